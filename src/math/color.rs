//! Linear Rec.709 colour: luminance and the sRGB transfer curve.

use glam::Vec3;

/// Relative luminance of the primaries of linear Rec.709.
pub const LUMINANCE: Vec3 = Vec3::new(0.212_671, 0.715_16, 0.072_169);

/// Relative luminance of a linear Rec.709 colour.
#[inline]
pub fn luminance(c: Vec3) -> f32 {
    c.dot(LUMINANCE)
}

/// Decodes one sRGB-encoded component to linear light (IEC 61966-2-1). Values outside `[0,1]` follow
/// the same curve, mirrored at zero.
pub fn srgb_to_linear(v: f32) -> f32 {
    let a = v.abs();
    let l = if a <= 0.040_45 { a / 12.92 } else { ((a + 0.055) / 1.055).powf(2.4) };
    l.copysign(v)
}

/// Encodes one linear component with the sRGB curve (IEC 61966-2-1).
pub fn linear_to_srgb(v: f32) -> f32 {
    let a = v.abs();
    let e = if a <= 0.003_130_8 { a * 12.92 } else { 1.055 * a.powf(1.0 / 2.4) - 0.055 };
    e.copysign(v)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_curve_is_its_own_inverse() {
        for i in 0..=255 {
            let v = i as f32 / 255.0;
            approx::assert_abs_diff_eq!(linear_to_srgb(srgb_to_linear(v)), v, epsilon = 1e-6);
        }
    }

    #[test]
    fn white_has_unit_luminance() {
        approx::assert_abs_diff_eq!(luminance(Vec3::ONE), 1.0, epsilon = 1e-6);
    }
}
