//! Materials at a surface point: the tree of closures becomes a BSDF, an emission and a transparency.

use super::bsdf::{Bsdf, BsdfBuilder, CAPACITY, Cover, MetalF90, Principled};
use super::class::SurfaceClass;
use super::lobes::fresnel::f0_from_ior;
use super::lobes::{Dielectric, Fresnel, Ggx, Lambert, Lobe, OrenNayar, Reflection, Sheen, Translucent};
use super::surface::{SurfacePoint, normalize_any};
use super::texture::{Looks, MeshPoint, TextureSet};
use crate::math::Frame;
use crate::scene::material::{Closure, MetalEdge, PrincipledClosure};
use crate::scene::needs::may_be_transparent;
use crate::scene::relief::Relief;
use crate::scene::value::Value;
use crate::scene::{Material, Scene, Warnings};
use glam::Vec3;
use std::sync::Arc;

/// All materials of a scene, ready to be evaluated.
#[derive(Debug)]
pub struct Materials {
    pub(super) scene: Arc<Scene>,
    pub(super) textures: TextureSet,
    /// For each material, whether light may pass straight through.
    transparent: Vec<bool>,
    /// For each material, what it depends on by its textures of how it is seen.
    looks: Vec<Looks>,
    /// For each material, what [`Materials::has_views`] says.
    views: Vec<bool>,
}

impl Materials {
    /// Prepares the materials of a scene.
    pub fn new(scene: Arc<Scene>, warnings: &mut Warnings) -> Self {
        for m in &scene.materials {
            let most = most_lobes(&m.surface);
            if most > CAPACITY {
                let problem =
                    format!("more than {CAPACITY} lobes may meet in a point; the last are left out");
                warnings.add(format!("material {:?}", m.name), problem, (most - CAPACITY) as u64);
            }
        }
        let transparent: Vec<bool> = scene.materials.iter().map(|m| may_be_transparent(m, &scene)).collect();
        let textures = TextureSet::new(scene.clone());
        let looks: Vec<Looks> = scene.materials.iter().map(|m| most_looks(m, &textures)).collect();
        let views = scene
            .materials
            .iter()
            .zip(&looks)
            .map(|(m, looks)| *looks != Looks::Same || is_layered(m))
            .collect();
        Self { textures, transparent, looks, views, scene }
    }

    /// Whether the direction that a material is seen from decides how much of its lobes shows.
    #[inline]
    pub fn has_views(&self, material: u32) -> bool {
        self.views[material as usize]
    }

    /// How a material may share light with its neighbours.
    pub fn class(&self, material: u32) -> SurfaceClass {
        let class = SurfaceClass::of(&self.scene.materials[material as usize]);
        // what is shared there is known for one direction only
        match self.looks[material as usize] {
            Looks::Direction => class.max(SurfaceClass::Reflecting),
            // neighbours show the same side
            Looks::Same | Looks::Side => class,
        }
    }

    /// Whether light may pass straight through a material somewhere.
    #[inline]
    pub fn may_be_transparent(&self, material: u32) -> bool {
        self.transparent[material as usize]
    }

    /// Share of the surface that is there; in `[0,1]`. It is the same from everywhere.
    pub fn opacity(&self, material: u32, at: &MeshPoint) -> f32 {
        self.textures.number(&self.scene.materials[material as usize].opacity, at).clamp(0.0, 1.0)
    }

    /// Share of light that passes straight through on its way along `wo`, of any length, towards the camera; in
    /// `[0,1]` a channel.
    pub fn transparency(&self, p: &SurfacePoint, wo: Vec3) -> Vec3 {
        let opacity = self.opacity(p.material, &p.at);
        let surface = &self.scene.materials[p.material as usize].surface;
        let through = match self.looks[p.material as usize] {
            Looks::Same => self.straight(surface, &p.at),
            Looks::Side | Looks::Direction => self.straight(surface, &p.seen_from(normalize_any(wo)).at),
        };
        (Vec3::splat(1.0 - opacity) + opacity * through).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// Sum of the transparent closures.
    fn straight(&self, closure: &Closure, at: &MeshPoint) -> Vec3 {
        match closure {
            Closure::Transparent { color } => self.textures.color(color, at).max(Vec3::ZERO),
            Closure::Mix { factor, a, b } => {
                let f = self.textures.number(factor, at).clamp(0.0, 1.0);
                self.straight(a, at) * (1.0 - f) + self.straight(b, at) * f
            }
            Closure::Add { a, b } => self.straight(a, at) + self.straight(b, at),
            _ => Vec3::ZERO,
        }
    }

    /// Radiance that the material emits where it is, on the sides that emit. Not weighted by opacity. `facing`: see
    /// [`super::surface::facing`]; few materials ask.
    pub fn emission(&self, material: u32, at: &MeshPoint, facing: impl Fn() -> f32) -> Vec3 {
        let mut at = *at;
        if self.looks[material as usize] != Looks::Same {
            at.facing = facing();
        }
        let e = self.emitted(&self.scene.materials[material as usize].surface, &at, &facing);
        // what is negative or not finite in a texture is no light
        let clean = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
        Vec3::new(clean(e.x), clean(e.y), clean(e.z))
    }

    fn emitted(&self, closure: &Closure, at: &MeshPoint, facing: &dyn Fn() -> f32) -> Vec3 {
        let product = |color: &Value, strength: &Value| match strength.is(0.0) {
            true => Vec3::ZERO,
            false => self.textures.color(color, at) * self.textures.number(strength, at),
        };
        match closure {
            Closure::Emission { color, strength } => product(color, strength),
            Closure::Principled(p) => match product(&p.emission_color, &p.emission_strength) {
                // it comes from below sheen and coat
                e if e != Vec3::ZERO && is_covered(p) => e * self.cover(p, at).transmittance(facing().abs()),
                e => e,
            },
            Closure::Mix { factor, a, b } => {
                let f = self.textures.number(factor, at).clamp(0.0, 1.0);
                self.emitted(a, at, facing) * (1.0 - f) + self.emitted(b, at, facing) * f
            }
            Closure::Add { a, b } => self.emitted(a, at, facing) + self.emitted(b, at, facing),
            _ => Vec3::ZERO,
        }
    }

    /// The scattering at a point. Transparent closures are not in it: they belong to visibility.
    /// `wo`: the direction it is seen from, which decides how much the layers of a principled surface hide
    /// of each other, how far normals of what mirrors may lean, and what textures show that depend on it.
    pub fn bsdf(&self, p: &SurfacePoint, wo: Vec3) -> Bsdf {
        let mut builder = BsdfBuilder::new(p.place.normal, wo);
        let surface = &self.scene.materials[p.material as usize].surface;
        match self.looks[p.material as usize] {
            Looks::Same => self.push(&mut builder, surface, Vec3::ONE, p),
            Looks::Side | Looks::Direction => self.push(&mut builder, surface, Vec3::ONE, &p.seen_from(wo)),
        }
        builder.build()
    }

    fn push(&self, builder: &mut BsdfBuilder, closure: &Closure, weight: Vec3, p: &SurfacePoint) {
        let color = |v: &Value| self.textures.color(v, &p.at).max(Vec3::ZERO);
        let number = |v: &Value| self.textures.number(v, &p.at);
        let frame = |n: &Option<Relief>| self.frame(n.as_ref(), p);
        match closure {
            Closure::Diffuse { color: c, roughness, normal } => {
                let (c, sigma) = (color(c).min(Vec3::ONE), number(roughness));
                match sigma > 0.0 {
                    false => builder.push(weight * c, frame(normal), Lobe::Lambert(Lambert)),
                    // its colour enters through multiple scattering, so it is not just a factor
                    true => builder.push(
                        weight,
                        frame(normal),
                        Lobe::OrenNayar(OrenNayar::new(c, sigma.min(1.0))),
                    ),
                }
            }
            Closure::Glossy { color: c, roughness, anisotropy, rotation, tangent, multiscatter, normal } => {
                let anisotropy = number(anisotropy);
                let ggx = grain(number(roughness), anisotropy);
                let frame = match anisotropy == 0.0 {
                    true => frame(normal),
                    false => self.tangent_frame(normal.as_ref(), tangent, p).turned(number(rotation)),
                };
                let fresnel = Fresnel::constant(color(c).min(Vec3::ONE));
                let lobe = Reflection::new(ggx, fresnel).with_multiscatter(*multiscatter);
                builder.push(weight, frame, Lobe::Reflection(lobe));
            }
            Closure::Glass { color: c, roughness, ior, multiscatter, normal } => {
                let ggx = Ggx::from_roughness(number(roughness));
                let (tint, eta) = (color(c).min(Vec3::ONE), sane_ior(number(ior)));
                let lobe = Dielectric::tinted(ggx, eta, Vec3::splat(f0_from_ior(eta)), tint, tint);
                builder.push(weight, frame(normal), Lobe::Dielectric(lobe.with_multiscatter(*multiscatter)));
            }
            Closure::Refraction { color: c, roughness, ior, normal } => {
                let ggx = Ggx::from_roughness(number(roughness));
                let lobe = Dielectric::refraction_only(ggx, sane_ior(number(ior)));
                builder.push(weight * color(c).min(Vec3::ONE), frame(normal), Lobe::Dielectric(lobe));
            }
            Closure::Translucent { color: c, normal } => {
                builder.push(weight * color(c).min(Vec3::ONE), frame(normal), Lobe::Translucent(Translucent));
            }
            Closure::Sheen { color: c, roughness, normal } => {
                let lobe = Sheen::new(number(roughness));
                builder.push(weight * color(c).min(Vec3::ONE), frame(normal), Lobe::Sheen(lobe));
            }
            Closure::Principled(c) => self.push_principled(builder, c, weight, p),
            Closure::Mix { factor, a, b } => {
                let f = number(factor).clamp(0.0, 1.0);
                if f < 1.0 {
                    self.push(builder, a, weight * (1.0 - f), p);
                }
                if f > 0.0 {
                    self.push(builder, b, weight * f, p);
                }
            }
            Closure::Add { a, b } => {
                self.push(builder, a, weight, p);
                self.push(builder, b, weight, p);
            }
            Closure::Transparent { .. } | Closure::Emission { .. } => {}
        }
    }

    fn push_principled(
        &self,
        builder: &mut BsdfBuilder,
        c: &PrincipledClosure,
        weight: Vec3,
        p: &SurfacePoint,
    ) {
        let color = |v: &Value| self.textures.color(v, &p.at).max(Vec3::ZERO);
        let number = |v: &Value| self.textures.number(v, &p.at);
        let unit = |v: &Value| number(v).clamp(0.0, 1.0);
        let anisotropy = number(&c.anisotropy).clamp(-1.0, 1.0);
        let frame = match anisotropy == 0.0 {
            true => self.frame(c.normal.as_ref(), p),
            false => self.tangent_frame(c.normal.as_ref(), &c.tangent, p),
        };
        let cover = self.cover(c, &p.at);
        let coat_frame = match (&c.coat_normal, cover.coat > 0.0) {
            (Some(_), true) => self.frame(c.coat_normal.as_ref(), p),
            _ => Frame::from_normal(p.ns),
        };
        let model = Principled {
            base_color: color(&c.base_color).min(Vec3::ONE),
            diffuse_roughness: unit(&c.diffuse_roughness),
            metallic: unit(&c.metallic),
            roughness: unit(&c.roughness),
            ior: sane_ior(number(&c.ior)),
            specular_level: number(&c.specular_level).max(0.0),
            specular_tint: color(&c.specular_tint),
            specular_color: c.specular_color.as_ref().map(|v| color(v).min(Vec3::ONE)),
            anisotropy,
            rotation: number(&c.rotation),
            transmission: unit(&c.transmission),
            cover,
            metal_f90: match c.metal_f90 {
                MetalEdge::White => MetalF90::White,
                MetalEdge::Base => MetalF90::Base,
            },
            multiscatter: c.multiscatter,
        };
        model.push(builder, weight, frame, coat_frame);
    }

    fn cover(&self, c: &PrincipledClosure, at: &MeshPoint) -> Cover {
        let tint = |v: &Value| self.textures.color(v, at).clamp(Vec3::ZERO, Vec3::ONE);
        let unit = |v: &Value| self.textures.number(v, at).clamp(0.0, 1.0);
        Cover {
            coat: unit(&c.coat),
            coat_roughness: unit(&c.coat_roughness),
            coat_ior: sane_ior(self.textures.number(&c.coat_ior, at)),
            coat_tint: tint(&c.coat_tint),
            sheen: unit(&c.sheen),
            sheen_roughness: unit(&c.sheen_roughness),
            sheen_tint: tint(&c.sheen_tint),
        }
    }

    /// Texture coordinates of a point in the mesh's first UV set; zero without one.
    pub fn uv(&self, at: &MeshPoint) -> glam::Vec2 {
        let mesh = &self.scene.meshes[at.mesh as usize];
        mesh.uvs.first().map_or(glam::Vec2::ZERO, |(_, a)| super::texture::interpolate(a, mesh, at))
    }
}

/// What a material depends on by its textures of how it is seen.
fn most_looks(m: &Material, textures: &TextureSet) -> Looks {
    let mut most = Looks::Same;
    m.for_each_value(&mut |v| most = most.max(textures.looks(v)));
    most
}

/// Whether sheen or a coat may lie over the rest.
fn is_covered(p: &PrincipledClosure) -> bool {
    !(p.coat.is(0.0) && p.sheen.is(0.0))
}

/// Whether some lobes of a material hide others.
fn is_layered(m: &Material) -> bool {
    let mut layered = false;
    m.surface.for_each(&mut |closure| {
        if let Closure::Principled(p) = closure {
            layered |= is_covered(p) || !(p.transmission.is(1.0) || p.metallic.is(1.0));
        }
    });
    layered
}

/// Most lobes that a closure can have at one point.
fn most_lobes(closure: &Closure) -> usize {
    let some = |v: &Value| usize::from(!v.is(0.0));
    match closure {
        Closure::Mix { a, b, .. } | Closure::Add { a, b } => most_lobes(a) + most_lobes(b),
        Closure::Principled(p) => {
            let over = some(&p.sheen) + some(&p.coat);
            let base = match p.metallic.is(1.0) {
                true => 0,
                // the dielectric reflection and the diffuse body
                false => some(&p.transmission) + if p.transmission.is(1.0) { 0 } else { 2 },
            };
            over + some(&p.metallic) + base
        }
        Closure::Transparent { .. } | Closure::Emission { .. } => 0,
        _ => 1,
    }
}

/// Keeps a refractive index from a texture within what exists.
fn sane_ior(ior: f32) -> f32 {
    if ior.is_finite() { ior.clamp(1e-2, 1e2) } else { 1.5 }
}

/// Microfacets of a glossy closure, with the anisotropy of Blender's Glossy BSDF: from -0.99 to 0.99,
/// positive values smoother along x.
fn grain(roughness: f32, anisotropy: f32) -> Ggx {
    let alpha = roughness * roughness;
    let squeeze = 1.0 - anisotropy.abs().min(0.99);
    let (short, long) = (alpha * squeeze, alpha / squeeze);
    if anisotropy < 0.0 { Ggx::new(long, short) } else { Ggx::new(short, long) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(json: &str) -> usize {
        most_lobes(&serde_json::from_str(json).unwrap())
    }

    #[test]
    fn the_most_lobes_are_counted() {
        assert_eq!(count(r#"{"type":"principled"}"#), 2);
        assert_eq!(count(r#"{"type":"principled","metallic":1,"coat":1}"#), 2);
        assert_eq!(count(r#"{"type":"principled","transmission":1,"sheen":1}"#), 2);
        assert_eq!(count(r#"{"type":"principled","metallic":0.5,"transmission":0.5}"#), 4);
        let mix = r#"{"type":"mix","a":{"type":"transparent"},"b":{"type":"add",
            "a":{"type":"glass"},"b":{"type":"principled"}}}"#;
        assert_eq!(count(mix), 3);
    }
}
