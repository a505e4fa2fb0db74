//! How arrivals that share a key are laid out in clusters, one after the other.

use super::Cut;
use super::division::{MOST_PARTS, divide, is_in_sight, share_in_sight};
use super::grid::Grid;
use super::sparse::Bits;
use super::store::{Arrival, Arrivals};
use crate::math::sampler::hash;
use crate::shading::{SurfaceClass, World};
use glam::Vec3;
use std::ops::Range;

/// Most camera arrivals, and half of the most light arrivals, in a cluster whose lobes are evaluated pair by
/// pair; larger ones are divided at random.
const MOST_PAIRED: u32 = 16;

/// Least share of a voxel that is in sight for which it is apart from a rest in which nothing arrived.
const LEAST_SHARE: f32 = 0.25;

/// A cluster. Its arrivals are neighbours in [`super::cluster::Clusters::order`]: the camera's first, then the lights'.
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

impl Cluster {
    /// The empty cluster of arrivals that do not count.
    pub(super) const OF_NOBODY: Self =
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

/// The arrivals of an iteration, by number.
#[derive(Clone, Copy)]
pub struct Numbered<'a> {
    /// The camera's.
    pub camera: &'a Arrivals,
    /// The lights'.
    pub light: &'a Arrivals,
    /// Those of the camera at which what pixels see ends, see [`super::outline::ends`].
    pub ends: &'a Bits,
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
    pub(super) fn place(&self, i: u32) -> (Vec3, Vec3) {
        let i = i as usize;
        match i.checked_sub(self.camera.len()) {
            None => self.camera.place(i),
            Some(j) => self.light.place(j),
        }
    }

    /// Instance of arrival number `i`, and triangle of its mesh.
    #[inline]
    pub(super) fn triangle(&self, i: u32) -> (u32, u32) {
        let i = i as usize;
        match i < self.camera.len() {
            true => self.camera.triangle(i),
            false => self.light.triangle(i - self.camera.len()),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.camera.len() + self.light.len()
    }
}

/// Number of no arrival.
const NOBODY: u32 = u32::MAX;

/// The piece of a surface that a cluster is; of use until its areas are known.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// First arrival of each part of its voxel; [`NOBODY`] where there is none.
    firsts: [u32; MOST_PARTS],
    /// The part that it is in.
    pub part: u8,
    /// Whether it is what the camera sees of its voxel, or what it does not see, where that is apart.
    pub in_sight: Option<bool>,
    /// Clusters that share that part at random, itself included.
    pub sharing: u32,
}

impl Piece {
    /// First arrivals of the parts of its voxel, as far as there are any.
    pub fn firsts(&self) -> impl Iterator<Item = u32> {
        self.firsts.into_iter().filter(|&i| i != NOBODY)
    }

    /// First arrival of its own part.
    pub fn first(&self) -> u32 {
        self.firsts[usize::from(self.part)]
    }

    /// Whether there are several parts.
    pub fn is_divided(&self) -> bool {
        self.firsts[1] != NOBODY
    }
}

/// An arrival by its key and number.
pub type Member = (u64, u32);

/// Some clusters as they are laid out one after the other.
#[derive(Default)]
pub struct Layout {
    /// Number of the camera's arrivals.
    cameras: u32,
    /// Numbers of the arrivals.
    pub order: Vec<u32>,
    /// The clusters.
    pub clusters: Vec<Cluster>,
    /// What each of them is.
    pub pieces: Vec<Piece>,
}

impl Layout {
    /// The clusters of these groups, each of which shares a key.
    pub fn of(world: &World, grid: &Grid, all: Numbered, groups: &[&[Member]], cut: &Cut) -> Self {
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
            let class = all.get(group[0].1).class;
            let mut add = |group: &[Member], here: &[(Vec3, Vec3)], in_sight: Option<bool>| {
                let count = divide(world, grid, here, &mut parts, cut);
                layout.add(group, (&parts, count), class, in_sight);
            };
            let Some(seen) = by_sight(world, grid, all, group, here, cut) else {
                add(group, here, None);
                continue;
            };
            for in_sight in [true, false] {
                let chosen = (0..group.len()).filter(|&k| seen[k] == in_sight);
                let (members, places): (Vec<_>, Vec<_>) = chosen.map(|k| (group[k], here[k])).unzip();
                if !members.is_empty() {
                    add(&members, &places, Some(in_sight));
                }
            }
        }
        layout
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.order.capacity() * size_of::<u32>()
            + self.clusters.capacity() * size_of::<Cluster>()
            + self.pieces.capacity() * size_of::<Piece>()
    }

    /// The clusters of what shares a key: one for each part, or several that share it at random where lobes are
    /// evaluated pair by pair. Of its area these have equal shares, as if the surface had been cut into interleaved
    /// pieces.
    fn add(
        &mut self,
        group: &[Member],
        (parts, count): (&[u8], usize),
        class: SurfaceClass,
        in_sight: Option<bool>,
    ) {
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
                self.pieces.push(Piece { firsts, part: part as u8, in_sight, sharing });
            }
        }
    }
}

/// For each of a group of arrivals, at one of which what pixels see ends, whether the camera sees its place; `None`
/// where that does not divide the group.
///
/// It does where some are out of sight, and where a part of the voxel is, though none is there: photons that alone
/// decided it would not be counted over the area that they have. But slivers beside what nothing reaches, as below a
/// box on the floor, are too small for that: a photon would be very bright there.
fn by_sight(
    world: &World,
    grid: &Grid,
    all: Numbered,
    group: &[Member],
    places: &[(Vec3, Vec3)],
    cut: &Cut,
) -> Option<Vec<bool>> {
    let end = places[group.iter().position(|&(_, i)| all.ends.has(i as usize))?];
    let seen: Vec<bool> =
        places.iter().map(|&place| !cut.is_raised() && is_in_sight(world, grid, place)).collect();
    let is_apart = match seen.contains(&false) {
        true => seen.contains(&true),
        false => (LEAST_SHARE..1.0).contains(&share_in_sight(world, grid, end)),
    };
    is_apart.then_some(seen)
}
