//! The ranges of leaves over one box, each found once: cells beside each other share most of their leaves.

use std::cell::Cell;

use crate::interval::Interval;

thread_local! {
    static SPARE: Cell<Option<KnownRanges>> = const { Cell::new(None) };
}

/// What is known of the leaves over one box.
#[derive(Default)]
pub struct KnownRanges {
    /// For each leaf, the box for which its range was found last, by number, and the range.
    leaves: Vec<(u32, Interval)>,
    /// The number of the present box; 0 is none.
    now: u32,
}

impl KnownRanges {
    /// Calls a function with nothing known, for a solid with this number of leaves.
    pub fn with<R>(leaves: usize, f: impl FnOnce(&mut Self) -> R) -> R {
        let mut known = SPARE.take().unwrap_or_default();
        if known.now == u32::MAX {
            known = Self::default();
        }
        known.now += 1;
        if known.leaves.len() < leaves {
            known.leaves.resize(leaves, (0, Interval::ALL));
        }
        let result = f(&mut known);
        SPARE.set(Some(known));
        result
    }

    /// The range of a leaf, by `find` if it is not known.
    #[inline]
    pub fn of(&mut self, leaf: u32, find: impl FnOnce() -> Interval) -> Interval {
        let now = self.now;
        let (number, range) = &mut self.leaves[leaf as usize];
        if *number != now {
            (*number, *range) = (now, find());
        }
        *range
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_kept_for_another_box() {
        let mut found = 0;
        for _ in 0..2 {
            KnownRanges::with(3, |known| {
                for leaf in [2, 0, 2] {
                    let range = known.of(leaf, || {
                        found += 1;
                        Interval::point(f64::from(leaf))
                    });
                    assert_eq!(range, Interval::point(f64::from(leaf)));
                }
            });
        }
        assert_eq!(found, 4);
    }
}
