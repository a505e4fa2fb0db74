//! The queries against brute force, the kernels against each other, and input that is out of order.

use glam::{Affine3A, DVec3, Mat3, Quat, Vec3};

use super::kernel::Isa;
use super::*;

/// A sequence of random numbers in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
    }
}

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

fn soup(triangles: usize, size: f32, random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..triangles as u32 {
        let centre = random.vector();
        mesh.0.extend([0; 3].map(|_| centre + size * random.vector()));
        mesh.1.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh
}

fn build(meshes: &[Mesh], instances: &[(u32, Affine3A)]) -> Accel {
    let geometry: Vec<_> = meshes.iter().map(|(p, t)| MeshGeometry { positions: p, triangles: t }).collect();
    let instances: Vec<_> =
        instances.iter().map(|&(mesh, to_world)| InstanceGeometry { mesh, to_world }).collect();
    Accel::build(&geometry, &instances).unwrap()
}

fn placements(count: usize, random: &mut Random) -> Vec<Affine3A> {
    (0..count)
        .map(|_| {
            let turn = Mat3::from_quat(Quat::from_scaled_axis(random.vector() * 3.0));
            let stretch = Mat3::from_cols(random.vector(), random.vector(), random.vector());
            Affine3A::from_mat3_translation(turn + 0.3 * stretch, 3.0 * random.vector())
        })
        .collect()
}

/// Distance along the ray to a triangle, by Moeller and Trumbore's test in double precision, and how far inside it is.
fn distance(ray: &Ray, [a, b, c]: [DVec3; 3]) -> Option<(f64, f64)> {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (ab, ac) = (b - a, c - a);
    let p = d.cross(ac);
    let det = ab.dot(p);
    let s = (o - a) / det;
    let q = s.cross(ab);
    let (u, v) = (s.dot(p), d.dot(q));
    let (t, inside) = (ac.dot(q), u.min(v).min(1.0 - u - v));
    (t > 0.0 && inside.is_finite()).then_some((t, inside))
}

#[test]
fn agrees_with_brute_force() {
    let mut random = Random(1);
    let meshes = [soup(60, 0.3, &mut random), soup(40, 0.5, &mut random), soup(1, 2.0, &mut random)];
    let places = placements(8, &mut random);
    let uses = [0, 0, 0, 1, 2, 2, 0, 2];
    let instances: Vec<_> = uses.into_iter().zip(places).collect();
    let accel = build(&meshes, &instances);
    assert_eq!((accel.shared.len(), accel.is_baked[0]), (2, 1 << 3));
    let mut hits = 0;
    for _ in 0..20_000 {
        let ray = Ray::new(3.0 * random.vector(), random.vector());
        let mut best = (f64::INFINITY, None);
        let mut in_doubt = false;
        for (i, (mesh, to_world)) in instances.iter().enumerate() {
            let (positions, triangles) = &meshes[*mesh as usize];
            let to_world = geometry::widen(to_world);
            for (j, corners) in triangles.iter().enumerate() {
                let place = |c: u32| to_world.transform_point3(positions[c as usize].as_dvec3());
                if let Some((t, inside)) = distance(&ray, corners.map(place)) {
                    in_doubt |= inside.abs() < 1e-4;
                    if inside > 0.0 && t < best.0 {
                        best = (t, Some((i as u32, j as u32)));
                    }
                }
            }
        }
        if in_doubt {
            continue;
        }
        let hit = accel.closest(&ray);
        assert_eq!(hit.map(|hit| (hit.instance, hit.triangle)), best.1, "{ray:?}");
        assert_eq!(accel.occluded(&ray), hit.is_some());
        let Some(hit) = hit else { continue };
        hits += 1;
        let t = f64::from(hit.t);
        assert!((t - best.0).abs() < 1e-4 * best.0.max(1.0), "{t} {best:?}");
        let (mesh, to_world) = &instances[hit.instance as usize];
        let (positions, triangles) = &meshes[*mesh as usize];
        let [a, b, c] =
            triangles[hit.triangle as usize].map(|c| to_world.transform_point3(positions[c as usize]));
        let point = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
        assert!(point.distance(ray.origin + ray.direction * hit.t) < 1e-3);
        // A segment that ends before the hit meets nothing, one that starts behind it something else.
        let before = Ray { t_max: hit.t * 0.999, ..ray };
        assert!(accel.closest(&before).is_none() && !accel.occluded(&before));
        let behind = accel.closest(&Ray { t_min: hit.t * 1.001, ..ray });
        assert!(behind.is_none_or(|behind| behind.t > hit.t));
        // The filter sees through what it rejects.
        let other = accel.closest_where(&ray, &|h| (h.instance, h.triangle) != (hit.instance, hit.triangle));
        assert_eq!(other.map(|h| h.t), behind.map(|h| h.t));
        assert_eq!(
            accel.occluded_where(&ray, &|h| h.triangle != hit.triangle || h.instance != hit.instance),
            other.is_some()
        );
    }
    assert!(hits > 2000, "{hits}");
}

#[test]
fn kernels_agree_in_every_bit() {
    let mut random = Random(2);
    let meshes = [soup(5000, 0.1, &mut random), soup(3000, 0.05, &mut random)];
    let mut instances: Vec<_> = placements(30, &mut random).into_iter().map(|place| (0, place)).collect();
    instances.push((1, Affine3A::IDENTITY));
    let mut accel = build(&meshes, &instances);
    let best = accel.isa;
    for i in 0..50_000 {
        let axis = [Vec3::X, Vec3::NEG_Y, Vec3::Z][i % 3];
        let direction = if i % 7 == 0 { axis } else { random.vector() };
        let ray = Ray { t_max: random.next() * 8.0, ..Ray::new(3.0 * random.vector(), direction) };
        accel.isa = best;
        let (hit, occluded) = (accel.closest(&ray), accel.occluded(&ray));
        accel.isa = Isa::Portable;
        assert_eq!(accel.closest(&ray), hit);
        assert_eq!(accel.occluded(&ray), occluded);
    }
}

#[test]
fn answers_do_not_depend_on_the_number_of_threads() {
    let mut random = Random(3);
    // Twice the same soup: every hit is a tie.
    let mut mesh = soup(20_000, 0.05, &mut random);
    let again: Vec<_> = mesh.1.clone();
    mesh.1.extend(again);
    let meshes = [mesh];
    let instances = [(0, Affine3A::IDENTITY)];
    let in_pool = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| build(&meshes, &instances))
    };
    let accels = [1, 2, 5].map(in_pool);
    for _ in 0..50_000 {
        let ray = Ray::new(2.0 * random.vector(), random.vector());
        let hit = accels[0].closest(&ray);
        assert!(hit.is_none_or(|hit| hit.triangle < 20_000));
        assert!(accels.iter().all(|accel| accel.closest(&ray) == hit));
    }
}

#[test]
fn rays_that_make_no_sense_hit_nothing() {
    let accel = build(&[soup(1000, 0.5, &mut Random(4))], &[(0, Affine3A::IDENTITY)]);
    let good = Ray::new(Vec3::ZERO, Vec3::X);
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut rays = vec![Ray { direction: Vec3::ZERO, ..good }, Ray { t_min: 2.0, t_max: 1.0, ..good }];
    for bad in bad {
        for axis in 0..3 {
            let mut ray = good;
            ray.origin[axis] = bad;
            rays.push(ray);
            let mut ray = good;
            ray.direction[axis] = bad;
            rays.push(ray);
        }
    }
    rays.extend([
        Ray { t_min: f32::NAN, ..good },
        Ray { t_max: f32::NAN, ..good },
        Ray { t_max: -1.0, ..good },
    ]);
    for ray in rays {
        assert_eq!(accel.closest(&ray), None, "{ray:?}");
        assert!(!accel.occluded(&ray), "{ray:?}");
    }
}

#[test]
fn bad_triangles_and_instances_are_dropped_and_counted() {
    let nan = Vec3::new(f32::NAN, 0.0, 0.0);
    let positions =
        vec![Vec3::ZERO, Vec3::X, Vec3::Y, nan, Vec3::splat(f32::INFINITY), 2.0 * Vec3::X, Vec3::splat(1e30)];
    let triangles =
        vec![[0, 1, 2], [0, 1, 3], [3, 3, 3], [4, 1, 2], [0, 1, 5], [0, 0, 1], [1, 1, 1], [0, 1, 6]];
    let singular = Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0));
    let not_finite = Affine3A::from_translation(nan);
    let mesh = (positions, triangles);
    let ray = Ray::new(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    for placed in [1, 2] {
        let mut instances = vec![(0, Affine3A::IDENTITY); placed];
        instances.extend([(0, singular), (0, not_finite), (0, Affine3A::ZERO)]);
        let accel = build(std::slice::from_ref(&mesh), &instances);
        let dropped = Dropped { non_finite_triangles: 4, degenerate_triangles: 3, singular_instances: 3 };
        assert_eq!(accel.dropped(), dropped);
        let hit = accel.closest(&ray).unwrap();
        assert_eq!((hit.t, hit.instance, hit.triangle), (1.0, 0, 0));
        let (min, max) = accel.bounds();
        assert!(min.distance(Vec3::ZERO) < 1e-4 && max.distance(Vec3::new(1.0, 1.0, 0.0)) < 1e-4);
    }
}

#[test]
fn twins_cost_nothing_but_are_there_for_a_filter() {
    let mut mesh = soup(1, 1.0, &mut Random(5));
    mesh.1 = vec![[0, 1, 2]; 1_000_000];
    let centre = mesh.0.iter().sum::<Vec3>() / 3.0;
    let ray = Ray::new(centre + Vec3::new(0.3, 0.1, 2.0), Vec3::new(-0.3, -0.1, -2.0));
    let away = Affine3A::from_translation(Vec3::X * 100.0);
    let once = vec![(0, Affine3A::IDENTITY)];
    for instances in [once, vec![(0, away), (0, Affine3A::IDENTITY)]] {
        let accel = build(std::slice::from_ref(&mesh), &instances);
        let instance = instances.len() as u32 - 1;
        let find = |accept: &dyn Fn(u32) -> bool| {
            let hit = accel.closest_where(&ray, &|hit| accept(hit.triangle));
            assert_eq!(accel.occluded_where(&ray, &|hit| accept(hit.triangle)), hit.is_some());
            hit.map(|hit| (hit.instance, hit.triangle))
        };
        assert_eq!(find(&|_| true), Some((instance, 0)));
        assert_eq!(find(&|triangle| triangle > 0), Some((instance, 1)));
        assert_eq!(find(&|triangle| triangle >= 999_999), Some((instance, 999_999)));
        assert_eq!(find(&|_| false), None);
        let blocks = accel.baked.iter().chain(&accel.shared).map(|tree| tree.blocks.len());
        assert_eq!(blocks.sum::<usize>(), 1);
        (0..10_000).for_each(|_| assert!(accel.closest(&ray).is_some()));
    }
}

/// Triangles in the plane x = `at(i).x` with their right angle at `at(i)` and legs of length `size(i)`.
fn triangles(count: u32, at: impl Fn(f32) -> Vec3, size: impl Fn(f32) -> f32) -> Mesh {
    let corners = |i| [at(i), at(i) + Vec3::Y * size(i), at(i) + Vec3::Z * size(i)];
    let positions = (0..count).flat_map(|i| corners(i as f32)).collect();
    (positions, (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

#[test]
fn evenly_spaced_and_nested_triangles_do_not_stall_the_build() {
    // Where clustering or reinsertion take quadratic time on these, the test takes minutes.
    const COUNT: u32 = 100_000;
    let place = [(0, Affine3A::IDENTITY)];
    let row = build(&[triangles(COUNT, |i| Vec3::X * i, |_| 1.0)], &place);
    let nested = build(&[triangles(COUNT, |_| Vec3::ZERO, |i| 1.0 + 1e-6 * i)], &place);
    let stairs = build(&[triangles(COUNT / 4, |_| Vec3::ZERO, |i| 1.0 + i)], &place);
    for accel in [row, nested, stairs] {
        let ray = Ray::new(Vec3::new(-1.0, 0.2, 0.2), Vec3::X);
        assert_eq!(accel.closest(&ray).map(|hit| (hit.t, hit.triangle)), Some((1.0, 0)));
    }
}

#[test]
fn a_million_instances() {
    let side = 1000;
    let at = |i: u32| Vec3::new((i % side) as f32, (i / side) as f32, 0.0) * 3.0;
    let instances: Vec<_> = (0..side * side).map(|i| (0, Affine3A::from_translation(at(i)))).collect();
    let accel = build(&[triangles(8, |i| Vec3::X * 0.1 * i, |_| 1.0)], &instances);
    assert!(accel.memory_bytes() < 200 << 20, "{} bytes", accel.memory_bytes());
    for i in (0..side * side).step_by(997) {
        let ray = Ray::new(at(i) + Vec3::new(-0.5, 0.2, 0.2), Vec3::X);
        let hit = accel.closest(&ray).map(|hit| (hit.instance, hit.triangle));
        assert_eq!(hit, Some((i, 0)));
    }
}

#[test]
fn slivers_that_would_fill_their_boxes_badly_are_not_baked() {
    let mesh = soup(5000, 0.02, &mut Random(6));
    let turned = Affine3A::from_quat(Quat::from_scaled_axis(Vec3::new(0.3, 0.5, 0.7)));
    let stretched = turned * Affine3A::from_scale(Vec3::new(1.0, 1e-3, 40.0));
    for (to_world, is_baked) in [(turned, true), (stretched, false)] {
        assert_eq!(build(std::slice::from_ref(&mesh), &[(0, to_world)]).is_baked(0), is_baked);
    }
}

#[test]
fn nothing_at_all() {
    let empty = (vec![], vec![]);
    for accel in [
        build(&[], &[]),
        build(std::slice::from_ref(&empty), &[(0, Affine3A::IDENTITY)]),
        build(&[empty], &[(0, Affine3A::IDENTITY); 3]),
    ] {
        assert_eq!(accel.closest(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        assert_eq!(accel.bounds(), (Vec3::ZERO, Vec3::ZERO));
    }
}

#[test]
fn indices_out_of_range_are_errors() {
    let positions = [Vec3::ZERO; 3];
    let mesh = MeshGeometry { positions: &positions, triangles: &[[0, 1, 2], [0, 1, 3]] };
    let error = Accel::build(&[mesh], &[]).err();
    assert_eq!(error, Some(AccelError::VertexOutOfRange { mesh: 0, triangle: 1, vertex: 3, vertices: 3 }));
    let instance = InstanceGeometry { mesh: 1, to_world: Affine3A::IDENTITY };
    let mesh = MeshGeometry { positions: &positions, triangles: &[] };
    let error = Accel::build(&[mesh], &[instance]).err();
    assert_eq!(error, Some(AccelError::MeshOutOfRange { instance: 0, mesh: 1, meshes: 1 }));
}
