//! Light transport methods. Each is driven iteration by iteration through [`Integrator`]; all share the
//! samplers, lobes, lights and the film.

pub mod path;
pub mod segment;
mod shown;
pub mod vertices;

use crate::film::{Film, Filter, Hints, Rect, Sample};
use crate::math::Sampler;
use crate::shading::{CameraRay, Sensor, World};
use crate::transport::report::Report;
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The stop sign of a render: set from any thread, looked at by the workers between small pieces of work.
#[derive(Debug, Default)]
pub struct StopSign(AtomicBool);

impl StopSign {
    /// Asks the workers to stop.
    pub fn raise(&self) {
        self.0.store(true, Relaxed);
    }

    /// Allows work again.
    pub fn lower(&self) {
        self.0.store(false, Relaxed);
    }

    /// Whether to stop.
    #[inline]
    pub fn is_raised(&self) -> bool {
        self.0.load(Relaxed)
    }
}

/// What integrators count.
#[derive(Debug, Default)]
pub struct Counters {
    /// Rays traced, shadow rays included.
    pub rays: AtomicU64,
    /// Most segments of an iteration, where there are any.
    pub segments: AtomicU64,
    /// What turned out not to pay and is left out, where an integrator looks.
    pub left_out: Mutex<Vec<String>>,
    /// What an integrator knows of its systematic error.
    pub hints: Mutex<Hints>,
    /// Contributions of segments that were not finite and were dropped.
    pub dropped: AtomicU64,
    /// The graph of the segment method, from the last iteration in which it was looked at (its last band).
    pub graph: Mutex<Option<Report>>,
    /// The most that an iteration held at a time, bytes, where an integrator tells.
    pub held: AtomicU64,
    /// Seconds spent in each stage, and the bytes that it holds.
    pub stages: Mutex<BTreeMap<&'static str, (f64, u64)>>,
}

/// What is behind a lock, also after a thread panicked with it: figures, whole at any time, or what is then made anew.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds up what the stages of an iteration cost, one after the other.
pub struct StageCosts<'a> {
    counters: &'a Counters,
    since: Instant,
}

impl<'a> StageCosts<'a> {
    /// The first stage begins.
    pub fn new(counters: &'a Counters) -> Self {
        Self { counters, since: Instant::now() }
    }

    /// So many bytes are held at this moment, or were at the worst one since the last stage.
    pub fn hold(&self, bytes: usize) {
        self.counters.held.fetch_max(bytes as u64, Relaxed);
    }

    /// A stage ends, and holds `bytes` of memory; the next begins.
    pub fn stage(&mut self, name: &'static str, bytes: usize) {
        let now = Instant::now();
        let seconds = now.duration_since(self.since).as_secs_f64();
        self.since = now;
        let mut stages = locked(&self.counters.stages);
        let stage = stages.entry(name).or_default();
        stage.0 += seconds;
        stage.1 = stage.1.max(bytes as u64);
    }
}

/// What an integrator needs to know of a render.
pub struct Context<'a> {
    /// The scene, ready to be traced and shaded.
    pub world: &'a World,
    /// The camera.
    pub sensor: &'a Sensor,
    /// Where the picture goes. Its pixel (0,0) is the corner of `crop`.
    pub film: &'a Film,
    /// The part of the full film that is rendered.
    pub crop: Rect,
    /// Pixel filter.
    pub filter: &'a Filter,
    /// Bounces; `None` is unlimited.
    pub max_depth: Option<u32>,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Whether what lies behind everything is transparent.
    pub transparent_background: bool,
    /// Leave nothing out, however little it brings.
    pub keep_all: bool,
    /// Sweeps by which the transfer operator is examined; zero: not at all.
    pub operator_sweeps: u32,
    /// Iterations that were completed before.
    pub completed: u32,
    /// Looked at at least every few milliseconds.
    pub stop: &'a StopSign,
    /// Event counts.
    pub counters: &'a Counters,
    /// Told of every tile of the film that has new content.
    pub tile_done: &'a (dyn Fn(Rect) + Sync),
}

impl Context<'_> {
    /// The camera ray of sample `index` of a pixel of the film, and the random numbers of the path that it begins.
    /// Even and odd samples are two independent sequences, as the film's two halves must be.
    pub fn camera_sample(&self, x: u32, y: u32, index: u32) -> (CameraRay, Sampler) {
        self.camera_ray(x, y, self.seed ^ ((index & 1) << 31), index >> 1)
    }

    /// Number `k` of up to `most` more such samples, of the same kind and independent of the others.
    pub fn further_camera_sample(
        &self,
        x: u32,
        y: u32,
        index: u32,
        k: u32,
        most: u32,
    ) -> (CameraRay, Sampler) {
        let seed = self.seed ^ GLANCE_STREAM ^ ((index & 1) << 31);
        self.camera_ray(x, y, seed, (index >> 1).wrapping_mul(most).wrapping_add(k))
    }

    fn camera_ray(&self, x: u32, y: u32, seed: u32, number: u32) -> (CameraRay, Sampler) {
        let (full_x, full_y) = (x + self.crop.x, y + self.crop.y);
        let mut sampler = Sampler::new(seed, full_y.wrapping_mul(1 << 16) ^ full_x, number);
        let centre = Vec2::new(full_x as f32 + 0.5, full_y as f32 + 0.5);
        let film = centre + self.filter.sample(sampler.next_2d());
        let lens = if self.world.needs().depth_of_field { sampler.next_2d() } else { Vec2::ZERO };
        (self.sensor.ray(film, lens), sampler)
    }
}

/// Keeps the random numbers of further camera samples apart from those of the first.
const GLANCE_STREAM: u32 = 0x91a9_ce00;
/// Paths that one task samples.
const TASK: usize = 64;
/// Portions in which tasks are done, so that their stores are not all kept beside what they are put together to.
const PORTIONS: usize = 16;
/// Fewest tasks of a portion for each thread: all should have something to do.
const TASKS_PER_THREAD: usize = 4;

/// So many tasks, portion by portion.
fn portions(tasks: usize) -> impl Iterator<Item = Range<usize>> {
    let least = TASKS_PER_THREAD * rayon::current_num_threads();
    let size = tasks.div_ceil(PORTIONS).max(least);
    (0..tasks).step_by(size).map(move |first| first..tasks.min(first + size))
}

impl Context<'_> {
    /// Samples so many paths, some at a time, each time into a store of their own. `path` samples the path of a number and
    /// adds the rays it takes; `take` is given the stores in order, while the next ones are made. If it is stopped, they
    /// are incomplete.
    fn paths<S: Default + Send>(
        &self,
        paths: usize,
        path: impl Fn(usize, &mut S, &mut u64) + Sync,
        mut take: impl FnMut(Vec<S>) + Send,
    ) {
        let one = |task| self.task(task * TASK..paths.min((task + 1) * TASK), &path);
        let mut made = vec![];
        for tasks in portions(paths.div_ceil(TASK)) {
            // or idle threads would wait for whole runs of tasks
            let next = || tasks.into_par_iter().with_max_len(1).map(one).collect();
            (_, made) = rayon::join(|| take(made), next);
        }
        take(made);
    }

    /// The same for one camera path a pixel, row by row; `path` is given the pixel.
    fn camera_paths<S: Default + Send>(
        &self,
        path: impl Fn(u32, u32, &mut S, &mut u64) + Sync,
        take: impl FnMut(Vec<S>) + Send,
    ) {
        let (width, pixels) = (self.crop.width as usize, self.crop.area());
        let of_pixel = |k, store: &mut S, rays: &mut u64| {
            path((k % width) as u32, (k / width) as u32, store, rays);
        };
        self.paths(pixels, of_pixel, take);
    }

    fn task<S: Default>(&self, paths: Range<usize>, path: impl Fn(usize, &mut S, &mut u64)) -> S {
        let (mut store, mut rays) = (S::default(), 0);
        for k in paths {
            if self.stop.is_raised() {
                break;
            }
            path(k, &mut store, &mut rays);
        }
        self.counters.rays.fetch_add(rays, Relaxed);
        store
    }
}

/// How an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IterationEnd {
    /// All of its samples are in the film.
    Complete,
    /// The stop sign cut it short.
    CutShort,
}

/// One method of computing light transport.
pub trait Integrator: Send {
    /// Adds about one sample a pixel to the film. May return early, with whole samples only, when the
    /// stop sign is raised. `index` counts iterations, for the random numbers; one that was cut short has the same again
    /// and goes on where it ended, unless it is all or nothing.
    fn iterate(&mut self, context: &Context, index: u32) -> IterationEnd;

    /// Whether an iteration that is cut short leaves nothing in the film, or but a few bands of it.
    fn is_all_or_nothing(&self) -> bool;

    /// Called when a render pauses: gives back the memory that only an iteration needs, and keeps what was learnt.
    fn rest(&mut self);
}

/// Adds light that was scattered `bounces` times on its way to the camera.
fn record(sample: &mut Sample, bounces: u32, light: Vec3) {
    sample.radiance += light;
    match bounces {
        0 => sample.emission += light,
        1 => sample.direct += light,
        _ => {}
    }
}
