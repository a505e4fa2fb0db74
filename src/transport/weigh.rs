//! The MMIS densities: for every segment, how densely all the paths of its end clusters could have made it.
//!
//! `P_cam(w) = sum of q p(w)` over the camera arrivals of the cluster that the segment leaves, and `P_light` likewise over
//! the light arrivals at its other end. Diffuse lobes factorise: their density of a direction is the same for all
//! arrivals of a cluster, so one sum of `q` serves all. Others are evaluated pair by pair, and the values of the
//! lobes are kept for the gathering.

use super::bridge::Bridges;
use super::cluster::{Cluster, Clusters};
use super::paired;
use super::returns::{Gathered, ratio};
use super::sparse::Sparse;
use super::store::{CameraStore, LightStore, NextEvent};
use super::{Cut, Estimator};
use crate::math::SharedExponent;
use crate::shading::{SurfaceClass, World};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::mem::take;

/// Densities of one arrival, over the area of its cluster.
#[derive(Clone, Copy, Debug, Default)]
pub struct Density {
    /// `P_cam` of the segment that leaves a camera arrival, or that brought a light arrival.
    pub camera: f32,
    /// `P_light` of the segment that brought a camera arrival; of the segment that leaves a light arrival, for
    /// leaving one out without the part of its own path.
    pub light: f32,
}

/// The next-event segment of a camera arrival.
#[derive(Clone, Copy, Debug, Default)]
pub struct TowardsLight {
    /// Value of the arrival's own lobes.
    pub value: Vec3,
    /// `P_cam` along it.
    pub camera: f32,
}

/// Lobe values of a cluster that does not factorise: for every camera arrival (and, if the literal recursion asks,
/// every light arrival), those of the directions of all segments that leave, then those of all photons, then those of all
/// bridges, the latter two times `(n_o / n_i)^2`.
#[derive(Clone, Copy, Debug)]
struct Matrix {
    start: u32,
    columns: u32,
    owns: u32,
    lights: u32,
}

/// Densities of an iteration. But for the first, [`Weights::direct`] and [`Weights::apart`] the arrays follow the order of the clusters.
#[derive(Debug, Default)]
pub struct Weights {
    /// One for every arrival, by number; zero where nobody asks.
    pub densities: Vec<Density>,
    /// Irradiance, weighed, from the bridge of every camera arrival; empty without any.
    pub bridged: Vec<Vec3>,
    /// One for every arrival, of use for those of the camera; empty unless whole paths are asked for.
    pub towards_lights: Vec<TowardsLight>,
    /// See [`Weights::direct`].
    direct: Vec<SharedExponent>,
    /// See [`Weights::apart`]; where it is not one.
    apart: Sparse<f32>,
    /// One for every cluster that is not diffuse.
    matrices: Sparse<Matrix>,
    /// Values of each batch of clusters.
    values: Vec<Vec<SharedExponent>>,
    owns: Vec<Vec<f32>>,
}

/// Clusters that are weighed together.
const BATCH: usize = 256;

/// What an iteration sampled and how it is clustered.
#[derive(Clone, Copy)]
pub struct Sampled<'a> {
    /// The scene.
    pub world: &'a World,
    /// The camera's side.
    pub camera: &'a CameraStore,
    /// The lights' side.
    pub light: &'a LightStore,
    /// The clusters.
    pub clusters: &'a Clusters,
    /// The bridges between them, if any were sampled.
    pub bridges: Option<&'a Bridges>,
}

impl<'a> Sampled<'a> {
    /// Cluster of arrival number `i`.
    #[inline]
    pub fn cluster_of(&self, i: usize) -> &'a Cluster {
        &self.clusters.clusters[self.clusters.of(i)]
    }

    /// Where arrival number `i` is among those of its cluster `c`.
    #[inline]
    pub(super) fn row(&self, i: usize, c: &Cluster) -> usize {
        (self.clusters.place(i) - c.first) as usize
    }

    /// Indices of the cluster's camera arrivals.
    pub fn cameras(&self, c: &Cluster) -> impl ExactSizeIterator<Item = usize> + Clone + use<'a> {
        let order = &self.clusters.order;
        c.camera_places().map(move |k| order[k] as usize)
    }

    /// Indices of the cluster's light arrivals.
    pub fn lights(&self, c: &Cluster) -> impl ExactSizeIterator<Item = usize> + Clone + use<'a> {
        let (order, first) = (&self.clusters.order, self.camera.arrivals.len());
        c.light_places().map(move |k| order[k] as usize - first)
    }

    /// Path of light arrival `j`.
    #[inline]
    pub(super) fn path(&self, j: usize) -> u32 {
        self.light.photons.path(j)
    }

    /// For every light arrival of the cluster, in their order: the sum of `q` over those of its path there.
    pub fn path_survivals(&self, c: &Cluster) -> Vec<f32> {
        let mut q: Vec<f32> = self.lights(c).map(|j| self.light.arrivals.survival(j)).collect();
        self.sum_over_paths(c, &mut q);
        q
    }

    /// Replaces the value of every light arrival of the cluster, in their order, by the sum of those of its path: what
    /// is left out with it. A path that returns to a cluster is no more independent of itself than a photon is.
    pub fn sum_over_paths(&self, c: &Cluster, values: &mut [f32]) {
        // arrivals are in the order of their numbers, so those of a path follow each other
        let mut paths = self.lights(c).map(|j| self.path(j)).peekable();
        let mut start = 0;
        while let Some(path) = paths.next() {
            let mut end = start + 1;
            while paths.next_if_eq(&path).is_some() {
                end += 1;
            }
            let sum = values[start..end].iter().sum();
            values[start..end].fill(sum);
            start = end;
        }
    }
}

/// What a batch of clusters comes to, beside what has a place for every arrival.
#[derive(Default)]
pub(super) struct Batch {
    apart: Vec<(u32, f32)>,
    pub bridged: Vec<Vec3>,
    pub towards_lights: Vec<TowardsLight>,
    matrices: Sparse<Matrix>,
    pub values: Vec<SharedExponent>,
    pub owns: Vec<f32>,
}

/// Where the figures of a cluster's arrivals go.
pub(super) struct Places<'a> {
    pub densities: &'a mut [Density],
    pub direct: &'a mut [SharedExponent],
    /// What [`Weights::apart`] says.
    pub apart: Vec<f32>,
}

impl Weights {
    /// Weighs all segments, for an estimator. Returns `false` if it was stopped.
    pub fn weigh(&mut self, s: Sampled, estimator: Estimator, cut: &Cut) -> bool {
        // the lobes' values are most of the memory: not twice
        *self = Self::default();
        let places = s.clusters.order.len();
        let mut densities = vec![Density::default(); places];
        let mut direct = vec![SharedExponent::default(); places];
        let batches = Batch::all(s, &mut densities, &mut direct, estimator, cut);
        if cut.is_raised() {
            return false;
        }
        // by number, which is how most of what follows goes through them
        self.densities = s.clusters.by_number(&densities, s.clusters.arrivals());
        drop(densities);
        let lit = match estimator {
            Estimator::Literal => s.clusters.arrivals(),
            Estimator::LeaveOneOut | Estimator::WholePath => s.camera.arrivals.len(),
        };
        self.direct = s.clusters.by_number(&direct, lit);
        drop(direct);
        let apart = batches.iter().flat_map(|b| b.apart.iter().copied());
        self.apart = Sparse::of(apart.collect(), s.camera.arrivals.len());
        self.keep(s, batches);
        true
    }

    /// What batches have beside that, one after the other.
    fn keep(&mut self, s: Sampled, batches: Vec<Batch>) {
        let matrices = batches.iter().map(|b| b.matrices.count()).sum();
        self.matrices.reserve(s.clusters.clusters.len(), matrices);
        for mut batch in batches {
            self.bridged.extend(batch.bridged);
            self.towards_lights.extend(batch.towards_lights);
            self.matrices.append(&mut batch.matrices);
            self.values.push(batch.values);
            self.owns.push(batch.owns);
        }
    }

    /// Basic radiance from next-event segments, reflected at camera arrival `i`; at a light arrival, for the literal
    /// recursion, towards where its path goes on.
    #[inline]
    pub fn direct(&self, i: usize) -> Vec3 {
        self.direct[i].decode()
    }

    /// `P_cam` of the segment that leaves camera arrival `i`, over the same without the part of its path's other arrivals;
    /// one where it has none, or nobody leaves them out.
    #[inline]
    pub fn apart(&self, i: usize) -> f32 {
        self.apart.get(i).copied().unwrap_or(1.0)
    }

    /// Values of the lobes of the `row`-th arrival of a cluster that is not diffuse: a camera's, unless the literal
    /// recursion asked for all.
    #[inline]
    pub fn row(&self, cluster: usize, row: usize) -> &[SharedExponent] {
        let Some(m) = self.matrices.get(cluster) else { return &[] };
        let start = m.start as usize + row * m.columns as usize;
        &self.values[cluster / BATCH][start..start + m.columns as usize]
    }

    /// Of the segment that brought the `row`-th camera arrival of a cluster that is not diffuse: for every light arrival,
    /// its path's part of `P_light`.
    #[inline]
    pub fn own(&self, cluster: usize, row: usize) -> &[f32] {
        let Some(m) = self.matrices.get(cluster) else { return &[] };
        let start = m.owns as usize + row * m.lights as usize;
        &self.owns[cluster / BATCH][start..start + m.lights as usize]
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.densities.capacity() * size_of::<Density>()
            + self.direct.capacity() * size_of::<SharedExponent>()
            + self.bridged.capacity() * size_of::<Vec3>()
            + self.towards_lights.capacity() * size_of::<TowardsLight>()
            + self.apart.bytes()
            + self.matrices.bytes()
            + self.values.iter().map(|v| v.capacity() * size_of::<SharedExponent>()).sum::<usize>()
            + self.owns.iter().map(|v| v.capacity() * size_of::<f32>()).sum::<usize>()
    }
}

impl Batch {
    /// Weighs all clusters. What has a place for every arrival goes to `densities` and `direct`.
    fn all(
        s: Sampled,
        mut densities: &mut [Density],
        mut direct: &mut [SharedExponent],
        estimator: Estimator,
        cut: &Cut,
    ) -> Vec<Self> {
        let mut jobs = Vec::new();
        for clusters in s.clusters.clusters.chunks(BATCH) {
            let arrivals = clusters.iter().map(|c| (c.cameras + c.lights) as usize).sum();
            let (here, rest) = take(&mut densities).split_at_mut(arrivals);
            let (lit, unlit) = take(&mut direct).split_at_mut(arrivals);
            (densities, direct) = (rest, unlit);
            jobs.push((clusters, here, lit));
        }
        let weigh =
            |(clusters, densities, direct)| Self::weigh(s, clusters, densities, direct, estimator, cut);
        jobs.into_par_iter().map(weigh).collect()
    }

    /// Weighs some clusters, whose arrivals follow each other.
    fn weigh(
        s: Sampled,
        clusters: &[Cluster],
        mut densities: &mut [Density],
        mut direct: &mut [SharedExponent],
        estimator: Estimator,
        cut: &Cut,
    ) -> Self {
        let mut batch = Self::default();
        let in_pairs = || clusters.iter().filter(|c| c.class != SurfaceClass::Diffuse);
        let pairs = |c: &Cluster| rows(c, estimator) * columns(s, c);
        batch.values.reserve_exact(in_pairs().map(pairs).sum());
        batch.owns.reserve_exact(in_pairs().map(|c| (c.cameras * c.lights) as usize).sum());
        for c in clusters {
            if cut.is_raised() {
                break;
            }
            let arrivals = (c.cameras + c.lights) as usize;
            let (here, rest) = take(&mut densities).split_at_mut(arrivals);
            let (lit, unlit) = take(&mut direct).split_at_mut(arrivals);
            (densities, direct) = (rest, unlit);
            let mut places = Places { densities: here, direct: lit, apart: vec![1.0; c.cameras as usize] };
            batch.matrices.push((c.class != SurfaceClass::Diffuse).then(|| Matrix {
                start: batch.values.len() as u32,
                columns: columns(s, c) as u32,
                owns: batch.owns.len() as u32,
                lights: c.lights,
            }));
            match c.class {
                SurfaceClass::Diffuse => diffuse(s, c, estimator, &mut places, &mut batch),
                SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                    paired::weigh(s, c, estimator, &mut places, &mut batch);
                }
            }
            for d in places.densities {
                *d = Density { camera: d.camera / c.area, light: d.light / c.area };
            }
            let apart = s.cameras(c).map(|i| i as u32).zip(places.apart);
            batch.apart.extend(apart.filter(|&(_, apart)| apart != 1.0));
        }
        batch
    }
}

/// Density of all techniques along a next-event segment of a cluster whose arrivals sampled one each. `p_cam`: density of the
/// camera's segments along it.
pub(super) fn next_event_density(n: &NextEvent, p_cam: f32, c: &Cluster) -> f32 {
    let met = if n.is_delta { 0.0 } else { p_cam };
    (met + n.next_event_pdf * c.cameras as f32) / c.area + n.light_density
}

/// Basic radiance times the weight of a next-event segment over its own density, `E / D_E`, see
/// [`next_event_density`].
pub(super) fn next_event_value(n: &NextEvent, p_cam: f32, c: &Cluster) -> Vec3 {
    let density = next_event_density(n, p_cam, c);
    if density > 0.0 { n.light / density } else { Vec3::ZERO }
}

/// Directions that are looked at in a cluster: of segments that leave, of photons, of bridges.
pub(super) fn columns(s: Sampled, c: &Cluster) -> usize {
    (c.cameras + c.lights + s.bridges.map_or(0, |_| c.cameras)) as usize
}

/// Arrivals of a cluster whose lobes are looked at.
fn rows(c: &Cluster, estimator: Estimator) -> usize {
    (c.cameras + if estimator == Estimator::Literal { c.lights } else { 0 }) as usize
}

fn diffuse(s: Sampled, c: &Cluster, estimator: Estimator, places: &mut Places, batch: &mut Batch) {
    let sum = |q: &mut dyn Iterator<Item = f32>| q.map(f64::from).sum::<f64>();
    let q_camera = sum(&mut s.cameras(c).map(|i| s.camera.arrivals.survival(i))) as f32;
    let q_light = sum(&mut s.lights(c).map(|j| s.light.arrivals.survival(j))) as f32;
    let mut arriving = DVec3::ZERO;
    for i in s.cameras(c) {
        if let Some(n) = s.camera.next_events.get(i) {
            arriving += (next_event_value(&n, q_camera * n.pdf, c) * n.pdf).as_dvec3();
        }
    }
    let arriving = arriving.as_vec3() / c.area;
    for (row, i) in s.cameras(c).enumerate() {
        let (reflectance, back_pdf) = (s.camera.arrivals.reflectance(i), s.camera.arrivals.back_pdf(i));
        let gathered = Gathered::new(s, c, row);
        if estimator == Estimator::LeaveOneOut && !gathered.is_all() {
            let q = gathered.arrivals(s, c).map(|i| s.camera.arrivals.survival(i));
            places.apart[row] = ratio(q_camera, q.sum());
        }
        let camera = q_camera * s.camera.outgoing.pdf(i);
        places.densities[row] = Density { camera, light: q_light * back_pdf };
        places.direct[row] = SharedExponent::encode(reflectance * arriving);
        if let Some(bridges) = s.bridges {
            let b = &bridges.segments[i];
            batch.bridged.push(b.value(q_camera * b.pdf, c));
        }
    }
    let rows = c.cameras as usize..;
    for ((row, j), own) in rows.zip(s.lights(c)).zip(s.path_survivals(c)) {
        let q = match estimator {
            Estimator::LeaveOneOut => (q_light - own).max(0.0),
            Estimator::Literal | Estimator::WholePath => q_light,
        };
        places.densities[row] =
            Density { camera: q_camera * s.light.arrivals.back_pdf(j), light: q * s.light.photons.pdf(j) };
        if estimator == Estimator::Literal {
            places.direct[row] = SharedExponent::encode(s.light.arrivals.reflectance(j) * arriving);
        }
        batch.bridged.extend(s.bridges.map(|_| Vec3::ZERO));
    }
    if estimator == Estimator::WholePath {
        batch.towards_lights.extend(s.cameras(c).map(|i| {
            let pdf = s.camera.next_events.get(i).map_or(0.0, |n| n.pdf);
            TowardsLight { value: s.camera.arrivals.reflectance(i) * pdf, camera: q_camera * pdf }
        }));
        let none = (0..c.lights).map(|_| TowardsLight::default());
        batch.towards_lights.extend(none);
    }
}
