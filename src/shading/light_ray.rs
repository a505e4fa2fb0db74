//! The first rays of light paths, and how dense they are beside the other ways to find the same light.

use super::emitters::{Draw, Emission, EmissionGuide, EmitterHit, Lesson, Receiver};
use super::ray::{LightPoint, LightSample, Piece};
use super::surface::{normalize_any, place};
use super::texture::MeshPoint;
use super::world::World;
use crate::accel::Ray;
use crate::math::Sampler;
use crate::math::density::{AreaPdf, EtenduePdf, SolidAnglePdf};
use glam::{Vec2, Vec2Swizzles, Vec3};

/// The first ray of a light path.
#[derive(Clone, Copy, Debug)]
pub struct LightRay {
    /// Where it goes.
    pub piece: Piece,
    /// Flux that one path stands for, if there is only one, W.
    pub flux: Vec3,
    /// How likely it was, the choice of emitter included.
    pub density: SourceDensity,
    /// What it was drawn from.
    pub draw: Draw,
    /// Where it left the emitter.
    hit: EmitterHit,
}

/// Density of a light path's first ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SourceDensity {
    /// Of an emitter of some extent, per étendue.
    Extended(EtenduePdf),
    /// Of a point: per solid angle.
    Point(SolidAnglePdf),
    /// Of light of one direction: per area across it.
    Beam(AreaPdf),
}

impl World {
    /// Draws the first ray of a light path, by power and by what the guide has learnt.
    pub fn sample_emission(&self, guide: &EmissionGuide, sampler: &mut Sampler) -> Option<LightRay> {
        let (emitter, place_u, direction_u) = (sampler.next_1d(), sampler.next_2d(), sampler.next_2d());
        // a guide makes one choice more
        let choice = if guide.is_empty() { 0.0 } else { sampler.next_1d() };
        let draw = guide.draw(&self.emitters, Vec2::new(choice, emitter), place_u, direction_u)?;
        let (id, [x, y, z, w]) = (draw.emitter, draw.at);
        let factor = self.emitters.emission_probability(id).0 * guide.relative(&draw);
        let s = self.emitters.sample_from(id, Vec2::new(x, y), Vec2::new(z, w))?;
        let (mut ray, mut emission, mut point) = (Ray::new(s.origin, s.direction), s.emission, s.origin);
        if let (Some(b), Some((instance, triangle))) = (s.barycentrics, self.emitters.triangle_of(id)) {
            let mesh = self.scene.group(instance).mesh;
            let barycentrics = if self.scene.is_mirrored(instance) { b.yx() } else { b };
            let at = MeshPoint::new(instance, mesh, triangle, barycentrics);
            let origin = place(&self.scene, &self.accel, &at);
            (ray, point) = (origin.spawn(s.direction), origin.position);
            if let Emission::Extended { radiance, .. } = &mut emission {
                *radiance = self.visible_emission(&at, origin.normal, s.direction);
            }
        }
        let flux = emission.flux() / factor;
        let density = match emission {
            Emission::Extended { pdf, .. } => SourceDensity::Extended(EtenduePdf(pdf.0 * factor)),
            Emission::Point { pdf, .. } => SourceDensity::Point(SolidAnglePdf(pdf.0 * factor)),
            Emission::Beam { pdf, .. } => SourceDensity::Beam(AreaPdf(pdf.0 * factor)),
        };
        let hit = EmitterHit {
            emitter: id,
            distance: f32::INFINITY,
            point,
            normal: s.normal,
            radiance: Vec3::ZERO,
        };
        let sound = flux.is_finite() && flux.max_element() > 0.0;
        let piece = Piece::along(ray, s.direction, self.emitters.is_infinite(id));
        sound.then_some(LightRay { piece, flux, density, draw, hit })
    }

    /// Density of the light paths that leave towards where this light was met from.
    pub fn emission_pdf(&self, guide: &EmissionGuide, light: &LightPoint) -> EtenduePdf {
        let factor = self.emission_factor(guide, -light.direction, &light.hit);
        EtenduePdf(self.emitters.pdf_from(light.direction, &light.hit).0 * factor)
    }

    /// Density of the light paths that leave a sampled point of a light towards the receiver: per étendue; of
    /// a delta light, per area across the light's direction.
    pub fn emission_pdf_of_sample(&self, guide: &EmissionGuide, light: &LightSample) -> f32 {
        let factor = self.emission_factor(guide, -light.direction, &light.hit);
        match light.is_delta {
            true => {
                let LightSample { hit, direction, .. } = light;
                factor * self.emitters.pdf_of_rays(hit.emitter, -*direction, hit.distance).0
            }
            false => factor * self.emitters.pdf_from(light.direction, &light.hit).0,
        }
    }

    /// Factor on an emitter's density of the rays that leave it along `direction` where `hit` says: the probability
    /// of choosing it, and how much the guide favours the ray.
    fn emission_factor(&self, guide: &EmissionGuide, direction: Vec3, hit: &EmitterHit) -> f32 {
        let chosen = self.emitters.emission_probability(hit.emitter).0;
        match guide.is_empty() {
            true => chosen,
            false => chosen * guide.relative(&self.emitters.draw_of(direction, hit)),
        }
    }

    /// A guide that has learnt from light paths of this scene.
    pub fn emission_guide(&self, lessons: Vec<Lesson>) -> EmissionGuide {
        EmissionGuide::learn(&self.emitters, lessons)
    }

    /// Density with which [`World::sample_light`] finds the light of an unobstructed light ray at a receiver:
    /// per solid angle; of a delta light, the probability of choosing it.
    pub fn pdf_of_sampling_ray(&self, receiver: &Receiver, ray: &LightRay) -> f32 {
        let chosen = self.emitters.probability(receiver, ray.hit.emitter).0;
        let to = ray.hit.point - receiver.position;
        match ray.density {
            SourceDensity::Point(_) | SourceDensity::Beam(_) => chosen,
            SourceDensity::Extended(_) if self.emitters.is_infinite(ray.hit.emitter) => {
                chosen * self.emitters.pdf_towards(receiver, -ray.piece.direction, &ray.hit).0
            }
            SourceDensity::Extended(_) => {
                let hit = EmitterHit { distance: to.length(), ..ray.hit };
                chosen * self.emitters.pdf_towards(receiver, normalize_any(to), &hit).0
            }
        }
    }
}

impl LightRay {
    /// Where the ray left the emitter, relative to the scene's origin.
    pub fn origin(&self) -> Vec3 {
        self.hit.point
    }
}
