//! What the inside of objects absorbs.
//!
//! A stretch of a path is inside of a surface's object where it leaves or reaches the surface on its back. Which one of
//! two different insides counts where objects overlap does not depend on the way along it: the stronger.

use super::ray::Piece;
use super::surface::SurfacePoint;
use super::world::World;
use glam::Vec3;

/// The material whose object a ray is inside of, if any, that leaves or meets a surface; seen from there it lies
/// `towards` a direction.
#[inline]
pub(super) fn interior(p: &SurfacePoint, towards: Vec3) -> Option<u32> {
    (p.place.normal.dot(towards) < 0.0).then_some(p.material)
}

impl World {
    /// Share of light that is left at the end of a piece, a surface: the Beer-Lambert law.
    #[inline]
    pub fn left_after(&self, piece: &Piece, end: &SurfacePoint) -> Vec3 {
        if !self.needs().absorption {
            return Vec3::ONE;
        }
        let distance = (end.place.position - piece.ray.origin).length() + piece.lead;
        self.left_between(piece.inside, interior(end, -piece.direction), distance)
    }

    /// The same between two ends, with the materials whose insides lie between them.
    #[inline]
    pub(super) fn left_between(&self, start: Option<u32>, end: Option<u32>, distance: f32) -> Vec3 {
        if !self.needs().absorption {
            return Vec3::ONE;
        }
        let coefficient = |m: Option<u32>| m.map_or(Vec3::ZERO, |m| self.absorption[m as usize]);
        // nothing absorbs nothing, however far it is
        (-coefficient(start).max(coefficient(end)) * distance.min(f32::MAX)).exp()
    }
}
