//! Quadrature and sampling of lobes, for their tests.

use super::Lobe;
use crate::math::sampler::hash_unit;
use glam::{DVec3, Vec3};
use std::f32::consts::TAU;

/// Unit vector of the given cosine to the normal, at the angle `phi` around it.
pub fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Integral over the projected solid angle of the hemisphere on the side of `side`: midpoints, denser
/// towards the horizon.
pub fn hemisphere_integral(side: f32, f: impl Fn(Vec3) -> Vec3) -> Vec3 {
    const RINGS: u32 = 400;
    const STEPS: u32 = 200;
    let mut sum = DVec3::ZERO;
    for i in 0..RINGS {
        let s = (i as f32 + 0.5) / RINGS as f32;
        let z = s * s;
        let area = 2.0 * s * z / RINGS as f32 * (TAU / STEPS as f32);
        for k in 0..STEPS {
            let phi = TAU * (k as f32 + 0.5) / STEPS as f32;
            sum += (f(direction(z.copysign(side), phi)) * area).as_dvec3();
        }
    }
    sum.as_vec3()
}

/// Integral of a lobe's density over the hemisphere on the side of `side`.
pub fn pdf_integral(lobe: &Lobe, from: Vec3, side: f32) -> f32 {
    hemisphere_integral(side, |to| Vec3::splat(lobe.pdf(from, to).0)).x
}

/// Mean weight of `count` independent draws and its standard error.
pub fn sampled_albedo(lobe: &Lobe, from: Vec3, count: u32) -> (Vec3, Vec3) {
    let draw = |i: u32| {
        let u = Vec3::new(hash_unit(i, 10), hash_unit(i, 11), hash_unit(i, 12));
        lobe.sample(from, u).map_or(Vec3::ZERO, |s| s.weight())
    };
    mean(count, draw)
}

/// Mean of `f` at 0, 1, ... and its standard error.
pub fn mean(count: u32, f: impl Fn(u32) -> Vec3) -> (Vec3, Vec3) {
    let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
    for i in 0..count {
        let v = f(i).as_dvec3();
        sum += v;
        squares += v * v;
    }
    let n = f64::from(count);
    let mean = sum / n;
    let variance = (squares / n - mean * mean).max(DVec3::ZERO);
    (mean.as_vec3(), (variance / n).map(f64::sqrt).as_vec3())
}
