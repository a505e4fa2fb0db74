//! The camera's data.

use super::SceneError;
use glam::{DAffine3, DMat4};
use serde::Deserialize;

/// How the camera projects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// The window lies on the plane z = -1, rays start at the origin.
    Perspective,
    /// The window is in scene units, rays are parallel to -z.
    Orthographic,
}

/// A camera. Looks along its local -z, local +y is up.
#[derive(Clone, Debug)]
pub struct Camera {
    /// The name, for messages.
    pub name: String,
    /// Perspective or orthographic.
    pub projection: Projection,
    /// Camera to world; no projective part.
    pub to_world: DAffine3,
    /// `x0, x1, y0, y1`: what the full film covers, edge to edge.
    pub window: [f32; 4],
    /// Nearest and farthest depth along the view axis that is seen.
    pub clipping: [f32; 2],
    /// Radius of the thin lens in scene units; 0 is a pinhole.
    pub aperture_radius: f32,
    /// Distance along the view axis to the plane in focus, scene units.
    pub focus_distance: f32,
    /// Number of blades of the aperture; fewer than 3 is a round one.
    pub blades: u32,
    /// Rotation of the aperture, radians.
    pub blade_rotation: f32,
    /// Height over width of the aperture's ellipse, inverted: 2 squeezes the width by half.
    pub aperture_ratio: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Json {
    #[serde(rename = "type")]
    projection: Projection,
    transform: [f64; 16],
    window: Option<[f64; 4]>,
    near: f64,
    far: f64,
    aperture_radius: f64,
    focus_distance: f64,
    blades: u32,
    blade_rotation: f64,
    aperture_ratio: f64,
}

impl Default for Json {
    fn default() -> Self {
        Self {
            projection: Projection::Perspective,
            transform: DMat4::IDENTITY.to_cols_array(),
            window: None,
            near: 0.0,
            far: 1e30,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            blades: 0,
            blade_rotation: 0.0,
            aperture_ratio: 1.0,
        }
    }
}

/// A row-major 4x4 matrix as an affine map; an error text where it is not one.
pub fn affine_from_rows(m: &[f64; 16]) -> Result<DAffine3, String> {
    if m.iter().any(|v| !v.is_finite()) {
        return Err("the transform has a value that is not finite".into());
    }
    if m[12] != 0.0 || m[13] != 0.0 || m[14] != 0.0 || m[15] != 1.0 {
        return Err("the transform's last row is not 0 0 0 1: projective transforms are not supported".into());
    }
    Ok(DAffine3::from_mat4(DMat4::from_cols_array(m).transpose()))
}

impl Camera {
    /// A camera from its JSON description (`docs/abi.md`).
    pub fn from_json(name: &str, json: &str) -> Result<Self, SceneError> {
        let fail = |problem: String| SceneError::new(format!("camera {name:?}"), problem);
        let j: Json = serde_json::from_str(json).map_err(|e| fail(e.to_string()))?;
        let to_world = affine_from_rows(&j.transform).map_err(fail)?;
        if to_world.matrix3.determinant().abs() < 1e-30 {
            return Err(fail("the transform is singular".into()));
        }
        // scale does not belong to a camera: keep its frame (USD and Blender do the same)
        let to_world = DAffine3::from_mat3_translation(
            glam::DMat3::from_cols(
                to_world.matrix3.x_axis.normalize(),
                to_world.matrix3.y_axis.normalize(),
                to_world.matrix3.z_axis.normalize(),
            ),
            to_world.translation,
        );
        let window = j.window.ok_or_else(|| fail("the window is missing".into()))?;
        let [x0, x1, y0, y1] = window;
        if !window.iter().all(|v| v.is_finite() && (*v as f32).is_finite()) || x0 >= x1 || y0 >= y1 {
            return Err(fail(format!("the window {window:?} is empty or not finite")));
        }
        let positive = |what: &str, v: f64| match v > 0.0 && v.is_finite() {
            true => Ok(v as f32),
            false => Err(fail(format!("{what} is {v}, it must be positive and finite"))),
        };
        let behind = j.near < 0.0 && j.projection == Projection::Perspective;
        if behind || j.near.is_nan() || j.far.is_nan() || j.far <= j.near {
            return Err(fail(format!("the clipping range {}..{} is empty", j.near, j.far)));
        }
        if !(j.aperture_radius >= 0.0 && j.aperture_radius.is_finite()) {
            return Err(fail(format!("aperture_radius is {}", j.aperture_radius)));
        }
        if !j.blade_rotation.is_finite() {
            return Err(fail("blade_rotation is not finite".into()));
        }
        Ok(Self {
            name: name.into(),
            projection: j.projection,
            to_world,
            window: window.map(|v| v as f32),
            clipping: [j.near as f32, j.far as f32],
            aperture_radius: j.aperture_radius as f32,
            focus_distance: positive("focus_distance", j.focus_distance)?,
            blades: j.blades,
            blade_rotation: j.blade_rotation as f32,
            aperture_ratio: positive("aperture_ratio", j.aperture_ratio)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_cameras_are_refused_by_name() {
        for (json, what) in [
            ("{}", "window is missing"),
            (r#"{"window":[0,0,-1,1]}"#, "empty"),
            (r#"{"window":[-1,1,-1,1],"focus_distance":0}"#, "focus_distance"),
            (r#"{"window":[-1,1,-1,1],"near":2,"far":1}"#, "clipping"),
            (r#"{"window":[-1,1,-1,1],"lens":35}"#, "lens"),
            (r#"{"window":[-1,1,-1,1],"transform":[1,0,0,0,0,0,0,0,0,0,1,0,0,0,0,1]}"#, "singular"),
            (r#"{"window":[-1,1,-1,1],"transform":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1]}"#, "projective"),
        ] {
            let e = Camera::from_json("cam", json).unwrap_err().to_string();
            assert!(e.contains("camera \"cam\"") && e.contains(what), "{json}: {e}");
        }
    }

    #[test]
    fn scale_is_taken_out_and_translation_kept() {
        let c = Camera::from_json(
            "cam",
            r#"{"window":[-1,1,-1,1],"transform":[2,0,0,5, 0,2,0,6, 0,0,2,7, 0,0,0,1]}"#,
        )
        .unwrap();
        assert_eq!(c.to_world.matrix3, glam::DMat3::IDENTITY);
        assert_eq!(c.to_world.translation, glam::DVec3::new(5.0, 6.0, 7.0));
    }
}
