//! Shading normals by which a mirror would show its own inside.
//!
//! Smoothed silhouettes and bumps lean so far that what is looked at from the front is mirrored below the surface, where there
//! is nothing: black rims. There specular lobes have a normal of their own, between the geometric and the shading one,
//! which mirrors to just above the surface, as in Cycles. It depends on where they are looked at from, so a light's walk
//! keeps away from Dirac lobes whose normal a camera's walk, or its own, would bend.

use glam::Vec3;

/// Least cosine of a mirrored direction with the geometric normal.
const GRAZING: f32 = 0.01;
/// What is looked at as flatly may be mirrored a little flatter.
const FLATTER: f32 = 0.9;

/// The normal that a specular lobe has in place of the shading normal `n` where it needs another, seen along `w`: all unit
/// vectors, `n` on the side of the geometric normal `ng`.
pub(super) fn bent(ng: Vec3, n: Vec3, w: Vec3) -> Option<Vec3> {
    if n == ng {
        return None;
    }
    let side = 1f32.copysign(ng.dot(w));
    let (front, n) = (ng * side, n * side);
    let (cos, lean) = (front.dot(w), n.dot(front));
    let least = GRAZING.min(FLATTER * cos);
    if 2.0 * n.dot(w) * lean - cos >= least {
        return None;
    }
    let across = (n - front * lean).try_normalize()?;
    let along = across.dot(w);
    // about a normal that leans by `a` the mirrored cosine is `hypot(along, cos) cos(2 a - atan2(along, cos))`
    let a = 0.5 * (along.atan2(cos) + (least / along.hypot(cos)).min(1.0).acos());
    Some((across * a.sin() + front * a.cos()) * side)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;
    use crate::math::warp;
    use glam::Vec2;

    #[test]
    fn bent_normals_mirror_just_above_the_surface_and_lean_less() {
        let mut counts = [0; 2];
        for i in 0..20_000 {
            let u = |k| hash_unit(i, k);
            let (ng, w) = (Vec3::Z, warp::uniform_sphere(Vec2::new(u(0), u(1))));
            let n = warp::uniform_sphere(Vec2::new(u(2), u(3)));
            let n = n.with_z(n.z.abs());
            let mirrored = |n: Vec3| (2.0 * n.dot(w) * n.z - w.z) * w.z.signum();
            let least = GRAZING.min(FLATTER * w.z.abs());
            match bent(ng, n, w) {
                None => assert!(mirrored(n) >= least * 0.999),
                Some(b) => {
                    assert!((b.length() - 1.0).abs() < 1e-5 && b.z >= n.z - 1e-5, "{n} {b}");
                    assert!((mirrored(b) - least).abs() < 1e-5, "{w} {n}: {b}");
                    assert!(b.cross(n).dot(ng).abs() < 1e-4, "in the plane of both normals");
                }
            }
            counts[usize::from(bent(ng, n, w).is_some())] += 1;
        }
        assert!(counts.iter().all(|&c| c > 1000), "{counts:?}");
        assert_eq!(bent(Vec3::Z, Vec3::Z, Vec3::new(0.6, 0.0, 0.8)), None);
    }
}
