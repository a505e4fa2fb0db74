//! Normals that materials give to surfaces, normal maps and bump maps; and tangents.

use super::value::{Channel, Value};
use serde::{Deserialize, Deserializer, de};

/// Where the tangents of anisotropic surfaces come from.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tangent {
    /// The u direction of a UV set; empty is the first one.
    Uv(String),
    /// A direction in the mesh's own space.
    Along(Value),
}

impl Tangent {
    /// The value, if it is one.
    pub fn value(&self) -> Option<&Value> {
        match self {
            Self::Uv(_) => None,
            Self::Along(v) => Some(v),
        }
    }
}

impl Default for Tangent {
    fn default() -> Self {
        Self::Uv(String::new())
    }
}

/// The space a normal map's vectors are in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum NormalSpace {
    /// Tangent (along u), bitangent, normal.
    #[default]
    Tangent,
    /// The mesh's own space.
    Object,
    /// The world's.
    World,
}

/// A normal map.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalMap {
    /// Texture whose colour is the normal in `[-1,1]`.
    pub texture: u32,
    /// 0 leaves the surface's normal, 1 takes the map's.
    #[serde(default = "one")]
    pub strength: Value,
    /// Space of the vectors.
    #[serde(default)]
    pub space: NormalSpace,
    /// UV set the tangents come from; empty is the first one.
    #[serde(default)]
    pub uv: String,
}

/// The space in which a bump map raises surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum BumpSpace {
    /// The world's.
    #[default]
    World,
    /// The mesh's own space: what is scaled has its bumps scaled.
    Object,
}

/// A bump map: the normal of the surface that would lie `distance * height` above.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BumpMap {
    /// Height.
    pub height: Value,
    /// Length that a height of one stands for, units of the space; negative: heights are depths.
    #[serde(default = "one")]
    pub distance: Value,
    /// 0 leaves the surface's normal, 1 takes the map's.
    #[serde(default = "one")]
    pub strength: Value,
    /// The space in which the surface is raised.
    #[serde(default)]
    pub space: BumpSpace,
    /// What gives the surface that is raised its normal.
    #[serde(default)]
    pub normal: Option<Box<Relief>>,
}

/// What gives a surface another normal than its mesh does.
#[derive(Clone, Debug)]
pub enum Relief {
    /// Normals.
    Normals(NormalMap),
    /// Heights.
    Heights(BumpMap),
}

const fn one() -> Value {
    Value::number(1.0)
}

impl Relief {
    /// Calls `f` with every parameter, normal maps as textures.
    pub fn for_each_value(&self, f: &mut dyn FnMut(&Value)) {
        match self {
            Self::Normals(map) => {
                f(&map.strength);
                f(&Value::Texture { texture: map.texture, channel: Channel::Rgb });
            }
            Self::Heights(map) => {
                [&map.height, &map.distance, &map.strength].into_iter().for_each(&mut *f);
                if let Some(below) = &map.normal {
                    below.for_each_value(f);
                }
            }
        }
    }
}

impl<'de> Deserialize<'de> for Relief {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let json = serde_json::Value::deserialize(deserializer)?;
        let relief = match json.get("height") {
            Some(_) => serde_json::from_value(json).map(Self::Heights),
            None => serde_json::from_value(json).map(Self::Normals),
        };
        relief.map_err(de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_are_told_apart() {
        let read = |json: &str| serde_json::from_str::<Relief>(json);
        assert!(matches!(read(r#"{"texture":3}"#), Ok(Relief::Normals(map)) if map.texture == 3));
        let both = r#"{"height":{"texture":1},"distance":-0.1,"normal":{"texture":2,"space":"world"}}"#;
        let Ok(Relief::Heights(bump)) = read(both) else { panic!("no bump map") };
        assert_eq!((bump.distance, bump.strength), (Value::number(-0.1), Value::number(1.0)));
        let mut textures = Vec::new();
        Relief::Heights(bump).for_each_value(&mut |v| {
            textures.extend(if let Value::Texture { texture, .. } = v { Some(*texture) } else { None });
        });
        assert_eq!(textures, [1, 2]);
        for (json, what) in [(r#"{"height":1,"depth":2}"#, "depth"), (r#"{"strength":1}"#, "texture")] {
            let error = read(json).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        }
    }
}
