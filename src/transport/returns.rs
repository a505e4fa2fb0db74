//! Camera paths that return to a cluster.
//!
//! An arrival is there because of what its path did before, and what the path brings after it is no draw of its own:
//! that its path came back says how these segments went. So it gathers from its own segment and from those of other
//! paths, and in place of `P_cam` stands the sum over the arrivals that made these. What earlier segments of its
//! path bring would lead back to it, too, and light could go round and grow.

use super::cluster::Cluster;
use super::store::CameraStore;
use super::weigh::Sampled;
use std::ops::Range;

/// Most camera arrivals in a cluster that looks out for returning paths: in a larger one, one path's part is small.
const MOST: u32 = 64;

impl CameraStore {
    /// Whether two arrivals, the earlier one first, are of the same path.
    fn are_one_path(&self, earlier: u32, later: u32) -> bool {
        (earlier..later).all(|i| self.outgoing[i as usize].forward > 0.0)
    }
}

impl Sampled<'_> {
    /// Rows of the cluster's camera arrivals that are of the same path as that of a row, itself included.
    pub fn kin(&self, c: &Cluster, row: usize) -> Range<usize> {
        if c.cameras > MOST {
            return row..row + 1;
        }
        // arrivals are in the order of their numbers, so those of a path follow each other
        let order = &self.clusters.order[c.camera_places()];
        let is_linked = |k: &usize| self.camera.are_one_path(order[*k], order[*k + 1]);
        let before = (0..row).rev().take_while(is_linked).count();
        let after = (row..order.len() - 1).take_while(is_linked).count();
        row - before..row + after + 1
    }
}

/// Whether the arrival of a row gathers from the segment that leaves that of a column.
#[inline]
pub(super) fn gathers(kin: &Range<usize>, row: usize, column: usize) -> bool {
    column == row || !kin.contains(&column)
}

/// `P_cam` over its part; zero if the part is so little that nothing can have come of it.
pub(super) fn ratio(all: f32, part: f32) -> f32 {
    let r = all / part;
    if r.is_finite() { r } else { 0.0 }
}

#[cfg(test)]
mod tests;
