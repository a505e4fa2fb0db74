//! Small scenes and renders for the integration tests.
#![allow(dead_code)] // each test file uses its part

use glam::{DMat4, DVec3, Vec3};
use segue::film::{Pass, Rect};
use segue::scene::mesh::MeshInput;
use segue::scene::{InstanceGroup, SceneBuilder};
use segue::session::settings::Settings;
use segue::session::{Events, Progress, Session};

/// Listens to nothing.
pub struct Silent;

impl Events for Silent {
    fn progress(&mut self, _: &Progress) -> bool {
        false
    }
    fn tile(&mut self, _: Rect) {}
}

/// A unit sphere of triangles: an icosahedron, each face split into four `levels` times. Faces wind
/// counter-clockwise seen from outside.
pub fn icosphere(levels: u32) -> (Vec<Vec3>, Vec<u32>) {
    let t = (1.0 + 5f32.sqrt()) / 2.0;
    #[rustfmt::skip]
    let corners = [(-1.0, t, 0.0), (1.0, t, 0.0), (-1.0, -t, 0.0), (1.0, -t, 0.0), (0.0, -1.0, t), (0.0, 1.0, t),
                   (0.0, -1.0, -t), (0.0, 1.0, -t), (t, 0.0, -1.0), (t, 0.0, 1.0), (-t, 0.0, -1.0), (-t, 0.0, 1.0)];
    let mut points: Vec<Vec3> = corners.iter().map(|&(x, y, z)| Vec3::new(x, y, z).normalize()).collect();
    #[rustfmt::skip]
    let mut faces: Vec<[u32; 3]> = vec![
        [0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
        [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
        [8, 6, 7], [9, 8, 1]];
    for _ in 0..levels {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let split = |[a, b, c]: [u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    (points, faces.into_iter().flatten().collect())
}

/// Builds scenes with little text.
#[derive(Default)]
pub struct Stage(pub SceneBuilder);

pub fn matrix(m: DMat4) -> [f64; 16] {
    m.transpose().to_cols_array()
}

impl Stage {
    pub fn mesh(&mut self, points: &[Vec3], triangles: &[u32], normals: Option<&[Vec3]>) -> u32 {
        let normals = normals.map(|n| (n, segue::scene::mesh::Interpolation::Vertex));
        let input =
            MeshInput { name: "mesh", points, face_indices: triangles, normals, ..Default::default() };
        self.0.add_mesh(&input).unwrap()
    }

    pub fn material(&mut self, json: &str) -> u32 {
        self.0.add_material("material", json).unwrap()
    }

    pub fn light(&mut self, json: &str) {
        self.0.add_light("light", json).unwrap();
    }

    pub fn place(&mut self, mesh: u32, material: u32, at: DMat4) {
        let group = InstanceGroup {
            name: "object".into(),
            mesh,
            materials: vec![material],
            camera_visible: true,
            two_sided_emission: true,
            object_index: 3,
        };
        self.0.add_instances(group, &[matrix(at)]).unwrap();
    }

    /// A quad between four corners, counter-clockwise seen from where it faces.
    pub fn quad(&mut self, corners: [[f32; 3]; 4], material: u32) {
        let mesh = self.mesh(&corners.map(Vec3::from), &[0, 1, 2, 0, 2, 3], None);
        self.place(mesh, material, DMat4::IDENTITY);
    }

    /// The corner of a room, two units wide and open to the camera's side.
    pub fn corner(&mut self, wall: u32) {
        self.quad([[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]], wall);
        self.quad([[-1., 1., 0.], [1., 1., 0.], [1., 1., 2.], [-1., 1., 2.]], wall);
        self.quad([[-1., -1., 0.], [-1., 1., 0.], [-1., 1., 2.], [-1., -1., 2.]], wall);
        self.quad([[-1., -1., 2.], [-1., 1., 2.], [1., 1., 2.], [1., -1., 2.]], wall);
    }

    /// A horizontal square of half side `size` at height 0, facing +z.
    pub fn floor(&mut self, size: f32, material: u32) {
        let p =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0) * size);
        let mesh = self.mesh(&p, &[0, 1, 2, 0, 2, 3], None);
        self.place(mesh, material, DMat4::IDENTITY);
    }

    /// A camera at `eye` that looks at `target`; `more` are further JSON keys, each with a leading comma.
    pub fn camera(&mut self, eye: DVec3, target: DVec3, half_window: f64, more: &str) {
        let up = if (target - eye).normalize().z.abs() > 0.9 { DVec3::Y } else { DVec3::Z };
        let z = (eye - target).normalize();
        let x = up.cross(z).normalize();
        let m =
            matrix(DMat4::from_cols(x.extend(0.0), z.cross(x).extend(0.0), z.extend(0.0), eye.extend(1.0)));
        let json =
            format!(r#"{{"transform":{m:?},"window":[{0},{1},{0},{1}]{more}}}"#, -half_window, half_window);
        self.0.set_camera("camera", &json).unwrap();
    }

    /// Renders a square picture; `more` are further JSON keys of the settings.
    pub fn render(&self, side: u32, samples: u32, more: &str) -> Session {
        let json = format!(r#"{{"resolution":[{side},{side}],"samples":{samples}{more}}}"#);
        let session = Session::new(self.0.build().unwrap(), Settings::from_json(&json).unwrap()).unwrap();
        session.run(&mut Silent).unwrap();
        session
    }
}

/// Mean of a pass over the picture, averaged over its channels (without alpha).
pub fn mean(session: &Session, pass: Pass) -> f64 {
    let values = session.film().read_pass(pass, session.film().rect()).unwrap();
    let channels = pass.channels();
    let colors = channels.min(3);
    let sum: f64 = values.chunks(channels).flat_map(|p| &p[..colors]).map(|&v| v as f64).sum();
    sum / (values.len() / channels * colors) as f64
}

/// Mean and its standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let m = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (n - 1.0);
    (m, (variance / n).sqrt())
}

/// Settings of the path tracer.
pub const PATH: &str = r#","integrator":"path""#;

/// The light of a scene by some settings: mean of a pass and its standard error, from renders of so many seeds, of
/// which no sample may have been refused.
pub fn estimate(
    s: &Stage,
    (side, samples, seeds): (u32, u32, u32),
    pass: Pass,
    settings: &str,
) -> (f64, f64) {
    let one = |seed| {
        let json = format!(r#","seed":{seed},"passes":["{}"]{settings}"#, pass.name());
        let session = s.render(side, samples, &json);
        assert_eq!(session.film().rejected_samples(), 0, "{settings}");
        mean(&session, pass)
    };
    mean_and_error(&(0..seeds).map(one).collect::<Vec<_>>())
}

/// Asserts that two estimates agree within so many standard errors, but for `slack` (relative), and that they are
/// precise enough to tell.
pub fn assert_agree(what: &str, (a, sa): (f64, f64), (b, sb): (f64, f64), (errors, slack): (f64, f64)) {
    let sigma = sa.hypot(sb);
    let apart = 100.0 * (a / b - 1.0);
    println!("{what}: {apart:.2} % apart, {:.2} % standard error", 100.0 * sigma / b);
    assert!(
        (a - b).abs() <= errors * sigma + slack * b.abs(),
        "{what}: {a} +- {sa} against {b} +- {sb}, {apart:.2} % apart"
    );
    assert!(sigma < 0.025 * b.abs(), "{what}: too noisy to say anything, {sa} and {sb} of {b}");
}

/// Asserts that `got` is `expected` within a relative tolerance, saying what it is about.
pub fn assert_close(what: &str, got: f64, expected: f64, tolerance: f64) {
    let error = (got / expected - 1.0).abs();
    assert!(error <= tolerance, "{what}: {got} instead of {expected}, off by {:.3} %", 100.0 * error);
}

/// A wall's material.
pub const WALL: &str = r#"{"surface":{"type":"diffuse","color":[0.7,0.6,0.5]}}"#;
/// A lamp below the ceiling.
pub const RECT: &str = r#"{"type":"rect","width":0.6,"height":0.6,"radiance":[5,5,5],
    "transform":[1,0,0,0,0,1,0,0,0,0,1,1.9,0,0,0,1]}"#;
/// A point light.
pub const POINT: &str =
    r#"{"type":"point","intensity":[0.5,0.5,0.5],"transform":[1,0,0,-0.5,0,1,0,-0.4,0,0,1,1.4,0,0,0,1]}"#;

/// A corner of a room, open to the camera's side, and a ball in it. `camera`: further JSON keys of the camera.
pub fn corner_with_ball(ball: &str, wall: &str, camera: &str) -> Stage {
    let mut s = Stage::default();
    let wall = s.material(wall);
    s.corner(wall);
    let ball = s.material(ball);
    let (points, triangles) = icosphere(3);
    let mesh = s.mesh(&points, &triangles, Some(&points));
    let at = DMat4::from_translation(DVec3::new(0.2, 0.1, 0.5)) * DMat4::from_scale(DVec3::splat(0.45));
    s.place(mesh, ball, at);
    s.camera(DVec3::new(0.6, -3.0, 1.3), DVec3::new(0.0, 0.0, 0.8), 0.4, camera);
    s
}
