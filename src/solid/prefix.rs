//! A tree of leaves as a list of words in prefix form: cheap to keep many of, and to walk.
//!
//! A word for each node: its kind above, below it the number of parts, or the number of the leaf and whether it is
//! negated.

use super::logic::Logic;

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
