//! Places where ω jumps from one sign to the other, and places where it has no value.
//!
//! A surface is found between two neighbouring numbers. If ω still differs there by as much as between the nodes of a
//! lattice, it does not pass through zero: it jumps. The operation that jumps is the first one whose value differs
//! although its operands do not.

use glam::DVec3;

use super::crossings::{ALL_HALVINGS, Crossing, FEW_NODES, Lattice, MOST_POINTS, evenly, halved};
use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::{Binary, Expr, Given, Interpreter, Node, Unary};
use crate::solid::construction::Solid;

/// What happens to ω.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Breakage {
    /// It goes from one sign to the other without passing through zero.
    Jump,
    /// It grows without bound, because a divisor is zero.
    Pole,
    /// It is not a number, or infinite.
    NoValue,
}

/// A place at which ω is not a continuous function.
#[derive(Debug, Clone, PartialEq)]
pub struct Break {
    /// What happens.
    pub what: Breakage,
    /// A point where it happens.
    pub at: DVec3,
    /// Where the operation is written that does it.
    pub span: Option<Span>,
    /// How that operation is called, such as `a division`.
    pub operation: String,
}

/// ω that differs by more than this part of what it is near by, between neighbouring numbers, jumps. Roots at zero
/// differ by 1e-5 at most.
const JUMP: f64 = 1e-2;

/// ω that grows by this factor towards a point has no bound there.
const GROWTH: f64 = 1e6;

/// Solids with more operations are not looked at.
const MOST_OPERATIONS: usize = 4000;

/// Places at which an operation is looked at more closely, at most: most tell the same.
const MOST_LOOKS: usize = 100;

/// An operation jumps if its value changes by so many times as much as its operands, between neighbouring numbers.
const SUDDEN: f64 = 1e6;

impl Solid {
    /// The operations that make ω jump across its surface, in a box.
    pub fn jumps(&self, over: &Aabb) -> Vec<Break> {
        let Some(formula) = Formula::of(self) else { return Vec::new() };
        let (crossings, _) = Lattice::of(self, over, FEW_NODES).crossings(self, MOST_POINTS, ALL_HALVINGS);
        let mut found = Vec::new();
        for Crossing { ends, scale } in crossings {
            let [a, b] = ends.map(|p| self.omega(p));
            if !scale.is_finite() || (a - b).abs() <= JUMP * scale {
                continue;
            }
            if let Some(node) = formula.that_jumps(ends) {
                let is_pole = (a - b).abs() > GROWTH * scale;
                let what = if is_pole { Breakage::Pole } else { Breakage::Jump };
                formula.add(&mut found, what, ends[0], node);
            }
        }
        found
    }

    /// The operations by which ω has no value, or no bound, where a fluid may be: in a box, outside of the solid.
    pub fn singularities(&self, over: &Aabb) -> Vec<Break> {
        let Some(formula) = Formula::of(self) else { return Vec::new() };
        let lattice = Lattice::of(self, over, FEW_NODES);
        let mut found = Vec::new();
        let without: Vec<DVec3> = (lattice.points.iter().zip(&lattice.signs))
            .filter_map(|(&p, sign)| sign.is_nan().then_some(p))
            .collect();
        for &p in evenly(&without, MOST_LOOKS) {
            if let Some(node) = formula.without_value(p) {
                formula.add(&mut found, Breakage::NoValue, p, node);
            }
        }
        let divisors = formula.divisors();
        let values = formula.values_of(&divisors, &lattice.points);
        for (&divisor, values) in divisors.iter().zip(&values) {
            self.poles(&formula, &lattice, (divisor, values), &mut found);
        }
        found
    }

    /// Looks for a zero of a divisor between nodes of which one at least is outside.
    fn poles(
        &self,
        formula: &Formula<'_>,
        lattice: &Lattice,
        ([node, divisor], values): ([Node; 2], &[f64]),
        found: &mut Vec<Break>,
    ) {
        let is_crossed = |[a, b]: &[usize; 2]| {
            values[*a] * values[*b] < 0.0 && (lattice.signs[*a] < 0.0 || lattice.signs[*b] < 0.0)
        };
        let crossed: Vec<[usize; 2]> = lattice.edges().filter(is_crossed).collect();
        for edge in evenly(&crossed, MOST_LOOKS) {
            let scale = edge.map(|i| self.omega(lattice.points[i]).abs()).into_iter().fold(0.0, f64::max);
            let ends =
                halved(edge.map(|i| lattice.points[i]), ALL_HALVINGS, |p| formula.value(divisor, p) > 0.0);
            let sizes = ends.map(|p| self.omega(p).abs());
            if sizes.iter().any(|size| size.is_nan() || *size > GROWTH * scale) {
                return formula.add(found, Breakage::Pole, ends[0], node);
            }
        }
    }
}

/// The formula of a solid, with the values of all its operations.
struct Formula<'a> {
    solid: &'a Solid,
    nodes: Vec<(Node, Expr)>,
    all: Interpreter,
}

impl<'a> Formula<'a> {
    /// The formula, if it has operations that may jump or have no value.
    fn of(solid: &'a Solid) -> Option<Self> {
        let (graph, _) = solid.formula();
        let nodes: Vec<(Node, Expr)> = graph.nodes().collect();
        let is_smooth = |expr: &Expr| match expr {
            Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_) => true,
            Expr::Lookup(..) => false,
            Expr::Unary(op, _) => matches!(op, Unary::Neg | Unary::Abs),
            Expr::Binary(Binary::Div, _, divisor) => graph.as_constant(*divisor).is_some_and(|c| c != 0.0),
            Expr::Binary(op, ..) => !matches!(op, Binary::Call(_) | Binary::MulOrZero),
        };
        if nodes.len() > MOST_OPERATIONS || nodes.iter().all(|(_, expr)| is_smooth(expr)) {
            return None;
        }
        let outputs: Vec<Node> = nodes.iter().map(|(node, _)| *node).collect();
        Some(Self { solid, all: Interpreter::new(graph, &outputs), nodes })
    }

    fn values(&self, p: DVec3) -> Vec<f64> {
        let mut out = vec![0.0; self.nodes.len()];
        let given = Given { time: self.solid.time(), ..Given::point(p.to_array()) };
        self.all.eval_given(given, &mut out);
        out
    }

    fn value(&self, node: Node, p: DVec3) -> f64 {
        self.values(p)[node.index()]
    }

    /// Values of the second node of each pair at many points.
    fn values_of(&self, pairs: &[[Node; 2]], points: &[DVec3]) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::with_capacity(points.len()); pairs.len()];
        if !pairs.is_empty() {
            for &p in points {
                let values = self.values(p);
                for (column, [_, node]) in columns.iter_mut().zip(pairs) {
                    column.push(values[node.index()]);
                }
            }
        }
        columns
    }

    /// The first operation whose values at two neighbouring points differ although those of its operands hardly do.
    fn that_jumps(&self, ends: [DVec3; 2]) -> Option<Node> {
        let [a, b] = ends.map(|p| self.values(p));
        let change = |node: Node| (a[node.index()] - b[node.index()]).abs();
        let is_sudden = |(node, expr): &&(Node, Expr)| {
            let of_operands = expr.operands().map(change).fold(0.0, f64::max);
            let size = a[node.index()].abs().max(b[node.index()].abs());
            let is_sudden = change(*node) > (SUDDEN * of_operands).max(JUMP * size);
            // 1/0 is infinite, and differs from what is beside it by ∞ or NaN
            let is_infinite = !size.is_finite() && of_operands.is_finite();
            expr.operands().next().is_some() && (is_sudden || is_infinite)
        };
        self.nodes.iter().find(is_sudden).map(|(node, _)| *node)
    }

    /// The first operation that has no value at a point, although its operands have.
    fn without_value(&self, p: DVec3) -> Option<Node> {
        let values = self.values(p);
        let is_first = |(node, expr): &&(Node, Expr)| {
            !values[node.index()].is_finite()
                && expr.operands().all(|operand| values[operand.index()].is_finite())
        };
        self.nodes.iter().find(is_first).map(|(node, _)| *node)
    }

    /// The divisions by what is no constant, each with its divisor.
    fn divisors(&self) -> Vec<[Node; 2]> {
        let (graph, _) = self.solid.formula();
        let divisor = |(node, expr): &(Node, Expr)| match expr {
            Expr::Binary(Binary::Div, _, divisor) if graph.as_constant(*divisor).is_none() => {
                Some([*node, *divisor])
            }
            _ => None,
        };
        self.nodes.iter().filter_map(divisor).collect()
    }

    /// Adds a break, unless its operation is known already.
    fn add(&self, found: &mut Vec<Break>, what: Breakage, at: DVec3, node: Node) {
        let (graph, _) = self.solid.formula();
        let span = graph.span(node);
        if found.iter().any(|known| known.span == span) {
            return;
        }
        let operation = match graph.expr(node) {
            Expr::Unary(Unary::Sign | Unary::Floor | Unary::Round, _) => "a step".into(),
            Expr::Unary(op, _) => format!("`{}`", op.name()),
            Expr::Binary(Binary::Div, ..) => "a division".into(),
            Expr::Binary(op, ..) => format!("`{}`", op.name()),
            Expr::Lookup(..) => "a table".into(),
            Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_) => {
                "a number".into()
            }
        };
        found.push(Break { what, at, span, operation });
    }
}
