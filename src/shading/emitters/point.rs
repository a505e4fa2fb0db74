//! Points that emit to all sides, or into a cone.

use super::bounds::LightBounds;
use super::falloff::Falloff;
use super::sample::{Emission, FromSample, Incident, TowardsSample};
use crate::math::density::SolidAnglePdf;
use crate::math::{luminance, warp};
use glam::{Vec2, Vec3};
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

    pub fn from(&self, u: Vec2) -> Option<FromSample> {
        let (direction, pdf) = match &self.falloff {
            Some(f) => f.sample(u),
            None => (warp::uniform_sphere(u), 0.25 / PI),
        };
        let intensity = self.intensity(direction);
        (intensity != Vec3::ZERO).then(|| FromSample {
            origin: self.position,
            normal: direction,
            direction,
            emission: Emission::Point { intensity, pdf: SolidAnglePdf(pdf) },
            barycentrics: None,
        })
    }

    pub fn power(&self) -> Vec3 {
        self.intensity * self.falloff.as_ref().map_or(Vec3::splat(4.0 * PI), Falloff::integral)
    }

    pub fn bounds(&self) -> LightBounds {
        let (p, intensity) = (self.position, luminance(self.intensity));
        match &self.falloff {
            None => LightBounds::everywhere(p, p, intensity),
            Some(f) => LightBounds::cone(p, p, f.axis(), f.cutoff(), false, intensity * f.peak()),
        }
    }
}
