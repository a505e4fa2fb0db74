//! Learns where light paths should begin from what those of this iteration brought to the picture.
//!
//! What a photon brings is linear in its flux, so a walk along the camera paths tells, for every arrival, how much one
//! unit of light that it reflects adds to the picture, as a share of what the pixel shows: the error of a pixel is
//! judged by its brightness. The densities of later iterations rest on what earlier ones found, and of every iteration
//! on nothing of its own: that biases nothing.

use super::exchange::{GRAIN, has_end, per_diffuse_cluster, segments};
use super::photons::photon_values;
use super::weigh::{Sampled, Weights};
use super::{Cut, store::LightStore};
use crate::shading::SurfaceClass;
use crate::shading::emitters::{EmissionGuide, Lesson};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Lessons of an iteration at most, and what is enough for a guide.
const MOST: usize = 1 << 17;

/// A guide, and what its successor is to be made of.
#[derive(Debug, Default)]
pub struct Guiding {
    /// Where light paths should begin, as far as it is known.
    pub guide: EmissionGuide,
    lessons: Vec<Lesson>,
}

/// The first arrival of a camera path.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Its number.
    pub arrival: u32,
    /// What one unit of light that it reflects adds to the picture.
    pub worth: Vec3,
}

impl Guiding {
    /// Whether the iteration `index`, with so many light paths, has something to teach. The guide changes after the
    /// first iteration, and whenever the number of iterations has doubled; the last ones before teach it, as
    /// many as are needed.
    pub fn is_wanted(index: u32, paths: usize) -> bool {
        let left = (index + 1).next_power_of_two() - (index + 1);
        paths > 0 && left as usize * paths < MOST
    }

    /// Learns from the iteration `index`: `starts` are the first arrivals of all paths that have one, in order.
    pub fn learn(&mut self, s: Sampled, w: &Weights, starts: &[Start], index: u32, cut: &Cut) {
        let worth = worth_of_paths(s, w, starts, cut);
        let stride = worth.len().div_ceil(MOST).max(1);
        let chosen = s.light.starts.iter().zip(worth).step_by(stride);
        self.lessons.extend(chosen.map(|(start, worth)| Lesson { draw: start.draw, worth }));
        if (index + 1).is_power_of_two() && !cut.is_raised() {
            self.guide = s.world.emission_guide(std::mem::take(&mut self.lessons));
        }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.guide.bytes() + self.lessons.capacity() * size_of::<Lesson>()
    }
}

/// What every light path of the store brought.
fn worth_of_paths(s: Sampled, w: &Weights, starts: &[Start], cut: &Cut) -> Vec<f32> {
    let arrivals = worth_of_arrivals(s, w, starts);
    let shared = per_diffuse_cluster(s, cut, |c| {
        let reflecting = s.cameras(c).map(|i| (arrivals[i] * s.camera.arrivals[i].reflectance).as_dvec3());
        reflecting.sum::<DVec3>().as_vec3()
    });
    let values = photon_values(s, w);
    let cameras = s.camera.arrivals.len();
    let of_photon = |j: usize| {
        let place = s.clusters.place[cameras + j];
        let k = s.clusters.of[cameras + j] as usize;
        let c = &s.clusters.clusters[k];
        let reflected = match c.class {
            SurfaceClass::Diffuse => shared[k] * s.light.arrivals[j].back_pdf,
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let column = (place - c.first) as usize;
                s.cameras(c).enumerate().map(|(row, i)| w.row(k, row)[column] * arrivals[i]).sum()
            }
        };
        reflected.dot(values[j])
    };
    let LightStore { photons, starts, .. } = s.light;
    let ends = starts.iter().skip(1).map(|s| s.first).chain([photons.len() as u32]);
    let ranges: Vec<_> = starts.iter().zip(ends).map(|(s, end)| s.first as usize..end as usize).collect();
    let of_path = |range: std::ops::Range<usize>| range.map(of_photon).sum();
    ranges.into_par_iter().with_min_len(GRAIN).map(of_path).collect()
}

/// What one unit of basic radiance that each camera arrival reflects of its photons adds to the picture.
fn worth_of_arrivals(s: Sampled, w: &Weights, starts: &[Start]) -> Vec<Vec3> {
    let constants = segments(s, w);
    let n = s.camera.arrivals.len();
    let some_paths = |(k, paths): (usize, &[Start])| {
        let first = paths[0].arrival as usize;
        let end = starts.get((k + 1) * GRAIN).map_or(n, |e| e.arrival as usize);
        let mut worth = vec![Vec3::ZERO; end - first];
        for p in paths {
            worth[p.arrival as usize - first] = p.worth;
        }
        for i in first..end {
            if has_end(s, i) {
                let along = worth[i - first] * constants[i].along_path(s, w, i) * constants[i].carry;
                worth[i + 1 - first] = along;
            }
            worth[i - first] *= s.camera.inverse_n2[i];
        }
        worth
    };
    starts.par_chunks(GRAIN).enumerate().flat_map_iter(some_paths).collect()
}
