//! What traversal precomputes about a ray, and the parts of the triangle test that run in double precision.

use glam::Vec3;

use super::Ray;
use super::kernel::TriangleBlock;

/// Half the spacing of `f32` just above one: the relative error of one rounding.
pub(super) const ROUNDING: f32 = f32::EPSILON / 2.0;

/// Relative slack of the slab test, in roundings. Three come from the slab test itself; five from the rounding of the
/// vertices in the triangle test, which moves them by at most `5 ROUNDING (t |d_axis| + extent)` on each axis: the part
/// that grows with `t` is covered here, the part that grows with the triangle's extent by [`box_padding`].
const SLAB_ROUNDINGS: f32 = 16.0;

/// What a triangle's box has to grow by on each side, given the triangle's largest extent; see [`SLAB_ROUNDINGS`].
pub(super) fn box_padding(extent: f32) -> f32 {
    SLAB_ROUNDINGS * ROUNDING * extent
}

/// A ray made ready for traversal in some space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub origin: [f32; 3],
    /// Reciprocal direction, shrunk towards zero: for the planes where the ray enters.
    pub inv_near: [f32; 3],
    /// Reciprocal direction, grown: for the planes where the ray leaves.
    pub inv_far: [f32; 3],
    /// 1 where the direction is negative, so that the entering plane is the upper one.
    pub negative: [usize; 3],
    /// Axes in the order of the triangle test: the last is the one along which the direction is longest.
    pub axes: [usize; 3],
    /// Shear that takes the direction to the unit vector of the last axis, and the scale along it.
    pub shear: [f32; 3],
    pub t_min: f32,
}

impl Prepared {
    /// None if nothing can be hit: a number is NaN, origin or direction are infinite, the direction is zero.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Option<Self> {
        // Rejects NaN in either bound too.
        if ray.origin.is_finite() && ray.direction.is_finite() && ray.t_min <= ray.t_max {
            // Adding zero turns -0 into +0, whose bits order like integers.
            Self::in_space(ray.origin, ray.direction, ray.t_min.max(0.0) + 0.0)
        } else {
            None
        }
    }

    /// The same in the space of an instance. None if the direction has vanished or overflowed.
    #[inline(always)]
    pub fn in_space(origin: Vec3, direction: Vec3, t_min: f32) -> Option<Self> {
        let d = direction.to_array();
        let size = direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let x = if z == 2 { 0 } else { z + 1 };
        let y = if x == 2 { 0 } else { x + 1 };
        let scale = 1.0 / d[z];
        // False for NaN, for a zero direction and for one so short that its reciprocal overflows.
        let usable = scale.abs() < f32::INFINITY && size.max_element() < f32::INFINITY;
        if !usable {
            return None;
        }
        let inverse = direction.recip();
        let slack = SLAB_ROUNDINGS * ROUNDING;
        Some(Self {
            origin: origin.to_array(),
            inv_near: (inverse * (1.0 - slack)).to_array(),
            inv_far: (inverse * (1.0 + slack)).to_array(),
            negative: d.map(|d| d.is_sign_negative() as usize),
            axes: [x, y, z],
            shear: [d[x] * scale, d[y] * scale, scale],
            t_min,
        })
    }
}

/// A triangle as the ray sees it: vertices relative to the origin, sheared so that the ray runs along the last axis.
struct Sheared {
    x: [f32; 3],
    y: [f32; 3],
    z: [f32; 3],
    /// Largest error of `x` and `y`.
    error: [f64; 2],
}

impl Sheared {
    fn new(ray: &Prepared, block: &TriangleBlock, lane: usize) -> Self {
        let [kx, ky, kz] = ray.axes;
        let [sx, sy, sz] = ray.shear;
        let relative = |axis: usize| block.vertices.map(|vertex| vertex[axis][lane] - ray.origin[axis]);
        let (px, py, pz) = (relative(kx), relative(ky), relative(kz));
        let largest = |p: [f32; 3]| p.iter().fold(0.0, |m: f32, p| m.max(p.abs())) as f64;
        let error = |p: [f32; 3], s: f32| 5.0 * ROUNDING as f64 * (largest(p) + s.abs() as f64 * largest(pz));
        Self {
            x: [0, 1, 2].map(|i| px[i] - sx * pz[i]),
            y: [0, 1, 2].map(|i| py[i] - sy * pz[i]),
            z: pz.map(|z| sz * z),
            error: [error(px, sx), error(py, sy)],
        }
    }

    /// Signed doubled areas opposite each vertex. Products of two `f32` are exact in `f64`, so the signs are right.
    fn edges(&self) -> [f64; 3] {
        let [x, y] = [self.x, self.y].map(|c| c.map(f64::from));
        [x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]]
    }
}

/// The triangle test of one lane in double precision, for when a single-precision area came out as zero: then its sign
/// is not known and the hit lies on an edge, or close. Returns `(t, u, v)` without a look at the ray's limits.
#[cold]
pub(super) fn exact_test(ray: &Prepared, block: &TriangleBlock, lane: usize) -> Option<[f32; 3]> {
    let sheared = Sheared::new(ray, block, lane);
    let e = sheared.edges();
    let inside = e.iter().all(|&e| e >= 0.0) || e.iter().all(|&e| e <= 0.0);
    let det = e[0] + e[1] + e[2];
    if !inside || det == 0.0 {
        return None;
    }
    let b = e.map(|e| e / det);
    let z = sheared.z.map(f64::from);
    let t = z[0] + b[1] * (z[1] - z[0]) + b[2] * (z[2] - z[0]);
    Some([t as f32, b[1] as f32, b[2] as f32])
}

/// Upper bound of the error of the `t` that the triangle test computes for one lane, in the manner of Pharr, Jakob and
/// Humphreys, "Physically Based Rendering" (4th edition), section 6.8.7.
#[cold]
pub(super) fn t_error(ray: &Prepared, block: &TriangleBlock, lane: usize) -> f32 {
    let gamma = |n: f64| n * ROUNDING as f64 / (1.0 - n * ROUNDING as f64);
    let sheared = Sheared::new(ray, block, lane);
    let largest = |c: [f32; 3]| c.iter().fold(0.0, |m: f32, c| m.max(c.abs())) as f64;
    let (x, y, z) = (largest(sheared.x), largest(sheared.y), largest(sheared.z));
    let [error_x, error_y] = sheared.error;
    let error_z = gamma(3.0) * z;
    let edges = sheared.edges();
    let e = edges.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    let error_e = 2.0 * (gamma(2.0) * x * y + error_y * x + error_x * y);
    let det = (edges[0] + edges[1] + edges[2]).abs();
    // 18: the longest chain of roundings between the areas and `t`; some two of the areas make up two thirds of `det`.
    (3.0 * (gamma(18.0) * e * z + error_e * z + error_z * e) / det) as f32
}
