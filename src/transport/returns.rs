//! Camera paths that return to a cluster.
//!
//! An arrival is there because of what its path did before, and what the path brings after it is no draw of its own:
//! that its path came back says how these segments went. So it gathers from its own segment and from those of other
//! paths, and in place of `P_cam` stands the sum over the arrivals that made these. What earlier segments of its
//! path bring would lead back to it, too, and light could go round and grow.

use super::cluster::Cluster;
use super::store::CameraStore;
use super::weigh::{Density, Sampled};
use glam::Vec3;
use std::ops::Range;

/// Most camera arrivals in a cluster that looks out for returning paths: in a larger one, one path's part is small.
const MOST: u32 = 64;

impl CameraStore {
    /// Whether two arrivals, the earlier one first, are of the same path.
    fn are_one_path(&self, earlier: u32, later: u32) -> bool {
        (earlier..later).all(|i| self.outgoing.has_end(i as usize))
    }
}

/// Which segments that leave a cluster one of its camera arrivals gathers.
pub(super) struct Gathered {
    row: usize,
    /// Rows of the arrivals of its path, itself included.
    kin: Range<usize>,
}

impl Gathered {
    /// By the row of the arrival.
    pub fn new(s: Sampled, c: &Cluster, row: usize) -> Self {
        if c.cameras > MOST {
            return Self { row, kin: row..row + 1 };
        }
        // arrivals are in the order of their numbers, so those of a path follow each other
        let order = &s.clusters.order[c.camera_places()];
        let is_linked = |k: &usize| s.camera.are_one_path(order[*k], order[*k + 1]);
        let before = (0..row).rev().take_while(is_linked).count();
        let after = (row..order.len() - 1).take_while(is_linked).count();
        Self { row, kin: row - before..row + after + 1 }
    }

    /// Whether that is all of them.
    pub fn is_all(&self) -> bool {
        self.kin.len() == 1
    }

    /// Whether the segment is among them that leaves the arrival of this row.
    pub fn contains(&self, row: usize) -> bool {
        row == self.row || !self.kin.contains(&row)
    }

    /// Arrivals that they leave.
    pub fn arrivals(&self, s: Sampled, c: &Cluster) -> impl Iterator<Item = usize> {
        s.cameras(c).enumerate().filter(|&(row, _)| self.contains(row)).map(|(_, i)| i)
    }
}

/// Leaves returning paths out of the lobe values of a cluster that is evaluated pair by pair: `values` are rows of `width`, of
/// which a column for every camera arrival comes first, and `pdfs` are `q p` of the same; `parts`: what
/// [`Weights::apart`](super::weigh::Weights::apart) says.
pub(super) fn leave_out(
    s: Sampled,
    c: &Cluster,
    pdfs: &[f32],
    values: &mut [Vec3],
    width: usize,
    densities: &[Density],
    parts: &mut [f32],
) {
    let n = c.cameras as usize;
    for (row, values) in values.chunks_mut(width).enumerate() {
        let gathered = Gathered::new(s, c, row);
        if gathered.is_all() {
            continue;
        }
        for (column, value) in values[..n].iter_mut().enumerate() {
            let rest = (0..n).filter(|&r| gathered.contains(r)).map(|r| pdfs[r * n + column]);
            let apart = match gathered.contains(column) {
                true => ratio(densities[column].camera, rest.sum()),
                false => 0.0,
            };
            *value *= apart;
            if column == row {
                parts[row] = apart;
            }
        }
    }
}

/// `P_cam` over its part; zero if the part is so little that nothing can have come of it.
pub(super) fn ratio(all: f32, part: f32) -> f32 {
    let r = all / part;
    if r.is_finite() { r } else { 0.0 }
}

#[cfg(test)]
mod tests;
