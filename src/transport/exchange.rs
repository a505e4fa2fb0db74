//! What camera segments bring, and what arrivals gather from those that leave their clusters.

use super::Cut;
use super::bridge::Bridges;
use super::cluster::Cluster;
use super::returns::Gathered;
use super::store::EmissionHit;
use super::weigh::{Density, Sampled, Weights};
use crate::shading::SurfaceClass;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Fewest arrivals or clusters, and number of paths, that one task takes.
pub(super) const GRAIN: usize = 512;

/// The constants of a camera segment, by the arrival it leaves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Segment {
    /// Emitted light that it met, weighed: `E / D_E`.
    pub emitted: Vec3,
    /// Factor on what its end reflects: `T / D_R`.
    pub carry: Vec3,
    /// Density of the camera's techniques: `c P_cam / A_x`.
    pub camera: f32,
    /// Factor on `P_light` that makes it the density of the light's techniques: `c / (A_y n_rel^2)`.
    pub light: f32,
    /// Density of bridges along it, were its end's cluster chosen with certainty.
    pub bridge: f32,
    /// Own-path continuation: `P_cam / (q p)`.
    pub continuation: f32,
}

impl Segment {
    /// What it brings, `value(s')`, if it met so much light, and if its end, where it has one, reflects so much
    /// carried light and has photons that bring so much.
    #[inline]
    pub fn value(&self, emitted: Vec3, end: Option<(Vec3, Vec3)>) -> Vec3 {
        match end {
            Some((carried, brought)) => emitted + self.carry * carried + brought,
            None => emitted,
        }
    }

    /// Factor on what it brings that makes it the own path's estimate of what arrival `i`, which it leaves, reflects.
    pub fn along_path(&self, s: Sampled, w: &Weights, i: usize) -> Vec3 {
        let cluster = s.clusters.of[i] as usize;
        let c = &s.clusters.clusters[cluster];
        let f = match c.class {
            SurfaceClass::Diffuse => s.camera.arrivals.get(i).reflectance * s.camera.outgoing.pdf(i),
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let row = (s.clusters.place[i] - c.first) as usize;
                w.row(cluster, row)[row]
            }
        };
        f * (self.continuation / c.area)
    }

    /// Densities of all techniques: `p_light` and `chance` of its end's cluster.
    pub fn density(&self, p_light: f32, chance: f32) -> f32 {
        self.camera + self.light * p_light.max(0.0) + self.bridge * chance
    }
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
    let camera = w.densities[s.clusters.place[i] as usize].camera / here.area;
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

/// The constants of all camera segments.
pub(super) fn segments(s: Sampled, w: &Weights) -> Vec<Segment> {
    let one = |i: usize| {
        let (a, out) = (s.camera.arrivals.get(i), s.camera.outgoing.get(i));
        if !a.goes_on {
            return Segment::default();
        }
        let here = s.cluster_of(i);
        let Density { camera: p_camera, apart, .. } = w.densities[s.clusters.place[i] as usize];
        // paired values have it within
        let within = if here.class == SurfaceClass::Diffuse { 1.0 } else { apart };
        let constants = Segment {
            emitted: emitted(s, w, i, None),
            continuation: p_camera * reciprocal(a.survival * out.pdf * within),
            ..Segment::default()
        };
        if !has_end(s, i) {
            return constants;
        }
        let end = s.cluster_of(i + 1);
        let p_light = w.densities[s.clusters.place[i + 1] as usize].light;
        let camera = out.forward * p_camera / here.area;
        let light = out.reverse * out.squeeze / end.area;
        let (mut bridge, mut chance) = (0.0, 0.0);
        if let Some(bridges) = s.bridges.filter(|_| out.passages == 0) {
            bridge = Bridges::density(s, &a, here, &s.camera.arrivals.get(i + 1), end);
            chance = bridges.chances[s.clusters.of[i + 1] as usize];
        }
        let constants = Segment { camera, light, bridge, ..constants };
        Segment { carry: out.throughput * reciprocal(constants.density(p_light, chance)), ..constants }
    };
    per_index(s, one)
}

/// Next-event light, and the `values` of the segments that leave a cluster, reflected at its arrivals.
pub(super) fn gather(s: Sampled, w: &Weights, values: &[Vec3], cut: &Cut) -> Vec<Vec3> {
    let mut light = reflect(s, w, values, cut);
    light.par_iter_mut().zip(&s.clusters.place).for_each(|(l, &place)| *l += w.direct[place as usize]);
    light
}

/// What arrivals reflect of the `values` of the segments that leave their clusters.
pub(super) fn reflect(s: Sampled, w: &Weights, values: &[Vec3], cut: &Cut) -> Vec<Vec3> {
    let arriving = |i: usize| (values[i] * s.camera.outgoing.pdf(i)).as_dvec3();
    let shared =
        per_diffuse_cluster(s, cut, |c| s.cameras(c).map(arriving).sum::<DVec3>().as_vec3() / c.area);
    let of_others = |i: usize, c: &Cluster, apart: f32| {
        let row = (s.clusters.place[i] - c.first) as usize;
        let gathered = Gathered::new(s, c, row);
        gathered.arrivals(s, c).map(arriving).sum::<DVec3>().as_vec3() * (apart / c.area)
    };
    per_arrival(s, cut, |i, k, c| match c.class {
        SurfaceClass::Diffuse => {
            let apart = w.densities[s.clusters.place[i] as usize].apart;
            let arriving = if apart == 1.0 { shared[k] } else { of_others(i, c, apart) };
            s.camera.arrivals.get(i).reflectance * arriving
        }
        SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
            let f = w.row(k, (s.clusters.place[i] - c.first) as usize);
            let sum: Vec3 = f.iter().zip(s.cameras(c)).map(|(f, i)| *f * values[i]).sum();
            sum / c.area
        }
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
        let k = s.clusters.of[i] as usize;
        f(i, k, &s.clusters.clusters[k])
    };
    per_index(s, one)
}

#[cfg(test)]
mod tests;
