//! Energy of rough microfacet surfaces: what single scattering loses, and how it is given back.
//!
//! A microfacet model that counts one bounce loses the light that meets a second facet, up to seven
//! tenths of it. It is given back so that a lossless surface has an albedo of one in every direction, in the
//! shape of what is scattered once:
//!
//! - Reflection scales the single-scattering lobe `f1` symmetrically, `f = f1(wo, wi) s(wo) s(wi)`, with the
//!   one function `s` for which every albedo becomes one, found by the fixed-point iteration of Sinkhorn
//!   and Knopp (1967). It stays reciprocal.
//! - Refracting interfaces are scaled by `1 / E(wo)`, what single scattering keeps of the light seen along `wo`
//!   (Turquin 2019), as in Cycles: a symmetric scale would have to trade reflection against refraction, and a broad
//!   lobe in its place lets light out of rough glass that would be totally reflected. As the layers of a
//!   principled surface, that is not reciprocal; `wo` is the camera's side for every walk.
//!
//! The tables hold the logarithm of `s`, and the albedos of single scattering or what it loses. They are
//! made by `tests/lobes_tables.rs`, which also checks them. Elevation enters as measured in the space
//! where the distribution of normals is a hemisphere: so the tables have a limit as roughness goes to zero.

use super::Ggx;
use super::fresnel::stretched_dielectric;
use glam::Vec3;
use grid::*;

/// Number of nodes along the axes of the tables. Nodes are evenly spaced from zero to one.
pub mod grid {
    /// Perceptual roughness, of the geometric mean of the two alphas.
    pub const ROUGHNESS: usize = 32;
    /// Elevation, as [`super::elevation_coordinate`].
    pub const ELEVATION: usize = 32;
    /// Roughness of refracting interfaces and layers, as [`super::glass_roughness_coordinate`].
    pub const GLASS_ROUGHNESS: usize = 48;
    /// Elevation over refracting interfaces.
    pub const GLASS_ELEVATION: usize = 64;
    /// Refractive index, as [`super::index_coordinate`].
    pub const INDEX: usize = 47;
    /// Square root of the cosine, for the layers' Fresnel averages.
    pub const COSINE: usize = 24;
    /// Elevation of the anisotropic table.
    pub const ANISO_ELEVATION: usize = 28;
    /// Stretched azimuth, as [`super::azimuth_coordinate`].
    pub const ANISO_AZIMUTH: usize = 24;
    /// Ratio of the alphas, as [`super::ratio_coordinate`].
    pub const ANISO_RATIO: usize = 13;
    /// Perceptual roughness of the anisotropic table.
    pub const ANISO_ROUGHNESS: usize = 22;

    /// Reflection: roughness, elevation.
    pub const REFLECTION: usize = ROUGHNESS * ELEVATION;
    /// Anisotropic reflection: ratio, roughness, azimuth, elevation.
    pub const ANISO: usize = ANISO_RATIO * ANISO_ROUGHNESS * ANISO_AZIMUTH * ANISO_ELEVATION;
    /// Means over a refracting interface: index, roughness, side (that of the lower index first).
    pub const GLASS_MEAN: usize = INDEX * GLASS_ROUGHNESS * 2;
    /// A refracting interface: index, roughness, side, elevation.
    pub const GLASS: usize = GLASS_MEAN * GLASS_ELEVATION;
    /// Fresnel averages of a dielectric layer: index, roughness, cosine.
    pub const LAYER: usize = INDEX * GLASS_ROUGHNESS * COSINE;

    /// Where the logarithm of the scale of reflection begins.
    pub const SCALE_AT: usize = 0;
    /// Single-scattering albedo of reflection.
    pub const ALBEDO_AT: usize = SCALE_AT + REFLECTION;
    /// Its cosine-weighted mean, by roughness.
    pub const MEAN_AT: usize = ALBEDO_AT + REFLECTION;
    /// Logarithm of the scale of anisotropic reflection.
    pub const ANISO_AT: usize = MEAN_AT + ROUGHNESS;
    /// Fourth root of what single scattering loses at a refracting interface.
    pub const GLASS_AT: usize = ANISO_AT + ANISO;
    /// Fourth root of its cosine-weighted mean.
    pub const GLASS_MEAN_AT: usize = GLASS_AT + GLASS;
    /// Fresnel average of what a layer scatters once.
    pub const ONCE_AT: usize = GLASS_MEAN_AT + GLASS_MEAN;
    /// Fresnel average of what it scatters more often.
    pub const MORE_AT: usize = ONCE_AT + LAYER;
    /// All numbers.
    pub const TOTAL: usize = MORE_AT + LAYER;
}

/// Largest refractive index of the tables; above it, its values are used.
pub const MAX_INDEX: f32 = 4.0;
/// Smallest ratio of the two alphas in the tables; below it, its values are used.
pub const MIN_RATIO: f32 = 0.01;
/// The number zero in the file, which is 16-bit fixed point.
pub const FIXED_ZERO: f32 = 16_384.0;
/// One, less zero.
pub const FIXED_ONE: f32 = 16_384.0;

static TABLES: [f32; TOTAL] = decode(include_bytes!("energy.bin"));

/// Little-endian 16-bit fixed point numbers.
const fn decode(bytes: &[u8; 2 * TOTAL]) -> [f32; TOTAL] {
    let mut out = [0.0; TOTAL];
    let mut i = 0;
    while i < TOTAL {
        // by hand: a call for every number is more than constants may take to evaluate
        let fixed = bytes[2 * i] as u16 | (bytes[2 * i + 1] as u16) << 8;
        out[i] = (fixed as f32 - FIXED_ZERO) / FIXED_ONE;
        i += 1;
    }
    out
}

/// Place of an elevation along its axis, for the cosine `x` to the normal: a function of the tangent `y` of
/// half the angle that draws the nodes together at both ends.
#[inline]
pub fn elevation_coordinate(x: f32) -> f32 {
    let y = ((1.0 - x) / (1.0 + x)).clamp(0.0, 1.0).sqrt();
    let (a, b) = (y.sqrt(), (1.0 - y).sqrt());
    a / (a + b)
}

/// Place of an azimuth along its axis, for the components along the rougher and the smoother axis.
#[inline]
pub fn azimuth_coordinate(along: f32, across: f32) -> f32 {
    let (a, b) = (along.abs(), across.abs());
    a / (a + b).max(1e-30)
}

/// Place of a perceptual roughness along the axis of the refracting tables.
#[inline]
pub fn glass_roughness_coordinate(r: f32) -> f32 {
    2.0 * r / (1.0 + r)
}

/// Place of a refractive index (at least one) along its axis.
pub fn index_coordinate(eta: f32) -> f32 {
    let z = |n: f32| ((n - 1.0) / (n + 1.0)).max(0.0);
    (z(eta) / z(MAX_INDEX)).sqrt().min(1.0)
}

/// Place of a ratio of alphas, the smaller over the larger, along its axis.
pub fn ratio_coordinate(ratio: f32) -> f32 {
    ratio.clamp(MIN_RATIO, 1.0).ln() / MIN_RATIO.ln()
}

/// A place between two neighbouring nodes.
#[derive(Clone, Copy, Debug)]
struct Node {
    index: u16,
    fraction: f32,
}

impl Node {
    /// At `v` of [0,1] on an axis of `n` nodes.
    #[inline]
    fn new(v: f32, n: usize) -> Self {
        let p = v.clamp(0.0, 1.0) * (n - 1) as f32;
        let index = (p as usize).min(n - 2);
        Self { index: index as u16, fraction: p - index as f32 }
    }

    #[inline]
    fn lerp(self, f: impl Fn(usize) -> f32) -> f32 {
        let i = usize::from(self.index);
        let (a, b) = (f(i), f(i + 1));
        a + (b - a) * self.fraction
    }
}

#[inline]
fn roughness(ggx: &Ggx, nodes: usize) -> Node {
    Node::new(ggx.mean_roughness(), nodes)
}

/// Elevation of a direction; `stretched`: its [`Ggx::stretched`] length.
#[inline]
fn elevation(w: Vec3, stretched: f32, nodes: usize) -> Node {
    Node::new(elevation_coordinate(w.z.abs() / stretched), nodes)
}

/// The scale `s` of a reflecting surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReflectionScale {
    roughness: Node,
    /// Of an anisotropic surface.
    ratio: Option<Node>,
    /// Whether the y axis is the rougher one.
    turned: bool,
}

impl ReflectionScale {
    pub fn new(ggx: &Ggx) -> Self {
        let a = ggx.alphas();
        let (low, high) = (a.min_element(), a.max_element());
        let ratio = (low < 0.999 * high).then(|| Node::new(ratio_coordinate(low / high), ANISO_RATIO));
        let nodes = if ratio.is_some() { ANISO_ROUGHNESS } else { ROUGHNESS };
        Self { roughness: roughness(ggx, nodes), ratio, turned: a.y > a.x }
    }

    /// `s(wo) s(wi)`, each direction with its [`Ggx::stretched`] length.
    #[inline]
    pub fn product(&self, ggx: &Ggx, (wo, so): (Vec3, f32), (wi, si): (Vec3, f32)) -> f32 {
        (self.log(ggx, wo, so) + self.log(ggx, wi, si)).exp()
    }

    #[inline]
    fn log(&self, ggx: &Ggx, w: Vec3, stretched: f32) -> f32 {
        let Some(ratio) = self.ratio else {
            let x = elevation(w, stretched, ELEVATION);
            return self.roughness.lerp(|r| x.lerp(|k| TABLES[SCALE_AT + r * ELEVATION + k]));
        };
        let x = elevation(w, stretched, ANISO_ELEVATION);
        let v = ggx.alphas() * w.truncate();
        let (along, across) = if self.turned { (v.y, v.x) } else { (v.x, v.y) };
        let azimuth = Node::new(azimuth_coordinate(along, across), ANISO_AZIMUTH);
        ratio.lerp(|q| {
            self.roughness.lerp(|r| {
                let row = (q * ANISO_ROUGHNESS + r) * ANISO_AZIMUTH;
                azimuth.lerp(|c| x.lerp(|k| TABLES[ANISO_AT + (row + c) * ANISO_ELEVATION + k]))
            })
        })
    }
}

/// Single-scattering albedo of a white reflecting surface, as if it were isotropic.
#[inline]
pub(super) fn albedo(ggx: &Ggx, w: Vec3) -> f32 {
    let x = elevation(w, ggx.stretched(w), ELEVATION);
    roughness(ggx, ROUGHNESS).lerp(|r| x.lerp(|k| TABLES[ALBEDO_AT + r * ELEVATION + k]))
}

/// Cosine-weighted mean of [`albedo`] over the hemisphere.
pub(super) fn mean_albedo(ggx: &Ggx) -> f32 {
    roughness(ggx, ROUGHNESS).lerp(|r| TABLES[MEAN_AT + r])
}

/// Average over the lobe of the stretched dielectric reflectance of index `eta`, seen at cosine `mu`: of
/// the light scattered once, and of the light scattered more often.
pub(super) fn layer_fresnel(ggx: &Ggx, mu: f32, eta: f32) -> (f32, f32) {
    if ggx.is_smooth() {
        let s = stretched_dielectric(mu, eta);
        return (s, s);
    }
    let cos = Node::new(mu.abs().sqrt(), COSINE);
    let rough = Node::new(glass_roughness_coordinate(ggx.mean_roughness()), GLASS_ROUGHNESS);
    let index = Node::new(index_coordinate(eta), INDEX);
    let look = |at: usize| {
        index.lerp(|i| rough.lerp(|r| cos.lerp(|k| TABLES[at + (i * GLASS_ROUGHNESS + r) * COSINE + k])))
    };
    (look(ONCE_AT), look(MORE_AT))
}

/// What a refracting interface loses by single scattering.
#[derive(Clone, Copy, Debug)]
pub(super) struct GlassLoss {
    index: Node,
    roughness: Node,
    /// Tint of the light that is scattered more than once, over that of the light scattered once, on the side of the lower
    /// and of the higher index.
    tint: [Vec3; 2],
}

impl GlassLoss {
    /// `eta` or its inverse: which side is which is for the methods. `ggx`: isotropic. `tint`: what is left of the light
    /// after each meeting with a facet; most of it is transmitted in the end.
    pub fn new(ggx: &Ggx, eta: f32, tint: Vec3) -> Self {
        let eta = if eta < 1.0 { 1.0 / eta } else { eta };
        let index = Node::new(index_coordinate(eta), INDEX);
        let rough = Node::new(glass_roughness_coordinate(ggx.mean_roughness()), GLASS_ROUGHNESS);
        let of_side = |side: usize| {
            let root =
                index.lerp(|i| rough.lerp(|r| TABLES[GLASS_MEAN_AT + (i * GLASS_ROUGHNESS + r) * 2 + side]));
            let lost = root.powi(4);
            // the geometric series of Kulla and Conty 2017, its first term apart
            tint * (1.0 - lost) / (Vec3::ONE - tint * lost)
        };
        Self { index, roughness: rough, tint: [0, 1].map(of_side) }
    }

    /// Share of the light from a direction that single scattering loses. `dense`: on the side of the
    /// higher index; `stretched`: the direction's [`Ggx::stretched`] length.
    #[inline]
    fn lost(&self, w: Vec3, stretched: f32, dense: bool) -> f32 {
        let x = elevation(w, stretched, GLASS_ELEVATION);
        let root = self.index.lerp(|i| {
            self.roughness.lerp(|r| {
                let row = GLASS_AT + ((i * GLASS_ROUGHNESS + r) * 2 + usize::from(dense)) * GLASS_ELEVATION;
                x.lerp(|k| TABLES[row + k])
            })
        });
        root.powi(4)
    }

    /// Factor on what is scattered once that gives back the rest, seen from `wo`. Arguments as above.
    #[inline]
    pub fn scale(&self, wo: Vec3, stretched: f32, dense: bool) -> Vec3 {
        let lost = self.lost(wo, stretched, dense);
        Vec3::ONE + self.tint[usize::from(dense)] * (lost / (1.0 - lost))
    }
}
