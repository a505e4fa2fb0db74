//! Collecting lobes into a [`Bsdf`].

use super::{Bsdf, Entry};
use crate::math::Frame;
use crate::shading::lobes::{Lambert, Lobe};
use glam::Vec3;

/// Most lobes that one surface point can have.
pub const CAPACITY: usize = 16;

/// Collects weighted lobes. Mixing materials is scaling the weights that they push.
#[derive(Clone, Debug)]
pub struct BsdfBuilder {
    bsdf: Bsdf,
    dropped: u32,
}

impl BsdfBuilder {
    /// No lobes yet. `ng`: unit geometric normal, pointing out of the object.
    pub fn new(ng: Vec3) -> Self {
        let empty = Entry {
            weight: Vec3::ZERO,
            frame: Frame { s: Vec3::X, t: Vec3::Y, n: Vec3::Z },
            lobe: Lobe::Lambert(Lambert),
            delta: false,
        };
        Self { bsdf: Bsdf { ng, len: 0, entries: [empty; CAPACITY] }, dropped: 0 }
    }

    /// Adds a lobe. The normal of `frame` is the shading normal; it is turned to the side of the
    /// geometric normal. Negative and non-finite weights count as zero, and a weight of zero adds nothing.
    pub fn push(&mut self, weight: Vec3, frame: Frame, lobe: Lobe) {
        let clean = |w: f32| if w.is_finite() { w.max(0.0) } else { 0.0 };
        let weight = Vec3::new(clean(weight.x), clean(weight.y), clean(weight.z));
        if weight == Vec3::ZERO {
            return;
        }
        if self.bsdf.len == CAPACITY {
            self.dropped += 1;
            return;
        }
        let frame = if frame.n.dot(self.bsdf.ng) < 0.0 {
            Frame { s: frame.s, t: -frame.t, n: -frame.n }
        } else {
            frame
        };
        self.bsdf.entries[self.bsdf.len] = Entry { weight, frame, lobe, delta: lobe.is_delta() };
        self.bsdf.len += 1;
    }

    /// How many lobes did not fit; the caller counts and reports them.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }

    /// The sum of what was pushed.
    pub fn build(self) -> Bsdf {
        self.bsdf
    }
}
