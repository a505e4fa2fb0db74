//! What lies between two points of a path: how much of the light comes through.

use super::interior::interior;
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
        self.comes_through(from, None, false, rays, |p| light.ray_from(p))
    }

    /// The same between two surface points.
    pub fn transmittance_between(&self, from: &SurfacePoint, to: &SurfacePoint, rays: &mut u64) -> Vec3 {
        self.comes_through(from, Some(to), false, rays, |p| p.segment_to(&to.place))
    }

    /// The same from a surface point to where the camera's sight begins, `end`. What the camera does not see
    /// sends nothing, and is not in the way.
    pub fn transmittance_to_camera(&self, from: &SurfacePoint, end: Vec3, rays: &mut u64) -> Vec3 {
        let hides = self.needs().camera_visibility;
        if hides && !self.scene.group(from.instance).camera_visible {
            return Vec3::ZERO;
        }
        self.comes_through(from, None, hides, rays, |p| p.segment_to_point(end))
    }

    /// Whether the camera, whose sight begins at `eye`, sees a point in space: nothing that it sees lies in between, but for
    /// what may let light through as it is.
    pub fn is_in_sight(&self, point: Vec3, eye: Vec3) -> bool {
        !self.is_blocked(&Ray { t_max: 1.0, ..Ray::new(point, eye - point) }, self.needs().camera_visibility)
    }

    /// Whether something lies on a ray that lets no light through as it is. `for_camera`: something that the camera sees.
    #[inline]
    fn is_blocked(&self, ray: &Ray, for_camera: bool) -> bool {
        let counts = |h: &Hit| !for_camera || self.scene.group(h.instance).camera_visible;
        let opaque =
            |h: &Hit| !self.materials.may_be_transparent(self.scene.material_index(h.instance, h.triangle));
        match (self.needs().transparency, for_camera) {
            (false, false) => self.accel.occluded(ray),
            (false, true) => self.accel.occluded_where(ray, &counts),
            (true, _) => self.accel.occluded_where(ray, &|h| opaque(h) && counts(h)),
        }
    }

    /// `to`: the surface at its end, unless that is a light or the camera. `for_camera`: past what the camera does not
    /// see. `ray_from`: the ray that is left from a point on it.
    fn comes_through(
        &self,
        from: &SurfacePoint,
        to: Option<&SurfacePoint>,
        for_camera: bool,
        rays: &mut u64,
        ray_from: impl Fn(&Place) -> Ray,
    ) -> Vec3 {
        let mut ray = ray_from(&from.place);
        *rays += 1;
        let last = to.and_then(|to| interior(to, -ray.direction));
        let left = |ray: &Ray, start, end| self.left_between(start, end, length_squared(ray).sqrt());
        // most rays that are blocked are blocked by something opaque
        if self.is_blocked(&ray, for_camera) {
            return Vec3::ZERO;
        }
        if !self.needs().transparency {
            return left(&ray, interior(from, ray.direction), last);
        }
        let counts = |h: &Hit| !for_camera || self.scene.group(h.instance).camera_visible;
        let (mut weight, mut inside) = (Vec3::ONE, interior(from, ray.direction));
        while let Some(hit) = self.accel.closest_where(&ray, &counts) {
            let p = SurfacePoint::new(&self.scene, &self.accel, &hit);
            let rest = ray_from(&p.place);
            // a plane that both ends lie on, to rounding, is met without end
            if rest.t_max.is_finite() && length_squared(&rest) >= length_squared(&ray) {
                break;
            }
            let piece = Ray { t_max: hit.t, ..ray };
            weight *= left(&piece, inside, interior(&p, -ray.direction));
            weight *= self.materials.transparency(p.material, &p.at);
            if weight == Vec3::ZERO {
                return weight;
            }
            *rays += 1;
            (ray, inside) = (rest, interior(&p, rest.direction));
        }
        weight * left(&ray, inside, last)
    }
}

fn length_squared(ray: &Ray) -> f32 {
    (ray.direction * ray.t_max).length_squared()
}
