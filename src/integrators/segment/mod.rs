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

/// What an arrival and the segment that leaves it take until they are in the film, about, bytes.
const BYTES_PER_ARRIVAL: f32 = 100.0;
/// Arrivals for which there is room at least: for each pixel of a band, with those of a light path, and for each light path.
const LEAST_ARRIVALS: [f32; 2] = [20.0, 5.0];

/// Segment-based light transport. Its stores are kept from one iteration to the next.
#[derive(Debug, Default)]
pub struct Segment {
    techniques: Techniques,
    band: Band,
    learnt: Learnt,
    /// Mean arrivals of a camera path, once they have been counted: closed white rooms have very long ones.
    arrivals: Option<f32>,
}

impl Segment {
    /// With these techniques.
    pub fn new(techniques: Techniques) -> Self {
        Self { techniques, band: Band::new(techniques), ..Self::default() }
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
        let counted = || self.band.mean_arrivals(context, &self.learnt);
        let arrivals = *self.arrivals.get_or_insert_with(counted);
        let bands = self.bands(context, arrivals);
        let all = self.most_light_paths(context, arrivals);
        let Self { techniques, band, learnt, .. } = self;
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

    /// How many there may be of what has so many arrivals each.
    fn affordable(&self, arrivals: f32) -> f32 {
        self.techniques.memory_budget as f32 / (arrivals * BYTES_PER_ARRIVAL)
    }

    /// The parts of the film that are made one after the other: each is clustered for itself, with all light paths. What
    /// bridges bring to the lens may arrive anywhere, so theirs is one. `arrivals`: of a camera path, on average.
    fn bands(&self, context: &Context, arrivals: f32) -> Vec<Rect> {
        if self.techniques.bridges.is_some() {
            return vec![context.film.rect()];
        }
        // light paths are as long
        let of_pixel = (2.0 * arrivals).max(LEAST_ARRIVALS[0]);
        context.film.bands(self.affordable(of_pixel) as u64)
    }

    /// Light paths of an iteration, if all are sampled; they are those of all bands. `arrivals`: of a path, on average.
    fn most_light_paths(&self, context: &Context, arrivals: f32) -> f32 {
        let wanted = (self.techniques.light_paths * context.film.rect().area() as f32).ceil();
        wanted.min(self.affordable(arrivals.max(LEAST_ARRIVALS[1])).floor().max(1.0))
    }
}
