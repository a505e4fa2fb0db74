//! Clusters: arrivals that share a voxel, a bin of normals and a class of surface.

use super::grid::Grid;
use super::store::Arrival;
use super::{Cut, area};
use crate::math::sampler::hash;
use crate::shading::{SurfaceClass, World};
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

/// Most camera arrivals, and half of the most light arrivals, in a cluster whose lobes are evaluated pair by
/// pair; larger ones are divided at random.
const MOST_PAIRED: u32 = 16;
/// By how much points are lifted off their surface before it is asked whether something stands between
/// them, in edges of the voxel.
const LIFT: f32 = 0.05;

/// A cluster. Its arrivals are neighbours in [`Clusters::order`]: the camera's first, then the lights'.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    /// Place of the first arrival in the order.
    pub first: u32,
    /// Camera arrivals.
    pub cameras: u32,
    /// Light arrivals.
    pub lights: u32,
    /// Surface area that it covers.
    pub area: f32,
    /// Class of its surfaces.
    pub class: SurfaceClass,
}

impl Cluster {
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

/// All clusters of an iteration. Arrivals are numbered: the camera's first, then the lights'.
#[derive(Debug, Default)]
pub struct Clusters {
    /// The clusters.
    pub clusters: Vec<Cluster>,
    /// Numbers of the arrivals, cluster by cluster.
    pub order: Vec<u32>,
    /// Place of every arrival in the order.
    pub place: Vec<u32>,
    /// Cluster of every arrival.
    pub of: Vec<u32>,
    keys: Vec<(u64, u32)>,
}

/// The arrivals of an iteration, by number.
#[derive(Clone, Copy)]
pub struct Numbered<'a> {
    /// The camera's.
    pub camera: &'a [Arrival],
    /// The lights'.
    pub light: &'a [Arrival],
}

impl<'a> Numbered<'a> {
    /// Arrival number `i`.
    #[inline]
    pub fn get(&self, i: u32) -> &'a Arrival {
        let i = i as usize;
        if i < self.camera.len() { &self.camera[i] } else { &self.light[i - self.camera.len()] }
    }

    fn len(&self) -> usize {
        self.camera.len() + self.light.len()
    }
}

/// A cluster while it is being made.
struct Draft {
    members: Vec<u32>,
    area: f32,
    class: SurfaceClass,
}

impl Clusters {
    /// Clusters the arrivals. `areas_count`: whether light paths are sampled; without them areas cancel.
    /// Returns `false` if it was stopped.
    pub fn build(&mut self, world: &World, grid: &Grid, all: Numbered, areas_count: bool, cut: &Cut) -> bool {
        let n = all.len();
        self.keys.clear();
        self.keys.par_extend((0..n as u32).into_par_iter().map(|i| (grid.key(all.get(i)), i)));
        // numbers make the order unique, so it does not depend on the threads
        self.keys.par_sort_unstable();
        let groups: Vec<&[(u64, u32)]> = self.keys.chunk_by(|a, b| a.0 == b.0).collect();
        let cameras = all.camera.len() as u32;
        let drafts: Vec<Draft> = groups
            .par_iter()
            .with_min_len(64)
            .flat_map_iter(|group| match cut.is_raised() {
                true => Vec::new(),
                false => drafts(world, grid, all, group, areas_count),
            })
            .collect();
        if cut.is_raised() {
            return false;
        }
        self.order.clear();
        self.clusters.clear();
        self.place.clear();
        self.place.resize(n, 0);
        self.of.clear();
        self.of.resize(n, 0);
        for draft in drafts {
            let first = self.order.len() as u32;
            let c = self.clusters.len() as u32;
            for &i in &draft.members {
                self.place[i as usize] = self.order.len() as u32;
                self.of[i as usize] = c;
                self.order.push(i);
            }
            let from_camera = draft.members.iter().take_while(|&&i| i < cameras).count() as u32;
            self.clusters.push(Cluster {
                first,
                cameras: from_camera,
                lights: draft.members.len() as u32 - from_camera,
                area: draft.area,
                class: draft.class,
            });
        }
        true
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.clusters.capacity() * size_of::<Cluster>()
            + self.keys.capacity() * size_of::<(u64, u32)>()
            + (self.order.capacity() + self.place.capacity() + self.of.capacity()) * size_of::<u32>()
    }
}

/// The clusters of what shares a key: one, or two where something stands between its points; each divided
/// again where pairs would be too many.
fn drafts(world: &World, grid: &Grid, all: Numbered, group: &[(u64, u32)], areas_count: bool) -> Vec<Draft> {
    let representative = all.get(group[0].1);
    let voxel = grid.voxel(representative.position);
    let (_, edge) = grid.place(&voxel);
    let hub = representative.position + representative.normal * (LIFT * edge);
    let hidden = |p: Vec3, n: Vec3| !world.is_clear(p + n * (LIFT * edge), hub);
    let (mut near, mut far) = (Vec::with_capacity(group.len()), Vec::new());
    near.push(group[0].1);
    for &(_, i) in &group[1..] {
        let a = all.get(i);
        if hidden(a.position, a.normal) { far.push(i) } else { near.push(i) }
    }
    let parted = !far.is_empty();
    let cameras = all.camera.len() as u32;
    let mut out = Vec::new();
    for (members, is_far) in [(near, false), (far, true)] {
        // members are in the order of their numbers
        let Some(&last) = members.last() else { continue };
        let cell = area::Cell { grid, voxel, representative, parted: parted.then_some(is_far) };
        let mean = members.iter().map(|&i| all.get(i).position - representative.position).sum::<Vec3>();
        let point = representative.position + mean / members.len() as f32;
        let has_photons = last >= cameras && members.len() > 1;
        let points = if has_photons { area::MANY_POINTS } else { area::FEW_POINTS };
        let area = match areas_count {
            // it cancels
            false => cell.plane_cut(point),
            true => cell
                .on_one_triangle(world, members.iter().map(|&i| all.get(i)))
                .unwrap_or_else(|| cell.coverage(world, point, points, &hidden)),
        };
        divide(members, area, representative.class, cameras, &mut out);
    }
    out
}

/// Divides a cluster at random where its lobes are evaluated pair by pair. Each part has its share of the area,
/// as if the surface had been cut into interleaved pieces.
fn divide(members: Vec<u32>, area: f32, class: SurfaceClass, cameras: u32, out: &mut Vec<Draft>) {
    let from_camera = members.iter().take_while(|&&i| i < cameras).count() as u32;
    let from_lights = members.len() as u32 - from_camera;
    let parts = from_camera.max(from_lights / 2).div_ceil(MOST_PAIRED);
    if class == SurfaceClass::Diffuse || parts <= 1 {
        out.push(Draft { members, area, class });
        return;
    }
    let first = out.len();
    for _ in 0..parts {
        out.push(Draft { members: Vec::new(), area: area / parts as f32, class });
    }
    let salt = members[0];
    for i in members {
        out[first + (hash(salt, i) % parts) as usize].members.push(i);
    }
    out.retain(|d| !d.members.is_empty());
}
