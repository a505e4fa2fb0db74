//! Statistical tests that every scattering lobe passes.

mod chi_square;
mod table;

use chi_square::{Chart, Draws, sidak, uniform};
use glam::Vec3;
use segue::math::{Frame, Sampler};
use segue::shading::lobes::{Density, Dielectric, Fresnel, Ggx, Lobe, Reflection, Side};
use table::{Row, directions, rows};

/// A lobe seen from one direction.
struct Seen<'a>(&'a Row, Vec3);

impl Draws for Seen<'_> {
    fn draw(&self, u: Vec3) -> Option<Vec3> {
        self.0.lobe.sample(self.1, u).map(|s| s.direction)
    }

    fn density(&self, w: Vec3) -> f64 {
        f64::from(self.0.lobe.pdf(self.1, w).0) * f64::from(w.z.abs())
    }

    fn chart(&self) -> Chart {
        match &self.0.lobe {
            Lobe::Reflection(_) => Chart::Half(self.1),
            Lobe::Dielectric(lobe) if self.0.width < 0.05 => {
                let from = self.1;
                let mirrored = Vec3::new(-from.x, -from.y, from.z);
                let eta = if from.z > 0.0 { lobe.eta() } else { 1.0 / lobe.eta() };
                let across = -from.truncate() / eta;
                let z = (1.0 - across.length_squared()).max(0.0).sqrt();
                let refracted = across.extend(-z.copysign(from.z)).normalize();
                let (above, below) = if from.z > 0.0 { (mirrored, refracted) } else { (refracted, mirrored) };
                Chart::Peaks(Frame::from_normal(above), Frame::from_normal(below))
            }
            _ => Chart::Direction,
        }
    }
}

fn each_seen(rows: &[Row]) -> Vec<(&Row, Vec3)> {
    rows.iter().flat_map(|row| directions().into_iter().map(move |from| (row, from))).collect()
}

#[test]
fn samples_follow_their_density() {
    let rows = rows();
    // single precision does not resolve the cells of a peak that is much narrower than this, in radians
    let resolved = |row: &Row, from: Vec3| row.width * from.z.abs() > 2e-5;
    let tested = |row: &Row, from: Vec3| !row.lobe.is_delta() && resolved(row, from);
    let runs: Vec<_> = each_seen(&rows).into_iter().filter(|(row, from)| tested(row, *from)).collect();
    let limit = sidak(runs.len());
    let mut failures = Vec::new();
    for (k, (row, from)) in runs.iter().enumerate() {
        let o = chi_square::test(&Seen(row, *from), k as u32, 100_000);
        // the density integrates to the share of draws that give a direction
        if o.p < limit || (o.mass - o.accepted).abs() > 4.5 * o.sigma + 1e-4 {
            failures.push(format!(
                "{} from {from}: p = {:.2e}, mass {:.4}, accepted {:.4}; {}",
                row.name, o.p, o.mass, o.accepted, o.worst
            ));
        }
    }
    assert!(failures.is_empty(), "{} of {} runs:\n{}", failures.len(), runs.len(), failures.join("\n"));
}

/// Mean weight of the draws, and its standard error: as many as it takes to make that small.
fn mean_weight(lobe: &Lobe, from: Vec3, seed: u32) -> (Vec3, f32) {
    const ROUNDS: [u32; 4] = [1 << 14, 1 << 16, 1 << 18, 1 << 20];
    let (mut sum, mut squares, mut i, mut round) = (glam::DVec3::ZERO, 0.0, 0, 0);
    loop {
        let n = ROUNDS[round];
        while i < n {
            if let Some(s) = lobe.sample(from, Sampler::new(seed, 0, i).next_3d()) {
                let w = s.weight().as_dvec3();
                sum += w;
                squares += w.x * w.x;
            }
            i += 1;
        }
        let mean = sum / f64::from(n);
        let error = ((squares / f64::from(n) - mean.x * mean.x).max(0.0) / f64::from(n)).sqrt();
        round += 1;
        if error < 1.5e-3 || round == ROUNDS.len() {
            return (mean.as_vec3(), error as f32);
        }
    }
}

#[test]
fn energy_is_kept() {
    let rows = rows();
    let mut failures = Vec::new();
    for (k, (row, from)) in each_seen(&rows).into_iter().enumerate() {
        let (mean, error) = mean_weight(&row.lobe, from, k as u32);
        let bad = if row.lossless {
            (mean - Vec3::ONE).abs().max_element() > 0.005
        } else {
            mean.max_element() > 1.0 + 4.0 * error
        };
        if bad {
            failures.push(format!("{} from {from}: albedo {mean} +- {error:.4}", row.name));
        }
    }
    assert!(failures.is_empty(), "{}:\n{}", failures.len(), failures.join("\n"));
}

/// Between the nodes of the energy tables, along roughness, elevation and index: what a long chain of
/// interactions keeps rests on the error of one.
#[test]
fn energy_is_kept_between_the_nodes_of_its_tables() {
    let cosines = [1.0_f32, 0.8, 0.5, 0.25, 0.1];
    let mut failures = Vec::new();
    for roughness in [0.07, 0.13, 0.2, 0.25, 0.3, 0.37, 0.45, 0.62, 0.85] {
        let ggx = Ggx::from_roughness(roughness);
        let metal = Lobe::Reflection(Reflection::new(ggx, Fresnel::constant(Vec3::ONE)));
        let glass = |eta| (format!("glass {eta}"), Lobe::Dielectric(Dielectric::new(ggx, eta)));
        for (name, lobe) in [("metal".to_string(), metal), glass(1.2), glass(1.5), glass(1.8), glass(2.2)] {
            for z in cosines.into_iter().flat_map(|z| [z, -z]) {
                if z < 0.0 && name == "metal" {
                    continue;
                }
                let from = Vec3::new((1.0 - z * z).sqrt(), 0.0, z);
                let draws = 1 << 18;
                let weight =
                    |i| lobe.sample(from, Sampler::new(1, 0, i).next_3d()).map_or(0.0, |s| s.weight().x);
                let mean = (0..draws).map(|i| f64::from(weight(i))).sum::<f64>() / f64::from(draws);
                if (mean - 1.0).abs() > 1.5e-3 {
                    failures.push(format!(
                        "{name}, roughness {roughness}, cosine {z}: {:+.3} %",
                        100.0 * (mean - 1.0)
                    ));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}:\n{}", failures.len(), failures.join("\n"));
}

/// What rounding a direction may change of a lobe's value, relatively: it moves the half vector of length
/// `h` by about 1e-7, which turns the normal by 1e-7 / h in a peak that is `width` wide.
fn rounding(row: &Row, from: Vec3, to: Vec3) -> f32 {
    let index = match from.z * to.z > 0.0 {
        true => 1.0,
        false if from.z > 0.0 => row.lobe.eta(),
        false => 1.0 / row.lobe.eta(),
    };
    2e-6 / (row.width * (from + to * index).length())
}

#[test]
fn samples_carry_the_values_of_eval_and_pdf() {
    for (k, (row, from)) in each_seen(&rows()).into_iter().enumerate() {
        for i in 0..500 {
            let Some(s) = row.lobe.sample(from, uniform(i, k as u32)) else { continue };
            let what = format!("{} from {from} to {}", row.name, s.direction);
            assert!((s.direction.length() - 1.0).abs() < 1e-5, "{what}: length");
            assert_eq!(s.kind.is_delta(), row.lobe.is_delta(), "{what}");
            assert_eq!(s.kind.side == Side::Transmission, s.direction.z * from.z < 0.0, "{what}: side");
            let eta = match s.kind.side {
                Side::Reflection => 1.0,
                Side::Transmission if from.z > 0.0 => row.lobe.eta(),
                Side::Transmission => 1.0 / row.lobe.eta(),
            };
            assert_eq!(s.eta, eta, "{what}: index");
            match s.pdf {
                Density::Discrete(p) => {
                    assert!(p.0 > 0.0 && p.0 <= 1.0, "{what}: probability {p:?}");
                    assert_eq!(row.lobe.eval(from, s.direction), Vec3::ZERO, "{what}");
                    assert_eq!(row.lobe.pdf(from, s.direction).0, 0.0, "{what}");
                }
                Density::Projected(p) => {
                    let tolerance = 1e-3 + rounding(row, from, s.direction);
                    let (f, q) = (row.lobe.eval(from, s.direction), row.lobe.pdf(from, s.direction).0);
                    assert!(p.0 > 0.0, "{what}: density {p:?}");
                    assert!((q / p.0 - 1.0).abs() < tolerance, "{what}: density {q} against {}", p.0);
                    let off = ((f - s.value).abs() / s.value.max(Vec3::splat(1e-20))).max_element();
                    assert!(off < tolerance, "{what}: value {f} against {}", s.value);
                }
            }
        }
    }
}

#[test]
fn lobes_are_reciprocal() {
    for (k, (row, from)) in each_seen(&rows()).into_iter().filter(|(r, _)| r.reciprocal).enumerate() {
        let n2 = |w: Vec3| if w.z < 0.0 { row.lobe.eta().powi(2) } else { 1.0 };
        for i in 0..500 {
            let Some(s) = row.lobe.sample(from, uniform(i, k as u32)) else { continue };
            let what = format!("{} from {from} to {}", row.name, s.direction);
            if s.kind.is_delta() {
                // the way back has the same coefficient; étendue takes care of the rest
                let there = s.value;
                let back = (0..64).find_map(|j| {
                    let u = Vec3::new(0.5, 0.5, (j as f32 + 0.5) / 64.0);
                    row.lobe.sample(s.direction, u).filter(|b| b.kind == s.kind)
                });
                let Some(back) = back else { continue };
                assert!(
                    (back.direction - from).length() < 2e-3,
                    "{what}: comes back along {}",
                    back.direction
                );
                assert!(
                    (back.value - there).abs().max_element() < 2e-3,
                    "{what}: {} and {there}",
                    back.value
                );
                continue;
            }
            let there = row.lobe.eval(from, s.direction) * n2(from);
            let back = row.lobe.eval(s.direction, from) * n2(s.direction);
            let off = ((there - back).abs() / there.max(Vec3::splat(1e-20))).max_element();
            let tolerance = 1e-3 + rounding(row, from, s.direction);
            assert!(off < tolerance, "{what}: {there} and {back}");
        }
    }
}

#[test]
fn nothing_is_ever_not_a_number() {
    let tiny = [0.0, 1e-30, 1e-12, 1e-7, 1e-6, 1e-3, 0.5, 1.0];
    let mut odd: Vec<Vec3> = Vec::new();
    for x in tiny {
        for z in tiny {
            for sign in [1.0, -1.0] {
                odd.extend(Vec3::new(x, -0.5 * x, sign * z).try_normalize());
            }
        }
    }
    odd.extend((0..50).map(|i| segue::math::warp::uniform_sphere(uniform(i, 3).truncate())));
    let top = segue::math::ONE_MINUS_EPSILON;
    let corners = [0.0, 1e-10, 0.5, top];
    for row in rows() {
        for &from in &odd {
            for &to in &odd {
                let (f, p) = (row.lobe.eval(from, to), row.lobe.pdf(from, to).0);
                assert!(f.is_finite() && f.min_element() >= 0.0, "{} {from} {to}: {f}", row.name);
                assert!(p.is_finite() && p >= 0.0, "{} {from} {to}: density {p}", row.name);
            }
            for i in 0..64 {
                let u = Vec3::new(corners[i & 3], corners[(i >> 2) & 3], corners[i >> 4]);
                let Some(s) = row.lobe.sample(from, u) else { continue };
                let w = s.weight();
                assert!(s.direction.is_finite() && w.is_finite(), "{} {from} {u}: {s:?}", row.name);
                assert!(w.min_element() >= 0.0 && s.pdf.value() > 0.0, "{} {from} {u}: {s:?}", row.name);
            }
            let a = row.lobe.albedo(from);
            assert!(
                a.is_finite() && a.min_element() >= 0.0 && a.max_element() < 1.01,
                "{} {from}: {a}",
                row.name
            );
        }
    }
}
