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
    carry: Vec3,
    /// The same without one photon at the end: `T / D_R^-`.
    carry_photons: Vec3,
    /// Own-path continuation: `P_cam / (q p)`.
    pub continuation: f32,
}

impl Segment {
    /// What it brings, `value(s')`, if it met so much light, and if its end, where it has one, reflects so much:
    /// carried light and that of photons.
    #[inline]
    pub fn value(&self, emitted: Vec3, end: Option<(Vec3, Vec3)>) -> Vec3 {
        match end {
            Some((carried, photons)) => emitted + self.carry * carried + self.carry_photons * photons,
            None => emitted,
        }
    }
}

/// One over a density; zero where there is none, or so little that nothing can have come of it.
fn reciprocal(density: f32) -> f32 {
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
    let here = &s.clusters.clusters[s.clusters.of[i] as usize];
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
        let here = &s.clusters.clusters[s.clusters.of[i] as usize];
        let p_camera = w.densities[s.clusters.place[i] as usize].camera;
        let constants = Segment {
            emitted: emitted(s, w, i, None),
            continuation: p_camera / (a.survival * out.pdf),
            ..Segment::default()
        };
        if !has_end(s, i) {
            return constants;
        }
        let end = &s.clusters.clusters[s.clusters.of[i + 1] as usize];
        let p_light = w.densities[s.clusters.place[i + 1] as usize].light;
        let camera = out.forward * p_camera / here.area;
        let light = out.reverse * out.squeeze * p_light / end.area;
        let others = if end.lights > 0 { 1.0 - 1.0 / end.lights as f32 } else { 0.0 };
        Segment {
            carry: out.throughput * reciprocal(camera + light),
            carry_photons: out.throughput * reciprocal(camera + light * others),
            ..constants
        }
    };
    per_index(s, one)
}

/// Flux over area of a photon, times its weight beside the other techniques.
fn photon_value(s: Sampled, w: &Weights, j: usize) -> Vec3 {
    let i = s.camera.arrivals.len() + j;
    let c = &s.clusters.clusters[s.clusters.of[i] as usize];
    if c.cameras == 0 {
        return Vec3::ZERO;
    }
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
            let before = &s.clusters.clusters[s.clusters.of[i - 1] as usize];
            let p_light = w.densities[s.clusters.place[i - 1] as usize].light;
            (light_choices * squeeze * p_light / before.area, camera)
        }
    };
    // with no photon to compare with, the camera has it all; with no camera path either, this one has
    let weight = if own + others > 0.0 { own / (own + others) } else { 1.0 };
    photon.flux * (weight / c.area)
}

/// What every photon brings to its cluster.
pub(super) fn photon_values(s: Sampled, w: &Weights) -> Vec<Vec3> {
    let n = s.light.arrivals.len();
    (0..n).into_par_iter().with_min_len(GRAIN).map(|j| photon_value(s, w, j)).collect()
}

/// Reflected light of the photons in every camera arrival's cluster that are `wanted`.
pub(super) fn gather_photons(
    s: Sampled,
    w: &Weights,
    values: &[Vec3],
    cut: &Cut,
    wanted: impl Fn(&Photon) -> bool + Sync,
) -> Vec<Vec3> {
    let light = |j: usize| if wanted(&s.light.photons[j]) { values[j] } else { Vec3::ZERO };
    let shared = per_diffuse_cluster(s, cut, |c| {
        let arriving = s.lights(c).map(|j| (light(j) * s.light.arrivals[j].back_pdf).as_dvec3());
        arriving.sum::<DVec3>().as_vec3()
    });
    per_arrival(s, cut, |i, k, c| {
        let reflected = match c.class {
            SurfaceClass::Diffuse => s.camera.arrivals[i].reflectance * shared[k],
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let row = s.clusters.place[i] - c.first;
                let f = &w.row(k, row as usize)[c.cameras as usize..];
                f.iter().zip(s.lights(c)).map(|(f, j)| *f * light(j)).sum::<Vec3>()
            }
        };
        reflected * s.camera.inverse_n2[i]
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

/// Something for every diffuse cluster, zero for the others.
fn per_diffuse_cluster(s: Sampled, cut: &Cut, f: impl Fn(&Cluster) -> Vec3 + Sync) -> Vec<Vec3> {
    let one = |c: &Cluster| match c.class == SurfaceClass::Diffuse && !cut.is_raised() {
        true => f(c),
        false => Vec3::ZERO,
    };
    s.clusters.clusters.par_iter().with_min_len(GRAIN).map(one).collect()
}

/// Something for every camera arrival, by its index, that of its cluster and the cluster.
fn per_arrival(s: Sampled, cut: &Cut, f: impl Fn(usize, usize, &Cluster) -> Vec3 + Sync) -> Vec<Vec3> {
    let one = |i: usize| {
        if cut.is_raised() {
            return Vec3::ZERO;
        }
        let k = s.clusters.of[i] as usize;
        f(i, k, &s.clusters.clusters[k])
    };
    per_index(s, one)
}
