//! Uniform sampling of the solid angle of a rectangle (Ureña, Fajardo and King 2013, "An Area-Preserving
//! Parametrization for Spherical Rectangles").

use glam::{DVec2, Vec2};
use std::f64::consts::TAU;

/// A rectangle on the plane `z = z0`, seen from the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct SphericalRect {
    low: DVec2,
    high: DVec2,
    z0: f64,
    b0: f64,
    b1: f64,
    k: f64,
    solid_angle: f64,
}

impl SphericalRect {
    /// The rectangle from `low` to `high` at distance `height` above zero from the plane.
    pub fn new(low: DVec2, high: DVec2, height: f64) -> Self {
        let z0 = -height;
        // z components of the normals of the planes through the origin and the edges (eq. 5 ff.)
        let slope = |v: f64| v / v.hypot(z0);
        let (n0, n1, n2, n3) = (-slope(low.y), slope(high.x), slope(high.y), -slope(low.x));
        let angle = |a: f64, b: f64| (-a * b).clamp(-1.0, 1.0).acos();
        let k = TAU - angle(n2, n3) - angle(n3, n0);
        let solid_angle = angle(n0, n1) + angle(n1, n2) - k;
        Self { low, high, z0, b0: n0, b1: n2, k, solid_angle }
    }

    /// Solid angle, sr. Its absolute error is some 1e-15.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Point of the rectangle's plane, uniform in solid angle (eqs. 12 to 16).
    pub fn sample(&self, u: Vec2) -> DVec2 {
        let au = u.x as f64 * self.solid_angle + self.k;
        let (sin, cos) = au.sin_cos();
        let fu = (cos * self.b0 - self.b1) / sin;
        let cu = (1.0f64.copysign(fu) / fu.hypot(self.b0)).clamp(-1.0, 1.0);
        let x = (-cu * self.z0 / ((1.0 - cu * cu).sqrt()).max(1e-150)).clamp(self.low.x, self.high.x);
        let d = x.hypot(self.z0);
        let (h0, h1) = (self.low.y / self.low.y.hypot(d), self.high.y / self.high.y.hypot(d));
        let h = h0 + u.y as f64 * (h1 - h0);
        let y = (h * d / ((1.0 - h * h).max(0.0).sqrt()).max(1e-150)).clamp(self.low.y, self.high.y);
        DVec2::new(x, y)
    }
}
