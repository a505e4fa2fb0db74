//! Vertices of sub-paths, and what happens when a path leaves one in a known direction.

use super::mis::{Sum, Turn};
use crate::shading::bsdf::{Bsdf, Walk};
use crate::shading::{Address, Sensor, SurfaceClass, SurfacePoint, World};
use crate::transport::arrival::survival;
use crate::transport::walk::End;
use glam::Vec3;
use std::borrow::Cow;

/// Largest share of the distance to the camera that the radius of merging may be.
const WIDEST: f32 = 0.25;

/// What all parts of an iteration need to know.
#[derive(Clone, Copy)]
pub struct Rules<'a> {
    /// The scene.
    pub world: &'a World,
    /// The camera.
    pub sensor: &'a Sensor,
    /// Whether vertices are connected.
    pub connects: bool,
    /// Whether light vertices are connected to the lens.
    pub splats: bool,
    /// Whether sub-paths are merged.
    pub merges: bool,
    /// Whether camera paths go on after their first vertex.
    pub goes_on: bool,
    /// Radius of merging over the pixel's footprint.
    pub radius: f32,
    /// Light paths of this iteration.
    pub light_paths: f32,
    /// Most bounces of a path.
    pub max_depth: u32,
}

impl<'a> Rules<'a> {
    /// With the radius kept well below the distance to the camera.
    pub fn bounded(self) -> Self {
        Self { radius: self.radius.min(WIDEST / self.sensor.footprint_growth()), ..self }
    }

    /// Radius of merging at a point.
    #[inline]
    pub fn radius(&self, p: Vec3) -> f32 {
        self.radius * self.sensor.pixel_footprint(p)
    }

    /// `eta` of merging at a point; zero without it.
    #[inline]
    pub fn eta(&self, p: Vec3) -> f32 {
        if self.merges { std::f32::consts::PI * self.light_paths * self.radius(p).powi(2) } else { 0.0 }
    }

    /// Whether paths are made in more than one way.
    #[inline]
    pub fn weighs(&self) -> bool {
        self.connects || self.goes_on
    }
}

/// A vertex of a sub-path: a surface that scatters continuously.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a> {
    /// The surface point.
    pub hit: &'a SurfacePoint,
    /// Its scattering, seen from `wo`.
    pub bsdf: &'a Bsdf,
    /// Unit direction to the vertex before.
    pub wo: Vec3,
    /// Probability that roulette lets the sub-path go on.
    pub survival: f32,
    /// Sum over the other techniques.
    pub sum: Sum,
}

/// A direction in which a vertex is left.
#[derive(Clone, Copy, Debug)]
pub struct Leaving {
    /// Camera: `eval(wo, direction)`. Light: `eval(direction, wo)`.
    pub value: Vec3,
    /// Absolute cosine to the geometric normal.
    pub cos: f32,
    /// Densities; nothing where they are not asked for.
    pub turn: Turn,
}

/// Probability that roulette lets a path go on that arrived at `end`.
pub fn survival_at(world: &World, end: &End) -> f32 {
    survival(world, &end.vertex.bsdf, end.wo, end.end_probability)
}

impl Vertex<'_> {
    /// Towards `direction`, for a sub-path of this kind. A surface of several layers is seen anew: they hide
    /// each other by the direction of the camera, and by that of the path when one is drawn.
    pub fn leaving(&self, rules: &Rules, walk: Walk, direction: Vec3) -> Leaving {
        let Self { hit, bsdf, wo, .. } = *self;
        let world = rules.world;
        let is_diffuse = world.class(hit.material) == SurfaceClass::Diffuse;
        let back = || match is_diffuse {
            true => Cow::Borrowed(bsdf),
            false => Cow::Owned(world.bsdf(hit, direction)),
        };
        let cos = hit.place.normal.dot(direction).abs();
        if walk == Walk::Camera && !rules.weighs() {
            return Leaving { value: bsdf.eval(wo, direction), cos, turn: Turn::default() };
        }
        let back = back();
        let value = match walk {
            Walk::Camera => bsdf.eval(wo, direction),
            Walk::Light => back.eval(direction, wo),
        };
        if !rules.weighs() || value == Vec3::ZERO {
            return Leaving { value, cos, turn: Turn::default() };
        }
        let (end_back, survival_back) = match is_diffuse {
            true => (1.0, self.survival),
            false => {
                let ends = back.end_probability(direction);
                (ends, survival(rules.world, &back, direction, ends))
            }
        };
        let turn = Turn {
            onward: self.survival * bsdf.continuous_pdf(wo, direction).0,
            end_back,
            sum: self.sum.at(survival_back * back.continuous_pdf(direction, wo).0),
        };
        Leaving { value, cos, turn }
    }
}

/// A light path's vertex as it is kept.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex {
    /// Where it is, scene space.
    pub position: Vec3,
    /// Unit shading normal of the mesh.
    pub normal: Vec3,
    /// Unit direction to the vertex before.
    pub wo: Vec3,
    /// The surface.
    pub at: Address,
    /// Absolute cosine of `wo` to the geometric normal.
    pub cos: f32,
    /// Flux that arrives, were it the only light path, W.
    pub flux: Vec3,
    /// Share of the surface that is there, which is in the flux.
    pub opacity: f32,
    /// As in [`Vertex`].
    pub survival: f32,
    /// As in [`Vertex`].
    pub sum: Sum,
    /// Times that the light has been scattered on its way here.
    pub bounces: u32,
}

impl LightVertex {
    /// Ready to be left.
    pub fn with<T>(&self, world: &World, f: impl FnOnce(&Vertex) -> T) -> T {
        let hit = world.surface(&self.at);
        let bsdf = world.bsdf(&hit, self.wo);
        f(&Vertex { hit: &hit, bsdf: &bsdf, wo: self.wo, survival: self.survival, sum: self.sum })
    }
}
