//! What camera segments bring, and what arrivals gather from those that leave their clusters.

use super::Cut;
use super::bridge::Bridges;
use super::cluster::Cluster;
use super::returns::Gathered;
use super::sparse::Sparse;
use super::store::EmissionHit;
use super::weigh::{Sampled, Weights};
use crate::math::SharedExponent;
use crate::shading::SurfaceClass;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Fewest arrivals or clusters, and number of paths, that one task takes.
pub(super) const GRAIN: usize = 512;

/// The densities with which the techniques make a camera segment that ends at an arrival.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Densities {
    /// That of the camera's: `c P_cam / A_x`.
    pub camera: f32,
    /// Factor on `P_light / A_y` that makes it the density of the light's techniques: `c / n_rel^2`.
    pub light: f32,
    /// Density of bridges along it, were its end's cluster chosen with certainty.
    pub bridge: f32,
}

impl Densities {
    /// Of the segment that leaves arrival `i`, which has an end.
    pub fn of(s: Sampled, w: &Weights, i: usize) -> Self {
        let out = s.camera.outgoing.get(i);
        let bridge = match s.bridges.filter(|_| out.passages == 0) {
            Some(_) => {
                let [a, b] = [i, i + 1].map(|i| s.camera.arrivals.get(i));
                Bridges::density(s, &a, s.cluster_of(i), &b, s.cluster_of(i + 1))
            }
            None => 0.0,
        };
        Self { camera: out.forward * w.densities[i].camera, light: out.reverse * out.squeeze, bridge }
    }

    /// Density of all techniques: `p_light`, over the area, and `chance` of its end's cluster.
    pub fn all(&self, p_light: f32, chance: f32) -> f32 {
        self.camera + self.light * p_light.max(0.0) + self.bridge * chance
    }
}

/// What does not change from sweep to sweep, of the segments that leave arrivals.
#[derive(Debug, Default)]
pub(super) struct Segments {
    /// Emitted light that they met, weighed: `E / D_E`.
    emitted: Sparse<SharedExponent>,
    /// One over the density of all techniques, of those that have an end: `1 / D_R`.
    reciprocals: Vec<f32>,
}

impl Segments {
    /// Of all camera segments.
    pub fn new(s: Sampled, w: &Weights) -> Self {
        let n = s.camera.arrivals.len();
        let some = |first: usize| {
            let mut part = Self::default();
            for i in first..(first + GRAIN).min(n) {
                let light = match s.camera.hits.has(i) {
                    true => emitted(s, w, i, None),
                    false => Vec3::ZERO,
                };
                part.emitted.push((light != Vec3::ZERO).then(|| SharedExponent::encode(light)));
                part.reciprocals.push(if has_end(s, i) { Self::reciprocal(s, w, i) } else { 0.0 });
            }
            part
        };
        let parts: Vec<Self> = (0..n.div_ceil(GRAIN)).into_par_iter().map(|k| some(k * GRAIN)).collect();
        let mut all = Self::default();
        all.emitted.reserve(n, parts.iter().map(|p| p.emitted.count()).sum());
        all.reciprocals.reserve_exact(n);
        for mut part in parts {
            all.emitted.append(&mut part.emitted);
            all.reciprocals.append(&mut part.reciprocals);
        }
        all
    }

    fn reciprocal(s: Sampled, w: &Weights, i: usize) -> f32 {
        let p_light = w.densities[i + 1].light;
        let chance = s.bridges.map_or(0.0, |b| b.chances[s.clusters.of(i + 1)]);
        reciprocal(Densities::of(s, w, i).all(p_light, chance))
    }

    /// Emitted light that the segment which leaves arrival `i` met, weighed.
    #[inline]
    pub fn emitted(&self, i: usize) -> Vec3 {
        self.emitted.get(i).map_or(Vec3::ZERO, |e| e.decode())
    }

    /// Factor on what the end of that segment reflects, `T / D_R`; zero without an end.
    #[inline]
    pub fn carry(&self, s: Sampled, i: usize) -> Vec3 {
        match self.reciprocals[i] {
            0.0 => Vec3::ZERO,
            reciprocal => s.camera.outgoing.throughput(i) * reciprocal,
        }
    }

    /// What it brings, `value(s')`, if it met so much light, and if its end, where it has one, reflects so much
    /// carried light and has photons that bring so much.
    #[inline]
    pub fn value(&self, s: Sampled, i: usize, emitted: Vec3, end: Option<(Vec3, Vec3)>) -> Vec3 {
        match end {
            Some((carried, brought)) => emitted + self.carry(s, i) * carried + brought,
            None => emitted,
        }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.emitted.bytes() + self.reciprocals.capacity() * size_of::<f32>()
    }
}

/// Factor on what a segment brings that makes it the own path's estimate of what arrival `i`, which it leaves, reflects.
pub(super) fn along_path(s: Sampled, w: &Weights, i: usize) -> Vec3 {
    let pdf = s.camera.outgoing.pdf(i);
    let (f, within) = match s.camera.arrivals.class(i) {
        SurfaceClass::Diffuse => (s.camera.arrivals.reflectance(i) * pdf, 1.0),
        // paired values have it within
        SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
            let cluster = s.clusters.of(i);
            let row = s.row(i, &s.clusters.clusters[cluster]);
            (w.row(cluster, row)[row].decode(), w.apart(i))
        }
    };
    f * (w.densities[i].camera * reciprocal(s.camera.arrivals.survival(i) * pdf * within))
}

/// One over a density; zero where there is none, or so little that nothing can have come of it.
pub(super) fn reciprocal(density: f32) -> f32 {
    let r = 1.0 / density;
    if density > 0.0 && r.is_finite() { r } else { 0.0 }
}

/// Whether a segment that leaves arrival `i` ends at the next one.
#[inline]
pub(super) fn has_end(s: Sampled, i: usize) -> bool {
    s.camera.outgoing.has_end(i)
}

/// Lights that the segment which leaves arrival `i` met, each with one over the density of all techniques, `1 / D_E`.
fn met<'a>(s: Sampled<'a>, w: &Weights, i: usize) -> impl Iterator<Item = (EmissionHit, f32)> + use<'a> {
    let here = s.cluster_of(i);
    let camera = w.densities[i].camera;
    s.camera.hits.of(i).map(move |h| {
        let next_event = h.next_event_pdf * here.cameras as f32 / here.area;
        (h, reciprocal(h.forward * camera + next_event + h.light_density))
    })
}

/// Emitted light that the segment which leaves arrival `i` met, weighed: `E / D_E`. `most`: passages through
/// Dirac lobes up to which light counts.
pub(super) fn emitted(s: Sampled, w: &Weights, i: usize, most: Option<u32>) -> Vec3 {
    let counted = met(s, w, i).filter(|(h, _)| most.is_none_or(|m| h.passages <= m));
    counted.map(|(h, reciprocal)| h.light * reciprocal).sum()
}

/// Share of light paths in the density of the light that was met, in the mean.
pub(super) fn emitted_share(s: Sampled, w: &Weights, i: usize) -> f32 {
    let (mut all, mut by_light) = (0.0, 0.0);
    for (h, reciprocal) in met(s, w, i) {
        let light = h.light.element_sum() * reciprocal;
        all += light;
        by_light += light * h.light_density * reciprocal;
    }
    if all > 0.0 { by_light / all } else { 0.0 }
}

/// What the segment that leaves arrival `i` offers to its cluster, if it brings `value`: times its density where lobes are
/// diffuse, since that is the same for all of them. Those of other lobes are within their values.
#[inline]
pub(super) fn offer(s: Sampled, i: usize, value: Vec3) -> Vec3 {
    match s.camera.arrivals.class(i) {
        SurfaceClass::Diffuse => value * s.camera.outgoing.pdf(i),
        SurfaceClass::Reflecting | SurfaceClass::Transmitting => value,
    }
}

/// What the segments that leave all arrivals offer, if they bring `value`.
pub(super) fn offers(s: Sampled, value: impl Fn(usize) -> Vec3 + Sync + Send) -> Vec<SharedExponent> {
    per_index(s, |i| SharedExponent::encode(offer(s, i, value(i))))
}

/// Next-event light, and what the segments that leave a cluster offer, reflected at its arrivals.
pub(super) fn gather(s: Sampled, w: &Weights, offers: &[SharedExponent], cut: &Cut) -> Vec<SharedExponent> {
    let all = |i: usize, light: Vec3| SharedExponent::encode(light + w.direct(i));
    reflect(s, w, |i| offers[i].decode(), all, cut)
}

/// What arrivals reflect of what the segments that leave their clusters offer; `keep` makes of it what is stored.
pub(super) fn reflect<T: Default + Send>(
    s: Sampled,
    w: &Weights,
    offer: impl Fn(usize) -> Vec3 + Sync,
    keep: impl Fn(usize, Vec3) -> T + Sync,
    cut: &Cut,
) -> Vec<T> {
    let arriving = |i: usize| offer(i).as_dvec3();
    let shared =
        per_diffuse_cluster(s, cut, |c| s.cameras(c).map(arriving).sum::<DVec3>().as_vec3() / c.area);
    let of_others = |i: usize, c: &Cluster, apart: f32| {
        let gathered = Gathered::new(s, c, s.row(i, c));
        gathered.arrivals(s, c).map(arriving).sum::<DVec3>().as_vec3() * (apart / c.area)
    };
    per_arrival(s, cut, |i, k, c| {
        let light = match c.class {
            SurfaceClass::Diffuse => {
                let apart = w.apart(i);
                let arriving = if apart == 1.0 { shared[k] } else { of_others(i, c, apart) };
                s.camera.arrivals.reflectance(i) * arriving
            }
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let f = w.row(k, s.row(i, c));
                let sum: Vec3 = f.iter().zip(s.cameras(c)).map(|(f, i)| f.decode() * offer(i)).sum();
                sum / c.area
            }
        };
        keep(i, light)
    })
}

/// Something for every camera arrival, by its index.
pub(super) fn per_index<T: Send>(s: Sampled, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    (0..s.camera.arrivals.len()).into_par_iter().with_min_len(GRAIN).map(f).collect()
}

/// Something for every diffuse cluster, nothing for the others.
pub(super) fn per_diffuse_cluster<T: Default + Send>(
    s: Sampled,
    cut: &Cut,
    f: impl Fn(&Cluster) -> T + Sync,
) -> Vec<T> {
    let one = |c: &Cluster| match c.class == SurfaceClass::Diffuse && !cut.is_raised() {
        true => f(c),
        false => T::default(),
    };
    s.clusters.clusters.par_iter().with_min_len(GRAIN).map(one).collect()
}

/// Something for every camera arrival, by its index, that of its cluster and the cluster.
pub(super) fn per_arrival<T: Default + Send>(
    s: Sampled,
    cut: &Cut,
    f: impl Fn(usize, usize, &Cluster) -> T + Sync,
) -> Vec<T> {
    let one = |i: usize| {
        if cut.is_raised() {
            return T::default();
        }
        let k = s.clusters.of(i);
        f(i, k, &s.clusters.clusters[k])
    };
    per_index(s, one)
}

#[cfg(test)]
mod tests;
