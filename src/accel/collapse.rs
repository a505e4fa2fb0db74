//! Binary tree by obvhs, collapsed into the eight-wide one.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::geometry::{Bounds, Triangle};
use super::kernel::{LANES, LEAF, Node, Tree, TriangleBlock, WIDTH, compact};
use super::twins::take_twins;

/// Tree over triangles, in blocks of up to four. None without triangles.
pub(super) fn triangle_tree(mut triangles: Vec<Triangle>) -> Option<Tree> {
    let twins = take_twins(&mut triangles);
    let boxes: Vec<_> = triangles.par_iter().map(Triangle::bounds).collect();
    let mut blocks = Vec::with_capacity(triangles.len() / 3);
    let mut tree = wide_tree(&boxes, LANES as u32, |members| {
        let mut block = TriangleBlock::EMPTY;
        for (lane, &member) in members.iter().enumerate() {
            let triangle = &triangles[member as usize];
            for (vertex, position) in triangle.positions.iter().enumerate() {
                for axis in 0..3 {
                    block.vertices[vertex][axis][lane] = position[axis];
                }
            }
            block.instance[lane] = triangle.instance;
            block.triangle[lane] = triangle.index;
        }
        blocks.push(block);
        blocks.len() as u32 - 1
    })?;
    tree.blocks = compact(blocks);
    tree.twins = twins;
    Some(tree)
}

/// Tree whose leaves hold one box each. Returns with it the boxes' order of leaves. None without boxes.
pub(super) fn box_tree(boxes: &[Bounds]) -> Option<(Tree, Vec<u32>)> {
    let mut order = Vec::with_capacity(boxes.len());
    let tree = wide_tree(boxes, 1, |members| {
        order.push(members[0]);
        order.len() as u32 - 1
    })?;
    Some((tree, order))
}

/// A few random bits from two numbers.
fn hash(a: u32, b: u32) -> u32 {
    let mut x = a.wrapping_mul(0x9E37_79B9) ^ b.wrapping_mul(0x85EB_CA6B);
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    x ^ (x >> 16)
}

/// The box, grown by up to a millionth of its size, each side by another amount.
///
/// The clustering of obvhs takes quadratic time on boxes that are equal or evenly spaced, because neighbours at equal
/// distance do not agree whom to merge with; this breaks the ties.
fn without_ties(index: u32, bounds: &Bounds) -> Aabb {
    let size = (bounds.max - bounds.min).max_element();
    let grow = |side: u32, at: f32| {
        let random = hash(index, side) as f32 / u32::MAX as f32;
        random * (1e-6 * size + 4.0 * f32::EPSILON * at.abs())
    };
    let min = [0, 1, 2].map(|axis| bounds.min[axis] - grow(axis as u32, bounds.min[axis]));
    let max = [0, 1, 2].map(|axis| bounds.max[axis] + grow(axis as u32 + 3, bounds.max[axis]));
    Aabb::new(Vec3A::from_array(min), Vec3A::from_array(max))
}

fn binary_tree(boxes: &[Bounds]) -> Bvh2 {
    let boxes: Vec<_> = boxes.par_iter().enumerate().map(|(i, b)| without_ties(i as u32, b)).collect();
    let indices = (0..boxes.len() as u32).collect();
    let mut binary =
        PlocBuilder::new().build(PlocSearchDistance::Medium, &boxes, indices, SortPrecision::U64, 3);
    ReinsertionOptimizer::default().run(&mut binary, 0.1, None);
    binary
}

/// Number of primitives below each node.
fn subtree_sizes(binary: &Bvh2) -> Vec<u32> {
    let mut parents_first = Vec::with_capacity(binary.nodes.len());
    let mut pending = vec![0];
    while let Some(index) = pending.pop() {
        parents_first.push(index);
        let node = &binary.nodes[index as usize];
        if !node.is_leaf() {
            pending.extend([node.first_index, node.first_index + 1]);
        }
    }
    let mut sizes = vec![0; binary.nodes.len()];
    for &index in parents_first.iter().rev() {
        let node = &binary.nodes[index as usize];
        let first = node.first_index as usize;
        sizes[index as usize] =
            if node.is_leaf() { node.prim_count } else { sizes[first] + sizes[first + 1] };
    }
    sizes
}

/// Builds the eight-wide tree; `leaf` is called with the members of each leaf and returns its index.
fn wide_tree(boxes: &[Bounds], leaf_size: u32, mut leaf: impl FnMut(&[u32]) -> u32) -> Option<Tree> {
    if boxes.is_empty() {
        return None;
    }
    let binary = binary_tree(boxes);
    let sizes = subtree_sizes(&binary);
    let mut nodes = vec![Node::EMPTY];
    // Binary subtree, and the wide node it becomes.
    let mut pending = vec![(0u32, 0usize)];
    let mut members = Vec::new();
    while let Some((root, wide)) = pending.pop() {
        let (children, count) = choose_children(&binary, &sizes, root, leaf_size);
        for (slot, &child) in children[..count].iter().enumerate() {
            let aabb = binary.nodes[child as usize].aabb();
            for axis in 0..3 {
                nodes[wide].bounds[axis][0][slot] = aabb.min[axis];
                nodes[wide].bounds[axis][1][slot] = aabb.max[axis];
            }
            nodes[wide].children[slot] = if sizes[child as usize] <= leaf_size {
                gather(&binary, child, &mut members);
                leaf(&members) | LEAF
            } else {
                nodes.push(Node::EMPTY);
                pending.push((child, nodes.len() - 1));
                nodes.len() as u32 - 1
            };
        }
    }
    Some(Tree { nodes: compact(nodes), blocks: Vec::new(), twins: Vec::new() })
}

/// The binary subtrees that become the children of the wide node for `root`: opens the largest until there are eight.
fn choose_children(binary: &Bvh2, sizes: &[u32], root: u32, leaf_size: u32) -> ([u32; WIDTH], usize) {
    let mut children = [root; WIDTH];
    let mut count = 1;
    while count < WIDTH {
        // Subtrees that do not fit a leaf come first: opening others only adds leaves.
        let worth = |child: u32| {
            let node = &binary.nodes[child as usize];
            let area = node.aabb().half_area();
            (!node.is_leaf()).then_some((sizes[child as usize] > leaf_size, area))
        };
        let best = (0..count)
            .filter_map(|slot| worth(children[slot]).filter(|w| w.0).map(|worth| (slot, worth.1)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((slot, _)) = best else { break };
        let first = binary.nodes[children[slot] as usize].first_index;
        children[slot] = first;
        children[count] = first + 1;
        count += 1;
    }
    children[..count].sort_by(|&b, &a| {
        binary.nodes[a as usize].aabb().half_area().total_cmp(&binary.nodes[b as usize].aabb().half_area())
    });
    (children, count)
}

/// The primitives below `root`, in ascending order.
fn gather(binary: &Bvh2, root: u32, members: &mut Vec<u32>) {
    members.clear();
    let mut pending = vec![root];
    while let Some(index) = pending.pop() {
        let node = &binary.nodes[index as usize];
        if node.is_leaf() {
            let first = node.first_index as usize;
            members.extend_from_slice(&binary.primitive_indices[first..first + node.prim_count as usize]);
        } else {
            pending.extend([node.first_index, node.first_index + 1]);
        }
    }
    members.sort_unstable();
}
