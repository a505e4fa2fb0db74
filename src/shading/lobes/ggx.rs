//! The GGX distribution of microfacet normals (Trowbridge and Reitz 1975, Walter et al. 2007) with
//! Smith's height-correlated masking and shadowing (Heitz 2014), anisotropic.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, TAU};

/// Roughness below which a surface is treated as perfectly smooth, as GGX alpha (perceptual roughness
/// 0.01). The blur that is left out is 0.006 degrees wide, and single precision directions resolve it to
/// no better than a thousandth part. The albedo is that of the Fresnel term on both sides, so that the
/// mean does not jump.
pub const SMOOTH_ALPHA: f32 = 1e-4;

/// Widths of the distribution of slopes along the local x and y axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    ax: f32,
    ay: f32,
}

impl Ggx {
    /// From the alphas along x and y (each the square of a perceptual roughness). If one is above
    /// [`SMOOTH_ALPHA`] the other is raised to it; negative and non-finite values count as zero.
    pub fn new(ax: f32, ay: f32) -> Self {
        let clean = |a: f32| if a.is_finite() { a.max(0.0) } else { 0.0 };
        let (ax, ay) = (clean(ax), clean(ay));
        if ax < SMOOTH_ALPHA && ay < SMOOTH_ALPHA {
            return Self { ax: 0.0, ay: 0.0 };
        }
        Self { ax: ax.max(SMOOTH_ALPHA), ay: ay.max(SMOOTH_ALPHA) }
    }

    /// Isotropic, from the perceptual roughness.
    pub fn from_roughness(roughness: f32) -> Self {
        Self::new(roughness * roughness, roughness * roughness)
    }

    /// Whether the surface is treated as perfectly smooth.
    #[inline]
    pub fn is_smooth(&self) -> bool {
        self.ax == 0.0
    }

    /// The widths along x and y.
    #[inline]
    pub fn alphas(&self) -> Vec2 {
        Vec2::new(self.ax, self.ay)
    }

    /// Perceptual roughness of the isotropic surface of the same mean alpha.
    #[inline]
    pub fn mean_roughness(&self) -> f32 {
        (self.ax * self.ay).sqrt().sqrt()
    }

    /// The isotropic surface of the same mean alpha.
    pub fn isotropic(&self) -> Self {
        let a = (self.ax * self.ay).sqrt();
        Self::new(a, a)
    }

    /// Density of normals `D(m)` per solid angle; `m` in the upper hemisphere (Heitz 2014, eq. 85).
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        let q = (m.x / self.ax).powi(2) + (m.y / self.ay).powi(2) + m.z * m.z;
        FRAC_1_PI / (self.ax * self.ay * q * q)
    }

    /// Length of the direction in the space where the distribution is a hemisphere:
    /// `|w_z| (1 + 2 Lambda(w))`.
    #[inline]
    pub fn stretched(&self, w: Vec3) -> f32 {
        ((self.ax * w.x).powi(2) + (self.ay * w.y).powi(2) + w.z * w.z).sqrt()
    }

    /// `D G2 / (4 |wo_z| |wi_z|)` for a reflection at `m`: the BRDF without its Fresnel term. For each
    /// direction its absolute cosine and its [`Ggx::stretched`] length.
    #[inline]
    pub fn reflection(&self, m: Vec3, (zo, so): (f32, f32), (zi, si): (f32, f32)) -> f32 {
        // G2 = 2 zo zi / (zi so + zo si) cancels the cosines
        self.d(m) / (2.0 * (zi * so + zo * si))
    }

    /// Density of the normals visible from `w` (`w.z > 0`), per solid angle of `m` (Heitz 2018, eq. 3).
    #[inline]
    pub fn visible(&self, w: Vec3, m: Vec3) -> f32 {
        2.0 * self.d(m) * w.dot(m).max(0.0) / (w.z + self.stretched(w))
    }

    /// Draws a normal visible from `w` (`w.z > 0`) by a spherical cap (Dupuy and Benyoub 2023).
    #[inline]
    pub fn sample_visible(&self, w: Vec3, u: Vec2) -> Vec3 {
        let v = Vec3::new(self.ax * w.x, self.ay * w.y, w.z).normalize();
        let z = (1.0 - u.y) * (1.0 + v.z) - v.z;
        self.unstretch(cap(z, u.x) + v)
    }

    /// Draws the reflection of `w` (`w.z > 0`) off a visible normal; the spherical cap is bounded so that
    /// fewer reflections fall below the horizon (Eto and Tokuyoshi 2023). The result may still be below.
    #[inline]
    pub fn sample_reflection(&self, w: Vec3, u: Vec2) -> Vec3 {
        let v = Vec3::new(self.ax * w.x, self.ay * w.y, w.z).normalize();
        let bound = self.cap_bound(w) * v.z;
        let z = (1.0 - u.y) * (1.0 + bound) - bound;
        let m = self.unstretch(cap(z, u.x) + v);
        m * (2.0 * w.dot(m)) - w
    }

    /// Density per solid angle with which [`Ggx::sample_reflection`] draws the reflection of `w` off `m`.
    #[inline]
    pub fn reflection_pdf(&self, w: Vec3, m: Vec3) -> f32 {
        self.d(m) / (2.0 * (self.cap_bound(w) * w.z + self.stretched(w)))
    }

    /// `k` of Eto and Tokuyoshi 2023, eq. 5: how much lower than the full cap the bounded one reaches.
    #[inline]
    fn cap_bound(&self, w: Vec3) -> f32 {
        let a2 = self.ax.min(self.ay).min(1.0).powi(2);
        let s2 = (1.0 + w.truncate().length()).powi(2);
        (1.0 - a2) * s2 / (s2 + a2 * w.z * w.z)
    }

    #[inline]
    fn unstretch(&self, h: Vec3) -> Vec3 {
        Vec3::new(self.ax * h.x, self.ay * h.y, h.z.max(1e-12)).normalize()
    }

    /// From the perceptual roughness and an anisotropy in [-1,1] (Burley 2012, section 5.4: an aspect of
    /// `sqrt(1 - 0.9 |anisotropy|)`). Positive: rougher along x; negative: along y.
    pub fn anisotropic(roughness: f32, anisotropy: f32) -> Self {
        let aspect = (1.0 - 0.9 * anisotropy.abs().min(1.0)).sqrt();
        let alpha = roughness * roughness;
        let (long, short) = (alpha / aspect, alpha * aspect);
        if anisotropy < 0.0 { Self::new(short, long) } else { Self::new(long, short) }
    }
}

/// Point of the unit sphere at height `z`, at the angle of `u` turns.
#[inline]
fn cap(z: f32, u: f32) -> Vec3 {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}
