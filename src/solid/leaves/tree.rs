//! A solid as leaves joined by "all of" and "any of".
//!
//! Negations are pushed down to the leaves and positive factors dropped. The tree has the sign of ω, not its
//! value.

use std::collections::HashMap;

use crate::ir::{Graph, Node, SignRule};

#[derive(Debug, Clone, PartialEq)]
pub enum Logic {
    Leaf { leaf: u32, negated: bool },
    All(Vec<Logic>),
    Any(Vec<Logic>),
}

/// A solid whose tree has more leaves than this when shared parts are written out is not taken apart.
const MOST_LEAVES: usize = 1 << 20;

/// Trees deeper than this are not taken apart: they are walked by recursion.
const DEEPEST: usize = 1000;

impl Logic {
    /// The tree of a root with the nodes of its leaves; `None` if it is too large to be written out.
    pub fn of(graph: &Graph, root: Node) -> Option<(Self, Vec<Node>)> {
        let mut reader = Reader { graph, leaves: Vec::new(), numbers: Default::default(), written: 0 };
        let tree = reader.read(root, false, 0)?;
        Some((tree, reader.leaves))
    }
}

struct Reader<'g> {
    graph: &'g Graph,
    leaves: Vec<Node>,
    numbers: HashMap<Node, u32>,
    written: usize,
}

impl Reader<'_> {
    fn read(&mut self, node: Node, negated: bool, depth: usize) -> Option<Logic> {
        if depth > DEEPEST {
            return None;
        }
        match SignRule::of(self.graph, node) {
            SignRule::Not(a) => self.read(a, !negated, depth + 1),
            SignRule::Same(a) => self.read(a, negated, depth + 1),
            // min(a, a) = a: the value of a ∧ a differs from a, its sign does not
            SignRule::All(a, b) | SignRule::Any(a, b) if a == b => self.read(a, negated, depth + 1),
            rule @ (SignRule::All(a, b) | SignRule::Any(a, b)) => {
                let (a, b) = (self.read(a, negated, depth + 1)?, self.read(b, negated, depth + 1)?);
                Some(flat(a, b, matches!(rule, SignRule::All(..)) != negated))
            }
            SignRule::Leaf => {
                self.written += 1;
                if self.written > MOST_LEAVES {
                    return None;
                }
                let next = self.leaves.len() as u32;
                let leaf = *self.numbers.entry(node).or_insert(next);
                if leaf == next {
                    self.leaves.push(node);
                }
                Some(Logic::Leaf { leaf, negated })
            }
        }
    }
}

/// Joins two trees. Parts that are joined by the same operation become members of one list.
fn flat(a: Logic, b: Logic, all: bool) -> Logic {
    let mut parts = Vec::new();
    for part in [a, b] {
        match (part, all) {
            (Logic::All(inner), true) | (Logic::Any(inner), false) => parts.extend(inner),
            (other, _) => parts.push(other),
        }
    }
    if all { Logic::All(parts) } else { Logic::Any(parts) }
}
