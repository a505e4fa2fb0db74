//! Memory layout of the trees, and the two instruction sets that traverse them.
//!
//! Both kernels perform the same IEEE operations in the same order and never fuse a multiplication with an addition,
//! so they agree in every bit.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod memory;
mod portable;
mod stack;

use super::ray::Prepared;
use super::twins::Twin;
use super::{Accel, Hit, Ray, walk};
pub(super) use memory::compact;
pub(super) use stack::{Entry, Stack};

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Triangles of a block.
pub(super) const LANES: usize = 4;
/// A triangle whose vertices are all nearer than this much of `t_max` ends before it for certain: each of them is off by
/// three roundings at most.
const NEARER: f32 = 1.0 - 4.0 * f32::EPSILON;
/// Marks a child that is a leaf: a block of triangles, or an instance.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight child boxes. A box that is not there is inside out.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// By axis, then lower and upper plane, then child.
    pub bounds: [[[f32; WIDTH]; 2]; 3],
    /// Index of the child's node, or [`LEAF`] and the index of its leaf.
    pub children: [u32; WIDTH],
}

impl Node {
    /// A node without children.
    pub const EMPTY: Self =
        Self { bounds: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [0; WIDTH] };
}

/// Up to four triangles. A lane that is not used holds NaN, which no test accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct TriangleBlock {
    /// By vertex, then axis, then lane.
    pub vertices: [[[f32; LANES]; 3]; 3],
    /// Index of the instance, meaningful in the baked tree only.
    pub instance: [u32; LANES],
    /// Index of the triangle in its mesh.
    pub triangle: [u32; LANES],
}

impl TriangleBlock {
    /// A block without triangles.
    pub const EMPTY: Self = Self {
        vertices: [[[f32::NAN; LANES]; 3]; 3],
        instance: [u32::MAX; LANES],
        triangle: [u32::MAX; LANES],
    };
}

/// An eight-wide tree over triangle blocks, or (then `blocks` is empty) over something that its owner keeps.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// The root comes first.
    pub nodes: Vec<Node>,
    pub blocks: Vec<TriangleBlock>,
    /// Triangles that others in `blocks` stand in for, in ascending order.
    pub twins: Vec<Twin>,
}

impl Tree {
    /// Heap memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
            + self.blocks.capacity() * size_of::<TriangleBlock>()
            + self.twins.capacity() * size_of::<Twin>()
    }
}

/// A placed mesh as traversal needs it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Instance {
    /// Columns of the linear part of world-to-mesh.
    pub to_mesh: [[f32; 3]; 3],
    /// World-space image of the mesh's origin.
    pub translation: [f32; 3],
    /// Index into the shared trees.
    pub tree: u32,
    /// Index of the instance in the input.
    pub id: u32,
}

/// What the test of one block of triangles found, by lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidates {
    pub t: [f32; LANES],
    pub u: [f32; LANES],
    pub v: [f32; LANES],
    /// Bits of the lanes that are hit, within the ray's limits.
    pub hit: u32,
    /// Bits of the lanes where an area came out as zero, so that [`super::ray::exact_test`] must decide.
    pub on_edge: u32,
    /// Bits of the lanes whose triangle is not entirely in front of the origin, and so of doubtful `t`.
    pub near_start: u32,
    /// Bits of the lanes whose triangle is not entirely nearer than `t_max`.
    pub near_end: u32,
}

/// The two tests that traversal is made of.
pub(super) trait Kernel: Copy {
    /// A ray as the kernel likes it.
    type Lanes: Copy;

    fn lanes(self, ray: &Prepared) -> Self::Lanes;

    /// Bits of the children whose box the ray may meet before `t_max`, and where it enters each.
    fn boxes(self, ray: &Self::Lanes, node: &Node, t_max: f32, entry: &mut [f32; WIDTH]) -> u32;

    /// Tests four triangles. None if no lane is hit or on an edge.
    fn triangles(self, ray: &Prepared, block: &TriangleBlock, t_max: f32) -> Option<Candidates>;

    /// Asks the processor to fetch what a child points to.
    fn prefetch<T>(self, items: &[T], index: usize);
}

/// The instruction set to use, chosen once when a structure is built.
#[derive(Clone, Copy, Debug)]
pub(super) enum Isa {
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Avx2),
    Portable,
}

impl Isa {
    /// The best that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(avx2) = avx2::Avx2::detect() {
            return Self::Avx2(avx2);
        }
        Self::Portable
    }
}

#[inline]
pub(super) fn closest<F: Fn(&Hit) -> bool>(isa: Isa, accel: &Accel, ray: &Ray, accept: &F) -> Option<Hit> {
    match isa {
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2(avx2) => avx2.closest(accel, ray, accept),
        Isa::Portable => walk::closest(portable::Portable, accel, ray, accept),
    }
}

#[inline]
pub(super) fn occluded<F: Fn(&Hit) -> bool>(isa: Isa, accel: &Accel, ray: &Ray, accept: &F) -> bool {
    match isa {
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2(avx2) => avx2.occluded(accel, ray, accept),
        Isa::Portable => walk::occluded(portable::Portable, accel, ray, accept),
    }
}
