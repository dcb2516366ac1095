//! A solid as leaves joined by "all of" and "any of", and what is left of it in a box.
//!
//! Negations are pushed down to the leaves, positive factors dropped: the tree has the sign of ω, not its value.

use std::collections::HashMap;

use glam::DVec3;

use super::leaf::Leaves;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{Binary, Expr, Graph, Node, Unary, sign_operands};

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Logic {
    Leaf { leaf: u32, negated: bool },
    All(Vec<Logic>),
    Any(Vec<Logic>),
}

/// What a box knows of a tree.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Pruned {
    Inside,
    Outside,
    /// The part that still matters there.
    Near(Logic),
}

/// A solid whose tree has more leaves than this when shared parts are written out is not taken apart.
const MOST_LEAVES: usize = 1 << 20;

/// Trees deeper than this are not taken apart: they are walked by recursion.
const DEEPEST: usize = 1000;

impl Logic {
    /// The tree of a root with the nodes of its leaves; nothing if it is too large to be written out.
    pub fn of(graph: &Graph, root: Node) -> Option<(Self, Vec<Node>)> {
        let mut reader = Reader { graph, leaves: Vec::new(), numbers: Default::default(), written: 0 };
        let tree = reader.read(root, false, 0)?;
        Some((tree, reader.leaves))
    }

    /// Calls `visit` for each leaf, repeated ones each time.
    pub fn for_leaves(&self, visit: &mut impl FnMut(u32)) {
        match self {
            Self::Leaf { leaf, .. } => visit(*leaf),
            Self::All(parts) | Self::Any(parts) => parts.iter().for_each(|part| part.for_leaves(visit)),
        }
    }

    /// What is left of the tree where each leaf has a known range. A leaf of which nothing is known may be NaN: it
    /// stays, and nothing is concluded past it.
    fn prune(&self, range: &impl Fn(u32) -> Interval) -> Pruned {
        match self {
            Self::Leaf { leaf, negated } => {
                let range = range(*leaf);
                let range = if *negated { -range } else { range };
                if range.lo > 0.0 {
                    Pruned::Inside
                } else if range.hi < 0.0 {
                    Pruned::Outside
                } else {
                    Pruned::Near(self.clone())
                }
            }
            Self::All(parts) => join(parts, range, &Pruned::Outside, Self::All),
            Self::Any(parts) => join(parts, range, &Pruned::Inside, Self::Any),
        }
    }

    /// What is left of the tree in a box.
    pub fn prune_in(&self, leaves: &Leaves, over: &Aabb) -> Pruned {
        let mut ranges: HashMap<u32, Interval> = HashMap::new();
        self.for_leaves(&mut |leaf| {
            ranges.entry(leaf).or_insert_with(|| leaves.range(leaf, over));
        });
        self.prune(&|leaf| ranges.get(&leaf).copied().unwrap_or(Interval::ALL))
    }

    /// The smallest or largest leaf, as the tree says; NaN if any leaf is.
    pub fn value(&self, leaves: &Leaves, p: DVec3) -> f64 {
        let best = |parts: &[Self], wins: fn(f64, f64) -> bool| {
            let values = parts.iter().map(|part| part.value(leaves, p));
            values.reduce(|a, b| if b.is_nan() || wins(b, a) { b } else { a }).unwrap_or(f64::NAN)
        };
        match self {
            Self::Leaf { leaf, negated: false } => leaves.value(*leaf, p),
            Self::Leaf { leaf, negated: true } => -leaves.value(*leaf, p),
            Self::All(parts) => best(parts, |b, a| b < a),
            Self::Any(parts) => best(parts, |b, a| b > a),
        }
    }

    fn may_be_nan(&self, range: &impl Fn(u32) -> Interval) -> bool {
        let mut unknown = false;
        self.for_leaves(&mut |leaf| unknown |= range(leaf) == Interval::ALL);
        unknown
    }
}

/// Parts of "all of" that are certainly inside drop out, one that is outside decides; "any of" the other way round.
fn join(
    parts: &[Logic],
    range: &impl Fn(u32) -> Interval,
    decisive: &Pruned,
    rejoin: fn(Vec<Logic>) -> Logic,
) -> Pruned {
    let mut left = Vec::new();
    let mut decided = false;
    for part in parts {
        match part.prune(range) {
            Pruned::Near(part) => left.push(part),
            other => decided |= other == *decisive,
        }
    }
    if decided && !left.iter().any(|part| part.may_be_nan(range)) {
        return decisive.clone();
    }
    if decided {
        // only NaN can still change the answer: keep everything
        return Pruned::Near(rejoin(parts.to_vec()));
    }
    match left.len() {
        0 if *decisive == Pruned::Outside => Pruned::Inside,
        0 => Pruned::Outside,
        1 => Pruned::Near(left.remove(0)),
        _ => Pruned::Near(rejoin(left)),
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
        let operands = sign_operands(self.graph, node);
        match (self.graph.expr(node), &operands[..]) {
            (Expr::Unary(Unary::Neg, _), &[a]) => self.read(a, !negated, depth + 1),
            // min(a, a) = a: the value of a ∧ a is another, its sign is not
            (Expr::Binary(..), &[a, b]) if a == b => self.read(a, negated, depth + 1),
            (Expr::Binary(op, ..), &[a, b]) => {
                let (a, b) = (self.read(a, negated, depth + 1)?, self.read(b, negated, depth + 1)?);
                let all = matches!(op, Binary::And | Binary::Min | Binary::PlainMin) != negated;
                Some(if all { flat(a, b, true) } else { flat(a, b, false) })
            }
            // a positive factor
            (_, &[a]) => self.read(a, negated, depth + 1),
            _ => {
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

/// Joins two trees; the same operation inside becomes part of one long list.
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
