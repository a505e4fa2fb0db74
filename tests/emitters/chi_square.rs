//! Samples against densities, bin by bin, for every kind of emitter.

use super::support::*;
use glam::{Vec2, Vec3};
use segue::math::Frame;
use segue::math::sampler::hash_unit;
use segue::math::warp::uniform_cone;
use segue::shading::emitters::{Emission, EmitterHit, Emitters, Incident, MeshTriangle, Receiver};
use std::f32::consts::TAU;

const ACROSS: usize = 20;
const AROUND: usize = 20;
const SAMPLES: u32 = 200_000;
/// Points per bin, along each axis, at which densities are taken.
const FINE: u32 = 24;

/// Equal bins of the cone around `frame.n` whose half angle has `1 - cos` of `one_minus_cos`.
struct Bins {
    frame: Frame,
    one_minus_cos: f32,
}

impl Bins {
    /// A cone around given directions.
    fn around(directions: impl Iterator<Item = Vec3>) -> Self {
        let directions: Vec<Vec3> = directions.collect();
        let axis = directions.iter().sum::<Vec3>().normalize_or(Vec3::Z);
        let chord = directions.iter().map(|d| (*d - axis).length()).fold(0.0, f32::max) * 1.1;
        let one_minus_cos = if chord > 1.2 { 2.0 } else { chord * chord / 2.0 };
        Self { frame: Frame::from_normal(axis), one_minus_cos }
    }

    fn index(&self, direction: Vec3) -> Option<usize> {
        let d = self.frame.to_local(direction);
        // |d - z|^2 = 2 (1 - cos), exact for narrow cones
        let h = (d - Vec3::Z).length_squared() / 2.0 / self.one_minus_cos;
        let phi = (d.y.atan2(d.x) / TAU).rem_euclid(1.0);
        let (i, j) = ((h * ACROSS as f32) as usize, ((phi * AROUND as f32) as usize).min(AROUND - 1));
        (i < ACROSS).then_some(i * AROUND + j)
    }

    /// Integral of `pdf` over bin `bin`.
    fn integrate(&self, bin: usize, pdf: &impl Fn(Vec3) -> f64) -> f64 {
        let (i, j) = (bin / AROUND, bin % AROUND);
        let mut sum = 0.0;
        for k in 0..FINE * FINE {
            let cell = Vec2::new((k % FINE) as f32, (k / FINE) as f32);
            let jitter = Vec2::new(hash_unit(k, bin as u32), hash_unit(k, bin as u32 + 7919));
            let t = (cell + jitter) / FINE as f32;
            let u = Vec2::new((i as f32 + t.x) / ACROSS as f32, (j as f32 + t.y) / AROUND as f32);
            sum += pdf(self.frame.to_world(uniform_cone(u, self.one_minus_cos)));
        }
        let solid_angle = TAU as f64 * self.one_minus_cos as f64 / (ACROSS * AROUND) as f64;
        sum / (FINE * FINE) as f64 * solid_angle
    }
}

/// Fails where directions do not follow their density. `sample` may yield none: the density then
/// integrates to less than one.
fn check(what: &str, sample: impl Fn(u32) -> Option<Vec3>, pdf: impl Fn(Vec3) -> f64) {
    let bins = Bins::around((0..4000).filter_map(&sample));
    let n = SAMPLES as f64;
    let expected: Vec<f64> = (0..ACROSS * AROUND).map(|b| n * bins.integrate(b, &pdf)).collect();
    let mut observed = vec![0.0; ACROSS * AROUND];
    let mut outside = 0.0;
    for i in 0..SAMPLES {
        match sample(i).and_then(|d| bins.index(d)) {
            Some(b) => observed[b] += 1.0,
            None => outside += 1.0,
        }
    }
    // what is not in any bin, and bins of few, are pooled
    let (mut chi2, mut degrees) = (0.0, -1.0);
    let (mut rest_observed, mut rest_expected) = (outside, n - expected.iter().sum::<f64>());
    for (&o, &e) in observed.iter().zip(&expected) {
        if e < 20.0 {
            rest_observed += o;
            rest_expected += e;
        } else {
            chi2 += (o - e).powi(2) / e;
            degrees += 1.0;
        }
    }
    let tolerance = 4.5 * rest_expected.abs().sqrt() + 2e-3 * n;
    assert!(
        (rest_observed - rest_expected).abs() < tolerance,
        "{what}: {rest_observed} samples where {rest_expected} are expected"
    );
    assert!(degrees > 10.0, "{what}: the bins are too coarse");
    // Wilson and Hilferty's normal approximation
    let z = ((chi2 / degrees).cbrt() - (1.0 - 2.0 / (9.0 * degrees))) / (2.0f64 / (9.0 * degrees)).sqrt();
    assert!(z < 4.5, "{what}: chi square {chi2} with {degrees} degrees of freedom, z = {z}");
}

fn directions_towards(what: &str, e: &Emitters, r: Receiver) {
    let sample = |i: u32| {
        let s = e.sample_towards(FIRST, &r, pair(i, 0))?;
        let Incident::Radiance { pdf, .. } = s.incident else { panic!("{what} is a delta light") };
        assert!(pdf.value() > 0.0 && (s.direction.length() - 1.0).abs() < 1e-5);
        if s.distance.is_finite() {
            let scale = s.point.length().max(r.position.length());
            assert!((r.position + s.direction * s.distance - s.point).length() < 1e-5 * scale, "{what}");
        }
        Some(s.direction)
    };
    let pdf = |w: Vec3| {
        let mut sum = 0.0;
        let mut add = |hit: EmitterHit| {
            if hit.radiance != Vec3::ZERO {
                sum += e.pdf_towards(&r, w, &hit).value() as f64;
            }
        };
        e.for_each_hit(r.position, w, f32::INFINITY, &mut add);
        e.for_each_infinite(Vec3::ZERO, w, &mut add);
        sum
    };
    check(&format!("towards {what}"), sample, pdf);
}

/// Directions that leave one point of an emitter: the share of the étendue density that is theirs.
fn directions_from(what: &str, e: &Emitters) {
    let sample = |i: u32| Some(e.sample_from(FIRST, Vec2::new(0.3, 0.6), pair(i, 1))?.direction);
    let at = |w: Vec3| EmitterHit {
        emitter: FIRST,
        distance: 1.0,
        point: e.sample_from(FIRST, Vec2::new(0.3, 0.6), Vec2::splat(0.5)).unwrap().origin,
        normal: e.sample_from(FIRST, Vec2::new(0.3, 0.6), Vec2::splat(0.5)).unwrap().normal,
        radiance: Vec3::splat(w.x),
    };
    // normalised: the density of the point is a constant factor
    let bins = Bins::around((0..4000).filter_map(sample));
    let pdf = |w: Vec3| {
        let hit = at(w);
        (e.pdf_from(-w, &hit).value() * hit.normal.dot(w).abs()) as f64
    };
    let total: f64 = (0..ACROSS * AROUND).map(|b| bins.integrate(b, &pdf)).sum();
    check(&format!("from {what}"), sample, |w| pdf(w) / total);
}

const SHAPES: [&str; 5] = [
    r#""rect","width":1.5"#,
    r#""disk","radius":0.6"#,
    r#""sphere","radius":0.4"#,
    r#""cylinder","radius":0.2,"length":1.4"#,
    r#""disk","radius":3"#,
];

#[test]
fn directions_towards_shapes() {
    for shape in SHAPES {
        for (x, h) in [(0.1, 0.8), (1.5, 0.6)] {
            let m = transform([0.0, 0.0, h], [0.1, 0.2, -1.0], [1.0, 1.0, 1.0]);
            let json = format!(r#"{{"type":{shape},"radiance":[1,1,1],"transform":{m}}}"#);
            let r = receiver([x, 0.2, 0.0], [0.0, 0.0, 1.0]);
            directions_towards(&format!("{shape} from {x}"), &emitters_of(&[&json], &[], &[]), r);
        }
    }
}

#[test]
fn directions_towards_rects_chosen_by_area() {
    // a parallelogram, and a rectangle too small for its solid angle to matter
    let sheared = glam::DAffine3::from_mat3_translation(
        glam::DMat3::from_cols(
            glam::DVec3::new(1.0, 0.2, 0.1),
            glam::DVec3::new(-0.6, 0.8, 0.0),
            glam::DVec3::Z,
        ),
        glam::DVec3::new(0.2, 0.1, 1.0),
    );
    let small = transform([0.0, 0.0, 1.0], [0.1, 0.2, -1.0], [2e-3, 1e-3, 1.0]);
    for m in [rows(&sheared), small] {
        let json = format!(r#"{{"type":"rect","radiance":[1,1,1],"transform":{m}}}"#);
        let r = receiver([0.1, 0.2, 0.0], [0.0, 0.0, 1.0]);
        directions_towards(&format!("rect under {m}"), &emitters_of(&[&json], &[], &[]), r);
    }
}

#[test]
fn directions_towards_triangles() {
    for (scale, height) in [(1.0, 0.3), (0.1, 1.0)] {
        let vertices = [Vec3::ZERO, Vec3::X * scale, Vec3::new(0.3, -1.0, 0.5) * scale];
        let vertices = vertices.map(|v| v + Vec3::Z * height);
        let t = MeshTriangle { instance: 0, triangle: 0, vertices, radiance: Vec3::ONE, two_sided: false };
        let e = emitters_of(&[], &[t], &[]);
        let r = receiver([0.1, 0.2, 0.0], [0.0, 0.0, 1.0]);
        let [a, b, c] = vertices;
        let normal = (b - a).cross(c - a).normalize();
        let pdf = |w: Vec3| {
            let distance = (a - r.position).dot(normal) / w.dot(normal);
            let point = r.position + w * distance;
            let inside = |a: Vec3, b: Vec3| (b - a).cross(point - a).dot(normal) >= 0.0;
            if distance > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
                let hit = EmitterHit { emitter: FIRST, distance, point, normal, radiance: Vec3::ONE };
                e.pdf_towards(&r, w, &hit).value() as f64
            } else {
                0.0
            }
        };
        let sample = |i: u32| Some(e.sample_towards(FIRST, &r, pair(i, 0))?.direction);
        check(&format!("towards a triangle of {scale}"), sample, pdf);
    }
}

#[test]
fn directions_towards_shaped_lights() {
    for shape in SHAPES {
        for shaping in [r#"{"cone_angle":0.5}"#, r#"{"spread":1.0}"#] {
            let m = transform([0.0, 0.0, 0.8], [0.1, 0.2, -1.0], [1.0, 1.0, 1.0]);
            let json =
                format!(r#"{{"type":{shape},"radiance":[1,1,1],"transform":{m},"shaping":{shaping}}}"#);
            let r = receiver([0.1, 0.2, 0.0], [0.0, 0.0, 1.0]);
            directions_towards(&format!("{shape} {shaping}"), &emitters_of(&[&json], &[], &[]), r);
        }
    }
}

#[test]
fn directions_towards_infinity() {
    let r = receiver([0.0; 3], [0.2, 0.3, 1.0]);
    let map = || image(23, 11, |x, y| [(x % 5 + y) as f32, 0.1, if (x, y) == (7, 3) { 60.0 } else { 0.0 }]);
    let m = transform([0.0; 3], [0.3, -0.5, 0.2], [-1.0, 1.0, 1.0]);
    let image_dome = format!(r#"{{"type":"dome","radiance":[1,1,1],"image":0,"transform":{m}}}"#);
    directions_towards("dome image", &emitters_of(&[&image_dome], &[], &[map()]), r);
    let dome = r#"{"type":"dome","radiance":[1,1,1]}"#;
    directions_towards("dome", &emitters_of(&[dome], &[], &[]), r);
    directions_towards(
        "dome without a normal",
        &emitters_of(&[dome], &[], &[]),
        Receiver { normal: None, ..r },
    );
    for angle in [0.3, 0.009, 4.0] {
        let json = format!(r#"{{"type":"distant","angle":{angle},"irradiance":[1,1,1],"transform":{m}}}"#);
        directions_towards(&format!("distant of {angle}"), &emitters_of(&[&json], &[], &[]), r);
    }
}

#[test]
fn points_of_an_image_rect() {
    let map = image(6, 5, |x, y| [(x * y) as f32, 0.2, if (x, y) == (1, 3) { 40.0 } else { 0.0 }]);
    let m = transform([0.0, 0.0, 0.8], [0.1, 0.2, -1.0], [1.0, 1.0, 1.0]);
    let json = format!(r#"{{"type":"rect","radiance":[1,1,1],"image":0,"transform":{m}}}"#);
    let e = emitters_of(&[&json], &[], &[map]);
    directions_towards("rect image", &e, receiver([0.1, 0.2, 0.0], [0.0, 0.0, 1.0]));
}

#[test]
fn directions_from_emitters() {
    let m = transform([0.3, 0.0, 0.8], [0.1, 0.2, -1.0], [1.0, 1.0, 1.0]);
    for shape in &SHAPES[..4] {
        let json = format!(r#"{{"type":{shape},"radiance":[1,1,1],"transform":{m}}}"#);
        directions_from(shape, &emitters_of(&[&json], &[], &[]));
    }
    // flat lights under a cone; round ones choose the direction first and so have no fixed point
    for shape in &SHAPES[..2] {
        for shaping in
            [r#"{"cone_angle":0.5,"focus":7}"#, r#"{"cone_angle":3,"focus":1.5}"#, r#"{"spread":1.0}"#]
        {
            let json =
                format!(r#"{{"type":{shape},"radiance":[1,1,1],"transform":{m},"shaping":{shaping}}}"#);
            directions_from(&format!("{shape} {shaping}"), &emitters_of(&[&json], &[], &[]));
        }
    }
    let t = MeshTriangle {
        instance: 0,
        triangle: 0,
        vertices: [Vec3::ZERO, Vec3::X, Vec3::new(0.3, 1.0, 0.5)],
        radiance: Vec3::ONE,
        two_sided: false,
    };
    directions_from("triangle", &emitters_of(&[], &[t], &[]));
}

#[test]
fn directions_from_points() {
    let m = transform([0.3, 0.0, 0.8], [0.1, 0.2, -1.0], [1.0, 1.0, 1.0]);
    let pdf_of = |e: &Emitters, i: u32| match e.sample_from(FIRST, Vec2::ZERO, pair(i, 1)).unwrap().emission {
        Emission::Point { pdf, .. } => pdf.value() as f64,
        _ => panic!("a point light"),
    };
    for shaping in ["", r#","shaping":{"cone_angle":0.4}"#, r#","shaping":{"spot_size":0.3,"spot_blend":0}"#]
    {
        let json = format!(r#"{{"type":"point","intensity":[1,1,1],"transform":{m}{shaping}}}"#);
        let e = emitters_of(&[&json], &[], &[]);
        let (first, sample) = (pdf_of(&e, 0), |i: u32| e.sample_from(FIRST, Vec2::ZERO, pair(i, 1)));
        assert!((pdf_of(&e, 5) / first - 1.0).abs() < 1e-4, "uniform in its cone");
        let axis = Vec3::new(0.1, 0.2, -1.0).normalize();
        let inside = |w: Vec3| if 1.0 - w.dot(axis) < 1.0 / (TAU * first as f32) { first } else { 0.0 };
        check(&format!("from point {shaping}"), |i| sample(i).map(|s| s.direction), inside);
    }
}
