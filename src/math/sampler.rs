//! Random numbers: stateless hashes and the per-path sampler.
//!
//! Every number is a function of (seed, pixel or path, sample, dimension) alone, so a picture does not
//! depend on the number of threads or on the order of the work.

use glam::{Vec2, Vec3};

/// Mixes two words into one (a xor-multiply finaliser; full avalanche).
#[inline]
pub fn hash(a: u32, b: u32) -> u32 {
    let mut h = a ^ b.wrapping_mul(0x9e37_79b9).rotate_left(15);
    h ^= h >> 16;
    h = h.wrapping_mul(0x21f0_aaad);
    h ^= h >> 15;
    h = h.wrapping_mul(0x735a_2d97);
    h ^ (h >> 15)
}

/// Mixes a point's coordinates into one word.
#[inline]
pub fn hash_point(p: Vec3) -> u32 {
    hash(p.x.to_bits(), hash(p.y.to_bits(), p.z.to_bits()))
}

/// Uniform number in [0,1) from a word.
#[inline]
pub fn unit(word: u32) -> f32 {
    (word >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Uniform number in [0,1) from two words.
#[inline]
pub fn hash_unit(a: u32, b: u32) -> f32 {
    unit(hash(a, b))
}

/// Dimensions served by the Owen-scrambled Sobol' sequence; later ones are plain hashes, which long
/// paths cannot be told apart from.
const SOBOL_DIMENSIONS: u32 = 64;
/// Length after which the sequence starts again under another scramble (a limit of the tables).
const SOBOL_LENGTH: u32 = 1 << 16;

/// Random numbers of one path: the first dimensions from an Owen-scrambled Sobol' sequence over the
/// samples of the same pixel (Burley 2020), the rest hashed.
#[derive(Clone, Debug)]
pub struct Sampler {
    seed: u32,
    index: u32,
    dimension: u32,
    /// Numbers of the current four dimensions: the sequence is computed four at a time.
    four: [f32; 4],
}

impl Sampler {
    /// The sampler of sample `index` of a stream (a pixel, or a light path slot); streams of different
    /// `stream` or `seed` are independent.
    pub fn new(seed: u32, stream: u32, index: u32) -> Self {
        let seed = hash(hash(seed, 0x5e9e), stream);
        let (seed, index) = (hash(seed, index / SOBOL_LENGTH), index % SOBOL_LENGTH);
        Self { seed, index, dimension: 0, four: [0.0; 4] }
    }

    /// Next number in [0,1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let d = self.dimension;
        self.dimension += 1;
        if d < SOBOL_DIMENSIONS {
            if d.is_multiple_of(4) {
                self.four = sobol_burley::sample_4d(self.index, d / 4, self.seed);
            }
            self.four[d as usize % 4]
        } else {
            unit(hash(hash(self.seed, d), self.index))
        }
    }

    /// Next pair.
    #[inline]
    pub fn next_2d(&mut self) -> Vec2 {
        Vec2::new(self.next_1d(), self.next_1d())
    }

    /// Next triple: a discrete choice and a direction.
    #[inline]
    pub fn next_3d(&mut self) -> Vec3 {
        Vec3::new(self.next_1d(), self.next_1d(), self.next_1d())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_over_every_axis() {
        // mean 1/2 and mean square 1/3 over samples, over streams and over dimensions
        let over = |f: &dyn Fn(u32) -> f32| {
            let n = 1 << 16;
            let (mut m1, mut m2) = (0.0, 0.0);
            for i in 0..n {
                let v = f(i) as f64;
                assert!((0.0..1.0).contains(&v));
                m1 += v;
                m2 += v * v;
            }
            (m1 / n as f64, m2 / n as f64)
        };
        let first = |seed, stream, index, skip| {
            let mut s = Sampler::new(seed, stream, index);
            (0..skip).for_each(|_| {
                s.next_1d();
            });
            s.next_1d()
        };
        for (m1, m2) in [
            over(&|i| first(1, 7, i, 0)),
            over(&|i| first(1, 7, i, 100)),
            over(&|i| first(1, i, 0, 0)),
            over(&|i| first(1, i, 3, 70)),
            over(&|i| first(i, 0, 0, 1)),
            over(&|i| first(i, 0, 0, 99)),
        ] {
            assert!((m1 - 0.5).abs() < 5e-3, "mean {m1}");
            assert!((m2 - 1.0 / 3.0).abs() < 5e-3, "mean square {m2}");
        }
    }

    #[test]
    fn neighbouring_streams_are_uncorrelated() {
        let n = 1 << 15;
        let mut c = 0.0;
        for i in 0..n {
            let a = Sampler::new(3, i, 0).next_1d() as f64 - 0.5;
            let b = Sampler::new(3, i + 1, 0).next_1d() as f64 - 0.5;
            c += a * b;
        }
        // variance of a product of two uniforms is 1/144
        let z = c / (n as f64 / 144.0).sqrt();
        assert!(z.abs() < 4.0, "z = {z}");
    }

    #[test]
    fn samples_of_a_pixel_are_stratified() {
        let mut strata = [0; 256];
        for i in 0..256 {
            strata[(Sampler::new(9, 4, i).next_1d() * 256.0) as usize] += 1;
        }
        assert!(strata.iter().all(|&n| n == 1));
    }
}
