//! Scene building over the border.

use super::{Failure, SceneHandle, ffi, guard};
use crate::scene::image::{Encoding, Image, Pixels};
use crate::scene::mesh::{AttributeInput, Interpolation, MeshInput};
use crate::scene::{InstanceGroup, Needs, SceneBuilder};
use glam::Vec3;
use half::f16;
use serde_json::json;

/// An empty scene.
pub(super) fn new_scene() -> Result<Box<SceneHandle>, Failure> {
    guard(|| Ok(Box::new(SceneHandle(SceneBuilder::new()))))
}

fn interpolation(what: &str, code: u32) -> Result<Interpolation, Failure> {
    match code {
        0 => Ok(Interpolation::Constant),
        1 => Ok(Interpolation::Face),
        2 => Ok(Interpolation::Vertex),
        3 => Ok(Interpolation::Corner),
        _ => Err(Failure::argument(format!("{what}: {code} is not an interpolation"))),
    }
}

fn vectors(flat: &[f32]) -> Vec<Vec3> {
    flat.chunks_exact(3).map(Vec3::from_slice).collect()
}

/// Values of `N` bytes each, in the machine's order.
fn values<T, const N: usize>(bytes: &[u8], read: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|b| read(*b)).collect()
}

impl SceneHandle {
    pub(super) fn add_mesh(&mut self, m: &ffi::MeshView) -> Result<u32, Failure> {
        guard(|| {
            let what = |part: &str| format!("mesh {:?}: {part}", m.name);
            let attributes = m
                .attributes
                .iter()
                .map(|a| {
                    Ok(AttributeInput {
                        name: a.name,
                        data: a.data,
                        components: a.components as usize,
                        interpolation: interpolation(&what(a.name), a.interpolation)?,
                        indices: a.has_indices.then_some(a.indices),
                    })
                })
                .collect::<Result<Vec<_>, Failure>>()?;
            let points = vectors(m.points);
            let normals = vectors(m.normals);
            let at = interpolation(&what("normals"), m.normal_interpolation)?;
            Ok(self.0.add_mesh(&MeshInput {
                name: m.name,
                points: &points,
                face_counts: m.has_face_counts.then_some(m.face_counts),
                face_indices: m.face_indices,
                holes: m.holes,
                normals: m.has_normals.then_some((&normals[..], at)),
                face_slots: m.has_slots.then_some(m.face_slots),
                left_handed: m.left_handed,
                attributes: &attributes,
            })?)
        })
    }

    pub(super) fn add_image(&mut self, i: &ffi::ImageView) -> Result<u32, Failure> {
        guard(|| {
            let encoding = match i.colorspace {
                "raw" | "linear" => Encoding::Linear,
                "srgb" => Encoding::Srgb,
                other => {
                    return Err(Failure::argument(format!(
                        "image {:?}: unknown colorspace {other:?}",
                        i.name
                    )));
                }
            };
            let pixels = match i.pixel_type {
                0 => Pixels::U8(i.bytes.to_vec()),
                1 => Pixels::U16(values(i.bytes, u16::from_ne_bytes)),
                2 => Pixels::F16(values(i.bytes, f16::from_ne_bytes)),
                3 => Pixels::F32(values(i.bytes, f32::from_ne_bytes)),
                other => return Err(Failure::argument(format!("image {:?}: no pixel type {other}", i.name))),
            };
            let size = (i.width, i.height, i.channels);
            let image = Image::new(i.name, size, pixels, encoding, self.0.warnings_mut())?;
            Ok(self.0.add_image(image)?)
        })
    }

    pub(super) fn add_texture(&mut self, name: &str, json: &str) -> Result<u32, Failure> {
        guard(|| Ok(self.0.add_texture(name, json)?))
    }

    pub(super) fn add_material(&mut self, name: &str, json: &str) -> Result<u32, Failure> {
        guard(|| Ok(self.0.add_material(name, json)?))
    }

    pub(super) fn add_light(&mut self, name: &str, json: &str) -> Result<u32, Failure> {
        guard(|| Ok(self.0.add_light(name, json)?))
    }

    pub(super) fn set_camera(&mut self, name: &str, json: &str) -> Result<(), Failure> {
        guard(|| Ok(self.0.set_camera(name, json)?))
    }

    pub(super) fn add_instances(&mut self, i: &ffi::InstancesView) -> Result<(), Failure> {
        guard(|| {
            let group = InstanceGroup {
                name: i.name.into(),
                mesh: i.mesh,
                materials: i.materials.to_vec(),
                camera_visible: i.camera_visible,
                two_sided_emission: i.two_sided_emission,
                object_index: i.object_index,
            };
            Ok(self.0.add_instances(group, i.transforms.as_chunks::<16>().0)?)
        })
    }

    pub(super) fn info(&self) -> Result<String, Failure> {
        guard(|| {
            let counts: serde_json::Map<_, _> =
                self.0.counts().into_iter().map(|(k, v)| (k.to_string(), v.into())).collect();
            let info = match self.0.build() {
                Ok(scene) => {
                    let needs = Needs::of(&scene);
                    json!({"warnings": scene.warnings.lines(), "needs": needs,
                           "left_out": needs.left_out(), "counts": counts})
                }
                Err(e) => {
                    let mut lines = self.0.warnings().lines();
                    lines.push(e.to_string());
                    json!({"warnings": lines, "needs": {}, "left_out": [], "counts": counts})
                }
            };
            Ok(info.to_string())
        })
    }
}
