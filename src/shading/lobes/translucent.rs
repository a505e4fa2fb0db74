//! Ideal diffuse transmission: Lambert's law on the side away from the light.

use super::{Finish, Kind, LobeSample, MIN_COS};
use crate::math::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Diffuse transmission of albedo one, without a change of medium. Reciprocal and lossless.
#[derive(Clone, Copy, Debug)]
pub struct Translucent;

impl Translucent {
    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        Vec3::splat(self.pdf(wo, wi))
    }

    #[inline]
    pub(super) fn pdf(&self, from: Vec3, to: Vec3) -> f32 {
        if from.z * to.z < 0.0 && to.z.abs() >= MIN_COS { FRAC_1_PI } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let d = warp::cosine_hemisphere(u.truncate());
        if d.z < MIN_COS {
            return None;
        }
        let direction = if from.z < 0.0 { d } else { -d };
        let kind = Kind::transmission(Finish::Diffuse);
        LobeSample::continuous(direction, Vec3::splat(FRAC_1_PI), FRAC_1_PI, 1.0, kind)
    }

    #[inline]
    pub(super) fn albedo(&self, _from: Vec3) -> Vec3 {
        Vec3::ONE
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{pdf_integral, sampled_albedo};
    use super::*;
    use crate::shading::lobes::Lobe;

    #[test]
    fn all_light_passes_to_the_other_side() {
        let lobe = Lobe::Translucent(Translucent);
        for from in [Vec3::Z, Vec3::new(0.8, 0.0, -0.6)] {
            let (mean, error) = sampled_albedo(&lobe, from, 400);
            assert_eq!((mean, error), (Vec3::ONE, Vec3::ZERO), "weights of one, none lost");
            approx::assert_abs_diff_eq!(pdf_integral(&lobe, from, -from.z), 1.0, epsilon = 1e-4);
            assert_eq!(pdf_integral(&lobe, from, from.z), 0.0);
            let s = lobe.sample(from, Vec3::splat(0.3)).unwrap();
            assert!(s.direction.z * from.z < 0.0);
            assert_eq!(s.kind, Kind::transmission(Finish::Diffuse));
            assert_eq!(s.value, lobe.eval(from, s.direction));
        }
        assert!(lobe.transmits() && !lobe.is_delta() && lobe.eta() == 1.0);
    }
}
