//! What arrivals gather from the photons that landed in their clusters, and from the bridges that leave them: light
//! that no sweep changes.
//!
//! Leaving one out (the Mecke formula): the density of a segment whose light comes from a photon that landed in its
//! end cluster counts the other photons there alone, since that one's presence is given.

use super::Cut;
use super::bridge::{Bridges, Others};
use super::cluster::Cluster;
use super::exchange::{Densities, GRAIN, has_end, per_arrival, per_diffuse_cluster, reciprocal};
use super::store::Rivals;
use super::weigh::{Sampled, Weights};
use crate::math::SharedExponent;
use crate::shading::SurfaceClass;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Weight of a photon beside the other techniques: the share of light paths in the density of all.
pub(super) fn photon_weight(s: Sampled, w: &Weights, j: usize) -> f32 {
    let i = s.camera.arrivals.len() + j;
    let c = s.cluster_of(i);
    let photon = s.light.photons.get(j);
    let camera = photon.camera_choices * w.densities[i].camera;
    let (own, others) = match photon.rivals {
        Rivals::First { light_density, next_event_pdf, is_delta } => {
            let met = if is_delta { 0.0 } else { camera };
            let others = met + next_event_pdf * c.cameras as f32 / c.area;
            // NaN only where the light grazes the surface
            (light_density, if others.is_nan() { f32::INFINITY } else { others })
        }
        Rivals::Later { light_choices, squeeze } => {
            let straight = photon.bounces == s.light.photons.bounces(j - 1) + 1;
            let bridged = s.bridges.filter(|_| straight).map_or(0.0, |b| {
                let [x, y] = [j, j - 1].map(|j| s.light.arrivals.get(j));
                b.others[j - 1].chance * Bridges::density(s, &x, c, &y, s.cluster_of(i - 1))
            });
            (light_choices * squeeze * w.densities[i - 1].light, camera + bridged)
        }
    };
    // with no photon to compare with, the camera has it all; with no camera path either, this one has
    if own + others > 0.0 { own / (own + others) } else { 1.0 }
}

/// Flux over area of a photon, times its weight.
pub(super) fn photon_value(s: Sampled, w: &Weights, j: usize) -> Vec3 {
    let c = s.cluster_of(s.camera.arrivals.len() + j);
    s.light.photons.flux(j) * (photon_weight(s, w, j) * c.inverse_area)
}

/// What every photon brings to its cluster; nothing where no camera path arrives.
pub(super) fn photon_values(s: Sampled, w: &Weights) -> Vec<SharedExponent> {
    let n = s.light.arrivals.len();
    let one = |j: usize| match s.cluster_of(s.camera.arrivals.len() + j).cameras {
        0 => SharedExponent::default(),
        _ => SharedExponent::encode(photon_value(s, w, j)),
    };
    (0..n).into_par_iter().with_min_len(GRAIN).map(one).collect()
}

/// What the photons of a diffuse cluster have in common.
#[derive(Clone, Copy, Default)]
struct Shared {
    /// What arrives.
    arriving: Vec3,
    /// The mean `q` of a photon's path there, as much as each brings: exact to first order.
    own: f32,
    /// The mean of what is left without it, likewise.
    others: Others,
}

/// The segment that arrives at a camera arrival, as the light reflected there sees it.
struct Approach {
    densities: Densities,
    throughput: Vec3,
    /// Whether it is a primary segment, whose rivals are the photons that are connected to the lens.
    is_primary: bool,
}

impl Approach {
    fn new(s: Sampled, w: &Weights, i: usize, c: &Cluster) -> Option<Self> {
        if let Some(b) = i.checked_sub(1).filter(|&b| has_end(s, b)) {
            let throughput = s.camera.outgoing.throughput(b);
            return Some(Self { densities: Densities::of(s, w, b), throughput, is_primary: false });
        }
        let seen = s.bridges?.seen[i];
        let densities = Densities { camera: seen, bridge: 1.0 / c.area, ..Densities::default() };
        (seen > 0.0).then_some(Self { densities, throughput: Vec3::splat(seen), is_primary: true })
    }

    /// Factor on light, if the other techniques have these.
    fn carry(&self, p_light: f32, others: Others) -> Vec3 {
        let chance = if self.is_primary { others.number } else { others.chance };
        self.throughput * reciprocal(self.densities.all(p_light, chance))
    }
}

/// Light of the photons in every camera arrival's cluster, and of the bridges that leave it, that has been scattered as
/// many times as `wanted`: what the segment that arrived there brings of it, each photon's part over the density of
/// all techniques but that photon, `R_p / D_R^-`. Where a primary segment arrived and no technique but the camera's could
/// have made it, what the arrival reflects.
pub(super) fn gather_photons(
    s: Sampled,
    w: &Weights,
    values: &[SharedExponent],
    cut: &Cut,
    wanted: impl Fn(u32) -> bool + Sync,
) -> Vec<SharedExponent> {
    let light = |j: usize| match wanted(s.light.photons.bounces(j)) {
        true => values[j].decode(),
        false => Vec3::ZERO,
    };
    let others = |j: usize| s.bridges.map_or_else(Others::default, |b| b.others[j]);
    let bridged = |i: usize| match s.bridges {
        Some(b) if wanted(b.segments[i].bounces) => w.bridged[s.clusters.place(i) as usize],
        _ => Vec3::ZERO,
    };
    let shared = per_diffuse_cluster(s, cut, |c| {
        if c.cameras == 0 || c.lights == 0 {
            return Shared::default();
        }
        let (mut arriving, mut left_out) = (DVec3::ZERO, DVec3::ZERO);
        for (j, own) in s.lights(c).zip(s.path_survivals(c)) {
            let value = (light(j) * s.light.arrivals.back_pdf(j)).as_dvec3();
            let Others { chance, number } = others(j);
            arriving += value;
            left_out += value.element_sum() * Vec3::new(own, chance, number).as_dvec3();
        }
        let total = arriving.element_sum();
        let [own, chance, number] =
            if total > 0.0 { (left_out / total).as_vec3().to_array() } else { [0.0; 3] };
        Shared { arriving: arriving.as_vec3(), own, others: Others { chance, number } }
    });
    let bridged_light = s.bridges.map(|b| {
        per_diffuse_cluster(s, cut, |c| {
            let leaving = s.cameras(c).map(|i| (bridged(i) * b.segments[i].pdf).as_dvec3());
            leaving.sum::<DVec3>().as_vec3()
        })
    });
    per_arrival(s, cut, |i, k, c| {
        if c.lights == 0 && s.bridges.is_none() {
            return SharedExponent::default();
        }
        let p_light = w.densities[i].light;
        let approach = Approach::new(s, w, i, c);
        // factor on light of a photon whose path's part of `P_light` is `own`
        let carry = |own: f32, others: Others| match &approach {
            Some(a) => a.carry(p_light - own / c.area, others),
            None => Vec3::ONE,
        };
        let mut sum = Vec3::ZERO;
        let mut over_bridges = Vec3::ZERO;
        match c.class {
            SurfaceClass::Diffuse => {
                let Shared { arriving, own, others } = shared[k];
                let arrivals = &s.camera.arrivals;
                let reflectance = arrivals.reflectance(i);
                sum = carry(own * arrivals.back_pdf(i), others) * reflectance * arriving;
                if let Some(light) = &bridged_light {
                    over_bridges = reflectance * light[k];
                }
            }
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let row = s.row(i, c);
                let f = &w.row(k, row)[c.cameras as usize..];
                for ((f, own), j) in f.iter().zip(w.own(k, row)).zip(s.lights(c)) {
                    sum += carry(*own, others(j)) * f.decode() * light(j);
                }
                if s.bridges.is_some() {
                    let f = f[c.lights as usize..].iter();
                    over_bridges = f.zip(s.cameras(c)).map(|(f, i)| f.decode() * bridged(i)).sum();
                }
            }
        }
        if let Some(bridges) = s.bridges {
            let all = Others { chance: bridges.chances[k], number: c.lights as f32 };
            sum += carry(0.0, all) * over_bridges;
        }
        SharedExponent::encode(sum)
    })
}

/// What arrival `i` reflects along its primary segment of the light that it carries and of its photons.
pub(super) fn towards_camera(s: Sampled, i: usize, carried: Vec3, photons: Vec3) -> Vec3 {
    match s.bridges {
        Some(b) if b.seen[i] > 0.0 => {
            let c = s.cluster_of(i);
            carried * (b.seen[i] / (b.seen[i] + c.lights as f32 / c.area)) + photons
        }
        _ => carried + photons,
    }
}
