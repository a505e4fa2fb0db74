//! The kernel's size, chosen place by place: where what it blurs and what noise it leaves are in balance.
//!
//! What an iteration reflects at the first arrival of every camera path, over the albedo there, makes a picture of what
//! arrives at the surfaces, in two halves: the iterations of even and of odd number. Their difference tells the noise,
//! whose variance goes like one over the kernel's area. What a kernel of some size *would* blur is found by
//! filtering that picture: grouped as the grid groups arrivals, the mean of a voxel less its pixel's own value, times the
//! same of the other half and of another grid. Noise of the halves is independent, so the product is on average the squared
//! difference alone, and what one grid does and another does not is noise, too. In every block of pixels the size counts for
//! which the sum of both is least.

use super::Cut;
use super::camera::Primary;
use super::grid::Grid;
use super::sizes::{BLOCK, Sizes, block, blocks};
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
/// Random grids with which the picture is filtered. Beside small bright spots they differ so much that two may tell of no
/// blur where there is a lot.
const GRIDS: u32 = 4;
/// The part of a pixel's sorting key that is its voxel's; the rest is its number.
const VOXEL: u64 = !0 << 32;
/// Least blur, over what a single grid does: beside an edge about half of that is left by many.
const LEAST_BLUR: f64 = 0.25;
/// Share of a block's pixels that have to tell something.
const LEAST_SHARE: f64 = 0.1;

/// For every candidate.
type PerSize = [f64; CANDIDATES.len()];

/// What a block of pixels tells.
#[derive(Clone, Copy, Debug, Default)]
struct Evidence {
    /// Pixels that tell anything.
    pixels: f64,
    /// Sum of the relative variances of their means.
    noise: f64,
    /// Sums of the relative squared differences that each candidate would make in the mean over its random grids: what
    /// the picture keeps of them.
    blur: PerSize,
    /// The same of a single grid, which is more: iterations average that away.
    of_one_grid: PerSize,
}

impl Evidence {
    /// The candidate of least error for as many iterations as there were, over which the sum of the reciprocal squared
    /// sizes was `densities`; `None` where too little is known.
    fn best(&self, completed: u32, densities: f64) -> Option<f32> {
        if self.pixels < LEAST_SHARE * f64::from(BLOCK * BLOCK) {
            return None;
        }
        let completed = f64::from(completed);
        // of a kernel of one pixel
        let noise = self.noise * completed / densities;
        let error = |k: usize| {
            let of_grids = (self.of_one_grid[k] - self.blur[k]).max(0.0) / completed;
            let blur = self.blur[k].max(LEAST_BLUR * self.of_one_grid[k]).max(0.0);
            BLUR * blur + of_grids + noise * f64::from(CANDIDATES[k]).exp2().powi(-2)
        };
        let best = (0..CANDIDATES.len()).min_by(|&a, &b| error(a).total_cmp(&error(b)))?;
        error(best).is_finite().then_some(CANDIDATES[best])
    }
}

/// How much each candidate has of a size between two of them.
fn shares(octaves: f32) -> PerSize {
    let last = CANDIDATES.len() - 1;
    let at = (octaves - CANDIDATES[0]).clamp(0.0, CANDIDATES[last]);
    let below = (at as usize).min(last - 1);
    let above = f64::from(at - CANDIDATES[below]);
    let mut shares = [0.0; CANDIDATES.len()];
    (shares[below], shares[below + 1]) = (1.0 - above, above);
    shares
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
    /// For every block, iterations by candidate, and what was last found out.
    used: Vec<PerSize>,
    evidence: Vec<Evidence>,
    sizes: Sizes,
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
    /// Those around which the surface goes on, see [`super::outline`].
    pub is_clear: &'a [bool],
    /// Arrivals of the camera's paths.
    pub arrivals: &'a Arrivals,
    /// Seed of the grids.
    pub seed: u32,
    /// Iterations with this one.
    pub completed: u32,
}

impl Adaptation {
    /// Begins an iteration, after which `completed` are, of a picture that is a part of the full film.
    pub fn begin(&mut self, picture: Rect, completed: u32) {
        if self.picture != picture {
            let count = blocks(picture).into_iter().product();
            *self = Self {
                picture,
                shown: vec![[0.0; 2]; picture.area()],
                octaves: vec![0.0; count],
                densities: vec![0.0; count],
                used: vec![PerSize::default(); count],
                evidence: vec![Evidence::default(); count],
                sizes: Sizes::default(),
            };
        }
        if chooses(completed) {
            self.evidence.fill(Evidence::default());
        }
    }

    /// The sizes now.
    pub fn sizes(&self) -> &Sizes {
        &self.sizes
    }

    /// Relative mean squared error that the kernels of the iterations so far make by what they blur, as far as it was known when
    /// sizes were last chosen; a little too much where they were of several sizes.
    pub fn blur(&self) -> Option<f64> {
        let pixels = self.evidence.iter().map(|e| e.pixels).sum::<f64>();
        let of_block = |(e, used): (&Evidence, &PerSize)| {
            let all = used.iter().sum::<f64>();
            e.blur.iter().zip(used).map(|(blur, n)| blur * n / all).sum::<f64>()
        };
        let sum = self.evidence.iter().zip(&self.used).map(of_block).sum::<f64>();
        (pixels > 0.0).then(|| sum.max(0.0) / pixels).filter(|b| b.is_finite())
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
        let clear = telling_pixels(look);
        let all = clear.iter().map(|&(pixel, _)| f64::from(middle(means[pixel as usize]))).sum::<f64>();
        let floor = DARK * (all / clear.len().max(1) as f64) as f32;
        let mut scales = vec![0.0f32; means.len()];
        let mut keys: Vec<u64> = Vec::new();
        // over the grids: of the differences in either half, and of their products
        let mut sums = vec![([0.0f32; 2], 0.0f32); means.len()];
        for k in std::iter::once(JUDGE).chain((0..CANDIDATES.len()).filter(|&k| k != JUDGE)) {
            if cut.is_raised() {
                return;
            }
            sums.fill(Default::default());
            for g in 0..GRIDS {
                let seed = hash(seed, GRIDS * k as u32 + g);
                let grid = Grid::new(sensor, CANDIDATES[k].exp2(), seed);
                keys.clear();
                keys.par_extend(clear.par_iter().map(|&(pixel, a)| {
                    // half a key does: now and then two voxels are one
                    grid.key(&arrivals.get(a as usize)) & VOXEL | u64::from(pixel)
                }));
                // pixels make the order unique, so it does not depend on the threads
                keys.par_sort_unstable();
                for voxel in keys.chunk_by(|a, b| a & VOXEL == b & VOXEL) {
                    let pixels = voxel.iter().map(|&key| (key & !VOXEL) as usize);
                    let sum = pixels.clone().fold([0.0; 2], |s, i| [s[0] + means[i][0], s[1] + means[i][1]]);
                    let mean = sum.map(|s| s / voxel.len() as f32);
                    for i in pixels {
                        if k == JUDGE && g == 0 {
                            scales[i] = 1.0 / (middle(mean) + floor).max(f32::MIN_POSITIVE);
                        }
                        let [a, b] = [0, 1].map(|half| (mean[half] - means[i][half]) * scales[i]);
                        let (differences, products) = &mut sums[i];
                        *differences = [differences[0] + a, differences[1] + b];
                        *products += a * b;
                    }
                }
            }
            for &(pixel, _) in &clear {
                let i = pixel as usize;
                let (x, y) = (band.x + pixel % band.width, band.y + pixel / band.width);
                let evidence = &mut self.evidence[block(self.picture, x, y)];
                if k == JUDGE {
                    evidence.pixels += 1.0;
                    evidence.noise += f64::from(0.5 * (means[i][0] - means[i][1]) * scales[i]).powi(2);
                }
                let ([a, b], same) = sums[i];
                let (all, same, n) = (f64::from(a) * f64::from(b), f64::from(same), f64::from(GRIDS));
                evidence.blur[k] += (all - same) / (n * (n - 1.0));
                evidence.of_one_grid[k] += same / n;
            }
        }
    }

    /// Ends an iteration of some nominal size in pixels, after which `completed` are; `next` is that of the next one.
    pub fn end_iteration(&mut self, nominal: f32, next: f32, completed: u32) {
        let of_blocks = self.densities.iter_mut().zip(&mut self.used).zip(&self.octaves);
        for ((density, used), octaves) in of_blocks {
            *density += f64::from(nominal * octaves.exp2()).powi(-2);
            let shares = shares(nominal.log2() + octaves);
            used.iter_mut().zip(shares).for_each(|(used, share)| *used += share);
        }
        if !chooses(completed) {
            return;
        }
        // never below a pixel for its own sake: the pixel filter blurs as much
        let least = (-next.log2()).min(0.0);
        for ((evidence, density), octaves) in self.evidence.iter().zip(&self.densities).zip(&mut self.octaves)
        {
            let best = evidence.best(completed, *density);
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

/// Pixels around which the surface goes on and that reflect something, with their arrivals.
fn telling_pixels(look: &Look) -> Vec<(u32, u32)> {
    let pixels = look.primaries.iter().zip(look.is_clear).enumerate();
    let seen = |(pixel, (p, is_clear)): (usize, (&Primary, &bool))| {
        let arrival = p.arrival.filter(|_| *is_clear && p.albedo > 0.0)?;
        Some((pixel as u32, arrival))
    };
    pixels.filter_map(seen).collect()
}

#[cfg(test)]
mod tests;
