//! Building a scene piece by piece, checking each as it comes.

use super::camera::affine_from_rows;
use super::instance::{Instance, InstanceGroup, is_regular};
use super::light::{Light, LightSpec};
use super::mesh::MeshInput;
use super::{Camera, Image, Material, Mesh, SceneError, Texture, Warnings};
use glam::{Affine3A, DAffine3, DVec3};
use std::sync::Arc;

/// A scene in the making: what has been added so far, in world coordinates of double precision.
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    meshes: Vec<Arc<Mesh>>,
    images: Vec<Arc<Image>>,
    textures: Vec<Texture>,
    materials: Vec<Material>,
    lights: Vec<LightSpec>,
    camera: Option<Camera>,
    groups: Vec<InstanceGroup>,
    instances: Vec<(DAffine3, u32)>,
    warnings: Warnings,
}

/// A complete, valid scene. Positions are relative to [`Scene::origin`].
#[derive(Clone, Debug)]
pub struct Scene {
    /// Triangle meshes in object space.
    pub meshes: Vec<Arc<Mesh>>,
    /// Pictures.
    pub images: Vec<Arc<Image>>,
    /// Textures; their image indices are valid.
    pub textures: Vec<Texture>,
    /// Materials; their texture indices are valid. The last one is the default grey.
    pub materials: Vec<Material>,
    /// Lights other than emissive meshes.
    pub lights: Vec<Light>,
    /// The camera; its `to_world` still is absolute.
    pub camera: Camera,
    /// What instances share.
    pub groups: Vec<InstanceGroup>,
    /// Where meshes stand.
    pub instances: Vec<Instance>,
    /// The world position of the scene's coordinate origin: the camera's, so that single precision is
    /// best where the picture is taken, however far that is from the world's origin.
    pub origin: DVec3,
    /// What was repaired or left out.
    pub warnings: Warnings,
}

fn next_id(len: usize, what: &str) -> Result<u32, SceneError> {
    u32::try_from(len).map_err(|_| SceneError::new("scene", format!("it has more than 2^32 {what}")))
}

impl SceneBuilder {
    /// An empty scene.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a mesh; its index.
    pub fn add_mesh(&mut self, input: &MeshInput) -> Result<u32, SceneError> {
        let id = next_id(self.meshes.len(), "meshes")?;
        let mesh = Mesh::new(input, &mut self.warnings)?;
        self.meshes.push(Arc::new(mesh));
        Ok(id)
    }

    /// Adds an image made with [`Image::new`]; its index.
    pub fn add_image(&mut self, image: Image) -> Result<u32, SceneError> {
        let id = next_id(self.images.len(), "images")?;
        self.images.push(Arc::new(image));
        Ok(id)
    }

    /// Adds a texture from its JSON description; its index.
    pub fn add_texture(&mut self, name: &str, json: &str) -> Result<u32, SceneError> {
        let id = next_id(self.textures.len(), "textures")?;
        let texture = Texture::from_json(name, json, &self.images, &self.textures)?;
        self.textures.push(texture);
        Ok(id)
    }

    /// Adds a material from its JSON description; its index.
    pub fn add_material(&mut self, name: &str, json: &str) -> Result<u32, SceneError> {
        let id = next_id(self.materials.len(), "materials")?;
        let material = Material::from_json(name, json, self.textures.len())?;
        if material.is_clamped() {
            let what = "a colour or share of light outside 0 to 1 is clamped";
            self.warnings.add(format!("material {name:?}"), what, 1);
        }
        self.materials.push(material);
        Ok(id)
    }

    /// Adds a light from its JSON description; its index.
    pub fn add_light(&mut self, name: &str, json: &str) -> Result<u32, SceneError> {
        let id = next_id(self.lights.len(), "lights")?;
        let light = LightSpec::from_json(name, json)?;
        if let Some(image) = light.image().filter(|&i| i as usize >= self.images.len()) {
            return Err(SceneError::new(format!("light {name:?}"), format!("there is no image {image}")));
        }
        self.lights.push(light);
        Ok(id)
    }

    /// Sets the camera from its JSON description.
    pub fn set_camera(&mut self, name: &str, json: &str) -> Result<(), SceneError> {
        self.camera = Some(Camera::from_json(name, json)?);
        Ok(())
    }

    /// Adds instances of one mesh. `transforms` are row-major 4x4 matrices. An empty list of
    /// materials means the default grey.
    pub fn add_instances(
        &mut self,
        group: InstanceGroup,
        transforms: &[[f64; 16]],
    ) -> Result<(), SceneError> {
        let object = format!("instances {:?}", group.name);
        let fail = |problem: String| Err(SceneError::new(object.clone(), problem));
        if group.mesh as usize >= self.meshes.len() {
            return fail(format!("there is no mesh {}", group.mesh));
        }
        if let Some(m) = group.materials.iter().find(|&&m| m as usize >= self.materials.len()) {
            return fail(format!("there is no material {m}"));
        }
        let id = next_id(self.groups.len(), "instance groups")?;
        next_id(self.instances.len() + transforms.len(), "instances")?;
        let (mut singular, mut broken) = (0, 0);
        self.instances.reserve(transforms.len());
        for rows in transforms {
            match affine_from_rows(rows) {
                Ok(m) if is_regular(&m) => self.instances.push((m, id)),
                Ok(_) => singular += 1,
                Err(_) => broken += 1,
            }
        }
        if singular > 0 {
            self.warnings.add(&object, "instances with a singular transform dropped", singular);
        }
        if broken > 0 {
            self.warnings.add(&object, "instances with a non-finite or projective transform dropped", broken);
        }
        self.groups.push(group);
        Ok(())
    }

    /// Notes something that a front end had to work around.
    pub fn warnings_mut(&mut self) -> &mut Warnings {
        &mut self.warnings
    }

    /// What was repaired or left out so far.
    pub fn warnings(&self) -> &Warnings {
        &self.warnings
    }

    /// Numbers of things, for `segue info`.
    pub fn counts(&self) -> [(&'static str, usize); 7] {
        [
            ("meshes", self.meshes.len()),
            ("triangles", self.meshes.iter().map(|m| m.triangles.len()).sum()),
            ("instances", self.instances.len()),
            ("materials", self.materials.len()),
            ("textures", self.textures.len()),
            ("images", self.images.len()),
            ("lights", self.lights.len()),
        ]
    }

    /// The scene as it stands. An error where it cannot be rendered at all.
    pub fn build(&self) -> Result<Scene, SceneError> {
        let camera = self.camera.clone().ok_or_else(|| SceneError::new("scene", "it has no camera"))?;
        let origin = camera.to_world.translation;
        let mut warnings = self.warnings.clone();
        let mut materials = self.materials.clone();
        let default = next_id(materials.len(), "materials")?;
        materials.push(Material::default());
        let mut groups = self.groups.clone();
        groups.iter_mut().filter(|g| g.materials.is_empty()).for_each(|g| g.materials.push(default));

        let mut instances = Vec::with_capacity(self.instances.len());
        let mut far = 0;
        for (m, group) in &self.instances {
            let local = DAffine3 { matrix3: m.matrix3, translation: m.translation - origin };
            let to_world = Affine3A::from_cols_array(&local.to_cols_array().map(|v| v as f32));
            match to_world.is_finite() {
                true => instances.push(Instance { to_world, group: *group }),
                false => far += 1,
            }
        }
        if far > 0 {
            warnings.add("scene", "instances too far from the camera for single precision dropped", far);
        }
        if instances.is_empty() && self.lights.is_empty() {
            warnings.add("scene", "it has neither geometry nor lights", 1);
        }
        let mut lights = Vec::with_capacity(self.lights.len());
        for spec in &self.lights {
            let local = DAffine3 { translation: spec.to_world.translation - origin, ..spec.to_world };
            lights.extend(spec.place(&local, &mut warnings)?);
        }
        Ok(Scene {
            meshes: self.meshes.clone(),
            images: self.images.clone(),
            textures: self.textures.iter().map(|t| t.clone().relative_to(origin)).collect(),
            materials,
            lights,
            camera,
            groups,
            instances,
            origin,
            warnings,
        })
    }
}

impl Scene {
    /// Mesh of an instance.
    #[inline]
    pub fn mesh(&self, instance: u32) -> &Mesh {
        &self.meshes[self.group(instance).mesh as usize]
    }

    /// Group of an instance.
    #[inline]
    pub fn group(&self, instance: u32) -> &InstanceGroup {
        &self.groups[self.instances[instance as usize].group as usize]
    }

    /// Whether an instance turns its mesh inside out, so that corners wind the other way round.
    #[inline]
    pub fn is_mirrored(&self, instance: u32) -> bool {
        self.instances[instance as usize].to_world.matrix3.determinant() < 0.0
    }

    /// Index of the material of a triangle of an instance.
    #[inline]
    pub fn material_index(&self, instance: u32, triangle: u32) -> u32 {
        let slot = self.mesh(instance).slots.as_ref().map_or(0, |s| s[triangle as usize]);
        self.group(instance).material(slot as usize)
    }
}
