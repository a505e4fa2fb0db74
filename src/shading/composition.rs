//! Lookup of textures that are made of others. All is done component by component.

use super::texture::{MeshPoint, TextureSet, finite};
use crate::scene::composition::{Multilinear, Table};
use crate::scene::value::Value;
use glam::Vec3;

/// Most values that a texture is made of.
const MOST: usize = 3;

impl TextureSet {
    /// The sum of products.
    pub(super) fn multilinear(&self, t: &Multilinear, at: &MeshPoint) -> Vec3 {
        finite(sum_of_products(&t.coefficients, &self.colors(&t.of, at)[..t.of.len()]))
    }

    /// Its slopes along the edges of the triangle: the product rule.
    pub(super) fn multilinear_slopes(&self, t: &Multilinear, at: &MeshPoint) -> [Vec3; 2] {
        let count = t.of.len();
        let values = self.colors(&t.of, at);
        let mut sum = [Vec3::ZERO; 2];
        for (i, value) in t.of.iter().enumerate() {
            let at_end = |end: Vec3| {
                let mut values = values;
                values[i] = end;
                sum_of_products(&t.coefficients, &values[..count])
            };
            let derivative = at_end(Vec3::ONE) - at_end(Vec3::ZERO);
            let slopes = self.color_slopes(value, at);
            sum = [0, 1].map(|k| sum[k] + derivative * slopes[k]);
        }
        sum
    }

    /// The table's value.
    pub(super) fn table(&self, t: &Table, at: &MeshPoint) -> Vec3 {
        self.entry(t, self.places(t, at))
    }

    /// Its slopes along the edges of the triangle, over an entry of the table: the chain rule.
    pub(super) fn table_slopes(&self, t: &Table, at: &MeshPoint) -> [Vec3; 2] {
        let places = self.places(t, at);
        let mut sum = [Vec3::ZERO; 2];
        for (i, value) in t.of.iter().enumerate() {
            let moved = |by: f32| {
                let mut places = places;
                places[i] += by;
                self.entry(t, places)
            };
            let [low, high] = t.domain[i];
            let derivative = (moved(0.5) - moved(-0.5)) * ((t.size[i] - 1) as f32 / (high - low));
            let slopes = self.color_slopes(value, at);
            sum = [0, 1].map(|k| sum[k] + derivative * slopes[k]);
        }
        sum
    }

    fn colors(&self, of: &[Value], at: &MeshPoint) -> [Vec3; MOST] {
        let mut values = [Vec3::ZERO; MOST];
        values.iter_mut().zip(of).for_each(|(value, v)| *value = self.color(v, at));
        values
    }

    /// Where the values stand along the sides of a table, in entries.
    fn places(&self, t: &Table, at: &MeshPoint) -> [Vec3; MOST] {
        let mut places = self.colors(&t.of, at);
        for ((place, [low, high]), &size) in places.iter_mut().zip(&t.domain).zip(&t.size) {
            *place = (*place - *low) * ((size - 1) as f32 / (high - low));
        }
        places
    }

    fn entry(&self, t: &Table, places: [Vec3; MOST]) -> Vec3 {
        let at = |c: usize| self.between_entries(t, places.map(|p| p[c]));
        // of numbers all components are in one place
        if places.iter().all(|p| p.x == p.y && p.y == p.z) {
            at(0)
        } else {
            Vec3::new(at(0).x, at(1).y, at(2).z)
        }
    }

    /// What stands at a place, linearly between entries.
    fn between_entries(&self, t: &Table, place: [f32; MOST]) -> Vec3 {
        let image = &self.scene.images[t.image as usize];
        // along each side the entries below and above, and their shares
        let mut sides = [([0, 0], [1.0, 0.0]); MOST];
        for ((side, &size), x) in sides.iter_mut().zip(&t.size).zip(place) {
            // NaN becomes the first entry
            let x = x.max(0.0).min((size - 1) as f32);
            let low = (x as u32).min(size.saturating_sub(2));
            let f = x - low as f32;
            *side = ([low, (low + 1).min(size - 1)], [1.0 - f, f]);
        }
        let rows = t.size.get(1).copied().unwrap_or(1);
        let mut sum = Vec3::ZERO;
        for corner in 0..1usize << t.of.len() {
            let bit = |i: usize| corner >> i & 1;
            let weight: f32 = (0..MOST).map(|i| sides[i].1[bit(i)]).product();
            if weight != 0.0 {
                let [x, y, z] = [0, 1, 2].map(|i| sides[i].0[bit(i)]);
                sum += weight * image.texel(x, z * rows + y).truncate();
            }
        }
        sum
    }
}

fn sum_of_products(coefficients: &[Vec3], values: &[Vec3]) -> Vec3 {
    let product = |subset: usize| {
        let chosen = values.iter().enumerate().filter(|(i, _)| subset >> i & 1 == 1);
        chosen.fold(Vec3::ONE, |product, (_, &v)| product * v)
    };
    coefficients.iter().enumerate().map(|(subset, &c)| c * product(subset)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::image::{Encoding, Pixels};
    use crate::scene::mesh::{AttributeInput, Interpolation, MeshInput};
    use crate::scene::value::Channel;
    use crate::scene::{Image, SceneBuilder, Warnings};
    use crate::shading::texture::Looks;
    use glam::Vec2;
    use std::sync::Arc;

    /// A scene of one triangle with one image. Texture 0 is its colour: the barycentrics in red and green, and 0.5.
    fn builder(width: u32, height: u32, image: &[f32]) -> SceneBuilder {
        let mut b = SceneBuilder::new();
        let color = AttributeInput {
            name: "c",
            data: &[0.0, 0.0, 0.5, 1.0, 0.0, 0.5, 0.0, 1.0, 0.5],
            components: 3,
            interpolation: Interpolation::Vertex,
            indices: None,
        };
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let attributes = [color];
        let mesh = MeshInput {
            name: "t",
            points: &points,
            face_indices: &[0, 1, 2],
            attributes: &attributes,
            ..Default::default()
        };
        b.add_mesh(&mesh).unwrap();
        b.set_camera("c", r#"{"window":[-1,1,-1,1],"transform":[1,0,0,0,0,1,0,0,0,0,1,5,0,0,0,1]}"#).unwrap();
        let pixels = Pixels::F32(image.to_vec());
        let size = (width, height, image.len() as u32 / (width * height));
        let image = Image::new("i", size, pixels, Encoding::Linear, &mut Warnings::default());
        b.add_image(image.unwrap()).unwrap();
        b.add_texture("c", r#"{"type":"attribute","name":"c","default":[0,0,0,1]}"#).unwrap();
        b
    }

    fn texture(mut b: SceneBuilder, json: &str) -> impl Fn(f32, f32) -> (Vec3, [Vec3; 2]) + use<> {
        let texture = b.add_texture("made", json).unwrap();
        let textures = TextureSet::new(Arc::new(b.build().unwrap()));
        move |u, v| {
            let at = MeshPoint::new(0, 0, 0, Vec2::new(u, v));
            let value = Value::Texture { texture, channel: Channel::Rgb };
            (textures.color(&value, &at), textures.color_slopes(&value, &at))
        }
    }

    #[test]
    fn products_are_summed_and_have_the_slopes_of_products() {
        // (1, 2, 0) + 3 c + (4, 5, 6) c * red
        let json = r#"{"type":"multilinear","of":[{"texture":0},{"texture":0,"channel":"r"}],
            "coefficients":[[1,2,0],[3,3,3],[0,0,0],[4,5,6]]}"#;
        let at = texture(builder(1, 1, &[0.0]), json);
        let expected = |u: f32, v: f32| {
            let c = Vec3::new(u, v, 0.5);
            Vec3::new(1.0, 2.0, 0.0) + 3.0 * c + Vec3::new(4.0, 5.0, 6.0) * c * u
        };
        for (u, v) in [(0.0, 0.0), (0.25, 0.5), (0.7, 0.1)] {
            let (value, [du, dv]) = at(u, v);
            assert!((value - expected(u, v)).abs().max_element() < 1e-5, "{value}");
            let h = 1e-2;
            let across = |x: f32, y: f32| (expected(u + x, v + y) - expected(u - x, v - y)) / (2.0 * h);
            assert!((du - across(h, 0.0)).abs().max_element() < 1e-3, "{du}");
            assert!((dv - across(0.0, h)).abs().max_element() < 1e-3, "{dv}");
        }
    }

    #[test]
    fn what_overflows_is_black() {
        let json = r#"{"type":"multilinear","of":[{"texture":0}],"coefficients":[[-3e38,0,0],[3e38,1,1]]}"#;
        let mut b = builder(1, 1, &[0.0]);
        b.add_texture("huge", json).unwrap();
        let square = r#"{"type":"multilinear","of":[{"texture":1},{"texture":1}],"coefficients":[[0,0,0],[0,0,0],[0,0,0],[1,1,1]]}"#;
        assert_eq!(texture(b, square)(0.2, 0.2).0, Vec3::ZERO);
    }

    #[test]
    fn tables_are_linear_between_their_entries_and_constant_beyond() {
        // colours by a number from 1 to 3, of which red + 0.5 covers 0.5 to 1.5
        let row = [0.0, 1.0, 5.0, 2.0, 3.0, 5.0, 4.0, 3.0, 5.0];
        let mut b = builder(3, 1, &row);
        b.add_texture(
            "double",
            r#"{"type":"multilinear","of":[{"texture":0,"channel":"r"}],"coefficients":[[0,0,0],[4,4,4]]}"#,
        )
        .unwrap();
        let json = r#"{"type":"table","of":[{"texture":1}],"domain":[[1,3]],"image":0}"#;
        let at = texture(b, json);
        for (u, expected) in [
            (0.0, [0.0, 1.0, 5.0]),
            (0.375, [1.0, 2.0, 5.0]),
            (0.625, [3.0, 3.0, 5.0]),
            (1.0, [4.0, 3.0, 5.0]),
        ] {
            assert!((at(u, 0.0).0 - Vec3::from(expected)).abs().max_element() < 1e-5, "{u}");
        }
        let [du, dv] = at(0.375, 0.0).1;
        assert!((du - Vec3::new(8.0, 8.0, 0.0)).abs().max_element() < 1e-4 && dv == Vec3::ZERO, "{du}");
    }

    #[test]
    fn tables_of_two_and_three_values() {
        // f(x, y) = x + 10 y, the rows from the top
        let of =
            |n: usize| ["r", "g", "b"][..n].iter().map(|c| format!(r#"{{"texture":0,"channel":"{c}"}}"#));
        let json = |n: usize| {
            let of = of(n).collect::<Vec<_>>().join(",");
            format!(r#"{{"type":"table","of":[{of}],"domain":[{}],"image":0}}"#, vec!["[0,1]"; n].join(","))
        };
        let at = texture(builder(2, 2, &[0.0, 1.0, 10.0, 11.0]), &json(2));
        assert!((at(0.25, 0.5).0 - 5.25).abs().max_element() < 1e-5);
        let [du, dv] = at(0.5, 0.5).1;
        assert!((du - 1.0).abs().max_element() < 1e-4 && (dv - 10.0).abs().max_element() < 1e-4);
        // and + 100 z
        let cube: Vec<f32> = (0..8).map(|i| [0.0, 1.0, 10.0, 11.0, 100.0, 101.0, 110.0, 111.0][i]).collect();
        let at = texture(builder(2, 4, &cube), &json(3));
        assert!((at(0.25, 0.5).0 - 55.25).abs().max_element() < 1e-4);
        // component by component
        let whole = r#"{"type":"table","of":[{"texture":0},{"texture":0}],"domain":[[0,1],[0,1]],"image":0}"#;
        let at = texture(builder(2, 2, &[0.0, 1.0, 10.0, 11.0]), whole);
        assert!((at(0.25, 0.5).0 - 11.0 * Vec3::new(0.25, 0.5, 0.5)).abs().max_element() < 1e-4);
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        for (json, what) in [
            (r#"{"type":"multilinear","of":[],"coefficients":[[1,1,1]]}"#, "one to three"),
            (
                r#"{"type":"multilinear","of":[{"texture":1}],"coefficients":[[1,1,1],[1,1,1]]}"#,
                "no texture 1",
            ),
            (r#"{"type":"multilinear","of":[1],"coefficients":[[1,1,1]]}"#, "2 coefficients"),
            (r#"{"type":"multilinear","of":[1],"coefficients":[[1,1,1],[1,1,1e39]]}"#, "not finite"),
            (r#"{"type":"table","of":[1],"domain":[[0,1]],"image":1}"#, "no image 1"),
            (r#"{"type":"table","of":[1],"domain":[[1,1]],"image":0}"#, "domain"),
            (r#"{"type":"table","of":[1,1],"domain":[[0,1]],"image":0}"#, "domain"),
            (r#"{"type":"table","of":[1,1,1],"domain":[[0,1],[0,1],[0,1]],"image":0}"#, "width squared"),
        ] {
            let e = builder(2, 3, &[0.0; 6]).add_texture("t", json).unwrap_err().to_string();
            assert!(e.contains(what), "{json}: {e}");
        }
        // as many lookups as a chain of products of the last with itself has: too many in the end, and no hang
        let mut b = builder(1, 1, &[0.0]);
        let mut made = 0;
        let problem = loop {
            let json = format!(
                r#"{{"type":"multilinear","of":[{{"texture":{made}}},{{"texture":{made}}}],"coefficients":[[0,0,0],[0,0,0],[0,0,0],[1,1,1]]}}"#
            );
            match b.add_texture("t", &json) {
                Ok(texture) => made = texture,
                Err(problem) => break problem.to_string(),
            }
        };
        assert!(problem.contains("at most 256") && made == 7, "{problem} {made}");
    }

    #[test]
    fn what_is_made_of_the_direction_of_view_depends_on_it() {
        let mut b = builder(1, 1, &[0.0]);
        b.add_texture("facing", r#"{"type":"facing"}"#).unwrap();
        let json = r#"{"type":"multilinear","of":[{"texture":1}],"coefficients":[[1,1,1],[2,2,2]]}"#;
        b.add_texture("made", json).unwrap();
        let textures = TextureSet::new(Arc::new(b.build().unwrap()));
        let value = |texture| Value::Texture { texture, channel: Channel::R };
        let looks = [Looks::Same, Looks::Direction, Looks::Direction];
        assert_eq!([0, 1, 2].map(|t| textures.looks(&value(t))), looks);
        assert_eq!(textures.looks(&Value::number(1.0)), Looks::Same);
        let at = MeshPoint::new(0, 0, 0, Vec2::splat(0.3));
        assert_eq!(textures.number(&value(2), &at), 3.0);
        assert_eq!(textures.number(&value(2), &MeshPoint { facing: -0.25, ..at }), 0.5);
        assert_eq!(textures.slopes(&value(2), &at), Vec2::ZERO);
    }
}
