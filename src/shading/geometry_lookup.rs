//! What the geometry of a surface has for textures: where a point is, and how it is turned.

use super::surface::{face_normal, normal_matrix, normalize_any, on_side_of};
use super::texture::{MeshPoint, interpolate};
use crate::scene::Scene;
use crate::scene::texture::{GeometryTexture, Quantity, Space};
use glam::{Mat3, Vec3};

/// A quantity of the geometry as a texture has it.
pub(super) fn geometry(scene: &Scene, t: &GeometryTexture, at: &MeshPoint) -> Vec3 {
    let to_world = &scene.instances[at.instance as usize].to_world;
    let turned = |own: Vec3| match t.space {
        Space::Object => own,
        Space::World => normalize_any(normal_matrix(Mat3::from(to_world.matrix3)) * own),
    };
    let vector = match t.of {
        Quantity::Normal => turned(own_normal(scene, at)),
        Quantity::FaceNormal => turned(own_face_normal(scene, at) * 1f32.copysign(at.facing)),
        Quantity::Position => {
            let mesh = &scene.meshes[at.mesh as usize];
            let [a, b, c] = mesh.triangles[at.triangle as usize].map(|i| mesh.positions[i as usize]);
            let own = a + (b - a) * at.barycentrics.x + (c - a) * at.barycentrics.y;
            match t.space {
                Space::Object => own,
                Space::World => to_world.transform_point3(own),
            }
        }
    };
    // far from the world's origin, coordinates that are relative to the camera's are finer
    t.to.transform_point3(vector.as_dvec3()).as_vec3()
}

/// Unit shading normal of the mesh in its own space, on the side that is seen.
pub(super) fn own_normal(scene: &Scene, at: &MeshPoint) -> Vec3 {
    let mesh = &scene.meshes[at.mesh as usize];
    let face = own_face_normal(scene, at);
    let front = mesh
        .normals
        .as_ref()
        .map_or(face, |normals| on_side_of(face, normalize_any(interpolate(normals, mesh, at))));
    front * 1f32.copysign(at.facing)
}

/// Unit normal of the triangle in the mesh's space, out of its front.
fn own_face_normal(scene: &Scene, at: &MeshPoint) -> Vec3 {
    let mesh = &scene.meshes[at.mesh as usize];
    face_normal(&mesh.positions, mesh.triangles[at.triangle as usize])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh::MeshInput;
    use crate::scene::value::{Channel, Value};
    use crate::scene::{InstanceGroup, SceneBuilder};
    use crate::shading::texture::{Looks, TextureSet};
    use glam::{DMat4, DVec3, Vec2};
    use std::sync::Arc;

    const TEXTURES: [&str; 5] = [
        r#"{"type":"geometry","of":"position"}"#,
        r#"{"type":"geometry","of":"position","transform":[0,0,2,1, 1,0,0,0, 0,1,0,-3]}"#,
        r#"{"type":"geometry","of":"position","space":"object"}"#,
        r#"{"type":"geometry","of":"face_normal"}"#,
        r#"{"type":"geometry","of":"normal","space":"object"}"#,
    ];

    /// The triangle x + y + z = 1 in its own space, stretched or mirrored along x and moved far away, where the camera is.
    fn looked_up(stretch: f64, facing: f32) -> ([Vec3; 5], [Looks; 5]) {
        let mut b = SceneBuilder::new();
        let points = [Vec3::X, Vec3::Y, Vec3::Z];
        let mesh = MeshInput { name: "t", points: &points, face_indices: &[0, 1, 2], ..Default::default() };
        b.add_mesh(&mesh).unwrap();
        for texture in TEXTURES {
            b.add_texture("g", texture).unwrap();
        }
        let to_world =
            DMat4::from_translation(DVec3::splat(1e6)) * DMat4::from_scale(DVec3::new(stretch, 1.0, 1.0));
        let group = InstanceGroup {
            name: "g".into(),
            mesh: 0,
            materials: vec![],
            camera_visible: true,
            two_sided_emission: false,
            object_index: 0,
        };
        b.add_instances(group, &[to_world.transpose().to_cols_array()]).unwrap();
        let camera = r#"{"window":[-1,1,-1,1],"transform":[1,0,0,1e6, 0,1,0,1e6, 0,0,1,1000005, 0,0,0,1]}"#;
        b.set_camera("c", camera).unwrap();
        let textures = TextureSet::new(Arc::new(b.build().unwrap()));
        let at = MeshPoint { facing, ..MeshPoint::new(0, 0, 0, Vec2::new(0.25, 0.5)) };
        let value = |texture| Value::Texture { texture, channel: Channel::Rgb };
        let all = [0, 1, 2, 3, 4];
        (all.map(|t| textures.color(&value(t), &at)), all.map(|t| textures.looks(&value(t))))
    }

    #[test]
    fn places_are_those_of_the_world_and_of_the_mesh() {
        let ([world, turned, own, ..], looks) = looked_up(4.0, 0.7);
        assert!(
            (world - Vec3::new(1e6 + 1.0, 1e6 + 0.25, 1e6 + 0.5)).abs().max_element() <= 0.0625,
            "{world}"
        );
        assert!(
            (turned - Vec3::new(2e6 + 2.0, 1e6 + 1.0, 1e6 - 2.75)).abs().max_element() <= 0.125,
            "{turned}"
        );
        assert!((own - Vec3::new(0.25, 0.25, 0.5)).length() < 1e-6, "{own}");
        assert_eq!(looks, [Looks::Same, Looks::Same, Looks::Same, Looks::Side, Looks::Side]);
    }

    #[test]
    fn normals_are_those_of_the_side_that_is_seen() {
        let diagonal = Vec3::splat(3f32.sqrt().recip());
        for (stretch, front) in [(4.0, Vec3::new(0.25, 1.0, 1.0)), (-4.0, Vec3::new(-0.25, 1.0, 1.0))] {
            for (facing, side) in [(0.7, 1.0), (-0.1, -1.0)] {
                let ([.., world, own], _) = looked_up(stretch, facing);
                assert!((world - side * front.normalize()).length() < 1e-6, "{stretch} {facing}: {world}");
                assert!((own - side * diagonal).length() < 1e-6, "{stretch} {facing}: {own}");
            }
        }
    }
}
