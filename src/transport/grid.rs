//! Jittered position-normal voxels (Binder et al. 2018): which arrivals lie close together.
//!
//! A voxel's edge is a power of two times a unit that follows the pixel's footprint at that distance from the
//! camera, so that it is a function of the place alone. Offsets, the orientation of the normals' bins and
//! the distances at which the edge doubles are drawn anew in every iteration: no pattern stays.

use super::sizes::Sizes;
use super::store::Arrival;
use crate::math::sampler::{hash, hash_unit};
use crate::shading::{Sensor, SurfaceClass};
use glam::{IVec3, Mat3, Quat, Vec2, Vec3};
use std::f32::consts::TAU;

/// Bins of normals along each axis of their octahedral map.
const NORMAL_BINS: f32 = 6.0;
/// Largest exponent of an edge, either way: what a footprint of zero or infinity gets.
const MAX_LEVEL: i32 = 100;

/// A grid of voxels.
#[derive(Clone, Debug)]
pub struct Grid<'a> {
    sensor: &'a Sensor,
    edge: f32,
    sizes: Option<&'a Sizes>,
    offset: Vec3,
    level_jitter: f32,
    turn: Mat3,
}

/// A box of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Voxel {
    level: i32,
    at: IVec3,
}

impl<'a> Grid<'a> {
    /// A grid of voxels of about `edge` pixels, jittered by `seed`.
    pub fn new(sensor: &'a Sensor, edge: f32, seed: u32) -> Self {
        let u = |k| hash_unit(seed, k);
        // uniform rotation (Shoemake 1992)
        let (a, b) = ((1.0 - u(4)).sqrt(), u(4).sqrt());
        let ((s1, c1), (s2, c2)) = ((TAU * u(5)).sin_cos(), (TAU * u(6)).sin_cos());
        Self {
            sensor,
            edge,
            sizes: None,
            offset: Vec3::new(u(0), u(1), u(2)),
            level_jitter: u(3),
            turn: Mat3::from_quat(Quat::from_xyzw(a * s1, a * c1, b * s2, b * c2).normalize()),
        }
    }

    /// The same, larger or smaller place by place.
    pub fn with_sizes(self, sizes: &'a Sizes) -> Self {
        Self { sizes: (!sizes.is_empty()).then_some(sizes), ..self }
    }

    /// Logarithm, in octaves, of the kernel's edge at a point.
    fn nominal(&self, p: Vec3) -> f32 {
        let octaves = |s: &Sizes| self.sensor.film_position(p).map_or(0.0, |film| s.octaves(film));
        (self.edge * self.sensor.pixel_footprint(p)).log2() + self.sizes.map_or(0.0, octaves)
    }

    /// The voxel of a point. On average over the jitter the logarithm of its edge is that of the kernel.
    pub fn voxel(&self, p: Vec3) -> Voxel {
        let level = self.level(p);
        let at = (p / edge(level) + self.offset).floor().as_ivec3();
        Voxel { level, at }
    }

    /// Whether the voxels are as large at a point as this one.
    pub fn has_level_of(&self, p: Vec3, voxel: &Voxel) -> bool {
        self.level(p) == voxel.level
    }

    fn level(&self, p: Vec3) -> i32 {
        let size = self.nominal(p) + self.level_jitter;
        // a conversion of NaN or an infinity saturates
        (size.floor() as i32).clamp(-MAX_LEVEL, MAX_LEVEL)
    }

    /// Logarithm, in octaves, of the edge of the voxel at a point over the kernel's: zero on average over the jitter.
    pub fn octaves(&self, p: Vec3) -> f32 {
        self.level(p) as f32 - self.nominal(p)
    }

    /// Lower corner and edge of a voxel.
    pub fn place(&self, voxel: &Voxel) -> (Vec3, f32) {
        let edge = edge(voxel.level);
        ((voxel.at.as_vec3() - self.offset) * edge, edge)
    }

    /// The bin of a unit normal.
    pub fn bin(&self, normal: Vec3) -> u32 {
        let n = self.turn * normal;
        let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
        let fold = |a: f32, b: f32| (1.0 - b.abs()) * 1f32.copysign(a);
        let p = if n.z < 0.0 { Vec2::new(fold(n.x, n.y), fold(n.y, n.x)) } else { Vec2::new(n.x, n.y) };
        let q = ((p * 0.5 + 0.5) * NORMAL_BINS).floor().clamp(Vec2::ZERO, Vec2::splat(NORMAL_BINS - 1.0));
        q.x as u32 + q.y as u32 * NORMAL_BINS as u32
    }

    /// Where the sight of a point from the middle of the lens ends; `None` beyond the clipping planes.
    pub fn seen_from(&self, p: Vec3) -> Option<Vec3> {
        self.sensor.view_through_middle(p).map(|view| view.end)
    }

    /// The key of an arrival: equal for those that share a cluster.
    pub fn key(&self, a: &Arrival) -> u64 {
        key(&self.voxel(a.position), self.bin(a.normal), a.class)
    }
}

fn edge(level: i32) -> f32 {
    (level as f32).exp2()
}

fn key(voxel: &Voxel, bin: u32, class: SurfaceClass) -> u64 {
    let Voxel { level, at } = *voxel;
    let words = [at.x as u32, at.y as u32, at.z as u32, level as u32 ^ bin << 8 ^ (class as u32) << 16];
    let half = |salt| words.iter().fold(salt, |h, &w| hash(h, w));
    u64::from(half(0x5e67)) << 32 | u64::from(half(0x0e51))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Rect;
    use crate::math::warp;
    use crate::scene::Camera;

    fn sensor() -> Sensor {
        Sensor::new(&Camera::from_json("c", r#"{"window":[-1,1,-1,1]}"#).unwrap(), 100, 100)
    }

    fn points(n: u32) -> impl Iterator<Item = Vec3> {
        (0..n).map(|i| {
            let r = (20.0 * hash_unit(i, 3) - 10.0).exp2();
            warp::uniform_sphere(Vec2::new(hash_unit(i, 1), hash_unit(i, 2))) * r
        })
    }

    #[test]
    fn points_lie_in_their_voxels() {
        let sensor = sensor();
        for seed in 0..20 {
            let grid = Grid::new(&sensor, 2.0, seed);
            for p in points(500) {
                let (low, edge) = grid.place(&grid.voxel(p));
                let slack = 1e-5 * p.length();
                assert!((p - low).min_element() >= -slack && (p - low).max_element() <= edge + slack);
            }
        }
    }

    #[test]
    fn edges_follow_the_footprint() {
        let sensor = sensor();
        let p = Vec3::new(3.0, -1.0, 7.0);
        let mean: f32 = (0..4000)
            .map(|seed| {
                let grid = Grid::new(&sensor, 3.0, seed);
                (grid.place(&grid.voxel(p)).1 / sensor.pixel_footprint(p)).log2()
            })
            .sum::<f32>()
            / 4000.0;
        assert!((mean - 3f32.log2()).abs() < 0.03, "{mean}");
    }

    #[test]
    fn edges_are_larger_and_smaller_place_by_place() {
        let sensor = sensor();
        let sizes =
            Sizes::new(Rect::new(0, 0, 100, 100), (0..49).map(|block| (block % 7) as f32 - 3.0).collect());
        // seen in the middle of the second column of blocks, behind the camera, and far beside the picture
        for (p, octaves) in [
            (Vec3::new(-0.52, 0.1, -1.0) * 3.0, -2.0),
            (Vec3::new(0.2, 0.1, 3.0), 0.0),
            (Vec3::new(9.0, 0.0, -1.0), 0.0),
        ] {
            let logarithm = |seed| {
                let grid = Grid::new(&sensor, 3.0, seed).with_sizes(&sizes);
                let voxel = grid.voxel(p);
                assert!(grid.has_level_of(p, &voxel));
                let edge = (grid.place(&voxel).1 / sensor.pixel_footprint(p)).log2();
                // what is told of the voxel is relative to the kernel there
                assert!((edge - 3f32.log2() - octaves - grid.octaves(p)).abs() < 1e-4);
                edge
            };
            let mean = (0..4000).map(logarithm).sum::<f32>() / 4000.0;
            assert!((mean - 3f32.log2() - octaves).abs() < 0.03, "{mean} at {p}");
        }
    }

    #[test]
    fn every_pair_of_close_points_is_parted_now_and_then() {
        let sensor = sensor();
        let p = Vec3::new(0.3, 2.0, -4.0);
        let q = p + Vec3::X * 0.25 * sensor.pixel_footprint(p);
        let together = (0..2000)
            .filter(|&seed| {
                let grid = Grid::new(&sensor, 1.0, seed);
                grid.voxel(p) == grid.voxel(q)
            })
            .count();
        // a quarter of an edge apart, a jittered boundary lies between them in about a quarter of the grids
        assert!((1300..1700).contains(&together), "{together}");
    }

    #[test]
    fn zero_and_infinite_footprints_have_voxels() {
        let sensor = sensor();
        let grid = Grid::new(&sensor, 4.0, 1);
        for p in [Vec3::ZERO, Vec3::splat(1e-38), Vec3::splat(1e30)] {
            let (low, edge) = grid.place(&grid.voxel(p));
            assert!(low.is_finite() && edge > 0.0 && edge.is_finite());
        }
    }

    #[test]
    fn opposite_normals_never_share_a_bin() {
        let sensor = sensor();
        for seed in 0..50 {
            let grid = Grid::new(&sensor, 4.0, seed);
            for p in points(100) {
                let n = p.normalize();
                assert!(grid.bin(n) < 36);
                assert_ne!(grid.bin(n), grid.bin(-n));
            }
        }
    }
}
