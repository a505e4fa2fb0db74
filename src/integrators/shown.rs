//! The picture so far, as that by which an iteration is judged.

use crate::film::{Film, Pass, Rect};
use crate::math::luminance;
use glam::Vec3;

/// Of the picture's mean brightness, what is added to that of a pixel where shares of it are judged.
const DARK: f32 = 0.1;
/// Pixels whose deviations are judged together.
const ROW: usize = 64;

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
    pub fn deviation(&self, other: &Self) -> f64 {
        let pixels = self.0.iter().zip(&other.0).zip(self.scales());
        let squares: Vec<f64> = pixels.map(|((a, b), scale)| f64::from((b - a) / scale).powi(2)).collect();
        let finite = |square: &&f64| square.is_finite();
        squares.chunks(ROW).map(|row| row.iter().filter(finite).sum::<f64>().sqrt()).sum()
    }
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
        assert!((mean.deviation(&found) - expected).abs() < 1e-4 * expected);
    }
}
