//! Unit vectors in four bytes, by the octahedral map (Cigolle et al. 2014).

use glam::{Vec2, Vec3};

/// Steps from the middle of the map to its border.
const STEPS: f32 = 32_767.0;

/// A unit vector, to within 7e-5 rad; exact along the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Octahedral([i16; 2]);

impl Octahedral {
    /// The nearest to a unit vector, or to one of any other length but zero.
    #[inline]
    pub fn encode(v: Vec3) -> Self {
        let p = v.truncate() / v.abs().element_sum();
        let p = if v.z < 0.0 { fold(p) } else { p };
        // conversion rounds towards zero and takes NaN to it
        Self((p * STEPS).round().to_array().map(|c| c as i16))
    }

    /// The unit vector.
    #[inline]
    pub fn decode(self) -> Vec3 {
        let p = Vec2::from(self.0.map(f32::from)) / STEPS;
        let z = 1.0 - p.abs().element_sum();
        let p = if z < 0.0 { fold(p) } else { p };
        p.extend(z).normalize()
    }

    /// Its code.
    #[inline]
    pub fn to_bits(self) -> u32 {
        let [x, y] = self.0.map(|c| u32::from(c as u16));
        x | y << 16
    }

    /// That of a code.
    #[inline]
    pub fn from_bits(code: u32) -> Self {
        Self([code as i16, (code >> 16) as i16])
    }
}

/// Turns the lower half of the octahedron outwards, and back.
#[inline]
fn fold(p: Vec2) -> Vec2 {
    (1.0 - Vec2::new(p.y, p.x).abs()) * Vec2::ONE.copysign(p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;
    use crate::math::warp;

    #[test]
    fn directions_come_back_to_within_the_bound() {
        let mut worst = 0.0f32;
        for k in 0..200_000 {
            let v = warp::uniform_sphere(Vec2::new(hash_unit(1, k), hash_unit(2, k)));
            let w = Octahedral::encode(v).decode();
            assert!((w.length() - 1.0).abs() < 1e-6);
            worst = worst.max(v.distance(w));
        }
        println!("{worst} rad");
        assert!(worst < 7e-5);
    }

    #[test]
    fn axes_and_edges_are_exact_and_codes_are_stable() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!(Octahedral::encode(axis).decode(), axis);
            assert_eq!(Octahedral::encode(-axis).decode(), -axis);
        }
        for v in [Vec3::new(1.0, -1.0, 0.0), Vec3::new(-1.0, 0.0, -1.0), Vec3::new(-0.0, 1.0, -1e-9)] {
            let code = Octahedral::encode(v.normalize());
            assert!(code.decode().distance(v.normalize()) < 7e-5);
            assert_eq!(Octahedral::encode(code.decode()), code);
            assert_eq!(Octahedral::from_bits(code.to_bits()), code);
        }
    }
}
