//! Cylinders without caps that emit outwards.

use super::bounds::{Cone, LightBounds};
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

/// A receiver outside, in the plane across the axis.
struct View {
    /// Unit vector from the axis to the receiver.
    side: DVec3,
    /// Distance from the axis.
    height: f64,
    /// Position along the axis.
    along: f64,
    /// Half the angle under which the circle is seen.
    half_angle: f64,
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
            height,
            along,
            half_angle: self.radius.atan2(self.tangent(height)),
        })
    }

    /// Length of the tangent to the circle from a distance, exact next to the circle.
    fn tangent(&self, height: f64) -> f64 {
        ((height - self.radius) * (height + self.radius)).sqrt()
    }

    /// Sines of the elevations of the ends of the line at distance `d`.
    fn ends(&self, v: &View, d: f64) -> (f64, f64) {
        let sine = |z: f64| z / z.hypot(d);
        (sine(-self.half_length - v.along), sine(self.half_length - v.along))
    }

    /// Density per solid angle: angles across the axis are uniform, and so is the sine of the elevation
    /// along the line that is met.
    fn density(&self, v: &View, d: f64) -> SolidAnglePdf {
        let (a, b) = self.ends(v, d);
        SolidAnglePdf((0.5 / (v.half_angle * (b - a))) as f32)
    }

    pub fn towards(&self, x: Vec3, u: Vec2) -> Option<(SurfacePoint, Vec3)> {
        let v = self.view(x)?;
        let (sin, cos) = ((2.0 * u.x as f64 - 1.0) * v.half_angle).sin_cos();
        // nearer root of the quadratic, by the product of the two
        let across = (self.radius * self.radius - (v.height * sin).powi(2)).max(0.0).sqrt();
        let d = self.tangent(v.height).powi(2) / (v.height * cos + across);
        let (a, b) = self.ends(&v, d);
        let sin_z = a + (b - a) * u.y as f64;
        let cos_z = (1.0 - sin_z * sin_z).max(0.0).sqrt();
        let in_plane = self.axis.cross(v.side) * sin - v.side * cos;
        let direction = (in_plane * cos_z + self.axis * sin_z).as_vec3();
        let z = (v.along + d * sin_z / cos_z).clamp(-self.half_length, self.half_length);
        let normal = (v.side * v.height + in_plane * d) / self.radius;
        let sample = SurfacePoint {
            direction,
            distance: d.hypot(z - v.along) as f32,
            point: (self.center + self.axis * z + normal * self.radius).as_vec3(),
            normal: normal.as_vec3(),
            pdf: self.density(&v, d),
        };
        (sample.distance > 0.0).then(|| (sample, self.emitted(-direction)))
    }

    pub fn pdf_towards(&self, x: Vec3, normal: Vec3) -> SolidAnglePdf {
        let Some(v) = self.view(x) else { return SolidAnglePdf(0.0) };
        let d = (v.side * v.height - normal.as_dvec3() * self.radius).length();
        self.density(&v, d)
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
            let direction = self.frame(normal).to_world(warp::cosine_hemisphere(v));
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

    /// Around a normal. By the axis, so that normals that differ by rounding have frames that do.
    fn frame(&self, normal: DVec3) -> Frame {
        let [s, n] = [self.axis, normal].map(|v| v.as_vec3());
        Frame { s, t: n.cross(s), n }
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

    /// The numbers from which [`Cylinder::from`] draws a ray.
    pub fn square_of(&self, point: Vec3, normal: Vec3, direction: Vec3) -> [Vec2; 2] {
        let (n, d) = (normal.as_dvec3(), direction.as_dvec3());
        let along = (point.as_dvec3() - self.center).dot(self.axis) / self.half_length;
        let half = |t: f64| ((t + 1.0) / 2.0) as f32;
        match &self.falloff {
            None => {
                let (s, t) = self.axis.any_orthonormal_pair();
                let turn = warp::turn_of(n.dot(s) as f32, n.dot(t) as f32);
                let local = self.frame(n).to_local(direction);
                [warp::in_unit_square(Vec2::new(turn, half(along))), warp::square_of_disk(local.truncate())]
            }
            Some(f) => {
                let front = (d - self.axis * d.dot(self.axis)).normalize_or_zero();
                let sin = self.axis.cross(front).dot(n);
                [warp::in_unit_square(Vec2::new(half(sin), half(along))), f.square_of(direction)]
            }
        }
    }

    pub fn power(&self) -> DVec3 {
        let facing = 4.0 * self.radius * self.half_length;
        match &self.falloff {
            None => self.radiance.as_dvec3() * (TAU / 2.0 * self.area()),
            Some(f) => (self.radiance * f.integral_over_cylinder(self.axis.as_vec3())).as_dvec3() * facing,
        }
    }

    pub fn bounds(&self) -> LightBounds {
        // the box around two circles: r sqrt(1 - a_i^2) around each end
        let ends = (self.axis * self.half_length).abs();
        let round = (DVec3::ONE - self.axis * self.axis).max(DVec3::ZERO).powf(0.5) * self.radius;
        let half = ends + round;
        let (min, max) = ((self.center - half).as_vec3(), (self.center + half).as_vec3());
        let (cone, peak) = match &self.falloff {
            None => (Cone::EVERYWHERE, 1.0),
            Some(f) => (Cone::solid(f.axis(), f.cutoff()), f.peak()),
        };
        let facing = 4.0 * self.radius * self.half_length;
        LightBounds { min, max, cone, intensity: (luminance(self.radiance) * peak) as f64 * facing }
    }
}
