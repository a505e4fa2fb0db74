//! The sphere around the scene, through which light from infinity enters.

use super::sample::{Emission, FromSample};
use crate::math::{Frame, warp};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// A sphere around everything that can be lit.
#[derive(Clone, Copy, Debug)]
pub struct SceneBounds {
    /// Its middle, world space.
    pub center: Vec3,
    /// Its radius, scene units; positive.
    pub radius: f32,
}

impl SceneBounds {
    /// Area of the disk that covers the sphere from any side.
    pub(super) fn disk_area(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// A ray along `direction` from a uniform point of the disk that touches the sphere.
    pub(super) fn enter(&self, direction: Vec3, u: Vec2, emission: Emission) -> FromSample {
        let disk = warp::concentric_disk(u).extend(-1.0) * self.radius;
        let origin = self.center + Frame::from_normal(direction).to_world(disk);
        FromSample { origin, normal: direction, direction, emission, barycentrics: None }
    }

    /// The numbers from which [`SceneBounds::enter`] draws the ray along `direction` through a point.
    pub(super) fn square_of(&self, direction: Vec3, point: Vec3) -> Vec2 {
        let local = Frame::from_normal(direction).to_local(point - self.center);
        warp::square_of_disk(local.truncate() / self.radius)
    }
}
