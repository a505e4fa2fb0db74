//! Images as textures: how they are mapped, continued beyond their edges, and reconstructed.

use super::value::Value;
use glam::{Affine2, Vec4};
use serde::Deserialize;

/// What lies outside `[0,1]` of an image's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The edge's texel.
    Clamp,
    /// The picture mirrored.
    Mirror,
    /// Transparent black.
    Black,
}

/// How an image is reconstructed between texel centres.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Reconstruction {
    /// Bilinear.
    #[default]
    Linear,
    /// Nearest texel.
    Closest,
}

/// How three coordinates become those of a picture, as in Blender's Image Texture.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Default)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Projection {
    /// The first two.
    #[default]
    Flat,
    /// From the six sides of a box; the normal in the mesh's space decides from which.
    Box {
        /// Between which share of the normal's components the pictures of two sides are blended, in `[0,1]`.
        #[serde(default)]
        blend: f32,
    },
    /// Longitude and latitude around the middle of the unit cube.
    Sphere,
    /// Longitude around the vertical axis through the middle of the unit cube, and height.
    Tube,
}

impl Projection {
    /// With what is out of range clamped.
    pub fn sane(self) -> Self {
        match self {
            Self::Box { blend } => Self::Box { blend: blend.clamp(0.0, 1.0) },
            other => other,
        }
    }
}

/// An image mapped by a UV set, or by other coordinates.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    /// Index of the image in the scene.
    pub image: u32,
    /// Name of the UV attribute; empty is the mesh's first one.
    pub uv: String,
    /// What stands for its coordinates instead, the first two components of it unless it is projected.
    pub at: Option<Value>,
    /// How three components of `at` become the two coordinates.
    pub projection: Projection,
    /// Those to picture coordinates, (0,0) at the bottom left.
    pub transform: Affine2,
    /// Wrap along s and t.
    pub wrap: [Wrap; 2],
    /// Reconstruction filter.
    pub filter: Reconstruction,
    /// Factor of the decoded value.
    pub scale: Vec4,
    /// Added after the factor.
    pub bias: Vec4,
}
