//! A solid as leaves joined by "all of" and "any of".
//!
//! Negations are pushed down to the leaves and positive factors dropped. The tree has the sign of ω, not its
//! value; with each leaf times its factors it has the value of the twin, up to rounding, unless a leaf occurs
//! with several factors. Where the graph knows a hull of a field, the tree has both, joined by "all of".

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
    /// The tree of a root with its leaves; `None` if it is too large to be written out.
    pub fn of(graph: &Graph, root: Node) -> Option<(Self, Vec<LeafNode>)> {
        let mut reader = Reader { graph, leaves: Vec::new(), numbers: Default::default(), written: 0 };
        let tree = reader.read(root, Above::ROOT)?;
        Some((tree, reader.leaves))
    }
}

/// A leaf of a tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafNode {
    pub node: Node,
    /// The product of the positive constant factors between the root and the leaf, where it is met first.
    pub factor: f64,
}

/// What stands above a node on the way from the root.
#[derive(Clone, Copy)]
struct Above {
    negated: bool,
    factor: f64,
    depth: usize,
}

impl Above {
    const ROOT: Self = Self { negated: false, factor: 1.0, depth: 0 };

    fn below(self) -> Self {
        Self { depth: self.depth + 1, ..self }
    }
}

struct Reader<'g> {
    graph: &'g Graph,
    leaves: Vec<LeafNode>,
    numbers: HashMap<Node, u32>,
    written: usize,
}

impl Reader<'_> {
    fn read(&mut self, node: Node, above: Above) -> Option<Logic> {
        if above.depth > DEEPEST {
            return None;
        }
        match self.graph.hull(node).filter(|_| !above.negated) {
            None => self.read_alone(node, above),
            Some(hull) => {
                let hull = self.read_alone(hull, above.below())?;
                Some(flat(hull, self.read_alone(node, above)?, true))
            }
        }
    }

    /// The tree of a field without its hull.
    fn read_alone(&mut self, node: Node, above: Above) -> Option<Logic> {
        let (below, negated) = (above.below(), above.negated);
        match SignRule::of(self.graph, node) {
            SignRule::Not(a) => self.read(a, Above { negated: !negated, ..below }),
            SignRule::Same(a) => {
                self.read(a, Above { factor: above.factor * SignRule::factor(self.graph, node), ..below })
            }
            // min(a, a) = a: the value of a ∧ a differs from a, its sign does not
            SignRule::All(a, b) | SignRule::Any(a, b) if a == b => self.read(a, below),
            rule @ (SignRule::All(a, b) | SignRule::Any(a, b)) => {
                let (a, b) = (self.read(a, below)?, self.read(b, below)?);
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
                    self.leaves.push(LeafNode { node, factor: above.factor });
                }
                Some(Logic::Leaf { leaf, negated })
            }
        }
    }
}

/// Joins two trees. Parts that are joined by the same operation become members of one list.
fn flat(a: Logic, b: Logic, all: bool) -> Logic {
    let members = |tree: Logic| match (tree, all) {
        (Logic::All(inner), true) | (Logic::Any(inner), false) => inner,
        (other, _) => vec![other],
    };
    let mut parts = members(a);
    parts.extend(members(b));
    if all { Logic::All(parts) } else { Logic::Any(parts) }
}
