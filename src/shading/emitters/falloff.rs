//! Directional fall-off of emission around an axis, and its importance sampling.

use crate::math::{Frame, warp};
use crate::scene::light::{Profile, Shaping};
use glam::{Vec2, Vec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A [`Shaping`] made ready for evaluation.
#[derive(Clone, Debug)]
pub(super) struct Falloff {
    frame: Frame,
    curve: Curve,
    /// Angle to the axis beyond which nothing is emitted, radians.
    cutoff: f64,
    /// Exponent of the cosine that sampling follows.
    power: f64,
}

#[derive(Clone, Debug)]
enum Curve {
    Lux { cutoff: f64, start: f64, focus: f64, tint: Vec3 },
    Spot { one_minus_cos: f64, width: f64 },
    Spread { tan: f64, scale: f64 },
}

impl Falloff {
    pub fn new(shaping: &Shaping) -> Self {
        let (curve, cutoff, power) = match shaping.profile {
            Profile::Lux { cutoff, softness, focus, focus_tint } => {
                let (cutoff, focus) = (cutoff as f64, focus as f64);
                // without a tint nothing leaves at right angles to a focused light
                let dark = focus_tint == Vec3::ZERO && focus > 0.0;
                let curve =
                    Curve::Lux { cutoff, start: cutoff * (1.0 - softness as f64), focus, tint: focus_tint };
                match dark {
                    true => (curve, cutoff.min(FRAC_PI_2), focus),
                    false => (curve, cutoff, 0.0),
                }
            }
            Profile::Spot { half_angle, blend } => {
                let one_minus_cos = one_minus_cos(half_angle as f64);
                let width = one_minus_cos * blend as f64;
                (Curve::Spot { one_minus_cos, width }, half_angle as f64, 0.0)
            }
            Profile::Spread { half_angle } => {
                let a = half_angle as f64;
                // tan a - a, by its series where the difference would cancel
                let rest = if a > 0.05 { a.tan() - a } else { a.powi(3) / 3.0 * (1.0 + 0.4 * a * a) };
                (Curve::Spread { tan: a.tan(), scale: 1.0 / rest }, a, 0.0)
            }
        };
        Self { frame: Frame::from_normal(shaping.axis), curve, cutoff, power }
    }

    /// Unit axis of the fall-off.
    pub fn axis(&self) -> Vec3 {
        self.frame.n
    }

    /// Angle to the axis beyond which nothing is emitted, radians.
    pub fn cutoff(&self) -> f64 {
        self.cutoff
    }

    /// Factor of the radiance emitted along the unit vector `direction`.
    pub fn factor(&self, direction: Vec3) -> Vec3 {
        let local = self.frame.to_local(direction);
        self.factor_at((local.x as f64).hypot(local.y as f64), local.z as f64)
    }

    fn factor_at(&self, sin: f64, cos: f64) -> Vec3 {
        match self.curve {
            // UsdLux ShapingAPI: L (1 - smoothstep(angle, start, cutoff)) lerp(cos^focus, tint, 1)
            Curve::Lux { cutoff, start, focus, tint } => {
                let angle = sin.atan2(cos);
                if angle > cutoff {
                    return Vec3::ZERO;
                }
                let edge =
                    if angle > start { 1.0 - smoothstep((angle - start) / (cutoff - start)) } else { 1.0 };
                let focused = if focus > 0.0 { cos.max(0.0).powf(focus) } else { 1.0 } as f32;
                (tint * (1.0 - focused) + focused) * edge as f32
            }
            Curve::Spot { one_minus_cos, width } => {
                // sin^2 / (1 + cos) is 1 - cos without its cancellation
                let inside = one_minus_cos - if cos > 0.0 { sin * sin / (1.0 + cos) } else { 1.0 - cos };
                match inside {
                    i if i < 0.0 => Vec3::ZERO,
                    i if i < width => Vec3::splat(smoothstep(i / width) as f32),
                    _ => Vec3::ONE,
                }
            }
            Curve::Spread { tan, scale } => {
                if cos <= 0.0 {
                    return Vec3::ZERO;
                }
                Vec3::splat(((tan - sin / cos).max(0.0) * scale) as f32)
            }
        }
    }

    /// Direction for an emitter that shines alike to all sides, and its density per solid angle.
    pub fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let (sin, cos) = if self.power > 0.0 || self.cutoff <= FRAC_PI_2 {
            cosine_power(u.x as f64, self.power + 1.0, self.cutoff)
        } else {
            let h = u.x as f64 * one_minus_cos(self.cutoff);
            ((h * (2.0 - h)).max(0.0).sqrt(), 1.0 - h)
        };
        (self.frame.to_world(around(u.y, sin, cos)), self.density(cos))
    }

    /// Density of [`Falloff::sample`] per solid angle; zero beyond the cutoff.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let local = self.frame.to_local(direction);
        let angle = (local.x as f64).hypot(local.y as f64).atan2(local.z as f64);
        if angle > self.cutoff { 0.0 } else { self.density(local.z as f64) }
    }

    fn density(&self, cos: f64) -> f32 {
        let d = if self.power > 0.0 || self.cutoff <= FRAC_PI_2 {
            cosine_power_density(cos, self.power, self.power + 1.0, self.cutoff)
        } else {
            1.0 / (TAU * one_minus_cos(self.cutoff))
        };
        d as f32
    }

    /// Direction for a flat emitter whose normal is the axis, and its density per projected solid angle.
    pub fn sample_flat(&self, u: Vec2) -> (Vec3, f32) {
        let cutoff = self.cutoff.min(FRAC_PI_2);
        let (sin, cos) = cosine_power(u.x as f64, self.power + 2.0, cutoff);
        let pdf = cosine_power_density(cos, self.power, self.power + 2.0, cutoff);
        (self.frame.to_world(around(u.y, sin, cos)), pdf as f32)
    }

    /// Density of [`Falloff::sample_flat`] per projected solid angle.
    pub fn pdf_flat(&self, direction: Vec3) -> f32 {
        let local = self.frame.to_local(direction);
        let angle = (local.x as f64).hypot(local.y as f64).atan2(local.z as f64);
        let cutoff = self.cutoff.min(FRAC_PI_2);
        match angle > cutoff {
            true => 0.0,
            false => cosine_power_density(local.z as f64, self.power, self.power + 2.0, cutoff) as f32,
        }
    }

    /// The numbers from which [`Falloff::sample`] draws a direction.
    pub fn square_of(&self, direction: Vec3) -> Vec2 {
        if self.power > 0.0 || self.cutoff <= FRAC_PI_2 {
            return self.square_of_power(direction, self.power + 1.0, self.cutoff);
        }
        let local = self.frame.to_local(direction);
        warp::square_of_cone(local, one_minus_cos(self.cutoff) as f32)
    }

    /// The numbers from which [`Falloff::sample_flat`] draws a direction.
    pub fn square_of_flat(&self, direction: Vec3) -> Vec2 {
        self.square_of_power(direction, self.power + 2.0, self.cutoff.min(FRAC_PI_2))
    }

    fn square_of_power(&self, direction: Vec3, k: f64, cutoff: f64) -> Vec2 {
        let local = self.frame.to_local(direction);
        let sin2 = (local.x as f64).powi(2) + (local.y as f64).powi(2);
        // 1 - cos^k, from the sine where that is exact
        let within = if local.z > 0.0 { -(0.5 * k * (-sin2).ln_1p()).exp_m1() } else { 1.0 };
        let u = (within / covered(k, cutoff)) as f32;
        warp::in_unit_square(Vec2::new(u, warp::turn_of(local.x, local.y)))
    }

    /// Integral of the factor over all solid angles, sr.
    pub fn integral(&self) -> Vec3 {
        self.integrate(self.cutoff, |_| 1.0)
    }

    /// Integral of the factor over projected solid angle, for a flat emitter; pi without a fall-off.
    pub fn integral_flat(&self) -> Vec3 {
        self.integrate(self.cutoff.min(FRAC_PI_2), |cos| cos)
    }

    /// Integral over solid angle of the factor times the sine to `axis`: what a cylinder shows.
    pub fn integral_over_cylinder(&self, axis: Vec3) -> Vec3 {
        const AROUND: u32 = 64;
        let local = self.frame.to_local(axis).as_dvec3();
        self.integrate(self.cutoff, |cos| {
            let sin = (1.0 - cos * cos).max(0.0).sqrt();
            let sine = |i: u32| {
                let (s, c) = (TAU * i as f64 / AROUND as f64).sin_cos();
                glam::DVec3::new(sin * c, sin * s, cos).cross(local).length()
            };
            (0..AROUND).map(sine).sum::<f64>() / AROUND as f64
        })
    }

    /// Largest factor of any direction.
    pub fn peak(&self) -> f32 {
        let tint = match self.curve {
            Curve::Lux { focus, tint, .. } if focus > 0.0 => tint.max_element(),
            _ => 0.0,
        };
        self.factor_at(0.0, 1.0).max_element().max(tint)
    }

    fn integrate(&self, cutoff: f64, weight: impl Fn(f64) -> f64) -> Vec3 {
        const STEPS: u32 = 1024;
        let step = cutoff / STEPS as f64;
        let mut sum = glam::DVec3::ZERO;
        for i in 0..STEPS {
            let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
            sum += self.factor_at(sin, cos).as_dvec3() * (sin * weight(cos));
        }
        (sum * (TAU * step)).as_vec3()
    }
}

fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// `1 - cos(angle)` without cancellation.
pub(super) fn one_minus_cos(angle: f64) -> f64 {
    2.0 * (angle / 2.0).sin().powi(2)
}

fn around(u: f32, sin: f64, cos: f64) -> Vec3 {
    let (s, c) = (TAU * u as f64).sin_cos();
    Vec3::new((sin * c) as f32, (sin * s) as f32, cos as f32)
}

/// `1 - cos(cutoff)^k`, without cancellation.
fn covered(k: f64, cutoff: f64) -> f64 {
    // 1 - cos = 2 sin^2(a/2), so ln cos = ln1p(-2 sin^2(a/2)); a right angle gives -inf and 1
    match cutoff >= FRAC_PI_2 {
        true => 1.0,
        false => -(k * (-one_minus_cos(cutoff)).ln_1p()).exp_m1(),
    }
}

/// Sine and cosine of an angle below `cutoff` (at most a right one) such that `cos^k` is uniform.
fn cosine_power(u: f64, k: f64, cutoff: f64) -> (f64, f64) {
    let ln_cos = (-u * covered(k, cutoff)).ln_1p() / k;
    let sin = (-(2.0 * ln_cos).exp_m1()).max(0.0).sqrt();
    (sin, ln_cos.exp())
}

/// Density, proportional to `cos^power`, in the measure in which `cos^k` is uniform.
fn cosine_power_density(cos: f64, power: f64, k: f64, cutoff: f64) -> f64 {
    let lobe = if power > 0.0 { cos.max(0.0).powf(power) } else { 1.0 };
    k / (2.0 * PI * covered(k, cutoff)) * lobe
}
