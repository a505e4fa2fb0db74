//! Ray tracing: closest hit and any hit over instanced triangle meshes.
//!
//! obvhs builds binary trees; they are collapsed into eight-wide trees of `f32` boxes over blocks of four triangles.
//! A mesh that one instance uses is baked into a single world-space tree, a mesh that several use is stored once and
//! reached through a tree of instances.
//!
//! What the queries promise, and the tests hold them to:
//! * Watertight: the triangle test is that of Woop, Benthin and Wald ("Watertight Ray/Triangle Intersection",
//!   JCGT 2013), and no box test ever rejects a box that holds a triangle which would be hit.
//! * The answer does not depend on the shape of the tree, the number of threads or the instruction set: among equal
//!   distances the smaller (instance, triangle) wins.
//! * A triangle is hit only where it is certain to lie in front of the ray's origin, so rays that leave a surface from
//!   [`offset::SurfacePoint::spawn`] never meet it again and need no fixed epsilon.

mod binary;
mod build;
mod collapse;
mod geometry;
mod kernel;
pub mod offset;
mod ray;
mod twins;
mod walk;

use glam::{Affine3A, Vec3};

use kernel::{Instance, Isa, Tree};

/// A half-line or segment `origin + t * direction`, `t` in `[max(t_min, 0), t_max]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// World-space start.
    pub origin: Vec3,
    /// World-space direction of any length above zero; `t` counts in units of it.
    pub direction: Vec3,
    /// Smallest accepted `t`; values below zero count as zero.
    pub t_min: f32,
    /// Largest accepted `t`; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// The half-line from `origin` towards `direction`.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in units of the ray's direction.
    pub t: f32,
    /// Index into the instances given to [`Accel::build`].
    pub instance: u32,
    /// Index into the triangles of the instance's mesh.
    pub triangle: u32,
    /// Barycentric coordinate of the triangle's second vertex.
    pub u: f32,
    /// Barycentric coordinate of the triangle's third vertex.
    pub v: f32,
}

/// A triangle mesh in its own space.
#[derive(Clone, Copy, Debug)]
pub struct MeshGeometry<'a> {
    /// Vertex positions, in mesh space.
    pub positions: &'a [Vec3],
    /// Three indices into `positions` a triangle.
    pub triangles: &'a [[u32; 3]],
}

/// One placement of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct InstanceGeometry {
    /// Index into the meshes given to [`Accel::build`].
    pub mesh: u32,
    /// Mesh space to world space; may mirror and shear.
    pub to_world: Affine3A,
}

/// Input that cannot be built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AccelError {
    /// An instance names a mesh that does not exist.
    #[error("instance {instance} uses mesh {mesh}, but there are only {meshes} meshes")]
    MeshOutOfRange {
        /// The instance.
        instance: usize,
        /// The mesh it names.
        mesh: u32,
        /// Number of meshes given.
        meshes: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error("mesh {mesh}, triangle {triangle} uses vertex {vertex}, but there are only {vertices} vertices")]
    VertexOutOfRange {
        /// The mesh.
        mesh: usize,
        /// The triangle in it.
        triangle: usize,
        /// The vertex index it names.
        vertex: u32,
        /// Number of vertices of the mesh.
        vertices: usize,
    },
    /// More than 2^31 triangles in one tree, or as many instances.
    #[error("{count} {what} are more than the {limit} that one tree can hold")]
    TooMany {
        /// "triangles" or "instances".
        what: &'static str,
        /// How many were given.
        count: usize,
        /// How many are possible.
        limit: usize,
    },
}

/// What [`Accel::build`] left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Triangles with a coordinate that is NaN, infinite or beyond 1e12 in size, in mesh or world space.
    pub non_finite_triangles: usize,
    /// Triangles without area.
    pub degenerate_triangles: usize,
    /// Instances whose transform is singular or not finite.
    pub singular_instances: usize,
}

/// The ray tracing structure over one scene; it keeps its own copy of the geometry.
pub struct Accel {
    /// Everything that is placed once, in world space.
    baked: Option<Tree>,
    /// Meshes that several instances share, in mesh space.
    shared: Vec<Tree>,
    /// Tree over `instances`; its leaves are indices into them.
    top: Option<Tree>,
    instances: Vec<Instance>,
    /// One bit an instance of the input: it is part of `baked`.
    is_baked: Vec<u64>,
    bounds: (Vec3, Vec3),
    dropped: Dropped,
    isa: Isa,
}

impl Accel {
    /// Builds the structure on the current rayon pool.
    ///
    /// Triangles and instances that no ray can meet are left out and counted, see [`Accel::dropped`].
    pub fn build(meshes: &[MeshGeometry], instances: &[InstanceGeometry]) -> Result<Accel, AccelError> {
        build::build(meshes, instances)
    }

    /// The nearest hit, or none. Among hits at equal `t` the smallest (instance, triangle).
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_where(ray, &|_| true)
    }

    /// Whether anything lies on the ray. What lies within rounding of `t_max` does not count.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_where(ray, &|_| true)
    }

    /// The nearest hit that `accept` agrees to. `accept` sees hits in no particular order.
    #[inline]
    pub fn closest_where(&self, ray: &Ray, accept: &impl Fn(&Hit) -> bool) -> Option<Hit> {
        kernel::closest(self.isa, self, ray, accept)
    }

    /// Whether anything that `accept` agrees to lies on the ray.
    #[inline]
    pub fn occluded_where(&self, ray: &Ray, accept: &impl Fn(&Hit) -> bool) -> bool {
        kernel::occluded(self.isa, self, ray, accept)
    }

    /// Smallest and largest world-space corner of what was built; both zero when nothing was.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// Heap memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        let trees = self.baked.iter().chain(&self.shared).chain(&self.top);
        trees.map(Tree::memory_bytes).sum::<usize>()
            + self.instances.capacity() * size_of::<Instance>()
            + self.shared.capacity() * size_of::<Tree>()
            + self.is_baked.capacity() * size_of::<u64>()
    }

    /// What was left out of the build.
    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// Whether `instance` was baked into the world-space tree.
    fn is_baked(&self, instance: u32) -> bool {
        self.is_baked[instance as usize / 64] >> (instance % 64) & 1 == 1
    }
}

#[cfg(test)]
mod tests;
