//! How polygons become triangles.

use super::mesh::MeshInput;
use crate::math::Frame;
use glam::{DVec3, Vec3};

/// Triangles of a mesh with where each came from.
pub(super) struct Triangulation {
    /// Polygon corner of each triangle corner.
    pub corners: Vec<[u32; 3]>,
    /// Polygon of each triangle; `None`: they are the same.
    faces: Option<Vec<u32>>,
}

impl Triangulation {
    /// Triangles of a mesh's polygons, without the holes.
    pub fn new(input: &MeshInput, face_count: usize) -> Self {
        let wind = |[a, b, c]: [u32; 3]| if input.left_handed { [a, c, b] } else { [a, b, c] };
        let Some(counts) = input.face_counts.filter(|c| c.iter().any(|&c| c != 3) || !input.holes.is_empty())
        else {
            let all = (0..face_count as u32).map(|f| wind([3 * f, 3 * f + 1, 3 * f + 2]));
            if input.holes.is_empty() {
                return Triangulation { corners: all.collect(), faces: None };
            }
            let there = present(input.holes, face_count);
            let faces: Vec<u32> = (0..face_count as u32).filter(|&f| there[f as usize]).collect();
            return Triangulation {
                corners: faces.iter().map(|&f| wind([3 * f, 3 * f + 1, 3 * f + 2])).collect(),
                faces: Some(faces),
            };
        };
        let there = present(input.holes, face_count);
        let (mut corners, mut faces) =
            (Vec::with_capacity(2 * face_count), Vec::with_capacity(2 * face_count));
        let mut clipper = EarClipper::default();
        let mut first = 0u32;
        for (face, &n) in counts.iter().enumerate() {
            let point = |k: u32| input.points[input.face_indices[(first + k) as usize] as usize];
            if there[face] {
                let start = corners.len();
                match n {
                    0..=2 => {}
                    3 => corners.push([first, first + 1, first + 2]),
                    _ => clipper.clip(n, point, |t| corners.push(t.map(|k| first + k))),
                }
                corners[start..].iter_mut().for_each(|t| *t = wind(*t));
                faces.resize(corners.len(), face as u32);
            }
            first += n;
        }
        Triangulation { corners, faces: Some(faces) }
    }

    /// Polygon of a triangle.
    pub fn face(&self, triangle: usize) -> usize {
        self.faces.as_ref().map_or(triangle, |f| f[triangle] as usize)
    }

    /// Drops what cannot be hit: counts of triangles with non-finite vertices and with zero area.
    pub fn drop_degenerate(&mut self, input: &MeshInput) -> (u64, u64) {
        let (mut non_finite, mut degenerate) = (0, 0);
        let keep: Vec<bool> = self
            .corners
            .iter()
            .map(|c| {
                let [a, b, c] = c.map(|c| input.points[input.face_indices[c as usize] as usize].as_dvec3());
                let finite = a.is_finite() && b.is_finite() && c.is_finite();
                // the area in f64: a needle of 1e-30 is still a triangle
                let solid = (b - a).cross(c - a) != DVec3::ZERO;
                non_finite += !finite as u64;
                degenerate += (finite && !solid) as u64;
                finite && solid
            })
            .collect();
        if non_finite + degenerate > 0 {
            let faces = self.faces.take().unwrap_or_else(|| (0..self.corners.len() as u32).collect());
            self.faces = Some(faces.iter().zip(&keep).filter(|&(_, &k)| k).map(|(&f, _)| f).collect());
            let mut k = keep.iter();
            self.corners.retain(|_| *k.next().expect("one flag a triangle"));
        }
        (non_finite, degenerate)
    }
}

fn present(holes: &[u32], face_count: usize) -> Vec<bool> {
    let mut there = vec![true; face_count];
    holes.iter().for_each(|&h| there[h as usize] = false);
    there
}

/// Cuts a polygon into triangles; keeps its buffers between polygons.
#[derive(Default)]
struct EarClipper {
    flat: Vec<[f32; 2]>,
    indices: Vec<u32>,
    earcut: earcut::Earcut<f32>,
}

impl EarClipper {
    /// Triangles of an `n`-gon, as corner numbers, in the polygon's winding. Convex quads are split by
    /// their first diagonal, everything else is ear-clipped in the plane of its (Newell) normal.
    fn clip(&mut self, n: u32, point: impl Fn(u32) -> Vec3, mut emit: impl FnMut([u32; 3])) {
        let normal: Vec3 = (1..n - 1)
            .map(|k| (point(k) - point(0)).cross(point(k + 1) - point(0)))
            .filter(|v| v.is_finite())
            .sum();
        if n == 4 {
            // the fan from corner 0 is good unless corner 1 or 3 lies on the wrong side of it
            let side = |a: u32, b: u32, c: u32| (point(b) - point(a)).cross(point(c) - point(a)).dot(normal);
            match side(0, 1, 2) > 0.0 && side(0, 2, 3) > 0.0 {
                true => [[0, 1, 2], [0, 2, 3]].into_iter().for_each(emit),
                false => [[1, 2, 3], [1, 3, 0]].into_iter().for_each(emit),
            }
            return;
        }
        let axes = Frame::from_normal(normal.try_normalize().unwrap_or(Vec3::Z));
        let origin = point(0);
        self.flat.clear();
        self.flat.extend((0..n).map(|k| {
            let p = axes.to_local(point(k) - origin);
            [p.x, p.y]
        }));
        self.indices.clear();
        let flat = std::mem::take(&mut self.flat);
        self.earcut.earcut(flat.iter().copied(), &[], &mut self.indices);
        self.flat = flat;
        for t in self.indices.chunks_exact(3) {
            // ear clipping may return either winding: restore the polygon's
            let [a, b, c] = [t[0], t[1], t[2]];
            let n = (point(b) - point(a)).cross(point(c) - point(a));
            emit(if n.dot(normal) < 0.0 { [a, c, b] } else { [a, b, c] });
        }
    }
}
