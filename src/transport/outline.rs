//! Where the surfaces that pixels see go on around them, and where they end: at outlines, and in gaps and cracks that
//! are hardly a pixel wide.

use super::camera::Primary;
use super::sparse::Bits;
use super::store::Arrivals;
use crate::shading::Sensor;
use rayon::prelude::*;

/// Cosine between normals of neighbouring pixels above which the surface goes on.
const SMOOTH: f32 = 0.8;

/// For every pixel of a band, in rows of `width`, whether the surface that it sees goes on around it, so that what it
/// shows is that of one place.
pub fn clear_pixels(width: u32, sensor: &Sensor, primaries: &[Primary], arrivals: &Arrivals) -> Vec<bool> {
    let (width, height) = (width as usize, primaries.len() / width.max(1) as usize);
    let is_clear = |pixel: usize| {
        let seen = &primaries[pixel];
        let Some(a) = seen.arrival.map(|a| a as usize) else { return false };
        let (class, (position, normal)) = (arrivals.class(a), arrivals.place(a));
        let reach = sensor.pixel_footprint(position);
        let goes_on = |neighbour: usize| {
            let p = &primaries[neighbour];
            p.arrival.is_some_and(|b| {
                let (at, n) = arrivals.place(b as usize);
                let is_alike = p.passages == seen.passages && arrivals.class(b as usize) == class;
                is_alike && normal.dot(n) > SMOOTH && (at - position).dot(normal).abs() < reach
            })
        };
        let (x, y) = (pixel % width, pixel / width);
        (x == 0 || goes_on(pixel - 1))
            && (x + 1 == width || goes_on(pixel + 1))
            && (y == 0 || goes_on(pixel - width))
            && (y + 1 == height || goes_on(pixel + width))
    };
    (0..primaries.len()).into_par_iter().map(is_clear).collect()
}

/// The arrivals of primary segments, if nothing lies on these, of pixels that are not clear.
pub fn ends(primaries: &[Primary], is_clear: &[bool]) -> Bits {
    let mut ends = Bits::default();
    for (p, is_clear) in primaries.iter().zip(is_clear) {
        if let Some(arrival) = p.arrival.filter(|_| p.passages == 0 && !is_clear) {
            ends.mark(arrival as usize);
        }
    }
    ends
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::testing::wall;

    const SIDE: u32 = 8;

    /// Which pixels are clear that see a wall, and at which arrivals it ends; `depth(x, y)` is where it stands, if it is there.
    fn clear(depth: impl Fn(u32, u32) -> Option<f32>) -> (Vec<bool>, Bits) {
        let (sensor, primaries, arrivals) = wall(SIDE, depth);
        let clear = clear_pixels(SIDE, &sensor, &primaries, &arrivals);
        let ends = ends(&primaries, &clear);
        (clear, ends)
    }

    fn columns(clear: &[bool]) -> Vec<bool> {
        assert!(clear.chunks(SIDE as usize).all(|row| row == &clear[..SIDE as usize]));
        clear[..SIDE as usize].to_vec()
    }

    #[test]
    fn surfaces_end_at_steps_and_at_gaps_and_not_at_the_border_of_the_picture() {
        assert!(clear(|_, _| Some(5.0)).0.into_iter().all(|c| c));
        let (step, ends) = clear(|x, _| Some(if x < 4 { 5.0 } else { 9.0 }));
        assert_eq!(columns(&step), [true, true, true, false, false, true, true, true]);
        assert!((0..64).all(|a| ends.has(a) == [3, 4].contains(&(a % 8))));
        let (gap, ends) = clear(|x, _| (x != 2).then_some(5.0));
        assert_eq!(columns(&gap), [true, false, false, false, true, true, true, true]);
        // seven arrivals a row: the gap has none
        assert!((0..60).all(|a| ends.has(a) == (a < 56 && [1, 2].contains(&(a % 7)))));
    }
}
