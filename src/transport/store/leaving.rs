//! Segments that leave camera arrivals, as they are kept: only those there are, and chains only where they are not plain.

use super::{NextEvent, Outgoing};
use crate::math::{Octahedral, SharedExponent};
use crate::transport::sparse::{Bits, Sparse};
use glam::Vec3;

/// A segment that leaves an arrival: 8 bytes.
#[derive(Clone, Copy, Debug)]
struct Leaving {
    direction: Octahedral,
    pdf: f32,
}

/// What lies on a segment's way: 20 bytes.
#[derive(Clone, Copy, Debug)]
struct Chain {
    throughput: SharedExponent,
    passages: u16,
    forward: f32,
    reverse: f32,
    squeeze: f32,
}

impl Chain {
    /// That of a segment that ends somewhere; nothing if there is nothing on its way, and no other choice at its ends.
    fn of(o: &Outgoing) -> Option<Self> {
        let is_plain = o.throughput == Vec3::ONE && o.passages == 0;
        let is_sure = o.forward == 1.0 && o.reverse == 1.0 && o.squeeze == 1.0;
        (o.forward > 0.0 && !(is_plain && is_sure)).then(|| Self {
            throughput: SharedExponent::encode(o.throughput),
            passages: o.passages.min(u32::from(u16::MAX)) as u16,
            forward: o.forward,
            reverse: o.reverse,
            squeeze: o.squeeze,
        })
    }
}

/// Segments that leave arrivals.
#[derive(Clone, Debug, Default)]
pub struct Outgoings {
    segments: Sparse<Leaving>,
    chains: Sparse<Chain>,
    ends: Bits,
}

impl Outgoings {
    /// Arrivals, with a segment that leaves or without.
    pub fn len(&self) -> usize {
        self.segments.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// Segments.
    pub fn count(&self) -> usize {
        self.segments.count()
    }

    /// Adds that of the next arrival; without a density there is none.
    pub fn push(&mut self, o: Outgoing) {
        let segment = Leaving { direction: Octahedral::encode(o.direction), pdf: o.pdf };
        self.segments.push((o.pdf > 0.0).then_some(segment));
        self.chains.push(Chain::of(&o));
        self.ends.push(o.forward > 0.0);
    }

    /// That of arrival `i`.
    #[inline]
    pub fn get(&self, i: usize) -> Outgoing {
        let Some(segment) = self.segments.get(i) else { return Outgoing::default() };
        let (direction, pdf) = (segment.direction.decode(), segment.pdf);
        if !self.has_end(i) {
            return Outgoing { direction, pdf, ..Outgoing::default() };
        }
        match self.chains.get(i) {
            None => Outgoing { direction, pdf, ..Outgoing::PLAIN },
            Some(c) => Outgoing {
                direction,
                pdf,
                throughput: c.throughput.decode(),
                forward: c.forward,
                reverse: c.reverse,
                squeeze: c.squeeze,
                passages: u32::from(c.passages),
            },
        }
    }

    /// Density with which that of arrival `i` was drawn.
    #[inline]
    pub fn pdf(&self, i: usize) -> f32 {
        self.segments.get(i).map_or(0.0, |s| s.pdf)
    }

    /// Its direction, if there is one.
    #[inline]
    pub fn direction(&self, i: usize) -> Vec3 {
        self.segments.get(i).map_or(Vec3::ZERO, |s| s.direction.decode())
    }

    /// Dirac lobes that it passes up to its end.
    #[inline]
    pub fn passages(&self, i: usize) -> u32 {
        self.chains.get(i).map_or(0, |c| u32::from(c.passages))
    }

    /// Whether that of arrival `i` ends at the next one.
    #[inline]
    pub fn has_end(&self, i: usize) -> bool {
        self.ends.get(i)
    }

    /// Throughput of that of arrival `i`, which has an end.
    #[inline]
    pub fn throughput(&self, i: usize) -> Vec3 {
        self.chains.get(i).map_or(Vec3::ONE, |c| c.throughput.decode())
    }

    /// Most Dirac lobes that one passes.
    pub fn most_passages(&self) -> u32 {
        self.chains.items().iter().map(|c| u32::from(c.passages)).max().unwrap_or(0)
    }

    /// Appends those of another, which is left empty.
    pub fn append(&mut self, other: &mut Self) {
        self.segments.append(&mut other.segments);
        self.chains.append(&mut other.chains);
        self.ends.append(&other.ends);
        other.ends.clear();
    }

    /// Removes all and keeps the memory.
    pub fn clear(&mut self) {
        self.segments.clear();
        self.chains.clear();
        self.ends.clear();
    }

    /// Makes room for all of these, too, and no more.
    pub fn reserve<'a>(&mut self, parts: impl Iterator<Item = &'a Self> + Clone) {
        let places = parts.clone().map(Self::len).sum();
        self.segments.reserve(places, parts.clone().map(|o| o.segments.count()).sum());
        self.chains.reserve(places, parts.map(|o| o.chains.count()).sum());
        self.ends.reserve(places);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.segments.bytes() + self.chains.bytes() + self.ends.bytes()
    }
}

/// A next-event segment: 24 bytes.
#[derive(Clone, Copy, Debug)]
struct Towards {
    direction: Octahedral,
    pdf: f32,
    next_event_pdf: f32,
    light_density: f32,
    light: SharedExponent,
    is_delta: bool,
}

/// Next-event segments of arrivals.
#[derive(Clone, Debug, Default)]
pub struct NextEvents(Sparse<Towards>);

impl NextEvents {
    /// Arrivals, with a next-event segment or without.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Segments.
    pub fn count(&self) -> usize {
        self.0.count()
    }

    /// Adds that of the next arrival; without a density there is none.
    pub fn push(&mut self, n: NextEvent) {
        self.0.push((n.next_event_pdf > 0.0).then(|| Towards {
            direction: Octahedral::encode(n.direction),
            pdf: n.pdf,
            next_event_pdf: n.next_event_pdf,
            light_density: n.light_density,
            light: SharedExponent::encode(n.light),
            is_delta: n.is_delta,
        }));
    }

    /// That of arrival `i`.
    #[inline]
    pub fn get(&self, i: usize) -> Option<NextEvent> {
        self.0.get(i).map(|t| NextEvent {
            direction: t.direction.decode(),
            pdf: t.pdf,
            light: t.light.decode(),
            next_event_pdf: t.next_event_pdf,
            light_density: t.light_density,
            is_delta: t.is_delta,
        })
    }

    /// Appends those of another, which is left empty.
    pub fn append(&mut self, other: &mut Self) {
        self.0.append(&mut other.0);
    }

    /// Removes all and keeps the memory.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Makes room for all of these, too, and no more.
    pub fn reserve<'a>(&mut self, parts: impl Iterator<Item = &'a Self> + Clone) {
        self.0.reserve(parts.clone().map(Self::len).sum(), parts.map(Self::count).sum());
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.0.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_come_back() {
        assert_eq!((size_of::<Leaving>(), size_of::<Chain>(), size_of::<Towards>()), (8, 20, 24));
        let plain = Outgoing { direction: Vec3::X, pdf: 0.25, ..Outgoing::PLAIN };
        let through_glass =
            Outgoing { squeeze: 0.5, passages: 70_000, throughput: Vec3::splat(0.5), ..plain };
        let unsure = Outgoing { reverse: 0.25, ..plain };
        let escaped = Outgoing { forward: 0.0, ..through_glass };
        let mut kept = Outgoings::default();
        for o in [plain, Outgoing::default(), through_glass, unsure, escaped] {
            kept.push(o);
        }
        assert_eq!((kept.len(), kept.count(), kept.chains.count()), (5, 4, 2));
        assert_eq!(kept.get(0), plain);
        assert_eq!(kept.get(1), Outgoing::default());
        assert_eq!(kept.get(2), Outgoing { passages: 65_535, ..through_glass });
        assert_eq!(kept.get(3), unsure);
        assert_eq!(kept.get(4), Outgoing { direction: Vec3::X, pdf: 0.25, ..Outgoing::default() });
        assert_eq!([0, 1, 4].map(|i| kept.has_end(i)), [true, false, false]);
        assert_eq!(kept.most_passages(), 65_535);
    }

    #[test]
    fn next_events_without_a_density_are_none() {
        let drawn =
            NextEvent { direction: Vec3::Y, next_event_pdf: 2.0, light: Vec3::ONE, ..Default::default() };
        let mut kept = NextEvents::default();
        kept.push(drawn);
        kept.push(NextEvent::default());
        assert_eq!((kept.get(0), kept.get(1), kept.count()), (Some(drawn), None, 1));
    }
}
