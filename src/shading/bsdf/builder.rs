//! Collecting lobes into a [`Bsdf`].

use super::bend::bent;
use super::cover::left_by;
use super::{Bsdf, Entry};
use crate::math::Frame;
use crate::shading::lobes::Lobe;
use glam::Vec3;
use smallvec::SmallVec;

/// Most lobes that one surface point can have.
pub const CAPACITY: usize = 16;

/// Collects weighted lobes. Mixing materials is scaling the weights that they push.
#[derive(Clone, Debug)]
pub struct BsdfBuilder {
    bsdf: Bsdf,
    wo: Vec3,
    dropped: u32,
}

impl BsdfBuilder {
    /// No lobes yet. `ng`: unit geometric normal, pointing out of the object; `wo`: the direction looked from.
    pub fn new(ng: Vec3, wo: Vec3) -> Self {
        Self { bsdf: Bsdf { ng, entries: SmallVec::new() }, wo, dropped: 0 }
    }

    /// The direction looked from.
    pub fn wo(&self) -> Vec3 {
        self.wo
    }

    /// Adds a lobe. The normal of `frame` is the shading normal; it is turned to the side of the
    /// geometric normal. Negative and non-finite weights count as zero, and a weight of zero adds nothing.
    pub fn push(&mut self, weight: Vec3, frame: Frame, lobe: Lobe) {
        let entry = self.entry(weight, frame, lobe);
        self.push_entry(entry);
    }

    /// Adds a lobe that lies over those pushed later. `weight`: of the whole stack; `share`: of the lobe in
    /// it. Returns how much of the light that is seen the lobe leaves to what is below: one minus the largest channel
    /// of its directional albedo.
    pub fn push_layer(&mut self, weight: Vec3, share: Vec3, frame: Frame, lobe: Lobe) -> f32 {
        let entry = self.entry(weight * share, frame, lobe);
        let side = 1f32.copysign(self.bsdf.ng.dot(self.wo));
        let albedo = entry.seen_from(self.wo, side).map_or(Vec3::ZERO, |o| share * lobe.albedo(o));
        self.push_entry(entry);
        left_by(albedo)
    }

    fn entry(&self, weight: Vec3, frame: Frame, lobe: Lobe) -> Entry {
        let clean = |w: f32| if w.is_finite() { w.max(0.0) } else { 0.0 };
        let weight = Vec3::new(clean(weight.x), clean(weight.y), clean(weight.z));
        let frame = if frame.n.dot(self.bsdf.ng) < 0.0 {
            Frame { s: frame.s, t: -frame.t, n: -frame.n }
        } else {
            frame
        };
        let bent = if lobe.is_specular() { bent(self.bsdf.ng, frame.n, self.wo) } else { None };
        let is_bent = bent.is_some();
        let frame = bent.map_or(frame, |n| frame.leaned(n));
        Entry { weight, frame, lobe, delta: lobe.is_delta(), is_bent }
    }

    fn push_entry(&mut self, entry: Entry) {
        if entry.weight == Vec3::ZERO {
            return;
        }
        if self.bsdf.entries.len() == CAPACITY {
            self.dropped += 1;
            return;
        }
        self.bsdf.entries.push(entry);
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
