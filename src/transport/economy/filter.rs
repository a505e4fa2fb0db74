//! Whether filtering pays. Where camera paths by themselves find all light with ease, many of them have less error than fewer that
//! are filtered, and no blur.
//!
//! It is asked where light paths do not pay, since what those bring comes by filtering alone. An iteration that filters is compared
//! to the mean of those before, and so is what its camera paths find by themselves. If that is not far behind, the next iteration
//! traces paths (`integrators::path`), with rays that are spent for that, and the pictures tell. Looking decides for later
//! iterations: that biases nothing.

use super::{Departure, WORTHWHILE};
use std::ops::AddAssign;

/// How much less variance path tracing may have than the camera paths of an iteration that filters, which end earlier. A trial that
/// fails is noise in the picture, so it has to be likely to succeed.
const LIKELY: f64 = 1.5;

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

impl Work {
    /// Costs of the camera's paths, and of filtering them, in nanoseconds of the machine that they were measured on
    /// (`benches/NOTES.md`, *Paths that are not filtered*). To read a clock would be another picture every time.
    fn costs(&self) -> [f64; 2] {
        let [rays, pixels, arrivals, pairs] =
            [self.rays, self.pixels, self.arrivals, self.pairs].map(|n| n as f64);
        [400.0 * rays + 550.0 * arrivals, 640.0 * arrivals + 200.0 * pairs + 250.0 * pixels]
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

/// What the next iteration is for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Next {
    /// The picture alone.
    #[default]
    Nothing,
    /// It filters, to be compared with one that does not; iterations before, see [`Departure::before`].
    Filtered(u32),
    /// It does not filter.
    Unfiltered {
        /// As above.
        before: u32,
        /// Variance of the one before, which did.
        variance: f64,
        /// How many times as much variance may be in this one for filtering not to pay.
        most: f64,
    },
}

/// What has been found out about the worth of filtering.
#[derive(Clone, Copy, Debug, Default)]
pub struct FilterEconomy {
    is_left_out: bool,
    next: Next,
}

impl FilterEconomy {
    /// Whether filtering is left out of iterations that look for nothing.
    pub fn is_left_out(&self) -> bool {
        self.is_left_out
    }

    /// Whether the next iteration filters if light paths need not.
    pub fn filters(&self) -> bool {
        match self.next {
            Next::Nothing => !self.is_left_out,
            Next::Filtered(_) => true,
            Next::Unfiltered { .. } => false,
        }
    }

    /// Whether the next iteration has to be compared to those before.
    pub fn compares(&self) -> bool {
        self.next != Next::Nothing
    }

    /// The next two iterations find out, after light paths were looked at and found not to pay with so many iterations before.
    pub fn begin(&mut self, before: u32) {
        self.next = if before > 0 { Next::Filtered(before) } else { Next::Nothing };
    }

    /// All iterations filter, until told otherwise.
    pub fn keep(&mut self) {
        *self = Self::default();
    }

    /// Judges after an iteration that filtered. `own`: how far off its camera paths are by themselves; `error_over_noise`: of the
    /// picture so far.
    pub fn judge_filtered(&mut self, departure: Departure, own: f64, error_over_noise: f64, work: Work) {
        let Next::Filtered(before) = self.next else { return };
        let [sampling, filtering] = work.costs();
        // the mean varies as well, about as much as so many iterations
        let of_mean = departure.squared() / f64::from(before + 1);
        let (variance, own) = (departure.squared() - of_mean, own * own - of_mean);
        let most = error_over_noise.max(1.0) * (sampling + filtering) / (WORTHWHILE * sampling);
        let is_likely = own < LIKELY * most * variance;
        self.is_left_out &= is_likely;
        self.next = if is_likely { Next::Unfiltered { before, variance, most } } else { Next::Nothing };
    }

    /// Judges after an iteration that traced paths.
    pub fn judge_unfiltered(&mut self, departure: Departure) {
        let Next::Unfiltered { before, variance, most } = self.next else { return };
        let unfiltered = departure.squared() - variance / f64::from(before);
        // what is not a number decides nothing
        self.is_left_out = unfiltered < most * variance;
        self.next = Next::Nothing;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORK: Work = Work { rays: 1000, pixels: 100, arrivals: 400, pairs: 2000 };

    /// After four iterations, of which one that filters and one that does not departed by so much.
    fn judged(filtered: f64, unfiltered: f64, error_over_noise: f64) -> FilterEconomy {
        let mut economy = FilterEconomy::default();
        assert!(economy.filters() && !economy.compares());
        economy.begin(4);
        assert!(economy.filters() && economy.compares());
        economy.judge_filtered(departure(filtered), unfiltered.min(filtered), error_over_noise, WORK);
        assert!(!economy.filters() && economy.compares());
        economy.judge_unfiltered(departure(unfiltered));
        assert!(!economy.compares());
        economy
    }

    fn departure(deviation: f64) -> Departure {
        Departure { deviation, before: 4 }
    }

    #[test]
    fn filtering_is_left_out_where_more_paths_have_less_error() {
        // costs 620 + 681 for 620: twice the variance pays, at a gain of a tenth
        let [sampling, filtering] = WORK.costs();
        let most = (sampling + filtering) / (1.1 * sampling);
        assert!((1.8..2.0).contains(&most), "{most}");
        // variances: 5 - 5/5 = 4 of the filtered one, d² - 4/4 of the other
        let filtered = 5.0f64.sqrt();
        let at = |ratio: f64, told| judged(filtered, (ratio * 4.0 + 1.0).sqrt(), told).is_left_out();
        assert!(at(0.99 * most, 1.0) && !at(1.01 * most, 1.0));
        // blur speaks against the filter
        assert!(at(1.01 * most, 1.1) && !at(1.01 * most, 0.5));
        assert!(!judged(filtered, f64::NAN, 1.0).is_left_out());
    }

    #[test]
    fn nothing_is_tried_that_is_not_likely() {
        let [sampling, filtering] = WORK.costs();
        let most = (sampling + filtering) / (1.1 * sampling);
        for (ratio, tries) in [(0.99 * 1.5 * most, true), (1.01 * 1.5 * most, false), (f64::NAN, false)] {
            let mut economy = FilterEconomy::default();
            economy.begin(4);
            let own = (ratio * 4.0 + 1.0).sqrt();
            economy.judge_filtered(departure(5.0f64.sqrt()), own, 1.0, WORK);
            assert_eq!((economy.compares(), economy.filters()), (tries, !tries));
        }
    }

    #[test]
    fn it_comes_back_with_light_paths() {
        let mut economy = judged(1.0, 1.0, 1.0);
        assert!(!economy.filters());
        // and is looked at again
        economy.begin(15);
        assert!(economy.filters());
        economy.keep();
        assert!(economy.filters() && !economy.compares());
        economy.begin(0);
        assert!(!economy.compares(), "nothing to compare with");
    }
}
