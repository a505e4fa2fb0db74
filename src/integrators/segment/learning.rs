//! What iterations teach later ones: where light paths begin and how many pay, the kernel's sizes, how often pixels look for
//! lights. Everything rests on earlier iterations alone.

use super::band::Band;
use crate::film::Rect;
use crate::integrators::shown::{Rows, Shown};
use crate::integrators::{Context, StageCosts, locked, path};
use crate::math::sampler::hash;
use crate::math::{LUMINANCE, luminance};
use crate::transport::adaptation::{Adaptation, Look};
use crate::transport::camera::Primary;
use crate::transport::economy::{Departure, Economy, Must, PATHS, Traced, Work};
use crate::transport::glances::Glances;
use crate::transport::guiding::{Guiding, Outcome, Start};
use crate::transport::{Cut, Techniques};
use glam::Vec3;
use rayon::prelude::*;
use std::sync::atomic::Ordering::Relaxed;

/// Keeps the random numbers of the grids that choose sizes apart from all others.
const ADAPTATION_STREAM: u32 = 0xada9_0000;

/// What is kept from one iteration to the next.
#[derive(Debug, Default)]
pub(super) struct Learnt {
    /// Where light paths begin.
    pub guiding: Guiding,
    /// The kernel's size place by place.
    pub adaptation: Adaptation,
    /// How often pixels look for light on their primary segments.
    pub glances: Glances,
    /// How many light paths pay, and whether filtering does.
    economy: Economy,
    /// Every band, and the picture there before the last iteration that looked whether they do.
    yardsticks: Vec<(Rect, Shown)>,
    /// Iterations that filtered.
    filtered: u32,
}

/// What is found out about an iteration while its bands are made.
pub(super) struct Lessons {
    techniques: Techniques,
    /// Its number.
    index: u32,
    /// Whether light paths learn from it where to begin.
    guides: bool,
    /// Whether it tells how many of them pay.
    looks: bool,
    /// Whether its picture is compared with those before.
    compares: bool,
    /// Its light paths, and the bands that share them.
    light_paths: f32,
    bands: usize,
    /// How far its picture is from those before.
    deviation: f64,
    /// Whether it tells if filtering pays, where it is compared with path tracing for that, and what that makes of it there.
    weighs_filter: bool,
    rows: Rows,
    traced: Traced,
    /// What it had to do.
    work: Work,
    /// Sum of what bands have beyond the camera's own paths.
    beyond: f64,
}

impl Learnt {
    /// How many of so many light paths an iteration samples.
    pub fn light_paths(&self, context: &Context, techniques: &Techniques, all: f32, index: u32) -> f32 {
        if is_thrifty(context, techniques) { self.economy.light_paths(all, index) } else { all }
    }

    /// Whether an iteration filters, and does not trace paths instead.
    pub fn filters(&self, context: &Context, techniques: &Techniques, index: u32) -> bool {
        !is_thrifty(context, techniques) || self.economy.filters(index)
    }

    /// Begins an iteration whose light paths are sampled: so many, of which `arrived` arrived somewhere.
    pub fn begin(
        &mut self,
        context: &Context,
        techniques: Techniques,
        index: u32,
        light_paths: f32,
        arrived: usize,
        bands: usize,
    ) -> Lessons {
        let is_thrifty = is_thrifty(context, &techniques);
        let guides = techniques.emission_guiding && self.guiding.begin_iteration(arrived);
        let looks = is_thrifty && self.economy.looks(index);
        let compares = is_thrifty && self.economy.compares(index);
        if looks {
            self.yardsticks.clear();
        }
        if techniques.kernel.adapts() {
            self.adaptation.begin(context.crop, context.completed + 1);
        }
        self.glances.begin(context.crop, context.world.needs().mirrors);
        let weighs_filter = compares && self.economy.weighs_filter(index);
        let rows = match weighs_filter {
            true => Rows::some(context.crop.area(), hash(context.seed, index)),
            false => Rows::ALL,
        };
        Lessons {
            techniques,
            index,
            guides,
            looks,
            compares,
            light_paths,
            bands,
            deviation: 0.0,
            weighs_filter,
            rows,
            traced: Traced::default(),
            work: Work::default(),
            beyond: 0.0,
        }
    }

    /// Takes in band number `k`, which is in the film at `place` now; `before` is the picture there before it, see
    /// [`Lessons::before`].
    pub fn take_in(
        &mut self,
        context: &Context,
        (k, place, band): (usize, Rect, &Band),
        before: Option<Shown>,
        lessons: &mut Lessons,
        cut: &Cut,
        costs: &mut StageCosts,
    ) {
        let sampled = band.sampled(context.world);
        lessons.beyond += band.beyond;
        self.glances.add(context.crop, &band.primaries, |p| p.weight * band.seen(sampled, p));
        if lessons.techniques.kernel.adapts() {
            let light = |p: &Primary| luminance(band.seen(sampled, p)) / p.albedo;
            let look = Look {
                band: context.crop,
                sensor: context.sensor,
                primaries: &band.primaries,
                is_clear: &band.is_clear,
                arrivals: &sampled.camera.arrivals,
                seed: hash(context.seed ^ ADAPTATION_STREAM, context.completed),
                completed: context.completed + 1,
            };
            self.adaptation.add(&look, light, cut);
        }
        costs.stage("adaptation", self.adaptation.bytes() + self.glances.bytes());
        if !(lessons.guides || lessons.compares) {
            return;
        }
        let Some(after) = Shown::of(context.film, place) else { return };
        if let Some(before) = before {
            let latest = before.latest(&after, context.completed);
            if lessons.looks {
                self.yardsticks.push((place, before));
            }
            if let Some((_, yardstick)) = self.yardsticks.get(k) {
                lessons.deviation += yardstick.deviation(&latest, lessons.rows);
                if lessons.weighs_filter {
                    lessons.traced += trace(context, yardstick, lessons.rows);
                    lessons.work += band.work();
                    costs.stage("path tracing", 0);
                }
            }
        }
        if lessons.guides || lessons.looks {
            let bytes = self.learn(context, band, &after, lessons, cut);
            costs.hold(band.held() + bytes);
            costs.stage("learning", bytes);
        }
    }

    /// Learns from a band where light paths should begin and how many of them pay, by what they bring as a share of what
    /// is shown. Returns the bytes that it took.
    fn learn(
        &mut self,
        context: &Context,
        band: &Band,
        shown: &Shown,
        lessons: &Lessons,
        cut: &Cut,
    ) -> usize {
        let starts = band.primaries.iter().zip(shown.scales()).filter_map(|(p, scale)| {
            let worth = p.weight * (LUMINANCE / scale);
            let worth = if worth.is_finite() { worth } else { Vec3::ZERO };
            Some(Start { arrival: p.arrival?, passages: p.passages, worth })
        });
        let starts: Vec<Start> = starts.collect();
        let outcome = Outcome {
            sampled: band.sampled(context.world),
            weights: &band.weights,
            reflected: &band.reflected,
            starts: &starts,
            max_depth: context.max_depth,
        };
        if lessons.looks {
            self.economy.look(outcome, lessons.light_paths, lessons.bands, cut);
        }
        if lessons.guides { self.guiding.learn(outcome, cut) } else { 0 }
    }

    /// Ends an iteration, all of whose bands are in the film. If it was stopped while they were taken in, what it says is
    /// incomplete and decides nothing. `rays`: traced for its picture.
    pub fn end(
        &mut self,
        context: &Context,
        lessons: &Lessons,
        rays: u64,
        cut: &Cut,
        costs: &mut StageCosts,
    ) {
        context.counters.rays.fetch_add(lessons.traced.rays, Relaxed);
        if cut.is_raised() {
            return;
        }
        let done = context.completed + 1;
        self.filtered += 1;
        let kernel = lessons.techniques.kernel;
        if kernel.adapts() {
            let [nominal, next] = [done - 1, done].map(|i| kernel.edge(i));
            self.adaptation.end_iteration(nominal, next, done);
            self.tell_blur(context);
        }
        self.glances.end_iteration(done, rays);
        costs.stage("adaptation", 0);
        if is_reported(context.completed) {
            let share = lessons.beyond / context.crop.area() as f64;
            locked(&context.counters.hints).beyond_unfiltered = share;
        }
        if lessons.guides {
            self.guiding.finish_iteration(context.world, cut);
            costs.stage("learning", self.guiding.bytes());
        }
        if lessons.compares {
            let departure = Departure { deviation: lessons.deviation, before: context.completed };
            match lessons.weighs_filter {
                true => {
                    let work = Work { rays, ..lessons.work };
                    let hints = *locked(&context.counters.hints);
                    let error = context.film.estimated_error(hints).filter(|e| e.noise > 0.0);
                    let over_noise = error.map_or(1.0, |e| e.total() / e.noise);
                    self.economy.judge_filter(departure, lessons.traced, over_noise, work);
                }
                false => {
                    let must = Must {
                        have_light_paths: context.world.has_hidden_light(),
                        filter: lessons.techniques.is_for_comparison(),
                    };
                    self.economy.judge(lessons.index, departure, must);
                }
            }
            *locked(&context.counters.left_out) = self.economy.left_out();
        }
    }

    /// Tells how much the kernels have blurred the picture, an iteration more included: those that do not filter add none.
    pub fn tell_blur(&self, context: &Context) {
        let share = f64::from(self.filtered) / f64::from(context.completed + 1);
        locked(&context.counters.hints).blur = self.adaptation.blur().map(|blur| blur * share * share);
    }
}

/// What path tracing makes of some rows of a band, with [`PATHS`] samples a pixel.
fn trace(context: &Context, yardstick: &Shown, rows: Rows) -> Traced {
    let (width, area) = (context.crop.width as usize, context.crop.area());
    let of_pixel = |k: usize| {
        let (x, y) = ((k % width) as u32, (k / width) as u32);
        let (mut halves, mut rays) = ([Vec3::ZERO; 2], 0);
        for n in 0..if rows.have(k) { PATHS } else { 0 } {
            if context.stop.is_raised() {
                break;
            }
            let camera = context.further_camera_sample(x, y, n, n >> 1, PATHS / 2);
            let (sample, taken) = path::sample(context, camera);
            halves[n as usize & 1] += sample.radiance * (2.0 / PATHS as f32);
            rays += taken as u32;
        }
        (halves, rays)
    };
    let traced: Vec<([Vec3; 2], u32)> = (0..area).into_par_iter().map(of_pixel).collect();
    let halves = [0, 1].map(|half| Shown::of_samples(traced.iter().map(|(light, _)| light[half])));
    let rays = traced.iter().map(|&(_, rays)| u64::from(rays)).sum();
    Traced { rays, ..yardstick.noise_of_halves(&halves, rows) }
}

impl Lessons {
    /// A band of the picture before the iteration is in it, if that is asked for.
    pub fn before(&self, context: &Context, place: Rect) -> Option<Shown> {
        if self.compares { Shown::of(context.film, place) } else { None }
    }
}

/// Whether light paths are left out where they do not pay.
fn is_thrifty(context: &Context, techniques: &Techniques) -> bool {
    !context.keep_all && techniques.can_do_without_light_paths()
}

/// Whether figures that hardly change are taken in an iteration before which so many were completed: ever more rarely.
pub(super) fn is_reported(completed: u32) -> bool {
    (completed + 1).is_power_of_two()
}
