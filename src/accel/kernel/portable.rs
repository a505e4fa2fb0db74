//! The kernel for any processor, in safe code.

use super::super::ray::Prepared;
use super::{Candidates, Kernel, LANES, NEARER, Node, TriangleBlock, WIDTH};

#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

/// `a` if it is larger, else `b`: so `b` if either is NaN, as the vector instructions have it.
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `a` if it is smaller, else `b`.
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

impl Kernel for Portable {
    type Lanes = Prepared;

    fn lanes(self, ray: &Prepared) -> Prepared {
        *ray
    }

    fn boxes(self, ray: &Prepared, node: &Node, t_max: f32, entry: &mut [f32; WIDTH]) -> u32 {
        let mut mask = 0;
        for child in 0..WIDTH {
            let (mut near, mut far) = (ray.t_min, t_max);
            for axis in 0..3 {
                let planes = &node.bounds[axis];
                let enters = planes[ray.negative[axis]][child] - ray.origin[axis];
                let leaves = planes[1 - ray.negative[axis]][child] - ray.origin[axis];
                near = max(enters * ray.inv_near[axis], near);
                far = min(leaves * ray.inv_far[axis], far);
            }
            entry[child] = near;
            mask |= u32::from(near <= far) << child;
        }
        mask
    }

    fn triangles(self, ray: &Prepared, block: &TriangleBlock, t_max: f32) -> Option<Candidates> {
        let [kx, ky, kz] = ray.axes;
        let [sx, sy, sz] = ray.shear;
        let mut found = Candidates {
            t: [0.0; LANES],
            u: [0.0; LANES],
            v: [0.0; LANES],
            hit: 0,
            on_edge: 0,
            near_start: 0,
            near_end: 0,
        };
        for lane in 0..LANES {
            let relative = |axis: usize| block.vertices.map(|vertex| vertex[axis][lane] - ray.origin[axis]);
            let (px, py, pz) = (relative(kx), relative(ky), relative(kz));
            let x = [0, 1, 2].map(|i| px[i] - sx * pz[i]);
            let y = [0, 1, 2].map(|i| py[i] - sy * pz[i]);
            let e = [x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]];
            let lowest = min(min(e[0], e[1]), e[2]);
            let highest = max(max(e[0], e[1]), e[2]);
            if !(lowest >= 0.0 || highest <= 0.0) {
                continue;
            }
            let z = pz.map(|z| sz * z);
            let scale = 1.0 / (e[0] + e[1] + e[2]);
            let b = e.map(|e| e * scale);
            let t = z[0] + (b[1] * (z[1] - z[0]) + b[2] * (z[2] - z[0]));
            (found.t[lane], found.u[lane], found.v[lane]) = (t, b[1], b[2]);
            let bit = 1 << lane;
            found.on_edge |= if lowest == 0.0 || highest == 0.0 { bit } else { 0 };
            let nearest = min(min(z[0], z[1]), z[2]);
            let farthest = max(max(z[0], z[1]), z[2]);
            let near_start = nearest <= 0.0;
            let in_range = t >= ray.t_min && t <= t_max;
            found.hit |= if in_range { bit } else { 0 };
            found.near_start |= if near_start { bit } else { 0 };
            found.near_end |= if farthest >= t_max * NEARER { bit } else { 0 };
        }
        (found.hit | found.on_edge != 0).then_some(found)
    }

    fn prefetch<T>(self, _: &[T], _: usize) {}
}
