//! Sequences in which only some elements are there: a bit for every place, and what there is without gaps.

use rayon::prelude::*;

/// Places that are counted together.
const WORD: usize = 64;

/// Yes or no for every place, and how often yes comes before one.
#[derive(Clone, Debug, Default)]
pub struct Bits {
    len: usize,
    /// Answers of 64 places each, and how many are yes before them.
    words: Vec<(u64, u32)>,
}

impl Bits {
    /// Places.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is no place.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a place.
    pub fn push(&mut self, yes: bool) {
        if self.len.is_multiple_of(WORD) {
            let before = self.words.last().map_or(0, |&(word, before)| before + word.count_ones());
            self.words.push((0, before));
        }
        let last = self.words.len() - 1;
        self.words[last].0 |= u64::from(yes) << (self.len % WORD);
        self.len += 1;
    }

    /// Adds places up to this one, which comes after all there are and is the only yes among them.
    pub fn mark(&mut self, place: usize) {
        debug_assert!(place >= self.len);
        while self.len < place {
            self.push(false);
        }
        self.push(true);
    }

    /// Whether the answer at a place is yes; beyond the last one it is not.
    #[inline]
    pub fn has(&self, i: usize) -> bool {
        i < self.len && self.get(i)
    }

    /// The answer at a place.
    #[inline]
    pub fn get(&self, i: usize) -> bool {
        self.words[i / WORD].0 >> (i % WORD) & 1 == 1
    }

    /// How often yes comes before a place.
    #[inline]
    fn rank(&self, i: usize) -> usize {
        let (word, before) = self.words[i / WORD];
        before as usize + (word & ((1 << (i % WORD)) - 1)).count_ones() as usize
    }

    /// Appends the places of another.
    pub fn append(&mut self, other: &Self) {
        (0..other.len).for_each(|i| self.push(other.get(i)));
    }

    /// Removes all places and keeps the memory.
    pub fn clear(&mut self) {
        self.len = 0;
        self.words.clear();
    }

    /// Makes room for so many more places, and no more.
    pub fn reserve(&mut self, places: usize) {
        let words = (self.len + places).div_ceil(WORD);
        self.words.reserve_exact(words.saturating_sub(self.words.len()));
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.words.capacity() * size_of::<(u64, u32)>()
    }
}

/// A sequence in which only some elements are there.
#[derive(Clone, Debug)]
pub struct Sparse<T> {
    places: Bits,
    items: Vec<T>,
}

impl<T> Default for Sparse<T> {
    fn default() -> Self {
        Self { places: Bits::default(), items: Vec::new() }
    }
}

impl<T> Sparse<T> {
    /// One of so many places, and these elements at theirs, of which no two are the same.
    pub fn of(mut placed: Vec<(u32, T)>, places: usize) -> Self
    where
        T: Send,
    {
        placed.par_sort_unstable_by_key(|item| item.0);
        let mut all = Self::default();
        all.reserve(places, placed.len());
        for (place, item) in placed {
            (all.len()..place as usize).for_each(|_| all.push(None));
            all.push(Some(item));
        }
        (all.len()..places).for_each(|_| all.push(None));
        all
    }

    /// Places, with an element or without.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no place.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Elements that are there.
    pub fn count(&self) -> usize {
        self.items.len()
    }

    /// Those, in order.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Adds a place.
    pub fn push(&mut self, item: Option<T>) {
        self.places.push(item.is_some());
        self.items.extend(item);
    }

    /// Whether an element is at a place.
    #[inline]
    pub fn has(&self, i: usize) -> bool {
        self.places.get(i)
    }

    /// The element at a place.
    #[inline]
    pub fn get(&self, i: usize) -> Option<&T> {
        self.has(i).then(|| &self.items[self.places.rank(i)])
    }

    /// Appends the places of another, which is left empty.
    pub fn append(&mut self, other: &mut Self) {
        self.places.append(&other.places);
        self.items.append(&mut other.items);
        other.places.clear();
    }

    /// Removes all places and keeps the memory.
    pub fn clear(&mut self) {
        self.places.clear();
        self.items.clear();
    }

    /// Makes room for so many more places and elements, and no more.
    pub fn reserve(&mut self, places: usize, items: usize) {
        self.places.reserve(places);
        self.items.reserve_exact(items);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.places.bytes() + self.items.capacity() * size_of::<T>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash;

    fn sequence(seed: u32, len: u32) -> Vec<Option<u32>> {
        (0..len).map(|k| hash(seed, k).is_multiple_of(3).then_some(k)).collect()
    }

    #[test]
    fn elements_are_found_where_they_were_put() {
        let (a, b) = (sequence(1, 1000), sequence(2, 333));
        let [mut first, mut second] = [&a, &b].map(|s| {
            let mut sparse = Sparse::default();
            s.iter().for_each(|item| sparse.push(*item));
            sparse
        });
        first.reserve(333, second.count());
        first.append(&mut second);
        assert!(second.is_empty() && second.count() == 0);
        let all = [a, b].concat();
        assert_eq!((first.len(), first.count()), (all.len(), all.iter().flatten().count()));
        for (i, item) in all.iter().enumerate() {
            assert_eq!((first.get(i), first.has(i)), (item.as_ref(), item.is_some()));
        }
        let placed = all.iter().enumerate().filter_map(|(i, item)| Some((i as u32, (*item)?)));
        let scattered = Sparse::of(placed.rev().collect(), all.len());
        assert_eq!(scattered.len(), all.len());
        assert!(all.iter().enumerate().all(|(i, item)| scattered.get(i) == item.as_ref()));
        first.clear();
        assert!(first.is_empty() && first.items().is_empty());
    }
}
