//! Tabulated distributions: alias table, and piecewise constant density of the unit square.

use super::ONE_MINUS_EPSILON;
use glam::Vec2;

/// Discrete distribution sampled in constant time (Walker 1974, Vose 1991).
#[derive(Clone, Debug, Default)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Chance to stay in this bin.
    keep: f32,
    alias: u32,
    /// Probability of this outcome.
    probability: f32,
}

impl AliasTable {
    /// Probabilities in proportion to `weights`; negative and non-finite weights count as zero.
    /// `None` where nothing has weight.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let weights: Vec<f64> =
            weights.into_iter().map(|w| if w.is_finite() { w.max(0.0) } else { 0.0 }).collect();
        let sum: f64 = weights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let n = weights.len();
        let mut scaled: Vec<f64> = weights.iter().map(|w| w / sum * n as f64).collect();
        let mut bins: Vec<Bin> =
            weights.iter().map(|w| Bin { keep: 1.0, alias: 0, probability: (w / sum) as f32 }).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| scaled[i] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            bins[s].keep = scaled[s] as f32;
            bins[s].alias = l as u32;
            scaled[l] -= 1.0 - scaled[s];
            if scaled[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // rounding may leave an empty outcome in `small`: it must never be kept
        if let Some(best) = (0..n).max_by(|&a, &b| weights[a].total_cmp(&weights[b])) {
            for s in small {
                if weights[s] == 0.0 {
                    bins[s].keep = 0.0;
                    bins[s].alias = best as u32;
                }
            }
        }
        Some(Self { bins })
    }

    /// Draws an outcome: index, its probability, and `u` remapped to a fresh number in [0,1).
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let x = u as f64 * self.bins.len() as f64;
        let i = (x as usize).min(self.bins.len() - 1);
        let r = (x - i as f64) as f32;
        let bin = self.bins[i];
        let (index, fresh) = if r < bin.keep {
            (i, r / bin.keep)
        } else {
            (bin.alias as usize, (r - bin.keep) / (1.0 - bin.keep))
        };
        (index, self.bins[index].probability, fresh.clamp(0.0, ONE_MINUS_EPSILON))
    }

    /// Probability of outcome `index`.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        self.bins[index].probability
    }

    /// Number of outcomes.
    pub fn len(&self) -> usize {
        self.bins.len()
    }

    /// Whether there are no outcomes.
    pub fn is_empty(&self) -> bool {
        self.bins.is_empty()
    }
}

/// Piecewise constant density over the unit square, on a `width` by `height` grid.
#[derive(Clone, Debug)]
pub struct Grid2d {
    width: usize,
    height: usize,
    cells: AliasTable,
}

impl Grid2d {
    /// Density in proportion to `weights`, row by row. `None` where nothing has weight.
    pub fn new(width: usize, height: usize, weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let cells = AliasTable::new(weights)?;
        assert_eq!(cells.len(), width * height, "one weight per cell");
        Some(Self { width, height, cells })
    }

    /// Point of the unit square and its density per unit area of it.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (cell, probability, fresh) = self.cells.sample(u.x);
        let corner = Vec2::new((cell % self.width) as f32, (cell / self.width) as f32);
        let size = Vec2::new(self.width as f32, self.height as f32);
        // `u.y` stratifies one axis inside the cell, what is left of `u.x` the other
        let p = ((corner + Vec2::new(fresh, u.y)) / size).min(Vec2::splat(ONE_MINUS_EPSILON));
        (p, probability * (self.width * self.height) as f32)
    }

    /// Density at a point of the unit square.
    pub fn pdf(&self, p: Vec2) -> f32 {
        let x = ((p.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((p.y * self.height as f32) as usize).min(self.height - 1);
        self.cells.probability(y * self.width + x) * (self.width * self.height) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;

    #[test]
    fn outcomes_come_as_often_as_their_weights() {
        let weights = [0.0, 1.0, 5.0, 1e-3, 0.0, 3.0, f64::NAN, -1.0];
        let t = AliasTable::new(weights).unwrap();
        let n = 400_000;
        let mut count = [0u32; 8];
        for i in 0..n {
            let (k, p, fresh) = t.sample(hash_unit(i, 5));
            assert_eq!(p, t.probability(k));
            assert!((0.0..1.0).contains(&fresh));
            count[k] += 1;
        }
        for (k, &c) in count.iter().enumerate() {
            let e = t.probability(k) as f64 * n as f64;
            assert!((c as f64 - e).abs() <= 4.5 * e.sqrt(), "outcome {k}: {c} against {e}");
        }
        assert!(AliasTable::new([0.0, 0.0]).is_none());
        assert!(AliasTable::new([]).is_none());
    }

    #[test]
    fn grid_density_is_that_of_its_samples() {
        let g = Grid2d::new(4, 2, [1.0, 0.0, 2.0, 3.0, 0.5, 1.0, 0.0, 8.0]).unwrap();
        let mut sum = 0.0;
        let n = 100_000;
        for i in 0..n {
            let (p, pdf) = g.sample(Vec2::new(hash_unit(i, 0), hash_unit(i, 1)));
            assert_eq!(pdf, g.pdf(p));
            sum += (p.x / pdf) as f64;
        }
        // the integral of x over the cells that have density: all but columns 1 (row 0) and 2 (row 1)
        let expected = 0.5 - (0.375 + 0.625) * 0.125;
        assert!((sum / n as f64 - expected).abs() < 5e-3);
    }
}
