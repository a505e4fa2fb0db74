//! Pixel filters, by filter importance sampling (Ernst, Stamminger, Greiner, "Filter Importance Sampling",
//! 2006): a sample is placed with the filter's density around its pixel and then counts for that pixel
//! alone, with weight one. The samples of different pixels stay independent.

use super::FilmError;
use glam::Vec2;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Shape of the pixel filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilterKind {
    /// Constant.
    #[default]
    Box,
    /// The four-term Blackman-Harris window (Harris 1978).
    BlackmanHarris,
}

/// A pixel filter, ready to be sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    /// Distance from the pixel's centre at which the filter ends, pixels.
    radius: f32,
}

impl Filter {
    /// A filter of `width` pixels; 0 stands for the default of its kind, 1 for the box and 1.5 for
    /// Blackman-Harris. The widths mean what they do in Cycles: a box is as wide as it says, a
    /// Blackman-Harris window reaches that far to each side.
    pub fn new(kind: FilterKind, width: f32) -> Result<Self, FilmError> {
        if !(width >= 0.0 && width.is_finite()) {
            return Err(FilmError::FilterWidth(width));
        }
        let radius = match kind {
            FilterKind::Box if width == 0.0 => 0.5,
            FilterKind::Box => 0.5 * width,
            FilterKind::BlackmanHarris if width == 0.0 => 1.5,
            FilterKind::BlackmanHarris => width,
        };
        Ok(Self { kind, radius })
    }

    /// Distance from the pixel's centre beyond which no sample falls, pixels per axis.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Offset from the pixel's centre in pixels, distributed as the filter, from `u` in `[0,1)²`.
    /// Monotone in each axis, so stratified numbers give stratified offsets.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        self.radius
            * match self.kind {
                FilterKind::Box => 2.0 * u - 1.0,
                FilterKind::BlackmanHarris => Vec2::new(blackman_harris(u.x), blackman_harris(u.y)),
            }
    }

    /// Density with which [`Filter::sample`] draws an offset, per square pixel: the weight with which what falls
    /// there counts for the pixel.
    #[inline]
    pub fn density(&self, offset: Vec2) -> f32 {
        let one = |x: f32| match (x + self.radius) / (2.0 * self.radius) {
            // half open, so that boxes side by side share no point
            t if !(0.0..1.0).contains(&t) => 0.0,
            t => match self.kind {
                FilterKind::Box => 1.0,
                FilterKind::BlackmanHarris => {
                    let cell = ((t * CELLS as f32) as usize).min(CELLS - 1);
                    let cdf = &*BLACKMAN_HARRIS_CDF;
                    (cdf[cell + 1] - cdf[cell]) * CELLS as f32
                }
            },
        };
        one(offset.x) * one(offset.y) / (2.0 * self.radius).powi(2)
    }
}

/// Cells of the table below: narrow enough that a picture cannot tell a constant density inside one from
/// the curve (of the default filter, a cell is 0.006 pixels).
const CELLS: usize = 512;

/// Cumulative distribution of the Blackman-Harris window over `[-1,1]` at the ends of equal cells.
static BLACKMAN_HARRIS_CDF: LazyLock<[f32; CELLS + 1]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        // integral of a0 - a1 cos x + a2 cos 2x - a3 cos 3x, over its value at 2 pi
        let t = i as f64 / CELLS as f64;
        let x = TAU * t;
        let wave = -0.48829 * x.sin() + 0.14128 / 2.0 * (2.0 * x).sin() - 0.01168 / 3.0 * (3.0 * x).sin();
        (t + wave / (0.35875 * TAU)) as f32
    })
});

/// Point of `[-1,1]` distributed as the window.
fn blackman_harris(u: f32) -> f32 {
    let cdf = &*BLACKMAN_HARRIS_CDF;
    // the first end above `u`: the cell before it has mass
    let cell = cdf.partition_point(|&c| c <= u).clamp(1, CELLS) - 1;
    let mass = cdf[cell + 1] - cdf[cell];
    let inside = if mass > 0.0 { ((u - cdf[cell]) / mass).clamp(0.0, 1.0) } else { 0.5 };
    2.0 * (cell as f32 + inside) / CELLS as f32 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::ONE_MINUS_EPSILON;
    use crate::math::sampler::hash_unit;

    /// Chi-square of `n` sampled offsets of one axis against `density` on `[-radius, radius]`.
    fn chi_square(filter: Filter, axis: usize, density: impl Fn(f64) -> f64) -> (f64, f64) {
        const BINS: usize = 60;
        const FINE: usize = 200;
        let n = 400_000u32;
        let r = filter.radius() as f64;
        let mut expected = [0.0; BINS];
        for (bin, e) in expected.iter_mut().enumerate() {
            let at = |k: usize| (bin as f64 + (k as f64 + 0.5) / FINE as f64) / BINS as f64 * 2.0 - 1.0;
            *e = (0..FINE).map(|k| density(at(k))).sum();
        }
        let total: f64 = expected.iter().sum();
        let mut seen = [0.0; BINS];
        for i in 0..n {
            let offset = filter.sample(Vec2::new(hash_unit(i, 1), hash_unit(i, 2)))[axis] as f64;
            assert!(offset.abs() <= r);
            seen[(((offset / r + 1.0) * 0.5 * BINS as f64) as usize).min(BINS - 1)] += 1.0;
        }
        // bins of few expected samples are pooled
        let (mut chi, mut used, mut pool) = (0.0, 0.0, (0.0, 0.0));
        for (s, e) in seen.iter().zip(expected).map(|(s, e)| (*s, e / total * n as f64)) {
            if e < 10.0 {
                pool = (pool.0 + s, pool.1 + e);
            } else {
                chi += (s - e) * (s - e) / e;
                used += 1.0;
            }
        }
        if pool.1 > 0.0 {
            chi += (pool.0 - pool.1) * (pool.0 - pool.1) / pool.1;
            used += 1.0;
        }
        (chi, used - 1.0)
    }

    /// One-sided limit at about 1e-4 by Wilson and Hilferty's cube root approximation.
    fn limit(freedom: f64) -> f64 {
        let k = 2.0 / (9.0 * freedom);
        freedom * (1.0 - k + 3.72 * k.sqrt()).powi(3)
    }

    #[test]
    fn offsets_follow_the_filter() {
        let window = |x: f64| {
            let x = std::f64::consts::PI * (x + 1.0);
            0.35875 - 0.48829 * x.cos() + 0.14128 * (2.0 * x).cos() - 0.01168 * (3.0 * x).cos()
        };
        for axis in 0..2 {
            for width in [0.0, 0.7, 4.0] {
                let filter = Filter::new(FilterKind::BlackmanHarris, width).unwrap();
                let (chi, freedom) = chi_square(filter, axis, window);
                assert!(chi < limit(freedom), "width {width}: {chi} for {freedom} degrees of freedom");
                // the test can tell filters apart
                let (chi, freedom) =
                    chi_square(filter, axis, |x| (1.0 + (std::f64::consts::PI * x).cos()).powi(2));
                assert!(chi > limit(freedom));
            }
            let (chi, freedom) = chi_square(Filter::new(FilterKind::Box, 0.0).unwrap(), axis, |_| 1.0);
            assert!(chi < limit(freedom), "box: {chi} for {freedom} degrees of freedom");
        }
    }

    #[test]
    fn offsets_are_monotone_symmetric_and_bounded() {
        let filter = Filter::new(FilterKind::BlackmanHarris, 0.0).unwrap();
        let at = |u: f32| filter.sample(Vec2::splat(u)).x;
        assert_eq!(filter.radius(), 1.5);
        assert!(at(0.0) >= -1.5 && at(ONE_MINUS_EPSILON) <= 1.5);
        assert!(at(0.5).abs() < 1e-6);
        let mut last = -1.5;
        for i in 0..10_000 {
            let u = i as f32 / 10_000.0;
            assert!(at(u) >= last);
            last = at(u);
            assert!((at(u) + at(1.0 - u)).abs() < 1e-3 * 1.5 || !(0.001..0.999).contains(&u));
        }
    }

    #[test]
    fn the_density_is_that_of_the_samples() {
        for filter in [
            Filter::new(FilterKind::Box, 0.0).unwrap(),
            Filter::new(FilterKind::Box, 2.5).unwrap(),
            Filter::new(FilterKind::BlackmanHarris, 0.0).unwrap(),
        ] {
            let (n, r) = (400, filter.radius());
            let at = |k: u32| ((k as f32 + 0.5) / n as f32 * 2.4 - 1.2) * r;
            let cell = (2.4 * r / n as f32).powi(2);
            let moment = |f: &dyn Fn(f32) -> f32| -> f32 {
                (0..n)
                    .map(|i| (0..n).map(|j| filter.density(Vec2::new(at(i), at(j)))).sum::<f32>() * f(at(i)))
                    .sum()
            };
            approx::assert_relative_eq!(moment(&|_| 1.0) * cell, 1.0, max_relative = 1e-2);
            let square = |x: f32| x * x;
            let m = 100_000;
            let drawn: f32 = (0..m)
                .map(|i| square(filter.sample(Vec2::splat((i as f32 + 0.5) / m as f32)).x))
                .sum::<f32>()
                / m as f32;
            approx::assert_relative_eq!(moment(&square) * cell, drawn, max_relative = 2e-2);
        }
    }

    #[test]
    fn widths_are_checked() {
        assert_eq!(Filter::new(FilterKind::Box, 0.0).unwrap().radius(), 0.5);
        assert_eq!(Filter::new(FilterKind::Box, 3.0).unwrap().radius(), 1.5);
        for bad in [-1.0, f32::NAN, f32::INFINITY] {
            assert!(Filter::new(FilterKind::Box, bad).is_err());
        }
        assert_eq!(
            serde_json::from_str::<FilterKind>("\"blackman-harris\"").unwrap(),
            FilterKind::BlackmanHarris
        );
    }
}
