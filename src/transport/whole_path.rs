//! The estimator without recursion (S16, S17): paths of segments are formed one by one and weighed as a whole. It is a
//! check of the recursion, which weighs segment by segment (S20, S22).
//!
//! A path is a chain of segments `s_1 .. s_k` whose ends share clusters: `s_i` ends and `s_{i+1}` begins in `C_i`. In
//! the space of such chains, étendue for every segment, each `C_i` contributes `f / A_i` to the integrand, whoever made
//! the path. Of the techniques
//!
//! - *join at `m`*, `1 <= m < k`, forms a path of every pair of a camera sub-path `s_1 .. s_m` and a light sub-path
//!   `s_k .. s_{m+1}` whose arrivals meet in `C_m`;
//! - *hit* takes a camera sub-path of all `k` segments, which met a light;
//! - *next event* takes one of `k - 1` segments and the next-event segment of its arrival.
//!
//! The two sub-paths of a pair are independent, so the numbers of paths that the techniques make there, on average, are
//!
//! ```text
//! D_m    = rho(s_1)  a_2 .. a_m      b_{m+1} .. b_{k-1}  e      a_i = c P_cam(s_i)   / (n_cam(C_{i-1}) A_{i-1})
//! D_hit  = rho(s_1)  a_2 .. a_k                                 b_i = c P_light(s_i) / (n_light(C_i) A_i n_rel²)
//! D_next = rho(s_1)  a_2 .. a_{k-1}  p_nee / A_{k-1}            e   = c n_L p_A p⊥ / n_rel²
//! ```
//!
//! `P` are the sums of the conditional densities over the arrivals of a cluster ([`super::weigh`]) and `n` the numbers of
//! these. A product of such means is what S17 averages, over all sequences of arrivals from which the chain could have
//! gone on. A sample counts `D f / A .. / p sum(D)`, with `p` of its own sub-paths: their throughputs, its weight, and
//! for a pair the kernel `1 / A_m`. Two recurrences along the sub-paths collect the sum over `D_m`:
//!
//! ```text
//! near_i = sum over m <= i of D_m / D_i  = 1 + b_i / a_i near_{i-1}                   near_1 = 1
//! rest_i = sum over all later ones / D_i = a_{i+1} / b_{i+1} (1 + rest_{i+1})         rest_{k-1} = (a_k + p_nee / A) / e
//! ```
//!
//! so that a pair's weight is `1 / (near_m + rest_m)`.
//!
//! **The path counts itself once.** These means are random, and a weight is right only if it is the same function of the
//! path and of *other* sub-paths whichever technique made the path; else what is made where neighbours are many or few is
//! weighed by just that. A camera sub-path has an arrival in `C_1 .. C_m`, a light sub-path in `C_m .. C_{k-1}`. So where
//! the path has no arrival from one side, the one that it would have from there is added to the mean: its own
//! conditional density, and one to the number. Means are then never empty, either. What remains is that a sub-path may
//! come to a cluster of its path once more by chance; that changes a mean, not a sum, and only where lobes differ in a cluster.

use super::Cut;
use super::arrival::{early_survival, reversed};
use super::camera::EARLY;
use super::exchange::{Densities, Segments, has_end, reciprocal};
use super::propagate::Reflected;
use super::store::{EmissionHit, NextEvent, Rivals};
use super::weigh::{Sampled, Weights};
use crate::math::SharedExponent;
use crate::shading::SurfaceClass;
use glam::Vec3;
use rayon::prelude::*;

// a photon that is joined at the first arrival has at most the next one's survival yet to be told from later ones
const _: () = assert!(EARLY == 2);

/// A camera sub-path up to one of its arrivals.
#[derive(Clone, Copy, Debug)]
struct Prefix {
    /// Factor on basic radiance that is reflected at the arrival.
    throughput: Vec3,
    /// Times that such light has been scattered on its way to the camera.
    bounces: u32,
    /// Whether it is the path's first.
    is_first: bool,
    /// Factor on the mean of `P_light` that makes it the density of joins before the arrival over that of one there.
    back: f32,
}

/// Of a photon: density of all techniques that follow the path further towards the light, over that of joining there.
#[derive(Clone, Copy, Debug, Default)]
struct Rest {
    /// Joined at the first arrival of a camera path.
    at_first: f32,
    /// At a later one.
    at_later: f32,
}

/// One step of `rest`, `a / b`, by what arrival the camera's path has, or would have, in the photon's cluster.
#[derive(Clone, Copy, Debug, Default)]
struct Step {
    joined: f32,
    early: f32,
    late: f32,
}

/// All that stays the same from path to path.
struct WholePaths<'a> {
    s: Sampled<'a>,
    w: &'a Weights,
    rests: Vec<Rest>,
}

impl Reflected {
    /// As [`Reflected::solve_limited`], by whole paths, for the first arrivals alone: what only their own paths find,
    /// with photons from their clusters.
    pub fn solve_whole_paths(
        &mut self,
        s: Sampled,
        w: &Weights,
        first: &[(u32, u32)],
        bounces: Option<u32>,
        cut: &Cut,
    ) -> bool {
        self.segments = Segments::new(s, w);
        let paths = WholePaths { s, w, rests: rests(s, w) };
        let most = bounces.unwrap_or(u32::MAX);
        let one = |&(start, passages): &(u32, u32)| match cut.is_raised() {
            true => (Vec3::ZERO, Vec3::ZERO),
            false => paths.light(start as usize, passages, most),
        };
        let light: Vec<(Vec3, Vec3)> = first.par_iter().map(one).collect();
        let n = s.camera.arrivals.len();
        let nothing = || vec![SharedExponent::default(); n];
        (self.carried, self.photons, self.direct) = (nothing(), nothing(), nothing());
        for (&(arrival, _), (all, direct)) in first.iter().zip(light) {
            self.carried[arrival as usize] = SharedExponent::encode(all);
            self.direct[arrival as usize] = SharedExponent::encode(direct);
        }
        !cut.is_raised()
    }
}

/// A mean; zero of nothing.
fn mean(sum: f32, count: u32) -> f32 {
    if count > 0 { sum / count as f32 } else { 0.0 }
}

/// `rest` of all photons, by index.
fn rests(s: Sampled, w: &Weights) -> Vec<Rest> {
    let steps: Vec<Step> = (0..s.light.photons.len()).into_par_iter().map(|j| step(s, w, j)).collect();
    let mut before = Step::default();
    let along_paths = steps.iter().zip(s.light.photons.iter()).map(|(step, photon)| {
        if let Rivals::First { .. } = photon.rivals {
            before = Step::default();
        }
        let rest = Rest {
            at_first: step.joined * (1.0 + before.early),
            at_later: step.joined * (1.0 + before.late),
        };
        let later = 1.0 + before.late;
        before = Step { joined: 0.0, early: step.early * later, late: step.late * later };
        rest
    });
    along_paths.collect()
}

fn step(s: Sampled, w: &Weights, j: usize) -> Step {
    let i = s.camera.arrivals.len() + j;
    let (here, photon, a) = (s.cluster_of(i), s.light.photons.get(j), s.light.arrivals.get(j));
    let p_camera = w.densities[i].camera * here.area;
    let (met, next_event, own) = match photon.rivals {
        Rivals::First { light_density, next_event_pdf, is_delta } => {
            let met = if is_delta { 0.0 } else { photon.camera_choices };
            (met, next_event_pdf, light_density)
        }
        Rivals::Later { light_choices, squeeze } => {
            let p_light = w.densities[i - 1].light;
            let own = light_choices * squeeze * mean(p_light, s.cluster_of(i - 1).lights);
            (photon.camera_choices, 0.0, own)
        }
    };
    let ratio = |p: f32| {
        let others = (met * p + next_event) / here.area;
        // NaN only where the light grazes the surface
        if others.is_nan() { f32::INFINITY } else { others * reciprocal(own) }
    };
    let joined = ratio(mean(p_camera, here.cameras));
    if !a.goes_on {
        return Step { joined, ..Step::default() };
    }
    let (q, pdf) = reversed(s.world, &a, photon.direction);
    let with = |q: f32| ratio(mean(p_camera + q * pdf, here.cameras + 1));
    Step { joined, early: with(early_survival(q)), late: with(q) }
}

impl WholePaths<'_> {
    /// What the first arrival of a path reflects of all light of at most so many bounces, and of light that bounces
    /// once. `passages`: Dirac lobes before that arrival, fewer than `most`.
    fn light(&self, start: usize, passages: u32, most: u32) -> (Vec3, Vec3) {
        let s = self.s;
        let (mut all, mut direct) = (Vec3::ZERO, Vec3::ZERO);
        let mut add = |bounces: u32, light: Vec3| {
            if bounces <= most {
                all += light;
            }
            if bounces == 1 {
                direct += light;
            }
        };
        let mut at = Prefix { throughput: Vec3::ONE, bounces: passages, is_first: true, back: 0.0 };
        let mut i = start;
        while at.bounces < most {
            let bounces = at.bounces + 1;
            add(bounces, at.throughput * self.next_event(i, &at));
            self.join(i, &at, |j, light| add(bounces + s.light.photons.bounces(j), at.throughput * light));
            if !s.camera.arrivals.goes_on(i) {
                break;
            }
            let near = self.near(i, &at, s.camera.outgoing.direction(i));
            for hit in self.hits(i) {
                add(bounces + hit.passages, at.throughput * self.hit(&hit, near));
            }
            if !has_end(s, i) {
                break;
            }
            at = self.beyond(i, &at, near);
            i += 1;
        }
        (all, direct)
    }

    /// `near` at an arrival of a path that goes on towards `to`, where no photon is joined.
    fn near(&self, i: usize, at: &Prefix, to: Vec3) -> f32 {
        if at.back == 0.0 {
            return 1.0;
        }
        let (q, pdf) = reversed(self.s.world, &self.s.camera.arrivals.get(i), to);
        let c = self.s.cluster_of(i);
        1.0 + at.back * mean(self.w.densities[i].light + q * pdf / c.area, c.lights + 1)
    }

    /// Light of the arrival's next-event segment, reflected there and weighed.
    fn next_event(&self, i: usize, at: &Prefix) -> Vec3 {
        let Some(n) = self.s.camera.next_events.get(i) else { return Vec3::ZERO };
        let value = self.w.towards_lights[self.s.clusters.place(i) as usize].value;
        value * n.light * (self.next_event_weight(i, &n, at) / n.next_event_pdf)
    }

    fn next_event_weight(&self, i: usize, n: &NextEvent, at: &Prefix) -> f32 {
        let c = self.s.cluster_of(i);
        let p_camera = self.w.towards_lights[self.s.clusters.place(i) as usize].camera;
        let met = if n.is_delta { 0.0 } else { mean(p_camera, c.cameras) };
        let joins = n.light_density * self.near(i, at, n.direction);
        let own = n.next_event_pdf / c.area;
        own * reciprocal(own + met / c.area + joins)
    }

    /// The light that the segment which leaves an arrival met.
    fn hits(&self, i: usize) -> impl Iterator<Item = EmissionHit> {
        self.s.camera.hits.of(i)
    }

    /// The same, reflected at the arrival and weighed.
    fn hit(&self, hit: &EmissionHit, near: f32) -> Vec3 {
        let i = hit.arrival as usize;
        let density = hit.forward * self.s.camera.arrivals.survival(i) * self.s.camera.outgoing.get(i).pdf;
        self.value_leaving(i) * hit.light * (self.hit_weight(hit, near) * reciprocal(density))
    }

    fn hit_weight(&self, hit: &EmissionHit, near: f32) -> f32 {
        let i = hit.arrival as usize;
        let c = self.s.cluster_of(i);
        let own = hit.forward * mean(self.w.densities[i].camera, c.cameras);
        own * reciprocal(own + hit.next_event_pdf / c.area + hit.light_density * near)
    }

    /// Every photon of the arrival's cluster, and the light of its path: reflected at the arrival and weighed.
    fn join(&self, i: usize, at: &Prefix, mut found: impl FnMut(usize, Vec3)) {
        let (s, w) = (self.s, self.w);
        let c = s.cluster_of(i);
        if c.lights == 0 {
            return;
        }
        let near = self.joined_near(i, at);
        let scale = c.inverse_area;
        let mut photon = |j: usize, value: Vec3| {
            found(j, value * s.light.photons.flux(j) * (self.join_weight(j, at, near) * scale));
        };
        match c.class {
            SurfaceClass::Diffuse => {
                let reflectance = s.camera.arrivals.reflectance(i);
                s.lights(c).for_each(|j| photon(j, reflectance * s.light.arrivals.back_pdf(j)));
            }
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let row = s.row(i, c);
                let values = &w.row(s.clusters.of(i), row)[c.cameras as usize..];
                s.lights(c).zip(values).for_each(|(j, value)| photon(j, value.decode()));
            }
        }
    }

    /// `near` at an arrival where a photon is joined: the light's path has its own arrival in the cluster.
    fn joined_near(&self, i: usize, at: &Prefix) -> f32 {
        1.0 + at.back * mean(self.w.densities[i].light, self.s.cluster_of(i).lights)
    }

    fn join_weight(&self, j: usize, at: &Prefix, near: f32) -> f32 {
        let rest = self.rests[j];
        reciprocal(near + if at.is_first { rest.at_first } else { rest.at_later })
    }

    /// The sub-path up to the arrival after `i`.
    fn beyond(&self, i: usize, at: &Prefix, near: f32) -> Prefix {
        let (a, out) = (self.s.camera.arrivals.get(i), self.s.camera.outgoing.get(i));
        let densities = Densities::of(self.s, self.w, i);
        let a_next = densities.camera / self.s.cluster_of(i).cameras as f32;
        let density = a.survival * out.pdf * out.forward;
        Prefix {
            throughput: at.throughput * self.value_leaving(i) * out.throughput * reciprocal(density),
            bounces: at.bounces + 1 + out.passages,
            is_first: false,
            back: densities.light * reciprocal(a_next) * near,
        }
    }

    /// Value of an arrival's lobes for the segment that leaves it.
    fn value_leaving(&self, i: usize) -> Vec3 {
        let (s, cluster) = (self.s, self.s.clusters.of(i));
        let c = &s.clusters.clusters[cluster];
        match c.class {
            SurfaceClass::Diffuse => s.camera.arrivals.reflectance(i) * s.camera.outgoing.get(i).pdf,
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
                let row = s.row(i, c);
                self.w.row(cluster, row)[row].decode()
            }
        }
    }
}

#[cfg(test)]
mod tests;
