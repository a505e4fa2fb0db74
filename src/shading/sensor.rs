//! The camera as a sensor: rays from points of the film and of the lens.

use crate::math::warp;
use crate::scene::Camera;
use crate::scene::camera::Projection;
use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::TAU;

/// A ray from the camera, in scene space (the camera stands at the scene's origin).
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// Point on the lens.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
    /// Nearest and farthest distance along the ray that is seen (the clipping planes).
    pub range: [f32; 2],
}

/// A camera with its film.
#[derive(Clone, Debug)]
pub struct Sensor {
    camera: Camera,
    rotation: Mat3,
    resolution: Vec2,
}

impl Sensor {
    /// The sensor of a camera with a full film of `width` by `height` pixels.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        Self {
            rotation: camera.to_world.matrix3.as_mat3(),
            camera: camera.clone(),
            resolution: Vec2::new(width as f32, height as f32),
        }
    }

    /// The ray through a film position in pixels from the top left corner of the *full* film, and
    /// through the point of the lens that `lens` in the unit square maps to.
    pub fn ray(&self, film: Vec2, lens: Vec2) -> CameraRay {
        let c = &self.camera;
        let [x0, x1, y0, y1] = c.window;
        let f = film / self.resolution;
        let w = Vec2::new(x0 + (x1 - x0) * f.x, y1 + (y0 - y1) * f.y);
        let (mut origin, mut direction) = match c.projection {
            Projection::Perspective => (Vec3::ZERO, w.extend(-1.0)),
            Projection::Orthographic => (w.extend(0.0), Vec3::NEG_Z),
        };
        if c.aperture_radius > 0.0 {
            let focus = origin + direction * c.focus_distance;
            let p = self.aperture(lens) * c.aperture_radius;
            origin += p.extend(0.0);
            direction = focus - origin;
        }
        let direction = direction.normalize();
        // the planes are at depths along -z, and the lens is at depth 0
        let per_depth = 1.0 / -direction.z;
        CameraRay {
            origin: self.rotation * origin,
            direction: (self.rotation * direction).normalize(),
            range: c.clipping.map(|d| d * per_depth),
        }
    }

    /// Depth of a scene point: its distance to the camera's plane.
    pub fn depth(&self, p: Vec3) -> f32 {
        -self.rotation.z_axis.dot(p)
    }

    /// Side of the square that a pixel covers at a scene point, as seen from the lens: by distance, so that
    /// it depends neither on the path that led there nor on the direction of view.
    pub fn pixel_footprint(&self, p: Vec3) -> f32 {
        let [x0, x1, y0, y1] = self.camera.window;
        let pixel = ((x1 - x0) / self.resolution.x * ((y1 - y0) / self.resolution.y)).abs().sqrt();
        match self.camera.projection {
            Projection::Perspective => pixel * p.length(),
            Projection::Orthographic => pixel,
        }
    }

    /// A uniform point of the aperture's shape, inside the unit circle.
    fn aperture(&self, u: Vec2) -> Vec2 {
        let c = &self.camera;
        let p = if c.blades < 3 {
            warp::concentric_disk(u)
        } else {
            let n = c.blades as f32;
            let blade = (u.x * n).floor().min(n - 1.0);
            let b = warp::uniform_triangle(Vec2::new(u.x * n - blade, u.y));
            let corner = |k: f32| Vec2::from_angle(TAU * k / n);
            corner(blade) * b.x + corner(blade + 1.0) * b.y
        };
        let p = Vec2::from_angle(c.blade_rotation).rotate(p);
        Vec2::new(p.x / c.aperture_ratio, p.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sensor(json: &str) -> Sensor {
        Sensor::new(&Camera::from_json("c", json).unwrap(), 200, 100)
    }

    #[test]
    fn corners_of_the_film_see_corners_of_the_window() {
        let s = sensor(r#"{"window":[-2,2,-1,1]}"#);
        let toward = |x, y| {
            let d = s.ray(Vec2::new(x, y), Vec2::ZERO).direction;
            d / -d.z
        };
        assert!((toward(0.0, 0.0) - Vec3::new(-2.0, 1.0, -1.0)).length() < 1e-5);
        assert!((toward(200.0, 100.0) - Vec3::new(2.0, -1.0, -1.0)).length() < 1e-5);
        assert!((toward(100.0, 50.0) - Vec3::NEG_Z).length() < 1e-6);
    }

    #[test]
    fn clipping_is_by_depth() {
        let s = sensor(r#"{"window":[-1,1,-1,1],"near":2,"far":5}"#);
        for p in [Vec2::ZERO, Vec2::new(40.0, 90.0)] {
            let r = s.ray(p, Vec2::ZERO);
            approx::assert_relative_eq!(
                s.depth(r.origin + r.direction * r.range[0]),
                2.0,
                max_relative = 1e-5
            );
            approx::assert_relative_eq!(
                s.depth(r.origin + r.direction * r.range[1]),
                5.0,
                max_relative = 1e-5
            );
        }
    }

    #[test]
    fn lens_rays_meet_in_the_plane_of_focus() {
        for blades in [0, 5] {
            let s = sensor(&format!(
                r#"{{"window":[-1,1,-0.5,0.5],"aperture_radius":0.3,"focus_distance":4,"blades":{blades},"aperture_ratio":2}}"#
            ));
            let film = Vec2::new(150.0, 30.0);
            let at_focus = |u: Vec2| {
                let r = s.ray(film, u);
                assert!((2.0 * r.origin.x).hypot(r.origin.y) <= 0.3 * (1.0 + 1e-5));
                r.origin + r.direction * (4.0 / -r.direction.z)
            };
            let sharp = at_focus(Vec2::new(0.5, 0.5));
            for u in [Vec2::new(0.01, 0.9), Vec2::new(0.7, 0.3), Vec2::new(0.99, 0.99)] {
                assert!((at_focus(u) - sharp).length() < 1e-4);
            }
        }
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let s = sensor(r#"{"type":"orthographic","window":[-3,1,0,2]}"#);
        let r = s.ray(Vec2::ZERO, Vec2::ZERO);
        assert_eq!((r.origin, r.direction), (Vec3::new(-3.0, 2.0, 0.0), Vec3::NEG_Z));
    }
}
