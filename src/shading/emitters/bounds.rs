//! Where an emitter is and where it shines: what the light tree needs to know of it.

use glam::Vec3;

/// Bounds in space and direction of what one or several emitters send out (Conty Estevez and Kulla 2018,
/// "Importance Sampling of Many Lights with Adaptive Tree Splitting").
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    pub min: Vec3,
    pub max: Vec3,
    /// Unit axis of the cone of normals.
    pub axis: Vec3,
    /// Cosine of the half angle of the cone of normals.
    pub cos_normals: f32,
    /// Cosine of the angle to a normal within which light is emitted, at most a right one.
    pub cos_emission: f32,
    /// Luminance of the intensity along the brightest direction, W/sr.
    pub intensity: f32,
    /// Whether it shines alike along the opposite normals.
    pub two_sided: bool,
}

impl LightBounds {
    /// Bounds of something that shines to all sides.
    pub fn everywhere(min: Vec3, max: Vec3, intensity: f32) -> Self {
        Self { min, max, axis: Vec3::Z, cos_normals: -1.0, cos_emission: 0.0, intensity, two_sided: false }
    }

    /// Bounds of something that shines within the angle `cutoff` (radians) of `axis`, by the cosine law
    /// where `flat`.
    pub fn cone(min: Vec3, max: Vec3, axis: Vec3, cutoff: f64, flat: bool, intensity: f32) -> Self {
        let right = std::f64::consts::FRAC_PI_2;
        // the cone of normals takes what is wider than a right angle, or does not follow the cosine
        let (normals, emission) = match flat {
            true => (0.0, cutoff.min(right)),
            false => (cutoff.min(std::f64::consts::PI), 0.0),
        };
        Self {
            min,
            max,
            axis,
            cos_normals: normals.cos() as f32,
            cos_emission: if flat && cutoff >= right { 0.0 } else { emission.cos() as f32 },
            intensity,
            two_sided: false,
        }
    }
}
