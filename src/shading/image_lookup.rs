//! Lookup of images: what lies beyond their edges, and between their texels.

use crate::scene::Image;
use crate::scene::texture::{ImageTexture, Reconstruction, Wrap};
use glam::{Vec2, Vec4};

/// Texel index of a coordinate, `None` for black.
fn wrap(i: i64, size: i64, mode: Wrap) -> Option<u32> {
    // by far the usual case, and a division saved
    if (0..size).contains(&i) {
        return Some(i as u32);
    }
    let k = match mode {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let k = i.rem_euclid(2 * size);
            k.min(2 * size - 1 - k)
        }
        Wrap::Black => return None,
    };
    Some(k as u32)
}

pub(super) fn sample(image: &Image, t: &ImageTexture, st: Vec2) -> Vec4 {
    if !st.is_finite() {
        return Vec4::ZERO;
    }
    let (w, h) = (image.width() as i64, image.height() as i64);
    let (column, row) = (|x: i64| wrap(x, w, t.wrap[0]), |y: i64| wrap(y, h, t.wrap[1]));
    let texel = |x: Option<u32>, y: Option<u32>| match (x, y) {
        (Some(x), Some(y)) => image.texel(x, y),
        _ => Vec4::ZERO,
    };
    // row 0 is the top row, and t grows upwards; far coordinates saturate, which no picture can show
    let p = Vec2::new(st.x * w as f32, (1.0 - st.y) * h as f32).clamp(Vec2::splat(-1e12), Vec2::splat(1e12));
    match t.filter {
        Reconstruction::Closest => texel(column(p.x.floor() as i64), row(p.y.floor() as i64)),
        Reconstruction::Linear => {
            let q = p - 0.5;
            let corner = q.floor();
            let f = q - corner;
            let (x, y) = (corner.x as i64, corner.y as i64);
            let (left, right) = (column(x), column(x + 1));
            let [top, bottom] = [row(y), row(y + 1)].map(|y| texel(left, y).lerp(texel(right, y), f.x));
            top.lerp(bottom, f.y)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Warnings;
    use crate::scene::image::{Encoding, Pixels};
    use glam::Affine2;

    fn checker() -> Image {
        // row 0 (top): 1 2, row 1 (bottom): 3 4
        let p = Pixels::F32(vec![1.0, 2.0, 3.0, 4.0]);
        Image::new("c", (2, 2, 1), p, Encoding::Linear, &mut Warnings::default()).unwrap()
    }

    fn texture(filter: Reconstruction, mode: Wrap) -> ImageTexture {
        ImageTexture {
            image: 0,
            uv: String::new(),
            at: None,
            transform: Affine2::IDENTITY,
            wrap: [mode; 2],
            filter,
            scale: Vec4::ONE,
            bias: Vec4::ZERO,
        }
    }

    #[test]
    fn the_origin_is_at_the_bottom_left() {
        let t = texture(Reconstruction::Closest, Wrap::Clamp);
        let at = |s, v| sample(&checker(), &t, Vec2::new(s, v)).x;
        assert_eq!([at(0.1, 0.1), at(0.9, 0.1), at(0.1, 0.9), at(0.9, 0.9)], [3.0, 4.0, 1.0, 2.0]);
    }

    #[test]
    fn wrap_modes() {
        let value =
            |mode, s: f32| sample(&checker(), &texture(Reconstruction::Closest, mode), Vec2::new(s, 0.1)).x;
        let row = |mode| [-0.9, -0.1, 0.1, 0.9, 1.1, 1.9, 2.1].map(|s| value(mode, s));
        assert_eq!(row(Wrap::Repeat), [3.0, 4.0, 3.0, 4.0, 3.0, 4.0, 3.0]);
        assert_eq!(row(Wrap::Clamp), [3.0, 3.0, 3.0, 4.0, 4.0, 4.0, 4.0]);
        assert_eq!(row(Wrap::Mirror), [4.0, 3.0, 3.0, 4.0, 4.0, 3.0, 3.0]);
        assert_eq!(row(Wrap::Black), [0.0, 0.0, 3.0, 4.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn bilinear_filtering_is_exact_at_centres_and_linear_between() {
        let t = texture(Reconstruction::Linear, Wrap::Repeat);
        let at = |s, v| sample(&checker(), &t, Vec2::new(s, v)).x;
        assert_eq!(at(0.25, 0.25), 3.0);
        assert_eq!(at(0.5, 0.25), 3.5);
        assert_eq!(at(0.5, 0.5), 2.5);
        assert_eq!(at(0.0, 0.25), 3.5, "repeats across the edge");
        assert_eq!(at(f32::NAN, 0.0), 0.0);
        assert!(at(1e30, -1e30).is_finite());
    }
}
