//! The picture so far, as that by which an iteration is judged.

use crate::film::{Film, Pass, Rect};
use crate::math::luminance;
use crate::math::sampler::hash_unit;
use crate::transport::economy::Traced;
use glam::Vec3;

/// Of the picture's mean brightness, what is added to that of a pixel where shares of it are judged.
const DARK: f32 = 0.1;
/// Pixels whose deviations are judged together.
const ROW: usize = 64;
/// So many rows tell how noisy a picture is; of large pictures this share.
const ENOUGH: usize = 48;
const LEAST: f32 = 1.0 / 32.0;

/// Which rows of pixels are compared: chosen at random, so many of them on average.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    share: f32,
    seed: u32,
}

impl Rows {
    /// All.
    pub const ALL: Self = Self { share: 1.0, seed: 0 };

    /// A part of the rows of a film, that is enough to tell.
    pub fn some(pixels: usize, seed: u32) -> Self {
        let share = (ENOUGH * ROW) as f32 / pixels as f32;
        Self { share: share.clamp(LEAST, 1.0), seed }
    }

    fn count(self, row: usize) -> bool {
        hash_unit(self.seed, row as u32) < self.share
    }

    /// Whether a pixel of a band counts, by its number.
    pub fn have(self, pixel: usize) -> bool {
        self.count(pixel / ROW)
    }
}

/// Luminance of a band as it stands in the film.
#[derive(Debug)]
pub struct Shown(Vec<f32>);

impl Shown {
    /// Of a band.
    pub fn of(film: &Film, band: Rect) -> Option<Self> {
        let shown = film.read_pass(Pass::Combined, band).ok()?;
        Some(Self::of_samples(shown.chunks_exact(4).map(|c| Vec3::new(c[0], c[1], c[2]))))
    }

    /// Of one sample of every pixel.
    pub fn of_samples(samples: impl Iterator<Item = Vec3>) -> Self {
        Self(samples.map(|s| luminance(s).max(0.0)).collect())
    }

    /// By which the brightness of each pixel is judged.
    pub fn scales(&self) -> impl Iterator<Item = f32> {
        let mean = self.0.iter().map(|&l| f64::from(l)).sum::<f64>() / self.0.len() as f64;
        let floor = DARK * mean as f32;
        self.0.iter().map(move |l| l + floor)
    }

    /// The iteration that made `after` of this, which was the mean of so many.
    pub fn latest(&self, after: &Self, before: u32) -> Self {
        let n = before as f32;
        Self(self.0.iter().zip(&after.0).map(|(b, a)| (n + 1.0) * a - n * b).collect())
    }

    /// How far a picture is from this one: relative deviations, squared over short rows of pixels and summed over
    /// these, so that a few bright specks do not decide.
    pub fn deviation(&self, other: &Self, rows: Rows) -> f64 {
        rooted(&self.squares(self.0.iter().zip(&other.0).map(|(a, b)| b - a), rows))
    }

    /// How far the mean of two independent pictures is from the truth, on average, relative to the brightness here.
    pub fn noise_of_halves(&self, [a, b]: &[Self; 2], rows: Rows) -> Traced {
        let squares = self.squares(a.0.iter().zip(&b.0).map(|(a, b)| 0.5 * (b - a)), rows);
        let deviation = rooted(&squares);
        let mut sorted: Vec<f64> = squares.into_iter().flatten().collect();
        sorted.sort_by(f64::total_cmp);
        let (pixels, noise) = (sorted.len(), sorted.iter().sum());
        let calm = sorted[..pixels - pixels / 100].iter().sum();
        Traced { deviation, noise, calm, pixels, rays: 0 }
    }

    /// Squares of relative differences, row by row, as far as they are finite.
    fn squares(&self, differences: impl Iterator<Item = f32>, rows: Rows) -> Vec<Vec<f64>> {
        let relative = differences.zip(self.scales()).map(|(d, scale)| f64::from(d / scale));
        let squares: Vec<f64> = relative.map(|d| d * d).collect();
        let finite = |row: &[f64]| row.iter().copied().filter(|square| square.is_finite()).collect();
        let counted = squares.chunks(ROW).enumerate().filter(|&(row, _)| rows.count(row));
        counted.map(|(_, row)| finite(row)).collect()
    }
}

/// Roots of the sums of rows, summed.
fn rooted(squares: &[Vec<f64>]) -> f64 {
    squares.iter().map(|row| row.iter().sum::<f64>().sqrt()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_iteration_is_found_again_and_measured() {
        let mean = Shown(vec![1.0; 128]);
        let latest = Shown([0.9, 1.3].repeat(64));
        let after = Shown(mean.0.iter().zip(&latest.0).map(|(m, l)| (3.0 * m + l) / 4.0).collect());
        let found = mean.latest(&after, 3);
        assert!(found.0.iter().zip(&latest.0).all(|(a, b)| (a - b).abs() < 1e-6));
        // two rows of 64 pixels, half of them 0.1 off and half 0.3, at a brightness of 1 + DARK
        let expected = 2.0 * (32.0f64 * (0.01 + 0.09)).sqrt() / 1.1;
        assert!((mean.deviation(&found, Rows::ALL) - expected).abs() < 1e-4 * expected);
    }
    #[test]
    fn halves_tell_the_noise_of_their_mean() {
        let mean = Shown(vec![1.0; 6400]);
        let mut halves = [0.9, 1.1].map(|l| Shown(vec![l; 6400]));
        (halves[0].0[70], halves[1].0[70], halves[1].0[900]) = (1.0, 21.0, f32::NAN);
        let found = mean.noise_of_halves(&halves, Rows::ALL);
        let (usual, worst) = ((0.1f64 / 1.1).powi(2), (10.0f64 / 1.1).powi(2));
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        assert_eq!(found.pixels, 6399);
        close(found.noise, 6398.0 * usual + worst);
        // without 63
        close(found.calm, 6336.0 * usual);
        let rows = [98.0 * 8.0 * usual.sqrt(), (63.0 * usual + worst).sqrt(), (63.0 * usual).sqrt()];
        close(found.deviation, rows.iter().sum());
    }

    #[test]
    fn some_of_the_rows_of_a_large_picture_are_enough() {
        let counted = |pixels: usize| {
            let rows = Rows::some(pixels, 3);
            (0..pixels).step_by(ROW).filter(|&k| rows.have(k)).count()
        };
        assert_eq!(counted(ENOUGH * ROW), ENOUGH);
        assert!((30..70).contains(&counted(400 * ROW)), "{}", counted(400 * ROW));
        assert!((700..900).contains(&counted(32 * 800 * ROW)), "{}", counted(32 * 800 * ROW));
    }
}
