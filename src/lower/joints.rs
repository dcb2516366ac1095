//! The joints of a shape: how its parts are put together, down to single formulas.

use rustc_hash::FxHashMap;

use super::lowering::Lowering;
use crate::ir::{Binary, Expr, Node, Unary};

/// A node, or what it is outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Side {
    pub node: Node,
    pub negated: bool,
}

/// What a part of the shape is made of.
pub(super) enum Joint {
    /// Another node holds the same points.
    Same(Side),
    /// R₀ operations.
    And([Side; 2]),
    Or([Side; 2]),
    /// The least and the greatest, which stay as they are.
    Least([Side; 2]),
    Greatest([Side; 2]),
    /// No joint: a formula.
    Leaf,
}

impl Lowering<'_> {
    /// The joints below a root, and an order in which parts come before what they are joined to.
    pub(super) fn skeleton(&self, root: Side) -> (Vec<Side>, FxHashMap<Side, Joint>) {
        let mut joints = FxHashMap::default();
        let mut waiting = vec![root];
        while let Some(side) = waiting.pop() {
            if joints.contains_key(&side) {
                continue;
            }
            let joint = self.joint(side);
            match &joint {
                Joint::Same(part) => waiting.push(*part),
                Joint::And(parts) | Joint::Or(parts) | Joint::Least(parts) | Joint::Greatest(parts) => {
                    waiting.extend(parts);
                }
                Joint::Leaf => {}
            }
            joints.insert(side, joint);
        }
        // operands have lower numbers than what uses them
        let mut order: Vec<Side> = joints.keys().copied().collect();
        order.sort_by_key(|side| (side.node, side.negated));
        (order, joints)
    }

    /// How a part is joined. A positive factor moves no surface, so it is left out; *not* turns *and* into *or*.
    fn joint(&self, Side { node, negated }: Side) -> Joint {
        let graph = &self.module.graph;
        let side = |node: Node, turned: bool| Side { node, negated: negated != turned };
        let both = |a: Node, b: Node| [side(a, false), side(b, false)];
        let factor = |node: Node| graph.as_constant(node).filter(|factor| factor.is_normal());
        match graph.expr(node) {
            Expr::Unary(Unary::Neg, a) => Joint::Same(side(a, true)),
            Expr::Binary(Binary::Mul, a, b) => match (factor(a), factor(b)) {
                (Some(factor), _) => Joint::Same(side(b, factor < 0.0)),
                (None, Some(factor)) => Joint::Same(side(a, factor < 0.0)),
                (None, None) => Joint::Leaf,
            },
            Expr::Binary(Binary::Div, a, b) => match factor(b) {
                Some(factor) => Joint::Same(side(a, factor < 0.0)),
                None => Joint::Leaf,
            },
            Expr::Binary(Binary::And, a, b) if negated => Joint::Or(both(a, b)),
            Expr::Binary(Binary::And, a, b) => Joint::And(both(a, b)),
            Expr::Binary(Binary::Or, a, b) if negated => Joint::And(both(a, b)),
            Expr::Binary(Binary::Or, a, b) => Joint::Or(both(a, b)),
            Expr::Binary(Binary::Min, a, b) if negated => Joint::Greatest(both(a, b)),
            Expr::Binary(Binary::Min, a, b) => Joint::Least(both(a, b)),
            Expr::Binary(Binary::Max, a, b) if negated => Joint::Least(both(a, b)),
            Expr::Binary(Binary::Max, a, b) => Joint::Greatest(both(a, b)),
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Lookup(..) => Joint::Leaf,
        }
    }
}
