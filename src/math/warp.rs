//! Maps from the unit square to the domains that are sampled, each with its density.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, TAU};

/// Uniform point of the unit disk, concentric map (Shirley and Chiu 1997). Density 1/pi per area.
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let o = u * 2.0 - 1.0;
    if o == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (r, phi) = if o.x.abs() > o.y.abs() {
        (o.x, FRAC_PI_4 * (o.y / o.x))
    } else {
        (o.y, FRAC_PI_2 - FRAC_PI_4 * (o.x / o.y))
    };
    Vec2::new(phi.cos(), phi.sin()) * r
}

/// Direction of the upper hemisphere with density 1/pi per *projected* solid angle.
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = concentric_disk(u);
    d.extend((1.0 - d.length_squared()).max(0.0).sqrt())
}

/// Density of [`cosine_hemisphere`] per projected solid angle.
pub const COSINE_HEMISPHERE_PDF: f32 = FRAC_1_PI;

/// Uniform direction of the sphere. Density 1/(4 pi) per solid angle.
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Uniform direction of the cone around +z whose half angle has `1 - cos` equal to
/// `one_minus_cos` (given so to stay exact for narrow cones).
pub fn uniform_cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    let h = u.x * one_minus_cos;
    let sin = (h * (2.0 - h)).max(0.0).sqrt();
    let (s, c) = (TAU * u.y).sin_cos();
    Vec3::new(sin * c, sin * s, 1.0 - h)
}

/// Solid angle of the cone of [`uniform_cone`]; its density is the inverse.
pub fn cone_solid_angle(one_minus_cos: f32) -> f32 {
    TAU * one_minus_cos
}

/// Barycentrics `(b1, b2)` of a uniform point of a triangle, low-distortion map (Heitz 2019).
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    let (mut a, mut b) = (u.x, u.y);
    if b > a {
        a *= 0.5;
        b -= a;
    } else {
        b *= 0.5;
        a -= b;
    }
    Vec2::new(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;

    fn points(n: u32) -> impl Iterator<Item = Vec2> {
        (0..n).map(|i| Vec2::new(hash_unit(i, 0), hash_unit(i, 1)))
    }

    #[test]
    fn moments_match_the_densities() {
        let n = 200_000;
        let mean = |f: &dyn Fn(Vec2) -> f32| points(n).map(|u| f(u) as f64).sum::<f64>() / n as f64;
        // E[z] of the cosine hemisphere is 2/3, E[z^2] of the sphere 1/3, E[r^2] of the disk 1/2
        assert!((mean(&|u| cosine_hemisphere(u).z) - 2.0 / 3.0).abs() < 3e-3);
        assert!((mean(&|u| uniform_sphere(u).z.powi(2)) - 1.0 / 3.0).abs() < 3e-3);
        assert!((mean(&|u| concentric_disk(u).length_squared()) - 0.5).abs() < 3e-3);
        assert!((mean(&|u| uniform_triangle(u).x) - 1.0 / 3.0).abs() < 3e-3);
        assert!((mean(&|u| uniform_cone(u, 0.3).z) - 0.85).abs() < 3e-3);
    }

    #[test]
    fn narrow_cones_keep_their_width() {
        // half the height of a cone of 1 - cos = 1e-9 is far below the epsilon of 1
        let d = uniform_cone(Vec2::new(0.5, 0.0), 1e-9);
        approx::assert_relative_eq!(d.x, 1e-9f32.sqrt(), max_relative = 1e-3);
    }
}
