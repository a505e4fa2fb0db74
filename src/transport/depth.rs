//! Propagation to a limited number of bounces.
//!
//! After `k` sweeps that start from nothing, what an arrival reflects is exactly the light of at most `k` bounces,
//! its own included, however deep the paths were whose arrivals share its cluster: so the limit is the number of
//! sweeps, and the paths are sampled without any. Passages through Dirac lobes are bounces too: a segment
//! with `m` of them reads what its end reflected `m` sweeps before.

use super::Cut;
use super::exchange::{
    FromPhotons, emitted, gather, gather_photons, has_end, per_index, photon_values, segments,
};
use super::propagate::Reflected;
use super::weigh::{Sampled, Weights};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::VecDeque;

/// Reflected light of at most so many bounces, carried and of photons.
struct Level {
    carried: Vec<Vec3>,
    photons: Vec<FromPhotons>,
}

/// The level that many sweeps before the last, if there was one.
fn back(levels: &VecDeque<Level>, sweeps: u32) -> Option<&Level> {
    levels.iter().rev().nth(sweeps as usize)
}

/// Most passages of a segment of the camera's paths; `first` as in [`Reflected::solve_limited`].
pub(super) fn longest_chain(s: Sampled, first: &[(u32, u32)]) -> u32 {
    s.camera.outgoing.iter().map(|o| o.passages).chain(first.iter().map(|f| f.1)).max().unwrap_or(0)
}

impl Reflected {
    /// As [`Reflected::solve`], for light of at most `bounces` bounces. `first`: for every path, its first
    /// arrival and the Dirac lobes before it, fewer than `bounces`. Returns `false` if it was stopped.
    pub fn solve_limited(
        &mut self,
        s: Sampled,
        w: &Weights,
        first: &[(u32, u32)],
        bounces: u32,
        cut: &Cut,
    ) -> bool {
        let n = s.camera.arrivals.len();
        let nothing = || vec![Vec3::ZERO; n];
        // as far back as the longest chain reads
        let kept = 1 + longest_chain(s, first) as usize;
        let mut levels =
            VecDeque::from([Level { carried: nothing(), photons: vec![FromPhotons::default(); n] }]);
        self.direct = nothing();
        let (constants, values) = (segments(s, w), photon_values(s, w));
        for k in 1..=bounces {
            if cut.is_raised() {
                return false;
            }
            let brought = per_index(s, |i| {
                // light met after k passages has bounced once more on its way
                let met = emitted(s, w, i, Some(k - 1));
                let level = back(&levels, s.camera.outgoing[i].passages).filter(|_| has_end(s, i));
                constants[i].value(met, level.map(|l| (l.carried[i + 1], l.photons[i + 1].brought)))
            });
            let photons = gather_photons(s, w, &constants, &values, cut, |p| p.bounces < k);
            let first_photons = if k == 1 { photons.clone() } else { Vec::new() };
            levels.push_back(Level { carried: gather(s, w, &brought, cut), photons });
            if levels.len() > kept {
                levels.pop_front();
            }
            if k == 1 {
                self.direct.clone_from(&levels[levels.len() - 1].carried);
                self.direct.par_iter_mut().zip(first_photons).for_each(|(d, p)| *d += p.reflected);
            }
        }
        (self.carried, self.photons) = (nothing(), vec![FromPhotons::default(); n]);
        for &(arrival, passages) in first {
            let i = arrival as usize;
            if let Some(level) = back(&levels, passages) {
                (self.carried[i], self.photons[i]) = (level.carried[i], level.photons[i]);
            }
        }
        true
    }
}
