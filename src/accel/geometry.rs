//! From meshes and instances to clean triangles and boxes.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, DAffine3, DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::kernel::Instance;
use super::ray::{ROUNDING, box_padding};
use super::{Dropped, MeshGeometry};

/// Largest coordinate: products of three stay within `f32`.
const LARGEST_COORDINATE: f32 = 1e12;

/// Least volume that a transform may leave a cube spanned by its columns' directions; below it, `f32` cannot invert it.
const LEAST_VOLUME: f64 = 1e-7;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub min: Vec3,
    pub max: Vec3,
}

impl Bounds {
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Half the surface area.
    pub fn half_area(&self) -> f32 {
        let size = self.max - self.min;
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    fn size(&self) -> DVec3 {
        (self.max - self.min).as_dvec3()
    }

    /// Grown on all sides by `by`, and rounded outwards.
    pub fn padded(self, by: Vec3) -> Self {
        Self { min: (self.min - by).map(f32::next_down), max: (self.max + by).map(f32::next_up) }
    }
}

/// A triangle in the space of its tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub positions: [Vec3; 3],
    pub instance: u32,
    pub index: u32,
}

impl Triangle {
    /// Instance and index, in the order in which ties are decided.
    pub fn id(&self) -> (u32, u32) {
        (self.instance, self.index)
    }

    /// The box that holds whatever the triangle test takes for a hit.
    pub fn bounds(&self) -> Bounds {
        let bounds = Bounds::of(self.positions);
        bounds.padded(Vec3::splat(box_padding((bounds.max - bounds.min).max_element())))
    }
}

/// Counts of what was left out, to be added to from several threads.
#[derive(Default)]
pub(super) struct Rejects {
    non_finite: AtomicUsize,
    degenerate: AtomicUsize,
}

impl Rejects {
    pub fn into_dropped(self, singular_instances: usize) -> Dropped {
        Dropped {
            non_finite_triangles: self.non_finite.into_inner(),
            degenerate_triangles: self.degenerate.into_inner(),
            singular_instances,
        }
    }

    /// Whether a triangle can be hit at all; counts it if not.
    fn keeps(&self, positions: &[Vec3; 3]) -> bool {
        // False for NaN.
        if !positions.iter().all(|p| p.abs().max_element() <= LARGEST_COORDINATE && !p.is_nan()) {
            self.non_finite.fetch_add(1, Ordering::Relaxed);
            return false;
        }
        if geometric_normal(positions.map(Vec3::as_dvec3)) == DVec3::ZERO {
            self.degenerate.fetch_add(1, Ordering::Relaxed);
            return false;
        }
        true
    }
}

/// The triangle's normal, by the right hand, twice its area long.
pub(super) fn geometric_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Where a vertex of a baked mesh lies in world space: the exact place, rounded once.
pub(super) fn bake_point(to_world: &DAffine3, point: Vec3) -> Vec3 {
    to_world.transform_point3(point.as_dvec3()).as_vec3()
}

/// `to_world` in double precision.
pub(super) fn widen(to_world: &Affine3A) -> DAffine3 {
    let column = |i: usize| Vec3::from(to_world.matrix3.col(i)).as_dvec3();
    DAffine3 {
        matrix3: DMat3::from_cols(column(0), column(1), column(2)),
        translation: Vec3::from(to_world.translation).as_dvec3(),
    }
}

/// The triangles of `mesh` that can be hit, in world space if `to_world` is given.
pub(super) fn triangles(
    mesh: &MeshGeometry,
    instance: u32,
    to_world: Option<DAffine3>,
    rejects: &Rejects,
) -> Vec<Triangle> {
    let positions = mesh.positions;
    let place = |vertex: u32| match &to_world {
        Some(to_world) => bake_point(to_world, positions[vertex as usize]),
        None => positions[vertex as usize],
    };
    let clean = |(index, corners): (usize, &[u32; 3])| {
        let positions = corners.map(place);
        let triangle = Triangle { positions, instance, index: index as u32 };
        rejects.keeps(&positions).then_some(triangle)
    };
    mesh.triangles.par_iter().enumerate().filter_map(clean).collect()
}

/// Whether a transform can be inverted well enough to trace rays through it.
pub(super) fn is_invertible(to_world: &DAffine3) -> bool {
    let columns = [0, 1, 2].map(|i| to_world.matrix3.col(i).normalize_or_zero());
    let volume = columns[0].cross(columns[1]).dot(columns[2]).abs();
    let inverse = to_world.matrix3.inverse();
    let fits = |v: DVec3| v.is_finite() && v.abs().max_element() <= f64::from(LARGEST_COORDINATE);
    let all_fit = |m: &DMat3| (0..3).all(|i| fits(m.col(i)));
    volume >= LEAST_VOLUME && all_fit(&to_world.matrix3) && fits(to_world.translation) && all_fit(&inverse)
}

/// How much larger the triangles' boxes may become, against the whole mesh, before it is better left unbaked. Turning
/// alone makes flat boxes up to four times as large, which is still cheaper than a second level.
const LARGEST_GROWTH: f64 = 6.0;

/// Whether a mesh is traced as precisely and as fast in world space as in its own.
pub(super) fn bakes_well(to_world: &DAffine3, mesh: &MeshGeometry) -> bool {
    if *to_world == DAffine3::IDENTITY {
        return true;
    }
    let finite = mesh.positions.iter().copied().filter(|p| p.is_finite());
    let bounds = Bounds::of(finite.map(|p| bake_point(to_world, p)));
    // The spacing of `f32` at the mesh's place must be small against its triangles.
    let size = (bounds.max - bounds.min).max_element() / (mesh.triangles.len() as f32).sqrt();
    let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
    // False if there is no finite vertex.
    let is_precise = farthest * f32::EPSILON < 1e-3 * size;
    is_precise && box_growth(to_world, mesh) <= LARGEST_GROWTH
}

/// By how much a transform makes the triangles' boxes larger, in relation to the mesh's own box as it is transformed:
/// slanted slivers fill their boxes badly, and rays that pass the mesh must look into every box. Zero if there is
/// nothing to compare.
fn box_growth(to_world: &DAffine3, mesh: &MeshGeometry) -> f64 {
    const CHUNK: usize = 4096;
    // The mesh's box, and the summed areas of the triangles' boxes before and after; chunks are summed in a fixed order,
    // whatever the number of threads.
    let chunk_sums = |triangles: &[[u32; 3]]| {
        let (mut all, mut areas) = (Bounds::EMPTY, [0.0; 2]);
        for corners in triangles {
            let before = corners.map(|c| mesh.positions[c as usize]);
            let after = before.map(|p| bake_point(to_world, p));
            if before.iter().chain(&after).all(|p| p.is_finite()) {
                let bounds = Bounds::of(before);
                all = all.union(bounds);
                areas[0] += half_area(DMat3::from_diagonal(bounds.size()));
                areas[1] += half_area(DMat3::from_diagonal(Bounds::of(after).size()));
            }
        }
        (all, areas)
    };
    let chunks: Vec<_> = mesh.triangles.par_chunks(CHUNK).map(chunk_sums).collect();
    let (all, [before, after]) =
        chunks.into_iter().fold((Bounds::EMPTY, [0.0; 2]), |(all, [b, a]), chunk| {
            (all.union(chunk.0), [b + chunk.1[0], a + chunk.1[1]])
        });
    if before == 0.0 {
        return 0.0;
    }
    let sides = DMat3::from_diagonal(all.size());
    (after / half_area(to_world.matrix3 * sides)) / (before / half_area(sides))
}

/// Half the surface of the parallelepiped that the columns span.
fn half_area(sides: DMat3) -> f64 {
    let [a, b, c] = [sides.col(0), sides.col(1), sides.col(2)];
    a.cross(b).length() + b.cross(c).length() + c.cross(a).length()
}

/// `|M| |M^-1|`: how rounding errors made in mesh space look in world space, for errors relative to world positions.
pub(super) fn amplification(to_world: &DMat3) -> DMat3 {
    absolute(to_world) * absolute(&to_world.inverse())
}

/// The matrix of absolute values.
pub(super) fn absolute(m: &DMat3) -> DMat3 {
    DMat3::from_cols(m.col(0).abs(), m.col(1).abs(), m.col(2).abs())
}

/// What traversal needs of an instance.
pub(super) fn instance(to_world: &DAffine3, tree: u32, id: u32) -> Instance {
    let inverse = to_world.matrix3.inverse();
    Instance {
        to_mesh: [0, 1, 2].map(|i| inverse.col(i).as_vec3().to_array()),
        translation: to_world.translation.as_vec3().to_array(),
        tree,
        id,
    }
}

/// World-space box of an instance of something that the boxes `parts` hold.
///
/// Rays are rounded on their way into mesh space, so the box grows by the error of a ray that starts near the mesh.
pub(super) fn instance_bounds(to_world: &DAffine3, parts: &[Bounds]) -> Bounds {
    let linear = absolute(&to_world.matrix3);
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let mut reach = DVec3::ZERO;
    for part in parts {
        let (lower, upper) = (part.min.as_dvec3(), part.max.as_dvec3());
        let centre = to_world.transform_point3((lower + upper) * 0.5);
        let half = linear * ((upper - lower) * 0.5);
        min = min.min(centre - half);
        max = max.max(centre + half);
        reach = reach.max(linear * lower.abs().max(upper.abs()));
    }
    let padding = amplification(&to_world.matrix3) * reach * (32.0 * f64::from(ROUNDING));
    Bounds { min: min.as_vec3(), max: max.as_vec3() }.padded(padding.as_vec3())
}
