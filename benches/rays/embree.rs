//! The few functions of Embree 4 that the comparison needs, from a shared library found at run time.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::ptr;

use glam::Vec3;
use libloading::{Library, Symbol};
use segue::accel::Ray;

type Handle = *mut c_void;

/// `RTCRay`, as embree4/rtcore_ray.h has it.
#[repr(C, align(16))]
#[derive(Clone, Copy)]
struct RtcRay {
    origin: [f32; 3],
    near: f32,
    direction: [f32; 3],
    time: f32,
    far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
}

/// `RTCRayHit`; `instance` has room for what later versions append.
#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: c_uint,
    geometry: c_uint,
    instance: [c_uint; 5],
}

impl From<&Ray> for RtcRay {
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.to_array(),
            near: ray.t_min,
            direction: ray.direction.to_array(),
            time: 0.0,
            far: ray.t_max,
            mask: u32::MAX,
            id: 0,
            flags: 0,
        }
    }
}

/// Embree's build qualities, and its slower watertight mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    Medium,
    High,
    Robust,
}

/// A scene with one triangle mesh.
pub struct Embree {
    scene: Handle,
    intersect: unsafe extern "C" fn(Handle, *mut RtcRayHit, *const c_void),
    occluded: unsafe extern "C" fn(Handle, *mut RtcRay, *const c_void),
}

// SAFETY: Embree's scenes may be queried from any number of threads once they are committed.
unsafe impl Sync for Embree {}

impl Embree {
    /// Loads the library at `path` and builds the mesh.
    pub fn new(path: &str, positions: &[Vec3], triangles: &[[u32; 3]], mode: Mode) -> Result<Self, String> {
        // SAFETY: the library is Embree, whose initialisers are harmless. It is never unloaded.
        let library = unsafe { Library::new(path) }.map_err(|e| e.to_string())?;
        let library: &'static Library = Box::leak(Box::new(library));
        macro_rules! function {
            ($name:literal, fn($($argument:ty),*) $(-> $result:ty)?) => {{
                // SAFETY: the signature is the one in Embree's headers.
                let symbol: Symbol<unsafe extern "C" fn($($argument),*) $(-> $result)?> =
                    unsafe { library.get($name) }.map_err(|e| e.to_string())?;
                *symbol
            }};
        }
        let new_device = function!(b"rtcNewDevice", fn(*const c_char) -> Handle);
        let new_scene = function!(b"rtcNewScene", fn(Handle) -> Handle);
        let new_geometry = function!(b"rtcNewGeometry", fn(Handle, c_int) -> Handle);
        let new_buffer = function!(
            b"rtcSetNewGeometryBuffer",
            fn(Handle, c_int, c_uint, c_int, usize, usize) -> *mut c_void
        );
        let commit_geometry = function!(b"rtcCommitGeometry", fn(Handle));
        let attach = function!(b"rtcAttachGeometry", fn(Handle, Handle) -> c_uint);
        let set_quality = function!(b"rtcSetSceneBuildQuality", fn(Handle, c_int));
        let set_flags = function!(b"rtcSetSceneFlags", fn(Handle, c_int));
        let commit_scene = function!(b"rtcCommitScene", fn(Handle));
        let device_error = function!(b"rtcGetDeviceError", fn(Handle) -> c_int);
        let intersect = function!(b"rtcIntersect1", fn(Handle, *mut RtcRayHit, *const c_void));
        let occluded = function!(b"rtcOccluded1", fn(Handle, *mut RtcRay, *const c_void));

        const TRIANGLE: c_int = 0;
        const INDEX_BUFFER: c_int = 0;
        const VERTEX_BUFFER: c_int = 1;
        const UINT3: c_int = 0x5003;
        const FLOAT3: c_int = 0x9003;
        const ROBUST: c_int = 1 << 2;
        // SAFETY: the calls follow the order that Embree's manual asks for; each buffer holds as many items of the size
        // asked for as are copied into it.
        unsafe {
            let device = new_device(ptr::null());
            let scene = new_scene(device);
            let geometry = new_geometry(device, TRIANGLE);
            let vertices = new_buffer(geometry, VERTEX_BUFFER, 0, FLOAT3, size_of::<Vec3>(), positions.len());
            let indices =
                new_buffer(geometry, INDEX_BUFFER, 0, UINT3, size_of::<[u32; 3]>(), triangles.len());
            if vertices.is_null() || indices.is_null() {
                return Err(format!("Embree error {}", device_error(device)));
            }
            ptr::copy_nonoverlapping(positions.as_ptr(), vertices.cast(), positions.len());
            ptr::copy_nonoverlapping(triangles.as_ptr(), indices.cast(), triangles.len());
            commit_geometry(geometry);
            attach(scene, geometry);
            set_quality(scene, if mode == Mode::High { 2 } else { 1 });
            set_flags(scene, if mode == Mode::Robust { ROBUST } else { 0 });
            commit_scene(scene);
            match device_error(device) {
                0 => Ok(Self { scene, intersect, occluded }),
                error => Err(format!("Embree error {error}")),
            }
        }
    }

    /// The distance and the triangle of the nearest hit.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<(f32, u32)> {
        let mut query = RtcRayHit {
            ray: ray.into(),
            normal: [0.0; 3],
            uv: [0.0; 2],
            primitive: u32::MAX,
            geometry: u32::MAX,
            instance: [u32::MAX; 5],
        };
        // SAFETY: the scene is committed, the ray and hit are laid out and aligned as Embree has them.
        unsafe { (self.intersect)(self.scene, &mut query, ptr::null()) };
        (query.geometry != u32::MAX).then_some((query.ray.far, query.primitive))
    }

    /// Whether anything lies on the ray.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        let mut query = RtcRay::from(ray);
        // SAFETY: as above.
        unsafe { (self.occluded)(self.scene, &mut query, ptr::null()) };
        query.far == f32::NEG_INFINITY
    }
}

/// CPU time that the calling thread has used, in seconds: other programs on the machine do not add to it.
pub fn thread_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` may be written to.
    unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}
