//! Lookup of images: what lies beyond their edges, and between their texels.

use crate::scene::Image;
use crate::scene::picture::{ImageTexture, Projection, Reconstruction, Wrap};
use glam::{Vec2, Vec3, Vec4};
use std::f32::consts::{PI, TAU};

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

/// The picture at three coordinates. `normal`: unit, in the mesh's space; few ask for it.
pub(super) fn projected(image: &Image, t: &ImageTexture, p: Vec3, normal: impl Fn() -> Vec3) -> Vec4 {
    let at = |uv: Vec2| sample(image, t, t.transform.transform_point2(uv));
    match t.projection {
        Projection::Flat => at(p.truncate()),
        Projection::Sphere => {
            let d = 2.0 * p - 1.0;
            at(Vec2::new(longitude(d), 1.0 - (d.z / d.length()).clamp(-1.0, 1.0).acos() / PI))
        }
        Projection::Tube => {
            let d = 2.0 * p - 1.0;
            at(Vec2::new(longitude(d), 0.5 + 0.5 * d.z))
        }
        Projection::Box { blend } => {
            let n = normal();
            // each side shows its picture the right way round
            let turned = |u: f32, over: bool| if over { 1.0 - u } else { u };
            let sides = [
                Vec2::new(turned(p.y, n.x < 0.0), p.z),
                Vec2::new(turned(p.x, n.y > 0.0), p.z),
                Vec2::new(turned(p.y, n.z > 0.0), p.x),
            ];
            let weights = box_weights(n, blend).to_array();
            let shown = sides.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
            shown.map(|(uv, weight)| weight * at(uv)).sum()
        }
    }
}

/// Longitude in `[0,1]`; zero on the axis.
fn longitude(d: Vec3) -> f32 {
    if d.x == 0.0 && d.y == 0.0 { 0.0 } else { 0.5 - f32::atan2(d.x, d.y) / TAU }
}

/// How much each pair of a box's sides shows of its picture. The shares of the normal's components are barycentric coordinates
/// of a triangle: its corners show one side, a strip of the width `blend` between them two, and its middle all three.
fn box_weights(normal: Vec3, blend: f32) -> Vec3 {
    let n = normal.abs();
    let limit = 0.5 * (1.0 + blend);
    for (side, [own, one, other]) in
        [[n.x, n.y, n.z], [n.y, n.x, n.z], [n.z, n.x, n.y]].into_iter().enumerate()
    {
        if own > limit * (own + one) && own > limit * (own + other) {
            return Vec3::AXES[side];
        }
    }
    if blend <= 0.0 {
        // on the edge between two
        return Vec3::X;
    }
    for [a, b, third] in [[0, 1, 2], [1, 2, 0], [0, 2, 1]] {
        let sum = n[a] + n[b];
        if n[third] < (1.0 - limit) * sum {
            let first = ((n[a] / sum - 0.5 * (1.0 - blend)) / blend).clamp(0.0, 1.0);
            return Vec3::AXES[a] * first + Vec3::AXES[b] * (1.0 - first);
        }
    }
    let n = n / n.element_sum();
    ((2.0 - limit) * n + (limit - 1.0)) / (2.0 * limit - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Warnings;
    use crate::scene::image::{Encoding, Pixels};
    use crate::scene::picture::Projection;
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
            projection: Projection::Flat,
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

    #[test]
    fn the_sides_of_a_box_share_the_picture() {
        for blend in [0.0, 0.2, 0.7, 1.0] {
            let along = |t: f32| {
                let (a, b) = ((7.0 * t).sin_cos(), (3.0 * t).sin_cos());
                Vec3::new(a.0 * b.1, a.1 * b.1, b.0)
            };
            let mut before = box_weights(along(0.0), blend);
            for i in 1..20_000 {
                let weights = box_weights(along(i as f32 / 2000.0), blend);
                assert!((weights.element_sum() - 1.0).abs() < 1e-4 && weights.min_element() >= -1e-5);
                let step = (weights - before).abs().max_element();
                assert!(blend == 0.0 || step < 0.02 / blend, "blend {blend} jumps by {step}");
                before = weights;
            }
            assert_eq!(box_weights(Vec3::new(-0.9, 0.1, 0.2).normalize(), blend.min(0.6)), Vec3::X);
        }
        let even = box_weights(Vec3::splat(3f32.sqrt().recip()), 0.5);
        assert!((even - Vec3::splat(1.0 / 3.0)).length() < 1e-6);
    }

    #[test]
    fn longitudes_and_latitudes_begin_where_blenders_do() {
        let mut t = texture(Reconstruction::Closest, Wrap::Clamp);
        let mut at = |projection, p: [f32; 3]| {
            t.projection = projection;
            projected(&checker(), &t, Vec3::from_array(p), || Vec3::NEG_X).x
        };
        // left and right are west and east of +y, bottom and top are south and north
        let corners = [[0.9, 0.4, 0.1], [0.1, 0.4, 0.1], [0.9, 0.4, 0.9], [0.1, 0.4, 0.9]];
        assert_eq!(corners.map(|p| at(Projection::Sphere, p)), [3.0, 4.0, 1.0, 2.0]);
        assert_eq!(corners.map(|p| at(Projection::Tube, p)), [3.0, 4.0, 1.0, 2.0]);
        // seen from -x, y runs to the left
        assert_eq!(at(Projection::Box { blend: 0.0 }, [0.5, 0.1, 0.1]), 4.0);
        assert_eq!(at(Projection::Tube, [0.5, 0.5, 0.9]), 1.0, "on the axis");
    }
}
