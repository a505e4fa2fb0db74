//! How a voxel is divided where something stands between its points, so that light does not pass through thin walls, and
//! where the camera sees only a part of it.
//!
//! The first arrival is a *hub*: what it sees is one part. What it does not see has a hub of its own, and so on: one
//! hub would not do, since it may lie in a crevice that nothing else is seen from, or the two sides of a wall may both be
//! hidden from it.

use super::Cut;
use super::area::on_plane;
use super::grid::Grid;
use crate::math::sampler::{hash_point, hash_unit};
use crate::shading::World;
use glam::Vec3;

/// Most parts of a voxel; the last one has all that no hub sees.
pub const MOST_PARTS: usize = 4;
/// By how much points are lifted off their surface before it is asked whether something stands between
/// them, in edges of the voxel.
const LIFT: f32 = 0.05;

/// The same before it is asked whether the camera sees them, and the least, over their largest coordinate: well above
/// rounding.
const SIGHT_LIFT: f32 = 1e-3;
const LEAST_SIGHT_LIFT: f32 = 32.0 * f32::EPSILON;
/// Points by which it is told how much of a voxel the camera sees.
const SIGHT_POINTS: u32 = 16;

/// A point from which it is asked what it sees.
struct Hub {
    point: Vec3,
    lift: f32,
}

impl Hub {
    /// Above a position, on the side of this normal.
    fn new(grid: &Grid, (position, normal): (Vec3, Vec3)) -> Self {
        let (_, edge) = grid.place(&grid.voxel(position));
        let lift = LIFT * edge;
        Self { point: position + normal * lift, lift }
    }

    fn sees(&self, world: &World, (p, normal): (Vec3, Vec3)) -> bool {
        world.is_clear(p + normal * self.lift, self.point)
    }
}

/// Whether the camera, through the middle of its lens, sees a point of a surface with this normal.
///
/// A kernel over what it sees and what it does not would blur light into the picture from where no pixel looks: out of a
/// gap of which the camera sees the rim alone, from behind whatever stands before a surface.
pub fn is_in_sight(world: &World, grid: &Grid, (p, normal): (Vec3, Vec3)) -> bool {
    let Some(eye) = grid.seen_from(p) else { return false };
    let (_, edge) = grid.place(&grid.voxel(p));
    // hardly aside: what is seen into a narrow gap must not depend on it
    let lift = (SIGHT_LIFT * edge).max(LEAST_SIGHT_LIFT * p.abs().max_element());
    let direction = (eye - p).normalize_or_zero();
    // surfaces that transmit are seen from behind, too
    let up = if normal.dot(direction) < 0.0 { -normal } else { normal };
    world.is_in_sight(p + (up + direction) * lift, eye)
}

/// Share of a voxel that the camera sees, of the plane that a point with its normal lies on: by a few points that are drawn
/// for this alone.
pub fn share_in_sight(world: &World, grid: &Grid, (p, normal): (Vec3, Vec3)) -> f32 {
    let (low, edge) = grid.place(&grid.voxel(p));
    let axis = normal.abs().max_position();
    let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
    let seed = hash_point(p);
    let (mut points, mut seen) = (0.0, 0.0);
    for k in 0..SIGHT_POINTS {
        let at = [(u_axis, 2 * k), (v_axis, 2 * k + 1)].map(|(a, n)| low[a] + edge * hash_unit(seed, n));
        let q = on_plane(p, normal, axis, at);
        if (low[axis]..low[axis] + edge).contains(&q[axis]) {
            points += 1.0;
            seen += if is_in_sight(world, grid, (q, normal)) { 1.0 } else { 0.0 };
        }
    }
    if points > 0.0 { seen / points } else { 1.0 }
}

/// The part of each of these points of a voxel, positions with normals, is written to `parts`. Returns how many
/// parts there are.
pub fn divide(world: &World, grid: &Grid, points: &[(Vec3, Vec3)], parts: &mut Vec<u8>, cut: &Cut) -> usize {
    const NONE: u8 = MOST_PARTS as u8 - 1;
    parts.clear();
    parts.resize(points.len(), NONE);
    for part in 0..NONE {
        let Some(first) = parts.iter().position(|&p| p == NONE) else { return part.into() };
        let hub = Hub::new(grid, points[first]);
        parts[first] = part;
        for (p, point) in parts.iter_mut().zip(points).skip(first + 1) {
            if *p == NONE && (cut.is_raised() || hub.sees(world, *point)) {
                *p = part;
            }
        }
    }
    if parts.contains(&NONE) { MOST_PARTS } else { NONE.into() }
}

/// The parts of a voxel, by their hubs.
pub struct Division<'a> {
    world: &'a World,
    hubs: Vec<Hub>,
}

impl<'a> Division<'a> {
    /// By the first point of each part, position with normal.
    pub fn new(world: &'a World, grid: &Grid, firsts: impl Iterator<Item = (Vec3, Vec3)>) -> Self {
        let hubs = firsts.take(MOST_PARTS - 1).map(|first| Hub::new(grid, first)).collect();
        Self { world, hubs }
    }

    /// The part to which a point belongs: the first whose hub sees it, or one that comes after those of the hubs.
    pub fn part(&self, point: Vec3, normal: Vec3) -> usize {
        let seen = self.hubs.iter().position(|hub| hub.sees(self.world, (point, normal)));
        seen.unwrap_or(self.hubs.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneBuilder;
    use crate::transport::testing::{CAMERA, ON, cuboid, sensor};
    use std::sync::Arc;

    /// Boxes that stand on a floor.
    fn on_floor(boxes: &[[Vec3; 2]]) -> World {
        let mut b = SceneBuilder::default();
        for [low, high] in [[Vec3::new(-1.0, -0.6, -2.0), Vec3::new(1.0, -0.5, 0.0)]].iter().chain(boxes) {
            cuboid(&mut b, *low, *high, r#"{"surface":{"type":"diffuse"}}"#);
        }
        b.set_camera("camera", CAMERA).unwrap();
        World::new(Arc::new(b.build().unwrap()), false).unwrap()
    }

    /// Too low for a lifted point to be below it.
    fn lid(point: Vec3) -> [Vec3; 2] {
        let half = Vec3::new(0.01, 0.0, 0.01);
        [point - half + Vec3::Y * 0.002, point + half + Vec3::Y * 0.05]
    }

    fn parts_of(boxes: &[[Vec3; 2]], points: &[Vec3]) -> (Vec<u8>, usize) {
        let (world, sensor) = (on_floor(boxes), sensor());
        let grid = Grid::new(&sensor, 4.0, 3);
        let places: Vec<(Vec3, Vec3)> = points.iter().map(|&p| (p, Vec3::Y)).collect();
        let mut parts = Vec::new();
        let count = divide(&world, &grid, &places, &mut parts, &ON);
        let firsts = (0..count).map(|part| parts.iter().position(|&p| usize::from(p) == part).unwrap());
        let division = Division::new(&world, &grid, firsts.map(|k| places[k]));
        for (&(p, n), &part) in places.iter().zip(&parts) {
            assert_eq!(division.part(p, n), usize::from(part));
        }
        (parts, count)
    }

    #[test]
    fn both_sides_of_a_wall_are_apart_though_neither_is_seen_from_the_first_point() {
        let at = |x: f32, z: f32| Vec3::new(x, -0.5, z);
        let wall = [Vec3::new(-1.0, -0.5, -1.05), Vec3::new(1.0, 0.5, -0.95)];
        let points = [at(0.0, -0.9), at(0.1, -0.9), at(0.1, -1.1), at(0.0, -1.1), at(0.05, -0.8)];
        assert_eq!(parts_of(&[wall], &points), (vec![0, 0, 1, 1, 0], 2));
        assert_eq!(parts_of(&[wall, lid(points[0])], &points), (vec![0, 1, 2, 2, 1], 3));
        assert_eq!(parts_of(&[], &points), (vec![0; 5], 1));
    }

    #[test]
    fn points_are_in_sight_on_the_camera_s_side_of_what_stands_before_it() {
        let wall = [Vec3::new(-1.0, -0.5, -1.05), Vec3::new(1.0, 0.5, -0.95)];
        let (world, sensor) = (on_floor(&[wall]), sensor());
        let grid = Grid::new(&sensor, 4.0, 3);
        let seen = |x: f32, z: f32| is_in_sight(&world, &grid, (Vec3::new(x, -0.5, z), Vec3::Y));
        assert_eq!(
            [seen(0.0, -0.9), seen(0.3, -0.5), seen(0.0, -1.1), seen(0.3, -1.9)],
            [true, true, false, false]
        );
        // from behind, too
        assert!(is_in_sight(&world, &grid, (Vec3::new(0.0, -0.5, -0.9), Vec3::NEG_Y)));
        // the border of what is seen runs through one voxel and not through others
        let share = |x: f32, z: f32| share_in_sight(&world, &grid, (Vec3::new(x, -0.5, z), Vec3::Y));
        assert_eq!([share(0.0, -0.5), share(0.0, -1.8)], [1.0, 0.0]);
        assert!((0.1..0.9).contains(&share(0.0, -0.949)));
        // nor is what lies behind the camera, nor what is nowhere
        assert!(!seen(0.0, 0.5) && !seen(f32::NAN, -0.9));
    }

    #[test]
    fn what_too_many_hubs_do_not_see_is_together() {
        let points: Vec<Vec3> = (0..6).map(|k| Vec3::new(0.1 * k as f32, -0.5, -1.0)).collect();
        let lids: Vec<_> = points.iter().map(|&p| lid(p)).collect();
        assert_eq!(parts_of(&lids, &points), (vec![0, 1, 2, 3, 3, 3], MOST_PARTS));
    }
}
