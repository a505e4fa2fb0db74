//! The closed set of analytic lights.

use super::bounds::LightBounds;
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::distant::Distant;
use super::dome::Dome;
use super::falloff::Falloff;
use super::map_sampler::{Layout, MapSampler};
use super::point::Point;
use super::rect::Rect;
use super::sample::{EmitterHit, EmitterId, FromSample, Incident, Receiver, SurfacePoint, TowardsSample};
use super::scene_bounds::SceneBounds;
use super::selection::Infinite;
use super::sphere::Sphere;
use crate::math::density::{AreaPdf, EtenduePdf, SolidAnglePdf};
use crate::math::luminance;
use crate::scene::light::{Light, LightKind, Shaping};
use crate::scene::{Image, SceneError};
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

/// An analytic light, ready to be sampled.
#[derive(Clone, Debug)]
pub(super) enum Emitter {
    Rect(Box<Rect>),
    Disk(Box<Disk>),
    Sphere(Sphere),
    Cylinder(Cylinder),
    Point(Point),
    Distant(Distant),
    Dome(Box<Dome>),
}

impl Emitter {
    pub fn new(light: &Light, images: &[Arc<Image>]) -> Result<Self, SceneError> {
        let map = |image: Option<u32>, layout: Layout| match image {
            None => Ok(None),
            Some(i) => match images.get(i as usize) {
                Some(image) => Ok(Some(MapSampler::new(image.clone(), layout))),
                None => {
                    let problem = format!("its image has the id {i}, there are only {}", images.len());
                    Err(SceneError::new(format!("light {:?}", light.name), problem))
                }
            },
        };
        let falloff = |s: &Option<Shaping>| s.as_ref().map(Falloff::new);
        Ok(match &light.kind {
            LightKind::Rect { center, edge_x, edge_y, normal, radiance, image, shaping } => {
                let place = [*center, *edge_x, *edge_y, *normal];
                Self::Rect(Box::new(Rect::new(
                    place,
                    *radiance,
                    map(*image, Layout::Flat)?,
                    falloff(shaping),
                )))
            }
            LightKind::Disk { center, axes: [a, b], normal, radiance, shaping } => {
                Self::Disk(Box::new(Disk::new([*center, *a, *b, *normal], *radiance, falloff(shaping))))
            }
            LightKind::Sphere { center, radius, radiance, shaping } => {
                Self::Sphere(Sphere::new(*center, *radius, *radiance, falloff(shaping)))
            }
            LightKind::Cylinder { center, axis, radius, radiance, shaping } => {
                Self::Cylinder(Cylinder::new(*center, *axis, *radius, *radiance, falloff(shaping)))
            }
            LightKind::Point { position, intensity, shaping } => {
                Self::Point(Point::new(*position, *intensity, falloff(shaping)))
            }
            LightKind::Distant { direction, half_angle, irradiance } => {
                Self::Distant(Distant::new(*direction, *half_angle, *irradiance))
            }
            LightKind::Dome { to_world, radiance, image } => {
                Self::Dome(Box::new(Dome::new(*to_world, *radiance, map(*image, Layout::LatLong)?)))
            }
        })
    }

    /// Whether a ray can meet it at a finite distance.
    pub fn is_hittable(&self) -> bool {
        matches!(self, Self::Rect(_) | Self::Disk(_) | Self::Sphere(_) | Self::Cylinder(_))
    }

    pub fn sample_towards(&self, receiver: &Receiver, u: Vec2) -> Option<TowardsSample> {
        let x = receiver.position;
        let (at, radiance) = match self {
            Self::Rect(l) => l.towards(x, u)?,
            Self::Disk(l) => l.towards(x, u)?,
            Self::Sphere(l) => l.towards(x, u)?,
            Self::Cylinder(l) => l.towards(x, u)?,
            Self::Point(l) => return l.towards(x),
            Self::Distant(l) => return Some(l.towards(receiver, u)),
            Self::Dome(l) => return l.towards(receiver, u),
        };
        towards_surface(at, radiance)
    }

    pub fn pdf_towards(&self, receiver: &Receiver, direction: Vec3, hit: &EmitterHit) -> SolidAnglePdf {
        let x = receiver.position;
        match self {
            Self::Rect(l) => l.pdf_towards(x, hit.point, direction, hit.distance),
            Self::Disk(l) => l.pdf_towards(x, hit.point, direction, hit.distance),
            Self::Sphere(l) => l.pdf_towards(x),
            Self::Cylinder(l) => l.pdf_towards(x, hit.normal),
            Self::Point(_) => SolidAnglePdf(0.0),
            Self::Distant(l) => l.pdf_towards(direction),
            Self::Dome(l) => l.pdf_towards(receiver, direction),
        }
    }

    pub fn sample_from(&self, bounds: &SceneBounds, u: Vec2, v: Vec2) -> Option<FromSample> {
        match self {
            Self::Rect(l) => l.from(u, v),
            Self::Disk(l) => l.from(u, v),
            Self::Sphere(l) => l.from(u, v),
            Self::Cylinder(l) => l.from(u, v),
            Self::Point(l) => l.from(v),
            Self::Distant(l) => Some(l.from(bounds, u, v)),
            Self::Dome(l) => l.from(bounds, u, v),
        }
    }

    /// Density of the ray that leaves along `direction` where `hit` says.
    pub fn pdf_from(&self, bounds: &SceneBounds, direction: Vec3, hit: &EmitterHit) -> EtenduePdf {
        match self {
            Self::Rect(l) => l.pdf_from(hit.point, direction),
            Self::Disk(l) => l.pdf_from(direction),
            Self::Sphere(l) => l.pdf_from(hit.normal, direction),
            Self::Cylinder(l) => l.pdf_from(hit.normal, direction),
            Self::Point(_) => EtenduePdf(0.0),
            Self::Distant(l) => l.pdf_from(bounds, direction),
            Self::Dome(l) => l.pdf_from(bounds, direction),
        }
    }

    /// The numbers from which [`Emitter::sample_from`] draws the ray that travels along `direction` from where
    /// `hit` says: those of its place, then those of its direction.
    pub fn square_of(&self, bounds: &SceneBounds, direction: Vec3, hit: &EmitterHit) -> [Vec2; 2] {
        match self {
            Self::Rect(l) => l.square_of(hit.point, direction),
            Self::Disk(l) => l.square_of(hit.point, direction),
            Self::Sphere(l) => l.square_of(hit.normal, direction),
            Self::Cylinder(l) => l.square_of(hit.point, hit.normal, direction),
            Self::Point(l) => [Vec2::ZERO, l.square_of(direction)],
            Self::Distant(l) if l.is_delta() => [bounds.square_of(direction, hit.point), Vec2::ZERO],
            Self::Distant(l) => [bounds.square_of(direction, hit.point), l.square_of(direction)],
            Self::Dome(l) => [bounds.square_of(direction, hit.point), l.square_of(direction)],
        }
    }

    /// Whether no ray can meet it by chance.
    pub fn is_delta(&self) -> bool {
        match self {
            Self::Point(_) => true,
            Self::Distant(l) => l.is_delta(),
            _ => false,
        }
    }

    /// Whether a ray's place and its direction are drawn at all.
    pub fn draws(&self) -> [bool; 2] {
        match self {
            Self::Point(_) => [false, true],
            Self::Distant(l) => [true, !l.is_delta()],
            _ => [true, true],
        }
    }

    /// Of what no ray can meet: density of the light paths that travel along `direction`, per area of a
    /// surface that faces them at `distance`.
    pub fn pdf_of_rays(&self, bounds: &SceneBounds, direction: Vec3, distance: f32) -> AreaPdf {
        match self {
            Self::Point(l) => l.pdf_from(direction).to_area(distance, 1.0),
            Self::Distant(l) if l.is_delta() => AreaPdf(1.0 / bounds.disk_area()),
            _ => AreaPdf(0.0),
        }
    }

    /// Distance and normal where a ray meets it.
    pub fn hit(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        match self {
            Self::Rect(l) => l.hit(origin, direction),
            Self::Disk(l) => l.hit(origin, direction),
            Self::Sphere(l) => l.hit(origin, direction),
            Self::Cylinder(l) => l.hit(origin, direction),
            Self::Point(_) | Self::Distant(_) | Self::Dome(_) => None,
        }
    }

    /// Radiance that leaves a point of its surface.
    pub fn emitted(&self, point: Vec3, direction: Vec3) -> Vec3 {
        match self {
            Self::Rect(l) => l.emitted(point, direction),
            Self::Disk(l) => l.emitted(direction),
            Self::Sphere(l) => l.emitted(direction),
            Self::Cylinder(l) => l.emitted(direction),
            Self::Point(_) | Self::Distant(_) | Self::Dome(_) => Vec3::ZERO,
        }
    }

    /// Radiance from infinity.
    pub fn seen(&self, direction: Vec3) -> Option<Vec3> {
        match self {
            Self::Distant(l) => l.seen(direction),
            Self::Dome(l) => Some(l.seen(direction)),
            _ => None,
        }
    }

    /// Power; from infinity, that through the sphere around the scene.
    pub fn power(&self, bounds: &SceneBounds) -> DVec3 {
        match self {
            Self::Rect(l) => l.power(),
            Self::Disk(l) => l.power(),
            Self::Sphere(l) => l.power(),
            Self::Cylinder(l) => l.power(),
            Self::Point(l) => l.power(),
            Self::Distant(l) => l.fluence() * bounds.disk_area() as f64,
            Self::Dome(l) => l.fluence() * bounds.disk_area() as f64,
        }
    }

    /// Bounds in space and direction; `None` for what is infinitely far away.
    pub fn bounds(&self) -> Option<LightBounds> {
        Some(match self {
            Self::Rect(l) => l.bounds(),
            Self::Disk(l) => l.bounds(),
            Self::Sphere(l) => l.bounds(),
            Self::Cylinder(l) => l.bounds(),
            Self::Point(l) => l.bounds(),
            Self::Distant(_) | Self::Dome(_) => return None,
        })
    }

    /// What the choice of emitter `id` needs to know of it; `None` for what is at a finite distance.
    pub fn infinite(&self, id: EmitterId) -> Option<Infinite> {
        let (irradiance, cone) = match self {
            Self::Distant(l) => (l.irradiance().as_dvec3(), l.cone()),
            // the mean over all orientations of a surface
            Self::Dome(l) => (l.fluence() / 4.0, None),
            _ => return None,
        };
        Some(Infinite { id, irradiance: luminance64(irradiance), cone })
    }
}

/// A sample of a surface as the caller gets it; `None` where it sends nothing.
pub(super) fn towards_surface(at: SurfacePoint, radiance: Vec3) -> Option<TowardsSample> {
    let SurfacePoint { direction, distance, point, normal, pdf } = at;
    let sound = radiance != Vec3::ZERO && pdf.0 > 0.0 && pdf.0.is_finite();
    sound.then_some(TowardsSample {
        direction,
        distance,
        point,
        normal,
        incident: Incident::Radiance { radiance, pdf },
        barycentrics: None,
    })
}

/// Luminance in double precision: powers and intensities may leave the range of single precision.
pub(super) fn luminance64(c: DVec3) -> f64 {
    let scale = c.max_element();
    if scale > 0.0 { luminance((c / scale).as_vec3()) as f64 * scale } else { 0.0 }
}
