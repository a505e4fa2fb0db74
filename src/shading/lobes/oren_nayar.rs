//! Rough diffuse reflection: the qualitative Oren-Nayar model as improved by Fujii, with the energy of
//! multiple scattering.
//!
//! Oren and Nayar 1994; Fujii, "A tiny improvement of Oren-Nayar reflectance model" (2012); Portsmouth,
//! Kutz and Hill 2025, "EON: A practical energy-preserving rough diffuse BRDF", for the directional
//! albedo of Fujii's model and the form of the multiple-scattering term.
//!
//! The colour enters the multiple-scattering term as it does in Cycles since Blender 4.3, with one power
//! more than in EON: at colour 0.8 and roughness 1 this is 3 % darker, and at colour 1 the same.

use super::{Finish, Kind, LobeSample, MIN_COS};
use crate::math::warp;
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

/// Rough diffuse reflection, on whichever side the light comes from. Reciprocal; lossless where white.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    color: Vec3,
    /// Weight of the cosine lobe, 1/sr.
    a: f32,
    /// Weight of the azimuthal term, 1/sr.
    b: f32,
    /// Factor on `(1 - E(wo)) (1 - E(wi))`, 1/sr.
    multiple: Vec3,
}

impl OrenNayar {
    /// `color`: albedo of a facet, clamped to [0,1]; `roughness` in [0,1], where 0 is Lambert's law.
    pub fn new(color: Vec3, roughness: f32) -> Self {
        let color = color.clamp(Vec3::ZERO, Vec3::ONE);
        let sigma = roughness.clamp(0.0, 1.0);
        let a = 1.0 / (PI + sigma * (FRAC_PI_2 - 2.0 / 3.0));
        let b = sigma * a;
        // average over the hemisphere of the albedo of single scattering (EON, eq. 16)
        let average = PI * a + (TAU - 5.6) / 3.0 * b;
        let lost = 1.0 - average;
        let multiple = match lost > 1e-6 {
            true => color * color * (FRAC_1_PI * average / lost) / (Vec3::ONE - color * lost),
            false => Vec3::ZERO,
        };
        Self { color, a, b, multiple }
    }

    /// Albedo of single scattering off white facets, seen at cosine `mu` (EON, eq. 15).
    #[inline]
    fn single_albedo(&self, mu: f32) -> f32 {
        let mu = mu.min(1.0);
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        let g = if mu < 1e-4 {
            // first order; the last term below divides zero by zero
            FRAC_PI_2 - 2.0 / 3.0 - mu
        } else {
            let last = 2.0 / 3.0 * (sin / mu) * (1.0 - sin * sin * sin);
            sin * (mu.acos() - 2.0 / 3.0 - sin * mu) + last
        };
        PI * self.a + self.b * g
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        if self.pdf(wo, wi) == 0.0 {
            return Vec3::ZERO;
        }
        let (zo, zi) = (wo.z.abs(), wi.z.abs());
        let s = wo.dot(wi) - zo * zi;
        let t = if s > 0.0 { s / zo.max(zi) } else { s };
        let unlit = (1.0 - self.single_albedo(zo)) * (1.0 - self.single_albedo(zi));
        self.color * (Vec3::splat(self.a + self.b * t) + self.multiple * unlit.max(0.0))
    }

    #[inline]
    pub(super) fn pdf(&self, from: Vec3, to: Vec3) -> f32 {
        if from.z * to.z > 0.0 && to.z.abs() >= MIN_COS { FRAC_1_PI } else { 0.0 }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let d = warp::cosine_hemisphere(u.truncate());
        if d.z < MIN_COS {
            return None;
        }
        let direction = if from.z < 0.0 { -d } else { d };
        let kind = Kind::reflection(Finish::Diffuse);
        LobeSample::continuous(direction, self.eval(from, direction), FRAC_1_PI, 1.0, kind)
    }

    /// Exact.
    #[inline]
    pub(super) fn albedo(&self, from: Vec3) -> Vec3 {
        let single = self.single_albedo(from.z.abs());
        let average = PI * self.a + (TAU - 5.6) / 3.0 * self.b;
        let multiple = self.multiple * (PI * (1.0 - single) * (1.0 - average));
        self.color * (Vec3::splat(single) + multiple)
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{direction, hemisphere_integral, pdf_integral};
    use super::*;
    use crate::shading::lobes::Lobe;

    #[test]
    fn white_reflects_everything_and_the_albedo_is_the_integral() {
        for roughness in [0.0, 0.2, 1.0] {
            for cos in [1.0, 0.6, 0.1, -0.4] {
                let from = direction(cos, 0.7);
                let of = |color: Vec3| {
                    let lobe = OrenNayar::new(color, roughness);
                    (hemisphere_integral(cos, |wi| lobe.eval(from, wi)), lobe.albedo(from))
                };
                let (white, albedo) = of(Vec3::ONE);
                assert!(white.abs_diff_eq(Vec3::ONE, 1e-3), "{roughness} {cos}: {white}");
                assert!(albedo.abs_diff_eq(Vec3::ONE, 1e-5), "{roughness} {cos}: {albedo}");
                let (integral, albedo) = of(Vec3::new(0.8, 0.5, 0.0));
                assert!(integral.abs_diff_eq(albedo, 1e-3), "{roughness} {cos}: {integral} {albedo}");
            }
        }
    }

    #[test]
    fn is_reciprocal_and_lambert_where_smooth() {
        let color = Vec3::new(0.9, 0.5, 0.1);
        let (wo, wi) = (direction(0.3, 0.2), direction(0.8, 2.0));
        let rough = OrenNayar::new(color, 0.7);
        assert!(rough.eval(wo, wi).abs_diff_eq(rough.eval(wi, wo), 1e-7));
        assert!(OrenNayar::new(color, 0.0).eval(wo, wi).abs_diff_eq(color * FRAC_1_PI, 1e-7));
    }

    #[test]
    fn the_density_integrates_to_one() {
        let lobe = Lobe::OrenNayar(OrenNayar::new(Vec3::ONE, 0.5));
        approx::assert_abs_diff_eq!(pdf_integral(&lobe, direction(0.3, 0.0), 1.0), 1.0, epsilon = 1e-4);
    }
}
