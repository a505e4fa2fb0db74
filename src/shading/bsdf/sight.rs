//! A surface looked at from one direction: what all questions about the other one share is worked out once.

use super::{Bsdf, BsdfSample, CAPACITY, Entry, Event, Passage, Walk};
use crate::math::ONE_MINUS_EPSILON;
use crate::math::density::{DiscreteProbability, ProjectedPdf};
use crate::shading::lobes::{Density, MIN_COS, Side};
use glam::Vec3;
use smallvec::SmallVec;
use std::mem::discriminant;

/// Least share of its weight at which a lobe is chosen, whatever its albedo: keeps every density with
/// which a lobe may answer the adjoint walk well away from zero.
const MIN_CHOICE: f32 = 1.0 / 32.0;

/// Between which lobes a walk chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Among {
    /// All of them.
    All,
    /// The continuous ones: the segment ends here.
    Continuous,
}

/// A [`Bsdf`] seen from one direction.
#[derive(Debug)]
pub struct Sight<'a> {
    bsdf: &'a Bsdf,
    from: Vec3,
    /// The geometric side looked from, +1 or -1.
    side: f32,
    choice: Choice,
    /// The direction in each lobe's frame.
    locals: SmallVec<[Option<Vec3>; 4]>,
}

impl Bsdf {
    /// The surface seen from `from`, to choose among some of its lobes. `None` where there are none of them, and for a
    /// direction in the tangent plane.
    pub fn sight(&self, from: Vec3, among: Among) -> Option<Sight<'_>> {
        let side = self.side_of(from)?;
        if among == Among::Continuous && !self.has_smooth() {
            return None;
        }
        let locals: SmallVec<_> = self.entries().iter().map(|e| e.seen_from(from, side)).collect();
        let choice = Choice::new(self.entries(), &locals, among);
        Some(Sight { bsdf: self, from, side, choice, locals })
    }
}

impl Sight<'_> {
    /// Effective BSDF with this as the camera's side (1/sr), and the density of drawing `to`.
    pub fn look(&self, to: Vec3) -> (Vec3, ProjectedPdf) {
        let Some(side) = self.bsdf.side_of(to) else { return (Vec3::ZERO, ProjectedPdf(0.0)) };
        let (mut value, mut pdf) = (Vec3::ZERO, 0.0);
        for (k, e, from) in self.continuous() {
            if let Some(to) = e.scattered(to, side) {
                let (f, p) = e.lobe.eval_and_pdf(from, to);
                value += e.weight * f * to.z.abs();
                pdf += self.choice.probability(k) * p.0 * to.z.abs();
            }
        }
        let cos = self.bsdf.ng.dot(to).abs();
        (value / cos, ProjectedPdf(pdf / cos))
    }

    /// Density of drawing `to` from the continuous lobes.
    pub fn pdf(&self, to: Vec3) -> ProjectedPdf {
        let Some(side) = self.bsdf.side_of(to) else { return ProjectedPdf(0.0) };
        let mut sum = 0.0;
        for (k, e, from) in self.continuous() {
            if let Some(to) = e.scattered(to, side) {
                sum += self.choice.probability(k) * e.lobe.pdf(from, to).0 * to.z.abs();
            }
        }
        ProjectedPdf(sum / self.bsdf.ng.dot(to).abs())
    }

    /// Continuous lobes that are seen, with their numbers and the direction in their frames.
    #[inline]
    fn continuous(&self) -> impl Iterator<Item = (usize, &Entry, Vec3)> {
        let lobes = self.bsdf.entries().iter().zip(&self.locals).enumerate();
        lobes.filter(|(_, (e, _))| !e.delta).filter_map(|(k, (e, local))| Some((k, e, (*local)?)))
    }

    /// Draws a direction. `u`: three independent uniform numbers of [0,1); x and y choose the direction, z the lobe.
    /// `None`: the light is absorbed.
    pub fn sample(&self, walk: Walk, u: Vec3) -> Option<BsdfSample> {
        let (k, uz) = self.choice.pick(u.z);
        self.sample_lobe(k, walk, u.with_z(uz))
    }

    /// Draws a direction from lobe `k`.
    fn sample_lobe(&self, k: usize, walk: Walk, u: Vec3) -> Option<BsdfSample> {
        let (bsdf, from, e) = (self.bsdf, self.from, &self.bsdf.entries()[k]);
        let local = self.locals[k]?;
        let s = e.lobe.sample(local, u)?;
        let direction = e.frame.to_world(s.direction).normalize();
        if e.delta && walk == Walk::Light && e.bends_from(bsdf.ng, direction) {
            return None;
        }
        let cos_to = bsdf.ng.dot(direction);
        let side_to = match s.kind.side {
            Side::Reflection => self.side,
            Side::Transmission => -self.side,
        };
        if cos_to * side_to < MIN_COS {
            return None;
        }
        let (value, pdf) = match (e.delta, walk) {
            (true, _) => {
                let turn = match walk {
                    Walk::Camera => 1.0,
                    // the delta's coefficient is symmetric in étendue about ns; this is the change to ng
                    Walk::Light => (local.z * cos_to / (bsdf.ng.dot(from) * s.direction.z)).abs(),
                };
                let choice = DiscreteProbability(self.choice.probability(k));
                (e.weight * s.value * turn, s.pdf * choice)
            }
            (false, Walk::Camera) => {
                let (value, pdf) = self.look(direction);
                (value, Density::Projected(pdf))
            }
            (false, Walk::Light) => (bsdf.eval(direction, from), Density::Projected(self.pdf(direction))),
        };
        let usable = pdf.value() > 0.0 && pdf.value().is_finite() && value.max_element() > 0.0;
        usable.then_some(BsdfSample { direction, value, pdf, eta: s.eta, kind: s.kind })
    }

    /// What the walk does at the surface. `u` as in [`Sight::sample`]; `again` as in [`Bsdf::event`].
    pub(super) fn event(&self, walk: Walk, u: Vec3, again: impl Fn(Vec3) -> Option<Bsdf>) -> Event {
        let (k, uz) = self.choice.pick(u.z);
        if !self.bsdf.entries()[k].delta {
            return Event::Ends { probability: self.continuous_share() };
        }
        let Some(s) = self.sample_lobe(k, walk, u.with_z(uz)) else { return Event::Absorbed };
        let forward = s.pdf.value();
        let e = &self.bsdf.entries()[k];
        // layers, and textures that ask, weigh the lobes by the direction looked from
        let other = again(s.direction);
        let back = other.as_ref().unwrap_or(self.bsdf).sight(s.direction, Among::All);
        let (weight, chosen) = back.and_then(|back| back.counterpart(k, self)).unwrap_or_default();
        // a lobe's own choice between reflection and refraction is the same from both sides
        let within = forward / self.choice.probability(k);
        let one_way = walk == Walk::Camera && e.bends_from(self.bsdf.ng, s.direction);
        let reverse = if one_way { 0.0 } else { within * chosen };
        let coefficient = match walk {
            Walk::Camera => s.value,
            // the camera's side decides
            Walk::Light => s.value * Vec3::select(e.weight.cmpgt(Vec3::ZERO), weight / e.weight, Vec3::ZERO),
        };
        if coefficient == Vec3::ZERO {
            return Event::Absorbed;
        }
        Event::Passes(Passage { direction: s.direction, coefficient, forward, reverse, eta: s.eta })
    }

    /// The weight of lobe `k` of another sight of the same surface, as it is seen here, and the probability of choosing it.
    fn counterpart(&self, k: usize, of: &Sight) -> Option<(Vec3, f32)> {
        let (entries, theirs) = (self.bsdf.entries(), of.bsdf.entries());
        let kind = |e: &Entry| discriminant(&e.lobe);
        let is_same = |e: &Entry| kind(e) == kind(&theirs[k]) && e.frame.n == theirs[k].frame.n;
        // lobes that do not show from one of the two sides are missing there
        let i = match entries.len() == theirs.len() {
            true => k,
            false => entries.iter().position(is_same)?,
        };
        Some((entries[i].weight, self.choice.probability(i)))
    }

    /// Probability that the choice falls on a continuous lobe.
    pub(super) fn continuous_share(&self) -> f32 {
        let continuous = self.bsdf.entries().iter().enumerate().filter(|(_, e)| !e.delta);
        continuous.map(|(k, _)| self.choice.probability(k)).sum()
    }

    /// Estimate of the directional albedo of the continuous lobes.
    pub fn continuous_albedo(&self) -> Vec3 {
        self.continuous().map(|(k, e, local)| e.weight * self.choice.albedo(k, e, local)).sum()
    }
}

/// The probabilities of choosing each lobe.
#[derive(Debug)]
struct Choice {
    len: usize,
    cumulative: [f32; CAPACITY],
    /// Albedos of the lobes, where they had to be known.
    albedos: SmallVec<[Vec3; 4]>,
}

impl Choice {
    /// Among lobes of which one at least is wanted.
    #[inline]
    fn new(entries: &[Entry], locals: &[Option<Vec3>], among: Among) -> Self {
        let mut cumulative = [0.0; CAPACITY];
        let len = entries.len();
        if len == 1 {
            cumulative[0] = 1.0;
            return Self { len, cumulative, albedos: SmallVec::new() };
        }
        let mut albedos = SmallVec::with_capacity(len);
        let mut sum = 0.0;
        for ((c, e), local) in cumulative.iter_mut().zip(entries).zip(locals) {
            let is_wanted = among == Among::All || !e.delta;
            let albedo = match local {
                Some(local) if is_wanted => e.lobe.albedo(*local),
                _ => Vec3::ZERO,
            };
            if is_wanted {
                sum += (e.weight * albedo.max(Vec3::splat(MIN_CHOICE))).element_sum();
            }
            albedos.push(albedo);
            *c = sum;
        }
        for c in &mut cumulative[..len] {
            *c /= sum;
        }
        Self { len, cumulative, albedos }
    }

    #[inline]
    fn albedo(&self, k: usize, e: &Entry, local: Vec3) -> Vec3 {
        self.albedos.get(k).copied().unwrap_or_else(|| e.lobe.albedo(local))
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
