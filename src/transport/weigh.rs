//! The MMIS densities: for every segment, how densely all the paths of its end clusters could have made it.
//!
//! `P_cam(w) = sum of q p(w)` over the camera arrivals of the cluster that the segment leaves, and `P_light` likewise over
//! the light arrivals at its other end. Diffuse lobes factorise: their density of a direction is the same for all
//! arrivals of a cluster, so one sum of `q` serves all. Others are evaluated pair by pair, and the values of the
//! lobes are kept for the gathering.

use super::Cut;
use super::cluster::{Cluster, Clusters};
use super::store::{CameraStore, LightStore, NextEvent};
use crate::shading::bsdf::Bsdf;
use crate::shading::{SurfaceClass, World};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Densities of one arrival.
#[derive(Clone, Copy, Debug, Default)]
pub struct Density {
    /// `P_cam` of the segment that leaves a camera arrival, or that brought a light arrival.
    pub camera: f32,
    /// `P_light` of the segment that brought a camera arrival; of the segment that leaves a light arrival, without
    /// that arrival's own part.
    pub light: f32,
}

/// Lobe values of a cluster that does not factorise: for every camera arrival, those of the directions of all
/// segments that leave, then those of all photons, the latter times `(n_o / n_i)^2`.
#[derive(Clone, Copy, Debug)]
pub struct Matrix {
    batch: u32,
    start: u32,
    columns: u32,
}

/// Densities of an iteration. The arrays follow the order of the clusters.
#[derive(Debug, Default)]
pub struct Weights {
    /// One for every arrival.
    pub densities: Vec<Density>,
    /// Basic radiance from next-event segments, reflected at every camera arrival.
    pub direct: Vec<Vec3>,
    /// One for every cluster; unused for diffuse ones.
    matrices: Vec<Matrix>,
    values: Vec<Vec<Vec3>>,
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
}

impl<'a> Sampled<'a> {
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
}

#[derive(Default)]
struct Batch {
    densities: Vec<Density>,
    direct: Vec<Vec3>,
    starts: Vec<(u32, u32)>,
    values: Vec<Vec3>,
}

impl Weights {
    /// Weighs all segments. Returns `false` if it was stopped.
    pub fn weigh(&mut self, s: Sampled, cut: &Cut) -> bool {
        // the lobes' values are most of the memory: not twice
        self.values.clear();
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
                    let start = batch.values.len() as u32;
                    match c.class {
                        SurfaceClass::Diffuse => diffuse(s, c, &mut batch),
                        SurfaceClass::Reflecting | SurfaceClass::Transmitting => paired(s, c, &mut batch),
                    }
                    batch.starts.push((start, c.cameras + c.lights));
                }
                batch
            })
            .collect();
        if cut.is_raised() {
            return false;
        }
        self.densities.clear();
        self.direct.clear();
        self.matrices.clear();
        for (b, batch) in (0..).zip(batches) {
            self.densities.extend(batch.densities);
            self.direct.extend(batch.direct);
            self.matrices.extend(batch.starts.iter().map(|&(start, columns)| Matrix {
                batch: b,
                start,
                columns,
            }));
            self.values.push(batch.values);
        }
        true
    }

    /// Values of the lobes of the `row`-th camera arrival of a cluster that is not diffuse.
    #[inline]
    pub fn row(&self, cluster: usize, row: usize) -> &[Vec3] {
        let m = &self.matrices[cluster];
        let start = m.start as usize + row * m.columns as usize;
        &self.values[m.batch as usize][start..start + m.columns as usize]
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.densities.capacity() * size_of::<Density>()
            + self.direct.capacity() * size_of::<Vec3>()
            + self.matrices.capacity() * size_of::<Matrix>()
            + self.values.iter().map(|v| v.capacity() * size_of::<Vec3>()).sum::<usize>()
    }
}

/// Basic radiance times the weight of a next-event segment over its own density, `E / D_E`, for a cluster of
/// `n` arrivals that each sampled one. `p_cam`: density of the camera's segments along it.
fn next_event_value(n: &NextEvent, p_cam: f32, c: &Cluster) -> Vec3 {
    let met = if n.is_delta { 0.0 } else { p_cam };
    let density = (met + n.next_event_pdf * c.cameras as f32) / c.area + n.light_density;
    if density > 0.0 { n.light / density } else { Vec3::ZERO }
}

fn diffuse(s: Sampled, c: &Cluster, batch: &mut Batch) {
    let sum = |q: &mut dyn Iterator<Item = f32>| q.map(f64::from).sum::<f64>();
    let q_camera = sum(&mut s.cameras(c).map(|i| s.camera.arrivals[i].survival)) as f32;
    let q_light = sum(&mut s.lights(c).map(|j| s.light.arrivals[j].survival));
    let mut arriving = DVec3::ZERO;
    for i in s.cameras(c) {
        let n = &s.camera.next_events[i];
        if n.next_event_pdf > 0.0 {
            arriving += (next_event_value(n, q_camera * n.pdf, c) * n.pdf).as_dvec3();
        }
    }
    let arriving = arriving.as_vec3() / c.area;
    for i in s.cameras(c) {
        let a = &s.camera.arrivals[i];
        batch.densities.push(Density {
            camera: q_camera * s.camera.outgoing[i].pdf,
            light: q_light as f32 * a.back_pdf,
        });
        batch.direct.push(a.reflectance * arriving);
    }
    for j in s.lights(c) {
        let a = &s.light.arrivals[j];
        batch.densities.push(Density {
            camera: q_camera * a.back_pdf,
            light: (q_light - f64::from(a.survival)) as f32 * s.light.photons[j].pdf,
        });
        batch.direct.push(Vec3::ZERO);
    }
}

fn paired(s: Sampled, c: &Cluster, batch: &mut Batch) {
    let cameras: Vec<(usize, Bsdf)> = s.cameras(c).map(|i| (i, s.camera.arrivals[i].bsdf(s.world))).collect();
    let lights: Vec<(usize, Bsdf)> = s.lights(c).map(|j| (j, s.light.arrivals[j].bsdf(s.world))).collect();
    let (n, m) = (cameras.len(), lights.len());
    let first = batch.densities.len();
    batch.densities.resize(first + n + m, Density::default());
    batch.direct.resize(first + n + m, Vec3::ZERO);
    let matrix = batch.values.len();
    batch.values.resize(matrix + n * (n + m), Vec3::ZERO);
    let densities = &mut batch.densities[first..];
    let mut next_event_pdfs = vec![0.0; n];
    let mut next_event_values = vec![Vec3::ZERO; n * n];
    for (row, (t, bsdf)) in cameras.iter().enumerate() {
        let a = &s.camera.arrivals[*t];
        let look = |w: Vec3| (a.survival * bsdf.continuous_pdf(a.wo, w).0, bsdf.eval(a.wo, w));
        for (column, (i, _)) in cameras.iter().enumerate() {
            if s.camera.arrivals[*i].goes_on {
                let (pdf, value) = look(s.camera.outgoing[*i].direction);
                densities[column].camera += pdf;
                batch.values[matrix + row * (n + m) + column] = value;
            }
            let next_event = &s.camera.next_events[*i];
            if next_event.next_event_pdf > 0.0 {
                let (pdf, value) = look(next_event.direction);
                next_event_pdfs[column] += pdf;
                next_event_values[row * n + column] = value;
            }
        }
        for (column, (j, _)) in lights.iter().enumerate() {
            let w = s.light.arrivals[*j].wo;
            let (pdf, value) = look(w);
            densities[n + column].camera += pdf;
            batch.values[matrix + row * (n + m) + n + column] = value / bsdf.relative_index(a.wo, w).powi(2);
        }
    }
    for (t, (own, bsdf)) in lights.iter().enumerate() {
        let a = &s.light.arrivals[*own];
        let pdf = |w: Vec3| a.survival * bsdf.continuous_pdf(a.wo, w).0;
        for (row, (i, _)) in cameras.iter().enumerate() {
            densities[row].light += pdf(s.camera.arrivals[*i].wo);
        }
        for (other, (j, _)) in lights.iter().enumerate() {
            if other != t && s.light.arrivals[*j].goes_on {
                densities[n + other].light += pdf(s.light.photons[*j].direction);
            }
        }
    }
    for (column, (i, _)) in cameras.iter().enumerate() {
        let next_event = &s.camera.next_events[*i];
        if next_event.next_event_pdf > 0.0 {
            let value = next_event_value(next_event, next_event_pdfs[column], c) / c.area;
            for row in 0..n {
                batch.direct[first + row] += next_event_values[row * n + column] * value;
            }
        }
    }
}
