//! How often a pixel looks for light on its primary segment.
//!
//! Lamps seen through glass, in mirrors and at their edges are small and very bright: most of a picture's noise may be
//! that they are met or missed. A primary segment alone costs a few rays, where an iteration's whole path costs dozens. So in
//! blocks of pixels where it pays, an iteration follows several, of which one goes on to the rest of its path, and takes the
//! mean of the light on them. With `n` glances of a block, each of variance `V` and cost `c`, beside other noise `U` of the whole
//! picture that an iteration of cost `C` brings, the product of error and cost is least at `n² = V C / (U c)` (Neyman's
//! allotment). Numbers rest on earlier iterations alone, so they bias nothing.

use super::camera::Primary;
use super::sizes::{block, blocks};
use crate::film::Rect;
use crate::math::luminance;
use glam::Vec3;
use rayon::prelude::*;

/// Most glances of a pixel in an iteration.
pub const MOST: u32 = 256;
/// Most that all of them may cost, as a share of what the rest of an iteration does: the rest of the picture counts, too.
const MOST_COST: f64 = 0.5;
/// What an iteration costs over its rays.
const OVER_RAYS: f64 = 2.0;
/// Share of that cost that goes to blocks with Dirac chains from the first, and most glances for it: what has not been met
/// yet may be there.
const IN_ADVANCE: f64 = 0.1;
/// See [`IN_ADVANCE`].
const MOST_IN_ADVANCE: f64 = 8.0;
/// Glances of every pixel in the first iteration of a scene with Dirac lobes, when nothing is known.
const AT_FIRST: u32 = 4;
/// Mean rays of a glance above which a block has Dirac chains.
const CHAINS: f64 = 1.02;
/// Of the picture's brightness, what is added to that of a block where noise is judged.
const DARK: f64 = 0.05;

/// Sums over the iterations of a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Luminance on primary segments, by glance, and its square.
    light: [f32; 2],
    /// Glances.
    glances: u32,
    /// Luminance of all else, by iteration, and its square.
    rest: [f32; 2],
    /// Iterations: not all pixels have the same where one was stopped between bands.
    iterations: u32,
}

/// What is known of the light on primary segments.
#[derive(Debug, Default)]
pub struct Glances {
    picture: Rect,
    seen: Vec<Seen>,
    /// For every block, rays that glances took.
    rays: Vec<u64>,
    /// For every block, glances of each of its pixels in an iteration.
    numbers: Vec<u32>,
    /// All rays of the iterations so far.
    all_rays: u64,
}

impl Glances {
    /// Begins a picture, a part of the full film, unless it has begun already. `may_chain`: whether there are Dirac lobes.
    pub fn begin(&mut self, picture: Rect, may_chain: bool) {
        if self.picture != picture {
            let count = blocks(picture).into_iter().product();
            let seen = vec![Seen::default(); picture.area()];
            *self = Self {
                picture,
                seen,
                rays: vec![0; count],
                numbers: vec![if may_chain { AT_FIRST } else { 1 }; count],
                all_rays: 0,
            };
        }
    }

    /// Glances of a pixel of the full film.
    pub fn number(&self, x: u32, y: u32) -> u32 {
        self.numbers[block(self.picture, x, y)]
    }

    /// Adds what a band shows after an iteration: `reflected` is the radiance beside the light on its primary segment.
    pub fn add(&mut self, band: Rect, primaries: &[Primary], reflected: impl Fn(&Primary) -> Vec3 + Sync) {
        let first = self.picture.index(band.x, band.y);
        let add = |(seen, p): (&mut Seen, &Primary)| {
            let rest = luminance(reflected(p));
            let sums = [luminance(p.light) * p.glances as f32, p.square];
            if rest.is_finite() && sums.iter().all(|s| s.is_finite()) {
                seen.light = [seen.light[0] + sums[0], seen.light[1] + sums[1]];
                seen.glances += p.glances;
                seen.rest = [seen.rest[0] + rest, seen.rest[1] + rest * rest];
                seen.iterations += 1;
            }
        };
        self.seen[first..][..band.area()].par_iter_mut().zip(primaries).for_each(add);
        for ((x, y), p) in band.pixels().zip(primaries) {
            self.rays[block(self.picture, x, y)] += u64::from(p.rays);
        }
    }

    /// Ends an iteration that took so many rays, after which `completed` are; sometimes the numbers are chosen anew.
    pub fn end_iteration(&mut self, completed: u32, rays: u64) {
        self.all_rays += rays;
        if !completed.is_power_of_two() {
            return;
        }
        let mut pixels = vec![0u32; self.numbers.len()];
        let mut brightness = vec![0.0; self.numbers.len()];
        let mut on_segment = vec![0.0; self.numbers.len()];
        let mut glances = vec![0u64; self.numbers.len()];
        let mut rest = vec![0.0; self.numbers.len()];
        for ((x, y), seen) in self.picture.pixels().zip(&self.seen) {
            let b = block(self.picture, x, y);
            let (light, variance) = mean_and_variance(seen.light, seen.glances);
            let (others, noise) = mean_and_variance(seen.rest, seen.iterations);
            pixels[b] += 1;
            // roots, so that a few bright pixels do not decide
            brightness[b] += (light + others).max(0.0).sqrt();
            on_segment[b] += variance;
            glances[b] += u64::from(seen.glances);
            rest[b] += noise;
        }
        for (bright, &n) in brightness.iter_mut().zip(&pixels) {
            *bright = (*bright / f64::from(n)).powi(2);
        }
        let floor = DARK * brightness.iter().sum::<f64>() / brightness.len() as f64;
        let scale = |b: usize| (brightness[b] + floor).powi(2);
        let other = (0..rest.len()).map(|b| rest[b] / scale(b)).sum::<f64>();
        let spent: u64 = self.rays.iter().sum();
        let cost = OVER_RAYS * self.all_rays.saturating_sub(spent) as f64 / f64::from(completed);
        let of_glance = |b: usize| self.rays[b] as f64 * f64::from(pixels[b]) / glances[b].max(1) as f64;
        // a ray a pixel without
        let has_chains = |b: usize| of_glance(b) > CHAINS * f64::from(pixels[b]);
        let chains = (0..rest.len()).filter(|&b| has_chains(b)).map(of_glance).sum::<f64>();
        let advance = (1.0 + IN_ADVANCE * cost / chains).min(MOST_IN_ADVANCE);
        let more: Vec<f64> = (0..rest.len())
            .map(|b| {
                let best = (on_segment[b] / scale(b) * cost / (other * of_glance(b))).sqrt();
                // what is NaN, for nothing is seen or known, is the lesser
                best.max(if has_chains(b) { advance } else { 1.0 }).min(f64::from(MOST)) - 1.0
            })
            .collect();
        let total = more.iter().enumerate().map(|(b, more)| more * of_glance(b)).sum::<f64>();
        let affordable = (MOST_COST * cost / total).min(1.0);
        let number = |more: &f64| (1.0 + affordable * more) as u32;
        self.numbers = more.iter().map(number).collect();
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.seen.capacity() * size_of::<Seen>()
    }
}

/// Mean of so many, and the variance of each, from their sum and that of their squares.
fn mean_and_variance([sum, squares]: [f32; 2], count: u32) -> (f64, f64) {
    let n = f64::from(count.max(1));
    let mean = f64::from(sum) / n;
    (mean, ((f64::from(squares) - n * mean * mean) / (n - 1.0).max(1.0)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Rect = Rect::new(32, 16, 48, 16);

    /// Glances of three blocks after so many iterations: the first sees a light in one glance of ten, the second a steady
    /// one, the third none; other light is noisy in all.
    fn chosen(completed: u32, bright: f32) -> [u32; 3] {
        let mut glances = Glances::default();
        glances.begin(PICTURE, true);
        assert_eq!(glances.number(40, 20), AT_FIRST);
        for i in 0..completed {
            let primaries: Vec<Primary> = PICTURE
                .pixels()
                .map(|(x, y)| {
                    let rays = 1 + u32::from(x < 64);
                    let light = match (x - 32) / 16 {
                        0 if (x * 7 + y * 3 + i) % 10 == 0 => bright,
                        1 => bright,
                        _ => 0.0,
                    };
                    let light = Vec3::splat(light);
                    let square = luminance(light).powi(2);
                    Primary { light, glances: 1, square, rays, ..Primary::NOTHING }
                })
                .collect();
            let noise = if i % 2 == 0 { 0.5 } else { 1.5 };
            glances.add(PICTURE, &primaries, |_| Vec3::splat(noise));
            glances.end_iteration(i + 1, 30 * PICTURE.area() as u64);
        }
        [40, 56, 72].map(|x| glances.number(x, 20))
    }

    #[test]
    fn more_glances_where_light_comes_and_goes() {
        assert_eq!(chosen(1, 100.0), [5, 5, 1]);
        // as many as half of the rest's cost allows: 28 rays in three blocks, a glance takes 2 in one
        let [most, steady, none] = chosen(16, 1000.0);
        assert!((40..=43).contains(&most), "{most}");
        assert_eq!([steady, none], [1, 1]);
        let [some, steady, none] = chosen(64, 4.0);
        assert!((6..MOST).contains(&some), "{some}");
        assert_eq!([steady, none], [5, 1]);
        // what overflows is left out
        assert_eq!(chosen(8, f32::MAX)[2], 1);
    }

    #[test]
    fn glances_are_alloted_as_the_formula_says() {
        // by hand for the picture above, by pixel of a block: three blocks cost 57 rays, a glance 2
        let n = 64.0;
        let v = 16.0 * (0.1 - 0.01);
        let brightness = [1.4, 5.0, 1.0];
        let floor = DARK * brightness.iter().sum::<f64>() / 3.0;
        let scale = brightness.map(|b| (b + floor).powi(2));
        let u = scale.iter().map(|s| 0.25 * n / (n - 1.0) / s).sum::<f64>();
        let best = (v / scale[0] * (3.0 * 57.0) / (u * 2.0)).sqrt();
        assert!((f64::from(chosen(64, 4.0)[0]) - best).abs() < 1.0, "{best}");
    }
}
