//! The binary tree: its shape is obvhs's, its boxes are exact.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::geometry::Bounds;

/// A subtree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Subtree {
    pub bounds: Bounds,
    /// Number of primitives in it.
    pub size: u32,
    /// The primitive, if there is one; else the index of the first child, with the second next to it.
    pub first: u32,
}

/// By how much boxes may grow against their size while the shape of the tree is found, at most.
const GROWTH: f32 = 1e-3;

/// Share of the nodes that the first round of reinsertion tries to place better.
const REINSERTED: f32 = 0.1;

/// Boxes that overlap so much that a line meets more than this share of them, of many, gain nothing by reinsertion, which
/// would take quadratic time.
const MOST_OVERLAP: f32 = 0.02;
const MANY: usize = 10_000;

/// The subtrees of a binary tree over `boxes`, of which there is at least one; the first is the whole.
pub(super) fn binary_tree(boxes: &[Bounds]) -> Vec<Subtree> {
    let shape = shape(boxes);
    let mut parents_first = Vec::with_capacity(shape.nodes.len());
    let mut pending = vec![0];
    while let Some(index) = pending.pop() {
        parents_first.push(index);
        let node = &shape.nodes[index as usize];
        if !node.is_leaf() {
            pending.extend([node.first_index, node.first_index + 1]);
        }
    }
    let nothing = Subtree { bounds: Bounds::EMPTY, size: 0, first: 0 };
    let mut subtrees = vec![nothing; shape.nodes.len()];
    for &index in parents_first.iter().rev() {
        let node = &shape.nodes[index as usize];
        let first = node.first_index;
        subtrees[index as usize] = if node.is_leaf() {
            Subtree { bounds: boxes[first as usize], size: 1, first }
        } else {
            let (a, b) = (&subtrees[first as usize], &subtrees[first as usize + 1]);
            Subtree { bounds: a.bounds.union(b.bounds), size: a.size + b.size, first }
        };
    }
    subtrees
}

/// Parallel locally-ordered clustering (Meister and Bittner 2018), improved by parallel reinsertion (2018). Leaves hold
/// one primitive each, by its own index.
fn shape(boxes: &[Bounds]) -> Bvh2 {
    let boxes: Vec<_> = boxes.par_iter().enumerate().map(|(i, b)| without_ties(i as u32, b)).collect();
    let indices = (0..boxes.len() as u32).collect();
    // A builder with capacity would count the world's origin among the boxes.
    let mut tree =
        PlocBuilder::new().build(PlocSearchDistance::Medium, &boxes, indices, SortPrecision::U64, 3);
    if boxes.len() < MANY || overlap(&tree, &boxes) <= MOST_OVERLAP {
        ReinsertionOptimizer::default().run(&mut tree, REINSERTED, None);
    }
    tree
}

/// The share of `boxes` that a random line through all of them meets: the mean of their areas by that of the whole.
fn overlap(tree: &Bvh2, boxes: &[Aabb]) -> f32 {
    // Averaged in a fixed order, whatever the number of threads.
    let means: Vec<f32> = boxes
        .par_chunks(1 << 12)
        .map(|chunk| chunk.iter().map(Aabb::half_area).sum::<f32>() / boxes.len() as f32)
        .collect();
    means.iter().sum::<f32>() / tree.nodes[0].aabb().half_area()
}

/// The box, grown by a random amount on each side.
///
/// Clustering merges two neighbours if each is the other's best partner. Where boxes are equal, evenly spaced or nested,
/// hardly any two agree, and the time becomes quadratic; a little disorder brings them together.
fn without_ties(index: u32, bounds: &Bounds) -> Aabb {
    let size = (bounds.max - bounds.min).max_element();
    let grow = |side: u32, at: f32| {
        let random = hash(index, side) as f32 / u32::MAX as f32;
        random * (GROWTH * size + 4.0 * f32::EPSILON * at.abs())
    };
    let min = [0, 1, 2].map(|axis| bounds.min[axis] - grow(axis as u32, bounds.min[axis]));
    let max = [0, 1, 2].map(|axis| bounds.max[axis] + grow(axis as u32 + 3, bounds.max[axis]));
    Aabb::new(Vec3A::from_array(min), Vec3A::from_array(max))
}

/// A few random bits from two numbers.
fn hash(a: u32, b: u32) -> u32 {
    let mut x = a.wrapping_mul(0x9E37_79B9) ^ b.wrapping_mul(0x85EB_CA6B);
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}
