//! Reflection and refraction at a GGX microfacet interface between two dielectrics
//! (Walter et al. 2007), tinted; smooth: mirror and refracted direction (delta).

use super::energy::GlassLoss;
use super::fresnel::{dielectric, f0_from_ior, reflectance};
use super::{Finish, Ggx, Kind, LobeSample, MIN_COS};
use glam::Vec3;

/// Blur of the refracted light, alpha times `|eta - 1|`, below which the interface is treated as smooth.
const SMOOTH_BLUR: f32 = 5e-4;

/// A dielectric interface; z points out of the medium of index `eta`. Isotropic: of unequal alphas the
/// mean is taken.
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
        /// Of a rough interface.
        loss: Option<GlassLoss>,
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

impl Facet {
    /// The refraction of the upward `o` at the normal `m`, to which it has the cosine `c`.
    #[inline]
    fn refract(&self, o: Vec3, m: Vec3, c: f32) -> Option<Vec3> {
        let possible = self.cos_t > 0.0 && self.choice < 1.0;
        possible.then(|| (m * (c / self.eta - self.cos_t) - o / self.eta).normalize())
    }
}

/// The microfacets of an interface: isotropic, and none where they would not blur what is seen through them.
fn finish(ggx: Ggx, eta: f32) -> Ggx {
    let smooth = ggx.isotropic().alphas().max_element() * (eta - 1.0).abs() < SMOOTH_BLUR;
    if smooth { Ggx::new(0.0, 0.0) } else { ggx.isotropic() }
}

impl Dielectric {
    /// Clear glass of index `eta` (below over above). Lossless.
    pub fn new(ggx: Ggx, eta: f32) -> Self {
        Self::tinted(ggx, eta, Vec3::splat(f0_from_ior(eta)), Vec3::ONE, Vec3::ONE)
    }

    /// With its own reflectance at normal incidence, and with factors on what is reflected and what is
    /// transmitted.
    pub fn tinted(ggx: Ggx, eta: f32, f0: Vec3, reflection: Vec3, transmission: Vec3) -> Self {
        let ggx = finish(ggx, eta);
        let loss = (!ggx.is_smooth()).then(|| GlassLoss::new(&ggx, eta, transmission));
        Self { ggx, eta, split: Split::Fresnel { loss, f0, reflection, transmission } }
    }

    /// The same, which without `multiscatter` loses what is scattered more than once.
    pub fn with_multiscatter(mut self, multiscatter: bool) -> Self {
        if let Split::Fresnel { loss, .. } = &mut self.split
            && !multiscatter
        {
            *loss = None;
        }
        self
    }

    /// Refraction without Fresnel reflection; light that would be totally reflected is absorbed, and
    /// what a rough surface scatters more than once is lost.
    pub fn refraction_only(ggx: Ggx, eta: f32) -> Self {
        Self { ggx: finish(ggx, eta), eta, split: Split::RefractionOnly }
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
    pub(super) fn eval_and_pdf(&self, from: Vec3, to: Vec3) -> (Vec3, f32) {
        self.terms(from, to)
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let sign = 1f32.copysign(from.z);
        let o = from * sign;
        if o.z < MIN_COS {
            return None;
        }
        if self.is_delta() {
            return self.sample_smooth(o, sign, u.z);
        }
        let i = self.draw(o, sign, u)?;
        let (value, pdf) = self.terms(from, i * sign);
        let (kind, eta) = if i.z > 0.0 {
            (Kind::reflection(Finish::Glossy), 1.0)
        } else {
            (Kind::transmission(Finish::Glossy), self.relative_index(sign))
        };
        LobeSample::continuous(i * sign, value, pdf, eta, kind)
    }

    #[inline]
    fn sample_smooth(&self, o: Vec3, sign: f32, u: f32) -> Option<LobeSample> {
        let facet = self.facet(o.z, sign);
        if u < facet.choice {
            let i = Vec3::new(-o.x, -o.y, o.z);
            let kind = Kind::reflection(Finish::Specular);
            return Some(LobeSample::delta(i * sign, facet.reflection, facet.choice, 1.0, kind));
        }
        let i = facet.refract(o, Vec3::Z, o.z)?;
        let kind = Kind::transmission(Finish::Specular);
        Some(LobeSample::delta(i * sign, facet.transmission, 1.0 - facet.choice, facet.eta, kind))
    }

    /// A direction for the upward `o`, from the density of [`Dielectric::terms`].
    #[inline]
    fn draw(&self, o: Vec3, sign: f32, u: Vec3) -> Option<Vec3> {
        let m = self.ggx.sample_visible(o, u.truncate());
        let c = o.dot(m);
        let facet = self.facet(c, sign);
        if u.z < facet.choice {
            let i = (m * (2.0 * c) - o).normalize();
            (i.z > 0.0).then_some(i)
        } else {
            facet.refract(o, m, c).filter(|i| i.z < 0.0)
        }
    }

    #[inline]
    pub(super) fn albedo(&self, from: Vec3) -> Vec3 {
        let facet = self.facet(from.z.abs(), from.z);
        facet.reflection + facet.transmission
    }

    /// Index beyond over index before, seen from above (`side` positive) or below.
    #[inline]
    fn relative_index(&self, side: f32) -> f32 {
        if side > 0.0 { self.eta } else { 1.0 / self.eta }
    }

    /// Whether the upper side, of directions turned by `sign`, is that of the higher index.
    #[inline]
    fn is_dense(&self, sign: f32) -> bool {
        (sign > 0.0) == (self.eta < 1.0)
    }

    /// What a facet does to light that meets it at cosine `c`, from above (`side` positive) or below.
    #[inline]
    fn facet(&self, c: f32, side: f32) -> Facet {
        let eta = self.relative_index(side);
        let (r, cos_t) = dielectric(c, eta);
        self.facet_with(r, cos_t, eta)
    }

    /// The same for the exact reflectance `r` and the cosine beyond.
    #[inline]
    fn facet_with(&self, r: f32, cos_t: f32, eta: f32) -> Facet {
        match self.split {
            Split::Fresnel { f0, reflection, transmission, .. } => {
                let r0 = f0_from_ior(eta);
                let s = ((r - r0) / (1.0 - r0)).clamp(0.0, 1.0);
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
        let sign = 1f32.copysign(wo.z);
        let (o, i) = (wo * sign, wi * sign);
        if self.is_delta() || o.z < MIN_COS || i.z.abs() < MIN_COS {
            return (Vec3::ZERO, 0.0);
        }
        let (so, si) = (self.ggx.stretched(o), self.ggx.stretched(i));
        let crosses = i.z < 0.0;
        let (value, pdf) = match crosses {
            false => self.reflected((o, so), (i, si), sign),
            true => self.refracted((o, so), (i, si), sign),
        };
        match &self.split {
            Split::Fresnel { loss: Some(loss), .. } => (value * loss.scale(o, so, self.is_dense(sign)), pdf),
            _ => (value, pdf),
        }
    }

    /// Single scattering; each direction with its stretched length.
    #[inline]
    fn reflected(&self, (o, so): (Vec3, f32), (i, si): (Vec3, f32), sign: f32) -> (Vec3, f32) {
        let m = (o + i).normalize();
        let facet = self.facet(o.dot(m), sign);
        let value = facet.reflection * self.ggx.reflection(m, (o.z, so), (i.z, si));
        let pdf = facet.choice * self.ggx.visible(o, m) / (4.0 * o.dot(m) * i.z);
        (value, pdf)
    }

    /// Walter et al. 2007, eq. 21 and 17, times `n_i^2 / n_o^2` for basic radiance.
    #[inline]
    fn refracted(&self, (o, so): (Vec3, f32), (i, si): (Vec3, f32), sign: f32) -> (Vec3, f32) {
        let eta = self.relative_index(sign);
        let h = o + i * eta;
        // the facet's normal is on the side of the lower index; turn it upwards
        let m = h.normalize_or_zero() * 1f32.copysign(h.z);
        let (co, ci) = (o.dot(m), -i.dot(m));
        if co <= 0.0 || ci <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let facet = self.facet_with(reflectance(co, ci, eta), ci, eta);
        let zi = -i.z;
        // solid angle of the normal over that of the refracted direction
        let jacobian = ci * (eta / (co - eta * ci)).powi(2);
        let value = facet.transmission * (self.ggx.reflection(m, (o.z, so), (zi, si)) * 4.0 * co * jacobian);
        let pdf = (1.0 - facet.choice) * self.ggx.visible(o, m) * jacobian / zi;
        (value, pdf)
    }
}
