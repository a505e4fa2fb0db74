//! The eight-wide trees, collapsed from binary ones.

use rayon::prelude::*;

use super::binary::{Subtree, binary_tree};
use super::geometry::{Bounds, Triangle};
use super::kernel::{LANES, LEAF, Node, Tree, TriangleBlock, WIDTH, compact};
use super::twins::take_twins;

/// Tree over triangles, in blocks of up to four. None without triangles.
pub(super) fn triangle_tree(mut triangles: Vec<Triangle>) -> Option<Tree> {
    let twins = take_twins(&mut triangles);
    let boxes: Vec<_> = triangles.par_iter().map(Triangle::bounds).collect();
    let mut blocks = Vec::with_capacity(triangles.len() / 3);
    let nodes = wide_tree(&boxes, LANES as u32, |members| {
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
    Some(Tree { nodes, blocks: compact(blocks), twins })
}

/// Tree whose leaves hold one box each. Returns with it the boxes' order of leaves. None without boxes.
pub(super) fn box_tree(boxes: &[Bounds]) -> Option<(Tree, Vec<u32>)> {
    let mut order = Vec::with_capacity(boxes.len());
    let nodes = wide_tree(boxes, 1, |members| {
        order.push(members[0]);
        order.len() as u32 - 1
    })?;
    Some((Tree { nodes, ..Tree::default() }, order))
}

/// Builds the eight-wide tree; `leaf` is called with the members of each leaf and returns its index.
fn wide_tree(boxes: &[Bounds], leaf_size: u32, mut leaf: impl FnMut(&[u32]) -> u32) -> Option<Vec<Node>> {
    if boxes.is_empty() {
        return None;
    }
    let subtrees = binary_tree(boxes);
    let mut nodes = vec![Node::EMPTY];
    // Binary subtree, and the wide node it becomes.
    let mut pending = vec![(0u32, 0usize)];
    let mut members = Vec::new();
    while let Some((root, wide)) = pending.pop() {
        let (children, count) = choose_children(&subtrees, root, leaf_size);
        for (slot, &child) in children[..count].iter().enumerate() {
            let subtree = &subtrees[child as usize];
            for axis in 0..3 {
                nodes[wide].bounds[axis][0][slot] = subtree.bounds.min[axis];
                nodes[wide].bounds[axis][1][slot] = subtree.bounds.max[axis];
            }
            nodes[wide].children[slot] = if subtree.size <= leaf_size {
                gather(&subtrees, child, &mut members);
                leaf(&members) | LEAF
            } else {
                nodes.push(Node::EMPTY);
                pending.push((child, nodes.len() - 1));
                nodes.len() as u32 - 1
            };
        }
    }
    Some(compact(nodes))
}

/// The binary subtrees that become the children of the wide node for `root`: of those that do not fit a leaf, the largest
/// is opened until there are eight.
fn choose_children(subtrees: &[Subtree], root: u32, leaf_size: u32) -> ([u32; WIDTH], usize) {
    let mut children = [root; WIDTH];
    let mut count = 1;
    let area = |child: u32| subtrees[child as usize].bounds.half_area();
    while count < WIDTH {
        let largest = (0..count)
            .filter(|&slot| subtrees[children[slot] as usize].size > leaf_size)
            .max_by(|&a, &b| area(children[a]).total_cmp(&area(children[b])));
        let Some(slot) = largest else { break };
        let first = subtrees[children[slot] as usize].first;
        children[slot] = first;
        children[count] = first + 1;
        count += 1;
    }
    // Any-hit queries take the last child first: small boxes are most likely filled, and soonest done with.
    children[..count].sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    (children, count)
}

/// The primitives below `root`, in ascending order.
fn gather(subtrees: &[Subtree], root: u32, members: &mut Vec<u32>) {
    members.clear();
    let mut pending = vec![root];
    while let Some(index) = pending.pop() {
        let subtree = &subtrees[index as usize];
        if subtree.size == 1 {
            members.push(subtree.first);
        } else {
            pending.extend([subtree.first, subtree.first + 1]);
        }
    }
    members.sort_unstable();
}
