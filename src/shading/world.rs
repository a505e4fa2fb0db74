//! The scene made ready: what integrators ask of it. Rays through holes and transparent surfaces, lights
//! met and lights sampled, surfaces shaded.

use super::bsdf::{Bsdf, Walk};
use super::class::SurfaceClass;
use super::displacement::displaced;
use super::emissive::emissive_triangles;
use super::emitters::{EmitterHit, Emitters, Incident, MeshTriangle, Receiver, SceneBounds};
use super::material::Materials;
use super::ray::{LightPoint, LightSample, Piece, Target};
use super::surface::{Address, SurfacePoint, facing, place, shading_normal};
use super::texture::{MeshPoint, interpolate};
use crate::accel::offset::SurfacePoint as Place;
use crate::accel::{Accel, AccelError, Hit, InstanceGeometry, MeshGeometry, Ray};
use crate::scene::needs::may_emit;
use crate::scene::{Material, Needs, Scene, SceneError, Warnings};
use glam::{DVec2, DVec3, Vec2, Vec2Swizzles, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Why a scene could not be made ready.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum WorldError {
    #[error(transparent)]
    Accel(#[from] AccelError),
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// What building a part took.
#[derive(Clone, Copy, Debug)]
pub struct BuildCost {
    /// Which part.
    pub name: &'static str,
    /// Seconds on the wall clock.
    pub seconds: f64,
    /// Bytes it keeps.
    pub bytes: u64,
}

/// A scene, ready to be traced and shaded. Positions are relative to [`Scene::origin`].
pub struct World {
    pub(super) scene: Arc<Scene>,
    pub(super) accel: Accel,
    pub(super) materials: Materials,
    pub(super) emitters: Emitters,
    classes: Vec<SurfaceClass>,
    /// Absorption coefficient inside of objects, by material, per scene unit.
    pub(super) absorption: Vec<Vec3>,
    needs: Needs,
    warnings: Warnings,
    costs: Vec<BuildCost>,
    most_survival: f32,
}

/// Vertices of a path between white walls, on average: where there are many paths, and at most.
const PATH_LENGTHS: [f32; 2] = [50.0, 2000.0];
/// Such vertices of all paths of an iteration together, where they may be longer.
const PATH_VERTICES: f32 = (1 << 23) as f32;

/// A surface point, shaded.
#[derive(Clone, Debug)]
pub struct Vertex {
    /// How it scatters. Without transparency, which is visibility's.
    pub bsdf: Bsdf,
    /// Radiance that it emits towards where it is seen from.
    pub emission: Vec3,
}

/// What a ray does at a surface.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // the large one is the usual one
pub enum Shaded {
    /// It passes straight through.
    Through {
        /// Factor on its throughput.
        weight: Vec3,
    },
    /// It is scattered or absorbed.
    Scatters {
        /// Factor on its throughput.
        weight: Vec3,
        /// Share of the surface that is there, which is in `weight`.
        opacity: f32,
        /// The surface.
        vertex: Vertex,
    },
}

impl World {
    /// Builds the ray tracing structure and the emitters, on the current rayon pool. `keep_all`: leave
    /// out nothing that this scene does not need.
    pub fn new(scene: Arc<Scene>, keep_all: bool) -> Result<Self, WorldError> {
        let needs = if keep_all { Needs::ALL } else { Needs::of(&scene) };
        let mut warnings = scene.warnings.clone();
        let mut costs = Vec::new();

        let start = Instant::now();
        let given = scene.clone();
        let scene = displaced(scene, &mut warnings);
        if !Arc::ptr_eq(&scene, &given) {
            let bytes = scene.meshes[given.meshes.len()..].iter().map(|m| m.memory_bytes() as u64).sum();
            let seconds = start.elapsed().as_secs_f64();
            costs.push(BuildCost { name: "displacement", seconds, bytes });
        }
        drop(given);

        let start = Instant::now();
        let meshes: Vec<MeshGeometry> = scene
            .meshes
            .iter()
            .map(|m| MeshGeometry { positions: &m.positions, triangles: &m.triangles })
            .collect();
        let instances: Vec<InstanceGeometry> = scene
            .instances
            .iter()
            .map(|i| InstanceGeometry { mesh: scene.groups[i.group as usize].mesh, to_world: i.to_world })
            .collect();
        let accel = Accel::build(&meshes, &instances)?;
        drop(instances);
        let dropped = accel.dropped();
        for (what, n) in [
            (
                "triangles too far away or too large for single precision dropped",
                dropped.non_finite_triangles,
            ),
            ("triangles without area in single precision dropped", dropped.degenerate_triangles),
            ("instances with a singular transform dropped", dropped.singular_instances),
        ] {
            if n > 0 {
                warnings.add("scene", what, n as u64);
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        costs.push(BuildCost { name: "acceleration structure", seconds, bytes: accel.memory_bytes() as u64 });

        let start = Instant::now();
        let materials = Materials::new(scene.clone(), &mut warnings);
        let triangles = emissive_triangles(&scene, &materials, &mut warnings);
        let (low, high) = accel.bounds();
        let bounds = SceneBounds {
            center: (low + high) * 0.5,
            // an empty scene still has a sky
            radius: Some(0.5 * (high - low).length()).filter(|&r| r > 0.0).unwrap_or(1.0),
        };
        let emitters = Emitters::build(&scene.lights, &triangles, &scene.images, bounds, &mut warnings)?;
        let bytes = (triangles.len() * size_of::<MeshTriangle>()) as u64;
        costs.push(BuildCost { name: "lights", seconds: start.elapsed().as_secs_f64(), bytes });
        if emitters.is_empty() {
            warnings.add("scene", "nothing emits light: the picture will be black", 1);
        }
        let classes = (0..scene.materials.len() as u32).map(|m| materials.class(m)).collect();
        let absorption = absorption_coefficients(&scene, &mut warnings);
        let most_survival = survival_for(PATH_LENGTHS[0]);
        Ok(Self {
            scene,
            accel,
            materials,
            emitters,
            classes,
            absorption,
            needs,
            warnings,
            costs,
            most_survival,
        })
    }

    /// For so many paths from the camera, or from the lights, that are kept at a time: the fewer, the longer they may
    /// be. Roulette that ends a path more often than surfaces absorb makes the noise of closed rooms grow with every
    /// bounce, and without bound where `albedo² > survival`.
    pub fn with_kept_paths(self, paths: f32) -> Self {
        let [shortest, longest] = PATH_LENGTHS;
        let length = (PATH_VERTICES / paths.max(1.0)).clamp(shortest, longest);
        Self { most_survival: survival_for(length), ..self }
    }

    /// Greatest probability with which roulette lets a path go on. Below one, so that a closed white scene lets go.
    #[inline]
    pub fn most_survival(&self) -> f32 {
        self.most_survival
    }

    /// The scene's data.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What the scene needs.
    #[inline]
    pub fn needs(&self) -> &Needs {
        &self.needs
    }

    /// Whether there may be light that light paths alone find: of lights that no ray meets, by way of mirrors or glass.
    pub fn has_hidden_light(&self) -> bool {
        self.needs.mirrors && self.emitters.has_delta()
    }

    /// What was repaired or left out, the scene's own warnings included.
    pub fn warnings(&self) -> &Warnings {
        &self.warnings
    }

    /// What building took.
    pub fn costs(&self) -> &[BuildCost] {
        &self.costs
    }

    /// A scene position in world coordinates.
    pub fn absolute(&self, p: Vec3) -> Vec3 {
        (p.as_dvec3() + self.scene.origin).as_vec3()
    }

    /// A world position in scene coordinates.
    pub fn relative(&self, p: DVec3) -> Vec3 {
        (p - self.scene.origin).as_vec3()
    }

    /// How the surfaces of a material may share light with their neighbours.
    #[inline]
    pub fn class(&self, material: u32) -> SurfaceClass {
        self.classes[material as usize]
    }

    /// The surface at a point of an instance's mesh.
    pub fn surface(&self, at: &Address) -> SurfacePoint {
        let Address { instance, triangle, barycentrics } = *at;
        let hit = Hit { t: 0.0, instance, triangle, u: barycentrics.x, v: barycentrics.y };
        SurfacePoint::new(&self.scene, &self.accel, &hit)
    }

    /// The surface of an instance's triangle at a point of it, to rounding; barycentrics of the address do not count.
    pub fn surface_near(&self, at: &Address, point: Vec3) -> SurfacePoint {
        let [origin, a, b] = self.corners(at).map(Vec3::as_dvec3);
        let (a, b, p) = (a - origin, b - origin, point.as_dvec3() - origin);
        let (aa, ab, bb, pa, pb) = (a.dot(a), a.dot(b), b.dot(b), p.dot(a), p.dot(b));
        let scale = 1.0 / (aa * bb - ab * ab);
        let uv = DVec2::new(pa * bb - pb * ab, pb * aa - pa * ab) * scale;
        let uv = if uv.is_finite() { uv.clamp(DVec2::ZERO, DVec2::ONE) } else { DVec2::splat(1.0 / 3.0) };
        self.surface(&Address { barycentrics: uv.as_vec2(), ..*at })
    }

    /// Corners of an instance's triangle, scene space, if it has one shading normal.
    pub fn flat_triangle(&self, at: &Address) -> Option<[Vec3; 3]> {
        let Address { instance, triangle, .. } = *at;
        let index = self.scene.group(instance).mesh;
        let mesh = &self.scene.meshes[index as usize];
        if let Some(normals) = &mesh.normals {
            let normal = |u: f32, v: f32| {
                interpolate(normals, mesh, &MeshPoint::new(instance, index, triangle, Vec2::new(u, v)))
            };
            if normal(0.0, 0.0) != normal(1.0, 0.0) || normal(0.0, 0.0) != normal(0.0, 1.0) {
                return None;
            }
        }
        Some(self.corners(at))
    }

    /// Corners of an instance's triangle, scene space.
    fn corners(&self, at: &Address) -> [Vec3; 3] {
        let mesh = &self.scene.meshes[self.scene.group(at.instance).mesh as usize];
        let to_world = &self.scene.instances[at.instance as usize].to_world;
        let corner = |v: u32| to_world.transform_point3(mesh.positions[v as usize]);
        mesh.triangles[at.triangle as usize].map(corner)
    }

    /// The scattering at a surface point that is seen along `wo`.
    pub fn bsdf(&self, p: &SurfacePoint, wo: Vec3) -> Bsdf {
        self.materials.bsdf(p, wo)
    }

    /// The same, if it may be another one than from another direction.
    pub fn bsdf_again(&self, p: &SurfacePoint, wo: Vec3) -> Option<Bsdf> {
        self.materials.has_views(p.material).then(|| self.bsdf(p, wo))
    }

    /// Whether nothing at all, transparent or not, lies between two points in space.
    pub fn is_clear(&self, from: Vec3, to: Vec3) -> bool {
        !self.accel.occluded(&Ray { t_max: 1.0, ..Ray::new(from, to - from) })
    }

    /// Texture coordinates of a surface point.
    pub fn uv(&self, p: &SurfacePoint) -> Vec2 {
        self.materials.uv(&p.at)
    }

    /// The surface at the end of a piece.
    #[inline]
    pub fn closest(&self, piece: &Piece, from_camera: bool) -> Option<SurfacePoint> {
        let hit = match from_camera && self.needs.camera_visibility {
            false => self.accel.closest(&piece.ray),
            true => self.accel.closest_where(&piece.ray, &|h| self.scene.group(h.instance).camera_visible),
        }?;
        Some(SurfacePoint::new(&self.scene, &self.accel, &hit))
    }

    /// What happens to the ray of a walk at a surface that it sees along `wo`. `choice`: a uniform number that
    /// decides between passing and scattering where both are possible.
    pub fn shade(&self, p: &SurfacePoint, wo: Vec3, walk: Walk, choice: f32) -> Shaded {
        if !self.needs.transparency || !self.materials.may_be_transparent(p.material) {
            let emission = self.emission_towards(p, wo);
            return Shaded::Scatters {
                weight: Vec3::ONE,
                opacity: 1.0,
                vertex: Vertex { bsdf: self.materials.bsdf(p, wo), emission },
            };
        }
        let towards_camera = match walk {
            Walk::Camera => wo,
            Walk::Light => -wo,
        };
        let through = self.materials.transparency(p, towards_camera);
        let emission = self.emission_towards(p, wo);
        // what emits must be met now and then, however transparent it is
        let most = if emission == Vec3::ZERO { 1.0 } else { 0.5 };
        let pass = through.max_element().min(most);
        if choice < pass {
            return Shaded::Through { weight: through / pass };
        }
        let opacity = self.materials.opacity(p.material, &p.at);
        let weight = Vec3::splat(opacity / (1.0 - pass));
        Shaded::Scatters { weight, opacity, vertex: Vertex { bsdf: self.materials.bsdf(p, wo), emission } }
    }

    /// Probability that a segment which arrives at a surface from `from` ends there. `bsdf`: of that surface, seen from
    /// anywhere.
    pub fn end_probability(&self, p: &SurfacePoint, bsdf: &Bsdf, from: Vec3) -> f32 {
        match bsdf.has_delta() {
            // layers hide each other by the direction they are seen from
            true => self.bsdf(p, from).end_probability(from),
            false => 1.0,
        }
    }

    /// Share of the surface that is there.
    pub fn opacity(&self, p: &SurfacePoint) -> f32 {
        match self.needs.transparency && self.materials.may_be_transparent(p.material) {
            true => self.materials.opacity(p.material, &p.at),
            false => 1.0,
        }
    }

    fn emission_towards(&self, p: &SurfacePoint, wo: Vec3) -> Vec3 {
        if !self.needs.emissive_surfaces {
            return Vec3::ZERO;
        }
        match self.scene.group(p.instance).two_sided_emission || p.place.normal.dot(wo) > 0.0 {
            true => self.materials.emission(p.material, &p.at, || facing(p.ns, p.place.normal, wo)),
            false => Vec3::ZERO,
        }
    }

    /// Calls `found` for every analytic light on a piece, up to the surface at its end.
    #[inline]
    pub fn for_each_light_on(
        &self,
        piece: &Piece,
        end: Option<&SurfacePoint>,
        from_camera: bool,
        mut found: impl FnMut(LightPoint),
    ) {
        if !self.needs.light_shapes {
            return;
        }
        let Piece { ray, direction, travelled, inside, .. } = *piece;
        let t_max = end.map_or(ray.t_max, |p| (p.place.position - ray.origin).dot(direction));
        self.emitters.for_each_hit(ray.origin, direction, t_max, |hit| {
            if hit.distance >= ray.t_min && self.emitters.is_seen(hit.emitter, from_camera) {
                let radiance = hit.radiance * self.left_between(inside, None, hit.distance);
                let hit = EmitterHit { distance: travelled + hit.distance, ..hit };
                found(LightPoint { radiance, direction, hit });
            }
        });
    }

    /// Calls `found` for every light at infinity that is seen along the end of a piece.
    #[inline]
    pub fn for_each_infinite_light(
        &self,
        piece: &Piece,
        from_camera: bool,
        mut found: impl FnMut(LightPoint),
    ) {
        // the far plane hides objects, not the sky behind them
        if !self.needs.infinite_lights {
            return;
        }
        let direction = piece.direction;
        let left = self.left_between(piece.inside, None, f32::INFINITY);
        self.emitters.for_each_infinite(piece.ray.origin, direction, |hit| {
            if self.emitters.is_seen(hit.emitter, from_camera) {
                found(LightPoint { radiance: hit.radiance * left, direction, hit });
            }
        });
    }

    /// The surface at the end of a piece as a light, if it is one that can be sampled.
    pub fn emitter_at(&self, piece: &Piece, p: &SurfacePoint, radiance: Vec3) -> Option<LightPoint> {
        let emitter = self.emitters.triangle(p.instance, p.at.triangle)?;
        let distance = piece.travelled + (p.place.position - piece.ray.origin).length();
        let Place { position: point, normal, .. } = p.place;
        let hit = EmitterHit { emitter, distance, point, normal, radiance };
        Some(LightPoint { radiance, direction: piece.direction, hit })
    }

    /// A sample of the light that reaches a receiver, nothing being in the way.
    pub fn sample_light(&self, receiver: &Receiver, u: Vec3) -> Option<LightSample> {
        let (id, chosen, fresh) = self.emitters.select(receiver, u.x)?;
        let s = self.emitters.sample_towards(id, receiver, Vec2::new(fresh, u.y))?;
        let target = if s.distance.is_finite() { Target::Point(s.point) } else { Target::Infinity };
        let hit = EmitterHit {
            emitter: id,
            distance: s.distance,
            point: s.point,
            normal: s.normal,
            radiance: Vec3::ZERO,
        };
        Some(match s.incident {
            Incident::Delta { irradiance } => LightSample {
                direction: s.direction,
                radiance: irradiance,
                pdf: chosen.0,
                is_delta: true,
                target,
                hit,
            },
            Incident::Radiance { radiance, pdf } => {
                let (radiance, target) =
                    match s.barycentrics.and_then(|b| Some((b, self.emitters.triangle_of(id)?))) {
                        None => (radiance, target),
                        Some((b, (instance, triangle))) => {
                            let mesh = self.scene.group(instance).mesh;
                            let barycentrics = if self.scene.is_mirrored(instance) { b.yx() } else { b };
                            let at = MeshPoint::new(instance, mesh, triangle, barycentrics);
                            let place = place(&self.scene, &self.accel, &at);
                            let radiance = self.visible_emission(&at, place.normal, -s.direction);
                            (radiance, Target::Surface(place))
                        }
                    };
                LightSample {
                    direction: s.direction,
                    radiance,
                    pdf: chosen.0 * pdf.0,
                    is_delta: false,
                    target,
                    hit,
                }
            }
        })
    }

    /// Density per solid angle with which [`World::sample_light`] finds light that a ray from the
    /// receiver met.
    pub fn pdf_of_sampling(&self, receiver: &Receiver, light: &LightPoint) -> f32 {
        let chosen = self.emitters.probability(receiver, light.hit.emitter);
        chosen.0 * self.emitters.pdf_towards(receiver, light.direction, &light.hit).0
    }

    /// Emission of a triangle of this geometric normal towards `wo`, as much of it as there is.
    pub(super) fn visible_emission(&self, at: &MeshPoint, normal: Vec3, wo: Vec3) -> Vec3 {
        let material = self.scene.material_index(at.instance, at.triangle);
        let facing = || facing(shading_normal(&self.scene, at, normal), normal, wo);
        let emission = self.materials.emission(material, at, facing);
        match self.needs.transparency && self.materials.may_be_transparent(material) {
            true => emission * self.materials.opacity(material, at),
            false => emission,
        }
    }
}

/// Absorption coefficients by material. Sampled points of surfaces that emit do not know what is behind them.
fn absorption_coefficients(scene: &Scene, warnings: &mut Warnings) -> Vec<Vec3> {
    let coefficient = |m: &Material| {
        if m.absorption == Vec3::ZERO || !may_emit(m) {
            return m.absorption;
        }
        warnings.add(format!("material {:?}", m.name), "it emits light, so its inside absorbs none", 1);
        Vec3::ZERO
    };
    scene.materials.iter().map(coefficient).collect()
}

fn survival_for(length: f32) -> f32 {
    1.0 - 1.0 / length
}
