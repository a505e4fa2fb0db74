//! The paper's recursion as written (S20, S22): every segment, whoever sampled it, brings what is gathered in the
//! cluster where it begins on the side of the light, divided by the densities of all techniques.
//!
//! Kept for comparison. Of a segment that a light path sampled it is known that a photon landed where it begins, so
//! gathering there again counts that photon more than its share: up to twofold a bounce where photons are
//! few. `propagate` leaves it out instead.

use super::Cut;
use super::depth::{Levels, longest_chain};
use super::exchange::{GRAIN, Segments, emitted, has_end, per_diffuse_cluster, reciprocal};
use super::photons::photon_value;
use super::propagate::Reflected;
use super::store::Rivals;
use super::weigh::{Sampled, Weights};
use crate::math::{SharedExponent, luminance};
use crate::shading::SurfaceClass;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Change of the mean, relative to it, below which sweeping stops. The start is nothing, so it is finer than that of
/// the other estimator.
const TOLERANCE: f64 = 1e-4;
/// Fewest and most sweeps without a limit of bounces.
const SWEEPS: [u32; 2] = [3, 128];

impl Reflected {
    /// As [`Reflected::solve_limited`], by the recursion as written: from nothing, as many sweeps as `bounces`, or
    /// until the mean stands still.
    pub fn solve_literal(
        &mut self,
        s: Sampled,
        w: &Weights,
        first: &[(u32, u32)],
        bounces: Option<u32>,
        cut: &Cut,
    ) -> bool {
        self.segments = Segments::new(s, w);
        let recursion = Recursion { s, w, segments: &self.segments, photons: photon_segments(s, w) };
        // without a limit a chain counts no more than a straight segment
        let sweeps_of = |passages: u32| if bounces.is_some() { passages } else { 0 };
        let chains = recursion.photons.iter().map(|p| p.passages).max().unwrap_or(0);
        let start = vec![Vec3::ZERO; s.clusters.arrivals()];
        let mut levels = Levels::new(start, sweeps_of(chains.max(longest_chain(s, first))));
        let n = s.camera.arrivals.len();
        let nothing = || vec![SharedExponent::default(); n];
        self.direct = nothing();
        let mut before = 0.0;
        for k in 1..=bounces.unwrap_or(SWEEPS[1]) {
            if cut.is_raised() {
                return false;
            }
            let most = (bounces.is_some() || k == 1).then_some(k - 1);
            let read =
                |i: usize, passages: u32| levels.back(sweeps_of(passages)).map_or(Vec3::ZERO, |l| l[i]);
            let next = recursion.sweep(read, most, cut);
            if k == 1 {
                self.direct = next[..n].iter().map(|l| SharedExponent::encode(*l)).collect();
            }
            let now = first.iter().map(|&(i, _)| f64::from(luminance(next[i as usize]))).sum::<f64>();
            levels.push(next);
            let change = (now - before).abs();
            before = now;
            if bounces.is_none() && k >= SWEEPS[0] && change <= TOLERANCE * now {
                break;
            }
        }
        (self.carried, self.photons) = (nothing(), nothing());
        for &(arrival, passages) in first {
            if let Some(level) = levels.back(sweeps_of(passages)) {
                self.carried[arrival as usize] = SharedExponent::encode(level[arrival as usize]);
            }
        }
        true
    }
}

/// A segment that a light path sampled, seen from the camera.
#[derive(Clone, Copy)]
struct LightSegment {
    /// Light over its density, if a light stands at its beginning: `E / D_E`.
    emitted: Vec3,
    /// Factor on what is reflected at its beginning: `T / D_R`.
    carry: Vec3,
    /// Dirac lobes passed.
    passages: u32,
}

/// The light segments, by the arrivals that they brought.
fn photon_segments(s: Sampled, w: &Weights) -> Vec<LightSegment> {
    let n = s.camera.arrivals.len();
    let one = |j: usize| {
        let photon = s.light.photons.get(j);
        let Rivals::Later { light_choices, squeeze } = photon.rivals else {
            return LightSegment {
                emitted: photon_value(s, w, j) * s.cluster_of(n + j).area,
                carry: Vec3::ZERO,
                passages: photon.bounces,
            };
        };
        let before = j - 1;
        let light = light_choices * squeeze * w.densities[n + before].light;
        let camera = photon.camera_choices * w.densities[n + j].camera;
        LightSegment {
            emitted: Vec3::ZERO,
            carry: s.light.carries[j] * reciprocal(light + camera),
            passages: photon.bounces.saturating_sub(s.light.photons.bounces(before) + 1),
        }
    };
    (0..s.light.photons.len()).into_par_iter().with_min_len(GRAIN).map(one).collect()
}

/// What stays the same from sweep to sweep.
struct Recursion<'a> {
    s: Sampled<'a>,
    w: &'a Weights,
    segments: &'a Segments,
    photons: Vec<LightSegment>,
}

impl Recursion<'_> {
    /// What every arrival reflects, by number: a camera's along its segment, a light's along the segment with which
    /// its path goes on. `read`: what arrival `i` reflected, for a segment of so many passages; `most`: passages up
    /// to which light counts.
    fn sweep(&self, read: impl Fn(usize, u32) -> Vec3 + Sync, most: Option<u32>, cut: &Cut) -> Vec<Vec3> {
        let Self { s, w, segments, photons } = self;
        let n = s.camera.arrivals.len();
        let leaving = |i: usize| {
            let end = has_end(*s, i).then(|| (read(i + 1, s.camera.outgoing.passages(i)), Vec3::ZERO));
            segments.value(*s, i, emitted(*s, w, i, most), end)
        };
        let brought = |j: usize| {
            let p = &photons[j];
            if p.carry == Vec3::ZERO {
                return if most.is_none_or(|m| p.passages <= m) { p.emitted } else { Vec3::ZERO };
            }
            p.carry * read(n + j - 1, p.passages)
        };
        let numbers = || (0..s.clusters.arrivals()).into_par_iter().with_min_len(GRAIN);
        let values: Vec<Vec3> = numbers().map(|i| if i < n { leaving(i) } else { brought(i - n) }).collect();
        let shared = per_diffuse_cluster(*s, cut, |c| {
            let cameras = s.cameras(c).map(|i| (values[i] * s.camera.outgoing.pdf(i)).as_dvec3());
            let lights = s.lights(c).map(|j| (values[n + j] * s.light.arrivals.back_pdf(j)).as_dvec3());
            (cameras.sum::<DVec3>() + lights.sum::<DVec3>()).as_vec3() / c.area
        });
        let reflected = |i: usize| {
            if cut.is_raised() || (i >= n && s.light.photons.pdf(i - n) <= 0.0) {
                return Vec3::ZERO;
            }
            let k = s.clusters.of(i);
            let c = &s.clusters.clusters[k];
            let gathered = match c.class {
                SurfaceClass::Diffuse => self.reflectance(i) * shared[k],
                SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                    let (to_camera, to_light) = w.row(k, s.row(i, c)).split_at(c.cameras as usize);
                    let cameras: Vec3 =
                        to_camera.iter().zip(s.cameras(c)).map(|(f, i)| f.decode() * values[i]).sum();
                    let lights: Vec3 =
                        to_light.iter().zip(s.lights(c)).map(|(f, j)| f.decode() * values[n + j]).sum();
                    (cameras + lights) / c.area
                }
            };
            w.direct(i) + gathered
        };
        numbers().map(reflected).collect()
    }

    fn reflectance(&self, i: usize) -> Vec3 {
        let n = self.s.camera.arrivals.len();
        if i < n { self.s.camera.arrivals.reflectance(i) } else { self.s.light.arrivals.reflectance(i - n) }
    }
}
