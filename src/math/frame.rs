//! Orthonormal frames.

use glam::{Quat, Vec3};

/// A right-handed orthonormal frame; local z is the normal `n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x axis.
    pub s: Vec3,
    /// Local y axis.
    pub t: Vec3,
    /// Local z axis.
    pub n: Vec3,
}

impl Frame {
    /// A frame around the unit vector `n` (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
    pub fn from_normal(n: Vec3) -> Self {
        // both zeros alike: directions that differ in them alone are the same
        let sign = if n.z < 0.0 { -1.0 } else { 1.0 };
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// A frame around the unit vector `n` whose x axis is `tangent` made orthogonal to it. Falls back
    /// to [`Frame::from_normal`] where the tangent is parallel to the normal, zero or not finite.
    pub fn from_normal_tangent(n: Vec3, tangent: Vec3) -> Self {
        let t = tangent.normalize_or_zero();
        let s = t - n * n.dot(t);
        let len2 = s.length_squared();
        if len2.is_nan() || len2 <= 1e-8 {
            return Self::from_normal(n);
        }
        let s = s / len2.sqrt();
        Self { s, t: n.cross(s), n }
    }

    /// The frame turned about its normal, counter-clockwise, by a number of full turns.
    pub fn turned(&self, turns: f32) -> Self {
        let (sin, cos) = (std::f32::consts::TAU * turns).sin_cos();
        Self { s: self.s * cos + self.t * sin, t: self.t * cos - self.s * sin, n: self.n }
    }

    /// The frame turned the shortest way to the unit normal `n`.
    pub fn leaned(&self, n: Vec3) -> Self {
        let s = Quat::from_rotation_arc(self.n, n) * self.s;
        Self { s, t: n.cross(s), n }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(f: Frame) {
        for (a, b) in [(f.s, f.t), (f.t, f.n), (f.n, f.s)] {
            approx::assert_abs_diff_eq!(a.dot(b), 0.0, epsilon = 1e-5);
            approx::assert_abs_diff_eq!(a.length(), 1.0, epsilon = 1e-5);
        }
        approx::assert_abs_diff_eq!(f.s.cross(f.t).dot(f.n), 1.0, epsilon = 1e-5);
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for n in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::new(1e-4, -1e-4, -1.0).normalize()] {
            check(Frame::from_normal(n));
            for t in [Vec3::X, Vec3::ZERO, Vec3::NAN, n, Vec3::new(0.3, -2.0, 1.0)] {
                check(Frame::from_normal_tangent(n, t));
            }
        }
    }

    #[test]
    fn local_and_back_is_the_identity() {
        let f = Frame::from_normal(Vec3::new(0.2, -0.5, 0.7).normalize());
        let v = Vec3::new(1.0, 2.0, -3.0);
        assert!((f.to_world(f.to_local(v)) - v).length() < 1e-5);
    }
}
