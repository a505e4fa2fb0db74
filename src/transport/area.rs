//! The surface area of a cluster.

use super::grid::{Grid, Voxel};
use super::store::Arrival;
use crate::math::sampler::{hash, hash_unit};
use crate::shading::{SurfaceClass, World};
use glam::Vec3;

/// Coverage points along each of two axes.
const POINTS: u32 = 4;
/// Most surfaces that are looked at below one coverage point.
const LAYERS: u32 = 8;

/// The part of space that a cluster takes.
pub struct Cell<'a> {
    /// The grid.
    pub grid: &'a Grid<'a>,
    /// Its voxel.
    pub voxel: Voxel,
    /// One of its arrivals.
    pub representative: &'a Arrival,
    /// Where something divides the voxel: whether this is the part that the representative does not see.
    pub parted: Option<bool>,
}

impl Cell<'_> {
    /// The paper's estimate: the area that the voxel cuts out of the plane through `point`.
    pub fn plane_cut(&self, point: Vec3) -> f32 {
        let (low, edge) = self.grid.place(&self.voxel);
        let (p, n) = ((point - low) / edge, self.representative.normal);
        edge * edge * unit_plane_cut(p, n)
    }

    /// Stratified estimate: rays through the voxel, along the axis nearest to the normal, meet what of the
    /// surface belongs to the cluster. `hidden`: whether a point with its normal is out of the
    /// representative's sight.
    pub fn coverage(&self, world: &World, point: Vec3, hidden: &impl Fn(Vec3, Vec3) -> bool) -> f32 {
        let (low, edge) = self.grid.place(&self.voxel);
        let n = self.representative.normal;
        let axis = n.abs().max_position();
        let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
        let bin = self.grid.bin(n);
        let seed = hash(point.x.to_bits(), hash(point.y.to_bits(), point.z.to_bits()));
        let mut sum = 0.0;
        for k in 0..POINTS * POINTS {
            let u = (k % POINTS) as f32 + hash_unit(seed, 2 * k);
            let v = (k / POINTS) as f32 + hash_unit(seed, 2 * k + 1);
            let mut top = low;
            top[u_axis] += u * edge / POINTS as f32;
            top[v_axis] += v * edge / POINTS as f32;
            let mut bottom = top;
            top[axis] += edge;
            if n[axis] < 0.0 {
                std::mem::swap(&mut top, &mut bottom);
            }
            world.for_each_surface(top, bottom, LAYERS, |p| {
                let class = world.class(p.material);
                let ns = match class == SurfaceClass::Transmitting || p.ns.dot(n) > 0.0 {
                    true => p.ns,
                    false => -p.ns,
                };
                let there = class == self.representative.class
                    && self.grid.bin(ns) == bin
                    && self.grid.voxel(p.place.position) == self.voxel
                    && self.parted.is_none_or(|far| hidden(p.place.position, ns) == far);
                if there {
                    // a surface seen edge-on would count without bound
                    sum += 1.0 / p.place.normal[axis].abs().max(0.05);
                }
            });
        }
        let face = edge * edge / (POINTS * POINTS) as f32;
        // the cluster has arrivals, so it is somewhere between the points
        sum.max(0.5) * face
    }
}

/// Area of the part of the plane through `p` with unit normal `n` inside the unit cube.
pub fn unit_plane_cut(p: Vec3, n: Vec3) -> f32 {
    let axis = n.abs().max_position();
    let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
    // the cut is projected along the axis: a square, less what lies above or below the cube
    let mut polygon: Vec<(f32, f32)> = vec![(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let height = |(u, v): (f32, f32)| {
        p[axis] - (n[u_axis] * (u - p[u_axis]) + n[v_axis] * (v - p[v_axis])) / n[axis]
    };
    for inside in [&(|q| height(q)) as &dyn Fn((f32, f32)) -> f32, &|q| 1.0 - height(q)] {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, &a) in polygon.iter().enumerate() {
            let b = polygon[(k + 1) % polygon.len()];
            let (ha, hb) = (inside(a), inside(b));
            if ha >= 0.0 {
                kept.push(a);
            }
            if (ha >= 0.0) != (hb >= 0.0) {
                let t = ha / (ha - hb);
                kept.push((a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1)));
            }
        }
        polygon = kept;
    }
    let twice: f32 = (0..polygon.len())
        .map(|k| {
            let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
            a.0 * b.1 - b.0 * a.1
        })
        .sum();
    // a plane that only touches the cube still has an arrival in it
    (0.5 * twice.abs() / n[axis].abs()).max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plane_cuts_are_exact() {
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{a} {b}");
        let middle = Vec3::splat(0.5);
        close(unit_plane_cut(middle, Vec3::Z), 1.0);
        close(unit_plane_cut(middle, Vec3::new(1.0, 0.0, 1.0).normalize()), 2f32.sqrt());
        // the regular hexagon
        close(unit_plane_cut(middle, Vec3::ONE.normalize()), 0.75 * 3f32.sqrt());
        // a corner triangle
        let n = Vec3::ONE.normalize();
        close(unit_plane_cut(Vec3::new(0.3, 0.0, 0.0), n), 0.5 * 3f32.sqrt() * 0.09);
        close(unit_plane_cut(Vec3::new(0.7, 1.0, 1.0), -n), 0.5 * 3f32.sqrt() * 0.09);
    }

    #[test]
    fn plane_cuts_average_to_the_right_density() {
        // Cutting a plane by a jittered grid tiles it, so over uniform jitter the mean cut is the projected
        // measure: the integral of the cut over offsets along the normal equals the cube's volume.
        for n in [Vec3::new(0.2, -0.5, 0.9), Vec3::new(-1.0, 0.99, 0.98), Vec3::X].map(Vec3::normalize) {
            let steps = 20_000;
            let reach = 2.0;
            let sum: f32 = (0..steps)
                .map(|k| {
                    let t = (k as f32 + 0.5) / steps as f32 * 2.0 * reach - reach;
                    let cut = unit_plane_cut(Vec3::splat(0.5) + n * t, n);
                    if cut > 1e-3 { cut } else { 0.0 }
                })
                .sum();
            let volume = sum * 2.0 * reach / steps as f32;
            assert!((volume - 1.0).abs() < 5e-3, "{volume}");
        }
    }
}
