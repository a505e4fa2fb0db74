//! Distant lights: a single direction, or a uniform cone of them.

use super::SceneBounds;
use super::falloff::one_minus_cos;
use super::sample::{Emission, FromSample, Incident, Receiver, TowardsSample};
use crate::math::density::{AreaPdf, EtenduePdf, SolidAnglePdf};
use crate::math::{Frame, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Light from a cone of directions, the same everywhere.
#[derive(Clone, Debug)]
pub(super) struct Distant {
    /// Around the direction towards the light.
    frame: Frame,
    /// `1 - cos` of the half angle; 0 for a single direction.
    one_minus_cos: f32,
    /// Irradiance of a facing surface.
    irradiance: Vec3,
    radiance: Vec3,
}

impl Distant {
    pub fn new(direction: Vec3, half_angle: f64, irradiance: Vec3) -> Self {
        // irradiance of a uniform cone: pi L sin^2; that of the hemisphere beyond a right angle
        let projected = PI * half_angle.min(FRAC_PI_2).sin().powi(2);
        Self {
            frame: Frame::from_normal(-direction),
            one_minus_cos: one_minus_cos(half_angle) as f32,
            irradiance,
            radiance: if half_angle > 0.0 {
                (irradiance.as_dvec3() / projected).as_vec3()
            } else {
                Vec3::ZERO
            },
        }
    }

    fn solid_angle_pdf(&self) -> f32 {
        1.0 / warp::cone_solid_angle(self.one_minus_cos)
    }

    pub fn towards(&self, receiver: &Receiver, u: Vec2) -> TowardsSample {
        let (direction, incident) = match self.one_minus_cos > 0.0 {
            true => (
                self.frame.to_world(warp::uniform_cone(u, self.one_minus_cos)),
                Incident::Radiance { radiance: self.radiance, pdf: SolidAnglePdf(self.solid_angle_pdf()) },
            ),
            false => (self.frame.n, Incident::Delta { irradiance: self.irradiance }),
        };
        TowardsSample {
            direction,
            distance: f32::INFINITY,
            point: receiver.position,
            normal: -direction,
            incident,
            barycentrics: None,
        }
    }

    /// Whether all its light comes from one direction.
    pub fn is_delta(&self) -> bool {
        self.one_minus_cos <= 0.0
    }

    /// Radiance from the unit vector `direction`; `None` outside the cone.
    pub fn seen(&self, direction: Vec3) -> Option<Vec3> {
        // |a - b|^2 = 2 (1 - cos) for unit vectors, exact where the cosine is not
        let inside = (direction - self.frame.n).length_squared() < 2.0 * self.one_minus_cos;
        inside.then_some(self.radiance)
    }

    pub fn pdf_towards(&self, direction: Vec3) -> SolidAnglePdf {
        SolidAnglePdf(self.seen(direction).map_or(0.0, |_| self.solid_angle_pdf()))
    }

    pub fn from(&self, bounds: &SceneBounds, u: Vec2, v: Vec2) -> FromSample {
        let area = AreaPdf(1.0 / bounds.disk_area());
        let direction = match self.one_minus_cos > 0.0 {
            true => -self.frame.to_world(warp::uniform_cone(v, self.one_minus_cos)),
            false => -self.frame.n,
        };
        let emission = match self.one_minus_cos > 0.0 {
            true => Emission::Extended {
                radiance: self.radiance,
                pdf: EtenduePdf(self.solid_angle_pdf() * area.0),
            },
            false => Emission::Beam { irradiance: self.irradiance, pdf: area },
        };
        bounds.enter(direction, u, emission)
    }

    pub fn pdf_from(&self, bounds: &SceneBounds, direction: Vec3) -> EtenduePdf {
        EtenduePdf(self.pdf_towards(-direction).0 / bounds.disk_area())
    }

    /// The numbers from which [`Distant::from`] draws the direction.
    pub fn square_of(&self, direction: Vec3) -> Vec2 {
        warp::square_of_cone(self.frame.to_local(-direction), self.one_minus_cos)
    }

    /// Irradiance of a facing surface.
    pub fn irradiance(&self) -> Vec3 {
        self.irradiance
    }

    /// Unit direction towards the light and sine of the half angle; `None` where it is more than half of
    /// all directions.
    pub fn cone(&self) -> Option<(Vec3, f32)> {
        let h = self.one_minus_cos;
        (h < 1.0).then(|| (self.frame.n, (h * (2.0 - h)).sqrt()))
    }

    /// Radiance integrated over all directions.
    pub fn fluence(&self) -> DVec3 {
        let fluence = match self.one_minus_cos > 0.0 {
            true => self.radiance * warp::cone_solid_angle(self.one_minus_cos),
            false => self.irradiance,
        };
        fluence.as_dvec3()
    }
}
