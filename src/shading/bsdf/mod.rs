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
//! common, a continuous lobe is evaluated as seen at grazing incidence, and a delta lobe absorbs.

mod builder;
pub mod principled;
mod walk;

pub use builder::{BsdfBuilder, CAPACITY};
pub use principled::{MetalF90, Principled};
pub use walk::{Event, Passage};

use super::lobes::{Density, Kind, Lobe, MIN_COS, Side};
use crate::math::density::{DiscreteProbability, ProjectedPdf};
use crate::math::{Frame, ONE_MINUS_EPSILON};
use glam::Vec3;
use smallvec::SmallVec;

/// Which way a path is being built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walk {
    /// From the camera: the known direction is `wo`, and radiance is carried.
    Camera,
    /// From a light: the known direction is `wi`, and flux is carried.
    Light,
}

/// A direction drawn from a [`Bsdf`].
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The drawn direction, unit length.
    pub direction: Vec3,
    /// Camera walk: `eval(from, direction)`. Light walk: `eval(direction, from) n_to^2 / n_from^2`. For a
    /// delta event the coefficient of the Dirac delta. Divided by the density it is the factor on the
    /// basic radiance, or the flux, that the path carries.
    pub value: Vec3,
    /// How likely the draw was, about the geometric normal. Never zero.
    pub pdf: Density,
    /// Refractive index of the sampled side over that of the side come from; 1 for a reflection.
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
}

/// Cosine to which the direction looked from is raised where the shading normal faces away from it.
const GRAZING: f32 = 1e-3;
/// Least share of its weight at which a lobe is chosen, whatever its albedo: keeps every density with
/// which a lobe may answer the adjoint walk well away from zero.
const MIN_CHOICE: f32 = 1.0 / 32.0;

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
    /// Refractive index below the surface over that above it, for what continuous lobes transmit: that
    /// of the refracting lobe of most weight.
    eta: f32,
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

    /// Refractive index on the side of `to` over that on the side of `from`, for light that a continuous
    /// lobe scatters between them.
    #[inline]
    pub fn relative_index(&self, from: Vec3, to: Vec3) -> f32 {
        let (from, to) = (self.ng.dot(from), self.ng.dot(to));
        if from * to > 0.0 {
            1.0
        } else if from > 0.0 {
            self.eta
        } else {
            1.0 / self.eta
        }
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

    /// Effective BSDF for light arriving from `from` and leaving along `to`, times `n_to^2 / n_from^2`:
    /// the value of a light walk.
    pub fn eval_flux(&self, from: Vec3, to: Vec3) -> Vec3 {
        let Some((st, sf, cos)) = self.sides(to, from) else { return Vec3::ZERO };
        let mut sum = Vec3::ZERO;
        for e in self.entries() {
            sum += self.eval_entry(e, to, st, from, sf);
        }
        sum * (self.relative_index(from, to).powi(2) / cos)
    }

    /// Density with which [`Bsdf::sample`], standing on `from`, draws `to` from the continuous lobes.
    pub fn pdf(&self, from: Vec3, to: Vec3) -> ProjectedPdf {
        let Some((sf, st, cos)) = self.sides(from, to) else { return ProjectedPdf(0.0) };
        let choice = Choice::new(self, from, sf);
        self.pdf_with(&choice, from, sf, to, st, cos)
    }

    #[inline]
    fn pdf_with(&self, choice: &Choice, from: Vec3, sf: f32, to: Vec3, st: f32, cos: f32) -> ProjectedPdf {
        let mut sum = 0.0;
        for (k, e) in self.entries().iter().enumerate() {
            if e.delta {
                continue;
            }
            if let (Some(t), Some(f)) = (e.scattered(to, st), e.seen_from(from, sf)) {
                sum += choice.probability(k) * e.lobe.pdf(f, t).0 * t.z.abs();
            }
        }
        ProjectedPdf(sum / cos)
    }

    /// Draws a direction, standing on `from`. `u`: three independent uniform numbers of [0,1); x and y
    /// choose the direction, z the lobe. `None`: the light is absorbed.
    pub fn sample(&self, from: Vec3, walk: Walk, u: Vec3) -> Option<BsdfSample> {
        let sf = self.side_of(from)?;
        let choice = Choice::new(self, from, sf);
        let (k, uz) = choice.pick(u.z);
        self.sample_entry(&choice, k, from, sf, walk, u.with_z(uz))
    }

    /// The geometric side of a direction; `None` where nothing scatters or it is in the tangent plane.
    #[inline]
    fn side_of(&self, from: Vec3) -> Option<f32> {
        let cos = self.ng.dot(from);
        (!self.is_black() && cos.abs() >= MIN_COS).then(|| 1f32.copysign(cos))
    }

    /// Draws a direction from lobe `k`, which `choice` chose.
    #[inline]
    fn sample_entry(
        &self,
        choice: &Choice,
        k: usize,
        from: Vec3,
        sf: f32,
        walk: Walk,
        u: Vec3,
    ) -> Option<BsdfSample> {
        let e = &self.entries()[k];
        let local = e.seen_from(from, sf)?;
        let s = e.lobe.sample(local, u)?;
        let direction = e.frame.to_world(s.direction).normalize();
        let cos_to = self.ng.dot(direction);
        let st = match s.kind.side {
            Side::Reflection => sf,
            Side::Transmission => -sf,
        };
        if cos_to * st < MIN_COS {
            return None;
        }
        let (value, pdf, eta) = if e.delta {
            let value = match walk {
                Walk::Camera => e.weight * s.value,
                // the delta's coefficient is symmetric in étendue about ns; this is the change to ng
                Walk::Light => {
                    let turn = (local.z * cos_to / (self.ng.dot(from) * s.direction.z)).abs();
                    e.weight * s.value * turn
                }
            };
            (value, s.pdf * DiscreteProbability(choice.probability(k)), s.eta)
        } else {
            let value = match walk {
                Walk::Camera => self.eval(from, direction),
                Walk::Light => self.eval_flux(from, direction),
            };
            let pdf = self.pdf_with(choice, from, sf, direction, st, cos_to.abs());
            (value, Density::Projected(pdf), self.relative_index(from, direction))
        };
        let usable = pdf.value() > 0.0 && pdf.value().is_finite() && value.max_element() > 0.0;
        usable.then_some(BsdfSample { direction, value, pdf, eta, kind: s.kind })
    }

    /// Estimate of the directional albedo seen along `wo`: for the Albedo pass, for roulette.
    pub fn albedo(&self, wo: Vec3) -> Vec3 {
        let side = 1f32.copysign(self.ng.dot(wo));
        let one = |e: &Entry| e.seen_from(wo, side).map_or(Vec3::ZERO, |o| e.weight * e.lobe.albedo(o));
        self.entries().iter().map(one).sum()
    }
}

/// The probabilities of choosing each lobe when standing on some direction.
struct Choice {
    len: usize,
    cumulative: [f32; CAPACITY],
}

impl Choice {
    /// Among all lobes.
    #[inline]
    fn new(bsdf: &Bsdf, from: Vec3, side: f32) -> Self {
        Self::among(bsdf, from, side, |_| true)
    }

    /// Among the lobes that are `wanted`, of which there is one at least.
    #[inline]
    fn among(bsdf: &Bsdf, from: Vec3, side: f32, wanted: impl Fn(&Entry) -> bool) -> Self {
        let mut cumulative = [0.0; CAPACITY];
        let mut sum = 0.0;
        let len = bsdf.entries.len();
        if len == 1 {
            cumulative[0] = 1.0;
            return Self { len: 1, cumulative };
        }
        for (c, e) in cumulative.iter_mut().zip(bsdf.entries()) {
            if !wanted(e) {
                *c = sum;
                continue;
            }
            let albedo = e.seen_from(from, side).map_or(Vec3::ZERO, |o| e.lobe.albedo(o));
            sum += (e.weight * albedo.max(Vec3::splat(MIN_CHOICE))).element_sum();
            *c = sum;
        }
        for c in &mut cumulative[..len] {
            *c /= sum;
        }
        Self { len, cumulative }
    }

    #[inline]
    fn probability(&self, k: usize) -> f32 {
        self.cumulative[k] - if k > 0 { self.cumulative[k - 1] } else { 0.0 }
    }

    /// Picks a lobe, and makes of `u` a fresh number of [0,1).
    #[inline]
    fn pick(&self, u: f32) -> (usize, f32) {
        let k = self.cumulative[..self.len - 1].iter().take_while(|&&c| u >= c).count();
        let low = if k > 0 { self.cumulative[k - 1] } else { 0.0 };
        (k, ((u - low) / self.probability(k)).clamp(0.0, ONE_MINUS_EPSILON))
    }
}
