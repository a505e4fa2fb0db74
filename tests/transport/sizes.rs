//! Clusters of one arrival and of a million.

use crate::common::{Stage, assert_close, mean};
use glam::{DMat4, DVec3, Vec3};
use segue::film::Pass;
use segue::transport::report::Report;

/// A closed cube whose walls emit and reflect: everywhere `L = L_e / (1 - albedo)`.
fn furnace(surface: &str) -> Stage {
    let mut s = Stage::default();
    let wall = s.material(surface);
    let p: Vec<Vec3> =
        (0..8).map(|k| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32)).collect();
    #[rustfmt::skip]
    let faces = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3];
    let mesh = s.mesh(&p, &faces, None);
    s.place(mesh, wall, DMat4::IDENTITY);
    s.camera(DVec3::new(0.5, 0.2, 0.5), DVec3::new(0.5, 1.0, 0.5), 0.5, "");
    s
}

const DIFFUSE: &str = r#"{"surface":{"type":"add","a":{"type":"diffuse","color":0.5},
    "b":{"type":"emission","strength":1}}}"#;
const GLOSSY: &str = r#"{"surface":{"type":"add","a":{"type":"mix","factor":0.5,"a":{"type":"diffuse","color":0},
    "b":{"type":"glossy","color":1,"roughness":0.6}},"b":{"type":"emission","strength":1}}}"#;

/// Renders and tells of the graph.
fn render(s: &Stage, side: u32, samples: u32, settings: &str) -> (f64, Report) {
    let session = s.render(side, samples, settings);
    let graph = session.statistics().graph.unwrap();
    println!("{graph:?}");
    (mean(&session, Pass::Combined), graph)
}

#[test]
fn a_million_arrivals_share_a_few_clusters() {
    let s = furnace(DIFFUSE);
    let (mean, graph) =
        render(&s, 1000, 1, r#","kernel":"fixed","kernel_size":1000,"light_paths":0,"memory_budget":8192"#);
    assert!(graph.largest >= 1_000_000, "{graph:?}");
    assert_close("a million", mean, 2.0, 1.5e-3);
}

#[test]
fn every_arrival_is_a_cluster_of_its_own() {
    for surface in [DIFFUSE, GLOSSY] {
        let s = furnace(surface);
        let (mean, graph) = render(&s, 128, 4, r#","kernel":"fixed","kernel_size":0.001"#);
        let total: u64 = graph.sizes.iter().sum();
        assert!(graph.sizes[0] as f64 > 0.99 * total as f64, "{graph:?}");
        assert_close(surface, mean, 2.0, 0.01);
    }
}

#[test]
fn large_clusters_of_glossy_lobes_are_divided() {
    let s = furnace(GLOSSY);
    let (mean, graph) = render(&s, 256, 1, r#","kernel":"fixed","kernel_size":24,"light_paths":2"#);
    assert!(graph.largest < 128, "{graph:?}");
    assert_close("divided at random", mean, 2.0, 0.01);
}
