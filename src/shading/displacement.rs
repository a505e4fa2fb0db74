//! Surfaces that materials move: displaced meshes instead of those that were given. Vertices move along their normals, so a
//! mesh must be fine enough for what is to be seen of it.

use super::surface::{face_normal, normal_matrix, normalize_any};
use super::texture::{MeshPoint, TextureSet};
use crate::scene::material::Displacement;
use crate::scene::mesh::Attribute;
use crate::scene::relief::BumpSpace;
use crate::scene::{InstanceGroup, Mesh, Scene, Warnings};
use glam::{Mat3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Barycentrics of a triangle's corners.
const CORNERS: [Vec2; 3] = [Vec2::ZERO, Vec2::X, Vec2::Y];

/// The scene with its displaced meshes. Those that stand somewhere with another displacement are there twice.
pub(super) fn displaced(scene: Arc<Scene>, warnings: &mut Warnings) -> Arc<Scene> {
    let moves = |group: &InstanceGroup| {
        group.materials.iter().any(|&m| scene.materials[m as usize].displacement.is_some())
    };
    // the first instance of each group; there may be none
    let mut stands: BTreeMap<u32, u32> = BTreeMap::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        if moves(&scene.groups[instance.group as usize]) {
            stands.entry(instance.group).or_insert(i as u32);
        }
    }
    if stands.is_empty() {
        return scene;
    }
    let textures = TextureSet::new(scene.clone());
    let mut result = Scene::clone(&scene);
    let displacements = |group: &InstanceGroup| -> Vec<String> {
        let of_material = |&m: &u32| format!("{:?}", scene.materials[m as usize].displacement);
        group.materials.iter().map(of_material).collect()
    };
    // by mesh and by what displaces it: colours may differ
    let mut made: BTreeMap<(u32, Vec<String>), u32> = BTreeMap::new();
    for (k, group) in scene.groups.iter().enumerate() {
        let Some(&instance) = stands.get(&(k as u32)) else { continue };
        let mesh = *made.entry((group.mesh, displacements(group))).or_insert_with(|| {
            let (mesh, bad) = displace(&scene, &textures, group, instance);
            if bad > 0 {
                let what = "vertices with a displacement that is not finite stay where they are";
                warnings.add(format!("mesh {:?}", mesh.name), what, bad);
            }
            result.meshes.push(Arc::new(mesh));
            result.meshes.len() as u32 - 1
        });
        result.groups[k].mesh = mesh;
    }
    Arc::new(result)
}

/// The mesh of a group as its materials displace it, and how many vertices have no finite place.
fn displace(scene: &Scene, textures: &TextureSet, group: &InstanceGroup, instance: u32) -> (Mesh, u64) {
    let mesh = &scene.meshes[group.mesh as usize];
    let given: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| corner_normals(mesh, t)).collect();
    let normals = vertex_normals(mesh, &given);
    let to_world = Mat3::from(scene.instances[instance as usize].to_world.matrix3);
    let (of_normals, from_world) = (normal_matrix(to_world), to_world.inverse());
    let displacement = |triangle: usize| {
        let slot = mesh.slots.as_ref().map_or(0, |s| s[triangle] as usize);
        scene.materials[group.material(slot) as usize].displacement.as_ref()
    };
    let mut is_placed = vec![false; mesh.positions.len()];
    let mut result = Mesh::clone(mesh);
    let mut bad = 0;
    for (t, vertices) in mesh.triangles.iter().enumerate() {
        let Some(Displacement { height, space, .. }) = displacement(t) else { continue };
        for (&v, barycentrics) in vertices.iter().zip(CORNERS) {
            // those that triangles share are the first one's
            if std::mem::replace(&mut is_placed[v as usize], true) {
                continue;
            }
            let at = MeshPoint::new(instance, group.mesh, t as u32, barycentrics);
            let height = textures.number(height, &at);
            let normal = normals[v as usize];
            let moved = match space {
                BumpSpace::Object => normal * height,
                BumpSpace::World => from_world * (normalize_any(of_normals * normal) * height),
            };
            let position = &mut result.positions[v as usize];
            if (*position + moved).is_finite() {
                *position += moved;
            } else {
                bad += 1;
            }
        }
    }
    let keeps = |triangle: usize| displacement(triangle).is_some_and(|d| d.keeps_normals);
    result.normals = new_normals(mesh, &given, &result.positions, keeps);
    (result, bad)
}

/// Shading normals at the corners of a triangle.
fn corner_normals(mesh: &Mesh, triangle: usize) -> [Vec3; 3] {
    let vertices = mesh.triangles[triangle];
    let flat = || face_normal(&mesh.positions, vertices);
    let given = mesh.normals.as_ref().map(|n| n.corners(triangle, vertices).unwrap_or_else(|n| [n; 3]));
    given.map_or_else(
        || [flat(); 3],
        |given| given.map(|n| Some(normalize_any(n)).filter(|&n| n != Vec3::ZERO).unwrap_or_else(flat)),
    )
}

/// The directions in which vertices move, of the normals at the corners of triangles.
fn vertex_normals(mesh: &Mesh, given: &[[Vec3; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; mesh.positions.len()];
    for (vertices, normals) in mesh.triangles.iter().zip(given) {
        for (&v, n) in vertices.iter().zip(normals) {
            sums[v as usize] += *n;
        }
    }
    sums.into_iter().map(normalize_any).collect()
}

/// Shading normals of moved vertices: corners of a vertex that had one normal have one again, the mean of their triangles'. Some
/// triangles keep what they were given.
fn new_normals(
    mesh: &Mesh,
    given: &[[Vec3; 3]],
    positions: &[Vec3],
    keeps: impl Fn(usize) -> bool,
) -> Option<Attribute<Vec3>> {
    let is_smooth = matches!(mesh.normals, Some(Attribute::Vertex(_) | Attribute::Corner(_)));
    if !is_smooth && !(0..mesh.triangles.len()).any(&keeps) {
        return None;
    }
    let keys = |t: usize| {
        let normals = given[t].map(|n| n.to_array().map(f32::to_bits));
        let vertices = mesh.triangles[t];
        [0, 1, 2].map(|k| (vertices[k], normals[k]))
    };
    let mut sums: BTreeMap<(u32, [u32; 3]), Vec3> = BTreeMap::new();
    for (t, &vertices) in mesh.triangles.iter().enumerate() {
        let n = face_normal(positions, vertices);
        keys(t).into_iter().for_each(|key| *sums.entry(key).or_default() += n);
    }
    let of_corners = |t: usize| {
        if keeps(t) {
            given[t]
        } else if is_smooth {
            keys(t).map(|key| normalize_any(sums[&key]))
        } else {
            [face_normal(positions, mesh.triangles[t]); 3]
        }
    };
    Some(Attribute::Corner((0..mesh.triangles.len()).map(of_corners).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneBuilder;
    use crate::scene::mesh::{AttributeInput, Interpolation, MeshInput};
    use glam::DMat4;

    /// Two squares of 8 x 8 cells, scaled by two, that share their mesh; the second one's material displaces it by its
    /// colour, half a wave along x, which the last vertex has not.
    fn scene(space: &str) -> Arc<Scene> {
        let mut b = SceneBuilder::new();
        let points: Vec<Vec3> =
            (0..81).map(|i| Vec3::new((i % 9) as f32, (i / 9) as f32, 0.0) / 8.0).collect();
        let mut heights: Vec<f32> =
            points.iter().flat_map(|p| [(p.x * std::f32::consts::PI).sin(), 0.0, 0.0]).collect();
        heights[3 * 80] = f32::NAN;
        let corner = |x: u32, y: u32| y * 9 + x;
        let faces: Vec<u32> = (0..64)
            .map(|i| (i % 8, i / 8))
            .flat_map(|(x, y)| [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)])
            .collect();
        let attributes = [AttributeInput {
            name: "h",
            data: &heights,
            components: 3,
            interpolation: Interpolation::Vertex,
            indices: None,
        }];
        let up = vec![Vec3::Z; points.len()];
        let mesh = MeshInput {
            name: "square",
            points: &points,
            face_counts: Some(&[4; 64]),
            face_indices: &faces,
            normals: Some((&up, Interpolation::Vertex)),
            attributes: &attributes,
            ..Default::default()
        };
        b.add_mesh(&mesh).unwrap();
        b.add_texture("h", r#"{"type":"attribute","name":"h","default":[0,0,0,1]}"#).unwrap();
        let json = |displacement: &str| format!(r#"{{"surface":{{"type":"diffuse"}}{displacement}}}"#);
        let moving =
            format!(r#","displacement":{{"height":{{"texture":0,"channel":"r"}},"space":"{space}"}}"#);
        for displacement in ["", moving.as_str()] {
            let material = b.add_material("m", &json(displacement)).unwrap();
            let group = InstanceGroup {
                name: "g".into(),
                mesh: 0,
                materials: vec![material],
                camera_visible: true,
                two_sided_emission: false,
                object_index: 0,
            };
            let doubled = DMat4::from_scale(glam::DVec3::splat(2.0)).transpose().to_cols_array();
            b.add_instances(group, &[doubled]).unwrap();
        }
        b.set_camera("c", r#"{"window":[-1,1,-1,1],"transform":[1,0,0,0,0,1,0,0,0,0,1,5,0,0,0,1]}"#).unwrap();
        Arc::new(b.build().unwrap())
    }

    #[test]
    fn vertices_move_along_normals_and_get_new_ones() {
        for (space, factor) in [("object", 1.0), ("world", 0.5)] {
            let before = scene(space);
            let mut warnings = Warnings::default();
            let after = displaced(before.clone(), &mut warnings);
            assert_eq!((after.groups[0].mesh, after.groups[1].mesh, after.meshes.len()), (0, 1, 2));
            assert!(Arc::ptr_eq(&after.meshes[0], &before.meshes[0]), "the other one stays");
            let mesh = &after.meshes[1];
            for (p, q) in mesh.positions.iter().zip(&before.meshes[0].positions).take(80) {
                let wanted = *q + Vec3::Z * (factor * (q.x * std::f32::consts::PI).sin());
                assert!((*p - wanted).length() < 1e-6, "{space}: {p} {wanted}");
            }
            assert_eq!(mesh.positions[80], before.meshes[0].positions[80]);
            assert_eq!(warnings.lines().len(), 1);
            // in the middle upright again, at a quarter leaning like the wave
            let at = |x: u32, y: u32| {
                let vertex = y * 9 + x;
                let (t, k) = (0..mesh.triangles.len())
                    .find_map(|t| Some((t, mesh.triangles[t].iter().position(|&v| v == vertex)?)))
                    .unwrap();
                corner_normals(mesh, t)[k]
            };
            assert!((at(4, 3) - Vec3::Z).length() < 0.02);
            let slope = factor * std::f32::consts::PI * std::f32::consts::FRAC_1_SQRT_2;
            assert!((at(2, 3) - Vec3::new(-slope, 0.0, 1.0).normalize()).length() < 0.05, "{}", at(2, 3));
        }
    }

    #[test]
    fn normals_are_kept_where_bumps_tell_the_slopes() {
        let mut kept = Scene::clone(&scene("object"));
        kept.materials
            .iter_mut()
            .filter_map(|m| m.displacement.as_mut())
            .for_each(|d| d.keeps_normals = true);
        let after = displaced(Arc::new(kept), &mut Warnings::default());
        let mesh = &after.meshes[1];
        assert!((mesh.positions[4].z - 1.0).abs() < 1e-6);
        assert!((0..mesh.triangles.len()).all(|t| corner_normals(mesh, t) == [Vec3::Z; 3]));
    }

    #[test]
    fn what_nothing_displaces_is_left_as_it_is() {
        let mut plain = Scene::clone(&scene("object"));
        plain.materials.iter_mut().for_each(|m| m.displacement = None);
        let plain = Arc::new(plain);
        assert!(Arc::ptr_eq(&displaced(plain.clone(), &mut Warnings::default()), &plain));
    }
}
