//! Gradient noise (Perlin 2002, "Improving Noise") and its fractal sum, as Blender has it.

use glam::{BVec3, IVec3, Vec3};

/// Factor that brings the noise to about [-1, 1].
const SPAN: f32 = 0.982;
/// Period along each axis, beyond which single precision has no room for octaves.
const PERIOD: f32 = 100_000.0;

/// Numbers of a fractal sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fractal {
    /// Octaves beyond the first, in part for what is not whole.
    pub detail: f32,
    /// Amplitude of an octave over that of the one before.
    pub roughness: f32,
    /// Frequency likewise.
    pub lacunarity: f32,
    /// Length by which places are moved by three noises more.
    pub distortion: f32,
}

/// The last mix of Jenkins 2006, "lookup3".
fn mixed(mut a: u32, mut b: u32, mut c: u32) -> u32 {
    let stir = |x: u32, y: u32, turn: u32| (x ^ y).wrapping_sub(y.rotate_left(turn));
    c = stir(c, b, 14);
    a = stir(a, c, 11);
    b = stir(b, a, 25);
    c = stir(c, b, 16);
    a = stir(a, c, 4);
    b = stir(b, a, 14);
    stir(c, b, 24)
}

/// A random number of a lattice point.
fn random(p: IVec3) -> u32 {
    const START: u32 = 0xdead_beef + (3 << 2) + 13;
    let [a, b, c] = [p.x, p.y, p.z].map(|v| START.wrapping_add(v as u32));
    mixed(a, b, c)
}

/// One of the gradients towards the middles of a cube's edges, times a vector.
fn gradient(lattice: IVec3, d: Vec3) -> f32 {
    let h = random(lattice) & 15;
    let u = if h < 8 { d.x } else { d.y };
    let v = match h {
        0..4 => d.y,
        12 | 14 => d.x,
        _ => d.z,
    };
    let signed = |v: f32, bit: u32| if h & bit == 0 { v } else { -v };
    signed(u, 1) + signed(v, 2)
}

/// Noise of mean zero, about in [-1, 1].
pub fn noise(p: Vec3) -> f32 {
    // rounding off what is huge would make lattice points of all places
    let shift = BVec3::new(p.x.abs() >= 1e6, p.y.abs() >= 1e6, p.z.abs() >= 1e6);
    let p = p % PERIOD + Vec3::select(shift, Vec3::splat(0.5), Vec3::ZERO);
    if !p.is_finite() {
        return 0.0;
    }
    let low = p.floor();
    let (corner, f) = (low.as_ivec3(), p - low);
    let t = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let at = |x: i32, y: i32, z: i32| {
        let step = IVec3::new(x, y, z);
        gradient(corner + step, f - step.as_vec3())
    };
    let mix = |a: f32, b: f32, t: f32| (1.0 - t) * a + t * b;
    let row = |y, z| mix(at(0, y, z), at(1, y, z), t.x);
    let layer = |z| mix(row(0, z), row(1, z), t.y);
    mix(layer(0), layer(1), t.z) * SPAN
}

impl Fractal {
    /// Its value at a place, about in [0, 1].
    pub fn at(&self, p: Vec3) -> f32 {
        self.octaves(self.distorted(p))
    }

    /// Three values at a place, of which the first is [`Self::at`].
    pub fn color_at(&self, p: Vec3) -> Vec3 {
        let p = self.distorted(p);
        Vec3::new(self.octaves(p), self.octaves(p + offset(3)), self.octaves(p + offset(4)))
    }

    fn distorted(&self, p: Vec3) -> Vec3 {
        if self.distortion == 0.0 {
            return p;
        }
        p + self.distortion * Vec3::from([0, 1, 2].map(|k| noise(p + offset(k))))
    }

    fn octaves(&self, p: Vec3) -> f32 {
        let (mut frequency, mut amplitude, mut most, mut sum) = (1.0, 1.0, 0.0, 0.0);
        for _ in 0..=self.detail as u32 {
            sum += noise(p * frequency) * amplitude;
            most += amplitude;
            amplitude *= self.roughness;
            frequency *= self.lacunarity;
        }
        let scaled = |sum: f32, most: f32| 0.5 * sum / most + 0.5;
        let part = self.detail.fract();
        let coarse = scaled(sum, most);
        if part == 0.0 {
            return coarse;
        }
        let fine = scaled(sum + noise(p * frequency) * amplitude, most + amplitude);
        coarse + (fine - coarse) * part
    }

    /// The finest length in it.
    pub fn finest(&self) -> f32 {
        self.lacunarity.max(1.0).powf(-self.detail.ceil())
    }
}

/// Where the noise of number `k` is taken from, far from the others: that which moves places, and further colours.
fn offset(k: u32) -> Vec3 {
    Vec3::from([0, 1, 2].map(|axis| 100.0 + 100.0 * unit(k, axis)))
}

/// A random number of [0, 1] of two.
fn unit(a: u32, b: u32) -> f32 {
    const START: u32 = 0xdead_beef + (2 << 2) + 13;
    let [a, b] = [a, b].map(|v| START.wrapping_add((v as f32).to_bits()));
    mixed(a, b, START) as f32 / u32::MAX as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::testing::place;

    #[test]
    fn noise_is_smooth_bounded_and_of_mean_zero() {
        let (mut sum, mut largest) = (0.0f64, 0.0f32);
        for i in 0..40_000 {
            let p = place(i);
            let v = noise(p);
            sum += f64::from(v);
            largest = largest.max(v.abs());
            assert!((noise(p + Vec3::splat(1e-3)) - v).abs() < 1e-2, "{p}");
            assert!(noise(p.round()).abs() < 1e-6, "nothing at lattice points");
        }
        assert!((sum / 40_000.0).abs() < 0.01 && (0.7..=1.0).contains(&largest), "{sum} {largest}");
        for p in [Vec3::splat(1e30), Vec3::INFINITY, Vec3::NAN, Vec3::splat(-2e6)] {
            assert!(noise(p).is_finite());
        }
    }

    #[test]
    fn details_come_in_gradually() {
        let of = |detail: f32| Fractal { detail, roughness: 0.5, lacunarity: 2.0, distortion: 0.0 };
        for i in 0..100 {
            let p = place(i);
            assert_eq!(of(0.0).at(p), 0.5 * noise(p) + 0.5);
            assert!((of(1.999).at(p) - of(2.0).at(p)).abs() < 1e-3);
            assert!((of(2.001).at(p) - of(2.0).at(p)).abs() < 1e-3);
        }
        assert_eq!(of(2.5).finest(), 0.125);
    }
}
