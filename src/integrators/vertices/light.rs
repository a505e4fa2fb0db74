//! Light paths: their vertices, and the light that these send straight to the lens.

use super::mis::{self, Sum};
use super::vertex::{LightVertex, Rules, Vertex, survival_at};
use crate::film::Splat;
use crate::math::Sampler;
use crate::shading::bsdf::Walk;
use crate::shading::emitters::PLAIN;
use crate::shading::{LightRay, Piece, SourceDensity, SurfaceClass};
use crate::transport::walk::{Chain, End, Follow, Nobody};
use glam::{Vec2, Vec3};

/// What light paths leave behind.
#[derive(Debug, Default)]
pub struct LightStore {
    /// Vertices, path by path.
    pub vertices: Vec<LightVertex>,
    /// Where the vertices of each path end.
    pub path_ends: Vec<u32>,
    /// Light that reached the lens.
    pub splats: Vec<Splat>,
}

impl LightStore {
    /// Vertices of path `k`.
    pub fn path(&self, k: usize) -> &[LightVertex] {
        let first = if k > 0 { self.path_ends[k - 1] } else { 0 };
        &self.vertices[first as usize..self.path_ends[k] as usize]
    }

    /// Appends the paths of another store.
    pub fn append(&mut self, other: &mut Self) {
        let first = self.vertices.len() as u32;
        self.vertices.append(&mut other.vertices);
        self.path_ends.extend(other.path_ends.drain(..).map(|end| end + first));
        self.splats.append(&mut other.splats);
    }

    /// Empties the store and keeps its memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.path_ends.clear();
        self.splats.clear();
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.vertices.capacity() * size_of::<LightVertex>()
            + self.path_ends.capacity() * size_of::<u32>()
            + self.splats.capacity() * size_of::<Splat>()
    }
}

/// Samples one path into the store. `wanted`: whether light at a place of the film counts. Adds the rays it
/// takes to `rays`.
pub fn path(
    rules: &Rules,
    sampler: &mut Sampler,
    wanted: &impl Fn(Vec2) -> bool,
    store: &mut LightStore,
    rays: &mut u64,
) {
    vertices(rules, sampler, wanted, store, rays);
    store.path_ends.push(store.vertices.len() as u32);
}

fn vertices(
    rules: &Rules,
    sampler: &mut Sampler,
    wanted: &impl Fn(Vec2) -> bool,
    store: &mut LightStore,
    rays: &mut u64,
) {
    let world = rules.world;
    let Some(ray) = world.sample_emission(&PLAIN, sampler) else { return };
    let follow = Follow { world, walk: Walk::Light, from_camera: false };
    let (chain, end) = follow.segment(ray.piece, sampler, &mut Nobody, rays);
    let Some(mut end) = end else { return };
    let mut flux = ray.flux * chain.flux_factor();
    let mut sum = first(rules, &ray, &chain, &end);
    let mut bounces = chain.passages;
    while bounces < rules.max_depth && flux.max_element() > 0.0 {
        let survival = survival_at(world, &end);
        let End { hit, wo, opacity, .. } = &end;
        let (wo, opacity) = (*wo, *opacity);
        let vertex = Vertex { hit, bsdf: &end.vertex.bsdf, wo, survival, sum };
        if rules.splats {
            let lens = if world.needs().depth_of_field { sampler.next_2d() } else { Vec2::ZERO };
            let seen = to_lens(rules, &vertex, flux, lens, wanted, rays);
            store.splats.extend(seen.map(|(film, light)| Splat { film, light, bounces: bounces + 1 }));
        }
        if rules.connects || rules.merges {
            store.vertices.push(LightVertex {
                position: hit.place.position,
                normal: hit.ns,
                wo,
                at: hit.address(),
                cos: hit.place.normal.dot(wo).abs(),
                flux,
                opacity,
                survival,
                sum,
                bounces,
            });
        }
        // the next vertex would have to be scattered by, too
        if bounces + 2 > rules.max_depth {
            return;
        }
        let u = sampler.next_3d();
        if sampler.next_1d() >= survival {
            return;
        }
        let Some(sample) = vertex.bsdf.sample_continuous(wo, Walk::Light, u) else { return };
        let left = vertex.leaving(rules, Walk::Light, sample.direction);
        let value = match world.class(hit.material) {
            SurfaceClass::Diffuse => sample.value,
            _ => left.value,
        };
        flux *= value / (sample.pdf.value() * survival);
        let (from, from_cos) = (hit.place.position, left.cos);
        let piece = Piece::leaving(hit, sample.direction);
        let (chain, next) = follow.segment(piece, sampler, &mut Nobody, rays);
        let Some(next) = next else { return };
        flux *= chain.flux_factor();
        if rules.weighs() {
            sum = after(rules, &left.turn, &chain, from, from_cos, &next);
        }
        bounces += 1 + chain.passages;
        end = next;
    }
}

/// The sum at the end of a segment that a vertex at `from` was left by.
pub fn after(rules: &Rules, turn: &mis::Turn, chain: &Chain, from: Vec3, from_cos: f32, end: &End) -> Sum {
    let place = &end.hit.place;
    let connected = (rules.connects && chain.passages == 0).then(|| {
        let g = from_cos * place.normal.dot(end.wo).abs() / place.position.distance_squared(from);
        turn.onward * chain.forward * g
    });
    Sum::after(turn, chain, connected, rules.eta(place.position))
}

/// The sum at a path's first vertex: next-event estimation, and the camera path that meets the light.
fn first(rules: &Rules, ray: &LightRay, chain: &Chain, end: &End) -> Sum {
    let place = &end.hit.place;
    let merged = rules.eta(place.position);
    if !rules.connects {
        return Sum { fixed: merged, slope: 0.0 };
    }
    let cos = place.normal.dot(end.wo).abs();
    let drawn = match chain.passages {
        0 => rules.world.pdf_of_sampling_ray(&end.hit.receiver(&end.vertex.bsdf, end.wo), ray),
        _ => 0.0,
    };
    match ray.density {
        SourceDensity::Extended(pdf) => Sum::from_light(chain, pdf.0, drawn / cos, false, merged),
        SourceDensity::Point(pdf) => {
            let across = pdf.to_area(place.position.distance(ray.origin()), 1.0).0;
            Sum::from_light(chain, across * cos, drawn, true, merged)
        }
        SourceDensity::Beam(across) => Sum::from_light(chain, across.0 * cos, drawn, true, merged),
    }
}

/// What a vertex sends to the lens, and where on the full film it is seen.
fn to_lens(
    rules: &Rules,
    vertex: &Vertex,
    flux: Vec3,
    lens: Vec2,
    wanted: &impl Fn(Vec2) -> bool,
    rays: &mut u64,
) -> Option<(Vec2, Vec3)> {
    let view = rules.sensor.view(vertex.hit.place.position, lens).filter(|v| wanted(v.film))?;
    let left = vertex.leaving(rules, Walk::Light, view.direction);
    if left.value == Vec3::ZERO {
        return None;
    }
    let visible = rules.world.transmittance_to_camera(vertex.hit, view.end, rays);
    if visible == Vec3::ZERO {
        return None;
    }
    let density = view.density * left.cos;
    let weight = if rules.weighs() { mis::lens(&left.turn, density, rules.light_paths) } else { 1.0 };
    Some((view.film, flux * left.value * visible * (density * weight / rules.light_paths)))
}
