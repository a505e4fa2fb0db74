//! Bridge segments: from every camera arrival to one light arrival (S6), and from light arrivals to the lens (S7).
//!
//! A bridge from cluster `C_x` to cluster `C_y` could have begun at any camera arrival of the one and ended at any
//! light arrival of the other, so per étendue its density is
//!
//! `B = n_C(C_x) chance(C_y) / (A_x A_y G)`, `G = cos_x cos_y / d^2`,
//!
//! where `chance` is the sum of the probabilities with which the cluster's light arrivals are chosen. It carries the
//! flux of the light path on which it ends, as a light segment does, and leaves that path out of its densities.
//! Seen straight, a light arrival is a pixel's, too: it is weighed beside the primary segments that gather it.

use super::Cut;
use super::cluster::Cluster;
use super::exchange::{per_index, reciprocal};
use super::store::Arrival;
use super::weigh::Sampled;
use crate::film::{Filter, Rect, Splat, is_wanted};
use crate::math::distribution::AliasTable;
use crate::math::{Sampler, luminance};
use crate::shading::bsdf::Bsdf;
use crate::shading::{Sensor, SurfaceClass, SurfacePoint};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// How a bridge's light arrival is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// All alike, as in the paper.
    Uniform,
    /// In proportion to the flux that they carry.
    ByPower,
}

/// The bridge that leaves a camera arrival.
#[derive(Clone, Copy, Debug, Default)]
pub struct Bridge {
    /// Direction in which it leaves.
    pub direction: Vec3,
    /// Density with which the arrival's own lobes draw that direction.
    pub pdf: f32,
    /// Irradiance of a surface there, over the probability of the choice; zero where nothing arrives.
    pub irradiance: Vec3,
    /// `c` of the camera's walk along it.
    pub camera_choices: f32,
    /// Density of the light's walk along it, without the path that it ends on.
    pub light_density: f32,
    /// `chance / (A_y G)`, without that path.
    pub density: f32,
    /// Times that its light has been scattered before it arrives.
    pub bounces: u32,
}

impl Bridge {
    /// Irradiance times its weight, shared among the arrivals of its cluster; `p_cam`: density of the camera's segments
    /// along it.
    pub fn value(&self, p_cam: f32, c: &Cluster) -> Vec3 {
        let own = self.density * c.cameras as f32 / c.area;
        let others = self.camera_choices * p_cam / c.area + self.light_density;
        self.irradiance * (own * reciprocal(own + others) / c.cameras as f32)
    }
}

/// What is left of a light arrival's cluster without its path.
#[derive(Clone, Copy, Debug, Default)]
pub struct Others {
    /// Chance that a bridge chooses one of them.
    pub chance: f32,
    /// Their number: every one of them is connected to the lens.
    pub number: f32,
}

/// The bridges of an iteration.
#[derive(Debug, Default)]
pub struct Bridges {
    /// One for every camera arrival.
    pub segments: Vec<Bridge>,
    /// For every cluster, the chance that a bridge ends there.
    pub chances: Vec<f32>,
    /// For every light arrival.
    pub others: Vec<Others>,
    /// For every camera arrival that is seen straight, the density per area with which primary segments arrive, times
    /// `c`; zero for others.
    pub seen: Vec<f32>,
    /// Light that arrivals send to the lens.
    pub splats: Vec<Splat>,
}

/// What bridges are sampled with.
pub struct BridgeSampler<'a> {
    /// The segments that they join, clustered.
    pub sampled: Sampled<'a>,
    /// The camera.
    pub sensor: &'a Sensor,
    /// How light arrivals are chosen.
    pub choice: Choice,
    /// Seed of their random numbers.
    pub seed: u32,
    /// The iteration.
    pub index: u32,
    /// Pixel filter.
    pub filter: &'a Filter,
    /// Rendered part of the full film.
    pub crop: Rect,
    /// Most bounces of light that is sent to the lens.
    pub max_depth: Option<u32>,
}

/// An end of a bridge.
struct Pier {
    hit: SurfacePoint,
    bsdf: Bsdf,
}

impl Pier {
    fn new(s: Sampled, a: &Arrival) -> Self {
        let hit = a.surface(s.world);
        Self { bsdf: s.world.bsdf(&hit, a.wo), hit }
    }

    fn cos(&self, w: Vec3) -> f32 {
        self.hit.place.normal.dot(w).abs()
    }

    /// Value of a light walk from `wo` to `w`. Layers depend on the side of the camera.
    fn value(&self, s: Sampled, a: &Arrival, w: Vec3) -> Vec3 {
        match a.class {
            SurfaceClass::Diffuse => self.bsdf.eval(w, a.wo),
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => s.world.bsdf(&self.hit, w).eval(w, a.wo),
        }
    }
}

impl Bridges {
    /// Samples the bridges of an iteration. `seen` as in [`Bridges::seen`]. Adds the rays it takes to `rays`. Returns
    /// `false` if it was stopped.
    pub fn sample(&mut self, sampler: &BridgeSampler, seen: Vec<f32>, rays: &mut u64, cut: &Cut) -> bool {
        let s = sampler.sampled;
        self.seen = seen;
        let table = AliasTable::new(s.light.photons.iter().map(|p| match sampler.choice {
            Choice::Uniform => 1.0,
            Choice::ByPower => f64::from(luminance(p.flux)),
        }));
        let chance = |j: usize| table.as_ref().map_or(0.0, |t| t.probability(j));
        let clusters = &s.clusters.clusters;
        self.chances = clusters.par_iter().map(|c| s.lights(c).map(chance).sum()).collect();
        self.others = vec![Others::default(); s.light.arrivals.len()];
        for c in clusters.iter().filter(|c| c.lights > 0) {
            let left = |value: &dyn Fn(usize) -> f32| {
                let mut own: Vec<f32> = s.lights(c).map(value).collect();
                let all: f32 = own.iter().sum();
                s.sum_over_paths(c, &mut own);
                own.into_iter().map(move |o| (all - o).max(0.0))
            };
            for ((j, chance), number) in s.lights(c).zip(left(&chance)).zip(left(&|_| 1.0)) {
                self.others[j] = Others { chance, number };
            }
        }
        let segments = per_index(s, |i| match &table {
            Some(table) if !cut.is_raised() => {
                let mut random = Sampler::new(sampler.seed, i as u32, sampler.index);
                let (j, probability, _) = table.sample(random.next_1d());
                let mut rays = 0;
                let bridge = self.between(sampler, i, j, probability, &mut rays);
                (bridge.unwrap_or_default(), rays)
            }
            _ => Default::default(),
        });
        *rays += segments.iter().map(|s| s.1).sum::<u64>();
        self.segments = segments.into_iter().map(|s| s.0).collect();
        let photons = (0..s.light.photons.len()).into_par_iter();
        let splats: Vec<(Option<Splat>, u64)> = photons
            .map(|j| {
                let mut rays = 0;
                let splat = if cut.is_raised() { None } else { self.to_lens(sampler, j, &mut rays) };
                (splat, rays)
            })
            .collect();
        *rays += splats.iter().map(|s| s.1).sum::<u64>();
        self.splats = splats.into_iter().filter_map(|s| s.0).collect();
        !cut.is_raised()
    }

    /// The bridge from camera arrival `i` to light arrival `j`, if light comes along it.
    fn between(
        &self,
        b: &BridgeSampler,
        i: usize,
        j: usize,
        probability: f32,
        rays: &mut u64,
    ) -> Option<Bridge> {
        let s = b.sampled;
        let (a, l, photon) = (s.camera.arrivals.get(i), s.light.arrivals.get(j), s.light.photons.get(j));
        let (here, there) = (Pier::new(s, &a), Pier::new(s, &l));
        let way = l.position - a.position;
        let square = way.length_squared();
        let direction = way / square.sqrt();
        let g = here.cos(direction) * there.cos(direction) / square;
        let pdf = here.bsdf.continuous_pdf(a.wo, direction).0;
        // others of its cluster may use what an arrival on this side of a surface that transmits cannot
        let is_shared = a.class == SurfaceClass::Transmitting;
        if !(g > 0.0 && g.is_finite()) || (pdf <= 0.0 && !is_shared) {
            return None;
        }
        let value = there.value(s, &l, -direction);
        if value == Vec3::ZERO {
            return None;
        }
        let visible = s.world.transmittance_between(&here.hit, &there.hit, rays);
        let flux = photon.flux * s.world.opacity(&there.hit);
        let irradiance = flux * value * visible * (g / probability);
        if visible == Vec3::ZERO || !irradiance.is_finite() {
            return None;
        }
        let end = s.cluster_of(s.camera.arrivals.len() + j);
        let onward = match end.class {
            SurfaceClass::Diffuse => {
                let q = s.lights(end).map(|t| s.light.arrivals.survival(t)).sum::<f32>();
                let own = s.lights(end).filter(|t| s.light.photons.path(*t) == photon.path);
                let own = own.map(|t| s.light.arrivals.survival(t)).sum::<f32>();
                (q - own).max(0.0) * there.bsdf.continuous_pdf(l.wo, -direction).0
            }
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => s
                .lights(end)
                .filter(|t| s.light.photons.path(*t) != photon.path)
                .map(|t| {
                    let other = s.light.arrivals.get(t);
                    other.survival * other.bsdf(s.world).continuous_pdf(other.wo, -direction).0
                })
                .sum(),
        };
        Some(Bridge {
            direction,
            pdf,
            irradiance,
            camera_choices: s.world.end_probability(&there.hit, &there.bsdf, -direction),
            light_density: s.world.end_probability(&here.hit, &here.bsdf, direction) * onward / end.area,
            density: self.others[j].chance / (end.area * g),
            bounces: photon.bounces + 1,
        })
    }

    /// What light arrival `j` sends to the lens beside the primary segments that gather it.
    fn to_lens(&self, b: &BridgeSampler, j: usize, rays: &mut u64) -> Option<Splat> {
        let s = b.sampled;
        let (l, photon) = (s.light.arrivals.get(j), s.light.photons.get(j));
        let bounces = photon.bounces + 1;
        if b.max_depth.is_some_and(|most| bounces > most) {
            return None;
        }
        let lens = match s.world.needs().depth_of_field {
            true => Sampler::new(!b.seed, j as u32, b.index).next_2d(),
            false => Vec2::ZERO,
        };
        let view = b.sensor.view(l.position, lens).filter(|v| is_wanted(v.film, b.filter, b.crop))?;
        let pier = Pier::new(s, &l);
        let value = pier.value(s, &l, view.direction);
        if value == Vec3::ZERO {
            return None;
        }
        let visible = s.world.transmittance_to_camera(&pier.hit, view.end, rays);
        let ends = s.world.end_probability(&pier.hit, &pier.bsdf, view.direction);
        let seen = view.density * pier.cos(view.direction);
        let own = self.others[j].number / s.cluster_of(s.camera.arrivals.len() + j).area;
        let weight = own * reciprocal(own + ends * seen);
        let light = photon.flux * s.world.opacity(&pier.hit) * value * visible * (seen * weight);
        let counts = light.is_finite() && light != Vec3::ZERO;
        counts.then_some(Splat { film: view.film, light, bounces })
    }

    /// Density of bridges along the segment from arrival `x` to `y` of cluster `end`, for a chance of one.
    pub fn density(s: Sampled, x: &Arrival, here: &Cluster, y: &Arrival, end: &Cluster) -> f32 {
        let way = y.position - x.position;
        let square = way.length_squared();
        let direction = way / square.sqrt();
        let cos = |a: &Arrival| a.surface(s.world).place.normal.dot(direction).abs();
        let g = cos(x) * cos(y) / square;
        let density = here.cameras as f32 / (here.area * end.area * g);
        // segments that graze a surface are left to those who walk
        if density.is_finite() { density } else { 0.0 }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.segments.capacity() * size_of::<Bridge>()
            + (self.chances.capacity() + self.seen.capacity()) * size_of::<f32>()
            + self.others.capacity() * size_of::<Others>()
            + self.splats.capacity() * size_of::<Splat>()
    }
}
