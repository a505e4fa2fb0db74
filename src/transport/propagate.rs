//! Radiance through the graph of clusters: `L(s) = T L_e + T sum over s' of f / A value(s')`.
//!
//! The photons of an iteration carry the flux of their own light paths, so what is gathered from them is
//! constant (`photons`); only the reflected radiance of camera segments is unknown.

use super::Cut;
use super::exchange::{GRAIN, Segments, along_path, emitted, gather, has_end, offers};
use super::photons::{gather_photons, photon_values, towards_camera};
use super::weigh::{Sampled, Weights};
use crate::math::{SharedExponent, luminance};
use glam::Vec3;
use rayon::prelude::*;
use std::mem::take;

/// Change of the mean, relative to it, below which sweeping stops.
const TOLERANCE: f64 = 1e-3;
/// Fewest and most sweeps.
const SWEEPS: [u32; 2] = [2, 32];

/// Reflected basic radiance at the camera's arrivals, by index.
#[derive(Debug, Default)]
pub struct Reflected {
    /// Of all light that was not gathered from photons there.
    pub carried: Vec<SharedExponent>,
    /// Of the photons that landed in the arrival's cluster, along the segment that brought it: see [`gather_photons`].
    pub photons: Vec<SharedExponent>,
    /// Of light that was scattered nowhere else; empty if nobody asked.
    pub direct: Vec<SharedExponent>,
    /// The constants of camera segments.
    pub(super) segments: Segments,
    /// The most that was held while it was solved, bytes.
    pub(super) most_bytes: usize,
}

impl Reflected {
    /// Solves for the radiance. `starts`: for every path, its first arrival. `wants_direct`: whether
    /// [`Reflected::direct`] is asked for. Returns `false` if it was stopped.
    pub fn solve(&mut self, s: Sampled, w: &Weights, starts: &[u32], wants_direct: bool, cut: &Cut) -> bool {
        self.segments = Segments::new(s, w);
        let values = photon_values(s, w);
        self.photons = gather_photons(s, w, &values, cut, |_| true);
        self.carried = self.own_tails(s, w, starts, cut);
        // photons' values and, in a sweep, what segments bring and clusters share
        let colors = values.capacity() + self.carried.capacity();
        self.most_bytes = self.bytes()
            + colors * size_of::<SharedExponent>()
            + s.clusters.clusters.len() * size_of::<Vec3>();
        let total = |light: &dyn Fn(usize) -> Vec3| {
            starts.iter().map(|&i| f64::from(luminance(light(i as usize)))).sum::<f64>()
        };
        let constant = total(&|i| self.photons[i].decode());
        let mut before = total(&|i| self.carried[i].decode());
        for sweep in 1..=SWEEPS[1] {
            if cut.is_raised() {
                return false;
            }
            let carried = take(&mut self.carried);
            self.carried = self.sweep(s, w, carried, cut);
            let now = total(&|i| self.carried[i].decode());
            let change = (now - before).abs();
            before = now;
            if sweep >= SWEEPS[0] && change <= TOLERANCE * (now + constant) {
                break;
            }
        }
        self.direct.clear();
        if wants_direct {
            let straight = offers(s, |i| emitted(s, w, i, Some(0)));
            let first = gather_photons(s, w, &values, cut, |bounces| bounces == 0);
            self.direct = gather(s, w, &straight, cut);
            self.add_direct_photons(s, &first);
        }
        !cut.is_raised()
    }

    /// One sweep: what arrivals reflect if they reflected so much carried light before.
    pub(super) fn sweep(
        &self,
        s: Sampled,
        w: &Weights,
        carried: Vec<SharedExponent>,
        cut: &Cut,
    ) -> Vec<SharedExponent> {
        let offers = offers(s, |i| {
            let end = has_end(s, i).then(|| (carried[i + 1].decode(), self.photons[i + 1].decode()));
            self.segments.value(s, i, self.segments.emitted(i), end)
        });
        drop(carried);
        gather(s, w, &offers, cut)
    }

    /// Adds what first arrivals reflect of `photons` to the light that was scattered nowhere else.
    pub(super) fn add_direct_photons(&mut self, s: Sampled, photons: &[SharedExponent]) {
        self.direct.par_iter_mut().zip(photons).enumerate().for_each(|(i, (d, p))| {
            *d = SharedExponent::encode(towards_camera(s, i, d.decode(), p.decode()));
        });
    }

    /// What arrival `i` reflects along its primary segment.
    pub fn towards_camera(&self, s: Sampled, i: usize) -> Vec3 {
        towards_camera(s, i, self.carried[i].decode(), self.photons[i].decode())
    }

    /// What is reflected at the end of the segment that leaves arrival `i`, which has one: carried light, and what
    /// photons bring, see [`Segment::value`].
    pub(super) fn end_of(&self, i: usize) -> (Vec3, Vec3) {
        (self.carried[i + 1].decode(), self.photons[i + 1].decode())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let colors = self.carried.capacity() + self.direct.capacity() + self.photons.capacity();
        colors * size_of::<SharedExponent>() + self.segments.bytes()
    }

    /// The most that was held while it was solved, bytes.
    pub fn most_bytes(&self) -> usize {
        self.most_bytes.max(self.bytes())
    }

    /// What every path's own tail says of the light it carries, from its end backwards.
    pub(super) fn own_tails(
        &self,
        s: Sampled,
        w: &Weights,
        starts: &[u32],
        cut: &Cut,
    ) -> Vec<SharedExponent> {
        let n = s.camera.arrivals.len();
        let some_paths = |(k, paths): (usize, &[u32])| {
            let first = paths[0] as usize;
            let end = starts.get((k + 1) * GRAIN).map_or(n, |&e| e as usize);
            let mut tails = vec![SharedExponent::default(); end - first];
            for i in (first..end).rev() {
                if cut.is_raised() {
                    break;
                }
                let mut light = w.direct(i);
                if s.camera.arrivals.goes_on(i) {
                    let end =
                        has_end(s, i).then(|| (tails[i + 1 - first].decode(), self.photons[i + 1].decode()));
                    let brought = self.segments.value(s, i, self.segments.emitted(i), end);
                    light += brought * along_path(s, w, i);
                }
                tails[i - first] = SharedExponent::encode(light);
            }
            tails
        };
        starts.par_chunks(GRAIN).enumerate().flat_map_iter(some_paths).collect()
    }
}

#[cfg(test)]
mod tests;
