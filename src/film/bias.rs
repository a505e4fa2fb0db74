//! How wrong the picture is, told without a reference: systematic error.
//!
//! Three things tell it. Some integrators deliver a second estimate of every sample that has no systematic error, but more
//! noise: the mean difference is the error, within what noise allows, and but for light that this estimate hardly ever finds.
//! The size of a kernel that varies from sample to sample tells, by the
//! slope of the light over the kernel's logarithm, what the kernel brings; that has less noise than path tracing, above
//! all in caustics. And an integrator may know what its kernels blur ([`Hints`]). The first is right and bounds what the others
//! guess.
//!
//! The first two are known for the samples of even and for those of odd number, with independent noise, so that the
//! product is the squared systematic error on average. Summed over blocks of pixels first it is less noisy, and misses
//! what is finer than a block. Of several sizes of block the one counts that leaves the most beyond doubt.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Sides of the blocks, pixels; the first are single pixels.
const SIDES: [usize; 5] = [1, 2, 4, 8, 16];
/// Standard errors that are taken off: what is left is no chance.
const DOUBT: f64 = 2.0;

/// Squared systematic error of a kernel over its squared slope per octave: beside a step, under a box of random offset, 3
/// to 4. It is less for an error that grows with the square of the size, and far more for what is finer than the kernel,
/// which more or less of it blurs away alike.
const PER_SLOPE: f64 = 4.0;
/// Least mean variance of the size, octaves squared, that tells anything.
const LEAST_VARIANCE: f64 = 1e-3;

/// Standard errors of the unfiltered estimate by which the others may exceed it.
const LENIENCE: f64 = 1.0;
/// By how much more counts what unfiltered estimates hardly find: judged by its surroundings it is more than its share of a
/// pixel's light.
const BEYOND: f64 = 3.0;

/// What an integrator knows of its systematic error; all of it relative and squared, means over the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hints {
    /// What its kernels blur, as far as it knows.
    pub blur: Option<f64>,
    /// Share of the light that its unfiltered estimates hardly ever find.
    pub beyond_unfiltered: f64,
}

/// The systematic error, squared, in which the witnesses agree best: means over the pixels. `unfiltered`: what is
/// beyond doubt, and what is as likely as not, see [`bounds`].
pub(super) fn agreed(unfiltered: Option<[f64; 2]>, by_size: Option<f64>, hints: Hints) -> Option<f64> {
    let guessed = [by_size, hints.blur].into_iter().flatten().reduce(f64::max);
    let Some([low, high]) = unfiltered else { return guessed };
    let low = (low - BEYOND * hints.beyond_unfiltered).max(0.0);
    Some(guessed.unwrap_or(0.0).min(high).max(low))
}

/// Something of the samples of even number, and of those of odd number.
pub(super) type Halves = [Vec3; 2];

/// Sums over half of a pixel's samples, of which every one knew its kernel: `z` is the logarithm, in octaves, of its
/// size over the nominal one.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Slope {
    light: Vec3,
    weighted: Vec3,
    z: f32,
    square: f32,
    count: u32,
}

impl Slope {
    /// Adds a sample.
    pub fn add(&mut self, light: Vec3, z: f32) {
        self.light += light;
        self.weighted += light * z;
        self.z += z;
        self.square += z * z;
        self.count += 1;
    }

    /// Covariance of light and `z`, and variance of `z`.
    fn covariance(&self) -> (Vec3, f32) {
        let scale = 1.0 / self.count.max(1) as f32;
        let (light, z) = (self.light * scale, self.z * scale);
        (self.weighted * scale - light * z, self.square * scale - z * z)
    }
}

/// How the light of every pixel goes with the kernel's size.
#[derive(Debug, Default)]
pub(super) struct BySize {
    covariances: Vec<Halves>,
    /// Sum over pixels of the squared variance of the size.
    variance: f64,
}

impl BySize {
    /// What a pixel of `pixels` says.
    pub fn add(&mut self, pixel: usize, pixels: usize, slopes: [Slope; 2]) {
        self.covariances.resize(pixels, Halves::default());
        let [even, odd] = slopes.map(|s| s.covariance());
        self.variance += f64::from(even.1) * f64::from(odd.1);
        self.covariances[pixel] = [even.0, odd.0];
    }

    /// As [`mean_square`], where the size varied. `scales`: factors that make light relative.
    pub fn mean_square(mut self, scales: &[Vec3], width: usize) -> Option<f64> {
        // pixels whose kernel varied more know more, and count as much
        let variance = self.variance / self.covariances.len().max(1) as f64;
        (variance > LEAST_VARIANCE.powi(2)).then(|| {
            for (covariance, &scale) in self.covariances.iter_mut().zip(scales) {
                let finite = |c: Vec3| if c.is_finite() { c } else { Vec3::ZERO };
                *covariance = covariance.map(|c| finite(c * scale));
            }
            PER_SLOPE * mean_square(&self.covariances, width) / variance
        })
    }
}

/// Sum over pixels, mean over channels, of the squared systematic error, from the mean differences of the two halves
/// of every pixel, in rows of `width`; at least zero.
pub(super) fn mean_square(differences: &[Halves], width: usize) -> f64 {
    bounds(differences, width)[0]
}

/// That, and the most that is as likely as not: no block hides anything from single pixels.
pub(super) fn bounds(differences: &[Halves], width: usize) -> [f64; 2] {
    let sides = SIDES.map(|side| in_blocks(differences, width, side));
    let low = sides.iter().map(|[sum, error]| sum - DOUBT * error).fold(0.0, f64::max);
    let [sum, error] = sides[0];
    [low, sum.max(0.0) + LENIENCE * error]
}

/// Sum over the blocks of their products, and its standard error.
fn in_blocks(differences: &[Halves], width: usize, side: usize) -> [f64; 2] {
    let sums: Vec<[f64; 2]> =
        differences.par_chunks(side * width).map(|rows| of_rows(rows, width, side)).collect();
    let [sum, squares] = sums.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    [sum, squares.sqrt()]
}

/// Sum over the blocks of a row of them of their products, and of the squares of these.
fn of_rows(rows: &[Halves], width: usize, side: usize) -> [f64; 2] {
    let height = rows.len() / width;
    let product = |x: usize| {
        let columns = x..(x + side).min(width);
        let pixels = (0..height).flat_map(|y| &rows[y * width..][columns.clone()]);
        let [even, odd] =
            pixels.fold([DVec3::ZERO; 2], |sum, d| [sum[0] + d[0].as_dvec3(), sum[1] + d[1].as_dvec3()]);
        (even * odd).element_sum() / (3 * height * columns.len()) as f64
    };
    (0..width).step_by(side).map(product).fold([0.0; 2], |sum, p| [sum[0] + p, sum[1] + p * p])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::{hash, hash_unit};

    const WIDTH: usize = 100;
    const PIXELS: usize = 90 * WIDTH;

    /// Mean squared systematic error found where there is `bias(x)` under uniform noise of this width.
    fn found(bias: impl Fn(usize) -> f32, noise: f32, seed: u32) -> f64 {
        let half = |i: usize, k: u32| {
            let u = |channel| hash_unit(hash(i as u32, seed), 3 * k + channel) - 0.5;
            Vec3::splat(bias(i % WIDTH)) + noise * Vec3::new(u(0), u(1), u(2))
        };
        let differences: Vec<_> = (0..PIXELS).map(|i| [half(i, 0), half(i, 1)]).collect();
        mean_square(&differences, WIDTH) / PIXELS as f64
    }

    #[test]
    fn systematic_errors_are_found_beneath_noise() {
        for seed in 0..10 {
            // a variance of 0.083 over a square of 0.01, everywhere alike or changing sign every ten pixels
            let even = found(|_| 0.1, 1.0, seed);
            assert!((0.006..0.0105).contains(&even), "{even}");
            let striped = found(|x| if x / 10 % 2 == 0 { 0.1 } else { -0.1 }, 1.0, seed);
            assert!((0.004..0.0105).contains(&striped), "{striped}");
            let fine = found(|x| if x % 2 == 0 { 0.1 } else { -0.1 }, 0.1, seed);
            assert!((0.009..0.0105).contains(&fine), "{fine}");
        }
    }

    fn by_size(slopes: &[[Slope; 2]], width: usize) -> Option<f64> {
        let mut by_size = BySize::default();
        slopes.iter().enumerate().for_each(|(pixel, &s)| by_size.add(pixel, slopes.len(), s));
        by_size.mean_square(&vec![Vec3::ONE; slopes.len()], width)
    }

    /// Light that changes by `slope` an octave, under noise of this width and kernels of two sizes an octave apart.
    fn found_by_size(slope: f32, noise: f32, seed: u32) -> Option<f64> {
        let mut slopes = vec![[Slope::default(); 2]; PIXELS];
        for (i, halves) in slopes.iter_mut().enumerate() {
            for k in 0..32u32 {
                let u = |channel| hash_unit(hash(i as u32, seed), 4 * k + channel);
                let z = if u(3) < 0.5 { -0.5 } else { 0.5 };
                let light = Vec3::new(u(0), u(1), u(2)) * noise + 5.0 + slope * z;
                halves[k as usize % 2].add(light, z);
            }
        }
        by_size(&slopes, WIDTH).map(|sum| sum / PIXELS as f64)
    }

    #[test]
    fn the_kernel_tells_by_its_size_what_it_does() {
        for seed in 0..5 {
            let told = found_by_size(0.1, 0.5, seed).unwrap() / (PER_SLOPE * 0.01);
            // of 16 samples a sixteenth of the variance goes with their mean, twice
            assert!((0.75..1.05).contains(&told), "{told}");
            assert!(found_by_size(0.0, 0.5, seed).unwrap() < 2e-3);
        }
        // of one size nothing can be told
        let mut same = Slope::default();
        (0..9).for_each(|k| same.add(Vec3::splat(k as f32), 0.3));
        assert_eq!(by_size(&[[same; 2]], 1), None);
        assert_eq!(by_size(&[], 1), None);
    }

    #[test]
    fn what_is_right_bounds_what_is_guessed() {
        let hints = |blur, beyond_unfiltered| Hints { blur, beyond_unfiltered };
        let told =
            |unfiltered, by_size, blur, beyond| agreed(unfiltered, by_size, hints(blur, beyond)).unwrap();
        let known = Some([0.01, 0.02]);
        assert_eq!(told(known, Some(0.5), Some(0.3), 0.0), 0.02);
        assert_eq!(told(known, Some(0.012), Some(0.015), 0.0), 0.015);
        assert_eq!(told(known, None, None, 0.0), 0.01);
        // light that it does not find is no error of the filter, but more than the difference there is not
        assert_eq!(told(known, Some(0.5), None, 1.0), 0.02);
        assert_eq!(told(known, None, Some(0.001), 1.0), 0.001);
        assert_eq!(told(None, None, Some(0.3), 0.0), 0.3);
        assert_eq!(agreed(None, None, Hints::default()), None);
        for seed in 0..10 {
            // a variance of 0.083 over a square of 0.01, as above
            let half = |i: usize, k: u32| {
                let u = |channel| hash_unit(hash(i as u32, seed), 3 * k + channel) - 0.4;
                Vec3::new(u(0), u(1), u(2))
            };
            let differences: Vec<_> = (0..PIXELS).map(|i| [half(i, 0), half(i, 1)]).collect();
            let [low, high] = bounds(&differences, WIDTH).map(|sum| sum / PIXELS as f64);
            assert!(low < 0.0105 && (0.0095..0.012).contains(&high), "{low} {high}");
        }
    }

    #[test]
    fn noise_alone_is_no_systematic_error() {
        // of independent noise of variance 1/12 hardly a thousandth
        let wrong: Vec<f64> = (0..40).map(|seed| found(|_| 0.0, 1.0, seed)).collect();
        assert!(wrong.iter().all(|&w| w < 1e-3), "{wrong:?}");
        assert!(wrong.iter().filter(|&&w| w == 0.0).count() > 28, "{wrong:?}");
    }
}
