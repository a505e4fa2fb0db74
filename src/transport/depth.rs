//! Propagation to a limited number of bounces.
//!
//! After `k` sweeps that start from nothing, what an arrival reflects is exactly the light of at most `k` bounces,
//! its own included, however deep the paths were whose arrivals share its cluster: so the limit is the number of
//! sweeps, and the paths are sampled without any. Passages through Dirac lobes are bounces too: a segment
//! with `m` of them reads what its end reflected `m` sweeps before.

use super::Cut;
use super::exchange::{Segments, emitted, gather, has_end, offers};
use super::photons::{gather_photons, photon_values};
use super::propagate::Reflected;
use super::weigh::{Sampled, Weights};
use crate::math::SharedExponent;
use std::collections::VecDeque;

/// Reflected light of at most so many bounces, carried and of photons.
struct Level {
    carried: Vec<SharedExponent>,
    photons: Vec<SharedExponent>,
}

/// The results of the last sweeps, as many as the longest chain reads back.
pub(super) struct Levels<T> {
    ring: VecDeque<T>,
    kept: usize,
}

impl<T> Levels<T> {
    /// With the start, for chains of at most so many passages.
    pub fn new(start: T, passages: u32) -> Self {
        Self { ring: VecDeque::from([start]), kept: 1 + passages as usize }
    }

    /// Adds the result of a sweep, and forgets what nobody reads any more.
    pub fn push(&mut self, level: T) {
        self.ring.push_back(level);
        if self.ring.len() > self.kept {
            self.ring.pop_front();
        }
    }

    /// The level that many sweeps before the last, if there was one.
    pub fn back(&self, sweeps: u32) -> Option<&T> {
        self.ring.iter().rev().nth(sweeps as usize)
    }
}

/// Most passages of a segment of the camera's paths; `first` as in [`Reflected::solve_limited`].
pub(super) fn longest_chain(s: Sampled, first: &[(u32, u32)]) -> u32 {
    first.iter().map(|f| f.1).fold(s.camera.outgoing.most_passages(), u32::max)
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
        let nothing = || vec![SharedExponent::default(); n];
        let start = Level { carried: nothing(), photons: nothing() };
        let mut levels = Levels::new(start, longest_chain(s, first));
        self.direct = nothing();
        self.segments = Segments::new(s, w);
        let values = photon_values(s, w);
        for k in 1..=bounces {
            if cut.is_raised() {
                return false;
            }
            let offers = offers(s, |i| {
                // light met after k passages has bounced once more on its way
                let met = emitted(s, w, i, Some(k - 1));
                let level = levels.back(s.camera.outgoing.passages(i)).filter(|_| has_end(s, i));
                let end = level.map(|l| (l.carried[i + 1].decode(), l.photons[i + 1].decode()));
                self.segments.value(s, i, met, end)
            });
            let photons = gather_photons(s, w, &values, cut, |bounces| bounces < k);
            let carried = gather(s, w, &offers, cut);
            if k == 1 {
                self.direct.clone_from(&carried);
                self.add_direct_photons(s, &photons);
            }
            levels.push(Level { carried, photons });
        }
        (self.carried, self.photons) = (nothing(), nothing());
        for &(arrival, passages) in first {
            let i = arrival as usize;
            if let Some(level) = levels.back(passages) {
                (self.carried[i], self.photons[i]) = (level.carried[i], level.photons[i]);
            }
        }
        true
    }
}
