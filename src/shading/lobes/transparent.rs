//! Straight passage through the surface.

use super::{Finish, Kind, LobeSample};
use glam::Vec3;

/// A surface that is not there; its colour is the weight it is used with. A delta lobe.
#[derive(Clone, Copy, Debug)]
pub struct Transparent;

impl Transparent {
    #[inline]
    pub(super) fn eval(&self, _wo: Vec3, _wi: Vec3) -> Vec3 {
        Vec3::ZERO
    }

    #[inline]
    pub(super) fn pdf(&self, _from: Vec3, _to: Vec3) -> f32 {
        0.0
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, _u: Vec3) -> Option<LobeSample> {
        Some(LobeSample::delta(-from, Vec3::ONE, 1.0, 1.0, Kind::transmission(Finish::Straight)))
    }

    #[inline]
    pub(super) fn albedo(&self, _from: Vec3) -> Vec3 {
        Vec3::ONE
    }
}
