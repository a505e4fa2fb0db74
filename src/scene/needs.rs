//! What a scene needs of the engine. Everything above asks this, so that what a scene does not contain
//! costs it nothing.

use super::light::LightKind;
use super::material::Closure;
use super::texture::Texture;
use super::value::{Channel, Value};
use super::{Material, Scene};
use glam::Vec3;
use serde::Serialize;

/// Features that a scene uses. A feature that is `false` is left out of the render.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Needs {
    /// Some surface lets light straight through: holes, cut-outs, transparent closures.
    pub transparency: bool,
    /// Some object is hidden from camera rays.
    pub camera_visibility: bool,
    /// The lens has a size.
    pub depth_of_field: bool,
    /// Some parameter comes from a texture.
    pub textures: bool,
    /// Some material has a normal map or a bump map.
    pub normal_maps: bool,
    /// Some surface emits.
    pub emissive_surfaces: bool,
    /// Lights that rays can meet at a finite distance.
    pub light_shapes: bool,
    /// Lights infinitely far away.
    pub infinite_lights: bool,
    /// Some surface may be a mirror or smooth glass.
    pub mirrors: bool,
    /// The inside of some object absorbs.
    pub absorption: bool,
}

impl Needs {
    /// Everything: nothing is left out.
    pub const ALL: Self = Self {
        transparency: true,
        camera_visibility: true,
        depth_of_field: true,
        textures: true,
        normal_maps: true,
        emissive_surfaces: true,
        light_shapes: true,
        infinite_lights: true,
        mirrors: true,
        absorption: true,
    };

    /// What the instances, lights and camera of a scene need.
    pub fn of(scene: &Scene) -> Self {
        let mut used = vec![false; scene.materials.len()];
        let groups = scene.instances.iter().map(|i| i.group);
        let mut seen = vec![false; scene.groups.len()];
        for g in groups {
            if !std::mem::replace(&mut seen[g as usize], true) {
                scene.groups[g as usize].materials.iter().for_each(|&m| used[m as usize] = true);
            }
        }
        let materials: Vec<&Material> =
            scene.materials.iter().zip(&used).filter(|&(_, &u)| u).map(|(m, _)| m).collect();
        let any_closure = |test: &dyn Fn(&Closure) -> bool| {
            materials.iter().any(|m| {
                let mut found = false;
                m.surface.for_each(&mut |c| found |= test(c));
                found
            })
        };
        Self {
            transparency: materials.iter().any(|m| may_be_transparent(m, scene)),
            camera_visibility: scene.groups.iter().zip(&seen).any(|(g, &seen)| seen && !g.camera_visible),
            depth_of_field: scene.camera.aperture_radius > 0.0,
            textures: materials.iter().any(|m| {
                let mut found = false;
                m.for_each_value(&mut |v| found |= matches!(v, Value::Texture { .. }));
                found
            }),
            normal_maps: any_closure(&|c| c.reliefs().next().is_some()),
            emissive_surfaces: materials.iter().any(|m| may_emit(m)),
            light_shapes: scene.lights.iter().any(|l| {
                !matches!(
                    l.kind,
                    LightKind::Point { .. } | LightKind::Distant { .. } | LightKind::Dome { .. }
                )
            }),
            infinite_lights: scene
                .lights
                .iter()
                .any(|l| matches!(l.kind, LightKind::Distant { .. } | LightKind::Dome { .. })),
            mirrors: any_closure(&may_be_mirror),
            absorption: materials.iter().any(|m| m.absorption != Vec3::ZERO),
        }
    }

    /// What is left out, one line each, for the log and the statistics.
    pub fn left_out(&self) -> Vec<String> {
        [
            (self.transparency, "transparency along rays and shadow rays: every used surface is opaque"),
            (self.camera_visibility, "visibility tests of camera rays: no object is hidden from the camera"),
            (self.depth_of_field, "lens sampling: the camera is a pinhole"),
            (self.textures, "texture lookups: every used material is constant"),
            (self.normal_maps, "tangent frames: no used material has a normal or bump map"),
            (self.emissive_surfaces, "emission of surfaces: no used material emits"),
            (self.light_shapes, "intersection with light shapes: no light has one"),
            (self.infinite_lights, "environment: no light is infinitely far away"),
            (self.absorption, "absorption along rays: the inside of no object absorbs"),
            (self.mirrors, "specular chains: no used surface is a mirror or smooth glass"),
        ]
        .into_iter()
        .filter(|(needed, _)| !needed)
        .map(|(_, what)| what.to_string())
        .collect()
    }
}

/// Whether a value may be other than the constant `v` somewhere.
fn may_differ_from_one(value: &Value, scene: &Scene) -> bool {
    match value {
        Value::Constant(_) => !value.is(1.0),
        Value::Texture { texture, channel } => match (&scene.textures[*texture as usize], channel) {
            // the alpha of a picture without alpha
            (Texture::Image(t), Channel::A) => {
                scene.images[t.image as usize].has_alpha() || t.scale.w != 1.0 || t.bias.w != 0.0
            }
            _ => true,
        },
    }
}

/// Whether light may pass straight through a material.
pub fn may_be_transparent(material: &Material, scene: &Scene) -> bool {
    let mut found = may_differ_from_one(&material.opacity, scene);
    material
        .surface
        .for_each(&mut |c| found |= matches!(c, Closure::Transparent { color } if !color.is(0.0)));
    found
}

/// Whether a material may emit.
pub fn may_emit(material: &Material) -> bool {
    let mut found = false;
    material.surface.for_each(&mut |c| {
        found |= match c {
            Closure::Emission { color, strength } => !color.is(0.0) && !strength.is(0.0),
            Closure::Principled(p) => !p.emission_color.is(0.0) && !p.emission_strength.is(0.0),
            _ => false,
        }
    });
    found
}

/// Whether a closure may have lobes that are Dirac deltas, straight passage apart.
fn may_be_mirror(closure: &Closure) -> bool {
    // alpha, its square, is well above where lobes become deltas
    let is_rough = |roughness: &Value| matches!(roughness, Value::Constant(r) if r.min_element() >= 0.02);
    match closure {
        Closure::Glossy { roughness, .. } => !is_rough(roughness),
        // of an index close to one, rough glass is smooth, too
        Closure::Glass { .. } | Closure::Refraction { .. } => true,
        Closure::Principled(p) => {
            !p.transmission.is(0.0)
                || !is_rough(&p.roughness)
                || (!p.coat.is(0.0) && !is_rough(&p.coat_roughness))
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::mesh::MeshInput;
    use crate::scene::{InstanceGroup, SceneBuilder};
    use glam::{DMat4, Vec3};

    fn builder() -> SceneBuilder {
        let mut b = SceneBuilder::new();
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y];
        b.add_mesh(&MeshInput { name: "t", points: &points, face_indices: &[0, 1, 2], ..Default::default() })
            .unwrap();
        b.set_camera("c", r#"{"window":[-1,1,-1,1],"transform":[1,0,0,1e6,0,1,0,0,0,0,1,5,0,0,0,1]}"#)
            .unwrap();
        b
    }

    fn group(materials: &[u32]) -> InstanceGroup {
        InstanceGroup {
            name: "g".into(),
            mesh: 0,
            materials: materials.to_vec(),
            camera_visible: true,
            two_sided_emission: false,
            object_index: 0,
        }
    }

    fn at(x: f64) -> [f64; 16] {
        DMat4::from_translation(glam::DVec3::new(x, 0.0, 0.0)).transpose().to_cols_array()
    }

    #[test]
    fn only_what_is_used_is_needed() {
        let mut b = builder();
        let grey = b.add_material("grey", r#"{"surface":{"type":"diffuse"}}"#).unwrap();
        let lamp = b.add_material("lamp", r#"{"surface":{"type":"emission"},"opacity":0.5}"#).unwrap();
        b.add_instances(group(&[grey]), &[at(0.0)]).unwrap();
        let n = super::Needs::of(&b.build().unwrap());
        assert!(
            !n.emissive_surfaces && !n.transparency && !n.light_shapes && !n.infinite_lights && !n.textures
        );
        assert_eq!(n.left_out().len(), 10);
        // instances of none of it: still not needed
        b.add_instances(group(&[lamp]), &[]).unwrap();
        assert!(!super::Needs::of(&b.build().unwrap()).emissive_surfaces);
        b.add_instances(group(&[lamp]), &[at(1.0)]).unwrap();
        b.add_light("sky", r#"{"type":"dome","radiance":[1,1,1]}"#).unwrap();
        let n = super::Needs::of(&b.build().unwrap());
        assert!(n.emissive_surfaces && n.transparency && n.infinite_lights && !n.mirrors);
        assert!(super::Needs::ALL.left_out().is_empty());
    }

    #[test]
    fn what_may_be_a_mirror_is_taken_for_one() {
        let is_mirror = |surface: &str| super::may_be_mirror(&serde_json::from_str(surface).unwrap());
        for surface in [
            r#"{"type":"glossy","roughness":0}"#,
            r#"{"type":"glossy","roughness":{"texture":0}}"#,
            r#"{"type":"glass","roughness":0.5}"#,
            r#"{"type":"principled","roughness":0.001}"#,
            r#"{"type":"principled","transmission":0.1}"#,
            r#"{"type":"principled","coat":0.2,"coat_roughness":0}"#,
        ] {
            assert!(is_mirror(surface), "{surface}");
        }
        for surface in [
            r#"{"type":"glossy","roughness":0.1}"#,
            r#"{"type":"principled","coat_roughness":0}"#,
            r#"{"type":"transparent"}"#,
            r#"{"type":"diffuse"}"#,
        ] {
            assert!(!is_mirror(surface), "{surface}");
        }
    }

    #[test]
    fn positions_are_relative_to_the_camera_in_double_precision() {
        let mut b = builder();
        b.add_instances(group(&[]), &[at(1e6 + 0.001), at(0.0)]).unwrap();
        let s = b.build().unwrap();
        approx::assert_relative_eq!(s.instances[0].to_world.translation.x, 0.001, max_relative = 1e-4);
        assert_eq!(s.instances[1].to_world.translation.z, -5.0);
        assert_eq!(s.materials[s.material_index(0, 0) as usize].name, "default");
    }

    #[test]
    fn what_refers_to_nothing_is_an_error_and_what_cannot_be_hit_is_counted() {
        let mut b = builder();
        assert!(b.add_instances(group(&[7]), &[]).unwrap_err().to_string().contains("no material 7"));
        assert!(b.add_instances(InstanceGroup { mesh: 3, ..group(&[]) }, &[]).is_err());
        assert!(b.add_light("l", r#"{"type":"dome","radiance":[1,1,1],"image":0}"#).is_err());
        let mut flat = at(0.0);
        flat[0] = 0.0;
        let mut broken = at(0.0);
        broken[3] = f64::NAN;
        b.add_instances(group(&[]), &[flat, at(0.0), broken]).unwrap();
        let s = b.build().unwrap();
        assert_eq!((s.instances.len(), s.warnings.lines().len()), (1, 2));
        assert!(SceneBuilder::new().build().unwrap_err().to_string().contains("camera"));
    }
}
