//! The upper layers of a principled surface: sheen, and a coat below it.

use super::BsdfBuilder;
use crate::math::Frame;
use crate::shading::lobes::fresnel::f0_from_ior;
use crate::shading::lobes::{Fresnel, Ggx, Lobe, Reflection, Sheen};
use glam::Vec3;

/// Parameters of these layers at one point. Weights, roughness and the channels of colours are in [0,1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover {
    /// Weight of the coat.
    pub coat: f32,
    /// Roughness of the coat.
    pub coat_roughness: f32,
    /// Refractive index of the coat; values below one count as one.
    pub coat_ior: f32,
    /// Transmittance of the coat along its normal.
    pub coat_tint: Vec3,
    /// Weight of the sheen.
    pub sheen: f32,
    /// Roughness of the sheen.
    pub sheen_roughness: f32,
    /// Colour of the sheen.
    pub sheen_tint: Vec3,
}

impl Cover {
    /// Pushes the lobes of a stack of this weight and returns the weight of what is below. `n`: normal of the base;
    /// `coat_frame`: of the coat.
    pub(super) fn push(&self, builder: &mut BsdfBuilder, weight: Vec3, n: Vec3, coat_frame: Frame) -> Vec3 {
        let mut weight = weight;
        if let Some((share, lobe)) = self.sheen() {
            // fibres follow the surface that is outermost
            let n = n.lerp(coat_frame.n, self.coat).try_normalize().unwrap_or(n);
            weight *= builder.push_layer(weight, share, Frame::from_normal(n), lobe);
        }
        if let Some((share, lobe)) = self.coat() {
            weight *= builder.push_layer(weight, share, coat_frame, lobe);
        }
        weight * self.tint(coat_frame.n.dot(builder.wo()))
    }

    /// What comes through of the light from below, towards a direction at this cosine to the normal.
    pub fn transmittance(&self, cos: f32) -> Vec3 {
        let to = Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos);
        let layers = [self.sheen(), self.coat()].into_iter().flatten();
        let left = layers.map(|(share, lobe)| left_by(share * lobe.albedo(to))).product::<f32>();
        self.tint(cos) * left
    }

    /// Its share, and the lobe.
    fn sheen(&self) -> Option<(Vec3, Lobe)> {
        let lobe = || Lobe::Sheen(Sheen::new(self.sheen_roughness));
        (self.sheen > 0.0).then(|| (self.sheen * self.sheen_tint, lobe()))
    }

    fn coat(&self) -> Option<(Vec3, Lobe)> {
        let fresnel = Fresnel::Dielectric { eta: self.coat_ior, f0: Vec3::splat(f0_from_ior(self.coat_ior)) };
        let lobe = || Lobe::Reflection(Reflection::new(Ggx::from_roughness(self.coat_roughness), fresnel));
        (self.coat > 0.0 && self.coat_ior > 1.0).then(|| (Vec3::splat(self.coat), lobe()))
    }

    /// Beer's law along the refracted direction, the tint being that of the shortest path.
    fn tint(&self, cos: f32) -> Vec3 {
        if self.coat == 0.0 {
            return Vec3::ONE;
        }
        let eta = self.coat_ior.max(1.0);
        let cos = cos.min(1.0);
        let cos_t = (1.0 - (1.0 - cos * cos) / (eta * eta)).max(1e-6).sqrt();
        Vec3::ONE.lerp(self.coat_tint.powf(1.0 / cos_t), self.coat)
    }
}

/// How much a layer leaves to those below it: one minus the largest channel of its albedo.
pub(super) fn left_by(albedo: Vec3) -> f32 {
    1.0 - albedo.max_element().clamp(0.0, 1.0)
}
