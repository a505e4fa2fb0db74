//! Cellular noise (Worley 1996, "A Cellular Texture Basis Function"), as Blender has it: one point at random in every cell
//! of a grid, and what the nearest ones tell.

use glam::{IVec3, Vec3};
use serde::Deserialize;

/// What a place is told of the points around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Feature {
    /// The nearest point.
    #[default]
    F1,
    /// The second nearest point.
    F2,
    /// All near ones, the nearer the more.
    SmoothF1,
    /// How far it is to where another point becomes the nearest.
    DistanceToEdge,
}

/// How distances are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Straight.
    #[default]
    Euclidean,
    /// Along the axes, one after the other.
    Manhattan,
    /// Along the longest axis.
    Chebychev,
    /// By a power of its own.
    Minkowski,
}

/// Numbers of cellular noise.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cells {
    /// What is told.
    pub feature: Feature,
    /// How distances are measured; to edges, always straight.
    pub metric: Metric,
    /// The power of [`Metric::Minkowski`].
    pub exponent: f32,
    /// Width over which points are mixed in [`Feature::SmoothF1`].
    pub smoothness: f32,
    /// 0: points are at the corners of their cells, 1: anywhere in these.
    pub randomness: f32,
    /// Octaves beyond the first, in part for what is not whole; of edges there are none.
    pub detail: f32,
    /// Amplitude of an octave over that of the one before.
    pub roughness: f32,
    /// Frequency likewise.
    pub lacunarity: f32,
    /// Whether distances are about in [0, 1].
    pub normalize: bool,
}

impl Default for Cells {
    fn default() -> Self {
        Self {
            feature: Feature::F1,
            metric: Metric::Euclidean,
            exponent: 0.5,
            smoothness: 0.5,
            randomness: 1.0,
            detail: 0.0,
            roughness: 0.5,
            lacunarity: 2.0,
            normalize: false,
        }
    }
}

/// Coordinates from which single precision has no room for cells.
const FAR: f32 = 1e6;
/// Least squared distance of points between which there is an edge.
const APART: f32 = 1e-4;

/// A random number of [0, 1] in each component, of a cell: Jarzynski and Olano 2020, "Hash Functions for GPU Rendering", `pcg3d`,
/// on signed numbers.
fn random(cell: IVec3) -> Vec3 {
    let mut v = cell.to_array().map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let stir = |v: &mut [i32; 3]| {
        for i in 0..3 {
            v[i] = v[i].wrapping_add(v[(i + 1) % 3].wrapping_mul(v[(i + 2) % 3]));
        }
    };
    stir(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    stir(&mut v);
    Vec3::from(v.map(|x| (x & i32::MAX) as f32)) / i32::MAX as f32
}

/// What is told at a place: a distance, and the colour of its cell.
#[derive(Clone, Copy, Debug, Default)]
struct Told {
    distance: f32,
    color: Vec3,
}

impl Told {
    fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            distance: self.distance + (other.distance - self.distance) * t,
            color: self.color.lerp(other.color, t),
        }
    }

    fn plus(self, other: Self, amplitude: f32) -> Self {
        Self {
            distance: self.distance + other.distance * amplitude,
            color: self.color + other.color * amplitude,
        }
    }
}

impl Cells {
    /// The distance at a place.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.told(p).distance
    }

    /// The colour at a place; of edges none.
    pub fn color(&self, p: Vec3) -> Vec3 {
        self.told(p).color
    }

    /// The finest length in it.
    pub fn finest(&self) -> f32 {
        self.lacunarity.max(1.0).powf(-self.detail.ceil())
    }

    fn told(&self, p: Vec3) -> Told {
        let span = 0.5 + 0.5 * self.randomness;
        let most = match self.feature {
            Feature::F1 | Feature::SmoothF1 => self.length(Vec3::splat(span)),
            Feature::F2 => 2.0 * self.length(Vec3::splat(span)),
            Feature::DistanceToEdge => span,
        };
        let is_plain = self.detail == 0.0 || self.roughness == 0.0 || self.feature == Feature::DistanceToEdge;
        let (told, sum) = if is_plain { (self.octave(p), 1.0) } else { self.octaves(p) };
        if !self.normalize {
            return told;
        }
        Told { distance: told.distance / (sum * most), color: told.color / sum }
    }

    /// The sum of octaves, and that of their amplitudes.
    fn octaves(&self, p: Vec3) -> (Told, f32) {
        let (mut amplitude, mut frequency, mut sum) = (1.0, 1.0, 0.0);
        let mut told = Told::default();
        for _ in 0..=self.detail as u32 {
            told = told.plus(self.octave(p * frequency), amplitude);
            sum += amplitude;
            amplitude *= self.roughness;
            frequency *= self.lacunarity;
        }
        let part = self.detail.fract();
        if part > 0.0 {
            told = told.lerp(told.plus(self.octave(p * frequency), amplitude), part);
            sum += amplitude * part;
        }
        (told, sum)
    }

    fn octave(&self, p: Vec3) -> Told {
        if !(p.is_finite() && p.abs().max_element() < FAR) {
            return Told::default();
        }
        let low = p.floor();
        let near = Near { cell: low.as_ivec3(), local: p - low, randomness: self.randomness };
        match self.feature {
            Feature::F1 | Feature::F2 => self.nearest(near),
            Feature::SmoothF1 => self.smooth(near),
            Feature::DistanceToEdge => Told { distance: near.to_edge(), color: Vec3::ZERO },
        }
    }

    fn nearest(&self, near: Near) -> Told {
        // the nearest and the second nearest
        let mut found = [(f32::MAX, IVec3::ZERO); 2];
        for (cell, point) in near.points(1) {
            let distance = self.length(point);
            if distance < found[0].0 {
                found = [(distance, cell), found[0]];
            } else if distance < found[1].0 {
                found[1] = (distance, cell);
            }
        }
        let (distance, cell) = found[usize::from(self.feature == Feature::F2)];
        Told { distance, color: random(cell) }
    }

    fn smooth(&self, near: Near) -> Told {
        // widths are radii there
        let width = (0.5 * self.smoothness).clamp(0.0, 0.5);
        if width == 0.0 {
            return self.nearest(near);
        }
        let mut told: Option<Told> = None;
        for (cell, point) in near.points(2) {
            let next = Told { distance: self.length(point), color: random(cell) };
            let Some(before) = told else {
                told = Some(next);
                continue;
            };
            let t = (0.5 + 0.5 * (before.distance - next.distance) / width).clamp(0.0, 1.0);
            let t = t * t * (3.0 - 2.0 * t);
            let less = width * t * (1.0 - t);
            let mut mixed = before.lerp(next, t);
            mixed.distance -= less;
            mixed.color -= less / (1.0 + 3.0 * width);
            told = Some(mixed);
        }
        told.unwrap_or_default()
    }

    fn length(&self, v: Vec3) -> f32 {
        let v = v.abs();
        match self.metric {
            Metric::Euclidean => v.length(),
            Metric::Manhattan => v.element_sum(),
            Metric::Chebychev => v.max_element(),
            Metric::Minkowski => v.powf(self.exponent).element_sum().powf(1.0 / self.exponent),
        }
    }
}

/// A place in its cell.
#[derive(Clone, Copy)]
struct Near {
    cell: IVec3,
    local: Vec3,
    randomness: f32,
}

impl Near {
    /// The cells around it, and where their points are from it.
    fn points(self, reach: i32) -> impl Iterator<Item = (IVec3, Vec3)> {
        let side = 2 * reach + 1;
        (0..side * side * side).map(move |i| {
            let offset = IVec3::new(i % side, i / side % side, i / (side * side)) - reach;
            let cell = self.cell + offset;
            (cell, offset.as_vec3() + random(cell) * self.randomness - self.local)
        })
    }

    fn to_edge(self) -> f32 {
        let nearer = |a: &Vec3, b: &Vec3| a.length_squared().total_cmp(&b.length_squared());
        let Some(closest) = self.points(1).map(|(_, point)| point).min_by(nearer) else { return 0.0 };
        let to_edge = |point: Vec3| {
            let across = point - closest;
            (across.length_squared() > APART).then(|| (0.5 * (closest + point)).dot(across.normalize()))
        };
        self.points(1).filter_map(|(_, point)| to_edge(point)).fold(f32::MAX, f32::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::testing::place;

    #[test]
    fn without_randomness_points_are_lattice_points() {
        let cells = |feature| Cells { feature, randomness: 0.0, ..Cells::default() };
        for i in 0..200 {
            let p = place(i);
            let to_lattice = (p - p.round()).length();
            assert!((cells(Feature::F1).distance(p) - to_lattice).abs() < 1e-4);
            assert!(cells(Feature::F2).distance(p) >= to_lattice - 1e-4);
            let to_edge = 0.5 - (p - p.round()).abs().max_element();
            assert!((cells(Feature::DistanceToEdge).distance(p) - to_edge).abs() < 1e-4);
        }
    }

    #[test]
    fn distances_are_those_of_the_metric_and_about_normal() {
        let of = |metric, normalize| Cells { metric, normalize, exponent: 2.0, ..Cells::default() };
        for i in 0..500 {
            let p = place(i);
            let at = |metric| of(metric, false).distance(p);
            assert!(
                at(Metric::Chebychev) <= at(Metric::Euclidean)
                    && at(Metric::Euclidean) <= at(Metric::Manhattan)
            );
            assert!((at(Metric::Minkowski) - at(Metric::Euclidean)).abs() < 1e-4);
            assert!((0.0..=1.0).contains(&of(Metric::Euclidean, true).distance(p)));
            let c = of(Metric::Euclidean, false).color(p);
            assert!(c.min_element() >= 0.0 && c.max_element() <= 1.0);
        }
    }

    #[test]
    fn the_smoothed_distance_is_smooth_and_tends_to_the_nearest() {
        let smooth = |smoothness| Cells { feature: Feature::SmoothF1, smoothness, ..Cells::default() };
        for i in 0..200 {
            let p = place(i);
            let plain = Cells::default().distance(p);
            assert!((smooth(1e-4).distance(p) - plain).abs() < 1e-3);
            assert_eq!(smooth(0.0).distance(p), plain);
            let step = smooth(1.0).distance(p + Vec3::splat(1e-3)) - smooth(1.0).distance(p);
            assert!(step.abs() < 2e-2);
        }
        for p in [Vec3::splat(1e30), Vec3::INFINITY, Vec3::NAN] {
            assert_eq!(smooth(1.0).distance(p), 0.0);
        }
    }
}
