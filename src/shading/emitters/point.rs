//! Points that emit to all sides, or into a cone.

use super::bounds::{Cone, LightBounds};
use super::falloff::Falloff;
use super::sample::{Emission, FromSample, Incident, TowardsSample};
use crate::math::density::SolidAnglePdf;
use crate::math::{luminance, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::PI;

/// A light without size.
#[derive(Clone, Debug)]
pub(super) struct Point {
    position: Vec3,
    intensity: Vec3,
    falloff: Option<Falloff>,
}

impl Point {
    pub fn new(position: Vec3, intensity: Vec3, falloff: Option<Falloff>) -> Self {
        Self { position, intensity, falloff }
    }

    fn intensity(&self, direction: Vec3) -> Vec3 {
        self.intensity * self.falloff.as_ref().map_or(Vec3::ONE, |f| f.factor(direction))
    }

    pub fn towards(&self, x: Vec3) -> Option<TowardsSample> {
        let to = self.position - x;
        let distance = to.length();
        let direction = to / distance;
        let irradiance = self.intensity(-direction) / distance / distance;
        // a receiver at the light itself gets no finite irradiance
        (distance > 0.0 && irradiance != Vec3::ZERO && irradiance.is_finite()).then(|| TowardsSample {
            direction,
            distance,
            point: self.position,
            normal: -direction,
            incident: Incident::Delta { irradiance },
            barycentrics: None,
        })
    }

    /// Density of [`Point::from`] for a direction of travel.
    pub fn pdf_from(&self, direction: Vec3) -> SolidAnglePdf {
        SolidAnglePdf(self.falloff.as_ref().map_or(0.25 / PI, |f| f.pdf(direction)))
    }

    pub fn from(&self, u: Vec2) -> Option<FromSample> {
        let (direction, pdf) = match &self.falloff {
            Some(f) => f.sample(u),
            None => (warp::uniform_sphere(u), 0.25 / PI),
        };
        let intensity = self.intensity(direction);
        (intensity != Vec3::ZERO).then_some(FromSample {
            origin: self.position,
            normal: direction,
            direction,
            emission: Emission::Point { intensity, pdf: SolidAnglePdf(pdf) },
            barycentrics: None,
        })
    }

    /// The numbers from which [`Point::from`] draws a direction.
    pub fn square_of(&self, direction: Vec3) -> Vec2 {
        match &self.falloff {
            Some(f) => f.square_of(direction),
            None => warp::square_of_sphere(direction),
        }
    }

    pub fn power(&self) -> DVec3 {
        let angles = self.falloff.as_ref().map_or(Vec3::splat(4.0 * PI), Falloff::integral);
        (self.intensity * angles).as_dvec3()
    }

    pub fn bounds(&self) -> LightBounds {
        let (cone, peak) = match &self.falloff {
            None => (Cone::EVERYWHERE, 1.0),
            Some(f) => (Cone::solid(f.axis(), f.cutoff()), f.peak()),
        };
        let intensity = (luminance(self.intensity) * peak) as f64;
        LightBounds { min: self.position, max: self.position, cone, intensity }
    }
}
