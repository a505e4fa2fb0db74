//! Segment-based light transport: the whole method, iteration by iteration.

mod band;
mod learning;

use super::{Context, Integrator, IterationEnd, StageCosts};
use crate::film::Rect;
use crate::transport::camera::Primary;
use crate::transport::{Cut, Techniques};
use band::Band;
use learning::Learnt;
use std::sync::atomic::Ordering::Relaxed;

/// What the segments of a camera path take until they are in the film, about, bytes.
const BYTES_PER_PIXEL: u64 = 2048;
/// Most light paths for each pixel of a band, so that theirs stay within bounds, too.
const LIGHT_PATHS_PER_PIXEL: u64 = 4;

/// Segment-based light transport. Its stores are kept from one iteration to the next.
#[derive(Debug, Default)]
pub struct Segment {
    techniques: Techniques,
    band: Band,
    learnt: Learnt,
}

impl Segment {
    /// With these techniques.
    pub fn new(techniques: Techniques) -> Self {
        Self { techniques, band: Band::new(techniques), learnt: Learnt::default() }
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
        self.band = Band::new(self.techniques);
    }
}

impl Segment {
    /// An iteration: light paths, and band by band the camera paths that they are joined to. Returns `false` if it was
    /// stopped.
    fn all_bands(&mut self, context: &Context, index: u32, cut: &Cut, costs: &mut StageCosts) -> bool {
        let rays_before = context.counters.rays.load(Relaxed);
        let bands = self.bands(context);
        let all = self.most_light_paths(context);
        let Self { techniques, band, learnt } = self;
        let light_paths = learnt.light_paths(context, techniques, all, index);
        if !band.sample_light(context, learnt, index, light_paths as u32, cut) {
            return false;
        }
        costs.stage("sampling", band.light.bytes());
        let arrived = band.light.starts.len();
        let mut lessons = learnt.begin(context, *techniques, index, light_paths, arrived, bands.len());
        for (k, place) in bands.into_iter().enumerate() {
            let crop = Rect { x: context.crop.x + place.x, y: context.crop.y + place.y, ..place };
            let of_band = Context { crop, ..*context };
            if !band.transport(&of_band, learnt, index, light_paths, cut, costs) {
                return false;
            }
            let before = lessons.before(context, place);
            band.gather(&of_band, place);
            costs.stage("gather", band.primaries.capacity() * size_of::<Primary>());
            learnt.take_in(&of_band, (k, place, band), before, &mut lessons, cut, costs);
        }
        let rays = context.counters.rays.load(Relaxed) - rays_before;
        learnt.end(context, &lessons, rays, cut, costs);
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
}
