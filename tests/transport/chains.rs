//! Chains of Dirac lobes conserve étendue `n^2 dA dw_perp`: the map from where and how a ray starts to where and how it
//! ends, in canonical coordinates (positions on a plane, index times the direction along it), has determinant one.

use crate::common::Stage;
use crate::support::{follow, ray, world};
use glam::{DMat4, DVec4, Vec2, Vec3};
use segue::math::Sampler;
use segue::math::sampler::hash_unit;
use segue::shading::World;
use segue::shading::bsdf::Walk;

const SCREEN: &str = r#"{"surface":{"type":"diffuse","color":0.5}}"#;

/// A slab with faces tilted against each other, between heights of about `low` and `low + 0.4`: its faces' outward
/// normals point out of it.
fn prism(s: &mut Stage, seed: u32, low: f32, material: u32) {
    let u = |d| 0.25 * (hash_unit(seed, d) - 0.5);
    let top = [(-4., -4., u(0)), (4., -4., u(1)), (4., 4., u(2))]
        .map(|(x, y, z)| Vec3::new(x, y, low + 0.4 + 3.0 * z));
    let bottom =
        [(-4., -4., u(3)), (4., 4., u(4)), (4., -4., u(5))].map(|(x, y, z)| Vec3::new(x, y, low + 3.0 * z));
    for corners in [top, bottom] {
        let mesh = s.mesh(&corners, &[0, 1, 2], None);
        s.place(mesh, material, DMat4::IDENTITY);
    }
}

/// Where the ray that starts at `x` with direction `p` (both along z = 3) ends, in canonical coordinates, and what
/// happened on the way: squeeze and number of passages.
fn end(world: &World, x: [f64; 4], seed: u32) -> Option<(DVec4, (u32, u32))> {
    let [x, y, px, py] = x.map(|v| v as f32);
    let direction = Vec3::new(px, py, -(1.0 - px * px - py * py).sqrt());
    let mut sampler = Sampler::new(seed, 0, 0);
    let (chain, end) = follow(world, ray(Vec3::new(x, y, 3.0), direction), Walk::Camera, &mut sampler);
    let end = end?;
    let n = end.hit.place.normal;
    let along = Vec2::new(end.hit.place.position.x, end.hit.place.position.y).as_dvec2();
    let slope = -end.wo.truncate().as_dvec2() * f64::from(chain.squeeze.sqrt().recip());
    assert!((n.z.abs() - 1.0).abs() < 1e-6, "the screen is level");
    Some((DVec4::new(along.x, along.y, slope.x, slope.y), (chain.squeeze.to_bits(), chain.passages)))
}

#[test]
fn etendue_is_conserved() {
    let (mut checked, mut immersed, mut longest) = (0, 0, 0);
    for seed in 0..60u32 {
        let mut s = Stage::default();
        let screen = s.material(SCREEN);
        let glass = s.material(r#"{"surface":{"type":"glass","ior":1.5}}"#);
        let dense = s.material(r#"{"surface":{"type":"glass","ior":1.9}}"#);
        prism(&mut s, 3 * seed, 1.6, glass);
        prism(&mut s, 3 * seed + 1, 0.6, dense);
        // the screen lies inside of the last glass in every other scene
        let at = if seed % 2 == 0 { 0.0 } else { -1.2 };
        prism(&mut s, 3 * seed + 2, -0.3, glass);
        let corners =
            [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| Vec3::new(x, y, at - 0.1));
        let mesh = s.mesh(&corners, &[0, 1, 2, 0, 2, 3], None);
        s.place(mesh, screen, DMat4::IDENTITY);
        let world = world(&mut s);
        for k in 0..20 {
            let u = |d| f64::from(hash_unit(1000 * seed + k, d)) - 0.5;
            let start = [1.5 * u(0) + 0.8, 1.5 * u(1) - 0.8, 0.6 * u(2), 0.6 * u(3)];
            let jacobian = |h: f64| {
                let (_, way) = end(&world, start, k)?;
                let mut columns = [DVec4::ZERO; 4];
                for (axis, column) in columns.iter_mut().enumerate() {
                    let mut ends = [DVec4::ZERO; 2];
                    for (e, sign) in ends.iter_mut().zip([1.0, -1.0]) {
                        let mut moved = start;
                        moved[axis] += sign * h;
                        let (there, its_way) = end(&world, moved, k)?;
                        if its_way != way {
                            return None;
                        }
                        *e = there;
                    }
                    *column = (ends[0] - ends[1]) / (2.0 * h);
                }
                Some((DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]).determinant(), way))
            };
            // where rays part on the way there is no derivative: two steps then disagree
            let (Some((coarse, way)), Some((fine, _))) = (jacobian(0.02), jacobian(0.01)) else { continue };
            if (coarse - fine).abs() > 0.02 {
                continue;
            }
            checked += 1;
            immersed += u32::from((f32::from_bits(way.0) - 1.0).abs() > 0.1);
            longest = longest.max(way.1);
            assert!((fine.abs() - 1.0).abs() < 0.01, "seed {seed}, ray {k}: {fine} after {way:?}");
        }
    }
    println!("{checked} chains, {immersed} of them ending in glass, of up to {longest} passages");
    assert!(checked > 300 && immersed > 50 && longest >= 6, "{checked} {immersed} {longest}");
}
