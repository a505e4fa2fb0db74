//! Choice among bounded emitters in proportion to an estimate of what they send to a receiver.
//!
//! Conty Estevez and Kulla 2018, in the form of pbrt-v4, section 12.6.3: one path from the root to a
//! leaf, choosing between two children by their importance.

use super::bounds::LightBounds;
use super::sample::Receiver;
use super::tree::{Content, Item, build};
use glam::Vec3;

/// A light tree.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// For each emitter, the turns from the root to its leaf, the first one lowest; [`ABSENT`] where it
    /// is not in the tree.
    trails: Vec<Trail>,
    /// Intensity of a node's unit, W/sr.
    unit: f64,
}

#[derive(Clone, Copy, Debug)]
struct Trail {
    /// A set bit is a turn to the second child.
    turns: u64,
    /// Depth of the leaf; [`ABSENT`] for no leaf.
    depth: u8,
}

const ABSENT: u8 = u8::MAX;

#[derive(Clone, Copy, Debug)]
struct Node {
    /// The sphere around the box.
    center: Vec3,
    radius2: f32,
    axis: Vec3,
    cos_normals: f32,
    sin_normals: f32,
    cos_emission: f32,
    /// In units of the tree; negative for a node that shines to both sides.
    intensity: f32,
    content: Content,
}

/// Tolerance of a cosine: what is nearer than this to a bound counts as within it, so that rounding
/// cannot take away an emitter that contributes.
const SLACK: f32 = 1e-3;
/// Smallest probability of a child that can contribute: bounds the harm of a wrong estimate.
const SMALLEST_SHARE: f64 = 1e-3;

impl LightTree {
    /// A tree over some of `count` emitters. Those of no intensity are left out.
    pub fn new(items: impl Iterator<Item = (u32, LightBounds)>, count: usize) -> Self {
        let mut items: Vec<Item> = items
            .filter(|(_, bounds)| bounds.intensity > 0.0)
            .map(|(emitter, bounds)| Item { bounds, emitter })
            .collect();
        let unit = items.iter().map(|i| i.bounds.intensity).fold(0.0, f64::max);
        for item in &mut items {
            // relative to the brightest: sums then fit single precision whatever the unit
            item.bounds.intensity = (item.bounds.intensity / unit).max(1e-30);
        }
        let built = build(&mut items);
        let nodes = built.iter().map(|n| {
            let LightBounds { cone, intensity, .. } = n.bounds;
            let center = n.bounds.center();
            let radius2 = (n.bounds.max - center).length_squared();
            let intensity = if cone.two_sided { -intensity } else { intensity } as f32;
            let (axis, cos_normals, cos_emission) = (cone.axis, cone.cos_normals, cone.cos_emission);
            let sin_normals = sine(cos_normals);
            Node {
                center,
                radius2,
                axis,
                cos_normals,
                sin_normals,
                cos_emission,
                intensity,
                content: n.content,
            }
        });
        let mut tree =
            Self { nodes: nodes.collect(), trails: vec![Trail { turns: 0, depth: ABSENT }; count], unit };
        tree.note_trails();
        tree
    }

    fn note_trails(&mut self) {
        let mut open = vec![(0u32, Trail { turns: 0, depth: 0 })];
        if self.nodes.is_empty() {
            open.clear();
        }
        while let Some((node, trail)) = open.pop() {
            match self.nodes[node as usize].content {
                Content::Leaf(emitter) => self.trails[emitter as usize] = trail,
                Content::Inner(right) => {
                    let depth = trail.depth + 1;
                    open.push((node + 1, Trail { depth, ..trail }));
                    open.push((right, Trail { turns: trail.turns | 1 << trail.depth, depth }));
                }
            }
        }
    }

    /// Estimate of the irradiance that all emitters together send to a receiver; zero where they cannot
    /// send any.
    pub fn importance(&self, receiver: &Receiver) -> f64 {
        self.nodes.first().map_or(0.0, |root| root.importance(receiver)) * self.unit
    }

    /// Chooses an emitter: its index, its probability, and `u` made uniform again. `None` where none can
    /// contribute.
    pub fn select(&self, receiver: &Receiver, mut u: f64) -> Option<(u32, f64, f64)> {
        let mut probability = 1.0;
        let mut current = 0;
        loop {
            match self.nodes.get(current as usize)?.content {
                Content::Leaf(emitter) => return Some((emitter, probability, u)),
                Content::Inner(right) => {
                    let first = self.share(current, right, receiver)?;
                    if u < first {
                        (current, u, probability) = (current + 1, u / first, probability * first);
                    } else {
                        u = (u - first) / (1.0 - first);
                        (current, probability) = (right, probability * (1.0 - first));
                    }
                }
            }
        }
    }

    /// Probability with which [`LightTree::select`] chooses an emitter.
    pub fn probability(&self, receiver: &Receiver, emitter: u32) -> f64 {
        let Some(trail) = self.trails.get(emitter as usize).filter(|t| t.depth != ABSENT) else { return 0.0 };
        let (mut probability, mut current, mut turns) = (1.0, 0, trail.turns);
        while let Some(Node { content: Content::Inner(right), .. }) = self.nodes.get(current as usize) {
            let Some(first) = self.share(current, *right, receiver) else { return 0.0 };
            if turns & 1 == 0 {
                (current, probability) = (current + 1, probability * first);
            } else {
                (current, probability) = (*right, probability * (1.0 - first));
            }
            turns >>= 1;
        }
        probability
    }

    /// Probability of the first child of a node; `None` where neither contributes.
    #[inline]
    fn share(&self, node: u32, right: u32, receiver: &Receiver) -> Option<f64> {
        let a = self.nodes[node as usize + 1].importance(receiver);
        let b = self.nodes[right as usize].importance(receiver);
        match (a > 0.0, b > 0.0) {
            (false, false) => None,
            (true, false) => Some(1.0),
            (false, true) => Some(0.0),
            (true, true) => Some((a / (a + b)).clamp(SMALLEST_SHARE, 1.0 - SMALLEST_SHARE)),
        }
    }
}

impl Node {
    /// Estimate of the irradiance in units of the tree per area; zero only where nothing can arrive.
    #[inline]
    fn importance(&self, receiver: &Receiver) -> f64 {
        let to = self.center - receiver.position;
        let (radius2, distance2) = (self.radius2, to.length_squared());
        let intensity = self.intensity.abs();
        // from within the sphere around the box everything may come from everywhere
        if distance2 <= radius2 * 1.0001 {
            // one emitter fills its box; of many, the mean of 1/d^2 over a ball of the volume of a cube
            // counts: 6/r^2 in its middle
            let least = if matches!(self.content, Content::Leaf(_)) { radius2 } else { radius2 / 6.0 };
            return intensity as f64 / distance2.max(least).max(f32::MIN_POSITIVE) as f64;
        }
        let direction = to / distance2.sqrt();
        let sin2_b = (radius2 / distance2).min(1.0);
        let (sin_b, cos_b) = (sin2_b.sqrt(), (1.0 - sin2_b).sqrt());
        let mut cos_w = -direction.dot(self.axis);
        if self.intensity < 0.0 {
            cos_w = cos_w.abs();
        }
        // the least angle to a normal of any point towards the receiver
        let (cos_a, sin_a) = reduce(cos_w, sine(cos_w), self.cos_normals, self.sin_normals);
        let (cos, _) = reduce(cos_a, sin_a, cos_b, sin_b);
        if cos < self.cos_emission - SLACK {
            return 0.0;
        }
        let mut weight = cos.max(SLACK);
        if let Some(n) = receiver.normal {
            let cos_i = direction.dot(n);
            let (cos, _) = reduce(cos_i, sine(cos_i), cos_b, sin_b);
            if cos < -SLACK {
                return 0.0;
            }
            weight *= cos.max(SLACK);
        }
        intensity as f64 * weight as f64 / distance2 as f64
    }
}

fn sine(cos: f32) -> f32 {
    (1.0 - cos * cos).max(0.0).sqrt()
}

/// Cosine and sine of the angle `a - b`, or of zero where that is negative.
#[inline]
fn reduce(cos_a: f32, sin_a: f32, cos_b: f32, sin_b: f32) -> (f32, f32) {
    if cos_a >= cos_b {
        return (1.0, 0.0);
    }
    (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b)
}
