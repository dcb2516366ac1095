//! A tree of leaves as a list of words in prefix form: cheap to keep many of, and to walk.
//!
//! A word for each node: its kind above, below it the number of parts, or the number of the leaf and whether it is
//! negated.

use super::logic::Logic;
use crate::interval::Interval;

const KIND_SHIFT: u32 = 30;
const PAYLOAD: u32 = (1 << KIND_SHIFT) - 1;
const LEAF: u32 = 0;
const ALL: u32 = 1;
const ANY: u32 = 2;

/// A word, read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    Leaf {
        leaf: u32,
        negated: bool,
    },
    /// So many trees follow, of which the smallest decides.
    All(u32),
    /// … of which the largest decides.
    Any(u32),
}

impl Word {
    #[inline]
    pub fn read(word: u32) -> Self {
        let payload = word & PAYLOAD;
        match word >> KIND_SHIFT {
            LEAF => Self::Leaf { leaf: payload >> 1, negated: word & 1 == 1 },
            ALL => Self::All(payload),
            _ => Self::Any(payload),
        }
    }
}

/// Appends a tree.
pub(super) fn encode(logic: &Logic, out: &mut Vec<u32>) {
    let (kind, parts) = match logic {
        Logic::Leaf { leaf, negated } => return out.push(leaf << 1 | u32::from(*negated)),
        Logic::All(parts) => (ALL, parts),
        Logic::Any(parts) => (ANY, parts),
    };
    out.push(kind << KIND_SHIFT | parts.len() as u32);
    parts.iter().for_each(|part| encode(part, out));
}

/// Moves past the tree that begins at `at`.
pub(super) fn skip(words: &[u32], at: &mut usize) {
    let mut open = 1;
    while open > 0 {
        open -= 1;
        if let Word::All(parts) | Word::Any(parts) = Word::read(words[*at]) {
            open += parts;
        }
        *at += 1;
    }
}

/// Whether a tree is surely negative, of whose leaves a function knows it, given their number and whether they are negated;
/// nothing as soon
/// as nothing is known of a leaf, which may be NaN then.
pub(super) fn is_negative(
    words: &[u32],
    at: &mut usize,
    leaf: &mut impl FnMut(u32, bool) -> Option<bool>,
) -> Option<bool> {
    let word = Word::read(words[*at]);
    *at += 1;
    let (parts, all) = match word {
        Word::Leaf { leaf: number, negated } => return leaf(number, negated),
        Word::All(parts) => (parts, true),
        Word::Any(parts) => (parts, false),
    };
    let mut negative = !all;
    for _ in 0..parts {
        let part = is_negative(words, at, leaf)?;
        negative = if all { negative || part } else { negative && part };
    }
    Some(negative)
}

/// What a region knows of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    Inside,
    Outside,
    /// A part still matters there.
    Near,
}

/// A tree in a region where each leaf has a known range; `left` receives the part that still matters there.
///
/// A leaf that may vanish in the region stays. One that is positive throughout drops out of "all of" and decides "any
/// of"; one that is negative throughout the other way round: the tree that is left has the sign of the whole at every
/// point of the region, and so the same surface. A leaf of which nothing is known may be NaN: it stays, and nothing is
/// concluded past it.
pub(super) fn prune(words: &[u32], range: &mut impl FnMut(u32) -> Interval, left: &mut Vec<u32>) -> Verdict {
    Pruning { words, range, left }.tree(&mut 0).0
}

struct Pruning<'a, F> {
    words: &'a [u32],
    range: &'a mut F,
    left: &'a mut Vec<u32>,
}

impl<F: FnMut(u32) -> Interval> Pruning<'_, F> {
    /// Also whether a leaf that is left may be NaN.
    fn tree(&mut self, at: &mut usize) -> (Verdict, bool) {
        let begin = *at;
        let code = self.words[begin];
        *at += 1;
        // the verdict on a part that settles the whole
        let (parts, decisive, neutral) = match Word::read(code) {
            Word::Leaf { leaf, negated } => {
                let range = (self.range)(leaf);
                let (lo, hi) = if negated { (-range.hi, -range.lo) } else { (range.lo, range.hi) };
                if lo > 0.0 {
                    return (Verdict::Inside, false);
                } else if hi < 0.0 {
                    return (Verdict::Outside, false);
                }
                self.left.push(code);
                return (Verdict::Near, range == Interval::ALL);
            }
            Word::All(parts) => (parts, Verdict::Outside, Verdict::Inside),
            Word::Any(parts) => (parts, Verdict::Inside, Verdict::Outside),
        };
        let start = self.left.len();
        self.left.push(code);
        let (mut count, mut decided, mut unknown) = (0, false, false);
        for _ in 0..parts {
            match self.tree(at) {
                (Verdict::Near, may_be_nan) => {
                    count += 1;
                    unknown |= may_be_nan;
                }
                (verdict, _) => decided |= verdict == decisive,
            }
        }
        match (decided, unknown, count) {
            (true, false, _) => {
                self.left.truncate(start);
                (decisive, false)
            }
            (true, true, _) => {
                // only NaN can still change the answer: keep everything
                self.left.truncate(start);
                self.left.extend_from_slice(&self.words[begin..*at]);
                (Verdict::Near, true)
            }
            (false, _, 0) => {
                self.left.truncate(start);
                (neutral, false)
            }
            (false, _, 1) => {
                self.left.remove(start);
                (Verdict::Near, unknown)
            }
            (false, _, _) => {
                self.left[start] = code & !PAYLOAD | count;
                (Verdict::Near, unknown)
            }
        }
    }
}

/// Leaves of a list of trees.
pub(super) fn leaf_count(words: &[u32]) -> usize {
    words.iter().filter(|&&word| word >> KIND_SHIFT == LEAF).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(leaf: u32, negated: bool) -> Logic {
        Logic::Leaf { leaf, negated }
    }

    #[track_caller]
    fn check(tree: &Logic, ranges: &[(f64, f64)], expected: (Verdict, Option<Logic>)) {
        let (mut words, mut left, mut wanted) = (Vec::new(), Vec::new(), Vec::new());
        encode(tree, &mut words);
        let mut end = 0;
        skip(&words, &mut end);
        assert_eq!(end, words.len());
        let range = |leaf: u32| Interval { lo: ranges[leaf as usize].0, hi: ranges[leaf as usize].1 };
        let verdict = prune(&words, &mut { range }, &mut left);
        if let Some(tree) = &expected.1 {
            encode(tree, &mut wanted);
        }
        assert_eq!((verdict, left), (expected.0, wanted));
    }

    #[test]
    fn what_is_decided_drops_out() {
        use Verdict::{Inside, Near, Outside};
        let (inside, outside, near) = ((1.0, 2.0), (-2.0, -1.0), (-1.0, 1.0));
        let unknown = (f64::NEG_INFINITY, f64::INFINITY);
        // (0 and 1) or not 2
        let both = Logic::All(vec![leaf(0, false), leaf(1, false)]);
        let tree = Logic::Any(vec![both.clone(), leaf(2, true)]);
        check(&tree, &[inside, inside, near], (Inside, None));
        check(&tree, &[outside, near, inside], (Outside, None));
        check(&tree, &[inside, near, inside], (Near, Some(leaf(1, false))));
        check(&tree, &[near, near, inside], (Near, Some(both)));
        check(&tree, &[near, near, near], (Near, Some(tree.clone())));
        check(&tree, &[outside, near, near], (Near, Some(leaf(2, true))));
        // a surface through the end of a range stays
        check(&tree, &[(0.0, 1.0), inside, inside], (Near, Some(leaf(0, false))));
        // nothing is concluded past a leaf that may be NaN
        check(&tree, &[unknown, outside, near], (Near, Some(tree.clone())));
        check(&tree, &[unknown, inside, outside], (Near, Some(tree.clone())));
    }
}
