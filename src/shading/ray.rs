//! Rays as integrators follow them, and light met or sampled along them.

use super::emitters::EmitterHit;
use super::interior::interior;
use super::sensor::CameraRay;
use super::surface::SurfacePoint;
use crate::accel::Ray;
use crate::accel::offset::SurfacePoint as Place;
use glam::Vec3;

/// A stretch of a ray between two surfaces. A ray that passes through transparent surfaces is a chain of
/// pieces; light that it meets is weighed as seen from where the first one began.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    pub(super) ray: Ray,
    /// Unit direction.
    pub direction: Vec3,
    /// Distance from where the ray began to where this piece does.
    pub(super) travelled: f32,
    /// The material of the surface that the piece leaves, if it does on its back.
    pub(super) inside: Option<u32>,
    /// Distance that light passes on the piece before the ray's origin: endless from lights at infinity, less than none
    /// where sight begins beyond it.
    pub(super) lead: f32,
}

/// Light met along a ray.
#[derive(Clone, Copy, Debug)]
pub struct LightPoint {
    /// Radiance against the ray.
    pub radiance: Vec3,
    /// Unit direction of the ray.
    pub(super) direction: Vec3,
    /// Where it was met, with the distance from the ray's very beginning.
    pub(super) hit: EmitterHit,
}

/// Light sampled from a surface point.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction to the light.
    pub direction: Vec3,
    /// Radiance; of a delta light, the irradiance of a surface that faces it.
    pub radiance: Vec3,
    /// Density per solid angle; of a delta light, the probability of having chosen it.
    pub pdf: f32,
    /// Whether nothing else could have found this direction.
    pub is_delta: bool,
    pub(super) target: Target,
    /// The point of the light, as a ray would meet it.
    pub(super) hit: EmitterHit,
}

/// Where sampled light comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Target {
    /// Far away, along the sample's direction.
    Infinity,
    /// A point in space.
    Point(Vec3),
    /// A point of a surface that is part of the scene.
    Surface(Place),
}

impl LightPoint {
    /// Whether it is infinitely far away.
    #[inline]
    pub fn is_infinite(&self) -> bool {
        self.hit.distance == f32::INFINITY
    }
}

impl LightSample {
    /// The ray that must be free for the light to arrive.
    pub(super) fn ray_from(&self, p: &Place) -> Ray {
        match &self.target {
            Target::Infinity => p.spawn(self.direction),
            Target::Point(target) => p.segment_to_point(*target),
            Target::Surface(target) => p.segment_to(target),
        }
    }
}

impl Piece {
    /// The first piece of a camera ray.
    pub fn from_camera(c: &CameraRay) -> Self {
        let ray = Ray { origin: c.origin, direction: c.direction, t_min: c.range[0], t_max: c.range[1] };
        Self { ray, direction: c.direction, travelled: 0.0, inside: None, lead: -ray.t_min.max(0.0) }
    }

    /// The first piece of a ray that leaves an emitter.
    pub(super) fn along(ray: Ray, direction: Vec3, is_from_infinity: bool) -> Self {
        let lead = if is_from_infinity { f32::INFINITY } else { 0.0 };
        Self { ray, direction, travelled: 0.0, inside: None, lead }
    }

    /// The first piece of a ray that leaves a surface.
    pub fn leaving(p: &SurfacePoint, direction: Vec3) -> Self {
        Self {
            ray: p.place.spawn(direction),
            direction,
            travelled: 0.0,
            inside: interior(p, direction),
            lead: 0.0,
        }
    }

    /// The next piece, beyond a surface that was passed.
    pub fn beyond(&self, p: &SurfacePoint) -> Self {
        let ray = p.place.spawn(self.direction);
        let step = (ray.origin - self.ray.origin).length();
        let ray = Ray { t_max: self.ray.t_max - step, ..ray };
        Self {
            ray,
            direction: self.direction,
            travelled: self.travelled + step,
            inside: interior(p, self.direction),
            lead: 0.0,
        }
    }
}
