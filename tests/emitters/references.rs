//! Irradiance in closed form or by quadrature, from the written definitions and not from the engine.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Irradiance at `x` with normal `n` from a polygon of radiance 1, wholly above the horizon (Lambert
/// 1760): half the sum of the edges' angles times the cosine of their planes' normals to `n`.
pub fn polygon(corners: &[DVec3], x: DVec3, n: DVec3) -> f64 {
    let sum: f64 = (0..corners.len())
        .map(|i| {
            let a = (corners[i] - x).normalize();
            let b = (corners[(i + 1) % corners.len()] - x).normalize();
            let c = a.cross(b);
            // angle by atan2: acos has no precision left for the short edges of a fine polygon
            c.length().atan2(a.dot(b)) * c.normalize_or_zero().dot(n)
        })
        .sum();
    0.5 * sum.abs()
}

/// Corners of `center + a cos t + b sin t`.
pub fn ellipse(center: DVec3, a: DVec3, b: DVec3) -> Vec<DVec3> {
    const N: u32 = 40_000;
    (0..N).map(|i| TAU * i as f64 / N as f64).map(|t| center + a * t.cos() + b * t.sin()).collect()
}

/// Irradiance from a surface given by a map of the unit square to (point, normal times area element),
/// by the midpoint rule; `radiance` is a function of the direction of emission.
pub fn surface(
    steps: u32,
    point: impl Fn(f64, f64) -> (DVec3, DVec3),
    radiance: impl Fn(DVec3) -> f64,
    x: DVec3,
    n: DVec3,
) -> f64 {
    let cell = 1.0 / steps as f64;
    let mut sum = 0.0;
    for i in 0..steps {
        for j in 0..steps {
            let (p, element) = point((i as f64 + 0.5) * cell, (j as f64 + 0.5) * cell);
            let to = p - x;
            let w = to.normalize();
            let (cos_light, cos) = (-element.dot(w), n.dot(w));
            if cos_light > 0.0 && cos > 0.0 {
                sum += radiance(-w) * cos * cos_light / to.length_squared();
            }
        }
    }
    sum * cell * cell
}

/// Points and area elements of the side of a cylinder.
pub fn cylinder(center: DVec3, axis: DVec3, radius: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    let (s, t) = axis.normalize().any_orthonormal_pair();
    move |u, v| {
        let n = s * (TAU * u).cos() + t * (TAU * u).sin();
        (center + axis * (v - 0.5) + n * radius, n * (TAU * radius * axis.length()))
    }
}

/// Points and area elements of a sphere.
pub fn sphere(center: DVec3, radius: f64) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let (z, phi) = (1.0 - 2.0 * u, TAU * v);
        let r = (1.0 - z * z).sqrt();
        let n = DVec3::new(r * phi.cos(), r * phi.sin(), z);
        (center + n * radius, n * (4.0 * PI * radius * radius))
    }
}

/// Points and area elements of a parallelogram; the normal is `edge_x` cross `edge_y`.
pub fn parallelogram(center: DVec3, edge_x: DVec3, edge_y: DVec3) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| (center + edge_x * (u - 0.5) + edge_y * (v - 0.5), edge_x.cross(edge_y))
}

/// Points and area elements of an ellipse; the normal is `a` cross `b`.
pub fn ellipse_area(center: DVec3, a: DVec3, b: DVec3) -> impl Fn(f64, f64) -> (DVec3, DVec3) {
    move |u, v| {
        let (r, phi) = (u.sqrt(), TAU * v);
        (center + a * (r * phi.cos()) + b * (r * phi.sin()), a.cross(b) * PI)
    }
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// UsdLux ShapingAPI without a tint.
pub fn lux(axis: DVec3, cone: f64, softness: f64, focus: f64) -> impl Fn(DVec3) -> f64 {
    move |w| {
        let cos = w.dot(axis).clamp(-1.0, 1.0);
        let (angle, start) = (cos.acos(), cone * (1.0 - softness));
        let edge = match angle {
            a if a > cone => 0.0,
            a if a > start => 1.0 - smoothstep((a - start) / (cone - start)),
            _ => 1.0,
        };
        edge * if focus > 0.0 { cos.max(0.0).powf(focus) } else { 1.0 }
    }
}

/// Blender's spot.
pub fn spot(axis: DVec3, size: f64, blend: f64) -> impl Fn(DVec3) -> f64 {
    move |w| {
        let edge = (size / 2.0).cos();
        let d = w.dot(axis) - edge;
        if blend == 0.0 { (d >= 0.0) as u8 as f64 } else { smoothstep(d / ((1.0 - edge) * blend)) }
    }
}

/// Blender's spread: the open share of a grid of slats, scaled to keep the power of a flat light.
pub fn spread(axis: DVec3, full: f64) -> impl Fn(DVec3) -> f64 {
    move |w| {
        let (a, cos) = (full / 2.0, w.dot(axis));
        match cos > 0.0 {
            true => (a.tan() - (1.0 - cos * cos).max(0.0).sqrt() / cos).max(0.0) / (a.tan() - a),
            false => 0.0,
        }
    }
}
