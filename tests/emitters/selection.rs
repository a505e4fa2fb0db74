//! Choice among many emitters.

use super::support::*;
use glam::{Vec2, Vec3};
use segue::math::sampler::hash_unit;
use segue::shading::emitters::{EmitterId, Emitters, MeshTriangle, Receiver};

fn vector(i: u32, d: u32) -> Vec3 {
    Vec3::new(hash_unit(i, d), hash_unit(i, d + 1), hash_unit(i, d + 2))
}

fn direction(i: u32, d: u32) -> Vec3 {
    segue::math::warp::uniform_sphere(Vec2::new(hash_unit(i, d), hash_unit(i, d + 1)))
}

/// Lights of all bounded kinds, scattered in a box of 10, of very unequal brightness.
fn scattered(n: u32) -> Vec<String> {
    let light = |i: u32| {
        let (at, forward) = ((vector(i, 50) * 10.0).as_dvec3(), direction(i, 60).as_dvec3());
        let m = transform(at.to_array(), forward.to_array(), [1.0; 3]);
        let l = 10f32.powf(hash_unit(i, 70) * 4.0 - 2.0);
        let emission = format!(r#""radiance":[{l},{l},{l}],"transform":{m}"#);
        match i % 7 {
            0 => format!(r#"{{"type":"rect","width":0.2,{emission}}}"#),
            1 => format!(r#"{{"type":"disk","radius":0.3,{emission}}}"#),
            2 => format!(r#"{{"type":"sphere","radius":0.1,{emission}}}"#),
            3 => format!(r#"{{"type":"cylinder","radius":0.05,{emission}}}"#),
            4 => format!(r#"{{"type":"point","intensity":[{l},{l},{l}],"transform":{m}}}"#),
            5 => format!(r#"{{"type":"disk","radius":0.3,{emission},"shaping":{{"cone_angle":0.4}}}}"#),
            _ => format!(r#"{{"type":"sphere","radius":0.1,{emission},"shaping":{{"spot_size":1.0}}}}"#),
        }
    };
    (0..n).map(light).collect()
}

fn triangles(n: u32) -> Vec<MeshTriangle> {
    let triangle = |i: u32| {
        let a = vector(i, 80) * 10.0;
        MeshTriangle {
            instance: i % 3,
            triangle: i / 3,
            vertices: [a, a + direction(i, 90) * 0.1, a + direction(i, 92) * 0.1],
            radiance: Vec3::splat(1.0 + hash_unit(i, 95)),
            two_sided: i.is_multiple_of(2),
        }
    };
    (0..n).map(triangle).collect()
}

const FAR: [&str; 3] = [
    r#"{"type":"dome","radiance":[0.1,0.1,0.1]}"#,
    r#"{"type":"distant","angle":0.01,"irradiance":[3,3,3]}"#,
    r#"{"type":"distant","irradiance":[1,1,1],"transform":[1,0,0,0, 0,-1,0,0, 0,0,-1,0, 0,0,0,1]}"#,
];

fn scene(lights: u32, triangle_count: u32, far: bool) -> Emitters {
    let mut all = scattered(lights);
    if far {
        all.extend(FAR.iter().map(|s| s.to_string()));
    }
    let json: Vec<&str> = all.iter().map(String::as_str).collect();
    emitters_of(&json, &triangles(triangle_count), &[])
}

fn receivers(n: u32) -> impl Iterator<Item = Receiver> {
    (0..n).map(|i| Receiver {
        position: vector(i, 10) * 12.0 - 1.0,
        normal: if i % 4 == 0 { None } else { Some(direction(i, 20)) },
    })
}

fn all(e: &Emitters) -> impl Iterator<Item = EmitterId> {
    (0..e.len() as u32).map(EmitterId)
}

#[test]
fn probabilities_are_those_of_the_choice() {
    for (lights, triangles, far) in [(1, 0, true), (2, 0, false), (30, 40, true), (300, 0, false)] {
        let e = scene(lights, triangles, far);
        for r in receivers(20) {
            let n = 20_000;
            let mut count = vec![0u32; e.len()];
            let (mut none, mut fresh) = (0, 0.0);
            for i in 0..n {
                match e.select(&r, hash_unit(i, 1)) {
                    Some((id, p, u)) => {
                        assert!((0.0..1.0).contains(&u));
                        let again = e.probability(&r, id);
                        assert!((p.value() / again.value() - 1.0).abs() < 1e-4, "{p:?} {again:?}");
                        count[id.0 as usize] += 1;
                        fresh += u as f64;
                    }
                    None => none += 1,
                }
            }
            let sum: f64 = all(&e).map(|id| e.probability(&r, id).value() as f64).sum();
            let missed = none as f64 / n as f64;
            let error = (missed * (1.0 - missed) / n as f64).sqrt();
            assert!((sum + missed - 1.0).abs() < 1e-4 + 5.0 * error, "sum {sum}, none {missed}");
            for id in all(&e) {
                let expected = e.probability(&r, id).value() as f64 * n as f64;
                let off = (count[id.0 as usize] as f64 - expected).abs();
                assert!(
                    off <= 5.5 * expected.sqrt() + 1.0,
                    "{id:?}: {} for {expected}",
                    count[id.0 as usize]
                );
            }
            let made = (n - none) as f64;
            if made > 1000.0 {
                assert!((fresh / made - 0.5).abs() < 5.0 / (12.0 * made).sqrt() + 1e-3, "u is not uniform");
            }
        }
    }
}

#[test]
fn what_contributes_is_chosen() {
    let e = scene(200, 100, true);
    for r in receivers(200) {
        for id in all(&e) {
            let contributes = (0..8).any(|i| {
                let s = e.sample_towards(id, &r, pair(i, 0));
                s.is_some_and(|s| r.normal.is_none_or(|n| n.dot(s.direction) > 0.0))
            });
            if contributes {
                assert!(e.probability(&r, id).value() > 0.0, "{id:?} contributes to {r:?}");
            }
        }
    }
}

#[test]
fn a_single_light_is_chosen_with_certainty() {
    for json in scattered(7).iter().map(String::as_str).chain(FAR) {
        let e = emitters_of(&[json], &[], &[]);
        for r in receivers(5) {
            let (id, p, u) = e.select(&r, 0.625).unwrap();
            assert_eq!((id, p.value(), u, e.probability(&r, id).value()), (FIRST, 1.0, 0.625, 1.0));
        }
    }
    assert!(emitters_of(&[], &[], &[]).select(&receivers(1).next().unwrap(), 0.5).is_none());
}

#[test]
fn the_tree_beats_choice_by_power() {
    let e = scene(10_000, 0, false);
    let (mut gain, mut count) = (0.0, 0.0);
    for r in receivers(60) {
        let Some(n) = r.normal else { continue };
        // variance of the choice alone, by summing over all emitters what each sends on average
        let (mut total, mut by_tree, mut by_power) = (0.0, 0.0, 0.0);
        for id in all(&e) {
            let sent = Estimate::new(4, |i| {
                e.sample_towards(id, &r, pair(i, 2))
                    .map_or(0.0, |s| (s.incident.estimate().x * n.dot(s.direction).max(0.0)) as f64)
            });
            total += sent.mean;
            if sent.mean > 0.0 {
                by_tree += sent.mean.powi(2) / e.probability(&r, id).value() as f64;
                by_power += sent.mean.powi(2) / e.emission_probability(id).value() as f64;
            }
        }
        gain += ((by_power / total / total - 1.0) / (by_tree / total / total - 1.0)).ln();
        count += 1.0;
    }
    let gain: f64 = f64::exp(gain / count);
    println!("variance by power over variance by the tree: {gain}");
    assert!(gain > 5.0, "the tree gains a factor of {gain} only");
}

#[test]
fn emission_is_chosen_by_power() {
    let e = scene(50, 50, true);
    let total: f64 = all(&e).map(|id| e.power(id).x as f64).sum();
    assert!((total / e.total_power().x as f64 - 1.0).abs() < 1e-4);
    // grey lights: luminance is power
    for id in all(&e) {
        let share = e.power(id).x as f64 / total;
        assert!((e.emission_probability(id).value() as f64 - share).abs() < 1e-5, "{id:?}");
    }
}

#[test]
fn triangles_are_found_by_instance_and_index() {
    let mut t = triangles(300);
    t[7].radiance = Vec3::ZERO;
    let e = emitters_of(&["{\"type\":\"dome\",\"radiance\":[1,1,1]}"], &t, &[]);
    assert_eq!(e.len(), 300);
    for (i, t) in t.iter().enumerate() {
        match e.triangle(t.instance, t.triangle) {
            Some(id) => assert_eq!(e.triangle_of(id), Some((t.instance, t.triangle))),
            None => assert_eq!(i, 7),
        }
    }
    assert_eq!((e.triangle(3, 0), e.triangle(0, 100), e.triangle_of(FIRST)), (None, None, None));
}
