//! Spheres that emit outwards.

use super::bounds::{Cone, LightBounds};
use super::falloff::Falloff;
use super::sample::{Emission, FromSample, SurfacePoint};
use crate::math::density::{AreaPdf, EtenduePdf, ProjectedPdf, SolidAnglePdf};
use crate::math::{Frame, luminance, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f32::consts::PI;
use std::f64::consts::TAU;

/// A sphere that emits outwards.
#[derive(Clone, Debug)]
pub(super) struct Sphere {
    center: DVec3,
    radius: f64,
    radiance: Vec3,
    falloff: Option<Falloff>,
}

/// The sphere as seen from a receiver outside of it.
struct View {
    to_center: DVec3,
    distance: f64,
    sin2: f64,
    one_minus_cos: f64,
}

impl Sphere {
    pub fn new(center: Vec3, radius: f32, radiance: Vec3, falloff: Option<Falloff>) -> Self {
        Self { center: center.as_dvec3(), radius: radius as f64, radiance, falloff }
    }

    fn view(&self, x: Vec3) -> Option<View> {
        let to_center = self.center - x.as_dvec3();
        let distance = to_center.length();
        // inside there is no light
        if distance.is_nan() || distance <= self.radius {
            return None;
        }
        let sin2 = (self.radius / distance).powi(2);
        // (d - r)(d + r) keeps the cosine exact next to the surface, sin^2/(1 + cos) its rest far away
        let cos = ((distance - self.radius) * (distance + self.radius)).sqrt() / distance;
        Some(View { to_center, distance, sin2, one_minus_cos: sin2 / (1.0 + cos) })
    }

    pub fn towards(&self, x: Vec3, u: Vec2) -> Option<(SurfacePoint, Vec3)> {
        let c = self.view(x)?;
        let h = u.x as f64 * c.one_minus_cos;
        let (sin2, cos) = (h * (2.0 - h), 1.0 - h);
        // angle at the centre between the line to the receiver and the sampled point (pbrt-v4, 6.2.4)
        let cos_a = sin2 / c.sin2.sqrt() + cos * (1.0 - sin2 / c.sin2).max(0.0).sqrt();
        let sin_a = (1.0 - cos_a * cos_a).max(0.0).sqrt();
        let axis = c.to_center / c.distance;
        let (s, t) = axis.any_orthonormal_pair();
        let (sin_phi, cos_phi) = (TAU * u.y as f64).sin_cos();
        let side = s * cos_phi + t * sin_phi;
        let direction = (axis * cos + side * sin2.max(0.0).sqrt()).as_vec3();
        let normal = side * sin_a - axis * cos_a;
        let across = (self.radius * self.radius - c.distance * c.distance * sin2).max(0.0).sqrt();
        let sample = SurfacePoint {
            direction,
            distance: (c.distance * cos - across).max(c.distance - self.radius) as f32,
            point: (self.center + normal * self.radius).as_vec3(),
            normal: normal.as_vec3(),
            pdf: SolidAnglePdf((1.0 / (TAU * c.one_minus_cos)) as f32),
        };
        (sample.distance > 0.0).then(|| (sample, self.emitted(-direction)))
    }

    pub fn pdf_towards(&self, x: Vec3) -> SolidAnglePdf {
        SolidAnglePdf(self.view(x).map_or(0.0, |c| (1.0 / (TAU * c.one_minus_cos)) as f32))
    }

    pub fn emitted(&self, direction: Vec3) -> Vec3 {
        self.radiance * self.falloff.as_ref().map_or(Vec3::ONE, |f| f.factor(direction))
    }

    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        let d = direction.as_dvec3().normalize();
        let o = origin.as_dvec3() - self.center;
        let closest = -o.dot(d);
        let rest = self.radius * self.radius - (o + d * closest).length_squared();
        let t = closest - rest.sqrt();
        // NaN where the ray misses; a start inside has t below zero
        (t > 0.0).then(|| (t as f32, ((o + d * t) / self.radius).as_vec3()))
    }

    pub fn from(&self, u: Vec2, v: Vec2) -> Option<FromSample> {
        let area = AreaPdf((1.0 / (2.0 * TAU * self.radius * self.radius)) as f32);
        let Some(falloff) = &self.falloff else {
            let normal = warp::uniform_sphere(u);
            let direction = Frame::from_normal(normal).to_world(warp::cosine_hemisphere(v));
            let pdf = area.with_direction(ProjectedPdf(warp::COSINE_HEMISPHERE_PDF));
            let emission = Emission::Extended { radiance: self.radiance, pdf };
            return Some(self.leave(normal, direction, emission));
        };
        // with a cone, the direction first, then a point of the disk that faces it
        let (direction, pdf) = falloff.sample(v);
        let radiance = self.emitted(direction);
        let d = warp::concentric_disk(u);
        let local = d.extend((1.0 - d.length_squared()).max(0.0).sqrt());
        let normal = Frame::from_normal(direction).to_world(local);
        let pdf = self.across_pdf(pdf);
        (radiance != Vec3::ZERO).then(|| self.leave(normal, direction, Emission::Extended { radiance, pdf }))
    }

    fn leave(&self, normal: Vec3, direction: Vec3, emission: Emission) -> FromSample {
        let origin = (self.center + normal.as_dvec3() * self.radius).as_vec3();
        FromSample { origin, normal, direction, emission, barycentrics: None }
    }

    /// Density per étendue of a direction of density `pdf` per solid angle and a uniform point of the
    /// disk that faces it.
    fn across_pdf(&self, pdf: f32) -> EtenduePdf {
        EtenduePdf((pdf as f64 * 2.0 / (TAU * self.radius * self.radius)) as f32)
    }

    pub fn pdf_from(&self, normal: Vec3, direction: Vec3) -> EtenduePdf {
        match &self.falloff {
            _ if normal.dot(direction) <= 0.0 => EtenduePdf(0.0),
            Some(f) => self.across_pdf(f.pdf(direction)),
            None => self.across_pdf(0.25 / PI),
        }
    }

    /// The numbers from which [`Sphere::from`] draws a ray.
    pub fn square_of(&self, normal: Vec3, direction: Vec3) -> [Vec2; 2] {
        let across = |n: Vec3, v: Vec3| warp::square_of_disk(Frame::from_normal(n).to_local(v).truncate());
        match &self.falloff {
            None => [warp::square_of_sphere(normal), across(normal, direction)],
            Some(f) => [across(direction, normal), f.square_of(direction)],
        }
    }

    pub fn power(&self) -> DVec3 {
        let angles = self.falloff.as_ref().map_or(Vec3::splat(4.0 * PI), Falloff::integral);
        (self.radiance * angles).as_dvec3() * (TAU / 2.0 * self.radius * self.radius)
    }

    pub fn bounds(&self) -> LightBounds {
        let half = DVec3::splat(self.radius);
        let (min, max) = ((self.center - half).as_vec3(), (self.center + half).as_vec3());
        let (cone, peak) = match &self.falloff {
            None => (Cone::EVERYWHERE, 1.0),
            Some(f) => (Cone::solid(f.axis(), f.cutoff()), f.peak()),
        };
        let facing = TAU / 2.0 * self.radius * self.radius;
        LightBounds { min, max, cone, intensity: (luminance(self.radiance) * peak) as f64 * facing }
    }
}
