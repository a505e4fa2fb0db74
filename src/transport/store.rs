//! What one iteration sampled: the ends of segments that arrive, and the segments that leave them.
//!
//! An *arrival* is the far end of a generalised segment, on a surface that scatters continuously. Its path
//! goes on in the next arrival of the same array, if it goes on. Directions are unit vectors in scene space and
//! point away from the surface; densities are per projected solid angle about the geometric normal; radiance
//! is basic radiance `L / n^2`, with the camera in a medium of index one.

use crate::shading::bsdf::Bsdf;
use crate::shading::emitters::Draw;
use crate::shading::{Address, SurfaceClass, World};
use glam::Vec3;

/// The end of a segment, from the camera or from a light.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Where it is, scene space.
    pub position: Vec3,
    /// Shading normal of the mesh, on the side arrived from unless the surface transmits: what it is clustered by.
    pub normal: Vec3,
    /// Direction back along the segment.
    pub wo: Vec3,
    /// The surface.
    pub at: Address,
    /// Reflectance, of a diffuse surface.
    pub reflectance: Vec3,
    /// Of a diffuse surface: density with which its lobe draws `wo`.
    pub back_pdf: f32,
    /// Probability `q` that Russian roulette lets the path go on.
    pub survival: f32,
    /// How it may share light with its neighbours.
    pub class: SurfaceClass,
    /// Whether a segment leaves it.
    pub goes_on: bool,
}

impl Arrival {
    /// The scattering there, computed anew.
    pub fn bsdf(&self, world: &World) -> Bsdf {
        self.bsdf_from(world, self.wo)
    }

    /// The same, looked at from elsewhere.
    pub fn bsdf_from(&self, world: &World, wo: Vec3) -> Bsdf {
        world.bsdf(&world.surface(&self.at), wo)
    }
}

/// The segment that leaves an arrival of a camera path.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outgoing {
    /// Direction in which it leaves.
    pub direction: Vec3,
    /// Density of that direction, given that a path goes on.
    pub pdf: f32,
    /// Throughput of the chain.
    pub throughput: Vec3,
    /// `c` of the camera's walk, up to the arrival at its end; zero without one.
    pub forward: f32,
    /// `c` of the light's walk.
    pub reverse: f32,
    /// `(n_start / n_end)^2`: étendue densities at the far end become densities at the near one.
    pub squeeze: f32,
    /// Dirac lobes passed.
    pub passages: u32,
}

/// The next-event segment of an arrival of a camera path.
#[derive(Clone, Copy, Debug, Default)]
pub struct NextEvent {
    /// Direction to the light.
    pub direction: Vec3,
    /// Density with which the arrival's own lobes draw that direction.
    pub pdf: f32,
    /// Basic radiance that arrives; of a delta light, the irradiance of the surface.
    pub light: Vec3,
    /// Density with which next-event estimation draws it; of a delta light, the probability.
    pub next_event_pdf: f32,
    /// Density with which light paths arrive along it, per étendue; of a delta light, per area.
    pub light_density: f32,
    /// Whether the light is a delta light.
    pub is_delta: bool,
}

/// Light that a camera segment met.
#[derive(Clone, Copy, Debug)]
pub struct EmissionHit {
    /// The arrival that the segment left.
    pub arrival: u32,
    /// Basic radiance times the chain's throughput.
    pub light: Vec3,
    /// `c` of the camera's walk up to there.
    pub forward: f32,
    /// Density with which next-event estimation draws it; zero through a chain.
    pub next_event_pdf: f32,
    /// Density with which light paths arrive along the segment, per étendue at its near end.
    pub light_density: f32,
    /// Dirac lobes passed.
    pub passages: u32,
}

/// A light path that arrived somewhere.
#[derive(Clone, Copy, Debug)]
pub struct LightStart {
    /// What its first ray was drawn from.
    pub draw: Draw,
    /// The first of its arrivals, which follow each other.
    pub first: u32,
}

/// What an arrival of a light path carries.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Its light path.
    pub path: u32,
    /// Flux, W.
    pub flux: Vec3,
    /// Times that the light has been scattered on its way here.
    pub bounces: u32,
    /// How else its segment could have been made.
    pub rivals: Rivals,
    /// `c` of the camera's walk along its segment.
    pub camera_choices: f32,
    /// Direction in which the path goes on, and its density.
    pub direction: Vec3,
    /// See `direction`.
    pub pdf: f32,
}

/// The techniques beside the light path itself that could have made a photon's last segment.
#[derive(Clone, Copy, Debug)]
pub enum Rivals {
    /// Of a first segment: it was made with `light_density` (as in [`NextEvent`]).
    First {
        /// Density of the light path's own segment.
        light_density: f32,
        /// Density of next-event estimation; zero through a chain.
        next_event_pdf: f32,
        /// Whether the light is a delta light, which camera segments do not meet.
        is_delta: bool,
    },
    /// Of a later segment, from the arrival before in the same array.
    Later {
        /// `c` of the light's walk.
        light_choices: f32,
        /// `(n_start / n_end)^2` seen from the photon.
        squeeze: f32,
    },
}

/// What the literal recursion alone needs to know of an arrival of a light path.
#[derive(Clone, Copy, Debug)]
pub struct Carry {
    /// Throughput of the chain that ends there.
    pub throughput: Vec3,
    /// `1 / n^2` on the side arrived from, if the light stands in a medium of index one.
    pub inverse_n2: f32,
}

/// The camera's side of an iteration. All but `hits` have one element for every arrival.
#[derive(Debug, Default)]
pub struct CameraStore {
    /// Ends of segments, path by path.
    pub arrivals: Vec<Arrival>,
    /// `1 / n^2` on the side arrived from.
    pub inverse_n2: Vec<f32>,
    /// Segments that leave them.
    pub outgoing: Vec<Outgoing>,
    /// Next-event segments.
    pub next_events: Vec<NextEvent>,
    /// Light met by segments that left an arrival, in their order.
    pub hits: Vec<EmissionHit>,
    /// Contributions that were not finite and were dropped.
    pub dropped: u64,
}

/// The lights' side of an iteration.
#[derive(Debug, Default)]
pub struct LightStore {
    /// Ends of segments, path by path.
    pub arrivals: Vec<Arrival>,
    /// What they carry.
    pub photons: Vec<Photon>,
    /// One for every path that arrived somewhere.
    pub starts: Vec<LightStart>,
    /// One for every arrival; empty unless the literal recursion asked for it.
    pub carries: Vec<Carry>,
}

fn bytes<T>(v: &Vec<T>) -> usize {
    v.capacity() * size_of::<T>()
}

impl CameraStore {
    /// Segments: those that leave arrivals, next-event segments, and one primary segment a path.
    pub fn segments(&self, paths: usize) -> usize {
        let leaving = self.arrivals.iter().filter(|a| a.goes_on).count();
        let direct = self.next_events.iter().filter(|n| n.next_event_pdf > 0.0).count();
        paths + leaving + direct
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        bytes(&self.arrivals)
            + bytes(&self.inverse_n2)
            + bytes(&self.outgoing)
            + bytes(&self.next_events)
            + bytes(&self.hits)
    }

    /// Appends the paths of another store; the first of its arrivals gets the number that is returned.
    pub fn append(&mut self, other: &mut Self) -> u32 {
        let first = self.arrivals.len() as u32;
        self.arrivals.append(&mut other.arrivals);
        self.inverse_n2.append(&mut other.inverse_n2);
        self.outgoing.append(&mut other.outgoing);
        self.next_events.append(&mut other.next_events);
        self.dropped += other.dropped;
        self.hits.extend(other.hits.drain(..).map(|h| EmissionHit { arrival: h.arrival + first, ..h }));
        first
    }

    /// Empties the store and keeps its memory.
    pub fn clear(&mut self) {
        self.arrivals.clear();
        self.inverse_n2.clear();
        self.outgoing.clear();
        self.next_events.clear();
        self.hits.clear();
        self.dropped = 0;
    }
}

impl LightStore {
    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        bytes(&self.arrivals) + bytes(&self.photons) + bytes(&self.starts) + bytes(&self.carries)
    }

    /// Appends the paths of another store.
    pub fn append(&mut self, other: &mut Self) {
        let first = self.arrivals.len() as u32;
        self.arrivals.append(&mut other.arrivals);
        self.photons.append(&mut other.photons);
        self.starts.extend(other.starts.drain(..).map(|s| LightStart { first: s.first + first, ..s }));
        self.carries.append(&mut other.carries);
    }

    /// Empties the store and keeps its memory.
    pub fn clear(&mut self) {
        self.arrivals.clear();
        self.photons.clear();
        self.starts.clear();
        self.carries.clear();
    }
}
