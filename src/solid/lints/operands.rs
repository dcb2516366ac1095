//! The operands of all `and` and `or` of a solid, as a tree, and what their signs say about one another.

use std::collections::HashMap;

use crate::diagnostic::Span;
use crate::interval::Interval;
use crate::ir::{Binary, Expr, Graph, Node, SignRule};
use crate::solid::leaves::tree::Logic;

/// Trees with more operands than this are not looked at.
const MOST_OPERANDS: usize = 4000;

/// Trees deeper than this are not looked at: they are read by recursion.
const DEEPEST: usize = 500;

/// How an operand is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// An inequality, by its number among the leaves of the solid.
    Leaf { leaf: u32, negated: bool },
    /// Both of two operands, by their numbers.
    All(usize, usize),
    /// Any of two operands.
    Any(usize, usize),
}

/// An operand. Negations stand at the leaves; `and` and `or` below a `not` have changed places.
#[derive(Debug, Clone)]
pub struct Operand {
    pub kind: Kind,
    /// Where it is written.
    pub span: Option<Span>,
    /// The operation that it belongs to, and the other operand of that; `None` for the whole solid.
    pub joined: Option<(usize, usize)>,
    /// The positive factor by which the operand is multiplied before it is joined.
    pub factor: f64,
    /// Whether it is a limit that the language has drawn around the other operand, as `.twist` does: it changes no point
    /// of that shape, but perhaps of the shape that is left when a part of it is removed.
    pub is_limit: bool,
}

/// The operands of a solid. Each comes before its own operands; the first is the whole solid.
#[derive(Debug, Clone)]
pub struct Operands {
    pub all: Vec<Operand>,
    /// The number of leaves.
    pub leaves: usize,
}

/// What is known of the sign of an operand in a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// Negative throughout.
    Outside,
    /// Positive throughout.
    Inside,
    /// A number throughout.
    Mixed,
    /// Perhaps not a number.
    Unknown,
}

impl Sign {
    pub fn of(range: Interval) -> Self {
        if range == Interval::ALL {
            Self::Unknown
        } else if range.lo > 0.0 {
            Self::Inside
        } else if range.hi < 0.0 {
            Self::Outside
        } else {
            Self::Mixed
        }
    }

    fn negated(self, yes: bool) -> Self {
        match self {
            Self::Inside if yes => Self::Outside,
            Self::Outside if yes => Self::Inside,
            same => same,
        }
    }
}

impl Operands {
    /// The operands of a formula; `None` if there are too many.
    pub fn of(graph: &Graph, root: Node) -> Option<Self> {
        let (_, nodes) = Logic::of(graph, root)?;
        let leaves = nodes.iter().enumerate().map(|(i, leaf)| (leaf.node, i as u32)).collect();
        let mut reader = Reader { graph, leaves, all: Vec::new(), joins: Vec::new() };
        reader.read(root, None, 0)?;
        Some(Self { all: reader.all, leaves: nodes.len() })
    }

    /// For each operand, whether the sign of the whole is known to be the same without it, given the signs of
    /// the leaves.
    pub fn without_effect(&self, leaves: &[Sign], removed: &[bool]) -> Vec<bool> {
        let signs = self.signs(leaves, removed);
        // whether the sign of the whole does not depend on that of this operand
        let mut free = vec![false; self.all.len()];
        let mut found = vec![false; self.all.len()];
        for (i, operand) in self.all.iter().enumerate() {
            let Some((parent, other)) = operand.joined else { continue };
            let (decided, neutral) = match self.all[parent].kind {
                Kind::All(..) => (Sign::Outside, Sign::Inside),
                Kind::Any(..) => (Sign::Inside, Sign::Outside),
                Kind::Leaf { .. } => continue, // leaves have no operands
            };
            // a limit follows from its shape, and says nothing of one that has a part less
            free[i] = free[parent] || signs[other] == decided && !self.all[other].is_limit;
            found[i] = signs[i] != Sign::Unknown && (free[i] || signs[i] == neutral);
        }
        found
    }

    /// The sign of each operand. One that is removed has the sign that changes nothing for its neighbour.
    fn signs(&self, leaves: &[Sign], removed: &[bool]) -> Vec<Sign> {
        let mut signs = vec![Sign::Unknown; self.all.len()];
        for (i, operand) in self.all.iter().enumerate().rev() {
            signs[i] = match operand.kind {
                Kind::Leaf { leaf, negated } => leaves[leaf as usize].negated(negated),
                Kind::All(a, b) => joined(signs[a], signs[b], Sign::Outside, Sign::Inside),
                Kind::Any(a, b) => joined(signs[a], signs[b], Sign::Inside, Sign::Outside),
            };
            if let (true, Some((parent, _))) = (removed[i], operand.joined) {
                let is_all = matches!(self.all[parent].kind, Kind::All(..));
                signs[i] = if is_all { Sign::Inside } else { Sign::Outside };
            }
        }
        signs
    }

    /// Whether one operand is a part of another one, or that operand itself.
    pub fn is_within(&self, mut part: usize, whole: usize) -> bool {
        while part > whole {
            let Some((parent, _)) = self.all[part].joined else { return false };
            part = parent;
        }
        part == whole
    }
}

fn joined(a: Sign, b: Sign, decided: Sign, neutral: Sign) -> Sign {
    match (a, b) {
        (Sign::Unknown, _) | (_, Sign::Unknown) => Sign::Unknown,
        (a, b) if a == decided || b == decided => decided,
        (a, b) if a == neutral => b,
        (a, b) if b == neutral => a,
        (_, _) => Sign::Mixed,
    }
}

struct Reader<'g> {
    graph: &'g Graph,
    leaves: HashMap<Node, u32>,
    all: Vec<Operand>,
    /// The place of each operand's own `and` or `or`, without factors and negations around it.
    joins: Vec<Option<Span>>,
}

impl Reader<'_> {
    /// Reads the operand at a node, and gives its number.
    fn read(&mut self, root: Node, joined: Option<(usize, usize)>, depth: usize) -> Option<usize> {
        let (mut node, mut negated, mut factor) = (root, false, 1.0);
        let rule = loop {
            match SignRule::of(self.graph, node) {
                SignRule::Not(a) => (node, negated) = (a, !negated),
                SignRule::Same(a) => {
                    factor *= self.factor(node, a);
                    node = a;
                }
                SignRule::All(a, b) | SignRule::Any(a, b) if a == b => node = a,
                rule => break rule,
            }
        };
        if depth > DEEPEST || self.all.len() >= MOST_OPERANDS {
            return None;
        }
        let number = self.all.len();
        // the `not` of `a \ b` is written nowhere: it has the place of the whole
        let whole = |span: &Span| {
            joined.is_some_and(|(at, _)| [self.all[at].span, self.joins[at]].contains(&Some(*span)))
        };
        let own = self.graph.span(node);
        let span = self.graph.span(root).filter(|span| !whole(span)).or(own);
        let leaf = self.leaves.get(&node).copied().unwrap_or(0);
        self.joins.push(own);
        self.all.push(Operand { kind: Kind::Leaf { leaf, negated }, span, joined, factor, is_limit: false });
        let (a, b, is_all) = match rule {
            SignRule::All(a, b) => (a, b, !negated),
            SignRule::Any(a, b) => (a, b, negated),
            SignRule::Not(_) | SignRule::Same(_) | SignRule::Leaf => return Some(number),
        };
        let first = self.read(a, Some((number, 0)), depth + 1)?;
        let second = self.read(b, Some((number, first)), depth + 1)?;
        self.all[first].joined = Some((number, second));
        self.mark_limit(node, [(a, first), (b, second)]);
        if negated {
            self.complement(number + 1);
        }
        self.all[number].kind = if is_all { Kind::All(first, second) } else { Kind::Any(first, second) };
        Some(number)
    }

    /// Marks that of two operands of a node which is a limit around the other: the language joins it by the least, and has
    /// it written where the node is, while the shape stands at a place of its own.
    fn mark_limit(&mut self, node: Node, parts: [(Node, usize); 2]) {
        if !matches!(self.graph.expr(node), Expr::Binary(Binary::Min, ..)) {
            return;
        }
        let is_of_node = parts.map(|(part, _)| self.graph.span(part) == self.graph.span(node));
        if let Some(limit) = parts.into_iter().zip(is_of_node).find_map(|((_, at), own)| own.then_some(at))
            && is_of_node != [true; 2]
        {
            self.all[limit].is_limit = true;
        }
    }

    /// Negates all operands from a number on.
    fn complement(&mut self, from: usize) {
        for operand in &mut self.all[from..] {
            operand.kind = match operand.kind {
                Kind::Leaf { leaf, negated } => Kind::Leaf { leaf, negated: !negated },
                Kind::All(a, b) => Kind::Any(a, b),
                Kind::Any(a, b) => Kind::All(a, b),
            };
        }
    }

    /// The factor between a product or quotient and the operand that has its sign.
    fn factor(&self, node: Node, operand: Node) -> f64 {
        match self.graph.expr(node) {
            Expr::Binary(Binary::Mul, u, v) => {
                self.graph.as_constant(if u == operand { v } else { u }).unwrap_or(1.0)
            }
            Expr::Binary(Binary::Div, _, v) => 1.0 / self.graph.as_constant(v).unwrap_or(1.0),
            // no other operation has the sign of one of its operands
            Expr::Binary(..)
            | Expr::Unary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Axis, Unary};

    /// What three-valued logic says of an operand is what trying both signs of it says.
    #[test]
    fn an_operand_has_no_effect_if_no_sign_of_it_changes_the_whole() {
        let mut g = Graph::default();
        let [x, y, z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| g.coordinate(axis));
        let both = g.binary(Binary::And, x, y);
        let not = g.unary(Unary::Neg, both);
        let root = g.binary(Binary::Or, not, z);
        let operands = Operands::of(&g, root).unwrap();
        // (not x or not y) or z
        let Kind::Any(first, last) = operands.all[0].kind else { panic!("{operands:?}") };
        let Kind::Any(not_x, not_y) = operands.all[first].kind else { panic!("{operands:?}") };
        for bits in 0..8_u32 {
            let values = [0, 1, 2].map(|i| bits >> i & 1 == 1);
            let signs = values.map(|inside| if inside { Sign::Inside } else { Sign::Outside });
            let found = operands.without_effect(&signs, &[false; 5]);
            let [x, y, z] = values;
            let whole = !x || !y || z;
            for (operand, without) in [(not_x, !y || z), (not_y, !x || z), (first, z), (last, !x || !y)] {
                assert_eq!(found[operand], whole == without, "{values:?} {operand}");
            }
        }
        // nothing is concluded past an operand that may not be a number
        let signs = [Sign::Inside, Sign::Unknown, Sign::Outside];
        let found = operands.without_effect(&signs, &[false; 5]);
        assert!(!found[not_y] && !found[first]);
    }
}
