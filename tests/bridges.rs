//! Bridge segments beside the path tracer: they find the same light, whatever else is sampled.

mod common;

use common::{PATH, Stage, icosphere};
use glam::{DMat4, DVec3};
use segue::film::Pass;

const WALL: &str = r#"{"surface":{"type":"diffuse","color":[0.7,0.6,0.5]}}"#;
const RECT: &str = r#"{"type":"rect","width":0.6,"height":0.6,"radiance":[5,5,5],
    "transform":[1,0,0,0,0,1,0,0,0,0,1,1.9,0,0,0,1]}"#;
const POINT: &str =
    r#"{"type":"point","intensity":[0.5,0.5,0.5],"transform":[1,0,0,-0.5,0,1,0,-0.4,0,0,1,1.4,0,0,0,1]}"#;
/// Every pass is compared from four seeds.
const SEEDS: u32 = 4;

/// A corner of a room and a ball in it, seen through a lens of some width.
fn corner(ball: &str, wall: &str, lens: &str) -> Stage {
    let mut s = Stage::default();
    let wall = s.material(wall);
    s.corner(wall);
    let ball = s.material(ball);
    let (points, triangles) = icosphere(3);
    let mesh = s.mesh(&points, &triangles, Some(&points));
    let at = DMat4::from_translation(DVec3::new(0.2, 0.1, 0.5)) * DMat4::from_scale(DVec3::splat(0.45));
    s.place(mesh, ball, at);
    s.camera(DVec3::new(0.6, -3.0, 1.3), DVec3::new(0.0, 0.0, 0.8), 0.4, lens);
    s
}

fn bridges(size: f32, more: &str) -> String {
    format!(r#","integrator":"segment-bridge","kernel":"fixed","kernel_size":{size}{more}"#)
}

fn agree(s: &Stage, what: &str, pass: Pass, more: &str, limit: &str) {
    let reference = common::estimate(s, (24, 256, SEEDS), pass, &format!("{PATH}{limit}"));
    let got = common::estimate(s, (24, 64, SEEDS), pass, &bridges(0.5, &format!("{more}{limit}")));
    common::assert_agree(what, got, reference, (4.5, 7e-3));
}

#[test]
fn bridges_find_the_light_of_all_surfaces() {
    let layered =
        r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4,"coat":0.5}}"#;
    let frosted = r#"{"surface":{"type":"glass","ior":1.4,"roughness":0.5}}"#;
    let half = r#"{"surface":{"type":"diffuse","color":0.7},"opacity":0.5}"#;
    let by_power = r#","bridges":"power""#;
    let unlit = r#","next_event":false,"light_paths":4"#;
    for (ball, wall, more) in
        [(WALL, WALL, ""), (layered, WALL, unlit), (frosted, layered, by_power), (half, half, by_power)]
    {
        let mut s = corner(ball, wall, "");
        s.light(RECT);
        agree(&s, &format!("{ball} {wall} {more}"), Pass::Combined, more, "");
    }
}

#[test]
fn bridges_find_the_light_of_a_point_through_a_wide_lens() {
    let mut s = corner(WALL, WALL, r#","aperture_radius":0.1,"focus_distance":3"#);
    s.light(POINT);
    agree(&s, "wide lens", Pass::Combined, "", "");
}

#[test]
fn bounces_and_passes_are_counted_as_in_path_tracing() {
    let mut s = corner(r#"{"surface":{"type":"glass","ior":1.5}}"#, WALL, "");
    let lamp = s.material(r#"{"surface":{"type":"emission","strength":3}}"#);
    s.quad([[-0.7, -0.7, 1.95], [-0.7, 0.7, 1.95], [0.7, 0.7, 1.95], [0.7, -0.7, 1.95]], lamp);
    for depth in [1, 2] {
        let limit = format!(r#","max_depth":{depth}"#);
        agree(&s, &format!("at most {depth} bounces"), Pass::Combined, "", &limit);
    }
    for pass in [Pass::Direct, Pass::Indirect] {
        agree(&s, pass.name(), pass, "", "");
    }
}
