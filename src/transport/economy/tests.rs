use super::*;
use crate::math::sampler::hash_unit;

/// Camera draws, and light draws of a share of their full number, of an integral over [0,1].
struct Drawn {
    camera: Vec<[(f64, f64); 3]>,
    photons: Vec<(f64, f64)>,
}

impl Drawn {
    fn sum(&self) -> f64 {
        self.camera.iter().flatten().chain(&self.photons).map(|&(c, _)| c).sum()
    }
}

/// Camera draws are uniform; light draws fall into the last tenth, where the integrand is large.
fn draw(share: f64, seed: u32) -> Drawn {
    const CAMERA: u32 = 12;
    const LIGHT: u32 = 40;
    let g = |x: f64| if x > 0.9 { 6.0 * (1.0 + x) } else { 0.2 * x };
    let by_light = |x: f64| if x > 0.9 { share * f64::from(LIGHT) * 10.0 } else { 0.0 };
    let item = |x: f64| {
        let density = f64::from(CAMERA) + by_light(x);
        (g(x) / density, by_light(x) / density)
    };
    let unit = |k: u32| f64::from(hash_unit(seed, k));
    let camera = (0..CAMERA).map(|k| [item(unit(k)), (0.0, 0.0), (0.0, 0.0)]).collect();
    // so many on average, independent of each other
    let tries = LIGHT * 16;
    let falls = (0..tries).filter(|k| unit(1000 + 2 * k) < share / 16.0);
    let photons = falls.map(|k| item(0.9 + 0.1 * unit(1001 + 2 * k))).collect();
    Drawn { camera, photons }
}

#[test]
fn what_fewer_light_paths_would_bring_is_told_by_all_of_them() {
    let runs = 20_000;
    let mut told = [0.0; SHARES.len()];
    for seed in 0..runs {
        let d = draw(1.0, seed);
        let found = of_row(d.camera.into_iter(), d.photons.into_iter());
        told.iter_mut().zip(found).for_each(|(sum, v)| *sum += v / f64::from(runs));
    }
    for (k, share) in SHARES.into_iter().enumerate() {
        let sums: Vec<f64> = (0..runs).map(|seed| draw(f64::from(share), runs + seed).sum()).collect();
        let mean = sums.iter().sum::<f64>() / f64::from(runs);
        let variance = sums.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / f64::from(runs - 1);
        println!("share {share}: told {:.5}, found {variance:.5}, mean {mean:.4}", told[k]);
        // draws of the camera are so many, not so many on average, which makes them a little better
        assert!((0.95..1.2).contains(&(told[k] / variance)), "{share}: {} {variance}", told[k]);
    }
}

#[test]
fn what_only_light_paths_find_keeps_them() {
    let camera = || [[(1.0, 0.0), (0.0, 0.0), (0.0, 0.0)]; 4].into_iter();
    let found = of_row(camera(), [(1e-3, 1.0)].into_iter());
    assert!(found[0].is_infinite() && found[1..].iter().all(|v| v.is_finite()), "{found:?}");
    // and where none of it was found, the rest decides alone
    assert_eq!(of_row(camera(), [(0.0, 1.0)].into_iter()), [0.0; SHARES.len()]);
}

fn judge(economy: &mut Economy, index: u32, departure: Departure, have_light_paths: bool) {
    economy.judge(index, departure, Must { have_light_paths, filter: true });
}

/// After an iteration with all light paths that left it open whether they pay. `some`: as in [`Economy::judge`].
fn on_trial(some: bool) -> Economy {
    let mut economy =
        Economy { errors: [1.2, 1.15, 1.1, 1.0], costs: [5.0, 5.6, 7.0, 10.0], ..Economy::default() };
    judge(&mut economy, 3, Departure { deviation: 2.0, before: 3 }, some);
    economy
}

#[test]
fn what_is_open_is_tried_once() {
    let mut economy = on_trial(false);
    assert!(economy.compares(4) && economy.light_paths(5000.0, 4) == 0.0);
    // variance with all: 4 - 4/4 = 3, without: 5.5 - 4/4 = 4.5, at half the cost
    judge(&mut economy, 4, Departure { deviation: 5.5f64.sqrt(), before: 3 }, false);
    assert!(!economy.compares(5) && economy.light_paths(5000.0, 5) == 0.0);
    // and where the pictures are much noisier, all stay: 6.5 - 4/4 = 5.5
    let mut economy = on_trial(false);
    judge(&mut economy, 4, Departure { deviation: 6.5f64.sqrt(), before: 3 }, false);
    assert_eq!(economy.light_paths(5000.0, 5), 5000.0);
}

#[test]
fn a_hidden_light_keeps_a_sixteenth_at_least() {
    let mut economy = on_trial(true);
    assert_eq!(economy.light_paths(5000.0, 4), 313.0);
    judge(&mut economy, 4, Departure { deviation: 4.0f64.sqrt(), before: 3 }, true);
    assert_eq!(economy.light_paths(5000.0, 5), 313.0);
    assert_eq!(economy.light_paths(500.0, 5), FEWEST);
    assert_eq!(economy.light_paths(5.0, 5), 5.0);
}

#[test]
fn nothing_is_tried_where_there_is_nothing_to_compare() {
    let mut economy =
        Economy { errors: [1.2, 1.15, 1.1, 1.0], costs: [5.0, 5.6, 7.0, 10.0], ..Economy::default() };
    judge(&mut economy, 0, Departure { deviation: 0.0, before: 0 }, false);
    assert!(!economy.compares(1) && economy.light_paths(5000.0, 1) == 5000.0);
}

#[test]
fn all_are_sampled_at_first_and_now_and_then() {
    let none = Economy { share: 0.0, ..Economy::default() };
    for k in 0..17 {
        let all = if [0, 3, 15].contains(&k) { 5000.0 } else { 0.0 };
        assert_eq!(none.light_paths(5000.0, k), all, "{k}");
    }
    assert_eq!(Economy::default().light_paths(5.0, 1), 5.0);
}
