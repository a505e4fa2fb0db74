//! Whether filtering pays. Where camera paths by themselves find all light with ease, many of them have less error than fewer that
//! are filtered, and no blur.
//!
//! It is asked where light paths do not pay, since what those bring comes by filtering alone. An iteration that filters is compared
//! to the mean of those before; paths are traced through some of its pixels (`integrators::path`) that do not enter the
//! picture. Looking decides for later iterations: that biases nothing.

use super::Departure;
use std::ops::AddAssign;

/// Paths through a pixel by which path tracing is judged: it gains from their being spread evenly.
pub const PATHS: u32 = 16;
/// Relative variance after these, but for the worst hundredth of the pixels, below which path tracing is quiet,
const QUIET: f64 = 0.04;
/// if these do not add more than so many times as much.
const EVEN: f64 = 2.0;
/// How much less variance filtering has to bring to a quiet picture: path tracing gains by evenness with every further sample, and what is
/// left of a filtered picture is soon its blur (`benches/NOTES.md`, *Paths that are not filtered*).
const PATIENCE: f64 = 2.0;

/// What an iteration that filters had to do.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// Rays.
    pub rays: u64,
    /// Pixels.
    pub pixels: u64,
    /// Camera arrivals.
    pub arrivals: u64,
    /// Pairs of camera arrivals in clusters that are not diffuse.
    pub pairs: u64,
}

/// Cost of a ray, in nanoseconds of the machine that this and what else work costs were measured on
/// (`benches/NOTES.md`, *Paths that are not filtered*). To read a clock would be another picture every time.
const RAY: f64 = 400.0;

impl Work {
    /// Cost of all.
    fn cost(&self) -> f64 {
        let [rays, pixels, arrivals, pairs] =
            [self.rays, self.pixels, self.arrivals, self.pairs].map(|n| n as f64);
        RAY * rays + 1350.0 * arrivals + 220.0 * pairs + 300.0 * pixels
    }
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.pixels += other.pixels;
        self.arrivals += other.arrivals;
        self.pairs += other.pairs;
    }
}

/// What path tracing made of some pixels, with [`PATHS`] samples of each.
#[derive(Clone, Copy, Debug, Default)]
pub struct Traced {
    /// How far that is from the truth, in the units of a [`Departure`].
    pub deviation: f64,
    /// Sum of the pixels' relative variances.
    pub noise: f64,
    /// The same without the worst hundredth.
    pub calm: f64,
    /// Pixels.
    pub pixels: usize,
    /// Rays.
    pub rays: u64,
}

impl Traced {
    /// Squared departure of one sample a pixel, if every further one brings as much as these have.
    fn variance(&self) -> f64 {
        f64::from(PATHS) * self.deviation * self.deviation
    }

    /// Cost of a sample of so many pixels.
    fn cost(&self, pixels: u64) -> f64 {
        let a_path = self.rays as f64 / (self.pixels as f64 * f64::from(PATHS));
        // at every arrival one ray to a light, and one that goes on
        let arrivals = 0.5 * (a_path - 1.0).max(0.0);
        pixels as f64 * (RAY * a_path + 400.0 * arrivals)
    }

    fn is_quiet(&self) -> bool {
        self.calm < QUIET * self.pixels as f64 && self.noise < EVEN * self.calm
    }
}

impl AddAssign for Traced {
    fn add_assign(&mut self, other: Self) {
        self.deviation += other.deviation;
        self.noise += other.noise;
        self.calm += other.calm;
        self.pixels += other.pixels;
        self.rays += other.rays;
    }
}

/// What has been found out about the worth of filtering.
#[derive(Clone, Copy, Debug, Default)]
pub struct FilterEconomy {
    is_left_out: bool,
    /// Whether path tracing was quiet.
    is_quiet: bool,
    /// Whether the next iteration is to be compared with path tracing, and the iterations before, see [`Departure::before`].
    looks: Option<u32>,
}

impl FilterEconomy {
    /// Whether filtering is left out of iterations that look for nothing.
    pub fn is_left_out(&self) -> bool {
        self.is_left_out
    }

    /// Whether the next iteration filters if light paths need not.
    pub fn filters(&self) -> bool {
        self.looks() || !self.is_left_out
    }

    /// Whether it is left out for good: path tracing is quiet, and nothing is missing.
    pub fn is_settled(&self) -> bool {
        self.is_left_out && self.is_quiet
    }

    /// Whether the next iteration is to be compared with path tracing.
    pub fn looks(&self) -> bool {
        self.looks.is_some()
    }

    /// The next iteration finds out, after light paths were looked at and found not to pay with so many iterations before.
    pub fn begin(&mut self, before: u32) {
        self.looks = (before > 0).then_some(before);
    }

    /// All iterations filter, until told otherwise.
    pub fn keep(&mut self) {
        *self = Self::default();
    }

    /// Judges after an iteration that filtered. `filtered`: its departure; `error_over_noise`: of the picture so far.
    pub fn judge(&mut self, filtered: Departure, traced: Traced, error_over_noise: f64, work: Work) {
        let Some(before) = self.looks.take() else { return };
        // the mean varies as well, about as much as so many iterations
        let variance = filtered.squared() * (1.0 - 1.0 / f64::from(before + 1));
        let filtering = variance * work.cost() * error_over_noise.max(1.0);
        let tracing = traced.variance() * traced.cost(work.pixels);
        self.is_quiet = traced.is_quiet();
        let patience = if self.is_quiet { PATIENCE } else { 1.0 };
        // what is not a number decides nothing
        self.is_left_out = tracing < patience * filtering;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORK: Work = Work { rays: 1000, pixels: 100, arrivals: 400, pairs: 2000 };

    /// Paths of 11 rays: five arrivals.
    fn traced(deviation: f64, noise: f64, calm: f64) -> Traced {
        Traced { deviation, noise, calm, pixels: 50, rays: 50 * 11 * u64::from(PATHS) }
    }

    /// After four iterations and one that departed by so much.
    fn judged(filtered: f64, traced: Traced, error_over_noise: f64) -> FilterEconomy {
        let mut economy = FilterEconomy::default();
        assert!(economy.filters() && !economy.looks());
        economy.begin(4);
        assert!(economy.filters() && economy.looks());
        let departure = Departure { deviation: filtered, before: 4 };
        economy.judge(departure, traced, error_over_noise, WORK);
        assert!(!economy.looks());
        economy
    }

    #[test]
    fn filtering_is_left_out_where_more_paths_have_less_error() {
        let most = WORK.cost() / traced(1.0, 1.0, 1.0).cost(WORK.pixels);
        assert!((2.0..2.5).contains(&most), "{most}");
        // a variance of 5 - 5/5 = 4, and of paths so many times that
        let at = |ratio: f64, told, noise: f64, calm: f64| {
            let deviation = (ratio * 4.0 / f64::from(PATHS)).sqrt();
            judged(5.0f64.sqrt(), traced(deviation, noise, calm), told).is_left_out()
        };
        let noisy = 2.0 * QUIET * 50.0;
        assert!(at(0.99 * most, 1.0, noisy, noisy) && !at(1.01 * most, 1.0, noisy, noisy));
        // blur speaks against the filter
        assert!(at(1.01 * most, 1.1, noisy, noisy) && !at(1.01 * most, 0.5, noisy, noisy));
        // and so does quiet, unless a few pixels break it
        let quiet = 0.5 * QUIET * 50.0;
        assert!(
            at(0.99 * PATIENCE * most, 1.0, quiet, quiet) && !at(1.01 * PATIENCE * most, 1.0, quiet, quiet)
        );
        assert!(!at(1.01 * most, 1.0, 1.01 * EVEN * quiet, quiet));
        assert!(!at(f64::NAN, 1.0, quiet, quiet));
    }

    #[test]
    fn it_comes_back_with_light_paths() {
        let mut economy = judged(1.0, traced(0.1, 1.0, 1.0), 1.0);
        assert!(!economy.filters());
        // and is looked at again
        economy.begin(15);
        assert!(economy.filters());
        economy.keep();
        assert!(economy.filters() && !economy.looks());
        economy.begin(0);
        assert!(!economy.looks(), "nothing to compare with");
    }
}
