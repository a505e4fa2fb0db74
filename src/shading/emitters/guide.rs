//! Where light paths should begin: a density over the emitters' rays, learnt from what earlier paths brought.
//!
//! A ray's coordinates are the random numbers that it is drawn from: an emitter, chosen by power, two numbers for
//! its place and two for its direction. The guide is a binary tree of boxes of them, each cut at the middle of the
//! axis along which what was learnt is least even, and is constant in every leaf (primary-sample-space guiding, Guo et
//! al. 2018). It multiplies the emitters' own densities, whatever they are; a share of the rays is drawn by
//! those alone, so that nothing that carries light is ever left out.

use super::Emitters;
use super::sample::EmitterId;
use crate::math::ONE_MINUS_EPSILON;
use glam::Vec2;

/// What a ray that leaves an emitter is drawn from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// The emitter.
    pub emitter: EmitterId,
    /// Two numbers for the place, then two for the direction, in `[0,1)`.
    pub at: [f32; 4],
}

/// What a light path brought to the picture.
#[derive(Clone, Copy, Debug)]
pub struct Lesson {
    /// What its first ray was drawn from.
    pub draw: Draw,
    /// How much it brought, an estimate that the path's density has been divided out of.
    pub worth: f32,
}

/// A learnt density of the first rays of light paths, relative to that of the emitters themselves.
#[derive(Clone, Debug, Default)]
pub struct EmissionGuide {
    /// A node's first child follows it. Empty as long as nothing was learnt.
    nodes: Vec<Node>,
}

/// A guide that has learnt nothing.
pub static PLAIN: EmissionGuide = EmissionGuide { nodes: Vec::new() };

/// Share of the rays that the guide draws.
const SHARE: f64 = 0.8;
/// Fewest lessons of a box that is cut.
const LEAST: usize = 32;
/// A leaf of a smaller share of all that was learnt is not cut.
const SMALLEST: f64 = 1.0 / 4096.0;
/// Most cuts above a leaf.
const DEPTH: u32 = 48;
/// An interval of an axis that is narrower is not cut.
const NARROWEST: f32 = 1.0 / 4096.0;

#[derive(Clone, Copy, Debug)]
enum Node {
    /// `first`: share of the first child in what the guide draws here; `second`: places from here to the other.
    Inner { split: Split, first: f64, second: u32 },
    /// The density in it.
    Leaf { relative: f32 },
}

/// What lies below belongs to the first child.
#[derive(Clone, Copy, Debug)]
enum Split {
    Emitter(u32),
    Axis { axis: u8, at: f32 },
}

impl Split {
    fn is_first(self, draw: &Draw) -> bool {
        match self {
            Self::Emitter(e) => draw.emitter.0 < e,
            Self::Axis { axis, at } => draw.at[axis as usize] < at,
        }
    }
}

/// A box of the coordinates.
#[derive(Clone, Copy, Debug)]
struct Cell {
    emitters: [u32; 2],
    low: [f32; 4],
    size: [f32; 4],
}

impl Cell {
    fn whole(emitters: &Emitters) -> Self {
        Self { emitters: [0, emitters.len() as u32], low: [0.0; 4], size: [1.0; 4] }
    }

    fn children(&self, split: Split) -> [Self; 2] {
        let mut both = [*self; 2];
        match split {
            Split::Emitter(e) => (both[0].emitters[1], both[1].emitters[0]) = (e, e),
            Split::Axis { axis, at } => {
                let a = axis as usize;
                (both[0].size[a], both[1].size[a]) = (self.size[a] / 2.0, self.size[a] / 2.0);
                both[1].low[a] = at;
            }
        }
        both
    }

    /// Share of the rays that the emitters themselves draw from it.
    fn volume(&self, emitters: &Emitters) -> f64 {
        let [first, end] = self.emitters;
        let power = emitters.power_before(end) - emitters.power_before(first);
        power * self.size.iter().map(|&s| s as f64).product::<f64>()
    }

    /// The splits that can be made: between emitters where half of the power is, and along every axis that is drawn.
    fn splits(&self, emitters: &Emitters) -> impl Iterator<Item = Split> {
        let [first, end] = self.emitters;
        let half = (emitters.power_before(first) + emitters.power_before(end)) / 2.0;
        let middle = emitters.at_power(half).clamp(first, end - 1);
        // either side of the emitter in the middle, whichever is more even
        let nearer = (half - emitters.power_before(middle)).abs();
        let after = (emitters.power_before(middle + 1) - half).abs() < nearer;
        let e = if after { middle + 1 } else { middle };
        let between = (first < e && e < end).then_some(Split::Emitter(e));
        let drawn = emitters.drawn(first..end);
        let (low, size) = (self.low, self.size);
        let wide = (0..4u8).filter(move |&a| drawn[a as usize / 2] && size[a as usize] > NARROWEST);
        let along = move |axis: u8| Split::Axis { axis, at: low[axis as usize] + size[axis as usize] / 2.0 };
        between.into_iter().chain(wide.map(along))
    }
}

impl EmissionGuide {
    /// The density that the lessons teach. Their order does not change.
    pub fn learn(emitters: &Emitters, mut lessons: Vec<Lesson>) -> Self {
        lessons.retain(|l| l.worth > 0.0 && l.worth.is_finite());
        let total = worth(&lessons);
        let mut guide = Self::default();
        if lessons.len() >= LEAST && total > 0.0 {
            let learning = Learning { emitters, total };
            guide.nodes = learning.grow(&mut lessons, Cell::whole(emitters), 0);
        }
        guide
    }

    /// Whether nothing was learnt yet.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// What a ray is drawn from, by uniform numbers. The emitters' own density of the ray is to be multiplied by
    /// [`EmissionGuide::relative`].
    pub fn draw(&self, emitters: &Emitters, u: Vec2, place: Vec2, direction: Vec2) -> Option<Draw> {
        let at = [place.x, place.y, direction.x, direction.y];
        let guided = u.x as f64 - (1.0 - SHARE);
        if self.nodes.is_empty() || guided < 0.0 {
            return Some(Draw { emitter: emitters.select_emission(u.y)?.0, at });
        }
        let mut choice = guided / SHARE;
        let (mut cell, mut node) = (Cell::whole(emitters), 0);
        while let Node::Inner { split, first, second } = self.nodes[node] {
            let children = cell.children(split);
            if choice < first {
                (cell, node, choice) = (children[0], node + 1, choice / first);
            } else {
                (cell, node, choice) =
                    (children[1], node + second as usize, (choice - first) / (1.0 - first));
            }
        }
        let [first, end] = cell.emitters;
        let [low, high] = cell.emitters.map(|e| emitters.power_before(e));
        let emitter = emitters.at_power(low + (high - low) * u.y as f64).clamp(first, end - 1);
        let within = |a: usize| (cell.low[a] + cell.size[a] * at[a]).min(ONE_MINUS_EPSILON);
        Some(Draw { emitter: EmitterId(emitter), at: std::array::from_fn(within) })
    }

    /// Density of a draw relative to that of the emitters themselves.
    pub fn relative(&self, draw: &Draw) -> f32 {
        if self.nodes.is_empty() {
            return 1.0;
        }
        let mut node = 0;
        loop {
            match self.nodes[node] {
                Node::Inner { split, .. } if split.is_first(draw) => node += 1,
                Node::Inner { second, .. } => node += second as usize,
                Node::Leaf { relative } => return relative,
            }
        }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.nodes.capacity() * size_of::<Node>()
    }
}

/// What growing a tree goes by.
struct Learning<'a> {
    emitters: &'a Emitters,
    /// Worth of all lessons.
    total: f64,
}

impl Learning<'_> {
    /// The tree of a box.
    fn grow(&self, lessons: &mut [Lesson], cell: Cell, depth: u32) -> Vec<Node> {
        let share = worth(lessons) / self.total;
        let volume = cell.volume(self.emitters);
        let is_leaf = lessons.len() < LEAST || share < SMALLEST || depth == DEPTH;
        let Some(split) = (!is_leaf).then(|| self.best_split(lessons, &cell)).flatten() else {
            let guided = if volume > 0.0 { share / volume } else { 0.0 };
            return vec![Node::Leaf { relative: (1.0 - SHARE + SHARE * guided) as f32 }];
        };
        lessons.sort_by_key(|l| !split.is_first(&l.draw));
        let (first, second) = lessons.split_at_mut(lessons.partition_point(|l| split.is_first(&l.draw)));
        let [near, far] = cell.children(split);
        let part = worth(first) / (worth(first) + worth(second));
        let (below, beyond) =
            rayon::join(|| self.grow(first, near, depth + 1), || self.grow(second, far, depth + 1));
        let mut nodes = vec![Node::Inner { split, first: part, second: below.len() as u32 + 1 }];
        nodes.extend(below.into_iter().chain(beyond));
        nodes
    }

    /// The split that tells most: whose parts are furthest from having what their volume promises.
    fn best_split(&self, lessons: &[Lesson], cell: &Cell) -> Option<Split> {
        let all = worth(lessons);
        let volume = cell.volume(self.emitters);
        let gain = |split: &Split| {
            let first = lessons.iter().filter(|l| split.is_first(&l.draw));
            let share = first.map(|l| l.worth as f64).sum::<f64>() / all;
            let expected = cell.children(*split)[0].volume(self.emitters) / volume;
            // of the entropy
            let part = |p: f64, q: f64| if p > 0.0 { p * (p / q).ln() } else { 0.0 };
            part(share, expected) + part(1.0 - share, 1.0 - expected)
        };
        let rated = cell.splits(self.emitters).map(|split| (gain(&split), split));
        rated.filter(|(g, _)| g.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, split)| split)
    }
}

fn worth(lessons: &[Lesson]) -> f64 {
    lessons.iter().map(|l| l.worth as f64).sum()
}
