//! Unidirectional path tracing with next-event estimation: the reference of all other methods.
//!
//! Paths start at the camera. At every vertex the light is estimated in two ways, by drawing a point of a
//! light and by following the BSDF to one; both are weighted by the power heuristic (Veach 1997, section
//! 9.2). Paths end by Russian roulette, which leaves the mean as it is, or where nothing is hit.

use super::{Context, Integrator, IterationEnd, record};
use crate::film::{Sample, SharedTile};
use crate::math::Sampler;
use crate::shading::bsdf::{Among, Sight, Walk};
use crate::shading::emitters::Receiver;
use crate::shading::lobes::Density;
use crate::shading::{CameraRay, LightPoint, Piece, Shaded, SurfacePoint, World};
use glam::Vec3;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// The path tracer.
#[derive(Debug, Default)]
pub struct Path;

/// Vertices before roulette begins: short paths carry most of the picture.
const ROULETTE_FROM: u32 = 3;
/// From here on even a path that loses nothing may end, so that a closed white scene does too.
const ROULETTE_ALWAYS_FROM: u32 = 64;
const MAX_SURVIVAL: f32 = 0.9995;

impl Integrator for Path {
    fn iterate(&mut self, context: &Context, index: u32) -> IterationEnd {
        use rayon::prelude::*;
        let cut_short = AtomicBool::new(false);
        context.film.par_tiles().for_each(|tile| {
            if !render_tile(context, index, tile) {
                cut_short.store(true, Relaxed);
            }
            (context.tile_done)(tile.rect());
        });
        if cut_short.into_inner() { IterationEnd::CutShort } else { IterationEnd::Complete }
    }

    fn is_all_or_nothing(&self) -> bool {
        false
    }

    fn rest(&mut self) {}
}

/// Returns whether all its pixels were sampled. An iteration that was cut short goes on where it ended: short slices of
/// time would else never come to the last tiles.
fn render_tile(context: &Context, index: u32, shared: &SharedTile) -> bool {
    let (mut rays, mut complete) = (0, true);
    let mut tile = shared.lock();
    let before = u64::from(context.completed) * shared.rect().area() as u64;
    let done = tile.delivered().saturating_sub(before) as usize;
    for (x, y) in shared.rect().pixels().skip(done) {
        if context.stop.is_raised() {
            complete = false;
            break;
        }
        let (sample, taken) = sample(context, context.camera_sample(x, y, index));
        tile.add(x, y, &sample);
        rays += taken;
    }
    context.counters.rays.fetch_add(rays, Relaxed);
    complete
}

/// The path that begins with a camera ray, and the rays that it took.
pub(super) fn sample(context: &Context, (ray, sampler): (CameraRay, Sampler)) -> (Sample, u64) {
    let mut walk = PathWalk { context, sampler, rays: 0 };
    let mut sample = Sample { alpha: 1.0, ..Sample::default() };
    walk.trace(&ray, &mut sample);
    (sample, walk.rays)
}

/// Where the last direction came from, for the weight of light that is hit by it.
#[derive(Clone, Copy)]
enum Origin {
    /// The camera, or a delta lobe: no other technique could have found the light.
    Delta,
    /// A continuous lobe at a vertex, with its density per solid angle.
    Vertex { receiver: Receiver, pdf: f32 },
}

struct PathWalk<'a, 'b> {
    context: &'a Context<'b>,
    sampler: Sampler,
    rays: u64,
}

/// Weight of a technique of density `a` beside one of density `b` (power heuristic, exponent 2).
fn power_heuristic(a: f32, b: f32) -> f32 {
    // the ratio form neither overflows nor divides infinity by infinity
    let r = b / a;
    if r.is_finite() { 1.0 / (1.0 + r * r) } else { 0.0 }
}

impl PathWalk<'_, '_> {
    fn world(&self) -> &World {
        self.context.world
    }

    /// Adds the light of a path that begins with a camera ray.
    fn trace(&mut self, camera: &CameraRay, sample: &mut Sample) {
        let context = self.context;
        let world = context.world;
        // factor on basic radiance
        let mut throughput = Vec3::ONE;
        let mut origin = Origin::Delta;
        let mut piece = Piece::from_camera(camera);
        for depth in 0.. {
            let from_camera = depth == 0;
            let mut found = Vec3::ZERO;
            // through holes and transparent surfaces until something scatters
            let end = loop {
                self.rays += 1;
                let hit = world.closest(&piece, from_camera);
                world.for_each_light_on(&piece, hit.as_ref(), from_camera, |light| {
                    found += throughput * light.radiance * self.hit_weight(origin, light);
                });
                let Some(hit) = hit else { break None };
                throughput *= world.left_after(&piece, &hit);
                let choice = if world.needs().transparency { self.sampler.next_1d() } else { 0.0 };
                match world.shade(&hit, -piece.direction, Walk::Camera, choice) {
                    Shaded::Through { weight } => {
                        throughput *= weight;
                        piece = piece.beyond(&hit);
                    }
                    Shaded::Scatters { weight, vertex, .. } => {
                        throughput *= weight;
                        break Some((hit, vertex));
                    }
                }
            };
            let Some((hit, vertex)) = end else {
                world.for_each_infinite_light(&piece, from_camera, |light| {
                    if !(from_camera && context.transparent_background) {
                        found += throughput * light.radiance * self.hit_weight(origin, light);
                    }
                });
                record(sample, depth, found);
                if from_camera && context.transparent_background {
                    sample.alpha = 1.0 - throughput.element_sum() / 3.0;
                }
                return;
            };
            if vertex.emission != Vec3::ZERO {
                let light = world.emitter_at(&piece, &hit, vertex.emission);
                let weight = light.map_or(1.0, |light| self.hit_weight(origin, light));
                found += throughput * vertex.emission * weight;
            }
            record(sample, depth, found);
            if from_camera {
                sample.first_hit = Some(world.first_hit(context.sensor, &hit, &vertex, -piece.direction));
            }
            if context.max_depth.is_some_and(|d| depth >= d) {
                return;
            }

            let wo = -piece.direction;
            let bsdf = &vertex.bsdf;
            let receiver = hit.receiver(bsdf, wo);
            let Some(sight) = bsdf.sight(wo, Among::All) else { return };
            if bsdf.has_smooth() {
                let direct = self.next_event(&hit, &receiver, &sight) * throughput;
                record(sample, depth + 1, direct);
            }
            let Some(s) = sight.sample(Walk::Camera, self.sampler.next_3d()) else { return };
            throughput *= s.weight();
            origin = match s.pdf {
                Density::Discrete(_) => Origin::Delta,
                Density::Projected(pdf) => {
                    Origin::Vertex { receiver, pdf: pdf.to_solid_angle(hit.place.normal.dot(s.direction)).0 }
                }
            };
            let u = self.sampler.next_1d();
            if depth >= ROULETTE_FROM {
                let ceiling = if depth >= ROULETTE_ALWAYS_FROM { MAX_SURVIVAL } else { 1.0 };
                let survival = throughput.max_element().min(ceiling);
                if u >= survival {
                    return;
                }
                throughput /= survival;
            }
            piece = Piece::leaving(&hit, s.direction);
        }
    }

    /// Weight of light that was found by the direction from `origin`.
    fn hit_weight(&self, origin: Origin, light: LightPoint) -> f32 {
        match origin {
            Origin::Delta => 1.0,
            Origin::Vertex { receiver, pdf } => {
                power_heuristic(pdf, self.world().pdf_of_sampling(&receiver, &light))
            }
        }
    }

    /// Light that reaches the vertex from a drawn point of a light, scattered towards where it is seen from.
    fn next_event(&mut self, hit: &SurfacePoint, receiver: &Receiver, sight: &Sight) -> Vec3 {
        let u = self.sampler.next_3d();
        let world = self.context.world;
        let Some(light) = world.sample_light(receiver, u) else { return Vec3::ZERO };
        let cos = hit.place.normal.dot(light.direction).abs();
        let (f, pdf) = sight.look(light.direction);
        let f = f * cos;
        if f == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let weight = match light.is_delta {
            true => 1.0,
            false => power_heuristic(light.pdf, pdf.0 * cos),
        };
        f * light.radiance * (weight / light.pdf) * world.transmittance(hit, &light, &mut self.rays)
    }
}
