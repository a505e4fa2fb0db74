//! What a camera path finds by itself: path tracing on the rays of the segments, at no ray more.
//!
//! Filtering blurs, and whatever else is only nearly right about clusters shows in the picture as well. This estimate
//! knows nothing of them, so its mean difference from the filtered one is the systematic error.

use super::store::{EmissionHit, NextEvent};
use super::walk::Chain;
use glam::Vec3;

/// The light of one path so far.
#[derive(Clone, Copy, Debug)]
pub struct OwnPath {
    /// Basic radiance reflected at the first arrival.
    pub light: Vec3,
    /// Factor on basic radiance at the arrival that the path has reached.
    throughput: Vec3,
    bounces: u32,
    most: u32,
}

impl OwnPath {
    /// A path whose first arrival lies behind so many Dirac lobes. `most`: bounces up to which light counts.
    pub fn new(passages: u32, most: Option<u32>) -> Self {
        Self { light: Vec3::ZERO, throughput: Vec3::ONE, bounces: passages, most: most.unwrap_or(u32::MAX) }
    }

    /// Light of the arrival's next-event segment, beside the segment that leaves it with probability `survival`.
    /// `value`: of the BSDF along it.
    pub fn see_next_event(&mut self, n: &NextEvent, survival: f32, value: Vec3) {
        if n.next_event_pdf <= 0.0 || self.bounces >= self.most {
            return;
        }
        let met = if n.is_delta { 0.0 } else { survival * n.pdf };
        self.add(value * n.light / (n.next_event_pdf + met));
    }

    /// Light that the segment which leaves the arrival met. `value`: of the BSDF; `density`: of the segment, its
    /// survival included.
    pub fn meet(&mut self, hits: &[EmissionHit], value: Vec3, density: f32) {
        for h in hits {
            if self.bounces.saturating_add(1 + h.passages) <= self.most {
                self.add(value * h.light / (h.forward * density + h.next_event_pdf));
            }
        }
    }

    /// The path goes on to its next arrival. Arguments as above.
    pub fn go_on(&mut self, chain: &Chain, value: Vec3, density: f32) {
        self.throughput *= value * chain.throughput / (density * chain.forward);
        self.bounces = self.bounces.saturating_add(1 + chain.passages);
    }

    fn add(&mut self, light: Vec3) {
        let light = self.throughput * light;
        // what overflows says nothing about systematic errors
        if light.is_finite() {
            self.light += light;
        }
    }
}
