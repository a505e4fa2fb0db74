//! Scattering as generalised segments meet it: at a Dirac lobe a segment goes on, at a continuous one it ends.
//!
//! Which of the two happens at a point that has both is a discrete choice, with the probabilities by which
//! [`Bsdf::sample`] chooses its lobes. Densities of continuous lobes are here *given* that the segment ended.

use super::{Among, Bsdf, BsdfSample, Walk};
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
    /// Coefficient of the Dirac delta of étendue: factor on basic radiance.
    pub coefficient: Vec3,
    /// Probability of this choice, for the walk that made it.
    pub forward: f32,
    /// Probability of the same passage for a walk the other way.
    pub reverse: f32,
    /// Refractive index of the side gone to over that of the side come from.
    pub eta: f32,
}

impl Bsdf {
    /// Chooses what happens to a walk that arrives from `from`. `u`: three uniform numbers of [0,1). `again`: the same BSDF
    /// as looked at from elsewhere, if that makes a difference.
    pub fn event(&self, from: Vec3, walk: Walk, u: Vec3, again: impl Fn(Vec3) -> Option<Self>) -> Event {
        if !self.has_delta() {
            return if self.is_black() { Event::Absorbed } else { Event::Ends { probability: 1.0 } };
        }
        self.sight(from, Among::All).map_or(Event::Absorbed, |s| s.event(walk, u, again))
    }

    /// Probability that a segment which arrives from `from` ends here.
    pub fn end_probability(&self, from: Vec3) -> f32 {
        if !self.has_delta() {
            return 1.0;
        }
        self.sight(from, Among::All).map_or(0.0, |s| s.continuous_share())
    }

    /// Density with which the continuous lobes, seen from `from`, draw `to`.
    pub fn continuous_pdf(&self, from: Vec3, to: Vec3) -> ProjectedPdf {
        self.sight(from, Among::Continuous).map_or(ProjectedPdf(0.0), |s| s.pdf(to))
    }

    /// Draws a direction from the continuous lobes: [`Sight::sample`].
    pub fn sample_continuous(&self, from: Vec3, walk: Walk, u: Vec3) -> Option<BsdfSample> {
        self.sight(from, Among::Continuous)?.sample(walk, u)
    }

    /// Estimate of the directional albedo of the continuous lobes, seen from `from`.
    pub fn continuous_albedo(&self, from: Vec3) -> Vec3 {
        self.sight(from, Among::Continuous).map_or(Vec3::ZERO, |s| s.continuous_albedo())
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
