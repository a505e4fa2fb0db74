//! The meshes, and the rays: from a camera, then two diffuse bounces, and to a light from the first two surfaces.

use glam::{Affine3A, Vec3};
use segue::accel::offset::SurfacePoint;
use segue::accel::{Accel, Hit, Ray};
use segue::math::Frame;

/// Side of the square picture, in pixels.
const PICTURE: u32 = 512;

/// A mesh, and where to look at it from.
pub struct Scene {
    pub name: &'static str,
    pub positions: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    eye: Vec3,
    target: Vec3,
    /// One corner of the light and its two sides.
    light: [Vec3; 3],
}

/// Random numbers in [0, 1) by position.
fn random(index: u64, dimension: u64) -> f32 {
    let mut x = (index << 8 | dimension).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

impl Scene {
    fn grid(&mut self, n: u32, place: impl Fn(f32, f32) -> Vec3) {
        let first = self.positions.len() as u32;
        let at = |i: u32| i as f32 / n as f32;
        self.positions
            .extend((0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| place(at(i), at(j))));
        for j in 0..n {
            for i in 0..n {
                let a = first + j * (n + 1) + i;
                self.triangles.extend([[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]);
            }
        }
    }

    fn sphere(&mut self, n: u32, centre: Vec3, radius: f32, bumps: f32) {
        let (tau, pi) = (std::f32::consts::TAU, std::f32::consts::PI);
        self.grid(n, |i, j| {
            let (sin, cos) = (pi * j).sin_cos();
            let d = Vec3::new(sin * (tau * i).cos(), cos, sin * (tau * i).sin());
            let bump = (37.0 * d.x).sin() * (31.0 * d.y).sin() * (29.0 * d.z).sin();
            centre + d * radius * (1.0 + bumps * bump)
        });
    }

    /// A room with two finely displaced spheres, five coarse ones and plain walls: about a million triangles.
    pub fn room() -> Self {
        let mut scene = Self {
            name: "room",
            positions: vec![],
            triangles: vec![],
            eye: Vec3::new(0.0, 2.2, 4.6),
            target: Vec3::new(0.0, 1.2, 0.0),
            light: [Vec3::new(-1.0, 4.9, -1.0), Vec3::X * 2.0, Vec3::Z * 2.0],
        };
        scene.sphere(500, Vec3::new(-1.6, 1.5, -0.5), 1.4, 0.06);
        scene.sphere(500, Vec3::new(1.7, 1.3, -1.2), 1.2, 0.04);
        for i in 0..5 {
            scene.sphere(56, Vec3::new(i as f32 * 1.6 - 3.2, 0.5, 1.6), 0.45, 0.0);
        }
        for axis in 0..3 {
            for side in [-5.0, 5.0] {
                scene.grid(1, |i, j| {
                    let mut p = Vec3::splat(side);
                    p[(axis + 1) % 3] = 10.0 * i - 5.0;
                    p[(axis + 2) % 3] = 10.0 * j - 5.0;
                    Vec3::new(p.x, p.y * 0.5 + 2.5, p.z)
                });
            }
        }
        scene
    }

    /// A million triangles of random shape and place, one in fifty of them a long sliver.
    pub fn soup() -> Self {
        let mut scene = Self {
            name: "soup",
            positions: vec![],
            triangles: vec![],
            eye: Vec3::new(0.3, 0.4, 1.4),
            target: Vec3::ZERO,
            light: [Vec3::new(-0.4, 0.99, -0.4), Vec3::X * 0.8, Vec3::Z * 0.8],
        };
        for t in 0..1_000_000u64 {
            let vector = |d| Vec3::new(random(t, d), random(t, d + 1), random(t, d + 2)) * 2.0 - 1.0;
            let centre = vector(0);
            let size = if t % 50 == 0 { 0.3 } else { 0.012 };
            let long = vector(3) * size;
            let wide = vector(6) * 0.012;
            let first = scene.positions.len() as u32;
            scene.positions.extend([centre, centre + long, centre + wide]);
            scene.triangles.push([first, first + 1, first + 2]);
        }
        scene
    }

    /// Named sets of rays; the flag says that any hit will do.
    pub fn rays(&self, accel: &Accel) -> Vec<(&'static str, bool, Vec<Ray>)> {
        let primary = self.camera_rays();
        let first = self.points(accel, &primary);
        let bounce1 = self.bounce(&first, 1);
        let second = self.points(accel, &bounce1);
        let bounce2 = self.bounce(&second, 2);
        let (shadow1, shadow2) = (self.shadows(&first, 3), self.shadows(&second, 4));
        vec![
            ("primary", false, primary),
            ("bounce 1", false, bounce1),
            ("bounce 2", false, bounce2),
            ("shadow 1", true, shadow1),
            ("shadow 2", true, shadow2),
        ]
    }

    /// One ray a pixel, in tiles of 8 by 8.
    fn camera_rays(&self) -> Vec<Ray> {
        let frame = Frame::from_normal((self.target - self.eye).normalize());
        (0..PICTURE * PICTURE)
            .map(|i| {
                let (tile, pixel) = (i / 64, i % 64);
                let x = tile % (PICTURE / 8) * 8 + pixel % 8;
                let y = tile / (PICTURE / 8) * 8 + pixel / 8;
                let at = |p: u32| (p as f32 + 0.5) / PICTURE as f32 * 1.4 - 0.7;
                Ray::new(self.eye, frame.to_world(Vec3::new(at(x), at(y), 1.0)).normalize())
            })
            .collect()
    }

    /// Where rays hit, and the normal on their side.
    fn points(&self, accel: &Accel, rays: &[Ray]) -> Vec<(SurfacePoint, Vec3)> {
        let point = |ray: &Ray, Hit { instance, triangle, u, v, .. }| {
            let vertices = self.triangles[triangle as usize].map(|c| self.positions[c as usize]);
            let point = accel.surface_point(instance, vertices, &Affine3A::IDENTITY, [u, v]);
            let facing = if point.normal.dot(ray.direction) > 0.0 { -point.normal } else { point.normal };
            (point, facing)
        };
        rays.iter().filter_map(|ray| accel.closest(ray).map(|hit| point(ray, hit))).collect()
    }

    fn bounce(&self, points: &[(SurfacePoint, Vec3)], dimension: u64) -> Vec<Ray> {
        let ray = |(i, (point, facing)): (usize, &(SurfacePoint, Vec3))| {
            let (r, angle) = (random(i as u64, 2 * dimension), random(i as u64, 2 * dimension + 1));
            let (sin, cos) = (std::f32::consts::TAU * angle).sin_cos();
            let local = Vec3::new(r.sqrt() * cos, r.sqrt() * sin, (1.0 - r).sqrt());
            point.spawn(Frame::from_normal(*facing).to_world(local))
        };
        points.iter().enumerate().map(ray).collect()
    }

    fn shadows(&self, points: &[(SurfacePoint, Vec3)], dimension: u64) -> Vec<Ray> {
        let [corner, side, other] = self.light;
        let ray = |(i, (point, _)): (usize, &(SurfacePoint, Vec3))| {
            let (u, v) = (random(i as u64, 2 * dimension), random(i as u64, 2 * dimension + 1));
            point.segment_to_point(corner + side * u + other * v)
        };
        points.iter().enumerate().map(ray).collect()
    }
}
