//! The layered principled surface, as in Blender 4.2 and later (Principled BSDF, second version).
//!
//! From above: sheen, a coat, and a base which is a mixture of metal, glass, and a dielectric reflection
//! over a diffuse body. Each layer takes from those below it the largest channel of its own directional
//! albedo for the direction looked from (albedo scaling; Kulla and Conty 2017, "Revisiting physically
//! based shading at Imageworks"). That direction alone decides, so the stack is not reciprocal, although
//! its lobes are; it never reflects more than it receives.

use super::{BsdfBuilder, Cover};
use crate::math::Frame;
use crate::shading::lobes::fresnel::f0_from_ior;
use crate::shading::lobes::{Dielectric, Fresnel, Ggx, Lambert, Lobe, OrenNayar, Reflection};
use glam::Vec3;

/// Reflectance of the metal towards grazing angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MetalF90 {
    /// White at 90 degrees, tinted by `specular_tint` near 82 degrees.
    White,
    /// The base colour at every angle.
    Base,
}

/// Parameters of the layered surface at one point. Unless said otherwise, numbers and the channels of
/// colours are in [0,1]; roughness is the square root of the GGX alpha.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Principled {
    /// Albedo of the diffuse body, normal reflectance of the metal, squared tint of the glass.
    pub base_color: Vec3,
    /// Roughness of the diffuse body (Oren-Nayar).
    pub diffuse_roughness: f32,
    /// Share of metal in the base.
    pub metallic: f32,
    /// Roughness of metal, glass and dielectric reflection.
    pub roughness: f32,
    /// Refractive index of the glass and of the dielectric reflection, above zero.
    pub ior: f32,
    /// Normal reflectance of the dielectric reflection: 0.5 is that of `ior`, 0 none. Not bounded.
    pub specular_level: f32,
    /// Factor on the normal reflectance of dielectrics; edge tint of the metal.
    pub specular_tint: Vec3,
    /// Normal reflectance of the dielectric reflection in place of that of `ior` (the specular workflow of
    /// UsdPreviewSurface).
    pub specular_color: Option<Vec3>,
    /// Anisotropy of metal and dielectric reflection, in [-1,1].
    pub anisotropy: f32,
    /// Rotation of the anisotropy about the normal, in turns.
    pub rotation: f32,
    /// Share of glass in what is not metal.
    pub transmission: f32,
    /// Sheen and coat.
    pub cover: Cover,
    /// What the metal reflects at grazing angles.
    pub metal_f90: MetalF90,
    /// Whether what microfacets below the coat scatter more than once comes out.
    pub multiscatter: bool,
}

/// Largest normal reflectance from which a refractive index is computed.
const MAX_F0: f32 = 0.99;

impl Principled {
    /// Pushes the lobes. `frame`: of the base, its x axis the tangent of the anisotropy; `coat_frame`: of the coat.
    pub fn push(&self, builder: &mut BsdfBuilder, weight: Vec3, frame: Frame, coat_frame: Frame) {
        let mut weight = self.cover.push(builder, weight, frame.n, coat_frame);
        let grain = match self.anisotropy == 0.0 {
            true => (Ggx::from_roughness(self.roughness), frame),
            false => (Ggx::anisotropic(self.roughness, self.anisotropy), frame.turned(self.rotation)),
        };
        if self.metallic > 0.0 {
            builder.push(weight * self.metallic, grain.1, self.reflection(grain.0, self.metal()));
            weight *= 1.0 - self.metallic;
        }
        if self.transmission > 0.0 {
            builder.push(weight * self.transmission, frame, Lobe::Dielectric(self.glass()));
            weight *= 1.0 - self.transmission;
        }
        if weight == Vec3::ZERO {
            return;
        }
        if let Some(fresnel) = self.specular() {
            weight *= builder.push_layer(weight, Vec3::ONE, grain.1, self.reflection(grain.0, fresnel));
        }
        self.push_diffuse(builder, weight, frame);
    }

    fn metal(&self) -> Fresnel {
        match self.metal_f90 {
            MetalF90::White => Fresnel::f82_tint(self.base_color, self.specular_tint.min(Vec3::ONE)),
            MetalF90::Base => Fresnel::constant(self.base_color),
        }
    }

    fn reflection(&self, ggx: Ggx, fresnel: Fresnel) -> Lobe {
        Lobe::Reflection(Reflection::new(ggx, fresnel).with_multiscatter(self.multiscatter))
    }

    fn glass(&self) -> Dielectric {
        let f0 = (f0_from_ior(self.ior) * self.specular_tint).min(Vec3::ONE);
        // light that goes in and comes out again is tinted twice
        let tint = self.base_color.map(f32::sqrt);
        Dielectric::tinted(Ggx::from_roughness(self.roughness), self.ior, f0, Vec3::ONE, tint)
            .with_multiscatter(self.multiscatter)
    }

    /// The dielectric reflection over the diffuse body, where there is one.
    fn specular(&self) -> Option<Fresnel> {
        if let Some(f0) = self.specular_color {
            let none = f0 == Vec3::ZERO && self.ior == 1.0;
            return (!none).then_some(Fresnel::Schlick { f0, f90: Vec3::ONE });
        }
        let f0 = f0_from_ior(self.ior) * 2.0 * self.specular_level;
        // an index below one reflects as its inverse does, but for the total reflection
        let eta = match self.specular_level == 0.5 {
            true => self.ior.max(1.0 / self.ior),
            false => ior_from_f0(f0),
        };
        (eta > 1.0).then(|| Fresnel::Dielectric { eta, f0: (f0 * self.specular_tint).min(Vec3::ONE) })
    }

    fn push_diffuse(&self, builder: &mut BsdfBuilder, weight: Vec3, frame: Frame) {
        if self.diffuse_roughness > 0.0 {
            let lobe = OrenNayar::new(self.base_color, self.diffuse_roughness);
            builder.push(weight, frame, Lobe::OrenNayar(lobe));
        } else {
            builder.push(weight * self.base_color, frame, Lobe::Lambert(Lambert));
        }
    }
}

/// Refractive index, at least one, of the normal reflectance `f0`.
fn ior_from_f0(f0: f32) -> f32 {
    let r = f0.clamp(0.0, MAX_F0).sqrt();
    (1.0 + r) / (1.0 - r)
}

#[cfg(test)]
mod tests;
