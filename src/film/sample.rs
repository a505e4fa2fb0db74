//! What an integrator delivers for one sample of one pixel.

use glam::{Vec2, Vec3};

/// One sample of a pixel. The film averages samples with equal weights: the pixel filter is importance
/// sampled ([`super::Filter`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Radiance, linear Rec.709, premultiplied by `alpha`.
    pub radiance: Vec3,
    /// Coverage, in `[0,1]`.
    pub alpha: f32,
    /// Another estimate of `radiance` from the same sample, without systematic errors; where the integrator has
    /// one, [`super::Film::estimated_error`] tells them. It need not be finite.
    pub unfiltered: Option<Vec3>,
    /// Logarithm, in octaves, of the size of the kernel that filtered it over the nominal size, where that varies at random
    /// and is zero on average: it tells systematic errors, too.
    pub kernel_octaves: Option<f32>,
    /// Part of `radiance` that reaches the camera unscattered from its emitter.
    pub emission: Vec3,
    /// Part of `radiance` that was scattered once; what is neither this nor `emission` is indirect.
    pub direct: Vec3,
    /// The surface seen, where there is one.
    pub first_hit: Option<FirstHit>,
}

/// The surface a sample sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstHit {
    /// Distance to the camera's plane along its view axis, scene units.
    pub depth: f32,
    /// World position.
    pub position: Vec3,
    /// World shading normal, of unit length.
    pub normal: Vec3,
    /// Colour of the surface, in `[0,1]`.
    pub albedo: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The object's pass index.
    pub object_index: u32,
    /// The material's pass index.
    pub material_index: u32,
}

/// Negative values of this size, relative to the sample's largest channel, are rounding.
const ROUNDING: f32 = 1e-4;

impl Sample {
    /// Radiance that was scattered more than once.
    #[inline]
    pub fn indirect(&self) -> Vec3 {
        self.radiance - self.emission - self.direct
    }

    /// Whether everything in it is finite and nothing is negative beyond rounding.
    pub(super) fn is_good(&self) -> bool {
        let floor = -ROUNDING * self.radiance.abs().max_element();
        // NaN fails every comparison
        let light = |v: Vec3| v.is_finite() && v.min_element() >= floor;
        light(self.radiance)
            && light(self.emission)
            && light(self.direct)
            && light(self.indirect())
            && (-ROUNDING..=1.0 + ROUNDING).contains(&self.alpha)
            && self.first_hit.as_ref().is_none_or(FirstHit::is_finite)
    }
}

impl FirstHit {
    fn is_finite(&self) -> bool {
        self.depth.is_finite()
            && self.position.is_finite()
            && self.normal.is_finite()
            && self.albedo.is_finite()
            && self.uv.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(v: f32) -> Sample {
        Sample { radiance: Vec3::splat(v), alpha: 1.0, ..Default::default() }
    }

    #[test]
    fn good_samples_are_told_from_bad_ones() {
        let hit = FirstHit { normal: Vec3::NEG_Z, uv: Vec2::new(-3.0, 7.0), ..Default::default() };
        assert!(Sample { emission: Vec3::X, first_hit: Some(hit), ..grey(1.0) }.is_good());
        assert!(Sample::default().is_good());
        assert!(grey(f32::MAX).is_good());
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(!Sample { radiance: Vec3::new(0.0, bad, 0.0), ..grey(1.0) }.is_good());
            assert!(!Sample { emission: Vec3::new(bad, 0.0, 0.0), ..grey(1.0) }.is_good());
            assert!(!Sample { direct: Vec3::new(0.0, 0.0, bad), ..grey(1.0) }.is_good());
            assert!(!Sample { alpha: bad, ..grey(1.0) }.is_good());
            let hit = FirstHit { depth: bad, ..Default::default() };
            assert!(!Sample { first_hit: Some(hit), ..grey(1.0) }.is_good());
        }
    }

    #[test]
    fn rounding_is_forgiven_and_nothing_worse() {
        let channel = |v| Sample { radiance: Vec3::new(100.0, v, 0.0), ..grey(0.0) };
        assert!(channel(-1e-3).is_good());
        assert!(!channel(-0.1).is_good());
        assert!(!grey(-1e-9).is_good(), "wholly negative is not rounding");
        assert!(Sample { direct: Vec3::splat(1.00001), ..grey(1.0) }.is_good());
        assert!(!Sample { direct: Vec3::splat(1.1), ..grey(1.0) }.is_good());
        assert!(!Sample { alpha: 1.5, ..grey(1.0) }.is_good());
    }
}
