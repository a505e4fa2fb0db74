//! What tests of patterns share.

use super::sampler::hash_unit;
use glam::Vec3;

/// The place of number `i`, at most 20 from zero along each axis.
pub fn place(i: u32) -> Vec3 {
    Vec3::from([0, 1, 2].map(|k| 40.0 * hash_unit(i, k) - 20.0))
}
