//! Domes: light from all around, constant or from a lat-long image.

use super::SceneBounds;
use super::map_sampler::MapSampler;
use super::sample::{Emission, FromSample, Incident, Receiver, TowardsSample};
use crate::math::density::{EtenduePdf, SolidAnglePdf};
use crate::math::{Frame, warp};
use glam::{DVec3, Mat3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// Light from infinity, all around.
#[derive(Clone, Debug)]
pub(super) struct Dome {
    to_world: Mat3,
    to_local: Mat3,
    radiance: Vec3,
    map: Option<MapSampler>,
}

impl Dome {
    pub fn new(to_world: Mat3, radiance: Vec3, map: Option<MapSampler>) -> Self {
        Self { to_world, to_local: to_world.transpose(), radiance, map }
    }

    /// A direction towards the dome, its radiance, and its density per solid angle.
    fn sample(&self, normal: Option<Vec3>, u: Vec2) -> Option<(Vec3, Vec3, f32)> {
        Some(match (&self.map, normal) {
            (Some(map), _) => {
                let (at, pdf) = map.sample(u)?;
                (self.to_world * direction_of(at), self.radiance * map.lookup(at), pdf)
            }
            (None, Some(n)) => {
                let local = warp::cosine_hemisphere(u);
                (Frame::from_normal(n).to_world(local), self.radiance, local.z * FRAC_1_PI)
            }
            (None, None) => (warp::uniform_sphere(u), self.radiance, 0.25 * FRAC_1_PI),
        })
    }

    fn pdf(&self, normal: Option<Vec3>, direction: Vec3) -> f32 {
        match (&self.map, normal) {
            (Some(map), _) => map.pdf(image_of(self.to_local * direction)),
            (None, Some(n)) => n.dot(direction).max(0.0) * FRAC_1_PI,
            (None, None) => 0.25 * FRAC_1_PI,
        }
    }

    pub fn towards(&self, receiver: &Receiver, u: Vec2) -> Option<TowardsSample> {
        let (direction, radiance, pdf) = self.sample(receiver.normal, u)?;
        (pdf > 0.0).then(|| TowardsSample {
            direction,
            distance: f32::INFINITY,
            point: receiver.position,
            normal: -direction,
            incident: Incident::Radiance { radiance, pdf: SolidAnglePdf(pdf) },
            barycentrics: None,
        })
    }

    /// Radiance from the unit vector `direction`.
    pub fn seen(&self, direction: Vec3) -> Vec3 {
        let image = self.map.as_ref().map_or(Vec3::ONE, |m| m.lookup(image_of(self.to_local * direction)));
        self.radiance * image
    }

    pub fn pdf_towards(&self, receiver: &Receiver, direction: Vec3) -> SolidAnglePdf {
        SolidAnglePdf(self.pdf(receiver.normal, direction))
    }

    pub fn from(&self, bounds: &SceneBounds, u: Vec2, v: Vec2) -> Option<FromSample> {
        let (towards, radiance, pdf) = self.sample(None, v)?;
        let emission = Emission::Extended { radiance, pdf: EtenduePdf(pdf / bounds.disk_area()) };
        (pdf > 0.0).then(|| bounds.enter(-towards, u, emission))
    }

    pub fn pdf_from(&self, bounds: &SceneBounds, direction: Vec3) -> EtenduePdf {
        EtenduePdf(self.pdf(None, -direction) / bounds.disk_area())
    }

    /// The numbers from which [`Dome::from`] draws the direction.
    pub fn square_of(&self, direction: Vec3) -> Vec2 {
        match &self.map {
            Some(map) => map.square_of(image_of(self.to_local * -direction)),
            None => warp::square_of_sphere(-direction),
        }
    }

    /// Radiance integrated over all directions.
    pub fn fluence(&self) -> DVec3 {
        let mean = self.radiance * self.map.as_ref().map_or(Vec3::ONE, MapSampler::mean);
        mean.as_dvec3() * (4.0 * PI as f64)
    }
}

/// Unit direction of a point of a lat-long image: +y at the top row, +z in the centre column, +x a
/// quarter to its left (OpenEXR).
pub(super) fn direction_of(at: Vec2) -> Vec3 {
    let (sin, cos) = (at.y * PI).sin_cos();
    let (x, z) = ((0.5 - at.x) * TAU).sin_cos();
    Vec3::new(sin * x, cos, sin * z)
}

/// Point of a lat-long image in `[0,1] x [0,1]`, y downwards, of a direction.
pub(super) fn image_of(d: Vec3) -> Vec2 {
    let u = 0.5 - d.x.atan2(d.z) / TAU;
    let v = d.x.hypot(d.z).atan2(d.y) / PI;
    Vec2::new(u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
}
