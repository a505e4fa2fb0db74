//! From descriptions to lights in world space.

use super::description::{Shape, ShapingJson};
use super::{LightKind, Profile, Shaping};
use glam::{DAffine3, DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Half angles below this cannot be resolved by directions in single precision: such a distant light
/// shines from a single direction.
const SMALLEST_HALF_ANGLE: f64 = 2e-7;
/// Narrowest spread; below it a flat light would have to be a laser.
const SMALLEST_SPREAD: f64 = 2e-3;

/// Why a light is not in the scene.
pub(super) enum Unplaceable {
    /// It cannot emit: dropped.
    Dark(&'static str),
    /// It makes no sense: an error.
    Broken(String),
}

/// Smallest and largest surface in square scene units that single precision carries safely.
const AREAS: std::ops::Range<f64> = 1e-34..1e34;

pub(super) fn place(
    shape: &Shape,
    m: &DAffine3,
    warn: &mut dyn FnMut(&str),
) -> Result<LightKind, Unplaceable> {
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
        let half_angle = (size / 2.0).min(PI) as f32;
        Profile::Spot { half_angle, blend: s.spot_blend.unwrap_or(0.0) as f32 }
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
