//! Sheen: the soft reflection of a layer of fibres, by a linearly transformed cosine.
//!
//! Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly Transformed
//! Cosines": light scattered several times in a thin volume of fibres, fitted for each angle and
//! roughness by a transformed cosine and a directional albedo. The rational functions that replace the
//! paper's tables are those published with MaterialX 1.39 (`zeltner` mode of its sheen node).

use super::{Finish, Kind, LobeSample, MIN_COS};
use crate::math::{Frame, warp};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, TAU};

/// Least roughness: that of the fit.
const MIN_ROUGHNESS: f32 = 0.01;

/// Sheen reflection, on whichever side the light comes from. The fit depends on the direction looked
/// from, so it is reciprocal only as far as the fit is good.
#[derive(Clone, Copy, Debug)]
pub struct Sheen {
    roughness: f32,
}

/// The transformed cosine for one direction looked from: `M^-1` has the rows `(a, 0, b)`, `(0, a, 0)`
/// and `(0, 0, 1)`, with x in the plane of that direction.
struct Transform {
    a: f32,
    b: f32,
    frame: Frame,
}

impl Transform {
    /// Density per projected solid angle: the paper's `D` over the cosine. `w` above the surface.
    #[inline]
    fn density(&self, w: Vec3) -> f32 {
        let v = self.frame.to_local(w);
        let q = (self.a * v.x + self.b * v.z).powi(2) + (self.a * v.y).powi(2) + v.z * v.z;
        FRAC_1_PI * (self.a / q).powi(2)
    }

    #[inline]
    fn draw(&self, u: Vec3) -> Vec3 {
        let c = warp::cosine_hemisphere(u.truncate());
        let v = Vec3::new(c.x - self.b * c.z, c.y, self.a * c.z);
        self.frame.to_world(v.normalize())
    }
}

impl Sheen {
    /// `roughness` in [0,1], Blender's; values below 0.01 are raised to it.
    pub fn new(roughness: f32) -> Self {
        Self { roughness: roughness.clamp(MIN_ROUGHNESS, 1.0) }
    }

    /// Directional albedo at cosine `x`.
    #[inline]
    fn reflectance(&self, x: f32) -> f32 {
        let (x, y) = (x.min(1.0), self.roughness);
        let width = y * (0.020_660_7 + 1.584_91 * y) / (0.037_942_4 + y * (1.322_27 + y));
        let mean = y * (-0.193_854 + y * (-1.148_85 + y * (1.793_2 - 0.959_43 * y * y))) / (0.046_391 + y);
        let floor =
            y * (0.000_654_023 + (-0.020_781_8 + 0.119_681 * y) * y) / (1.262_64 + y * (-1.920_21 + y));
        let bell = (-0.5 * ((x - mean) / width).powi(2)).exp() / (width * TAU.sqrt());
        (bell + floor).clamp(0.0, 1.0)
    }

    /// The transform for `from` above the surface.
    #[inline]
    fn transform(&self, from: Vec3) -> Transform {
        let (x, y) = (from.z.min(1.0), self.roughness);
        let a = (2.581_26 * x + 0.813_703 * y) * y / (1.0 + 0.310_327 * x * x + 2.609_94 * x * y);
        let b = (1.0 - x).sqrt() * (y - 1.0) * y * y * y
            / (2.540_53e-5 + 1.712_28 * x - 1.715_06 * x * y + 1.341_74 * y * y);
        Transform { a, b, frame: Frame::from_normal_tangent(Vec3::Z, from.with_z(0.0)) }
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        Vec3::splat(self.pdf(wo, wi) * self.reflectance(wo.z.abs()))
    }

    #[inline]
    pub(super) fn pdf(&self, from: Vec3, to: Vec3) -> f32 {
        if from.z * to.z <= 0.0 || to.z.abs() < MIN_COS {
            return 0.0;
        }
        let sign = 1f32.copysign(from.z);
        self.transform(from * sign).density(to * sign)
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let sign = 1f32.copysign(from.z);
        let transform = self.transform(from * sign);
        let d = transform.draw(u);
        if d.z < MIN_COS {
            return None;
        }
        let pdf = transform.density(d);
        let value = Vec3::splat(pdf * self.reflectance(from.z.abs()));
        LobeSample::continuous(d * sign, value, pdf, 1.0, Kind::reflection(Finish::Diffuse))
    }

    /// Exact.
    #[inline]
    pub(super) fn albedo(&self, from: Vec3) -> Vec3 {
        Vec3::splat(self.reflectance(from.z.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{direction, pdf_integral, sampled_albedo};
    use super::*;
    use crate::shading::lobes::Lobe;

    #[test]
    fn the_density_integrates_to_one_and_the_albedo_is_what_is_sampled() {
        for roughness in [0.2, 0.5, 1.0] {
            for cos in [1.0, 0.5, 0.05, -0.3] {
                let (sheen, from) = (Sheen::new(roughness), direction(cos, 1.1));
                let lobe = Lobe::Sheen(sheen);
                let total = pdf_integral(&lobe, from, cos);
                approx::assert_abs_diff_eq!(total, 1.0, epsilon = 5e-3);
                // every draw has the same weight but the few that fall below the horizon
                let (mean, error) = sampled_albedo(&lobe, from, 4000);
                let off = (mean - lobe.albedo(from)).x.abs();
                assert!(off <= 4.0 * error.x + 1e-5, "{roughness} {cos}: {mean} {off}");
                let s = lobe.sample(from, Vec3::new(0.2, 0.7, 0.5)).unwrap();
                let value = lobe.eval(from, s.direction);
                assert!(value.abs_diff_eq(s.value, 1e-3 * value.x), "{value} {}", s.value);
            }
        }
    }

    #[test]
    fn the_albedo_grows_towards_the_silhouette_and_stays_below_one() {
        for step in 0..=100 {
            let sheen = Sheen::new(step as f32 / 100.0);
            for x in 0..100 {
                let (here, next) = (x as f32 / 100.0, (x + 1) as f32 / 100.0);
                let r = sheen.reflectance(here);
                assert!(r < 1.0 && r >= sheen.reflectance(next), "{step} {x}: {r}");
                let t = sheen.transform(direction(here.max(1e-3), 0.0));
                assert!(t.a > 0.0 && t.b.is_finite());
            }
        }
    }
}
