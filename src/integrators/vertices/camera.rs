//! Camera paths: what they see, and what their vertices gather by connection and by merging.

use super::light::{LightStore, after};
use super::merge::{PhotonMap, is_same_surface};
use super::mis::{self, Sum, Turn};
use super::vertex::{LightVertex, Rules, Vertex, survival_at};
use crate::film::Sample;
use crate::integrators::record;
use crate::math::Sampler;
use crate::shading::bsdf::Walk;
use crate::shading::emitters::{PLAIN, Receiver};
use crate::shading::{CameraRay, LightPoint, Piece, SurfacePoint, World};
use crate::shading::{Sensor, Vertex as Shading};
use crate::transport::walk::{Chain, End, Follow, Witness};
use glam::Vec3;

/// Samples camera paths beside the light paths of the same iteration.
pub struct CameraSampler<'a> {
    /// What is sampled.
    pub rules: Rules<'a>,
    /// Whether what lies behind everything is transparent.
    pub transparent_background: bool,
    /// The light paths.
    pub light: &'a LightStore,
    /// Their vertices by place.
    pub photons: &'a PhotonMap,
}

/// A camera path's end so far.
struct Tip {
    end: End,
    /// Factor on the basic radiance that is reflected there.
    weight: Vec3,
    /// Times that light which is emitted there will have been scattered.
    bounces: u32,
    survival: f32,
    sum: Sum,
}

impl CameraSampler<'_> {
    /// The sample that one path makes. `mate`: number of the light path it is connected with. Adds the rays it
    /// takes to `rays`.
    pub fn path(&self, ray: &CameraRay, sampler: &mut Sampler, mate: usize, rays: &mut u64) -> Sample {
        let rules = &self.rules;
        let mut sample = Sample { alpha: 1.0, ..Sample::default() };
        let follow = Follow { world: rules.world, walk: Walk::Camera, from_camera: true };
        let mut seeing = Seeing { camera: self, sample: &mut sample };
        let (chain, end) = follow.segment(Piece::from_camera(ray), sampler, &mut seeing, rays);
        let Some(end) = end.filter(|_| rules.merges || rules.connects) else { return sample };
        let follow = Follow { from_camera: false, ..follow };
        let mut tip = Tip {
            weight: chain.throughput / chain.forward,
            bounces: chain.passages,
            survival: survival_at(rules.world, &end),
            sum: self.first(ray, &chain, &end),
            end,
        };
        loop {
            if tip.bounces >= rules.max_depth {
                return sample;
            }
            let vertex = tip.vertex();
            if rules.connects {
                self.next_event(&tip, &vertex, sampler, &mut sample, rays);
                for light in self.light.path(mate) {
                    self.connect(&tip, &vertex, light, &mut sample, rays);
                }
            }
            if rules.merges {
                self.merge(&tip, &vertex, &mut sample);
            }
            if !rules.goes_on {
                return sample;
            }
            let u = sampler.next_3d();
            if sampler.next_1d() >= tip.survival {
                return sample;
            }
            let Some(s) = vertex.bsdf.sample_continuous(tip.end.wo, Walk::Camera, u) else { return sample };
            let left = vertex.leaving(rules, Walk::Camera, s.direction);
            let weight = tip.weight * s.value / (s.pdf.value() * tip.survival);
            let mut meeting = Meeting {
                rules,
                receiver: vertex.hit.receiver(vertex.bsdf, vertex.wo),
                cos: left.cos,
                turn: left.turn,
                weight,
                bounces: tip.bounces + 1,
                sample: &mut sample,
            };
            let piece = Piece::leaving(vertex.hit, s.direction);
            let (chain, end) = follow.segment(piece, sampler, &mut meeting, rays);
            let Some(end) = end else { return sample };
            tip = Tip {
                weight: weight * chain.throughput / chain.forward,
                bounces: tip.bounces + 1 + chain.passages,
                survival: survival_at(rules.world, &end),
                sum: after(rules, &left.turn, &chain, tip.end.hit.place.position, left.cos, &end),
                end,
            };
        }
    }

    /// The sum at a path's first vertex: the light paths that are connected to the lens.
    fn first(&self, ray: &CameraRay, chain: &Chain, end: &End) -> Sum {
        let rules = &self.rules;
        let place = &end.hit.place;
        let seen = (rules.connects && chain.passages == 0).then(|| {
            let cos = place.normal.dot(end.wo).abs();
            rules.sensor.density(ray, place.position) * cos
        });
        Sum::from_lens(chain, seen, rules.light_paths, rules.eta(place.position))
    }

    /// Light that reaches the vertex from a drawn point of a light.
    fn next_event(
        &self,
        tip: &Tip,
        vertex: &Vertex,
        sampler: &mut Sampler,
        sample: &mut Sample,
        rays: &mut u64,
    ) {
        let rules = &self.rules;
        let u = sampler.next_3d();
        let receiver = vertex.hit.receiver(vertex.bsdf, vertex.wo);
        let Some(light) = rules.world.sample_light(&receiver, u) else { return };
        let left = vertex.leaving(rules, Walk::Camera, light.direction);
        if left.value == Vec3::ZERO {
            return;
        }
        let visible = rules.world.transmittance(vertex.hit, &light, rays);
        if visible == Vec3::ZERO {
            return;
        }
        // per étendue; of a delta light, per area of this surface
        let (drawn, emitted) = match light.is_delta {
            true => (light.pdf, rules.world.emission_pdf_of_sample(&PLAIN, &light) * left.cos),
            false => (light.pdf / left.cos, rules.world.emission_pdf_of_sample(&PLAIN, &light)),
        };
        let weight = mis::next_event(&left.turn, drawn, emitted, light.is_delta);
        let arriving = light.radiance * visible * (left.cos * weight / light.pdf);
        record(sample, tip.bounces + 1, tip.weight * left.value * arriving);
    }

    /// Light that a vertex of a light path sends here.
    fn connect(&self, tip: &Tip, vertex: &Vertex, light: &LightVertex, sample: &mut Sample, rays: &mut u64) {
        let rules = &self.rules;
        let bounces = tip.bounces + light.bounces + 2;
        let way = light.position - vertex.hit.place.position;
        let square = way.length_squared();
        if bounces > rules.max_depth || square == 0.0 {
            return;
        }
        let direction = way / square.sqrt();
        let here = vertex.leaving(rules, Walk::Camera, direction);
        if here.value == Vec3::ZERO {
            return;
        }
        light.with(rules.world, |other| {
            let there = other.leaving(rules, Walk::Light, -direction);
            if there.value == Vec3::ZERO {
                return;
            }
            let visible = rules.world.transmittance_between(vertex.hit, other.hit, rays);
            if visible == Vec3::ZERO {
                return;
            }
            let g = here.cos * there.cos / square;
            let arriving = light.flux * there.value * visible;
            let weight = mis::connection(&there.turn, &here.turn, g);
            record(sample, bounces, tip.weight * here.value * arriving * (g * weight));
        });
    }

    /// Light that arrives nearby.
    fn merge(&self, tip: &Tip, vertex: &Vertex, sample: &mut Sample) {
        let rules = &self.rules;
        let place = vertex.hit.place.position;
        let eta = rules.eta(place);
        self.photons.for_each(rules, place, rules.radius(place), |i| {
            let light = &self.light.vertices[i];
            let bounces = tip.bounces + light.bounces + 1;
            if bounces > rules.max_depth || !is_same_surface(light.normal, vertex.hit.ns) {
                return;
            }
            let left = vertex.leaving(rules, Walk::Camera, light.wo);
            if left.value == Vec3::ZERO {
                return;
            }
            let weight = match rules.weighs() {
                true => mis::merging(light.sum.at(left.turn.onward), left.turn.sum, eta),
                false => 1.0,
            };
            // photons are as dense as their own facet is turned to the light, which under smoothed normals is
            // not what the BSDF reckons with here; the surface's opacity is in both sub-paths
            let arriving = light.flux * (weight * left.cos / (light.cos * light.opacity * eta));
            record(sample, bounces, tip.weight * left.value * arriving);
        });
    }
}

impl Tip {
    fn vertex(&self) -> Vertex<'_> {
        let End { hit, vertex, wo, .. } = &self.end;
        Vertex { hit, bsdf: &vertex.bsdf, wo: *wo, survival: self.survival, sum: self.sum }
    }
}

/// Collects what the primary segment sees, which no other technique finds.
struct Seeing<'a, 'b> {
    camera: &'a CameraSampler<'b>,
    sample: &'a mut Sample,
}

impl Seeing<'_, '_> {
    fn is_background(&self, chain: &Chain) -> bool {
        self.camera.transparent_background && chain.passages == 0
    }
}

impl Witness for Seeing<'_, '_> {
    fn light(&mut self, chain: &Chain, light: &LightPoint) {
        if !(light.is_infinite() && self.is_background(chain)) {
            self.glow(chain, light.radiance);
        }
    }

    fn glow(&mut self, chain: &Chain, radiance: Vec3) {
        if chain.passages <= self.camera.rules.max_depth {
            record(self.sample, chain.passages, chain.throughput * radiance / chain.forward);
        }
    }

    fn surface(&mut self, hit: &SurfacePoint, vertex: &Shading, wo: Vec3) {
        let Rules { world, sensor, .. } = self.camera.rules;
        let (world, sensor): (&World, &Sensor) = (world, sensor);
        self.sample.first_hit.get_or_insert_with(|| world.first_hit(sensor, hit, vertex, wo));
    }

    fn escaped(&mut self, chain: &Chain) {
        if self.is_background(chain) {
            self.sample.alpha = 1.0 - chain.throughput.element_sum() / 3.0;
        }
    }
}

/// Collects the light that a later segment meets.
struct Meeting<'a, 'b> {
    rules: &'a Rules<'b>,
    receiver: Receiver,
    /// Cosine of the direction in which it left.
    cos: f32,
    turn: Turn,
    /// Factor on basic radiance where the segment begins.
    weight: Vec3,
    /// Bounces of light that is met there.
    bounces: u32,
    sample: &'a mut Sample,
}

impl Meeting<'_, '_> {
    fn add(&mut self, chain: &Chain, radiance: Vec3, drawn: f32, emitted: f32) {
        let bounces = self.bounces + chain.passages;
        if bounces <= self.rules.max_depth {
            let weight = mis::meeting(&self.turn, chain, drawn, emitted);
            record(
                self.sample,
                bounces,
                self.weight * chain.throughput * radiance * (weight / chain.forward),
            );
        }
    }
}

impl Witness for Meeting<'_, '_> {
    fn light(&mut self, chain: &Chain, light: &LightPoint) {
        if !self.rules.connects {
            return;
        }
        let drawn = match chain.passages {
            0 => self.rules.world.pdf_of_sampling(&self.receiver, light) / self.cos,
            _ => 0.0,
        };
        self.add(chain, light.radiance, drawn, self.rules.world.emission_pdf(&PLAIN, light).0);
    }

    fn glow(&mut self, chain: &Chain, radiance: Vec3) {
        self.add(chain, radiance, 0.0, 0.0);
    }
}
