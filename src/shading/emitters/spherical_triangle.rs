//! Uniform sampling of the solid angle of a triangle (Arvo 1995, "Stratified Sampling of Spherical
//! Triangles").

use glam::{DVec3, Vec2};
use std::f64::consts::PI;

/// A triangle seen from the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalTriangle {
    /// Unit vectors to the corners.
    corners: [DVec3; 3],
    solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle of these corners. Its solid angle is not a number where one of them is the origin.
    pub fn new(corners: [DVec3; 3]) -> Self {
        let corners @ [a, b, c] = corners.map(|v| v / v.length());
        // Van Oosterom and Strackee 1983
        let half = a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        Self { corners, solid_angle: 2.0 * half }
    }

    /// Solid angle, sr.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Unit direction into the triangle, uniform in solid angle.
    pub fn sample(&self, u: Vec2) -> DVec3 {
        let [a, b, c] = self.corners;
        // inner angle at the first corner
        let (ab, ac) = (a.cross(b), a.cross(c));
        let (sin_a, cos_a) = ab.cross(ac).length().atan2(ab.dot(ac)).sin_cos();
        // the part triangle of area u S, whose third corner lies on the edge from a to c
        let (sin_s, cos_s) = (PI + u.x as f64 * self.solid_angle).sin_cos();
        let (sin, cos) = (sin_s * cos_a - cos_s * sin_a, cos_s * cos_a + sin_s * sin_a);
        let k1 = cos + cos_a;
        let k2 = sin - sin_a * a.dot(b);
        let cos_edge = (k2 + (k2 * cos - k1 * sin) * cos_a) / ((k2 * sin + k1 * cos) * sin_a);
        let cos_edge = cos_edge.clamp(-1.0, 1.0);
        let third = a * cos_edge + across(c, a) * (1.0 - cos_edge * cos_edge).sqrt();
        // along the arc from the second corner to the new third one
        let h = u.y as f64 * (1.0 - third.dot(b));
        b * (1.0 - h) + across(third, b) * (h * (2.0 - h)).max(0.0).sqrt()
    }
}

/// Unit part of `v` at right angles to `axis`.
fn across(v: DVec3, axis: DVec3) -> DVec3 {
    (v - axis * v.dot(axis)).normalize_or_zero()
}
