//! Choice among all emitters: bounded ones by a light tree, those at infinity by their irradiance.

use super::bounds::LightBounds;
use super::light_tree::LightTree;
use super::sample::{EmitterId, Receiver};
use crate::math::ONE_MINUS_EPSILON;
use crate::math::density::DiscreteProbability;
use crate::math::sampler::hash;
use glam::Vec3;

/// Chooses emitters for receivers.
#[derive(Clone, Debug)]
pub(super) struct Selector {
    tree: LightTree,
    infinite: Vec<Infinite>,
    /// The only emitter that sends anything.
    only: Option<EmitterId>,
}

/// What the choice needs to know of an emitter at infinity.
#[derive(Clone, Copy, Debug)]
pub(super) struct Infinite {
    pub id: EmitterId,
    /// Luminance of the irradiance of a surface that faces it.
    pub irradiance: f64,
    /// Unit direction towards it, and the sine of its half angle; `None` for what is all around.
    pub cone: Option<(Vec3, f32)>,
}

/// The least share of the choices that bounded emitters get next to those at infinity, and the reverse:
/// a single number for each side says little of what is hidden and what is near.
const LEAST_SIDE: f64 = 0.2;
/// Share of the choices among emitters at infinity that is dealt out evenly.
const EVEN: f64 = 0.1;

impl Selector {
    /// A selector over `count` emitters, of which the bounded ones have bounds.
    pub fn new(
        bounded: impl Iterator<Item = (u32, LightBounds)>,
        mut infinite: Vec<Infinite>,
        count: usize,
    ) -> Self {
        infinite.retain(|i| i.irradiance > 0.0);
        let bounded: Vec<_> = bounded.filter(|(_, b)| b.intensity > 0.0).collect();
        let only = match (bounded.as_slice(), infinite.as_slice()) {
            ([(emitter, _)], []) => Some(EmitterId(*emitter)),
            ([], [infinite]) => Some(infinite.id),
            _ => None,
        };
        Self { tree: LightTree::new(bounded.into_iter(), count), infinite, only }
    }

    /// How the choice divides; `None` where nothing contributes at all.
    fn sides(&self, receiver: &Receiver) -> Option<Sides> {
        if self.infinite.is_empty() {
            // the tree itself says whether something contributes
            return Some(Sides { bounded: 1.0, far: 0.0, even: 0.0 });
        }
        let near = self.tree.importance(receiver);
        let (mut far, mut alive) = (0.0, 0);
        for importance in self.infinite.iter().map(|i| i.importance(receiver)).filter(|&i| i > 0.0) {
            far += importance;
            alive += 1;
        }
        let bounded = match (near > 0.0, far > 0.0) {
            (false, false) => return None,
            (true, false) => 1.0,
            (false, true) => 0.0,
            (true, true) => (near / (near + far)).clamp(LEAST_SIDE, 1.0 - LEAST_SIDE),
        };
        Some(Sides { bounded, far, even: EVEN / alive as f64 })
    }

    /// Chooses an emitter: which, its probability, and `u` made uniform again.
    pub fn select(&self, receiver: &Receiver, u: f32) -> Option<(EmitterId, DiscreteProbability, f32)> {
        if let Some(only) = self.only {
            return Some((only, DiscreteProbability(1.0), u));
        }
        let sides = self.sides(receiver)?;
        let near = sides.bounded;
        // a deep tree uses up the 24 bits of a unit number: append others
        let mut u = u as f64 + hash(u.to_bits(), 0x11e7) as f64 * 2f64.powi(-56);
        if u < near {
            let (emitter, p, u) = self.tree.select(receiver, u / near)?;
            return Some((EmitterId(emitter), DiscreteProbability((near * p) as f32), single(u)));
        }
        u = (u - near) / (1.0 - near);
        let mut last = None;
        for i in &self.infinite {
            let p = sides.share(i, receiver);
            if p > 0.0 {
                if u < p {
                    return Some((i.id, DiscreteProbability(((1.0 - near) * p) as f32), single(u / p)));
                }
                u -= p;
                last = Some((i.id, p));
            }
        }
        // rounding left a little over
        last.map(|(id, p)| (id, DiscreteProbability(((1.0 - near) * p) as f32), ONE_MINUS_EPSILON))
    }

    /// Probability with which [`Selector::select`] chooses an emitter.
    pub fn probability(&self, receiver: &Receiver, id: EmitterId) -> DiscreteProbability {
        if let Some(only) = self.only {
            return DiscreteProbability(if only == id { 1.0 } else { 0.0 });
        }
        let Some(sides) = self.sides(receiver) else { return DiscreteProbability(0.0) };
        let near = sides.bounded;
        let p = match self.infinite.iter().find(|i| i.id == id) {
            Some(i) => (1.0 - near) * sides.share(i, receiver),
            None if near > 0.0 => near * self.tree.probability(receiver, id.0),
            None => 0.0,
        };
        DiscreteProbability(p as f32)
    }
}

/// How the choice for one receiver divides.
struct Sides {
    /// Probability of choosing among the bounded emitters.
    bounded: f64,
    /// Sum of the importances of those at infinity.
    far: f64,
    /// The even part of each one's share.
    even: f64,
}

impl Sides {
    /// Probability of an emitter among those at infinity.
    fn share(&self, i: &Infinite, receiver: &Receiver) -> f64 {
        let importance = i.importance(receiver);
        if importance > 0.0 { (1.0 - EVEN) * importance / self.far + self.even } else { 0.0 }
    }
}

impl Infinite {
    fn importance(&self, receiver: &Receiver) -> f64 {
        match (self.cone, receiver.normal) {
            (Some((direction, sin)), Some(n)) => {
                // the part of the cone that is highest over the horizon, with a little for rounding
                self.irradiance * (direction.dot(n) + sin + 1e-3).clamp(0.0, 1.0) as f64
            }
            _ => self.irradiance,
        }
    }
}

fn single(u: f64) -> f32 {
    (u as f32).min(ONE_MINUS_EPSILON)
}
