//! How likely a drawn direction was.

use crate::math::density::{DiscreteProbability, ProjectedPdf};

/// Density of a draw, by its measure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// Drawn from a continuous density.
    Projected(ProjectedPdf),
    /// Drawn from a discrete set: a Dirac delta of directions.
    Discrete(DiscreteProbability),
}

impl Density {
    /// The number itself, whatever its measure: what the sample's value is divided by.
    #[inline]
    pub fn value(self) -> f32 {
        match self {
            Self::Projected(ProjectedPdf(p)) | Self::Discrete(DiscreteProbability(p)) => p,
        }
    }

    /// Whether this is the probability of a Dirac delta.
    #[inline]
    pub fn is_discrete(self) -> bool {
        matches!(self, Self::Discrete(_))
    }
}

impl std::ops::Mul<DiscreteProbability> for Density {
    type Output = Self;

    /// The density given that a discrete choice was made first.
    #[inline]
    fn mul(self, choice: DiscreteProbability) -> Self {
        match self {
            Self::Projected(d) => Self::Projected(d * choice),
            Self::Discrete(DiscreteProbability(p)) => Self::Discrete(DiscreteProbability(p * choice.0)),
        }
    }
}
