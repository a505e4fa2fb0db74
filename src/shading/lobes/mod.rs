//! Scattering lobes: the closed set of ways in which a surface scatters light.
//!
//! A lobe works in a local frame whose z axis is the shading normal. Directions are unit vectors that
//! point away from the surface. Radiance is carried as *basic radiance* `L / n^2`, where `n` is the
//! refractive index of the side a direction lies on. For a camera-side direction `wo` and a light-side
//! direction `wi`:
//!
//! - [`Lobe::eval`] is the BSDF of basic radiance, 1/sr: `L(wo)/n_o^2 = integral of f(wo, wi) L(wi)/n_i^2`
//!   over the projected solid angle of `wi`. No factor of `1/eta^2` is left for refraction, and a
//!   lossless lobe integrates to one. Reciprocity reads `f(wo, wi) n_o^2 = f(wi, wo) n_i^2`.
//! - [`Lobe::pdf`] is the density with which [`Lobe::sample`], standing on one direction, draws the
//!   other, per unit projected solid angle of the latter.
//! - [`Lobe::sample`] draws a direction; `None` means that the light is absorbed (or that the draw fell
//!   below the horizon). The mean of [`LobeSample::weight`] over the draws, a `None` counting as zero, is
//!   the directional albedo.
//!
//! A *delta* lobe (mirror, smooth glass, straight passage) scatters into single directions: its `eval`
//! and `pdf` are zero, and only sampling sees it.

mod density;
pub mod dielectric;
pub mod energy;
pub mod fresnel;
pub mod ggx;
pub mod lambert;
pub mod oren_nayar;
pub mod reflection;
pub mod sheen;
#[cfg(test)]
pub(super) mod testing;
pub mod translucent;
pub mod transparent;

pub use density::Density;
pub use dielectric::Dielectric;
pub use fresnel::Fresnel;
pub use ggx::Ggx;
pub use lambert::Lambert;
pub use oren_nayar::OrenNayar;
pub use reflection::Reflection;
pub use sheen::Sheen;
pub use translucent::Translucent;
pub use transparent::Transparent;

use crate::math::density::{DiscreteProbability, ProjectedPdf};
use glam::Vec3;

/// Which side of the surface light leaves on, seen from where it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The same side.
    Reflection,
    /// The other side.
    Transmission,
}

/// How sharp a lobe is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finish {
    /// Broad, without a preferred direction.
    Diffuse,
    /// Around the mirrored or refracted direction.
    Glossy,
    /// Exactly the mirrored or refracted direction.
    Specular,
    /// Straight on, as if the surface were not there.
    Straight,
}

/// What kind of scattering event a sample is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kind {
    /// Reflection or transmission.
    pub side: Side,
    /// How sharp.
    pub finish: Finish,
}

impl Kind {
    /// A reflection.
    pub const fn reflection(finish: Finish) -> Self {
        Self { side: Side::Reflection, finish }
    }

    /// A transmission.
    pub const fn transmission(finish: Finish) -> Self {
        Self { side: Side::Transmission, finish }
    }

    /// Whether the event is a Dirac delta of directions.
    pub fn is_delta(self) -> bool {
        matches!(self.finish, Finish::Specular | Finish::Straight)
    }
}

/// A direction drawn from a lobe.
#[derive(Clone, Copy, Debug)]
pub struct LobeSample {
    /// The drawn direction, local frame, unit length.
    pub direction: Vec3,
    /// `eval(from, direction)`, 1/sr; for a delta event the coefficient of the Dirac delta of projected
    /// solid angle, without unit (a perfect mirror has 1).
    pub value: Vec3,
    /// How likely the draw was. Never zero.
    pub pdf: Density,
    /// Refractive index of the sampled side over that of the side come from; 1 for a reflection.
    pub eta: f32,
    /// What happened.
    pub kind: Kind,
}

impl LobeSample {
    /// Throughput of the sample: value over density, for continuous and delta events alike.
    #[inline]
    pub fn weight(&self) -> Vec3 {
        self.value / self.pdf.value()
    }

    /// A delta event of probability `p`, which must not be zero.
    #[inline]
    pub(crate) fn delta(direction: Vec3, value: Vec3, p: f32, eta: f32, kind: Kind) -> Self {
        Self { direction, value, pdf: Density::Discrete(DiscreteProbability(p)), eta, kind }
    }

    /// A sample of a continuous density; `None` where the density is not a usable number.
    #[inline]
    pub(crate) fn continuous(direction: Vec3, value: Vec3, pdf: f32, eta: f32, kind: Kind) -> Option<Self> {
        (pdf > 0.0 && pdf.is_finite()).then_some(Self {
            direction,
            value,
            pdf: Density::Projected(ProjectedPdf(pdf)),
            eta,
            kind,
        })
    }
}

/// Cosines below this count as below the horizon: there, single precision has no digits left.
pub const MIN_COS: f32 = 1e-6;

/// A scattering lobe.
#[derive(Clone, Copy, Debug)]
pub enum Lobe {
    /// Ideal diffuse reflection.
    Lambert(Lambert),
    /// Rough diffuse reflection.
    OrenNayar(OrenNayar),
    /// Ideal diffuse transmission.
    Translucent(Translucent),
    /// Reflection off a layer of fibres.
    Sheen(Sheen),
    /// Rough or smooth reflection off microfacets.
    Reflection(Reflection),
    /// Rough or smooth reflection and refraction at an interface.
    Dielectric(Dielectric),
    /// Straight passage.
    Transparent(Transparent),
}

/// Calls the same method of whichever lobe it is.
macro_rules! each {
    ($self:ident, $lobe:ident => $call:expr) => {
        match $self {
            Lobe::Lambert($lobe) => $call,
            Lobe::OrenNayar($lobe) => $call,
            Lobe::Translucent($lobe) => $call,
            Lobe::Sheen($lobe) => $call,
            Lobe::Reflection($lobe) => $call,
            Lobe::Dielectric($lobe) => $call,
            Lobe::Transparent($lobe) => $call,
        }
    };
}

impl Lobe {
    /// BSDF of basic radiance (1/sr) for camera side `wo`, light side `wi`. Zero for delta lobes.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        each!(self, lobe => lobe.eval(wo, wi))
    }

    /// Density of drawing `to` when standing on `from`. Zero for delta lobes.
    #[inline]
    pub fn pdf(&self, from: Vec3, to: Vec3) -> ProjectedPdf {
        ProjectedPdf(each!(self, lobe => lobe.pdf(from, to)))
    }

    /// [`Lobe::eval`] for the camera's side `from`, and [`Lobe::pdf`], which have much in common.
    #[inline]
    pub fn eval_and_pdf(&self, from: Vec3, to: Vec3) -> (Vec3, ProjectedPdf) {
        let (value, pdf) = match self {
            Self::Reflection(lobe) => lobe.eval_and_pdf(from, to),
            Self::Dielectric(lobe) => lobe.eval_and_pdf(from, to),
            _ => (self.eval(from, to), self.pdf(from, to).0),
        };
        (value, ProjectedPdf(pdf))
    }

    /// Draws a direction, the other one being `from`. `u`: three independent uniform numbers of [0,1);
    /// x and y choose the direction, z between reflection and refraction.
    #[inline]
    pub fn sample(&self, from: Vec3, u: Vec3) -> Option<LobeSample> {
        each!(self, lobe => lobe.sample(from, u))
    }

    /// Estimate of the directional albedo: what [`LobeSample::weight`] is on average.
    #[inline]
    pub fn albedo(&self, from: Vec3) -> Vec3 {
        each!(self, lobe => lobe.albedo(from))
    }

    /// Whether the lobe scatters into single directions.
    #[inline]
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::OrenNayar(_) | Self::Translucent(_) | Self::Sheen(_) => false,
            Self::Reflection(lobe) => lobe.is_delta(),
            Self::Dielectric(lobe) => lobe.is_delta(),
            Self::Transparent(_) => true,
        }
    }

    /// Whether it mirrors, more or less sharply, about a normal.
    #[inline]
    pub fn is_specular(&self) -> bool {
        matches!(self, Self::Reflection(_) | Self::Dielectric(_))
    }

    /// Whether it scatters light to the other side.
    #[inline]
    pub fn transmits(&self) -> bool {
        match self {
            Self::Lambert(_) | Self::OrenNayar(_) | Self::Sheen(_) | Self::Reflection(_) => false,
            Self::Translucent(_) | Self::Dielectric(_) | Self::Transparent(_) => true,
        }
    }

    /// Refractive index below the surface over that above it: 1 for all but refracting lobes.
    #[inline]
    pub fn eta(&self) -> f32 {
        match self {
            Self::Dielectric(lobe) => lobe.eta(),
            _ => 1.0,
        }
    }
}
