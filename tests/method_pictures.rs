//! Draws the pictures of `docs/method.md` from the engine's own clusters and segments, as portable pixmaps in
//! `target/method`: `cargo test --release --test method_pictures -- --ignored`.

mod common;

use common::{Stage, icosphere};
use glam::{DMat4, DVec3, Vec2, Vec3};
use segue::math::Sampler;
use segue::math::sampler::hash_unit;
use segue::scene::Camera;
use segue::shading::emitters::PLAIN;
use segue::shading::{CameraRay, Sensor, World};
use segue::transport::camera::{CameraSampler, Primary};
use segue::transport::cluster::{Clusters, Numbered};
use segue::transport::grid::Grid;
use segue::transport::kernel::Kernel;
use segue::transport::light::LightSampler;
use segue::transport::outline::{clear_pixels, ends};
use segue::transport::store::{Arrivals, CameraStore, LightStore};
use segue::transport::{Cut, Estimator};
use std::fs;
use std::path::Path;
use std::sync::Arc;

const SIDE: u32 = 480;
/// Half of the window of the drawing's camera.
const WINDOW: f32 = 0.37;
const EYE: DVec3 = DVec3::new(0.9, -4.2, 1.7);
const TARGET: DVec3 = DVec3::new(-0.05, 0.0, 0.9);

struct Canvas(Vec<Vec3>);

impl Canvas {
    fn write(&self, name: &str) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/method");
        fs::create_dir_all(&folder).unwrap();
        let mut bytes = format!("P6 {SIDE} {SIDE} 255\n").into_bytes();
        bytes.extend(self.0.iter().flat_map(|c| c.to_array().map(|v| (v.clamp(0.0, 1.0) * 255.0) as u8)));
        fs::write(folder.join(name), bytes).unwrap();
    }

    /// A line between two points of the picture, in pixels.
    fn line(&mut self, a: Vec2, b: Vec2, color: Vec3) {
        let steps = (b - a).abs().max_element().ceil().max(1.0);
        for k in 0..=steps as u32 {
            let p = a.lerp(b, k as f32 / steps).floor();
            if p.min_element() >= 0.0 && p.max_element() < SIDE as f32 {
                let pixel = &mut self.0[(p.y as u32 * SIDE + p.x as u32) as usize];
                *pixel = pixel.lerp(color, 0.7);
            }
        }
    }
}

/// An open room with a ball, below a square light.
fn room() -> Stage {
    let mut s = Stage::default();
    let wall = s.material(r#"{"surface":{"type":"diffuse","color":[0.7,0.65,0.6]}}"#);
    let corner = |k: u32| {
        Vec3::new((k & 1) as f32 * 2.0 - 1.0, (k >> 1 & 1) as f32 * 2.0 - 1.0, (k >> 2) as f32 * 2.0)
    };
    let corners: Vec<Vec3> = (0..8).map(corner).collect();
    // without the front and the ceiling
    #[rustfmt::skip]
    let faces = [0, 1, 3, 0, 3, 2, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];
    let mesh = s.mesh(&corners, &faces, None);
    s.place(mesh, wall, DMat4::IDENTITY);
    let ball = s.material(r#"{"surface":{"type":"diffuse","color":[0.3,0.5,0.7]}}"#);
    let (points, triangles) = icosphere(4);
    let mesh = s.mesh(&points, &triangles, Some(&points));
    s.place(
        mesh,
        ball,
        DMat4::from_translation(DVec3::new(0.25, 0.1, 0.5)) * DMat4::from_scale(DVec3::splat(0.45)),
    );
    s.light(
        r#"{"type":"rect","width":0.7,"height":0.7,"radiance":[5,5,5],"transform":[1,0,0,0,0,1,0,0,0,0,1,1.9,0,0,0,1]}"#,
    );
    s.camera(EYE, TARGET, f64::from(WINDOW), "");
    s
}

fn sampler<'a>(world: &'a World, sensor: &'a Sensor) -> CameraSampler<'a> {
    CameraSampler {
        world,
        sensor,
        guide: &PLAIN,
        light_paths: 1.0,
        transparent_background: false,
        max_depth: None,
        next_event: true,
        goes_on: true,
    }
}

/// What every pixel of the drawing sees first.
fn seen(world: &World, sensor: &Sensor) -> (CameraStore, Vec<Primary>) {
    let mut store = CameraStore::default();
    let sampler = CameraSampler { goes_on: false, ..sampler(world, sensor) };
    let pixels = (0..SIDE * SIDE).map(|k| Vec2::new((k % SIDE) as f32 + 0.5, (k / SIDE) as f32 + 0.5));
    let primaries = pixels
        .map(|p| sampler.path(&sensor.ray(p, Vec2::ZERO), &mut Sampler::new(0, 0, 0), &mut store, &mut 0).0)
        .collect();
    (store, primaries)
}

/// Brightness by which a picture is read as a room.
fn shade(normal: Vec3) -> f32 {
    0.55 + 0.45 * normal.dot(Vec3::new(0.3, -0.6, 0.75).normalize())
}

#[test]
#[ignore = "draws pictures"]
fn cluster_maps() {
    let s = room();
    let world = World::new(Arc::new(s.0.build().unwrap()), false).unwrap();
    let sensor = Sensor::new(&world.scene().camera, SIDE, SIDE);
    let (store, primaries) = seen(&world, &sensor);
    let ends = ends(&primaries, &clear_pixels(SIDE, &sensor, &primaries, &store.arrivals));
    let cut = Cut(&|| false);
    for iteration in [0, 100] {
        // as a picture of a third of the size has them, for the eye
        let edge = 3.0 * Kernel::default().edge(iteration);
        let grid = Grid::new(&sensor, edge, iteration);
        let mut clusters = Clusters::default();
        assert!(clusters.group(
            &world,
            &grid,
            Numbered { camera: &store.arrivals, light: &Arrivals::default(), ends: &ends },
            &cut
        ));
        let color = |p: &Primary| match p.arrival {
            None => Vec3::ONE,
            Some(a) => {
                let id = clusters.of(a as usize) as u32;
                let tint = Vec3::new(hash_unit(id, 1), hash_unit(id, 2), hash_unit(id, 3));
                (Vec3::splat(0.35) + 0.65 * tint) * shade(store.arrivals.get(a as usize).normal)
            }
        };
        Canvas(primaries.iter().map(color).collect()).write(&format!("clusters_{}.ppm", iteration + 1));
    }
}

#[test]
#[ignore = "draws pictures"]
fn segment_graph() {
    let s = room();
    let world = World::new(Arc::new(s.0.build().unwrap()), false).unwrap();
    let sensor = Sensor::new(&world.scene().camera, SIDE, SIDE);
    let (store, primaries) = seen(&world, &sensor);
    let color = |p: &Primary| match p.arrival {
        None => Vec3::ONE,
        Some(a) => Vec3::splat(0.75 + 0.25 * shade(store.arrivals.get(a as usize).normal)),
    };
    let mut canvas = Canvas(primaries.iter().map(color).collect());
    let (z, up) = ((EYE - TARGET).normalize().as_vec3(), Vec3::Z);
    let x = up.cross(z).normalize();
    let y = z.cross(x);
    let project = |p: Vec3| {
        // scene space has its origin at the drawing's camera
        let v = Vec3::new(p.dot(x), p.dot(y), -p.dot(z));
        (Vec2::new(v.x, -v.y) / (v.z * WINDOW) * 0.5 + 0.5) * SIDE as f32
    };
    // a small camera in the room, of 7 by 7 pixels
    let eye = (DVec3::new(-0.5, -1.3, 1.0) - EYE).as_vec3();
    let towards = (DVec3::new(0.0, 0.4, 0.7) - EYE).as_vec3() - eye;
    let small = Sensor::new(&Camera::from_json("small", r#"{"window":[-1,1,-1,1]}"#).unwrap(), 7, 7);
    let (mut camera, mut light) = (CameraStore::default(), LightStore::default());
    for k in 0..49 {
        let across = Vec2::new((k % 7) as f32 - 3.0, (k / 7) as f32 - 3.0) * 0.11;
        let direction = (towards.normalize() + x * across.x + y * across.y).normalize();
        let ray = CameraRay { origin: eye, direction, range: [0.0, f32::INFINITY] };
        let first = camera.arrivals.len();
        sampler(&world, &small).path(&ray, &mut Sampler::new(7, k, 0), &mut camera, &mut 0);
        if first < camera.arrivals.len() {
            let seen = camera.arrivals.get(first).position;
            canvas.line(project(eye), project(seen), Vec3::new(0.45, 0.55, 0.85));
        }
    }
    let lights = LightSampler {
        world: &world,
        guide: &PLAIN,
        paths: 12.0,
        next_event: true,
        estimator: Estimator::LeaveOneOut,
    };
    (0..12).for_each(|k| lights.path(k, &mut Sampler::new(9, 0, k), &mut light, &mut 0));
    let lamp = (1.9 - EYE.z) as f32;
    for (i, a) in camera.arrivals.iter().enumerate() {
        if let Some(n) = camera.next_events.get(i).filter(|n| n.direction.z > 0.0) {
            let there = a.position + n.direction * ((lamp - a.position.z) / n.direction.z);
            canvas.line(project(a.position), project(there), Vec3::new(0.93, 0.8, 0.25));
        }
    }
    for i in (0..camera.outgoing.len()).filter(|&i| camera.outgoing.has_end(i)) {
        let [a, b] = [i, i + 1].map(|k| project(camera.arrivals.get(k).position));
        canvas.line(a, b, Vec3::new(0.1, 0.25, 0.75));
    }
    for (j, a) in light.arrivals.iter().enumerate() {
        let photon = light.photons.get(j);
        let from = match photon.bounces {
            // its first ray again
            0 => world.sample_emission(&PLAIN, &mut Sampler::new(9, 0, photon.path)).unwrap().origin(),
            _ => light.arrivals.get(j - 1).position,
        };
        canvas.line(project(from), project(a.position), Vec3::new(0.85, 0.3, 0.1));
    }
    canvas.write("segments.ppm");
}
