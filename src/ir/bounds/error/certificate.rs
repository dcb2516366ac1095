//! Bounds of the error of a whole graph over a box, which is divided until they are tight.

use std::collections::BinaryHeap;

use super::arithmetic::{Arithmetic, Error};
use super::rules::{ErrorRules, Operand};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{RangeEvaluator, Region};
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::Binary;

/// Boxes that are looked at for one certificate, and operations in them.
const MOST_BOXES: usize = 4000;
const MOST_OPERATIONS: usize = 3_000_000;

/// A bound this much above that of some single point is tight enough.
const TIGHT: f64 = 1.25;

/// A graph prepared for certificates of one arithmetic.
pub struct ErrorAnalysis<'a> {
    graph: &'a Graph,
    root: Node,
    arithmetic: Arithmetic<'a>,
    ranges: RangeEvaluator,
    time: Interval,
}

impl<'a> ErrorAnalysis<'a> {
    /// Prepares a root for one arithmetic, at all times.
    pub fn new(graph: &'a Graph, root: Node, arithmetic: Arithmetic<'a>) -> Self {
        Self { graph, root, arithmetic, ranges: RangeEvaluator::new(graph, root), time: Interval::ALL }
    }

    /// For these times, rather than for all.
    #[must_use]
    pub fn during(self, time: Interval) -> Self {
        Self { time, ..self }
    }

    /// A bound of |computed − exact| of the root at every point of a box; ∞ where there is none. The box is
    /// divided until the bound is at most `enough`, cannot become so, or would not become much smaller.
    ///
    /// With [`Inputs::Shifted`] the box is one of shifted coordinates.
    pub fn certify(&self, over: &Aabb, enough: f64) -> f64 {
        let whole = Piece { bound: self.bound(over), over: *over };
        let mut parts = BinaryHeap::from([whole]);
        let most = MOST_BOXES.min(MOST_OPERATIONS / self.graph.len().max(1)).max(16);
        // no division of the box gives less than this
        let mut attained: f64 = 0.0;
        for _ in 0..most {
            let Some(worst) = parts.peek() else { break };
            let centre = worst.over.centre();
            attained = attained.max(self.bound(&Aabb::new(centre, centre)));
            let tight = attained > enough.max(worst.bound / TIGHT) || attained.is_infinite();
            if worst.bound <= enough || tight {
                break;
            }
            let Some(worst) = parts.pop() else { break };
            parts.extend(worst.over.halves().map(|over| Piece { bound: self.bound(&over), over }));
        }
        parts.peek().map_or(f64::INFINITY, |worst| worst.bound)
    }

    /// The bound for a box in one piece.
    pub fn bound(&self, over: &Aabb) -> f64 {
        self.errors(over)[self.root.index()].absolute
    }

    /// The errors of all nodes over a box, in the graph's order.
    pub fn errors(&self, over: &Aabb) -> Vec<Error> {
        let ranges = self.ranges.all_with(&Region { time: self.time, ..Region::of(over) });
        let mut known: Vec<Operand> = Vec::with_capacity(ranges.len());
        for ((_, expr), range) in std::iter::zip(self.graph.nodes(), ranges) {
            // the ends of R₀'s ranges are R₀ of the operands' ends, rounded
            let rounded = matches!(expr, Expr::Binary(Binary::And | Binary::Or, ..));
            let range = if rounded { range.widened(4) } else { range };
            let rules = ErrorRules { arithmetic: self.arithmetic, known: &known, range };
            let (error, not_negative) = rules.of(expr);
            known.push(Operand { error, range, not_negative });
        }
        known.into_iter().map(|operand| operand.error).collect()
    }
}

/// A part of the box, the one with the largest bound first.
struct Piece {
    bound: f64,
    over: Aabb,
}

impl Ord for Piece {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl PartialOrd for Piece {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Piece {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Piece {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::bounds::error::arithmetic::Inputs;
    use crate::ir::{Axis, Form, Forms, Unary};
    use crate::precision::Precision;
    use glam::DVec3;

    const UNIT: f64 = 0.5 * f64::EPSILON;

    fn bound(graph: &Graph, root: Node, form: Form, over: Aabb) -> f64 {
        let forms = Forms::all(form);
        let arithmetic = Arithmetic { precision: Precision::F64, forms: &forms, inputs: Inputs::Exact };
        ErrorAnalysis::new(graph, root, arithmetic).bound(&over)
    }

    #[track_caller]
    fn near(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found:e} is not {expected:e}");
    }

    fn cube(lo: f64, hi: f64) -> Aabb {
        Aabb::new(DVec3::splat(lo), DVec3::splat(hi))
    }

    #[test]
    fn sums_products_and_roots_by_hand() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let over = cube(0.0, 2.0);
        // one rounding of a sum of at most 4
        let sum = graph.binary(Binary::Add, x, y);
        near(bound(&graph, sum, Form::Stable, over), 4.0 * UNIT);
        // (1 + u)²(1 + u) − 1 of at most 16, and the underflow
        let square = graph.binary(Binary::Mul, sum, sum);
        near(bound(&graph, square, Form::Stable, over), 48.0 * UNIT);
        // for x² + y²: squares u, sum u, halved by the root, root u
        let (x2, y2) = (graph.binary(Binary::Mul, x, x), graph.binary(Binary::Mul, y, y));
        let squares = graph.binary(Binary::Add, x2, y2);
        let rho = graph.unary(Unary::Sqrt, squares);
        near(bound(&graph, rho, Form::Stable, over), 2.0 * UNIT * 8f64.sqrt());
        // the divisor may vanish
        let quotient = graph.binary(Binary::Div, y, x);
        assert_eq!(bound(&graph, quotient, Form::Stable, over), f64::INFINITY);
        near(bound(&graph, quotient, Form::Stable, cube(1.0, 2.0)), 2.0 * UNIT);
    }

    #[test]
    fn forms_of_r0_by_hand() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let and = graph.binary(Binary::And, x, y);
        // exact operands: 1 ∧ 1 … 2 ∧ 2 = 2·(2 − √2)
        let (over, value) = (cube(1.0, 2.0), 2.0 * (2.0 - 2f64.sqrt()));
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-3, "{found:e}");
        close(bound(&graph, and, Form::Stable, over), 4.0 * UNIT * value);
        close(bound(&graph, and, Form::Scaled, over), 7.0 * UNIT * value);
        let textbook = UNIT * 4.0 + 2.01 * UNIT * 8f64.sqrt() + 1.01 * UNIT * value;
        close(bound(&graph, and, Form::Textbook, over), textbook);
        // squares of 1e200 overflow, their scaled form does not
        assert_eq!(bound(&graph, and, Form::Stable, cube(1.0, 1e200)), f64::INFINITY);
        assert!(bound(&graph, and, Form::Scaled, cube(1.0, 1e200)) < 1e185);
    }

    #[test]
    fn dividing_the_box_tightens_the_bound_and_stops_where_nothing_is_known() {
        // (x ∨ y) ∧ (¬x ∨ ¬y): in no place are both operands large, but over the whole box either may be
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let [not_x, not_y] = [x, y].map(|node| graph.unary(Unary::Neg, node));
        let (either, neither) = (graph.binary(Binary::Or, x, y), graph.binary(Binary::Or, not_x, not_y));
        let root = graph.binary(Binary::And, either, neither);
        let undefined = graph.unary(Unary::Sqrt, y);
        let forms = Forms::all(Form::Stable);
        let arithmetic = Arithmetic { precision: Precision::F64, forms: &forms, inputs: Inputs::Exact };
        let analysis = ErrorAnalysis::new(&graph, root, arithmetic);
        let over = cube(-1.0, 1.0);
        let (whole, divided) = (analysis.bound(&over), analysis.certify(&over, 0.0));
        assert!(divided < 0.7 * whole && divided > UNIT, "{divided:e} {whole:e}");
        assert_eq!(analysis.certify(&over, whole), whole);
        let analysis = ErrorAnalysis::new(&graph, undefined, arithmetic);
        assert_eq!(analysis.certify(&over, 0.0), f64::INFINITY);
    }
}
