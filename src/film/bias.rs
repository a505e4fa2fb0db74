//! How wrong the picture is, told without a reference: systematic error.
//!
//! Some integrators deliver a second estimate of every sample that has no systematic error, but more noise. The mean
//! difference of the two in the samples of even number and that in those of odd number have independent noise, so their product is the
//! squared systematic error on average. Summed over blocks of pixels first it is less noisy, and misses what is finer
//! than a block. Of several sizes of block the one counts that leaves the most beyond doubt.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Sides of the blocks, pixels.
const SIDES: [usize; 5] = [1, 2, 4, 8, 16];
/// Standard errors that are taken off: what is left is no chance.
const DOUBT: f64 = 2.0;

/// Sum over pixels, mean over channels, of the squared systematic error, from the mean differences of the two halves
/// of every pixel, in rows of `width`; at least zero.
pub(super) fn mean_square(differences: &[[Vec3; 2]], width: usize) -> f64 {
    SIDES.into_iter().map(|side| beyond_doubt(differences, width, side)).fold(0.0, f64::max)
}

fn beyond_doubt(differences: &[[Vec3; 2]], width: usize, side: usize) -> f64 {
    let sums: Vec<[f64; 2]> =
        differences.par_chunks(side * width).map(|rows| of_rows(rows, width, side)).collect();
    let [sum, squares] = sums.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    sum - DOUBT * squares.sqrt()
}

/// Sum over the blocks of a row of them of their products, and of the squares of these.
fn of_rows(rows: &[[Vec3; 2]], width: usize, side: usize) -> [f64; 2] {
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

    #[test]
    fn noise_alone_is_no_systematic_error() {
        // of independent noise of variance 1/12 hardly a thousandth
        let wrong: Vec<f64> = (0..40).map(|seed| found(|_| 0.0, 1.0, seed)).collect();
        assert!(wrong.iter().all(|&w| w < 1e-3), "{wrong:?}");
        assert!(wrong.iter().filter(|&&w| w == 0.0).count() > 28, "{wrong:?}");
    }
}
