//! Parameters of materials: constants, or what a texture says.

use glam::Vec3;
use serde::{Deserialize, Deserializer, de};

/// Which part of a texture's RGBA value is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Channel {
    /// The colour.
    #[default]
    Rgb,
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Alpha.
    A,
    /// Relative luminance of the colour.
    Luminance,
    /// Mean of the colour's components.
    Average,
}

/// A parameter: a constant (a number is a grey colour) or a texture's output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// The same everywhere.
    Constant(Vec3),
    /// A texture of the scene.
    Texture {
        /// Index of the texture.
        texture: u32,
        /// Part of its value.
        channel: Channel,
    },
}

impl Value {
    /// A grey constant.
    pub const fn number(v: f32) -> Self {
        Self::Constant(Vec3::splat(v))
    }

    /// Whether the value is the constant `v` everywhere.
    pub fn is(&self, v: f32) -> bool {
        *self == Self::number(v)
    }
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Reference {
            texture: u32,
            #[serde(default)]
            channel: Channel,
        }
        let json = serde_json::Value::deserialize(deserializer)?;
        let read = |v: &serde_json::Value| -> Result<f32, D::Error> {
            let v = v.as_f64().ok_or_else(|| de::Error::custom(format!("{v} is not a number")))?;
            Ok(v as f32)
        };
        match &json {
            serde_json::Value::Number(_) => Ok(Self::number(read(&json)?)),
            serde_json::Value::Array(a) if a.len() == 3 => {
                Ok(Self::Constant(Vec3::new(read(&a[0])?, read(&a[1])?, read(&a[2])?)))
            }
            serde_json::Value::Object(_) => {
                let r: Reference = serde_json::from_value(json).map_err(de::Error::custom)?;
                Ok(Self::Texture { texture: r.texture, channel: r.channel })
            }
            other => {
                Err(de::Error::custom(format!("{other} is not a number, a colour [r,g,b] or a texture")))
            }
        }
    }
}
