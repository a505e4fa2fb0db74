//! Sizes, distances and contrasts far from the ordinary.

use super::support::*;
use glam::{Vec2, Vec3};
use segue::shading::emitters::{EmitterHit, Incident, MeshTriangle, Receiver};
use std::f64::consts::PI;

/// Red irradiance of a surface facing up at `x`.
fn irradiance(json: &str, x: [f32; 3]) -> Estimate {
    let e = emitters_of(&[json], &[], &[]);
    let r = receiver(x, [0.0, 0.0, 1.0]);
    Estimate::new(2000, |i| {
        e.sample_towards(FIRST, &r, pair(i, 0))
            .map_or(0.0, |s| (s.incident.estimate().x * s.direction.z.max(0.0)) as f64)
    })
}

#[test]
fn spheres_of_all_sizes() {
    for exponent in -8..=8 {
        let radius = 10f64.powi(exponent);
        for ratio in [1.001, 1.5, 10.0, 1e4] {
            let d = radius * ratio;
            let m = transform([0.0, 0.0, d], [0.0, 0.0, -1.0], [1.0; 3]);
            let json = format!(r#"{{"type":"sphere","radius":{radius},"radiance":[1,1,1],"transform":{m}}}"#);
            let expected = PI / ratio / ratio;
            irradiance(&json, [0.0; 3]).assert_is(
                expected,
                2e-4,
                &format!("radius {radius} at {ratio} radii"),
            );
        }
    }
}

#[test]
fn flat_lights_of_all_sizes() {
    for exponent in -8..=8 {
        let size = 10f64.powi(exponent);
        let m = transform([0.0, 0.0, size], [0.0, 0.0, -1.0], [1.0; 3]);
        let disk = format!(r#"{{"type":"disk","radius":{size},"radiance":[1,1,1],"transform":{m}}}"#);
        irradiance(&disk, [0.0; 3]).assert_is(PI / 2.0, 2e-4, &format!("disk of {size}"));
        let rect = format!(
            r#"{{"type":"rect","width":{0},"height":{0},"radiance":[1,1,1],"transform":{m}}}"#,
            2.0 * size
        );
        // Lambert: 4 times a quarter of unit sides at unit distance
        let expected = 4.0 / 2f64.sqrt() * (1.0 / 2f64.sqrt()).atan();
        irradiance(&rect, [0.0; 3]).assert_is(expected, 2e-4, &format!("rect of {size}"));
        let tube = format!(
            r#"{{"type":"cylinder","radius":{},"length":{},"radiance":[1,1,1],"transform":{m}}}"#,
            0.1 * size,
            20.0 * size
        );
        let e = irradiance(&tube, [0.0; 3]);
        assert!(e.mean > 0.2 && e.mean < 0.4 && e.error < 0.02 * e.mean, "tube of {size}: {e:?}");
    }
}

#[test]
fn far_from_the_origin() {
    // coordinates that single precision resolves to 0.008
    let m = transform([1e5, 1e5, 1e5 + 2.0], [0.0, 0.0, -1.0], [1.0; 3]);
    let json = format!(r#"{{"type":"disk","radius":1,"radiance":[1,1,1],"transform":{m}}}"#);
    irradiance(&json, [1e5; 3]).assert_is(PI / 5.0, 1e-2, "disk far away");
}

#[test]
fn receivers_next_to_and_on_lights() {
    let shapes = [
        r#"{"type":"sphere","radiance":[1,1,1]}"#,
        r#"{"type":"cylinder","radiance":[1,1,1]}"#,
        r#"{"type":"rect","radiance":[1,1,1]}"#,
        r#"{"type":"disk","radiance":[1,1,1]}"#,
        r#"{"type":"disk","radiance":[1,1,1],"shaping":{"spread":0.1}}"#,
        r#"{"type":"rect","radiance":[1,1,1],"shaping":{"spread":0.1}}"#,
        r#"{"type":"point","intensity":[1,1,1]}"#,
    ];
    for json in shapes {
        let e = emitters_of(&[json], &[], &[]);
        let z =
            [-1e-20, -1e-9, -1e-6, -1e-3, 0.0, 1e-20, 1e-6, 0.5, -0.5, -0.500_000_06, 0.499_999_97, f32::NAN];
        for z in z {
            for x in [0.0, 1e-12, 0.5, 0.500_000_06] {
                let r = Receiver { position: Vec3::new(x, 0.0, z), normal: None };
                for i in 0..500 {
                    if let Some(s) = e.sample_towards(FIRST, &r, pair(i, 0)) {
                        assert!(s.direction.is_finite() && s.distance > 0.0, "{json} at {x} {z}: {s:?}");
                        let estimate = s.incident.estimate();
                        assert!(estimate.is_finite() && estimate.min_element() >= 0.0, "{json}: {s:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn inside_a_sphere_or_a_cylinder_it_is_dark() {
    for json in [r#"{"type":"sphere","radiance":[1,1,1]}"#, r#"{"type":"cylinder","radiance":[1,1,1]}"#] {
        let e = emitters_of(&[json], &[], &[]);
        let r = Receiver { position: Vec3::new(0.1, 0.2, 0.1), normal: None };
        for i in 0..200 {
            assert!(e.sample_towards(FIRST, &r, pair(i, 0)).is_none());
            let w = segue::math::warp::uniform_sphere(pair(i, 1));
            e.for_each_hit(r.position, w, f32::INFINITY, |hit| panic!("{json}: {hit:?}"));
        }
    }
}

#[test]
fn a_sun_of_a_thousandth_of_a_degree() {
    let angle = 0.001f64.to_radians();
    let json = format!(r#"{{"type":"distant","angle":{angle},"irradiance":[1,1,1]}}"#);
    let e = emitters_of(&[&json], &[], &[]);
    let r = receiver([0.0; 3], [0.0, 0.0, 1.0]);
    let (mut seen, mut widest) = (0, 0.0f32);
    for i in 0..10_000 {
        let s = e.sample_towards(FIRST, &r, pair(i, 0)).unwrap();
        let Incident::Radiance { radiance, pdf } = s.incident else { panic!("the sun has a size") };
        assert!((radiance.x / pdf.value() - 1.0).abs() < 1e-5, "irradiance");
        let solid_angle = PI * (angle / 2.0).powi(2);
        assert!((1.0 / pdf.value() as f64 / solid_angle - 1.0).abs() < 1e-4, "solid angle");
        widest = widest.max(s.direction.x.hypot(s.direction.y));
        let mut met = |hit: EmitterHit| {
            seen += 1;
            assert_eq!(hit.radiance, radiance);
            assert_eq!(e.pdf_towards(&r, s.direction, &hit), pdf);
        };
        e.for_each_infinite(Vec3::ZERO, s.direction, &mut met);
    }
    // directions have 24 bits: those at the rim may round out of the disk
    assert!(seen > 9_700, "{seen} of 10000 samples see the sun");
    assert!((widest as f64 / (angle / 2.0) - 1.0).abs() < 0.02, "half angle {widest}");
}

#[test]
fn a_single_bright_texel_is_found() {
    let map = image(512, 256, |x, y| if (x, y) == (200, 70) { [1e6; 3] } else { [1.0; 3] });
    let e = emitters_of(&[r#"{"type":"dome","radiance":[1,1,1],"image":0}"#], &[], &[map]);
    let r = Receiver { position: Vec3::ZERO, normal: None };
    let fluence = Estimate::new(20_000, |i| {
        e.sample_towards(FIRST, &r, pair(i, 0)).unwrap().incident.estimate().x as f64
    });
    // a texel's share of the sphere, by its row's mean sine, and the rest of 1
    let step = PI / 256.0;
    let texel = step * step * (70.5 * step).sin();
    let expected = 4.0 * PI + 1e6 * texel;
    fluence.assert_is(expected, 2e-3, "fluence of sky and sun");
    assert!(fluence.error < 0.015 * fluence.mean, "{fluence:?}");
}

#[test]
fn images_of_odd_sizes_and_black_ones() {
    for (w, h) in [(1, 1), (1, 7), (9, 1), (3, 2), (64, 33)] {
        let map = image(w, h, |x, y| [(x + y) as f32 + 0.5, 0.0, 0.0]);
        let e = emitters_of(&[r#"{"type":"dome","radiance":[1,1,1],"image":0}"#], &[], &[map]);
        let r = Receiver { position: Vec3::ZERO, normal: None };
        let by_image = Estimate::new(20_000, |i| {
            e.sample_towards(FIRST, &r, pair(i, 0)).unwrap().incident.estimate().x as f64
        });
        let uniform = Estimate::new(20_000, |i| {
            let mut sum = 0.0;
            let w = segue::math::warp::uniform_sphere(pair(i, 1));
            e.for_each_infinite(Vec3::ZERO, w, |hit| sum += hit.radiance.x as f64);
            sum * 4.0 * PI
        });
        by_image.assert_agrees(uniform, 1e-4, &format!("{w} x {h}"));
        let mean = e.power(FIRST).x as f64 / (PI * 9.0);
        by_image.assert_is(mean, 1e-3, &format!("power of {w} x {h}"));
    }
    let black = image(8, 4, |_, _| [0.0; 3]);
    let e = emitters_of(&[r#"{"type":"dome","radiance":[1,1,1],"image":0}"#], &[], &[black]);
    let r = Receiver { position: Vec3::ZERO, normal: None };
    assert!(e.select(&r, 0.5).is_none() && e.select_emission(0.5).is_none());
    assert!(e.sample_towards(FIRST, &r, pair(0, 0)).is_none());
    assert!(e.sample_from(FIRST, pair(0, 0), pair(0, 1)).is_none());
}

#[test]
fn dome_images_are_oriented_as_documented() {
    // one texel lit at a time: top, centre, a quarter to the left of the centre
    let seen = |x: u32, y: u32, w: Vec3| {
        let map = image(8, 5, |i, j| [if (i, j) == (x, y) { 1.0 } else { 0.0 }; 3]);
        let e = emitters_of(&[r#"{"type":"dome","radiance":[1,1,1],"image":0}"#], &[], &[map]);
        let mut l = 0.0;
        e.for_each_infinite(Vec3::ZERO, w, |hit| l = hit.radiance.x);
        l
    };
    assert!(seen(4, 0, Vec3::new(0.0, 1.0, 0.1).normalize()) > 0.4);
    assert!(seen(4, 2, Vec3::Z) > 0.4 && seen(3, 2, Vec3::Z) > 0.4);
    assert!(seen(2, 2, Vec3::X) > 0.4 && seen(6, 2, Vec3::NEG_X) > 0.4);
    // a mirror in x swaps the sides
    let map = image(8, 5, |i, j| [if (i, j) == (2, 2) { 1.0 } else { 0.0 }; 3]);
    let json =
        r#"{"type":"dome","radiance":[1,1,1],"image":0,"transform":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"#;
    let e = emitters_of(&[json], &[], &[map]);
    let mut l = 0.0;
    e.for_each_infinite(Vec3::ZERO, Vec3::NEG_X, |hit| l = hit.radiance.x);
    assert!(l > 0.4);
}

#[test]
fn rect_images_are_upright_for_who_looks_at_the_light() {
    // the light shines along -z; its top left is at (+x, +y)
    let map = image(2, 2, |x, y| [if (x, y) == (0, 0) { 1.0 } else { 0.0 }; 3]);
    let json = r#"{"type":"rect","radiance":[1,1,1],"image":0}"#;
    let e = emitters_of(&[json], &[], &[map]);
    let seen = |x: f32, y: f32| {
        let mut l = 0.0;
        e.for_each_hit(Vec3::new(x, y, -1.0), Vec3::Z, f32::INFINITY, |hit| l = hit.radiance.x);
        l
    };
    assert_eq!((seen(0.4, 0.4), seen(-0.4, 0.4), seen(0.4, -0.4)), (1.0, 0.0, 0.0));
}

#[test]
fn receivers_next_to_and_on_triangles() {
    let vertices = [Vec3::ZERO, Vec3::X, Vec3::new(0.2, 1e-3, 0.0)];
    let t = |two_sided| MeshTriangle { instance: 0, triangle: 0, vertices, radiance: Vec3::ONE, two_sided };
    for e in [emitters_of(&[], &[t(false)], &[]), emitters_of(&[], &[t(true)], &[])] {
        for z in [-0.1, -1e-6, -1e-20, 0.0, 1e-30, 1e-9, 1e-4, 0.01, 1.0, f32::NAN] {
            for at in [Vec2::ZERO, Vec2::X, Vec2::new(0.2, 5e-4), Vec2::new(0.5, 0.0), Vec2::new(2.0, 0.0)] {
                let r = Receiver { position: at.extend(z), normal: None };
                for i in 0..300 {
                    if let Some(s) = e.sample_towards(FIRST, &r, pair(i, 0)) {
                        assert!(s.direction.is_finite() && s.distance > 0.0, "{at} {z}: {s:?}");
                        assert!(s.incident.estimate().is_finite(), "{at} {z}: {s:?}");
                        let b = s.barycentrics.unwrap();
                        assert!(b.min_element() >= 0.0 && b.element_sum() < 1.000_001, "{b}");
                    }
                }
            }
        }
    }
}
