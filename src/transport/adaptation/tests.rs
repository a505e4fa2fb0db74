use super::*;
use crate::math::sampler::hash_unit;
use crate::transport::outline::clear_pixels;
use crate::transport::testing::{ON, wall};
use glam::Vec3;

const SIDE: u32 = 96;
const PICTURE: Rect = Rect::new(0, 0, SIDE, SIDE);

/// What is found in iterations that show `light(x, y)` under noise of this width, whose share of
/// the light is alike within 4 x 4 pixels as a kernel makes it.
fn adapted(light: impl Fn(u32, u32) -> f32, noise: f32, depth: impl Fn(u32, u32) -> f32) -> Adaptation {
    let (sensor, mut primaries, arrivals) = wall(SIDE, |x, y| Some(depth(x, y)));
    let mut adaptation = Adaptation::default();
    for completed in 1..=64 {
        adaptation.begin(PICTURE, completed);
        for ((x, y), p) in PICTURE.pixels().zip(&mut primaries) {
            let u = hash_unit(hash(x / 4, y / 4), completed) - 0.5;
            p.weight = Vec3::splat(light(x, y) * (1.0 + noise * u));
        }
        let look = Look {
            band: PICTURE,
            sensor: &sensor,
            primaries: &primaries,
            is_clear: &clear_pixels(SIDE, &sensor, &primaries, &arrivals),
            arrivals: &arrivals,
            seed: completed,
            completed,
        };
        adaptation.add(&look, |p| p.weight.x, &ON);
        adaptation.end_iteration(4.0, 4.0, completed);
    }
    adaptation
}

/// Sizes in pixels, block by block.
fn sizes(light: impl Fn(u32, u32) -> f32, noise: f32, depth: impl Fn(u32, u32) -> f32) -> Vec<f32> {
    adapted(light, noise, depth).octaves.iter().map(|o| 4.0 * o.exp2()).collect()
}

/// Mean over some blocks, octaves over a pixel.
fn mean(sizes: &[f32], columns: std::ops::Range<usize>) -> f32 {
    let [across, _] = blocks(PICTURE);
    let chosen = sizes.iter().enumerate().filter(|(block, _)| columns.contains(&(block % across)));
    let octaves: Vec<f32> = chosen.map(|(_, s)| s.log2()).collect();
    octaves.iter().sum::<f32>() / octaves.len() as f32
}

#[test]
fn even_light_gets_the_largest_kernel() {
    // sixteen pixels, but for chance
    let found = mean(&sizes(|_, _| 1.0, 1.0, |_, _| 5.0), 0..6);
    assert!((3.5..=4.0).contains(&found), "{found}");
}

#[test]
fn kernels_are_small_where_light_is_fine_and_as_small_as_noise_allows() {
    // slanting, so that no grid happens to part the stripes
    let striped = |x: u32, y: u32| match x < SIDE / 2 && ((2 * x + y) / 8).is_multiple_of(2) {
        true => 0.8,
        false => 1.0,
    };
    let [calm, loud] = [0.5, 2.0].map(|noise| sizes(striped, noise, |_, _| 5.0));
    let (fine, coarse) = (mean(&calm, 0..2), mean(&loud, 0..2));
    assert!(fine < 1.0 && coarse > fine + 0.5, "{fine} {coarse}");
    assert!(mean(&calm, 4..6) > 3.5 && mean(&loud, 4..6) > 3.0);
}

#[test]
fn what_kernels_blur_is_told() {
    // stripes of a tenth of the mean, finer than any kernel but the smallest, so calm that none blurs them in the end
    let striped = |x: u32, y: u32| if ((2 * x + y) / 8).is_multiple_of(2) { 0.9 } else { 1.1 };
    let [even, calm, loud] = [
        adapted(|_, _| 1.0, 1.0, |_, _| 5.0),
        adapted(striped, 0.1, |_, _| 5.0),
        adapted(striped, 4.0, |_, _| 5.0),
    ]
    .map(|a| a.blur().unwrap());
    // squared: 0.01 where kernels join the stripes
    assert!(even < 1e-3 && calm < 3e-3, "{even} {calm}");
    assert!((3e-3..1.2e-2).contains(&loud), "{loud}");
    assert_eq!(Adaptation::default().blur(), None);
}

#[test]
fn a_step_between_surfaces_is_no_blur() {
    // light is different where the surface is, so that no kernel joins the two
    let ledge = |x: u32, _| if x < SIDE / 2 { 5.0 } else { 50.0 };
    let lit = |x: u32, _| if x < SIDE / 2 { 0.1 } else { 1.0 };
    let found = mean(&sizes(lit, 1.0, ledge), 0..6);
    assert!(found > 3.5, "{found}");
    // while on one surface it is
    let joined = mean(&sizes(lit, 1.0, |_, _| 5.0), 2..4);
    assert!(joined < 3.0, "{joined}");
}

#[test]
fn where_nothing_is_told_the_size_is_nominal() {
    // no pixel has neighbours on its surface
    assert!(
        sizes(|_, _| 1.0, 1.0, |x, y| 5.0 + (7 * x % 11 + 3 * y % 7) as f32).into_iter().all(|s| s == 4.0)
    );
    assert!(sizes(|_, _| f32::NAN, 1.0, |_, _| 5.0).into_iter().all(|s| s.is_finite()));
}
