//! Clusters: arrivals that share a voxel, a bin of normals and a class of surface.

use super::Cut;
use super::area::{Cell, FEW_POINTS, MOST_POINTS, POINTS_OF_PHOTONS};
use super::division::{Division, MOST_PARTS, divide};
use super::grid::Grid;
use super::store::{Arrival, Arrivals};
use super::unseen::{self, UNSEEN};
use crate::math::sampler::hash;
use crate::shading::{SurfaceClass, World};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// Most camera arrivals, and half of the most light arrivals, in a cluster whose lobes are evaluated pair by
/// pair; larger ones are divided at random.
const MOST_PAIRED: u32 = 16;
/// Fewest voxels or clusters that one task takes.
const GRAIN: usize = 64;

/// A cluster. Its arrivals are neighbours in [`Clusters::order`]: the camera's first, then the lights'.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    /// Place of the first arrival in the order.
    pub first: u32,
    /// Camera arrivals.
    pub cameras: u32,
    /// Light arrivals.
    pub lights: u32,
    /// Area by which the densities of techniques are divided: a rough estimate of the surface area that it covers.
    /// Only ratios of techniques come of it, and those need one figure for all of them rather than the true one.
    pub area: f32,
    /// One over the surface area, right on average and independent of `area`, so that the product of a weight and a
    /// photon over the area is right, too; zero where nobody asks.
    pub inverse_area: f32,
    /// Class of its surfaces.
    pub class: SurfaceClass,
}

/// Number of no arrival.
const NOBODY: u32 = u32::MAX;

/// The piece of a surface that a cluster is; of use until its areas are known.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// First arrival of each part of its voxel; [`NOBODY`] where there is none.
    firsts: [u32; MOST_PARTS],
    /// The part that it is in.
    part: u8,
    /// Clusters that share that part at random, itself included.
    sharing: u32,
}

impl Cluster {
    /// The empty cluster of arrivals that do not count.
    const OF_NOBODY: Self =
        Self { first: 0, cameras: 0, lights: 0, area: 1.0, inverse_area: 0.0, class: SurfaceClass::Diffuse };

    /// Places of the camera's arrivals.
    pub fn camera_places(&self) -> Range<usize> {
        self.first as usize..(self.first + self.cameras) as usize
    }

    /// Places of the lights' arrivals.
    pub fn light_places(&self) -> Range<usize> {
        let start = self.first + self.cameras;
        start as usize..(start + self.lights) as usize
    }
}

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

/// The arrivals of an iteration, by number.
#[derive(Clone, Copy)]
pub struct Numbered<'a> {
    /// The camera's.
    pub camera: &'a Arrivals,
    /// The lights'.
    pub light: &'a Arrivals,
}

impl Numbered<'_> {
    /// Arrival number `i`.
    #[inline]
    pub fn get(&self, i: u32) -> Arrival {
        let i = i as usize;
        if i < self.camera.len() { self.camera.get(i) } else { self.light.get(i - self.camera.len()) }
    }

    /// Position and normal of arrival number `i`.
    #[inline]
    fn place(&self, i: u32) -> (Vec3, Vec3) {
        let i = i as usize;
        match i.checked_sub(self.camera.len()) {
            None => self.camera.place(i),
            Some(j) => self.light.place(j),
        }
    }

    /// Instance of arrival number `i`, and triangle of its mesh.
    #[inline]
    fn triangle(&self, i: u32) -> (u32, u32) {
        let i = i as usize;
        match i < self.camera.len() {
            true => self.camera.triangle(i),
            false => self.light.triangle(i - self.camera.len()),
        }
    }

    fn len(&self) -> usize {
        self.camera.len() + self.light.len()
    }
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

/// Some clusters as they are laid out one after the other.
#[derive(Default)]
struct Layout {
    /// Number of the camera's arrivals.
    cameras: u32,
    order: Vec<u32>,
    clusters: Vec<Cluster>,
    pieces: Vec<Piece>,
}

impl Layout {
    /// The clusters of these groups, each of which shares a key.
    fn of(world: &World, grid: &Grid, all: Numbered, groups: &[&[(u64, u32)]], cut: &Cut) -> Self {
        let members = groups.iter().copied().flatten();
        // before any ray: they lie far apart in memory, and are fetched side by side
        let places: Vec<(Vec3, Vec3)> = members.map(|&(_, i)| all.place(i)).collect();
        let mut layout = Self { cameras: all.camera.len() as u32, ..Self::default() };
        layout.order.reserve_exact(places.len());
        layout.clusters.reserve_exact(groups.len());
        layout.pieces.reserve_exact(groups.len());
        let mut rest = &places[..];
        let mut parts = Vec::new();
        for group in groups {
            let (here, others) = rest.split_at(group.len());
            rest = others;
            let count = divide(world, grid, here, &mut parts, cut);
            layout.add(group, (&parts, count), all.get(group[0].1).class);
        }
        layout
    }

    fn bytes(&self) -> usize {
        self.order.capacity() * size_of::<u32>()
            + self.clusters.capacity() * size_of::<Cluster>()
            + self.pieces.capacity() * size_of::<Piece>()
    }

    /// The clusters of what shares a key: one for each part, or several that share it at random where lobes are
    /// evaluated pair by pair. Of its area these have equal shares, as if the surface had been cut into interleaved
    /// pieces.
    fn add(&mut self, group: &[(u64, u32)], (parts, count): (&[u8], usize), class: SurfaceClass) {
        let members =
            |part| group.iter().zip(parts).filter(move |p| usize::from(*p.1) == part).map(|(&(_, i), _)| i);
        let mut firsts = [NOBODY; MOST_PARTS];
        (0..count).for_each(|part| firsts[part] = members(part).next().unwrap_or(NOBODY));
        for part in 0..count {
            let total = members(part).count() as u32;
            let from_camera = members(part).take_while(|&i| i < self.cameras).count() as u32;
            let sharing = match class {
                SurfaceClass::Diffuse => 1,
                SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                    from_camera.max((total - from_camera) / 2).div_ceil(MOST_PAIRED).max(1)
                }
            };
            for share in 0..sharing {
                let first = self.order.len();
                self.order.extend(members(part).filter(|&i| hash(firsts[part], i) % sharing == share));
                let taken = &self.order[first..];
                if taken.is_empty() {
                    continue;
                }
                let cameras = taken.iter().take_while(|&&i| i < self.cameras).count() as u32;
                self.clusters.push(Cluster {
                    first: first as u32,
                    cameras,
                    lights: taken.len() as u32 - cameras,
                    area: 0.0,
                    inverse_area: 0.0,
                    class,
                });
                self.pieces.push(Piece { firsts, part: part as u8, sharing });
            }
        }
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
    let part = usize::from(piece.part);
    let firsts = piece.firsts.iter().filter(|&&i| i != NOBODY);
    let representative = all.get(piece.firsts[part]);
    let voxel = grid.voxel(representative.position);
    let sharing = piece.sharing as f32;
    let (_, edge) = grid.place(&voxel);
    c.area = edge * edge / sharing;
    if areas == Areas::None {
        return 0;
    }
    let cell = Cell { grid, voxel, representative: &representative, is_divided: piece.firsts[1] != NOBODY };
    let division = Division::new(world, grid, firsts.map(|&i| all.place(i)));
    let exact = cell.on_one_triangle(world, members.iter().map(|&i| all.triangle(i)));
    let mut probes = 0;
    let mut estimate = |points: u32| {
        let belongs = |p, n| division.part(p, n) == part;
        exact.unwrap_or_else(|| cell.coverage(world, points, &belongs, &mut probes)) / sharing
    };
    let is_true = areas == Areas::True;
    c.area = estimate(if is_true { MOST_POINTS } else { FEW_POINTS });
    if is_true || (c.cameras > 0 && c.lights > 0) {
        let (least, most) = POINTS_OF_PHOTONS.into_inner();
        c.inverse_area = 1.0 / estimate(c.lights.clamp(least, most));
    }
    probes
}
