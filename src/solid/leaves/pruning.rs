//! What is left of a tree of leaves in a region.

use std::ops::Range;

use super::words::{PAYLOAD, Word};
use crate::interval::Interval;

/// What a region knows of a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    Inside,
    Outside,
    /// A part still matters there.
    Near,
}

/// A tree in a region where each leaf has a known range; `left` receives the part that still matters there.
///
/// A leaf that may vanish in the region stays. One that is positive throughout drops out of "all of" and
/// decides "any of"; one that is negative throughout drops out of "any of" and decides "all of". So the tree
/// that is left has the sign of the whole at every point of the region, and the same surface. A leaf with an
/// unknown range may be NaN: it stays, and no conclusion is drawn past it.
pub fn prune(words: &[u32], range: &mut impl FnMut(u32) -> Interval, left: &mut Vec<u32>) -> Verdict {
    Pruning { words, range, left }.tree(&mut 0).0
}

/// The part of a tree that may decide its value in a region where each leaf has a known range: a tree with
/// the same value at every point of the region.
///
/// A part of "any of" that is below another one throughout drops out, and a part of "all of" that is above another one.
/// A leaf with an unknown range may be NaN, which decides: it stays.
pub fn deciding(words: &[u32], range: &mut impl FnMut(u32) -> Interval) -> Vec<u32> {
    let mut left = Vec::new();
    Pruning { words, range, left: &mut left }.value(&mut 0);
    left
}

/// What is left of one part of several.
struct Left {
    /// Its words in what is left.
    place: Range<usize>,
    range: Interval,
    may_be_nan: bool,
}

struct Pruning<'a, F> {
    words: &'a [u32],
    range: &'a mut F,
    left: &'a mut Vec<u32>,
}

impl<F: FnMut(u32) -> Interval> Pruning<'_, F> {
    /// The verdict on the tree at `at`, and whether a leaf that is left may be NaN.
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

    /// What may decide the value of the tree at `at`.
    fn value(&mut self, at: &mut usize) -> Left {
        let start = self.left.len();
        let code = self.words[*at];
        *at += 1;
        self.left.push(code);
        let (parts, all) = match Word::read(code) {
            Word::Leaf { leaf, negated } => {
                let known = (self.range)(leaf);
                let range = if negated { -known } else { known };
                return Left { place: start..start + 1, range, may_be_nan: known == Interval::ALL };
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let found: Vec<Left> = (0..parts).map(|_| self.value(at)).collect();
        let joined = |a: Interval, b: &Left| if all { a.min(b.range) } else { a.max(b.range) };
        let none = if all { f64::INFINITY } else { f64::NEG_INFINITY };
        let range = found.iter().fold(Interval { lo: none, hi: none }, joined);
        let decides = |part: &&Left| {
            let beaten = if all { part.range.lo > range.hi } else { part.range.hi < range.lo };
            part.may_be_nan || !beaten
        };
        let (mut count, mut end) = (0, start + 1);
        for part in found.iter().filter(decides) {
            self.left.copy_within(part.place.clone(), end);
            end += part.place.len();
            count += 1;
        }
        self.left.truncate(end);
        if count == 1 {
            self.left.remove(start);
        } else {
            self.left[start] = code & !PAYLOAD | count;
        }
        let may_be_nan = found.iter().any(|part| part.may_be_nan);
        Left { place: start..self.left.len(), range, may_be_nan }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::leaves::tree::Logic;
    use crate::solid::leaves::words::{encode, skip};

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
        // no conclusion is drawn past a leaf that may be NaN
        check(&tree, &[unknown, outside, near], (Near, Some(tree.clone())));
        check(&tree, &[unknown, inside, outside], (Near, Some(tree.clone())));
    }

    /// The value of a tree whose leaves have these values.
    fn value(words: &[u32], at: &mut usize, values: &[f64]) -> f64 {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                let value = values[leaf as usize];
                return if negated { -value } else { value };
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let parts = (0..parts).map(|_| value(words, at, values)).collect::<Vec<f64>>();
        parts.into_iter().reduce(|a, b| if all { a.min(b) } else { a.max(b) }).unwrap_or(f64::NAN)
    }

    #[test]
    fn what_cannot_decide_the_value_drops_out() {
        let tree = Logic::Any(vec![
            Logic::All(vec![leaf(0, false), leaf(1, true)]),
            leaf(2, false),
            Logic::All(vec![leaf(3, false), leaf(4, false), leaf(0, true)]),
        ]);
        let mut words = Vec::new();
        encode(&tree, &mut words);
        let mut random = 1_u64;
        let mut draw = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut shorter = 0;
        for _ in 0..2000 {
            let ranges: Vec<Interval> = (0..5)
                .map(|_| {
                    let (a, b) = (draw() - 0.5, draw() - 0.5);
                    Interval { lo: a.min(b), hi: a.max(b) }
                })
                .collect();
            let left = deciding(&words, &mut |leaf| ranges[leaf as usize]);
            shorter += usize::from(left.len() < words.len());
            for _ in 0..20 {
                let values: Vec<f64> = ranges.iter().map(|r| r.lo + draw() * (r.hi - r.lo)).collect();
                let (mut whole, mut part) = (0, 0);
                assert_eq!(value(&left, &mut part, &values), value(&words, &mut whole, &values));
                assert_eq!((part, whole), (left.len(), words.len()));
            }
        }
        assert!(shorter > 1000, "{shorter} of 2000 trees were made shorter");
        // a leaf that may be NaN stays, however far the others are above it
        let ranges = |leaf: u32| if leaf == 2 { Interval::ALL } else { Interval { lo: 1.0, hi: 2.0 } };
        assert!(deciding(&words, &mut { ranges }).contains(&(2 << 1)));
    }
}
