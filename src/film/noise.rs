//! How wrong the picture is, told without a reference: noise.
//!
//! The squared error is estimated from the two halves of each
//! pixel's samples, which are independent pictures of the same thing: `((a - b) / 2)²` is an unbiased
//! estimate of the variance of their mean. Systematic error is invisible to it: see `bias`.
//!
//! The `r` of the denominator cannot be the pixel itself: where it happens to be dark the quotient explodes.
//! It is the mean of the pixel's neighbours (not of itself: one far too bright sample would hide the error that it
//! tells of; of a wider neighbourhood where such samples are so rare that the nearest ones happen to have none; of one half
//! alone where such a sample fell into the other and a kernel spread it over all of them), drawn back to the pixel where that differs from its
//! neighbours by more than noise explains (the local linear estimator of J.-S. Lee, "Digital Image
//! Enhancement and Noise Filtering by Use of Local Statistics", 1980).

use super::Tile;
use glam::{BVec3, DVec3, Vec3};
use rayon::prelude::*;
use std::iter::Sum;

/// The neighbourhood of a pixel reaches this far to each side: 5 x 5 pixels. Wider ones blur edges more than
/// they calm noise.
const RADIUS: usize = 2;
/// Sides of the squares that stand in for it where it has seen too little of what is rare, from the smallest.
const WIDER: [usize; 3] = [16, 64, 256];
/// Relative standard error up to which a mean counts as known.
const KNOWN: f64 = 0.5;
/// Times as bright as the other from which a half has seen what is rare.
const RARE: f64 = 10.0;
/// Pixels over which a kernel spreads a sample, at least.
const SPREAD: f64 = 3.0;

/// A pixel that has been sampled at least twice.
#[derive(Clone, Copy)]
pub(super) struct Pixel {
    pub mean: Vec3,
    /// Means of its halves.
    pub halves: [Vec3; 2],
    /// Estimated variance of `mean`.
    pub variance: Vec3,
}

/// What a pixel's two halves tell; `None` before both have a sample.
pub(super) fn of_pixel(tile: &Tile, pixel: usize) -> Option<Pixel> {
    let ([even, odd], counts) = tile.halves(pixel);
    let [n, m] = counts.map(f64::from);
    (m > 0.0).then(|| {
        // a difference of means has variance v/n + v/m, the mean of all v/(n + m)
        let [even_mean, odd_mean] = [even / n, odd / m];
        let difference = even_mean - odd_mean;
        Pixel {
            mean: ((even + odd) / (n + m)).as_vec3(),
            halves: [even_mean, odd_mean].map(|half| half.as_vec3()),
            variance: (difference * difference * (n * m / ((n + m) * (n + m)))).as_vec3().min(Vec3::MAX),
        }
    })
}

/// Sums over a neighbourhood.
#[derive(Clone, Copy, Default)]
struct Window {
    mean: DVec3,
    halves: [DVec3; 2],
    squares: [DVec3; 2],
    variance: DVec3,
    count: f64,
}

impl From<&Option<Pixel>> for Window {
    fn from(pixel: &Option<Pixel>) -> Self {
        pixel.map_or(Window::default(), |p| {
            let halves = p.halves.map(Vec3::as_dvec3);
            Window {
                mean: p.mean.as_dvec3(),
                halves,
                squares: halves.map(|half| half * half),
                variance: p.variance.as_dvec3(),
                count: 1.0,
            }
        })
    }
}

impl Sum for Window {
    fn sum<I: Iterator<Item = Window>>(windows: I) -> Window {
        windows.fold(Window::default(), |a, b| Window {
            mean: a.mean + b.mean,
            halves: [a.halves[0] + b.halves[0], a.halves[1] + b.halves[1]],
            squares: [a.squares[0] + b.squares[0], a.squares[1] + b.squares[1]],
            variance: a.variance + b.variance,
            count: a.count + b.count,
        })
    }
}

/// Means of squares of pixels, from which a pixel's own part can be taken out again.
struct Squares {
    side: usize,
    across: usize,
    windows: Vec<Window>,
}

impl Squares {
    fn new(pixels: &[Option<Pixel>], width: usize, side: usize) -> Self {
        let across = width.div_ceil(side);
        let of_rows = |rows: &[Option<Pixel>]| {
            let mut windows = vec![Window::default(); across];
            for (i, pixel) in rows.iter().enumerate() {
                let window = &mut windows[i % width / side];
                *window = [*window, Window::from(pixel)].into_iter().sum();
            }
            windows
        };
        let windows = pixels.par_chunks(side * width).flat_map_iter(of_rows).collect();
        Self { side, across, windows }
    }

    fn around(&self, x: usize, y: usize) -> Window {
        self.windows[y / self.side * self.across + x / self.side]
    }
}

/// What is known of the surroundings of a pixel without it.
struct Surroundings {
    mean: DVec3,
    /// Mean variance of its pixels.
    variance: DVec3,
    count: DVec3,
    /// Whether the mean is known with the pixel's own noise in it: else what it shows is too rare to be judged by so few.
    is_known: BVec3,
    /// Whether it is one half's, because the other is far too bright.
    is_half: BVec3,
}

impl Surroundings {
    fn new(window: Window, pixel: &Pixel) -> Self {
        let (mean, variance) = (pixel.mean.as_dvec3(), pixel.variance.as_dvec3());
        let count = (window.count - 1.0).max(1.0);
        // an only pixel has itself alone; a difference may be below zero by rounding
        let others = if window.count > 1.0 { ((window.mean - mean) / count).max(DVec3::ZERO) } else { mean };
        // noise that neighbours share, as a kernel makes it, shows in the halves alone
        let apart = 0.5 * (window.halves[0] - window.halves[1]).abs();
        let error = window.variance.powf(0.5).max(apart) / window.count;
        let both = Self {
            mean: others,
            variance: ((window.variance - variance) / count).max(DVec3::ZERO),
            count: DVec3::splat(count),
            is_known: error.cmple(KNOWN * others),
            is_half: BVec3::FALSE,
        };
        if both.is_known.all() { both } else { both.or(Self::of_darker_half(window)) }
    }

    /// By the half that is darker in all, known by how much its pixels differ, if the other has seen something rare.
    fn of_darker_half(window: Window) -> Self {
        let is_even = window.halves[0].cmplt(window.halves[1]);
        // the darker one's first
        let sorted =
            |[even, odd]: [DVec3; 2]| [DVec3::select(is_even, even, odd), DVec3::select(is_even, odd, even)];
        let ([sum, other], [square, other_square]) = (sorted(window.halves), sorted(window.squares));
        let mean = sum / window.count;
        let variance = (square / window.count - mean * mean).max(DVec3::ZERO);
        let is_calm = (variance / window.count).powf(0.5).cmple(KNOWN * mean) & mean.cmpgt(DVec3::ZERO);
        let is_rare = other.cmpgt(RARE * sum);
        let is_spread = (other * other).cmpgt(SPREAD * other_square);
        let is_known = is_calm & is_rare & is_spread;
        Self { mean, variance, count: DVec3::splat(window.count), is_known, is_half: is_known }
    }

    /// The same with the channels that are known, and those of a wider one.
    fn or(self, wider: Self) -> Self {
        let select = |known, wider| DVec3::select(self.is_known, known, wider);
        Self {
            mean: select(self.mean, wider.mean),
            variance: select(self.variance, wider.variance),
            count: select(self.count, wider.count),
            is_known: self.is_known | wider.is_known,
            is_half: self.is_half | (wider.is_half & !self.is_known),
        }
    }
}

/// What differences are multiplied with to be relative ones, `1 / sqrt(r² + (0.01 mean r)²)`, for a picture of rows of
/// `width` pixels; zero where nothing is known. `None` if all is black.
pub(super) fn scales(pixels: &[Option<Pixel>], width: usize) -> Option<Vec<Vec3>> {
    let row_sums: Vec<Window> =
        pixels.par_chunks(width).map(|row| row.iter().map(Window::from).sum()).collect();
    let known: Window = row_sums.into_iter().sum();
    let floor = (0.01 * known.mean.element_sum() / (3.0 * known.count)).powi(2);
    let wider = WIDER.map(|side| Squares::new(pixels, width, side));
    let rows = 0..pixels.len() / width;
    (floor > 0.0).then(|| {
        rows.into_par_iter().flat_map_iter(|y| row_scales(pixels, width, y, floor, &wider)).collect()
    })
}

/// The same for row `y`.
fn row_scales(pixels: &[Option<Pixel>], width: usize, y: usize, floor: f64, wider: &[Squares]) -> Vec<Vec3> {
    let height = pixels.len() / width;
    let rows = y.saturating_sub(RADIUS)..(y + RADIUS + 1).min(height);
    let column = |x| rows.clone().map(|row| Window::from(&pixels[row * width + x])).sum();
    let columns: Vec<Window> = (0..width).map(column).collect();
    let scale = |(x, pixel): (usize, &Option<Pixel>)| {
        let Some(pixel) = pixel else { return Vec3::ZERO };
        // plain sums, not running ones: next to a very bright pixel those would keep its rounding error
        let near = columns[x.saturating_sub(RADIUS)..(x + RADIUS + 1).min(width)].iter().copied().sum();
        let found = wider.iter().fold(Surroundings::new(near, pixel), |found, squares| {
            if found.is_known.all() {
                found
            } else {
                found.or(Surroundings::new(squares.around(x, y), pixel))
            }
        });
        let smooth = found.mean;
        let mean = pixel.mean.as_dvec3();
        let excess = mean - smooth;
        // one pixel's estimate of variance is often far too small
        let noise = pixel.variance.as_dvec3().max(found.variance);
        // share of the squared difference that noise does not explain; no difference, nothing to draw back
        let trust = (1.0 - noise / (excess * excess).max(DVec3::splat(f64::MIN_POSITIVE))).max(DVec3::ZERO);
        let trust = DVec3::select(found.is_half, DVec3::ZERO, trust);
        let truth = smooth + trust * excess;
        // one over the square of a noisy mean is too large by three of its relative variances
        let convexity = 3.0 * found.variance / found.count * (1.0 - trust);
        (truth * truth + convexity + floor).powf(-0.5).as_vec3()
    };
    pixels[y * width..][..width].iter().enumerate().map(scale).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{ErrorEstimate, Film, Hints, PassSet, Sample};
    use crate::math::sampler::{hash, hash_unit};

    const SIZE: (u32, u32) = (160, 120);

    /// Factor of mean one that a sample's radiance is multiplied with.
    #[derive(Clone, Copy, Debug)]
    enum Noise {
        Uniform,
        Exponential,
        /// Almost always nothing, else very bright.
        Fireflies(f32),
    }

    impl Noise {
        fn factor(self, u: f32) -> f32 {
            match self {
                Noise::Uniform => 2.0 * u,
                Noise::Exponential => -(1.0 - u).ln(),
                Noise::Fireflies(rate) if u < rate => 1.0 / rate,
                Noise::Fireflies(_) => 0.0,
            }
        }

        fn variance(self) -> f64 {
            match self {
                Noise::Uniform => 1.0 / 3.0,
                Noise::Exponential => 1.0,
                Noise::Fireflies(rate) => 1.0 / rate as f64 - 1.0,
            }
        }
    }

    /// Constant.
    fn flat(_: u32, _: u32) -> Vec3 {
        Vec3::new(0.2, 0.5, 0.9)
    }

    /// Three decades from left to right.
    fn ramp(x: u32, _: u32) -> Vec3 {
        Vec3::new(1.0, 0.7, 0.4) * 10f32.powf(3.0 * x as f32 / SIZE.0 as f32)
    }

    /// The left half sees no light at all.
    fn half_black(x: u32, y: u32) -> Vec3 {
        if x < SIZE.0 / 2 { Vec3::ZERO } else { flat(x, y) }
    }

    /// Squares of ten pixels, a hundredfold apart, and thin lines brighter still.
    fn edges(x: u32, y: u32) -> Vec3 {
        let square = if (x / 10 + y / 10).is_multiple_of(2) { 1.0 } else { 0.01 };
        let bright = if x.is_multiple_of(37) { 20.0 } else { square };
        Vec3::splat(bright)
    }

    /// Estimate, and the expectation of what it estimates, of a picture of `count(x, y)` samples a pixel.
    fn estimated_and_true(
        truth: fn(u32, u32) -> Vec3,
        noise: Noise,
        count: impl Fn(u32, u32) -> u32 + Sync,
    ) -> (f64, f64) {
        let film = Film::new(SIZE.0, SIZE.1, PassSet::default()).unwrap();
        film.par_tiles().for_each(|shared| {
            let mut tile = shared.lock();
            for (x, y) in shared.rect().pixels() {
                for i in 0..count(x, y) {
                    let factor = |channel| noise.factor(hash_unit(hash(x * 8191 + y, i), channel));
                    let radiance = truth(x, y) * Vec3::new(factor(0), factor(1), factor(2));
                    tile.add(x, y, &Sample { radiance, alpha: 1.0, ..Default::default() });
                }
            }
        });
        let known: Vec<_> = film.rect().pixels().filter(|&(x, y)| count(x, y) > 1).collect();
        let channels = 3.0 * known.len() as f64;
        let sum = known.iter().map(|&(x, y)| truth(x, y).as_dvec3().element_sum()).sum::<f64>();
        let floor = (0.01 * sum / channels).powi(2);
        let error = |&(x, y): &(u32, u32)| {
            let square = truth(x, y).as_dvec3().powf(2.0);
            (square * noise.variance() / count(x, y) as f64 / (square + floor)).element_sum()
        };
        (
            film.estimated_error(Hints::default()).unwrap().noise,
            known.iter().map(error).sum::<f64>() / channels,
        )
    }

    fn check(name: &str, truth: fn(u32, u32) -> Vec3, noise: Noise, count: impl Fn(u32, u32) -> u32 + Sync) {
        let (estimated, expected) = estimated_and_true(truth, noise, count);
        let ratio = estimated / expected;
        assert!(
            (0.9..1.1).contains(&ratio),
            "{name}, {noise:?}: {estimated}, should be {expected} ({ratio})"
        );
    }

    #[test]
    fn known_noise_is_estimated_within_a_tenth() {
        let noises = [
            (Noise::Uniform, 2),
            (Noise::Uniform, 16),
            (Noise::Exponential, 4),
            (Noise::Exponential, 64),
            (Noise::Fireflies(0.01), 64),
            (Noise::Fireflies(0.02), 512),
        ];
        for (noise, n) in noises {
            check("flat", flat, noise, |_, _| n);
            check("ramp", ramp, noise, |_, _| n);
            check("half black", half_black, noise, |_, _| n);
        }
    }

    #[test]
    fn what_is_rare_is_judged_by_where_else_it_happens() {
        // a bright sample in one pixel of a dozen
        for n in [8, 9] {
            let (estimated, expected) = estimated_and_true(flat, Noise::Fireflies(0.01), |_, _| n);
            let ratio = estimated / expected;
            assert!((0.6..1.6).contains(&ratio), "{n}: {estimated}, should be {expected}");
        }
    }

    /// Where a kernel has spread a rare sample over a few pixels of a dark corner, the wider surroundings are too bright to judge by.
    #[test]
    fn a_bright_patch_in_the_dark_is_judged_by_the_half_without_it() {
        let is_dark = |x: u32, y: u32| x < 40 && y < 30;
        for n in [8, 33] {
            let film = Film::new(SIZE.0, SIZE.1, PassSet::default()).unwrap();
            let value = |x, y| if is_dark(x, y) { 0.02 } else { 1.0 };
            for i in 0..n {
                film.add_iteration(|x, y| {
                    let in_patch = i == 2 && (10..16).contains(&x) && (12..18).contains(&y);
                    let noise = 0.5 + hash_unit(hash(x, y), i);
                    let radiance = Vec3::splat(value(x, y) * noise + if in_patch { 100.0 } else { 0.0 });
                    Sample { radiance, alpha: 1.0, ..Default::default() }
                });
            }
            let squares: f64 = film.rect().pixels().map(|(x, y)| f64::from(value(x, y)).powi(2)).sum();
            let pixels = f64::from(SIZE.0 * SIZE.1);
            let floor = 1e-4 * squares / pixels;
            let patch = 36.0 * (100.0 / f64::from(n)).powi(2) / (0.02f64.powi(2) + floor);
            let expected = patch / pixels + 1.0 / (12.0 * f64::from(n));
            let ratio = film.estimated_error(Hints::default()).unwrap().noise / expected;
            assert!((0.7..1.4).contains(&ratio), "{n}: {ratio}");
        }
    }

    #[test]
    fn edges_and_thin_lines_are_not_smoothed_away() {
        check("edges", edges, Noise::Uniform, |_, _| 16);
        check("edges", edges, Noise::Exponential, |_, _| 64);
        check("edges", edges, Noise::Fireflies(0.02), |_, _| 1024);
    }

    #[test]
    fn pixels_may_have_different_counts() {
        check("odd counts", ramp, Noise::Exponential, |_, _| 5);
        check("mixed counts", ramp, Noise::Exponential, |x, y| 2 + hash(x, y) % 20);
        check("cut short", flat, Noise::Exponential, |_, y| if y < 50 { 8 } else { y % 2 });
    }

    #[test]
    fn nothing_known_and_nothing_seen() {
        const NONE: Option<ErrorEstimate> = Some(ErrorEstimate { noise: 0.0, bias: None });
        let film = Film::new(40, 40, PassSet::default()).unwrap();
        assert_eq!(film.estimated_error(Hints::default()), None);
        film.add_iteration(|_, _| Sample::default());
        assert_eq!(film.estimated_error(Hints::default()), None);
        film.add_iteration(|_, _| Sample::default());
        assert_eq!(film.estimated_error(Hints::default()), NONE);
        let one = Film::new(1, 1, PassSet::default()).unwrap();
        (0..2).for_each(|_| one.add_iteration(|_, _| Sample { radiance: Vec3::ONE, ..Default::default() }));
        assert_eq!(one.estimated_error(Hints::default()), NONE);
    }

    #[test]
    fn the_largest_values_do_not_overflow() {
        let film = Film::new(16, 16, PassSet::default()).unwrap();
        for i in 0..2 {
            let value = |x| if (x + i) % 2 == 0 { f32::MAX } else { 0.0 };
            film.add_iteration(|x, _| Sample { radiance: Vec3::splat(value(x)), ..Default::default() });
        }
        assert!(film.estimated_error(Hints::default()).unwrap().noise.is_finite());
    }

    #[test]
    fn a_bright_pixel_leaves_no_trace_beyond_its_neighbourhood() {
        let pixel = |value, variance| {
            Some(Pixel {
                mean: Vec3::splat(value),
                halves: [Vec3::splat(value); 2],
                variance: Vec3::splat(variance),
            })
        };
        let mut row = vec![pixel(0.1, 0.01); 40];
        row[..8].fill(None);
        let without = row_scales(&row, 40, 0, 1e-4, &[]);
        row[0] = pixel(1e30, 0.0);
        assert_eq!(row_scales(&row, 40, 0, 1e-4, &[])[8..], without[8..]);
    }

    #[test]
    fn the_estimate_does_not_depend_on_the_number_of_threads() {
        let film = Film::new(150, 90, PassSet::default()).unwrap();
        for i in 0..4 {
            film.add_iteration(|x, y| Sample {
                radiance: Vec3::splat(hash_unit(hash(x, y), i)),
                ..Default::default()
            });
        }
        let ask = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| film.estimated_error(Hints::default()).unwrap().noise)
        };
        assert_eq!(ask(1).to_bits(), ask(5).to_bits());
    }
}
