//! Propagation to a limited number of bounces.
//!
//! After `k` sweeps that start from nothing, what an arrival reflects is exactly the light of at most `k` bounces,
//! its own included, however deep the paths were whose arrivals share its cluster: so the limit is the number of
//! sweeps, and the paths are sampled without any. Passages through Dirac lobes are bounces too: a segment
//! with `m` of them reads what its end reflected `m` sweeps before.

use super::Cut;
use super::exchange::{emitted, gather, gather_photons, has_end, photon_values, segments};
use super::propagate::Reflected;
use super::weigh::{Sampled, Weights};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::VecDeque;

/// Fewest arrivals that one task takes.
const GRAIN: usize = 512;

/// Reflected light of at most so many bounces, carried and of photons.
struct Level {
    carried: Vec<Vec3>,
    photons: Vec<Vec3>,
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
        let chains = s.camera.outgoing.iter().map(|o| o.passages).chain(first.iter().map(|f| f.1));
        let kept = 1 + chains.max().unwrap_or(0) as usize;
        let mut levels = VecDeque::from([Level { carried: nothing(), photons: nothing() }]);
        // the level of at most `k` bounces, once the last one made is `last`
        let at = |levels: &VecDeque<Level>, last: u32, k: u32| levels.len() - 1 - (last - k) as usize;
        self.direct = nothing();
        let (constants, values) = (segments(s, w), photon_values(s, w));
        for k in 1..=bounces {
            if cut.is_raised() {
                return false;
            }
            let brought: Vec<Vec3> = (0..n)
                .into_par_iter()
                .with_min_len(GRAIN)
                .map(|i| {
                    // light met after k passages has bounced once more on its way
                    let met = emitted(s, w, i, Some(k - 1));
                    match (k - 1).checked_sub(s.camera.outgoing[i].passages) {
                        Some(level) if has_end(s, i) => {
                            let Level { carried, photons } = &levels[at(&levels, k - 1, level)];
                            let all = &constants[i];
                            all.value(carried[i + 1], photons[i + 1]) - all.emitted + met
                        }
                        _ => met,
                    }
                })
                .collect();
            let photons = gather_photons(s, w, &values, cut, |p| p.bounces < k);
            let first_photons = if k == 1 { photons.clone() } else { Vec::new() };
            levels.push_back(Level { carried: gather(s, w, &brought, cut), photons });
            if levels.len() > kept {
                levels.pop_front();
            }
            if k == 1 {
                self.direct.clone_from(&levels[levels.len() - 1].carried);
                self.direct.par_iter_mut().zip(first_photons).for_each(|(d, p)| *d += p);
            }
        }
        (self.carried, self.photons) = (nothing(), nothing());
        for &(arrival, passages) in first {
            let i = arrival as usize;
            let level = &levels[at(&levels, bounces, bounces - passages)];
            (self.carried[i], self.photons[i]) = (level.carried[i], level.photons[i]);
        }
        true
    }
}
