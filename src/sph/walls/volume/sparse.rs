//! A three-dimensional array whose entries are made on demand.
//!
//! It is a tree with three levels of 16³ branches. An entry is made by the first thread that asks for it; others that
//! ask meanwhile wait. What is made depends on its place alone, so the order does not matter.

use std::sync::OnceLock;

/// Bits of an index that one level takes.
const BITS: usize = 4;

/// Entries of a level.
const ENTRIES: usize = 1 << (3 * BITS);

/// Most branches at the root.
const MOST_ROOTS: usize = 1 << 22;

type Level<T> = OnceLock<Box<[OnceLock<T>]>>;

/// Entries of type `T`, by three indices.
pub(super) struct Sparse<T> {
    roots: Vec<OnceLock<Box<[Level<T>]>>>,
    /// Branches at the root along each axis.
    counts: [usize; 3],
}

impl<T> Sparse<T> {
    /// An array with indices up to `size` (exclusive); `None` if it is too large to have a tree.
    pub fn new(size: [usize; 3]) -> Option<Self> {
        let counts = size.map(|n| (n >> (2 * BITS)) + 1);
        let [x, y, z] = counts;
        let roots = x.checked_mul(y)?.checked_mul(z).filter(|&roots| roots <= MOST_ROOTS)?;
        Some(Self { roots: empty(roots).into_vec(), counts })
    }

    /// The entry with these indices, which is made at the first request.
    #[inline]
    pub fn get(&self, at: [usize; 3], make: impl FnOnce() -> T) -> &T {
        let [i, j, k] = at.map(|n| n >> (2 * BITS));
        let root = &self.roots[i + self.counts[0] * (j + self.counts[1] * k)];
        let branch = &root.get_or_init(|| empty(ENTRIES))[entry(at.map(|n| n >> BITS))];
        branch.get_or_init(|| empty(ENTRIES))[entry(at)].get_or_init(make)
    }
}

/// Where an entry lies in its level.
fn entry([i, j, k]: [usize; 3]) -> usize {
    const MASK: usize = (1 << BITS) - 1;
    (i & MASK) | (j & MASK) << BITS | (k & MASK) << (2 * BITS)
}

fn empty<T>(count: usize) -> Box<[OnceLock<T>]> {
    (0..count).map(|_| OnceLock::new()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_made_once_and_found_again() {
        let array = Sparse::new([700, 3, 20]).unwrap();
        let places = [[0, 0, 0], [15, 2, 19], [16, 2, 19], [699, 0, 0], [255, 1, 7], [256, 1, 7]];
        for (n, place) in places.into_iter().enumerate() {
            assert_eq!(*array.get(place, || n), n);
        }
        for (n, place) in places.into_iter().enumerate() {
            assert_eq!(*array.get(place, || unreachable!("{place:?} is known")), n);
        }
        assert!(Sparse::<u8>::new([usize::MAX / 2, 1 << 30, 1 << 30]).is_none());
    }
}
