//! Shading frames: the mesh's normal, or what a normal map or a bump map makes of it.

use super::material::Materials;
use super::surface::{SurfacePoint, normal_matrix, normalize_any};
use crate::math::Frame;
use crate::scene::relief::{BumpMap, BumpSpace, NormalMap, NormalSpace, Relief, Tangent};
use glam::{Mat3, Vec2, Vec3};

impl Materials {
    /// The shading frame.
    pub(super) fn frame(&self, relief: Option<&Relief>, p: &SurfacePoint) -> Frame {
        Frame::from_normal(relief.map_or(p.ns, |relief| self.relief(relief, p)))
    }

    /// The shading frame with its x axis along a tangent.
    pub(super) fn tangent_frame(
        &self,
        relief: Option<&Relief>,
        tangent: &Tangent,
        p: &SurfacePoint,
    ) -> Frame {
        let n = relief.map_or(p.ns, |relief| self.relief(relief, p));
        let along = match tangent {
            Tangent::Uv(name) => {
                let set = self.textures.uv_set(name, p.at.mesh);
                set.map_or(Vec3::ZERO, |set| p.tangent(&self.scene, set))
            }
            Tangent::Along(v) => {
                let m = Mat3::from(self.scene.instances[p.instance as usize].to_world.matrix3);
                normalize_any(normal_matrix(m) * self.textures.color(v, &p.at))
            }
        };
        Frame::from_normal_tangent(n, along)
    }

    fn relief(&self, relief: &Relief, p: &SurfacePoint) -> Vec3 {
        match relief {
            Relief::Normals(map) => self.mapped_normal(map, p),
            Relief::Heights(map) => self.bumped_normal(map, p),
        }
    }

    fn mapped_normal(&self, map: &NormalMap, p: &SurfacePoint) -> Vec3 {
        let v = self.textures.lookup(map.texture, &p.at).truncate();
        let n = match map.space {
            NormalSpace::World => v,
            NormalSpace::Object => {
                let m = Mat3::from(self.scene.instances[p.instance as usize].to_world.matrix3);
                normal_matrix(m) * v
            }
            NormalSpace::Tangent => {
                let Some(set) = self.textures.uv_set(&map.uv, p.at.mesh) else { return p.ns };
                let tangent = p.tangent(&self.scene, set);
                if tangent == Vec3::ZERO {
                    return p.ns;
                }
                let f = Frame::from_normal_tangent(p.ns, tangent);
                let bitangent = if p.uv_is_mirrored(&self.scene, set) { -f.t } else { f.t };
                f.s * v.x + bitangent * v.y + f.n * v.z
            }
        };
        let n = normalize_any(n);
        blended(p.ns, n, self.textures.number(&map.strength, &p.at))
    }

    /// The surface's gradient of Mikkelsen 2010, "Bump mapping unparametrized surfaces on the GPU", along the edges of the triangle.
    fn bumped_normal(&self, map: &BumpMap, p: &SurfacePoint) -> Vec3 {
        let n = map.normal.as_ref().map_or(p.ns, |below| self.relief(below, p));
        let rise = self.textures.slopes(&map.height, &p.at) * self.textures.number(&map.distance, &p.at);
        let leaned = match map.space {
            BumpSpace::World => leaned(n, p.edges(&self.scene), rise),
            BumpSpace::Object => {
                let m = Mat3::from(self.scene.instances[p.instance as usize].to_world.matrix3);
                // the normal's covector goes back by the transpose
                let own = normalize_any(m.transpose() * n);
                normalize_any(normal_matrix(m) * leaned(own, p.own_edges(&self.scene), rise))
            }
        };
        blended(n, leaned, self.textures.number(&map.strength, &p.at))
    }
}

/// The normal of a surface with these edges, from a common corner, if it rises by so much along each.
fn leaned(n: Vec3, [e1, e2]: [Vec3; 2], rise: Vec2) -> Vec3 {
    // lengths are about one, so that products of those of small triangles are not zero
    let scale = e1.abs().max(e2.abs()).max_element();
    let [e1, e2] = [e1, e2].map(|e| e / scale);
    let (across_2, across_1) = (e2.cross(n), n.cross(e1));
    let det = e1.dot(across_2);
    let rise = rise * (1f32.copysign(det) / scale);
    normalize_any(n * det.abs() - across_2 * rise.x - across_1 * rise.y)
}

/// Between two unit normals, or beyond the second.
fn blended(n: Vec3, other: Vec3, strength: f32) -> Vec3 {
    let between = normalize_any(n + (other - n) * strength.max(0.0));
    if between == Vec3::ZERO { n } else { between }
}
