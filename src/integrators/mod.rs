//! Light transport methods. Each is driven iteration by iteration through [`Integrator`]; all share the
//! samplers, lobes, lights and the film.

pub mod path;

use crate::film::{Film, Filter, Rect};
use crate::shading::{Sensor, World};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};

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

/// Events that integrators count.
#[derive(Debug, Default)]
pub struct Counters {
    /// Rays traced, shadow rays included.
    pub rays: AtomicU64,
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
    /// Looked at at least every few milliseconds.
    pub stop: &'a StopSign,
    /// Event counts.
    pub counters: &'a Counters,
    /// Told of every tile of the film that has new content.
    pub tile_done: &'a (dyn Fn(Rect) + Sync),
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
    /// stop sign is raised. `index` counts the calls, for the random numbers.
    fn iterate(&mut self, context: &Context, index: u32) -> IterationEnd;
}
