//! Reflection off a GGX microfacet surface with a coloured Fresnel term: metals, glossy paint, coats.

use super::energy::{self, ReflectionScale};
use super::{Finish, Fresnel, Ggx, Kind, LobeSample, MIN_COS};
use glam::Vec3;

/// Microfacet reflection, on whichever side the light comes from. Smooth: a mirror (delta).
#[derive(Clone, Copy, Debug)]
pub struct Reflection {
    ggx: Ggx,
    fresnel: Fresnel,
    scale: ReflectionScale,
    /// How much of the light that single scattering loses comes out after more bounces: the factor
    /// `F_avg E_avg / (1 - F_avg (1 - E_avg))` of Kulla and Conty 2017, with one Fresnel term taken out
    /// that the lobe already has.
    regained: Vec3,
}

impl Reflection {
    /// A surface of microfacets `ggx`, each reflecting by `fresnel`.
    pub fn new(ggx: Ggx, fresnel: Fresnel) -> Self {
        let (f, e) = (fresnel.average(), energy::mean_albedo(&ggx));
        let regained = f * e / (Vec3::ONE - f * (1.0 - e));
        Self { ggx, fresnel, scale: ReflectionScale::new(&ggx), regained }
    }

    /// The same, which without `multiscatter` loses what is scattered more than once.
    pub fn with_multiscatter(self, multiscatter: bool) -> Self {
        if multiscatter { self } else { Self { regained: Vec3::ZERO, ..self } }
    }

    #[inline]
    pub(super) fn is_delta(&self) -> bool {
        self.ggx.is_smooth()
    }

    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        match self.normal(wo, wi) {
            Some((o, i, m)) => self.value(o, i, m),
            None => Vec3::ZERO,
        }
    }

    #[inline]
    pub(super) fn pdf(&self, from: Vec3, to: Vec3) -> f32 {
        match self.normal(from, to) {
            Some((o, i, m)) => self.ggx.reflection_pdf(o, m) / i.z,
            None => 0.0,
        }
    }

    /// Both at once: they share the normal.
    #[inline]
    pub(super) fn eval_and_pdf(&self, from: Vec3, to: Vec3) -> (Vec3, f32) {
        match self.normal(from, to) {
            Some((o, i, m)) => (self.value(o, i, m), self.ggx.reflection_pdf(o, m) / i.z),
            None => (Vec3::ZERO, 0.0),
        }
    }

    #[inline]
    pub(super) fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        let flip = from.z < 0.0;
        let o = if flip { -from } else { from };
        let back = |i: Vec3| if flip { -i } else { i };
        if o.z < MIN_COS {
            return None;
        }
        if self.is_delta() {
            let i = back(Vec3::new(-o.x, -o.y, o.z));
            let kind = Kind::reflection(Finish::Specular);
            return Some(LobeSample::delta(i, self.fresnel.eval(o.z), 1.0, 1.0, kind));
        }
        let i = self.ggx.sample_reflection(o, u.truncate()).normalize();
        let (o, i, m) = self.normal(o, i)?;
        let pdf = self.ggx.reflection_pdf(o, m) / i.z;
        LobeSample::continuous(back(i), self.value(o, i, m), pdf, 1.0, Kind::reflection(Finish::Glossy))
    }

    /// Exact, up to the tables' interpolation, for an isotropic dielectric: layers rely on it.
    #[inline]
    pub(super) fn albedo(&self, from: Vec3) -> Vec3 {
        let mu = from.z.abs();
        if self.is_delta() {
            return self.fresnel.eval(mu);
        }
        let once = energy::albedo(&self.ggx, from);
        let more = self.regained * (1.0 - once);
        match self.fresnel {
            Fresnel::Dielectric { eta, f0 } => {
                let (f1, f2) = energy::layer_fresnel(&self.ggx, mu, eta);
                let rise = Vec3::ONE - f0;
                (f0 + rise * f1) * once + (f0 + rise * f2) * more
            }
            Fresnel::Schlick { .. } | Fresnel::F82 { .. } => {
                let blur = self.ggx.mean_roughness().min(1.0);
                self.fresnel.eval(mu).lerp(self.fresnel.average(), blur) * (once + more)
            }
        }
    }

    /// Both directions turned to the upper side, and the normal that mirrors one into the other. `None`
    /// where there is none, and for a mirror.
    #[inline]
    fn normal(&self, wo: Vec3, wi: Vec3) -> Option<(Vec3, Vec3, Vec3)> {
        if self.is_delta() || wo.z * wi.z <= 0.0 {
            return None;
        }
        let (o, i) = if wo.z < 0.0 { (-wo, -wi) } else { (wo, wi) };
        (o.z >= MIN_COS && i.z >= MIN_COS).then(|| (o, i, (o + i).normalize()))
    }

    #[inline]
    fn value(&self, o: Vec3, i: Vec3, m: Vec3) -> Vec3 {
        let (so, si) = (self.ggx.stretched(o), self.ggx.stretched(i));
        let scale = self.scale.product(&self.ggx, (o, so), (i, si));
        let once = self.fresnel.eval(o.dot(m)) * self.ggx.reflection(m, (o.z, so), (i.z, si));
        once * (Vec3::ONE + self.regained * (scale - 1.0))
    }
}
