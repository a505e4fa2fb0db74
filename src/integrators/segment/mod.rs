//! Segment-based light transport: the whole method, iteration by iteration.

mod band;
mod learning;

use super::path::Path;
use super::{Context, Integrator, IterationEnd, StageCosts};
use crate::film::Rect;
use crate::transport::camera::Primary;
use crate::transport::{Cut, Techniques};
use band::{Band, Lengths};
use learning::Learnt;
use std::sync::atomic::Ordering::Relaxed;

/// What is held of an iteration until it is in the film, about, bytes: of a pixel, of a camera arrival on a diffuse surface
/// with the segments that leave it, of one on another, whose lobes are kept pair by pair, and of a light arrival.
const BYTES: [f32; 4] = [180.0, 100.0, 300.0, 110.0];
/// Most of the memory budget for light paths, which are there with every band.
const LIGHT_SHARE: f32 = 0.5;

/// Segment-based light transport. Its stores are kept from one iteration to the next.
#[derive(Debug, Default)]
pub struct Segment {
    techniques: Techniques,
    band: Band,
    learnt: Learnt,
    /// Arrivals of paths, once they have been counted: closed white rooms have very many.
    lengths: Option<Lengths>,
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
        if !self.learnt.filters(context, &self.techniques, index) {
            let end = Path.iterate(context, index);
            costs.stage("path tracing", 0);
            if end == IterationEnd::Complete {
                self.learnt.tell_blur(context);
            }
            return end;
        }
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
        let counted = || self.band.lengths(context, &self.learnt);
        let lengths = *self.lengths.get_or_insert_with(counted);
        let all = self.most_light_paths(context, lengths);
        let bands = self.bands(context, lengths, all);
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
        band.forget();
        let rays = context.counters.rays.load(Relaxed) - rays_before;
        learnt.end(context, &lessons, rays, cut, costs);
        true
    }

    /// The parts of the film that are made one after the other: each is clustered for itself, with all light paths. What
    /// bridges bring to the lens may arrive anywhere, so theirs is one.
    fn bands(&self, context: &Context, lengths: Lengths, light_paths: f32) -> Vec<Rect> {
        if self.techniques.bridges.is_some() {
            return vec![context.film.rect()];
        }
        let [pixel, diffuse, other, light] = BYTES;
        let left = self.techniques.memory_budget as f32 - light_paths * lengths.light * light;
        let of_pixel = pixel + lengths.diffuse * diffuse + lengths.other * other;
        context.film.bands((left / of_pixel) as u64)
    }

    /// Light paths of an iteration, if all are sampled; they are those of all bands.
    fn most_light_paths(&self, context: &Context, lengths: Lengths) -> f32 {
        let wanted = (self.techniques.light_paths * context.film.rect().area() as f32).ceil();
        let [.., light] = BYTES;
        let most = LIGHT_SHARE * self.techniques.memory_budget as f32 / (lengths.light * light);
        wanted.min(most.floor().max(1.0))
    }
}
