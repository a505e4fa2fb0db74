//! The render loop as the outside sees it: start, iterate until a limit, progress, cancel, snapshots,
//! statistics.

pub mod clock;
pub mod settings;
pub mod statistics;

use crate::film::{ErrorEstimate, Film, FilmError, Rect};
use crate::integrators::path::Path;
use crate::integrators::segment::Segment;
use crate::integrators::vertices::Vertices;
use crate::integrators::{Context, Counters, Integrator, IterationEnd, StopSign, locked};
use crate::scene::{Scene, SceneError};
use crate::shading::{BuildCost, Sensor, World, WorldError};
use crate::transport::{Estimator, Techniques};
use clock::Stopwatch;
use serde::Serialize;
use settings::{Method, Settings};
use statistics::{CurvePoint, Stage, Statistics, StopReason};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Why a render could not be set up.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum SessionError {
    #[error("{0}")]
    Settings(String),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    World(#[from] WorldError),
    #[error(transparent)]
    Film(#[from] FilmError),
    #[error("the threads could not be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    #[error("a defect of the engine: {0}")]
    Panic(String),
}

/// How far a render is.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Progress {
    /// Share of the work that is done, in `[0,1]`, by the nearest limit.
    pub fraction: f64,
    /// Seconds of rendering so far.
    pub seconds: f64,
    /// Expected seconds to the end.
    pub remaining: Option<f64>,
    /// Samples a pixel so far.
    pub samples: f64,
    /// Last estimate of the relative mean squared error.
    pub estimated_error: Option<f64>,
    /// The part of it that is systematic, where the method can tell.
    pub estimated_bias: Option<f64>,
    /// What is being done.
    pub stage: &'static str,
}

/// Receives news of a running render, on the thread that runs it.
pub trait Events {
    /// How far it is. Returning `true` cancels.
    fn progress(&mut self, progress: &Progress) -> bool;
    /// A rectangle of the film has new content.
    fn tile(&mut self, rect: Rect);
}

/// A render: a scene, ready to be traced, and a film that fills.
pub struct Session {
    settings: Settings,
    world: World,
    sensor: Sensor,
    film: Film,
    pool: rayon::ThreadPool,
    build: BTreeMap<String, Stage>,
    warnings: Vec<String>,
    counters: Counters,
    stop: StopSign,
    cancelled: AtomicBool,
    state: Mutex<State>,
    integrator: Mutex<Box<dyn Integrator>>,
}

/// What changes from iteration to iteration.
struct State {
    /// Iterations that were begun: their random numbers are spent.
    begun: u32,
    /// Iterations that came to their end.
    iterations: u32,
    seconds: f64,
    cpu_seconds: f64,
    error: Option<ErrorEstimate>,
    curve: Vec<CurvePoint>,
    next_curve_point: f64,
    stop_reason: StopReason,
}

/// Least number of samples a pixel on which an error is estimated.
const MIN_SAMPLES_FOR_ERROR: u32 = 4;
/// Ratio of the run times at which neighbouring points of the error curve are taken.
const CURVE_RATIO: f64 = 1.25;
/// Time between looks at the clock and calls of the progress callback.
const POLL: Duration = Duration::from_millis(20);
/// Side of the rectangles in which new content is announced, pixels.
const ANNOUNCED: u32 = 256;

/// The method that the settings name.
fn integrator(settings: &Settings) -> Box<dyn Integrator> {
    let techniques = settings.techniques;
    let Techniques { kernel, light_paths, .. } = techniques;
    match settings.method {
        Method::Path => Box::new(Path),
        Method::Segment | Method::SegmentBridge => Box::new(Segment::new(techniques)),
        Method::Mvf => Box::new(Segment::new(Techniques { light_paths: 0.0, ..techniques })),
        Method::PhotonFilter => Box::new(Segment::new(Techniques { camera_paths: false, ..techniques })),
        Method::SegmentPath => {
            Box::new(Segment::new(Techniques { estimator: Estimator::WholePath, ..techniques }))
        }
        Method::Light => Box::new(Vertices::light_tracing(light_paths)),
        Method::Bdpt => Box::new(Vertices::bidirectional(light_paths)),
        Method::Ppm => Box::new(Vertices::photon_mapping(kernel, light_paths)),
        Method::Bpm => Box::new(Vertices::bidirectional_photon_mapping(kernel, light_paths)),
        Method::Vcm => Box::new(Vertices::connection_and_merging(kernel, light_paths)),
    }
}

impl Session {
    /// Builds what rendering the scene needs.
    pub fn new(scene: Scene, settings: Settings) -> Result<Self, SessionError> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build()?;
        let film = Film::new(settings.crop.width, settings.crop.height, settings.passes)?;
        let sensor = Sensor::new(&scene.camera, settings.resolution[0], settings.resolution[1]);
        let world = pool.install(|| World::new(Arc::new(scene), settings.keep_all))?;
        let world = match settings.kept_paths() {
            Some(paths) => world.with_kept_paths(paths),
            None => world,
        };
        let cost = |c: &BuildCost| (c.name.to_string(), Stage { seconds: c.seconds, bytes: c.bytes });
        let mut build: BTreeMap<String, Stage> = world.costs().iter().map(cost).collect();
        let bytes = Film::memory_bytes(film.width(), film.height(), settings.passes);
        build.insert("film".into(), Stage { seconds: 0.0, bytes });
        Ok(Self {
            integrator: Mutex::new(integrator(&settings)),
            sensor,
            film,
            pool,
            build,
            warnings: world.warnings().lines(),
            world,
            settings,
            counters: Counters::default(),
            stop: StopSign::default(),
            cancelled: AtomicBool::new(false),
            state: Mutex::new(State {
                begun: 0,
                iterations: 0,
                seconds: 0.0,
                cpu_seconds: 0.0,
                error: None,
                curve: Vec::new(),
                next_curve_point: 0.0,
                stop_reason: StopReason::Running,
            }),
        })
    }

    /// The film; may be read at any time.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// The settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The scene as it is rendered.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Stops a running render as soon as its workers notice, or the next one before it begins.
    pub fn cancel(&self) {
        self.cancelled.store(true, Relaxed);
        self.stop.raise();
    }

    /// Renders until a limit is reached or it is cancelled. Run again, it starts from where it stopped,
    /// with its time limit anew and with what it had learnt.
    pub fn run(&self, events: &mut dyn Events) -> Result<StopReason, SessionError> {
        let mut integrator = locked(&self.integrator);
        locked(&self.state).stop_reason = StopReason::Running;
        let watch = Stopwatch::start();
        let (before, cpu_before) = {
            let s = locked(&self.state);
            (s.seconds, s.cpu_seconds)
        };
        let announcements = Announcements::new(self.film.rect());
        let ends_early = !integrator.is_all_or_nothing();
        let method = &mut **integrator;
        let (done, finished) = channel();
        let reason = std::thread::scope(|scope| {
            let worker = scope.spawn(|| {
                let tile_done = |rect: Rect| announcements.add(rect);
                // owned here, so that a panic drops it and the listener learns of that, too
                let done = done;
                let reason = self.iterate(method, &tile_done, &watch, (before, cpu_before));
                // nobody listens any more only if the listener panicked
                let _ = done.send(());
                reason
            });
            let mut last_tiles = 0.0;
            loop {
                let over = !matches!(finished.recv_timeout(POLL), Err(RecvTimeoutError::Timeout));
                let seconds = watch.seconds();
                if !self.cancelled.load(Relaxed) && events.progress(&self.progress(before + seconds)) {
                    self.cancel();
                }
                let is_late = self.settings.limits.seconds.is_some_and(|limit| seconds >= limit);
                // every pixel has one sample at least
                if ends_early && is_late && locked(&self.state).iterations > 0 {
                    self.stop.raise();
                }
                // showing pixels costs time: often at first, then ever more rarely
                if over || seconds - last_tiles > (0.1 * seconds).clamp(0.25, 5.0) {
                    last_tiles = seconds;
                    announcements.take().into_iter().for_each(|r| events.tile(r));
                }
                if over {
                    return worker.join();
                }
            }
        });
        self.stop.lower();
        let cancelled = self.cancelled.swap(false, Relaxed);
        let reason = reason.map_err(|panic| {
            // it may have been left half-done
            *integrator = self::integrator(&self.settings);
            SessionError::Panic(panic_text(&*panic))
        })?;
        integrator.rest();
        let reason = if cancelled { StopReason::Cancelled } else { reason };
        let mut state = locked(&self.state);
        state.stop_reason = reason;
        Ok(reason)
    }

    fn iterate(
        &self,
        integrator: &mut dyn Integrator,
        tile_done: &(dyn Fn(Rect) + Sync),
        watch: &Stopwatch,
        (before, cpu_before): (f64, f64),
    ) -> StopReason {
        let context = |completed: u32| Context {
            completed,
            keep_all: self.settings.keep_all,
            operator_sweeps: self.settings.operator_sweeps,
            world: &self.world,
            sensor: &self.sensor,
            film: &self.film,
            crop: self.settings.crop,
            filter: &self.settings.filter,
            max_depth: self.settings.max_depth,
            seed: self.settings.seed,
            transparent_background: self.settings.transparent_background,
            stop: &self.stop,
            counters: &self.counters,
            tile_done,
        };
        let limits = self.settings.limits;
        let mut last = 0.0;
        loop {
            let (iterations, index) = {
                let state = locked(&self.state);
                (state.iterations, state.begun)
            };
            if limits.samples.is_some_and(|n| iterations >= n) {
                self.note(watch, before, cpu_before, true);
                return StopReason::Samples;
            }
            let began = watch.seconds();
            // an iteration that would be thrown away is not begun, but there is one at least
            let too_late = |limit: f64| began + 0.5 * last >= limit;
            if integrator.is_all_or_nothing() && iterations > 0 && limits.seconds.is_some_and(too_late) {
                self.note(watch, before, cpu_before, true);
                return StopReason::Time;
            }
            if !self.stop.is_raised() {
                let end = self.pool.install(|| integrator.iterate(&context(iterations), index));
                let mut state = locked(&self.state);
                // one that leaves nothing when it is cut short is not gone on with, and its samples must not be drawn again
                if end == IterationEnd::Complete || integrator.is_all_or_nothing() {
                    state.begun = index.saturating_add(1);
                }
                if end == IterationEnd::Complete {
                    state.iterations = iterations.saturating_add(1);
                }
            }
            last = watch.seconds() - began;
            if self.stop.is_raised() {
                self.note(watch, before, cpu_before, true);
                return StopReason::Time;
            }
            let error = self.note(watch, before, cpu_before, false);
            if let (Some(limit), Some(error)) = (limits.error, error)
                && error <= limit
            {
                return StopReason::Error;
            }
        }
    }

    /// Keeps the clock, and at growing intervals (or at the `end`) estimates the error. Returns an estimate
    /// only where it is new.
    fn note(&self, watch: &Stopwatch, before: f64, cpu_before: f64, end: bool) -> Option<f64> {
        let mut state = locked(&self.state);
        state.seconds = before + watch.seconds();
        state.cpu_seconds = cpu_before + watch.cpu_seconds();
        if !end && state.seconds < state.next_curve_point {
            return None;
        }
        state.next_curve_point = state.seconds * CURVE_RATIO;
        let enough = state.iterations >= MIN_SAMPLES_FOR_ERROR;
        let hints = *locked(&self.counters.hints);
        let estimate = enough.then(|| self.pool.install(|| self.film.estimated_error(hints))).flatten();
        state.error = estimate.or(state.error);
        let point = CurvePoint {
            seconds: state.seconds,
            cpu_seconds: state.cpu_seconds,
            samples: self.mean_samples(),
            estimated_error: estimate.map(|e| e.total()),
            estimated_bias: estimate.and_then(|e| e.bias),
        };
        state.curve.push(point);
        point.estimated_error
    }

    fn mean_samples(&self) -> f64 {
        self.film.total_samples() as f64 / self.film.rect().area() as f64
    }

    fn progress(&self, seconds: f64) -> Progress {
        let state = locked(&self.state);
        let limits = &self.settings.limits;
        let samples = state.iterations as f64;
        let by_samples = limits.samples.map(|n| samples / n as f64);
        let by_time = limits.seconds.map(|t| seconds / t);
        // the error falls as one over the samples
        let by_error = limits.error.zip(state.error).map(|(limit, e)| limit / e.total());
        let fraction =
            [by_samples, by_time, by_error].into_iter().flatten().fold(0.0, f64::max).clamp(0.0, 1.0);
        Progress {
            fraction,
            seconds,
            remaining: (fraction > 0.0).then(|| seconds * (1.0 - fraction) / fraction),
            samples,
            estimated_error: state.error.map(|e| e.total()),
            estimated_bias: state.error.and_then(|e| e.bias),
            stage: "rendering",
        }
    }

    /// How far the render is.
    pub fn current_progress(&self) -> Progress {
        let seconds = locked(&self.state).seconds;
        self.progress(seconds)
    }

    /// The figures so far.
    pub fn statistics(&self) -> Statistics {
        let state = locked(&self.state);
        let mut stages = self.build.clone();
        let counted = locked(&self.counters.stages);
        let segments = self.counters.segments.load(Relaxed);
        let told = self.counters.held.load(Relaxed);
        let of_stages = || counted.values().map(|&(_, bytes)| bytes).sum();
        let held: u64 = if told > 0 { told } else { of_stages() };
        for (&name, &(seconds, bytes)) in counted.iter() {
            stages.insert(name.into(), Stage { seconds, bytes });
        }
        if counted.is_empty() {
            stages.insert("sampling".into(), Stage { seconds: state.seconds, bytes: 0 });
        }
        Statistics {
            integrator: serde_json::to_value(self.settings.method)
                .ok()
                .and_then(|v| v.as_str().map(String::from))
                .unwrap_or_default(),
            seconds: state.seconds,
            cpu_seconds: state.cpu_seconds,
            build_seconds: self.build.values().map(|s| s.seconds).sum(),
            samples: self.mean_samples(),
            rays: self.counters.rays.load(Relaxed),
            segments,
            bytes_per_segment: held as f64 / segments.max(1) as f64,
            peak_memory_bytes: clock::peak_memory_bytes(),
            non_finite: self.film.rejected_samples(),
            dropped: self.counters.dropped.load(Relaxed),
            graph: locked(&self.counters.graph).clone(),
            estimated_error: state.error.map(|e| e.total()),
            estimated_bias: state.error.and_then(|e| e.bias),
            threads: self.pool.current_num_threads(),
            seed: self.settings.seed,
            width: self.film.width(),
            height: self.film.height(),
            stop_reason: state.stop_reason,
            stages,
            left_out: [self.world.needs().left_out(), locked(&self.counters.left_out).clone()].concat(),
            warnings: self.warnings.clone(),
            curve: state.curve.clone(),
        }
    }
}

/// The text of a panic's payload.
pub fn panic_text(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| s.to_string())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "a panic without a message".into())
}

/// Parts of the film with new content, gathered between announcements.
struct Announcements {
    film: Rect,
    across: u32,
    dirty: Vec<AtomicU32>,
}

impl Announcements {
    fn new(film: Rect) -> Self {
        let (across, down) = (film.width.div_ceil(ANNOUNCED), film.height.div_ceil(ANNOUNCED));
        Self { film, across, dirty: (0..across * down).map(|_| AtomicU32::new(0)).collect() }
    }

    fn add(&self, tile: Rect) {
        let block = tile.y / ANNOUNCED * self.across + tile.x / ANNOUNCED;
        self.dirty[block as usize].store(1, Relaxed);
    }

    fn take(&self) -> Vec<Rect> {
        let blocks = self.dirty.iter().enumerate().filter(|(_, d)| d.swap(0, Relaxed) != 0);
        blocks
            .filter_map(|(i, _)| {
                let (x, y) = (i as u32 % self.across * ANNOUNCED, i as u32 / self.across * ANNOUNCED);
                Rect::new(x, y, ANNOUNCED, ANNOUNCED).intersection(&self.film)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests;
