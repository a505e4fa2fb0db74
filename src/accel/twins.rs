//! Triangles that lie exactly on top of each other.
//!
//! A ray that meets one meets all, at the same distance, and the one that comes first in the input wins. So trees hold
//! only that one: a million copies of a triangle cost what one costs. The others matter only if a filter refuses the
//! first, and are looked up then.

use rayon::prelude::*;

use super::geometry::Triangle;

/// A triangle that is not in the tree because another one with the same corners is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Twin {
    /// Instance and index of the one in the tree.
    stands_in: (u32, u32),
    /// Instance and index of this one.
    pub id: (u32, u32),
}

/// The twins of the triangle in the tree with the given instance and index, in ascending order.
pub(super) fn twins_of(twins: &[Twin], stands_in: (u32, u32)) -> &[Twin] {
    let start = twins.partition_point(|twin| twin.stands_in < stands_in);
    let count = twins[start..].partition_point(|twin| twin.stands_in == stands_in);
    &twins[start..start + count]
}

/// Takes all but the first of triangles with the same corners out of `triangles`, which ascend by instance and index.
pub(super) fn take_twins(triangles: &mut Vec<Triangle>) -> Vec<Twin> {
    let mut keys: Vec<(u64, u32)> =
        triangles.par_iter().enumerate().map(|(index, triangle)| (hash(triangle), index as u32)).collect();
    keys.par_sort_unstable();
    let mut twins = Vec::new();
    let mut is_twin = vec![false; triangles.len()];
    for alike in keys.chunk_by(|a, b| a.0 == b.0).filter(|alike| alike.len() > 1) {
        // More than one only if different triangles have the same hash.
        let mut firsts: Vec<&Triangle> = Vec::new();
        for &(_, index) in alike {
            let triangle = &triangles[index as usize];
            match firsts.iter().find(|first| bits(first) == bits(triangle)) {
                Some(first) => {
                    is_twin[index as usize] = true;
                    twins.push(Twin { stands_in: first.id(), id: triangle.id() });
                }
                None => firsts.push(triangle),
            }
        }
    }
    if !twins.is_empty() {
        let mut is_twin = is_twin.into_iter();
        triangles.retain(|_| is_twin.next() == Some(false));
        twins.sort_unstable();
    }
    twins
}

fn bits(triangle: &Triangle) -> [[u32; 3]; 3] {
    triangle.positions.map(|p| p.to_array().map(f32::to_bits))
}

fn hash(triangle: &Triangle) -> u64 {
    bits(triangle).as_flattened().iter().fold(0, |hash: u64, &bits| {
        let mixed = (hash ^ u64::from(bits)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        mixed ^ mixed >> 29
    })
}
