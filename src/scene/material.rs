//! Materials: a small tree of closures whose parameters are constants or textures.

use super::SceneError;
use super::relief::{BumpSpace, Relief, Tangent};
use super::value::Value;
use glam::Vec3;
use serde::Deserialize;

/// Reflectance of metal at grazing angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum MetalEdge {
    /// White at 90 degrees (tinted by `specular_tint` near 82 degrees).
    #[default]
    White,
    /// The base colour at every angle.
    Base,
}

const fn eight_tenths() -> Value {
    Value::number(0.8)
}
const fn half() -> Value {
    Value::number(0.5)
}
const fn yes() -> bool {
    true
}
const fn one() -> Value {
    Value::number(1.0)
}
const fn zero() -> Value {
    Value::number(0.0)
}
const fn glass_ior() -> Value {
    Value::number(1.5)
}
const fn coat_roughness() -> Value {
    Value::number(0.03)
}

/// The layered principled surface: sheen over coat over metal, dielectric, glass and diffuse.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // the parameters are Blender's, one by one, and documented in docs/abi.md
pub struct PrincipledClosure {
    #[serde(default = "eight_tenths")]
    pub base_color: Value,
    #[serde(default = "zero")]
    pub diffuse_roughness: Value,
    #[serde(default = "zero")]
    pub metallic: Value,
    #[serde(default = "half")]
    pub roughness: Value,
    #[serde(default = "glass_ior")]
    pub ior: Value,
    #[serde(default = "half")]
    pub specular_level: Value,
    #[serde(default = "one")]
    pub specular_tint: Value,
    pub specular_color: Option<Value>,
    #[serde(default = "zero")]
    pub anisotropy: Value,
    #[serde(default = "zero")]
    pub rotation: Value,
    #[serde(default)]
    pub tangent: Tangent,
    #[serde(default = "zero")]
    pub transmission: Value,
    #[serde(default = "zero")]
    pub coat: Value,
    #[serde(default = "coat_roughness")]
    pub coat_roughness: Value,
    #[serde(default = "glass_ior")]
    pub coat_ior: Value,
    #[serde(default = "one")]
    pub coat_tint: Value,
    pub coat_normal: Option<Relief>,
    #[serde(default = "zero")]
    pub sheen: Value,
    #[serde(default = "half")]
    pub sheen_roughness: Value,
    #[serde(default = "one")]
    pub sheen_tint: Value,
    #[serde(default = "one")]
    pub emission_color: Value,
    #[serde(default = "zero")]
    pub emission_strength: Value,
    #[serde(default)]
    pub metal_f90: MetalEdge,
    /// Whether what microfacets scatter more than once comes out; the coat's always does.
    #[serde(default = "yes")]
    pub multiscatter: bool,
    pub normal: Option<Relief>,
}

/// A node of a material's tree. Parameters and their defaults are those of `docs/abi.md`.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Closure {
    /// Lambert, or Oren-Nayar where rough.
    Diffuse {
        #[serde(default = "eight_tenths")]
        color: Value,
        #[serde(default = "zero")]
        roughness: Value,
        normal: Option<Relief>,
    },
    /// Microfacet reflection of constant reflectance.
    Glossy {
        #[serde(default = "eight_tenths")]
        color: Value,
        #[serde(default = "half")]
        roughness: Value,
        #[serde(default = "zero")]
        anisotropy: Value,
        #[serde(default = "zero")]
        rotation: Value,
        #[serde(default)]
        tangent: Tangent,
        #[serde(default = "yes")]
        multiscatter: bool,
        normal: Option<Relief>,
    },
    /// Dielectric interface: reflection and refraction.
    Glass {
        #[serde(default = "one")]
        color: Value,
        #[serde(default = "zero")]
        roughness: Value,
        #[serde(default = "glass_ior")]
        ior: Value,
        #[serde(default = "yes")]
        multiscatter: bool,
        normal: Option<Relief>,
    },
    /// Refraction without reflection.
    Refraction {
        #[serde(default = "one")]
        color: Value,
        #[serde(default = "zero")]
        roughness: Value,
        #[serde(default = "glass_ior")]
        ior: Value,
        normal: Option<Relief>,
    },
    /// Straight through.
    Transparent {
        #[serde(default = "one")]
        color: Value,
    },
    /// Lambert to the other side.
    Translucent {
        #[serde(default = "eight_tenths")]
        color: Value,
        normal: Option<Relief>,
    },
    /// Cloth-like retroreflection at grazing angles.
    Sheen {
        #[serde(default = "eight_tenths")]
        color: Value,
        #[serde(default = "half")]
        roughness: Value,
        normal: Option<Relief>,
    },
    /// Emitted radiance, `color * strength`.
    Emission {
        #[serde(default = "one")]
        color: Value,
        #[serde(default = "one")]
        strength: Value,
    },
    /// The layered model.
    Principled(Box<PrincipledClosure>),
    /// `(1 - factor) a + factor b`.
    Mix {
        #[serde(default = "half")]
        factor: Value,
        a: Box<Closure>,
        b: Box<Closure>,
    },
    /// `a + b`.
    Add { a: Box<Closure>, b: Box<Closure> },
}

/// A surface material.
#[derive(Clone, Debug)]
pub struct Material {
    /// The name, for messages.
    pub name: String,
    /// Scattering and emission.
    pub surface: Closure,
    /// Share of the surface that is there; the rest is a hole.
    pub opacity: Value,
    /// Absorption coefficient of the inside of objects, per scene unit.
    pub absorption: Vec3,
    /// What moves the surface.
    pub displacement: Option<Displacement>,
    /// Value of the Material Index pass.
    pub pass_index: u32,
}

/// How far vertices move along their normals.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Displacement {
    /// The distance.
    pub height: Value,
    /// The space whose units it has.
    #[serde(default)]
    pub space: BumpSpace,
    /// Whether shading normals stay those of the surface that is moved, since a bump map has its slopes.
    #[serde(default)]
    pub keeps_normals: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Json {
    surface: Closure,
    #[serde(default = "one")]
    opacity: Value,
    #[serde(default)]
    absorption: [f32; 3],
    #[serde(default)]
    displacement: Option<Displacement>,
    #[serde(default)]
    pass_index: u32,
}

/// Deepest tree of mixes that is accepted: beyond any made by hand, and safe for the stack.
const MAX_DEPTH: usize = 64;

impl Default for Material {
    /// The grey of surfaces that have no material.
    fn default() -> Self {
        Self {
            name: "default".into(),
            surface: Closure::Diffuse { color: eight_tenths(), roughness: zero(), normal: None },
            opacity: one(),
            absorption: Vec3::ZERO,
            displacement: None,
            pass_index: 0,
        }
    }
}

impl Material {
    /// A material from its JSON description (`docs/abi.md`); `texture_count` textures exist.
    pub fn from_json(name: &str, json: &str, texture_count: usize) -> Result<Self, SceneError> {
        let fail = |problem: String| SceneError::new(format!("material {name:?}"), problem);
        let j: Json = serde_json::from_str(json).map_err(|e| fail(e.to_string()))?;
        if j.surface.depth() > MAX_DEPTH {
            return Err(fail(format!("its tree of closures is deeper than {MAX_DEPTH}")));
        }
        let Json { surface, opacity, absorption, displacement, pass_index } = j;
        let absorption = Vec3::from(absorption);
        if !(absorption.is_finite() && absorption.min_element() >= 0.0) {
            return Err(fail("its absorption is negative or not finite".to_string()));
        }
        let material = Self { name: name.into(), surface, opacity, absorption, displacement, pass_index };
        let mut problem = None;
        material.for_each_value(&mut |v| {
            problem = problem.take().or(match v {
                Value::Constant(c) if !c.is_finite() => Some("a parameter is not finite".to_string()),
                Value::Texture { texture, .. } if *texture as usize >= texture_count => {
                    Some(format!("there is no texture {texture}"))
                }
                _ => None,
            });
        });
        match problem {
            Some(p) => Err(fail(p)),
            None => Ok(material),
        }
    }

    /// Whether a constant that is a share of light lies outside `[0,1]`; it is clamped when shaded.
    pub fn is_clamped(&self) -> bool {
        let outside =
            |v: &Value| matches!(v, Value::Constant(c) if c.min_element() < 0.0 || c.max_element() > 1.0);
        let mut found = outside(&self.opacity);
        self.surface.for_each(&mut |c| {
            found |= match c {
                Closure::Diffuse { color, .. }
                | Closure::Glossy { color, .. }
                | Closure::Glass { color, .. }
                | Closure::Refraction { color, .. }
                | Closure::Transparent { color }
                | Closure::Translucent { color, .. }
                | Closure::Sheen { color, .. } => outside(color),
                Closure::Principled(p) => {
                    [&p.base_color, &p.metallic, &p.transmission, &p.coat, &p.sheen].into_iter().any(outside)
                }
                Closure::Mix { factor, .. } => outside(factor),
                Closure::Emission { .. } | Closure::Add { .. } => false,
            }
        });
        found
    }

    /// Calls `f` with every parameter, normal maps as textures.
    pub fn for_each_value(&self, f: &mut dyn FnMut(&Value)) {
        f(&self.opacity);
        if let Some(displacement) = &self.displacement {
            f(&displacement.height);
        }
        self.surface.for_each(&mut |c| c.own_values(f));
    }
}

impl Closure {
    fn depth(&self) -> usize {
        match self {
            Self::Mix { a, b, .. } | Self::Add { a, b } => 1 + a.depth().max(b.depth()),
            _ => 1,
        }
    }

    /// Calls `f` with this closure and all below it.
    pub fn for_each(&self, f: &mut dyn FnMut(&Closure)) {
        f(self);
        if let Self::Mix { a, b, .. } | Self::Add { a, b } = self {
            a.for_each(f);
            b.for_each(f);
        }
    }

    /// What gives normals to this closure alone.
    pub fn reliefs(&self) -> impl Iterator<Item = &Relief> {
        let (normal, coat) = match self {
            Self::Diffuse { normal, .. }
            | Self::Glossy { normal, .. }
            | Self::Glass { normal, .. }
            | Self::Refraction { normal, .. }
            | Self::Translucent { normal, .. }
            | Self::Sheen { normal, .. } => (normal.as_ref(), None),
            Self::Principled(p) => (p.normal.as_ref(), p.coat_normal.as_ref()),
            Self::Transparent { .. } | Self::Emission { .. } | Self::Mix { .. } | Self::Add { .. } => {
                (None, None)
            }
        };
        normal.into_iter().chain(coat)
    }

    fn own_values(&self, f: &mut dyn FnMut(&Value)) {
        match self {
            Self::Diffuse { color, roughness, .. } | Self::Sheen { color, roughness, .. } => {
                [color, roughness].into_iter().for_each(&mut *f)
            }
            Self::Glossy { color, roughness, anisotropy, rotation, tangent, .. } => {
                let values = [color, roughness, anisotropy, rotation];
                values.into_iter().chain(tangent.value()).for_each(&mut *f);
            }
            Self::Glass { color, roughness, ior, .. } | Self::Refraction { color, roughness, ior, .. } => {
                [color, roughness, ior].into_iter().for_each(&mut *f)
            }
            Self::Transparent { color } | Self::Translucent { color, .. } => f(color),
            Self::Emission { color, strength } => [color, strength].into_iter().for_each(&mut *f),
            Self::Principled(p) => {
                let PrincipledClosure {
                    base_color,
                    diffuse_roughness,
                    metallic,
                    roughness,
                    ior,
                    specular_level,
                    specular_tint,
                    specular_color,
                    anisotropy,
                    rotation,
                    tangent,
                    transmission,
                    coat,
                    coat_roughness,
                    coat_ior,
                    coat_tint,
                    coat_normal: _,
                    sheen,
                    sheen_roughness,
                    sheen_tint,
                    emission_color,
                    emission_strength,
                    metal_f90: _,
                    multiscatter: _,
                    normal: _,
                } = &**p;
                [base_color, diffuse_roughness, metallic, roughness, ior, specular_level, specular_tint]
                    .into_iter()
                    .chain([anisotropy, rotation, transmission, coat, coat_roughness, coat_ior, coat_tint])
                    .chain([sheen, sheen_roughness, sheen_tint, emission_color, emission_strength])
                    .chain(specular_color)
                    .chain(tangent.value())
                    .for_each(&mut *f);
            }
            Self::Mix { factor, .. } => f(factor),
            Self::Add { .. } => {}
        }
        self.reliefs().for_each(|relief| relief.for_each_value(f));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn trees_are_read_with_their_defaults() {
        let json = r#"{"surface":{"type":"mix","factor":{"texture":0,"channel":"r"},
            "a":{"type":"diffuse","color":[0.1,0.2,0.3]},"b":{"type":"principled","metallic":1}}}"#;
        let m = Material::from_json("m", json, 1).unwrap();
        let mut n = 0;
        m.for_each_value(&mut |_| n += 1);
        assert_eq!(n, 1 + 1 + 2 + 19);
        let Closure::Mix { a, b, .. } = &m.surface else { panic!("not a mix") };
        assert!(
            matches!(&**a, Closure::Diffuse { color: Value::Constant(c), .. } if *c == Vec3::new(0.1, 0.2, 0.3))
        );
        assert!(matches!(&**b, Closure::Principled(p) if p.metallic.is(1.0) && p.ior.is(1.5)));
    }

    #[test]
    fn reflecting_more_than_all_light_is_noticed() {
        let clamped = |surface: &str| {
            Material::from_json("m", &format!(r#"{{"surface":{surface}}}"#), 0).unwrap().is_clamped()
        };
        assert!(clamped(r#"{"type":"diffuse","color":[0.5,1.5,0.5]}"#));
        assert!(clamped(r#"{"type":"add","a":{"type":"glass","color":-1},"b":{"type":"emission"}}"#));
        assert!(!clamped(r#"{"type":"emission","strength":50}"#));
        assert!(!clamped(r#"{"type":"principled","ior":3,"specular_level":2}"#));
    }

    #[test]
    fn bad_descriptions_are_refused_by_name() {
        for (json, what) in [
            (r#"{"surface":{"type":"velvet"}}"#, "velvet"),
            (r#"{"surface":{"type":"diffuse","colour":1}}"#, "colour"),
            (r#"{"surface":{"type":"diffuse","color":"red"}}"#, "red"),
            (r#"{"surface":{"type":"diffuse","color":[1,2]}}"#, "[1,2]"),
            (r#"{"surface":{"type":"diffuse","color":1e60}}"#, "not finite"),
            (r#"{"surface":{"type":"diffuse","color":{"texture":3}}}"#, "no texture 3"),
            (r#"{"surface":{"type":"diffuse","normal":{"texture":3}}}"#, "no texture 3"),
            (r#"{"opacity":1}"#, "surface"),
        ] {
            let e = Material::from_json("paint", json, 3).unwrap_err().to_string();
            assert!(e.contains("material \"paint\"") && e.contains(what), "{json}: {e}");
        }
    }
}
