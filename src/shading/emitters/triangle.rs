//! Emissive triangles of meshes.

use super::bounds::{Cone, LightBounds};
use super::sample::{Emission, FromSample, SurfacePoint};
use super::spherical_triangle::SphericalTriangle;
use crate::math::density::{AreaPdf, EtenduePdf, ProjectedPdf, SolidAnglePdf};
use crate::math::{Frame, luminance, warp};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f32::consts::FRAC_1_PI;
use std::f64::consts::PI;

/// An emissive triangle as the caller hands it over.
#[derive(Clone, Copy, Debug)]
pub struct MeshTriangle {
    /// Index of the instance it belongs to.
    pub instance: u32,
    /// Index of the triangle in its mesh.
    pub triangle: u32,
    /// Corners in world space; seen counter-clockwise from the side that emits.
    pub vertices: [Vec3; 3],
    /// Mean emitted radiance over the triangle.
    pub radiance: Vec3,
    /// Whether the other side emits alike.
    pub two_sided: bool,
}

/// An emissive triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    vertex: Vec3,
    edges: [Vec3; 2],
    radiance: Vec3,
    two_sided: bool,
}

/// Solid angle from which on points are chosen by it.
const NEAR: f64 = 0.05;
/// Height of a receiver over the triangle's plane, over its coordinates, below which rounding blurs the directions
/// to points nearby: seen from the triangle itself, all of them are.
const BLURRED: f64 = 1e-5;

impl Triangle {
    /// `None` where it cannot emit: no area, no radiance, or not finite.
    pub fn new(t: &MeshTriangle) -> Option<Self> {
        let [a, b, c] = t.vertices;
        let edges = [b - a, c - a];
        let area = edges[0].cross(edges[1]).length();
        let emits = t.radiance.min_element() >= 0.0 && t.radiance.max_element() > 0.0;
        // a subnormal area has no precise normal
        let sound = t.radiance.is_finite() && area.is_normal() && a.is_finite();
        (emits && sound).then_some(Self { vertex: a, edges, radiance: t.radiance, two_sided: t.two_sided })
    }

    /// The triangle as seen from a receiver, where it is so large that points are better chosen by solid
    /// angle.
    fn spherical(&self, x: Vec3) -> Option<SphericalTriangle> {
        let [a, b] = self.edges;
        let size2 = a.length_squared().max(b.length_squared()).max((a - b).length_squared());
        let middle = self.vertex + (a + b) / 3.0;
        if middle.distance_squared(x) > 4.0 * size2 {
            return None;
        }
        let reach = x.abs().max(self.vertex.abs()).max_element().max(size2.sqrt());
        let (o, normal) = (x.as_dvec3() - self.vertex.as_dvec3(), a.as_dvec3().cross(b.as_dvec3()));
        if o.dot(normal).abs() <= BLURRED * f64::from(reach) * normal.length() {
            return None;
        }
        let corner = |at: Vec3| at.as_dvec3() - x.as_dvec3();
        let corners = [self.vertex, self.vertex + a, self.vertex + b].map(corner);
        Some(SphericalTriangle::new(corners)).filter(|s| s.solid_angle() > NEAR)
    }

    /// Barycentrics where a ray from `x` meets the triangle's plane, kept inside the triangle.
    fn barycentrics(&self, x: Vec3, direction: DVec3) -> Vec2 {
        let [a, b] = self.edges.map(|e| e.as_dvec3());
        let o = x.as_dvec3() - self.vertex.as_dvec3();
        let (p, q) = (direction.cross(b), o.cross(a));
        let at = DVec2::new(o.dot(p), direction.dot(q)) / a.dot(p);
        let at = at.max(DVec2::ZERO);
        (at / at.element_sum().max(1.0)).as_vec2()
    }

    /// Unit normal and area.
    fn geometry(&self) -> (Vec3, f32) {
        let n = self.edges[0].cross(self.edges[1]);
        let length = n.length();
        (n / length, 0.5 * length)
    }

    fn point(&self, b: Vec2) -> Vec3 {
        self.vertex + self.edges[0] * b.x + self.edges[1] * b.y
    }

    pub fn towards(&self, x: Vec3, u: Vec2) -> Option<(SurfacePoint, Vec3, Vec2)> {
        let (normal, area) = self.geometry();
        let spherical = self.spherical(x);
        let b = match &spherical {
            Some(s) => self.barycentrics(x, s.sample(u)),
            None => warp::uniform_triangle(u),
        };
        let point = self.point(b);
        let facing = if self.two_sided && normal.dot(x - point) < 0.0 { -normal } else { normal };
        let mut sample = SurfacePoint::by_area(x, point, facing, AreaPdf(1.0 / area))?;
        if let Some(s) = &spherical {
            sample.pdf = SolidAnglePdf(1.0 / s.solid_angle() as f32);
        }
        Some((sample, self.radiance, b))
    }

    pub fn pdf_towards(&self, x: Vec3, direction: Vec3, distance: f32) -> SolidAnglePdf {
        let (normal, area) = self.geometry();
        let cos = -normal.dot(direction);
        match self.spherical(x) {
            _ if !self.two_sided && cos <= 0.0 => SolidAnglePdf(0.0),
            Some(s) => SolidAnglePdf(1.0 / s.solid_angle() as f32),
            None => AreaPdf(1.0 / area).to_solid_angle(distance, cos),
        }
    }

    pub fn from(&self, mut u: Vec2, v: Vec2) -> FromSample {
        let (mut normal, area) = self.geometry();
        let mut pdf = FRAC_1_PI;
        if self.two_sided {
            pdf *= 0.5;
            if u.x < 0.5 {
                normal = -normal;
            }
            u.x = (u.x * 2.0).fract();
        }
        let b = warp::uniform_triangle(u);
        let pdf = AreaPdf(1.0 / area).with_direction(ProjectedPdf(pdf));
        FromSample {
            origin: self.point(b),
            normal,
            direction: Frame::from_normal(normal).to_world(warp::cosine_hemisphere(v)),
            emission: Emission::Extended { radiance: self.radiance, pdf },
            barycentrics: Some(b),
        }
    }

    pub fn pdf_from(&self, direction: Vec3) -> EtenduePdf {
        let (normal, area) = self.geometry();
        let pdf = match self.two_sided {
            true => 0.5 * FRAC_1_PI,
            false if normal.dot(direction) > 0.0 => FRAC_1_PI,
            false => 0.0,
        };
        AreaPdf(1.0 / area).with_direction(ProjectedPdf(pdf))
    }

    /// The numbers from which [`Triangle::from`] draws a ray.
    pub fn square_of(&self, point: Vec3, direction: Vec3) -> [Vec2; 2] {
        let (normal, _) = self.geometry();
        let is_back = self.two_sided && normal.dot(direction) < 0.0;
        let mut u = warp::square_of_triangle(self.barycentrics(point, -normal.as_dvec3()));
        if self.two_sided {
            u.x = 0.5 * if is_back { u.x } else { 1.0 + u.x };
        }
        let side = if is_back { -normal } else { normal };
        [u, warp::square_of_disk(Frame::from_normal(side).to_local(direction).truncate())]
    }

    pub fn power(&self) -> DVec3 {
        let sides = if self.two_sided { 2.0 } else { 1.0 };
        self.radiance.as_dvec3() * (PI * sides * self.geometry().1 as f64)
    }

    pub fn bounds(&self) -> LightBounds {
        let [a, b, c] = [self.vertex, self.vertex + self.edges[0], self.vertex + self.edges[1]];
        let (normal, area) = self.geometry();
        LightBounds {
            min: a.min(b).min(c),
            max: a.max(b).max(c),
            cone: Cone::flat(normal, PI / 2.0, self.two_sided),
            intensity: luminance(self.radiance) as f64 * area as f64,
        }
    }
}
