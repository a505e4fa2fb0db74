//! Walls of bricks, as Blender has them.

use glam::Vec3;
use serde::Deserialize;

/// Numbers of a wall in the plane of x and y. Defaults are Blender's.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Bricks {
    /// Width of a brick.
    pub width: f32,
    /// Height of a row.
    pub height: f32,
    /// Width of the mortar around a brick; half of what is between two.
    pub mortar: f32,
    /// Share of that width over which mortar begins softly.
    pub smooth: f32,
    /// Added to the random number of bricks.
    pub bias: f32,
    /// By how much of their width bricks are moved in every so many-th row.
    pub offset: f32,
    /// How many rows that is; 0: no row is moved or squashed.
    pub offset_frequency: u32,
    /// Factor of the width of bricks in every so many-th row.
    pub squash: f32,
    /// How many rows that is.
    pub squash_frequency: u32,
}

impl Default for Bricks {
    fn default() -> Self {
        Self {
            width: 0.5,
            height: 0.25,
            mortar: 0.02,
            smooth: 0.1,
            bias: 0.0,
            offset: 0.5,
            offset_frequency: 2,
            squash: 1.0,
            squash_frequency: 2,
        }
    }
}

/// A random number of [0, 1].
fn random(n: u32) -> f32 {
    let n = n.wrapping_add(1013) & 0x7fff_ffff;
    let n = (n >> 13) ^ n;
    let mixed = n.wrapping_mul(n.wrapping_mul(n).wrapping_mul(60_493).wrapping_add(19_990_303));
    0.5 * ((mixed.wrapping_add(1_376_312_589) & 0x7fff_ffff) as f32 / 1_073_741_824.0)
}

impl Bricks {
    /// At a place, how much is mortar, and the random number of the brick; both in [0, 1].
    pub fn at(&self, p: Vec3) -> [f32; 2] {
        let row = (p.y / self.height).floor();
        let number = i64::from(row as i32);
        let (mut width, mut offset) = (self.width, 0.0);
        if self.offset_frequency > 0 && self.squash_frequency > 0 {
            if number % i64::from(self.squash_frequency) == 0 {
                width *= self.squash;
            }
            if number % i64::from(self.offset_frequency) == 0 {
                offset = width * self.offset;
            }
        }
        let column = ((p.x + offset) / width).floor();
        let (x, y) = (p.x + offset - width * column, p.y - self.height * row);
        let name = ((number as u32) << 16).wrapping_add(column as i32 as u32 & 0xffff);
        let tint = (random(name) + self.bias).clamp(0.0, 1.0);
        let to_edge = x.min(y).min(width - x).min(self.height - y);
        let mortar = if to_edge >= self.mortar {
            0.0
        } else if self.smooth == 0.0 {
            1.0
        } else {
            let t = ((1.0 - to_edge / self.mortar) / self.smooth).min(1.0);
            t * t * (3.0 - 2.0 * t)
        };
        [mortar, tint]
    }

    /// The finest length in it.
    pub fn finest(&self) -> f32 {
        (self.mortar * self.smooth.max(0.1)).min(self.height).min(self.width).max(1e-4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mortar_is_at_the_edges_and_rows_are_moved() {
        let wall = Bricks { smooth: 0.0, ..Bricks::default() };
        let mortar = |x: f32, y: f32| wall.at(Vec3::new(x, y, 7.0))[0];
        // rows of even number are moved by half a brick
        assert_eq!([mortar(0.25, 0.125), mortar(0.01, 0.125), mortar(0.01, 0.375)], [1.0, 0.0, 1.0]);
        assert_eq!([mortar(0.1, 0.01), mortar(0.1, 0.24), mortar(0.1, 0.125)], [1.0, 1.0, 0.0]);
        let soft = Bricks { smooth: 1.0, ..wall };
        let half = soft.at(Vec3::new(0.1, 0.01, 0.0))[0];
        assert!((half - 0.5).abs() < 1e-4, "{half}");
    }

    #[test]
    fn bricks_have_numbers_of_their_own() {
        let wall = Bricks::default();
        let tints: Vec<f32> = (0..400)
            .map(|i| wall.at(Vec3::new(0.5 * (i % 20) as f32 + 0.1, 0.25 * (i / 20) as f32 + 0.1, 0.0))[1])
            .collect();
        let mean = tints.iter().sum::<f32>() / 400.0;
        assert!((mean - 0.5).abs() < 0.05 && tints.iter().all(|t| (0.0..=1.0).contains(t)), "{mean}");
        let pale = Bricks { bias: 1.0, ..wall };
        assert_eq!(pale.at(Vec3::splat(0.1))[1], 1.0);
        for p in [Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e30)] {
            assert!(wall.at(p).iter().all(|v| (0.0..=1.0).contains(v)), "{p}");
        }
    }
}
