//! The triangles of a scene that emit.

use super::emitters::MeshTriangle;
use super::material::Materials;
use super::texture::MeshPoint;
use crate::scene::needs::may_emit;
use crate::scene::{Scene, Warnings};
use glam::{Vec2, Vec3};

/// Emissive triangles beyond this number are found by hitting them only: choosing among so many costs
/// more memory than it is worth.
const MOST_SAMPLED_TRIANGLES: usize = 1 << 23;
/// Points of a triangle at which its mean radiance is taken, and cosines from which it is looked at there.
const EMISSION_POINTS: [(Vec2, f32); 7] = [
    (Vec2::new(1.0 / 3.0, 1.0 / 3.0), 0.5),
    (Vec2::new(0.1, 0.1), 0.9),
    (Vec2::new(0.8, 0.1), 0.3),
    (Vec2::new(0.1, 0.8), 0.7),
    (Vec2::new(0.45, 0.45), -0.5),
    (Vec2::new(0.1, 0.45), -0.9),
    (Vec2::new(0.45, 0.1), -0.3),
];

/// The triangles that emit, with their mean radiance.
pub(super) fn emissive_triangles(
    scene: &Scene,
    materials: &Materials,
    warnings: &mut Warnings,
) -> Vec<MeshTriangle> {
    let emits: Vec<bool> = scene.materials.iter().map(may_emit).collect();
    let mut triangles = Vec::new();
    for (i, instance) in scene.instances.iter().enumerate() {
        let group = &scene.groups[instance.group as usize];
        if !group.materials.iter().any(|&m| emits[m as usize]) {
            continue;
        }
        let mesh = &scene.meshes[group.mesh as usize];
        if triangles.len() + mesh.triangles.len() > MOST_SAMPLED_TRIANGLES {
            let what = "too many emissive triangles: the rest of them is not sampled, only hit";
            warnings.add(format!("instances {:?}", group.name), what, 1);
            break;
        }
        for t in 0..mesh.triangles.len() as u32 {
            let material = scene.material_index(i as u32, t);
            if !emits[material as usize] {
                continue;
            }
            let at = |barycentrics| MeshPoint::new(i as u32, group.mesh, t, barycentrics);
            let sum: Vec3 = EMISSION_POINTS
                .into_iter()
                .map(|(b, facing)| {
                    let facing = if group.two_sided_emission { facing } else { facing.abs() };
                    materials.emission(material, &at(b), || facing) * materials.opacity(material, &at(b))
                })
                .sum();
            let corners = mesh.triangles[t as usize].map(|v| mesh.positions[v as usize]);
            let [a, b, c] = corners.map(|p| instance.to_world.transform_point3(p));
            let vertices = if scene.is_mirrored(i as u32) { [a, c, b] } else { [a, b, c] };
            triangles.push(MeshTriangle {
                instance: i as u32,
                triangle: t,
                vertices,
                radiance: sum / EMISSION_POINTS.len() as f32,
                two_sided: group.two_sided_emission,
            });
        }
    }
    triangles
}
