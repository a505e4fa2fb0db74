//! Radiance through the graph of clusters: `L(s) = T L_e + T sum over s' of f / A value(s')`.
//!
//! The photons of an iteration carry the flux of their own light paths, so what is gathered from them is
//! constant; only the reflected radiance of camera segments is unknown. Leaving one out (the Mecke
//! formula): the density of a segment whose light comes from a photon that landed in its end cluster counts
//! the other photons there alone, since that one's presence is given.

use super::Cut;
use super::cluster::Cluster;
use super::store::Rivals;
use super::weigh::{Sampled, Weights};
use crate::math::luminance;
use crate::shading::SurfaceClass;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Change of the mean, relative to it, below which sweeping stops.
const TOLERANCE: f64 = 1e-3;
/// Fewest and most sweeps.
const SWEEPS: [u32; 2] = [2, 32];
const BATCH: usize = 256;

/// Reflected basic radiance at the camera's arrivals, by index.
#[derive(Debug, Default)]
pub struct Reflected {
    /// Of all light that was not gathered from photons there.
    pub carried: Vec<Vec3>,
    /// Of the photons that landed in the arrival's cluster.
    pub photons: Vec<Vec3>,
    /// Of light that was scattered nowhere else.
    pub direct: Vec<Vec3>,
    /// Sweeps that were made.
    pub sweeps: u32,
    segments: Vec<Segment>,
}

/// The constants of a camera segment, by the arrival it leaves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Segment {
    /// Emitted light that it met, weighed: `E / D_E`.
    pub emitted: Vec3,
    /// Factor on what its end reflects: `T / D_R`.
    pub carry: Vec3,
    /// The same without one photon at the end: `T / D_R^-`.
    pub carry_photons: Vec3,
    /// Own-path continuation: `P_cam / (q p)`.
    continuation: f32,
}

impl Segment {
    pub fn value(&self, carried: Vec3, photons: Vec3) -> Vec3 {
        self.emitted + self.carry * carried + self.carry_photons * photons
    }
}

/// One over a density; zero where there is none, or so little that nothing can have come of it.
fn reciprocal(density: f32) -> f32 {
    let r = 1.0 / density;
    if density > 0.0 && r.is_finite() { r } else { 0.0 }
}

impl Reflected {
    /// Solves for the radiance. `starts`: for every path, the range of its arrivals. Returns `false` if it was
    /// stopped.
    pub fn solve(&mut self, s: Sampled, w: &Weights, starts: &[u32], cut: &Cut) -> bool {
        let n = s.camera.arrivals.len();
        self.segments = segments(s, w, None);
        let (photons, first_photons) = gather_photons(s, w, None);
        self.photons = photons;
        if cut.is_raised() {
            return false;
        }
        self.carried = self.own_tails(s, w, starts, n);
        let mean = |v: &[Vec3]| starts.iter().map(|&i| f64::from(luminance(v[i as usize]))).sum::<f64>();
        let constant = mean(&self.photons);
        let mut before = mean(&self.carried);
        self.sweeps = 0;
        while self.sweeps < SWEEPS[1] {
            if cut.is_raised() {
                return false;
            }
            let values: Vec<Vec3> = (0..n)
                .into_par_iter()
                .with_min_len(1024)
                .map(|i| {
                    let segment = &self.segments[i];
                    match s.camera.outgoing[i].forward > 0.0 {
                        true => segment.value(self.carried[i + 1], self.photons[i + 1]),
                        false => segment.emitted,
                    }
                })
                .collect();
            self.carried = gather(s, w, &values);
            self.sweeps += 1;
            let now = mean(&self.carried);
            let change = (now - before).abs();
            before = now;
            if self.sweeps >= SWEEPS[0] && change <= TOLERANCE * (now + constant) {
                break;
            }
        }
        let straight: Vec<Vec3> = segments(s, w, Some(0)).iter().map(|segment| segment.emitted).collect();
        self.direct = gather(s, w, &straight);
        self.direct.par_iter_mut().zip(first_photons).for_each(|(d, p)| *d += p);
        true
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let vectors = self.carried.capacity() + self.photons.capacity() + self.direct.capacity();
        vectors * size_of::<Vec3>() + self.segments.capacity() * size_of::<Segment>()
    }

    /// What every path's own tail says of the light it carries, from its end backwards.
    fn own_tails(&self, s: Sampled, w: &Weights, starts: &[u32], n: usize) -> Vec<Vec3> {
        let path = |k: usize| {
            let end = starts.get(k + 1).map_or(n, |&e| e as usize);
            let mut tail = vec![Vec3::ZERO; end - starts[k] as usize];
            for i in (starts[k] as usize..end).rev() {
                let at = i - starts[k] as usize;
                let place = s.clusters.place[i] as usize;
                let mut light = w.direct[place];
                if s.camera.arrivals[i].goes_on {
                    let segment = &self.segments[i];
                    let value = match s.camera.outgoing[i].forward > 0.0 {
                        true => segment.value(tail[at + 1], self.photons[i + 1]),
                        false => segment.emitted,
                    };
                    let cluster = s.clusters.of[i] as usize;
                    let c = &s.clusters.clusters[cluster];
                    let f = match c.class {
                        SurfaceClass::Diffuse => s.camera.arrivals[i].reflectance * s.camera.outgoing[i].pdf,
                        _ => {
                            let row = place - c.first as usize;
                            w.row(cluster, row)[row]
                        }
                    };
                    light += f * value * (segment.continuation / c.area);
                }
                tail[at] = light;
            }
            tail
        };
        (0..starts.len()).into_par_iter().with_min_len(256).flat_map_iter(path).collect()
    }
}

/// The constants of all camera segments. `most`: passages through Dirac lobes up to which met light counts.
pub(super) fn segments(s: Sampled, w: &Weights, most: Option<u32>) -> Vec<Segment> {
    let hits = &s.camera.hits;
    let one = |i: usize| {
        let (a, out) = (&s.camera.arrivals[i], &s.camera.outgoing[i]);
        if !a.goes_on {
            return Segment::default();
        }
        let here = &s.clusters.clusters[s.clusters.of[i] as usize];
        let camera = w.densities[s.clusters.place[i] as usize].camera / here.area;
        let mut emitted = Vec3::ZERO;
        let first = hits.partition_point(|h| (h.arrival as usize) < i);
        let own = hits[first..].iter().take_while(|h| h.arrival as usize == i);
        for h in own.filter(|h| most.is_none_or(|m| h.passages <= m)) {
            let next_event = h.next_event_pdf * here.cameras as f32 / here.area;
            emitted += h.light * reciprocal(h.forward * camera + next_event + h.light_density);
        }
        let continuation = camera * here.area / (a.survival * out.pdf);
        if out.forward <= 0.0 {
            return Segment { emitted, continuation, ..Segment::default() };
        }
        let end = &s.clusters.clusters[s.clusters.of[i + 1] as usize];
        let light =
            w.densities[s.clusters.place[i + 1] as usize].light / end.area * out.reverse * out.squeeze;
        let others = if end.lights > 0 { 1.0 - 1.0 / end.lights as f32 } else { 0.0 };
        Segment {
            emitted,
            carry: out.throughput * reciprocal(out.forward * camera + light),
            carry_photons: out.throughput * reciprocal(out.forward * camera + light * others),
            continuation,
        }
    };
    (0..s.camera.arrivals.len()).into_par_iter().with_min_len(1024).map(one).collect()
}

/// Flux over area of a photon, times its weight beside the other techniques.
fn photon_value(s: Sampled, w: &Weights, c: &Cluster, j: usize) -> Vec3 {
    let photon = &s.light.photons[j];
    let camera = photon.camera_choices * w.densities[s.light_place(j)].camera / c.area;
    let (own, others) = match photon.rivals {
        Rivals::First { light_density, next_event_pdf, is_delta } => {
            let met = if is_delta { 0.0 } else { camera };
            // NaN only where the light grazes the surface
            let others = met + next_event_pdf * c.cameras as f32 / c.area;
            (light_density, if others.is_nan() { f32::INFINITY } else { others })
        }
        Rivals::Later { light_choices, squeeze } => {
            let place = s.light_place(j - 1);
            let cluster = s.clusters.of[s.camera.arrivals.len() + j - 1] as usize;
            let area = s.clusters.clusters[cluster].area;
            (light_choices * squeeze * w.densities[place].light / area, camera)
        }
    };
    // with no photon to compare with, the camera has it all; with no camera path either, this one has
    let weight = if own + others > 0.0 { own / (own + others) } else { 1.0 };
    photon.flux * (weight / c.area)
}

/// Reflected light of the photons of every camera arrival's cluster: of all that were scattered at most `most`
/// times, and of those never scattered alone.
pub(super) fn gather_photons(s: Sampled, w: &Weights, most: Option<u32>) -> (Vec<Vec3>, Vec<Vec3>) {
    let mut all = vec![Vec3::ZERO; s.camera.arrivals.len()];
    let mut first = all.clone();
    let batches: Vec<Vec<(usize, Vec3, Vec3)>> = clusters(s)
        .map(|batch| {
            let mut out = Vec::new();
            for (k, c) in batch {
                if c.lights == 0 || c.cameras == 0 {
                    continue;
                }
                let counts = |j: usize| most.is_none_or(|m| s.light.photons[j].bounces <= m);
                let value = |j| if counts(j) { photon_value(s, w, c, j) } else { Vec3::ZERO };
                let values: Vec<(Vec3, bool)> =
                    s.lights(c).map(|j| (value(j), s.light.photons[j].bounces == 0)).collect();
                let sums = |f: &dyn Fn(usize) -> Vec3| {
                    values.iter().enumerate().fold(
                        (Vec3::ZERO, Vec3::ZERO),
                        |(all, first), (m, &(v, is_first))| {
                            let light = f(m) * v;
                            (all + light, if is_first { first + light } else { first })
                        },
                    )
                };
                let arrivals = &s.light.arrivals;
                let lights = s.clusters.order[c.light_places()].iter();
                let back: Vec<f32> =
                    lights.map(|&i| arrivals[i as usize - s.camera.arrivals.len()].back_pdf).collect();
                let shared = sums(&|m| Vec3::splat(back[m]));
                for (row, i) in s.cameras(c).enumerate() {
                    let (a, f) = match c.class {
                        SurfaceClass::Diffuse => {
                            let r = s.camera.arrivals[i].reflectance;
                            (r * shared.0, r * shared.1)
                        }
                        _ => {
                            let values = &w.row(k, row)[c.cameras as usize..];
                            sums(&|m| values[m])
                        }
                    };
                    out.push((i, a * s.camera.inverse_n2[i], f * s.camera.inverse_n2[i]));
                }
            }
            out
        })
        .collect();
    for (i, a, f) in batches.into_iter().flatten() {
        all[i] = a;
        first[i] = f;
    }
    (all, first)
}

/// One sweep: next-event light and the `values` of the segments that leave a cluster, reflected at its arrivals.
pub(super) fn gather(s: Sampled, w: &Weights, values: &[Vec3]) -> Vec<Vec3> {
    let mut out = vec![Vec3::ZERO; values.len()];
    let batches: Vec<Vec<(usize, Vec3)>> = clusters(s)
        .map(|batch| {
            let mut out = Vec::new();
            for (k, c) in batch {
                let direct = &w.direct[c.camera_places()];
                let leaving = s.cameras(c).map(|i| (values[i] * s.camera.outgoing[i].pdf).as_dvec3());
                let shared = match c.class {
                    SurfaceClass::Diffuse => leaving.sum::<DVec3>().as_vec3() / c.area,
                    _ => Vec3::ZERO,
                };
                for (row, i) in s.cameras(c).enumerate() {
                    let reflected = match c.class {
                        SurfaceClass::Diffuse => s.camera.arrivals[i].reflectance * shared,
                        _ => {
                            let f = w.row(k, row);
                            let sum: Vec3 = f.iter().zip(s.cameras(c)).map(|(f, i)| *f * values[i]).sum();
                            sum / c.area
                        }
                    };
                    out.push((i, direct[row] + reflected));
                }
            }
            out
        })
        .collect();
    for (i, v) in batches.into_iter().flatten() {
        out[i] = v;
    }
    out
}

/// The clusters with their indices, in batches.
fn clusters<'a>(
    s: Sampled<'a>,
) -> impl IndexedParallelIterator<Item = impl Iterator<Item = (usize, &'a Cluster)>> {
    let all = &s.clusters.clusters;
    all.par_chunks(BATCH)
        .enumerate()
        .map(|(b, chunk)| chunk.iter().enumerate().map(move |(k, c)| (b * BATCH + k, c)))
}
