//! What an iteration's graph looks like, in figures: how large its clusters are, and how strongly the transfer
//! operator feeds back. Its spectral radius is at most its largest row sum.

use super::Cut;
use super::exchange::{Segments, offer, reflect};
use super::operator::Sweeps;
use super::propagate::Reflected;
use super::weigh::{Sampled, Weights};
use serde::Serialize;

/// Figures of one iteration.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Clusters by their number of arrivals: element `k` counts those with `2^k` to `2^(k+1) - 1`.
    pub sizes: Vec<u64>,
    /// Arrivals of the largest cluster.
    pub largest: u32,
    /// Row sums of the transfer operator between camera segments, largest channel.
    pub row_sums: RowSums,
    /// What many sweeps do, if somebody asked.
    pub sweeps: Option<Sweeps>,
}

/// How strongly arrivals reflect what leaves their clusters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RowSums {
    /// The least.
    pub least: f32,
    /// Their mean.
    pub mean: f64,
    /// The largest.
    pub largest: f32,
}

impl Reflected {
    /// Looks at the iteration that was solved. `starts`: for every path, its first arrival. `count`: of
    /// [`Reflected::sweeps`]; zero: none. If it is stopped, what it says is incomplete.
    pub fn report(&self, s: Sampled, w: &Weights, starts: &[u32], count: u32, cut: &Cut) -> Report {
        let (sizes, largest) = sizes(s);
        let sweeps = (count > 0).then(|| self.sweeps(s, w, starts, count, cut));
        Report { sizes, largest, row_sums: row_sums(s, w, &self.segments, cut), sweeps }
    }
}

/// Clusters by the logarithm of their size, and the largest size.
fn sizes(s: Sampled) -> (Vec<u64>, u32) {
    let mut sizes = Vec::new();
    let mut largest = 0;
    for n in s.clusters.clusters.iter().map(|c| c.cameras + c.lights).filter(|&n| n > 0) {
        largest = largest.max(n);
        let k = n.ilog2() as usize;
        if sizes.len() <= k {
            sizes.resize(k + 1, 0);
        }
        sizes[k] += 1;
    }
    (sizes, largest)
}

fn row_sums(s: Sampled, w: &Weights, constants: &Segments, cut: &Cut) -> RowSums {
    let sums = reflect(s, w, |i| offer(s, i, constants.carry(s, i)), |_, sum| sum.max_element(), cut);
    let mut found = RowSums { least: f32::INFINITY, ..RowSums::default() };
    for &sum in &sums {
        found.least = found.least.min(sum);
        found.largest = found.largest.max(sum);
        found.mean += f64::from(sum) / sums.len() as f64;
    }
    if sums.is_empty() { RowSums::default() } else { found }
}
