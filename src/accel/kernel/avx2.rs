//! The kernel for x86-64 processors with AVX2.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::super::ray::Prepared;
use super::super::{Accel, Hit, Ray, walk};
use super::{Candidates, Kernel, LANES, NEARER, Node, TriangleBlock, WIDTH};

/// Proof that the processor has AVX2: only [`Avx2::detect`] makes one.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Avx2(());

impl Avx2 {
    /// Some if the processor has AVX2.
    pub fn detect() -> Option<Self> {
        is_x86_feature_detected!("avx2").then_some(Self(()))
    }

    #[inline]
    pub fn closest<F: Fn(&Hit) -> bool>(self, accel: &Accel, ray: &Ray, accept: &F) -> Option<Hit> {
        #[target_feature(enable = "avx2")]
        fn enabled<F: Fn(&Hit) -> bool>(kernel: Avx2, accel: &Accel, ray: &Ray, accept: &F) -> Option<Hit> {
            walk::closest(kernel, accel, ray, accept)
        }
        // SAFETY: `self` proves that AVX2 is there.
        unsafe { enabled(self, accel, ray, accept) }
    }

    #[inline]
    pub fn occluded<F: Fn(&Hit) -> bool>(self, accel: &Accel, ray: &Ray, accept: &F) -> bool {
        #[target_feature(enable = "avx2")]
        fn enabled<F: Fn(&Hit) -> bool>(kernel: Avx2, accel: &Accel, ray: &Ray, accept: &F) -> bool {
            walk::occluded(kernel, accel, ray, accept)
        }
        // SAFETY: `self` proves that AVX2 is there.
        unsafe { enabled(self, accel, ray, accept) }
    }
}

/// A ray spread over eight lanes.
#[derive(Clone, Copy)]
pub(in super::super) struct Lanes {
    origin: [__m256; 3],
    inv_near: [__m256; 3],
    inv_far: [__m256; 3],
    t_min: __m256,
    negative: [usize; 3],
}

/// One vertex of four triangles as the ray sees it: relative to its origin, and sheared so that it runs along `z`.
#[derive(Clone, Copy)]
struct Sheared {
    x: __m128,
    y: __m128,
    /// Before it is scaled.
    z: __m128,
}

impl Sheared {
    #[inline(always)]
    fn new(ray: &Prepared, vertex: &[[f32; LANES]; 3]) -> Self {
        let [kx, ky, kz] = ray.axes;
        // SAFETY: SSE is part of x86-64; each load reads an array of four.
        unsafe {
            let x = _mm_sub_ps(_mm_loadu_ps(vertex[kx].as_ptr()), _mm_set1_ps(ray.origin[kx]));
            let y = _mm_sub_ps(_mm_loadu_ps(vertex[ky].as_ptr()), _mm_set1_ps(ray.origin[ky]));
            let z = _mm_sub_ps(_mm_loadu_ps(vertex[kz].as_ptr()), _mm_set1_ps(ray.origin[kz]));
            Self {
                x: _mm_sub_ps(x, _mm_mul_ps(_mm_set1_ps(ray.shear[0]), z)),
                y: _mm_sub_ps(y, _mm_mul_ps(_mm_set1_ps(ray.shear[1]), z)),
                z,
            }
        }
    }

    /// Signed doubled area of the triangle that the vertex, the next one and the ray span.
    #[inline(always)]
    fn area(self, next: Self) -> __m128 {
        // SAFETY: SSE is part of x86-64.
        unsafe { _mm_sub_ps(_mm_mul_ps(self.x, next.y), _mm_mul_ps(self.y, next.x)) }
    }
}

// The methods are always inlined into the functions above, where AVX2 is enabled; each `unsafe` call of an intrinsic
// is sound because `self` proves that the processor has it.
impl Kernel for Avx2 {
    type Lanes = Lanes;

    #[inline(always)]
    fn lanes(self, ray: &Prepared) -> Lanes {
        let ([ox, oy, oz], [nx, ny, nz], [fx, fy, fz]) = (ray.origin, ray.inv_near, ray.inv_far);
        // No closures: they would not be compiled for AVX2.
        // SAFETY: AVX2 is there.
        unsafe {
            Lanes {
                origin: [_mm256_set1_ps(ox), _mm256_set1_ps(oy), _mm256_set1_ps(oz)],
                inv_near: [_mm256_set1_ps(nx), _mm256_set1_ps(ny), _mm256_set1_ps(nz)],
                inv_far: [_mm256_set1_ps(fx), _mm256_set1_ps(fy), _mm256_set1_ps(fz)],
                t_min: _mm256_set1_ps(ray.t_min),
                negative: ray.negative,
            }
        }
    }

    #[inline(always)]
    fn boxes(self, ray: &Lanes, node: &Node, t_max: f32, entry: &mut [f32; WIDTH]) -> u32 {
        // SAFETY: AVX2 is there; every load reads one array of eight, which 32 divides the address of because the
        // node is aligned to 64 bytes and the planes come first; the store writes an array of eight.
        unsafe {
            let mut near = ray.t_min;
            let mut far = _mm256_set1_ps(t_max);
            for axis in 0..3 {
                let planes = &node.bounds[axis];
                let enters = _mm256_load_ps(planes[ray.negative[axis] & 1].as_ptr());
                let leaves = _mm256_load_ps(planes[(ray.negative[axis] & 1) ^ 1].as_ptr());
                // The operand that may be NaN (zero times infinity) comes first: then the second is taken.
                near = _mm256_max_ps(
                    _mm256_mul_ps(_mm256_sub_ps(enters, ray.origin[axis]), ray.inv_near[axis]),
                    near,
                );
                far = _mm256_min_ps(
                    _mm256_mul_ps(_mm256_sub_ps(leaves, ray.origin[axis]), ray.inv_far[axis]),
                    far,
                );
            }
            _mm256_storeu_ps(entry.as_mut_ptr(), near);
            _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32
        }
    }

    #[inline(always)]
    fn triangles(self, ray: &Prepared, block: &TriangleBlock, t_max: f32) -> Option<Candidates> {
        let [a, b, c] = &block.vertices;
        let (a, b, c) = (Sheared::new(ray, a), Sheared::new(ray, b), Sheared::new(ray, c));
        // SAFETY: SSE is part of x86-64, and the stores write arrays of four.
        unsafe {
            let (ea, eb, ec) = (b.area(c), c.area(a), a.area(b));
            let zero = _mm_setzero_ps();
            let lowest = _mm_min_ps(_mm_min_ps(ea, eb), ec);
            let highest = _mm_max_ps(_mm_max_ps(ea, eb), ec);
            let inside = _mm_or_ps(_mm_cmpge_ps(lowest, zero), _mm_cmple_ps(highest, zero));
            if _mm_movemask_ps(inside) == 0 {
                return None;
            }
            let scale = _mm_set1_ps(ray.shear[2]);
            let (za, zb, zc) = (_mm_mul_ps(scale, a.z), _mm_mul_ps(scale, b.z), _mm_mul_ps(scale, c.z));
            let scale = _mm_div_ps(_mm_set1_ps(1.0), _mm_add_ps(_mm_add_ps(ea, eb), ec));
            let (u, v) = (_mm_mul_ps(eb, scale), _mm_mul_ps(ec, scale));
            let slopes = _mm_add_ps(_mm_mul_ps(u, _mm_sub_ps(zb, za)), _mm_mul_ps(v, _mm_sub_ps(zc, za)));
            let t = _mm_add_ps(za, slopes);
            let nearest = _mm_min_ps(_mm_min_ps(za, zb), zc);
            let farthest = _mm_max_ps(_mm_max_ps(za, zb), zc);
            let near_start = _mm_cmple_ps(nearest, zero);
            let in_range =
                _mm_and_ps(_mm_cmpge_ps(t, _mm_set1_ps(ray.t_min)), _mm_cmple_ps(t, _mm_set1_ps(t_max)));
            let is_zero = _mm_or_ps(_mm_cmpeq_ps(lowest, zero), _mm_cmpeq_ps(highest, zero));
            let hit = _mm_movemask_ps(_mm_and_ps(inside, in_range)) as u32;
            let on_edge = _mm_movemask_ps(_mm_and_ps(inside, is_zero)) as u32;
            if hit | on_edge == 0 {
                return None;
            }
            let mut found = Candidates {
                t: [0.0; LANES],
                u: [0.0; LANES],
                v: [0.0; LANES],
                hit,
                on_edge,
                near_start: _mm_movemask_ps(near_start) as u32,
                near_end: _mm_movemask_ps(_mm_cmpge_ps(farthest, _mm_set1_ps(t_max * NEARER))) as u32,
            };
            _mm_storeu_ps(found.t.as_mut_ptr(), t);
            _mm_storeu_ps(found.u.as_mut_ptr(), u);
            _mm_storeu_ps(found.v.as_mut_ptr(), v);
            Some(found)
        }
    }

    #[inline(always)]
    fn prefetch<T>(self, items: &[T], index: usize) {
        let address = items.as_ptr().wrapping_add(index).cast::<i8>();
        for line in 0..size_of::<T>().div_ceil(64) {
            // SAFETY: SSE is part of x86-64, and a prefetch may be given any address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64 * line)) }
        }
    }
}
