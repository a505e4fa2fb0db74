//! The coordinates of rays that leave emitters, and densities learnt over them.

use super::support::*;
use glam::{DAffine3, Vec2, Vec3};
use segue::shading::emitters::{
    Draw, EmissionGuide, EmitterHit, EmitterId, Emitters, Lesson, MeshTriangle, Receiver,
};

const SHAPES: [&str; 4] = [
    r#""type":"rect","width":1.5"#,
    r#""type":"disk","radius":0.6"#,
    r#""type":"sphere","radius":0.4"#,
    r#""type":"cylinder","radius":0.2,"length":1.4"#,
];
const SHAPINGS: [&str; 4] = [
    "",
    r#","shaping":{"cone_angle":40,"cone_softness":0.2}"#,
    r#","shaping":{"focus":3}"#,
    r#","shaping":{"cone_angle":120}"#,
];

fn triangle(two_sided: bool) -> MeshTriangle {
    let vertices = [Vec3::new(0.1, 0.2, 0.5), Vec3::new(1.1, 0.1, 0.9), Vec3::new(0.3, 1.0, 0.2)];
    MeshTriangle { instance: 0, triangle: 0, vertices, radiance: Vec3::ONE, two_sided }
}

/// A ray that leaves an emitter at a point.
fn left(emitter: EmitterId, point: Vec3, normal: Vec3) -> EmitterHit {
    EmitterHit { emitter, distance: 1.0, point, normal, radiance: Vec3::ONE }
}

/// Where a ray meets a light first.
fn met(e: &Emitters, origin: Vec3, direction: Vec3) -> EmitterHit {
    let mut nearest: Option<EmitterHit> = None;
    e.for_each_hit(origin, direction, f32::INFINITY, |hit| {
        if nearest.is_none_or(|n| hit.distance < n.distance) {
            nearest = Some(hit);
        }
    });
    nearest.expect("the ray leads to the light")
}

/// What a ray was drawn from, told from the ray alone.
fn told(e: &Emitters, id: EmitterId, place: Vec2, direction: Vec2) -> Option<Draw> {
    let s = e.sample_from(id, place, direction)?;
    // of a light at infinity, the ray may be met anywhere
    let point = if e.is_infinite(id) { s.origin + s.direction * 2.3 } else { s.origin };
    Some(e.draw_of(s.direction, &left(id, point, s.normal)))
}

/// `drawn`: whether the place and the direction of a ray matter.
fn check(what: &str, e: &Emitters, drawn: [bool; 2]) {
    let (mut worst, mut met) = (0f32, 0);
    for i in 0..4000 {
        let (u, v) = (pair(i, 0), pair(i, 1));
        let Some(draw) = told(e, FIRST, u, v) else { continue };
        met += 1;
        for (k, (a, b)) in draw.at.iter().zip([u.x, u.y, v.x, v.y]).enumerate() {
            if drawn[k / 2] {
                // angles are turns
                let off = (a - b).abs();
                worst = worst.max(off.min(1.0 - off));
            }
        }
    }
    assert!(met > 3000, "{what}: only {met} rays leave");
    assert!(worst < 4e-3, "{what}: {worst}");
}

#[test]
fn rays_tell_what_they_were_drawn_from() {
    let m = transform([0.2, 0.1, 0.5], [0.3, 0.2, -1.0], [1.0, 1.0, 1.0]);
    for shape in SHAPES {
        for shaping in SHAPINGS {
            let json = format!(r#"{{{shape},"radiance":[1,1,1],"transform":{m}{shaping}}}"#);
            check(&json, &emitters_of(&[&json], &[], &[]), [true; 2]);
        }
    }
    for shaping in SHAPINGS {
        let json = format!(r#"{{"type":"point","intensity":[1,1,1],"transform":{m}{shaping}}}"#);
        check(&json, &emitters_of(&[&json], &[], &[]), [false, true]);
    }
    let spot = format!(
        r#"{{"type":"point","intensity":[1,1,1],"transform":{m},"shaping":{{"spot_size":1,"spot_blend":0.3}}}}"#
    );
    check("spot", &emitters_of(&[&spot], &[], &[]), [false, true]);
    for two_sided in [false, true] {
        check("triangle", &emitters_of(&[], &[triangle(two_sided)], &[]), [true; 2]);
    }
    let map = image(7, 5, |x, y| [0.1 + x as f32, 0.2 + y as f32, ((x * y) % 3) as f32]);
    let rect = format!(r#"{{"type":"rect","radiance":[1,1,1],"image":0,"transform":{m}}}"#);
    check("image", &emitters_of(&[&rect], &[], std::slice::from_ref(&map)), [true; 2]);
}

#[test]
fn rays_from_infinity_tell_what_they_were_drawn_from() {
    let m = transform([0.0; 3], [0.3, 0.2, -1.0], [1.0, 1.0, 1.0]);
    let distant =
        |angle: &str| format!(r#"{{"type":"distant","irradiance":[1,1,1],"angle":{angle},"transform":{m}}}"#);
    check("beam", &emitters_of(&[&distant("0")], &[], &[]), [true, false]);
    for angle in ["1e-3", "0.2", "3"] {
        check(angle, &emitters_of(&[&distant(angle)], &[], &[]), [true; 2]);
    }
    let dome = format!(r#"{{"type":"dome","radiance":[1,1,1],"transform":{m}}}"#);
    check("dome", &emitters_of(&[&dome], &[], &[]), [true; 2]);
    let dome = format!(r#"{{"type":"dome","radiance":[1,1,1],"image":0,"transform":{m}}}"#);
    let map = image(9, 6, |x, y| [0.1 + x as f32, 0.2 + y as f32, ((x * y) % 3) as f32]);
    check("mapped dome", &emitters_of(&[&dome], &[], std::slice::from_ref(&map)), [true; 2]);
}

/// Every way a transform may point: along the axes and between them.
const FORWARDS: [[f64; 3]; 8] = [
    [1., 0., 0.],
    [-1., 0., 0.],
    [0., 1., 0.],
    [0., -1., 0.],
    [0., 0., 1.],
    [0., 0., -1.],
    [-0.6, -0.8, 0.],
    [0.3, 0.2, -1.],
];

fn assert_near(what: &str, a: &Draw, b: &Draw, tolerance: f32) {
    assert_eq!(a.emitter, b.emitter);
    for (x, y) in a.at.iter().zip(b.at) {
        let off = (x - y).abs();
        assert!(off.min(1.0 - off) < tolerance, "{what}: {a:?} {b:?}");
    }
}

/// What a camera's ray or a next-event segment meets is told alike, whichever way the light points.
#[test]
fn light_that_is_met_and_light_that_is_sampled_tell_the_same() {
    for forward in FORWARDS {
        let m = transform([0.2, 0.1, 0.5], forward, [1.0, 1.0, 1.0]);
        // the last one's tube stands upright as a rotation about y in double precision leaves it
        let upright = rows(&DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2));
        for (shape, m) in SHAPES.iter().map(|s| (s, &m)).chain([(&SHAPES[3], &upright)]) {
            let json = format!(r#"{{{shape},"radiance":[1,1,1],"transform":{m}}}"#);
            let e = emitters_of(&[&json], &[], &[]);
            let mut checked = 0;
            for i in 0..500 {
                let (u, v) = (pair(i, 0), pair(i, 1));
                let s = e.sample_from(FIRST, u, v).unwrap();
                let own = told(&e, FIRST, u, v).unwrap();
                let eye = s.origin + s.direction * 2.0;
                // grazing rays magnify rounding
                if s.direction.dot(s.normal) > 0.1 {
                    let hit = met(&e, eye, -s.direction);
                    assert_near(&json, &e.draw_of(s.direction, &hit), &own, 2e-3);
                    checked += 1;
                }
                let receiver = Receiver { position: eye, normal: None };
                if let Some(t) = e.sample_towards(FIRST, &receiver, u)
                    && t.direction.dot(t.normal) < -0.1
                {
                    let sampled = e.draw_of(-t.direction, &left(FIRST, t.point, t.normal));
                    let hit = met(&e, eye, t.direction);
                    assert_near(&json, &e.draw_of(-t.direction, &hit), &sampled, 2e-3);
                }
            }
            assert!(checked > 300, "{json}: {checked}");
        }
        let beam = format!(r#"{{"type":"distant","irradiance":[1,1,1],"transform":{m}}}"#);
        let e = emitters_of(&[&beam], &[], &[]);
        let receiver = Receiver { position: Vec3::new(0.3, -0.5, 0.8), normal: None };
        let at = |direction: Vec3| e.draw_of(direction, &left(FIRST, receiver.position, direction));
        let from = e.sample_from(FIRST, Vec2::ZERO, Vec2::ZERO).unwrap().direction;
        let towards = e.sample_towards(FIRST, &receiver, Vec2::ZERO).unwrap().direction;
        assert_near(&beam, &at(from), &at(-towards), 1e-5);
    }
}

#[test]
fn tiny_triangles_tell_what_their_rays_were_drawn_from() {
    for scale in [1e-3, 1e-6, 1e-9] {
        let t = triangle(false);
        let vertices = t.vertices.map(|v| v * scale);
        let e = emitters_of(&[], &[MeshTriangle { vertices, ..t }], &[]);
        check(&format!("triangle of {scale}"), &e, [true; 2]);
    }
}

/// Many kinds of light together, and how much their rays are worth.
fn scene() -> Emitters {
    let m = transform([0.2, 0.1, 0.5], [0.3, 0.2, -1.0], [1.0, 1.0, 1.0]);
    let rect = format!(r#"{{"type":"rect","radiance":[1,1,1],"transform":{m}}}"#);
    let point = format!(r#"{{"type":"point","intensity":[0.3,0.3,0.3],"transform":{m}}}"#);
    let sun = format!(r#"{{"type":"distant","irradiance":[0.1,0.1,0.1],"transform":{m}}}"#);
    let dome = r#"{"type":"dome","radiance":[0.02,0.02,0.02]}"#;
    let triangles: Vec<MeshTriangle> =
        (0..50).map(|t| MeshTriangle { triangle: t, ..triangle(t % 2 == 0) }).collect();
    emitters_of(&[&rect, &point, &sun, dome], &triangles, &[])
}

/// Most of it comes from small parts of a few emitters.
fn worth(d: &Draw) -> f32 {
    let [x, y, z, w] = d.at;
    match d.emitter.0 {
        0 => (-300.0 * ((z - 0.3).powi(2) + (w - 0.7).powi(2))).exp() * 5.0,
        1 => {
            if z > 0.9 {
                3.0 * w
            } else {
                0.0
            }
        }
        2 => (-90.0 * ((x - 0.5).powi(2) + (y - 0.1).powi(2))).exp() * 20.0,
        3 => x * z,
        e => {
            if e == 17 || e > 40 {
                1.0 + x
            } else {
                0.01
            }
        }
    }
}

fn draw(guide: &EmissionGuide, e: &Emitters, i: u32) -> Draw {
    guide.draw(e, pair(i, 2), pair(i, 0), pair(i, 1)).expect("something emits")
}

/// Guides that learnt once, and then again from what they drew.
fn learnt(e: &Emitters) -> EmissionGuide {
    let mut guide = EmissionGuide::default();
    for round in 0..3 {
        let lessons = (0..20_000).map(|i| {
            let d = draw(&guide, e, i + round * 20_000);
            Lesson { draw: d, worth: worth(&d) / guide.relative(&d) }
        });
        guide = EmissionGuide::learn(e, lessons.collect());
        assert!(!guide.is_empty());
    }
    guide
}

#[test]
fn guided_densities_are_those_of_their_draws() {
    let e = scene();
    let guide = learnt(&e);
    // what the emitters themselves draw has a mean density of one
    let plain = EmissionGuide::default();
    let n = 400_000;
    Estimate::new(n, |i| guide.relative(&draw(&plain, &e, i)) as f64).assert_is(1.0, 1e-5, "integral");
    // and any mean is the same, over either density
    let quantities: [fn(&Draw) -> f64; 4] = [
        |d| worth(d) as f64,
        |d| (d.at[0] * d.at[3]) as f64,
        |d| (d.emitter.0 as f64).sqrt(),
        |d| if d.emitter.0 == 1 { d.at[2] as f64 } else { 0.0 },
    ];
    for (k, q) in quantities.iter().enumerate() {
        let guided = Estimate::new(n, |i| {
            let d = draw(&guide, &e, i);
            q(&d) / guide.relative(&d) as f64
        });
        let plain = Estimate::new(n, |i| q(&draw(&plain, &e, i + n)));
        guided.assert_agrees(plain, 1e-5, &format!("quantity {k}"));
    }
}

#[test]
fn guides_find_what_is_worth_it() {
    let e = scene();
    let guide = learnt(&e);
    let plain = EmissionGuide::default();
    let n = 200_000;
    let guided = Estimate::new(n, |i| {
        let d = draw(&guide, &e, i);
        (worth(&d) / guide.relative(&d)) as f64
    });
    let by_power = Estimate::new(n, |i| worth(&draw(&plain, &e, i)) as f64);
    let gain = (by_power.error / guided.error).powi(2);
    assert!(gain > 5.0, "the variance falls by {gain}");
}

#[test]
fn guides_learn_nothing_from_nothing() {
    let e = scene();
    let plain = EmissionGuide::default();
    for worth in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let lessons = (0..1000).map(|i| Lesson { draw: draw(&plain, &e, i), worth });
        assert!(EmissionGuide::learn(&e, lessons.collect()).is_empty());
    }
    assert!(EmissionGuide::learn(&e, Vec::new()).is_empty());
    let dark = emitters_of(&[], &[], &[]);
    assert!(plain.draw(&dark, Vec2::splat(0.5), Vec2::ZERO, Vec2::ZERO).is_none());
}
