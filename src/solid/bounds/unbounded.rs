//! Which operand of a solid has no box, and to which sides.

use super::extent::Bounds;
use super::search::Side;
use crate::diagnostic::Span;
use crate::ir::{Graph, Node, SignRule};
use crate::solid::construction::Solid;
use crate::solid::engine::Engine;

/// Why a solid has no bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Unbounded {
    /// The part of the formula that was not found to end: a member of a union, or the whole.
    pub operand: Option<Span>,
    /// Whether that is the whole solid.
    pub is_whole: bool,
    /// The sides to which no end was found, such as `+x`.
    pub sides: Vec<&'static str>,
}

impl Unbounded {
    /// The sides in words, such as `towards -z and +z`.
    pub fn direction(&self) -> String {
        match self.sides.as_slice() {
            [] => "anywhere".into(),
            [_, _, _, _, _, _] => "towards any side".into(),
            [one] => format!("towards {one}"),
            [first @ .., last] => format!("towards {} and {last}", first.join(", ")),
        }
    }
}

/// Operands looked at: each is a search of its own.
const MOST_LOOKS: usize = 200;

impl Solid {
    /// Why the solid has no bounds; `None` if it has.
    pub fn unbounded(&self) -> Option<Unbounded> {
        if *self.bounds() != Bounds::Unbounded {
            return None;
        }
        let (graph, root) = self.formula();
        let operand = self.unbounded_operand(graph, root);
        let part = if operand == root { None } else { self.operand(graph, operand) };
        let open = part.as_ref().unwrap_or(self).open_sides();
        let sides = open.iter().map(|&Side { axis, upper }| {
            [["-x", "+x"], ["-y", "+y"], ["-z", "+z"]][axis][usize::from(upper)]
        });
        Some(Unbounded { operand: graph.span(operand), is_whole: operand == root, sides: sides.collect() })
    }

    /// The part of a formula as a solid, at the same time.
    fn operand(&self, graph: &Graph, node: Node) -> Option<Self> {
        let part = Self::new("operand", graph, node, Engine::Interpreter).ok()?;
        Some(part.between(self.moment.from, self.moment.to))
    }

    /// The first member of a union that is not bounded, and of its members, and so on.
    fn unbounded_operand(&self, graph: &Graph, root: Node) -> Node {
        let (mut node, mut looks) = (root, MOST_LOOKS);
        loop {
            let (a, b) = match SignRule::of(graph, node) {
                SignRule::Same(a) => {
                    node = a;
                    continue;
                }
                SignRule::Any(a, b) => (a, b),
                SignRule::All(..) | SignRule::Not(_) | SignRule::Leaf => return node,
            };
            let mut is_open = |node: Node| {
                looks = usize::saturating_sub(looks, 1);
                looks > 0 && self.operand(graph, node).is_some_and(|part| *part.bounds() == Bounds::Unbounded)
            };
            node = if is_open(a) {
                a
            } else if is_open(b) {
                b
            } else {
                return node;
            };
        }
    }
}
