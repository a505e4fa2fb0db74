//! Light arrivals that no camera path has to do with: they are sampled in vain, and nothing more is spent on them.
//!
//! A photon counts where camera paths arrive. Its weight asks which photons leave the cluster that it came from, so
//! all of that cluster's count, too. Sets of clusters are Bloom filters: what is wrongly taken for a member costs a
//! little time and changes nothing.

use super::layout::Numbered;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Key of arrivals that do not count; those of clusters are hashes, and never it but by a chance of 2^-64.
pub const UNSEEN: u64 = u64::MAX;
/// Bits for each key.
const BITS: usize = 16;

/// A set of clusters' keys.
struct KeySet(Vec<AtomicU64>);

impl KeySet {
    /// An empty set, for about so many keys.
    fn new(keys: usize) -> Self {
        let words = (keys * BITS / 64).next_power_of_two();
        Self((0..words).map(|_| AtomicU64::new(0)).collect())
    }

    /// The bits of a key, each by the index of its word and as a mask. Keys are hashes already.
    fn bits(&self, key: u64) -> [(usize, u64); 2] {
        [key, key.rotate_right(32)].map(|k| ((k >> 6) as usize & (self.0.len() - 1), 1 << (k & 63)))
    }

    fn insert(&self, key: u64) {
        self.bits(key).into_iter().for_each(|(word, mask)| {
            self.0[word].fetch_or(mask, Relaxed);
        });
    }

    fn has(&self, key: u64) -> bool {
        self.bits(key).into_iter().all(|(word, mask)| self.0[word].load(Relaxed) & mask != 0)
    }
}

/// Replaces the keys of light arrivals that do not count by [`UNSEEN`]. `keys`: those of all arrivals, by number.
pub fn sort_out(keys: &mut [(u64, u32)], all: Numbered) {
    let (camera, light) = keys.split_at_mut(all.camera.len());
    let seen = KeySet::new(camera.len());
    camera.par_iter().for_each(|&(key, _)| seen.insert(key));
    let left = KeySet::new(light.len());
    light.par_windows(2).enumerate().for_each(|(j, pair)| {
        // the next of the store, if the path has one
        if all.light.get(j).goes_on && seen.has(pair[1].0) {
            left.insert(pair[0].0);
        }
    });
    light
        .par_iter_mut()
        .filter(|(key, _)| !seen.has(*key) && !left.has(*key))
        .for_each(|(key, _)| *key = UNSEEN);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sampler::hash;

    #[test]
    fn sets_keep_what_is_put_in_and_little_else() {
        let key = |k: u32| u64::from(hash(1, k)) << 32 | u64::from(hash(2, k));
        let set = KeySet::new(1000);
        (0..1000).for_each(|k| set.insert(key(k)));
        assert!((0..1000).all(|k| set.has(key(k))));
        let wrong = (1000..101_000).filter(|&k| set.has(key(k))).count();
        println!("{wrong} of 100,000 taken for members");
        assert!(wrong < 3000);
        assert!(!KeySet::new(0).has(7));
    }
}
