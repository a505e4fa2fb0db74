//! The surface area of a cluster.

use super::grid::{Grid, Voxel};
use super::store::Arrival;
use crate::math::sampler::{hash, hash_point, hash_unit};
use crate::shading::{SurfaceClass, World};
use glam::Vec3;
use std::ops::RangeInclusive;

/// Coverage points that have to lie on the cluster, where photons are divided by its area: as many as there are photons,
/// within these bounds, so that they add little to the noise of the photons' number.
pub const POINTS_OF_PHOTONS: RangeInclusive<u32> = 4..=32;
/// The same where the area only decides how much each technique counts.
pub const FEW_POINTS: u32 = 1;
/// The same where areas stand in densities themselves, so that both an area and its reciprocal have to be right.
pub const MOST_POINTS: u32 = 64;
/// Most points that are tried to find them, and most where these found fewer than [`ENOUGH`].
const TRIES: [u32; 2] = [256, 8192];
/// So many are looked for further.
const ENOUGH: u32 = *POINTS_OF_PHOTONS.start();
/// Most points that are tried for a rough estimate.
const FEW_TRIES: u32 = 32;
/// Distance from the representative's plane, in edges of the voxel, within which a surface is taken to be in sight.
const NEAR_PLANE: f32 = 0.05;
/// Cosine of the angle between a shading normal and the surface's own below which faces with the same shading normal may
/// lie along any axis.
const STEEP: f32 = 0.8;
/// Most surfaces that are looked at below one coverage point.
const LAYERS: usize = 64;

/// The part of space that a cluster takes.
pub struct Cell<'a> {
    /// The grid.
    pub grid: &'a Grid<'a>,
    /// Its voxel.
    pub voxel: Voxel,
    /// One of its arrivals.
    pub representative: &'a Arrival,
    /// Whether something divides the voxel, and the cluster has but a part of it.
    pub is_divided: bool,
    /// Whether it has what the camera sees of the voxel, or what it does not see: a sliver, perhaps.
    pub is_cut: bool,
}

impl Cell<'_> {
    /// The paper's estimate: the area that the voxel cuts out of a plane.
    fn plane_cut(&self, point: Vec3, normal: Vec3) -> f32 {
        let (low, edge) = self.grid.place(&self.voxel);
        edge * edge * unit_plane_cut((point - low) / edge, normal)
    }

    /// Normal of the representative's surface itself, on the side of its shading normal.
    fn plane(&self, world: &World) -> Vec3 {
        let normal = self.representative.surface(world).place.normal;
        if normal.dot(self.representative.normal) < 0.0 { -normal } else { normal }
    }

    /// The exact area where the whole cut lies on one triangle and so do all members: `triangles`, by instance and number.
    pub fn on_one_triangle(
        &self,
        world: &World,
        mut triangles: impl Iterator<Item = (u32, u32)>,
    ) -> Option<f32> {
        let r = self.representative;
        if self.is_divided || self.is_cut || !triangles.all(|t| t == (r.at.instance, r.at.triangle)) {
            return None;
        }
        let (low, edge) = self.grid.place(&self.voxel);
        let [a, b, c] = world.flat_triangle(&r.at)?.map(|v| (v - low) / edge);
        let n = (b - a).cross(c - a).normalize_or_zero();
        if n == Vec3::ZERO {
            return None;
        }
        let inside = |q: Vec3, from: Vec3, to: Vec3| (to - from).cross(q - from).dot(n) >= 0.0;
        let point = (r.position - low) / edge;
        let belongs = |q: Vec3| {
            let same_size = self.grid.has_level_of(low + q * edge, &self.voxel);
            same_size && inside(q, a, b) && inside(q, b, c) && inside(q, c, a)
        };
        plane_cut_corners(point, n).into_iter().all(belongs).then(|| edge * edge * unit_plane_cut(point, n))
    }

    /// Estimate by rays through the voxel, along the axis nearest to the surface's normal, which meet what of the surface
    /// belongs to the cluster; along all axes where shading normals lean away from that. Photons are divided by the area, so it is the reciprocal that has to be right on average:
    /// independent points are tried until `wanted` of them lie on the cluster (inverse binomial sampling, Haldane
    /// 1945). Where that takes too many, the next one is taken to be on it: of `M` hits in `N` tries, the `k`-th is
    /// number `k (N + 1) / (M + 1)` in the mean, so the reciprocal's mean stays as it would have been.
    /// Estimates of different `wanted` are independent. `belongs`: whether a point with its normal is
    /// in the cluster's part of the voxel; `is_shown`: whether it is on the cluster's side of sight. Adds the points
    /// that were tried to `probes`.
    pub fn coverage(
        &self,
        world: &World,
        wanted: u32,
        belongs: &impl Fn(Vec3, Vec3) -> bool,
        is_shown: &impl Fn(Vec3, Vec3) -> bool,
        probes: &mut u64,
    ) -> f32 {
        let (low, edge) = self.grid.place(&self.voxel);
        let ns = self.representative.normal;
        let plane = self.plane(world);
        // seen along one axis, a surface that is smooth by its normals alone may be seen edge-on
        let shares = match ns.dot(plane) < STEEP {
            true => Vec3::splat(1.0 / 3.0),
            false => Vec3::AXES[plane.abs().max_position()],
        };
        let bin = self.grid.bin(ns);
        let at = self.representative.position;
        let seed = hash(wanted, hash_point(at));
        let (mut sum, mut squares, mut tries, mut found) = (0.0, 0.0, 0, 0);
        let is_rough = wanted == FEW_POINTS;
        let (mut goal, mut most) = match (is_rough, self.is_cut) {
            (true, false) => (wanted, FEW_TRIES),
            // a photon in a sliver that were taken to be large would keep its weight over a tiny area; the first point
            // may come a hundred times too early, the fourth hardly ever
            (true, true) => (ENOUGH, TRIES[1]),
            (false, _) => (wanted, TRIES[0]),
        };
        while found < goal && tries < most {
            let [u, v, choice] = std::array::from_fn(|k| hash_unit(seed, 3 * tries + k as u32));
            tries += 1;
            let axis = (0..2).find(|&k| choice < shares.to_array()[..=k].iter().sum()).unwrap_or(2);
            let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut top = low;
            top[u_axis] += u * edge;
            top[v_axis] += v * edge;
            let mut bottom = top;
            top[axis] += edge;
            if ns[axis] < 0.0 {
                std::mem::swap(&mut top, &mut bottom);
            }
            let (mut is_first, mut is_there) = (true, false);
            // the upper side of something too thin for points above its lower side to be inside: depth in edges, orientation
            let mut upper: Option<(f32, bool)> = None;
            world.for_each_surface(top, bottom, LAYERS, |p| {
                // where nothing divides the cluster, only what bends away or lies below something may be out of sight
                let rise = (p.position - at).dot(plane);
                let is_doubtful = self.is_divided || !is_first || rise.abs() > NEAR_PLANE * edge;
                is_first = false;
                let faces = p.ns.dot(ns) > 0.0;
                let side = match p.class == SurfaceClass::Transmitting || faces {
                    true => p.ns,
                    false => -p.ns,
                };
                let there = p.class == self.representative.class
                    && self.grid.bin(side) == bin
                    && self.grid.voxel(p.position) == self.voxel
                    && (!is_doubtful || belongs(p.position, side));
                let is_lower = upper.is_some_and(|(d, f)| f != faces && p.depth - d < NEAR_PLANE);
                upper = (there && !is_lower).then_some((p.depth, faces));
                if there && !is_lower && is_shown(p.position, side) {
                    is_there = true;
                    // a surface seen edge-on would count without bound
                    let slope = 1.0 / p.normal.abs().dot(shares).max(0.05);
                    sum += slope;
                    squares += slope * slope;
                }
            });
            found += u32::from(is_there);
            if !is_rough && tries == TRIES[0] && found < ENOUGH {
                (goal, most) = (ENOUGH, TRIES[1]);
            }
        }
        *probes += u64::from(tries);
        let cut_short = if found < goal { 1.0 } else { 0.0 };
        let area_of_try = edge * edge / (tries as f32 + cut_short);
        if found == 0 {
            return self.plane_cut(at, plane).min(area_of_try);
        }
        // the reciprocal of a mean of slopes is too large by their variance over their number, to first order
        let spread =
            if found > 1 { (found as f32 * squares / (sum * sum) - 1.0) / (found - 1) as f32 } else { 0.0 };
        sum * (1.0 + cut_short / found as f32) * area_of_try * (1.0 + spread)
    }
}

/// Area of the part of the plane through `p` with unit normal `n` inside the unit cube.
pub fn unit_plane_cut(p: Vec3, n: Vec3) -> f32 {
    let axis = n.abs().max_position();
    let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
    let corners = plane_cut_corners(p, n);
    let twice: f32 = (0..corners.len())
        .map(|k| {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            a[u_axis] * b[v_axis] - b[u_axis] * a[v_axis]
        })
        .sum();
    // a plane that only touches the cube still has an arrival in it
    (0.5 * twice.abs() / n[axis].abs()).max(1e-3)
}

/// The point of the plane through `p` with normal `n` that has these coordinates along the two axes after `axis`, which
/// does not lie in the plane.
pub fn on_plane(p: Vec3, n: Vec3, axis: usize, [u, v]: [f32; 2]) -> Vec3 {
    let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut q = Vec3::ZERO;
    (q[u_axis], q[v_axis]) = (u, v);
    q[axis] = p[axis] - (n[u_axis] * (u - p[u_axis]) + n[v_axis] * (v - p[v_axis])) / n[axis];
    q
}

/// Corners of the polygon that the unit cube cuts out of a plane, in order.
fn plane_cut_corners(p: Vec3, n: Vec3) -> Vec<Vec3> {
    let axis = n.abs().max_position();
    // along the axis the cut is projected to a square, less what lies above or below the cube
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mut corners: Vec<Vec3> = square.map(|at| on_plane(p, n, axis, at)).into();
    for above in [true, false] {
        let inside = |q: Vec3| if above { q[axis] } else { 1.0 - q[axis] };
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let (ha, hb) = (inside(a), inside(b));
            if ha >= 0.0 {
                kept.push(a);
            }
            if (ha >= 0.0) != (hb >= 0.0) {
                kept.push(a.lerp(b, ha / (ha - hb)));
            }
        }
        corners = kept;
    }
    corners
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
