//! The film as its users see it: what goes in comes out, from any number of threads.

use glam::{Vec2, Vec3};
use rayon::prelude::*;
use segue::film::{BACKGROUND_DEPTH, Film, FilmError, FirstHit, Pass, PassSet, Rect, Sample};
use segue::math::sampler::{hash, hash_unit};

fn all_passes() -> PassSet {
    Pass::ALL.into_iter().collect()
}

fn grey(value: f32) -> Sample {
    Sample { radiance: Vec3::splat(value), alpha: 1.0, ..Default::default() }
}

/// A sample that differs in every pixel, iteration and field.
fn noisy(x: u32, y: u32, iteration: u32) -> Sample {
    let u = |k| hash_unit(hash(x * 7919 + y, iteration), k);
    let rgb = |k| Vec3::new(u(k), u(k + 1), u(k + 2));
    let (emission, direct) = (rgb(0), rgb(3));
    let hit = FirstHit {
        depth: u(6),
        position: 10.0 * rgb(7) - 5.0,
        normal: 2.0 * rgb(10) - 1.0,
        albedo: rgb(13),
        uv: Vec2::new(u(16), u(17)),
        object_index: hash(x, y) % 100,
        material_index: hash(y, x) % 100,
    };
    Sample {
        unfiltered: None,
        kernel_octaves: None,
        radiance: emission + direct + rgb(18),
        alpha: u(21),
        emission,
        direct,
        first_hit: (u(22) < 0.7).then_some(hit),
    }
}

#[test]
fn every_pixel_reads_the_mean_of_its_samples() {
    // sides that do not divide into tiles
    let (width, height, iterations) = (67, 41, 5);
    let film = Film::new(width, height, all_passes()).unwrap();
    for i in 0..iterations {
        film.add_iteration(|x, y| noisy(x, y, i));
    }
    let image = |pass| film.read_pass(pass, film.rect()).unwrap();
    let pictures = Pass::ALL.map(|pass| (pass, image(pass)));
    for (x, y) in film.rect().pixels() {
        let samples: Vec<Sample> = (0..iterations).map(|i| noisy(x, y, i)).collect();
        let mean = |f: &dyn Fn(&Sample) -> Vec3| samples.iter().map(f).sum::<Vec3>() / iterations as f32;
        let hit_mean = |f: &dyn Fn(&FirstHit) -> Vec3| mean(&|s| s.first_hit.as_ref().map_or(Vec3::ZERO, f));
        let first = samples.iter().find_map(|s| s.first_hit);
        let alpha = mean(&|s| Vec3::splat(s.alpha)).x;
        for (pass, picture) in &pictures {
            let expected: Vec<f32> = match pass {
                Pass::Combined => mean(&|s| s.radiance).extend(alpha).to_array().to_vec(),
                Pass::Alpha => vec![alpha],
                Pass::Depth => vec![first.map_or(BACKGROUND_DEPTH, |h| h.depth)],
                Pass::Position => first.map_or(Vec3::ZERO, |h| h.position).to_array().to_vec(),
                Pass::Normal => hit_mean(&|h| h.normal).to_array().to_vec(),
                Pass::Albedo => hit_mean(&|h| h.albedo).to_array().to_vec(),
                Pass::Uv => first.map_or(Vec3::ZERO, |h| h.uv.extend(1.0)).to_array().to_vec(),
                Pass::ObjectIndex => vec![first.map_or(0.0, |h| h.object_index as f32)],
                Pass::MaterialIndex => vec![first.map_or(0.0, |h| h.material_index as f32)],
                Pass::Emission => mean(&|s| s.emission).to_array().to_vec(),
                Pass::Direct => mean(&|s| s.direct).to_array().to_vec(),
                Pass::Indirect => mean(&|s| s.indirect()).to_array().to_vec(),
            };
            let at = film.rect().index(x, y) * pass.channels();
            for (got, want) in picture[at..at + pass.channels()].iter().zip(expected) {
                assert!(
                    (got - want).abs() <= 1e-5 * want.abs().max(1.0),
                    "{pass:?} at ({x}, {y}): {got}, {want}"
                );
            }
        }
    }
    assert_eq!(film.total_samples(), (width * height * iterations) as u64);
    assert_eq!(film.rejected_samples(), 0);
}

#[test]
fn a_rectangle_is_that_part_of_the_whole() {
    let film = Film::new(100, 70, all_passes()).unwrap();
    film.add_iteration(|x, y| noisy(x, y, 0));
    for rect in [Rect::new(0, 0, 1, 1), Rect::new(99, 69, 1, 1), Rect::new(31, 30, 40, 37), film.rect()] {
        for pass in Pass::ALL {
            let (whole, part) =
                (film.read_pass(pass, film.rect()).unwrap(), film.read_pass(pass, rect).unwrap());
            let n = pass.channels();
            for (x, y) in rect.pixels() {
                let (from, to) = (film.rect().index(x, y) * n, rect.index(x, y) * n);
                assert_eq!(whole[from..from + n], part[to..to + n]);
            }
        }
    }
}

#[test]
fn nothing_is_read_where_nothing_was_written() {
    let film = Film::new(40, 3, all_passes()).unwrap();
    // an iteration cut short: the first tile only
    film.par_tiles().filter(|tile| tile.rect().x == 0).for_each(|shared| {
        let mut tile = shared.lock();
        shared.rect().pixels().for_each(|(x, y)| tile.add(x, y, &noisy(x, y, 0)));
    });
    for pass in Pass::ALL {
        let right = film.read_pass(pass, Rect::new(32, 0, 8, 3)).unwrap();
        assert!(right.iter().all(|&v| v == 0.0), "{pass:?}");
    }
    let counts = film.sample_counts(film.rect()).unwrap();
    assert!(film.rect().pixels().all(|(x, y)| counts[film.rect().index(x, y)] == u32::from(x < 32)));
    assert_eq!(film.total_samples(), 96);
}

#[test]
fn the_background_is_far_and_has_no_texture_coordinates() {
    let film = Film::new(1, 1, all_passes()).unwrap();
    film.add_iteration(|_, _| grey(0.5));
    assert_eq!(film.read_pass(Pass::Depth, film.rect()).unwrap(), [BACKGROUND_DEPTH]);
    assert_eq!(film.read_pass(Pass::Uv, film.rect()).unwrap(), [0.0; 3]);
    film.add_iteration(|_, _| Sample {
        first_hit: Some(FirstHit { depth: 2.0, ..Default::default() }),
        ..grey(0.5)
    });
    assert_eq!(film.read_pass(Pass::Depth, film.rect()).unwrap(), [2.0]);
    assert_eq!(film.read_pass(Pass::Uv, film.rect()).unwrap(), [0.0, 0.0, 1.0]);
}

#[test]
fn bad_samples_are_left_out_and_counted() {
    let film = Film::new(64, 2, PassSet::default()).unwrap();
    for i in 0..12 {
        film.add_iteration(|x, y| match (x, y, i % 4) {
            (5, 1, 0) => grey(f32::NAN),
            (5, 1, 1) => grey(f32::INFINITY),
            (5, 1, 2) => grey(-3.0),
            _ => grey(2.0),
        });
    }
    assert_eq!(film.rejected_samples(), 9);
    assert!(
        film.read_pass(Pass::Combined, film.rect()).unwrap().chunks(4).all(|p| p == [2.0, 2.0, 2.0, 1.0])
    );
    assert_eq!(film.sample_counts(Rect::new(4, 1, 3, 1)).unwrap(), [12, 3, 12]);
}

#[test]
fn a_million_samples_sum_exactly_enough() {
    let film = Film::new(1, 1, all_passes()).unwrap();
    let value = |i: u32| if i == 0 { 4e5 } else { 0.1 + 0.2 * hash_unit(i, 3) };
    let mut exact = 0.0;
    film.par_tiles().for_each(|shared| {
        let mut tile = shared.lock();
        (0..1_000_000).for_each(|i| {
            tile.add(0, 0, &Sample { emission: Vec3::splat(value(i)), ..grey(value(i)) });
        });
    });
    (0..1_000_000).for_each(|i| exact += value(i) as f64 / 1e6);
    for pass in [Pass::Combined, Pass::Emission] {
        let got = film.read_pass(pass, film.rect()).unwrap()[0] as f64;
        assert!((got / exact - 1.0).abs() < 1e-6, "{pass:?}: {got} for {exact}");
    }
}

#[test]
fn pictures_do_not_depend_on_the_number_of_threads() {
    let render = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let film = Film::new(130, 75, all_passes()).unwrap();
        pool.install(|| {
            for i in 0..7 {
                film.add_iteration(|x, y| noisy(x, y, i));
            }
        });
        Pass::ALL.map(|pass| film.read_pass(pass, film.rect()).unwrap())
    };
    let one = render(1);
    for threads in [2, 7] {
        assert!(render(threads) == one, "{threads} threads");
    }
}

#[test]
fn reading_during_rendering_gives_means_of_whole_samples() {
    let film = Film::new(96, 64, all_passes()).unwrap();
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| (0..200).for_each(|_| film.add_iteration(|_, _| grey(0.25))));
        while !writer.is_finished() {
            for pixel in film.read_pass(Pass::Combined, film.rect()).unwrap().chunks(4) {
                assert!(pixel == [0.25, 0.25, 0.25, 1.0] || pixel == [0.0; 4], "{pixel:?}");
            }
        }
    });
    assert_eq!(film.total_samples(), 200 * 96 * 64);
}

#[test]
fn a_writer_that_panics_leaves_the_film_readable() {
    let film = Film::new(8, 8, PassSet::default()).unwrap();
    let writer = std::panic::AssertUnwindSafe(|| {
        film.add_iteration(|x, y| if (x, y) == (3, 3) { panic!("on purpose") } else { grey(1.0) })
    });
    assert!(std::panic::catch_unwind(writer).is_err());
    assert_eq!(film.read_pass(Pass::Combined, Rect::new(2, 3, 1, 1)).unwrap(), [1.0; 4]);
    assert_eq!(film.total_samples(), 27);
}

#[test]
fn impossible_films_are_refused() {
    for (width, height) in [(0, 5), (5, 0), (1_000_000, 1_000_000), (u32::MAX, 1), (1, 65_537)] {
        let error = Film::new(width, height, PassSet::default()).unwrap_err();
        assert!(matches!(error, FilmError::Size { .. }));
        assert!(error.to_string().contains(&format!("{width} x {height}")), "{error}");
    }
    assert!(matches!(Film::new(4, 4, PassSet::EMPTY), Err(FilmError::NoPasses)));
}

/// A terabyte. Where the system promises memory that it has not got, nobody can tell beforehand.
#[test]
#[cfg(target_os = "linux")]
fn a_film_that_does_not_fit_in_memory_is_refused() {
    if std::fs::read_to_string("/proc/sys/vm/overcommit_memory").is_ok_and(|s| s.trim() == "1") {
        eprintln!("skipped: this system promises any amount of memory");
        return;
    }
    let error = Film::new(65_536, 65_536, all_passes()).unwrap_err();
    assert!(matches!(error, FilmError::Memory { .. }), "{error}");
    assert!(error.to_string().contains("65536 x 65536"), "{error}");
}

#[test]
fn memory_is_only_taken_for_passes_asked_for() {
    let with = |pass| Film::memory_bytes(100, 100, PassSet::default().with(pass));
    let combined = Film::memory_bytes(100, 100, PassSet::default());
    assert_eq!(with(Pass::Alpha), combined);
    assert_eq!(with(Pass::Normal) - combined, 24 * 10_000);
    assert_eq!(with(Pass::Depth) - combined, 5 * 10_000);
}

#[test]
fn bad_requests_are_refused() {
    let film = Film::new(10, 6, PassSet::default()).unwrap();
    let outside = [
        Rect::new(0, 0, 0, 1),
        Rect::new(0, 0, 11, 1),
        Rect::new(10, 0, 1, 1),
        Rect::new(0, 5, 1, 2),
        Rect::new(u32::MAX, 0, 2, 1),
        Rect::new(1, 1, u32::MAX, u32::MAX),
    ];
    for rect in outside {
        assert!(matches!(film.read_pass(Pass::Combined, rect), Err(FilmError::Rect { .. })), "{rect}");
        assert!(film.sample_counts(rect).is_err());
    }
    let error = film.read_pass(Pass::Depth, film.rect()).unwrap_err();
    assert!(error.to_string().contains("Depth"), "{error}");
    let mut short = [0.0; 239];
    assert!(matches!(
        film.read_pass_into(Pass::Combined, film.rect(), &mut short),
        Err(FilmError::BufferLength { needed: 240, given: 239 })
    ));
}

#[test]
fn bands_are_whole_tiles_and_cover_the_film_once() {
    for (width, height, most, count) in
        [(64, 64, 1 << 20, 1), (64, 64, 0, 2), (100, 1080, 100 * 300, 4), (7, 33, 7 * 32, 2), (5, 1, 1, 1)]
    {
        let film = Film::new(width, height, all_passes()).unwrap();
        let bands = film.bands(most);
        assert_eq!(bands.len(), count, "{width} x {height}, {most}");
        for band in &bands {
            assert!((band.y % 32, band.x, band.width) == (0, 0, width) && band.height > 0);
            film.add_to_band(*band, |x, y| {
                assert!(band.intersection(&Rect::new(x, y, 1, 1)).is_some());
                grey(1.0)
            });
        }
        assert_eq!(film.total_samples(), u64::from(width) * u64::from(height));
    }
}
