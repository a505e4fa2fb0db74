//! The BSDF of a surface point: a weighted sum of lobes, each with its own shading normal, in world space.
//!
//! Conventions are those of [`crate::shading::lobes`] (basic radiance, directions away from the surface),
//! with densities and values about the *geometric* normal. A shading normal `ns` enters as in Veach 1997,
//! section 5.3: the effective BSDF is `f(wo, wi) |ns.wi| / |ng.wi|`. It is not symmetric, so the roles of
//! the two directions matter: light arriving from `wi` leaves towards the camera along `wo`.
//!
//! Which side of the surface a direction is on is decided by the geometric normal alone, so no light
//! leaks through a closed surface. Where the shading normal disagrees about the light side `wi`, nothing
//! is scattered; where it disagrees about the side looked from, which bumps and smoothed silhouettes make
//! common, specular lobes have another (`bend`), and other lobes are evaluated as seen at grazing incidence.

mod bend;
mod builder;
mod cover;
pub mod principled;
mod sight;
mod walk;

pub use builder::{BsdfBuilder, CAPACITY};
pub use cover::Cover;
pub use principled::{MetalF90, Principled};
pub use sight::{Among, Sight};
pub use walk::{Event, Passage};

use super::lobes::{Density, Kind, Lobe, MIN_COS};
use crate::math::Frame;
use crate::math::density::ProjectedPdf;
use glam::Vec3;
use smallvec::SmallVec;

/// Which way a path is being built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// From the camera: the known direction is `wo`, and radiance is carried.
    Camera,
    /// From a light: the known direction is `wi`, and flux of basic radiance, per `dA dw_perp`, is carried.
    Light,
}

/// A direction drawn from a [`Bsdf`].
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The drawn direction, unit length.
    pub direction: Vec3,
    /// Camera walk: `eval(from, direction)`. Light walk: `eval(direction, from)`. For a delta event the
    /// coefficient of the Dirac delta of étendue. Divided by the density it is the factor on the basic radiance
    /// that the path carries.
    pub value: Vec3,
    /// How likely the draw was, about the geometric normal. Never zero.
    pub pdf: Density,
    /// Refractive index, by the drawn lobe, of the sampled side over that of the side come from; 1 for a reflection.
    pub eta: f32,
    /// What happened.
    pub kind: Kind,
}

impl BsdfSample {
    /// Factor on what the path carries: value over density.
    #[inline]
    pub fn weight(&self) -> Vec3 {
        self.value / self.pdf.value()
    }
}

/// A lobe with its weight and its frame.
#[derive(Clone, Copy, Debug)]
struct Entry {
    weight: Vec3,
    /// Its normal is on the same side as the geometric normal.
    frame: Frame,
    lobe: Lobe,
    delta: bool,
    /// Whether the normal is not the shading normal; see [`bend`].
    is_bent: bool,
}

/// Cosine to which the direction looked from is raised where the shading normal faces away from it.
const GRAZING: f32 = 1e-3;

impl Entry {
    /// The direction looked from in the local frame, on the geometric side `side` (+1 or -1).
    #[inline]
    fn seen_from(&self, w: Vec3, side: f32) -> Option<Vec3> {
        let v = self.frame.to_local(w);
        if v.z * side >= GRAZING {
            Some(v)
        } else if self.delta {
            (v.z * side >= MIN_COS).then_some(v)
        } else {
            let flat = v.truncate().normalize_or(glam::Vec2::X);
            Some((flat * (1.0 - GRAZING * GRAZING).sqrt()).extend(GRAZING * side))
        }
    }

    /// Whether a walk that comes along this lobe from `w` would see it bent, or whether it is bent.
    fn bends_from(&self, ng: Vec3, w: Vec3) -> bool {
        self.is_bent || (self.lobe.is_specular() && bend::bent(ng, self.frame.n, w).is_some())
    }

    /// The other direction in the local frame; `None` where the shading normal disagrees about its side.
    #[inline]
    fn scattered(&self, w: Vec3, side: f32) -> Option<Vec3> {
        let v = self.frame.to_local(w);
        (v.z * side >= MIN_COS).then_some(v)
    }
}

/// The scattering of light at one surface point.
#[derive(Clone, Debug)]
pub struct Bsdf {
    ng: Vec3,
    /// Few surfaces have more than two, and this is copied often.
    entries: SmallVec<[Entry; 2]>,
}

impl Bsdf {
    /// The geometric normal, pointing out of the object.
    #[inline]
    pub fn ng(&self) -> Vec3 {
        self.ng
    }

    /// The normal of what is seen: the mean shading normal of the lobes by their weight, or the geometric
    /// one where nothing scatters.
    pub fn normal(&self) -> Vec3 {
        let sum: Vec3 = self.entries().iter().map(|e| e.frame.n * e.weight.element_sum()).sum();
        sum.try_normalize().unwrap_or(self.ng)
    }

    /// Whether nothing scatters.
    #[inline]
    pub fn is_black(&self) -> bool {
        self.entries.is_empty()
    }

    /// Whether some lobe is a Dirac delta.
    pub fn has_delta(&self) -> bool {
        self.entries().iter().any(|e| e.delta)
    }

    /// Whether some lobe is continuous: whether [`Bsdf::eval`] can be other than zero.
    pub fn has_smooth(&self) -> bool {
        self.entries().iter().any(|e| !e.delta)
    }

    /// Whether a continuous lobe scatters light to the other side.
    pub fn transmits(&self) -> bool {
        self.entries().iter().any(|e| e.lobe.transmits() && !e.delta)
    }

    /// Whether there are lobes, and all are Dirac deltas.
    pub fn is_delta_only(&self) -> bool {
        self.has_delta() && !self.has_smooth()
    }

    /// How much light passes straight through: the weight of the transparent lobes.
    pub fn transparency(&self) -> Vec3 {
        let straight = self.entries().iter().filter(|e| matches!(e.lobe, Lobe::Transparent(_)));
        straight.map(|e| e.weight).sum()
    }

    #[inline]
    fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// The two geometric sides as signs, or `None` for a direction in the tangent plane.
    #[inline]
    fn sides(&self, a: Vec3, b: Vec3) -> Option<(f32, f32, f32)> {
        let (ca, cb) = (self.ng.dot(a), self.ng.dot(b));
        (ca.abs() >= MIN_COS && cb.abs() >= MIN_COS).then(|| (1f32.copysign(ca), 1f32.copysign(cb), cb.abs()))
    }

    /// Effective BSDF of basic radiance (1/sr), about the geometric normal, for the camera-side
    /// direction `wo` and the light-side direction `wi`. Delta lobes do not show.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let Some((so, si, cos)) = self.sides(wo, wi) else { return Vec3::ZERO };
        let mut sum = Vec3::ZERO;
        for e in self.entries() {
            sum += self.eval_entry(e, wo, so, wi, si);
        }
        sum / cos
    }

    /// One lobe's value times `|ns.wi|`.
    #[inline]
    fn eval_entry(&self, e: &Entry, wo: Vec3, so: f32, wi: Vec3, si: f32) -> Vec3 {
        if e.delta {
            return Vec3::ZERO;
        }
        match (e.scattered(wi, si), e.seen_from(wo, so)) {
            (Some(i), Some(o)) => e.weight * e.lobe.eval(o, i) * i.z.abs(),
            _ => Vec3::ZERO,
        }
    }

    /// Density with which [`Bsdf::sample`], standing on `from`, draws `to` from the continuous lobes.
    pub fn pdf(&self, from: Vec3, to: Vec3) -> ProjectedPdf {
        self.sight(from, Among::All).map_or(ProjectedPdf(0.0), |s| s.pdf(to))
    }

    /// Draws a direction, standing on `from`: [`Sight::sample`] among all lobes.
    pub fn sample(&self, from: Vec3, walk: Walk, u: Vec3) -> Option<BsdfSample> {
        self.sight(from, Among::All)?.sample(walk, u)
    }

    /// The geometric side of a direction; `None` where nothing scatters or it is in the tangent plane.
    #[inline]
    fn side_of(&self, from: Vec3) -> Option<f32> {
        let cos = self.ng.dot(from);
        (!self.is_black() && cos.abs() >= MIN_COS).then(|| 1f32.copysign(cos))
    }

    /// Estimate of the directional albedo seen along `wo`: for the Albedo pass, for roulette.
    pub fn albedo(&self, wo: Vec3) -> Vec3 {
        let side = 1f32.copysign(self.ng.dot(wo));
        let one = |e: &Entry| e.seen_from(wo, side).map_or(Vec3::ZERO, |o| e.weight * e.lobe.albedo(o));
        self.entries().iter().map(one).sum()
    }
}
