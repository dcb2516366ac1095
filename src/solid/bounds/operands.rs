//! Bounds from the operands of a solid, each in coordinates of its own.
//!
//! Each member of a union has a box if the union has one, and one member of an intersection is enough. A member that has
//! none may have one in the coordinates of its linear forms, see `ir::framed`: a plate that is bent and then turned. It is
//! the box around the turned box, which further search makes smaller.

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::extent::Bounds;
use super::search::EVERYWHERE;
use super::whole::at_its_time;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{
    Axis, Contractor, Expr, Framed, Graph, LinearForm, Node, Region, SignRule, Unary, contract_linear, framed,
};
use crate::solid::construction::Solid;
use crate::solid::engine::Engine;

/// Operands looked at: each is a search of its own.
const MOST_LOOKS: usize = 100;

/// Relative size by which a box in other coordinates is made larger, for the rounding of the forms.
const SLACK: f64 = 1e-9;

/// A longer box has no end.
const ENDLESS: f64 = 1e60;

impl Solid {
    /// A box around the solid from its operands; `None` if none was found.
    pub(super) fn box_of_operands(&self) -> Option<Aabb> {
        let (graph, root) = at_its_time(self);
        let mut operands = Operands {
            solid: self,
            graph: graph.into_owned(),
            looks: MOST_LOOKS,
            root,
            known: FxHashMap::default(),
        };
        operands.around(root, false)
    }

    /// A formula as a solid at the same time.
    fn of_formula(&self, graph: &Graph, root: Node) -> Option<Self> {
        let part = Self::new("operand", graph, root, Engine::Interpreter).ok()?;
        Some(part.between(self.moment.from, self.moment.to))
    }
}

struct Operands<'a> {
    solid: &'a Solid,
    graph: Graph,
    /// What was searched already.
    root: Node,
    looks: usize,
    /// What was found of nodes, negated or not.
    known: FxHashMap<(Node, bool), Option<Aabb>>,
}

impl Operands<'_> {
    /// A box around the points where a node is positive, or negative.
    fn around(&mut self, node: Node, negated: bool) -> Option<Aabb> {
        if let Some(&known) = self.known.get(&(node, negated)) {
            return known;
        }
        let found = match (SignRule::of(&self.graph, node), negated) {
            (SignRule::Same(u), _) => self.around(u, negated),
            (SignRule::Not(u), _) => self.around(u, !negated),
            (SignRule::All(u, v), false) | (SignRule::Any(u, v), true) => self
                .alone(node, negated)
                .or_else(|| self.around(u, negated))
                .or_else(|| self.around(v, negated)),
            (SignRule::All(u, v), true) | (SignRule::Any(u, v), false) => {
                let (first, second) = (self.around(u, negated)?, self.around(v, negated)?);
                // the union with an empty box must not be made of its corners
                Some(if first.is_empty() {
                    second
                } else if second.is_empty() {
                    first
                } else {
                    first.union(&second)
                })
            }
            (SignRule::Leaf, _) => self.alone(node, negated),
        };
        self.known.insert((node, negated), found);
        found
    }

    /// The box of a node from a search of its own, in the coordinates of space or in those of its forms.
    fn alone(&mut self, node: Node, negated: bool) -> Option<Aabb> {
        self.looks = self.looks.checked_sub(1)?;
        let is_whole = node == self.root && !negated;
        let root = if negated { self.graph.unary(Unary::Neg, node) } else { node };
        let (graph, root) = self.graph.extract_cone(root);
        let part = self.solid.of_formula(&graph, root)?;
        if is_whole {
            return self.in_frame(&graph, root);
        }
        match part.found_within(EVERYWHERE).bounds {
            Bounds::Empty => Some(Aabb::EMPTY),
            Bounds::Within(hull) => Some(hull),
            Bounds::Unbounded => part.box_far_out().or_else(|| self.in_frame(&graph, root)),
        }
    }

    /// The box from a search in the coordinates of the forms.
    fn in_frame(&self, graph: &Graph, root: Node) -> Option<Aabb> {
        let Framed { graph: inner, root: inner_root, forms } = framed(graph, root)?;
        let part = self.solid.of_formula(&inner, inner_root)?;
        let within = match *part.bounds() {
            Bounds::Empty => return Some(Aabb::EMPTY),
            Bounds::Within(hull) => hull.grown(SLACK * hull.size().max_element()),
            Bounds::Unbounded => return None,
        };
        let time = self.solid.moment.interval();
        let (mut space, mut known) = (EVERYWHERE, Vec::new());
        for (axis, &form) in forms.iter().enumerate() {
            if let Some(own) =
                Axis::SPACE.into_iter().position(|axis| graph.expr(form) == Expr::Coordinate(axis))
            {
                (space.min[own], space.max[own]) = (within.min[axis], within.max[axis]);
                continue;
            }
            let (graph, form) = graph.extract_cone(form);
            let contractor = Contractor::new(&graph, form);
            let origin = Aabb::new(DVec3::ZERO, DVec3::ZERO);
            let slopes = contractor.slopes(&Region { time, ..Region::of(&EVERYWHERE) })?;
            let offset = contractor.values(&Region { time, ..Region::of(&origin) })?;
            let range = Interval { lo: within.min[axis], hi: within.max[axis] } - offset;
            known.push(LinearForm::new(slopes, range, offset.lo.abs().max(offset.hi.abs())));
        }
        if !contract_linear(&known, &mut space) {
            return Some(Aabb::EMPTY);
        }
        (space.size().max_element() < ENDLESS).then_some(space)
    }
}
