//! Rays a second, beside Embree's: the same mesh and the same rays in one process, in turns.
//!
//! `EMBREE_LIBRARY=/path/to/libembree4.so cargo bench --bench rays`; without the variable Segue is measured alone.
//! Rates are rays by CPU time of the threads, so other work on the machine disturbs them little; the ratio is the median
//! over the rounds of the ratio within a round.

mod embree;
mod scenes;

use std::time::Instant;

use embree::{Embree, Mode, thread_seconds};
use glam::Affine3A;
use scenes::Scene;
use segue::accel::{Accel, InstanceGeometry, MeshGeometry, Ray};

const ROUNDS: usize = 9;
/// Rays that each contender traces before it is the next one's turn.
const PART: usize = 1 << 14;

fn main() {
    // `cargo test --benches` runs this too, with another argument; then there is nothing to do.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let library = std::env::var("EMBREE_LIBRARY").ok();
    if library.is_none() {
        println!("EMBREE_LIBRARY is not set: no comparison");
    }
    for scene in [Scene::room(), Scene::soup()] {
        measure(&scene, library.as_deref());
    }
}

fn measure(scene: &Scene, library: Option<&str>) {
    let mesh = MeshGeometry { positions: &scene.positions, triangles: &scene.triangles };
    let instance = InstanceGeometry { mesh: 0, to_world: Affine3A::IDENTITY };
    let start = Instant::now();
    let accel = Accel::build(&[mesh], &[instance]).expect("the mesh is sound");
    println!("\n{}: {} triangles", scene.name, scene.triangles.len());
    println!("Segue: {:.2} s to build, {} MB", start.elapsed().as_secs_f64(), accel.memory_bytes() >> 20);
    let start = Instant::now();
    let load = |mode| {
        let built = library.map(|path| Embree::new(path, &scene.positions, &scene.triangles, mode));
        built.transpose().unwrap_or_else(|error| panic!("Embree: {error}"))
    };
    let embree = load(Mode::Medium);
    if embree.is_some() {
        println!("Embree: {:.2} s to build", start.elapsed().as_secs_f64());
    }
    let robust = load(Mode::Robust);

    println!(
        "{:10} {:>7} {:>12} {:>12} {:>12} {:>14}",
        "rays", "threads", "Segue", "Embree", "ratio", "to robust"
    );
    for (name, any, rays) in scene.rays(&accel) {
        if let (false, Some(embree)) = (any, &embree) {
            let differ = rays.iter().filter(|ray| {
                let ours = accel.closest(ray).map(|hit| hit.t);
                let theirs = embree.closest(ray).map(|hit| hit.0);
                match (ours, theirs) {
                    (Some(a), Some(b)) => (a - b).abs() > 1e-3 * a.abs().max(1.0),
                    (a, b) => a.is_some() != b.is_some(),
                }
            });
            let (differ, all) = (differ.count(), rays.len());
            println!("{name:10} {differ} of {all} differ");
        }
        let ours = |ray: &Ray| if any { accel.occluded(ray) } else { accel.closest(ray).is_some() };
        let theirs = |embree: &Option<Embree>, ray: &Ray| match embree {
            Some(embree) if any => embree.occluded(ray),
            Some(embree) => embree.closest(ray).is_some(),
            None => false,
        };
        for threads in [1, 2] {
            let mut rounds = [[0.0; 3]; ROUNDS];
            for (index, round) in rounds.iter_mut().enumerate() {
                for (part, rays) in rays.chunks(PART).enumerate() {
                    // In turns, and in turns who is first: neither load nor caches favour one.
                    for turn in 0..3 {
                        let who = (turn + part + index) % 3;
                        round[who] += match who {
                            0 => seconds(rays, threads, ours),
                            1 => seconds(rays, threads, |ray| theirs(&embree, ray)),
                            _ => seconds(rays, threads, |ray| theirs(&robust, ray)),
                        };
                    }
                }
            }
            let rate = |who: usize| {
                1e-6 * (rays.len() * threads) as f64 / median(rounds.iter().map(|round| round[who]))
            };
            let ratio = |other: usize| median(rounds.iter().map(|round| round[other] / round[0]));
            let (ours, theirs) = (rate(0), rate(1));
            println!(
                "{name:10} {threads:7} {ours:7.2} Mr/s {theirs:7.2} Mr/s {:12.3} {:14.3}",
                ratio(1),
                ratio(2),
            );
        }
    }
}

/// CPU time of `threads` threads that run at once.
fn seconds(rays: &[Ray], threads: usize, query: impl Fn(&Ray) -> bool + Sync) -> f64 {
    let run = |part: &[Ray]| {
        let start = thread_seconds();
        let hits = part.iter().filter(|ray| query(ray)).count();
        std::hint::black_box(hits);
        thread_seconds() - start
    };
    if threads == 1 {
        return run(rays);
    }
    let parts = rays.chunks(rays.len().div_ceil(threads));
    std::thread::scope(|scope| {
        let running: Vec<_> = parts.map(|part| scope.spawn(|| run(part))).collect();
        running.into_iter().map(|thread| thread.join().expect("no panic")).sum()
    })
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
