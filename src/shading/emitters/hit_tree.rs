//! Which lights a ray may meet.

use super::bounds::{Cone, LightBounds};
use super::tree::{Content, Item, MAX_DEPTH, build};
use glam::{Vec3, Vec3A};

/// A bounding volume hierarchy over analytic lights, for rays that want all of them.
#[derive(Clone, Debug)]
pub(super) struct HitTree {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: Vec3A,
    max: Vec3A,
    content: Content,
}

impl HitTree {
    /// A tree over lights, given their boxes.
    pub fn new(lights: impl Iterator<Item = (u32, Vec3, Vec3)>) -> Self {
        let item = |(emitter, min, max): (u32, Vec3, Vec3)| {
            // lights are met in double precision: keep rounding from cutting them off
            let pad = min.abs().max(max.abs()) * 4e-7 + f32::MIN_POSITIVE;
            let bounds =
                LightBounds { min: min - pad, max: max + pad, cone: Cone::EVERYWHERE, intensity: 1.0 };
            Item { bounds, emitter }
        };
        let mut items: Vec<Item> = lights.map(item).collect();
        let nodes = build(&mut items);
        let node = |n: &super::tree::BuiltNode| Node {
            min: n.bounds.min.into(),
            max: n.bounds.max.into(),
            content: n.content,
        };
        Self { nodes: nodes.iter().map(node).collect() }
    }

    /// Calls `candidate` with every light whose box the ray meets before `t_max`.
    #[inline]
    pub fn for_each(&self, origin: Vec3, direction: Vec3, t_max: f32, mut candidate: impl FnMut(u32)) {
        if self.nodes.is_empty() {
            return;
        }
        let origin = Vec3A::from(origin);
        // a huge slope in place of an infinite one: zero times it is not NaN
        let inverse = Vec3A::from(direction).recip().clamp(Vec3A::splat(-1e30), Vec3A::splat(1e30));
        let mut stack = [0u32; MAX_DEPTH + 1];
        let (mut top, mut current) = (0, 0u32);
        loop {
            let node = &self.nodes[current as usize];
            if node.is_met(origin, inverse, t_max) {
                match node.content {
                    Content::Leaf(emitter) => candidate(emitter),
                    Content::Inner(right) => {
                        stack[top] = right;
                        top += 1;
                        current += 1;
                        continue;
                    }
                }
            }
            if top == 0 {
                return;
            }
            top -= 1;
            current = stack[top];
        }
    }
}

impl Node {
    #[inline]
    fn is_met(&self, origin: Vec3A, inverse: Vec3A, t_max: f32) -> bool {
        let (a, b) = ((self.min - origin) * inverse, (self.max - origin) * inverse);
        let near = a.min(b).max_element();
        let far = a.max(b).min_element();
        near <= far * 1.000_001 && far >= 0.0 && near <= t_max
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash_unit;
    use crate::math::warp::uniform_sphere;
    use glam::Vec2;

    fn boxes(n: u32) -> Vec<(u32, Vec3, Vec3)> {
        let v = |i: u32, d: u32| Vec3::new(hash_unit(i, d), hash_unit(i, d + 1), hash_unit(i, d + 2));
        (0..n)
            .map(|i| {
                let c = v(i, 0) * 10.0;
                // some flat, some coincident
                let half = v(i, 3) * Vec3::new(0.5, 0.5, (i % 3) as f32 * 0.2);
                if i % 7 == 0 { (i, Vec3::ONE, Vec3::splat(1.5)) } else { (i, c - half, c + half) }
            })
            .collect()
    }

    #[test]
    fn finds_what_a_loop_finds() {
        for n in [0, 1, 2, 3, 500] {
            let boxes = boxes(n);
            let tree = HitTree::new(boxes.iter().copied());
            for i in 0..2000 {
                let o = Vec3::new(hash_unit(i, 20), hash_unit(i, 21), hash_unit(i, 22)) * 10.0;
                let mut d = uniform_sphere(Vec2::new(hash_unit(i, 23), hash_unit(i, 24)));
                if i % 5 == 0 {
                    d = if i % 2 == 0 { Vec3::X } else { Vec3::NEG_Z };
                }
                let t_max = hash_unit(i, 25) * 12.0;
                let mut found = Vec::new();
                tree.for_each(o, d, t_max, |e| found.push(e));
                found.sort_unstable();
                for b in &boxes {
                    let node = Node { min: b.1.into(), max: b.2.into(), content: Content::Leaf(0) };
                    if node.is_met(
                        o.into(),
                        d.recip().clamp(Vec3::splat(-1e30), Vec3::splat(1e30)).into(),
                        t_max,
                    ) {
                        assert!(found.binary_search(&b.0).is_ok(), "ray {i} misses box {}", b.0);
                    }
                }
                assert!(found.len() <= boxes.len());
            }
        }
    }
}
