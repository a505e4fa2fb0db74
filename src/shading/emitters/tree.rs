//! Builds binary trees over emitters, top down, by the surface area orientation heuristic. With cones
//! and intensities all alike it is the surface area heuristic.

use super::bounds::LightBounds;
use glam::Vec3;

/// An emitter to put into a tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub bounds: LightBounds,
    pub emitter: u32,
}

/// What a node of a tree holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// One emitter.
    Leaf(u32),
    /// Two children: the next node, and the node at this index.
    Inner(u32),
}

/// A node of a tree, in depth-first order.
#[derive(Clone, Copy, Debug)]
pub(super) struct BuiltNode {
    pub bounds: LightBounds,
    pub content: Content,
}

/// Depth from which on halves are split by number: with fewer than 2^31 items no tree is deeper than 63.
const BALANCED_FROM: u32 = 32;
/// Greatest depth of a leaf below the root.
pub(super) const MAX_DEPTH: usize = 63;
/// Items from which on only the longest axis is tried.
const ONE_AXIS_FROM: usize = 256;
/// Items from which on the two halves are built in parallel.
const PARALLEL_FROM: usize = 4096;
const BINS: usize = 12;

/// A tree over `items`, which are reordered. Empty where there are none.
pub(super) fn build(items: &mut [Item]) -> Vec<BuiltNode> {
    let Some(first) = items.first() else { return Vec::new() };
    let placeholder = BuiltNode { bounds: first.bounds, content: Content::Leaf(0) };
    let mut nodes = vec![placeholder; 2 * items.len() - 1];
    build_range(items, &mut nodes, 0, 0);
    nodes
}

/// Fills `nodes`, whose first has index `base`, with the tree over `items`.
fn build_range(items: &mut [Item], nodes: &mut [BuiltNode], base: u32, depth: u32) {
    if let [item] = items {
        nodes[0] = BuiltNode { bounds: item.bounds, content: Content::Leaf(item.emitter) };
        return;
    }
    let middle = split(items, depth);
    let (left, right) = items.split_at_mut(middle);
    let (node, rest) = nodes.split_at_mut(1);
    let (left_nodes, right_nodes) = rest.split_at_mut(2 * left.len() - 1);
    let right_base = base + 2 * left.len() as u32;
    let in_parallel = left.len() + right.len() >= PARALLEL_FROM;
    let mut build_left = || build_range(left, left_nodes, base + 1, depth + 1);
    let mut build_right = || build_range(right, right_nodes, right_base, depth + 1);
    if in_parallel {
        rayon::join(build_left, build_right);
    } else {
        build_left();
        build_right();
    }
    node[0] = BuiltNode {
        bounds: left_nodes[0].bounds.union(&right_nodes[0].bounds),
        content: Content::Inner(right_base),
    };
}

/// Reorders items into two parts that are not empty; where the second one starts.
fn split(items: &mut [Item], depth: u32) -> usize {
    if items.len() == 2 {
        return 1;
    }
    let centers = items.iter().map(|i| i.bounds.center());
    let (low, high) = centers.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), c| (l.min(c), h.max(c)));
    let extent = high - low;
    let longest = extent.max_position();
    let best = match depth < BALANCED_FROM && extent.max_element() > 0.0 {
        false => None,
        true if items.len() >= ONE_AXIS_FROM => best_split(items, longest, low, extent),
        true => (0..3)
            .filter_map(|axis| best_split(items, axis, low, extent))
            .min_by(|a, b| a.cost.total_cmp(&b.cost)),
    };
    if let Some(s) = best {
        let mut middle = 0;
        for i in 0..items.len() {
            if bin(&items[i], s.axis, low, extent) <= s.bin {
                items.swap(i, middle);
                middle += 1;
            }
        }
        return middle;
    }
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let key = |i: &Item| i.bounds.center()[longest];
        key(a).total_cmp(&key(b)).then(a.emitter.cmp(&b.emitter))
    });
    middle
}

struct Split {
    cost: f32,
    axis: usize,
    /// Last bin of the first part.
    bin: usize,
}

fn bin(item: &Item, axis: usize, low: Vec3, extent: Vec3) -> usize {
    let t = (item.bounds.center()[axis] - low[axis]) / extent[axis];
    ((t * BINS as f32) as usize).min(BINS - 1)
}

/// The cheapest split between two bins of one axis; `None` where all items are in one bin.
fn best_split(items: &[Item], axis: usize, low: Vec3, extent: Vec3) -> Option<Split> {
    if extent[axis] <= 0.0 {
        return None;
    }
    let mut bins: [Option<LightBounds>; BINS] = [None; BINS];
    for item in items {
        grow(&mut bins[bin(item, axis, low, extent)], &item.bounds);
    }
    let mut above: [Option<LightBounds>; BINS] = [None; BINS];
    let mut sum = None;
    for i in (1..BINS).rev() {
        if let Some(b) = &bins[i] {
            grow(&mut sum, b);
        }
        above[i - 1] = sum;
    }
    // thin slices across a long box are not worth their light (the heuristic's factor K_r)
    let shape = extent.max_element() / extent[axis];
    let mut below = None;
    let mut best: Option<Split> = None;
    for i in 0..BINS - 1 {
        // an empty bin moves nothing across
        let Some(b) = &bins[i] else { continue };
        grow(&mut below, b);
        if let (Some(a), Some(b)) = (&below, &above[i]) {
            let cost = shape * (cost(a) + cost(b));
            if best.as_ref().is_none_or(|s| cost < s.cost) {
                best = Some(Split { cost, axis, bin: i });
            }
        }
    }
    best
}

fn grow(sum: &mut Option<LightBounds>, b: &LightBounds) {
    *sum = Some(sum.map_or(*b, |s| s.union(b)));
}

fn cost(b: &LightBounds) -> f32 {
    let d = b.max - b.min;
    // the squared diagonal ranks what lies on a line or is of no extent, where the area is zero
    let area = d.x * d.y + d.y * d.z + d.z * d.x + 0.01 * d.length_squared();
    b.intensity as f32 * b.cone.measure() * area
}
