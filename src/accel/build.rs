//! Decides what is baked and what is shared, and builds the trees.

use glam::{DAffine3, Vec3};
use rayon::prelude::*;

use super::collapse::{box_tree, triangle_tree};
use super::geometry::{
    Bounds, Rejects, bakes_well, instance, instance_bounds, is_invertible, triangles, widen,
};
use super::kernel::{Isa, LEAF, Tree, WIDTH};
use super::{Accel, AccelError, InstanceGeometry, MeshGeometry};

const LIMIT: usize = LEAF as usize;

/// See [`Accel::build`].
pub(super) fn build(meshes: &[MeshGeometry], instances: &[InstanceGeometry]) -> Result<Accel, AccelError> {
    check(meshes, instances)?;
    let placed: Vec<Placed> = instances
        .iter()
        .enumerate()
        .map(|(id, instance)| Placed {
            id: id as u32,
            mesh: instance.mesh as usize,
            to_world: widen(&instance.to_world),
        })
        .filter(|placed| is_invertible(&placed.to_world))
        .collect();
    let singular = instances.len() - placed.len();
    let mut uses = vec![0usize; meshes.len()];
    placed.iter().for_each(|placed| uses[placed.mesh] += 1);
    let (baked, shared): (Vec<Placed>, Vec<Placed>) = placed
        .into_iter()
        .partition(|placed| uses[placed.mesh] == 1 && bakes_well(&placed.to_world, &meshes[placed.mesh]));

    let rejects = Rejects::default();
    let mut is_baked = vec![0u64; instances.len().div_ceil(64)];
    let mut world_triangles = Vec::new();
    for placed in &baked {
        is_baked[placed.id as usize / 64] |= 1 << (placed.id % 64);
        world_triangles.extend(triangles(&meshes[placed.mesh], placed.id, Some(placed.to_world), &rejects));
    }
    limit("triangles", world_triangles.len())?;
    let baked = triangle_tree(world_triangles);

    let (trees, tree_of_mesh) = shared_trees(meshes, &shared, &rejects);
    let parts: Vec<Vec<Bounds>> = trees.iter().map(child_bounds).collect();
    let shared: Vec<(Placed, u32)> = shared
        .into_iter()
        .filter_map(|placed| tree_of_mesh[placed.mesh].map(|tree| (placed, tree)))
        .collect();
    let boxes: Vec<Bounds> = shared
        .par_iter()
        .map(|(placed, tree)| instance_bounds(&placed.to_world, &parts[*tree as usize]))
        .collect();
    let (top, order) = box_tree(&boxes).unzip();
    let leaves = order
        .unwrap_or_default()
        .par_iter()
        .map(|&leaf| {
            let (placed, tree) = &shared[leaf as usize];
            instance(&placed.to_world, *tree, placed.id)
        })
        .collect();
    let all = baked.iter().chain(&top).flat_map(child_bounds).fold(Bounds::EMPTY, Bounds::union);
    let bounds = if all.min.x <= all.max.x { (all.min, all.max) } else { (Vec3::ZERO, Vec3::ZERO) };
    Ok(Accel {
        baked,
        shared: trees,
        top,
        instances: leaves,
        is_baked,
        bounds,
        dropped: rejects.into_dropped(singular),
        isa: Isa::detect(),
    })
}

/// An instance that can be traced.
struct Placed {
    id: u32,
    mesh: usize,
    to_world: DAffine3,
}

fn limit(what: &'static str, count: usize) -> Result<(), AccelError> {
    if count < LIMIT { Ok(()) } else { Err(AccelError::TooMany { what, count, limit: LIMIT - 1 }) }
}

/// Looks for indices out of range.
fn check(meshes: &[MeshGeometry], instances: &[InstanceGeometry]) -> Result<(), AccelError> {
    limit("instances", instances.len())?;
    if let Some((instance, bad)) = instances.iter().enumerate().find(|(_, i)| i.mesh as usize >= meshes.len())
    {
        return Err(AccelError::MeshOutOfRange { instance, mesh: bad.mesh, meshes: meshes.len() });
    }
    for (index, mesh) in meshes.iter().enumerate() {
        limit("triangles", mesh.triangles.len())?;
        let vertices = mesh.positions.len();
        let is_bad = |vertex: &u32| *vertex as usize >= vertices;
        let bad = mesh.triangles.par_iter().position_first(|corners| corners.iter().any(is_bad));
        if let Some(triangle) = bad {
            let vertex = mesh.triangles[triangle].into_iter().find(is_bad).unwrap_or(u32::MAX);
            return Err(AccelError::VertexOutOfRange { mesh: index, triangle, vertex, vertices });
        }
    }
    Ok(())
}

/// A tree for each mesh that `shared` places and that has triangles, and for each mesh the index of its tree.
fn shared_trees(
    meshes: &[MeshGeometry],
    shared: &[Placed],
    rejects: &Rejects,
) -> (Vec<Tree>, Vec<Option<u32>>) {
    let mut is_used = vec![false; meshes.len()];
    shared.iter().for_each(|placed| is_used[placed.mesh] = true);
    let built: Vec<Option<Tree>> = meshes
        .par_iter()
        .zip(&is_used)
        .map(|(mesh, &is_used)| {
            is_used.then(|| triangle_tree(triangles(mesh, u32::MAX, None, rejects))).flatten()
        })
        .collect();
    let mut trees = Vec::new();
    let tree_of_mesh = built
        .into_iter()
        .map(|tree| {
            trees.push(tree?);
            Some(trees.len() as u32 - 1)
        })
        .collect();
    (trees, tree_of_mesh)
}

/// The boxes of the root's children.
fn child_bounds(tree: &Tree) -> Vec<Bounds> {
    let planes = &tree.nodes[0].bounds;
    (0..WIDTH)
        .map(|child| {
            let corner = |side: usize| Vec3::from_array([0, 1, 2].map(|axis| planes[axis][side][child]));
            Bounds { min: corner(0), max: corner(1) }
        })
        .filter(|bounds| bounds.min.x <= bounds.max.x)
        .collect()
}
