//! Rectangles and parallelograms that emit from one side.

use super::bounds::{Cone, LightBounds};
use super::falloff::Falloff;
use super::map_sampler::MapSampler;
use super::plane::{Plane, flat_integral, leave, leave_pdf, leave_square};
use super::sample::{FromSample, SurfacePoint};
use super::spherical_rect::SphericalRect;
use crate::math::density::{AreaPdf, EtenduePdf, SolidAnglePdf};
use crate::math::{luminance, warp};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// A parallelogram that emits from one side.
#[derive(Clone, Debug)]
pub(super) struct Rect {
    plane: Plane,
    area: f64,
    /// Lengths of the edges, where they are at right angles.
    sides: Option<DVec2>,
    radiance: Vec3,
    map: Option<MapSampler>,
    falloff: Option<Falloff>,
}

/// Solid angle below which points are chosen by area: there the spherical construction has nothing left
/// to gain.
const SMALL: f64 = 1e-5;

/// How points are chosen for one receiver.
enum Strategy {
    /// By area within a window of the affine coordinates.
    Area { low: DVec2, high: DVec2 },
    /// Uniformly in solid angle.
    Spherical(SphericalRect),
    /// By the image.
    Image,
}

impl Rect {
    pub fn new(
        [center, edge_x, edge_y, normal]: [Vec3; 4],
        radiance: Vec3,
        map: Option<MapSampler>,
        falloff: Option<Falloff>,
    ) -> Self {
        let plane = Plane::new(center, edge_x, edge_y, normal);
        let sides = DVec2::new(edge_x.as_dvec3().length(), edge_y.as_dvec3().length());
        let right = edge_x.as_dvec3().dot(edge_y.as_dvec3()).abs() <= 1e-5 * sides.x * sides.y;
        Self { area: plane.cell_area(), plane, sides: right.then_some(sides), radiance, map, falloff }
    }

    fn strategy(&self, x: Vec3) -> Option<Strategy> {
        let height = self.plane.height(x);
        if height.is_nan() || height <= 0.0 {
            return None;
        }
        if self.map.is_some() {
            return Some(Strategy::Image);
        }
        let half = DVec2::splat(0.5);
        let Some(sides) = self.sides else {
            return Some(Strategy::Area { low: -half, high: half });
        };
        // in scene units around the receiver's foot point
        let foot = self.plane.coordinates(x) * sides;
        let (mut low, mut high) = (-sides * half - foot, sides * half - foot);
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
        Some(match spherical.solid_angle() > SMALL {
            true => Strategy::Spherical(spherical),
            false => Strategy::Area { low: (low + foot) / sides, high: (high + foot) / sides },
        })
    }

    pub fn towards(&self, x: Vec3, u: Vec2) -> Option<(SurfacePoint, Vec3)> {
        let sample = match self.strategy(x)? {
            Strategy::Area { low, high } => {
                let at = low + (high - low) * u.as_dvec2();
                let window = (high - low).element_product() * self.area;
                SurfacePoint::by_area(
                    x,
                    self.plane.point(at),
                    self.plane.normal,
                    AreaPdf(1.0 / window as f32),
                )?
            }
            Strategy::Spherical(s) => {
                let sides = self.sides?;
                let at = self.plane.coordinates(x) + s.sample(u) / sides;
                let pdf = AreaPdf(1.0);
                let by_area = SurfacePoint::by_area(x, self.plane.point(at), self.plane.normal, pdf)?;
                SurfacePoint { pdf: SolidAnglePdf(1.0 / s.solid_angle() as f32), ..by_area }
            }
            Strategy::Image => {
                let (at, pdf) = self.map.as_ref()?.sample(u)?;
                let pdf = AreaPdf(pdf / self.area as f32);
                SurfacePoint::by_area(x, self.plane.point(from_image(at)), self.plane.normal, pdf)?
            }
        };
        Some((sample, self.emitted(sample.point, -sample.direction)))
    }

    pub fn pdf_towards(&self, x: Vec3, point: Vec3, direction: Vec3, distance: f32) -> SolidAnglePdf {
        let cos = -self.plane.normal.dot(direction);
        match self.strategy(x) {
            None => SolidAnglePdf(0.0),
            Some(Strategy::Area { low, high }) => {
                let at = self.plane.coordinates(point);
                let inside = at.cmpge(low).all() && at.cmple(high).all();
                let window = (high - low).element_product() * self.area;
                let pdf = if inside { 1.0 / window } else { 0.0 };
                AreaPdf(pdf as f32).to_solid_angle(distance, cos)
            }
            Some(Strategy::Spherical(s)) => SolidAnglePdf(1.0 / s.solid_angle() as f32),
            Some(Strategy::Image) => self.area_pdf(point).to_solid_angle(distance, cos),
        }
    }

    /// Density of points when emitting.
    fn area_pdf(&self, point: Vec3) -> AreaPdf {
        let image = self.map.as_ref().map_or(1.0, |m| m.pdf(to_image(self.plane.coordinates(point))));
        AreaPdf(image / self.area as f32)
    }

    pub fn emitted(&self, point: Vec3, direction: Vec3) -> Vec3 {
        let image =
            self.map.as_ref().map_or(Vec3::ONE, |m| m.lookup(to_image(self.plane.coordinates(point))));
        self.radiance * image * self.falloff.as_ref().map_or(Vec3::ONE, |f| f.factor(direction))
    }

    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        let (t, at) = self.plane.hit(origin, direction)?;
        (at.abs().max_element() <= 0.5).then_some((t as f32, self.plane.normal))
    }

    pub fn from(&self, u: Vec2, v: Vec2) -> Option<FromSample> {
        let (at, pdf) = match &self.map {
            Some(map) => map.sample(u)?,
            None => (u, 1.0),
        };
        let point = self.plane.point(from_image(at));
        let image = self.map.as_ref().map_or(Vec3::ONE, |m| m.lookup(at));
        let area = AreaPdf(pdf / self.area as f32);
        leave(point, self.plane.normal, self.radiance * image, self.falloff.as_ref(), area, v)
    }

    pub fn pdf_from(&self, point: Vec3, direction: Vec3) -> EtenduePdf {
        self.area_pdf(point).with_direction(leave_pdf(self.plane.normal, self.falloff.as_ref(), direction))
    }

    /// The numbers from which [`Rect::from`] draws a ray.
    pub fn square_of(&self, point: Vec3, direction: Vec3) -> [Vec2; 2] {
        let at = warp::in_unit_square(to_image(self.plane.coordinates(point)));
        let place = self.map.as_ref().map_or(at, |m| m.square_of(at));
        [place, leave_square(self.plane.normal, self.falloff.as_ref(), direction)]
    }

    pub fn power(&self) -> DVec3 {
        let image = self.map.as_ref().map_or(Vec3::ONE, MapSampler::mean);
        (self.radiance * image * flat_integral(self.falloff.as_ref())).as_dvec3() * self.area
    }

    pub fn bounds(&self) -> LightBounds {
        let (min, max) = self.plane.extent(0.5, false);
        let image = self.map.as_ref().map_or(Vec3::ONE, MapSampler::mean);
        let (cutoff, peak) = self.falloff.as_ref().map_or((10.0, 1.0), |f| (f.cutoff(), f.peak()));
        let intensity = (luminance(self.radiance * image) * peak) as f64 * self.area;
        LightBounds { min, max, cone: Cone::flat(self.plane.normal, cutoff, false), intensity }
    }
}

/// Affine coordinates of a point of the image, whose (0,0) is the top left, at (+x, +y).
fn from_image(at: Vec2) -> DVec2 {
    DVec2::splat(0.5) - at.as_dvec2()
}

fn to_image(at: DVec2) -> Vec2 {
    (DVec2::splat(0.5) - at).as_vec2()
}
