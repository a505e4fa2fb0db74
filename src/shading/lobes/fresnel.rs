//! Fresnel terms: how much an interface reflects, by the cosine to its normal.

use glam::Vec3;
use std::sync::LazyLock;

/// Reflectance at normal incidence of an interface of relative refractive index `eta`.
#[inline]
pub fn f0_from_ior(eta: f32) -> f32 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// Exact unpolarised reflectance of a dielectric interface. `cos`: absolute cosine on the side come
/// from; `eta`: refractive index of the far side over that of the near side.
///
/// Returns the reflectance and the cosine on the far side; `(1, 0)` on total internal reflection.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> (f32, f32) {
    let c = cos.min(1.0);
    // 1 - (1 - c^2) / eta^2, without cancellation for eta near one
    let cos2_t = (c * c + (eta - 1.0) * (eta + 1.0)) / (eta * eta);
    if cos2_t <= 0.0 {
        return (1.0, 0.0);
    }
    let t = cos2_t.sqrt();
    (reflectance(c, t, eta), t)
}

/// The same from both absolute cosines: `c` on the side come from, `t` on the far side. Exact also where
/// computing `t` from `c` would cancel, near total reflection.
#[inline]
pub fn reflectance(c: f32, t: f32, eta: f32) -> f32 {
    let s = (c - eta * t) / (c + eta * t);
    let p = (eta * c - t) / (eta * c + t);
    0.5 * (s * s + p * p)
}

/// Average over the hemisphere, `2 integral F(mu) mu dmu`, of the dielectric reflectance for `eta >= 1`. Every shaded
/// surface asks for it, so it is read from a table, to 5e-6.
pub fn dielectric_average(eta: f32) -> f32 {
    const NODES: usize = 2048;
    // divided by z = (eta - 1) / (eta + 1), by which the nodes are evenly spaced; the last one is that of infinity
    static TABLE: LazyLock<[f32; NODES + 1]> = LazyLock::new(|| {
        std::array::from_fn(|i| match i as f64 / NODES as f64 {
            0.0 => 2.0 / 3.0,
            1.0 => 1.0,
            z => (average_in_closed_form((1.0 + z) / (1.0 - z)) / z) as f32,
        })
    });
    let z = if eta < 1e6 { ((eta - 1.0) / (eta + 1.0)).max(0.0) } else { 1.0 };
    let place = z * NODES as f32;
    let below = (place as usize).min(NODES - 1);
    let [a, b] = [TABLE[below], TABLE[below + 1]];
    z * (a + (b - a) * (place - below as f32))
}

/// Walsh 1926; see d'Eon 2021, "An analytic BRDF for materials with spherical Lambertian scatterers", eq. 33.
fn average_in_closed_form(n: f64) -> f64 {
    if n < 1.0001 {
        // the closed form cancels; this is its first order, to which only grazing light contributes
        return (n - 1.0) / 3.0;
    }
    let n2 = n * n;
    let p = n2 + 1.0;
    let m = n2 - 1.0;
    let a = 0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2));
    let b = n2 * m * m / p.powi(3) * ((n - 1.0) / (n + 1.0)).ln();
    let c = -2.0 * n2 * n * (n2 + 2.0 * n - 1.0) / (p * (n2 * n2 - 1.0));
    let d = 8.0 * n2 * n2 * (n2 * n2 + 1.0) / (p * (n2 * n2 - 1.0).powi(2)) * n.ln();
    a + b + c + d
}

/// A coloured Fresnel term of a reflecting surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fresnel {
    /// Schlick 1994: `f0 + (f90 - f0) (1 - cos)^5`.
    Schlick {
        /// Reflectance at normal incidence.
        f0: Vec3,
        /// Reflectance at grazing incidence.
        f90: Vec3,
    },
    /// Schlick with an edge tint: `f0 + (1 - f0) (1 - cos)^5 - b cos (1 - cos)^6`
    /// (Kutz, Hašan and Edmondson 2021, "Novel aspects of the Adobe Standard Material"; Hoffman 2023).
    F82 {
        /// Reflectance at normal incidence.
        f0: Vec3,
        /// Depth of the dip near 82 degrees.
        b: Vec3,
    },
    /// Exact dielectric reflectance, stretched so that it begins at `f0` and ends at one.
    Dielectric {
        /// Relative refractive index, at least one.
        eta: f32,
        /// Reflectance at normal incidence.
        f0: Vec3,
    },
}

impl Fresnel {
    /// The same reflectance at every angle.
    pub fn constant(f: Vec3) -> Self {
        Self::Schlick { f0: f, f90: f }
    }

    /// Metal of reflectance `f0` whose value at about 82 degrees (cosine 1/7) is `tint` times that of
    /// Schlick's curve.
    pub fn f82_tint(f0: Vec3, tint: Vec3) -> Self {
        const MU: f32 = 1.0 / 7.0;
        let schlick = f0 + (Vec3::ONE - f0) * (1.0 - MU).powi(5);
        Self::F82 { f0, b: schlick * (Vec3::ONE - tint) / (MU * (1.0 - MU).powi(6)) }
    }

    /// Reflectance at the cosine `mu` in `[0,1]`.
    #[inline]
    pub fn eval(&self, mu: f32) -> Vec3 {
        let x = (1.0 - mu).clamp(0.0, 1.0);
        let x5 = x * x * x * x * x;
        match *self {
            Self::Schlick { f0, f90 } => f0 + (f90 - f0) * x5,
            Self::F82 { f0, b } => {
                (f0 + (Vec3::ONE - f0) * x5 - b * (mu * x5 * x)).clamp(Vec3::ZERO, Vec3::ONE)
            }
            Self::Dielectric { eta, f0 } => f0 + (Vec3::ONE - f0) * stretched_dielectric(mu, eta),
        }
    }

    /// Cosine-weighted average over the hemisphere, `2 integral F(mu) mu dmu`.
    pub fn average(&self) -> Vec3 {
        match *self {
            Self::Schlick { f0, f90 } => f0 + (f90 - f0) / 21.0,
            Self::F82 { f0, b } => f0 + (Vec3::ONE - f0) / 21.0 - b / 126.0,
            Self::Dielectric { eta, f0 } => {
                let r0 = f0_from_ior(eta);
                let s = ((dielectric_average(eta) - r0) / (1.0 - r0)).clamp(0.0, 1.0);
                f0 + (Vec3::ONE - f0) * s
            }
        }
    }
}

/// The exact reflectance mapped so that normal incidence is 0 and total reflection 1. `eta` far over near.
#[inline]
pub fn stretched_dielectric(mu: f32, eta: f32) -> f32 {
    let r0 = f0_from_ior(eta);
    ((dielectric(mu, eta).0 - r0) / (1.0 - r0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn average(f: impl Fn(f64) -> f64) -> f64 {
        let n = 20_000;
        (0..n).map(|i| (i as f64 + 0.5) / n as f64).map(|mu| 2.0 * mu * f(mu)).sum::<f64>() / n as f64
    }

    #[test]
    fn the_average_is_read_as_it_is_computed() {
        for k in 0..=14_000 {
            let eta = 1.0 + (k as f32 / 1000.0).exp_m1() * 1e-3;
            let expected = average_in_closed_form(f64::from(eta)) as f32;
            approx::assert_abs_diff_eq!(dielectric_average(eta), expected, epsilon = 5e-6);
        }
        assert_eq!(dielectric_average(f32::INFINITY), 1.0);
    }

    #[test]
    fn dielectric_has_its_known_values() {
        approx::assert_abs_diff_eq!(dielectric(1.0, 1.5).0, 0.04, epsilon = 1e-6);
        approx::assert_abs_diff_eq!(dielectric(1.0, 1.0 / 1.5).0, 0.04, epsilon = 1e-6);
        approx::assert_abs_diff_eq!(dielectric(0.0, 1.5).0, 1.0, epsilon = 1e-6);
        assert_eq!(dielectric(0.5, 1.0 / 1.5), (1.0, 0.0));
        // at Brewster's angle the p half vanishes; the s half is ((n^2 - 1) / (n^2 + 1))^2
        let brewster = dielectric((1.0f32 / (1.0 + 2.25)).sqrt(), 1.5).0;
        approx::assert_abs_diff_eq!(brewster, 0.5 * (1.25f32 / 3.25).powi(2), epsilon = 1e-6);
    }

    #[test]
    fn both_sides_agree_on_the_reflectance() {
        for eta in [1.0001, 1.3, 2.4] {
            for mu in [0.1, 0.3, 0.8, 1.0] {
                let (r, t) = dielectric(mu, eta);
                let (back, mu2) = dielectric(t, 1.0 / eta);
                // of an index near one, few digits are left after the one
                approx::assert_abs_diff_eq!(r, back, epsilon = 1e-5 + 1e-7 / (eta - 1.0));
                approx::assert_abs_diff_eq!(mu, mu2, epsilon = 2e-3);
            }
        }
    }

    #[test]
    fn averages_are_those_of_the_curves() {
        for eta in [1.00005, 1.0005, 1.002, 1.1, 1.5, 2.0, 4.0] {
            let expected = average(|mu| f64::from(dielectric(mu as f32, eta).0));
            approx::assert_relative_eq!(f64::from(dielectric_average(eta)), expected, max_relative = 2e-3);
        }
        let f0 = Vec3::new(0.9, 0.5, 0.04);
        for f in [
            Fresnel::Schlick { f0, f90: Vec3::new(1.0, 0.5, 0.8) },
            Fresnel::f82_tint(f0, Vec3::new(0.2, 1.0, 0.7)),
            Fresnel::Dielectric { eta: 1.5, f0 },
        ] {
            for c in 0..3 {
                let expected = average(|mu| f64::from(f.eval(mu as f32)[c]));
                approx::assert_abs_diff_eq!(f64::from(f.average()[c]), expected, epsilon = 3e-4);
            }
        }
    }

    #[test]
    fn edge_tint_is_met_at_82_degrees() {
        let (f0, tint) = (Vec3::new(0.9, 0.6, 0.3), Vec3::new(0.5, 0.8, 1.0));
        let plain = Fresnel::Schlick { f0, f90: Vec3::ONE }.eval(1.0 / 7.0);
        let tinted = Fresnel::f82_tint(f0, tint).eval(1.0 / 7.0);
        assert!((tinted - plain * tint).abs().max_element() < 1e-5);
    }
}
