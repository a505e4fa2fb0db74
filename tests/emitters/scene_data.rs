//! Descriptions of lights: what is refused, what is repaired, what is dropped.

use super::support::*;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use segue::scene::light::{LightKind, LightSpec};
use segue::scene::{Light, SeenBy, Warnings};

fn place(json: &str) -> (Option<Light>, Vec<String>) {
    let spec = LightSpec::from_json("lamp", json).unwrap();
    let mut warnings = Warnings::default();
    let light = spec.place(&spec.to_world, &mut warnings).unwrap();
    (light, warnings.lines())
}

#[test]
fn bad_descriptions_are_refused_by_name() {
    for (json, what) in [
        ("[1]", "map"),
        ("{}", "type"),
        (r#"{"type":"laser"}"#, "laser"),
        (r#"{"type":"rect"}"#, "radiance"),
        (r#"{"type":"rect","radiance":[1,1,1],"radius":2}"#, "radius"),
        (r#"{"type":"rect","radiance":[1,1,1],"width":-1}"#, "width"),
        (r#"{"type":"rect","radiance":[1,1,1],"width":"x"}"#, "string"),
        (r#"{"type":"disk","radiance":[1,-1,1]}"#, "radiance"),
        (r#"{"type":"disk","radiance":[1,1e300,1]}"#, "radiance"),
        (r#"{"type":"sphere","radiance":[1,1]}"#, "length"),
        (r#"{"type":"sphere","radiance":[1,1,1],"transform":[1,2]}"#, "transform"),
        (r#"{"type":"sphere","radiance":[1,1,1],"camera_visible":3}"#, "camera_visible"),
        (r#"{"type":"dome","radiance":[1,1,1],"camera_visible":false,"camera_only":true}"#, "camera_only"),
        (
            r#"{"type":"sphere","radiance":[1,1,1],"transform":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1]}"#,
            "projective",
        ),
        (r#"{"type":"point","radiance":[1,1,1]}"#, "radiance"),
        (r#"{"type":"point","intensity":[1,1,1],"shaping":{"cone":1}}"#, "cone"),
        (r#"{"type":"point","intensity":[1,1,1],"shaping":{"cone_angle":1,"spread":1}}"#, "exclude"),
        (r#"{"type":"point","intensity":[1,1,1],"shaping":{"spot_blend":1}}"#, "spot_size"),
        (r#"{"type":"point","intensity":[1,1,1],"shaping":{"spot_size":1,"spot_blend":2}}"#, "spot_blend"),
        (r#"{"type":"point","intensity":[1,1,1],"shaping":{"cone_angle":-1}}"#, "cone_angle"),
        (r#"{"type":"point","intensity":[1,1,1],"shaping":{"focus":-1}}"#, "focus"),
        (r#"{"type":"distant"}"#, "exactly one"),
        (r#"{"type":"distant","radiance":[1,1,1]}"#, "angle"),
        (r#"{"type":"distant","irradiance":[1,1,1],"radiance":[1,1,1],"angle":1}"#, "exactly one"),
        (r#"{"type":"distant","irradiance":[1,1,1],"angle":7}"#, "angle"),
        (r#"{"type":"dome","radiance":[1,1,1],"shaping":{}}"#, "shaping"),
    ] {
        let e = LightSpec::from_json("lamp", json).unwrap_err().to_string();
        assert!(e.contains("light \"lamp\"") && e.contains(what), "{json}: {e}");
    }
}

#[test]
fn lights_that_cannot_emit_are_dropped_with_a_warning() {
    for json in [
        r#"{"type":"rect","radiance":[0,0,0]}"#,
        r#"{"type":"rect","radiance":[1,1,1],"width":0}"#,
        r#"{"type":"disk","radiance":[1,1,1],"radius":0}"#,
        r#"{"type":"sphere","radiance":[1,1,1],"radius":1e-30}"#,
        r#"{"type":"cylinder","radiance":[1,1,1],"length":0}"#,
        r#"{"type":"sphere","radiance":[1,1,1],"transform":[0,0,0,0, 0,0,0,0, 0,0,0,0, 0,0,0,1]}"#,
        r#"{"type":"point","intensity":[1,1,1],"shaping":{"cone_angle":0}}"#,
        r#"{"type":"distant","irradiance":[0,0,0]}"#,
        r#"{"type":"dome","radiance":[0,0,0]}"#,
    ] {
        let (light, warnings) = place(json);
        assert!(light.is_none() && warnings.len() == 1, "{json}: {warnings:?}");
        assert!(warnings[0].contains("lamp") && warnings[0].contains("emits nothing"), "{warnings:?}");
    }
}

#[test]
fn what_does_not_fit_is_an_error_when_placed() {
    for json in [
        r#"{"type":"rect","radiance":[1,1,1],"width":1e20,"height":1e20}"#,
        r#"{"type":"point","intensity":[1,1,1],"transform":[1,0,0,1e300, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"#,
        r#"{"type":"dome","radiance":[1,1,1],"transform":[0,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"#,
    ] {
        let spec = LightSpec::from_json("lamp", json).unwrap();
        let e = spec.place(&spec.to_world, &mut Warnings::default()).unwrap_err().to_string();
        assert!(e.contains("light \"lamp\""), "{e}");
    }
    let spec = LightSpec::from_json("lamp", r#"{"type":"sphere","radiance":[1,1,1]}"#).unwrap();
    let broken = DAffine3::from_translation(DVec3::NAN);
    assert!(spec.place(&broken, &mut Warnings::default()).is_err());
}

#[test]
fn what_is_approximated_is_said() {
    let uneven = rows(&DAffine3::from_mat3(DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0))));
    for (shape, radius) in [("sphere", 1.0), ("cylinder", 1.25)] {
        let (light, warnings) =
            place(&format!(r#"{{"type":"{shape}","radiance":[1,1,1],"transform":{uneven}}}"#));
        let r = match light.unwrap().kind {
            LightKind::Sphere { radius, .. } | LightKind::Cylinder { radius, .. } => radius,
            other => panic!("{other:?}"),
        };
        assert!((r - radius).abs() < 1e-6 && warnings.len() == 1, "{shape} {r}: {warnings:?}");
    }
    // shapes that take any affine map say nothing
    for shape in ["rect", "disk"] {
        let (_, warnings) =
            place(&format!(r#"{{"type":"{shape}","radiance":[1,1,1],"transform":{uneven}}}"#));
        assert!(warnings.is_empty());
    }
}

#[test]
fn the_placed_light_is_where_the_transform_says() {
    let spec = LightSpec::from_json(
        "lamp",
        r#"{"type":"rect","width":4,"radiance":[1,2,3],"camera_visible":false,"image":7,
            "transform":[0,0,1,1e9, 0,1,0,2, -1,0,0,3, 0,0,0,1]}"#,
    )
    .unwrap();
    assert_eq!((spec.image(), spec.seen_by), (Some(7), SeenBy::AllButCamera));
    // a common origin is subtracted before single precision
    let relative = DAffine3::from_translation(-DVec3::new(1e9, 0.0, 0.0)) * spec.to_world;
    let light = spec.place(&relative, &mut Warnings::default()).unwrap().unwrap();
    let LightKind::Rect { center, edge_x, edge_y, normal, radiance, .. } = light.kind else { panic!() };
    assert_eq!((center, edge_x, edge_y), (Vec3::new(0.0, 2.0, 3.0), Vec3::new(0.0, 0.0, -4.0), Vec3::Y));
    assert_eq!((normal, radiance), (Vec3::NEG_X, Vec3::new(1.0, 2.0, 3.0)));
}

#[test]
fn ellipses_have_orthogonal_axes_and_the_right_area() {
    let m = DMat3::from_cols(DVec3::new(1.0, 0.5, 0.0), DVec3::new(0.8, 1.0, 0.3), DVec3::Z);
    let json = format!(
        r#"{{"type":"disk","radius":1,"radiance":[1,1,1],"transform":{}}}"#,
        rows(&DAffine3::from_mat3(m))
    );
    let LightKind::Disk { axes: [a, b], normal, .. } = place(&json).0.unwrap().kind else { panic!() };
    assert!(a.dot(b).abs() < 1e-5 && a.dot(normal).abs() < 1e-5);
    let area = m.x_axis.cross(m.y_axis).length() as f32;
    assert!((a.length() * b.length() / area - 1.0).abs() < 1e-5);
    // the given radii lie on it
    for p in [m.x_axis.as_vec3(), m.y_axis.as_vec3()] {
        let (s, t) = (p.dot(a) / a.length_squared(), p.dot(b) / b.length_squared());
        assert!((s * s + t * t - 1.0).abs() < 1e-5);
    }
    assert!(normal.z < 0.0);
}
