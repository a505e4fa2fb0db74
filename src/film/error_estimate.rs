//! How wrong the picture is, told without a reference.
//!
//! The relative mean squared error of a picture `x` against the truth `r`, over pixels and channels, is
//! `mean((x - r)² / (r² + (0.01 mean r)²))`. It is the sum of what more samples average out ([`super::noise`]) and of what
//! is systematic ([`super::bias`]).

use super::bias::{self, BySize, Halves, Hints};
use super::noise::{Pixel, of_pixel, scales};
use super::{Film, Tile};
use glam::Vec3;
use rayon::prelude::*;

/// Estimated relative mean squared error of a picture: the sum of its parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// The part that more samples average out.
    pub noise: f64,
    /// The part that is systematic, as far as it is beyond doubt; `None` if the samples had nothing to tell it by.
    pub bias: Option<f64>,
}

impl ErrorEstimate {
    /// Both parts.
    pub fn total(&self) -> f64 {
        self.noise + self.bias.unwrap_or(0.0)
    }
}

impl Film {
    /// Estimated error of the picture as it stands now; `None` before any pixel has two samples (pixels with fewer
    /// are left out).
    ///
    /// The noise is right on average for independent samples. Samples that are spread evenly on purpose
    /// (low-discrepancy sequences) make the picture better than their halves tell, so it errs to the safe side
    /// there. It reads the whole film, in parallel: ask between iterations, not for every tile.
    ///
    /// `hints`: what the integrator knows of its systematic error.
    pub fn estimated_error(&self, hints: Hints) -> Option<ErrorEstimate> {
        let (width, area) = (self.width() as usize, self.rect().area());
        let mut pixels = vec![None; area];
        let (mut differences, mut by_size) = (Vec::new(), BySize::default());
        self.visit(self.rect(), |tile, pixel, place| {
            pixels[place] = of_pixel(tile, pixel);
            if pixels[place].is_none() {
                return;
            }
            if let Some(found) = mean_differences(tile, pixel) {
                differences.resize(area, Halves::default());
                differences[place] = found;
            }
            if let Some(found) = tile.slopes(pixel) {
                by_size.add(place, area, found);
            }
        });
        let count = pixels.iter().flatten().count();
        if count == 0 {
            return None;
        }
        let Some(scales) = scales(&pixels, width) else {
            // wholly black: no light was found, and nothing disagrees
            return Some(ErrorEstimate { noise: 0.0, bias: None });
        };
        let square = |(p, scale): (&Option<Pixel>, &Vec3)| {
            p.map_or(0.0, |p| (p.variance.as_dvec3() * scale.as_dvec3().powf(2.0)).element_sum())
        };
        // what rows give is summed in their order, whatever thread it came from
        let rows: Vec<f64> = (pixels.par_chunks(width).zip(scales.par_chunks(width)))
            .map(|(row, scales)| row.iter().zip(scales).map(square).sum())
            .collect();
        let noise = rows.iter().sum::<f64>() / (3 * count) as f64;
        for (d, scale) in differences.iter_mut().zip(&scales) {
            *d = d.map(|d| d * scale);
        }
        let count = count as f64;
        let unfiltered =
            (!differences.is_empty()).then(|| bias::bounds(&differences, width).map(|sum| sum / count));
        let by_size = by_size.mean_square(&scales, width).map(|sum| sum / count);
        Some(ErrorEstimate { noise, bias: bias::agreed(unfiltered, by_size, hints) })
    }
}

/// Mean differences from the unfiltered estimates of a pixel's halves, both of which have samples.
fn mean_differences(tile: &Tile, pixel: usize) -> Option<Halves> {
    let (_, [n, m]) = tile.halves(pixel);
    tile.differences(pixel).map(|[even, odd]| [even / n as f32, odd / m as f32])
}
