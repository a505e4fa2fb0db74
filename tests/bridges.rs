//! Bridge segments beside the path tracer: they find the same light, whatever else is sampled.

mod common;

use common::{PATH, POINT, RECT, Stage, WALL, corner_with_ball};
use segue::film::Pass;

/// Every pass is compared from four seeds.
const SEEDS: u32 = 4;

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
        let mut s = corner_with_ball(ball, wall, "");
        s.light(RECT);
        agree(&s, &format!("{ball} {wall} {more}"), Pass::Combined, more, "");
    }
}

#[test]
fn bridges_find_the_light_of_a_point_through_a_wide_lens() {
    let mut s = corner_with_ball(WALL, WALL, r#","aperture_radius":0.1,"focus_distance":3"#);
    s.light(POINT);
    agree(&s, "wide lens", Pass::Combined, "", "");
}

#[test]
fn bounces_and_passes_are_counted_as_in_path_tracing() {
    let mut s = corner_with_ball(r#"{"surface":{"type":"glass","ior":1.5}}"#, WALL, "");
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
