//! Probability densities whose type names their measure, so that two of different measures cannot be
//! added or compared by accident.

macro_rules! density {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
        pub struct $name(pub f32);

        impl $name {
            /// The bare number.
            #[inline]
            pub fn value(self) -> f32 {
                self.0
            }
        }

        /// The density given that a discrete choice was made first.
        impl std::ops::Mul<DiscreteProbability> for $name {
            type Output = Self;
            #[inline]
            fn mul(self, choice: DiscreteProbability) -> Self {
                Self(self.0 * choice.0)
            }
        }
    };
}

density! {
    /// Density per surface area, in 1/(scene unit)^2.
    AreaPdf
}
density! {
    /// Density per solid angle, in 1/sr.
    SolidAnglePdf
}
density! {
    /// Density per projected solid angle (solid angle times the cosine to the surface), in 1/sr.
    ProjectedPdf
}
density! {
    /// Density per unit of geometric étendue (area times projected solid angle).
    EtenduePdf
}
density! {
    /// Probability of a discrete outcome.
    DiscreteProbability
}

impl AreaPdf {
    /// The same density per solid angle seen from a point at `distance`, where the surface's normal
    /// makes an angle of cosine `cos` with the line between them.
    #[inline]
    pub fn to_solid_angle(self, distance: f32, cos: f32) -> SolidAnglePdf {
        SolidAnglePdf(self.0 * distance * distance / cos.abs())
    }

    /// With the density of the direction that leaves the point.
    #[inline]
    pub fn with_direction(self, direction: ProjectedPdf) -> EtenduePdf {
        EtenduePdf(self.0 * direction.0)
    }
}

impl SolidAnglePdf {
    /// The same density per area of a surface at `distance`, whose normal makes an angle of cosine
    /// `cos` with the line of sight.
    #[inline]
    pub fn to_area(self, distance: f32, cos: f32) -> AreaPdf {
        AreaPdf(self.0 * cos.abs() / (distance * distance))
    }

    /// The same density per projected solid angle at a surface seen under cosine `cos`.
    #[inline]
    pub fn to_projected(self, cos: f32) -> ProjectedPdf {
        ProjectedPdf(self.0 / cos.abs())
    }
}

impl ProjectedPdf {
    /// The same density per solid angle.
    #[inline]
    pub fn to_solid_angle(self, cos: f32) -> SolidAnglePdf {
        SolidAnglePdf(self.0 * cos.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_convert_there_and_back() {
        let area = AreaPdf(0.25);
        let w = area.to_solid_angle(3.0, -0.5);
        assert_eq!(w, SolidAnglePdf(4.5));
        assert_eq!(w.to_area(3.0, 0.5), area);
        assert_eq!(w.to_projected(0.5).to_solid_angle(-0.5), w);
        assert_eq!(area.with_direction(ProjectedPdf(2.0)) * DiscreteProbability(0.5), EtenduePdf(0.25));
    }
}
