//! Light tracing, bidirectional path tracing, photon mapping and their union beside the path tracer.

mod common;

use common::{PATH, Stage, icosphere};
use glam::{DMat4, DVec3, Vec3};
use segue::film::Pass;

/// The mean of a pass and its standard error, from 8 seeds.
fn estimate(s: &Stage, side: u32, samples: u32, pass: Pass, settings: &str) -> (f64, f64) {
    common::estimate(s, (side, samples, 8), pass, settings)
}

/// Agreement but for `slack` (relative) that merging may leave.
fn assert_agree(what: &str, a: (f64, f64), b: (f64, f64), slack: f64) {
    common::assert_agree(what, a, b, (5.0, slack));
}

/// Methods, and the relative error that merging within a small fixed radius may leave.
type Methods<'a> = &'a [(&'a str, f64)];
const ALL: Methods = &[("light", 0.0), ("bdpt", 0.0), ("ppm", 5e-3), ("bpm", 5e-3), ("vcm", 5e-3)];
/// Those that find what is seen through mirrors and glass.
const COMPLETE: Methods = &[("bdpt", 0.0), ("ppm", 5e-3), ("bpm", 5e-3), ("vcm", 5e-3)];
/// Those with every way to begin at a light or at a lens; `bpm` has those of `ppm`.
const BEGINNINGS: Methods = &[("light", 0.0), ("bdpt", 0.0), ("ppm", 5e-3), ("vcm", 5e-3)];
/// Those that do not darken at edges, or hardly.
const SHARP: Methods = &[("light", 0.0), ("bdpt", 0.0), ("vcm", 5e-3)];

/// Renders by each of some methods and compares with path tracing; `more` goes to both.
fn compare(what: &str, s: &Stage, methods: Methods, size: (u32, u32), more: &str) {
    compare_pass(what, s, methods, size, Pass::Combined, more);
}

fn compare_pass(
    what: &str,
    s: &Stage,
    methods: Methods,
    (side, samples): (u32, u32),
    pass: Pass,
    more: &str,
) {
    let reference = estimate(s, side, 2 * samples, pass, &format!("{PATH}{more}"));
    for &(method, slack) in methods {
        // what has nothing but light paths needs more of them
        let paths = if ["bdpt", "vcm"].contains(&method) { 1 } else { 4 };
        let settings = format!(
            r#","integrator":"{method}","kernel":"fixed","kernel_size":1,"light_paths":{paths}{more}"#
        );
        let got = estimate(s, side, samples, pass, &settings);
        assert_agree(&format!("{method}, {what}"), got, reference, slack);
    }
}

/// A ball of facets, with smoothed normals or its own. Light that a smoothed facet sends below the horizon of its
/// shading normal is found from the camera alone.
fn ball(s: &mut Stage, material: &str, is_smooth: bool) {
    let (points, triangles) = icosphere(3);
    place_ball(s, material, &points, &triangles, is_smooth);
}

fn place_ball(s: &mut Stage, material: &str, points: &[Vec3], triangles: &[u32], is_smooth: bool) {
    let material = s.material(material);
    let mesh = s.mesh(points, triangles, is_smooth.then_some(points));
    let at = DMat4::from_translation(DVec3::new(0.2, 0.1, 0.5)) * DMat4::from_scale(DVec3::splat(0.45));
    s.place(mesh, material, at);
}

/// A corner of a room, open to the camera's side, and a ball in it.
fn corner(ball_material: &str, wall: &str, is_smooth: bool) -> Stage {
    let mut s = Stage::default();
    let wall = s.material(wall);
    s.corner(wall);
    ball(&mut s, ball_material, is_smooth);
    s.camera(DVec3::new(0.6, -3.0, 1.3), DVec3::new(0.0, 0.0, 0.8), 0.4, "");
    s
}

/// A ball over a floor that fills the picture: no edges, where photon mapping darkens.
fn yard(ball_material: &str, floor: &str) -> Stage {
    yard_with(&[], ball_material, floor)
}

fn yard_with(textures: &[&str], ball_material: &str, floor: &str) -> Stage {
    let mut s = Stage::default();
    for texture in textures {
        s.0.add_texture("texture", texture).unwrap();
    }
    let floor = s.material(floor);
    s.quad([[-1.5, -1.2, 0.], [1.5, -1.2, 0.], [1.5, 2.4, 0.], [-1.5, 2.4, 0.]], floor);
    ball(&mut s, ball_material, false);
    yard_camera(&mut s, 0.25, "");
    s
}

fn yard_camera(s: &mut Stage, half_window: f64, more: &str) {
    s.camera(DVec3::new(0.3, -2.2, 2.6), DVec3::new(0.0, 0.0, 0.3), half_window, more);
}

const WALL: &str = r#"{"surface":{"type":"diffuse","color":[0.7,0.6,0.5]}}"#;
const GLASS: &str = r#"{"surface":{"type":"glass","ior":1.5}}"#;
const LAYERED: &str = r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4,
    "coat":0.5,"coat_roughness":0.3}}"#;
const DOME: &str = r#"{"type":"dome","radiance":[0.2,0.3,0.4]}"#;

/// A light of this kind and these numbers, where a room has its ceiling.
fn at_ceiling(light: &str) -> String {
    format!(r#"{{{light},"transform":[1,0,0,0,0,1,0,-0.1,0,0,1,1.85,0,0,0,1]}}"#)
}

fn rect() -> String {
    at_ceiling(r#""type":"rect","width":0.6,"height":0.6,"radiance":[5,5,5]"#)
}

/// A large lamp, so that the path tracer finds it through glass.
fn lamp(s: &mut Stage) {
    let lamp = s.material(r#"{"surface":{"type":"emission","strength":3}}"#);
    s.quad([[-0.7, -0.7, 1.95], [-0.7, 0.7, 1.95], [0.7, 0.7, 1.95], [0.7, -0.7, 1.95]], lamp);
}

#[test]
fn a_diffuse_room_agrees() {
    let mut s = corner(WALL, WALL, false);
    s.light(&rect());
    s.light(DOME);
    compare("diffuse room", &s, SHARP, (32, 32), "");
    compare("wide filter", &s, SHARP, (32, 24), r#","filter":"blackman-harris""#);
    compare("crop", &s, &SHARP[..2], (48, 24), r#","crop":[10,8,30,34],"filter":"blackman-harris""#);
}

#[test]
fn glossy_and_layered_surfaces_agree() {
    let glossy = r#"{"surface":{"type":"glossy","color":0.8,"roughness":0.35}}"#;
    let frosted = r#"{"surface":{"type":"glass","ior":1.4,"roughness":0.5}}"#;
    let sheet = r#"{"surface":{"type":"add","a":{"type":"diffuse","color":0.4},
        "b":{"type":"translucent","color":0.4}}}"#;
    for (ball, wall) in [(LAYERED, WALL), (glossy, LAYERED), (frosted, WALL), (sheet, glossy)] {
        let mut s = corner(ball, wall, true);
        s.light(&rect());
        s.light(DOME);
        compare(&format!("{ball}, {wall}"), &s, &SHARP[1..], (24, 16), "");
        let mut s = yard(ball, wall);
        s.light(&rect());
        compare(&format!("yard, {ball}, {wall}"), &s, ALL, (24, 24), "");
    }
}

/// Paths choose between a continuous lobe and one that is none.
#[test]
fn surfaces_that_are_mirrors_in_part_agree() {
    let half = r#"{"surface":{"type":"mix","factor":0.4,"a":{"type":"diffuse","color":0.7},
        "b":{"type":"glossy","color":0.9,"roughness":0}}}"#;
    // the coat hides glass the more the flatter it is seen, which differs between outside and inside
    let coated = r#"{"surface":{"type":"principled","base_color":[0.9,0.7,0.5],"roughness":0,"transmission":0.8,
        "coat":1,"coat_roughness":0.4,"coat_ior":2,"coat_tint":[0.9,0.5,0.4]}}"#;
    for ball in [half, coated] {
        let mut s = yard(ball, half);
        lamp(&mut s);
        s.light(DOME);
        compare(ball, &s, COMPLETE, (24, 24), "");
    }
}

/// What mirrors bends its normals to where it is looked at from, which differs between the walks.
#[test]
fn coarse_smoothed_mirrors_agree() {
    let part = r#"{"surface":{"type":"principled","base_color":[0.8,0.3,0.2],"roughness":0.4,
        "coat":1,"coat_roughness":0}}"#;
    let mirror = r#"{"surface":{"type":"glossy","color":0.9,"roughness":0}}"#;
    const METHODS: Methods = &[("bdpt", 0.0), ("vcm", 5e-3), ("segment", 5e-3)];
    for material in [mirror, part, GLASS] {
        let mut s = Stage::default();
        let wall = s.material(WALL);
        s.corner(wall);
        let (points, triangles) = icosphere(1);
        place_ball(&mut s, material, &points, &triangles, true);
        s.camera(DVec3::new(0.6, -3.0, 1.3), DVec3::new(0.0, 0.0, 0.8), 0.4, "");
        lamp(&mut s);
        s.light(DOME);
        compare(material, &s, METHODS, (24, 48), "");
    }
    // floor beside a plate whose normals lean by 60 degrees: all of the lamp's light in it is by bent normals
    for lean in [1.0, -1.0] {
        let mut s = Stage::default();
        let (floor, plate) = (s.material(WALL), s.material(mirror));
        s.quad([[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]], floor);
        let corners = [(-1.0, 0.0), (1.0, 0.0), (1.0, 1.5), (-1.0, 1.5)].map(|(y, z)| Vec3::new(1.0, y, z));
        let normal = Vec3::new(-0.5, 0.0, lean * 0.75f32.sqrt());
        let mesh = s.mesh(&corners, &[0, 2, 1, 0, 3, 2], Some(&[normal; 4]));
        s.place(mesh, plate, DMat4::IDENTITY);
        s.camera(DVec3::new(-0.2, 0.0, 1.7), DVec3::new(0.3, 0.0, 0.0), 0.2, "");
        let glow = s.material(r#"{"surface":{"type":"emission","strength":3}}"#);
        s.quad([[-0.7, -0.7, 1.95], [-0.7, 0.7, 1.95], [1.5, 0.7, 1.95], [1.5, -0.7, 1.95]], glow);
        compare_pass(&format!("plate, {lean}"), &s, METHODS, (24, 96), Pass::Indirect, "");
    }
}

#[test]
fn every_light_agrees() {
    let tilted = r#""transform":[1,0,0,0,0,0.6,-0.8,0,0,0.8,0.6,0,0,0,0,1]"#;
    for light in [
        at_ceiling(r#""type":"disk","radius":0.3,"radiance":[5,5,5]"#),
        at_ceiling(r#""type":"sphere","radius":0.1,"radiance":[9,9,9]"#),
        at_ceiling(r#""type":"cylinder","radius":0.05,"length":0.7,"radiance":[9,9,9]"#),
        at_ceiling(r#""type":"point","intensity":[0.5,0.5,0.5]"#),
        at_ceiling(
            r#""type":"point","intensity":[0.5,0.5,0.5],"shaping":{"cone_angle":50,"cone_softness":0.3}"#,
        ),
        format!(r#"{{"type":"distant","irradiance":[1,1,1],"angle":3,{tilted}}}"#),
        format!(r#"{{"type":"distant","irradiance":[1,1,1],"angle":0,{tilted}}}"#),
        DOME.into(),
    ] {
        let mut s = yard(WALL, WALL);
        s.light(&light);
        compare(&light, &s, BEGINNINGS, (24, 16), "");
    }
    let mut s = yard(WALL, WALL);
    lamp(&mut s);
    compare("lamp of triangles", &s, BEGINNINGS, (24, 16), "");
}

#[test]
fn every_camera_agrees() {
    for (more, half) in [
        (r#","aperture_radius":0.15,"focus_distance":2.5,"blades":5,"aperture_ratio":1.5"#, 0.25),
        (r#","type":"orthographic""#, 0.8),
        (r#","type":"orthographic","aperture_radius":0.1,"focus_distance":2.5"#, 0.8),
        (r#","near":2.6,"far":3.5"#, 0.25),
    ] {
        let mut s = yard(WALL, WALL);
        s.light(&rect());
        yard_camera(&mut s, half, more);
        compare(more, &s, BEGINNINGS, (24, 24), "");
    }
}

#[test]
fn half_transparent_surfaces_agree() {
    let half = r#"{"surface":{"type":"diffuse","color":0.7},"opacity":0.5}"#;
    let mut s = yard(half, half);
    s.light(&rect());
    compare("cut-outs", &s, ALL, (24, 24), "");
    let tinted = r#"{"surface":{"type":"mix","factor":0.5,"a":{"type":"diffuse","color":0.7},
        "b":{"type":"transparent","color":[0.9,0.5,0.2]}}}"#;
    let mut s = corner(tinted, WALL, false);
    s.light(&rect());
    compare("tinted", &s, SHARP, (24, 24), "");
}

/// What depends on the direction of view is one thing for the camera's walk and another for the light's. The second texture
/// is 0.1 where a back is seen straight on and 0.9 where a front is.
#[test]
fn surfaces_that_look_different_from_aside_agree() {
    let textures = [
        r#"{"type":"facing"}"#,
        r#"{"type":"multilinear","of":[{"texture":0}],"coefficients":[[0.5,0.5,0.5],[0.4,0.4,0.4]]}"#,
    ];
    for other in [
        r#"{"type":"glossy","color":0.8,"roughness":0.4}"#,
        r#"{"type":"transparent","color":[0.9,0.5,0.2]}"#,
        r#"{"type":"glass","ior":1.4,"roughness":0.4}"#,
        r#"{"type":"glass","ior":1.4}"#,
        r#"{"type":"add","a":{"type":"emission","strength":0.5},"b":{"type":"diffuse"}}"#,
        r#"{"type":"principled","base_color":0.5,"coat":1,"coat_tint":[0.9,0.4,0.4],"emission_strength":0.5,
            "sheen":0.5,"anisotropy":0.7,"tangent":{"along":[0,1,0.2]},"roughness":0.4}"#,
    ] {
        let mixed = format!(
            r#"{{"surface":{{"type":"mix","factor":{{"texture":1}},"a":{{"type":"diffuse","color":0.7}},"b":{other}}}}}"#
        );
        let mut s = yard_with(&textures, &mixed, WALL);
        s.light(&rect());
        let methods = if other.contains("glass") { COMPLETE } else { ALL };
        compare(other, &s, methods, (24, 24), "");
        let mut s = yard_with(&textures, &mixed, &mixed);
        s.light(DOME);
        compare(&format!("floor, {other}"), &s, &SHARP[1..], (24, 16), "");
    }
}

/// A side's own colour, by its normal: below the sheet other than above, in a class that shares light with its neighbours.
#[test]
fn sides_that_differ_agree() {
    let textures = [
        r#"{"type":"geometry","of":"normal"}"#,
        r#"{"type":"multilinear","of":[{"texture":0}],"coefficients":[[0.5,0.5,0.5],[0.4,0.4,0.4]]}"#,
    ];
    for other in ["", r#","opacity":0.5"#] {
        let sided =
            format!(r#"{{"surface":{{"type":"diffuse","color":{{"texture":1,"channel":"b"}}}}{other}}}"#);
        let mut s = yard_with(&textures, &sided, &sided);
        s.light(&rect());
        let sheet = s.material(&sided);
        s.quad([[-1., -0.2, 0.9], [0.2, -0.2, 0.9], [0.2, 0.9, 1.1], [-1., 0.9, 1.1]], sheet);
        compare(other, &s, ALL, (24, 24), "");
    }
}

/// Glass around something else, so that light is inside of the glass both on its way between two of its own points and
/// from a point of it to another surface.
#[test]
fn insides_that_absorb_agree() {
    const METHODS: Methods = &[
        ("bdpt", 0.0),
        ("ppm", 5e-3),
        ("bpm", 5e-3),
        ("vcm", 5e-3),
        ("segment", 5e-3),
        ("segment-bridge", 5e-3),
    ];
    for surface in [
        r#"{"type":"glass","ior":1.5}"#,
        r#"{"type":"glass","ior":1.4,"roughness":0.5}"#,
        r#"{"type":"transparent","color":0.9}"#,
    ] {
        let glass = format!(r#"{{"surface":{surface},"absorption":[0.5,1.5,4]}}"#);
        let mut s = yard(&glass, WALL);
        let core = s.material(WALL);
        let (points, triangles) = icosphere(1);
        let mesh = s.mesh(&points, &triangles, None);
        let at = DMat4::from_translation(DVec3::new(0.2, 0.1, 0.5)) * DMat4::from_scale(DVec3::splat(0.2));
        s.place(mesh, core, at);
        lamp(&mut s);
        compare(&glass, &s, METHODS, (24, 24), "");
    }
}

/// A camera inside of the object, whose sight begins beyond its lens, and light from infinity on the back of a sheet, which
/// nothing is left of.
#[test]
fn insides_that_absorb_agree_at_the_ends_of_paths() {
    let wall = r#"{"surface":{"type":"translucent","color":0.8},"absorption":[0.5,1.5,4]}"#;
    let mut s = yard(WALL, WALL);
    let around = s.material(wall);
    let (points, triangles) = icosphere(3);
    let mesh = s.mesh(&points, &triangles, None);
    s.place(mesh, around, DMat4::from_translation(DVec3::new(0.3, -2.2, 2.6)));
    s.light(r#"{"type":"sphere","radius":0.1,"radiance":[9,9,9],"transform":[1,0,0,0.2,0,1,0,-1,0,0,1,1.4,0,0,0,1]}"#);
    yard_camera(&mut s, 0.25, r#","near":0.7"#);
    compare("camera inside", &s, SHARP, (24, 32), "");

    let mut s = Stage::default();
    let sheet = s.material(r#"{"surface":{"type":"diffuse","color":0.8},"absorption":[0.5,1.5,4]}"#);
    s.quad([[-1., -1., 1.], [1., -1., 1.], [1., 1., 1.], [-1., 1., 1.]], sheet);
    s.light(DOME);
    s.light(r#"{"type":"sphere","radius":0.2,"radiance":[9,9,9],"transform":[1,0,0,0.3,0,1,0,0,0,0,1,0.2,0,0,0,1]}"#);
    s.camera(DVec3::new(0.0, 0.0, -0.5), DVec3::new(0.0, 0.0, 1.0), 0.2, "");
    compare("back of a sheet", &s, SHARP, (24, 32), "");
}

#[test]
fn bounces_are_counted_as_in_path_tracing() {
    let mut s = corner(WALL, WALL, false);
    s.light(&rect());
    s.light(DOME);
    for depth in 0..4 {
        let limit = format!(r#","max_depth":{depth}"#);
        compare(&format!("at most {depth} bounces"), &s, SHARP, (24, 24), &limit);
    }
    let mut s = yard(GLASS, WALL);
    lamp(&mut s);
    for depth in [1, 2, 4] {
        let limit = format!(r#","max_depth":{depth}"#);
        compare(&format!("at most {depth} bounces, glass"), &s, COMPLETE, (24, 24), &limit);
    }
}

/// Through glass, and with it the passes.
#[test]
fn passes_agree() {
    let mut s = corner(GLASS, WALL, true);
    s.light(DOME);
    lamp(&mut s);
    for pass in [Pass::Combined, Pass::Emission, Pass::Direct, Pass::Indirect, Pass::Alpha] {
        let more = r#","transparent_background":true"#;
        compare_pass(pass.name(), &s, &SHARP[1..], (24, 24), pass, more);
    }
}

/// In a closed room of glowing walls radiance is `emission / (1 - albedo)` everywhere, on flat facets and on smoothed
/// ones; where facets meet merging loses a little.
#[test]
fn furnaces_stay_even() {
    for is_smooth in [false, true] {
        let mut s = Stage::default();
        let (points, triangles) = icosphere(3);
        let mesh = s.mesh(&points, &triangles, is_smooth.then_some(&points));
        let wall = s.material(
            r#"{"surface":{"type":"add","a":{"type":"emission","strength":0.3},
                "b":{"type":"diffuse","color":0.6}}}"#,
        );
        s.place(mesh, wall, DMat4::from_scale(DVec3::new(3.0, 2.0, 2.5)));
        s.camera(DVec3::new(0.4, -0.7, 0.2), DVec3::new(-0.3, 0.5, 0.1), 0.5, "");
        for (method, slack) in ALL {
            let settings = format!(r#","integrator":"{method}","kernel_size":2"#);
            let got = estimate(&s, 16, 64, Pass::Combined, &settings);
            assert_agree(&format!("furnace by {method}"), got, (0.75, 0.0), 1e-3 + 2.0 * slack);
        }
    }
}
