//! Segment transport beside the path tracer: every set of techniques finds the same light.

mod common;

use common::{PATH, POINT, RECT, Stage, WALL, corner_with_ball};
use glam::DVec3;
use segue::film::{Hints, Pass};

/// The mean of a pass and its standard error, from 4 seeds.
fn estimate(s: &Stage, side: u32, samples: u32, pass: Pass, settings: &str) -> (f64, f64) {
    common::estimate(s, (side, samples, 4), pass, settings)
}

/// Agreement but for `slack` (relative) that a kernel of finite size may leave.
fn assert_agree(what: &str, a: (f64, f64), b: (f64, f64), slack: f64) {
    common::assert_agree(what, a, b, (4.5, slack));
}

fn segment(more: &str) -> String {
    format!(r#","integrator":"segment","kernel":"fixed","kernel_size":0.5{more}"#)
}

const DOME: &str = r#"{"type":"dome","radiance":[0.2,0.3,0.4]}"#;
const DISTANT: &str = r#"{"type":"distant","irradiance":[1,1,1],"angle":3,
    "transform":[1,0,0,0,0,0.6,-0.8,0,0,0.8,0.6,0,0,0,0,1]}"#;

/// What finds the light of a rough scene by itself.
const SETS: [(&str, &str); 6] = [
    ("all", ""),
    ("camera and next event", r#","light_paths":0"#),
    ("camera alone", r#","light_paths":0,"next_event":false"#),
    ("both without next event", r#","next_event":false"#),
    ("light alone", r#","camera_paths":false,"next_event":false,"light_paths":4"#),
    ("light and next event", r#","camera_paths":false,"light_paths":1"#),
];

#[test]
fn every_set_of_techniques_finds_the_light_of_a_diffuse_room() {
    let mut s = corner_with_ball(WALL, WALL, "");
    s.light(RECT);
    s.light(DOME);
    let reference = estimate(&s, 32, 256, Pass::Combined, PATH);
    for (name, set) in SETS {
        assert_agree(name, estimate(&s, 32, 96, Pass::Combined, &segment(set)), reference, 5e-3);
    }
}

/// Re-gathering light segments, or counting the photon that is gathered among those that could have been, is off by
/// several percent here: photons are few in every cluster.
#[test]
fn photons_do_not_count_themselves() {
    let mut s = corner_with_ball(WALL, WALL, "");
    s.light(RECT);
    let reference = estimate(&s, 32, 256, Pass::Indirect, PATH);
    for size in [1.0, 0.3] {
        let set = format!(
            r#","integrator":"segment","next_event":false,"kernel":"fixed","kernel_size":{size},"light_paths":1"#
        );
        let name = format!("kernel of {size} pixels");
        assert_agree(&name, estimate(&s, 32, 192, Pass::Indirect, &set), reference, 5e-3);
    }
}

/// The recursion as written is too bright where photons are few, the more so the smaller the kernel; without light
/// paths both estimators are the same, and with many photons in every cluster they meet.
#[test]
fn the_literal_recursion_has_the_bias_that_leaving_one_out_removes() {
    let mut s = corner_with_ball(
        WALL,
        r#"{"surface":{"type":"principled","base_color":[0.7,0.6,0.5],"roughness":0.5}}"#,
        "",
    );
    s.light(RECT);
    let reference = estimate(&s, 32, 256, Pass::Indirect, PATH);
    let render = |size: f32, samples: u32, more: &str| {
        let set = format!(
            r#","integrator":"segment","next_event":false,"kernel":"fixed","kernel_size":{size}{more}"#
        );
        estimate(&s, 32, samples, Pass::Indirect, &set)
    };
    let fixed = |size: f32, more: &str| render(size, 64, more);
    let mut biases = Vec::new();
    for size in [2.0, 1.0, 0.3] {
        let own = fixed(size, r#","light_paths":1"#);
        let literal = fixed(size, r#","light_paths":1,"estimator":"literal""#);
        println!(
            "kernel of {size} pixels: leaving one out {:+.2} %, literal {:+.2} %",
            100.0 * (own.0 / reference.0 - 1.0),
            100.0 * (literal.0 / reference.0 - 1.0)
        );
        assert_agree(&format!("leaving one out, {size} pixels"), own, reference, 1e-2);
        biases.push(literal.0 / reference.0 - 1.0);
    }
    assert!(biases[0] < biases[1] && biases[1] < biases[2], "{biases:?}");
    assert!(biases[2] > 0.03, "{biases:?}");
    let many = render(16.0, 16, r#","light_paths":4"#);
    let many_literal = render(16.0, 16, r#","light_paths":4,"estimator":"literal""#);
    assert_agree("many photons", many_literal, many, 1e-2);
    let none = r#","light_paths":0,"max_depth":3"#;
    let literal = format!(r#"{none},"estimator":"literal""#);
    // but for paths that return to a cluster, of which there are few where the kernel is small
    for (size, allowed) in [(1.0, 1e-3), (0.02, 1e-5)] {
        let alike = (render(size, 16, none).0, render(size, 16, &literal).0);
        assert!((alike.0 / alike.1 - 1.0).abs() < allowed, "{size}: {alike:?}");
    }
}

#[test]
fn glossy_and_layered_surfaces_agree() {
    let layered =
        r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4,"coat":0.5}}"#;
    let glossy = r#"{"surface":{"type":"glossy","color":0.8,"roughness":0.35}}"#;
    let frosted = r#"{"surface":{"type":"glass","ior":1.4,"roughness":0.5}}"#;
    let sheet = r#"{"surface":{"type":"add","a":{"type":"diffuse","color":0.4},
        "b":{"type":"translucent","color":0.4}}}"#;
    for (ball, wall) in [(layered, WALL), (glossy, layered), (frosted, WALL), (sheet, glossy)] {
        let mut s = corner_with_ball(ball, wall, "");
        s.light(RECT);
        s.light(DOME);
        let reference = estimate(&s, 24, 256, Pass::Combined, PATH);
        for (name, set) in &SETS[..4] {
            let got = estimate(&s, 24, 96, Pass::Combined, &segment(set));
            assert_agree(&format!("{name}, {ball}, {wall}"), got, reference, 5e-3);
        }
    }
}

/// A surface that transmits shares its clusters between both sides, and with them the lights that only the other
/// side can use: losing those would be a bias that grows with the kernel.
#[test]
fn transmitting_surfaces_keep_their_light_under_large_kernels() {
    let mut s = corner_with_ball(r#"{"surface":{"type":"translucent","color":0.8}}"#, WALL, "");
    s.light(RECT);
    let reference = estimate(&s, 48, 128, Pass::Combined, PATH);
    for (name, set) in &SETS[..2] {
        let settings = format!(r#","integrator":"segment","kernel":"fixed","kernel_size":3{set}"#);
        assert_agree(name, estimate(&s, 48, 48, Pass::Combined, &settings), reference, 5e-3);
    }
}

#[test]
fn delta_lights_and_the_sun_agree() {
    for light in [POINT, DISTANT, &DISTANT.replace(r#""angle":3"#, r#""angle":0"#)] {
        let mut s = corner_with_ball(WALL, WALL, "");
        s.light(light);
        let reference = estimate(&s, 32, 256, Pass::Combined, PATH);
        for (name, set) in [SETS[0], SETS[1], SETS[4], SETS[5]] {
            // camera paths do not find what has no size
            let got = estimate(&s, 32, 96, Pass::Combined, &segment(set));
            assert_agree(&format!("{name}, {light}"), got, reference, 7e-3);
        }
    }
}

#[test]
fn half_transparent_surfaces_catch_as_much_of_a_photon_as_of_other_light() {
    let half = r#"{"surface":{"type":"diffuse","color":0.7},"opacity":0.5}"#;
    let mut s = corner_with_ball(half, half, "");
    s.light(RECT);
    let reference = estimate(&s, 32, 256, Pass::Combined, PATH);
    for (name, set) in [SETS[0], SETS[1], SETS[4], SETS[5]] {
        assert_agree(name, estimate(&s, 32, 96, Pass::Combined, &segment(set)), reference, 7e-3);
    }
}

/// Light through mirrors and glass, by the number of bounces: a large lamp, so that the path tracer finds it too.
#[test]
fn bounces_are_counted_as_in_path_tracing() {
    let glass = r#"{"surface":{"type":"glass","ior":1.5}}"#;
    let mut s = corner_with_ball(glass, WALL, "");
    let lamp = s.material(r#"{"surface":{"type":"emission","strength":3}}"#);
    s.quad([[-0.7, -0.7, 1.95], [-0.7, 0.7, 1.95], [0.7, 0.7, 1.95], [0.7, -0.7, 1.95]], lamp);
    for depth in [0, 1, 2, 3, 5] {
        let limit = format!(r#","max_depth":{depth}"#);
        let reference = estimate(&s, 32, 192, Pass::Combined, &format!("{PATH}{limit}"));
        let got = estimate(&s, 32, 96, Pass::Combined, &segment(&limit));
        assert_agree(&format!("at most {depth} bounces"), got, reference, 5e-3);
    }
}

#[test]
fn passes_split_the_light_as_path_tracing_does() {
    let glass = r#"{"surface":{"type":"glass","ior":1.5}}"#;
    let mut s = corner_with_ball(glass, WALL, "");
    s.light(DOME);
    let lamp = s.material(r#"{"surface":{"type":"emission","strength":3}}"#);
    s.quad([[-0.7, -0.7, 1.95], [-0.7, 0.7, 1.95], [0.7, 0.7, 1.95], [0.7, -0.7, 1.95]], lamp);
    for pass in [Pass::Emission, Pass::Direct, Pass::Indirect] {
        let reference = estimate(&s, 32, 192, pass, PATH);
        let got = estimate(&s, 32, 96, pass, &segment(""));
        assert_agree(pass.name(), got, reference, 1e-2);
    }
}

/// A crack with a lamp on its ground, of which the camera sees the rim alone: what a kernel of four pixels has of its walls
/// is brighter than that the farther down it is.
#[test]
fn a_kernel_does_not_reach_into_a_crack_beyond_what_is_seen() {
    let mut s = Stage::default();
    let wall = s.material(r#"{"surface":{"type":"diffuse","color":[0.5,0.5,0.5]}}"#);
    let (far, gap, deep) = (1.0, 0.02, -0.5);
    s.quad([[-far, -far, 0.], [0., -far, 0.], [0., far, 0.], [-far, far, 0.]], wall);
    s.quad([[gap, -far, 0.], [far, -far, 0.], [far, far, 0.], [gap, far, 0.]], wall);
    s.quad([[0., -far, deep], [0., far, deep], [0., far, 0.], [0., -far, 0.]], wall);
    s.quad([[gap, far, deep], [gap, -far, deep], [gap, -far, 0.], [gap, far, 0.]], wall);
    s.light(&format!(
        r#"{{"type":"rect","width":{gap},"height":{},"radiance":[5,5,5],
        "transform":[-1,0,0,{},0,1,0,0,0,0,-1,{deep},0,0,0,1]}}"#,
        2.0 * far,
        0.5 * gap
    ));
    s.camera(DVec3::new(-2.0, 0.0, 2.0), DVec3::ZERO, 0.2, "");
    let reference = estimate(&s, 32, 512, Pass::Combined, PATH);
    let set =
        r#","integrator":"segment","next_event":false,"light_paths":24,"kernel":"fixed","kernel_size":4"#;
    assert_agree("crack", estimate(&s, 32, 96, Pass::Combined, set), reference, 0.05);
}

/// What each path finds by itself is right on average, so beside it a large kernel is seen to blur and a small one is
/// not: whatever were wrong with the unfiltered estimate would be told as a systematic error.
#[test]
fn the_systematic_error_of_large_kernels_is_told() {
    let frosted = r#"{"surface":{"type":"glass","ior":1.4,"roughness":0.5}}"#;
    let clear = r#"{"surface":{"type":"glass","ior":1.4}}"#;
    let layered =
        r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4,"coat":0.5}}"#;
    for (ball, wall) in [(WALL, WALL), (frosted, layered), (clear, WALL)] {
        let mut s = corner_with_ball(ball, wall, "");
        s.light(RECT);
        s.light(DOME);
        for more in ["", r#","next_event":false"#, r#","max_depth":2"#] {
            let bias = |size: f32| {
                let set = format!(r#","integrator":"segment","kernel":"fixed","kernel_size":{size}{more}"#);
                s.render(48, 32, &set).film().estimated_error(Hints::default()).unwrap().bias.unwrap()
            };
            let (fine, coarse) = (bias(0.1), bias(24.0));
            println!("{ball} {wall} {more}: {fine:.6} at 0.1 pixels, {coarse:.6} at 24");
            assert!(fine < 2e-4 && coarse > 5e-4, "{ball}, {wall}{more}: {fine}, {coarse}");
        }
    }
    let mut s = corner_with_ball(WALL, WALL, "");
    s.light(RECT);
    assert_eq!(s.render(16, 4, PATH).film().estimated_error(Hints::default()).and_then(|e| e.bias), None);
}

/// Whole paths and the recursion are two estimators of the same light, with other weights. Their samples are the same, so
/// they differ by less than from the path tracer.
fn assert_whole_paths_agree(what: &str, ball: &str, wall: &str, light: &str, sizes: &[f32], set: &str) {
    let mut s = corner_with_ball(ball, wall, "");
    s.light(light);
    let estimate = |samples, settings: &str| common::estimate(&s, (24, samples, 8), Pass::Combined, settings);
    let reference = estimate(192, PATH);
    for size in sizes {
        let render = |method: &str| {
            estimate(32, &format!(r#","integrator":"{method}","kernel":"fixed","kernel_size":{size}{set}"#))
        };
        let whole = render("segment-path");
        assert_agree(&format!("{what}, {size} pixels, path"), whole, reference, 3e-3);
        assert_agree(&format!("{what}, {size} pixels, segment"), whole, render("segment"), 3e-3);
    }
}

#[test]
fn whole_paths_find_the_light_of_diffuse_rooms() {
    assert_whole_paths_agree("diffuse", WALL, WALL, RECT, &[0.5, 2.0], "");
    assert_whole_paths_agree("diffuse, no next event", WALL, WALL, RECT, &[2.0], SETS[3].1);
}

const LAYERED: &str =
    r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4,"coat":0.5}}"#;
const GLOSSY: &str = r#"{"surface":{"type":"glossy","color":0.8,"roughness":0.35}}"#;

#[test]
fn whole_paths_find_the_light_of_glossy_rooms() {
    assert_whole_paths_agree("glossy", GLOSSY, LAYERED, RECT, &[2.0], "");
}

#[test]
fn whole_paths_find_the_light_of_glossy_rooms_without_next_event() {
    assert_whole_paths_agree("glossy, no next event", GLOSSY, LAYERED, RECT, &[0.5, 2.0], SETS[3].1);
}

#[test]
fn whole_paths_find_light_through_glass_and_of_points() {
    let glass = r#"{"surface":{"type":"glass","ior":1.5}}"#;
    assert_whole_paths_agree("glass", glass, WALL, RECT, &[0.5, 2.0], "");
    assert_whole_paths_agree("point, light paths alone", WALL, WALL, POINT, &[2.0], SETS[4].1);
}

#[test]
fn whole_paths_count_bounces_as_path_tracing_does() {
    let glass = r#"{"surface":{"type":"glass","ior":1.5}}"#;
    let mut s = corner_with_ball(glass, WALL, "");
    let lamp = s.material(r#"{"surface":{"type":"emission","strength":3}}"#);
    s.quad([[-0.7, -0.7, 1.95], [-0.7, 0.7, 1.95], [0.7, 0.7, 1.95], [0.7, -0.7, 1.95]], lamp);
    let whole = r#","integrator":"segment-path","kernel":"fixed","kernel_size":0.5"#;
    for depth in [0, 1, 2, 3] {
        let limit = format!(r#","max_depth":{depth}"#);
        let reference = estimate(&s, 24, 192, Pass::Combined, &format!("{PATH}{limit}"));
        let got = estimate(&s, 24, 48, Pass::Combined, &format!("{whole}{limit}"));
        assert_agree(&format!("at most {depth} bounces"), got, reference, 3e-3);
    }
    for pass in [Pass::Direct, Pass::Indirect] {
        let reference = estimate(&s, 24, 192, pass, PATH);
        assert_agree(pass.name(), estimate(&s, 24, 48, pass, whole), reference, 5e-3);
    }
}
