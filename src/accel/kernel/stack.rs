//! The traversal stack.
#![allow(unsafe_code)]

use std::mem::MaybeUninit;

/// Entries kept off the heap. Trees over a million triangles rarely need sixty; coincident boxes make trees deeper.
const INLINE: usize = 96;

/// A child to visit: where the ray enters its box, whose bits order like the number since it is never negative, above
/// the child's reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(in super::super) struct Entry(u64);

impl Entry {
    #[inline(always)]
    pub fn new(near: f32, child: u32) -> Self {
        Self(u64::from(near.to_bits()) << 32 | u64::from(child))
    }

    #[inline(always)]
    pub fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    pub fn child(self) -> u32 {
        self.0 as u32
    }
}

/// A stack that moves on to the heap when it outgrows its array, so no subtree is ever lost.
pub(in super::super) struct Stack {
    /// The first `height` entries are initialised.
    entries: [MaybeUninit<Entry>; INLINE],
    /// At most [`INLINE`].
    height: usize,
    /// What lies on top of `entries`; empty unless they are full.
    overflow: Vec<Entry>,
}

impl Stack {
    #[inline(always)]
    pub fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; INLINE], height: 0, overflow: Vec::new() }
    }

    #[inline(always)]
    pub fn push(&mut self, entry: Entry) {
        if self.height < INLINE {
            self.entries[self.height].write(entry);
            self.height += 1;
        } else {
            self.push_overflow(entry);
        }
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<Entry> {
        if self.height == INLINE
            && let Some(entry) = self.pop_overflow()
        {
            return Some(entry);
        }
        self.height = self.height.checked_sub(1)?;
        // SAFETY: the entries below the old height are initialised.
        Some(unsafe { self.entries[self.height].assume_init() })
    }

    #[cold]
    fn push_overflow(&mut self, entry: Entry) {
        self.overflow.push(entry);
    }

    #[cold]
    fn pop_overflow(&mut self) -> Option<Entry> {
        self.overflow.pop()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_in_first_out_beyond_the_array() {
        let mut stack = Stack::new();
        for round in 1..4 {
            let count = INLINE as u32 * round;
            (0..count).for_each(|i| stack.push(Entry::new(i as f32, i)));
            for i in (0..count).rev() {
                let entry = stack.pop().unwrap();
                assert_eq!((entry.near(), entry.child()), (i as f32, i));
            }
            assert_eq!(stack.pop(), None);
        }
    }
}
