//! Images as emitters: bilinear lookup, and sampling in proportion to it.

use crate::math::{ONE_MINUS_EPSILON, luminance};
use crate::scene::Image;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// How an image is laid over its emitter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Over a plane: measure 1, clamped at the edges.
    Flat,
    /// Over the sphere by longitude and latitude: measure 4 pi, periodic in x.
    LatLong,
}

/// An image, and a pyramid of sums to sample it by (hierarchical sample warping, Clarberg et al. 2005).
///
/// The density is constant over a texel's cell, where it is in proportion to the mean of the *bilinear*
/// interpolation: it is nowhere zero where the interpolation is not. Cells themselves are computed from
/// the image when needed, so that only a third of a float per texel is stored.
#[derive(Clone, Debug)]
pub(super) struct MapSampler {
    image: Arc<Image>,
    layout: Layout,
    width: usize,
    height: usize,
    /// Sums over 2x2 cells, over 4x4 and so on, up to the whole.
    levels: Vec<Level>,
    mean: Vec3,
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    sums: Vec<f32>,
}

impl Level {
    fn get(&self, x: usize, y: usize) -> f32 {
        if x < self.width && y < self.height { self.sums[y * self.width + x] } else { 0.0 }
    }
}

impl MapSampler {
    pub fn new(image: Arc<Image>, layout: Layout) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let mut map = Self { image, layout, width, height, levels: Vec::new(), mean: Vec3::ZERO };
        map.mean = map.integrate_colour();
        let (w, h) = (width.div_ceil(2), height.div_ceil(2));
        let mut sums = vec![0.0; w * h];
        sums.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            let cells = [map.cell_row(2 * y), map.cell_row(2 * y + 1)];
            for (x, sum) in row.iter_mut().enumerate() {
                *sum = (2 * x..(2 * x + 2).min(width)).map(|x| cells[0][x] + cells[1][x]).sum();
            }
        });
        map.levels.push(Level { width: w, height: h, sums });
        while let Some(below) = map.levels.last().filter(|l| l.width * l.height > 1) {
            let (w, h) = (below.width.div_ceil(2), below.height.div_ceil(2));
            let sum = |i: usize| {
                let (x, y) = (i % w * 2, i / w * 2);
                below.get(x, y) + below.get(x + 1, y) + below.get(x, y + 1) + below.get(x + 1, y + 1)
            };
            let sums = (0..w * h).map(sum).collect();
            map.levels.push(Level { width: w, height: h, sums });
        }
        map
    }

    /// Mean colour over the layout's measure.
    pub fn mean(&self) -> Vec3 {
        self.mean
    }

    fn total(&self) -> f32 {
        self.levels.last().map_or(0.0, |l| l.get(0, 0))
    }

    /// A texel; neighbours beyond the edges are clamped or, around the sphere, periodic.
    fn texel(&self, x: isize, y: isize) -> Vec3 {
        let x = match self.layout {
            Layout::Flat => x.clamp(0, self.width as isize - 1),
            Layout::LatLong => x.rem_euclid(self.width as isize),
        };
        let y = y.clamp(0, self.height as isize - 1);
        self.image.texel(x as u32, y as u32).truncate().max(Vec3::ZERO)
    }

    /// Bilinear interpolation at a point of the unit square, y downwards.
    pub fn lookup(&self, at: Vec2) -> Vec3 {
        let p = at * Vec2::new(self.width as f32, self.height as f32) - 0.5;
        let (base, f) = (p.floor(), p - p.floor());
        let (x, y) = (base.x as isize, base.y as isize);
        let top = self.texel(x, y).lerp(self.texel(x + 1, y), f.x);
        let bottom = self.texel(x, y + 1).lerp(self.texel(x + 1, y + 1), f.x);
        top.lerp(bottom, f.y)
    }

    /// Share of the layout's measure that one cell of row `y` takes.
    fn cell_share(&self, y: usize) -> f64 {
        let rows = match self.layout {
            Layout::Flat => 1.0 / self.height as f64,
            // cos a - cos b = 2 sin((a+b)/2) sin((b-a)/2), of the whole 2
            Layout::LatLong => {
                let step = PI / self.height as f64;
                ((y as f64 + 0.5) * step).sin() * (0.5 * step).sin()
            }
        };
        rows / self.width as f64
    }

    /// Mean luminance of the bilinear interpolation over a cell: weights 1/8, 6/8, 1/8 along each axis.
    fn cell_mean(&self, x: usize, y: usize) -> f32 {
        let (x, y) = (x as isize, y as isize);
        let row = |y: isize| {
            let l = |x: isize| luminance(self.texel(x, y));
            l(x - 1) * 0.125 + l(x) * 0.75 + l(x + 1) * 0.125
        };
        row(y - 1) * 0.125 + row(y) * 0.75 + row(y + 1) * 0.125
    }

    /// Weight of a cell: its mean times its share; zero outside the image.
    fn cell(&self, x: usize, y: usize) -> f32 {
        match x < self.width && y < self.height {
            true => self.cell_mean(x, y) * self.cell_share(y) as f32,
            false => 0.0,
        }
    }

    /// [`MapSampler::cell`] for a whole row, reading each texel of the three rows once.
    fn cell_row(&self, y: usize) -> Vec<f32> {
        if y >= self.height {
            return vec![0.0; self.width];
        }
        let column = |x: isize| {
            let l = |dy: isize| luminance(self.texel(x, y as isize + dy));
            l(-1) * 0.125 + l(0) * 0.75 + l(1) * 0.125
        };
        let share = self.cell_share(y) as f32;
        let (mut left, mut middle) = (column(-1), column(0));
        (0..self.width)
            .map(|x| {
                let right = column(x as isize + 1);
                let mean = left * 0.125 + middle * 0.75 + right * 0.125;
                (left, middle) = (middle, right);
                mean * share
            })
            .collect()
    }

    fn integrate_colour(&self) -> Vec3 {
        let rows: Vec<DVec3> = (0..self.height)
            .into_par_iter()
            .map(|y| {
                let sum: DVec3 = (0..self.width).map(|x| self.texel(x as isize, y as isize).as_dvec3()).sum();
                // a texel spreads over its own row and the two next to it
                let row = |y: isize| self.cell_share(y.clamp(0, self.height as isize - 1) as usize);
                let y = y as isize;
                let edge = (y == 0) as u8 as f64 + (y == self.height as isize - 1) as u8 as f64;
                let inner = row(y - 1) * (y > 0) as u8 as f64
                    + row(y + 1) * (y + 1 < self.height as isize) as u8 as f64;
                sum * (row(y) * (0.75 + 0.125 * edge) + inner * 0.125)
            })
            .collect();
        rows.into_iter().sum::<DVec3>().as_vec3()
    }

    /// Point of the unit square, and its density per unit of the layout's measure. `None` where the
    /// image is black.
    pub fn sample(&self, u: Vec2) -> Option<(Vec2, f32)> {
        let (mut x, mut y, mut u) = (0, 0, u);
        for level in (0..self.levels.len()).rev() {
            let child = |dx: usize, dy: usize| match level {
                0 => self.cell(2 * x + dx, 2 * y + dy),
                _ => self.levels[level - 1].get(2 * x + dx, 2 * y + dy),
            };
            let c = [[child(0, 0), child(1, 0)], [child(0, 1), child(1, 1)]];
            let (low, v) = choose(c[0][0] + c[0][1], c[1][0] + c[1][1], u.y)?;
            let row = c[low];
            let (right, h) = choose(row[0], row[1], u.x)?;
            (x, y) = (2 * x + right, 2 * y + low);
            u = Vec2::new(h, v);
        }
        let pdf = self.density(self.cell_mean(x, y));
        let at = Vec2::new((x as f32 + u.x) / self.width as f32, self.row_point(y, u.y));
        Some((at, pdf))
    }

    /// Coordinate within row `y`, uniform in the layout's measure.
    fn row_point(&self, y: usize, u: f32) -> f32 {
        let (a, b) = (y as f64 / self.height as f64, (y + 1) as f64 / self.height as f64);
        let t = match self.layout {
            Layout::Flat => a + (b - a) * u as f64,
            Layout::LatLong => {
                // 1 - cos of half angles, exact at the upper pole; the lower one by symmetry
                let flip = y >= self.height.div_ceil(2);
                let (a, b) = if flip { (1.0 - a, 1.0 - b) } else { (a, b) };
                let s = |t: f64| (t * PI / 2.0).sin().powi(2);
                let t = (s(a) + (s(b) - s(a)) * u as f64).sqrt().asin() * 2.0 / PI;
                if flip { 1.0 - t } else { t }
            }
        };
        t as f32
    }

    /// Density of [`MapSampler::sample`] per unit of the layout's measure.
    pub fn pdf(&self, at: Vec2) -> f32 {
        let x = ((at.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((at.y * self.height as f32) as usize).min(self.height - 1);
        self.density(self.cell_mean(x, y))
    }

    fn density(&self, cell_mean: f32) -> f32 {
        let measure = match self.layout {
            Layout::Flat => 1.0,
            Layout::LatLong => 2.0 * TAU,
        };
        cell_mean / (self.total() * measure as f32)
    }
}

/// Chooses between two weights: 0 or 1, and `u` made uniform again. `None` where both are zero.
fn choose(a: f32, b: f32, u: f32) -> Option<(usize, f32)> {
    let p = a / (a + b);
    match u < p {
        _ if a + b <= 0.0 => None,
        true => Some((0, (u / p).min(ONE_MINUS_EPSILON))),
        false => Some((1, ((u - p) / (1.0 - p)).min(ONE_MINUS_EPSILON))),
    }
}
