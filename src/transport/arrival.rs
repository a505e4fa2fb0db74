//! Ends of segments, made ready for the store.

use super::store::{Arrival, storable_survival};
use super::walk::End;
use crate::shading::bsdf::{Bsdf, Sight};
use crate::shading::{SurfaceClass, World};
use glam::Vec3;

/// Least probability that a path goes on; the greatest is the world's.
const LEAST: f32 = 0.05;

/// Probability `q` with which a path goes on from a surface: the albedo of what is continuous, given that the
/// segment ended there.
pub fn survival(world: &World, bsdf: &Bsdf, wo: Vec3, end_probability: f32) -> f32 {
    survival_of(world, bsdf.continuous_albedo(wo), end_probability)
}

fn survival_of(world: &World, albedo: Vec3, end_probability: f32) -> f32 {
    bounded(world, albedo.max_element() / end_probability)
}

fn bounded(world: &World, albedo: f32) -> f32 {
    // false for NaN
    storable_survival(if albedo > LEAST { albedo.min(world.most_survival()) } else { LEAST })
}

/// How a path that came to an arrival from `from` would go on back along the segment that ended there: the probability
/// that it does at all, and the density of that direction.
pub fn reversed(world: &World, a: &Arrival, from: Vec3) -> (f32, f32) {
    if a.class == SurfaceClass::Diffuse {
        return (bounded(world, a.reflectance.max_element()), a.back_pdf);
    }
    let bsdf = a.bsdf_from(world, from);
    (survival(world, &bsdf, from, bsdf.end_probability(from)), bsdf.continuous_pdf(from, a.wo).0)
}

/// The same at the first arrivals of a camera path, which decide most of the picture's noise: paths are longer there.
pub fn early_survival(q: f32) -> f32 {
    storable_survival(q.sqrt())
}

/// The end of a segment as it is stored; `goes_on` is the caller's to set. `sight`: of its continuous lobes from where
/// the segment came.
pub fn arrival(world: &World, end: &End, sight: Option<&Sight>) -> Arrival {
    let End { hit, vertex, wo, end_probability, .. } = end;
    let class = world.class(hit.material);
    let facing = if hit.place.normal.dot(*wo) < 0.0 { -hit.ns } else { hit.ns };
    let (reflectance, back_pdf) = match (class, vertex.bsdf.lambert()) {
        (SurfaceClass::Diffuse, Some((r, _))) => (r, sight.map_or(0.0, |s| s.pdf(*wo).0)),
        _ => (Vec3::ZERO, 0.0),
    };
    Arrival {
        position: hit.place.position,
        normal: if class == SurfaceClass::Transmitting { hit.ns } else { facing },
        wo: *wo,
        at: hit.address(),
        reflectance,
        back_pdf,
        survival: survival_of(world, sight.map_or(Vec3::ZERO, Sight::continuous_albedo), *end_probability),
        class,
        goes_on: false,
    }
}
