//! What the unit tests share.

use super::camera::{CameraSampler, Primary};
use super::cluster::{Areas, Clusters, Numbered};
use super::grid::Grid;
use super::light::LightSampler;
use super::sparse::Bits;
use super::store::{Arrival, Arrivals, CameraStore, LightStore};
use super::{Cut, Estimator};
use crate::film::Rect;
use crate::math::{Sampler, warp};
use crate::scene::mesh::MeshInput;
use crate::scene::{Camera, InstanceGroup, SceneBuilder};
use crate::shading::emitters::PLAIN;
use crate::shading::{Address, CameraRay, Sensor, SurfaceClass, World};
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// A camera at the origin that looks along -z.
pub const CAMERA: &str = r#"{"window":[-1,1,-1,1]}"#;

/// Never stopped.
pub const ON: Cut = Cut(&|| false);

/// Adds a mesh of one material where its points are.
pub fn place(b: &mut SceneBuilder, points: &[Vec3], faces: &[u32], material: &str) {
    let identity: [f64; 16] = std::array::from_fn(|k| f64::from(u8::from(k % 5 == 0)));
    let material = b.add_material("material", material).unwrap();
    let input = MeshInput { name: "mesh", points, face_indices: faces, ..Default::default() };
    let mesh = b.add_mesh(&input).unwrap();
    let group = InstanceGroup {
        name: "object".into(),
        mesh,
        materials: vec![material],
        camera_visible: true,
        two_sided_emission: true,
        object_index: 0,
    };
    b.add_instances(group, &[identity]).unwrap();
}

#[rustfmt::skip]
const CUBE: [u32; 36] =
    [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];

/// The corners of a box.
fn corners(low: Vec3, high: Vec3) -> Vec<Vec3> {
    let of = |k: u32| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32);
    (0..8).map(|k| low + of(k) * (high - low)).collect()
}

/// Adds a box of one material.
pub fn cuboid(b: &mut SceneBuilder, low: Vec3, high: Vec3, material: &str) {
    let outwards: Vec<u32> = CUBE.chunks(3).flat_map(|t| [t[0], t[2], t[1]]).collect();
    place(b, &corners(low, high), &outwards, material);
}

/// A closed room of one material, with a pane of glass across it.
pub fn room(wall: &str) -> World {
    let mut b = SceneBuilder::default();
    place(&mut b, &corners(Vec3::NEG_ONE, Vec3::ONE), &CUBE, wall);
    let half = Vec3::new(0.8, 0.8, 0.05);
    cuboid(&mut b, -half, half, r#"{"surface":{"type":"glass","ior":1.5}}"#);
    b.set_camera("camera", CAMERA).unwrap();
    World::new(Arc::new(b.build().unwrap()), false).unwrap()
}

/// The room's camera.
pub fn sensor() -> Sensor {
    Sensor::new(&Camera::from_json("camera", CAMERA).unwrap(), 40, 40)
}

/// What every pixel sees of a wall, in rows of `side`, with the camera: orthographic and a unit to the pixel. `depth(x, y)` is where
/// the wall stands, if it is there.
pub fn wall(side: u32, depth: impl Fn(u32, u32) -> Option<f32>) -> (Sensor, Vec<Primary>, Arrivals) {
    let camera = format!(r#"{{"type":"orthographic","window":[0,{side},-{side},0]}}"#);
    let sensor = Sensor::new(&Camera::from_json("camera", &camera).unwrap(), side, side);
    let (mut primaries, mut arrivals) = (Vec::new(), Arrivals::default());
    for (x, y) in Rect::new(0, 0, side, side).pixels() {
        let ray = sensor.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::ZERO);
        let arrival = depth(x, y).map(|depth| {
            arrivals.push(Arrival {
                position: ray.origin + ray.direction * depth,
                normal: -ray.direction,
                wo: -ray.direction,
                at: Address { instance: 0, triangle: 0, barycentrics: Vec2::ZERO },
                reflectance: Vec3::ONE,
                back_pdf: 1.0,
                survival: 1.0,
                class: SurfaceClass::Diffuse,
                goes_on: false,
            });
            arrivals.len() as u32 - 1
        });
        primaries.push(Primary { arrival, albedo: 1.0, ..Primary::NOTHING });
    }
    (sensor, primaries, arrivals)
}

/// Paths of both sides in such a room.
pub fn sampled(world: &World, seed: u32, camera_paths: u32, light_paths: u32) -> (CameraStore, LightStore) {
    let (mut camera, mut light) = (CameraStore::default(), LightStore::default());
    let sensor = sensor();
    let sampler = CameraSampler {
        world,
        sensor: &sensor,
        guide: &PLAIN,
        light_paths: light_paths as f32,
        transparent_background: false,
        max_depth: None,
        next_event: true,
        goes_on: true,
    };
    for k in 0..camera_paths {
        let mut random = Sampler::new(seed, k, 0);
        let direction = warp::uniform_sphere(random.next_2d());
        let ray = CameraRay { origin: Vec3::new(0.1, 0.2, 0.5), direction, range: [0.0, f32::INFINITY] };
        sampler.path(&ray, &mut random, &mut camera, &mut 0);
    }
    let estimator = Estimator::LeaveOneOut;
    let sampler =
        LightSampler { world, guide: &PLAIN, paths: light_paths as f32, next_event: true, estimator };
    (0..light_paths).for_each(|k| sampler.path(k, &mut Sampler::new(!seed, k, 0), &mut light, &mut 0));
    (camera, light)
}

/// Clusters of these arrivals in that room.
pub fn clustered(world: &World, camera: &CameraStore, light: &LightStore, areas: Areas) -> Clusters {
    let sensor = sensor();
    let grid = Grid::new(&sensor, 4.0, 3);
    let all = Numbered { camera: &camera.arrivals, light: &light.arrivals, ends: &Bits::default() };
    let mut clusters = Clusters::default();
    assert!(clusters.group(world, &grid, all, &ON) && clusters.measure(world, &grid, all, areas, &ON));
    clusters
}
