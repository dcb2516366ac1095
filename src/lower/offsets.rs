//! `.offset(d)` and `.distance()`: a shape rebuilt from the distances of its parts.
//!
//! The value of R₀ is not a distance, and grows faster than one beyond an edge. So ω of each part is moved
//! instead of ω of the whole, and the parts are joined as before: faces move by d, and edges stay sharp.

use rustc_hash::FxHashMap;

use super::distances::Square;
use super::joints::{Joint, Side};
use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::{self, Binary, Node, Unary};

/// What becomes of the parts of a shape.
#[derive(Clone, Copy)]
enum Anew {
    /// Their surfaces move outwards by this length, and their joints stay what they are.
    Offset(Node),
    /// They become distances where these are known, and the least and the greatest join them.
    Distance,
}

impl Lowering<'_> {
    /// The shape with its faces moved outwards by a length, which may depend on place and time.
    pub fn offset_shape(&mut self, shape: Node, by: &(Value, Span), span: Span) -> Option<Node> {
        let length = self.as_number(&by.0, by.1)?;
        let moved = self.made_anew(shape, Anew::Offset(length), span)?;
        if let Some(inwards) = self.known_value(length).filter(|length| *length < 0.0) {
            let within = ir::reach(&self.module.graph, shape);
            self.warn_of_nothing_left(moved, within, -inwards, span);
        }
        Some(moved)
    }

    /// The shape with the distances of its parts as field, joined by the least and the greatest.
    pub fn distance_of_shape(&mut self, shape: Node, span: Span) -> Option<Node> {
        self.made_anew(shape, Anew::Distance, span)
    }

    fn made_anew(&mut self, shape: Node, anew: Anew, span: Span) -> Option<Node> {
        let root = Side { node: shape, negated: false };
        let (order, joints) = self.skeleton(root);
        let within = ir::reach(&self.module.graph, shape);
        let mut done: FxHashMap<Side, Node> = FxHashMap::default();
        for side in order {
            if self.over_budget(span) {
                return None;
            }
            let mut joined = |op: Binary, parts: [Side; 2]| {
                let [a, b] = parts.map(|part| done[&part]);
                self.binary(op, a, b, span)
            };
            let (and, or) = match anew {
                Anew::Offset(_) => (Binary::And, Binary::Or),
                Anew::Distance => (Binary::Min, Binary::Max),
            };
            let new = match joints[&side] {
                Joint::Same(other) => done[&other],
                Joint::And(parts) => joined(and, parts),
                Joint::Or(parts) => joined(or, parts),
                Joint::Least(parts) => joined(Binary::Min, parts),
                Joint::Greatest(parts) => joined(Binary::Max, parts),
                Joint::Leaf => match anew {
                    Anew::Offset(length) => self.offset_leaf(side, length, within, span),
                    Anew::Distance => {
                        let distance = self.exact_distance(side.node, (within, 1.0), span);
                        self.signed(distance.map_or(side.node, |known| known.field), side.negated, span)
                    }
                },
            };
            done.insert(side, new);
        }
        done.get(&root).copied()
    }

    /// A formula whose surface is moved outwards: by its distance, or by g = |∇ω| to first order.
    fn offset_leaf(&mut self, side: Side, length: Node, within: Option<Aabb>, span: Span) -> Node {
        let half = self.known_value(length).map_or(1.0, |length| (4.0 * length.abs()).max(1.0));
        let (field, by, square) = match self.exact_distance(side.node, (within, half), span) {
            Some(distance) => (distance.field, length, distance.square),
            None => {
                let slope = self.slope_of_leaf(side.node, span);
                (side.node, self.binary(Binary::Mul, length, slope, span), None)
            }
        };
        let field = self.signed(field, side.negated, span);
        let moved = self.binary(Binary::Add, field, by, span);
        if let Some(square) = square.filter(|_| !side.negated) {
            let hull = self.offset_square(side.node, square, length, span);
            self.module.graph.enclose(moved, hull);
        }
        moved
    }

    /// ω + kd + cd²/2, which is positive wherever the distance within, plus d, is: ω is −kd − cd²/2 at the distance d
    /// outside. In this formula ω stands once, so that it shows where the solid ends.
    pub(super) fn offset_square(&mut self, leaf: Node, square: Square, length: Node, span: Span) -> Node {
        let [slope, half] = [square.at_surface, 0.5 * square.bend].map(|number| self.constant(number));
        let bent = self.binary(Binary::Mul, half, length, span);
        let sum = self.binary(Binary::Add, slope, bent, span);
        let level = self.binary(Binary::Mul, sum, length, span);
        self.binary(Binary::Add, leaf, level, span)
    }

    fn signed(&mut self, field: Node, negated: bool, span: Span) -> Node {
        if negated { self.unary(Unary::Neg, field, span) } else { field }
    }
}
