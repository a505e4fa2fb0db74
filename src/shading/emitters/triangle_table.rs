//! Which emitter a mesh's triangle is.

use super::EmitterId;

/// Constant-time lookup from (instance, triangle) to emitter, and back.
#[derive(Clone, Debug, Default)]
pub(super) struct TriangleTable {
    /// For each instance, where its triangles start in `emitters`, and which triangle is the first.
    instances: Vec<Range>,
    /// Emitter indices, [`NONE`] for triangles that do not emit.
    emitters: Vec<u32>,
    /// Instance and triangle of each emitter from `first` on.
    places: Vec<(u32, u32)>,
    first: u32,
}

#[derive(Clone, Copy, Debug)]
struct Range {
    start: usize,
    first_triangle: u32,
    count: u32,
}

const NONE: u32 = u32::MAX;

impl TriangleTable {
    /// A table in which the triangle at `places[i]` (instance, triangle) is emitter `first + i`.
    pub fn new(places: &[(u32, u32)], first: u32) -> Self {
        let count = places.iter().map(|p| p.0 as usize + 1).max().unwrap_or(0);
        let mut spans = vec![(u32::MAX, 0); count];
        for &(instance, triangle) in places {
            let span = &mut spans[instance as usize];
            *span = (span.0.min(triangle), span.1.max(triangle));
        }
        let mut start = 0;
        let range = |&(low, high): &(u32, u32)| {
            let count = if low <= high { high - low + 1 } else { 0 };
            let range = Range { start, first_triangle: low, count };
            start += count as usize;
            range
        };
        let instances: Vec<Range> = spans.iter().map(range).collect();
        let mut emitters = vec![NONE; start];
        for (i, &(instance, triangle)) in places.iter().enumerate() {
            let r = instances[instance as usize];
            emitters[r.start + (triangle - r.first_triangle) as usize] = first + i as u32;
        }
        Self { instances, emitters, places: places.to_vec(), first }
    }

    /// The emitter of a triangle.
    #[inline]
    pub fn get(&self, instance: u32, triangle: u32) -> Option<EmitterId> {
        let r = self.instances.get(instance as usize)?;
        let i = triangle.checked_sub(r.first_triangle).filter(|&i| i < r.count)?;
        let emitter = self.emitters[r.start + i as usize];
        (emitter != NONE).then_some(EmitterId(emitter))
    }

    /// Instance and triangle of an emitter.
    pub fn place(&self, id: EmitterId) -> Option<(u32, u32)> {
        self.places.get(id.0.checked_sub(self.first)? as usize).copied()
    }
}
