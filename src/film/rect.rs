//! Rectangles of pixels.

use std::fmt;

/// A rectangle of pixels; `x` grows to the right and `y` downwards from the film's top left corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Rect {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Rect {
    /// The rectangle of this corner and size.
    pub const fn new(x: u32, y: u32, width: u32, height: u32) -> Self {
        Self { x, y, width, height }
    }

    /// Number of pixels.
    pub const fn area(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether it is not empty and lies in a picture of `width` by `height` pixels.
    pub const fn is_inside(&self, width: u32, height: u32) -> bool {
        // in 64 bits the sums cannot overflow
        self.width > 0
            && self.height > 0
            && self.x as u64 + self.width as u64 <= width as u64
            && self.y as u64 + self.height as u64 <= height as u64
    }

    /// The pixels in both, if any.
    pub fn intersection(&self, other: &Rect) -> Option<Rect> {
        let (x, y) = (self.x.max(other.x), self.y.max(other.y));
        let right = (self.x + self.width).min(other.x + other.width);
        let bottom = (self.y + self.height).min(other.y + other.height);
        (x < right && y < bottom).then(|| Rect::new(x, y, right - x, bottom - y))
    }

    /// Index of pixel `(x, y)` in row-major order. The pixel must lie in the rectangle.
    #[inline]
    pub fn index(&self, x: u32, y: u32) -> usize {
        debug_assert!(x >= self.x && x - self.x < self.width && y >= self.y && y - self.y < self.height);
        (y - self.y) as usize * self.width as usize + (x - self.x) as usize
    }

    /// All pixels `(x, y)`, row by row from the top.
    pub fn pixels(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let Rect { x, y, width, height } = *self;
        (y..y + height).flat_map(move |row| (x..x + width).map(move |column| (column, row)))
    }
}

impl fmt::Display for Rect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the rectangle of {} x {} pixels at ({}, {})", self.width, self.height, self.x, self.y)
    }
}
