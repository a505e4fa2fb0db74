//! Descriptions of lights: JSON, and what can be said against it before the light is placed.

use super::placement::{Unplaceable, place};
use super::{Light, SeenBy};
use crate::scene::camera::affine_from_rows;
use crate::scene::{SceneError, Warnings};
use glam::{DAffine3, DMat4};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::f64::consts::TAU;

/// A light as described, not yet placed: its numbers are checked, its transform is kept in double
/// precision.
#[derive(Clone, Debug)]
pub struct LightSpec {
    /// The name, for messages.
    pub name: String,
    /// Light to world.
    pub to_world: DAffine3,
    /// Which rays see it.
    pub seen_by: SeenBy,
    shape: Shape,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Shape {
    Rect {
        #[serde(default = "one")]
        width: f64,
        #[serde(default = "one")]
        height: f64,
        radiance: [f64; 3],
        image: Option<u32>,
        shaping: Option<ShapingJson>,
    },
    Disk {
        #[serde(default = "half")]
        radius: f64,
        radiance: [f64; 3],
        shaping: Option<ShapingJson>,
    },
    Sphere {
        #[serde(default = "half")]
        radius: f64,
        radiance: [f64; 3],
        shaping: Option<ShapingJson>,
    },
    Cylinder {
        #[serde(default = "half")]
        radius: f64,
        #[serde(default = "one")]
        length: f64,
        radiance: [f64; 3],
        shaping: Option<ShapingJson>,
    },
    Point {
        intensity: [f64; 3],
        shaping: Option<ShapingJson>,
    },
    Distant {
        #[serde(default)]
        angle: f64,
        irradiance: Option<[f64; 3]>,
        radiance: Option<[f64; 3]>,
    },
    Dome {
        radiance: [f64; 3],
        image: Option<u32>,
        portal: Option<Value>,
    },
}

fn one() -> f64 {
    1.0
}

fn half() -> f64 {
    0.5
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShapingJson {
    pub cone_angle: Option<f64>,
    pub cone_softness: Option<f64>,
    pub focus: Option<f64>,
    pub focus_tint: Option<[f64; 3]>,
    pub spot_size: Option<f64>,
    pub spot_blend: Option<f64>,
    pub spread: Option<f64>,
}

impl LightSpec {
    /// A light from its JSON description (`docs/abi.md`).
    pub fn from_json(name: &str, json: &str) -> Result<Self, SceneError> {
        Self::parse(name, json).map_err(|problem| SceneError::new(format!("light {name:?}"), problem))
    }

    fn parse(name: &str, json: &str) -> Result<Self, String> {
        fn take<T: DeserializeOwned>(map: &mut Map<String, Value>, key: &str) -> Result<Option<T>, String> {
            let value = map.remove(key);
            value.map(|v| serde_json::from_value(v).map_err(|e| format!("{key}: {e}"))).transpose()
        }
        let mut map: Map<String, Value> = serde_json::from_str(json).map_err(|e| e.to_string())?;
        let rows = take(&mut map, "transform")?.unwrap_or(DMat4::IDENTITY.to_cols_array());
        let seen_by = match ["camera_visible", "camera_only"].map(|key| take(&mut map, key)) {
            [visible, only] => match (visible?.unwrap_or(true), only?.unwrap_or(false)) {
                (true, false) => SeenBy::All,
                (false, false) => SeenBy::AllButCamera,
                (true, true) => SeenBy::CameraAlone,
                (false, true) => return Err("camera_only: nothing would see it, not even the camera".into()),
            },
        };
        let shape: Shape = serde_json::from_value(Value::Object(map)).map_err(|e| e.to_string())?;
        check(&shape)?;
        Ok(Self { name: name.into(), to_world: affine_from_rows(&rows)?, seen_by, shape })
    }

    /// The image the light uses, by its index in the scene.
    pub fn image(&self) -> Option<u32> {
        match self.shape {
            Shape::Rect { image, .. } | Shape::Dome { image, .. } => image,
            _ => None,
        }
    }

    /// The light in the world, with `to_world` in place of the description's own transform (the same,
    /// but for a common origin that was subtracted). A light that cannot emit is dropped with a warning.
    pub fn place(&self, to_world: &DAffine3, warnings: &mut Warnings) -> Result<Option<Light>, SceneError> {
        let object = || format!("light {:?}", self.name);
        let mut warn = |text: &str| warnings.add(object(), text, 1);
        match place(&self.shape, to_world, &mut warn) {
            Ok(kind) => Ok(Some(Light { name: self.name.clone(), seen_by: self.seen_by, kind })),
            Err(Unplaceable::Dark(reason)) => {
                warn(&format!("dropped, it emits nothing: {reason}"));
                Ok(None)
            }
            Err(Unplaceable::Broken(problem)) => Err(SceneError::new(object(), problem)),
        }
    }
}

fn check(shape: &Shape) -> Result<(), String> {
    let size = |what: &str, v: f64| match v >= 0.0 && (v as f32).is_finite() {
        true => Ok(()),
        false => Err(format!("{what} is {v}, it must be finite and not negative")),
    };
    let emission = |what: &str, c: &[f64; 3]| match c.iter().all(|&v| v >= 0.0 && (v as f32).is_finite()) {
        true => Ok(()),
        false => Err(format!("{what} is {c:?}, it must be finite and not negative")),
    };
    match shape {
        Shape::Rect { width, height, radiance, shaping, .. } => {
            size("width", *width)?;
            size("height", *height)?;
            emission("radiance", radiance)?;
            check_shaping(shaping)
        }
        Shape::Disk { radius, radiance, shaping } | Shape::Sphere { radius, radiance, shaping } => {
            size("radius", *radius)?;
            emission("radiance", radiance)?;
            check_shaping(shaping)
        }
        Shape::Cylinder { radius, length, radiance, shaping } => {
            size("radius", *radius)?;
            size("length", *length)?;
            emission("radiance", radiance)?;
            check_shaping(shaping)
        }
        Shape::Point { intensity, shaping } => {
            emission("intensity", intensity)?;
            check_shaping(shaping)
        }
        Shape::Distant { angle, irradiance, radiance } => {
            if !(0.0..=TAU + 1e-6).contains(angle) {
                return Err(format!("angle is {angle}, it must be from 0 to 2 pi"));
            }
            match (irradiance, radiance) {
                (Some(e), None) => emission("irradiance", e),
                (None, Some(_)) if *angle == 0.0 => {
                    Err("radiance needs an angle above 0; give irradiance instead".into())
                }
                (None, Some(l)) => emission("radiance", l),
                _ => Err("exactly one of irradiance and radiance must be given".into()),
            }
        }
        Shape::Dome { radiance, .. } => emission("radiance", radiance),
    }
}

fn check_shaping(shaping: &Option<ShapingJson>) -> Result<(), String> {
    let Some(s) = shaping else { return Ok(()) };
    let lux =
        s.cone_angle.is_some() || s.cone_softness.is_some() || s.focus.is_some() || s.focus_tint.is_some();
    let spot = s.spot_size.is_some() || s.spot_blend.is_some();
    if lux as u8 + spot as u8 + s.spread.is_some() as u8 > 1 {
        return Err("shaping: a cone, a spot and a spread exclude each other".into());
    }
    if spot && s.spot_size.is_none() {
        return Err("shaping: spot_blend without spot_size".into());
    }
    if let Some(blend) = s.spot_blend.filter(|b| *b > 1.0) {
        return Err(format!("shaping: spot_blend is {blend}, it must be from 0 to 1"));
    }
    let tint = s.focus_tint.unwrap_or_default();
    let scalars = [
        ("cone_angle", s.cone_angle),
        ("cone_softness", s.cone_softness),
        ("focus", s.focus),
        ("focus_tint", Some(tint[0])),
        ("focus_tint", Some(tint[1])),
        ("focus_tint", Some(tint[2])),
        ("spot_size", s.spot_size),
        ("spot_blend", s.spot_blend),
        ("spread", s.spread),
    ];
    for (what, value) in scalars {
        if let Some(v) = value
            && !(v >= 0.0 && (v as f32).is_finite())
        {
            return Err(format!("shaping: {what} is {v}, it must be finite and not negative"));
        }
    }
    Ok(())
}
