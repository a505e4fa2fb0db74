//! Scenes whose answer is known in closed form, by each method: every camera, every light, the passes, the film.

mod common;

use common::{Stage, assert_agree, assert_close, estimate, icosphere, mean};
use glam::{DMat4, DVec3};
use segue::film::Pass;
use std::f64::consts::PI;

/// Runs tests by methods with these settings.
macro_rules! by_methods {
    ($($module:ident $settings:literal),* => $names:tt) => {
        $(by_methods!(@one $module $settings $names);)*
    };
    (@one $module:ident $settings:literal [$($name:ident),* $(,)?]) => {
        mod $module {
            $(#[test] fn $name() { super::$name($settings) })*
        }
    };
}

// segments and merging over half a pixel: what is left of the bias of filtering is within the tolerances
by_methods!(
    path r#","integrator":"path""#,
    segment r#","integrator":"segment","kernel":"fixed","kernel_size":0.5"#,
    bdpt r#","integrator":"bdpt""#,
    vcm r#","integrator":"vcm","kernel":"fixed","kernel_size":0.5"# =>
    [
        every_camera_sees_the_furnace,
        furnaces_converge_for_high_albedo_too,
        every_light_fills_the_integrating_sphere_by_its_flux,
        emissive_meshes_are_lights,
        infinite_lights_light_a_floor,
        passes_say_what_is_seen,
        cut_outs_and_transparent_surfaces_let_light_through,
        glass_keeps_all_light,
        absorbing_plates_keep_what_the_law_leaves,
        the_same_seed_gives_the_same_picture_whatever_the_threads,
        a_scene_far_from_the_origin_is_the_same_scene,
    ]
);

// light paths alone seldom find what is small in a large scene: closed rooms only
by_methods!(
    light r#","integrator":"light","light_paths":8"#,
    ppm r#","integrator":"ppm","light_paths":4"#,
    bpm r#","integrator":"bpm","light_paths":4"# =>
    [
        every_camera_sees_the_furnace,
        emissive_meshes_are_lights,
        the_same_seed_gives_the_same_picture_whatever_the_threads,
    ]
);

/// A closed room with walls of this emission and albedo: radiance is `emission / (1 - albedo)`
/// everywhere, whatever its shape.
fn furnace(albedo: f64, camera: impl Fn(&mut Stage)) -> Stage {
    let mut s = Stage::default();
    let (points, triangles) = icosphere(2);
    let mesh = s.mesh(&points, &triangles, None);
    let wall = s.material(&format!(
        r#"{{"surface":{{"type":"add","a":{{"type":"emission","strength":0.3}},
             "b":{{"type":"diffuse","color":{albedo}}}}}}}"#
    ));
    s.place(mesh, wall, DMat4::from_scale(DVec3::new(3.0, 2.0, 2.5)));
    camera(&mut s);
    s
}

fn every_camera_sees_the_furnace(method: &str) {
    let (eye, target) = (DVec3::new(0.4, -0.7, 0.2), DVec3::new(-0.3, 0.5, 0.1));
    for more in [
        "",
        r#","type":"orthographic""#,
        r#","aperture_radius":0.2,"focus_distance":1.5"#,
        r#","aperture_radius":0.2,"focus_distance":1.5,"blades":6,"aperture_ratio":2"#,
        r#","near":0.1,"far":20"#,
    ] {
        let s = furnace(0.6, |s| s.camera(eye, target, 0.5, more));
        let got = mean(&s.render(16, 256, method), Pass::Combined);
        assert_close(&format!("furnace, camera {more:?}"), got, 0.3 / 0.4, 5e-3);
    }
}

fn furnaces_converge_for_high_albedo_too(method: &str) {
    for albedo in [0.0, 0.5, 0.9, 0.97] {
        let s = furnace(albedo, |s| s.camera(DVec3::ZERO, DVec3::X, 0.6, ""));
        let got = estimate(&s, (16, 48, 6), Pass::Combined, method);
        assert!(got.1 < 1e-2 * got.0, "too noisy to say anything: {got:?}");
        assert_agree(&format!("furnace of albedo {albedo}"), got, (0.3 / (1.0 - albedo), 0.0), (3.0, 5e-3));
    }
}

/// In a sphere of Lambertian walls, light of flux `flux` that is scattered twice or more has the same
/// radiance everywhere, wherever the light stands: `albedo^2 flux / (4 pi^2 r^2 (1 - albedo))`.
fn every_light_fills_the_integrating_sphere_by_its_flux(method: &str) {
    let albedo = 0.6;
    let at = |x: f64, y: f64, z: f64| format!(r#","transform":[1,0,0,{x},0,1,0,{y},0,0,1,{z},0,0,0,1]}}"#);
    let cases = [
        (r#"{"type":"rect","width":0.4,"height":0.2,"radiance":[2,2,2]"#, 2.0 * 0.08 * PI),
        (r#"{"type":"disk","radius":0.3,"radiance":[2,2,2]"#, 2.0 * PI * 0.09 * PI),
        (r#"{"type":"sphere","radius":0.2,"radiance":[2,2,2]"#, 2.0 * 4.0 * PI * 0.04 * PI),
        (r#"{"type":"cylinder","radius":0.1,"length":0.7,"radiance":[2,2,2]"#, 2.0 * 2.0 * PI * 0.07 * PI),
        (r#"{"type":"point","intensity":[2,2,2]"#, 2.0 * 4.0 * PI),
    ];
    for (light, flux) in cases {
        let mut s = Stage::default();
        let (points, triangles) = icosphere(4);
        let mesh = s.mesh(&points, &triangles, None);
        let wall = s.material(&format!(r#"{{"surface":{{"type":"diffuse","color":{albedo}}}}}"#));
        s.place(mesh, wall, DMat4::IDENTITY);
        s.light(&format!("{light}{}", at(0.2, -0.1, 0.3)));
        s.camera(DVec3::new(-0.3, 0.2, -0.4), DVec3::new(0.5, 0.5, -0.5), 0.7, "");
        let session = s.render(24, 256, &format!("{method}{}", r#","passes":["Indirect"]"#));
        let expected = albedo * albedo * flux / (4.0 * PI * PI * (1.0 - albedo));
        assert_close(light, mean(&session, Pass::Indirect), expected, 1e-2);
    }
}

/// A sphere lamp made of emissive triangles does what the analytic one does.
fn emissive_meshes_are_lights(method: &str) {
    let mut s = Stage::default();
    let (points, triangles) = icosphere(4);
    let mesh = s.mesh(&points, &triangles, None);
    let wall = s.material(r#"{"surface":{"type":"diffuse","color":0.6}}"#);
    let lamp = s.material(r#"{"surface":{"type":"emission","strength":2}}"#);
    s.place(mesh, wall, DMat4::IDENTITY);
    s.place(
        mesh,
        lamp,
        DMat4::from_translation(DVec3::new(0.2, -0.1, 0.3)) * DMat4::from_scale(DVec3::splat(0.2)),
    );
    s.camera(DVec3::new(-0.3, 0.2, -0.4), DVec3::new(0.5, 0.5, -0.5), 0.7, "");
    // the lamp is black and blocks light, so only what is scattered once is the same everywhere:
    // compare with the same lamp, not blocking, by its direct light
    let session = s.render(24, 256, &format!("{method}{}", r#","passes":["Direct"],"max_depth":1"#));
    let by_mesh = mean(&session, Pass::Direct);

    let mut s = Stage::default();
    let mesh = s.mesh(&points, &triangles, None);
    let wall = s.material(r#"{"surface":{"type":"diffuse","color":0.6}}"#);
    s.place(mesh, wall, DMat4::IDENTITY);
    let at = r#""transform":[1,0,0,0.2,0,1,0,-0.1,0,0,1,0.3,0,0,0,1]"#;
    s.light(&format!(r#"{{"type":"sphere","radius":0.2,"radiance":[2,2,2],{at}}}"#));
    s.camera(DVec3::new(-0.3, 0.2, -0.4), DVec3::new(0.5, 0.5, -0.5), 0.7, "");
    let session = s.render(24, 256, &format!("{method}{}", r#","passes":["Direct"],"max_depth":1"#));
    assert_close("direct light of a lamp of triangles", by_mesh, mean(&session, Pass::Direct), 1e-2);
}

/// Radiance of a white Lambertian floor under lights whose irradiance is known.
fn infinite_lights_light_a_floor(method: &str) {
    let tilt = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        format!(r#","transform":[1,0,0,0, 0,{c},{0},0, 0,{s},{c},0, 0,0,0,1]}}"#, -s)
    };
    let cases = [
        (r#"{"type":"distant","irradiance":[3,3,3]"#.to_string() + &tilt(0.0), 3.0),
        (r#"{"type":"distant","irradiance":[3,3,3]"#.to_string() + &tilt(60.0), 1.5),
        (r#"{"type":"distant","angle":0.01,"irradiance":[3,3,3]"#.to_string() + &tilt(60.0), 1.5),
        (
            r#"{"type":"distant","angle":0.5,"radiance":[3,3,3]"#.to_string() + &tilt(0.0),
            3.0 * PI * 0.25f64.sin().powi(2),
        ),
        (r#"{"type":"dome","radiance":[3,3,3]"#.to_string() + &tilt(25.0), 3.0 * PI),
    ];
    for (light, irradiance) in cases {
        let mut s = Stage::default();
        let white = s.material(r#"{"surface":{"type":"diffuse","color":1}}"#);
        s.floor(10.0, white);
        s.light(&light);
        s.camera(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.3, "");
        let got = mean(&s.render(8, 256, method), Pass::Combined);
        assert_close(&light, got, irradiance / PI, 5e-3);
    }
}

fn passes_say_what_is_seen(method: &str) {
    let mut s = Stage::default();
    let grey = s.material(r#"{"surface":{"type":"diffuse","color":[0.2,0.4,0.6]},"pass_index":5}"#);
    s.floor(10.0, grey);
    s.light(r#"{"type":"dome","radiance":[1,1,1]}"#);
    // far away from the world's origin, seen at an angle
    s.camera(DVec3::new(0.0, -3.0, 4.0), DVec3::ZERO, 0.1, "");
    let passes = r#","passes":["Depth","Position","Normal","Albedo","UV","ObjectIndex","MaterialIndex","Emission",
                   "Direct","Indirect","Alpha"]"#;
    let session = s.render(9, 64, &format!("{method}{passes}"));
    let pixel = |pass: Pass| {
        let v = session.film().read_pass(pass, session.film().rect()).unwrap();
        v[40 * pass.channels()..][..pass.channels()].to_vec()
    };
    assert_close("depth", pixel(Pass::Depth)[0] as f64, 5.0, 0.02);
    assert!(pixel(Pass::Position).iter().all(|v| v.abs() < 0.1));
    assert_eq!(pixel(Pass::Normal), [0.0, 0.0, 1.0]);
    for (got, expected) in pixel(Pass::Albedo).iter().zip([0.2, 0.4, 0.6]) {
        assert_close("albedo", *got as f64, expected, 1e-3);
    }
    assert_eq!((pixel(Pass::ObjectIndex)[0], pixel(Pass::MaterialIndex)[0]), (3.0, 5.0));
    assert_eq!((pixel(Pass::Emission)[0], pixel(Pass::Indirect)[0]), (0.0, 0.0));
    assert_eq!(pixel(Pass::Alpha)[0], 1.0);
    assert_eq!(pixel(Pass::Direct), pixel(Pass::Combined)[..3]);
}

fn cut_outs_and_transparent_surfaces_let_light_through(method: &str) {
    // a floor under a sky, seen and lit through a sheet that lets a quarter (or a colour) of light through
    for (sheet, through) in [
        (r#"{"surface":{"type":"diffuse","color":0},"opacity":0.75}"#, 0.25),
        (r#"{"surface":{"type":"transparent","color":0.25}}"#, 0.25),
        (
            r#"{"surface":{"type":"mix","factor":0.5,"a":{"type":"diffuse","color":0},"b":{"type":"transparent","color":0.5}}}"#,
            0.25,
        ),
        (r#"{"surface":{"type":"diffuse","color":0},"opacity":0}"#, 1.0),
    ] {
        let mut s = Stage::default();
        let white = s.material(r#"{"surface":{"type":"diffuse","color":1}}"#);
        let sheet_material = s.material(sheet);
        s.floor(1.0, white);
        let p = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| glam::Vec3::new(x, y, 0.0) * 500.0);
        let mesh = s.mesh(&p, &[0, 1, 2, 0, 2, 3], None);
        s.place(mesh, sheet_material, DMat4::from_translation(DVec3::Z));
        s.light(r#"{"type":"dome","radiance":[1,1,1]}"#);
        s.light(r#"{"type":"distant","irradiance":[1,1,1]}"#);
        s.camera(DVec3::new(0.0, 0.0, 0.5), DVec3::ZERO, 0.3, "");
        let below = mean(&s.render(8, 512, method), Pass::Combined);
        assert_close(&format!("lit through {sheet}"), below, through * (1.0 + 1.0 / PI), 1e-2);
        s.camera(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.1, "");
        let above = mean(&s.render(8, 512, method), Pass::Combined);
        assert_close(&format!("seen through {sheet}"), above, through * through * (1.0 + 1.0 / PI), 3e-2);
    }
}

fn glass_keeps_all_light(method: &str) {
    // a lossless object in a uniform sky cannot be seen, rough or smooth
    for surface in [
        r#"{"type":"glass","ior":1.5}"#,
        r#"{"type":"glass","ior":1.5,"roughness":0.4}"#,
        r#"{"type":"glossy","color":1,"roughness":0}"#,
        r#"{"type":"glossy","color":1,"roughness":0.6}"#,
        r#"{"type":"diffuse","color":1}"#,
        r#"{"type":"diffuse","color":1,"roughness":0.7}"#,
    ] {
        let mut s = Stage::default();
        let (points, triangles) = icosphere(4);
        // interpolated normals would turn rough scattering into the surface, where it is lost
        let mesh = s.mesh(&points, &triangles, None);
        let material = s.material(&format!(r#"{{"surface":{surface}}}"#));
        s.place(mesh, material, DMat4::IDENTITY);
        s.light(r#"{"type":"dome","radiance":[1,1,1]}"#);
        s.camera(DVec3::new(0.0, -5.0, 0.0), DVec3::ZERO, 0.1, "");
        assert_close(surface, mean(&s.render(16, 256, method), Pass::Combined), 1.0, 1e-2);
    }
}

fn absorbing_plates_keep_what_the_law_leaves(method: &str) {
    // a plate under a uniform sky, seen straight through: without an interface, and with one that reflects `r`
    let (thickness, coefficients) = (0.7, [0.5, 1.0, 3.0]);
    let r = (0.5f64 / 2.5).powi(2);
    for (surface, r) in [(r#"{"type":"transparent"}"#, 0.0), (r#"{"type":"glass","ior":1.5}"#, r)] {
        let mut s = Stage::default();
        let plate = s.material(&format!(r#"{{"surface":{surface},"absorption":{coefficients:?}}}"#));
        let corner = |k: u32| glam::Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32) - 0.5;
        let points: Vec<_> = (0..8).map(corner).collect();
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<u32> = sides.iter().flat_map(|&[a, b, c, d]| [a, b, c, a, c, d]).collect();
        let mesh = s.mesh(&points, &triangles, None);
        s.place(mesh, plate, DMat4::from_scale(DVec3::new(9.0, 9.0, thickness)));
        s.light(r#"{"type":"dome","radiance":[1,1,1]}"#);
        s.camera(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 0.3, r#","type":"orthographic""#);
        let session = s.render(8, 512, method);
        let values = session.film().read_pass(Pass::Combined, session.film().rect()).unwrap();
        for (channel, coefficient) in coefficients.into_iter().enumerate() {
            let got = values.iter().skip(channel).step_by(4).map(|&v| f64::from(v)).sum::<f64>() / 64.0;
            let a = f64::exp(-coefficient * thickness);
            // a geometric series of reflections inside
            let bounces = 1.0 / (1.0 - r * r * a * a);
            let expected = (1.0 - r) * (1.0 - r) * a * bounces * (1.0 + r * a) + r;
            assert_close(&format!("{surface}, channel {channel}"), got, expected, 1e-2);
        }
    }
}

fn the_same_seed_gives_the_same_picture_whatever_the_threads(method: &str) {
    let mut s = Stage::default();
    let (points, triangles) = icosphere(3);
    let mesh = s.mesh(&points, &triangles, Some(&points));
    let glass = s.material(r#"{"surface":{"type":"glass","roughness":0.1},"opacity":0.9}"#);
    let grey = s.material(r#"{"surface":{"type":"principled","coat":1}}"#);
    s.place(mesh, glass, DMat4::from_translation(DVec3::Z));
    s.floor(5.0, grey);
    s.light(
        r#"{"type":"sphere","radius":0.2,"radiance":[9,8,7],"transform":[1,0,0,1,0,1,0,1,0,0,1,3,0,0,0,1]}"#,
    );
    s.light(r#"{"type":"dome","radiance":[0.1,0.2,0.3]}"#);
    s.camera(DVec3::new(0.0, -5.0, 2.0), DVec3::Z, 0.4, "");
    let picture = |more: &str| {
        let session = s.render(70, 4, &format!("{method}{more}"));
        session.film().read_pass(Pass::Combined, session.film().rect()).unwrap()
    };
    let one = picture(r#","threads":1"#);
    assert_eq!(one, picture(r#","threads":2"#));
    assert_eq!(one, picture(r#","threads":7"#));
    assert_ne!(one, picture(r#","seed":1"#));
    if !method.contains(r#""path""#) {
        return;
    }
    // pixels that share nothing are the same in a crop
    let crop = {
        let session = s.render(70, 4, &format!("{method}{}", r#","crop":[10,20,50,60]"#));
        session.film().read_pass(Pass::Combined, session.film().rect()).unwrap()
    };
    assert_eq!(crop[..4 * 40], one[4 * (20 * 70 + 10)..][..4 * 40]);
}

fn a_scene_far_from_the_origin_is_the_same_scene(method: &str) {
    let picture = |offset: DVec3| {
        let mut s = Stage::default();
        let grey = s.material(r#"{"surface":{"type":"diffuse"}}"#);
        let (points, triangles) = icosphere(3);
        let mesh = s.mesh(&points, &triangles, None);
        s.place(mesh, grey, DMat4::from_translation(offset));
        let DVec3 { x, y, z } = offset + DVec3::new(2.0, -2.0, 2.0);
        s.light(&format!(
            r#"{{"type":"sphere","radius":0.5,"radiance":[9,8,7],"transform":[1,0,0,{x},0,1,0,{y},0,0,1,{z},0,0,0,1]}}"#
        ));
        s.camera(offset + DVec3::new(0.0, -5.0, 1.0), offset, 0.3, "");
        mean(&s.render(32, 64, method), Pass::Combined)
    };
    let near = picture(DVec3::ZERO);
    assert_close("moved by 1e7", picture(DVec3::new(1e7, -1e7, 1e7)), near, 1e-3);
}
