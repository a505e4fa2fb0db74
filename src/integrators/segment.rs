//! Segment-based light transport: the whole method, iteration by iteration.

use super::shown::Shown;
use super::{Context, Integrator, IterationEnd, StageCosts, locked};
use crate::film::{FirstHit, Pass, Rect, Sample, SplatBuffer};
use crate::math::sampler::hash;
use crate::math::{LUMINANCE, Sampler, luminance};
use crate::shading::World;
use crate::transport::adaptation::{Adaptation, Look};
use crate::transport::bridge::{BridgeSampler, Bridges, Choice};
use crate::transport::camera::{CameraSampler, Primary};
use crate::transport::cluster::{Areas, Clusters, Numbered};
use crate::transport::economy::{Departure, Economy};
use crate::transport::glances::{self, Glances};
use crate::transport::grid::Grid;
use crate::transport::guiding::{Guiding, Outcome, Start};
use crate::transport::light::LightSampler;
use crate::transport::propagate::Reflected;
use crate::transport::store::{CameraStore, LightStore};
use crate::transport::weigh::{Sampled, Weights};
use crate::transport::{Cut, Estimator, Techniques};
use glam::Vec3;
use std::mem::take;
use std::sync::atomic::Ordering::Relaxed;

/// What the segments of a camera path take until they are in the film, about, bytes.
const BYTES_PER_PIXEL: u64 = 2048;
/// Most light paths for each pixel of a band, so that theirs stay within bounds, too.
const LIGHT_PATHS_PER_PIXEL: u64 = 4;
/// Keeps the random numbers of light paths apart from those of pixels.
const LIGHT_STREAM: u32 = 0x11e4_7000;
/// Keeps those of the grids apart from both.
const GRID_STREAM: u32 = 0x961d_0000;
/// Keeps those of the grids that choose sizes apart.
const ADAPTATION_STREAM: u32 = 0xada9_0000;
/// Keeps those of bridges apart.
const BRIDGE_STREAM: u32 = 0xb21d_9e00;

/// What an iteration samples, and how it is clustered.
#[derive(Debug, Default)]
struct Samples {
    camera: CameraStore,
    light: LightStore,
    clusters: Clusters,
}

impl Samples {
    /// With the scene, and the bridges if there are any.
    fn with<'a>(&'a self, world: &'a World, bridges: Option<&'a Bridges>) -> Sampled<'a> {
        Sampled { world, camera: &self.camera, light: &self.light, clusters: &self.clusters, bridges }
    }
}

/// Segment-based light transport. Its stores are kept from one iteration to the next.
#[derive(Debug, Default)]
pub struct Segment {
    techniques: Techniques,
    samples: Samples,
    bridges: Bridges,
    splats: SplatBuffer,
    weights: Weights,
    reflected: Reflected,
    guiding: Guiding,
    /// What every pixel of the band sees, row by row.
    primaries: Vec<Primary>,
    /// The first surface that every pixel sees, if a pass asks for it.
    first_hits: Vec<Option<FirstHit>>,
    /// For every pixel of the band, the size of the voxel in which it is filtered, octaves over the kernel's.
    octaves: Vec<f32>,
    /// First arrival of every camera path that has one.
    starts: Vec<u32>,
    /// The kernel's size place by place.
    adaptation: Adaptation,
    /// How often pixels look for light on their primary segments.
    glances: Glances,
    /// How many light paths pay.
    economy: Economy,
    /// How much of the light is beyond the camera's own paths, see [`Reflected::beyond_own_paths`].
    beyond: f64,
    /// For every band, the picture before the last iteration that looked whether they do.
    yardsticks: Vec<Shown>,
}

impl Segment {
    /// With these techniques.
    pub fn new(techniques: Techniques) -> Self {
        Self { techniques, ..Self::default() }
    }
}

impl Integrator for Segment {
    fn iterate(&mut self, context: &Context, index: u32) -> IterationEnd {
        let stopped = || context.stop.is_raised();
        let cut = Cut(&stopped);
        let mut costs = StageCosts::new(context.counters);
        let is_complete = self.all_bands(context, index, &cut, &mut costs);
        if is_complete { IterationEnd::Complete } else { IterationEnd::CutShort }
    }

    fn is_all_or_nothing(&self) -> bool {
        true
    }

    fn rest(&mut self) {
        *self = Self {
            guiding: take(&mut self.guiding),
            adaptation: take(&mut self.adaptation),
            glances: take(&mut self.glances),
            economy: take(&mut self.economy),
            yardsticks: take(&mut self.yardsticks),
            ..Self::new(self.techniques)
        };
    }
}

/// What is found out about an iteration while its bands are made.
struct Lessons {
    /// Whether light paths learn from it where to begin.
    guides: bool,
    /// Whether it tells how many of them pay.
    looks: bool,
    /// Its light paths, and the bands that share them.
    light_paths: f32,
    bands: usize,
}

impl Segment {
    /// An iteration: light paths, and band by band the camera paths that they are joined to. Returns `false` if it was
    /// stopped.
    fn all_bands(&mut self, context: &Context, index: u32, cut: &Cut, costs: &mut StageCosts) -> bool {
        let rays_before = context.counters.rays.load(Relaxed);
        let bands = self.bands(context);
        let all = self.most_light_paths(context);
        let light_paths = match self.is_thrifty(context) {
            true => self.economy.light_paths(all, index),
            false => all,
        };
        if !self.sample_light(context, index, light_paths as u32, cut) {
            return false;
        }
        self.forget_band();
        costs.stage("sampling", self.samples.light.bytes());
        let lessons = Lessons {
            guides: self.techniques.emission_guiding
                && self.guiding.begin_iteration(self.samples.light.starts.len()),
            looks: self.is_thrifty(context) && Economy::looks(index),
            light_paths,
            bands: bands.len(),
        };
        let compares = self.is_thrifty(context) && self.economy.compares(index);
        if lessons.looks {
            self.yardsticks.clear();
        }
        let mut deviation = 0.0;
        self.beyond = 0.0;
        let adapts = self.techniques.kernel.adapts();
        if adapts {
            self.adaptation.begin(context.crop, context.completed + 1);
        }
        self.glances.begin(context.crop, context.world.needs().mirrors);
        for (k, band) in bands.into_iter().enumerate() {
            let crop = Rect { x: context.crop.x + band.x, y: context.crop.y + band.y, ..band };
            let of_band = Context { crop, ..*context };
            if !self.transport(&of_band, index, light_paths, cut, costs) {
                return false;
            }
            let before = if compares { Shown::of(context.film, band) } else { None };
            self.gather(&of_band, band);
            self.count_glances(&of_band);
            costs.stage("gather", self.primaries.capacity() * size_of::<Primary>());
            if adapts {
                self.adapt(&of_band, cut);
                costs.stage("adaptation", self.adaptation.bytes());
            }
            let after = if lessons.guides || compares { Shown::of(context.film, band) } else { None };
            let Some(after) = after else { continue };
            if let Some(before) = before {
                let latest = before.latest(&after, context.completed);
                if lessons.looks {
                    self.yardsticks.push(before);
                }
                deviation += self.yardsticks.get(k).map_or(0.0, |y| y.deviation(&latest));
            }
            if lessons.guides || lessons.looks {
                let bytes = self.learn(&of_band, &after, &lessons, cut);
                costs.hold(self.held() + bytes);
                costs.stage("learning", bytes);
            }
        }
        if adapts {
            let done = context.completed + 1;
            let [nominal, next] = [done - 1, done].map(|i| self.techniques.kernel.edge(i));
            self.adaptation.end_iteration(nominal, next, done);
            locked(&context.counters.hints).blur = self.adaptation.blur();
            costs.stage("adaptation", 0);
        }
        let rays = context.counters.rays.load(Relaxed) - rays_before;
        self.glances.end_iteration(context.completed + 1, rays);
        costs.stage("adaptation", self.glances.bytes());
        if (index + 1).is_power_of_two() && self.techniques.camera_paths {
            let share = self.beyond / context.crop.area() as f64;
            locked(&context.counters.hints).beyond_unfiltered = share;
        }
        if lessons.guides {
            self.guiding.finish_iteration(context.world, cut);
            costs.stage("learning", self.guiding.bytes());
        }
        if compares {
            let departure = Departure { deviation, before: context.completed };
            self.economy.judge(index, departure, context.world.has_hidden_light());
            let left_out = self.economy.left_out();
            *locked(&context.counters.left_out) = left_out;
        }
        true
    }

    /// Pixels of a band at most.
    fn band_pixels(&self) -> u64 {
        self.techniques.memory_budget / BYTES_PER_PIXEL
    }

    /// The parts of the film that are made one after the other: each is clustered for itself, with all light paths. What
    /// bridges bring to the lens may arrive anywhere, so theirs is one.
    fn bands(&self, context: &Context) -> Vec<Rect> {
        match self.techniques.bridges {
            None => context.film.bands(self.band_pixels()),
            Some(_) => vec![context.film.rect()],
        }
    }

    /// Light paths of an iteration, if all are sampled.
    fn most_light_paths(&self, context: &Context) -> f32 {
        let wanted = (self.techniques.light_paths * context.film.rect().area() as f32).ceil();
        wanted.min((LIGHT_PATHS_PER_PIXEL * self.band_pixels()).max(1) as f32)
    }

    /// All stages of a band up to the film. Returns `false` if it was stopped.
    fn transport(
        &mut self,
        context: &Context,
        index: u32,
        light_paths: f32,
        cut: &Cut,
        costs: &mut StageCosts,
    ) -> bool {
        let Context { world, sensor, .. } = *context;
        self.forget_band();
        if !self.sample_camera(context, index, light_paths, cut) {
            return false;
        }
        costs.stage("sampling", self.samples.camera.bytes() + self.samples.light.bytes());

        let edge = self.techniques.kernel.edge(context.completed);
        let grid = Grid::new(sensor, edge, hash(context.seed ^ GRID_STREAM, index))
            .with_sizes(self.adaptation.sizes());
        let all = Numbered { camera: &self.samples.camera.arrivals, light: &self.samples.light.arrivals };
        // bridges may begin at any light arrival; the other estimators follow light paths to their ends
        let needs_all = context.keep_all
            || self.techniques.estimator != Estimator::LeaveOneOut
            || self.techniques.bridges.is_some();
        let clusters = &mut self.samples.clusters;
        let is_done = match needs_all {
            true => clusters.group(world, &grid, all, cut),
            false => clusters.group_seen(world, &grid, all, cut),
        };
        if !is_done {
            return false;
        }
        let clusters = &self.samples.clusters;
        costs.hold(self.held() + clusters.most_bytes() - clusters.bytes());
        costs.stage("clustering", clusters.bytes());
        let areas = match self.techniques.estimator {
            _ if light_paths == 0.0 => Areas::None,
            Estimator::LeaveOneOut | Estimator::WholePath => Areas::OfPhotons,
            Estimator::Literal => Areas::True,
        };
        if !self.samples.clusters.measure(world, &grid, all, areas, cut) {
            return false;
        }
        costs.stage("areas", 0);
        self.octaves.clear();
        self.octaves.extend(self.primaries.iter().map(|p| match p.arrival {
            Some(a) => grid.octaves(self.samples.camera.arrivals.position(a as usize)),
            None => 0.0,
        }));
        context.counters.segments.fetch_max(self.segments() as u64, Relaxed);

        if let Some(choice) = self.techniques.bridges {
            if !self.sample_bridges(context, index, choice, cut) {
                return false;
            }
            costs.stage("bridges", self.bridges.bytes() + self.splats.bytes());
        }
        let sampled = self.samples.with(context.world, self.techniques.bridges.map(|_| &self.bridges));
        if !self.weights.weigh(sampled, self.techniques.estimator, cut) {
            return false;
        }
        costs.hold(self.held());
        costs.stage("weights", self.weights.bytes());
        let passes = context.film.passes();
        let wants_direct = passes.contains(Pass::Direct) || passes.contains(Pass::Indirect);
        let first = || {
            let first = self.primaries.iter().filter_map(|p| Some((p.arrival?, p.passages)));
            first
                .filter(|&(_, passages)| context.max_depth.is_none_or(|most| passages < most))
                .collect::<Vec<_>>()
        };
        let (weights, reflected) = (&self.weights, &mut self.reflected);
        let solved = match (self.techniques.estimator, context.max_depth) {
            (Estimator::Literal, limit) => reflected.solve_literal(sampled, weights, &first(), limit, cut),
            (Estimator::WholePath, limit) => {
                reflected.solve_whole_paths(sampled, weights, &first(), limit, cut)
            }
            (Estimator::LeaveOneOut, None) => {
                reflected.solve(sampled, weights, &self.starts, wants_direct, cut)
            }
            (Estimator::LeaveOneOut, Some(limit)) => {
                reflected.solve_limited(sampled, weights, &first(), limit, cut)
            }
        };
        costs.hold(self.held() + self.reflected.most_bytes() - self.reflected.bytes());
        costs.stage("propagation", self.reflected.bytes());
        context.counters.dropped.fetch_add(self.samples.camera.dropped, Relaxed);
        // figures that hardly change are taken ever more rarely
        if solved && (index + 1).is_power_of_two() {
            let sweeps = match (self.techniques.estimator, context.max_depth) {
                (Estimator::LeaveOneOut, None) => context.operator_sweeps,
                _ => 0,
            };
            let report = self.reflected.report(sampled, &self.weights, &self.starts, sweeps, cut);
            *locked(&context.counters.graph) = Some(report);
            if self.techniques.camera_paths {
                self.beyond += self.reflected.beyond_own_paths(sampled, &self.weights, &self.starts, cut);
            }
            costs.stage("report", 0);
        }
        solved
    }

    fn sample_camera(&mut self, context: &Context, index: u32, light_paths: f32, cut: &Cut) -> bool {
        let sampler = CameraSampler {
            world: context.world,
            sensor: context.sensor,
            guide: &self.guiding.guide,
            light_paths,
            transparent_background: context.transparent_background,
            max_depth: context.max_depth,
            next_event: self.techniques.next_event,
            goes_on: self.techniques.camera_paths,
        };
        let wants_first_hits = context.film.passes().iter().any(Pass::is_first_hit);
        let path = |x: u32, y: u32, (store, seen): &mut (CameraStore, Vec<_>), rays: &mut u64| {
            let (ray, mut random) = context.camera_sample(x, y, index);
            let (mut primary, first_hit) = sampler.path(&ray, &mut random, store, rays);
            let more = 1..self.glances.number(x + context.crop.x, y + context.crop.y);
            if !more.is_empty() {
                primary.average(more.map(|k| {
                    let (ray, mut random) = context.further_camera_sample(x, y, index, k, glances::MOST);
                    sampler.glance(&ray, &mut random, rays)
                }));
            }
            seen.push((primary, first_hit));
        };
        self.samples.camera.clear();
        self.primaries.clear();
        self.first_hits.clear();
        self.starts.clear();
        let pixels = context.crop.area();
        self.primaries.reserve_exact(pixels);
        self.starts.reserve_exact(pixels);
        self.first_hits.reserve_exact(if wants_first_hits { pixels } else { 0 });
        let camera = &mut self.samples.camera;
        context.camera_rows(path, |rows| {
            camera.reserve(rows.iter().map(|r| &r.0));
            for (mut store, seen) in rows {
                let first = camera.append(&mut store);
                for (mut p, first_hit) in seen {
                    p.arrival = p.arrival.map(|a| a + first);
                    self.starts.extend(p.arrival);
                    self.primaries.push(p);
                    self.first_hits.extend(wants_first_hits.then_some(first_hit));
                }
            }
        });
        !cut.is_raised()
    }

    fn sample_light(&mut self, context: &Context, index: u32, paths: u32, cut: &Cut) -> bool {
        let sampler = LightSampler {
            world: context.world,
            guide: &self.guiding.guide,
            paths: paths as f32,
            next_event: self.techniques.next_event,
            estimator: self.techniques.estimator,
        };
        let path = |k: u32, store: &mut LightStore, rays: &mut u64| {
            // Leaving one out takes light paths to be independent of each other. Stratified among each other, those of
            // an iteration are not: given one photon, fewer others lie nearby. They are from iteration to iteration.
            sampler.path(k, &mut Sampler::new(context.seed ^ LIGHT_STREAM, k, index), store, rays);
        };
        let light = &mut self.samples.light;
        light.clear();
        context.light_batches(paths, path, |batches| {
            light.reserve(batches.iter());
            batches.into_iter().for_each(|mut store| light.append(&mut store));
        });
        !cut.is_raised()
    }

    /// Bridges between what was sampled and clustered, and what they send to the lens.
    fn sample_bridges(&mut self, context: &Context, index: u32, choice: Choice, cut: &Cut) -> bool {
        let Context { world, sensor, filter, crop, max_depth, .. } = *context;
        let sampled = self.samples.with(world, None);
        let mut seen = vec![0.0; sampled.camera.arrivals.len()];
        for p in self.primaries.iter().filter(|p| p.passages == 0) {
            if let Some(a) = p.arrival {
                seen[a as usize] = p.density;
            }
        }
        let seed = context.seed ^ BRIDGE_STREAM;
        let sampler = BridgeSampler { sampled, sensor, choice, seed, index, filter, crop, max_depth };
        let mut rays = 0;
        let is_done = self.bridges.sample(&sampler, seen, &mut rays, cut);
        context.counters.rays.fetch_add(rays, Relaxed);
        self.splats.collect(&self.bridges.splats, filter, crop);
        is_done
    }

    /// Whether light paths are left out where they do not pay.
    fn is_thrifty(&self, context: &Context) -> bool {
        !context.keep_all && self.techniques.can_do_without_light_paths()
    }

    /// Learns from a band where light paths should begin and how many of them pay, by what they bring as a share of what
    /// is shown. Returns the bytes that it took.
    fn learn(&mut self, context: &Context, shown: &Shown, lessons: &Lessons, cut: &Cut) -> usize {
        let starts = self.primaries.iter().zip(shown.scales()).filter_map(|(p, scale)| {
            let worth = p.weight * (LUMINANCE / scale);
            let worth = if worth.is_finite() { worth } else { Vec3::ZERO };
            Some(Start { arrival: p.arrival?, passages: p.passages, worth })
        });
        let starts: Vec<Start> = starts.collect();
        let sampled = self.samples.with(context.world, self.techniques.bridges.map(|_| &self.bridges));
        let (weights, reflected, max_depth) = (&self.weights, &self.reflected, context.max_depth);
        let outcome = Outcome { sampled, weights, reflected, starts: &starts, max_depth };
        if lessons.looks {
            self.economy.look(outcome, lessons.light_paths, lessons.bands, cut);
        }
        if lessons.guides { self.guiding.learn(outcome, cut) } else { 0 }
    }

    /// Takes note of how the light on primary segments varies, and of all else that a band shows.
    fn count_glances(&mut self, context: &Context) {
        let Self { samples, bridges, reflected, primaries, glances, .. } = self;
        let sampled = samples.with(context.world, self.techniques.bridges.map(|_| &*bridges));
        glances.add(context.crop, primaries, |p| p.weight * seen(reflected, sampled, p));
    }

    /// Takes note of what a band shows, from which the kernel's sizes follow.
    fn adapt(&mut self, context: &Context, cut: &Cut) {
        let sampled = self.samples.with(context.world, self.techniques.bridges.map(|_| &self.bridges));
        let light = |p: &Primary| luminance(seen(&self.reflected, sampled, p)) / p.albedo;
        let look = Look {
            band: context.crop,
            sensor: context.sensor,
            primaries: &self.primaries,
            arrivals: &self.samples.camera.arrivals,
            seed: hash(context.seed ^ ADAPTATION_STREAM, context.completed),
            completed: context.completed + 1,
        };
        self.adaptation.add(&look, light, cut);
    }

    /// Gives back what a band was weighed and solved with.
    fn forget_band(&mut self) {
        (self.samples.clusters, self.weights, self.reflected) = Default::default();
    }

    /// What is held of the iteration now, bytes.
    fn held(&self) -> usize {
        self.samples.camera.bytes()
            + self.samples.light.bytes()
            + self.samples.clusters.bytes()
            + self.bridges.bytes()
            + self.splats.bytes()
            + self.weights.bytes()
            + self.reflected.bytes()
            + self.primaries.capacity() * size_of::<Primary>()
            + self.first_hits.capacity() * size_of::<Option<FirstHit>>()
            + (self.starts.capacity() + self.octaves.capacity()) * size_of::<f32>()
    }

    /// Segments of this band.
    fn segments(&self) -> usize {
        self.samples.camera.segments(self.primaries.len()) + self.samples.light.arrivals.len()
    }

    /// One sample for every pixel of a band.
    fn gather(&self, context: &Context, band: Rect) {
        let sampled = self.samples.with(context.world, self.techniques.bridges.map(|_| &self.bridges));
        context.film.add_to_band(band, |x, y| {
            let pixel = band.index(x, y);
            let (p, splatted) = (&self.primaries[pixel], self.splats.get(pixel));
            let (reflected, direct) = match p.arrival.map(|a| a as usize) {
                Some(a) => {
                    let direct = self.reflected.direct.get(a).filter(|_| p.passages == 0);
                    (self.reflected.towards_camera(sampled, a), direct.map_or(Vec3::ZERO, |d| d.decode()))
                }
                None => (Vec3::ZERO, Vec3::ZERO),
            };
            Sample {
                radiance: p.light + p.weight * reflected + splatted.light,
                unfiltered: self.techniques.camera_paths.then(|| p.light + p.weight * p.unfiltered),
                kernel_octaves: Some(self.octaves[pixel]),
                alpha: p.alpha,
                emission: p.emission,
                direct: p.mirrored + p.weight * direct.min(reflected) + splatted.direct,
                first_hit: self.first_hits.get(pixel).copied().flatten(),
            }
        });
        (context.tile_done)(band);
    }
}

/// Basic radiance that is reflected at the end of a primary segment.
fn seen(reflected: &Reflected, sampled: Sampled, primary: &Primary) -> Vec3 {
    primary.arrival.map_or(Vec3::ZERO, |a| reflected.towards_camera(sampled, a as usize))
}
