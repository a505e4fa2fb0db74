//! The film as an OpenEXR file.
//!
//! One part, tiled. The channels of Combined are `R G B A`, those of the other passes `Depth.Z`,
//! `Normal.X`, ...; with a layer name in front they become `ViewLayer.Combined.R`, `ViewLayer.Depth.Z`, ...,
//! which is how Blender names them and what compositors group by.

use super::{Film, FilmError, Pass, Rect};
use exr::image::{
    AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer, write::WritableImage,
};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, Chromaticities, IntegerBounds, LineOrder, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use exr::prelude::SmallVec;
use glam::Mat4;
use half::f16;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Side of the file's tiles, pixels.
const FILE_TILE: usize = 64;

/// How a file is written. As JSON, the ABI's `segue_render_write_exr` options; the caller fills in the rest.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ExrOptions {
    /// Colours, alpha and normals as 16-bit floats. Depth, positions, texture coordinates and indices are
    /// 32-bit floats always.
    pub half: bool,
    /// How pixels are compressed.
    pub compression: Compression,
    /// Prefix of all channel names; empty for none.
    pub layer: String,
    /// Texts for the header, by name.
    pub attributes: BTreeMap<String, String>,
    /// Size of the full picture, of which the film may be a crop; `None`: the film is all of it.
    #[serde(skip)]
    pub full_size: Option<[u32; 2]>,
    /// Place of the film's top left pixel in the full picture.
    #[serde(skip)]
    pub offset: [u32; 2],
    /// World to camera space, for column vectors.
    #[serde(skip)]
    pub world_to_camera: Option<Mat4>,
}

impl Default for ExrOptions {
    fn default() -> Self {
        Self {
            half: true,
            compression: Compression::default(),
            layer: String::new(),
            attributes: BTreeMap::new(),
            full_size: None,
            offset: [0, 0],
            world_to_camera: None,
        }
    }
}

/// Compression of an OpenEXR file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Not at all.
    None,
    /// Run lengths; lossless.
    Rle,
    /// Deflate, by blocks of lines; lossless.
    #[default]
    Zip,
    /// Deflate, line by line; lossless.
    Zips,
    /// Wavelets; lossless.
    Piz,
    /// Deflate, with 32-bit floats cut to 24 bits.
    Pxr24,
    /// Lossy cosine transform of the channels named `R`, `G`, `B` and (by the format's rules) `Y`.
    Dwaa,
}

impl From<Compression> for exr::compression::Compression {
    fn from(compression: Compression) -> Self {
        match compression {
            Compression::None => Self::Uncompressed,
            Compression::Rle => Self::RLE,
            Compression::Zip => Self::ZIP16,
            Compression::Zips => Self::ZIP1,
            Compression::Piz => Self::PIZ,
            Compression::Pxr24 => Self::PXR24,
            Compression::Dwaa => Self::DWAA(None),
        }
    }
}

impl Film {
    /// Writes all passes to a file. The file appears, or is replaced, when it is complete.
    pub fn write_exr(&self, path: &Path, options: &ExrOptions) -> Result<(), FilmError> {
        let image = self.exr_image(self.rect(), options)?;
        let io_error = |source| FilmError::Io { path: path.to_owned(), source };
        let temporary = Temporary::beside(path).map_err(io_error)?;
        let file = BufWriter::new(temporary.file().map_err(io_error)?);
        encode(&image, file).map_err(|error| match error {
            exr::error::Error::Io(source) => io_error(source),
            other => FilmError::Encode(other.to_string()),
        })?;
        temporary.persist().map_err(io_error)
    }

    /// A rectangle of all passes as the bytes of a file.
    pub fn exr_bytes(&self, rect: Rect, options: &ExrOptions) -> Result<Vec<u8>, FilmError> {
        let image = self.exr_image(self.checked(rect)?, options)?;
        let mut bytes = Cursor::new(Vec::new());
        encode(&image, &mut bytes).map_err(|error| FilmError::Encode(error.to_string()))?;
        Ok(bytes.into_inner())
    }

    /// A snapshot of `rect` with its header. Nothing is locked any more when it is encoded.
    fn exr_image(&self, rect: Rect, options: &ExrOptions) -> Result<FlatImage, FilmError> {
        let [x, y] = options.offset;
        let [width, height] = options.full_size.unwrap_or([self.width(), self.height()]);
        let film = Rect::new(x, y, self.width(), self.height());
        // the format's coordinates are signed
        let addressable = i32::try_from(width.max(height)).is_ok();
        if !(addressable && film.is_inside(width, height)) {
            return Err(FilmError::Window { data: film, width, height });
        }

        let mut attributes = LayerAttributes {
            layer_position: Vec2((x + rect.x) as i32, (y + rect.y) as i32),
            // the file's matrices are for row vectors, so its rows are our columns
            world_to_camera: options.world_to_camera.map(|m| m.to_cols_array()),
            ..LayerAttributes::default()
        };
        for (name, value) in &options.attributes {
            let value = AttributeValue::Text(text("attribute value", value, usize::MAX)?);
            attributes.other.insert(text("attribute name", name, MAX_NAME)?, value);
        }

        let layer = Layer::new(
            Vec2(rect.width as usize, rect.height as usize),
            attributes,
            Encoding {
                compression: options.compression.into(),
                blocks: Blocks::Tiles(Vec2(FILE_TILE, FILE_TILE)),
                line_order: LineOrder::Increasing,
            },
            AnyChannels::sort(self.exr_channels(rect, options)?),
        );
        let mut shared =
            ImageAttributes::new(IntegerBounds::from_dimensions((width as usize, height as usize)));
        shared.chromaticities = Some(REC709);
        Ok(Image { attributes: shared, layer_data: layer })
    }

    /// The channels of all passes, read together so that they agree with each other in every pixel.
    fn exr_channels(
        &self,
        rect: Rect,
        options: &ExrOptions,
    ) -> Result<SmallVec<[AnyChannel<FlatSamples>; 4]>, FilmError> {
        let mut planes: Vec<(Pass, Vec<FlatSamples>)> = self
            .passes()
            .iter()
            .map(|pass| {
                let half = options.half && !pass.is_first_hit();
                let plane = || match half {
                    true => FlatSamples::F16(vec![f16::ZERO; rect.area()]),
                    false => FlatSamples::F32(vec![0.0; rect.area()]),
                };
                (pass, (0..pass.channels()).map(|_| plane()).collect())
            })
            .collect();
        self.visit(rect, |tile, pixel, place| {
            let mut values = [0.0; 4];
            for (pass, planes) in &mut planes {
                let values = &mut values[..pass.channels()];
                tile.read(*pass, pixel, values);
                for (plane, &value) in planes.iter_mut().zip(values.iter()) {
                    match plane {
                        FlatSamples::F16(plane) => plane[place] = to_half(value),
                        FlatSamples::F32(plane) => plane[place] = value,
                        FlatSamples::U32(_) => unreachable!("no pass is made of integers"),
                    }
                }
            }
        });
        let mut channels = SmallVec::new();
        for (pass, planes) in planes {
            for (letter, plane) in pass.channel_letters().chars().zip(planes) {
                let name = match (options.layer.as_str(), pass) {
                    ("", Pass::Combined) => letter.to_string(),
                    ("", _) => format!("{}.{letter}", pass.name()),
                    (layer, _) => format!("{layer}.{}.{letter}", pass.name()),
                };
                channels.push(AnyChannel::new(text("channel name", &name, MAX_NAME)?, plane));
            }
        }
        Ok(channels)
    }
}

type FlatImage = Image<Layer<AnyChannels<FlatSamples>>>;

fn encode(image: &FlatImage, mut out: impl Write + Seek) -> exr::error::UnitResult {
    image.write().to_buffered(&mut out)?;
    Ok(out.flush()?)
}

/// Chromaticities of Rec. ITU-R BT.709, CIE xy.
const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Nearest 16-bit float; brighter than its range is its brightest, since infinities break compositing.
fn to_half(value: f32) -> f16 {
    f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()))
}

/// Longest name of a channel or attribute, bytes.
const MAX_NAME: usize = 255;

/// UTF-8 text of the header.
fn text(what: &'static str, text: &str, max_bytes: usize) -> Result<Text, FilmError> {
    let refuse = |reason| Err(FilmError::ExrText { what, text: text.to_owned(), reason });
    if text.contains('\0') {
        return refuse("contains a NUL character");
    }
    if text.len() > max_bytes {
        return refuse("is longer than 255 bytes");
    }
    if text.is_empty() && max_bytes == MAX_NAME {
        return refuse("is empty");
    }
    Ok(Text::from_bytes_unchecked(SmallVec::from_slice(text.as_bytes())))
}

/// A file under another name until it is complete; removed if it never is.
struct Temporary {
    path: PathBuf,
    target: PathBuf,
}

impl Temporary {
    fn beside(target: &Path) -> io::Result<Self> {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        // through links, so that the link stays one
        let target = fs::canonicalize(target).unwrap_or_else(|_| target.to_owned());
        if target.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
        }
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!(".segue-{}-{number}.tmp", std::process::id());
        Ok(Self { path: target.with_file_name(name), target })
    }

    fn file(&self) -> io::Result<File> {
        File::options().write(true).create_new(true).open(&self.path)
    }

    fn persist(self) -> io::Result<()> {
        fs::rename(&self.path, &self.target)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // after a successful rename there is nothing to remove, and that is fine
        let _ = fs::remove_file(&self.path);
    }
}
