//! Light that camera segments met, as it is kept: 24 bytes each.

use super::EmissionHit;
use crate::math::SharedExponent;
use crate::transport::sparse::Bits;

#[derive(Clone, Copy, Debug)]
struct Packed {
    arrival: u32,
    forward: f32,
    next_event_pdf: f32,
    light_density: f32,
    light: SharedExponent,
    passages: u16,
}

impl Packed {
    fn hit(&self) -> EmissionHit {
        EmissionHit {
            arrival: self.arrival,
            light: self.light.decode(),
            forward: self.forward,
            next_event_pdf: self.next_event_pdf,
            light_density: self.light_density,
            passages: u32::from(self.passages),
        }
    }
}

/// Light met by segments that left arrivals, in their order.
#[derive(Clone, Debug, Default)]
pub struct Hits {
    hits: Vec<Packed>,
    /// Whether arrivals have any, as far as it is known.
    places: Bits,
}

impl Hits {
    /// Their number.
    pub fn len(&self) -> usize {
        self.hits.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.hits.is_empty()
    }

    /// Adds one, of the same arrival as the last or a later one.
    pub fn push(&mut self, h: EmissionHit) {
        let arrival = h.arrival as usize;
        if self.places.len() <= arrival {
            self.places.mark(arrival);
        }
        self.hits.push(Packed {
            arrival: h.arrival,
            forward: h.forward,
            next_event_pdf: h.next_event_pdf,
            light_density: h.light_density,
            light: SharedExponent::encode(h.light),
            passages: h.passages.min(u32::from(u16::MAX)) as u16,
        });
    }

    /// Whether the segment that left arrival `i` met some.
    #[inline]
    pub fn has(&self, i: usize) -> bool {
        self.places.has(i)
    }

    /// Those of the segment that left arrival `i`.
    pub fn of(&self, i: usize) -> impl Iterator<Item = EmissionHit> {
        let first =
            if self.has(i) { self.hits.partition_point(|h| (h.arrival as usize) < i) } else { self.len() };
        self.hits[first..].iter().take_while(move |h| h.arrival as usize == i).map(Packed::hit)
    }

    /// Appends those of another, which is left empty: its arrivals follow the first so many.
    pub fn append(&mut self, other: &mut Self, arrivals: usize) {
        while self.places.len() < arrivals {
            self.places.push(false);
        }
        self.places.append(&other.places);
        let first = arrivals as u32;
        self.hits.extend(other.hits.drain(..).map(|h| Packed { arrival: h.arrival + first, ..h }));
        other.places.clear();
    }

    /// Removes all and keeps the memory.
    pub fn clear(&mut self) {
        self.hits.clear();
        self.places.clear();
    }

    /// Makes room for so many more, of so many arrivals, and no more.
    pub fn reserve(&mut self, arrivals: usize, hits: usize) {
        self.places.reserve(arrivals);
        self.hits.reserve_exact(hits);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.hits.capacity() * size_of::<Packed>() + self.places.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn hits_are_found_by_the_arrival_they_left() {
        assert_eq!(size_of::<Packed>(), 24);
        let hit = |arrival| EmissionHit {
            arrival,
            light: Vec3::ONE,
            forward: 0.5,
            next_event_pdf: 0.25,
            light_density: arrival as f32,
            passages: 3,
        };
        let (mut first, mut second) = (Hits::default(), Hits::default());
        [1, 1, 4].into_iter().for_each(|a| first.push(hit(a)));
        [0, 2].into_iter().for_each(|a| second.push(hit(a)));
        first.append(&mut second, 70);
        let found = |i: usize| first.of(i).map(|h| (h.arrival, h.light_density)).collect::<Vec<_>>();
        assert_eq!((first.len(), second.is_empty()), (5, true));
        assert_eq!(found(1), [(1, 1.0), (1, 1.0)]);
        assert_eq!([found(4), found(70), found(72)], [[(4, 4.0)], [(70, 0.0)], [(72, 2.0)]]);
        assert!([0, 2, 69, 71, 73, 1000].into_iter().all(|i| found(i).is_empty()));
    }
}
