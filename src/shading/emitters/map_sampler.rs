//! Images as emitters: bilinear lookup, and sampling in proportion to it.

use crate::math::{ONE_MINUS_EPSILON, luminance, warp};
use crate::scene::Image;
use glam::{DVec3, Vec2, Vec3};
use half::bf16;
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
/// interpolation: it is nowhere zero where the interpolation is not. The means are kept in 16 bits, which
/// is a matter of noise and not of truth: the density is defined by what is kept.
#[derive(Clone, Debug)]
pub(super) struct MapSampler {
    image: Arc<Image>,
    layout: Layout,
    width: usize,
    height: usize,
    /// Mean luminance of each cell.
    cells: Vec<bf16>,
    /// Share of the layout's measure that one cell of each row takes.
    shares: Vec<f32>,
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
        let (cells, levels) = (vec![bf16::ZERO; width * height], Vec::new());
        let shares = (0..height).map(|y| cell_share(layout, width, height, y) as f32).collect();
        let mut map = Self { image, layout, width, height, cells, shares, levels, mean: Vec3::ZERO };
        map.fill_cells();
        let mut level = map.sums_of(width, height, |x, y| map.cell(x, y));
        while level.sums.len() > 1 {
            let above = map.sums_of(level.width, level.height, |x, y| level.get(x, y));
            map.levels.push(std::mem::replace(&mut level, above));
        }
        map.levels.push(level);
        map
    }

    /// Computes the cells' means and the mean colour.
    fn fill_cells(&mut self) {
        /// Rows per task: two more are read than are written.
        const BAND: usize = 32;
        let mut cells = std::mem::take(&mut self.cells);
        let bands = cells.par_chunks_mut(BAND * self.width).enumerate().map(|(band, cells)| {
            let first = (band * BAND) as isize;
            let rows = (cells.len() / self.width) as isize;
            let mut colour = DVec3::ZERO;
            // rows from one above the band to one below it
            let luminances: Vec<Vec<f32>> = (first - 1..=first + rows)
                .map(|y| {
                    let mut sum = DVec3::ZERO;
                    let row = (0..self.width as isize).map(|x| {
                        let c = self.texel(x, y);
                        sum += c.as_dvec3();
                        luminance(c)
                    });
                    let row = row.collect();
                    if (first..first + rows).contains(&y) {
                        colour += sum * self.row_weight(y as usize);
                    }
                    row
                })
                .collect();
            for (three, row) in luminances.windows(3).zip(cells.chunks_mut(self.width)) {
                let column = |x: usize| three[0][x] * 0.125 + three[1][x] * 0.75 + three[2][x] * 0.125;
                for (x, cell) in row.iter_mut().enumerate() {
                    let (left, right) = self.neighbours(x);
                    *cell = keep(column(left) * 0.125 + column(x) * 0.75 + column(right) * 0.125);
                }
            }
            colour
        });
        let colours: Vec<DVec3> = bands.collect();
        self.mean = colours.into_iter().sum::<DVec3>().as_vec3();
        self.cells = cells;
    }

    /// Sums over 2x2 entries of a grid.
    fn sums_of(&self, width: usize, height: usize, get: impl Fn(usize, usize) -> f32 + Sync) -> Level {
        let (w, h) = (width.div_ceil(2), height.div_ceil(2));
        let mut sums = vec![0.0; w * h];
        sums.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            for (x, sum) in row.iter_mut().enumerate() {
                let (x, y) = (2 * x, 2 * y);
                *sum = get(x, y) + get(x + 1, y) + get(x, y + 1) + get(x + 1, y + 1);
            }
        });
        Level { width: w, height: h, sums }
    }

    /// Mean colour over the layout's measure.
    pub fn mean(&self) -> Vec3 {
        self.mean
    }

    fn total(&self) -> f32 {
        self.levels.last().map_or(0.0, |l| l.get(0, 0))
    }

    /// A texel. At most one beyond the edges: clamped or, around the sphere, periodic.
    fn texel(&self, x: isize, y: isize) -> Vec3 {
        let (width, height) = (self.width as isize, self.height as isize);
        let x = match self.layout {
            Layout::Flat => x.clamp(0, width - 1),
            Layout::LatLong if x < 0 => x + width,
            Layout::LatLong if x >= width => x - width,
            Layout::LatLong => x,
        };
        self.image.texel(x as u32, y.clamp(0, height - 1) as u32).truncate().max(Vec3::ZERO)
    }

    /// Columns to the left and to the right of `x`.
    fn neighbours(&self, x: usize) -> (usize, usize) {
        let last = self.width - 1;
        match self.layout {
            Layout::Flat => (x.saturating_sub(1), (x + 1).min(last)),
            Layout::LatLong => (if x == 0 { last } else { x - 1 }, if x == last { 0 } else { x + 1 }),
        }
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

    /// Weight of the texels of row `y` in the mean of the bilinear interpolation: they spread over the
    /// cells of their own row and of the two next to it.
    fn row_weight(&self, y: usize) -> f64 {
        let share = |y: usize| self.shares[y] as f64;
        let (above, below) = (share(y.saturating_sub(1)), share((y + 1).min(self.height - 1)));
        0.125 * above + 0.75 * share(y) + 0.125 * below
    }

    fn cell_mean(&self, x: usize, y: usize) -> f32 {
        self.cells[y * self.width + x].to_f32()
    }

    /// Weight of a cell: its mean times its share; zero outside the image.
    fn cell(&self, x: usize, y: usize) -> f32 {
        match x < self.width && y < self.height {
            true => self.cell_mean(x, y) * self.shares[y],
            false => 0.0,
        }
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

    /// The numbers from which [`MapSampler::sample`] draws a point.
    pub fn square_of(&self, at: Vec2) -> Vec2 {
        let mut x = ((at.x * self.width as f32) as usize).min(self.width - 1);
        let mut y = ((at.y * self.height as f32) as usize).min(self.height - 1);
        let mut u = Vec2::new(at.x * self.width as f32 - x as f32, self.part_of_row(y, at.y));
        for level in 0..self.levels.len() {
            let get = |x: usize, y: usize| match level {
                0 => self.cell(x, y),
                _ => self.levels[level - 1].get(x, y),
            };
            let ([x0, y0], odd) = ([x & !1, y & !1], [x & 1, y & 1]);
            let row = |y: usize| get(x0, y) + get(x0 + 1, y);
            u.x = unchoose(get(x0, y), get(x0 + 1, y), odd[0], u.x);
            u.y = unchoose(row(y0), row(y0 + 1), odd[1], u.y);
            (x, y) = (x / 2, y / 2);
        }
        warp::in_unit_square(u)
    }

    /// What [`MapSampler::row_point`] takes to a coordinate within row `y`.
    fn part_of_row(&self, y: usize, at: f32) -> f32 {
        let (a, b) = (y as f64 / self.height as f64, (y + 1) as f64 / self.height as f64);
        let measure = |t: f64| match self.layout {
            Layout::Flat => t,
            Layout::LatLong if t > 0.5 => 1.0 - ((1.0 - t) * PI / 2.0).sin().powi(2),
            Layout::LatLong => (t * PI / 2.0).sin().powi(2),
        };
        (((measure(at as f64) - measure(a)) / (measure(b) - measure(a))) as f32).clamp(0.0, 1.0)
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

/// Share of the layout's measure that one cell of row `y` takes.
fn cell_share(layout: Layout, width: usize, height: usize, y: usize) -> f64 {
    let row = match layout {
        Layout::Flat => 1.0 / height as f64,
        // cos a - cos b = 2 sin((a+b)/2) sin((b-a)/2), of the whole 2
        Layout::LatLong => {
            let step = PI / height as f64;
            ((y as f64 + 0.5) * step).sin() * (0.5 * step).sin()
        }
    };
    row / width as f64
}

/// A cell's mean as it is kept: finite, and zero only where it is.
fn keep(mean: f32) -> bf16 {
    match bf16::from_f32(mean).min(bf16::MAX) {
        k if k == bf16::ZERO && mean > 0.0 => bf16::MIN_POSITIVE_SUBNORMAL,
        k => k,
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

/// The number from which [`choose`] made this choice and left `rest`.
fn unchoose(a: f32, b: f32, choice: usize, rest: f32) -> f32 {
    let p = a / (a + b);
    match choice {
        _ if a + b <= 0.0 => rest,
        0 => rest * p,
        _ => p + rest * (1.0 - p),
    }
}
