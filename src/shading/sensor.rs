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

/// How the sensor sees a point of the scene through a point of its lens.
#[derive(Clone, Copy, Debug)]
pub struct SensorView {
    /// Position in pixels from the top left corner of the full film.
    pub film: Vec2,
    /// Unit direction from the point to the lens.
    pub direction: Vec3,
    /// Where sight ends: on the near clipping plane, or on the lens itself.
    pub end: Vec3,
    /// As [`Sensor::density`] says.
    pub density: f32,
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

    /// Density of camera rays where one of them meets `p`, if every pixel sends one, uniform over its square:
    /// per area across the ray, given the point of the lens. It is also the sensor's importance: a light path
    /// of flux `F` that arrives there and goes on along the ray counts `F` times the cosine, the BSDF and this.
    pub fn density(&self, ray: &CameraRay, p: Vec3) -> f32 {
        match self.camera.projection {
            // a pixel's solid angle is its area in the window times cos^3, and cos is depth over distance
            Projection::Perspective => p.distance(ray.origin) / (self.pixel_area() * self.depth(p).powi(3)),
            Projection::Orthographic => 1.0 / (self.pixel_area() * self.depth(ray.direction)),
        }
    }

    /// How `p` is seen through the point of the lens that `lens` in the unit square maps to; `None` beyond
    /// the clipping planes. The position on the film may lie outside the picture.
    pub fn view(&self, p: Vec3, lens: Vec2) -> Option<SensorView> {
        let c = &self.camera;
        let lens = if c.aperture_radius > 0.0 { self.aperture(lens) * c.aperture_radius } else { Vec2::ZERO };
        self.view_through(p, lens)
    }

    /// The same through the middle of the lens.
    pub fn view_through_middle(&self, p: Vec3) -> Option<SensorView> {
        self.view_through(p, Vec2::ZERO)
    }

    /// The same through a point of the lens in the camera's own space.
    fn view_through(&self, p: Vec3, lens: Vec2) -> Option<SensorView> {
        let c = &self.camera;
        let at = self.rotation.transpose() * p;
        let depth = -at.z;
        let [near, far] = c.clipping;
        let in_front = depth > 0.0 || c.projection == Projection::Orthographic;
        if !(in_front && depth >= near && depth <= far) {
            return None;
        }
        // the ray through the lens point and `p`: its xy at a depth, and where it meets the window
        let (slope, origin, window) = match c.projection {
            Projection::Perspective => {
                let slope = (at.truncate() - lens) / depth;
                (slope, lens, lens / c.focus_distance + slope)
            }
            Projection::Orthographic => {
                let slope = -lens / c.focus_distance;
                let origin = at.truncate() - slope * depth;
                (slope, origin, origin - lens)
            }
        };
        let film = self.on_film(window);
        let forward = (self.rotation * slope.extend(-1.0)).normalize();
        let ray =
            CameraRay { origin: self.rotation * origin.extend(0.0), direction: forward, range: c.clipping };
        let end = self.rotation * (origin + slope * near).extend(-near);
        let density = self.density(&ray, p);
        let sound = density > 0.0 && density.is_finite() && film.is_finite() && end.is_finite();
        sound.then_some(SensorView { film, direction: -forward, end, density })
    }

    /// Where the middle of the lens sees a scene point, in pixels from the top left corner of the full film; `None` behind
    /// the camera. It may lie outside the picture.
    pub fn film_position(&self, p: Vec3) -> Option<Vec2> {
        let at = self.rotation.transpose() * p;
        let window = match self.camera.projection {
            Projection::Perspective if at.z < 0.0 => at.truncate() / -at.z,
            Projection::Perspective => return None,
            Projection::Orthographic => at.truncate(),
        };
        Some(self.on_film(window))
    }

    /// The position on the full film of a point of the window.
    fn on_film(&self, window: Vec2) -> Vec2 {
        let [x0, x1, y0, y1] = self.camera.window;
        (window - Vec2::new(x0, y1)) / Vec2::new(x1 - x0, y0 - y1) * self.resolution
    }

    /// Area of a pixel in the window's units.
    fn pixel_area(&self) -> f32 {
        let [x0, x1, y0, y1] = self.camera.window;
        ((x1 - x0) / self.resolution.x * ((y1 - y0) / self.resolution.y)).abs()
    }

    /// By how much [`Sensor::pixel_footprint`] grows per distance.
    pub fn footprint_growth(&self) -> f32 {
        match self.camera.projection {
            Projection::Perspective => self.pixel_area().sqrt(),
            Projection::Orthographic => 0.0,
        }
    }

    /// Side of the square that a pixel covers at a scene point, as seen from the lens: by distance, so that
    /// it depends neither on the path that led there nor on the direction of view.
    pub fn pixel_footprint(&self, p: Vec3) -> f32 {
        let pixel = self.pixel_area().sqrt();
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

    const CAMERAS: [&str; 4] = [
        r#"{"window":[-2,1,-1,1],"transform":[0,0,1,0,1,0,0,0,0,1,0,0,0,0,0,1]}"#,
        r#"{"window":[-2,1,-1,1],"aperture_radius":0.3,"focus_distance":2,"blades":5,"aperture_ratio":2}"#,
        r#"{"type":"orthographic","window":[-3,1,-1,1],"near":-1}"#,
        r#"{"type":"orthographic","window":[-3,1,-1,1],"aperture_radius":0.3,"focus_distance":2}"#,
    ];

    #[test]
    fn points_on_a_ray_are_seen_where_it_came_from() {
        for json in CAMERAS {
            let s = sensor(json);
            for (film, lens) in
                [(Vec2::new(150.0, 30.0), Vec2::new(0.1, 0.8)), (Vec2::new(3.0, 99.0), Vec2::ONE * 0.6)]
            {
                let ray = s.ray(film, lens);
                let p = ray.origin + ray.direction * 4.0;
                let view = s.view(p, lens).unwrap();
                assert!((view.film - film).length() < 1e-3, "{json}: {} for {film}", view.film);
                assert!((view.direction + ray.direction).length() < 1e-5);
                assert!((view.end - ray.origin - ray.direction * ray.range[0]).length() < 1e-4);
                approx::assert_relative_eq!(view.density, s.density(&ray, p), max_relative = 1e-4);
                // in focus it is seen there through the middle of the lens, too
                let p = ray.origin + ray.direction * (s.camera.focus_distance / s.depth(ray.direction));
                assert!((s.film_position(p).unwrap() - film).length() < 1e-3, "{json}");
            }
            assert!(s.view(s.rotation.z_axis * 3.0, Vec2::ZERO).is_none(), "behind the camera");
        }
    }

    /// The density integrates to one over what a pixel sees of a tilted plane, whatever the lens point.
    #[test]
    fn every_pixel_sends_one_ray() {
        for json in CAMERAS {
            let s = sensor(json);
            let n = s.rotation * Vec3::new(0.3, -0.2, 1.0).normalize();
            let centre = s.rotation * Vec3::new(-1.5, 0.0, -3.0);
            let (a, b) = n.any_orthonormal_pair();
            let lens = Vec2::new(0.3, 0.7);
            let (cells, half) = (1500, 6.0);
            let side = 2.0 * half / cells as f32;
            let mut pixels = 0.0;
            for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
                let at = |k: u32| (k as f32 + 0.5) * side - half;
                let Some(view) = s.view(centre + a * at(i) + b * at(j), lens) else { continue };
                // a block in the middle of the film
                if (view.film - Vec2::new(100.0, 50.0)).abs().max_element() < 20.0 {
                    pixels += f64::from(view.density * n.dot(view.direction).abs() * side * side);
                }
            }
            approx::assert_relative_eq!(pixels, 1600.0, max_relative = 1e-2);
        }
    }
}
