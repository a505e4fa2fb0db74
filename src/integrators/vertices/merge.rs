//! The photon map: light vertices by place, found from camera vertices within the radius of merging.
//!
//! A hash grid. Its cells' edges are powers of two, the least that is no smaller than the diameter of merging
//! where the photon is; the radius follows the pixel's footprint, so a search looks at one level or two.

use super::vertex::{LightVertex, Rules};
use crate::math::sampler::hash;
use glam::{IVec3, Vec3};
use rayon::prelude::*;
use smallvec::SmallVec;

/// Largest exponent of an edge, either way: what a radius of zero or infinity gets.
const MAX_LEVEL: i32 = 100;
/// Least cosine between the normals of surfaces that are merged.
const SAME_SURFACE: f32 = 0.9;

/// The vertices of an iteration's light paths, by place.
#[derive(Debug, Default)]
pub struct PhotonMap {
    /// Bucket and number of every vertex, in order.
    keys: Vec<u64>,
    /// The first of each bucket, and one past the last.
    starts: Vec<u32>,
    /// Places of the vertices, in the order of `keys`.
    places: Vec<Vec3>,
}

/// Exponent of the edge of the cells where the radius is `r`.
fn level(r: f32) -> i32 {
    // NaN becomes zero
    ((2.0 * r).log2().ceil() as i32).clamp(-MAX_LEVEL, MAX_LEVEL)
}

fn cell(p: Vec3, level: i32) -> IVec3 {
    (p / (level as f32).exp2()).floor().as_ivec3()
}

fn bucket(cell: IVec3, level: i32, buckets: u32) -> u32 {
    let IVec3 { x, y, z } = cell;
    hash(hash(hash(x as u32, y as u32), z as u32), level as u32) & (buckets - 1)
}

impl PhotonMap {
    /// Sorts these vertices in, and forgets what was before.
    pub fn build(&mut self, rules: &Rules, vertices: &[LightVertex]) {
        let buckets = (vertices.len() as u32).next_power_of_two();
        let key = |(i, v): (usize, &LightVertex)| {
            let level = level(rules.radius(v.position));
            u64::from(bucket(cell(v.position, level), level, buckets)) << 32 | i as u64
        };
        self.keys.clear();
        self.keys.par_extend(vertices.par_iter().enumerate().map(key));
        self.keys.par_sort_unstable();
        self.starts.clear();
        let mut next = 0;
        for b in 0..=u64::from(buckets) {
            while next < self.keys.len() && self.keys[next] >> 32 < b {
                next += 1;
            }
            self.starts.push(next as u32);
        }
        self.places.clear();
        self.places.par_extend(self.keys.par_iter().map(|&k| vertices[k as u32 as usize].position));
    }

    /// Calls `found` with the number of every vertex within `radius` of a point, in a fixed order.
    pub fn for_each(&self, rules: &Rules, p: Vec3, radius: f32, mut found: impl FnMut(usize)) {
        let buckets = self.starts.len() as u32 - 1;
        // the radius differs within the radius, by this much, and rounding
        let spread = (rules.radius * rules.sensor.footprint_growth()).min(0.5) + 1e-3;
        let mut seen = SmallVec::<[u32; 64]>::new();
        for level in level(radius * (1.0 - spread))..=level(radius * (1.0 + spread)) {
            let (low, high) = (cell(p - radius, level), cell(p + radius, level));
            for z in low.z..=high.z {
                for y in low.y..=high.y {
                    for x in low.x..=high.x {
                        let b = bucket(IVec3::new(x, y, z), level, buckets);
                        // cells may share a bucket
                        if !seen.contains(&b) {
                            seen.push(b);
                        }
                    }
                }
            }
        }
        for b in seen {
            for i in self.starts[b as usize] as usize..self.starts[b as usize + 1] as usize {
                if self.places[i].distance_squared(p) <= radius * radius {
                    found(self.keys[i] as u32 as usize);
                }
            }
        }
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.keys.capacity() * 8 + self.starts.capacity() * 4 + self.places.capacity() * size_of::<Vec3>()
    }
}

/// Whether vertices with these shading normals may be on one surface.
#[inline]
pub fn is_same_surface(a: Vec3, b: Vec3) -> bool {
    a.dot(b) > SAME_SURFACE
}
