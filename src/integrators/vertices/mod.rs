//! Methods on the vertices of paths: light tracing, bidirectional path tracing, photon mapping and all of it at
//! once, one engine with a set of techniques.
//!
//! An iteration traces light paths, keeps their vertices, and then one camera path a pixel. Light is found in
//! four ways: light vertices are connected to the lens (splats), camera vertices to a light (next event) and to
//! the vertices of one light path, and camera vertices are merged with all light vertices that lie within a
//! radius. Every way is weighed by the densities of all others that the method has ([`mis`]).
//!
//! | method | lens | connections | merging |
//! | --- | --- | --- | --- |
//! | light tracing (Arvo 1986; Dutré et al. 1993) | all | | |
//! | bidirectional path tracing (Veach 1997, chapter 10) | yes | yes | |
//! | stochastic progressive photon mapping (Hachisuka and Jensen 2009) | | | first vertex |
//! | bidirectional photon mapping (Vorba 2011; Georgiev et al. 2012) | | | every vertex |
//! | vertex connection and merging (Georgiev et al. 2012; Hachisuka et al. 2012) | yes | yes | every vertex |
//!
//! Vertices are surfaces that scatter continuously; mirrors and glass belong to the segments between them
//! ([`crate::transport::walk`]). What is emitted towards a primary segment, through mirrors and glass or not, is
//! always found by that segment. Light tracing finds nothing else on it: it is complete only where
//! nothing rough is seen through mirrors or glass.

mod camera;
mod light;
mod merge;
pub mod mis;
mod vertex;

use super::{Context, Integrator, IterationEnd, StageCosts};
use crate::film::{Sample, SplatBuffer, is_wanted};
use crate::math::Sampler;
use crate::transport::kernel::Kernel;
use camera::CameraSampler;
use light::LightStore;
use merge::PhotonMap;
use std::f32::consts::PI;
use vertex::Rules;

/// Keeps the random numbers of light paths apart from those of pixels.
const LIGHT_STREAM: u32 = 0x7e27_1c00;

/// The techniques of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Techniques {
    /// Light vertices are connected to the lens.
    splats: bool,
    /// Camera vertices are connected to lights and to light vertices.
    connects: bool,
    /// Camera vertices are merged with light vertices.
    merges: bool,
    /// Camera paths go on after their first vertex.
    goes_on: bool,
}

impl Techniques {
    const NONE: Self = Self { splats: false, connects: false, merges: false, goes_on: false };
}

/// A method on vertices. Its stores are kept from one iteration to the next.
#[derive(Debug)]
pub struct Vertices {
    techniques: Techniques,
    kernel: Kernel,
    light_paths: f32,
    light: LightStore,
    photons: PhotonMap,
    splats: SplatBuffer,
    samples: Vec<Sample>,
}

impl Vertices {
    fn new(techniques: Techniques, kernel: Kernel, light_paths: f32) -> Self {
        Self {
            techniques,
            kernel,
            light_paths,
            light: LightStore::default(),
            photons: PhotonMap::default(),
            splats: SplatBuffer::default(),
            samples: Vec::new(),
        }
    }

    /// Light tracing with so many light paths a pixel.
    pub fn light_tracing(light_paths: f32) -> Self {
        Self::new(Techniques { splats: true, ..Techniques::NONE }, Kernel::default(), light_paths)
    }

    /// Bidirectional path tracing with so many light paths a pixel.
    pub fn bidirectional(light_paths: f32) -> Self {
        let techniques = Techniques { splats: true, connects: true, goes_on: true, ..Techniques::NONE };
        Self::new(techniques, Kernel::default(), light_paths)
    }

    /// Progressive photon mapping. The disk of merging is as large as the kernel.
    pub fn photon_mapping(kernel: Kernel, light_paths: f32) -> Self {
        Self::new(Techniques { merges: true, ..Techniques::NONE }, kernel, light_paths)
    }

    /// Bidirectional photon mapping.
    pub fn bidirectional_photon_mapping(kernel: Kernel, light_paths: f32) -> Self {
        Self::new(Techniques { merges: true, goes_on: true, ..Techniques::NONE }, kernel, light_paths)
    }

    /// Vertex connection and merging.
    pub fn connection_and_merging(kernel: Kernel, light_paths: f32) -> Self {
        let techniques = Techniques { splats: true, connects: true, merges: true, goes_on: true };
        Self::new(techniques, kernel, light_paths)
    }
}

impl Integrator for Vertices {
    fn iterate(&mut self, context: &Context, index: u32) -> IterationEnd {
        let mut costs = StageCosts::new(context.counters);
        let Techniques { splats, connects, merges, goes_on } = self.techniques;
        let light_paths = (self.light_paths * context.crop.area() as f32).ceil();
        let rules = Rules {
            world: context.world,
            sensor: context.sensor,
            connects,
            splats,
            merges,
            goes_on,
            radius: self.kernel.edge(context.completed) / PI.sqrt(),
            light_paths,
            max_depth: context.max_depth.unwrap_or(u32::MAX),
        }
        .bounded();

        self.trace_light(context, &rules, index);
        if context.stop.is_raised() {
            return IterationEnd::CutShort;
        }
        costs.stage("light paths", self.light.bytes());
        if merges {
            self.photons.build(&rules, &self.light.vertices);
            costs.stage("photon map", self.photons.bytes());
        }
        self.trace_camera(context, rules, index);
        if context.stop.is_raised() {
            return IterationEnd::CutShort;
        }
        costs.stage("camera paths", self.samples.capacity() * size_of::<Sample>());
        self.gather(context);
        costs.stage("gather", self.splats.bytes());
        IterationEnd::Complete
    }

    fn is_all_or_nothing(&self) -> bool {
        true
    }

    fn rest(&mut self) {
        *self = Self::new(self.techniques, self.kernel, self.light_paths);
    }
}

impl Vertices {
    fn trace_light(&mut self, context: &Context, rules: &Rules, index: u32) {
        let wanted = |film| is_wanted(film, context.filter, context.crop);
        let path = |k: usize, store: &mut _, rays: &mut u64| {
            // the paths of one iteration are stratified among each other
            let mut random = Sampler::new(context.seed ^ LIGHT_STREAM, index, k as u32);
            light::path(rules, &mut random, &wanted, store, rays);
        };
        self.light.clear();
        context.paths(rules.light_paths as usize, path, |made| {
            made.into_iter().for_each(|mut store| self.light.append(&mut store));
        });
    }

    fn trace_camera(&mut self, context: &Context, rules: Rules, index: u32) {
        let sampler = CameraSampler {
            rules,
            transparent_background: context.transparent_background,
            light: &self.light,
            photons: &self.photons,
        };
        let crop = context.crop;
        let (pixels, paths) = (crop.area() as u64, self.light.path_ends.len() as u64);
        self.samples.clear();
        let path = |x: u32, y: u32, samples: &mut Vec<Sample>, rays: &mut u64| {
            let (ray, mut random) = context.camera_sample(x, y, index);
            let pixel = u64::from(y) * u64::from(crop.width) + u64::from(x);
            let mate = (pixel * paths / pixels) as usize;
            samples.push(sampler.path(&ray, &mut random, mate, rays));
        };
        context
            .camera_paths(path, |made| made.into_iter().for_each(|mut some| self.samples.append(&mut some)));
    }

    /// One sample for every pixel.
    fn gather(&mut self, context: &Context) {
        if self.techniques.splats {
            self.splats.collect(&self.light.splats, context.filter, context.crop);
        }
        let width = context.crop.width as usize;
        context.film.add_iteration(|x, y| {
            let pixel = y as usize * width + x as usize;
            let splatted = self.splats.get(pixel);
            let mut sample = self.samples[pixel];
            sample.radiance += splatted.light;
            sample.direct += splatted.direct;
            sample
        });
        (context.tile_done)(context.film.rect());
    }
}
