//! Items of one kind, packed, one after the other.

/// How an item is kept.
pub trait Pack: Copy {
    /// The item.
    type Item;

    /// Packs it.
    fn pack(item: &Self::Item) -> Self;

    /// The item, as far as it was kept.
    fn unpack(&self) -> Self::Item;
}

/// Packed items.
#[derive(Clone, Debug)]
pub struct List<P>(pub(super) Vec<P>);

impl<P> Default for List<P> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<P: Pack> List<P> {
    /// Their number.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds one.
    pub fn push(&mut self, item: P::Item) {
        self.0.push(P::pack(&item));
    }

    /// Item number `i`.
    #[inline]
    pub fn get(&self, i: usize) -> P::Item {
        self.0[i].unpack()
    }

    /// All of them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = P::Item> {
        self.0.iter().map(P::unpack)
    }

    /// Appends those of another, which is left empty.
    pub fn append(&mut self, other: &mut Self) {
        self.0.append(&mut other.0);
    }

    /// Removes all and keeps the memory.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Makes room for so many more, and no more.
    pub fn reserve(&mut self, count: usize) {
        self.0.reserve_exact(count);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<P>()
    }
}

impl<P: Pack> FromIterator<P::Item> for List<P> {
    fn from_iter<I: IntoIterator<Item = P::Item>>(items: I) -> Self {
        Self(items.into_iter().map(|item| P::pack(&item)).collect())
    }
}
