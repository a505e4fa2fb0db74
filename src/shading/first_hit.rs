//! What the passes show of the first surface that is seen.

use super::sensor::Sensor;
use super::surface::SurfacePoint;
use super::world::{Vertex, World};
use crate::film::FirstHit;
use glam::Vec3;

impl World {
    /// The surface seen along `wo`, for the film.
    pub fn first_hit(&self, sensor: &Sensor, hit: &SurfacePoint, vertex: &Vertex, wo: Vec3) -> FirstHit {
        FirstHit {
            depth: sensor.depth(hit.place.position),
            position: self.absolute(hit.place.position),
            normal: vertex.bsdf.normal(),
            albedo: vertex.bsdf.albedo(wo).clamp(Vec3::ZERO, Vec3::ONE),
            uv: self.uv(hit),
            object_index: self.scene().group(hit.instance).object_index,
            material_index: self.scene().materials[hit.material as usize].pass_index,
        }
    }
}
