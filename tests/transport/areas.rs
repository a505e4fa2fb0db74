//! Cluster areas. What matters of an estimate is what it does to the photons that are divided by it: the mean, over
//! photons that fall uniformly, of the true area over the estimate, which is one for a perfect estimator.

use crate::common::{Stage, icosphere, mean_and_error};
use crate::support::{ON, arrive, sensor, world};
use glam::{DMat4, DVec3, Vec2, Vec3};
use segue::math::sampler::hash_unit;
use segue::math::warp;
use segue::shading::World;
use segue::transport::area::unit_plane_cut;
use segue::transport::cluster::{Areas, Clusters, Numbered};
use segue::transport::grid::Grid;
use segue::transport::sparse::Bits;
use segue::transport::store::{Arrival, Arrivals};
use std::f64::consts::PI;

const GREY: &str = r#"{"surface":{"type":"diffuse","color":0.5}}"#;
/// Edge of the voxels, about.
const EDGE: f32 = 0.12;

/// Photons that fall vertically, or along -x or -y, each uniformly over the side of the unit cube that they meet.
fn photons(world: &World, seed: u32, sides: &[Vec3], count: u32) -> Arrivals {
    let u = |k: u32, d| hash_unit(seed ^ 0x3a11, 4 * k + d);
    (0..count)
        .filter_map(|k| {
            let side = sides[k as usize % sides.len()];
            let across = Vec3::new(u(k, 0), u(k, 1), u(k, 2)) * (Vec3::ONE - side);
            arrive(world, across + side, -side)
        })
        .collect()
}

/// Areas of the clusters, by the method of the engine and by the paper's plane through one of its arrivals.
fn both_areas(world: &World, grid: &Grid, all: Numbered) -> [Vec<f32>; 2] {
    let mut clusters = Clusters::default();
    assert!(clusters.group(world, grid, all, &ON) && clusters.measure(world, grid, all, Areas::True, &ON));
    let each = (0..clusters.arrivals()).map(|i| &clusters.clusters[clusters.of(i)]);
    let by_rays = each.clone().map(|c| 1.0 / c.inverse_area);
    let by_plane = each.map(|c| {
        let representative = all.get(clusters.order[c.first as usize]);
        let (low, edge) = grid.place(&grid.voxel(representative.position));
        edge * edge * unit_plane_cut((representative.position - low) / edge, representative.normal)
    });
    [by_rays.collect(), by_plane.collect()]
}

/// True areas of the clusters of some arrivals, where they are known.
type Truth<'a> = &'a dyn Fn(&Grid, &Arrivals) -> Vec<Option<f64>>;

/// Mean of the true area over the estimate, by the method of the engine and by the paper's plane.
fn bias(world: &World, seeds: u32, photons: impl Fn(u32) -> Arrivals, truth: Truth) -> [f64; 2] {
    let sensor = sensor(EDGE);
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for seed in 0..seeds {
        let photons = photons(seed);
        let grid = Grid::new(&sensor, 1.0, seed);
        let all = Numbered { camera: &Arrivals::default(), light: &photons, ends: &Bits::default() };
        let areas = both_areas(world, &grid, all);
        for (i, exact) in truth(&grid, &photons).into_iter().enumerate() {
            let Some(exact) = exact else { continue };
            count += 1.0;
            for (sum, areas) in sums.iter_mut().zip(&areas) {
                *sum += exact / f64::from(areas[i]);
            }
        }
    }
    sums.map(|s| s / count)
}

/// The part of a voxel in which one of the faces `x = 0`, `y = 0` or `z = 0` of the positive octant lies: a rectangle.
fn of_octant(grid: &Grid, arrivals: &Arrivals, sides: &[Vec3]) -> Vec<Option<f64>> {
    let area = |a: Arrival| {
        let (low, edge) = grid.place(&grid.voxel(a.position));
        let extent = low + edge - low.max(Vec3::ZERO);
        let along_the_face = a.normal.abs().cmplt(Vec3::splat(0.5));
        // a face goes on for ever where no other begins, and ends at one
        let on = |v: Vec3| Vec3::select(along_the_face, v, Vec3::splat(0.5));
        let open = Vec3::ONE - sides.iter().sum::<Vec3>();
        let is_inside = on(low + edge).max_element() < 1.0 && (on(low) * open).min_element() >= 0.0;
        is_inside.then(|| Vec3::select(along_the_face, extent, Vec3::ONE).as_dvec3().element_product())
    };
    arrivals.iter().map(area).collect()
}

#[test]
fn areas_on_a_plane_at_an_edge_and_in_a_corner() {
    let mut s = Stage::default();
    let grey = s.material(GREY);
    let (floor, wall, other) = (Vec3::Z, Vec3::X, Vec3::Y);
    s.quad([[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]], grey);
    let cases = [("plane", vec![floor]), ("edge", vec![floor, wall]), ("corner", vec![floor, wall, other])];
    for (name, sides) in cases {
        match name {
            "edge" => s.quad([[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]], grey),
            "corner" => s.quad([[0., 0., 0.], [0., 0., 1.], [1., 0., 1.], [1., 0., 0.]], grey),
            _ => {}
        }
        let world = world(&mut s);
        let found =
            bias(&world, 24, |seed| photons(&world, seed, &sides, 20_000), &|g, a| of_octant(g, a, &sides));
        println!(
            "{name}: coverage {:+.3} %, plane cut {:+.3} %",
            100.0 * (found[0] - 1.0),
            100.0 * (found[1] - 1.0)
        );
        assert!((found[0] - 1.0).abs() < 4e-3, "{name}: {found:?}");
        // where the surface ends inside a voxel, the plane goes on and photons are divided by too much
        match sides.len() {
            1 => assert!((found[1] - 1.0).abs() < 0.04, "{found:?}"),
            _ => assert!(found[1] < found[0], "{found:?}"),
        }
    }
}

#[test]
fn of_a_thin_plate_one_side_counts() {
    let mut s = Stage::default();
    let grey = s.material(GREY);
    s.quad([[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]], grey);
    // its lower side, so near that what is lifted off it is above both
    let z = -0.03 * EDGE;
    s.quad([[0., 0., z], [0., 1., z], [1., 1., z], [1., 0., z]], grey);
    let world = world(&mut s);
    let sides = [Vec3::Z];
    let [found, _] =
        bias(&world, 24, |seed| photons(&world, seed, &sides, 20_000), &|g, a| of_octant(g, a, &sides));
    println!("thin plate: coverage {:+.3} %", 100.0 * (found - 1.0));
    assert!((found - 1.0).abs() < 4e-3, "{found}");
}

#[test]
fn a_ribbon_that_few_points_of_its_voxels_meet() {
    let (x, width) = (0.5, EDGE / 300.0);
    let mut s = Stage::default();
    let grey = s.material(GREY);
    s.quad([[x, 0., 0.], [x + width, 0., 0.], [x + width, 1., 0.], [x, 1., 0.]], grey);
    let world = world(&mut s);
    let fall = |seed| {
        let u = |k: u32, d| hash_unit(seed ^ 0x517b, 2 * k + d);
        let from = |k| Vec3::new(x + width * u(k, 0), u(k, 1), 1.0);
        (0..400).filter_map(|k| arrive(&world, from(k), -Vec3::Z)).collect()
    };
    let truth = |grid: &Grid, arrivals: &Arrivals| {
        let area = |a: Arrival| {
            let (low, edge) = grid.place(&grid.voxel(a.position));
            let across = (low.x + edge).min(x + width) - low.x.max(x);
            (low.y >= 0.0 && low.y + edge < 1.0).then(|| f64::from(across * edge))
        };
        arrivals.iter().map(area).collect()
    };
    let [found, _] = bias(&world, 200, fall, &truth);
    println!("ribbon: coverage {:+.2} %", 100.0 * (found - 1.0));
    assert!((found - 1.0).abs() < 0.02, "{found}");
}

#[test]
fn a_tilted_plane_is_cut_exactly() {
    let mut s = Stage::default();
    let grey = s.material(GREY);
    let corners = [[-99., -9., -60.], [99., -9., 61.], [0., 99., 20.]].map(Vec3::from);
    let mesh = s.mesh(&corners, &[0, 1, 2], None);
    s.place(mesh, grey, DMat4::IDENTITY);
    let world = world(&mut s);
    let sensor = sensor(EDGE);
    for seed in 0..20 {
        let u = |d| hash_unit(seed, d) - 0.5;
        let a = arrive(&world, Vec3::new(u(0), u(1), 99.0), -Vec3::Z).unwrap();
        let grid = Grid::new(&sensor, 1.0, seed);
        let (low, edge) = grid.place(&grid.voxel(a.position));
        // points of the plane above a fine lattice, those inside the voxel
        let n = 1000;
        let cell = edge / n as f32;
        let inside = (0..n * n)
            .filter(|k| {
                let p = low + Vec3::new((k % n) as f32 + 0.5, (k / n) as f32 + 0.5, 0.0) * cell;
                let z = a.position.z - ((p - a.position) * a.normal).truncate().element_sum() / a.normal.z;
                (low.z..low.z + edge).contains(&z)
            })
            .count();
        let exact = inside as f32 * cell * cell / a.normal.z.abs();
        let mut clusters = Clusters::default();
        let all = Numbered {
            camera: &Arrivals::default(),
            light: &[a, a].into_iter().collect(),
            ends: &Bits::default(),
        };
        assert!(
            clusters.group(&world, &grid, all, &ON) && clusters.measure(&world, &grid, all, Areas::True, &ON)
        );
        let got = clusters.clusters[0].area;
        assert!((got / exact - 1.0).abs() < 5e-3, "{got} {exact}");
    }
}

/// On a sphere a cluster is what its voxel and its bin of normals share, in two parts where it curves out of sight:
/// no closed form. But the density of uniform photons that uniform points find there is known.
#[test]
fn photons_on_spheres_are_as_dense_as_they_are() {
    for radius in [0.4f32, 1.0, 3.0] {
        let mut s = Stage::default();
        let grey = s.material(GREY);
        let (points, triangles) = icosphere(5);
        let mesh = s.mesh(&points, &triangles, Some(&points));
        s.place(mesh, grey, DMat4::from_scale(DVec3::splat(f64::from(radius))));
        let world = world(&mut s);
        let uniform = |seed: u32, count: u32| -> Arrivals {
            let direction =
                |k: u32| warp::uniform_sphere(Vec2::new(hash_unit(seed, 2 * k), hash_unit(seed, 2 * k + 1)));
            (0..count).filter_map(|k| arrive(&world, 2.0 * radius * direction(k), -direction(k))).collect()
        };
        let sensor = sensor(EDGE);
        let (photons, queries) = ((15_000.0 * radius * radius) as u32, 10_000);
        let exact = f64::from(photons) / (4.0 * PI * f64::from(radius * radius));
        let density = |seed: u32| {
            let (camera, light) = (uniform(2 * seed, queries), uniform(2 * seed + 1, photons));
            let grid = Grid::new(&sensor, 1.0, seed);
            let all = Numbered { camera: &camera, light: &light, ends: &Bits::default() };
            // every query finds the photons of its cluster, each over the cluster's area
            let areas = both_areas(&world, &grid, all);
            let mut clusters = Clusters::default();
            assert!(clusters.group(&world, &grid, all, &ON));
            areas.map(|areas| {
                let found = |i: usize| {
                    let c = &clusters.clusters[clusters.of(i)];
                    f64::from(c.lights) / f64::from(areas[i])
                };
                (0..camera.len()).map(found).sum::<f64>() / f64::from(queries) / exact
            })
        };
        let found: Vec<[f64; 2]> = (0..12).map(density).collect();
        let (covered, sigma) = mean_and_error(&found.iter().map(|f| f[0]).collect::<Vec<_>>());
        let (plane, _) = mean_and_error(&found.iter().map(|f| f[1]).collect::<Vec<_>>());
        println!(
            "sphere of {:.0} voxels: coverage {:+.2} % (+- {:.2}), plane cut {:+.2} %",
            radius / EDGE,
            100.0 * (covered - 1.0),
            100.0 * sigma,
            100.0 * (plane - 1.0)
        );
        assert!((covered - 1.0).abs() < 0.01 + 3.0 * sigma, "{covered} +- {sigma}");
        assert!(sigma < 0.01, "too noisy: {sigma}");
    }
}

/// What arrivals near the edge of a plate far above a floor, on the side that the camera sees, find there: photons over area,
/// relative to how dense they are on that side. `densities`: photons on either side, seen and hidden, per area. `marks`:
/// whether clusters are told that something ends there. The mean and its standard error.
fn density_beside_an_edge(densities: [f64; 2], seeds: u32, marks: bool) -> (f64, f64) {
    let mut s = Stage::default();
    let grey = s.material(GREY);
    s.quad([[-1., -1., -2.], [1., -1., -2.], [1., 1., -2.], [-1., 1., -2.]], grey);
    s.quad([[0., -1., -1.], [1., -1., -1.], [1., 1., -1.], [0., 1., -1.]], grey);
    let world = world(&mut s);
    let sensor = sensor(EDGE);
    // over a strip to either side of the edge, twice as long
    let width = 0.25f32;
    let on = |side: f32, count: u32, seed: u32| {
        let u = move |k| hash_unit(seed, k);
        let at = move |k| Vec3::new(side * width * u(2 * k), width * (2.0 * u(2 * k + 1) - 1.0), -1.5);
        let world = &world;
        (0..count).filter_map(move |k| arrive(world, at(k), Vec3::NEG_Z))
    };
    let found = |seed: u32| {
        let [seen, hidden] = densities.map(|d| (d * f64::from(2.0 * width * width)).round() as u32);
        let light: Arrivals = on(-1.0, seen, 4 * seed).chain(on(1.0, hidden, 4 * seed + 1)).collect();
        // within a voxel of the edge, and away from the ends of the strip
        let near = |a: &Arrival| a.position.x > -EDGE && a.position.y.abs() < width - 2.0 * EDGE;
        let camera: Arrivals = on(-1.0, 4000, 4 * seed + 2).filter(near).collect();
        let mut ends = Bits::default();
        (0..camera.len()).filter(|_| marks).for_each(|i| ends.mark(i));
        let grid = Grid::new(&sensor, 1.0, seed);
        let all = Numbered { camera: &camera, light: &light, ends: &ends };
        let mut clusters = Clusters::default();
        assert!(clusters.group(&world, &grid, all, &ON));
        assert!(clusters.measure(&world, &grid, all, Areas::OfPhotons, &ON));
        let at = |i: usize| {
            let c = &clusters.clusters[clusters.of(i)];
            f64::from(c.lights) * f64::from(c.inverse_area)
        };
        (0..camera.len()).map(at).sum::<f64>() / camera.len() as f64 / densities[0]
    };
    mean_and_error(&(0..seeds).map(found).collect::<Vec<_>>())
}

#[test]
fn what_the_camera_does_not_see_is_apart() {
    let densities = [4_000.0, 20_000.0];
    let ((apart, sigma), (joined, _)) =
        (density_beside_an_edge(densities, 240, true), density_beside_an_edge(densities, 40, false));
    println!("seen alone {apart} +- {sigma}, joined {joined}");
    assert!((apart - 1.0).abs() < 0.01 + 3.0 * sigma && sigma < 0.01, "{apart} +- {sigma}");
    assert!(joined > 1.3, "{joined}");
}

/// About one photon in a voxel: whether any is hidden must not decide over what area those that are not are counted.
#[test]
fn photons_do_not_decide_what_is_apart() {
    let few = 1.0 / f64::from(EDGE * EDGE);
    let (found, sigma) = density_beside_an_edge([few, few], 2000, true);
    println!("one photon in a voxel: {found} +- {sigma}");
    assert!((found - 1.0).abs() < 0.01 + 3.0 * sigma && sigma < 0.02, "{found} +- {sigma}");
}
