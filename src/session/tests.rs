use super::*;
use crate::film::Pass;
use crate::scene::SceneBuilder;
use crate::transport::testing::place;
use glam::Vec3;

struct Silent;

impl Events for Silent {
    fn progress(&mut self, _: &Progress) -> bool {
        false
    }

    fn tile(&mut self, _: Rect) {}
}

/// A small lamp above a floor, and a pane of glass between them.
fn session(samples: u32) -> Session {
    session_with(&format!(r#"{{"resolution":[40,40],"samples":{samples},"light_paths":1}}"#))
}

fn session_with(settings: &str) -> Session {
    let mut b = SceneBuilder::default();
    let mut square = |s: f32, z: f32, material: &str| {
        let points = [[-s, -s, z], [s, -s, z], [s, s, z], [-s, s, z]].map(Vec3::from);
        place(&mut b, &points, &[0, 1, 2, 0, 2, 3], material);
    };
    square(4.0, -4.0, r#"{"surface":{"type":"diffuse","color":[0.7,0.6,0.5]}}"#);
    square(0.5, -2.5, r#"{"surface":{"type":"glass","ior":1.5}}"#);
    square(0.1, -1.0, r#"{"surface":{"type":"emission","color":[9,8,7]}}"#);
    b.set_camera("camera", r#"{"window":[-1,1,-1,1]}"#).unwrap();
    Session::new(b.build().unwrap(), Settings::from_json(settings).unwrap()).unwrap()
}

/// What is learnt in one run (where light paths begin, whether they pay, the sizes of kernels) is there in the next.
#[test]
fn a_render_that_paused_goes_on_as_if_it_had_not() {
    let picture = |s: &Session| s.film.read_pass(Pass::Combined, s.film.rect()).unwrap();
    let whole = session(20);
    whole.run(&mut Silent).unwrap();
    let mut paused = session(7);
    for samples in [7, 9, 20] {
        paused.settings.limits.samples = Some(samples);
        assert_eq!(paused.run(&mut Silent).unwrap(), StopReason::Samples);
    }
    assert!(picture(&whole).iter().any(|&v| v > 0.0));
    assert_eq!(picture(&whole), picture(&paused));
}

/// Slices of time that are shorter than an iteration come to all tiles.
#[test]
fn an_iteration_that_was_cut_short_is_gone_on_with() {
    let paths = |limit: &str| {
        session_with(&format!(r#"{{"integrator":"path","resolution":[400,400],"threads":2,{limit}}}"#))
    };
    let (sliced, whole) = (paths(r#""time":1e-4"#), paths(r#""samples":3"#));
    let mut cut = 0;
    while locked(&sliced.state).iterations < 3 {
        assert_eq!(sliced.run(&mut Silent).unwrap(), StopReason::Time);
        let counts = sliced.film.sample_counts(sliced.film.rect()).unwrap();
        let (least, most) = (*counts.iter().min().unwrap(), *counts.iter().max().unwrap());
        assert!(least >= 1 && most - least <= 1, "{least} {most}");
        cut += u32::from(least != most);
    }
    assert!(cut > 0, "none was cut short");
    // with the same samples as without a pause
    whole.run(&mut Silent).unwrap();
    let picture = |s: &Session| s.film.read_pass(Pass::Combined, s.film.rect()).unwrap();
    let counts = sliced.film.sample_counts(sliced.film.rect()).unwrap();
    let (a, b) = (picture(&sliced), picture(&whole));
    let as_many: Vec<usize> = (0..counts.len()).filter(|&k| counts[k] == 3).collect();
    assert!(!as_many.is_empty());
    assert!(as_many.iter().all(|&k| a[4 * k..4 * k + 4] == b[4 * k..4 * k + 4]));
}

/// Fails at once.
struct Broken;

impl Integrator for Broken {
    fn iterate(&mut self, _: &Context, _: u32) -> IterationEnd {
        panic!("broken on purpose")
    }

    fn is_all_or_nothing(&self) -> bool {
        true
    }

    fn rest(&mut self) {}
}

/// It ends with an error, it is not waited for.
#[test]
fn a_panic_of_an_integrator_is_told() {
    let broken = session(1);
    *locked(&broken.integrator) = Box::new(Broken);
    let told = broken.run(&mut Silent).unwrap_err().to_string();
    assert!(told.contains("broken on purpose"), "{told}");
    // what follows has a sound one again
    assert_eq!(broken.run(&mut Silent).unwrap(), StopReason::Samples);
}
