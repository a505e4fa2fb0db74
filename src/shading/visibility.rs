//! What lies between two points of a path: how much of the light comes through.

use super::interior::interior;
use super::ray::LightSample;
use super::surface::SurfacePoint;
use super::world::World;
use crate::accel::offset::SurfacePoint as Place;
use crate::accel::{Hit, Ray};
use glam::Vec3;

/// Where light is followed to.
#[derive(Clone, Copy)]
enum Goal<'a> {
    Light,
    Surface(&'a SurfacePoint),
    /// Past what it does not see.
    Camera,
}

impl World {
    /// Share of light that comes through from a sampled light to a surface point. Adds the rays it takes
    /// to `rays`.
    pub fn transmittance(&self, from: &SurfacePoint, light: &LightSample, rays: &mut u64) -> Vec3 {
        self.comes_through(from, Goal::Light, rays, |p| light.ray_from(p))
    }

    /// The same between two surface points.
    pub fn transmittance_between(&self, from: &SurfacePoint, to: &SurfacePoint, rays: &mut u64) -> Vec3 {
        self.comes_through(from, Goal::Surface(to), rays, |p| p.segment_to(&to.place))
    }

    /// The same from a surface point to where the camera's sight begins, `end`. What the camera does not see
    /// sends nothing, and is not in the way.
    pub fn transmittance_to_camera(&self, from: &SurfacePoint, end: Vec3, rays: &mut u64) -> Vec3 {
        if self.needs().camera_visibility && !self.scene.group(from.instance).camera_visible {
            return Vec3::ZERO;
        }
        self.comes_through(from, Goal::Camera, rays, |p| p.segment_to_point(end))
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

    /// From a surface point to a goal. `ray_from`: the ray that is left from a point on it.
    fn comes_through(
        &self,
        from: &SurfacePoint,
        goal: Goal,
        rays: &mut u64,
        ray_from: impl Fn(&Place) -> Ray,
    ) -> Vec3 {
        let mut ray = ray_from(&from.place);
        *rays += 1;
        let last = match goal {
            Goal::Surface(to) => interior(to, -ray.direction),
            Goal::Light | Goal::Camera => None,
        };
        let is_sight = matches!(goal, Goal::Camera);
        let for_camera = is_sight && self.needs().camera_visibility;
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
            let towards_camera = if is_sight { ray.direction } else { -ray.direction };
            weight *= self.materials.transparency(&p, towards_camera);
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
