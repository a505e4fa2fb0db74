//! What a ray finds where it hits: position, normals, tangents.

use super::bsdf::Bsdf;
use super::emitters::Receiver;
use super::texture::{MeshPoint, interpolate};
use crate::accel::offset::SurfacePoint as Place;
use crate::accel::{Accel, Hit};
use crate::scene::{Mesh, Scene};
use glam::{Mat3, Vec2, Vec3};

/// A point on a surface, in scene space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position, with its rounding error and the geometric normal: out of the front side, where corners
    /// wind counter-clockwise in object space.
    pub place: Place,
    /// Unit shading normal, in the hemisphere of the geometric one.
    pub ns: Vec3,
    /// Instance that was hit.
    pub instance: u32,
    /// Material there.
    pub material: u32,
    /// Where that is on the mesh.
    pub at: MeshPoint,
}

/// Which point of which surface: enough to find it again.
#[derive(Clone, Copy, Debug)]
pub struct Address {
    /// Instance.
    pub instance: u32,
    /// Triangle of its mesh.
    pub triangle: u32,
    /// Barycentrics in the triangle.
    pub barycentrics: Vec2,
}

/// A point of a mesh in the world, as the ray tracer sees it.
pub fn place(scene: &Scene, accel: &Accel, at: &MeshPoint) -> Place {
    let mesh = &scene.meshes[at.mesh as usize];
    let corners = mesh.triangles[at.triangle as usize].map(|i| mesh.positions[i as usize]);
    let to_world = &scene.instances[at.instance as usize].to_world;
    accel.surface_point(at.instance, corners, to_world, at.barycentrics.to_array())
}

/// Object-to-world map of normals, up to a positive factor: the cofactor matrix, turned so that a
/// mirrored instance keeps its outside.
pub fn normal_matrix(m: Mat3) -> Mat3 {
    let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis];
    let cofactors = Mat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
    if m.determinant() < 0.0 { -cofactors } else { cofactors }
}

/// Normalises without under- or overflow, whatever the scale.
pub fn normalize_any(v: Vec3) -> Vec3 {
    let scale = v.abs().max_element();
    if scale > 0.0 && scale.is_finite() { (v / scale).normalize() } else { Vec3::ZERO }
}

/// Unit normal of a triangle of these points, out of its front; zero if it has none.
pub fn face_normal(points: &[Vec3], vertices: [u32; 3]) -> Vec3 {
    let [a, b, c] = vertices.map(|v| points[v as usize]);
    normalize_any((b - a).cross(c - a))
}

/// A unit shading normal on the side of the geometric one, or that one where it is none (zero).
pub fn on_side_of(geometric: Vec3, shading: Vec3) -> Vec3 {
    match shading.length_squared() > 0.5 {
        true => shading * 1f32.copysign(shading.dot(geometric)),
        false => geometric,
    }
}

/// Unit shading normal at a point of an instance's mesh, on the side of the geometric one.
pub fn shading_normal(scene: &Scene, at: &MeshPoint, geometric: Vec3) -> Vec3 {
    let mesh = &scene.meshes[at.mesh as usize];
    let Some(normals) = &mesh.normals else { return geometric };
    let matrix = Mat3::from(scene.instances[at.instance as usize].to_world.matrix3);
    on_side_of(geometric, normalize_any(normal_matrix(matrix) * interpolate(normals, mesh, at)))
}

/// Cosine between a direction and the shading normal, negative on the back of the surface.
pub fn facing(ns: Vec3, geometric: Vec3, wo: Vec3) -> f32 {
    ns.dot(wo).abs().copysign(geometric.dot(wo))
}

impl SurfacePoint {
    /// Where to find it again.
    pub fn address(&self) -> Address {
        Address { instance: self.instance, triangle: self.at.triangle, barycentrics: self.at.barycentrics }
    }

    /// The surface where a ray hit.
    pub fn new(scene: &Scene, accel: &Accel, hit: &Hit) -> Self {
        let group = scene.group(hit.instance);
        let at = MeshPoint::new(hit.instance, group.mesh, hit.triangle, Vec2::new(hit.u, hit.v));
        let place = place(scene, accel, &at);
        Self {
            place,
            ns: shading_normal(scene, &at, place.normal),
            instance: hit.instance,
            material: scene.material_index(hit.instance, hit.triangle),
            at,
        }
    }

    /// The point, and how its surface is turned towards the direction that it is seen from.
    pub fn seen_from(&self, wo: Vec3) -> Self {
        let at = MeshPoint { facing: facing(self.ns, self.place.normal, wo), ..self.at };
        Self { at, ..*self }
    }

    /// This point as one that light is sampled for: from all sides where its `bsdf` transmits, else from
    /// the side of `wo` alone.
    pub fn receiver(&self, bsdf: &Bsdf, wo: Vec3) -> Receiver {
        let facing = if self.place.normal.dot(wo) < 0.0 { -self.place.normal } else { self.place.normal };
        Receiver { position: self.place.position, normal: (!bsdf.transmits()).then_some(facing) }
    }

    /// The edges of the triangle that leave its first vertex, in the world.
    pub fn edges(&self, scene: &Scene) -> [Vec3; 2] {
        let matrix = Mat3::from(scene.instances[self.instance as usize].to_world.matrix3);
        self.own_edges(scene).map(|e| matrix * e)
    }

    /// The same in the mesh's own space.
    pub fn own_edges(&self, scene: &Scene) -> [Vec3; 2] {
        let mesh: &Mesh = &scene.meshes[self.at.mesh as usize];
        let [a, b, c] = mesh.triangles[self.at.triangle as usize].map(|i| mesh.positions[i as usize]);
        [b - a, c - a]
    }

    /// The world-space derivative of the position by u of a UV set, or zero where it has none.
    pub fn tangent(&self, scene: &Scene, uv_set: usize) -> Vec3 {
        let mesh: &Mesh = &scene.meshes[self.at.mesh as usize];
        let vertices = mesh.triangles[self.at.triangle as usize];
        let Ok([ua, ub, uc]) = mesh.uvs[uv_set].1.corners(self.at.triangle as usize, vertices) else {
            return Vec3::ZERO;
        };
        let [a, b, c] = vertices.map(|i| mesh.positions[i as usize]);
        let (d1, d2) = (ub - ua, uc - ua);
        let det = d1.perp_dot(d2);
        let t = ((b - a) * d2.y - (c - a) * d1.y) * 1f32.copysign(det);
        let matrix = Mat3::from(scene.instances[self.instance as usize].to_world.matrix3);
        if det != 0.0 { normalize_any(matrix * normalize_any(t)) } else { Vec3::ZERO }
    }

    /// Whether the UV set winds against the triangle, so that its bitangent is turned over.
    pub fn uv_is_mirrored(&self, scene: &Scene, uv_set: usize) -> bool {
        let mesh: &Mesh = &scene.meshes[self.at.mesh as usize];
        let vertices = mesh.triangles[self.at.triangle as usize];
        let mirrored = match mesh.uvs[uv_set].1.corners(self.at.triangle as usize, vertices) {
            Ok([a, b, c]) => (b - a).perp_dot(c - a) < 0.0,
            Err(_) => false,
        };
        mirrored != (Mat3::from(scene.instances[self.instance as usize].to_world.matrix3).determinant() < 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_stay_normal_under_shear_and_mirror() {
        let m =
            Mat3::from_cols(Vec3::new(2.0, 0.1, 0.0), Vec3::new(1.0, -3.0, 0.5), Vec3::new(0.0, 0.3, 0.7));
        for m in [m, -m] {
            let (e1, e2) = (Vec3::new(1.0, 0.2, 0.0), Vec3::new(-0.3, 1.0, 0.4));
            let n = normal_matrix(m) * e1.cross(e2);
            assert!(n.dot(m * e1).abs() < 1e-4 && n.dot(m * e2).abs() < 1e-4);
            // what was outside stays outside
            let out = e1.cross(e2);
            assert!(n.dot(m * out) > 0.0);
        }
    }

    #[test]
    fn tiny_and_huge_vectors_normalise() {
        for s in [1e-30, 1e30] {
            assert!((normalize_any(Vec3::new(3.0, 0.0, 4.0) * s) - Vec3::new(0.6, 0.0, 0.8)).length() < 1e-6);
        }
        assert_eq!(normalize_any(Vec3::ZERO), Vec3::ZERO);
        assert_eq!(normalize_any(Vec3::NAN), Vec3::ZERO);
    }
}
