//! Points on surfaces, and rays that leave them without meeting them again.
//!
//! There is no fixed epsilon. A point is interpolated in double precision and comes with a bound of its distance from
//! the triangle as it is traced; rays start beyond that bound (Pharr, Jakob and Humphreys, "Physically Based Rendering",
//! 4th edition, section 6.8.6). What is left, the error of the triangle test itself, is dealt with in the test: it takes
//! only hits that are certain to lie in front of the origin. So the offset is about one spacing of `f32`, whatever the
//! size of the triangle.

use glam::{Affine3A, DMat3, Mat3, Vec3};

use super::geometry::{amplification, bake_point, geometric_normal, widen};
use super::ray::ROUNDING;
use super::{Accel, Ray};

/// Roundings that a point suffers on its way from world to mesh space: subtraction, matrix, product, two sums, one to
/// spare.
const TRANSFORM_ROUNDINGS: f64 = 6.0;

/// A point on a triangle, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where it is.
    pub position: Vec3,
    /// By axis, how far from `position` the traced triangle passes at most.
    pub error: Vec3,
    /// Unit geometric normal: by the right hand in mesh space, taken to world space as normals are. So the outside of a
    /// mesh stays its outside when it is mirrored.
    pub normal: Vec3,
    /// What the roundings of a ray on its way into the triangle's mesh space come to in world space, by axis; zero for
    /// baked triangles, whose rays go nowhere.
    amplification: Mat3,
}

impl SurfacePoint {
    /// A ray that leaves the point in `direction`, without end.
    #[inline]
    pub fn spawn(&self, direction: Vec3) -> Ray {
        Ray::new(spawn_origin(self.position, self.error, self.normal, direction), direction)
    }

    /// A segment to `target`, a point in space; `t` runs from 0 to 1.
    #[inline]
    pub fn segment_to_point(&self, target: Vec3) -> Ray {
        let origin = spawn_origin(self.position, self.error, self.normal, target - self.position);
        Ray { t_max: 1.0, ..Ray::new(origin, target - origin) }
    }

    /// A segment between two surfaces that meets neither of them, for [`Accel::occluded`]; `t` runs from 0 to 1.
    #[inline]
    pub fn segment_to(&self, target: &SurfacePoint) -> Ray {
        let way = target.position - self.position;
        // The rounding of the direction moves the end by half a spacing of its length on each axis, and the transform
        // into the target's mesh space by a few more.
        let roundings = 2.0 * TRANSFORM_ROUNDINGS as f32 * ROUNDING;
        let rounding = 4.0 * ROUNDING * way.abs() + roundings * (target.amplification * way.abs());
        let origin = spawn_origin(self.position, self.error, self.normal, way);
        let end = spawn_origin(target.position, target.error + rounding, target.normal, -way);
        Ray { t_max: 1.0, ..Ray::new(origin, end - origin) }
    }
}

/// The origin of a ray that leaves `point` in `direction`: off the plane through the point with unit `normal`, to the
/// side that `direction` points to, by as much as the plane may be away given the `error` by axis.
#[inline]
pub fn spawn_origin(point: Vec3, error: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    // The few roundings on the way are made up for by going on to the next number below.
    let distance = normal.abs().dot(error);
    let offset = normal * if normal.dot(direction) < 0.0 { -distance } else { distance };
    let away = |at: f32, offset: f32| match offset {
        offset if offset > 0.0 => (at + offset).next_up(),
        offset if offset < 0.0 => (at + offset).next_down(),
        _ => at,
    };
    Vec3::new(away(point.x, offset.x), away(point.y, offset.y), away(point.z, offset.z))
}

impl Accel {
    /// The point with barycentric coordinates `u` and `v` on the triangle with mesh-space `vertices` of `instance`, whose
    /// transform is `to_world`.
    ///
    /// The position follows the barycentric coordinates, not the ray that found them: it is on the triangle within
    /// `error` even where the ray came from afar.
    pub fn surface_point(
        &self,
        instance: u32,
        vertices: [Vec3; 3],
        to_world: &Affine3A,
        [u, v]: [f32; 2],
    ) -> SurfacePoint {
        let to_world = widen(to_world);
        let is_baked = self.is_baked(instance);
        // The corners as they are traced: those of baked triangles have been rounded.
        let corners = vertices.map(|p| {
            if is_baked {
                bake_point(&to_world, p).as_dvec3()
            } else {
                to_world.transform_point3(p.as_dvec3())
            }
        });
        let [a, b, c] = corners;
        let exact = a + (b - a) * f64::from(u) + (c - a) * f64::from(v);
        let position = exact.as_vec3();
        // One rounding, and a little for those in double precision.
        let mut error = (position.as_dvec3() - exact).abs() + (a.abs() + b.abs() + c.abs()) * 1e-15;
        let mut amplified = DMat3::ZERO;
        if !is_baked {
            amplified = amplification(&to_world.matrix3);
            let reach = (exact - to_world.translation).abs();
            error += amplified * reach * (TRANSFORM_ROUNDINGS * f64::from(ROUNDING));
        }
        let flip = if to_world.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        SurfacePoint {
            position,
            error: error.as_vec3().map(f32::next_up),
            normal: (geometric_normal(corners) * flip).normalize().as_vec3(),
            amplification: amplified.as_mat3(),
        }
    }
}

#[cfg(test)]
mod tests;
