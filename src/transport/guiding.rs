//! Learns where light paths should begin from what those of this iteration brought to the picture.
//!
//! What a photon brings is linear in its flux, so a walk along the camera paths tells, for every arrival, how much one
//! unit of light that it reflects adds to the picture, as a share of what the pixel shows: the error of a pixel is
//! judged by its brightness. The densities of later iterations rest on what earlier ones found, and of every iteration
//! on nothing of its own: that biases nothing.

use super::cluster::Cluster;
use super::exchange::{GRAIN, along_path, has_end, per_diffuse_cluster};
use super::photons::photon_values;
use super::propagate::Reflected;
use super::weigh::{Sampled, Weights};
use super::{Cut, store::LightStore};
use crate::math::SharedExponent;
use crate::shading::emitters::{EmissionGuide, Lesson};
use crate::shading::{SurfaceClass, World};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Lessons of an iteration at most, and what is enough for a guide.
const MOST: usize = 1 << 17;

/// Iterations that teach at most, where photons are few.
const LAST: u32 = 32;

/// A guide, and what its successor is to be made of.
#[derive(Debug, Default)]
pub struct Guiding {
    /// Where light paths should begin, as far as it is known.
    pub guide: EmissionGuide,
    lessons: Vec<Lesson>,
    /// Iterations so far.
    iterations: u32,
}

/// The first arrival of a camera path.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Its number.
    pub arrival: u32,
    /// Dirac lobes before it.
    pub passages: u32,
    /// What one unit of light that it reflects adds to the picture.
    pub worth: Vec3,
}

/// What an iteration came to.
#[derive(Clone, Copy)]
pub struct Outcome<'a> {
    /// What was sampled.
    pub sampled: Sampled<'a>,
    /// How it was weighed.
    pub weights: &'a Weights,
    /// What it reflects.
    pub reflected: &'a Reflected,
    /// First arrivals of all paths that have one, in order.
    pub starts: &'a [Start],
    /// Bounces up to which light counts.
    pub max_depth: Option<u32>,
}

impl Guiding {
    /// An iteration begins, with so many light paths that arrived: says whether it has something to teach. The guide
    /// changes after the first, and whenever the number of iterations has doubled; the last ones before teach
    /// it, as many as are needed.
    pub fn begin_iteration(&mut self, paths: usize) -> bool {
        self.iterations += 1;
        let left = self.iterations.next_power_of_two() - self.iterations;
        paths > 0 && left < LAST && left as usize * paths < MOST
    }

    /// Learns from an iteration, or from one of its bands. Returns the bytes that it took.
    pub fn learn(&mut self, o: Outcome, cut: &Cut) -> usize {
        let worth = worth_of_paths(o, cut);
        let stride = worth.len().div_ceil(MOST).max(1);
        let colors = o.reflected.carried.len() + o.sampled.light.photons.len();
        let bytes = colors * size_of::<SharedExponent>()
            + o.sampled.clusters.clusters.len() * size_of::<Vec3>()
            + worth.len() * size_of::<f32>();
        let chosen = o.sampled.light.starts.iter().zip(worth).step_by(stride);
        self.lessons.extend(chosen.map(|(start, worth)| Lesson { draw: start.draw, worth }));
        bytes + self.bytes()
    }

    /// An iteration that teaches something is over.
    pub fn finish_iteration(&mut self, world: &World, cut: &Cut) {
        if self.iterations.is_power_of_two() && !cut.is_raised() {
            self.guide = world.emission_guide(std::mem::take(&mut self.lessons));
        }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.lessons.capacity() * size_of::<Lesson>() + self.guide.bytes()
    }
}

/// What every light path of the store brought.
fn worth_of_paths(o: Outcome, cut: &Cut) -> Vec<f32> {
    let Outcome { sampled: s, weights: w, .. } = o;
    let arrivals = worth_of_arrivals(o, |_| 1.0);
    let shared = per_diffuse_cluster(s, cut, |c| {
        let reflecting =
            s.cameras(c).map(|i| (arrivals[i].decode() * s.camera.arrivals.reflectance(i)).as_dvec3());
        reflecting.sum::<DVec3>().as_vec3()
    });
    let values = photon_values(s, w);
    let cameras = s.camera.arrivals.len();
    let of_photon = |j: usize| {
        if cut.is_raised() || o.max_depth.is_some_and(|most| s.light.photons.bounces(j) >= most) {
            return 0.0;
        }
        let k = s.clusters.of(cameras + j);
        let c = &s.clusters.clusters[k];
        let reflected = match c.class {
            SurfaceClass::Diffuse => shared[k] * s.light.arrivals.back_pdf(j),
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let column = s.row(cameras + j, c);
                s.cameras(c)
                    .enumerate()
                    .map(|(row, i)| w.row(k, row)[column].decode() * arrivals[i].decode())
                    .sum()
            }
        };
        reflected.dot(values[j].decode())
    };
    let LightStore { photons, starts, .. } = s.light;
    let ends = starts.iter().skip(1).map(|s| s.first).chain([photons.len() as u32]);
    let ranges: Vec<_> = starts.iter().zip(ends).map(|(s, end)| s.first as usize..end as usize).collect();
    let of_path = |range: std::ops::Range<usize>| range.map(of_photon).sum();
    ranges.into_par_iter().with_min_len(GRAIN).map(of_path).collect()
}

/// What one unit of light that each camera arrival reflects of its photons adds to the picture. `spread`: a factor for
/// every bounce, by the cluster that is left.
pub(super) fn worth_of_arrivals(o: Outcome, spread: impl Fn(&Cluster) -> f32 + Sync) -> Vec<SharedExponent> {
    let Outcome { sampled: s, weights: w, starts, .. } = o;
    let constants = &o.reflected.segments;
    let n = s.camera.arrivals.len();
    let some_paths = |(k, paths): (usize, &[Start])| {
        let first = paths[0].arrival as usize;
        let end = starts.get((k + 1) * GRAIN).map_or(n, |e| e.arrival as usize);
        let mut worth = vec![SharedExponent::default(); end - first];
        for (p, next) in paths.iter().zip(paths.iter().skip(1).map(Some).chain([None])) {
            let (mut along, mut bounces) = (p.worth, p.passages);
            for i in p.arrival as usize..next.map_or(end, |p| p.arrival as usize) {
                if o.max_depth.is_some_and(|most| bounces >= most) {
                    break;
                }
                worth[i - first] = SharedExponent::encode(along);
                if !has_end(s, i) {
                    break;
                }
                along *= along_path(s, w, i) * constants.carry(s, i) * spread(s.cluster_of(i));
                bounces = bounces.saturating_add(1 + s.camera.outgoing.passages(i));
            }
        }
        worth
    };
    starts.par_chunks(GRAIN).enumerate().flat_map_iter(some_paths).collect()
}
