//! Rays that leave surfaces: they never meet the triangle they start on, and they do meet what is just above it.

use glam::{Affine3A, DVec3, Mat3, Quat, Vec3};

use super::super::{InstanceGeometry, MeshGeometry};
use super::*;

const RAYS: u32 = 20_000;

/// Random numbers in [0, 1) by position.
fn random(index: u32, dimension: u32) -> f32 {
    let mut x =
        index.wrapping_mul(0x9E37_79B9) ^ dimension.wrapping_mul(0x85EB_CA6B).wrapping_add(0x27D4_EB2F);
    x = (x ^ (x >> 16)).wrapping_mul(0x7FEB_352D);
    x = (x ^ (x >> 15)).wrapping_mul(0x846C_A68B);
    (x ^ (x >> 16)) as f32 / u32::MAX as f32
}

fn vector(index: u32, dimension: u32) -> Vec3 {
    Vec3::new(random(index, dimension), random(index, dimension + 1), random(index, dimension + 2)) * 2.0
        - 1.0
}

fn barycentrics(index: u32, dimension: u32) -> [f32; 2] {
    let (a, b) = (random(index, dimension), random(index, dimension + 1));
    if a + b < 1.0 { [a, b] } else { [1.0 - a, 1.0 - b] }
}

/// A way to put a triangle of size one into the world: by its vertices alone, or also by an instance's transform.
struct Place {
    name: String,
    /// Applied to the vertices.
    vertices: Affine3A,
    to_world: Affine3A,
    /// Puts the mesh to use twice, so that it is not baked.
    is_shared: bool,
}

fn places() -> Vec<Place> {
    let turn = Quat::from_scaled_axis(Vec3::new(0.4, -0.9, 1.3));
    let turned = Mat3::from_quat(turn);
    let mut transforms = vec![];
    for scale in [1e-4, 1e-2, 1.0, 1e3, 1e6] {
        let place = Affine3A::from_scale_rotation_translation(
            Vec3::splat(scale),
            turn,
            Vec3::new(0.3, -2.0, 1.1) * scale,
        );
        transforms.push((format!("size {scale}"), place));
    }
    for offset in [Vec3::splat(1e5), Vec3::new(-1e5, 0.0, 2e4)] {
        transforms.push((format!("at {offset}"), Affine3A::from_rotation_translation(turn, offset)));
    }
    let shear = Mat3::from_cols(Vec3::X, Vec3::new(1.3, 1.0, 0.2), Vec3::new(-0.4, 0.9, 1.0));
    transforms
        .push(("sheared".into(), Affine3A::from_mat3_translation(turned * shear, Vec3::new(1.0, 2.0, 3.0))));
    let mirror = Mat3::from_diagonal(Vec3::new(1.0, -1.0, 1.0));
    transforms.push(("mirrored".into(), Affine3A::from_mat3(turned * mirror)));
    let squash = Mat3::from_diagonal(Vec3::new(1.0, 0.01, 30.0));
    transforms.push(("squashed".into(), Affine3A::from_mat3(turned * squash)));
    transforms.push(("squashed later".into(), Affine3A::from_mat3(squash * turned)));
    let mut places = vec![];
    for (name, transform) in transforms {
        for (how, vertices, to_world, is_shared) in [
            ("vertices", transform, Affine3A::IDENTITY, false),
            ("baked", Affine3A::IDENTITY, transform, false),
            ("instance", Affine3A::IDENTITY, transform, true),
        ] {
            places.push(Place { name: format!("{name}, by {how}"), vertices, to_world, is_shared });
        }
    }
    places
}

struct Scene {
    accel: Accel,
    triangles: Vec<[Vec3; 3]>,
    to_world: Affine3A,
}

impl Scene {
    fn new(triangles: Vec<[Vec3; 3]>, place: &Place) -> Self {
        let put = |p| place.vertices.transform_point3(p);
        let triangles: Vec<_> = triangles.into_iter().map(|corners| corners.map(put)).collect();
        let positions = triangles.as_flattened();
        let indices: Vec<_> = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mesh = MeshGeometry { positions, triangles: &indices };
        let mut instances = vec![InstanceGeometry { mesh: 0, to_world: place.to_world }];
        if place.is_shared {
            let away = Affine3A::from_translation(Vec3::splat(1e9)) * place.to_world;
            instances.push(InstanceGeometry { mesh: 0, to_world: away });
        }
        let accel = Accel::build(&[mesh], &instances).unwrap();
        Self { accel, triangles, to_world: place.to_world }
    }

    fn point(&self, triangle: usize, barycentrics: [f32; 2]) -> SurfacePoint {
        self.accel.surface_point(0, self.triangles[triangle], &self.to_world, barycentrics)
    }
}

/// Triangles of all shapes, around the origin.
fn triangle(shape: u32) -> [Vec3; 3] {
    let [a, b, c] = [0, 3, 6].map(|dimension| vector(shape, dimension));
    match shape % 4 {
        0 => [a, a.lerp(b, 0.01), c],
        1 => [a, b, a.lerp(b, 0.3) + 0.003 * c],
        _ => [a, b, c],
    }
}

/// How far along the normal the rounding of a direction moves it, on its way to the mesh's space too: a direction that
/// rises less may turn to the other side.
fn doubt(point: &SurfacePoint, direction: Vec3) -> f32 {
    16.0 * ROUNDING * point.normal.abs().dot(4.0 * direction.abs() + point.amplification * direction.abs())
}

fn is_doubtful(point: &SurfacePoint, direction: Vec3) -> bool {
    point.normal.dot(direction).abs() < doubt(point, direction)
}

#[test]
fn leaving_rays_do_not_meet_their_own_triangle() {
    for place in places() {
        for shape in 0..8 {
            let scene = Scene::new(vec![triangle(shape)], &place);
            for i in 0..RAYS / 8 {
                let point = scene.point(0, barycentrics(i, 0));
                let direction = vector(i, 2);
                if is_doubtful(&point, direction) {
                    continue;
                }
                let ray = point.spawn(direction);
                let hit = scene.accel.closest(&ray);
                assert!(hit.is_none(), "{}, shape {shape}: {ray:?} meets {hit:?}", place.name);
                assert!(!scene.accel.occluded(&ray), "{}, shape {shape}: {ray:?}", place.name);
            }
        }
    }
}

#[test]
fn the_error_bounds_the_distance_from_the_plane() {
    for place in places() {
        let scene = Scene::new(vec![triangle(2)], &place);
        let to_world = widen(&scene.to_world);
        let [a, b, c] = scene.triangles[0].map(|p| match scene.accel.is_baked(0) {
            true => bake_point(&to_world, p).as_dvec3(),
            false => to_world.transform_point3(p.as_dvec3()),
        });
        let normal = (b - a).cross(c - a).normalize();
        for i in 0..RAYS / 8 {
            let point = scene.point(0, barycentrics(i, 0));
            let off = normal.dot(point.position.as_dvec3() - a).abs();
            assert!(
                off <= normal.abs().dot(point.error.as_dvec3()) * 1.000_001,
                "{}: {off} {point:?}",
                place.name
            );
            for direction in [point.normal, -point.normal] {
                let origin = spawn_origin(point.position, point.error, point.normal, direction);
                let height = normal.dot(origin.as_dvec3() - a) * normal.dot(direction.as_dvec3()).signum();
                assert!(height >= 0.0, "{}: {height}", place.name);
                // Not much farther than needed: a few spacings of the numbers involved.
                let spacing = (point.position.abs().max_element() + point.error.max_element()) * f32::EPSILON;
                let bound = 2.0 * point.error.length() + 4.0 * spacing;
                assert!(height as f32 <= bound, "{}: {height} > {bound}", place.name);
            }
        }
    }
}

#[test]
fn leaving_rays_meet_what_is_just_above() {
    // A second sheet above the first, at a few times the distance that rays start at.
    for place in places() {
        let base = [Vec3::new(-1.0, -1.0, 0.1), Vec3::new(1.0, -0.9, 0.2), Vec3::new(0.1, 1.1, -0.1)];
        let single = Scene::new(vec![base], &place);
        let middle = single.point(0, [0.3, 0.3]);
        // In mesh space, the distance that is as many spacings of world space.
        let linear = widen(&(place.to_world * place.vertices)).matrix3;
        let normal = geometric_normal(base.map(Vec3::as_dvec3)).normalize();
        let world_normal = linear.inverse().transpose() * normal;
        let largest = single.point(0, [0.0, 0.0]).position.abs().max(middle.position.abs()).max_element();
        let gap = 24.0 * f64::from(middle.error.length() + largest * f32::EPSILON) * world_normal.length();
        let above = base.map(|p| (p.as_dvec3() + normal * gap).as_vec3());
        let scene = Scene::new(vec![base, above], &place);
        // Slanted, but not so far that the ray passes the sheet above by its side.
        let slant = (0.05 / gap).min(0.5);
        for i in 0..RAYS / 8 {
            let [u, v] = barycentrics(i, 0);
            // Away from the edge, so that the sheet above is met.
            let point = scene.point(0, [0.1 + 0.7 * u, 0.1 + 0.7 * v]);
            let sideways = vector(i, 2).as_dvec3().reject_from(normal);
            let direction = (linear * (normal + slant * sideways)).as_vec3();
            if is_doubtful(&point, direction) {
                continue;
            }
            let hit = scene.accel.closest(&point.spawn(direction));
            assert_eq!(hit.map(|hit| hit.triangle), Some(1), "{}: {gap:e} {point:?}", place.name);
            // Downwards there is nothing.
            assert_eq!(scene.accel.closest(&point.spawn(-direction)), None, "{}", place.name);
            // From between the sheets, the way to each is free, and the way through each is not.
            let other = scene.point(1, [0.1 + 0.7 * u, 0.1 + 0.7 * v]);
            assert!(!scene.accel.occluded(&point.segment_to(&other)), "{}", place.name);
        }
    }
}

#[test]
fn segments_between_surfaces_meet_neither() {
    for place in places() {
        for shape in 0..8 {
            let target = triangle(shape + 8).map(|p| p * 1.5 + Vec3::new(2.0, 1.0, 0.0));
            let scene = Scene::new(vec![triangle(shape), target], &place);
            let mut seen = 0;
            for i in 0..RAYS / 8 {
                let from = scene.point(0, barycentrics(i, 0));
                let to = scene.point(1, barycentrics(i, 2));
                let way = to.position - from.position;
                if is_doubtful(&from, way) || is_doubtful(&to, way) || crosses(&scene, &from, &to) {
                    continue;
                }
                seen += 1;
                let there = from.segment_to(&to);
                assert!(!scene.accel.occluded(&there), "{}, shape {shape}: {there:?}", place.name);
                let back = to.segment_to(&from);
                assert!(!scene.accel.occluded(&back), "{}, shape {shape}: {back:?}", place.name);
            }
            assert!(seen > RAYS / 400, "{}, shape {shape}: {seen}", place.name);
        }
    }
}

/// Whether one of the two triangles lies in the way, well away from the ends.
fn crosses(scene: &Scene, from: &SurfacePoint, to: &SurfacePoint) -> bool {
    let (a, b) = (from.position.as_dvec3(), to.position.as_dvec3());
    let to_world = widen(&scene.to_world);
    scene.triangles.iter().any(|corners| {
        let [p, q, r] = corners.map(|c| to_world.transform_point3(c.as_dvec3()));
        let normal = geometric_normal([p, q, r]);
        let (ha, hb) = (normal.dot(a - p), normal.dot(b - p));
        let end = 1e-3 * ha.abs().max(hb.abs());
        if ha.abs() < end || hb.abs() < end || (ha > 0.0) == (hb > 0.0) {
            return false;
        }
        let x = a.lerp(b, ha / (ha - hb));
        let side = |p: DVec3, q: DVec3| normal.dot((q - p).cross(x - p)) > -1e-3 * normal.length_squared();
        side(p, q) && side(q, r) && side(r, p)
    })
}

#[test]
fn a_blocker_between_two_surfaces_is_met() {
    for place in places() {
        let square = |z: f32| [Vec3::new(-1.0, -1.0, z), Vec3::new(1.0, -1.0, z), Vec3::new(0.0, 1.5, z)];
        let sizes = [0.0, 1e-3, 0.5, 0.999, 1.0];
        for blocker in 1..4 {
            let scene = Scene::new([sizes[0], sizes[4], sizes[blocker]].map(square).to_vec(), &place);
            let gap = sizes[blocker].min(1.0 - sizes[blocker]);
            for i in 0..RAYS / 80 {
                let [u, v] = barycentrics(i, 0);
                let at = [0.2 + 0.4 * u, 0.2 + 0.4 * v];
                let (from, to) = (scene.point(0, at), scene.point(1, at));
                // Where `f32` cannot tell the sheets apart there is nothing to ask.
                let thickness = (to.position - from.position).length() * gap;
                let error =
                    (from.error + to.error).length() + from.position.abs().max_element() * f32::EPSILON;
                if thickness > 32.0 * error {
                    assert!(scene.accel.occluded(&from.segment_to(&to)), "{}, {gap}", place.name);
                    assert!(scene.accel.occluded(&to.segment_to(&from)), "{}, {gap}", place.name);
                    assert!(
                        scene.accel.occluded(&from.segment_to_point(to.position)),
                        "{}, {gap}",
                        place.name
                    );
                }
            }
        }
    }
}

#[test]
fn the_normal_keeps_its_side_in_a_mirror() {
    let place =
        |to_world| Place { name: String::new(), vertices: Affine3A::IDENTITY, to_world, is_shared: false };
    let plain = Scene::new(vec![[Vec3::ZERO, Vec3::X, Vec3::Y]], &place(Affine3A::IDENTITY));
    assert_eq!(plain.point(0, [0.2, 0.2]).normal, Vec3::Z);
    let mirror = Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let mirrored = Scene::new(vec![[Vec3::ZERO, Vec3::X, Vec3::Y]], &place(mirror));
    assert_eq!(mirrored.point(0, [0.2, 0.2]).normal, Vec3::Z);
}
