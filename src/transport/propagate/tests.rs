//! The transfer operator between the camera's segments contracts, whatever the surfaces and the clusters.

use super::*;
use crate::math::{Sampler, warp};
use crate::shading::emitters::PLAIN;
use crate::shading::{CameraRay, World};
use crate::transport::Estimator;
use crate::transport::camera::CameraSampler;
use crate::transport::cluster::Areas;
use crate::transport::light::LightSampler;
use crate::transport::store::{CameraStore, LightStore};
use crate::transport::testing::{ON, clustered, room, sensor};

/// Paths of both sides in a glowing room.
fn sampled(world: &World, seed: u32, camera_paths: u32, light_paths: u32) -> (CameraStore, LightStore) {
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

#[test]
fn no_surface_and_no_cluster_makes_the_sweeps_diverge() {
    let diffuse = |albedo: f32| format!(r#"{{"type":"diffuse","color":{albedo}}}"#);
    let glossy = |r: f32| format!(r#"{{"type":"glossy","color":0.95,"roughness":{r}}}"#);
    let frosted = r#"{"type":"glass","ior":1.5,"roughness":0.3}"#.to_string();
    let layered = r#"{"type":"principled","base_color":0.9,"roughness":0.2,"coat":1}"#.to_string();
    let walls = [diffuse(0.5), diffuse(0.98), glossy(0.03), glossy(0.1), glossy(0.5), frosted, layered];
    for (k, wall) in (0u32..).zip(walls) {
        let glowing =
            format!(r#"{{"surface":{{"type":"add","a":{{"type":"emission","strength":0.1}},"b":{wall}}}}}"#);
        let world = room(&glowing);
        // many and few arrivals in a cluster, with and without photons
        for (camera_paths, light_paths) in [(40, 0), (40, 400), (1500, 0), (1500, 100)] {
            let (camera, light) = sampled(&world, 17 + k, camera_paths, light_paths);
            let areas = if light_paths > 0 { Areas::OfPhotons } else { Areas::None };
            let clusters = clustered(&world, &camera, &light, areas);
            let mut weights = Weights::default();
            let s =
                Sampled { world: &world, camera: &camera, light: &light, clusters: &clusters, bridges: None };
            assert!(weights.weigh(s, Estimator::LeaveOneOut, &ON));
            let solved = Reflected { segments: segments(s, &weights), ..Reflected::default() };
            let [radius, peak] = solved.growth(s, &weights, 200, &ON);
            println!("{wall}, {camera_paths} and {light_paths} paths: radius {radius:.4}, peak {peak:.3}");
            assert!(radius < 1.0 && peak.is_finite(), "{wall}: {radius} {peak}");
        }
    }
}
