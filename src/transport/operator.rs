//! How the transfer operator between the camera segments of an iteration behaves under many sweeps, for diagnosis:
//! whether light could grow without bound, and how many sweeps are needed from which start.

use super::Cut;
use super::exchange::{has_end, offer, per_index, reflect};
use super::propagate::Reflected;
use super::weigh::{Sampled, Weights};
use crate::math::SharedExponent;
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

/// Figures of many sweeps over one iteration's graph.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Sweeps {
    /// How many.
    pub count: u32,
    /// The light that a sweep leaves, as a share: its geometric mean over the second half of them, if nothing emits and
    /// every arrival reflected one unit at first. An estimate of the spectral radius.
    pub radius: f64,
    /// The most light there was after any of them, over that of the first moment.
    pub peak: f64,
    /// Distance from the solution, over the solution, summed over first arrivals: after 1, 2, 4 and so on sweeps from
    /// darkness.
    pub from_darkness: Vec<f64>,
    /// The same from what every path's own tail says.
    pub from_tails: Vec<f64>,
}

impl Reflected {
    /// Sweeps `count` times over the iteration that was solved, without limit of bounces. `starts`: for every path, its
    /// first arrival. If it is stopped, what it says is incomplete.
    pub fn sweeps(&self, s: Sampled, w: &Weights, starts: &[u32], count: u32, cut: &Cut) -> Sweeps {
        let [radius, peak] = self.growth(s, w, count, cut);
        let tails = || self.own_tails(s, w, starts, cut);
        let solution = (0..count).fold(tails(), |light, _| self.sweep(s, w, light, cut));
        let sum = |f: &dyn Fn(usize) -> Vec3| {
            starts.iter().map(|&i| f64::from(f(i as usize).abs().element_sum())).sum::<f64>()
        };
        let all = sum(&|i| solution[i].decode() + self.photons[i].decode()).max(f64::MIN_POSITIVE);
        let distances = |mut light: Vec<SharedExponent>| {
            let mut found = Vec::new();
            // not up to the end, where the solution's own error would show
            for sweep in 1..=count / 4 {
                light = self.sweep(s, w, light, cut);
                if sweep.is_power_of_two() {
                    found.push(sum(&|i| light[i].decode() - solution[i].decode()) / all);
                }
            }
            found
        };
        let darkness = vec![SharedExponent::default(); solution.len()];
        Sweeps { count, radius, peak, from_darkness: distances(darkness), from_tails: distances(tails()) }
    }

    /// Growth a sweep in the second half of `count`, and the most light after any.
    pub(super) fn growth(&self, s: Sampled, w: &Weights, count: u32, cut: &Cut) -> [f64; 2] {
        let norm = |light: &[Vec3]| light.iter().map(|l| f64::from(l.abs().max_element())).sum::<f64>();
        let mut light = vec![Vec3::ONE; s.camera.arrivals.len()];
        let first = norm(&light);
        // logarithms over that of the first moment: of the light now, after half of the sweeps, and the most
        let (mut now, mut half, mut peak) = (0.0_f64, 0.0, f64::NEG_INFINITY);
        for sweep in 1..=count {
            let offers = per_index(s, |i| match has_end(s, i) {
                true => offer(s, i, self.segments.carry(s, i) * light[i + 1]),
                false => Vec3::ZERO,
            });
            light = reflect(s, w, |i| offers[i], |_, light| light, cut);
            let left = norm(&light) / first;
            // what is left is not told from nothing
            if left < f64::from(f32::MIN_POSITIVE) || cut.is_raised() {
                return [0.0, peak.exp()];
            }
            now += left.ln();
            peak = peak.max(now);
            if sweep == count / 2 {
                half = now;
            }
            // kept at one, against underflow
            let scale = (1.0 / left) as f32;
            light.par_iter_mut().for_each(|l| *l *= scale);
        }
        [((now - half) / f64::from((count - count / 2).max(1))).exp(), peak.exp()]
    }
}
