//! What flat emitters share: the plane they lie in, and emission from one side of it.

use super::falloff::Falloff;
use super::sample::{Emission, FromSample};
use crate::math::density::{AreaPdf, ProjectedPdf};
use crate::math::{Frame, warp};
use glam::{DVec2, DVec3, Vec2, Vec3};
use std::f64::consts::{FRAC_1_PI, PI};

/// A plane with affine coordinates: `center + edge_x s + edge_y t`.
#[derive(Clone, Debug)]
pub(super) struct Plane {
    pub center: Vec3,
    pub normal: Vec3,
    edges: [Vec3; 2],
    /// Dual basis of the edges in the plane.
    dual: [DVec3; 2],
}

impl Plane {
    pub fn new(center: Vec3, edge_x: Vec3, edge_y: Vec3, normal: Vec3) -> Self {
        let (x, y, n) = (edge_x.as_dvec3(), edge_y.as_dvec3(), normal.as_dvec3());
        let (across_y, across_x) = (y.cross(n), x.cross(n));
        let dual = [across_y / x.dot(across_y), across_x / y.dot(across_x)];
        Self { center, normal, edges: [edge_x, edge_y], dual }
    }

    /// The point at affine coordinates `(s, t)`.
    pub fn point(&self, at: DVec2) -> Vec3 {
        let [x, y] = self.edges;
        (self.center.as_dvec3() + x.as_dvec3() * at.x + y.as_dvec3() * at.y).as_vec3()
    }

    /// Affine coordinates of a point of the plane.
    pub fn coordinates(&self, point: Vec3) -> DVec2 {
        let d = point.as_dvec3() - self.center.as_dvec3();
        DVec2::new(d.dot(self.dual[0]), d.dot(self.dual[1]))
    }

    /// Area of the parallelogram of the two edges.
    pub fn cell_area(&self) -> f64 {
        self.edges[0].as_dvec3().cross(self.edges[1].as_dvec3()).length()
    }

    /// Height of a point over the emitting side.
    pub fn height(&self, point: Vec3) -> f64 {
        (point.as_dvec3() - self.center.as_dvec3()).dot(self.normal.as_dvec3())
    }

    /// Distance and affine coordinates where a ray meets the emitting side.
    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f64, DVec2)> {
        let (o, d) = (origin.as_dvec3() - self.center.as_dvec3(), direction.as_dvec3());
        let n = self.normal.as_dvec3();
        let t = -o.dot(n) / d.dot(n);
        let p = o + d * t;
        // t is NaN where the ray lies in the plane
        let met = d.dot(n) < 0.0 && t > 0.0;
        met.then(|| (t, DVec2::new(p.dot(self.dual[0]), p.dot(self.dual[1]))))
    }

    /// Lower and upper corner of the box around the points whose coordinates are within `reach` of zero,
    /// by a parallelogram or, with `round`, an ellipse.
    pub fn extent(&self, reach: f32, round: bool) -> (Vec3, Vec3) {
        let [x, y] = self.edges.map(|e| e.abs() * reach);
        let half = if round { (x * x + y * y).powf(0.5) } else { x + y };
        (self.center - half, self.center + half)
    }
}

/// Ray that leaves a point of a flat emitter, with cosine-distributed directions within its fall-off.
pub(super) fn leave(
    point: Vec3,
    normal: Vec3,
    radiance: Vec3,
    falloff: Option<&Falloff>,
    area: AreaPdf,
    u: Vec2,
) -> Option<FromSample> {
    let (direction, pdf) = match falloff {
        Some(f) => f.sample_flat(u),
        None => {
            (Frame::from_normal(normal).to_world(warp::cosine_hemisphere(u)), warp::COSINE_HEMISPHERE_PDF)
        }
    };
    let radiance = falloff.map_or(radiance, |f| radiance * f.factor(direction));
    (radiance != Vec3::ZERO).then(|| FromSample {
        origin: point,
        normal,
        direction,
        emission: Emission::Extended { radiance, pdf: area.with_direction(ProjectedPdf(pdf)) },
        barycentrics: None,
    })
}

/// Density of [`leave`] per projected solid angle.
pub(super) fn leave_pdf(normal: Vec3, falloff: Option<&Falloff>, direction: Vec3) -> ProjectedPdf {
    ProjectedPdf(match falloff {
        Some(f) => f.pdf_flat(direction),
        None if normal.dot(direction) > 0.0 => FRAC_1_PI as f32,
        None => 0.0,
    })
}

/// The numbers from which [`leave`] draws a direction.
pub(super) fn leave_square(normal: Vec3, falloff: Option<&Falloff>, direction: Vec3) -> Vec2 {
    match falloff {
        Some(f) => f.square_of_flat(direction),
        None => warp::square_of_disk(Frame::from_normal(normal).to_local(direction).truncate()),
    }
}

/// Integral of the fall-off over projected solid angle.
pub(super) fn flat_integral(falloff: Option<&Falloff>) -> Vec3 {
    falloff.map_or(Vec3::splat(PI as f32), Falloff::integral_flat)
}
