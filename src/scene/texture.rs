//! Textures: where a material's values come from when they are not constant.

use super::composition::{self, Multilinear, MultilinearJson, Table, TableJson};
use super::picture::{ImageTexture, Projection, Reconstruction, Wrap};
use super::value::Value;
use super::{Image, SceneError};
use crate::math::bricks::Bricks;
use crate::math::cells::Cells;
use crate::math::noise::Fractal;
use glam::{Affine2, DAffine3, DMat3, DVec3, Mat2, Vec2, Vec4};
use serde::Deserialize;
use std::sync::Arc;

/// Where noise and other patterns are looked up.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub enum Place {
    /// Where a colour attribute of this name says; where a mesh has none, all is at the origin.
    Attribute(String),
    /// Where a value says.
    Value(Value),
}

impl Place {
    /// The attribute, if it is one.
    pub fn attribute(&self) -> Option<&str> {
        match self {
            Self::Attribute(name) => Some(name),
            Self::Value(_) => None,
        }
    }

    /// The value, if it is one.
    pub fn value(&self) -> Option<&Value> {
        match self {
            Self::Attribute(_) => None,
            Self::Value(v) => Some(v),
        }
    }
}

/// Noise by a place, and what it is shown as.
#[derive(Clone, Debug)]
pub struct NoiseTexture {
    /// The place.
    pub place: Place,
    /// The noise.
    pub noise: Fractal,
    /// Whether the three components have noise of their own.
    pub colored: bool,
    /// Index of the image whose upper row has the values from 0 to 1, from left to right.
    pub image: u32,
    /// Factor of the image's value.
    pub scale: Vec4,
    /// Added after the factor.
    pub bias: Vec4,
}

/// Cellular noise by a place.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellTexture {
    /// The place.
    pub place: Place,
    /// The noise.
    #[serde(default)]
    pub cells: Cells,
    /// Whether it is the cells' colours, instead of the distances.
    #[serde(default)]
    pub colored: bool,
}

/// Walls of bricks by a place: mortar in the first component, the bricks' random numbers in the second.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BrickTexture {
    /// The place.
    pub place: Place,
    /// The wall.
    #[serde(default)]
    pub bricks: Bricks,
}

/// What the geometry of a surface has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Where the point is.
    Position,
    /// The unit shading normal of the mesh, on the side that is seen.
    Normal,
    /// The unit normal of the triangle, on the side that is seen.
    FaceNormal,
}

/// The space that it is in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Space {
    /// The scene's.
    #[default]
    World,
    /// The mesh's own.
    Object,
}

/// The geometry of the surface as a vector.
#[derive(Clone, Debug)]
pub struct GeometryTexture {
    /// What it is.
    pub of: Quantity,
    /// The space that it is in.
    pub space: Space,
    /// What is applied to it, in a space around the scene's origin.
    pub to: DAffine3,
}

/// A texture: a function of the surface point with an RGBA value.
#[derive(Clone, Debug)]
pub enum Texture {
    /// The same everywhere.
    Constant(Vec4),
    /// A picture.
    Image(Box<ImageTexture>),
    /// Noise.
    Noise(Box<NoiseTexture>),
    /// Cellular noise.
    Cells(Box<CellTexture>),
    /// A wall of bricks.
    Bricks(Box<BrickTexture>),
    /// The length of a vector.
    Length(Value),
    /// The geometry of the surface.
    Geometry(Box<GeometryTexture>),
    /// A colour attribute of the mesh, or `default` where the mesh has none of that name.
    Attribute {
        /// Name of the attribute.
        name: String,
        /// Value where the mesh has no such attribute.
        default: Vec4,
    },
    /// The cosine between the direction that the surface is seen from and its shading normal, negative on its back.
    Facing,
    /// A sum of products of others.
    Multilinear(Multilinear),
    /// A function of others.
    Table(Table),
}

#[derive(Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
enum Json {
    Constant {
        value: [f32; 4],
    },
    Image {
        image: u32,
        #[serde(default)]
        uv: String,
        #[serde(default)]
        at: Option<Value>,
        #[serde(default)]
        projection: Projection,
        #[serde(default = "identity")]
        transform: [f32; 6],
        #[serde(default)]
        wrap_s: Wrap,
        #[serde(default)]
        wrap_t: Wrap,
        #[serde(default)]
        filter: Reconstruction,
        #[serde(default = "ones")]
        scale: [f32; 4],
        #[serde(default)]
        bias: [f32; 4],
    },
    Noise {
        place: Place,
        image: u32,
        #[serde(default)]
        detail: f32,
        #[serde(default = "half")]
        roughness: f32,
        #[serde(default = "two")]
        lacunarity: f32,
        #[serde(default)]
        distortion: f32,
        #[serde(default)]
        colored: bool,
        #[serde(default = "ones")]
        scale: [f32; 4],
        #[serde(default)]
        bias: [f32; 4],
    },
    Cells(Box<CellTexture>),
    Bricks(Box<BrickTexture>),
    Length {
        of: Value,
    },
    Geometry {
        of: Quantity,
        #[serde(default)]
        space: Space,
        #[serde(default = "identity_in_space")]
        transform: [f64; 12],
    },
    Attribute {
        name: String,
        default: [f32; 4],
    },
    Facing {},
    Multilinear(MultilinearJson),
    Table(TableJson),
}

/// Octaves beyond the first, at most.
const MOST_DETAIL: f32 = 15.0;

fn half() -> f32 {
    0.5
}

fn two() -> f32 {
    2.0
}

fn identity() -> [f32; 6] {
    [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
}

fn identity_in_space() -> [f64; 12] {
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]
}

fn ones() -> [f32; 4] {
    [1.0; 4]
}

impl Texture {
    /// The same where the coordinates of the scene are relative to `origin`.
    pub(super) fn relative_to(self, origin: DVec3) -> Self {
        match self {
            Self::Geometry(mut t) if t.of == Quantity::Position && t.space == Space::World => {
                t.to.translation = t.to.transform_point3(origin);
                Self::Geometry(t)
            }
            other => other,
        }
    }

    /// Where it is looked up, if it is a pattern.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Self::Noise(t) => Some(&t.place),
            Self::Cells(t) => Some(&t.place),
            Self::Bricks(t) => Some(&t.place),
            Self::Constant(_)
            | Self::Image(_)
            | Self::Length(_)
            | Self::Geometry(_)
            | Self::Attribute { .. }
            | Self::Facing
            | Self::Multilinear(_)
            | Self::Table(_) => None,
        }
    }

    /// The attribute of the mesh that it reads, by name: a UV set or a colour.
    pub fn attribute(&self) -> Option<&str> {
        match self {
            Self::Image(t) => Some(&t.uv),
            Self::Attribute { name, .. } => Some(name),
            _ => self.place().and_then(Place::attribute),
        }
    }

    /// The values that it is made of.
    pub fn made_of(&self) -> &[Value] {
        match self {
            Self::Multilinear(t) => &t.of,
            Self::Table(t) => &t.of,
            Self::Image(t) => t.at.as_slice(),
            Self::Length(of) => std::slice::from_ref(of),
            _ => self.place().and_then(Place::value).map(std::slice::from_ref).unwrap_or_default(),
        }
    }

    /// A texture from its JSON description (`docs/abi.md`), and from the images and other textures that are there.
    pub fn from_json(
        name: &str,
        json: &str,
        images: &[Arc<Image>],
        before: &[Self],
    ) -> Result<Self, SceneError> {
        let fail = |problem: String| SceneError::new(format!("texture {name:?}"), problem);
        let finite = |what: &str, values: &[f32]| match values.iter().all(|v| v.is_finite()) {
            true => Ok(()),
            false => Err(fail(format!("{what} has a value that is not finite"))),
        };
        let exists = |image: u32| match (image as usize) < images.len() {
            true => Ok(()),
            false => Err(fail(format!("there is no image {image}"))),
        };
        let check_place = |place: &Place| match place {
            Place::Attribute(of) if of.is_empty() => Err(fail("place names no attribute".into())),
            Place::Attribute(_) => Ok(()),
            Place::Value(v) => composition::check(std::slice::from_ref(v), name, before),
        };
        match serde_json::from_str(json).map_err(|e| fail(e.to_string()))? {
            Json::Constant { value } => {
                finite("value", &value)?;
                Ok(Self::Constant(value.into()))
            }
            Json::Image { image, uv, at, projection, transform, wrap_s, wrap_t, filter, scale, bias } => {
                exists(image)?;
                if projection != Projection::Flat && at.is_none() {
                    return Err(fail("a projection needs three coordinates: `at` is missing".into()));
                }
                if let Projection::Box { blend } = projection {
                    finite("blend", &[blend])?;
                }
                finite("transform", &transform)?;
                finite("scale", &scale)?;
                finite("bias", &bias)?;
                if let Some(at) = &at {
                    composition::check(std::slice::from_ref(at), name, before)?;
                }
                let [a, b, c, d, e, f] = transform;
                Ok(Self::Image(Box::new(ImageTexture {
                    image,
                    uv,
                    at,
                    projection: projection.sane(),
                    transform: Affine2::from_mat2_translation(
                        Mat2::from_cols(Vec2::new(a, d), Vec2::new(b, e)),
                        Vec2::new(c, f),
                    ),
                    wrap: [wrap_s, wrap_t],
                    filter,
                    scale: scale.into(),
                    bias: bias.into(),
                })))
            }
            Json::Noise { place, image, detail, roughness, lacunarity, distortion, colored, scale, bias } => {
                exists(image)?;
                check_place(&place)?;
                finite("noise", &[detail, roughness, lacunarity, distortion])?;
                finite("scale", &scale)?;
                finite("bias", &bias)?;
                let detail = detail.clamp(0.0, MOST_DETAIL);
                let roughness = roughness.max(0.0);
                let noise = Fractal { detail, roughness, lacunarity, distortion };
                let (scale, bias) = (scale.into(), bias.into());
                Ok(Self::Noise(Box::new(NoiseTexture { place, noise, colored, image, scale, bias })))
            }
            Json::Cells(mut texture) => {
                check_place(&texture.place)?;
                let c = &mut texture.cells;
                let numbers = [c.exponent, c.smoothness, c.randomness, c.detail, c.roughness, c.lacunarity];
                finite("cells", &numbers)?;
                c.exponent = c.exponent.max(0.01);
                c.randomness = c.randomness.clamp(0.0, 1.0);
                c.detail = c.detail.clamp(0.0, MOST_DETAIL);
                c.roughness = c.roughness.clamp(0.0, 1.0);
                Ok(Self::Cells(texture))
            }
            Json::Bricks(texture) => {
                check_place(&texture.place)?;
                let b = &texture.bricks;
                finite("bricks", &[b.width, b.height, b.mortar, b.smooth, b.bias, b.offset, b.squash])?;
                if !(b.width > 0.0 && b.height > 0.0 && b.squash > 0.0) {
                    return Err(fail("bricks have no width or no height".into()));
                }
                Ok(Self::Bricks(texture))
            }
            Json::Length { of } => {
                composition::check(std::slice::from_ref(&of), name, before)?;
                Ok(Self::Length(of))
            }
            Json::Geometry { of, space, transform } => {
                finite("transform", &transform.map(|v| v as f32))?;
                let [a, b, c, d, e, f, g, h, i, j, k, l] = transform;
                let matrix3 = DMat3::from_cols_array(&[a, e, i, b, f, j, c, g, k]);
                let to = DAffine3 { matrix3, translation: DVec3::new(d, h, l) };
                Ok(Self::Geometry(Box::new(GeometryTexture { of, space, to })))
            }
            Json::Attribute { name: attribute, default } => {
                finite("default", &default)?;
                Ok(Self::Attribute { name: attribute, default: default.into() })
            }
            Json::Facing {} => Ok(Self::Facing),
            Json::Multilinear(json) => Ok(Self::Multilinear(Multilinear::new(json, name, before)?)),
            Json::Table(json) => Ok(Self::Table(Table::new(json, name, images, before)?)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Warnings;
    use crate::scene::image::{Encoding, Pixels};

    #[test]
    fn descriptions_are_read_and_checked() {
        let black =
            Image::new("i", (1, 1, 1), Pixels::U8(vec![0]), Encoding::Linear, &mut Warnings::default());
        let images = [Arc::new(black.unwrap())];
        let t = Texture::from_json(
            "t",
            r#"{"type":"image","image":0,"transform":[2,0,0.5,0,3,0.25]}"#,
            &images,
            &[],
        )
        .unwrap();
        let Texture::Image(t) = t else { panic!("not an image") };
        assert_eq!(t.transform.transform_point2(Vec2::ONE), Vec2::new(2.5, 3.25));
        for (json, what) in [
            (r#"{"type":"image","image":1}"#, "no image 1"),
            (r#"{"type":"image","image":0,"wrap":"x"}"#, "wrap"),
            (r#"{"type":"voronoi"}"#, "voronoi"),
            (r#"{"type":"image","image":0,"projection":"tube"}"#, "`at`"),
            (r#"{"type":"geometry","of":"colour"}"#, "colour"),
            (r#"{"type":"geometry","of":"normal","transform":[1]}"#, "length"),
            (r#"{"type":"noise","image":0}"#, "place"),
            (r#"{"type":"noise","place":"","image":0}"#, "place"),
            (r#"{"type":"noise","place":"p","image":1}"#, "no image 1"),
            (r#"{"type":"noise","place":"p","image":0,"detail":1e39}"#, "noise"),
            (r#"{"type":"constant","value":[1,2,3]}"#, "length"),
        ] {
            let e = Texture::from_json("t", json, &images, &[]).unwrap_err().to_string();
            assert!(e.contains(what), "{json}: {e}");
        }
    }
}
