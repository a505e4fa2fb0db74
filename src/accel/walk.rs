//! Traversal, generic over the kernel. Everything here is inlined into the functions that enable the instructions.

use glam::Vec3;

use super::kernel::{Candidates, Entry, Instance, Kernel, LEAF, Node, Stack, Tree, TriangleBlock, WIDTH};
use super::ray::{Prepared, exact_t, exact_test};
use super::twins::twins_of;
use super::{Accel, Hit, Ray};

/// What a query has found so far.
struct Query<'a, F, const ANY: bool> {
    accept: &'a F,
    /// The largest `t` still of interest.
    t_max: f32,
    /// Where the ray ends, whatever was found.
    t_end: f32,
    best: Option<Hit>,
}

impl<F: Fn(&Hit) -> bool, const ANY: bool> Query<'_, F, ANY> {
    /// Looks at what a block's test found; `instance` stands in for that of the block. True once the query is answered.
    fn candidates(
        &mut self,
        ray: &Prepared,
        tree: &Tree,
        block: &TriangleBlock,
        mut found: Candidates,
        instance: Option<u32>,
    ) -> bool {
        let mut rest = found.hit | found.on_edge;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize;
            let bit = rest & rest.wrapping_neg();
            rest ^= bit;
            if found.on_edge & bit != 0 {
                match exact_test(ray, block, lane) {
                    Some([t, u, v]) => (found.t[lane], found.u[lane], found.v[lane]) = (t, u, v),
                    None => continue,
                }
            }
            let hit = Hit {
                t: found.t[lane],
                instance: instance.unwrap_or(block.instance[lane]),
                triangle: block.triangle[lane],
                u: found.u[lane],
                v: found.v[lane],
            };
            let doubtful = found.near_start | if ANY { found.near_end } else { 0 };
            let in_range = hit.t >= ray.t_min && hit.t <= self.t_max;
            if in_range
                && self.wins(&hit)
                && (doubtful & bit == 0 || self.is_certain(ray, block, lane, found.near_start & bit != 0))
            {
                if (self.accept)(&hit) {
                    self.take(hit);
                } else {
                    self.try_twins(tree, (block.instance[lane], block.triangle[lane]), hit);
                }
                if ANY && self.best.is_some() {
                    return true;
                }
            }
        }
        false
    }

    /// Whether the hit certainly lies in front of the origin and, if any hit will do, before the end.
    #[inline(always)]
    fn is_certain(&self, ray: &Prepared, block: &TriangleBlock, lane: usize, near_start: bool) -> bool {
        let (t, error) = exact_t(ray, block, lane);
        (!near_start || t > error) && (!ANY || t + error < f64::from(self.t_end))
    }

    fn take(&mut self, hit: Hit) {
        self.t_max = hit.t;
        self.best = Some(hit);
    }

    /// Offers the filter the other triangles at the place of one that it refused.
    #[inline(never)]
    fn try_twins(&mut self, tree: &Tree, refused: (u32, u32), hit: Hit) {
        let is_shared = refused.0 == u32::MAX;
        for twin in twins_of(&tree.twins, refused) {
            let instance = if is_shared { hit.instance } else { twin.id.0 };
            let hit = Hit { instance, triangle: twin.id.1, ..hit };
            if self.wins(&hit) && (self.accept)(&hit) {
                return self.take(hit);
            }
        }
    }

    /// Whether `hit`, no farther than `t_max`, is to replace the best one.
    #[inline(always)]
    fn wins(&self, hit: &Hit) -> bool {
        match &self.best {
            Some(best) if hit.t == best.t => (hit.instance, hit.triangle) < (best.instance, best.triangle),
            _ => true,
        }
    }
}

/// What traversal does with a tree's leaves. A trait rather than closures: its methods can be inlined by force, and
/// only what is inlined into the entry functions is compiled for their instruction set.
trait Leaves<K: Kernel> {
    /// The largest `t` still of interest.
    fn t_max(&self) -> f32;

    /// Announces that a leaf will probably be visited.
    fn prefetch(&self, leaf: u32);

    /// Visits a leaf; true ends the walk.
    fn visit(&mut self, leaf: u32) -> bool;
}

/// Blocks of triangles.
struct Triangles<'a, 'q, K, F, const ANY: bool> {
    kernel: K,
    tree: &'a Tree,
    ray: &'a Prepared,
    /// None in the baked tree, whose blocks know their instances.
    instance: Option<u32>,
    query: &'a mut Query<'q, F, ANY>,
}

impl<K: Kernel, F: Fn(&Hit) -> bool, const ANY: bool> Leaves<K> for Triangles<'_, '_, K, F, ANY> {
    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.query.t_max
    }

    #[inline(always)]
    fn prefetch(&self, leaf: u32) {
        self.kernel.prefetch(&self.tree.blocks, leaf as usize);
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let block = &self.tree.blocks[leaf as usize];
        match self.kernel.triangles(self.ray, block, self.query.t_max) {
            Some(found) => self.query.candidates(self.ray, self.tree, block, found, self.instance),
            None => false,
        }
    }
}

/// Instances of shared meshes.
struct Instances<'a, 'q, K, F, const ANY: bool> {
    kernel: K,
    accel: &'a Accel,
    ray: &'a Ray,
    t_min: f32,
    query: &'a mut Query<'q, F, ANY>,
}

impl<K: Kernel, F: Fn(&Hit) -> bool, const ANY: bool> Leaves<K> for Instances<'_, '_, K, F, ANY> {
    #[inline(always)]
    fn t_max(&self) -> f32 {
        self.query.t_max
    }

    #[inline(always)]
    fn prefetch(&self, leaf: u32) {
        self.kernel.prefetch(&self.accel.instances, leaf as usize);
    }

    #[inline(always)]
    fn visit(&mut self, leaf: u32) -> bool {
        let instance = &self.accel.instances[leaf as usize];
        let Some(ray) = to_mesh(self.ray, instance, self.t_min) else { return false };
        let tree = &self.accel.shared[instance.tree as usize];
        let lanes = self.kernel.lanes(&ray);
        let mut leaves = Triangles {
            kernel: self.kernel,
            tree,
            ray: &ray,
            instance: Some(instance.id),
            query: self.query,
        };
        walk::<K, _, ANY>(self.kernel, &tree.nodes, &lanes, &mut leaves)
    }
}

/// Visits the leaves that the ray may meet, for the closest hit from near to far. True if a visit ended the walk.
#[inline(always)]
fn walk<K: Kernel, L: Leaves<K>, const ANY: bool>(
    kernel: K,
    nodes: &[Node],
    lanes: &K::Lanes,
    leaves: &mut L,
) -> bool {
    let mut stack = Stack::new();
    let mut near = [0.0; WIDTH];
    let mut current = 0;
    loop {
        if current & LEAF == 0 {
            let node = &nodes[current as usize];
            let mut mask = kernel.boxes(lanes, node, leaves.t_max(), &mut near);
            if mask != 0 {
                let next = || {
                    let child = mask.trailing_zeros() as usize % WIDTH;
                    mask &= mask - 1;
                    let reference = node.children[child];
                    if reference & LEAF == 0 {
                        kernel.prefetch(nodes, reference as usize);
                    } else {
                        leaves.prefetch(reference ^ LEAF);
                    }
                    (Entry::new(near[child], reference), mask == 0)
                };
                current =
                    if ANY { push_all(&mut stack, next) } else { push_sorted(&mut stack, next) }.child();
                continue;
            }
        } else if leaves.visit(current ^ LEAF) {
            return true;
        }
        current = loop {
            match stack.pop() {
                Some(entry) if ANY || entry.near() <= leaves.t_max() => break entry.child(),
                Some(_) => {}
                None => return false,
            }
        };
    }
}

/// Pushes all but the last of the entries that `next` returns, with a flag at the last one; returns that.
#[inline(always)]
fn push_all(stack: &mut Stack, mut next: impl FnMut() -> (Entry, bool)) -> Entry {
    loop {
        let (entry, is_last) = next();
        if is_last {
            return entry;
        }
        stack.push(entry);
    }
}

/// The same, but the nearest is returned, and the nearer an entry the later it is pushed.
#[inline(always)]
fn push_sorted(stack: &mut Stack, mut next: impl FnMut() -> (Entry, bool)) -> Entry {
    let order = |a: Entry, b: Entry| (a.min(b), a.max(b));
    let (a, is_last) = next();
    if is_last {
        return a;
    }
    let (b, is_last) = next();
    let (a, b) = order(a, b);
    if is_last {
        stack.push(b);
        return a;
    }
    let (c, is_last) = next();
    let (b, c) = order(b, c);
    let (a, b) = order(a, b);
    if is_last {
        stack.push(c);
        stack.push(b);
        return a;
    }
    // Four or more are rare: insertion.
    let mut sorted = [Entry::default(); WIDTH];
    (sorted[0], sorted[1], sorted[2]) = (c, b, a);
    let mut count = 3;
    loop {
        let (entry, is_last) = next();
        let mut place = count;
        while place > 0 && sorted[place - 1] < entry {
            sorted[place] = sorted[place - 1];
            place -= 1;
        }
        sorted[place] = entry;
        count += 1;
        if is_last {
            break;
        }
    }
    sorted[..count - 1].iter().for_each(|&entry| stack.push(entry));
    sorted[count - 1]
}

/// The ray in the space of an instance's mesh; `t` stays the same.
#[inline(always)]
fn to_mesh(ray: &Ray, instance: &Instance, t_min: f32) -> Option<Prepared> {
    let [x, y, z] = instance.to_mesh.map(Vec3::from_array);
    let linear = |p: Vec3| x * p.x + y * p.y + z * p.z;
    // Subtracting first keeps the error in proportion to the distance from the instance, not from the world's origin.
    let origin = linear(ray.origin - Vec3::from_array(instance.translation));
    if !origin.is_finite() {
        return None;
    }
    Prepared::in_space(origin, linear(ray.direction), t_min)
}

#[inline(always)]
fn run<K: Kernel, F: Fn(&Hit) -> bool, const ANY: bool>(
    kernel: K,
    accel: &Accel,
    ray: &Ray,
    query: &mut Query<F, ANY>,
) -> bool {
    let Some(world) = Prepared::new(ray) else { return false };
    let lanes = kernel.lanes(&world);
    if let Some(tree) = &accel.baked {
        let mut leaves = Triangles { kernel, tree, ray: &world, instance: None, query: &mut *query };
        if walk::<K, _, ANY>(kernel, &tree.nodes, &lanes, &mut leaves) {
            return true;
        }
    }
    let Some(top) = &accel.top else { return false };
    let mut leaves = Instances { kernel, accel, ray, t_min: world.t_min, query };
    walk::<K, _, ANY>(kernel, &top.nodes, &lanes, &mut leaves)
}

#[inline(always)]
pub(super) fn closest<K: Kernel, F: Fn(&Hit) -> bool>(
    kernel: K,
    accel: &Accel,
    ray: &Ray,
    accept: &F,
) -> Option<Hit> {
    let mut query = Query::<F, false> { accept, t_max: ray.t_max, t_end: ray.t_max, best: None };
    run(kernel, accel, ray, &mut query);
    query.best
}

#[inline(always)]
pub(super) fn occluded<K: Kernel, F: Fn(&Hit) -> bool>(
    kernel: K,
    accel: &Accel,
    ray: &Ray,
    accept: &F,
) -> bool {
    let mut query = Query::<F, true> { accept, t_max: ray.t_max, t_end: ray.t_max, best: None };
    run(kernel, accel, ray, &mut query)
}
