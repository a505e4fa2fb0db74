//! What a camera path finds by itself: path tracing on the rays of the segments, at no ray more.
//!
//! Filtering blurs, and whatever else is only nearly right about clusters shows in the picture as well. This estimate
//! knows nothing of them, so its mean difference from the filtered one is the systematic error.

use super::Cut;
use super::photons::{gather_photons, photon_values, photon_weight};
use super::propagate::Reflected;
use super::store::{EmissionHit, NextEvent, Rivals};
use super::walk::Chain;
use super::weigh::{Sampled, Weights};
use crate::math::{SharedExponent, luminance};
use glam::Vec3;
use rayon::prelude::*;

/// Weight above which photons find what a camera path meets so rarely that its mean says nothing.
const HARDLY_MET: f32 = 0.9;

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

impl Reflected {
    /// How much of the light these first arrivals reflect is beyond their own paths, squared as a share and summed: photons bring it
    /// straight from lights through Dirac lobes, and camera segments hardly ever meet those lights. `most`: bounces up to which light
    /// counts. Without bridges, whose light would be among it.
    pub fn beyond_own_paths(
        &self,
        s: Sampled,
        w: &Weights,
        firsts: &[u32],
        most: Option<u32>,
        cut: &Cut,
    ) -> f64 {
        if !s.world.needs().mirrors {
            return 0.0;
        }
        let mut values = photon_values(s, w);
        let is_beyond = |j: usize| {
            // a first segment's bounces are its passages
            let is_straight = s.light.photons.bounces(j) > 0
                && matches!(s.light.photons.get(j).rivals, Rivals::First { .. });
            is_straight && photon_weight(s, w, j) > HARDLY_MET
        };
        values.par_iter_mut().enumerate().for_each(|(j, value)| {
            // where no camera path arrives there is no density either
            if *value != SharedExponent::default() && !is_beyond(j) {
                *value = SharedExponent::default();
            }
        });
        let counts = |bounces| most.is_none_or(|most| bounces < most);
        let beyond = gather_photons(s, w, &values, cut, counts);
        let square = |&i: &u32| {
            let i = i as usize;
            let share = luminance(beyond[i].decode()) / luminance(self.towards_camera(s, i));
            if share.is_finite() { f64::from(share.clamp(0.0, 1.0)).powi(2) } else { 0.0 }
        };
        firsts.iter().map(square).sum()
    }
}
