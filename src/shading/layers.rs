//! All surfaces on a short way through space.

use super::class::SurfaceClass;
use super::surface::{normalize_any, shading_normal};
use super::texture::MeshPoint;
use super::world::World;
use crate::accel::{Hit, Ray};
use glam::{Mat3, Vec2, Vec3};
use smallvec::SmallVec;
use std::cell::RefCell;

/// Surfaces so close behind another one, as a part of the way, are hidden by it.
const SAME_PLACE: f32 = 1e-5;

/// A point of a surface, scene space; less than a [`super::SurfacePoint`], from which no ray is to leave.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    /// Where it is, as a part of the way.
    pub depth: f32,
    /// Where that is.
    pub position: Vec3,
    /// Unit geometric normal, out of the front side.
    pub normal: Vec3,
    /// Unit shading normal, in the hemisphere of the geometric one.
    pub ns: Vec3,
    /// How the material may share light with its neighbours.
    pub class: SurfaceClass,
}

impl World {
    /// Calls `found` for the surfaces between two points in space, one after the other, the first `most` of them.
    pub fn for_each_surface(&self, from: Vec3, to: Vec3, most: usize, mut found: impl FnMut(&Layer)) {
        let hits = RefCell::new(SmallVec::<[Hit; 8]>::new());
        let ray = Ray { t_max: 1.0, ..Ray::new(from, to - from) };
        // all of them in one walk: none is good enough to end it
        self.accel.closest_where(&ray, &|hit| {
            hits.borrow_mut().push(*hit);
            false
        });
        let mut hits = hits.into_inner();
        let key = |h: &Hit| (h.instance, h.triangle);
        hits.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(key(a).cmp(&key(b))));
        hits.dedup_by(|next, last| next.t - last.t < SAME_PLACE);
        hits.iter().take(most).for_each(|hit| found(&self.layer(from.lerp(to, hit.t), hit)));
    }

    fn layer(&self, position: Vec3, hit: &Hit) -> Layer {
        let index = self.scene.group(hit.instance).mesh;
        let mesh = &self.scene.meshes[index as usize];
        let matrix = Mat3::from(self.scene.instances[hit.instance as usize].to_world.matrix3);
        let [a, b, c] = mesh.triangles[hit.triangle as usize].map(|v| mesh.positions[v as usize]);
        let outside = (matrix * (b - a)).cross(matrix * (c - a)) * 1f32.copysign(matrix.determinant());
        let normal = normalize_any(outside);
        let at = MeshPoint::new(hit.instance, index, hit.triangle, Vec2::new(hit.u, hit.v));
        Layer {
            depth: hit.t,
            position,
            normal,
            ns: shading_normal(&self.scene, &at, normal),
            class: self.class(self.scene.material_index(hit.instance, hit.triangle)),
        }
    }
}
