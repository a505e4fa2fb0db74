//! Reflection and refraction at a GGX microfacet interface between two dielectrics
//! (Walter et al. 2007), tinted; smooth: mirror and refracted direction (delta).

use super::fresnel::{dielectric, f0_from_ior};
use super::{Finish, Ggx, Kind, LobeSample, MIN_COS};
use glam::Vec3;

/// Blur of the refracted light, alpha times `|eta - 1|`, below which the interface is treated as smooth.
const SMOOTH_BLUR: f32 = 5e-4;

/// A dielectric interface; z points out of the medium of index `eta`.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    ggx: Ggx,
    /// Index below over index above.
    eta: f32,
    split: Split,
}

/// How the light is divided at each microfacet.
#[derive(Clone, Copy, Debug)]
enum Split {
    Fresnel {
        /// Reflectance at normal incidence; the exact curve is stretched to begin here.
        f0: Vec3,
        reflection: Vec3,
        transmission: Vec3,
    },
    /// All is refracted, and what cannot be is lost (Blender's Refraction BSDF).
    RefractionOnly,
}

/// What happens at one microfacet.
struct Facet {
    /// Index beyond over index before.
    eta: f32,
    reflection: Vec3,
    transmission: Vec3,
    /// Probability of choosing the reflection.
    choice: f32,
    /// Cosine of the refracted direction to the facet's normal.
    cos_t: f32,
}

impl Dielectric {
    /// Clear glass of index `eta` (below over above). Lossless.
    pub fn new(ggx: Ggx, eta: f32) -> Self {
        Self::tinted(ggx, eta, Vec3::splat(f0_from_ior(eta)), Vec3::ONE, Vec3::ONE)
    }

    /// With its own reflectance at normal incidence, and with factors on what is reflected and what is
    /// transmitted.
    pub fn tinted(ggx: Ggx, eta: f32, f0: Vec3, reflection: Vec3, transmission: Vec3) -> Self {
        Self::with_split(ggx, eta, Split::Fresnel { f0, reflection, transmission })
    }

    /// Refraction without Fresnel reflection; light that would be totally reflected is absorbed, and
    /// what a rough surface scatters more than once is lost.
    pub fn refraction_only(ggx: Ggx, eta: f32) -> Self {
        Self::with_split(ggx, eta, Split::RefractionOnly)
    }

    fn with_split(ggx: Ggx, eta: f32, split: Split) -> Self {
        let smooth = ggx.alphas().max_element() * (eta - 1.0).abs() < SMOOTH_BLUR;
        Self { ggx: if smooth { Ggx::new(0.0, 0.0) } else { ggx }, eta, split }
    }

    /// Index below over index above.
    #[inline]
    pub fn eta(&self) -> f32 {
        self.eta
    }

    #[inline]
    pub(super) fn is_delta(&self) -> bool {
        self.ggx.is_smooth()
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.terms(wo, wi).0
    }

    #[inline]
    pub(super) fn pdf(&self, from: Vec3, to: Vec3) -> f32 {
        self.terms(from, to).1
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let sign = 1f32.copysign(from.z);
        let o = from * sign;
        if o.z < MIN_COS {
            return None;
        }
        let delta = self.is_delta();
        let m = if delta { Vec3::Z } else { self.ggx.sample_visible(o, u.truncate()) };
        let c = o.dot(m);
        let facet = self.facet(c, sign);
        if u.z < facet.choice {
            let i = (m * (2.0 * c) - o).normalize();
            if delta {
                let kind = Kind::reflection(Finish::Specular);
                return Some(LobeSample::delta(i * sign, facet.reflection, facet.choice, 1.0, kind));
            }
            if i.z < MIN_COS {
                return None;
            }
            let (value, pdf) = self.reflected(o, i, m, &facet);
            LobeSample::continuous(i * sign, value, pdf, 1.0, Kind::reflection(Finish::Glossy))
        } else {
            if facet.choice >= 1.0 || facet.cos_t <= 0.0 {
                return None;
            }
            let i = (m * (c / facet.eta - facet.cos_t) - o / facet.eta).normalize();
            if delta {
                let kind = Kind::transmission(Finish::Specular);
                let (value, p) = (facet.transmission, 1.0 - facet.choice);
                return Some(LobeSample::delta(i * sign, value, p, facet.eta, kind));
            }
            if i.z > -MIN_COS {
                return None;
            }
            let (value, pdf) = self.refracted(o, i, m, &facet);
            LobeSample::continuous(i * sign, value, pdf, facet.eta, Kind::transmission(Finish::Glossy))
        }
    }

    #[inline]
    pub(super) fn albedo(&self, from: Vec3) -> Vec3 {
        let facet = self.facet(from.z.abs(), from.z);
        facet.reflection + facet.transmission
    }

    /// What a facet does to light that meets it at cosine `c`, from above (`side` positive) or below.
    #[inline]
    fn facet(&self, c: f32, side: f32) -> Facet {
        let eta = if side > 0.0 { self.eta } else { 1.0 / self.eta };
        let (r, cos_t) = dielectric(c, eta);
        match self.split {
            Split::Fresnel { f0, reflection, transmission } => {
                let r0 = f0_from_ior(eta);
                // index one has no curve to stretch
                let s = if r0 < 1.0 { ((r - r0) / (1.0 - r0)).clamp(0.0, 1.0) } else { 1.0 };
                let f = f0 + (Vec3::ONE - f0) * s;
                let (reflection, transmission) = (reflection * f, transmission * (Vec3::ONE - f));
                let (a, b) = (reflection.element_sum(), transmission.element_sum());
                let choice = if a + b > 0.0 { a / (a + b) } else { 0.5 };
                Facet { eta, reflection, transmission, choice, cos_t }
            }
            Split::RefractionOnly => {
                let transmission = if cos_t > 0.0 { Vec3::ONE } else { Vec3::ZERO };
                Facet { eta, reflection: Vec3::ZERO, transmission, choice: 0.0, cos_t }
            }
        }
    }

    /// Value and density per projected solid angle; zero for a smooth interface.
    #[inline]
    fn terms(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        const NOTHING: (Vec3, f32) = (Vec3::ZERO, 0.0);
        let sign = 1f32.copysign(wo.z);
        let (o, i) = (wo * sign, wi * sign);
        if self.is_delta() || o.z < MIN_COS || i.z.abs() < MIN_COS {
            return NOTHING;
        }
        if i.z > 0.0 {
            let m = (o + i).normalize();
            self.reflected(o, i, m, &self.facet(o.dot(m), sign))
        } else {
            let eta = if sign > 0.0 { self.eta } else { 1.0 / self.eta };
            let h = o + i * eta;
            // the facet's normal is on the side of the lower index; turn it upwards
            let m = h.normalize_or_zero() * 1f32.copysign(h.z);
            if o.dot(m) <= 0.0 || i.dot(m) >= 0.0 {
                return NOTHING;
            }
            self.refracted(o, i, m, &self.facet(o.dot(m), sign))
        }
    }

    #[inline]
    fn reflected(&self, o: Vec3, i: Vec3, m: Vec3, facet: &Facet) -> (Vec3, f32) {
        let value = facet.reflection * self.ggx.reflection(o, i, m);
        let pdf = facet.choice * self.ggx.visible(o, m) / (4.0 * o.dot(m) * i.z);
        (value, pdf)
    }

    /// Walter et al. 2007, eq. 21 and 17, times `n_i^2 / n_o^2` for basic radiance.
    #[inline]
    fn refracted(&self, o: Vec3, i: Vec3, m: Vec3, facet: &Facet) -> (Vec3, f32) {
        let (co, ci) = (o.dot(m), i.dot(m).abs());
        // solid angle of the normal over that of the refracted direction
        let jacobian = ci * (facet.eta / (co - facet.eta * ci)).powi(2);
        let value = facet.transmission * (self.ggx.refraction(o, i, m) * jacobian);
        let pdf = (1.0 - facet.choice) * self.ggx.visible(o, m) * jacobian / i.z.abs();
        (value, pdf)
    }
}
