//! Maps from the unit square to the domains that are sampled, each with its density.

use super::ONE_MINUS_EPSILON;
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

/// The point of the unit square that [`concentric_disk`] takes to `d`.
pub fn square_of_disk(d: Vec2) -> Vec2 {
    let r = d.length();
    let o = match d.x.abs() > d.y.abs() {
        true => Vec2::new(r.copysign(d.x), r.copysign(d.x) / FRAC_PI_4 * (d.y / d.x).atan()),
        false if r > 0.0 => Vec2::new(r.copysign(d.y) / FRAC_PI_4 * (d.x / d.y).atan(), r.copysign(d.y)),
        false => Vec2::ZERO,
    };
    in_unit_square((o + 1.0) / 2.0)
}

/// Kept inside of the half open unit square, which rounding may leave.
pub fn in_unit_square(u: Vec2) -> Vec2 {
    u.clamp(Vec2::ZERO, Vec2::splat(ONE_MINUS_EPSILON))
}

/// Part of a full turn from +x towards +y.
pub fn turn_of(x: f32, y: f32) -> f32 {
    let turn = y.atan2(x) / TAU;
    if turn < 0.0 { (turn + 1.0).min(ONE_MINUS_EPSILON) } else { turn }
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

/// The point of the unit square that [`uniform_sphere`] takes to `d`.
pub fn square_of_sphere(d: Vec3) -> Vec2 {
    in_unit_square(Vec2::new((1.0 - d.z) / 2.0, turn_of(d.x, d.y)))
}

/// Uniform direction of the cone around +z whose half angle has `1 - cos` equal to
/// `one_minus_cos` (given so to stay exact for narrow cones).
pub fn uniform_cone(u: Vec2, one_minus_cos: f32) -> Vec3 {
    let h = u.x * one_minus_cos;
    let sin = (h * (2.0 - h)).max(0.0).sqrt();
    let (s, c) = (TAU * u.y).sin_cos();
    Vec3::new(sin * c, sin * s, 1.0 - h)
}

/// The point of the unit square that [`uniform_cone`] takes to `d`.
pub fn square_of_cone(d: Vec3, one_minus_cos: f32) -> Vec2 {
    let sin2 = d.x * d.x + d.y * d.y;
    // 1 - cos without its cancellation
    let h = if d.z > 0.0 { sin2 / (1.0 + d.z) } else { 1.0 - d.z };
    in_unit_square(Vec2::new(h / one_minus_cos, turn_of(d.x, d.y)))
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

/// The point of the unit square that [`uniform_triangle`] takes to `b`.
pub fn square_of_triangle(b: Vec2) -> Vec2 {
    in_unit_square(match b.y > b.x {
        true => Vec2::new(2.0 * b.x, b.x + b.y),
        false => Vec2::new(b.x + b.y, 2.0 * b.y),
    })
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
    fn maps_can_be_undone() {
        // not at poles, which have no longitude
        for u in points(20_000).map(|u| u * 0.99 + 0.005) {
            let back = |v: Vec2| assert!((u - v).abs().max_element() < 2e-3, "{u} {v}");
            back(square_of_disk(concentric_disk(u)));
            back(square_of_sphere(uniform_sphere(u)));
            back(square_of_triangle(uniform_triangle(u)));
            back(square_of_cone(uniform_cone(u, 0.3), 0.3));
            back(square_of_cone(uniform_cone(u, 1e-9), 1e-9));
            back(square_of_cone(uniform_cone(u, 1.7), 1.7));
        }
        assert_eq!(square_of_disk(Vec2::ZERO), Vec2::splat(0.5));
    }

    #[test]
    fn narrow_cones_keep_their_width() {
        // half the height of a cone of 1 - cos = 1e-9 is far below the epsilon of 1
        let d = uniform_cone(Vec2::new(0.5, 0.0), 1e-9);
        approx::assert_relative_eq!(d.x, 1e-9f32.sqrt(), max_relative = 1e-3);
    }
}
