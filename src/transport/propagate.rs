//! Radiance through the graph of clusters: `L(s) = T L_e + T sum over s' of f / A value(s')`.
//!
//! The photons of an iteration carry the flux of their own light paths, so what is gathered from them is
//! constant; only the reflected radiance of camera segments is unknown. Leaving one out (the Mecke
//! formula): the density of a segment whose light comes from a photon that landed in its end cluster counts
//! the other photons there alone, since that one's presence is given.

use super::Cut;
use super::exchange::{GRAIN, Segment, emitted, gather, has_end, per_index, segments};
use super::photons::{FromPhotons, gather_photons, photon_values, towards_camera};
use super::weigh::{Sampled, Weights};
use crate::math::luminance;
use glam::Vec3;
use rayon::prelude::*;

/// Change of the mean, relative to it, below which sweeping stops.
const TOLERANCE: f64 = 1e-3;
/// Fewest and most sweeps.
const SWEEPS: [u32; 2] = [2, 32];

/// Reflected basic radiance at the camera's arrivals, by index.
#[derive(Debug, Default)]
pub struct Reflected {
    /// Of all light that was not gathered from photons there.
    pub carried: Vec<Vec3>,
    /// Of the photons that landed in the arrival's cluster.
    pub photons: Vec<FromPhotons>,
    /// Of light that was scattered nowhere else; empty if nobody asked.
    pub direct: Vec<Vec3>,
    /// The constants of camera segments.
    pub(super) segments: Vec<Segment>,
}

impl Reflected {
    /// Solves for the radiance. `starts`: for every path, its first arrival. `wants_direct`: whether
    /// [`Reflected::direct`] is asked for. Returns `false` if it was stopped.
    pub fn solve(&mut self, s: Sampled, w: &Weights, starts: &[u32], wants_direct: bool, cut: &Cut) -> bool {
        self.segments = segments(s, w);
        let values = photon_values(s, w);
        self.photons = gather_photons(s, w, &self.segments, &values, cut, |_| true);
        self.carried = self.own_tails(s, w, starts, cut);
        let total = |light: &dyn Fn(usize) -> Vec3| {
            starts.iter().map(|&i| f64::from(luminance(light(i as usize)))).sum::<f64>()
        };
        let constant = total(&|i| self.photons[i].reflected);
        let mut before = total(&|i| self.carried[i]);
        for sweep in 1..=SWEEPS[1] {
            if cut.is_raised() {
                return false;
            }
            self.carried = self.sweep(s, w, &self.carried, cut);
            let now = total(&|i| self.carried[i]);
            let change = (now - before).abs();
            before = now;
            if sweep >= SWEEPS[0] && change <= TOLERANCE * (now + constant) {
                break;
            }
        }
        self.direct.clear();
        if wants_direct {
            let straight = per_index(s, |i| emitted(s, w, i, Some(0)));
            let first = gather_photons(s, w, &self.segments, &values, cut, |bounces| bounces == 0);
            self.direct = gather(s, w, &straight, cut);
            let seen = |(i, (d, p)): (usize, (&mut Vec3, FromPhotons))| *d = towards_camera(s, i, *d, p);
            self.direct.par_iter_mut().zip(first).enumerate().for_each(seen);
        }
        !cut.is_raised()
    }

    /// One sweep: what arrivals reflect if they reflected so much carried light before.
    pub(super) fn sweep(&self, s: Sampled, w: &Weights, carried: &[Vec3], cut: &Cut) -> Vec<Vec3> {
        let brought = per_index(s, |i| {
            let segment = &self.segments[i];
            segment
                .value(segment.emitted, has_end(s, i).then(|| (carried[i + 1], self.photons[i + 1].brought)))
        });
        gather(s, w, &brought, cut)
    }

    /// What arrival `i` reflects along its primary segment.
    pub fn towards_camera(&self, s: Sampled, i: usize) -> Vec3 {
        towards_camera(s, i, self.carried[i], self.photons[i])
    }

    /// What is reflected at the end of the segment that leaves arrival `i`, which has one: carried light, and what
    /// photons bring, see [`Segment::value`].
    pub(super) fn end_of(&self, i: usize) -> (Vec3, Vec3) {
        (self.carried[i + 1], self.photons[i + 1].brought)
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let vectors = self.carried.capacity() + self.direct.capacity();
        vectors * size_of::<Vec3>()
            + self.photons.capacity() * size_of::<FromPhotons>()
            + self.segments.capacity() * size_of::<Segment>()
    }

    /// What every path's own tail says of the light it carries, from its end backwards.
    pub(super) fn own_tails(&self, s: Sampled, w: &Weights, starts: &[u32], cut: &Cut) -> Vec<Vec3> {
        let n = s.camera.arrivals.len();
        let some_paths = |(k, paths): (usize, &[u32])| {
            let first = paths[0] as usize;
            let end = starts.get((k + 1) * GRAIN).map_or(n, |&e| e as usize);
            let mut tails = vec![Vec3::ZERO; end - first];
            for i in (first..end).rev() {
                if cut.is_raised() {
                    break;
                }
                let place = s.clusters.place[i] as usize;
                let mut light = w.direct[place];
                if s.camera.arrivals.get(i).goes_on {
                    let segment = &self.segments[i];
                    let end = has_end(s, i).then(|| (tails[i + 1 - first], self.photons[i + 1].brought));
                    let brought = segment.value(segment.emitted, end);
                    light += brought * segment.along_path(s, w, i);
                }
                tails[i - first] = light;
            }
            tails
        };
        starts.par_chunks(GRAIN).enumerate().flat_map_iter(some_paths).collect()
    }
}

#[cfg(test)]
mod tests;
