//! Colours in six bytes: three mantissas of 13 bits and one exponent, that of the largest.

use glam::Vec3;

/// Bits of a mantissa.
const BITS: i32 = 13;
/// The largest.
const FULL: u32 = (1 << BITS) - 1;
/// Exponents, of which one is added: zero is that of black.
const LEAST: i32 = -126;
/// That of what is not finite.
const NOT_FINITE: u32 = 511;
/// Octaves by which small numbers are raised on their way.
const RAISE: i32 = 64;

/// A colour without negative components, of any scale that `f32` has: each to within `2^-13` (1.2e-4) of the largest, rounded
/// to nearest (and to within 8e-43): errors cancel in sums of colours of many scales, and components below a ten-thousandth of
/// the largest are lost. What is not finite stays so, all of it; what is negative becomes zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SharedExponent([u16; 3]);

impl SharedExponent {
    /// The nearest to a colour.
    #[inline]
    pub fn encode(c: Vec3) -> Self {
        if !c.is_finite() {
            return Self::pack([0; 3], NOT_FINITE);
        }
        let largest = c.max_element();
        if largest <= 0.0 {
            return Self::default();
        }
        let c = c.max(Vec3::ZERO);
        // the least that is more than the largest component; of denormal numbers, that of the least normal one
        let mut exponent = ((largest.to_bits() >> 23) as i32 - 126).max(LEAST);
        // those of small numbers would have no scale
        let (c, raised) = if exponent < -RAISE { (c * power(RAISE), RAISE) } else { (c, 0) };
        let round = |exponent: i32| {
            let scaled = c * power(BITS - exponent - raised) + 0.5;
            scaled.to_array().map(|m| m as i32 as u32)
        };
        let mut mantissas = round(exponent);
        if mantissas.iter().any(|&m| m > FULL) {
            if exponent < 128 {
                exponent += 1;
                mantissas = round(exponent);
            } else {
                mantissas = mantissas.map(|m| m.min(FULL));
            }
        }
        Self::pack(mantissas, (exponent - LEAST + 1) as u32)
    }

    /// The colour.
    #[inline]
    pub fn decode(self) -> Vec3 {
        let [low, middle, high] = self.0.map(u32::from);
        let mantissas = [low & FULL, (low >> BITS | middle << 3) & FULL, (middle >> 10 | high << 6) & FULL];
        let exponent = high >> 7;
        if exponent == NOT_FINITE {
            return Vec3::NAN;
        }
        let c = Vec3::from(mantissas.map(|m| m as i32 as f32));
        let exponent = exponent as i32 - 1 + LEAST - BITS;
        match exponent < LEAST {
            true => c * power(exponent + RAISE) * power(-RAISE),
            false => c * power(exponent),
        }
    }

    #[inline]
    fn pack([r, g, b]: [u32; 3], exponent: u32) -> Self {
        Self([(r | g << BITS) as u16, (g >> 3 | b << 10) as u16, (b >> 6 | exponent << 7) as u16])
    }
}

/// `2^n`, of `n` in the range of normal `f32`.
#[inline]
fn power(n: i32) -> f32 {
    f32::from_bits(((n + 127) as u32) << 23)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;
    use glam::DVec3;

    fn there_and_back(c: Vec3) -> Vec3 {
        SharedExponent::encode(c).decode()
    }

    #[test]
    fn colours_of_all_scales_come_back_to_within_the_bound_and_without_bias() {
        for power in -38..=38 {
            let scale = 10f32.powi(power);
            let (mut sum, mut exact) = (DVec3::ZERO, DVec3::ZERO);
            for k in 0..4000 {
                let c = Vec3::new(hash_unit(1, k), hash_unit(2, k), 0.01 * hash_unit(3, k)) * scale;
                let d = there_and_back(c);
                // the least of numbers are denormal
                let bound = c.max_element() * 2f32.powi(-13) + 8e-43;
                assert!((c - d).abs().max_element() <= bound, "{c} {d}");
                assert_eq!(there_and_back(d), d);
                (sum, exact) = (sum + d.as_dvec3(), exact + c.as_dvec3());
            }
            let off = (sum - exact).abs().max_element() / exact.max_element();
            assert!(off < 1e-5 || power < -37, "1e{power}: {off}");
        }
    }

    #[test]
    fn ends_of_the_range_stay() {
        assert_eq!(there_and_back(Vec3::ZERO), Vec3::ZERO);
        assert_eq!(there_and_back(Vec3::ONE), Vec3::ONE);
        assert_eq!(there_and_back(Vec3::new(-1.0, 0.5, -0.0)), Vec3::new(0.0, 0.5, 0.0));
        let largest = there_and_back(Vec3::splat(f32::MAX));
        assert!(largest.is_finite() && largest.x > 0.999 * f32::MAX);
        assert!(there_and_back(Vec3::splat(f32::MIN_POSITIVE)).x > 0.999 * f32::MIN_POSITIVE);
        assert!(there_and_back(Vec3::splat(1e-41)).x > 0.0);
        for c in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(!there_and_back(Vec3::new(1.0, c, 1.0)).is_finite());
        }
    }
}
