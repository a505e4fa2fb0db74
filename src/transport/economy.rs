//! How many light paths pay: as many as make error times cost least (efficiency-aware multiple importance sampling,
//! Grittmann et al. 2022, for segments).
//!
//! A contribution `C = g / D` was weighed by the density `D` of all techniques, of which light paths have the share
//! `p`. With `r` times the light paths it would have been `C' = C / (1 - p + p r)`. So the contributions of one
//! iteration tell the second moment for every `r`, also of light that fewer light paths would have missed: what light
//! paths find best speaks for itself through them. What it is worth is judged by the brightness of its pixel, at deeper
//! arrivals along their own camera path. Looking is done by iterations that have all their light paths, and decides for
//! later ones: that biases nothing.
//!
//! What fewer light paths lose at deeper arrivals is told too low, in some scenes by a factor of three, in others not at
//! all. Where that decides, one iteration with fewer is a trial, and the pictures tell ([`Trial`]).

mod filter;

use super::Cut;
use super::cluster::Cluster;
use super::exchange::{Densities, GRAIN, emitted_share, has_end};
use super::guiding::{Outcome, worth_of_arrivals};
use super::photons::photon_weight;
use super::weigh::{Sampled, Weights, next_event_density};
use crate::math::SharedExponent;
use crate::shading::SurfaceClass;
use crate::shading::bsdf::Bsdf;
use filter::FilterEconomy;
use glam::Vec3;
use rayon::prelude::*;

pub use filter::{PATHS, Traced, Work};

/// Numbers of light paths that are compared, as shares of all.
const SHARES: [f32; 4] = [0.0, 1.0 / 16.0, 0.25, 1.0];
/// Number of the last.
const ALL: usize = SHARES.len() - 1;
/// Cost of a point at which an area is probed, in arrivals.
const PROBE: f64 = 0.25;
/// Growth of their number with that of light paths: fewer photons are in nearly as many clusters.
const PROBE_GROWTH: f64 = 0.2;
/// Factor on the variance that fewer light paths add: what deeper arrivals lose is told up to so much too low (measured,
/// `benches/NOTES.md`).
const UNTOLD: f64 = 3.0;
/// The same where it is told in full.
const TOLD: f64 = 1.0;
/// Gain that is worth the risk of leaving light paths out: what they have not found so far is not known.
const WORTHWHILE: f64 = 1.1;
/// Gain that a trial has to show: one iteration tells the ratio of variances to two fifths (`benches/NOTES.md`).
const PROVEN: f64 = 1.25;
/// So many light paths at least, if any: those of a cluster would else be parts of one path, and what is estimated by
/// one of them would depend on the density of the others (1 % dark with four).
const FEWEST: f32 = 64.0;
/// Where paths are traced and all is quiet, nobody looks before this iteration.
const SETTLED: u32 = 255;
/// Clusters that are looked at, about.
const MOST: usize = 1 << 14;

/// A figure for every share of the light paths.
type PerShare = [f64; SHARES.len()];

/// What has been found out about the worth of light paths.
#[derive(Debug)]
pub struct Economy {
    /// For every share, the sum of what pixels are off, as far as it has been looked at.
    errors: PerShare,
    /// For every share, arrivals sampled and what else costs as much, of all iterations that looked.
    costs: PerShare,
    /// Share of the light paths that pays.
    share: f32,
    /// A smaller one that may, which the next iteration tries.
    trial: Option<Trial>,
    /// Whether filtering pays without light paths.
    filter: FilterEconomy,
}

impl Default for Economy {
    fn default() -> Self {
        let filter = FilterEconomy::default();
        Self { errors: [0.0; SHARES.len()], costs: [0.0; SHARES.len()], share: 1.0, trial: None, filter }
    }
}

/// A share of the light paths on trial, after an iteration with all of them.
#[derive(Clone, Copy, Debug)]
struct Trial {
    /// Which of [`SHARES`].
    share: usize,
    /// Squared departure of the picture with all light paths.
    with_all: f64,
    /// Iterations from whose mean it departed.
    before: u32,
}

/// How far the picture of an iteration is from the mean of those before the last that looked.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// Standard deviation by pixel brightness, in units that are the same from iteration to iteration.
    pub deviation: f64,
    /// Iterations before, which that mean is of where this one looks.
    pub before: u32,
}

impl Departure {
    fn squared(&self) -> f64 {
        self.deviation * self.deviation
    }
}

/// What must not be left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Must {
    /// Some light paths: there may be light that camera paths cannot find.
    pub have_light_paths: bool,
    /// Filtering.
    pub filter: bool,
}

/// What some technique may bring to a cluster.
#[derive(Clone, Copy, Debug, Default)]
struct Item {
    /// Per value of a lobe: basic radiance, weighed, over area.
    light: Vec3,
    /// Share of light paths in the density of all techniques.
    share: f32,
}

/// What a camera arrival adds to its cluster.
#[derive(Clone, Copy, Debug, Default)]
struct Draws {
    next_event: Item,
    emitted: Item,
    carried: Item,
}

impl Economy {
    /// Whether iteration `index` samples all light paths, to look what they bring.
    pub fn looks(&self, index: u32) -> bool {
        let is_due = (index + 1).is_power_of_two() && (index + 1).trailing_zeros().is_multiple_of(2);
        is_due && (index >= SETTLED || !self.filter.is_settled())
    }

    /// Whether iteration `index` has to be compared to those before.
    pub fn compares(&self, index: u32) -> bool {
        self.looks(index) || self.trial.is_some() || self.filter.looks()
    }

    /// Whether iteration `index` filters, and does not trace paths instead.
    pub fn filters(&self, index: u32) -> bool {
        self.looks(index) || self.filter.filters()
    }

    /// How many of `all` light paths iteration `index` should sample.
    pub fn light_paths(&self, all: f32, index: u32) -> f32 {
        let share = match (self.looks(index), self.trial) {
            (true, _) => 1.0,
            (false, Some(trial)) => SHARES[trial.share],
            (false, None) => self.share,
        };
        if share == 0.0 { 0.0 } else { (share * all).ceil().max(FEWEST).min(all) }
    }

    /// What is left out, for the log and the statistics.
    pub fn left_out(&self) -> Vec<String> {
        let percent = 100.0 * (1.0 - self.share);
        let why = "they cost more than they bring here";
        let light = (self.share < 1.0)
            .then(|| format!("light paths, {percent:.0} % of them in most iterations: {why}"));
        let filter = self.filter.is_left_out().then(|| {
            "filtering in most iterations: camera paths by themselves have less error here".to_string()
        });
        light.into_iter().chain(filter).collect()
    }

    /// Looks at an iteration that sampled all light paths, which were so many, or at one of its bands, which share their
    /// cost.
    pub fn look(&mut self, o: Outcome, light_paths: f32, bands: usize, cut: &Cut) {
        let found = errors(o, cut);
        if cut.is_raised() || found.iter().any(|v| v.is_nan()) {
            return;
        }
        // with a smaller kernel fewer clusters have something to say: none of it is forgotten
        self.errors.iter_mut().zip(found).for_each(|(sum, v)| *sum += v);
        let Outcome { sampled: s, starts, .. } = o;
        let camera = (s.camera.arrivals.len() + starts.len()) as f64;
        let light = (s.light.arrivals.len() as f64 + f64::from(light_paths)) / bands as f64;
        let probes = PROBE * s.clusters.probes as f64;
        let costs = SHARES.map(f64::from).map(|r| camera + r * light + r.powf(PROBE_GROWTH) * probes);
        self.costs.iter_mut().zip(costs).for_each(|(sum, v)| *sum += v);
    }

    /// Whether iteration `index` is to be compared with path tracing, to find out whether filtering pays.
    pub fn weighs_filter(&self, index: u32) -> bool {
        self.filter.looks() && !self.looks(index)
    }

    /// Judges whether filtering pays, see [`FilterEconomy::judge`].
    pub fn judge_filter(&mut self, filtered: Departure, traced: Traced, error_over_noise: f64, work: Work) {
        self.filter.judge(filtered, traced, error_over_noise, work);
    }

    /// Judges how many light paths pay after iteration `index`, by what was seen in it.
    pub fn judge(&mut self, index: u32, departure: Departure, must: Must) {
        let (squared, before) = (departure.squared(), departure.before);
        let mut looked = before;
        if self.looks(index) {
            let [surely, perhaps] =
                [UNTOLD, TOLD].map(|factor| self.best(factor, usize::from(must.have_light_paths)));
            let is_open = surely == ALL && perhaps != ALL && before > 0;
            self.trial = is_open.then_some(Trial { share: perhaps, with_all: squared, before });
            // what is open stays as it is until it has been tried
            if !is_open {
                self.share = SHARES[surely];
            }
        } else if let Some(Trial { share, with_all, before }) = self.trial.take() {
            looked = before;
            // the mean varies as well, about as much as so many iterations with all light paths
            let of_mean = with_all / f64::from(before + 1);
            let (with_fewer, with_all) = ((squared - of_mean).max(0.0), with_all - of_mean);
            let pays = PROVEN * with_fewer * self.costs[share] < with_all * self.costs[ALL];
            self.share = if pays { SHARES[share] } else { 1.0 };
        }
        match self.share > 0.0 || must.filter {
            true => self.filter.keep(),
            false if self.trial.is_none() => self.filter.begin(looked),
            false => {}
        }
    }

    /// The share, from number `least` on, at which error times cost is least, if what fewer light paths add to the
    /// variance is `factor` times what is told.
    fn best(&self, factor: f64, least: usize) -> usize {
        let told = |k: usize| self.errors[k] * self.errors[k];
        let variance = |k: usize| {
            let added = told(k) - told(ALL);
            told(ALL) + if added > 0.0 { factor * added } else { added }
        };
        let product = |k: usize| variance(k) * self.costs[k];
        let best = (least..ALL).min_by(|&a, &b| product(a).total_cmp(&product(b))).unwrap_or(ALL);
        if WORTHWHILE * product(best) < product(ALL) { best } else { ALL }
    }
}

/// Standard deviations, summed over some of the clusters: of variances a few bright specks would have most. What a
/// deeper arrival gathers is shared by those of the cluster that it is seen from, so each of them has a part of its
/// error.
fn errors(o: Outcome, cut: &Cut) -> PerShare {
    let worth = worth_of_arrivals(o, |c| 1.0 / (c.cameras as f32).sqrt());
    let clusters = &o.sampled.clusters.clusters;
    let stride = clusters.len().div_ceil(MOST);
    let of_some = |(chunk, clusters): (usize, &[Cluster])| {
        let mut sum = [0.0; SHARES.len()];
        for k in (chunk * GRAIN..chunk * GRAIN + clusters.len()).step_by(stride) {
            if !cut.is_raised() {
                let found = of_cluster(o, k, &worth);
                sum.iter_mut().zip(found).for_each(|(sum, v)| *sum += v.sqrt());
            }
        }
        sum
    };
    let parts: Vec<PerShare> = clusters.par_chunks(GRAIN).enumerate().map(of_some).collect();
    // in order: the same sum on any number of threads
    parts.iter().fold([0.0; SHARES.len()], |sum, part| std::array::from_fn(|k| sum[k] + part[k]))
}

/// The variances of cluster number `k`. A single camera arrival does not tell how much it would vary.
fn of_cluster(o: Outcome, k: usize, worth: &[SharedExponent]) -> PerShare {
    let s = o.sampled;
    let c = &s.clusters.clusters[k];
    let mut sum = [0.0; SHARES.len()];
    if c.cameras < 2 || s.cameras(c).all(|i| worth[i].decode() == Vec3::ZERO) {
        return sum;
    }
    let draws: Vec<Draws> = s.cameras(c).map(|i| draws(o, i)).collect();
    let photons: Vec<Item> = s
        .lights(c)
        .map(|j| {
            let photon = s.light.photons.get(j);
            let counts = o.max_depth.is_none_or(|most| photon.bounces < most);
            let share = photon_weight(s, o.weights, j);
            let flux = if counts { photon.flux } else { Vec3::ZERO };
            Item { light: flux * (share * c.inverse_area), share }
        })
        .collect();
    // by column: the lobe's values of the next-event segment and of the one that leaves, and of the photon's
    let mut add = |scale: f64, row: &dyn Fn(usize) -> [Vec3; 2], photon: &dyn Fn(usize) -> Vec3| {
        let camera = draws.iter().enumerate().map(|(column, d)| {
            let [next_event, leaving] = row(column);
            [value(&d.next_event, next_event), value(&d.emitted, leaving), value(&d.carried, leaving)]
        });
        let light = photons.iter().enumerate().map(|(column, p)| value(p, photon(column)));
        let found = of_row(camera, light);
        sum.iter_mut().zip(found).for_each(|(sum, v)| *sum += scale * v);
    };
    match c.class {
        SurfaceClass::Diffuse => {
            // all arrivals reflect alike: one row, and how much its square counts
            let reflected =
                |i: usize| f64::from((worth[i].decode() * s.camera.arrivals.reflectance(i)).element_sum());
            let scale: f64 = s.cameras(c).map(|i| reflected(i).powi(2)).sum();
            let grey = Vec3::splat(1.0 / 3.0);
            let (camera, light): (Vec<usize>, Vec<usize>) = (s.cameras(c).collect(), s.lights(c).collect());
            let row = |column: usize| {
                let i = camera[column];
                let next_event = s.camera.next_events.get(i).map_or(0.0, |n| n.pdf);
                [grey * next_event, grey * s.camera.outgoing.pdf(i)]
            };
            add(scale, &row, &|column| grey * s.light.arrivals.back_pdf(light[column]));
        }
        SurfaceClass::Reflecting | SurfaceClass::Transmitting => {
            let camera: Vec<usize> = s.cameras(c).collect();
            for (r, &i) in camera.iter().enumerate().filter(|&(_, &i)| worth[i].decode() != Vec3::ZERO) {
                let (a, worth) = (s.camera.arrivals.get(i), worth[i].decode());
                let bsdf: Bsdf = a.bsdf(s.world);
                let f = o.weights.row(k, r);
                let row = |column: usize| {
                    let next_event = s.camera.next_events.get(camera[column]);
                    let lit = next_event.map_or(Vec3::ZERO, |n| bsdf.eval(a.wo, n.direction));
                    [worth * lit, worth * f[column].decode()]
                };
                add(1.0, &row, &|column| worth * f[camera.len() + column].decode());
            }
        }
    }
    sum
}

/// What an item comes to by a lobe's value, and its share of light paths.
fn value(item: &Item, lobe: Vec3) -> (f64, f64) {
    (f64::from(item.light.dot(lobe)), f64::from(item.share.clamp(0.0, 1.0)))
}

/// What camera arrival `i` adds to its cluster, per value of a lobe.
fn draws(o: Outcome, i: usize) -> Draws {
    let (s, w): (Sampled, &Weights) = (o.sampled, o.weights);
    let c = s.cluster_of(i);
    let segments = &o.reflected.segments;
    let mut draws = Draws::default();
    if let Some(next_event) = s.camera.next_events.get(i) {
        // the densities of the cluster's lobes along it are those of its own, as far as they are alike
        let p_cam = c.cameras as f32 * s.camera.arrivals.survival(i) * next_event.pdf;
        let density = next_event_density(&next_event, p_cam, c);
        let light = next_event.light / (density * c.area);
        draws.next_event = Item { light, share: next_event.light_density / density };
    }
    if !s.camera.arrivals.goes_on(i) {
        return draws;
    }
    draws.emitted = Item { light: segments.emitted(i) / c.area, share: emitted_share(s, w, i) };
    if has_end(s, i) {
        let p_light = w.densities[i + 1].light.max(0.0);
        let light = segments.value(s, i, Vec3::ZERO, Some(o.reflected.end_of(i))) / c.area;
        let densities = Densities::of(s, w, i);
        let by_light = densities.light * p_light;
        let density = densities.all(p_light, 0.0);
        let share = if density > 0.0 { by_light / density } else { 0.0 };
        draws.carried = Item { light, share };
    }
    draws
}

/// The variance of what one arrival gathers. `camera`: what every camera arrival of the cluster brings, `photons`: what
/// photons do, as values and shares of light paths.
///
/// Light that light paths have less than half of is found well by the camera's: there the deviations of its
/// arrivals from their mean are its variance. Of other light they may not have found any, and all contributions tell
/// its second moment.
fn of_row(
    camera: impl ExactSizeIterator<Item = [(f64, f64); 3]>,
    photons: impl Iterator<Item = (f64, f64)>,
) -> PerShare {
    let n = camera.len() as f64;
    let (mut sums, mut squares, mut found) = ([0.0; SHARES.len()], [0.0; SHARES.len()], [0.0; SHARES.len()]);
    // (light of the camera's techniques, light of photons), of light with the share `p` of light paths
    let moments = |p: f64, r: f64| {
        let density = 1.0 - p + p * r;
        let square = density * density;
        // what only light paths find is never found without them
        if density > 0.0 { ((1.0 - p) / square, p * r / square) } else { (f64::INFINITY, 0.0) }
    };
    for items in camera {
        for (k, r) in SHARES.iter().map(|&r| f64::from(r)).enumerate() {
            let mut well = 0.0;
            for &(c, p) in &items {
                if p < 0.5 {
                    well += c / (1.0 - p + p * r);
                    found[k] += c * c * moments(p, r).1;
                } else if c != 0.0 {
                    let (by_camera, by_photons) = moments(p, r);
                    found[k] += c * c * (by_camera + by_photons);
                }
            }
            sums[k] += well;
            squares[k] += well * well;
        }
    }
    for (c, p) in photons.filter(|&(c, _)| c != 0.0) {
        for (k, r) in SHARES.iter().map(|&r| f64::from(r)).enumerate() {
            let (by_camera, by_photons) = moments(p, r);
            found[k] += c * c * if p < 0.5 { by_photons } else { by_camera + by_photons };
        }
    }
    std::array::from_fn(|k| found[k] + (squares[k] - sums[k] * sums[k] / n).max(0.0) * n / (n - 1.0))
}

#[cfg(test)]
mod tests;
