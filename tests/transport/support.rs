//! Arrivals without a camera.

use crate::common::Stage;
use glam::{DVec3, Vec3};
use segue::math::Sampler;
use segue::scene::Camera;
use segue::shading::bsdf::Walk;
use segue::shading::{CameraRay, Piece, Sensor, World};
use segue::transport::Cut;
use segue::transport::arrival::arrival;
use segue::transport::store::Arrival;
use segue::transport::walk::{Chain, End, Follow, Nobody};
use std::sync::Arc;

/// Nothing stops.
pub const ON: Cut<'static> = Cut(&|| false);

pub fn world(s: &mut Stage) -> World {
    // at the origin, where scene space has its own
    s.camera(DVec3::ZERO, DVec3::NEG_Z, 1.0, "");
    World::new(Arc::new(s.0.build().unwrap()), false).unwrap()
}

/// An orthographic camera: pixels of `footprint` everywhere.
pub fn sensor(footprint: f32) -> Sensor {
    let half = 0.5 * footprint;
    let json = format!(r#"{{"type":"orthographic","window":[{},{half},{},{half}]}}"#, -half, -half);
    Sensor::new(&Camera::from_json("camera", &json).unwrap(), 1, 1)
}

/// A ray from anywhere.
pub fn ray(origin: Vec3, direction: Vec3) -> Piece {
    Piece::from_camera(&CameraRay { origin, direction, range: [0.0, f32::INFINITY] })
}

/// Follows a segment that only counts what it passes.
pub fn follow(world: &World, piece: Piece, walk: Walk, sampler: &mut Sampler) -> (Chain, Option<End>) {
    Follow { world, walk, from_camera: false }.segment(piece, sampler, &mut Nobody, &mut 0)
}

/// The first surface along a ray, as an arrival.
pub fn arrive(world: &World, origin: Vec3, direction: Vec3) -> Option<Arrival> {
    let mut sampler = Sampler::new(0, 0, 0);
    let end = follow(world, ray(origin, direction), Walk::Light, &mut sampler).1?;
    Some(arrival(world, &end, end.sight().as_ref()))
}
