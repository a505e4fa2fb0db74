//! Sequential sampling from the camera, with a next-event segment at every arrival (S8).

use super::arrival::{arrival, early_survival};
use super::own_path::OwnPath;
use super::store::{CameraStore, EmissionHit, NextEvent, Outgoing};
use super::walk::{Chain, End, Follow, Witness};
use crate::film::FirstHit;
use crate::math::density::ProjectedPdf;
use crate::math::{Sampler, luminance};
use crate::shading::bsdf::{Sight, Walk};
use crate::shading::emitters::{EmissionGuide, Receiver};
use crate::shading::{CameraRay, LightPoint, Piece, Sensor, SurfaceClass, SurfacePoint, Vertex, World};
use glam::Vec3;

/// Arrivals of a path at which it is let go more rarely.
pub(super) const EARLY: usize = 2;

/// What a pixel sees along its primary segment.
#[derive(Clone, Copy, Debug)]
pub struct Primary {
    /// The arrival at its end.
    pub arrival: Option<u32>,
    /// Factor on the basic radiance that is reflected there: throughput over choice probabilities.
    pub weight: Vec3,
    /// Luminance of the albedo there, of what is continuous.
    pub albedo: f32,
    /// Dirac lobes that it passes.
    pub passages: u32,
    /// Density per area with which primary segments arrive there, times `c`.
    pub density: f32,
    /// Basic radiance that the path by itself finds to be reflected there.
    pub unfiltered: Vec3,
    /// Radiance of the lights on it.
    pub light: Vec3,
    /// That of lights seen straight.
    pub emission: Vec3,
    /// That of lights seen by one passage.
    pub mirrored: Vec3,
    /// Coverage.
    pub alpha: f32,
    /// Primary segments of which the lights are means, the sum of the squared luminances of their `light`, and the rays that
    /// they took.
    pub glances: u32,
    /// See `glances`.
    pub square: f32,
    /// See `glances`.
    pub rays: u32,
}

impl Primary {
    pub(super) const NOTHING: Self = Self {
        arrival: None,
        weight: Vec3::ZERO,
        albedo: 0.0,
        passages: 0,
        density: 0.0,
        unfiltered: Vec3::ZERO,
        light: Vec3::ZERO,
        emission: Vec3::ZERO,
        mirrored: Vec3::ZERO,
        alpha: 1.0,
        glances: 0,
        square: 0.0,
        rays: 0,
    };

    /// Takes the light of others into its means.
    pub fn average(&mut self, others: impl Iterator<Item = Self>) {
        let mut sums = [self.light, self.emission, self.mirrored].map(|v| v * self.glances as f32);
        for o in others {
            let more = [o.light, o.emission, o.mirrored].map(|v| v * o.glances as f32);
            sums = std::array::from_fn(|k| sums[k] + more[k]);
            self.glances += o.glances;
            self.square += o.square;
            self.rays += o.rays;
        }
        [self.light, self.emission, self.mirrored] = sums.map(|v| v / self.glances as f32);
    }
}

/// Samples camera paths.
pub struct CameraSampler<'a> {
    /// The scene.
    pub world: &'a World,
    /// The camera.
    pub sensor: &'a Sensor,
    /// Where light paths begin.
    pub guide: &'a EmissionGuide,
    /// Light paths of this iteration: their densities enter those of the camera's segments.
    pub light_paths: f32,
    /// Whether what lies behind everything is transparent.
    pub transparent_background: bool,
    /// Most bounces of what is seen along a primary segment.
    pub max_depth: Option<u32>,
    /// Whether arrivals sample next-event segments.
    pub next_event: bool,
    /// Whether paths go on after their first arrival.
    pub goes_on: bool,
}

/// Collects what the primary segment sees.
struct Seeing<'a> {
    sampler: &'a CameraSampler<'a>,
    primary: &'a mut Primary,
    first_hit: Option<FirstHit>,
}

impl Seeing<'_> {
    fn add(&mut self, chain: &Chain, radiance: Vec3) {
        if self.sampler.max_depth.is_some_and(|most| chain.passages > most) {
            return;
        }
        let light = chain.throughput * radiance / chain.forward;
        self.primary.light += light;
        match chain.passages {
            0 => self.primary.emission += light,
            1 => self.primary.mirrored += light,
            _ => {}
        }
    }

    fn is_background(&self, chain: &Chain) -> bool {
        self.sampler.transparent_background && chain.passages == 0
    }
}

impl Witness for Seeing<'_> {
    fn light(&mut self, chain: &Chain, light: &LightPoint) {
        if !(light.is_infinite() && self.is_background(chain)) {
            self.add(chain, light.radiance);
        }
    }

    fn glow(&mut self, chain: &Chain, radiance: Vec3) {
        self.add(chain, radiance);
    }

    fn surface(&mut self, hit: &SurfacePoint, vertex: &Vertex, wo: Vec3) {
        let CameraSampler { world, sensor, .. } = self.sampler;
        self.first_hit.get_or_insert_with(|| world.first_hit(sensor, hit, vertex, wo));
    }

    fn escaped(&mut self, chain: &Chain) {
        if self.is_background(chain) {
            self.primary.alpha = 1.0 - chain.throughput.element_sum() / 3.0;
        }
    }
}

/// A primary segment.
struct Beginning {
    primary: Primary,
    first_hit: Option<FirstHit>,
    chain: Chain,
    end: Option<End>,
}

/// Collects the light that a segment meets after it left an arrival.
struct Meeting<'a> {
    world: &'a World,
    hits: &'a mut Vec<EmissionHit>,
    dropped: &'a mut u64,
    arrival: u32,
    receiver: Receiver,
    /// Cosine of the direction in which it left.
    cos: f32,
    guide: &'a EmissionGuide,
    /// Light paths times the probability that one ends at the arrival.
    light_paths: f32,
    next_event: bool,
}

impl Meeting<'_> {
    fn add(&mut self, chain: &Chain, radiance: Vec3, next_event_pdf: f32, emission_pdf: f32) {
        let light = chain.throughput * radiance;
        if !light.is_finite() {
            *self.dropped += 1;
            return;
        }
        self.hits.push(EmissionHit {
            arrival: self.arrival,
            light,
            forward: chain.forward,
            next_event_pdf,
            light_density: self.light_paths * emission_pdf * chain.reverse * chain.squeeze,
            passages: chain.passages,
        });
    }
}

impl Witness for Meeting<'_> {
    fn light(&mut self, chain: &Chain, light: &LightPoint) {
        let next_event_pdf = match chain.passages {
            0 if self.next_event => self.world.pdf_of_sampling(&self.receiver, light) / self.cos,
            _ => 0.0,
        };
        let emission_pdf = match self.light_paths > 0.0 {
            true => self.world.emission_pdf(self.guide, light).0,
            false => 0.0,
        };
        self.add(chain, light.radiance, next_event_pdf, emission_pdf);
    }

    fn glow(&mut self, chain: &Chain, radiance: Vec3) {
        self.add(chain, radiance, 0.0, 0.0);
    }
}

impl CameraSampler<'_> {
    /// Samples the path of one camera ray into the store. Adds the rays it takes to `rays`. Returns what the pixel sees, and
    /// the first surface on the way.
    pub fn path(
        &self,
        ray: &CameraRay,
        sampler: &mut Sampler,
        store: &mut CameraStore,
        rays: &mut u64,
    ) -> (Primary, Option<FirstHit>) {
        let Beginning { mut primary, first_hit, chain, end } = self.primary(ray, sampler, rays);
        let Some(mut end) = end else { return (primary, first_hit) };
        let first = store.arrivals.len();
        primary.arrival = Some(first as u32);
        primary.weight = chain.throughput / chain.forward;
        primary.passages = chain.passages;
        let place = &end.hit.place;
        primary.density =
            chain.forward * place.normal.dot(end.wo).abs() * self.sensor.density(ray, place.position);
        let mut own = OwnPath::new(chain.passages, self.max_depth);
        let follow = Follow { world: self.world, walk: Walk::Camera, from_camera: false };
        let mut met = Vec::new();
        loop {
            let index = store.arrivals.len();
            let sight = end.sight();
            if index == first {
                primary.albedo = luminance(sight.as_ref().map_or(Vec3::ZERO, Sight::continuous_albedo));
            }
            let mut arrived = arrival(self.world, &end, sight.as_ref());
            if !self.goes_on {
                arrived.survival = 0.0;
            } else if index - first < EARLY {
                arrived.survival = early_survival(arrived.survival);
            }
            let receiver = end.hit.receiver(&end.vertex.bsdf, end.wo);
            let (next_event, value) = match (self.next_event, &sight) {
                (true, Some(sight)) => {
                    let drawn = self.next_event(&end, sight, &receiver, sampler, rays);
                    drawn.unwrap_or_default()
                }
                _ => Default::default(),
            };
            let sound = next_event.light.is_finite() && next_event.next_event_pdf.is_finite();
            store.dropped += u64::from(!sound);
            let next_event = if sound { next_event } else { NextEvent::default() };
            own.see_next_event(&next_event, arrived.survival, value);
            let u = sampler.next_3d();
            let goes_on = sampler.next_1d() < arrived.survival;
            let sample = if goes_on { sight.and_then(|s| s.sample(Walk::Camera, u)) } else { None };
            arrived.goes_on = sample.is_some();
            let survival = arrived.survival;
            let Some(sample) = sample else {
                store.push(arrived, next_event, Outgoing::default());
                break;
            };
            let direction = sample.direction;
            let light_end = end.probability_from(self.world, direction);
            let mut meeting = Meeting {
                world: self.world,
                hits: &mut met,
                dropped: &mut store.dropped,
                arrival: index as u32,
                receiver,
                cos: end.hit.place.normal.dot(direction).abs(),
                guide: self.guide,
                light_paths: self.light_paths * light_end,
                next_event: self.next_event,
            };
            let piece = Piece::leaving(&end.hit, direction);
            let (chain, next) = follow.segment(piece, sampler, &mut meeting, rays);
            let density = survival * sample.pdf.value();
            own.meet(&met, sample.value, density);
            met.drain(..).for_each(|hit| store.hits.push(hit));
            own.go_on(&chain, sample.value, density);
            let outgoing = Outgoing {
                direction,
                pdf: sample.pdf.value(),
                throughput: chain.throughput,
                forward: if next.is_some() { chain.forward } else { 0.0 },
                reverse: chain.reverse * light_end,
                squeeze: chain.squeeze,
                passages: chain.passages,
            };
            store.push(arrived, next_event, outgoing);
            match next {
                Some(e) => end = e,
                None => break,
            }
        }
        primary.unfiltered = own.light;
        (primary, first_hit)
    }

    /// What is seen on a primary segment alone.
    pub fn glance(&self, ray: &CameraRay, sampler: &mut Sampler, rays: &mut u64) -> Primary {
        self.primary(ray, sampler, rays).primary
    }

    fn primary(&self, ray: &CameraRay, sampler: &mut Sampler, rays: &mut u64) -> Beginning {
        let mut primary = Primary { glances: 1, ..Primary::NOTHING };
        let before = *rays;
        let follow = Follow { world: self.world, walk: Walk::Camera, from_camera: true };
        let mut seeing = Seeing { sampler: self, primary: &mut primary, first_hit: None };
        let (chain, end) = follow.segment(Piece::from_camera(ray), sampler, &mut seeing, rays);
        let first_hit = seeing.first_hit;
        primary.square = luminance(primary.light).powi(2);
        primary.rays = (*rays - before) as u32;
        Beginning { primary, first_hit, chain, end }
    }

    /// A next-event segment along which light arrives, and the value of the lobes.
    fn next_event(
        &self,
        end: &End,
        sight: &Sight,
        receiver: &Receiver,
        sampler: &mut Sampler,
        rays: &mut u64,
    ) -> Option<(NextEvent, Vec3)> {
        let u = sampler.next_3d();
        let light = self.world.sample_light(receiver, u)?;
        let cos = end.hit.place.normal.dot(light.direction).abs();
        let (value, ProjectedPdf(pdf)) = sight.look(light.direction);
        // arrivals from the other side of a surface that transmits share its cluster, and may use what this one cannot
        let is_shared = self.world.class(end.hit.material) == SurfaceClass::Transmitting;
        if cos <= 0.0 || (pdf <= 0.0 && !is_shared) {
            return None;
        }
        let visible = self.world.transmittance(&end.hit, &light, rays);
        if visible == Vec3::ZERO || light.radiance == Vec3::ZERO {
            return None;
        }
        let arriving = light.radiance * visible;
        let paths = match self.light_paths > 0.0 {
            true => {
                let ends = end.probability_from(self.world, light.direction);
                self.light_paths * ends * self.world.emission_pdf_of_sample(self.guide, &light)
            }
            false => 0.0,
        };
        // a delta light counts by area, others by étendue
        let (light_cos, pdf_cos) = if light.is_delta { (cos, 1.0) } else { (1.0, cos) };
        let next_event = NextEvent {
            direction: light.direction,
            pdf,
            light: arriving * light_cos,
            next_event_pdf: light.pdf / pdf_cos,
            light_density: paths * light_cos,
            is_delta: light.is_delta,
        };
        Some((next_event, value))
    }
}
