//! Tiles: the sums of a small rectangle of the film.

use super::bias::Slope;
use super::{FirstHit, Pass, PassSet, Rect, Sample};
use glam::{DVec3, Vec2, Vec3};
use std::collections::TryReserveError;

/// Value of the Depth pass where every sample left the scene, as Cycles has it: farther than anything.
pub const BACKGROUND_DEPTH: f32 = 1e10;

/// A rectangle of the film and what was delivered to it. The vector of a pass that nobody asked for is
/// empty.
#[derive(Debug)]
pub struct Tile {
    rect: Rect,
    /// Samples that count, per pixel.
    counts: Vec<u32>,
    /// Sums of radiance of the samples of even and of odd number.
    halves: Vec<[DVec3; 2]>,
    /// Sums, likewise, of radiance less its unfiltered estimate; empty until a sample has one.
    differences: Vec<[Vec3; 2]>,
    /// The same of radiance over the kernel's size; empty until a sample has one.
    slopes: Vec<[Slope; 2]>,
    /// Sums of coverage.
    alpha: Vec<f64>,
    sums: Sums,
    first: FirstHits,
    rejected: u64,
}

/// Sums of the averaged passes.
#[derive(Debug)]
struct Sums {
    normal: Vec<DVec3>,
    albedo: Vec<DVec3>,
    emission: Vec<DVec3>,
    direct: Vec<DVec3>,
    indirect: Vec<DVec3>,
}

/// What the first sample that hits something sees.
#[derive(Debug)]
struct FirstHits {
    seen: Vec<bool>,
    depth: Vec<f32>,
    position: Vec<Vec3>,
    uv: Vec<Vec2>,
    object_index: Vec<u32>,
    material_index: Vec<u32>,
}

/// `count` defaults, or an error where memory is short; nothing if they are not `wanted`.
fn zeros<T: Copy + Default>(wanted: bool, count: usize) -> Result<Vec<T>, TryReserveError> {
    let mut values = Vec::new();
    if wanted {
        values.try_reserve_exact(count)?;
        values.resize(count, T::default());
    }
    Ok(values)
}

/// Adds to the sum of a pixel, if the pass is kept.
#[inline]
fn add(sums: &mut [DVec3], pixel: usize, value: DVec3) {
    if let Some(sum) = sums.get_mut(pixel) {
        *sum += value;
    }
}

/// Light without negative rounding.
#[inline]
fn light(value: Vec3) -> DVec3 {
    value.max(Vec3::ZERO).as_dvec3()
}

/// Sets the value of a pixel, if the pass is kept.
#[inline]
fn set<T>(values: &mut [T], pixel: usize, value: T) {
    if let Some(place) = values.get_mut(pixel) {
        *place = value;
    }
}

impl Tile {
    pub(super) fn new(rect: Rect, passes: PassSet) -> Result<Self, TryReserveError> {
        let n = rect.area();
        let kept = |pass| passes.contains(pass);
        Ok(Self {
            rect,
            counts: zeros(true, n)?,
            halves: zeros(true, n)?,
            differences: Vec::new(),
            slopes: Vec::new(),
            alpha: zeros(true, n)?,
            sums: Sums {
                normal: zeros(kept(Pass::Normal), n)?,
                albedo: zeros(kept(Pass::Albedo), n)?,
                emission: zeros(kept(Pass::Emission), n)?,
                direct: zeros(kept(Pass::Direct), n)?,
                indirect: zeros(kept(Pass::Indirect), n)?,
            },
            first: FirstHits {
                seen: zeros(passes.iter().any(Pass::is_first_hit), n)?,
                depth: zeros(kept(Pass::Depth), n)?,
                position: zeros(kept(Pass::Position), n)?,
                uv: zeros(kept(Pass::Uv), n)?,
                object_index: zeros(kept(Pass::ObjectIndex), n)?,
                material_index: zeros(kept(Pass::MaterialIndex), n)?,
            },
            rejected: 0,
        })
    }

    /// Bytes of one pixel's sums.
    pub(super) fn bytes_per_pixel(passes: PassSet) -> u64 {
        let pass_bytes = |pass| match pass {
            Pass::Combined | Pass::Alpha => 0,
            Pass::Normal | Pass::Albedo | Pass::Emission | Pass::Direct | Pass::Indirect => {
                size_of::<DVec3>()
            }
            Pass::Depth => size_of::<f32>(),
            Pass::Position => size_of::<Vec3>(),
            Pass::Uv => size_of::<Vec2>(),
            Pass::ObjectIndex | Pass::MaterialIndex => size_of::<u32>(),
        };
        let always = size_of::<u32>()
            + size_of::<[DVec3; 2]>()
            + size_of::<[Vec3; 2]>()
            + size_of::<[Slope; 2]>()
            + size_of::<f64>();
        let seen = if passes.iter().any(Pass::is_first_hit) { size_of::<bool>() } else { 0 };
        (always + seen + passes.iter().map(pass_bytes).sum::<usize>()) as u64
    }

    /// The tile's place on the film.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Adds a sample to pixel `(x, y)` of the film, which must lie in the tile. A sample that is not finite,
    /// or negative beyond rounding, is left out and counted ([`super::Film::rejected_samples`]).
    pub fn add(&mut self, x: u32, y: u32, sample: &Sample) {
        if !sample.is_good() {
            self.rejected += 1;
            return;
        }
        let pixel = self.rect.index(x, y);
        let half = self.counts[pixel] as usize & 1;
        self.counts[pixel] += 1;
        self.halves[pixel][half] += light(sample.radiance);
        if let Some(unfiltered) = sample.unfiltered {
            self.differences.resize(self.counts.len(), Default::default());
            let difference = sample.radiance - unfiltered;
            self.differences[pixel][half] += if difference.is_finite() { difference } else { Vec3::ZERO };
        }
        if let Some(octaves) = sample.kernel_octaves.filter(|o| o.is_finite()) {
            self.slopes.resize(self.counts.len(), Default::default());
            self.slopes[pixel][half].add(sample.radiance, octaves);
        }
        self.alpha[pixel] += sample.alpha.clamp(0.0, 1.0) as f64;
        add(&mut self.sums.emission, pixel, light(sample.emission));
        add(&mut self.sums.direct, pixel, light(sample.direct));
        add(&mut self.sums.indirect, pixel, light(sample.indirect()));
        if let Some(hit) = &sample.first_hit {
            add(&mut self.sums.normal, pixel, hit.normal.as_dvec3());
            add(&mut self.sums.albedo, pixel, hit.albedo.as_dvec3());
            self.first.record(pixel, hit);
        }
    }

    /// Samples of a pixel that count.
    pub(super) fn count(&self, pixel: usize) -> u32 {
        self.counts[pixel]
    }

    /// Samples of the whole tile that count.
    pub(super) fn total_count(&self) -> u64 {
        self.counts.iter().map(|&n| n as u64).sum()
    }

    /// Samples that were delivered, whether they count or not.
    pub fn delivered(&self) -> u64 {
        self.total_count() + self.rejected
    }

    /// Samples that were left out.
    pub(super) fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Sums of radiance and sample counts of the two halves of a pixel.
    pub(super) fn halves(&self, pixel: usize) -> ([DVec3; 2], [u32; 2]) {
        let n = self.counts[pixel];
        (self.halves[pixel], [n - n / 2, n / 2])
    }

    /// Sums of the differences from the unfiltered estimate, of the halves of a pixel; `None` where there is no such
    /// estimate.
    pub(super) fn differences(&self, pixel: usize) -> Option<[Vec3; 2]> {
        self.differences.get(pixel).copied()
    }

    /// What the sizes of kernels tell of the halves of a pixel; `None` where nobody said them.
    pub(super) fn slopes(&self, pixel: usize) -> Option<[Slope; 2]> {
        self.slopes.get(pixel).copied()
    }

    /// Writes the value of a pass, which must be one the tile keeps, to `out` (as many floats as the pass
    /// has channels). Zero where there are no samples.
    pub(super) fn read(&self, pass: Pass, pixel: usize, out: &mut [f32]) {
        let n = self.counts[pixel];
        if n == 0 {
            out.fill(0.0);
            return;
        }
        let scale = 1.0 / n as f64;
        let mean = |sums: &[DVec3]| (sums[pixel] * scale).as_vec3().to_array();
        match pass {
            Pass::Combined => {
                let [even, odd] = self.halves[pixel];
                let rgb = ((even + odd) * scale).as_vec3();
                out.copy_from_slice(&rgb.extend((self.alpha[pixel] * scale) as f32).to_array());
            }
            Pass::Alpha => out[0] = (self.alpha[pixel] * scale) as f32,
            Pass::Normal => out.copy_from_slice(&mean(&self.sums.normal)),
            Pass::Albedo => out.copy_from_slice(&mean(&self.sums.albedo)),
            Pass::Emission => out.copy_from_slice(&mean(&self.sums.emission)),
            Pass::Direct => out.copy_from_slice(&mean(&self.sums.direct)),
            Pass::Indirect => out.copy_from_slice(&mean(&self.sums.indirect)),
            Pass::Depth => {
                out[0] = if self.first.seen[pixel] { self.first.depth[pixel] } else { BACKGROUND_DEPTH }
            }
            Pass::Position => out.copy_from_slice(&self.first.position[pixel].to_array()),
            Pass::Uv => {
                let there = if self.first.seen[pixel] { 1.0 } else { 0.0 };
                out.copy_from_slice(&self.first.uv[pixel].extend(there).to_array());
            }
            Pass::ObjectIndex => out[0] = self.first.object_index[pixel] as f32,
            Pass::MaterialIndex => out[0] = self.first.material_index[pixel] as f32,
        }
    }
}

impl FirstHits {
    /// Keeps the hit if it is the pixel's first and a pass wants it.
    fn record(&mut self, pixel: usize, hit: &FirstHit) {
        match self.seen.get_mut(pixel) {
            Some(seen) if !*seen => *seen = true,
            _ => return,
        }
        set(&mut self.depth, pixel, hit.depth);
        set(&mut self.position, pixel, hit.position);
        set(&mut self.uv, pixel, hit.uv);
        set(&mut self.object_index, pixel, hit.object_index);
        set(&mut self.material_index, pixel, hit.material_index);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::{hash, hash_unit};

    fn grey(value: f32) -> Sample {
        Sample { radiance: Vec3::splat(value), alpha: 1.0, ..Default::default() }
    }

    #[test]
    fn halves_take_turns_over_the_samples_that_count() {
        let mut tile = Tile::new(Rect::new(8, 4, 2, 1), PassSet::default()).unwrap();
        for value in [1.0, 10.0, 2.0, f32::NAN, 20.0, 4.0] {
            tile.add(9, 4, &grey(value));
        }
        assert_eq!(tile.halves(1), ([DVec3::splat(7.0), DVec3::splat(30.0)], [3, 2]));
        assert_eq!(tile.halves(0), ([DVec3::ZERO; 2], [0, 0]));
    }

    #[test]
    fn halves_of_independent_samples_are_uncorrelated() {
        let rect = Rect::new(0, 0, 100, 100);
        let mut tile = Tile::new(rect, PassSet::default()).unwrap();
        for i in 0..6 {
            rect.pixels().for_each(|(x, y)| tile.add(x, y, &grey(hash_unit(hash(x, y), i))));
        }
        // products of deviations, each half a mean of 3 uniform numbers
        let sum: f64 = (0..rect.area())
            .map(|pixel| {
                let ([a, b], [na, nb]) = tile.halves(pixel);
                (a.x / na as f64 - 0.5) * (b.x / nb as f64 - 0.5)
            })
            .sum();
        let deviation = (1.0 / 12.0 / 3.0) * (rect.area() as f64).sqrt();
        assert!(sum.abs() < 4.0 * deviation, "{} standard deviations", sum / deviation);
    }
}
