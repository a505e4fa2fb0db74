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
    /// Cosine and sine of the angle k at which sampling starts.
    start: DVec2,
    solid_angle: f64,
}

impl SphericalRect {
    /// The rectangle from `low` to `high` at distance `height` above zero from the plane.
    pub fn new(low: DVec2, high: DVec2, height: f64) -> Self {
        let z0 = -height;
        // z components of the normals of the planes through the origin and the edges (eq. 5 ff.)
        let length = |v: f64| (v * v + z0 * z0).sqrt();
        let [l0, l1, l2, l3] = [low.y, high.x, high.y, low.x].map(length);
        let (n0, n1, n2, n3) = (-low.y / l0, high.x / l1, high.y / l2, -low.x / l3);
        // inner angles as unit complex numbers, whose products are sums of angles; the sines by the
        // normals' cross products, exact where the planes almost coincide
        let angle = |cos: f64, x: f64, y: f64, lengths: f64| {
            DVec2::new(cos, height * (x * x + y * y + z0 * z0).sqrt() / lengths)
        };
        let first = angle(-n0 * n1, high.x, low.y, l0 * l1).rotate(angle(-n1 * n2, high.x, high.y, l1 * l2));
        let last = angle(-n2 * n3, low.x, high.y, l2 * l3).rotate(angle(-n3 * n0, low.x, low.y, l3 * l0));
        // the four angles less a full turn
        let all = first.rotate(last);
        let solid_angle = all.y.atan2(all.x);
        let solid_angle = if solid_angle < -1e-14 { solid_angle + TAU } else { solid_angle.max(0.0) };
        // k is a full turn less the last two angles
        Self { low, high, z0, b0: n0, b1: n2, start: DVec2::new(last.x, -last.y), solid_angle }
    }

    /// Solid angle, sr. Its absolute error is some 1e-15.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Point of the rectangle's plane, uniform in solid angle (eqs. 12 to 16).
    pub fn sample(&self, u: Vec2) -> DVec2 {
        let (sin, cos) = (u.x as f64 * self.solid_angle).sin_cos();
        let au = self.start.rotate(DVec2::new(cos, sin));
        let fu = (au.x * self.b0 - self.b1) / au.y;
        let cu = (1.0f64.copysign(fu) / (fu * fu + self.b0 * self.b0).sqrt()).clamp(-1.0, 1.0);
        let x = (-cu * self.z0 / (1.0 - cu * cu).sqrt().max(1e-150)).clamp(self.low.x, self.high.x);
        let d2 = x * x + self.z0 * self.z0;
        let (h0, h1) = (
            self.low.y / (self.low.y * self.low.y + d2).sqrt(),
            self.high.y / (self.high.y * self.high.y + d2).sqrt(),
        );
        let h = h0 + u.y as f64 * (h1 - h0);
        let y = h * (d2 / (1.0 - h * h).max(1e-300)).sqrt();
        DVec2::new(x, y.clamp(self.low.y, self.high.y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Solid angle of a rectangle whose corner is the foot point: atan(a b / (h r)).
    fn corner(a: f64, b: f64, h: f64) -> f64 {
        (a * b / (h * (a * a + b * b + h * h).sqrt())).atan()
    }

    #[test]
    fn solid_angles_are_right() {
        for h in [1e-12, 1e-3, 1.0, 1e3] {
            for (x, y) in [(0.0, 0.0), (-0.3, 0.2), (4.0, -7.0), (-1e3, 2e3)] {
                let (low, high) = (DVec2::new(x - 0.5, y - 1.0), DVec2::new(x + 0.5, y + 1.0));
                let s = SphericalRect::new(low, high, h);
                let c = |x: f64, y: f64| corner(x, y, h);
                let expected = c(high.x, high.y) - c(low.x, high.y) - c(high.x, low.y) + c(low.x, low.y);
                let got = s.solid_angle();
                assert!(
                    (got - expected).abs() < 1e-12 + 1e-9 * expected,
                    "{x} {y} {h}: {got} for {expected}"
                );
                for i in 0..=4 {
                    let p = s.sample(Vec2::new(i as f32 / 4.0, (4 - i) as f32 / 4.0));
                    assert!(p.is_finite() && p.cmpge(low).all() && p.cmple(high).all(), "{p} at {h}");
                }
            }
        }
    }
}
