//! Ideal diffuse reflection (Lambert), on whichever side the light comes from.

use super::{Finish, Kind, LobeSample, MIN_COS};
use crate::math::warp;
use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// Diffuse reflection of albedo one. Reciprocal and lossless.
#[derive(Clone, Copy, Debug)]
pub struct Lambert;

impl Lambert {
    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        Vec3::splat(self.pdf(wo, wi))
    }

    #[inline]
    pub(super) fn pdf(&self, from: Vec3, to: Vec3) -> f32 {
        if from.z * to.z > 0.0 && to.z.abs() >= MIN_COS { FRAC_1_PI } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let d = warp::cosine_hemisphere(u.truncate());
        if d.z < MIN_COS {
            return None;
        }
        let direction = if from.z < 0.0 { -d } else { d };
        let kind = Kind::reflection(Finish::Diffuse);
        LobeSample::continuous(direction, Vec3::splat(FRAC_1_PI), FRAC_1_PI, 1.0, kind)
    }

    #[inline]
    pub(super) fn albedo(&self, _from: Vec3) -> Vec3 {
        Vec3::ONE
    }
}
