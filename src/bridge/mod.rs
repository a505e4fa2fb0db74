//! The cxx bridge between the C ABI (`cpp_bridge/`) and the engine: it translates, and nothing else.
//!
//! Every function returns a `Result` and catches panics, since cxx aborts on one that reaches it.

mod scene;

use scene::new_scene;

use crate::film::{ExrOptions, Pass, Rect};
use crate::scene::{SceneBuilder, SceneError};
use crate::session::settings::Settings;
use crate::session::statistics::StopReason;
use crate::session::{Events, Progress, Session, SessionError, panic_text};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// A failure on its way to C: the number is a `segue_status`.
#[derive(Debug)]
pub struct Failure {
    status: u32,
    text: String,
}

impl std::fmt::Display for Failure {
    /// `status:text`, which the C++ side takes apart again; cxx carries only a text.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}", self.status, self.text)
    }
}

impl std::error::Error for Failure {}

const BAD_ARGUMENT: u32 = 1;
const BAD_SCENE: u32 = 2;
const INTERNAL: u32 = 3;
const IO: u32 = 5;

impl Failure {
    fn argument(text: impl Into<String>) -> Self {
        Self { status: BAD_ARGUMENT, text: text.into() }
    }
}

impl From<SceneError> for Failure {
    fn from(e: SceneError) -> Self {
        Self { status: BAD_SCENE, text: e.to_string() }
    }
}

impl From<SessionError> for Failure {
    fn from(e: SessionError) -> Self {
        let status = match &e {
            SessionError::Settings(_) | SessionError::Film(_) => BAD_ARGUMENT,
            SessionError::Scene(_) | SessionError::World(_) => BAD_SCENE,
            SessionError::Threads(_) | SessionError::Panic(_) => INTERNAL,
        };
        Self { status, text: e.to_string() }
    }
}

impl From<crate::film::FilmError> for Failure {
    fn from(e: crate::film::FilmError) -> Self {
        let status = match &e {
            crate::film::FilmError::Io { .. } => IO,
            _ => BAD_ARGUMENT,
        };
        Self { status, text: e.to_string() }
    }
}

impl From<serde_json::Error> for Failure {
    fn from(e: serde_json::Error) -> Self {
        Self::argument(e.to_string())
    }
}

/// Runs `f`, turning a panic into a failure.
fn guard<T>(f: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(f)).unwrap_or_else(|panic| {
        Err(Failure { status: INTERNAL, text: format!("a defect: {}", panic_text(&*panic)) })
    })
}

// SAFETY: the callbacks are a plain C++ object that lives for the whole call it is borrowed for, and its
// methods are noexcept.
#[allow(missing_docs, unsafe_code)]
#[cxx::bridge(namespace = "segue::bridge")]
mod ffi {
    /// How an attribute comes over the border; empty slices stand for null pointers.
    struct AttributeView<'a> {
        name: &'a str,
        data: &'a [f32],
        components: u32,
        interpolation: u32,
        has_indices: bool,
        indices: &'a [u32],
    }

    struct MeshView<'a> {
        name: &'a str,
        points: &'a [f32],
        has_face_counts: bool,
        face_counts: &'a [u32],
        face_indices: &'a [u32],
        holes: &'a [u32],
        has_normals: bool,
        normals: &'a [f32],
        normal_interpolation: u32,
        has_slots: bool,
        face_slots: &'a [u32],
        left_handed: bool,
        attributes: Vec<AttributeView<'a>>,
    }

    struct InstancesView<'a> {
        name: &'a str,
        mesh: u32,
        transforms: &'a [f64],
        materials: &'a [u32],
        camera_visible: bool,
        two_sided_emission: bool,
        object_index: u32,
    }

    struct ImageView<'a> {
        name: &'a str,
        width: u32,
        height: u32,
        channels: u32,
        pixel_type: u32,
        bytes: &'a [u8],
        colorspace: &'a str,
    }

    struct FilmRect {
        x: u32,
        y: u32,
        width: u32,
        height: u32,
    }

    unsafe extern "C++" {
        include!("bridge.h");
        /// The callbacks of one call of `segue_render_run`.
        type Callbacks;
        fn progress(self: Pin<&mut Callbacks>, json: &str) -> bool;
        fn tile(self: Pin<&mut Callbacks>, x: u32, y: u32, width: u32, height: u32);
    }

    extern "Rust" {
        fn version() -> String;

        type SceneHandle;
        fn new_scene() -> Result<Box<SceneHandle>>;
        fn add_mesh(self: &mut SceneHandle, mesh: &MeshView) -> Result<u32>;
        fn add_image(self: &mut SceneHandle, image: &ImageView) -> Result<u32>;
        fn add_texture(self: &mut SceneHandle, name: &str, json: &str) -> Result<u32>;
        fn add_material(self: &mut SceneHandle, name: &str, json: &str) -> Result<u32>;
        fn add_light(self: &mut SceneHandle, name: &str, json: &str) -> Result<u32>;
        fn set_camera(self: &mut SceneHandle, name: &str, json: &str) -> Result<()>;
        fn add_instances(self: &mut SceneHandle, instances: &InstancesView) -> Result<()>;
        fn info(self: &SceneHandle) -> Result<String>;

        type RenderHandle;
        fn new_render(scene: &SceneHandle, settings: &str) -> Result<Box<RenderHandle>>;
        fn run(self: &RenderHandle, callbacks: Pin<&mut Callbacks>) -> Result<bool>;
        fn cancel(self: &RenderHandle) -> Result<()>;
        fn size(self: &RenderHandle) -> Result<FilmRect>;
        fn pass_channels(self: &RenderHandle, pass: &str) -> Result<u32>;
        fn read_pass(self: &RenderHandle, pass: &str, rect: &FilmRect, out: &mut [f32]) -> Result<()>;
        fn read_exr(self: &RenderHandle, rect: &FilmRect) -> Result<Vec<u8>>;
        fn write_exr(self: &RenderHandle, path: &str, options: &str) -> Result<()>;
        fn stats(self: &RenderHandle) -> Result<String>;
    }
}

fn version() -> String {
    env!("CARGO_PKG_VERSION").into()
}

/// A scene behind the border.
pub struct SceneHandle(SceneBuilder);

/// A render behind the border.
pub struct RenderHandle(Session);

fn new_render(scene: &SceneHandle, settings: &str) -> Result<Box<RenderHandle>, Failure> {
    guard(|| {
        let settings = Settings::from_json(settings).map_err(Failure::argument)?;
        Ok(Box::new(RenderHandle(Session::new(scene.0.build()?, settings)?)))
    })
}

/// Brings events over the border.
struct Forward<'a>(std::pin::Pin<&'a mut ffi::Callbacks>);

impl Events for Forward<'_> {
    fn progress(&mut self, progress: &Progress) -> bool {
        let json = serde_json::to_string(progress).unwrap_or_default();
        self.0.as_mut().progress(&json)
    }

    fn tile(&mut self, r: Rect) {
        self.0.as_mut().tile(r.x, r.y, r.width, r.height);
    }
}

impl RenderHandle {
    /// `false` if it was cancelled.
    fn run(&self, callbacks: std::pin::Pin<&mut ffi::Callbacks>) -> Result<bool, Failure> {
        guard(|| Ok(self.0.run(&mut Forward(callbacks))? != StopReason::Cancelled))
    }

    fn cancel(&self) -> Result<(), Failure> {
        guard(|| {
            self.0.cancel();
            Ok(())
        })
    }

    fn size(&self) -> Result<ffi::FilmRect, Failure> {
        guard(|| {
            let Rect { x, y, width, height } = self.0.film().rect();
            Ok(ffi::FilmRect { x, y, width, height })
        })
    }

    fn pass_channels(&self, pass: &str) -> Result<u32, Failure> {
        guard(|| Ok(pass.parse::<Pass>()?.channels() as u32))
    }

    fn read_pass(&self, pass: &str, rect: &ffi::FilmRect, out: &mut [f32]) -> Result<(), Failure> {
        guard(|| Ok(self.0.film().read_pass_into(pass.parse()?, rect_of(rect), out)?))
    }

    fn read_exr(&self, rect: &ffi::FilmRect) -> Result<Vec<u8>, Failure> {
        guard(|| Ok(self.0.film().exr_bytes(rect_of(rect), &self.options("")?)?))
    }

    fn write_exr(&self, path: &str, options: &str) -> Result<(), Failure> {
        guard(|| Ok(self.0.film().write_exr(Path::new(path), &self.options(options)?)?))
    }

    fn stats(&self) -> Result<String, Failure> {
        guard(|| Ok(serde_json::to_string(&self.0.statistics())?))
    }

    /// Options of a file, with what this render knows about itself.
    fn options(&self, json: &str) -> Result<ExrOptions, Failure> {
        let mut options: ExrOptions =
            if json.is_empty() { ExrOptions::default() } else { serde_json::from_str(json)? };
        let settings = self.0.settings();
        options.full_size = Some(settings.resolution);
        options.offset = [settings.crop.x, settings.crop.y];
        options.world_to_camera =
            Some(glam::DMat4::from(self.0.world().scene().camera.to_world.inverse()).as_mat4());
        options.attributes.insert("segue/version".into(), version());
        options.attributes.insert("segue/settings".into(), settings.source.clone());
        options.attributes.insert("segue/statistics".into(), serde_json::to_string(&self.0.statistics())?);
        Ok(options)
    }
}

fn rect_of(r: &ffi::FilmRect) -> Rect {
    Rect::new(r.x, r.y, r.width, r.height)
}
