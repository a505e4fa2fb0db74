//! What arrivals gather: from the segments that leave their clusters, and from the photons that landed in them.

use super::Cut;
use super::cluster::Cluster;
use super::store::{Photon, Rivals};
use super::weigh::{Sampled, Weights};
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
}

/// Light of the photons in the cluster of a camera arrival.
#[derive(Clone, Copy, Debug, Default)]
pub struct FromPhotons {
    /// What the arrival reflects of it.
    pub reflected: Vec3,
    /// What the segment that arrived there brings of it: each photon's part over the density of all techniques
    /// but that photon, `R_p / D_R^-`.
    pub brought: Vec3,
}

/// One over a density; zero where there is none, or so little that nothing can have come of it.
pub(super) fn reciprocal(density: f32) -> f32 {
    let r = 1.0 / density;
    if density > 0.0 && r.is_finite() { r } else { 0.0 }
}

/// Whether a segment that leaves arrival `i` ends at the next one.
#[inline]
pub(super) fn has_end(s: Sampled, i: usize) -> bool {
    s.camera.outgoing[i].forward > 0.0
}

/// Emitted light that the segment which leaves arrival `i` met, weighed: `E / D_E`. `most`: passages through
/// Dirac lobes up to which light counts.
pub(super) fn emitted(s: Sampled, w: &Weights, i: usize, most: Option<u32>) -> Vec3 {
    let hits = &s.camera.hits;
    let here = s.cluster_of(i);
    let camera = w.densities[s.clusters.place[i] as usize].camera / here.area;
    let first = hits.partition_point(|h| (h.arrival as usize) < i);
    let own = hits[first..].iter().take_while(|h| h.arrival as usize == i);
    own.filter(|h| most.is_none_or(|m| h.passages <= m))
        .map(|h| {
            let next_event = h.next_event_pdf * here.cameras as f32 / here.area;
            h.light * reciprocal(h.forward * camera + next_event + h.light_density)
        })
        .sum()
}

/// The constants of all camera segments.
pub(super) fn segments(s: Sampled, w: &Weights) -> Vec<Segment> {
    let one = |i: usize| {
        let (a, out) = (&s.camera.arrivals[i], &s.camera.outgoing[i]);
        if !a.goes_on {
            return Segment::default();
        }
        let here = s.cluster_of(i);
        let p_camera = w.densities[s.clusters.place[i] as usize].camera;
        let constants = Segment {
            emitted: emitted(s, w, i, None),
            continuation: p_camera / (a.survival * out.pdf),
            ..Segment::default()
        };
        if !has_end(s, i) {
            return constants;
        }
        let end = s.cluster_of(i + 1);
        let p_light = w.densities[s.clusters.place[i + 1] as usize].light;
        let camera = out.forward * p_camera / here.area;
        let light = out.reverse * out.squeeze / end.area;
        Segment { carry: out.throughput * reciprocal(camera + light * p_light), camera, light, ..constants }
    };
    per_index(s, one)
}

/// Flux over area of a photon, times its weight beside the other techniques.
pub(super) fn photon_value(s: Sampled, w: &Weights, j: usize) -> Vec3 {
    let i = s.camera.arrivals.len() + j;
    let c = s.cluster_of(i);
    let photon = &s.light.photons[j];
    let camera = photon.camera_choices * w.densities[s.clusters.place[i] as usize].camera / c.area;
    let (own, others) = match photon.rivals {
        Rivals::First { light_density, next_event_pdf, is_delta } => {
            let met = if is_delta { 0.0 } else { camera };
            let others = met + next_event_pdf * c.cameras as f32 / c.area;
            // NaN only where the light grazes the surface
            (light_density, if others.is_nan() { f32::INFINITY } else { others })
        }
        Rivals::Later { light_choices, squeeze } => {
            let before = s.cluster_of(i - 1);
            let p_light = w.densities[s.clusters.place[i - 1] as usize].light;
            (light_choices * squeeze * p_light / before.area, camera)
        }
    };
    // with no photon to compare with, the camera has it all; with no camera path either, this one has
    let weight = if own + others > 0.0 { own / (own + others) } else { 1.0 };
    photon.flux * (weight * c.inverse_area)
}

/// What every photon brings to its cluster; nothing where no camera path arrives.
pub(super) fn photon_values(s: Sampled, w: &Weights) -> Vec<Vec3> {
    let n = s.light.arrivals.len();
    let one = |j: usize| match s.cluster_of(s.camera.arrivals.len() + j).cameras {
        0 => Vec3::ZERO,
        _ => photon_value(s, w, j),
    };
    (0..n).into_par_iter().with_min_len(GRAIN).map(one).collect()
}

/// Light of the photons in every camera arrival's cluster that are `wanted`.
pub(super) fn gather_photons(
    s: Sampled,
    w: &Weights,
    segments: &[Segment],
    values: &[Vec3],
    cut: &Cut,
    wanted: impl Fn(&Photon) -> bool + Sync,
) -> Vec<FromPhotons> {
    let light = |j: usize| if wanted(&s.light.photons[j]) { values[j] } else { Vec3::ZERO };
    // what arrives, and the mean `q` of a photon's path there, as much as each brings: exact to first order
    let shared = per_diffuse_cluster(s, cut, |c| {
        if c.cameras == 0 || c.lights == 0 {
            return (Vec3::ZERO, 0.0);
        }
        let (mut arriving, mut left_out) = (DVec3::ZERO, 0.0);
        for (j, own) in s.lights(c).zip(s.path_survivals(c)) {
            let value = (light(j) * s.light.arrivals[j].back_pdf).as_dvec3();
            arriving += value;
            left_out += value.element_sum() * f64::from(own);
        }
        let total = arriving.element_sum();
        (arriving.as_vec3(), if total > 0.0 { (left_out / total) as f32 } else { 0.0 })
    });
    per_arrival(s, cut, |i, k, c| {
        if c.lights == 0 {
            return FromPhotons::default();
        }
        let place = s.clusters.place[i];
        let p_light = w.densities[place as usize].light;
        let before = i.checked_sub(1).filter(|&b| has_end(s, b));
        let arriving = before.map(|b| (&segments[b], s.camera.outgoing[b].throughput));
        // factor on light of a photon whose path's part of `P_light` is `own`
        let carry = |own: f32| match arriving {
            Some((a, throughput)) => throughput * reciprocal(a.camera + a.light * (p_light - own).max(0.0)),
            None => Vec3::ZERO,
        };
        let mut sum = FromPhotons::default();
        match c.class {
            SurfaceClass::Diffuse => {
                let (a, (arriving, own)) = (&s.camera.arrivals[i], shared[k]);
                sum.reflected = a.reflectance * arriving;
                sum.brought = carry(own * a.back_pdf) * sum.reflected;
            }
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let row = (place - c.first) as usize;
                let f = &w.row(k, row)[c.cameras as usize..];
                for ((f, own), j) in f.iter().zip(w.own(k, row)).zip(s.lights(c)) {
                    let reflected = *f * light(j);
                    sum.reflected += reflected;
                    sum.brought += carry(*own) * reflected;
                }
            }
        }
        let inverse_n2 = s.camera.inverse_n2[i];
        FromPhotons { reflected: sum.reflected * inverse_n2, brought: sum.brought * inverse_n2 }
    })
}

/// One sweep: next-event light, and the `values` of the segments that leave a cluster, reflected at its arrivals.
pub(super) fn gather(s: Sampled, w: &Weights, values: &[Vec3], cut: &Cut) -> Vec<Vec3> {
    let shared = per_diffuse_cluster(s, cut, |c| {
        let leaving = s.cameras(c).map(|i| (values[i] * s.camera.outgoing[i].pdf).as_dvec3());
        leaving.sum::<DVec3>().as_vec3() / c.area
    });
    per_arrival(s, cut, |i, k, c| {
        let place = s.clusters.place[i];
        let reflected = match c.class {
            SurfaceClass::Diffuse => s.camera.arrivals[i].reflectance * shared[k],
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let f = w.row(k, (place - c.first) as usize);
                let sum: Vec3 = f.iter().zip(s.cameras(c)).map(|(f, i)| *f * values[i]).sum();
                sum / c.area
            }
        };
        w.direct[place as usize] + reflected
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
