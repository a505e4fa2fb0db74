//! Irradiance under every kind of light: next event against the reference, and light paths and rays
//! against next event.

use super::references::*;
use super::support::*;
use glam::{DVec3, Vec3};
use segue::shading::emitters::{EmitterHit, Emitters, Incident, MeshTriangle, Receiver};
use std::f64::consts::PI;

const SAMPLES: u32 = 60_000;

fn normal(r: &Receiver) -> Vec3 {
    r.normal.expect("test receivers have a normal")
}

/// Red irradiance by next event, over all emitters by selection.
fn next_event(e: &Emitters, r: &Receiver) -> Estimate {
    Estimate::new(SAMPLES, |i| {
        let Some((id, p, _)) = e.select(r, pair(i, 0).x) else { return 0.0 };
        let Some(s) = e.sample_towards(id, r, pair(i, 1)) else { return 0.0 };
        (s.incident.estimate().x * normal(r).dot(s.direction).max(0.0) / p.value()) as f64
    })
}

/// Calls `f` for all that a ray from the receiver meets.
fn trace(e: &Emitters, x: Vec3, w: Vec3, triangles: &[MeshTriangle], mut f: impl FnMut(EmitterHit)) {
    e.for_each_hit(x, w, f32::INFINITY, &mut f);
    e.for_each_infinite(Vec3::ZERO, w, &mut f);
    for t in triangles {
        let [a, b, c] = t.vertices;
        let n = (b - a).cross(c - a);
        let distance = (a - x).dot(n) / w.dot(n);
        let p = x + w * distance;
        let inside = |a: Vec3, b: Vec3| (b - a).cross(p - a).dot(n) >= 0.0;
        let facing = t.two_sided || w.dot(n) < 0.0;
        if distance > 0.0 && facing && inside(a, b) && inside(b, c) && inside(c, a) {
            let emitter = e.triangle(t.instance, t.triangle).expect("an emitter");
            let normal = n.normalize() * -w.dot(n).signum();
            f(EmitterHit { emitter, distance, point: p, normal, radiance: t.radiance });
        }
    }
}

/// Uniform directions for rays: of the whole sphere, or of a cone well around a small light.
struct Directions {
    frame: segue::math::Frame,
    one_minus_cos: f32,
}

impl Directions {
    fn around(e: &Emitters, r: &Receiver) -> Self {
        let sampled: Vec<Vec3> = (0..2000)
            .filter_map(|i| {
                let (id, ..) = e.select(r, pair(i, 0).x)?;
                Some(e.sample_towards(id, r, pair(i, 1))?.direction)
            })
            .collect();
        let axis = sampled.iter().sum::<Vec3>().normalize_or(Vec3::Z);
        let widest = sampled.iter().map(|d| (*d - axis).length()).fold(0.0, f32::max) * 1.3;
        let one_minus_cos = if widest > 0.5 { 2.0 } else { widest * widest / 2.0 };
        Self { frame: segue::math::Frame::from_normal(axis), one_minus_cos }
    }

    fn get(&self, i: u32) -> Vec3 {
        self.frame.to_world(segue::math::warp::uniform_cone(pair(i, 2), self.one_minus_cos))
    }

    fn solid_angle(&self) -> f64 {
        2.0 * PI * self.one_minus_cos as f64
    }
}

/// Red irradiance by rays of uniform direction.
fn rays(e: &Emitters, r: &Receiver, triangles: &[MeshTriangle]) -> Estimate {
    let directions = Directions::around(e, r);
    Estimate::new(SAMPLES, |i| {
        let w = directions.get(i);
        let mut sum = 0.0;
        trace(e, r.position, w, triangles, |hit| sum += hit.radiance.x);
        (sum * normal(r).dot(w).max(0.0)) as f64 * directions.solid_angle()
    })
}

/// The density of next event integrated over what rays meet, less the share of samples that it does not
/// make: one where the two belong together.
fn density_balance(e: &Emitters, r: &Receiver, triangles: &[MeshTriangle]) -> Estimate {
    let directions = Directions::around(e, r);
    Estimate::new(SAMPLES, |i| {
        let made = e.select(r, pair(i, 0).x).and_then(|(id, ..)| e.sample_towards(id, r, pair(i, 1)));
        let w = directions.get(i);
        let mut sum = 0.0;
        trace(e, r.position, w, triangles, |hit| {
            // where nothing is emitted there is no sample
            if hit.radiance != Vec3::ZERO {
                sum += (e.pdf_towards(r, w, &hit) * e.probability(r, hit.emitter)).value();
            }
        });
        sum as f64 * directions.solid_angle() + made.is_none() as u8 as f64
    })
}

/// Mean red irradiance over a disk around the receiver, by light paths that land on it.
fn light_paths(e: &Emitters, r: &Receiver, radius: f32) -> Estimate {
    let n = normal(r);
    Estimate::new(SAMPLES, |i| {
        let Some((id, p, _)) = e.select_emission(pair(i, 0).x) else { return 0.0 };
        let Some(s) = e.sample_from(id, pair(i, 3), pair(i, 4)) else { return 0.0 };
        let distance = (r.position - s.origin).dot(n) / s.direction.dot(n);
        let at = s.origin + s.direction * distance;
        let lands = s.direction.dot(n) < 0.0 && distance > 0.0 && at.distance(r.position) < radius;
        let flux = s.emission.flux().x / p.value();
        if lands { flux as f64 / (PI * (radius as f64).powi(2)) } else { 0.0 }
    })
}

/// Mean red irradiance over the same disk, by next event.
fn next_event_over_disk(e: &Emitters, r: &Receiver, radius: f32) -> Estimate {
    let frame = segue::math::Frame::from_normal(normal(r));
    Estimate::new(SAMPLES, |i| {
        let d = segue::math::warp::concentric_disk(pair(i, 5)) * radius;
        let r = Receiver { position: r.position + frame.to_world(d.extend(0.0)), ..*r };
        let Some((id, p, _)) = e.select(&r, pair(i, 0).x) else { return 0.0 };
        let Some(s) = e.sample_towards(id, &r, pair(i, 1)) else { return 0.0 };
        (s.incident.estimate().x * normal(&r).dot(s.direction).max(0.0) / p.value()) as f64
    })
}

/// All comparisons for one light.
fn check(what: &str, json: &str, r: Receiver, expected: f64, disk: f32) {
    check_scene(what, &emitters_of(&[json], &[], &[]), &[], r, Some(expected), disk);
}

fn check_scene(
    what: &str,
    e: &Emitters,
    triangles: &[MeshTriangle],
    r: Receiver,
    expected: Option<f64>,
    disk: f32,
) {
    let direct = next_event(e, &r);
    if let Some(expected) = expected {
        direct.assert_is(expected, 2e-4, &format!("{what}, next event"));
    }
    let delta = (0..e.len() as u32).all(|i| {
        let s = e.sample_towards(segue::shading::emitters::EmitterId(i), &r, pair(i, 9));
        s.is_some_and(|s| matches!(s.incident, Incident::Delta { .. }))
    });
    if !delta {
        rays(e, &r, triangles).assert_agrees(direct, 2e-4, &format!("{what}, rays"));
        density_balance(e, &r, triangles).assert_is(1.0, 2e-4, &format!("{what}, density"));
    }
    let over_disk = next_event_over_disk(e, &r, disk);
    light_paths(e, &r, disk).assert_agrees(over_disk, 2e-4, &format!("{what}, light paths"));
}

const UP: [f64; 3] = [0.0, 0.0, 1.0];
const DOWN: [f64; 3] = [0.0, 0.0, -1.0];
const ONE: [f64; 3] = [1.0, 1.0, 1.0];

fn floor(x: f32, y: f32) -> Receiver {
    receiver([x, y, 0.0], [0.0, 0.0, 1.0])
}

fn origin(r: &Receiver) -> DVec3 {
    r.position.as_dvec3()
}

#[test]
fn rect_follows_lamberts_formula() {
    let json =
        |m: String| format!(r#"{{"type":"rect","width":2,"height":0.5,"radiance":[3,1,0],"transform":{m}}}"#);
    for (x, y) in [(0.0, 0.0), (0.9, 0.3), (1.7, -1.0)] {
        for h in [0.1, 1.0, 2.5] {
            let r = floor(x, y);
            let c =
                [[-1.0, -0.25], [1.0, -0.25], [1.0, 0.25], [-1.0, 0.25]].map(|[x, y]| DVec3::new(x, y, h));
            let expected = 3.0 * polygon(&c, origin(&r), DVec3::Z);
            check(
                &format!("rect at {x} {y} under {h}"),
                &json(transform([0.0, 0.0, h], DOWN, ONE)),
                r,
                expected,
                0.2,
            );
        }
    }
}

#[test]
fn sheared_rect_is_a_parallelogram() {
    let m = glam::DAffine3::from_mat3_translation(
        glam::DMat3::from_cols(DVec3::new(1.0, 0.2, 0.1), DVec3::new(-0.6, 0.8, 0.0), DVec3::Z),
        DVec3::new(0.2, 0.1, 1.0),
    );
    let (x, y, c) = (m.matrix3.x_axis, m.matrix3.y_axis, m.translation);
    let corners = [-x - y, x - y, x + y, y - x].map(|d| c + d * 0.5);
    let r = floor(0.1, -0.3);
    let json = format!(r#"{{"type":"rect","radiance":[1,1,1],"transform":{}}}"#, rows(&m));
    check("parallelogram", &json, r, polygon(&corners, origin(&r), DVec3::Z), 0.2);
    // a mirrored one still shines along its -z
    let mirrored =
        glam::DAffine3::from_mat3_translation(glam::DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), c);
    let json = format!(r#"{{"type":"rect","radiance":[1,1,1],"transform":{}}}"#, rows(&mirrored));
    let corners =
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| c + DVec3::new(x, y, 0.0));
    check("mirrored rect", &json, r, polygon(&corners, origin(&r), DVec3::Z), 0.2);
}

#[test]
fn disk_follows_its_closed_form() {
    for (radius, h) in [(0.5, 1.0), (2.0, 0.3), (0.01, 1.5)] {
        let m = transform([0.0, 0.0, h], DOWN, ONE);
        let json = format!(r#"{{"type":"disk","radius":{radius},"radiance":[2,1,1],"transform":{m}}}"#);
        let expected = 2.0 * PI * radius * radius / (radius * radius + h * h);
        check(&format!("disk of {radius} under {h}"), &json, floor(0.0, 0.0), expected, 0.2);
    }
}

#[test]
fn scaled_disk_is_an_ellipse() {
    let m = glam::DAffine3::from_mat3_translation(
        glam::DMat3::from_cols(DVec3::new(1.2, 0.3, 0.0), DVec3::new(0.5, 0.7, 0.2), DVec3::Z),
        DVec3::new(0.0, 0.3, 1.1),
    );
    let r = floor(0.4, 0.2);
    let outline = ellipse(m.translation, m.matrix3.x_axis * 0.5, m.matrix3.y_axis * 0.5);
    let json = format!(r#"{{"type":"disk","radiance":[1,1,1],"transform":{}}}"#, rows(&m));
    check("ellipse", &json, r, polygon(&outline, origin(&r), DVec3::Z), 0.2);
}

#[test]
fn sphere_above_the_horizon_follows_the_cosine_law() {
    for (radius, at) in [
        (0.5f64, DVec3::new(0.3, 0.4, 1.0)),
        (0.9, DVec3::new(0.0, 0.1, 0.95)),
        (0.01, DVec3::new(1.0, 0.0, 1.0)),
    ] {
        let m = transform(at.to_array(), UP, ONE);
        let json = format!(r#"{{"type":"sphere","radius":{radius},"radiance":[5,1,1],"transform":{m}}}"#);
        let d = at.length();
        let expected = 5.0 * PI * (radius / d).powi(2) * at.z / d;
        check(&format!("sphere of {radius}"), &json, floor(0.0, 0.0), expected, 0.05);
    }
}

#[test]
fn sphere_cut_by_the_horizon() {
    let (radius, at) = (0.6, DVec3::new(1.0, 0.0, 0.2));
    let m = transform(at.to_array(), UP, ONE);
    let json = format!(r#"{{"type":"sphere","radius":{radius},"radiance":[1,1,1],"transform":{m}}}"#);
    let expected = surface(1500, sphere(at, radius), |_| 1.0, DVec3::ZERO, DVec3::Z);
    check("sphere on the horizon", &json, floor(0.0, 0.0), expected, 0.1);
}

#[test]
fn cylinder_agrees_with_quadrature() {
    for (at, axis, radius) in [
        (DVec3::new(0.2, 0.1, 0.8), DVec3::X * 2.0, 0.1),
        (DVec3::new(0.5, 0.0, 0.5), DVec3::new(0.3, 0.2, 1.0), 0.3),
    ] {
        let x = axis.normalize();
        let (y, z) = x.any_orthonormal_pair();
        let m = glam::DAffine3::from_mat3_translation(glam::DMat3::from_cols(x, y, z), at);
        let json = format!(
            r#"{{"type":"cylinder","radius":{radius},"length":{},"radiance":[2,1,1],"transform":{}}}"#,
            axis.length(),
            rows(&m)
        );
        let expected = 2.0 * surface(1000, cylinder(at, axis, radius), |_| 1.0, DVec3::ZERO, DVec3::Z);
        check(&format!("cylinder of {radius}"), &json, floor(0.0, 0.0), expected, 0.1);
    }
}

#[test]
fn point_and_spot_follow_the_inverse_square() {
    let m = transform([0.5, 0.0, 2.0], DOWN, ONE);
    let (d2, cos) = (4.25, 2.0 / 4.25f64.sqrt());
    let json = format!(r#"{{"type":"point","intensity":[7,1,1],"transform":{m}}}"#);
    check("point", &json, floor(0.0, 0.0), 7.0 * cos / d2, 0.2);
    for (size, blend) in [(0.6, 0.0), (0.6, 0.7), (3.0, 1.0), (5.0, 0.5)] {
        let json = format!(
            r#"{{"type":"point","intensity":[7,1,1],"transform":{m},"shaping":{{"spot_size":{size},"spot_blend":{blend}}}}}"#
        );
        let to = DVec3::new(-0.5, 0.0, -2.0).normalize();
        let expected = 7.0 * spot(DVec3::NEG_Z, size, blend)(to) * cos / d2;
        check(&format!("spot {size} {blend}"), &json, floor(0.0, 0.0), expected, 0.05);
    }
}

#[test]
fn shaped_lights_agree_with_quadrature() {
    let at = DVec3::new(0.2, 0.1, 1.0);
    let axis = DVec3::NEG_Z;
    let m = transform(at.to_array(), DOWN, ONE);
    type Profile = Box<dyn Fn(DVec3) -> f64>;
    let profiles: [(&str, Profile); 6] = [
        (r#"{"cone_angle":0.5,"cone_softness":0.4}"#, Box::new(lux(axis, 0.5, 0.4, 0.0))),
        (r#"{"cone_angle":1.2,"focus":5}"#, Box::new(lux(axis, 1.2, 0.0, 5.0))),
        (r#"{"cone_angle":0.7,"focus":2,"cone_softness":1.5}"#, Box::new(lux(axis, 0.7, 1.5, 2.0))),
        (r#"{"spot_size":1.4,"spot_blend":0.5}"#, Box::new(spot(axis, 1.4, 0.5))),
        (r#"{"spread":0.6}"#, Box::new(spread(axis, 0.6))),
        (r#"{"spread":2.8}"#, Box::new(spread(axis, 2.8))),
    ];
    let r = floor(0.1, 0.0);
    let (x, n) = (origin(&r), DVec3::Z);
    for (shaping, profile) in &profiles {
        let shapes = [
            (
                r#""rect","width":0.8"#,
                surface(1000, parallelogram(at, -DVec3::X * 0.8, DVec3::Y), profile, x, n),
            ),
            (r#""disk""#, surface(1000, ellipse_area(at, -DVec3::X * 0.5, DVec3::Y * 0.5), profile, x, n)),
            (r#""sphere","radius":0.3"#, surface(1000, sphere(at, 0.3), profile, x, n)),
            (r#""cylinder","radius":0.2"#, surface(1000, cylinder(at, DVec3::X, 0.2), profile, x, n)),
        ];
        for (shape, expected) in shapes {
            let json =
                format!(r#"{{"type":{shape},"radiance":[1,1,1],"transform":{m},"shaping":{shaping}}}"#);
            // the reference's own error at the cone's edge
            let e = emitters_of(&[&json], &[], &[]);
            next_event(&e, &r).assert_is(expected, 2e-3, &format!("{shape} {shaping}"));
            check_scene(&format!("{shape} {shaping}"), &e, &[], r, None, 0.1);
        }
    }
}

#[test]
fn focus_tint_colours_the_off_axis_light() {
    let m = transform([0.0, 0.0, 1.0], DOWN, ONE);
    let json = format!(
        r#"{{"type":"point","intensity":[1,1,1],"transform":{m},"shaping":{{"cone_angle":1.5,"focus":3,"focus_tint":[0.5,0,1]}}}}"#
    );
    let e = emitters_of(&[&json], &[], &[]);
    let r = floor(1.0, 0.0);
    let Incident::Delta { irradiance } = e.sample_towards(FIRST, &r, pair(0, 0)).unwrap().incident else {
        panic!("a point light is a delta light")
    };
    let f = 0.5f32.sqrt().powi(3);
    let expected = Vec3::new(0.5 + 0.5 * f, f, 1.0) * 0.5;
    assert!((irradiance - expected).abs().max_element() < 1e-5, "{irradiance}");
    check_scene("tinted point", &e, &[], r, None, 0.1);
}

#[test]
fn distant_lights_give_their_irradiance() {
    let forward = [0.3, 0.1, -0.8];
    let cos = 0.8 / (0.09f64 + 0.01 + 0.64).sqrt();
    for angle in [0.0, 0.009, 0.5] {
        let m = transform([5.0, 5.0, 5.0], forward, ONE);
        let json = format!(r#"{{"type":"distant","angle":{angle},"irradiance":[4,1,1],"transform":{m}}}"#);
        check(&format!("distant of {angle}"), &json, floor(0.0, 0.0), 4.0 * cos, 0.5);
    }
    let m = transform([0.0; 3], forward, ONE);
    let json = format!(r#"{{"type":"distant","angle":0.5,"radiance":[4,1,1],"transform":{m}}}"#);
    let expected = 4.0 * PI * 0.25f64.sin().powi(2) * cos;
    check("distant by radiance", &json, floor(0.0, 0.0), expected, 0.5);
    // a whole sphere of directions
    let json = r#"{"type":"distant","angle":6.283185307,"radiance":[1,1,1]}"#;
    check("distant all around", json, floor(0.0, 0.0), PI, 0.5);
}

#[test]
fn constant_dome_gives_pi() {
    check("dome", r#"{"type":"dome","radiance":[2,1,1]}"#, floor(0.3, 0.0), 2.0 * PI, 0.5);
    let e = emitters_of(
        &[r#"{"type":"dome","radiance":[2,1,1],"image":0}"#],
        &[],
        &[image(16, 8, |_, _| [0.5; 3])],
    );
    check_scene("dome with a constant image", &e, &[], floor(0.0, 0.0), Some(PI), 0.5);
    // without a normal all directions are sampled
    let e = emitters_of(&[r#"{"type":"dome","radiance":[1,1,1]}"#], &[], &[]);
    let r = Receiver { normal: None, ..floor(0.0, 0.0) };
    let all = Estimate::new(2000, |i| {
        e.sample_towards(FIRST, &r, pair(i, 0)).unwrap().incident.estimate().x as f64
    });
    all.assert_is(4.0 * PI, 1e-5, "fluence of a dome");
}

#[test]
fn dome_image_is_sampled_consistently() {
    let map = image(37, 18, |x, y| [(x * y % 7) as f32, 0.3, if (x, y) == (9, 4) { 500.0 } else { 0.0 }]);
    let m = transform([0.0; 3], [0.3, -0.5, 0.2], [-1.0, 1.0, 1.0]);
    let json = format!(r#"{{"type":"dome","radiance":[1,1,1],"image":0,"transform":{m}}}"#);
    check_scene("dome image", &emitters_of(&[&json], &[], &[map]), &[], floor(0.0, 0.0), None, 0.5);
}

#[test]
fn rect_image_is_sampled_consistently() {
    let map = image(5, 4, |x, y| [(x * x + y) as f32, 1.0, if (x, y) == (1, 3) { 90.0 } else { 0.0 }]);
    let m = transform([0.2, 0.3, 1.0], DOWN, ONE);
    let json = format!(r#"{{"type":"rect","radiance":[1,1,1],"image":0,"transform":{m}}}"#);
    check_scene("rect image", &emitters_of(&[&json], &[], &[map]), &[], floor(0.0, 0.0), None, 0.2);
}

#[test]
fn triangles_follow_lamberts_formula() {
    let vertices = [Vec3::new(-0.5, -0.4, 1.0), Vec3::new(0.1, 0.9, 0.8), Vec3::new(0.8, -0.3, 1.2)];
    let r = floor(0.1, 0.0);
    let expected = polygon(&vertices.map(|v| v.as_dvec3()), origin(&r), DVec3::Z);
    // far away, where points are chosen by area
    let small = vertices.map(|v| v * 0.1 + Vec3::Z);
    let t =
        [MeshTriangle { instance: 0, triangle: 0, vertices: small, radiance: Vec3::ONE, two_sided: false }];
    let far = polygon(&small.map(|v| v.as_dvec3()), origin(&r), DVec3::Z);
    check_scene("small triangle", &emitters_of(&[], &t, &[]), &t, r, Some(far), 0.2);
    for two_sided in [false, true] {
        let t = [MeshTriangle {
            instance: 3,
            triangle: 5,
            vertices,
            radiance: Vec3::new(2.0, 1.0, 1.0),
            two_sided,
        }];
        let e = emitters_of(&[], &t, &[]);
        check_scene("triangle", &e, &t, r, Some(2.0 * expected), 0.2);
    }
    let flipped = [vertices[0], vertices[2], vertices[1]];
    let t = |two_sided| MeshTriangle {
        instance: 0,
        triangle: 0,
        vertices: flipped,
        radiance: Vec3::ONE,
        two_sided,
    };
    assert_eq!(next_event(&emitters_of(&[], &[t(false)], &[]), &r).mean, 0.0);
    let e = emitters_of(&[], &[t(true)], &[]);
    check_scene("triangle from behind", &e, &[t(true)], r, Some(expected), 0.2);
}

#[test]
fn many_lights_at_once() {
    let t = [MeshTriangle {
        instance: 0,
        triangle: 1,
        vertices: [Vec3::new(-0.5, -0.4, 1.0), Vec3::new(0.1, 0.9, 0.8), Vec3::new(0.8, -0.3, 1.2)],
        radiance: Vec3::ONE,
        two_sided: false,
    }];
    let lights = [
        format!(
            r#"{{"type":"rect","radiance":[1,1,1],"transform":{}}}"#,
            transform([0.0, 0.0, 1.0], DOWN, ONE)
        ),
        format!(
            r#"{{"type":"sphere","radius":0.2,"radiance":[3,1,1],"transform":{}}}"#,
            transform([1.0, 0.5, 0.7], UP, ONE)
        ),
        format!(
            r#"{{"type":"distant","angle":0.3,"irradiance":[1,1,1],"transform":{}}}"#,
            transform([0.0; 3], [0.1, 0.4, -1.0], ONE)
        ),
        r#"{"type":"dome","radiance":[0.3,1,1]}"#.to_string(),
        format!(
            r#"{{"type":"point","intensity":[1,1,1],"transform":{}}}"#,
            transform([1.0, 0.5, 0.7], UP, ONE)
        ),
    ];
    let json: Vec<&str> = lights.iter().map(String::as_str).collect();
    let r = floor(0.0, 0.0);
    let each = |i: usize| next_event(&emitters_of(&json[i..=i], &[], &[]), &r);
    let mut sum = next_event(&emitters_of(&[], &t, &[]), &r);
    for e in (0..lights.len()).map(each) {
        sum = Estimate { mean: sum.mean + e.mean, error: sum.error.hypot(e.error) };
    }
    let e = emitters_of(&json, &t, &[]);
    next_event(&e, &r).assert_agrees(sum, 1e-5, "all at once");
    let paths = light_paths(&e, &r, 0.2);
    paths.assert_agrees(next_event_over_disk(&e, &r, 0.2), 1e-4, "light paths of all");
    assert!(e.total_power().x > 0.0);
}

/// On a facet of a closed room whose walls glow to both sides, all directions shine, but for those of the facet itself:
/// seen from its own plane it sends nothing, wherever rounding puts its points.
#[test]
fn a_wall_of_a_glowing_room_gets_no_light_from_itself() {
    let radius = |k: usize| Vec3::new(3.0, 2.0, 2.5)[k];
    let triangles: Vec<MeshTriangle> = (0..8u32)
        .map(|octant| {
            let corner = |k: usize| Vec3::AXES[k] * radius(k) * if octant >> k & 1 == 0 { 1.0 } else { -1.0 };
            MeshTriangle {
                instance: 0,
                triangle: octant,
                vertices: [0, 1, 2].map(corner),
                radiance: Vec3::ONE,
                two_sided: true,
            }
        })
        .collect();
    let e = emitters_of(&[], &triangles, &[]);
    for (own, at) in [(0, [0.3, 0.3]), (3, [0.05, 0.1]), (5, [0.48, 0.5]), (6, [0.8, 0.15])] {
        let [a, b, c] = triangles[own].vertices;
        let x = a + (b - a) * at[0] + (c - a) * at[1];
        let n = (b - a).cross(c - a).normalize();
        let r = Receiver { position: x, normal: Some(if n.dot(x) > 0.0 { -n } else { n }) };
        next_event(&e, &r).assert_is(PI, 1e-3, &format!("facet {own}"));
    }
}
