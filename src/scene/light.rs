//! Lights: their description as the ABI gives it, and their data once placed in the world.

use super::camera::affine_from_rows;
use super::{SceneError, Warnings};
use glam::{DAffine3, DMat3, DMat4, DVec3, Mat3, Vec3};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A light as described, not yet placed: its numbers are checked, its transform is kept in double
/// precision.
#[derive(Clone, Debug)]
pub struct LightSpec {
    /// The name, for messages.
    pub name: String,
    /// Light to world.
    pub to_world: DAffine3,
    /// Whether camera rays see it.
    pub camera_visible: bool,
    shape: Shape,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
enum Shape {
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
struct ShapingJson {
    cone_angle: Option<f64>,
    cone_softness: Option<f64>,
    focus: Option<f64>,
    focus_tint: Option<[f64; 3]>,
    spot_size: Option<f64>,
    spot_blend: Option<f64>,
    spread: Option<f64>,
}

/// How emission falls off with the angle to an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// UsdLux's ShapingAPI.
    Lux {
        /// Angle to the axis beyond which nothing is emitted, radians, in (0, pi].
        cutoff: f32,
        /// Share of `cutoff`, from its end, over which a smoothstep fades emission out.
        softness: f32,
        /// Exponent of the cosine to the axis.
        focus: f32,
        /// Colour towards which the focus fades off the axis.
        focus_tint: Vec3,
    },
    /// Blender's spot: a smoothstep of the cosine.
    Spot {
        /// Half the cone's full angle, radians, in (0, pi/2].
        half_angle: f32,
        /// Share of `1 - cos(half_angle)` over which the edge is blended.
        blend: f32,
    },
    /// Blender's area light spread: the share of light a grid of slats lets through, scaled so that a
    /// flat light keeps its power.
    Spread {
        /// Half the full angle, radians, in (0, pi/2).
        half_angle: f32,
    },
}

/// A profile and the axis it is measured from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaping {
    /// Unit axis, world space, along the light's -z.
    pub axis: Vec3,
    /// Fall-off around it.
    pub profile: Profile,
}

/// A light in world space. Radiance is in W/(m^2 sr) per linear Rec.709 channel.
#[derive(Clone, Debug)]
pub struct Light {
    /// The name, for messages.
    pub name: String,
    /// Whether camera rays see it.
    pub camera_visible: bool,
    /// What emits.
    pub kind: LightKind,
}

/// What emits, in world space.
#[derive(Clone, Debug)]
pub enum LightKind {
    /// A parallelogram that emits from one side.
    Rect {
        /// Its middle.
        center: Vec3,
        /// The whole edge along the light's +x.
        edge_x: Vec3,
        /// The whole edge along the light's +y.
        edge_y: Vec3,
        /// Unit normal of the side that emits.
        normal: Vec3,
        /// Emitted radiance.
        radiance: Vec3,
        /// Image that multiplies `radiance`: the top left at (+x, +y), as seen upright by who looks at
        /// the emitting side (UsdLux).
        image: Option<u32>,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// An ellipse that emits from one side.
    Disk {
        /// Its middle.
        center: Vec3,
        /// Major and minor semi-axes, orthogonal to each other.
        axes: [Vec3; 2],
        /// Unit normal of the side that emits.
        normal: Vec3,
        /// Emitted radiance.
        radiance: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// A sphere that emits outwards.
    Sphere {
        /// Its middle.
        center: Vec3,
        /// Its radius.
        radius: f32,
        /// Emitted radiance.
        radiance: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// A cylinder without caps that emits outwards.
    Cylinder {
        /// Its middle.
        center: Vec3,
        /// From one end of its axis to the other.
        axis: Vec3,
        /// Its radius.
        radius: f32,
        /// Emitted radiance.
        radiance: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// A point without size.
    Point {
        /// Where it is.
        position: Vec3,
        /// Emitted intensity, W/sr.
        intensity: Vec3,
        /// Directional fall-off.
        shaping: Option<Shaping>,
    },
    /// Light from a cone of directions, the same everywhere.
    Distant {
        /// Unit vector along which the light travels.
        direction: Vec3,
        /// Half angle of the cone, radians, in [0, pi]; 0 is a single direction.
        half_angle: f64,
        /// Irradiance of a surface that faces the light.
        irradiance: Vec3,
    },
    /// Light from all around.
    Dome {
        /// Rotation, or rotation and mirror, from the light to the world.
        to_world: Mat3,
        /// Emitted radiance.
        radiance: Vec3,
        /// Lat-long image that multiplies `radiance`.
        image: Option<u32>,
    },
}

/// Half angles below this cannot be resolved by directions in single precision: such a distant light
/// shines from a single direction.
const SMALLEST_HALF_ANGLE: f64 = 2e-7;
/// Narrowest spread; below it a flat light would have to be a laser.
const SMALLEST_SPREAD: f64 = 2e-3;

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
        let camera_visible = take(&mut map, "camera_visible")?.unwrap_or(true);
        let shape: Shape = serde_json::from_value(Value::Object(map)).map_err(|e| e.to_string())?;
        check(&shape)?;
        Ok(Self { name: name.into(), to_world: affine_from_rows(&rows)?, camera_visible, shape })
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
            Ok(kind) => {
                Ok(Some(Light { name: self.name.clone(), camera_visible: self.camera_visible, kind }))
            }
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

/// Why a light is not in the scene.
enum Unplaceable {
    Dark(&'static str),
    Broken(String),
}

/// Smallest and largest surface in square scene units that single precision carries safely.
const AREAS: std::ops::Range<f64> = 1e-34..1e34;

fn place(shape: &Shape, m: &DAffine3, warn: &mut dyn FnMut(&str)) -> Result<LightKind, Unplaceable> {
    let finite = |v: DVec3| {
        let v = v.as_vec3();
        match v.is_finite() {
            true => Ok(v),
            false => Err(Unplaceable::Broken("its place or size does not fit single precision".into())),
        }
    };
    let colour = |c: &[f64; 3]| {
        let c = DVec3::from_array(*c).as_vec3();
        match c.max_element() > 0.0 {
            true => Ok(c),
            false => Err(Unplaceable::Dark("its colour is black")),
        }
    };
    let area = |a: f64| match a {
        a if a >= AREAS.end => {
            Err(Unplaceable::Broken(format!("its area is {a}, too large to compute with")))
        }
        a if a < AREAS.start => Err(Unplaceable::Dark("its area is zero")),
        _ => Ok(()),
    };
    if !m.is_finite() {
        return Err(Unplaceable::Broken("the transform has a value that is not finite".into()));
    }
    let (x, y, z) = (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis);
    let forward = (-z).normalize_or(DVec3::NEG_Z);
    // -z seen through a transform that may mirror or shear: the emitting side of the local xy plane
    let facing = || {
        let side = if m.matrix3.determinant() < 0.0 { 1.0 } else { -1.0 };
        x.cross(y).normalize_or(DVec3::NEG_Z) * side
    };
    let uniform = is_uniform(&m.matrix3);
    Ok(match shape {
        Shape::Rect { width, height, radiance, image, shaping } => {
            let (edge_x, edge_y) = (x * *width, y * *height);
            area(edge_x.cross(edge_y).length())?;
            LightKind::Rect {
                center: finite(m.translation)?,
                edge_x: finite(edge_x)?,
                edge_y: finite(edge_y)?,
                normal: finite(facing())?,
                radiance: colour(radiance)?,
                image: *image,
                shaping: place_shaping(shaping, facing(), warn)?,
            }
        }
        Shape::Disk { radius, radiance, shaping } => {
            let [a, b] = principal_axes(x * *radius, y * *radius);
            area(PI * a.cross(b).length())?;
            LightKind::Disk {
                center: finite(m.translation)?,
                axes: [finite(a)?, finite(b)?],
                normal: finite(facing())?,
                radiance: colour(radiance)?,
                shaping: place_shaping(shaping, facing(), warn)?,
            }
        }
        Shape::Sphere { radius, radiance, shaping } => {
            if !uniform {
                warn("a sphere light under a non-uniform scale is taken as a sphere of the mean scale");
            }
            let radius = radius * (x.length() + y.length() + z.length()) / 3.0;
            area(4.0 * PI * radius * radius)?;
            LightKind::Sphere {
                center: finite(m.translation)?,
                radius: radius as f32,
                radiance: colour(radiance)?,
                shaping: place_shaping(shaping, forward, warn)?,
            }
        }
        Shape::Cylinder { radius, length, radiance, shaping } => {
            let axis = x * *length;
            let round = (y.length() - z.length()).abs() <= 1e-4 * y.length().max(z.length());
            let right = |a: DVec3, b: DVec3| a.dot(b).abs() <= 1e-4 * a.length() * b.length();
            if !(round && right(x, y) && right(y, z) && right(z, x)) {
                warn(
                    "a cylinder light under a shear or an uneven scale is taken as round, of the mean scale",
                );
            }
            let radius = radius * (y.length() + z.length()) / 2.0;
            area(TAU * radius * axis.length())?;
            area(radius * radius)?;
            LightKind::Cylinder {
                center: finite(m.translation)?,
                axis: finite(axis)?,
                radius: radius as f32,
                radiance: colour(radiance)?,
                shaping: place_shaping(shaping, forward, warn)?,
            }
        }
        Shape::Point { intensity, shaping } => {
            if !uniform && shaping.is_some() {
                warn("a non-uniform scale does not stretch the cone of a point light");
            }
            LightKind::Point {
                position: finite(m.translation)?,
                intensity: colour(intensity)?,
                shaping: place_shaping(shaping, forward, warn)?,
            }
        }
        Shape::Distant { angle, irradiance, radiance } => {
            let half_angle = (angle / 2.0).min(PI);
            // irradiance of a uniform cone: pi L sin^2; all of the hemisphere beyond a right angle
            let facing_share = half_angle.min(FRAC_PI_2).sin().powi(2);
            let irradiance = match (irradiance, radiance) {
                (Some(e), _) => *e,
                (None, l) => l.unwrap_or_default().map(|v| v * PI * facing_share),
            };
            LightKind::Distant {
                direction: finite(forward)?,
                half_angle: if half_angle < SMALLEST_HALF_ANGLE { 0.0 } else { half_angle },
                irradiance: colour(&irradiance)?,
            }
        }
        Shape::Dome { radiance, image, portal } => {
            if portal.is_some() {
                warn("the portal of a dome light is ignored: domes are sampled by their image");
            }
            let rotation = orthonormal(&m.matrix3)
                .ok_or_else(|| Unplaceable::Broken("the transform of a dome is singular".into()))?;
            if !uniform {
                warn("only the rotation of a dome light's transform is used");
            }
            LightKind::Dome { to_world: rotation.as_mat3(), radiance: colour(radiance)?, image: *image }
        }
    })
}

fn place_shaping(
    shaping: &Option<ShapingJson>,
    axis: DVec3,
    warn: &mut dyn FnMut(&str),
) -> Result<Option<Shaping>, Unplaceable> {
    let Some(s) = shaping else { return Ok(None) };
    let profile = if let Some(size) = s.spot_size {
        let half_angle = (size / 2.0).min(FRAC_PI_2) as f32;
        Profile::Spot { half_angle, blend: s.spot_blend.unwrap_or(0.0).min(1.0) as f32 }
    } else if let Some(spread) = s.spread {
        // a spread of half a turn blocks nothing
        if spread >= PI * (1.0 - 1e-6) {
            return Ok(None);
        }
        if spread < SMALLEST_SPREAD {
            warn("a spread below 0.002 radians was widened to that");
        }
        Profile::Spread { half_angle: (spread.max(SMALLEST_SPREAD) / 2.0) as f32 }
    } else {
        Profile::Lux {
            cutoff: s.cone_angle.unwrap_or(FRAC_PI_2).min(PI) as f32,
            softness: s.cone_softness.unwrap_or(0.0) as f32,
            focus: s.focus.unwrap_or(0.0) as f32,
            focus_tint: DVec3::from_array(s.focus_tint.unwrap_or_default()).as_vec3(),
        }
    };
    match profile {
        Profile::Lux { cutoff: angle, .. } | Profile::Spot { half_angle: angle, .. } if angle < 1e-6 => {
            Err(Unplaceable::Dark("its cone is closed"))
        }
        _ => Ok(Some(Shaping { axis: axis.as_vec3(), profile })),
    }
}

/// Whether a map is a rotation or mirror times one scale.
fn is_uniform(m: &DMat3) -> bool {
    let gram = m.transpose() * *m;
    let mean = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    (gram - DMat3::IDENTITY * mean).to_cols_array().iter().all(|v| v.abs() <= 1e-4 * mean)
}

/// The rotation (or rotation and mirror) of a map, by Gram-Schmidt from its y axis. `None` where it is
/// singular.
fn orthonormal(m: &DMat3) -> Option<DMat3> {
    let y = m.y_axis.try_normalize()?;
    let z = (m.z_axis - y * y.dot(m.z_axis)).try_normalize()?;
    let x = y.cross(z);
    let side = x.dot(m.x_axis);
    (side != 0.0).then(|| DMat3::from_cols(x * side.signum(), y, z))
}

/// Semi-axes of the ellipse `a cos t + b sin t` from two conjugate radii (Rytz).
fn principal_axes(a: DVec3, b: DVec3) -> [DVec3; 2] {
    let t = 0.5 * (2.0 * a.dot(b)).atan2(a.length_squared() - b.length_squared());
    let (sin, cos) = t.sin_cos();
    [a * cos + b * sin, b * cos - a * sin]
}
