//! Light that arrives anywhere on the film, added up pixel by pixel in a fixed order.

use super::{Filter, Rect};
use glam::{Vec2, Vec3};

/// Light that arrives at a place of the film.
#[derive(Clone, Copy, Debug)]
pub struct Splat {
    /// Place in pixels from the top left corner of the full film.
    pub film: Vec2,
    /// Radiance, for a pixel whose filter is one there.
    pub light: Vec3,
    /// Times that it has been scattered.
    pub bounces: u32,
}

/// What a pixel got.
#[derive(Clone, Copy, Debug, Default)]
pub struct Splatted {
    /// Radiance.
    pub light: Vec3,
    /// Part of it that was scattered once.
    pub direct: Vec3,
}

/// Sums of an iteration.
#[derive(Debug, Default)]
pub struct SplatBuffer {
    pixels: Vec<Splatted>,
}

/// The pixels of `crop` whose filters reach a place of the full film, of an axis: first and one past the last.
fn reach(at: f32, radius: f32, start: u32, length: u32) -> std::ops::Range<u32> {
    let (first, last) = ((at - 0.5 - radius).floor(), (at - 0.5 + radius).ceil());
    let clamp = |v: f32| (v.max(0.0) as u32).clamp(start, start + length);
    // conversion saturates
    clamp(first)..clamp(last + 1.0)
}

/// Whether light at a place of the full film counts for a pixel of `crop`.
pub fn is_wanted(film: Vec2, filter: &Filter, crop: Rect) -> bool {
    let near = |at: f32, start: u32, length: u32| {
        at >= start as f32 + 0.5 - filter.radius() && at <= (start + length) as f32 - 0.5 + filter.radius()
    };
    near(film.x, crop.x, crop.width) && near(film.y, crop.y, crop.height)
}

impl SplatBuffer {
    /// Adds up these splats, and forgets what was before.
    pub fn collect(&mut self, splats: &[Splat], filter: &Filter, crop: Rect) {
        self.pixels.clear();
        self.pixels.resize(crop.area(), Splatted::default());
        for s in splats {
            for y in reach(s.film.y, filter.radius(), crop.y, crop.height) {
                for x in reach(s.film.x, filter.radius(), crop.x, crop.width) {
                    let weight = filter.density(s.film - Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                    if weight > 0.0 {
                        let pixel = &mut self.pixels[crop.index(x, y)];
                        pixel.light += s.light * weight;
                        if s.bounces == 1 {
                            pixel.direct += s.light * weight;
                        }
                    }
                }
            }
        }
    }

    /// What a pixel got, by its index in the crop; nothing where there were no splats at all.
    pub fn get(&self, pixel: usize) -> Splatted {
        self.pixels.get(pixel).copied().unwrap_or_default()
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.pixels.capacity() * size_of::<Splatted>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FilterKind;

    /// What falls well inside the crop counts once in all, however the filter divides it.
    #[test]
    fn splats_keep_their_light() {
        let crop = Rect::new(3, 5, 20, 10);
        for (kind, width) in [(FilterKind::Box, 0.0), (FilterKind::Box, 2.0)] {
            let filter = Filter::new(kind, width).unwrap();
            let mut buffer = SplatBuffer::default();
            for film in [Vec2::new(10.3, 9.9), Vec2::new(8.0, 8.0), Vec2::new(12.5, 10.0)] {
                assert!(is_wanted(film, &filter, crop));
                buffer.collect(&[Splat { film, light: Vec3::ONE, bounces: 1 }], &filter, crop);
                let sum: f32 = (0..crop.area()).map(|p| buffer.get(p).light.x).sum();
                approx::assert_relative_eq!(sum, 1.0, max_relative = 1e-5);
            }
            for film in [Vec2::new(1.0, 9.0), Vec2::new(5.0, 17.0), Vec2::new(-1e30, 1e30), Vec2::NAN] {
                assert!(!is_wanted(film, &filter, crop));
                buffer.collect(&[Splat { film, light: Vec3::ONE, bounces: 1 }], &filter, crop);
                assert!((0..crop.area()).all(|p| buffer.get(p).light == Vec3::ZERO));
            }
        }
    }
}
