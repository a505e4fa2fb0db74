//! What traversal precomputes about a ray, and the parts of the triangle test that run in double precision.

use glam::{DVec3, Vec3};

use super::Ray;
use super::kernel::{LANES, TriangleBlock};

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
    pub direction: [f32; 3],
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
            direction: d,
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
}

impl Sheared {
    #[inline(always)]
    fn new(ray: &Prepared, block: &TriangleBlock, lane: usize) -> Self {
        let [kx, ky, kz] = ray.axes;
        let [sx, sy, sz] = ray.shear;
        let mut sheared = Self { x: [0.0; 3], y: [0.0; 3], z: [0.0; 3] };
        for (i, vertex) in block.vertices.iter().enumerate() {
            let x = vertex[kx][lane] - ray.origin[kx];
            let y = vertex[ky][lane] - ray.origin[ky];
            let z = vertex[kz][lane] - ray.origin[kz];
            (sheared.x[i], sheared.y[i], sheared.z[i]) = (x - sx * z, y - sy * z, sz * z);
        }
        sheared
    }

    /// Signed doubled areas opposite each vertex. Products of two `f32` are exact in `f64`, so the signs are right.
    #[inline(always)]
    fn areas(&self) -> [f64; 3] {
        let area = |a: usize, b: usize| {
            f64::from(self.x[a]) * f64::from(self.y[b]) - f64::from(self.y[a]) * f64::from(self.x[b])
        };
        [area(1, 2), area(2, 0), area(0, 1)]
    }
}

/// The triangle test of one lane in double precision, for when a single-precision area came out as zero: then its sign
/// is not known and the hit lies on an edge, or close. Returns `(t, u, v)` without a look at the ray's limits.
#[inline(never)]
pub(super) fn exact_test(ray: &Prepared, block: &TriangleBlock, lane: usize) -> Option<[f32; 3]> {
    let sheared = Sheared::new(ray, block, lane);
    let [a, b, c] = sheared.areas();
    let inside = (a >= 0.0 && b >= 0.0 && c >= 0.0) || (a <= 0.0 && b <= 0.0 && c <= 0.0);
    let det = a + b + c;
    if !inside || det == 0.0 {
        return None;
    }
    let (u, v) = (b / det, c / det);
    let [z, zb, zc] = sheared.z.map(f64::from);
    let t = z + u * (zb - z) + v * (zc - z);
    Some([t as f32, u as f32, v as f32])
}

/// Where the ray meets a triangle's plane, and how far off that may be; in double precision, straight from the vertices.
///
/// Decides whether a hit lies in front of the ray's origin, or before its end, when single precision cannot tell.
#[inline(never)]
pub(super) fn exact_t(ray: &Prepared, block: &TriangleBlock, lane: usize) -> (f64, f64) {
    let origin = DVec3::from_array(ray.origin.map(f64::from));
    let direction = DVec3::from_array(ray.direction.map(f64::from));
    let [a, b, c] = &block.vertices;
    let relative = |vertex: &[[f32; LANES]; 3]| {
        DVec3::new(f64::from(vertex[0][lane]), f64::from(vertex[1][lane]), f64::from(vertex[2][lane]))
            - origin
    };
    let (a, b, c) = (relative(a), relative(b), relative(c));
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    let slope = normal.dot(direction).recip();
    // Some ten roundings of terms that are no larger than this product.
    let size = ab.length_squared() * ac.length_squared() * a.length_squared();
    (normal.dot(a) * slope, 8.0 * f64::EPSILON * (size.sqrt() * slope).abs())
}
