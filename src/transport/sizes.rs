//! The size of the kernel, place by place in the picture.

use crate::film::Rect;
use glam::Vec2;

/// Side of the blocks of pixels that have a size of their own.
pub const BLOCK: u32 = 16;

/// Octaves by which the kernel is larger or smaller than the nominal one, for every block of a picture; between the
/// middles of blocks they are interpolated. Empty: nominal everywhere.
#[derive(Clone, Debug, Default)]
pub struct Sizes {
    origin: Vec2,
    across: usize,
    octaves: Vec<f32>,
}

/// Blocks in a row of them, and rows of them, that cover a picture.
pub fn blocks(picture: Rect) -> [usize; 2] {
    [picture.width, picture.height].map(|side| side.div_ceil(BLOCK) as usize)
}

/// The block of a pixel of the full film, which must lie in the picture.
pub fn block(picture: Rect, x: u32, y: u32) -> usize {
    let [across, _] = blocks(picture);
    ((y - picture.y) / BLOCK) as usize * across + ((x - picture.x) / BLOCK) as usize
}

impl Sizes {
    /// Of the blocks of a part of the full film, row by row.
    pub fn new(picture: Rect, octaves: Vec<f32>) -> Self {
        let [across, _] = blocks(picture);
        Self { origin: Vec2::new(picture.x as f32, picture.y as f32), across, octaves }
    }

    /// Whether it is nominal everywhere.
    pub fn is_empty(&self) -> bool {
        self.octaves.is_empty()
    }

    /// Octaves over the nominal size at a position on the full film; outside the picture none.
    pub fn octaves(&self, film: Vec2) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let down = self.octaves.len() / self.across;
        let size = Vec2::new(self.across as f32, down as f32);
        let at = (film - self.origin) / BLOCK as f32;
        // false for NaN
        if !(at.cmpge(Vec2::ZERO).all() && at.cmple(size).all()) {
            return 0.0;
        }
        let at = (at - 0.5).clamp(Vec2::ZERO, size - 1.0);
        let (x, y) = (at.x as usize, at.y as usize);
        let (right, below) = ((x + 1).min(self.across - 1), (y + 1).min(down - 1));
        let f = at.fract();
        let of = |x: usize, y: usize| self.octaves[y * self.across + x];
        let row = |y: usize| of(x, y) + f.x * (of(right, y) - of(x, y));
        row(y) + f.y * (row(below) - row(y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_interpolated_between_the_middles_of_blocks() {
        let sizes = Sizes::new(Rect::new(100, 50, 40, 32), vec![0.0, 1.0, 2.0, -1.0, 0.0, 1.0]);
        let at = |x: f32, y: f32| sizes.octaves(Vec2::new(100.0 + x, 50.0 + y));
        assert_eq!([at(8.0, 8.0), at(24.0, 8.0), at(8.0, 24.0)], [0.0, 1.0, -1.0]);
        assert_eq!([at(16.0, 8.0), at(16.0, 16.0)], [0.5, 0.0]);
        // towards the border as in the last middle
        assert_eq!([at(0.0, 0.0), at(48.0, 3.0), at(0.0, 32.0)], [0.0, 2.0, -1.0]);
        for outside in [Vec2::ZERO, Vec2::splat(1e9), Vec2::splat(-f32::INFINITY), Vec2::splat(f32::NAN)] {
            assert_eq!(sizes.octaves(outside), 0.0);
        }
        assert_eq!(Sizes::default().octaves(Vec2::ONE), 0.0);
    }
}
