//! Scattering as generalised segments meet it: at a Dirac lobe a segment goes on, at a continuous one it ends.
//!
//! Which of the two happens at a point that has both is a discrete choice, with the probabilities by which
//! [`Bsdf::sample`] chooses its lobes. Densities of continuous lobes are here *given* that the segment ended.

use super::{Bsdf, BsdfSample, Choice, Walk};
use crate::math::density::ProjectedPdf;
use crate::shading::lobes::Lobe;
use glam::Vec3;

/// What a walk does at a surface point.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A continuous lobe was chosen: the segment ends here.
    Ends {
        /// Probability of this choice, that of [`Bsdf::end_probability`].
        probability: f32,
    },
    /// A Dirac lobe was chosen: the segment goes on.
    Passes(Passage),
    /// The light is absorbed.
    Absorbed,
}

/// A segment's passage through a Dirac lobe.
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// Unit direction in which it goes on.
    pub direction: Vec3,
    /// Coefficient of the Dirac delta: factor on basic radiance, or on flux.
    pub coefficient: Vec3,
    /// Probability of this choice, for the walk that made it.
    pub forward: f32,
    /// Probability of the same passage for a walk the other way.
    pub reverse: f32,
    /// Refractive index of the side gone to over that of the side come from.
    pub eta: f32,
}

impl Bsdf {
    /// Chooses what happens to a walk that arrives from `from`. `u`: three uniform numbers of [0,1).
    pub fn event(&self, from: Vec3, walk: Walk, u: Vec3) -> Event {
        if !self.has_delta() {
            return if self.is_black() { Event::Absorbed } else { Event::Ends { probability: 1.0 } };
        }
        let Some(side) = self.side_of(from) else { return Event::Absorbed };
        let choice = Choice::new(self, from, side);
        let (k, uz) = choice.pick(u.z);
        if !self.entries()[k].delta {
            return Event::Ends { probability: self.continuous_share(&choice) };
        }
        let Some(s) = self.sample_entry(&choice, k, from, side, walk, u.with_z(uz)) else {
            return Event::Absorbed;
        };
        let forward = s.pdf.value();
        // a lobe's own choice between reflection and refraction is the same from both sides
        let within = forward / choice.probability(k);
        let Some(far_side) = self.side_of(s.direction) else { return Event::Absorbed };
        let reverse = within * Choice::new(self, s.direction, far_side).probability(k);
        Event::Passes(Passage { direction: s.direction, coefficient: s.value, forward, reverse, eta: s.eta })
    }

    /// Probability that a segment which arrives from `from` ends here.
    pub fn end_probability(&self, from: Vec3) -> f32 {
        if !self.has_delta() {
            return 1.0;
        }
        let Some(side) = self.side_of(from) else { return 0.0 };
        self.continuous_share(&Choice::new(self, from, side))
    }

    /// Probability that a choice falls on a continuous lobe.
    fn continuous_share(&self, choice: &Choice) -> f32 {
        let continuous = self.entries().iter().enumerate().filter(|(_, e)| !e.delta);
        continuous.map(|(k, _)| choice.probability(k)).sum()
    }

    /// Density with which [`Bsdf::sample_continuous`], standing on `from`, draws `to`.
    pub fn continuous_pdf(&self, from: Vec3, to: Vec3) -> ProjectedPdf {
        let (true, Some((sf, st, cos))) = (self.has_smooth(), self.sides(from, to)) else {
            return ProjectedPdf(0.0);
        };
        let choice = Choice::among(self, from, sf, |e| !e.delta);
        self.pdf_with(&choice, from, sf, to, st, cos)
    }

    /// Draws a direction from the continuous lobes; as [`Bsdf::sample`].
    pub fn sample_continuous(&self, from: Vec3, walk: Walk, u: Vec3) -> Option<BsdfSample> {
        if !self.has_smooth() {
            return None;
        }
        let side = self.side_of(from)?;
        let choice = Choice::among(self, from, side, |e| !e.delta);
        let (k, uz) = choice.pick(u.z);
        self.sample_entry(&choice, k, from, side, walk, u.with_z(uz))
    }

    /// Estimate of the directional albedo of the continuous lobes, seen from `from`.
    pub fn continuous_albedo(&self, from: Vec3) -> Vec3 {
        let side = 1f32.copysign(self.ng.dot(from));
        let continuous = self.entries().iter().filter(|e| !e.delta);
        continuous.filter_map(|e| e.seen_from(from, side).map(|o| e.weight * e.lobe.albedo(o))).sum()
    }

    /// Where all continuous lobes are Lambert's, about one normal: their reflectance and that normal.
    pub fn lambert(&self) -> Option<(Vec3, Vec3)> {
        let mut continuous = self.entries().iter().filter(|e| !e.delta).peekable();
        let normal = continuous.peek()?.frame.n;
        let mut reflectance = Vec3::ZERO;
        for e in continuous {
            if !matches!(e.lobe, Lobe::Lambert(_)) || e.frame.n != normal {
                return None;
            }
            reflectance += e.weight;
        }
        Some((reflectance, normal))
    }
}
