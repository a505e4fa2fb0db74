//! The kernel's size, chosen place by place: where what it blurs and what noise it leaves are in balance.
//!
//! What an iteration reflects at the first arrival of every camera path, over the albedo there, makes a picture of what
//! arrives at the surfaces, in two halves: the iterations of even and of odd number. Their difference tells the noise,
//! whose variance goes like one over the kernel's area. What a kernel of some size *would* blur is found by
//! filtering that picture: grouped as the grid groups arrivals, the mean of a voxel less its pixel's own value, times the
//! same of the other half. Noise of the halves is independent, so the product is on average the squared difference alone.
//! In every block of pixels the size counts for which the sum of both is least.

use super::Cut;
use super::camera::Primary;
use super::grid::Grid;
use super::sizes::{BLOCK, Sizes, blocks};
use super::store::Arrivals;
use crate::film::Rect;
use crate::math::sampler::hash;
use crate::shading::Sensor;
use rayon::prelude::*;

/// Sizes that are compared, octaves over one pixel: one after the other.
const CANDIDATES: [f32; 5] = [0.0, 1.0, 2.0, 3.0, 4.0];
/// The candidate whose voxels tell by what brightness differences are judged.
const JUDGE: usize = 2;
/// Of the picture's mean, what is added to that brightness.
const DARK: f32 = 0.05;
/// Most octaves over the nominal size. The chosen sizes shrink with it in the end, whatever is found: the picture converges.
const MOST: f32 = 2.0;
/// First iteration after which sizes are chosen; then after every power of two.
const FIRST: u32 = 4;
/// By how much squared differences count more than squared noise. The picture that is filtered is blurred already, so
/// that it tells too little, least of all beside small bright spots (`benches/NOTES.md` has what other factors gave).
const BLUR: f64 = 3.0;
/// Share of a block's pixels that have to tell something.
const LEAST_SHARE: f64 = 0.1;
/// Cosine between normals of neighbouring pixels above which the surface goes on.
const SMOOTH: f32 = 0.8;

/// What a block of pixels tells.
#[derive(Clone, Copy, Debug, Default)]
struct Evidence {
    /// Pixels that tell anything.
    pixels: f64,
    /// Sum of the relative variances of their means.
    noise: f64,
    /// Sums of the relative squared differences that each candidate would make.
    blur: [f64; CANDIDATES.len()],
}

impl Evidence {
    /// Squared differences, counted as they are judged, that a kernel makes of so many octaves over a pixel.
    fn blur_of(&self, octaves: f32) -> f64 {
        let last = CANDIDATES.len() - 1;
        let at = (octaves - CANDIDATES[0]).clamp(0.0, CANDIDATES[last]);
        let below = (at as usize).min(last - 1);
        let [low, high] = [self.blur[below], self.blur[below + 1]];
        BLUR * (low + f64::from(at - CANDIDATES[below]) * (high - low))
    }

    /// The candidate of least error for as many iterations as there were, over which the sum of the reciprocal squared
    /// sizes was `densities`; `None` where too little is known.
    fn best(&self, completed: u32, densities: f64) -> Option<f32> {
        if self.pixels < LEAST_SHARE * f64::from(BLOCK * BLOCK) {
            return None;
        }
        // of a kernel of one pixel
        let noise = self.noise * f64::from(completed) / densities;
        let error =
            |k: usize| BLUR * self.blur[k].max(0.0) + noise * f64::from(CANDIDATES[k]).exp2().powi(-2);
        let best = (0..CANDIDATES.len()).min_by(|&a, &b| error(a).total_cmp(&error(b)))?;
        error(best).is_finite().then_some(CANDIDATES[best])
    }
}

/// What is known of the picture, and the sizes that follow from it.
#[derive(Debug, Default)]
pub struct Adaptation {
    picture: Rect,
    /// For every pixel, the sums of the two halves.
    shown: Vec<[f32; 2]>,
    /// For every block, octaves over the nominal size, and the sum over all iterations of the reciprocal squared size.
    octaves: Vec<f32>,
    densities: Vec<f64>,
    evidence: Vec<Evidence>,
    sizes: Sizes,
    blur: Option<f64>,
}

/// A band of the picture after an iteration.
#[derive(Clone, Copy, Debug)]
pub struct Look<'a> {
    /// Its place on the full film.
    pub band: Rect,
    /// The camera.
    pub sensor: &'a Sensor,
    /// What its pixels saw, row by row.
    pub primaries: &'a [Primary],
    /// Arrivals of the camera's paths.
    pub arrivals: &'a Arrivals,
    /// Seed of the grids.
    pub seed: u32,
    /// Iterations with this one.
    pub completed: u32,
}

impl Adaptation {
    /// Begins a picture, a part of the full film, unless it has begun already.
    pub fn begin(&mut self, picture: Rect) {
        if self.picture != picture {
            let count = blocks(picture).into_iter().product();
            *self = Self {
                picture,
                shown: vec![[0.0; 2]; picture.area()],
                octaves: vec![0.0; count],
                densities: vec![0.0; count],
                evidence: vec![Evidence::default(); count],
                sizes: Sizes::default(),
                blur: None,
            };
        }
    }

    /// The sizes now.
    pub fn sizes(&self) -> &Sizes {
        &self.sizes
    }

    /// Relative mean squared error that the kernels make by what they blur, as it was found when sizes were last chosen.
    pub fn blur(&self) -> Option<f64> {
        self.blur
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.shown.capacity() * size_of::<[f32; 2]>() + self.evidence.capacity() * size_of::<Evidence>()
    }

    /// Adds what a band shows after an iteration: `light` is what its pixel reflects over the albedo. Some iterations are
    /// looked at closely.
    pub fn add(&mut self, look: &Look, light: impl Fn(&Primary) -> f32 + Sync, cut: &Cut) {
        let first = self.picture.index(look.band.x, look.band.y);
        let shown = &mut self.shown[first..][..look.band.area()];
        let half = (look.completed - 1) as usize & 1;
        let add = |(sums, p): (&mut [f32; 2], &Primary)| {
            let light = light(p);
            sums[half] += if light.is_finite() { light } else { 0.0 };
        };
        shown.par_iter_mut().zip(look.primaries).for_each(add);
        if chooses(look.completed) {
            self.compare(look, cut);
        }
    }

    /// Collects what a band tells.
    fn compare(&mut self, look: &Look, cut: &Cut) {
        let Look { band, sensor, arrivals, seed, completed, .. } = *look;
        let first = self.picture.index(band.x, band.y);
        let counts = [completed.div_ceil(2), completed / 2].map(|n| n as f32);
        let shown = &self.shown[first..][..band.area()];
        let means: Vec<[f32; 2]> = shown.iter().map(|s| [s[0] / counts[0], s[1] / counts[1]]).collect();
        let clear = clear_pixels(look);
        let all = clear.iter().map(|&(pixel, _)| f64::from(middle(means[pixel as usize]))).sum::<f64>();
        let floor = DARK * (all / clear.len().max(1) as f64) as f32;
        let mut scales = vec![0.0f32; means.len()];
        let mut keys = Vec::new();
        for k in std::iter::once(JUDGE).chain((0..CANDIDATES.len()).filter(|&k| k != JUDGE)) {
            if cut.is_raised() {
                return;
            }
            let grid = Grid::new(sensor, CANDIDATES[k].exp2(), hash(seed, k as u32));
            keys.clear();
            keys.par_extend(clear.par_iter().map(|&(pixel, a)| (grid.key(&arrivals.get(a as usize)), pixel)));
            // pixels make the order unique, so it does not depend on the threads
            keys.par_sort_unstable();
            for voxel in keys.chunk_by(|a, b| a.0 == b.0) {
                let pixels = voxel.iter().map(|&(_, pixel)| pixel as usize);
                let sum = pixels.clone().fold([0.0; 2], |s, i| [s[0] + means[i][0], s[1] + means[i][1]]);
                let mean = sum.map(|s| s / voxel.len() as f32);
                for i in pixels {
                    let evidence = &mut self.evidence[block(self.picture, band, i)];
                    if k == JUDGE {
                        scales[i] = 1.0 / (middle(mean) + floor).max(f32::MIN_POSITIVE);
                        evidence.pixels += 1.0;
                        evidence.noise += f64::from(0.5 * (means[i][0] - means[i][1]) * scales[i]).powi(2);
                    }
                    let difference = |half: usize| f64::from((mean[half] - means[i][half]) * scales[i]);
                    evidence.blur[k] += difference(0) * difference(1);
                }
            }
        }
    }

    /// Ends an iteration of some nominal size in pixels, after which `completed` are; `next` is that of the next one.
    pub fn end_iteration(&mut self, nominal: f32, next: f32, completed: u32) {
        for (density, octaves) in self.densities.iter_mut().zip(&self.octaves) {
            *density += f64::from(nominal * octaves.exp2()).powi(-2);
        }
        if !chooses(completed) {
            return;
        }
        let made = self.evidence.iter().zip(&self.octaves).map(|(e, o)| e.blur_of(nominal.log2() + o));
        let pixels = self.evidence.iter().map(|e| e.pixels).sum::<f64>();
        self.blur = (pixels > 0.0).then(|| made.sum::<f64>().max(0.0) / pixels).filter(|b| b.is_finite());
        // never below a pixel for its own sake: the pixel filter blurs as much
        let least = (-next.log2()).min(0.0);
        for ((evidence, density), octaves) in
            self.evidence.iter_mut().zip(&self.densities).zip(&mut self.octaves)
        {
            let best = std::mem::take(evidence).best(completed, *density);
            *octaves = best.map_or(0.0, |best| (best - next.log2()).clamp(least, MOST));
        }
        self.sizes = Sizes::new(self.picture, self.octaves.clone());
    }
}

/// Whether sizes are chosen after so many iterations.
fn chooses(completed: u32) -> bool {
    completed >= FIRST && completed.is_power_of_two()
}

/// Mean of two halves.
fn middle(halves: [f32; 2]) -> f32 {
    0.5 * (halves[0] + halves[1])
}

/// The block of a band's pixel.
fn block(picture: Rect, band: Rect, pixel: usize) -> usize {
    let (x, y) = (pixel as u32 % band.width, pixel as u32 / band.width);
    let (x, y) = (band.x - picture.x + x, band.y - picture.y + y);
    let [across, _] = blocks(picture);
    (y / BLOCK) as usize * across + (x / BLOCK) as usize
}

/// Pixels around which the surface goes on, so that what they show is that of one place, with their arrivals.
fn clear_pixels(look: &Look) -> Vec<(u32, u32)> {
    let (width, height) = (look.band.width, look.band.height);
    let seen = |pixel: u32| {
        let p = &look.primaries[pixel as usize];
        p.arrival.filter(|_| p.albedo > 0.0).map(|a| (a, p.passages))
    };
    let clear = |pixel: u32| {
        let (number, passages) = seen(pixel)?;
        let a = look.arrivals.get(number as usize);
        let reach = look.sensor.pixel_footprint(a.position);
        let goes_on = |neighbour: u32| {
            seen(neighbour).is_some_and(|(n, p)| {
                let b = look.arrivals.get(n as usize);
                let rise = (b.position - a.position).dot(a.normal).abs();
                p == passages && a.class == b.class && a.normal.dot(b.normal) > SMOOTH && rise < reach
            })
        };
        let (x, y) = (pixel % width, pixel / width);
        let all_around = (x == 0 || goes_on(pixel - 1))
            && (x + 1 == width || goes_on(pixel + 1))
            && (y == 0 || goes_on(pixel - width))
            && (y + 1 == height || goes_on(pixel + width));
        all_around.then_some((pixel, number))
    };
    (0..width * height).into_par_iter().filter_map(clear).collect()
}

#[cfg(test)]
mod tests;
