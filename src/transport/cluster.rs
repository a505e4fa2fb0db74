//! Clusters: arrivals that share a voxel, a bin of normals and a class of surface.

use super::Cut;
use super::area::{Cell, FEW_POINTS, MOST_POINTS, POINTS_OF_PHOTONS};
use super::division::{Division, is_in_sight};
use super::grid::Grid;
use super::layout::{Layout, Piece};
use super::unseen::{self, UNSEEN};
use crate::shading::World;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

pub use super::layout::{Cluster, Numbered};

/// Fewest voxels or clusters that one task takes.
const GRAIN: usize = 64;

/// Which surface areas are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Areas {
    /// None: without light paths nothing is divided by one.
    None,
    /// For clusters where camera paths meet photons; others get rough ones.
    OfPhotons,
    /// For all, and for the densities as well.
    True,
}

/// All clusters of an iteration. Arrivals are numbered: the camera's first, then the lights'.
#[derive(Debug, Default)]
pub struct Clusters {
    /// The clusters.
    pub clusters: Vec<Cluster>,
    /// Numbers of the arrivals, cluster by cluster.
    pub order: Vec<u32>,
    /// See [`Clusters::place`] and [`Clusters::of`]: written in the order of clusters.
    place: Vec<AtomicU32>,
    of: Vec<AtomicU32>,
    /// Points at which it was looked for surfaces, to find areas.
    pub probes: u64,
    /// One for every cluster that is not empty, until the areas are known.
    pieces: Vec<Piece>,
    /// The most that was held while arrivals were grouped, bytes.
    most_bytes: usize,
}

impl Clusters {
    /// Clusters the arrivals; areas are left to [`Clusters::measure`]. Returns `false` if it was stopped.
    pub fn group(&mut self, world: &World, grid: &Grid, all: Numbered, cut: &Cut) -> bool {
        self.group_by_key(world, grid, all, false, cut)
    }

    /// The same, but light arrivals that no camera path has to do with are in a last cluster, which is empty.
    pub fn group_seen(&mut self, world: &World, grid: &Grid, all: Numbered, cut: &Cut) -> bool {
        self.group_by_key(world, grid, all, true, cut)
    }

    fn group_by_key(
        &mut self,
        world: &World,
        grid: &Grid,
        all: Numbered,
        only_seen: bool,
        cut: &Cut,
    ) -> bool {
        let n = all.len();
        *self = Self::default();
        let mut keys: Vec<(u64, u32)> = Vec::with_capacity(n);
        keys.par_extend((0..n as u32).into_par_iter().map(|i| (grid.key(&all.get(i)), i)));
        if cut.is_raised() {
            return false;
        }
        if only_seen {
            unseen::sort_out(&mut keys, all);
        }
        // numbers make the order unique, so it does not depend on the threads
        keys.par_sort_unstable();
        let counting = keys.partition_point(|k| k.0 != UNSEEN);
        let groups: Vec<&[(u64, u32)]> = keys[..counting].chunk_by(|a, b| a.0 == b.0).collect();
        let parts: Vec<Layout> =
            groups.par_chunks(GRAIN).map(|some| Layout::of(world, grid, all, some, cut)).collect();
        if cut.is_raised() {
            return false;
        }
        let scratch = keys.capacity() * size_of::<(u64, u32)>()
            + groups.capacity() * size_of::<&[(u64, u32)]>()
            + parts.iter().map(Layout::bytes).sum::<usize>();
        drop(groups);
        drop(keys);
        self.order.reserve_exact(counting);
        self.clusters.reserve_exact(parts.iter().map(|p| p.clusters.len()).sum::<usize>() + 1);
        self.pieces.reserve_exact(self.clusters.capacity());
        for mut part in parts {
            let before = self.order.len() as u32;
            let clusters = part.clusters.into_iter();
            self.clusters.extend(clusters.map(|c| Cluster { first: before + c.first, ..c }));
            self.order.append(&mut part.order);
            self.pieces.append(&mut part.pieces);
        }
        let nobodys = self.clusters.len() as u32;
        self.clusters.extend((counting < n).then_some(Cluster::OF_NOBODY));
        self.most_bytes = scratch + self.bytes();
        let all = |value: u32| (0..n).into_par_iter().map(move |_| AtomicU32::new(value)).collect();
        (self.place, self.of) = (all(u32::MAX), all(nobodys));
        let (order, place, of) = (&self.order, &self.place, &self.of);
        let write = |(c, cluster): (usize, &Cluster)| {
            for at in cluster.first..cluster.first + cluster.cameras + cluster.lights {
                let i = order[at as usize] as usize;
                place[i].store(at, Relaxed);
                of[i].store(c as u32, Relaxed);
            }
        };
        self.clusters.par_iter().with_min_len(GRAIN).enumerate().for_each(write);
        true
    }

    /// Finds the clusters' areas. Returns `false` if it was stopped.
    pub fn measure(&mut self, world: &World, grid: &Grid, all: Numbered, areas: Areas, cut: &Cut) -> bool {
        let order = &self.order;
        let of_one = |(c, piece): (&mut Cluster, &Piece)| {
            if cut.is_raised() {
                return 0;
            }
            let members = &order[c.first as usize..][..(c.cameras + c.lights) as usize];
            measure(world, grid, all, members, (c, piece), areas)
        };
        let pieces = std::mem::take(&mut self.pieces);
        let clusters = self.clusters.par_iter_mut().zip(&pieces);
        self.probes = clusters.with_min_len(GRAIN).map(of_one).sum();
        !cut.is_raised()
    }

    /// Place in the order of arrival number `i`, which is in a cluster.
    #[inline]
    pub fn place(&self, i: usize) -> u32 {
        self.place[i].load(Relaxed)
    }

    /// Cluster of arrival number `i`.
    #[inline]
    pub fn of(&self, i: usize) -> usize {
        self.of[i].load(Relaxed) as usize
    }

    /// What the first `count` arrivals have at their places; nothing for those in no cluster.
    pub fn by_number<T: Copy + Default + Send + Sync>(&self, placed: &[T], count: usize) -> Vec<T> {
        let one = |i| placed.get(self.place(i) as usize).copied().unwrap_or_default();
        (0..count).into_par_iter().map(one).collect()
    }

    /// Arrivals, whether in a cluster or not.
    pub fn arrivals(&self) -> usize {
        self.of.len()
    }

    /// The most that was held while arrivals were grouped, bytes.
    pub fn most_bytes(&self) -> usize {
        self.most_bytes.max(self.bytes())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.clusters.capacity() * size_of::<Cluster>()
            + self.pieces.capacity() * size_of::<Piece>()
            + (self.order.capacity() + self.place.capacity() + self.of.capacity()) * size_of::<u32>()
    }
}

/// The areas of a cluster, its share of those of a part. Returns how many points were looked at.
fn measure(
    world: &World,
    grid: &Grid,
    all: Numbered,
    members: &[u32],
    (c, piece): (&mut Cluster, &Piece),
    areas: Areas,
) -> u64 {
    let representative = all.get(piece.first());
    let voxel = grid.voxel(representative.position);
    let sharing = piece.sharing as f32;
    let (_, edge) = grid.place(&voxel);
    c.area = edge * edge / sharing;
    if areas == Areas::None {
        return 0;
    }
    let (is_divided, is_cut) = (piece.is_divided(), piece.in_sight.is_some());
    let cell = Cell { grid, voxel, representative: &representative, is_divided, is_cut };
    let division = Division::new(world, grid, piece.firsts().map(|i| all.place(i)));
    let exact = cell.on_one_triangle(world, members.iter().map(|&i| all.triangle(i)));
    let mut probes = 0;
    let mut estimate = |points: u32| {
        let belongs = |p, n| division.part(p, n) == usize::from(piece.part);
        let is_shown = |p, n| piece.in_sight.is_none_or(|s| is_in_sight(world, grid, (p, n)) == s);
        exact.unwrap_or_else(|| cell.coverage(world, points, &belongs, &is_shown, &mut probes)) / sharing
    };
    let is_true = areas == Areas::True;
    c.area = estimate(if is_true { MOST_POINTS } else { FEW_POINTS });
    if is_true || (c.cameras > 0 && c.lights > 0) {
        let (least, most) = POINTS_OF_PHOTONS.into_inner();
        c.inverse_area = 1.0 / estimate(c.lights.clamp(least, most));
    }
    probes
}
