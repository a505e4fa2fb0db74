//! What one iteration sampled: the ends of segments that arrive, and the segments that leave them.
//!
//! An *arrival* is the far end of a generalised segment, on a surface that scatters continuously. Its path
//! goes on in the next arrival of the same array, if it goes on. Directions are unit vectors in scene space and
//! point away from the surface; densities are per projected solid angle about the geometric normal; radiance
//! is basic radiance `L / n^2`, and flux that of basic radiance over `dA dw_perp`.
//!
//! What is kept is packed: directions to within 7e-5 rad, colours to within 1.2e-4 of their largest component. All techniques
//! look at the same rounded directions, so their densities agree, but for lobes nearly as narrow as that.

mod arrivals;
mod hits;
mod leaving;
mod list;
mod photons;

pub use arrivals::{Arrivals, PackedArrival, storable_survival};
pub use hits::Hits;
pub use leaving::{NextEvents, Outgoings};
pub use list::{List, Pack};
pub use photons::{PackedPhoton, Photons};

use crate::shading::bsdf::Bsdf;
use crate::shading::emitters::Draw;
use crate::shading::{Address, SurfaceClass, SurfacePoint, World};
use glam::Vec3;

/// The end of a segment, from the camera or from a light.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Where it is, scene space.
    pub position: Vec3,
    /// Shading normal of the mesh, on the side arrived from unless the surface transmits: what it is clustered by.
    pub normal: Vec3,
    /// Direction back along the segment; of a diffuse surface, as kept, its normal: it looks the same from there.
    pub wo: Vec3,
    /// The surface; see [`Arrival::surface`].
    pub at: Address,
    /// Reflectance, of a diffuse surface.
    pub reflectance: Vec3,
    /// Of a diffuse surface: density with which its lobe draws `wo`.
    pub back_pdf: f32,
    /// Probability `q` that Russian roulette lets the path go on, as [`storable_survival`] has it.
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
        world.bsdf(&self.surface(world), wo)
    }

    /// The surface there. Barycentrics of diffuse ones are not kept: they follow from the position.
    pub fn surface(&self, world: &World) -> SurfacePoint {
        match self.class {
            SurfaceClass::Diffuse => world.surface_near(&self.at, self.position),
            SurfaceClass::Reflecting | SurfaceClass::Transmitting => world.surface(&self.at),
        }
    }
}

/// The segment that leaves an arrival of a camera path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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

impl Outgoing {
    /// One with nothing on its way, between surfaces that it is sure to leave and to end at.
    pub(super) const PLAIN: Self = Self {
        direction: Vec3::ZERO,
        pdf: 0.0,
        throughput: Vec3::ONE,
        forward: 1.0,
        reverse: 1.0,
        squeeze: 1.0,
        passages: 0,
    };
}

/// The next-event segment of an arrival of a camera path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// Flux of basic radiance, W.
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// The camera's side of an iteration. All but `hits` have one place for every arrival.
#[derive(Clone, Debug, Default)]
pub struct CameraStore {
    /// Ends of segments, path by path.
    pub arrivals: Arrivals,
    /// Segments that leave them.
    pub outgoing: Outgoings,
    /// Next-event segments.
    pub next_events: NextEvents,
    /// Light met by segments that left an arrival, in their order.
    pub hits: Hits,
    /// Contributions that were not finite and were dropped.
    pub dropped: u64,
}

/// The lights' side of an iteration.
#[derive(Clone, Debug, Default)]
pub struct LightStore {
    /// Ends of segments, path by path.
    pub arrivals: Arrivals,
    /// What they carry.
    pub photons: Photons,
    /// One for every path that arrived somewhere.
    pub starts: Vec<LightStart>,
    /// Throughput of the chain that ends at every arrival; empty unless the literal recursion asked for it.
    pub carries: Vec<Vec3>,
}

fn bytes<T>(v: &Vec<T>) -> usize {
    v.capacity() * size_of::<T>()
}

impl CameraStore {
    /// Adds an arrival, its next-event segment and the one that leaves it.
    pub fn push(&mut self, a: Arrival, next_event: NextEvent, outgoing: Outgoing) {
        self.arrivals.push(a);
        self.next_events.push(next_event);
        self.outgoing.push(outgoing);
    }

    /// Segments: those that leave arrivals, next-event segments, and one primary segment a path.
    pub fn segments(&self, paths: usize) -> usize {
        paths + self.outgoing.count() + self.next_events.count()
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.arrivals.bytes() + self.outgoing.bytes() + self.next_events.bytes() + self.hits.bytes()
    }

    /// Makes room for the paths of all these stores, too, and no more.
    pub fn reserve<'a>(&mut self, parts: impl Iterator<Item = &'a Self> + Clone) {
        let arrivals = parts.clone().map(|p| p.arrivals.len()).sum();
        self.arrivals.reserve(arrivals);
        self.outgoing.reserve(parts.clone().map(|p| &p.outgoing));
        self.next_events.reserve(parts.clone().map(|p| &p.next_events));
        self.hits.reserve(arrivals, parts.map(|p| p.hits.len()).sum());
    }

    /// Appends the paths of another store; the first of its arrivals gets the number that is returned.
    pub fn append(&mut self, other: &mut Self) -> u32 {
        let first = self.arrivals.len();
        self.arrivals.append(&mut other.arrivals);
        self.outgoing.append(&mut other.outgoing);
        self.next_events.append(&mut other.next_events);
        self.hits.append(&mut other.hits, first);
        self.dropped += other.dropped;
        first as u32
    }

    /// Empties the store and keeps its memory.
    pub fn clear(&mut self) {
        self.arrivals.clear();
        self.outgoing.clear();
        self.next_events.clear();
        self.hits.clear();
        self.dropped = 0;
    }
}

impl LightStore {
    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.arrivals.bytes() + self.photons.bytes() + bytes(&self.starts) + bytes(&self.carries)
    }

    /// Makes room for the paths of all these stores, too, and no more.
    pub fn reserve<'a>(&mut self, parts: impl Iterator<Item = &'a Self> + Clone) {
        let arrivals = parts.clone().map(|p| p.arrivals.len()).sum();
        self.arrivals.reserve(arrivals);
        self.photons.reserve(arrivals);
        self.starts.reserve_exact(parts.clone().map(|p| p.starts.len()).sum());
        self.carries.reserve_exact(parts.map(|p| p.carries.len()).sum());
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
