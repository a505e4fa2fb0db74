//! Shared by the emitter tests: scenes of one light, statistics, quadrature.

use glam::{DAffine3, DVec3, Vec2, Vec3};
use segue::math::sampler::hash_unit;
use segue::scene::image::{Encoding, Pixels};
use segue::scene::{Image, Light, LightSpec, Warnings};
use segue::shading::emitters::{EmitterId, Emitters, MeshTriangle, Receiver, SceneBounds};
use std::sync::Arc;

/// The first emitter of a scene.
pub const FIRST: EmitterId = EmitterId(0);

/// A sphere around the test scenes.
pub const BOUNDS: SceneBounds = SceneBounds { center: Vec3::new(0.1, -0.2, 0.3), radius: 3.0 };

pub fn light(json: &str) -> Light {
    let spec = LightSpec::from_json("test", json).unwrap();
    spec.place(&spec.to_world, &mut Warnings::default()).unwrap().expect("the light emits")
}

pub fn emitters_of(lights: &[&str], triangles: &[MeshTriangle], images: &[Arc<Image>]) -> Emitters {
    let lights: Vec<Light> = lights.iter().map(|json| light(json)).collect();
    Emitters::build(&lights, triangles, images, BOUNDS, &mut Warnings::default()).unwrap()
}

pub fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> Arc<Image> {
    let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels = all.flat_map(|(x, y)| texel(x, y)).collect();
    let mut warnings = Warnings::default();
    Arc::new(
        Image::new("map", (width, height, 3), Pixels::F32(pixels), Encoding::Linear, &mut warnings).unwrap(),
    )
}

/// A light-to-world transform as JSON numbers: local -z along `forward`, moved to `at`, scaled.
pub fn transform(at: [f64; 3], forward: [f64; 3], scale: [f64; 3]) -> String {
    let z = -DVec3::from_array(forward).normalize();
    let x = (if z.x.abs() > 0.9 { DVec3::Y } else { DVec3::X }).reject_from(z).normalize();
    let m = glam::DMat3::from_cols(x * scale[0], z.cross(x) * scale[1], z * scale[2]);
    rows(&DAffine3::from_mat3_translation(m, DVec3::from_array(at)))
}

pub fn rows(m: &DAffine3) -> String {
    let t = glam::DMat4::from(*m).transpose().to_cols_array();
    format!("{t:?}")
}

pub fn receiver(position: [f32; 3], normal: [f32; 3]) -> Receiver {
    Receiver { position: Vec3::from_array(position), normal: Some(Vec3::from_array(normal).normalize()) }
}

/// Independent uniform pairs.
pub fn pair(i: u32, dimension: u32) -> Vec2 {
    Vec2::new(hash_unit(i, 2 * dimension + 1000), hash_unit(i, 2 * dimension + 1001))
}

/// Mean and standard error of a sample of `n` values.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

impl Estimate {
    pub fn new(n: u32, mut value: impl FnMut(u32) -> f64) -> Self {
        let (mut mean, mut m2) = (0.0, 0.0);
        for i in 0..n {
            let v = value(i);
            assert!(v.is_finite(), "sample {i} is {v}");
            let d = v - mean;
            mean += d / (i + 1) as f64;
            m2 += d * (v - mean);
        }
        Self { mean, error: (m2 / (n as f64 - 1.0) / n as f64).sqrt() }
    }

    /// Fails where the mean is further from `expected` than chance allows. `exact` is the relative error
    /// of `expected` itself and of single precision.
    pub fn assert_is(&self, expected: f64, exact: f64, what: &str) {
        let allowed = 4.5 * self.error + exact * expected.abs();
        let off = self.mean - expected;
        assert!(
            off.abs() <= allowed,
            "{what}: {} +- {} instead of {expected} ({:+.2} %)",
            self.mean,
            self.error,
            100.0 * off / expected
        );
    }

    /// Fails where two estimates differ more than chance allows.
    pub fn assert_agrees(&self, other: Estimate, exact: f64, what: &str) {
        Estimate { error: self.error.hypot(other.error), ..*self }.assert_is(other.mean, exact, what);
    }
}
