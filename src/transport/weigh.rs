//! The MMIS densities: for every segment, how densely all the paths of its end clusters could have made it.
//!
//! `P_cam(w) = sum of q p(w)` over the camera arrivals of the cluster that the segment leaves, and `P_light` likewise over
//! the light arrivals at its other end. Diffuse lobes factorise: their density of a direction is the same for all
//! arrivals of a cluster, so one sum of `q` serves all. Others are evaluated pair by pair, and the values of the
//! lobes are kept for the gathering.

use super::bridge::Bridges;
use super::cluster::{Cluster, Clusters};
use super::returns::{Gathered, leave_out, ratio};
use super::store::{Arrival, CameraStore, LightStore, NextEvent};
use super::{Cut, Estimator};
use crate::math::density::ProjectedPdf;
use crate::shading::bsdf::{Among, Bsdf};
use crate::shading::{SurfaceClass, World};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;

/// Densities of one arrival.
#[derive(Clone, Copy, Debug, Default)]
pub struct Density {
    /// `P_cam` of the segment that leaves a camera arrival, or that brought a light arrival.
    pub camera: f32,
    /// `P_light` of the segment that brought a camera arrival; of the segment that leaves a light arrival, for
    /// leaving one out without the part of its own path.
    pub light: f32,
    /// `P_cam` of the segment that leaves a camera arrival, over the same without the part of its path's other
    /// arrivals; one where it has none, or nobody leaves them out.
    pub apart: f32,
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
pub struct Matrix {
    batch: u32,
    start: u32,
    columns: u32,
    owns: u32,
    lights: u32,
}

/// Densities of an iteration. The arrays follow the order of the clusters.
#[derive(Debug, Default)]
pub struct Weights {
    /// One for every arrival.
    pub densities: Vec<Density>,
    /// Basic radiance from next-event segments, reflected at every camera arrival; at light arrivals, for the
    /// literal recursion, towards where their paths go on.
    pub direct: Vec<Vec3>,
    /// Irradiance, weighed, from the bridge of every camera arrival; empty without any.
    pub bridged: Vec<Vec3>,
    /// One for every arrival, of use for those of the camera; empty unless whole paths are asked for.
    pub towards_lights: Vec<TowardsLight>,
    /// One for every cluster; unused for diffuse ones.
    matrices: Vec<Matrix>,
    values: Vec<Vec<Vec3>>,
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
        &self.clusters.clusters[self.clusters.of[i] as usize]
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
    fn path(&self, j: usize) -> u32 {
        self.light.photons.get(j).path
    }

    /// For every light arrival of the cluster, in their order: the sum of `q` over those of its path there.
    pub fn path_survivals(&self, c: &Cluster) -> Vec<f32> {
        let mut q: Vec<f32> = self.lights(c).map(|j| self.light.arrivals.get(j).survival).collect();
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

#[derive(Default)]
struct Batch {
    densities: Vec<Density>,
    direct: Vec<Vec3>,
    bridged: Vec<Vec3>,
    towards_lights: Vec<TowardsLight>,
    starts: Vec<(u32, u32)>,
    values: Vec<Vec3>,
    owns: Vec<f32>,
}

impl Weights {
    /// Weighs all segments, for an estimator. Returns `false` if it was stopped.
    pub fn weigh(&mut self, s: Sampled, estimator: Estimator, cut: &Cut) -> bool {
        // the lobes' values are most of the memory: not twice
        self.values.clear();
        self.owns.clear();
        let batches: Vec<Batch> = s
            .clusters
            .clusters
            .par_chunks(BATCH)
            .map(|clusters| {
                let mut batch = Batch::default();
                for c in clusters {
                    if cut.is_raised() {
                        break;
                    }
                    batch.starts.push((batch.values.len() as u32, batch.owns.len() as u32));
                    match c.class {
                        SurfaceClass::Diffuse => diffuse(s, c, estimator, &mut batch),
                        SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                            paired(s, c, estimator, &mut batch)
                        }
                    }
                }
                batch
            })
            .collect();
        if cut.is_raised() {
            return false;
        }
        self.densities.clear();
        self.direct.clear();
        self.bridged.clear();
        self.towards_lights.clear();
        self.matrices.clear();
        let groups = s.clusters.clusters.chunks(BATCH);
        for ((b, batch), clusters) in (0..).zip(batches).zip(groups) {
            self.densities.extend(batch.densities);
            self.direct.extend(batch.direct);
            self.bridged.extend(batch.bridged);
            self.towards_lights.extend(batch.towards_lights);
            self.matrices.extend(batch.starts.iter().zip(clusters).map(|(&(start, owns), c)| Matrix {
                batch: b,
                start,
                columns: columns(s, c) as u32,
                owns,
                lights: c.lights,
            }));
            self.values.push(batch.values);
            self.owns.push(batch.owns);
        }
        true
    }

    /// Values of the lobes of the `row`-th arrival of a cluster that is not diffuse: a camera's, unless the literal
    /// recursion asked for all.
    #[inline]
    pub fn row(&self, cluster: usize, row: usize) -> &[Vec3] {
        let m = &self.matrices[cluster];
        let start = m.start as usize + row * m.columns as usize;
        &self.values[m.batch as usize][start..start + m.columns as usize]
    }

    /// Of the segment that brought the `row`-th camera arrival of a cluster that is not diffuse: for every light arrival,
    /// its path's part of `P_light`.
    #[inline]
    pub fn own(&self, cluster: usize, row: usize) -> &[f32] {
        let m = &self.matrices[cluster];
        let start = m.owns as usize + row * m.lights as usize;
        &self.owns[m.batch as usize][start..start + m.lights as usize]
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.densities.capacity() * size_of::<Density>()
            + (self.direct.capacity() + self.bridged.capacity()) * size_of::<Vec3>()
            + self.towards_lights.capacity() * size_of::<TowardsLight>()
            + self.matrices.capacity() * size_of::<Matrix>()
            + self.values.iter().map(|v| v.capacity() * size_of::<Vec3>()).sum::<usize>()
            + self.owns.iter().map(|v| v.capacity() * size_of::<f32>()).sum::<usize>()
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
fn next_event_value(n: &NextEvent, p_cam: f32, c: &Cluster) -> Vec3 {
    let density = next_event_density(n, p_cam, c);
    if density > 0.0 { n.light / density } else { Vec3::ZERO }
}

/// Directions that are looked at in a cluster: of segments that leave, of photons, of bridges.
fn columns(s: Sampled, c: &Cluster) -> usize {
    (c.cameras + c.lights + s.bridges.map_or(0, |_| c.cameras)) as usize
}

fn diffuse(s: Sampled, c: &Cluster, estimator: Estimator, batch: &mut Batch) {
    let sum = |q: &mut dyn Iterator<Item = f32>| q.map(f64::from).sum::<f64>();
    let q_camera = sum(&mut s.cameras(c).map(|i| s.camera.arrivals.get(i).survival)) as f32;
    let q_light = sum(&mut s.lights(c).map(|j| s.light.arrivals.get(j).survival)) as f32;
    let mut arriving = DVec3::ZERO;
    for i in s.cameras(c) {
        if let Some(n) = s.camera.next_events.get(i) {
            arriving += (next_event_value(&n, q_camera * n.pdf, c) * n.pdf).as_dvec3();
        }
    }
    let arriving = arriving.as_vec3() / c.area;
    for (row, i) in s.cameras(c).enumerate() {
        let a = s.camera.arrivals.get(i);
        let gathered = Gathered::new(s, c, row);
        let apart = match estimator == Estimator::LeaveOneOut && !gathered.is_all() {
            true => {
                let q = gathered.arrivals(s, c).map(|i| s.camera.arrivals.get(i).survival);
                ratio(q_camera, q.sum())
            }
            false => 1.0,
        };
        let camera = q_camera * s.camera.outgoing.pdf(i);
        batch.densities.push(Density { camera, light: q_light * a.back_pdf, apart });
        batch.direct.push(a.reflectance * arriving);
        if let Some(bridges) = s.bridges {
            let b = &bridges.segments[i];
            batch.bridged.push(b.value(q_camera * b.pdf, c));
        }
    }
    for (j, own) in s.lights(c).zip(s.path_survivals(c)) {
        let a = s.light.arrivals.get(j);
        let q = match estimator {
            Estimator::LeaveOneOut => (q_light - own).max(0.0),
            Estimator::Literal | Estimator::WholePath => q_light,
        };
        batch.densities.push(Density {
            camera: q_camera * a.back_pdf,
            light: q * s.light.photons.get(j).pdf,
            apart: 1.0,
        });
        batch.direct.push(a.reflectance * arriving);
        batch.bridged.extend(s.bridges.map(|_| Vec3::ZERO));
    }
    if estimator == Estimator::WholePath {
        batch.towards_lights.extend(s.cameras(c).map(|i| {
            let pdf = s.camera.next_events.get(i).map_or(0.0, |n| n.pdf);
            TowardsLight { value: s.camera.arrivals.get(i).reflectance * pdf, camera: q_camera * pdf }
        }));
        batch.towards_lights.resize(batch.densities.len(), TowardsLight::default());
    }
}

/// An arrival of a cluster whose lobes are evaluated pair by pair.
struct Member {
    number: usize,
    arrival: Arrival,
    bsdf: Bsdf,
    /// Direction of the segment that leaves it, if there is one.
    leaves: Option<Vec3>,
}

impl Member {
    fn of_camera(s: Sampled, i: usize) -> Self {
        let arrival = s.camera.arrivals.get(i);
        let leaves = arrival.goes_on.then(|| s.camera.outgoing.get(i).direction);
        Self { number: i, arrival, bsdf: arrival.bsdf(s.world), leaves }
    }

    fn of_light(s: Sampled, j: usize) -> Self {
        let arrival = s.light.arrivals.get(j);
        let leaves = arrival.goes_on.then(|| s.light.photons.get(j).direction);
        Self { number: j, arrival, bsdf: arrival.bsdf(s.world), leaves }
    }
}

fn paired(s: Sampled, c: &Cluster, estimator: Estimator, batch: &mut Batch) {
    let cameras: Vec<Member> = s.cameras(c).map(|i| Member::of_camera(s, i)).collect();
    let lights: Vec<Member> = s.lights(c).map(|j| Member::of_light(s, j)).collect();
    let (n, m) = (cameras.len(), lights.len());
    let width = columns(s, c);
    let first = batch.densities.len();
    batch.densities.resize(first + n + m, Density { apart: 1.0, ..Density::default() });
    batch.direct.resize(first + n + m, Vec3::ZERO);
    let matrix = batch.values.len();
    // who gathers, as seen from where, and with which `q`: a light arrival's path is no technique of the camera
    let mut gatherers: Vec<(Cow<Bsdf>, Vec3, f32)> =
        cameras.iter().map(|m| (Cow::Borrowed(&m.bsdf), m.arrival.wo, m.arrival.survival)).collect();
    if estimator == Estimator::Literal {
        gatherers.extend(lights.iter().map(|m| {
            // nobody reads what one gathers whose path ends
            let wo = m.leaves.unwrap_or(m.arrival.wo);
            (Cow::Owned(m.arrival.bsdf_from(s.world, wo)), wo, 0.0)
        }));
    }
    let rows = gatherers.len();
    let owns = batch.owns.len();
    batch.owns.resize(owns + n * m, 0.0);
    batch.values.resize(matrix + rows * width, Vec3::ZERO);
    let densities = &mut batch.densities[first..];
    let bridges = cameras.iter().filter_map(|m| Some(&s.bridges?.segments[m.number]));
    let next_events: Vec<_> = cameras.iter().map(|m| s.camera.next_events.get(m.number)).collect();
    let mut bridge_pdfs = vec![0.0; n];
    let mut next_event_pdfs = vec![0.0; n];
    let mut next_event_values = vec![Vec3::ZERO; rows * n];
    let mut leaving_pdfs = vec![0.0; rows * n];
    for (row, (bsdf, wo, q)) in gatherers.iter().enumerate() {
        let sight = bsdf.sight(*wo, Among::Continuous);
        let look = |w: Vec3| {
            let (value, ProjectedPdf(pdf)) =
                sight.as_ref().map_or((Vec3::ZERO, ProjectedPdf(0.0)), |s| s.look(w));
            (q * pdf, value)
        };
        for (column, (member, next_event)) in cameras.iter().zip(&next_events).enumerate() {
            if let Some(direction) = member.leaves {
                let (pdf, value) = look(direction);
                densities[column].camera += pdf;
                leaving_pdfs[row * n + column] = pdf;
                batch.values[matrix + row * width + column] = value;
            }
            if let Some(next_event) = next_event {
                let (pdf, value) = look(next_event.direction);
                next_event_pdfs[column] += pdf;
                next_event_values[row * n + column] = value;
            }
        }
        for (column, member) in lights.iter().enumerate() {
            let w = member.arrival.wo;
            let (pdf, value) = look(w);
            densities[n + column].camera += pdf;
            batch.values[matrix + row * width + n + column] = value / bsdf.relative_index(*wo, w).powi(2);
        }
        for (column, b) in bridges.clone().enumerate() {
            let (pdf, value) = look(b.direction);
            bridge_pdfs[column] += pdf;
            batch.values[matrix + row * width + n + m + column] =
                value / bsdf.relative_index(*wo, b.direction).powi(2);
        }
    }
    if estimator == Estimator::LeaveOneOut {
        leave_out(s, c, &leaving_pdfs, &mut batch.values[matrix..], width, densities);
    }
    if s.bridges.is_some() {
        batch.bridged.extend(bridges.zip(&bridge_pdfs).map(|(b, &p_cam)| b.value(p_cam, c)));
        batch.bridged.resize(first + n + m, Vec3::ZERO);
    }
    for (t, own) in lights.iter().enumerate() {
        let a = &own.arrival;
        let sight = own.bsdf.sight(a.wo, Among::Continuous);
        let pdf = |w: Vec3| sight.as_ref().map_or(0.0, |s| a.survival * s.pdf(w).0);
        for (row, member) in cameras.iter().enumerate() {
            let part = pdf(member.arrival.wo);
            densities[row].light += part;
            batch.owns[owns + row * m + t] = part;
        }
        for (other, member) in lights.iter().enumerate() {
            let is_rival = estimator != Estimator::LeaveOneOut || s.path(member.number) != s.path(own.number);
            if let Some(direction) = member.leaves.filter(|_| is_rival) {
                densities[n + other].light += pdf(direction);
            }
        }
    }
    for row in 0..n {
        s.sum_over_paths(c, &mut batch.owns[owns + row * m..][..m]);
    }
    for (column, next_event) in next_events.iter().enumerate() {
        if let Some(next_event) = next_event {
            let value = next_event_value(next_event, next_event_pdfs[column], c) / c.area;
            for row in 0..rows {
                batch.direct[first + row] += next_event_values[row * n + column] * value;
            }
        }
    }
    if estimator == Estimator::WholePath {
        let own = |k: usize| TowardsLight { value: next_event_values[k * n + k], camera: next_event_pdfs[k] };
        batch.towards_lights.extend((0..n).map(own));
        batch.towards_lights.resize(batch.densities.len(), TowardsLight::default());
    }
}
