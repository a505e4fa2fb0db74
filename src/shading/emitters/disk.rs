//! Disks and ellipses that emit from one side.

use super::bounds::{Cone, LightBounds};
use super::falloff::Falloff;
use super::plane::{Plane, flat_integral, leave, leave_pdf, leave_square};
use super::sample::{FromSample, SurfacePoint};
use super::spherical_rect::SphericalRect;
use crate::math::density::{AreaPdf, EtenduePdf, SolidAnglePdf};
use crate::math::{luminance, warp};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// An ellipse that emits from one side.
#[derive(Clone, Debug)]
pub(super) struct Disk {
    plane: Plane,
    area: f64,
    /// Lengths of the semi-axes.
    axes: DVec2,
    radiance: Vec3,
    falloff: Option<Falloff>,
}

/// How points are chosen for one receiver. The windows are in scene units around the receiver's foot
/// point; points of a window outside the ellipse are no sample.
enum Strategy {
    /// By area over the ellipse.
    Area,
    /// By area over a rectangle.
    Window { low: DVec2, high: DVec2 },
    /// Uniformly in the solid angle of a rectangle.
    Spherical(SphericalRect),
}

/// Solid angle of the rectangle around the ellipse from which on it pays to choose by solid angle,
/// although a fifth of its samples miss the ellipse.
const NEAR: f64 = 0.7;

impl Disk {
    pub fn new([center, a, b, normal]: [Vec3; 4], radiance: Vec3, falloff: Option<Falloff>) -> Self {
        let plane = Plane::new(center, a, b, normal);
        let axes = DVec2::new(a.as_dvec3().length(), b.as_dvec3().length());
        Self { area: PI * plane.cell_area(), plane, axes, radiance, falloff }
    }

    fn strategy(&self, x: Vec3) -> Option<Strategy> {
        let height = self.plane.height(x);
        if height.is_nan() || height <= 0.0 {
            return None;
        }
        let foot = self.plane.coordinates(x) * self.axes;
        let (mut low, mut high) = (-self.axes - foot, self.axes - foot);
        let whole = (high - low).element_product();
        if let Some(f) = &self.falloff
            && f.cutoff() < 1.55
        {
            // nothing beyond the cutoff is seen from here
            let reach = DVec2::splat(height * f.cutoff().tan());
            low = low.max(-reach);
            high = high.min(reach);
            if !low.cmplt(high).all() {
                return None;
            }
        }
        let spherical = SphericalRect::new(low, high, height);
        let window = (high - low).element_product();
        Some(match () {
            _ if spherical.solid_angle() > NEAR => Strategy::Spherical(spherical),
            _ if window < 0.7 * whole => Strategy::Window { low, high },
            _ => Strategy::Area,
        })
    }

    pub fn towards(&self, x: Vec3, u: Vec2) -> Option<(SurfacePoint, Vec3)> {
        let foot = || self.plane.coordinates(x);
        let by_area = |at: DVec2, pdf: f64| {
            SurfacePoint::by_area(x, self.plane.point(at), self.plane.normal, AreaPdf(pdf as f32))
        };
        let sample = match self.strategy(x)? {
            Strategy::Area => by_area(warp::concentric_disk(u).as_dvec2(), 1.0 / self.area)?,
            Strategy::Window { low, high } => {
                let at = foot() + (low + (high - low) * u.as_dvec2()) / self.axes;
                inside(at).then(|| by_area(at, 1.0 / (high - low).element_product()))??
            }
            Strategy::Spherical(s) => {
                let at = foot() + s.sample(u) / self.axes;
                let point = inside(at).then(|| by_area(at, 1.0))??;
                SurfacePoint { pdf: SolidAnglePdf(1.0 / s.solid_angle() as f32), ..point }
            }
        };
        Some((sample, self.emitted(-sample.direction)))
    }

    pub fn pdf_towards(&self, x: Vec3, point: Vec3, direction: Vec3, distance: f32) -> SolidAnglePdf {
        let cos = -self.plane.normal.dot(direction);
        let by_area = |pdf: f64| AreaPdf(pdf as f32).to_solid_angle(distance, cos);
        match self.strategy(x) {
            None => SolidAnglePdf(0.0),
            Some(Strategy::Area) => by_area(1.0 / self.area),
            Some(Strategy::Window { low, high }) => {
                let at = (self.plane.coordinates(point) - self.plane.coordinates(x)) * self.axes;
                let seen = at.cmpge(low).all() && at.cmple(high).all();
                by_area(if seen { 1.0 / (high - low).element_product() } else { 0.0 })
            }
            Some(Strategy::Spherical(s)) => SolidAnglePdf(1.0 / s.solid_angle() as f32),
        }
    }

    pub fn emitted(&self, direction: Vec3) -> Vec3 {
        self.radiance * self.falloff.as_ref().map_or(Vec3::ONE, |f| f.factor(direction))
    }

    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        let (t, at) = self.plane.hit(origin, direction)?;
        inside(at).then_some((t as f32, self.plane.normal))
    }

    pub fn from(&self, u: Vec2, v: Vec2) -> Option<FromSample> {
        let point = self.plane.point(warp::concentric_disk(u).as_dvec2());
        let area = AreaPdf(1.0 / self.area as f32);
        leave(point, self.plane.normal, self.radiance, self.falloff.as_ref(), area, v)
    }

    pub fn pdf_from(&self, direction: Vec3) -> EtenduePdf {
        let area = AreaPdf(1.0 / self.area as f32);
        area.with_direction(leave_pdf(self.plane.normal, self.falloff.as_ref(), direction))
    }

    /// The numbers from which [`Disk::from`] draws a ray.
    pub fn square_of(&self, point: Vec3, direction: Vec3) -> [Vec2; 2] {
        let place = warp::square_of_disk(self.plane.coordinates(point).as_vec2());
        [place, leave_square(self.plane.normal, self.falloff.as_ref(), direction)]
    }

    pub fn power(&self) -> DVec3 {
        (self.radiance * flat_integral(self.falloff.as_ref())).as_dvec3() * self.area
    }

    pub fn bounds(&self) -> LightBounds {
        let (min, max) = self.plane.extent(1.0, true);
        let (cutoff, peak) = self.falloff.as_ref().map_or((10.0, 1.0), |f| (f.cutoff(), f.peak()));
        let intensity = (luminance(self.radiance) * peak) as f64 * self.area;
        LightBounds { min, max, cone: Cone::flat(self.plane.normal, cutoff, false), intensity }
    }
}

fn inside(at: DVec2) -> bool {
    at.length_squared() <= 1.0
}
