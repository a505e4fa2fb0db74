//! Texture lookup at a surface point.

use super::geometry_lookup::{geometry, own_normal};
use super::image_lookup::{projected, sample};
use crate::math::luminance;
use crate::scene::mesh::Attribute;
use crate::scene::picture::{ImageTexture, Projection};
use crate::scene::texture::{BrickTexture, CellTexture, NoiseTexture, Place, Quantity, Texture};
use crate::scene::value::{Channel, Value};
use crate::scene::{Mesh, Scene};
use glam::{Vec2, Vec3, Vec4};
use std::ops::{Add, Mul};
use std::sync::Arc;

/// Where on a mesh a texture is looked up.
#[derive(Clone, Copy, Debug)]
pub struct MeshPoint {
    /// Instance of it.
    pub instance: u32,
    /// Index of the mesh.
    pub mesh: u32,
    /// Triangle of the mesh.
    pub triangle: u32,
    /// Barycentrics of the triangle's second and third vertex.
    pub barycentrics: Vec2,
    /// What [`Texture::Facing`] is there.
    pub facing: f32,
}

impl MeshPoint {
    /// A point, looked at straight on.
    pub fn new(instance: u32, mesh: u32, triangle: u32, barycentrics: Vec2) -> Self {
        Self { instance, mesh, triangle, barycentrics, facing: 1.0 }
    }

    /// Another point of the triangle.
    fn moved(&self, u: f32, v: f32) -> Self {
        Self { barycentrics: Vec2::new(u, v), ..*self }
    }
}

/// What a value depends on, of how the surface is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Looks {
    /// Nothing.
    Same,
    /// The side that is seen.
    Side,
    /// The direction that it is seen from.
    Direction,
}

/// All textures of a scene, with the names of attributes resolved to numbers.
#[derive(Debug)]
pub struct TextureSet {
    pub(super) scene: Arc<Scene>,
    /// For each texture, the number of its attribute's name.
    texture_names: Vec<u32>,
    /// For each mesh, name numbers of its UV sets and of its colours.
    uv_names: Vec<Box<[u32]>>,
    color_names: Vec<Box<[u32]>>,
    /// For each texture, what it depends on of how the surface is seen.
    looks: Vec<Looks>,
}

/// Share of the finest length of patterns over which they are taken for straight.
const FINE: f32 = 0.02;

/// Name number that means "the first set".
const FIRST: u32 = u32::MAX;

impl TextureSet {
    /// Resolves the names of a scene's textures.
    pub fn new(scene: Arc<Scene>) -> Self {
        let names: Vec<&str> = scene.textures.iter().filter_map(Texture::attribute).collect();
        let number = |name: &str| match name {
            "" => FIRST,
            // a name that no texture asks for gets a number past the end
            _ => names.iter().position(|n| *n == name).unwrap_or(names.len()) as u32,
        };
        let texture_names = scene.textures.iter().map(|t| t.attribute().map_or(FIRST, number)).collect();
        let uv_names = scene.meshes.iter().map(|m| m.uvs.iter().map(|(n, _)| number(n)).collect()).collect();
        let color_names =
            scene.meshes.iter().map(|m| m.colors.iter().map(|(n, _)| number(n)).collect()).collect();
        let mut looks: Vec<Looks> = Vec::with_capacity(scene.textures.len());
        for t in &scene.textures {
            // what others are made of comes before them
            let made_of = t.made_of().iter().map(|v| looks_of(&looks, v));
            looks.push(made_of.fold(own_looks(t), Looks::max));
        }
        Self { texture_names, uv_names, color_names, looks, scene }
    }

    /// What a value depends on of how the surface is seen.
    pub fn looks(&self, value: &Value) -> Looks {
        looks_of(&self.looks, value)
    }

    /// The RGBA value of a texture. An image on a mesh without the UV set reads it at (0,0).
    pub fn lookup(&self, texture: u32, at: &MeshPoint) -> Vec4 {
        match &self.scene.textures[texture as usize] {
            Texture::Constant(v) => *v,
            Texture::Image(t) => {
                let image = &self.scene.images[t.image as usize];
                let value = match &t.at {
                    Some(place) => projected(image, t, self.color(place, at), || own_normal(&self.scene, at)),
                    None => {
                        let uv = self.uv(texture, at).unwrap_or(Vec2::ZERO);
                        sample(image, t, t.transform.transform_point2(uv))
                    }
                };
                value * t.scale + t.bias
            }
            Texture::Noise(t) => self.noise(t, self.place(texture, &t.place, at)),
            Texture::Cells(t) => cells(t, self.place(texture, &t.place, at)),
            Texture::Bricks(t) => bricks(t, self.place(texture, &t.place, at)),
            Texture::Length(of) => Vec3::splat(self.color(of, at).length()).extend(1.0),
            Texture::Geometry(t) => geometry(&self.scene, t, at).extend(1.0),
            Texture::Attribute { default, .. } => self.attribute(texture, at).unwrap_or(*default),
            Texture::Facing => Vec3::splat(at.facing).extend(1.0),
            Texture::Multilinear(t) => self.multilinear(t, at).extend(1.0),
            Texture::Table(t) => self.table(t, at).extend(1.0),
        }
    }

    /// The colour attribute that a texture names.
    fn attribute(&self, texture: u32, at: &MeshPoint) -> Option<Vec4> {
        let mesh = &self.scene.meshes[at.mesh as usize];
        let i = index(&self.color_names[at.mesh as usize], self.texture_names[texture as usize])?;
        Some(interpolate(&mesh.colors[i].1, mesh, at))
    }

    /// Where a pattern is looked up.
    fn place(&self, texture: u32, place: &Place, at: &MeshPoint) -> Vec3 {
        match place.value() {
            Some(v) => self.color(v, at),
            None => self.attribute(texture, at).unwrap_or(Vec4::ZERO).truncate(),
        }
    }

    fn noise(&self, t: &NoiseTexture, place: Vec3) -> Vec4 {
        let image = &self.scene.images[t.image as usize];
        let last = image.width() - 1;
        let shown = |strength: f32| {
            let x = strength.clamp(0.0, 1.0) * last as f32;
            let left = (x as u32).min(last.saturating_sub(1));
            let (a, b) = (image.texel(left, 0), image.texel((left + 1).min(last), 0));
            a.lerp(b, x - left as f32)
        };
        let value = if t.colored {
            let [r, g, b] = t.noise.color_at(place).to_array().map(shown);
            Vec4::new(r.x, g.y, b.z, r.w)
        } else {
            shown(t.noise.at(place))
        };
        value * t.scale + t.bias
    }

    /// A parameter as a colour.
    #[inline]
    pub fn color(&self, value: &Value, at: &MeshPoint) -> Vec3 {
        match *value {
            Value::Constant(c) => c,
            Value::Texture { texture, channel } => part(channel, self.lookup(texture, at)),
        }
    }

    /// A parameter as a number; a colour counts by its luminance.
    #[inline]
    pub fn number(&self, value: &Value, at: &MeshPoint) -> f32 {
        grey(self.color(value, at))
    }

    /// How much a number changes along the edges of the triangle that leave its first vertex, over the whole of each: in an image as
    /// from one texel to the next.
    pub fn slopes(&self, value: &Value, at: &MeshPoint) -> Vec2 {
        let [u, v] = self.color_slopes(value, at);
        Vec2::new(luminance(u), luminance(v))
    }

    /// The same of a colour.
    pub(super) fn color_slopes(&self, value: &Value, at: &MeshPoint) -> [Vec3; 2] {
        let Value::Texture { texture, channel } = *value else { return [Vec3::ZERO; 2] };
        let slopes = match &self.scene.textures[texture as usize] {
            Texture::Constant(_) | Texture::Facing => [Vec4::ZERO; 2],
            Texture::Image(t) if t.projection != Projection::Flat => {
                let Some(place) = &t.at else { return [Vec3::ZERO; 2] };
                let image = &self.scene.images[t.image as usize];
                let step = 1.0 / image.width().max(image.height()) as f32;
                let normal = own_normal(&self.scene, at);
                let picture = |p| projected(image, t, p, || normal) * t.scale;
                slopes_along(self.color(place, at), self.color_slopes(place, at), step, picture)
            }
            Texture::Image(t) => {
                let Some((uv, edges)) = self.uv_slopes(texture, t, at) else { return [Vec3::ZERO; 2] };
                let image = &self.scene.images[t.image as usize];
                let size = Vec2::new(image.width() as f32, image.height() as f32);
                let st = t.transform.transform_point2(uv);
                let across = |texel: Vec2| {
                    let d = 0.5 * texel / size;
                    (sample(image, t, st + d) - sample(image, t, st - d)) * t.scale
                };
                let (ds, dt) = (across(Vec2::X) * size.x, across(Vec2::Y) * size.y);
                let along = |edge: Vec2| {
                    let edge = t.transform.transform_vector2(edge);
                    ds * edge.x + dt * edge.y
                };
                edges.map(along)
            }
            Texture::Noise(t) => {
                let step = FINE * t.noise.finest();
                self.pattern_slopes(texture, &t.place, at, step, |p| self.noise(t, p))
            }
            Texture::Cells(t) => {
                let step = FINE * t.cells.finest();
                self.pattern_slopes(texture, &t.place, at, step, |p| cells(t, p))
            }
            Texture::Bricks(t) => {
                let step = FINE * t.bricks.finest();
                self.pattern_slopes(texture, &t.place, at, step, |p| bricks(t, p))
            }
            Texture::Length(of) => {
                let direction = self.color(of, at).normalize_or_zero();
                self.color_slopes(of, at).map(|s| Vec3::splat(direction.dot(s)).extend(0.0))
            }
            Texture::Attribute { .. } | Texture::Geometry(_) => {
                let corner = |u, v| self.lookup(texture, &at.moved(u, v));
                let [a, b, c] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
                [b - a, c - a]
            }
            Texture::Multilinear(t) => self.multilinear_slopes(t, at).map(|s| s.extend(0.0)),
            Texture::Table(t) => self.table_slopes(t, at).map(|s| s.extend(0.0)),
        };
        slopes.map(|s| part(channel, s))
    }

    /// The slopes of a pattern along the edges of the triangle, taken over a length of `step`.
    fn pattern_slopes(
        &self,
        texture: u32,
        place: &Place,
        at: &MeshPoint,
        step: f32,
        pattern: impl Fn(Vec3) -> Vec4,
    ) -> [Vec4; 2] {
        let middle = self.place(texture, place, at);
        let edges = match place.value() {
            Some(v) => self.color_slopes(v, at),
            None => {
                let corner = |u, v| self.place(texture, place, &at.moved(u, v));
                [corner(1.0, 0.0), corner(0.0, 1.0)].map(|end| end - corner(0.0, 0.0))
            }
        };
        slopes_along(middle, edges, step, pattern)
    }

    /// The coordinates of an image before its transform, and their slopes along the edges of the triangle.
    fn uv_slopes(&self, texture: u32, t: &ImageTexture, at: &MeshPoint) -> Option<(Vec2, [Vec2; 2])> {
        if let Some(place) = &t.at {
            let edges = self.color_slopes(place, at).map(|edge| edge.truncate());
            return Some((self.color(place, at).truncate(), edges));
        }
        let mesh = &self.scene.meshes[at.mesh as usize];
        let set = index(&self.uv_names[at.mesh as usize], self.texture_names[texture as usize])?;
        let map = &mesh.uvs[set].1;
        let vertices = mesh.triangles[at.triangle as usize];
        let [a, b, c] = map.corners(at.triangle as usize, vertices).ok()?;
        Some((interpolate(map, mesh, at), [b - a, c - a]))
    }

    /// Index in the mesh's list of the UV set that `name` (of a normal map) means.
    pub fn uv_set(&self, name: &str, mesh: u32) -> Option<usize> {
        self.scene.meshes[mesh as usize].uv_index(name)
    }

    fn uv(&self, texture: u32, at: &MeshPoint) -> Option<Vec2> {
        let mesh = &self.scene.meshes[at.mesh as usize];
        let i = index(&self.uv_names[at.mesh as usize], self.texture_names[texture as usize])?;
        Some(interpolate(&mesh.uvs[i].1, mesh, at))
    }
}

fn cells(t: &CellTexture, place: Vec3) -> Vec4 {
    let value = if t.colored { t.cells.color(place) } else { Vec3::splat(t.cells.distance(place)) };
    finite(value).extend(1.0)
}

fn bricks(t: &BrickTexture, place: Vec3) -> Vec4 {
    let [mortar, tint] = t.bricks.at(place);
    Vec4::new(mortar, tint, 0.0, 1.0)
}

/// What powers and products make of extreme values is 0 where it is not finite.
pub(super) fn finite(v: Vec3) -> Vec3 {
    if v.is_finite() { v } else { Vec3::ZERO }
}

/// The slopes of a function of a place along edges that leave it, taken over a length of `step`.
fn slopes_along(middle: Vec3, edges: [Vec3; 2], step: f32, value: impl Fn(Vec3) -> Vec4) -> [Vec4; 2] {
    edges.map(|edge| {
        let length = edge.length();
        let d = edge * (0.5 * step / length);
        if length > 0.0 { (value(middle + d) - value(middle - d)) * (length / step) } else { Vec4::ZERO }
    })
}

/// What a texture depends on by itself.
fn own_looks(t: &Texture) -> Looks {
    match t {
        Texture::Facing => Looks::Direction,
        Texture::Geometry(t) if t.of != Quantity::Position => Looks::Side,
        Texture::Image(t) if matches!(t.projection, Projection::Box { .. }) => Looks::Side,
        _ => Looks::Same,
    }
}

/// What a value depends on, of textures that depend on this.
fn looks_of(textures: &[Looks], value: &Value) -> Looks {
    match *value {
        Value::Constant(_) => Looks::Same,
        Value::Texture { texture, .. } => textures[texture as usize],
    }
}

fn part(channel: Channel, v: Vec4) -> Vec3 {
    match channel {
        Channel::Rgb => v.truncate(),
        Channel::R => Vec3::splat(v.x),
        Channel::G => Vec3::splat(v.y),
        Channel::B => Vec3::splat(v.z),
        Channel::A => Vec3::splat(v.w),
        Channel::Luminance => Vec3::splat(luminance(v.truncate())),
        Channel::Average => Vec3::splat(v.truncate().element_sum() / 3.0),
    }
}

fn grey(c: Vec3) -> f32 {
    if c.x == c.y && c.y == c.z { c.x } else { luminance(c) }
}

fn index(names: &[u32], name: u32) -> Option<usize> {
    match name {
        FIRST => (!names.is_empty()).then_some(0),
        _ => names.iter().position(|&n| n == name),
    }
}

/// The attribute at a point of a triangle.
#[inline]
pub fn interpolate<T>(attribute: &Attribute<T>, mesh: &Mesh, at: &MeshPoint) -> T
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    match attribute.corners(at.triangle as usize, mesh.triangles[at.triangle as usize]) {
        Err(v) => v,
        Ok([a, b, c]) => {
            let Vec2 { x: u, y: v } = at.barycentrics;
            a * (1.0 - u - v) + b * u + c * v
        }
    }
}
