//! Generalised segments: a ray, followed through Dirac lobes and through what is transparent, up to the next
//! surface that scatters continuously.
//!
//! Étendue `n^2 dA dw_perp` is conserved along such a chain, so a chain of mirrors and glass is a segment like
//! any other: only the probabilities of the choices made on the way enter its density. Stochastic
//! visibility (cut-outs, transparency) is not among them: it is a factor on the throughput for every technique.

use crate::math::Sampler;
use crate::shading::bsdf::{Among, Event, Sight, Walk};
use crate::shading::{LightPoint, Piece, Shaded, SurfacePoint, Vertex, World};
use glam::Vec3;

/// Passages through Dirac lobes after which roulette begins, so that a closed box of mirrors lets go.
const ROULETTE_FROM: u32 = 16;
/// Probability of going on from there. It depends on the number of passages alone, hence is the same both ways.
const SURVIVAL: f32 = 0.95;

/// What has been collected along a generalised segment.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    /// Product of the coefficients of the Dirac lobes and of stochastic visibility: factor on basic radiance.
    pub throughput: Vec3,
    /// Probability of the choices made: `c` of this walk.
    pub forward: f32,
    /// Probability of the same choices for the walk the other way.
    pub reverse: f32,
    /// `(n_start / n_here)^2`: étendue densities here become densities where the segment began.
    pub squeeze: f32,
    /// Dirac lobes passed.
    pub passages: u32,
}

impl Chain {
    const START: Self = Self { throughput: Vec3::ONE, forward: 1.0, reverse: 1.0, squeeze: 1.0, passages: 0 };

    /// Factor on the flux of a light walk: it keeps its étendue, of which flux is counted per `dA dw_perp`.
    pub fn flux_factor(&self) -> Vec3 {
        self.throughput * (self.squeeze / self.forward)
    }
}

/// Where a generalised segment ends: a surface with a continuous lobe.
#[derive(Clone, Debug)]
pub struct End {
    /// The surface point.
    pub hit: SurfacePoint,
    /// Its scattering.
    pub vertex: Vertex,
    /// Unit direction back along the segment.
    pub wo: Vec3,
    /// Share of the surface that is there: a factor of the segment's throughput.
    pub opacity: f32,
    /// Probability that a segment which arrives so ends here.
    pub end_probability: f32,
}

impl End {
    /// Its continuous lobes, seen from where the segment came.
    pub fn sight(&self) -> Option<Sight<'_>> {
        self.vertex.bsdf.sight(self.wo, Among::Continuous)
    }

    /// Probability that a segment which arrives from `from` ends here.
    pub fn probability_from(&self, world: &World, from: Vec3) -> f32 {
        world.end_probability(&self.hit, &self.vertex.bsdf, from)
    }
}

/// What is told of a segment while it is followed.
pub trait Witness {
    /// A light was met: an analytic one, one at infinity, or an emissive surface that can be sampled.
    fn light(&mut self, _chain: &Chain, _light: &LightPoint) {}
    /// Radiance was met that no other technique can find.
    fn glow(&mut self, _chain: &Chain, _radiance: Vec3) {}
    /// A surface scatters or absorbs here; first of all the one that is seen.
    fn surface(&mut self, _hit: &SurfacePoint, _vertex: &Vertex, _wo: Vec3) {}
    /// The segment left the scene.
    fn escaped(&mut self, _chain: &Chain) {}
}

/// Nobody is told: light paths.
pub struct Nobody;

impl Witness for Nobody {}

/// How a segment is followed.
pub struct Follow<'a> {
    /// The scene.
    pub world: &'a World,
    /// Whose walk it is.
    pub walk: Walk,
    /// Whether it begins at the camera.
    pub from_camera: bool,
}

impl Follow<'_> {
    /// Follows a segment from its first piece. Adds the rays it takes to `rays`.
    pub fn segment(
        &self,
        mut piece: Piece,
        sampler: &mut Sampler,
        witness: &mut impl Witness,
        rays: &mut u64,
    ) -> (Chain, Option<End>) {
        let world = self.world;
        let mut chain = Chain::START;
        let sees_lights = self.walk == Walk::Camera;
        loop {
            let from_camera = self.from_camera && chain.passages == 0;
            *rays += 1;
            let hit = world.closest(&piece, from_camera);
            if sees_lights {
                world.for_each_light_on(&piece, hit.as_ref(), from_camera, |l| witness.light(&chain, &l));
            }
            let Some(hit) = hit else {
                if sees_lights {
                    world.for_each_infinite_light(&piece, from_camera, |l| witness.light(&chain, &l));
                }
                witness.escaped(&chain);
                return (chain, None);
            };
            chain.throughput *= world.left_after(&piece, &hit);
            let wo = -piece.direction;
            let choice = if world.needs().transparency { sampler.next_1d() } else { 0.0 };
            let (vertex, opacity) = match world.shade(&hit, wo, self.walk, choice) {
                Shaded::Through { weight } => {
                    chain.throughput *= weight;
                    piece = piece.beyond(&hit);
                    continue;
                }
                Shaded::Scatters { weight, opacity, vertex } => {
                    chain.throughput *= weight;
                    (vertex, opacity)
                }
            };
            if sees_lights && vertex.emission != Vec3::ZERO {
                match world.emitter_at(&piece, &hit, vertex.emission) {
                    Some(light) => witness.light(&chain, &light),
                    None => witness.glow(&chain, vertex.emission),
                }
            }
            witness.surface(&hit, &vertex, wo);
            let u = if vertex.bsdf.has_delta() { sampler.next_3d() } else { Vec3::ZERO };
            match vertex.bsdf.event(wo, self.walk, u, |from| world.bsdf_again(&hit, from)) {
                Event::Absorbed => return (chain, None),
                Event::Ends { probability: end_probability } => {
                    chain.forward *= end_probability;
                    return (chain, Some(End { hit, vertex, wo, opacity, end_probability }));
                }
                Event::Passes(passage) => {
                    chain.throughput *= passage.coefficient;
                    chain.forward *= passage.forward;
                    chain.reverse *= passage.reverse;
                    chain.squeeze /= passage.eta * passage.eta;
                    chain.passages += 1;
                    if chain.passages > ROULETTE_FROM {
                        if sampler.next_1d() >= SURVIVAL {
                            return (chain, None);
                        }
                        chain.forward *= SURVIVAL;
                        chain.reverse *= SURVIVAL;
                    }
                    piece = Piece::leaving(&hit, passage.direction);
                }
            }
        }
    }
}
