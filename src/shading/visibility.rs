//! What lies between two points of a path: how much of the light comes through.

use super::ray::LightSample;
use super::surface::SurfacePoint;
use super::world::World;
use crate::accel::offset::SurfacePoint as Place;
use crate::accel::{Hit, Ray};
use glam::Vec3;

impl World {
    /// Share of light that comes through from a sampled light to a surface point. Adds the rays it takes
    /// to `rays`.
    pub fn transmittance(&self, from: &SurfacePoint, light: &LightSample, rays: &mut u64) -> Vec3 {
        self.comes_through(from, false, rays, |p| light.ray_from(p))
    }

    /// The same between two surface points.
    pub fn transmittance_between(&self, from: &SurfacePoint, to: &SurfacePoint, rays: &mut u64) -> Vec3 {
        self.comes_through(from, false, rays, |p| p.segment_to(&to.place))
    }

    /// The same from a surface point to where the camera's sight begins, `end`. What the camera does not see
    /// sends nothing, and is not in the way.
    pub fn transmittance_to_camera(&self, from: &SurfacePoint, end: Vec3, rays: &mut u64) -> Vec3 {
        let hides = self.needs().camera_visibility;
        if hides && !self.scene.group(from.instance).camera_visible {
            return Vec3::ZERO;
        }
        self.comes_through(from, hides, rays, |p| p.segment_to_point(end))
    }

    /// `for_camera`: past what the camera does not see. `ray_from`: the ray that is left from a point on it.
    fn comes_through(
        &self,
        from: &SurfacePoint,
        for_camera: bool,
        rays: &mut u64,
        ray_from: impl Fn(&Place) -> Ray,
    ) -> Vec3 {
        let mut ray = ray_from(&from.place);
        *rays += 1;
        let counts = |h: &Hit| !for_camera || self.scene.group(h.instance).camera_visible;
        if !self.needs().transparency {
            let occluded = match for_camera {
                false => self.accel.occluded(&ray),
                true => self.accel.occluded_where(&ray, &counts),
            };
            return if occluded { Vec3::ZERO } else { Vec3::ONE };
        }
        let opaque =
            |h: &Hit| !self.materials.may_be_transparent(self.scene.material_index(h.instance, h.triangle));
        // most shadow rays that are blocked are blocked by something opaque
        if self.accel.occluded_where(&ray, &|h| opaque(h) && counts(h)) {
            return Vec3::ZERO;
        }
        let mut weight = Vec3::ONE;
        while let Some(hit) = self.accel.closest_where(&ray, &counts) {
            let p = SurfacePoint::new(&self.scene, &self.accel, &hit);
            let rest = ray_from(&p.place);
            // a plane that both ends lie on, to rounding, is met without end
            if rest.t_max.is_finite() && length_squared(&rest) >= length_squared(&ray) {
                return weight;
            }
            weight *= self.materials.transparency(p.material, &p.at);
            if weight == Vec3::ZERO {
                return weight;
            }
            *rays += 1;
            ray = rest;
        }
        weight
    }
}

fn length_squared(ray: &Ray) -> f32 {
    (ray.direction * ray.t_max).length_squared()
}
