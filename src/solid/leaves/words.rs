//! A tree of leaves as a list of words in prefix form: cheap to keep many of, and to walk.
//!
//! There is a word for each node. Its upper bits are the kind; the lower ones are the number of parts, or the
//! number of the leaf and whether it is negated.

use super::tree::Logic;

const KIND_SHIFT: u32 = 30;
pub const PAYLOAD: u32 = (1 << KIND_SHIFT) - 1;
const LEAF: u32 = 0;
const ALL: u32 = 1;
const ANY: u32 = 2;

/// A word, read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    Leaf {
        leaf: u32,
        negated: bool,
    },
    /// The minimum of the given number of trees, which follow.
    All(u32),
    /// The maximum of the given number of trees, which follow.
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
pub fn encode(logic: &Logic, out: &mut Vec<u32>) {
    let (kind, parts) = match logic {
        Logic::Leaf { leaf, negated } => return out.push(leaf << 1 | u32::from(*negated)),
        Logic::All(parts) => (ALL, parts),
        Logic::Any(parts) => (ANY, parts),
    };
    out.push(kind << KIND_SHIFT | parts.len() as u32);
    parts.iter().for_each(|part| encode(part, out));
}

/// The tree of the complement: leaves change their signs, "all of" and "any of" their places.
pub fn opposite(words: &[u32]) -> Vec<u32> {
    let other = |&word: &u32| match Word::read(word) {
        Word::Leaf { .. } => word ^ 1,
        Word::All(parts) => ANY << KIND_SHIFT | parts,
        Word::Any(parts) => ALL << KIND_SHIFT | parts,
    };
    words.iter().map(other).collect()
}

/// Moves past the tree that begins at `at`.
pub fn skip(words: &[u32], at: &mut usize) {
    let mut open = 1;
    while open > 0 {
        open -= 1;
        if let Word::All(parts) | Word::Any(parts) = Word::read(words[*at]) {
            open += parts;
        }
        *at += 1;
    }
}

/// Whether a tree is surely negative. `leaf` decides that for a leaf, given its number and whether it is
/// negated. `None` as soon as it knows nothing about a leaf, which may then be NaN.
pub fn is_negative(
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

/// Leaves of a list of trees.
pub fn leaf_count(words: &[u32]) -> usize {
    words.iter().filter(|&&word| word >> KIND_SHIFT == LEAF).count()
}
