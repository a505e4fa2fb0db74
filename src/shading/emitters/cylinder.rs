//! Cylinders without caps that emit outwards.

use super::bounds::LightBounds;
use super::falloff::Falloff;
use super::sample::{Emission, FromSample, SurfacePoint};
use crate::math::density::{AreaPdf, EtenduePdf, ProjectedPdf, SolidAnglePdf};
use crate::math::{Frame, luminance, warp};
use glam::{DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_1_PI, TAU};

/// The side of a cylinder, emitting outwards.
#[derive(Clone, Debug)]
pub(super) struct Cylinder {
    center: DVec3,
    axis: DVec3,
    half_length: f64,
    radius: f64,
    radiance: Vec3,
    falloff: Option<Falloff>,
}

/// What a receiver outside sees: generator lines within `arc` of the unit vector `side`.
struct View {
    side: DVec3,
    arc: f64,
    /// Distance from the axis, and position along it.
    height: f64,
    along: f64,
}

impl Cylinder {
    pub fn new(center: Vec3, axis: Vec3, radius: f32, radiance: Vec3, falloff: Option<Falloff>) -> Self {
        let axis = axis.as_dvec3();
        Self {
            center: center.as_dvec3(),
            axis: axis.normalize(),
            half_length: axis.length() / 2.0,
            radius: radius as f64,
            radiance,
            falloff,
        }
    }

    fn area(&self) -> f64 {
        TAU * self.radius * 2.0 * self.half_length
    }

    fn view(&self, x: Vec3) -> Option<View> {
        let d = x.as_dvec3() - self.center;
        let along = d.dot(self.axis);
        let across = d - self.axis * along;
        let height = across.length();
        // all that is seen from within the radius is the back; false for NaN
        (height > self.radius).then(|| View {
            side: across / height,
            // acos(r / h), exact for receivers next to the surface
            arc: ((height - self.radius) * (height + self.radius)).sqrt().atan2(self.radius),
            height,
            along,
        })
    }

    /// Density per area of the point at `z` along the generator line at distance `d` from a receiver:
    /// lines uniform in angle, then equiangular along the line (Kulla and Fajardo 2012).
    fn area_pdf(&self, v: &View, d: f64, z: f64) -> f64 {
        let (a, b) = self.line_angles(v, d);
        let z = z - v.along;
        d / ((b - a) * (d * d + z * z)) / (2.0 * v.arc * self.radius)
    }

    /// Angles under which a receiver sees the ends of a line at distance `d`.
    fn line_angles(&self, v: &View, d: f64) -> (f64, f64) {
        ((-self.half_length - v.along).atan2(d), (self.half_length - v.along).atan2(d))
    }

    pub fn towards(&self, x: Vec3, u: Vec2) -> Option<(SurfacePoint, Vec3)> {
        let v = self.view(x)?;
        let phi = (2.0 * u.x as f64 - 1.0) * v.arc;
        let normal = v.side * phi.cos() + self.axis.cross(v.side) * phi.sin();
        let d = (v.side * v.height - normal * self.radius).length();
        let (a, b) = self.line_angles(&v, d);
        let z = v.along + d * (a + (b - a) * u.y as f64).tan();
        let z = z.clamp(-self.half_length, self.half_length);
        let point = self.center + self.axis * z + normal * self.radius;
        let pdf = self.area_pdf(&v, d, z);
        // distances in double precision: the receiver may be next to the surface
        let to = point - x.as_dvec3();
        let distance = to.length();
        let direction = to / distance;
        let cos = -normal.dot(direction);
        let pdf = SolidAnglePdf((pdf * distance * distance / cos) as f32);
        let sample = SurfacePoint {
            direction: direction.as_vec3(),
            distance: distance as f32,
            point: point.as_vec3(),
            normal: normal.as_vec3(),
            pdf,
        };
        let sound = cos > 0.0 && distance > 0.0 && pdf.0.is_finite();
        sound.then(|| (sample, self.emitted(-sample.direction)))
    }

    pub fn pdf_towards(
        &self,
        x: Vec3,
        point: Vec3,
        normal: Vec3,
        direction: Vec3,
        distance: f32,
    ) -> SolidAnglePdf {
        let Some(v) = self.view(x) else { return SolidAnglePdf(0.0) };
        let z = (point.as_dvec3() - self.center).dot(self.axis);
        let d = (v.side * v.height - normal.as_dvec3() * self.radius).length();
        AreaPdf(self.area_pdf(&v, d, z) as f32).to_solid_angle(distance, normal.dot(direction))
    }

    pub fn emitted(&self, direction: Vec3) -> Vec3 {
        self.radiance * self.falloff.as_ref().map_or(Vec3::ONE, |f| f.factor(direction))
    }

    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        let (o, d) = (origin.as_dvec3() - self.center, direction.as_dvec3());
        let (oz, dz) = (o.dot(self.axis), d.dot(self.axis));
        let (o, d) = (o - self.axis * oz, d - self.axis * dz);
        let speed2 = d.length_squared();
        let closest = -o.dot(d) / speed2;
        let rest = (self.radius * self.radius - (o + d * closest).length_squared()) / speed2;
        let t = closest - rest.sqrt();
        // NaN where the ray misses; a start inside has t below zero
        let met = t > 0.0 && (oz + dz * t).abs() <= self.half_length;
        met.then(|| (t as f32, ((o + d * t) / self.radius).as_vec3()))
    }

    pub fn from(&self, u: Vec2, v: Vec2) -> Option<FromSample> {
        let phi = TAU * u.x as f64;
        let z = self.half_length * (2.0 * u.y as f64 - 1.0);
        let (s, t) = self.axis.any_orthonormal_pair();
        let leave = |normal: DVec3, direction: Vec3, radiance: Vec3, pdf: EtenduePdf| FromSample {
            origin: (self.center + self.axis * z + normal * self.radius).as_vec3(),
            normal: normal.as_vec3(),
            direction,
            emission: Emission::Extended { radiance, pdf },
            barycentrics: None,
        };
        let Some(falloff) = &self.falloff else {
            let normal = s * phi.cos() + t * phi.sin();
            let direction = Frame::from_normal(normal.as_vec3()).to_world(warp::cosine_hemisphere(v));
            let area = AreaPdf((1.0 / self.area()) as f32);
            let pdf = area.with_direction(ProjectedPdf(warp::COSINE_HEMISPHERE_PDF));
            return Some(leave(normal, direction, self.radiance, pdf));
        };
        // with a cone, the direction first, then a point of the rectangle that faces it
        let (direction, pdf) = falloff.sample(v);
        let radiance = self.emitted(direction);
        let d = direction.as_dvec3();
        let front = (d - self.axis * d.dot(self.axis)).try_normalize()?;
        let sin = 2.0 * u.x as f64 - 1.0;
        let normal = front * (1.0 - sin * sin).max(0.0).sqrt() + self.axis.cross(front) * sin;
        let pdf = self.across_pdf(direction, pdf)?;
        (radiance != Vec3::ZERO).then(|| leave(normal, direction, radiance, pdf))
    }

    /// Density per étendue of a direction of density `pdf` per solid angle and a uniform point of the
    /// rectangle the cylinder shows it. `None` along the axis, where it shows none.
    fn across_pdf(&self, direction: Vec3, pdf: f32) -> Option<EtenduePdf> {
        let across = 4.0 * self.radius * self.half_length * direction.as_dvec3().cross(self.axis).length();
        let pdf = (pdf as f64 / across) as f32;
        pdf.is_finite().then_some(EtenduePdf(pdf))
    }

    pub fn pdf_from(&self, normal: Vec3, direction: Vec3) -> EtenduePdf {
        match &self.falloff {
            _ if normal.dot(direction) <= 0.0 => EtenduePdf(0.0),
            Some(f) => self.across_pdf(direction, f.pdf(direction)).unwrap_or(EtenduePdf(0.0)),
            None => EtenduePdf((FRAC_1_PI / self.area()) as f32),
        }
    }

    pub fn power(&self) -> Vec3 {
        match &self.falloff {
            None => self.radiance * (TAU / 2.0 * self.area()) as f32,
            Some(f) => {
                self.radiance
                    * f.integral_over_cylinder(self.axis.as_vec3())
                    * (4.0 * self.radius * self.half_length) as f32
            }
        }
    }

    pub fn bounds(&self) -> LightBounds {
        // the box around two circles: r sqrt(1 - a_i^2) around each end
        let ends = (self.axis * self.half_length).abs();
        let round = (DVec3::ONE - self.axis * self.axis).max(DVec3::ZERO).powf(0.5) * self.radius;
        let half = ends + round;
        let (min, max) = ((self.center - half).as_vec3(), (self.center + half).as_vec3());
        let intensity = luminance(self.radiance) * (4.0 * self.radius * self.half_length) as f32;
        match &self.falloff {
            None => LightBounds::everywhere(min, max, intensity),
            Some(f) => LightBounds::cone(min, max, f.axis(), f.cutoff(), false, intensity * f.peak()),
        }
    }
}
