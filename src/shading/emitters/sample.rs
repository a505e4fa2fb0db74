//! What emitters are asked and what they answer.

use crate::math::density::{AreaPdf, EtenduePdf, SolidAnglePdf};
use glam::{Vec2, Vec3};

/// An emitter of the scene: the analytic lights in their order, then the emissive triangles in theirs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EmitterId(pub u32);

/// A point that receives light, world space.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Where it is.
    pub position: Vec3,
    /// Unit normal of a surface that light reaches from this side only; `None` where light counts from
    /// all sides, as on transmissive surfaces.
    pub normal: Option<Vec3>,
}

/// What arrives at a receiver along a sampled direction, if nothing is in the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Incident {
    /// Radiance from an emitter of some extent.
    Radiance {
        /// Radiance towards the receiver.
        radiance: Vec3,
        /// Density of the direction.
        pdf: SolidAnglePdf,
    },
    /// Light from a single direction, chosen with certainty.
    Delta {
        /// Irradiance of a surface that faces the direction.
        irradiance: Vec3,
    },
}

impl Incident {
    /// Single-sample estimate of the irradiance of a surface that faces the direction: multiply with
    /// the scattering function and the cosine.
    #[inline]
    pub fn estimate(&self) -> Vec3 {
        match *self {
            Self::Radiance { radiance, pdf } => radiance / pdf.0,
            Self::Delta { irradiance } => irradiance,
        }
    }
}

/// A sample towards an emitter, for next-event estimation.
#[derive(Clone, Copy, Debug)]
pub struct TowardsSample {
    /// Unit direction from the receiver to the light.
    pub direction: Vec3,
    /// Distance to the sampled point; infinite for domes and distant lights.
    pub distance: f32,
    /// The sampled point; the receiver's position where `distance` is infinite.
    pub point: Vec3,
    /// Unit normal of the emitting side there; opposite to `direction` where there is no surface.
    pub normal: Vec3,
    /// What arrives.
    pub incident: Incident,
    /// Barycentrics of the second and third vertex, where the emitter is a triangle: `incident` then
    /// holds its mean radiance, and a texture is the caller's to evaluate.
    pub barycentrics: Option<Vec2>,
}

/// What leaves an emitter along a sampled ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emission {
    /// From a surface, or from infinity through the disk that covers the scene.
    Extended {
        /// Radiance along the ray.
        radiance: Vec3,
        /// Density of the ray: per area times projected solid angle.
        pdf: EtenduePdf,
    },
    /// From a point, known with certainty.
    Point {
        /// Intensity along the ray, W/sr.
        intensity: Vec3,
        /// Density of the direction.
        pdf: SolidAnglePdf,
    },
    /// Along a single direction, known with certainty.
    Beam {
        /// Irradiance of a surface that faces the light.
        irradiance: Vec3,
        /// Density of the origin on a plane perpendicular to the direction.
        pdf: AreaPdf,
    },
}

impl Emission {
    /// The flux that one sample stands for, W.
    #[inline]
    pub fn flux(&self) -> Vec3 {
        match *self {
            Self::Extended { radiance, pdf } => radiance / pdf.0,
            Self::Point { intensity, pdf } => intensity / pdf.0,
            Self::Beam { irradiance, pdf } => irradiance / pdf.0,
        }
    }
}

/// The first ray of a light path.
#[derive(Clone, Copy, Debug)]
pub struct FromSample {
    /// Where it starts.
    pub origin: Vec3,
    /// Unit normal of the emitting side; equal to `direction` where there is no surface.
    pub normal: Vec3,
    /// Unit direction of travel.
    pub direction: Vec3,
    /// What it carries.
    pub emission: Emission,
    /// As in [`TowardsSample::barycentrics`].
    pub barycentrics: Option<Vec2>,
}

/// Where a ray meets an emitter.
#[derive(Clone, Copy, Debug)]
pub struct EmitterHit {
    /// Which emitter.
    pub emitter: EmitterId,
    /// Distance along the ray; infinite for domes and distant lights.
    pub distance: f32,
    /// The point met; where `distance` is infinite, any point of the ray.
    pub point: Vec3,
    /// Unit normal of the emitting side there.
    pub normal: Vec3,
    /// Radiance against the ray.
    pub radiance: Vec3,
}

/// A point of an emitting surface sampled as seen from a receiver.
#[derive(Clone, Copy, Debug)]
pub(super) struct SurfacePoint {
    pub direction: Vec3,
    pub distance: f32,
    pub point: Vec3,
    pub normal: Vec3,
    pub pdf: SolidAnglePdf,
}

impl SurfacePoint {
    /// A point chosen by area. `None` where its back is seen, or it is where the receiver is.
    #[inline]
    pub fn by_area(from: Vec3, point: Vec3, normal: Vec3, pdf: AreaPdf) -> Option<Self> {
        let to = point - from;
        let distance = to.length();
        let direction = to / distance;
        let cos = -normal.dot(direction);
        // false for NaN too, which a zero distance makes
        (cos > 0.0 && distance > 0.0).then(|| Self {
            direction,
            distance,
            point,
            normal,
            pdf: pdf.to_solid_angle(distance, cos),
        })
    }
}
