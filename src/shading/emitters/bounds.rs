//! Where an emitter is and where it shines: what the light tree needs to know of it.

use glam::{Quat, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Bounds in space and direction of what one or several emitters send out (Conty Estevez and Kulla 2018,
/// "Importance Sampling of Many Lights with Adaptive Tree Splitting").
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    pub min: Vec3,
    pub max: Vec3,
    pub cone: Cone,
    /// Luminance of the intensity along the brightest direction, W/sr.
    pub intensity: f64,
}

/// Directions of emission: within an angle of one of a cone of normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    /// Unit axis of the cone of normals.
    pub axis: Vec3,
    /// Cosine of the half angle of the cone of normals.
    pub cos_normals: f32,
    /// Cosine of the angle to a normal within which light is emitted, at most a right one.
    pub cos_emission: f32,
    /// Whether it shines alike along the opposite normals.
    pub two_sided: bool,
}

impl Cone {
    /// To all sides alike.
    pub const EVERYWHERE: Self =
        Self { axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0, two_sided: false };

    /// By the cosine law within `cutoff` (radians) of a normal.
    pub fn flat(normal: Vec3, cutoff: f64, two_sided: bool) -> Self {
        let cos_emission = if cutoff < FRAC_PI_2 as f64 { cutoff.cos() as f32 } else { 0.0 };
        Self { axis: normal, cos_normals: 1.0, cos_emission, two_sided }
    }

    /// Alike along all directions within `cutoff` (radians) of an axis.
    pub fn solid(axis: Vec3, cutoff: f64) -> Self {
        Self { axis, cos_normals: cutoff.cos() as f32, cos_emission: 1.0, two_sided: false }
    }

    /// A cone around both.
    pub fn union(&self, other: &Cone) -> Cone {
        let mut b = *other;
        if b.two_sided && self.axis.dot(b.axis) < 0.0 {
            b.axis = -b.axis;
        }
        let (axis, cos_normals) = if self.cos_normals <= b.cos_normals {
            wrap(self.axis, self.cos_normals, b.axis, b.cos_normals)
        } else {
            wrap(b.axis, b.cos_normals, self.axis, self.cos_normals)
        };
        Cone {
            axis,
            cos_normals,
            cos_emission: self.cos_emission.min(b.cos_emission),
            two_sided: self.two_sided || b.two_sided,
        }
    }

    /// Measure of the directions lit, weighed by the cosine (Conty Estevez and Kulla 2018, eq. 1).
    pub fn measure(&self) -> f32 {
        let o = self.cos_normals.clamp(-1.0, 1.0).acos();
        let w = (o + self.cos_emission.clamp(-1.0, 1.0).acos()).min(PI);
        let (sin, cos) = o.sin_cos();
        2.0 * PI * (1.0 - cos) + FRAC_PI_2 * (2.0 * w * sin - (o - 2.0 * w).cos() - 2.0 * o * sin + cos)
    }
}

/// The cone around a wide cone `a` and a narrow one `b` (axis and cosine of the half angle each).
fn wrap(a: Vec3, cos_a: f32, b: Vec3, cos_b: f32) -> (Vec3, f32) {
    let sine = |cos: f32| (1.0 - cos * cos).max(0.0).sqrt();
    // the narrow one is inside where the angle between is at most the difference of the half angles
    if cos_a <= -1.0 || a.dot(b) >= cos_a * cos_b + sine(cos_a) * sine(cos_b) || a == b {
        return (a, cos_a);
    }
    let (angle_a, angle_b) = (cos_a.min(1.0).acos(), cos_b.min(1.0).acos());
    let between = a.cross(b).length().atan2(a.dot(b));
    let half = 0.5 * (angle_a + between + angle_b);
    match a.cross(b).try_normalize() {
        Some(around) if half < PI => {
            ((Quat::from_axis_angle(around, half - angle_a) * a).normalize(), half.cos())
        }
        _ => (a, -1.0),
    }
}

impl LightBounds {
    /// Bounds around both.
    pub fn union(&self, other: &LightBounds) -> LightBounds {
        LightBounds {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            cone: self.cone.union(&other.cone),
            intensity: self.intensity + other.intensity,
        }
    }

    /// Middle of the box.
    pub fn center(&self) -> Vec3 {
        // halves first: the sum of two large numbers may overflow
        self.min * 0.5 + self.max * 0.5
    }
}
