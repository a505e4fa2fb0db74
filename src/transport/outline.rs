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
        let Some(a) = seen.arrival.map(|a| arrivals.get(a as usize)) else { return false };
        let reach = sensor.pixel_footprint(a.position);
        let goes_on = |neighbour: usize| {
            let p = &primaries[neighbour];
            p.arrival.is_some_and(|b| {
                let b = arrivals.get(b as usize);
                let rise = (b.position - a.position).dot(a.normal).abs();
                let is_alike = p.passages == seen.passages && a.class == b.class;
                is_alike && a.normal.dot(b.normal) > SMOOTH && rise < reach
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
    use crate::scene::Camera;
    use crate::shading::{Address, SurfaceClass};
    use crate::transport::store::Arrival;
    use glam::{Vec2, Vec3};

    const SIDE: u32 = 8;

    /// What pixels see of a wall, orthographic and a unit to the pixel; `depth(x, y)` is where it stands, if it is there.
    fn clear(depth: impl Fn(u32, u32) -> Option<f32>) -> (Vec<bool>, Bits) {
        let camera = r#"{"type":"orthographic","window":[0,8,-8,0]}"#;
        let sensor = Sensor::new(&Camera::from_json("camera", camera).unwrap(), SIDE, SIDE);
        let mut arrivals = Arrivals::default();
        let mut primaries = Vec::new();
        for (x, y) in (0..SIDE * SIDE).map(|i| (i % SIDE, i / SIDE)) {
            let ray = sensor.ray(Vec2::new(x as f32 + 0.5, y as f32 + 0.5), Vec2::ZERO);
            let arrival = depth(x, y).map(|d| {
                arrivals.push(Arrival {
                    position: ray.origin + ray.direction * d,
                    normal: -ray.direction,
                    wo: -ray.direction,
                    at: Address { instance: 0, triangle: 0, barycentrics: Vec2::ZERO },
                    reflectance: Vec3::ONE,
                    back_pdf: 1.0,
                    survival: 1.0,
                    class: SurfaceClass::Diffuse,
                    goes_on: false,
                });
                arrivals.len() as u32 - 1
            });
            primaries.push(Primary { arrival, ..Primary::NOTHING });
        }
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
