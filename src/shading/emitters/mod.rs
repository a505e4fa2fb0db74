//! Emitters: analytic lights, domes and emissive triangles. Each can be sampled towards a receiver
//! (next event), sampled from (light paths), met by a ray, and asked for the density of what was
//! sampled; a set of them can be chosen from.

mod bounds;
mod cylinder;
mod disk;
mod distant;
mod dome;
mod emitter;
mod falloff;
mod guide;
mod hit_tree;
mod light_tree;
mod map_sampler;
mod plane;
mod point;
mod rect;
mod sample;
mod scene_bounds;
mod selection;
mod sphere;
mod spherical_rect;
mod spherical_triangle;
mod tree;
mod triangle;
mod triangle_table;

use crate::math::density::{AreaPdf, DiscreteProbability, EtenduePdf, SolidAnglePdf};
use crate::math::distribution::AliasTable;
use crate::scene::{Image, Light, SceneError, SeenBy, Warnings};
use emitter::{Emitter, luminance64};
use glam::{DVec3, Vec2, Vec3};
use hit_tree::HitTree;
use selection::Selector;
use std::ops::Range;
use std::sync::Arc;
use triangle::Triangle;
use triangle_table::TriangleTable;

pub use guide::{Draw, EmissionGuide, Lesson, PLAIN};
pub use sample::{Emission, EmitterHit, EmitterId, FromSample, Incident, Receiver, TowardsSample};
pub use scene_bounds::SceneBounds;
pub use triangle::MeshTriangle;

/// All that emits in a scene.
#[derive(Debug)]
pub struct Emitters {
    lights: Vec<Emitter>,
    seen_by: Vec<SeenBy>,
    triangles: Vec<Triangle>,
    table: TriangleTable,
    infinite: Vec<EmitterId>,
    hittable: HitTree,
    selector: Selector,
    by_power: Option<AliasTable>,
    /// Share of the power that the emitters before each one have together, and all.
    power_before: Vec<f64>,
    total_power: Vec3,
    bounds: SceneBounds,
}

impl Emitters {
    /// The emitters of a scene. Light `i` becomes emitter `i`. Triangles that cannot emit are dropped,
    /// counted in `warnings`.
    pub fn build(
        lights: &[Light],
        triangles: &[MeshTriangle],
        images: &[Arc<Image>],
        bounds: SceneBounds,
        warnings: &mut Warnings,
    ) -> Result<Self, SceneError> {
        let seen_by: Vec<SeenBy> = lights.iter().map(|l| l.seen_by).collect();
        let shines = |i: u32| seen_by[i as usize] != SeenBy::CameraAlone;
        let lights = lights.iter().map(|l| Emitter::new(l, images)).collect::<Result<Vec<_>, _>>()?;
        let mut places = Vec::with_capacity(triangles.len());
        let mut kept = Vec::with_capacity(triangles.len());
        for t in triangles {
            if let Some(triangle) = Triangle::new(t) {
                places.push((t.instance, t.triangle));
                kept.push(triangle);
            }
        }
        if kept.len() < triangles.len() {
            let count = (triangles.len() - kept.len()) as u64;
            warnings.add("emissive meshes", "triangles without area or radiance do not emit", count);
        }
        let numbered = || (0..).zip(&lights);
        let far: Vec<_> = numbered().filter_map(|(i, l)| l.infinite(EmitterId(i))).collect();
        let shapes = numbered().filter(|(_, l)| l.is_hittable());
        let hittable = HitTree::new(shapes.filter_map(|(i, l)| l.bounds().map(|b| (i, b.min, b.max))));
        let first = lights.len() as u32;
        let bounded = numbered().filter(|&(i, _)| shines(i)).filter_map(|(i, l)| Some((i, l.bounds()?)));
        let bounded = bounded.chain((first..).zip(&kept).map(|(i, t)| (i, t.bounds())));
        let power = |(i, l): (u32, &Emitter)| if shines(i) { l.power(&bounds) } else { DVec3::ZERO };
        let powers: Vec<DVec3> = numbered().map(power).chain(kept.iter().map(Triangle::power)).collect();
        let shining = far.iter().filter(|i| shines(i.id.0)).copied().collect();
        let table = TriangleTable::new(&places, first);
        Ok(Self {
            power_before: shares_before(&powers),
            by_power: AliasTable::new(powers.iter().map(|&p| luminance64(p))),
            total_power: powers.iter().sum::<DVec3>().as_vec3(),
            infinite: far.iter().map(|i| i.id).collect(),
            selector: Selector::new(bounded, shining, lights.len() + kept.len()),
            lights,
            seen_by,
            triangles: kept,
            table,
            hittable,
            bounds,
        })
    }

    /// Number of emitters.
    pub fn len(&self) -> usize {
        self.lights.len() + self.triangles.len()
    }

    /// Whether nothing emits.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether an emitter is infinitely far away.
    pub fn is_infinite(&self, id: EmitterId) -> bool {
        matches!(self.get(id), Kind::Light(Emitter::Distant(_) | Emitter::Dome(_)))
    }

    /// Whether some emitter is met by no ray.
    pub fn has_delta(&self) -> bool {
        self.lights.iter().any(Emitter::is_delta)
    }

    /// Power of all emitters, W; that of domes and distant lights is what enters the scene's sphere.
    pub fn total_power(&self) -> Vec3 {
        self.total_power
    }

    /// Power of one emitter, as in [`Emitters::total_power`].
    pub fn power(&self, id: EmitterId) -> Vec3 {
        let power = match self.get(id) {
            Kind::Light(l) => l.power(&self.bounds),
            Kind::Triangle(t) => t.power(),
        };
        power.as_vec3()
    }

    /// Whether a ray sees an emitter; triangles leave that to their instance.
    pub fn is_seen(&self, id: EmitterId, from_camera: bool) -> bool {
        self.seen_by.get(id.0 as usize).is_none_or(|seen_by| seen_by.includes(from_camera))
    }

    /// The emitter of a mesh's triangle.
    #[inline]
    pub fn triangle(&self, instance: u32, triangle: u32) -> Option<EmitterId> {
        self.table.get(instance, triangle)
    }

    /// Instance and triangle of an emitter that is one.
    pub fn triangle_of(&self, id: EmitterId) -> Option<(u32, u32)> {
        self.table.place(id)
    }

    fn get(&self, id: EmitterId) -> Kind<'_> {
        let i = id.0 as usize;
        match i < self.lights.len() {
            true => Kind::Light(&self.lights[i]),
            false => Kind::Triangle(&self.triangles[i - self.lights.len()]),
        }
    }

    /// Samples light from emitter `id` towards a receiver. `None` where none arrives, or by chance for
    /// shapes that are sampled by a larger one around them.
    pub fn sample_towards(&self, id: EmitterId, receiver: &Receiver, u: Vec2) -> Option<TowardsSample> {
        match self.get(id) {
            Kind::Light(l) => l.sample_towards(receiver, u),
            Kind::Triangle(t) => {
                let (at, radiance, barycentrics) = t.towards(receiver.position, u)?;
                Some(TowardsSample {
                    barycentrics: Some(barycentrics),
                    ..emitter::towards_surface(at, radiance)?
                })
            }
        }
    }

    /// Density with which [`Emitters::sample_towards`] would have sampled what a ray from the receiver
    /// along `direction` met.
    pub fn pdf_towards(&self, receiver: &Receiver, direction: Vec3, hit: &EmitterHit) -> SolidAnglePdf {
        match self.get(hit.emitter) {
            Kind::Light(l) => l.pdf_towards(receiver, direction, hit),
            Kind::Triangle(t) => t.pdf_towards(receiver.position, direction, hit.distance),
        }
    }

    /// Samples a ray that leaves emitter `id`: `u` for its origin, `v` for its direction.
    pub fn sample_from(&self, id: EmitterId, u: Vec2, v: Vec2) -> Option<FromSample> {
        match self.get(id) {
            Kind::Light(l) => l.sample_from(&self.bounds, u, v),
            Kind::Triangle(t) => Some(t.from(u, v)),
        }
    }

    /// Density with which [`Emitters::sample_from`] would have sampled the ray that travels *against*
    /// `direction` and leaves the emitter where `hit` says, per étendue. Zero for emitters that no ray
    /// can meet.
    pub fn pdf_from(&self, direction: Vec3, hit: &EmitterHit) -> EtenduePdf {
        match self.get(hit.emitter) {
            Kind::Light(l) => l.pdf_from(&self.bounds, -direction, hit),
            Kind::Triangle(t) => t.pdf_from(-direction),
        }
    }

    /// The same for emitters that no ray can meet, whose light has one direction at every point: density per
    /// area of a surface that faces rays which travel along `direction`, at `distance` from the emitter.
    pub fn pdf_of_rays(&self, id: EmitterId, direction: Vec3, distance: f32) -> AreaPdf {
        match self.get(id) {
            Kind::Light(l) => l.pdf_of_rays(&self.bounds, direction, distance),
            Kind::Triangle(_) => AreaPdf(0.0),
        }
    }

    /// Calls `found` for every analytic light that the ray meets nearer than `t_max`, in no particular
    /// order. `direction` is a unit vector. Triangles and what is at infinity are not among them.
    pub fn for_each_hit(&self, origin: Vec3, direction: Vec3, t_max: f32, mut found: impl FnMut(EmitterHit)) {
        self.hittable.for_each(origin, direction, t_max, |i| {
            let light = &self.lights[i as usize];
            if let Some((distance, normal)) = light.hit(origin, direction)
                && distance < t_max
            {
                let point = origin + direction * distance;
                let radiance = light.emitted(point, -direction);
                found(EmitterHit { emitter: EmitterId(i), distance, point, normal, radiance });
            }
        });
    }

    /// Calls `found` for every dome and every distant light of some extent that is seen from `origin` along the
    /// unit vector `direction`.
    pub fn for_each_infinite(&self, origin: Vec3, direction: Vec3, mut found: impl FnMut(EmitterHit)) {
        for &id in &self.infinite {
            if let Some(radiance) = self.lights[id.0 as usize].seen(direction) {
                let distance = f32::INFINITY;
                found(EmitterHit { emitter: id, distance, point: origin, normal: -direction, radiance });
            }
        }
    }

    /// Chooses an emitter for a receiver: the emitter, its probability, and `u` made uniform again.
    pub fn select(&self, receiver: &Receiver, u: f32) -> Option<(EmitterId, DiscreteProbability, f32)> {
        self.selector.select(receiver, u)
    }

    /// Probability with which [`Emitters::select`] chooses an emitter.
    pub fn probability(&self, receiver: &Receiver, id: EmitterId) -> DiscreteProbability {
        self.selector.probability(receiver, id)
    }

    /// Chooses an emitter in proportion to its power, to start a light path: the emitter, its
    /// probability, and `u` made uniform again.
    pub fn select_emission(&self, u: f32) -> Option<(EmitterId, DiscreteProbability, f32)> {
        let (index, p, u) = self.by_power.as_ref()?.sample(u);
        Some((EmitterId(index as u32), DiscreteProbability(p), u))
    }

    /// Share of the power that the emitters before number `index` have.
    fn power_before(&self, index: u32) -> f64 {
        self.power_before[index as usize]
    }

    /// The emitter in whose part of the power this share of it lies.
    fn at_power(&self, share: f64) -> u32 {
        let behind = self.power_before.partition_point(|&p| p <= share);
        behind.saturating_sub(1).min(self.len().saturating_sub(1)) as u32
    }

    /// Whether all of some emitters draw the place, and whether all draw the direction, of rays that leave them.
    fn drawn(&self, range: Range<u32>) -> [bool; 2] {
        let lights = &self.lights[(range.start as usize).min(self.lights.len())..];
        let among = &lights[..lights.len().min(range.len())];
        among.iter().map(Emitter::draws).fold([true; 2], |all, one| [all[0] && one[0], all[1] && one[1]])
    }

    /// What [`Emitters::sample_from`] draws the ray from that travels along `direction` and leaves an emitter where
    /// `hit` says.
    pub fn draw_of(&self, direction: Vec3, hit: &EmitterHit) -> Draw {
        let [place, direction] = match self.get(hit.emitter) {
            Kind::Light(l) => l.square_of(&self.bounds, direction, hit),
            Kind::Triangle(t) => t.square_of(hit.point, direction),
        };
        Draw { emitter: hit.emitter, at: [place.x, place.y, direction.x, direction.y] }
    }

    /// Probability with which [`Emitters::select_emission`] chooses an emitter.
    pub fn emission_probability(&self, id: EmitterId) -> DiscreteProbability {
        DiscreteProbability(self.by_power.as_ref().map_or(0.0, |t| t.probability(id.0 as usize)))
    }
}

/// Sums of the powers before each, and of all, as shares.
fn shares_before(powers: &[DVec3]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut before: Vec<f64> = std::iter::once(0.0)
        .chain(powers.iter().map(|&p| {
            let power = luminance64(p);
            sum += if power.is_finite() { power.max(0.0) } else { 0.0 };
            sum
        }))
        .collect();
    before.iter_mut().for_each(|b| *b /= sum.max(f64::MIN_POSITIVE));
    before
}

enum Kind<'a> {
    Light(&'a Emitter),
    Triangle(&'a Triangle),
}
