//! The transfer operator between the camera's segments contracts, whatever the surfaces and the clusters.

use super::*;
use crate::transport::Estimator;
use crate::transport::cluster::Areas;
use crate::transport::testing::{ON, clustered, room, sampled};

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
            let solved = Reflected { segments: Segments::new(s, &weights), ..Reflected::default() };
            let [radius, peak] = solved.growth(s, &weights, 200, &ON);
            println!("{wall}, {camera_paths} and {light_paths} paths: radius {radius:.4}, peak {peak:.3}");
            assert!(radius < 1.0 && peak.is_finite(), "{wall}: {radius} {peak}");
        }
    }
}
