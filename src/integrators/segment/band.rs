//! A band of the picture in one iteration, from its samples to the film.

use super::learning::{Learnt, is_reported};
use crate::film::{FirstHit, Pass, Rect, Sample, SplatBuffer};
use crate::integrators::{Context, StageCosts, locked};
use crate::math::Sampler;
use crate::math::sampler::hash;
use crate::shading::{SurfaceClass, World};
use crate::transport::bridge::{BridgeSampler, Bridges, Choice};
use crate::transport::camera::{CameraSampler, Primary};
use crate::transport::cluster::{Areas, Cluster, Clusters, Numbered};
use crate::transport::economy::Work;
use crate::transport::glances;
use crate::transport::grid::Grid;
use crate::transport::light::LightSampler;
use crate::transport::outline::{clear_pixels, ends};
use crate::transport::propagate::Reflected;
use crate::transport::store::{CameraStore, LightStore};
use crate::transport::weigh::{Sampled, Weights};
use crate::transport::{Cut, Estimator, Techniques};
use glam::Vec3;
use rayon::prelude::*;
use std::mem::take;
use std::sync::atomic::Ordering::Relaxed;

/// Keeps the random numbers of light paths apart from those of pixels.
const LIGHT_STREAM: u32 = 0x11e4_7000;
/// Keeps those of the grids apart from both.
const GRID_STREAM: u32 = 0x961d_0000;
/// Keeps those of bridges apart.
const BRIDGE_STREAM: u32 = 0xb21d_9e00;

/// Camera paths, and light paths, by which it is found how long they are.
const PILOTS: usize = 256;

/// Arrivals of a path, on average.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lengths {
    /// Of a camera path, on diffuse surfaces.
    pub diffuse: f32,
    /// Of a camera path, on others.
    pub other: f32,
    /// Of a light path.
    pub light: f32,
}

/// The random numbers of a light path.
fn light_random(context: &Context, path: u32, index: u32) -> Sampler {
    // Leaving one out takes light paths to be independent of each other. Stratified among each other, those of
    // an iteration are not: given one photon, fewer others lie nearby. They are from iteration to iteration.
    Sampler::new(context.seed ^ LIGHT_STREAM, path, index)
}

/// What is sampled of a band, how it is clustered, and what comes of it. The light paths are those of all bands.
#[derive(Debug, Default)]
pub(super) struct Band {
    techniques: Techniques,
    camera: CameraStore,
    pub light: LightStore,
    clusters: Clusters,
    bridges: Bridges,
    splats: SplatBuffer,
    pub weights: Weights,
    pub reflected: Reflected,
    /// What every pixel sees, row by row.
    pub primaries: Vec<Primary>,
    /// For every pixel, whether the surface that it sees goes on around it.
    pub is_clear: Vec<bool>,
    /// The first surface that every pixel sees, if a pass asks for it.
    first_hits: Vec<Option<FirstHit>>,
    /// For every pixel, the size of the voxel in which it is filtered, octaves over the kernel's.
    octaves: Vec<f32>,
    /// First arrival of every camera path that has one.
    starts: Vec<u32>,
    /// How much of the light is beyond the camera's own paths, see [`Reflected::beyond_own_paths`]; only in iterations that are reported.
    pub beyond: f64,
}

impl Band {
    /// Of nothing yet.
    pub fn new(techniques: Techniques) -> Self {
        Self { techniques, ..Self::default() }
    }

    /// What was sampled, with the scene.
    pub fn sampled<'a>(&'a self, world: &'a World) -> Sampled<'a> {
        let bridges = self.techniques.bridges.map(|_| &self.bridges);
        Sampled { world, camera: &self.camera, light: &self.light, clusters: &self.clusters, bridges }
    }

    /// Basic radiance that is reflected at the end of a primary segment.
    pub fn seen(&self, sampled: Sampled, primary: &Primary) -> Vec3 {
        primary.arrival.map_or(Vec3::ZERO, |a| self.reflected.towards_camera(sampled, a as usize))
    }

    /// What was done up to the film but for rays, as far as it would have been without light paths.
    pub fn work(&self) -> Work {
        let of_cluster = |c: &Cluster| match c.class {
            SurfaceClass::Diffuse => 0,
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => u64::from(c.cameras).pow(2),
        };
        Work {
            rays: 0,
            pixels: self.primaries.len() as u64,
            arrivals: self.camera.arrivals.len() as u64,
            pairs: self.clusters.clusters.iter().map(of_cluster).sum(),
        }
    }

    /// All stages up to the film. Returns `false` if it was stopped.
    pub fn transport(
        &mut self,
        context: &Context,
        learnt: &Learnt,
        index: u32,
        light_paths: f32,
        cut: &Cut,
        costs: &mut StageCosts,
    ) -> bool {
        let Context { world, sensor, .. } = *context;
        self.forget();
        self.beyond = 0.0;
        if !self.sample_camera(context, learnt, index, light_paths, cut) {
            return false;
        }
        costs.stage("sampling", self.camera.bytes() + self.light.bytes());

        let edge = self.techniques.kernel.edge(context.completed);
        let grid = Grid::new(sensor, edge, hash(context.seed ^ GRID_STREAM, index))
            .with_sizes(learnt.adaptation.sizes());
        self.is_clear = clear_pixels(context.crop.width, sensor, &self.primaries, &self.camera.arrivals);
        let ends = ends(&self.primaries, &self.is_clear);
        let all = Numbered { camera: &self.camera.arrivals, light: &self.light.arrivals, ends: &ends };
        // bridges may begin at any light arrival; the other estimators follow light paths to their ends
        let needs_all = context.keep_all
            || self.techniques.estimator != Estimator::LeaveOneOut
            || self.techniques.bridges.is_some();
        let clusters = &mut self.clusters;
        let is_done = match needs_all {
            true => clusters.group(world, &grid, all, cut),
            false => clusters.group_seen(world, &grid, all, cut),
        };
        if !is_done {
            return false;
        }
        let clusters = &self.clusters;
        costs.hold(self.held() + clusters.most_bytes() - clusters.bytes());
        costs.stage("clustering", clusters.bytes());
        let areas = match self.techniques.estimator {
            _ if light_paths == 0.0 => Areas::None,
            Estimator::LeaveOneOut | Estimator::WholePath => Areas::OfPhotons,
            Estimator::Literal => Areas::True,
        };
        if !self.clusters.measure(world, &grid, all, areas, cut) {
            return false;
        }
        costs.stage("areas", 0);
        self.octaves.clear();
        self.octaves.extend(self.primaries.iter().map(|p| match p.arrival {
            Some(a) => grid.octaves(self.camera.arrivals.position(a as usize)),
            None => 0.0,
        }));
        context.counters.segments.fetch_max(self.segments() as u64, Relaxed);

        if let Some(choice) = self.techniques.bridges {
            if !self.sample_bridges(context, index, choice, cut) {
                return false;
            }
            costs.stage("bridges", self.bridges.bytes() + self.splats.bytes());
        }
        let mut weights = take(&mut self.weights);
        let is_done = weights.weigh(self.sampled(context.world), self.techniques.estimator, cut);
        self.weights = weights;
        if !is_done {
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
        let mut reflected = take(&mut self.reflected);
        let (sampled, weights) = (self.sampled(world), &self.weights);
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
        self.reflected = reflected;
        costs.hold(self.held() + self.reflected.most_bytes() - self.reflected.bytes());
        costs.stage("propagation", self.reflected.bytes());
        context.counters.dropped.fetch_add(self.camera.dropped, Relaxed);
        if solved && is_reported(context.completed) {
            let sweeps = match (self.techniques.estimator, context.max_depth) {
                (Estimator::LeaveOneOut, None) => context.operator_sweeps,
                _ => 0,
            };
            let sampled = self.sampled(world);
            let report = self.reflected.report(sampled, &self.weights, &self.starts, sweeps, cut);
            *locked(&context.counters.graph) = Some(report);
            if self.techniques.camera_paths && self.techniques.bridges.is_none() {
                let (weights, starts, most) = (&self.weights, &self.starts, context.max_depth);
                self.beyond = self.reflected.beyond_own_paths(sampled, weights, starts, most, cut);
            }
            costs.stage("report", 0);
        }
        solved
    }

    fn camera_sampler<'a>(
        &self,
        context: &'a Context,
        learnt: &'a Learnt,
        light_paths: f32,
    ) -> CameraSampler<'a> {
        CameraSampler {
            world: context.world,
            sensor: context.sensor,
            guide: &learnt.guiding.guide,
            light_paths,
            transparent_background: context.transparent_background,
            max_depth: context.max_depth,
            next_event: self.techniques.next_event,
            goes_on: self.techniques.camera_paths,
        }
    }

    /// How long some paths are.
    pub fn lengths(&self, context: &Context, learnt: &Learnt) -> Lengths {
        let sampler = self.camera_sampler(context, learnt, 0.0);
        let (width, area) = (context.crop.width as usize, context.crop.area());
        let pixels: Vec<usize> = (0..area).step_by(area.div_ceil(PILOTS)).collect();
        let of_camera = |&pixel: &usize| {
            let (ray, mut random) = context.camera_sample((pixel % width) as u32, (pixel / width) as u32, 0);
            let mut store = CameraStore::default();
            sampler.path(&ray, &mut random, &mut store, &mut 0);
            let diffuse = store.arrivals.iter().filter(|a| a.class == SurfaceClass::Diffuse).count();
            [diffuse, store.arrivals.len() - diffuse]
        };
        let sampler = self.light_sampler(context, learnt, PILOTS as f32);
        let of_light = |k: u32| {
            let mut store = LightStore::default();
            sampler.path(k, &mut light_random(context, k, 0), &mut store, &mut 0);
            store.arrivals.len()
        };
        let camera = pixels.par_iter().map(of_camera).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        let light: usize = (0..PILOTS as u32).into_par_iter().map(of_light).sum();
        let [diffuse, other] = camera.map(|count| count as f32 / pixels.len() as f32);
        Lengths { diffuse, other, light: light as f32 / PILOTS as f32 }
    }

    fn light_sampler<'a>(&self, context: &'a Context, learnt: &'a Learnt, paths: f32) -> LightSampler<'a> {
        LightSampler {
            world: context.world,
            guide: &learnt.guiding.guide,
            paths,
            next_event: self.techniques.next_event,
            estimator: self.techniques.estimator,
        }
    }

    fn sample_camera(
        &mut self,
        context: &Context,
        learnt: &Learnt,
        index: u32,
        light_paths: f32,
        cut: &Cut,
    ) -> bool {
        let sampler = self.camera_sampler(context, learnt, light_paths);
        let wants_first_hits = context.film.passes().iter().any(Pass::is_of_surfaces);
        let path = |x: u32, y: u32, (store, seen): &mut (CameraStore, Vec<_>), rays: &mut u64| {
            let (ray, mut random) = context.camera_sample(x, y, index);
            let (mut primary, first_hit) = sampler.path(&ray, &mut random, store, rays);
            let more = 1..learnt.glances.number(x + context.crop.x, y + context.crop.y);
            if !more.is_empty() {
                primary.average(more.map(|k| {
                    let (ray, mut random) = context.further_camera_sample(x, y, index, k, glances::MOST);
                    sampler.glance(&ray, &mut random, rays)
                }));
            }
            seen.push((primary, first_hit));
        };
        self.camera.clear();
        self.primaries.clear();
        self.first_hits.clear();
        self.starts.clear();
        let pixels = context.crop.area();
        self.primaries.reserve_exact(pixels);
        self.starts.reserve_exact(pixels);
        self.first_hits.reserve_exact(if wants_first_hits { pixels } else { 0 });
        let camera = &mut self.camera;
        context.camera_paths(path, |made| {
            camera.reserve(made.iter().map(|m| &m.0));
            for (mut store, seen) in made {
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

    /// So many light paths, for all bands. Returns `false` if it was stopped.
    pub fn sample_light(
        &mut self,
        context: &Context,
        learnt: &Learnt,
        index: u32,
        paths: u32,
        cut: &Cut,
    ) -> bool {
        let sampler = self.light_sampler(context, learnt, paths as f32);
        let path = |k: usize, store: &mut LightStore, rays: &mut u64| {
            sampler.path(k as u32, &mut light_random(context, k as u32, index), store, rays);
        };
        let light = &mut self.light;
        light.clear();
        context.paths(paths as usize, path, |made| {
            light.reserve(made.iter());
            made.into_iter().for_each(|mut store| light.append(&mut store));
        });
        !cut.is_raised()
    }

    /// Bridges between what was sampled and clustered, and what they send to the lens.
    fn sample_bridges(&mut self, context: &Context, index: u32, choice: Choice, cut: &Cut) -> bool {
        let Context { world, sensor, filter, crop, max_depth, .. } = *context;
        let mut bridges = take(&mut self.bridges);
        let sampled = Sampled { bridges: None, ..self.sampled(world) };
        let mut seen = vec![0.0; sampled.camera.arrivals.len()];
        for p in self.primaries.iter().filter(|p| p.passages == 0) {
            if let Some(a) = p.arrival {
                seen[a as usize] = p.density;
            }
        }
        let seed = context.seed ^ BRIDGE_STREAM;
        let sampler = BridgeSampler { sampled, sensor, choice, seed, index, filter, crop, max_depth };
        let mut rays = 0;
        let is_done = bridges.sample(&sampler, seen, &mut rays, cut);
        self.bridges = bridges;
        context.counters.rays.fetch_add(rays, Relaxed);
        self.splats.collect(&self.bridges.splats, filter, crop);
        is_done
    }

    /// Gives back what it was clustered, weighed and solved with.
    pub fn forget(&mut self) {
        (self.clusters, self.weights, self.reflected) = Default::default();
    }

    /// What is held of the iteration now, bytes.
    pub fn held(&self) -> usize {
        self.camera.bytes()
            + self.light.bytes()
            + self.clusters.bytes()
            + self.bridges.bytes()
            + self.splats.bytes()
            + self.weights.bytes()
            + self.reflected.bytes()
            + self.primaries.capacity() * size_of::<Primary>()
            + self.first_hits.capacity() * size_of::<Option<FirstHit>>()
            + self.is_clear.capacity() * size_of::<bool>()
            + (self.starts.capacity() + self.octaves.capacity()) * size_of::<f32>()
    }

    /// Segments of this band.
    fn segments(&self) -> usize {
        self.camera.segments(self.primaries.len()) + self.light.arrivals.len()
    }

    /// One sample for every pixel; `band` is its place on the film.
    pub fn gather(&self, context: &Context, band: Rect) {
        let sampled = self.sampled(context.world);
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
