//! The densities by which segments are weighed.

use crate::common::{Stage, mean_and_error};
use crate::support::{ON, follow, ray, sensor, world};
use glam::{DMat4, Vec3};
use segue::math::{Sampler, warp};
use segue::shading::bsdf::Walk;
use segue::shading::{Piece, World};
use segue::transport::Estimator;
use segue::transport::arrival::arrival;
use segue::transport::cluster::{Areas, Clusters, Numbered};
use segue::transport::grid::Grid;
use segue::transport::sparse::Bits;
use segue::transport::store::{Arrival, CameraStore, LightStore, NextEvent, Outgoing, Photon, Rivals};
use segue::transport::walk::End;
use segue::transport::weigh::{Sampled, Weights};
use std::f64::consts::PI;

const MATERIALS: [&str; 3] = [
    r#"{"surface":{"type":"diffuse","color":0.7}}"#,
    r#"{"surface":{"type":"glossy","color":0.8,"roughness":0.5}}"#,
    r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4}}"#,
];

/// Two unit squares that face each other at a distance of one.
fn plates(material: &str) -> World {
    let mut s = Stage::default();
    let material = s.material(material);
    for (z, triangles) in [(0.0, [0, 1, 2, 0, 2, 3]), (1.0, [0, 2, 1, 0, 3, 2])] {
        let corners = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)].map(|(x, y)| Vec3::new(x, y, z));
        let mesh = s.mesh(&corners, &triangles, None);
        s.place(mesh, material, DMat4::IDENTITY);
    }
    world(&mut s)
}

/// A uniform point of a plate, arrived at from a direction drawn about its normal.
fn on_plate(world: &World, upper: bool, sampler: &mut Sampler) -> (Arrival, End) {
    // one that falls beside it by rounding is drawn again
    loop {
        let (place, d) = (sampler.next_2d(), warp::cosine_hemisphere(sampler.next_2d()));
        let (z, wo) = if upper { (1.0, Vec3::new(d.x, d.y, -d.z)) } else { (0.0, d) };
        let origin = place.extend(z) + wo * 0.3;
        if let Some(end) = follow(world, ray(origin, -wo), Walk::Camera, &mut Sampler::new(0, 0, 0)).1 {
            return (arrival(world, &end, end.sight().as_ref()), end);
        }
    }
}

/// The direction in which an arrival's path goes on, and its density.
fn go_on(a: &mut Arrival, end: &End, walk: Walk, sampler: &mut Sampler) -> Option<(Vec3, f32)> {
    let u = sampler.next_3d();
    let goes_on = sampler.next_1d() < a.survival;
    let sample = if goes_on { end.vertex.bsdf.sample_continuous(end.wo, walk, u) } else { None }?;
    a.goes_on = true;
    Some((sample.direction, sample.pdf.value()))
}

/// The étendue between the plates, measured by segments from both: each counts one over the densities of all
/// techniques.
fn measured_etendue(world: &World, seed: u32, paths: u32, footprint: f32) -> f64 {
    let (mut camera, mut light) = (CameraStore::default(), LightStore::default());
    let push = |store: &mut CameraStore, a: Arrival, out: Outgoing| {
        store.push(a, NextEvent::default(), out);
    };
    for k in 0..paths {
        let mut sampler = Sampler::new(seed, 1, k);
        let (mut a, end) = on_plate(world, false, &mut sampler);
        let mut out = Outgoing::default();
        let mut next = None;
        if let Some((direction, pdf)) = go_on(&mut a, &end, Walk::Camera, &mut sampler) {
            next = follow(world, Piece::leaving(&end.hit, direction), Walk::Camera, &mut sampler).1;
            let forward = if next.is_some() { 1.0 } else { 0.0 };
            out = Outgoing {
                direction,
                pdf,
                throughput: Vec3::ONE,
                forward,
                reverse: 1.0,
                squeeze: 1.0,
                passages: 0,
            };
        }
        push(&mut camera, a, out);
        if let Some(e) = next {
            push(&mut camera, arrival(world, &e, e.sight().as_ref()), Outgoing::default());
        }
        let mut sampler = Sampler::new(seed, 2, k);
        let (mut a, end) = on_plate(world, true, &mut sampler);
        let going = go_on(&mut a, &end, Walk::Light, &mut sampler);
        let (direction, pdf) = going.unwrap_or_default();
        let rivals = Rivals::First { light_density: 1.0, next_event_pdf: 0.0, is_delta: false };
        let photon =
            Photon { path: k, flux: Vec3::ONE, bounces: 0, rivals, camera_choices: 1.0, direction, pdf };
        light.arrivals.push(a);
        light.photons.push(photon);
        let next = going
            .and_then(|_| follow(world, Piece::leaving(&end.hit, direction), Walk::Light, &mut sampler).1);
        if let Some(e) = next {
            light.arrivals.push(arrival(world, &e, e.sight().as_ref()));
            let rivals = Rivals::Later { light_choices: 1.0, squeeze: 1.0 };
            light.photons.push(Photon { bounces: 1, rivals, ..photon });
        }
    }
    light.carries.resize(light.photons.len(), Vec3::ONE);
    let sensor = sensor(footprint);
    let grid = Grid::new(&sensor, 1.0, seed);
    let all = Numbered { camera: &camera.arrivals, light: &light.arrivals, ends: &Bits::default() };
    let (mut clusters, mut weights) = (Clusters::default(), Weights::default());
    assert!(clusters.group(world, &grid, all, &ON) && clusters.measure(world, &grid, all, Areas::True, &ON));
    let s = Sampled { world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
    assert!(weights.weigh(s, Estimator::LeaveOneOut, &ON));
    let n = camera.arrivals.len();
    let density = |camera: usize, light: usize| {
        f64::from(weights.densities[camera].camera) + f64::from(weights.densities[light].light)
    };
    let has_end = |&i: &usize| camera.outgoing.get(i).forward > 0.0;
    let from_camera = (0..n).filter(has_end).map(|i| 1.0 / density(i, i + 1));
    let later = |j: &usize| matches!(light.photons.get(*j).rivals, Rivals::Later { .. });
    let from_light = (0..light.photons.len()).filter(later).map(|j| {
        // what the engine leaves out of a light arrival's density is its own part
        let own = light.arrivals.get(j - 1).survival * light.photons.get(j - 1).pdf;
        1.0 / (density(n + j, n + j - 1) + f64::from(own / s.cluster_of(n + j - 1).area))
    });
    from_camera.sum::<f64>() + from_light.sum::<f64>()
}

#[test]
fn segments_of_all_techniques_measure_the_etendue_between_two_plates() {
    // the form factor of opposite unit squares at unit distance, times pi times the area
    let form_factor = 2.0 / PI
        * ((4.0f64 / 3.0).sqrt().ln() + 2.0 * 2f64.sqrt() * (1.0 / 2f64.sqrt()).atan() - 2.0 * 1f64.atan());
    let exact = PI * form_factor;
    for material in MATERIALS {
        let world = plates(material);
        for (footprint, paths) in [(0.2, 4000), (0.05, 20_000)] {
            let values: Vec<f64> =
                (0..24).map(|seed| measured_etendue(&world, seed, paths, footprint)).collect();
            let (m, sigma) = mean_and_error(&values);
            println!("{material}, voxels of {footprint}: {m:.5} +- {sigma:.5}, exact {exact:.5}");
            assert!(
                (m - exact).abs() < 4.0 * sigma + 1e-3 * exact,
                "{material}: {m} +- {sigma}, exact {exact}"
            );
            assert!(sigma < 0.01 * exact, "too noisy: {sigma}");
        }
    }
}

/// Light arrivals in uniform directions read the density of the camera's techniques; over the hemisphere it
/// integrates to the number of segments that the cluster's arrivals send on average.
#[test]
fn densities_integrate_to_the_number_of_paths_that_go_on() {
    for material in MATERIALS {
        let world = plates(material);
        let ratio = |seed: u32| {
            let (mut camera, mut light) = (CameraStore::default(), LightStore::default());
            let mut cosines = Vec::new();
            for k in 0..3000 {
                let mut sampler = Sampler::new(seed, 3, k);
                let a = on_plate(&world, false, &mut sampler).0;
                camera.push(a, NextEvent::default(), Outgoing::default());
                let mut probe = on_plate(&world, false, &mut sampler).0;
                let d = warp::uniform_sphere(sampler.next_2d());
                probe.wo = d.with_z(d.z.abs());
                cosines.push(probe.wo.z);
                light.arrivals.push(probe);
                let rivals = Rivals::First { light_density: 1.0, next_event_pdf: 0.0, is_delta: false };
                let flux = Vec3::ONE;
                light.photons.push(Photon {
                    path: k,
                    flux,
                    bounces: 0,
                    rivals,
                    camera_choices: 1.0,
                    direction: d,
                    pdf: 0.0,
                });
            }
            let sensor = sensor(0.15);
            let grid = Grid::new(&sensor, 1.0, seed);
            let all = Numbered { camera: &camera.arrivals, light: &light.arrivals, ends: &Bits::default() };
            let (mut clusters, mut weights) = (Clusters::default(), Weights::default());
            assert!(clusters.group(&world, &grid, all, &ON));
            assert!(clusters.measure(&world, &grid, all, Areas::True, &ON));
            let s =
                Sampled { world: &world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
            assert!(weights.weigh(s, Estimator::LeaveOneOut, &ON));
            let (mut integral, mut expected) = (0.0, 0.0);
            for c in clusters.clusters.iter().filter(|c| c.lights > 0) {
                let read = |j: usize| {
                    let i = camera.arrivals.len() + j;
                    f64::from(weights.densities[i].camera * c.area * cosines[j])
                };
                integral += 2.0 * PI * s.lights(c).map(read).sum::<f64>() / f64::from(c.lights);
                expected += s.cameras(c).map(|i| f64::from(camera.arrivals.get(i).survival)).sum::<f64>();
            }
            integral / expected
        };
        let (m, sigma) = mean_and_error(&(0..16).map(ratio).collect::<Vec<_>>());
        println!("{material}: {m:.4} +- {sigma:.4}");
        // a glossy lobe loses what it draws below the surface
        let slack = if material == MATERIALS[0] { 0.0 } else { 0.03 };
        assert!(m < 1.0 + 4.0 * sigma && m > 1.0 - slack - 4.0 * sigma, "{material}: {m} +- {sigma}");
    }
}
