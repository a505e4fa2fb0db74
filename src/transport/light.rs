//! Sequential sampling from the lights. They emit basic radiance: a lamp inside of glass is as bright as one outside.

use super::Estimator;
use super::arrival::arrival;
use super::store::{LightStart, LightStore, Photon, Rivals};
use super::walk::{Chain, End, Follow, Nobody};
use crate::math::Sampler;
use crate::shading::bsdf::Walk;
use crate::shading::emitters::EmissionGuide;
use crate::shading::{LightRay, Piece, SourceDensity, SurfaceClass, World};
use glam::Vec3;

/// Samples light paths.
pub struct LightSampler<'a> {
    /// The scene.
    pub world: &'a World,
    /// Where light paths should begin.
    pub guide: &'a EmissionGuide,
    /// Light paths of this iteration.
    pub paths: f32,
    /// Whether camera arrivals sample next-event segments.
    pub next_event: bool,
    /// What the arrivals are stored for.
    pub estimator: Estimator,
}

impl LightSampler<'_> {
    /// Samples path number `path` into the store. Adds the rays it takes to `rays`.
    pub fn path(&self, path: u32, sampler: &mut Sampler, store: &mut LightStore, rays: &mut u64) {
        let Some(ray) = self.world.sample_emission(self.guide, sampler) else { return };
        let follow = Follow { world: self.world, walk: Walk::Light, from_camera: false };
        let (chain, end) = follow.segment(ray.piece, sampler, &mut Nobody, rays);
        let Some(mut end) = end else { return };
        let mut flux = ray.flux / self.paths * chain.flux_factor();
        let mut rivals = self.first(&ray, &chain, &end);
        let mut camera_choices = chain.reverse;
        let mut bounces = chain.passages;
        let mut carried = chain.throughput;
        let start = LightStart { draw: ray.draw, first: store.arrivals.len() as u32 };
        if flux.is_finite() && flux.max_element() > 0.0 {
            store.starts.push(start);
        }
        while flux.is_finite() && flux.max_element() > 0.0 {
            let sight = end.sight();
            let mut arrived = arrival(self.world, &end, sight.as_ref());
            let u = sampler.next_3d();
            let goes_on = sampler.next_1d() < arrived.survival;
            let sample = if goes_on { sight.and_then(|s| s.sample(Walk::Light, u)) } else { None };
            arrived.goes_on = sample.is_some();
            store.arrivals.push(arrived);
            if self.estimator == Estimator::Literal {
                store.carries.push(carried);
            }
            let (direction, pdf) = sample.map_or((Vec3::ZERO, 0.0), |s| (s.direction, s.pdf.value()));
            // the camera segment that gathers it is as opaque at its end
            let flux_there = flux / end.opacity;
            let photon = Photon { path, flux: flux_there, bounces, rivals, camera_choices, direction, pdf };
            store.photons.push(photon);
            let Some(sample) = sample else { return };
            let value = match arrived.class {
                SurfaceClass::Diffuse => sample.value,
                // layers depend on the side of the camera, which is known only now
                _ => self.world.bsdf(&end.hit, direction).eval(direction, end.wo),
            };
            flux *= value / (pdf * arrived.survival);
            let camera_end = end.probability_from(self.world, direction);
            let piece = Piece::leaving(&end.hit, direction);
            let (chain, next) = follow.segment(piece, sampler, &mut Nobody, rays);
            let Some(next) = next else { return };
            flux *= chain.flux_factor();
            rivals = Rivals::Later { light_choices: chain.forward, squeeze: 1.0 / chain.squeeze };
            camera_choices = chain.reverse * camera_end;
            carried = chain.throughput;
            bounces += 1 + chain.passages;
            end = next;
        }
    }

    /// The rivals of a path's first segment.
    fn first(&self, ray: &LightRay, chain: &Chain, end: &End) -> Rivals {
        let unbroken = chain.passages == 0;
        let cos = end.hit.place.normal.dot(end.wo).abs();
        let next_event_pdf = || {
            if !self.next_event {
                return 0.0;
            }
            let receiver = end.hit.receiver(&end.vertex.bsdf, end.wo);
            self.world.pdf_of_sampling_ray(&receiver, ray)
        };
        let across = match ray.density {
            SourceDensity::Extended(pdf) => {
                return Rivals::First {
                    light_density: self.paths * pdf.0 * chain.forward / chain.squeeze,
                    next_event_pdf: if unbroken { next_event_pdf() / cos } else { 0.0 },
                    is_delta: false,
                };
            }
            // through a chain nothing else finds the light of a point: any density will do
            _ if !unbroken => {
                return Rivals::First { light_density: 1.0, next_event_pdf: 0.0, is_delta: true };
            }
            SourceDensity::Point(pdf) => pdf.to_area(end.hit.place.position.distance(ray.origin()), 1.0).0,
            SourceDensity::Beam(pdf) => pdf.0,
        };
        Rivals::First {
            light_density: self.paths * across * chain.forward * cos,
            next_event_pdf: next_event_pdf(),
            is_delta: true,
        }
    }
}
