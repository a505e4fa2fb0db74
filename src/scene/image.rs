//! Pictures in memory, kept in the precision they came in.

use super::{SceneError, Warnings};
use crate::math::color::srgb_to_linear;
use glam::{Vec3, Vec4};
use half::f16;
use std::sync::LazyLock;

/// Pixel values as they came, row 0 on top, channels interleaved.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// Eight bits, 255 is one.
    U8(Vec<u8>),
    /// Sixteen bits, 65535 is one.
    U16(Vec<u16>),
    /// Half float.
    F16(Vec<f16>),
    /// Float.
    F32(Vec<f32>),
}

impl Pixels {
    fn len(&self) -> usize {
        match self {
            Self::U8(p) => p.len(),
            Self::U16(p) => p.len(),
            Self::F16(p) => p.len(),
            Self::F32(p) => p.len(),
        }
    }
}

/// How colour values are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Scene linear, or data.
    Linear,
    /// The sRGB transfer curve on the colour channels.
    Srgb,
}

/// A picture.
#[derive(Clone, Debug)]
pub struct Image {
    name: String,
    width: u32,
    height: u32,
    channels: u32,
    pixels: Pixels,
    encoding: Encoding,
}

/// Largest picture side: 2^16 keeps texel indices exact in `f32`.
const MAX_SIDE: u32 = 1 << 16;

impl Image {
    /// A picture of `height * width * channels` values; non-finite ones become 0 and are counted.
    pub fn new(
        name: &str,
        (width, height, channels): (u32, u32, u32),
        mut pixels: Pixels,
        encoding: Encoding,
        warnings: &mut Warnings,
    ) -> Result<Self, SceneError> {
        let object = format!("image {name:?}");
        if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
            return Err(SceneError::new(
                object,
                format!("its size is {width} x {height}, allowed is 1 to {MAX_SIDE}"),
            ));
        }
        if !(1..=4).contains(&channels) {
            return Err(SceneError::new(object, format!("it has {channels} channels, allowed is 1 to 4")));
        }
        let expected = width as usize * height as usize * channels as usize;
        if pixels.len() != expected {
            return Err(SceneError::new(
                object,
                format!("it has {} values instead of {expected}", pixels.len()),
            ));
        }
        let mut bad = 0;
        match &mut pixels {
            Pixels::F16(p) => p.iter_mut().filter(|v| !v.is_finite()).for_each(|v| {
                *v = f16::ZERO;
                bad += 1;
            }),
            Pixels::F32(p) => p.iter_mut().filter(|v| !v.is_finite()).for_each(|v| {
                *v = 0.0;
                bad += 1;
            }),
            Pixels::U8(_) | Pixels::U16(_) => {}
        }
        if bad > 0 {
            warnings.add(object, "values that are not finite were set to 0", bad);
        }
        Ok(Self { name: name.into(), width, height, channels, pixels, encoding })
    }

    /// The name, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether some texel has an alpha that is not one.
    pub fn has_alpha(&self) -> bool {
        let stride = self.channels as usize;
        matches!(stride, 2 | 4)
            && match &self.pixels {
                Pixels::U8(p) => p.chunks(stride).any(|t| t[stride - 1] != 255),
                Pixels::U16(p) => p.chunks(stride).any(|t| t[stride - 1] != 65535),
                Pixels::F16(p) => p.chunks(stride).any(|t| t[stride - 1].to_f32() != 1.0),
                Pixels::F32(p) => p.chunks(stride).any(|t| t[stride - 1] != 1.0),
            }
    }

    /// The decoded texel: linear colour and alpha. Grey is spread over the colour channels; a missing
    /// alpha is one. `x` grows to the right, `y` downwards; both must be inside.
    pub fn texel(&self, x: u32, y: u32) -> Vec4 {
        let n = self.channels as usize;
        let i = (y as usize * self.width as usize + x as usize) * n;
        let is_srgb = self.encoding == Encoding::Srgb;
        let curve = |v: f32| if is_srgb { srgb_to_linear(v) } else { v };
        match &self.pixels {
            Pixels::U8(p) => {
                let table = byte_table(self.encoding);
                spread(&p[i..i + n], |v| table[v as usize], |v| f32::from(v) / 255.0)
            }
            Pixels::U16(p) => spread(&p[i..i + n], |v| curve(unit16(v)), unit16),
            Pixels::F16(p) => spread(&p[i..i + n], |v| curve(v.to_f32()), f16::to_f32),
            Pixels::F32(p) => spread(&p[i..i + n], curve, |v| v),
        }
    }

    /// Bytes the pixels take.
    pub fn memory_bytes(&self) -> usize {
        self.pixels.len()
            * match self.pixels {
                Pixels::U8(_) => 1,
                Pixels::U16(_) | Pixels::F16(_) => 2,
                Pixels::F32(_) => 4,
            }
    }
}

fn unit16(v: u16) -> f32 {
    f32::from(v) / 65535.0
}

/// The channels of a texel as RGBA.
#[inline]
fn spread<T: Copy>(texel: &[T], color: impl Fn(T) -> f32, alpha: impl Fn(T) -> f32) -> Vec4 {
    match *texel {
        [grey] => Vec3::splat(color(grey)).extend(1.0),
        [grey, a] => Vec3::splat(color(grey)).extend(alpha(a)),
        [r, g, b] => Vec4::new(color(r), color(g), color(b), 1.0),
        [r, g, b, a, ..] => Vec4::new(color(r), color(g), color(b), alpha(a)),
        [] => Vec4::W,
    }
}

/// Linear values of bytes.
fn byte_table(encoding: Encoding) -> &'static [f32; 256] {
    static TABLES: LazyLock<[[f32; 256]; 2]> = LazyLock::new(|| {
        let linear: [f32; 256] = std::array::from_fn(|i| i as f32 / 255.0);
        [linear, linear.map(srgb_to_linear)]
    });
    &TABLES[usize::from(encoding == Encoding::Srgb)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_decoded_and_spread() {
        let mut w = Warnings::default();
        let grey = Image::new("g", (1, 1, 2), Pixels::U8(vec![188, 51]), Encoding::Srgb, &mut w).unwrap();
        let t = grey.texel(0, 0);
        approx::assert_abs_diff_eq!(t.x, 0.5, epsilon = 5e-3);
        assert_eq!((t.x, t.y), (t.z, t.x));
        assert_eq!(t.w, 51.0 / 255.0);
        let rgb =
            Image::new("c", (2, 1, 3), Pixels::U16(vec![0, 0, 0, 65535, 0, 0]), Encoding::Linear, &mut w)
                .unwrap();
        assert_eq!(rgb.texel(1, 0), Vec4::new(1.0, 0.0, 0.0, 1.0));
        assert!(grey.has_alpha() && !rgb.has_alpha());
        assert!(w.is_empty());
    }

    #[test]
    fn bad_pictures_are_refused_or_repaired() {
        let mut w = Warnings::default();
        assert!(Image::new("z", (0, 1, 3), Pixels::U8(vec![]), Encoding::Srgb, &mut w).is_err());
        assert!(Image::new("z", (1, 1, 5), Pixels::U8(vec![0; 5]), Encoding::Srgb, &mut w).is_err());
        assert!(Image::new("z", (2, 2, 3), Pixels::U8(vec![0; 5]), Encoding::Srgb, &mut w).is_err());
        let i = Image::new(
            "n",
            (1, 1, 3),
            Pixels::F32(vec![f32::NAN, 1.0, f32::INFINITY]),
            Encoding::Linear,
            &mut w,
        );
        assert_eq!(i.unwrap().texel(0, 0), Vec4::new(0.0, 1.0, 0.0, 1.0));
        assert!(w.lines()[0].contains("(2 times)"));
    }
}
