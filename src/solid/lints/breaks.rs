//! Places where ω jumps from one sign to the other, and places where it has no value.
//!
//! A surface is found between two neighbouring numbers. If ω still differs there by as much as between the nodes of a
//! lattice, it does not pass through zero: it jumps. The operation that jumps is the first one whose value differs
//! although its operands do not. Operations that a choice leaves out at that place are not looked at.

use std::collections::HashMap;

use glam::DVec3;

use super::crossings::{ALL_HALVINGS, Crossing, FEW_NODES, Lattice, MOST_POINTS, evenly, halved};
use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::{Binary, Expr, Given, Graph, Interpreter, Node, Unary};
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

/// ω jumps if between neighbouring numbers it differs by more than this part of its size nearby. Roots at
/// zero differ by 1e-5 at most.
const JUMP: f64 = 1e-2;

/// ω that grows by this factor towards a point has no bound there.
const GROWTH: f64 = 1e6;

/// Solids with more operations are not looked at.
const MOST_OPERATIONS: usize = 4000;

/// Maximum number of places at which an operation is looked at more closely. Most of them show the same.
const MOST_LOOKS: usize = 100;

/// Maximum number of operations that are carried out in search of zeros of all divisors together: less than
/// half a second.
const POLE_OPERATIONS: usize = 100_000_000;

/// Maximum number of evaluations of the whole formula at one such zero.
const EVALUATIONS_OF_LOOK: usize = 10;

/// An operation jumps if between neighbouring numbers its value changes by more than this factor times the
/// change of its operands.
const SUDDEN: f64 = 1e6;

impl Solid {
    /// Whether ω may jump because its formula chooses between values, as `if`, `where` and `step` do. The whole
    /// numbers of `floor` and `mod`, of which copies are made, are not meant.
    pub fn may_choose(&self) -> bool {
        let (graph, node) = self.formula();
        let (cone, _) = graph.extract_cone(node);
        cone.exprs().iter().any(|expr| match expr {
            Expr::Unary(op, _) => *op == Unary::Sign,
            Expr::Binary(op, ..) => *op == Binary::MulOrZero,
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => false,
        })
    }

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
        self.poles(&formula, &lattice, &mut found);
        found
    }

    /// Whether an operation of the formula leaves the range of numbers at a point, and not because a divisor or the
    /// argument of a logarithm is zero there.
    pub fn overflows_at(&self, p: DVec3) -> bool {
        let (graph, _) = self.formula();
        let nodes: Vec<(Node, Expr)> = graph.nodes().collect();
        let outputs: Vec<Node> = nodes.iter().map(|(node, _)| *node).collect();
        let mut values = vec![0.0; nodes.len()];
        let given = Given { time: self.time(), ..Given::point(p.to_array()) };
        Interpreter::new(graph, &outputs).eval_given(given, &mut values);
        let is_plain = |operand: Node| values[operand.index()].is_finite() && values[operand.index()] != 0.0;
        nodes.iter().any(|(node, expr)| {
            let mut operands = expr.operands().peekable();
            let overflows = operands.peek().is_some() && operands.all(is_plain);
            overflows && values[node.index()].is_infinite()
        })
    }

    /// Looks for zeros of divisors between nodes of which one at least is outside. All divisors share a budget.
    fn poles(&self, formula: &Formula<'_>, lattice: &Lattice, found: &mut Vec<Break>) {
        let divisors = formula.divisors();
        let all_signs = formula.signs_of(&divisors, &lattice.points);
        let mut budget = POLE_OPERATIONS;
        for (i, (divisor, signs)) in divisors.iter().zip(&all_signs).enumerate() {
            let is_crossed = |[a, b]: &[usize; 2]| {
                signs[*a] * signs[*b] < 0 && (lattice.signs[*a] < 0.0 || lattice.signs[*b] < 0.0)
            };
            let crossed: Vec<[usize; 2]> = lattice.edges().filter(is_crossed).collect();
            let cone = formula.cone(&[divisor.node]);
            let cost = ALL_HALVINGS * cone.operations + EVALUATIONS_OF_LOOK * formula.nodes.len();
            let looks = MOST_LOOKS.min(budget / (divisors.len() - i) / cost);
            if looks == 0 {
                continue;
            }
            for edge in evenly(&crossed, looks) {
                budget -= cost;
                let edge = edge.map(|i| lattice.points[i]);
                let ends = halved(edge, ALL_HALVINGS, |p| cone.values(p)[0] > 0.0);
                if self.has_pole(edge, ends) {
                    for division in formula.that_grow(&divisor.divisions, edge, ends) {
                        formula.add(found, Breakage::Pole, ends[0], division);
                    }
                    break;
                }
            }
        }
    }

    /// Whether ω has no bound between two neighbouring points on an edge, at which a divisor differs in sign.
    fn has_pole(&self, edge: [DVec3; 2], ends: [DVec3; 2]) -> bool {
        let scale = edge.map(|p| self.omega(p).abs()).into_iter().fold(0.0, f64::max);
        // where the divisor is exactly zero ω may be no number although it has a limit, such as sin(x)/x, or
        // finite although it has none: the points beyond count as well
        let [a, b] = ends;
        let sizes = [a, b, a + (a - b), b + (b - a)].map(|p| self.omega(p).abs());
        // ω is no number at all of them if it is made of infinite quotients
        sizes.iter().any(|size| *size > GROWTH * scale) || sizes.iter().all(|size| size.is_nan())
    }
}

/// A divisor that is no constant, and all divisions by it.
struct Divisor {
    node: Node,
    divisions: Vec<Node>,
}

/// Some operations of a formula, with all that they need.
struct Cone {
    program: Interpreter,
    outputs: usize,
    operations: usize,
    time: f64,
}

impl Cone {
    fn of(graph: &Graph, outputs: &[Node], time: f64) -> Self {
        let (graph, outputs) = graph.extract(outputs);
        let program = Interpreter::new(&graph, &outputs);
        Self { program, outputs: outputs.len(), operations: graph.len(), time }
    }

    /// The values of those operations at a point.
    fn values(&self, p: DVec3) -> Vec<f64> {
        let mut out = vec![0.0; self.outputs];
        self.program.eval_given(Given { time: self.time, ..Given::point(p.to_array()) }, &mut out);
        out
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

    fn cone(&self, outputs: &[Node]) -> Cone {
        Cone::of(self.solid.formula().0, outputs, self.solid.time())
    }

    /// The signs of each divisor at many points, 0 where it is no number.
    fn signs_of(&self, divisors: &[Divisor], points: &[DVec3]) -> Vec<Vec<i8>> {
        let mut columns = vec![Vec::with_capacity(points.len()); divisors.len()];
        if divisors.is_empty() {
            return columns;
        }
        let nodes: Vec<Node> = divisors.iter().map(|divisor| divisor.node).collect();
        let cone = self.cone(&nodes);
        for &p in points {
            for (column, value) in columns.iter_mut().zip(cone.values(p)) {
                column.push(i8::from(value > 0.0) - i8::from(value < 0.0));
            }
        }
        columns
    }

    /// Whether each operation takes part in ω at one of some points at least, given the values of all there.
    /// Values that `where` does not choose are multiplied by zero.
    fn taking_part(&self, at: &[Vec<f64>]) -> Vec<bool> {
        let (_, root) = self.solid.formula();
        let mut takes_part = vec![false; self.nodes.len()];
        takes_part[root.index()] = true;
        // operands come before their uses
        for (node, expr) in self.nodes.iter().rev().filter(|(node, _)| node.index() <= root.index()) {
            let is_zero = |factor: Node| at.iter().all(|values| values[factor.index()] == 0.0);
            let drops_first = matches!(expr, Expr::Binary(Binary::MulOrZero, _, factor) if is_zero(*factor));
            if takes_part[node.index()] {
                for operand in expr.operands().skip(usize::from(drops_first)) {
                    takes_part[operand.index()] = true;
                }
            }
        }
        takes_part
    }

    /// The first operation whose values at two neighbouring points differ although those of its operands hardly do.
    fn that_jumps(&self, ends: [DVec3; 2]) -> Option<Node> {
        let values = ends.map(|p| self.values(p));
        let takes_part = self.taking_part(&values);
        let [a, b] = values;
        let change = |node: Node| (a[node.index()] - b[node.index()]).abs();
        let is_sudden = |(node, expr): &&(Node, Expr)| {
            let of_operands = expr.operands().map(change).fold(0.0, f64::max);
            let size = a[node.index()].abs().max(b[node.index()].abs());
            let is_sudden = change(*node) > (SUDDEN * of_operands).max(JUMP * size);
            // 1/0 is infinite, and differs from what is beside it by ∞ or NaN
            let is_infinite = !size.is_finite() && of_operands.is_finite();
            takes_part[node.index()] && expr.operands().next().is_some() && (is_sudden || is_infinite)
        };
        self.nodes.iter().find(is_sudden).map(|(node, _)| *node)
    }

    /// The operation by which ω has no value at a point: found from the root downwards, because an operation
    /// without a value that is not chosen does no harm.
    fn without_value(&self, p: DVec3) -> Option<Node> {
        let (graph, mut node) = self.solid.formula();
        let values = self.values(p);
        let value = |node: Node| values[node.index()];
        if value(node).is_finite() {
            return None;
        }
        loop {
            let operands = || graph.expr(node).operands().filter(|operand| !value(*operand).is_finite());
            // NaN and ∞ explain one another only if there is nothing else
            let alike = operands().find(|operand| value(*operand).is_nan() == value(node).is_nan());
            match alike.or_else(|| operands().next()) {
                Some(operand) => node = operand,
                None => return Some(node),
            }
        }
    }

    /// The divisors that are no constants.
    fn divisors(&self) -> Vec<Divisor> {
        let (graph, _) = self.solid.formula();
        let mut found: Vec<Divisor> = Vec::new();
        let mut known: HashMap<Node, usize> = HashMap::new();
        for &(node, expr) in &self.nodes {
            if let Expr::Binary(Binary::Div, _, divisor) = expr
                && graph.as_constant(divisor).is_none()
            {
                let number = *known.entry(divisor).or_insert_with(|| {
                    found.push(Divisor { node: divisor, divisions: Vec::new() });
                    found.len() - 1
                });
                found[number].divisions.push(node);
            }
        }
        found
    }

    /// Those of some divisions that take part in ω and have no bound between two neighbouring points on an edge.
    fn that_grow(&self, divisions: &[Node], edge: [DVec3; 2], ends: [DVec3; 2]) -> Vec<Node> {
        let (far, near) = (edge.map(|p| self.values(p)), ends.map(|p| self.values(p)));
        let takes_part = self.taking_part(&near);
        let size = |at: &[Vec<f64>; 2], node: Node| {
            at.iter().map(|values| values[node.index()].abs()).fold(0.0, f64::max)
        };
        let grows = |&node: &Node| takes_part[node.index()] && size(&near, node) > GROWTH * size(&far, node);
        divisions.iter().copied().filter(grows).collect()
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
            Expr::Lookup(lookup, _) => graph.tables()[lookup.table as usize].what().into(),
            Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_) => {
                "a number".into()
            }
        };
        found.push(Break { what, at, span, operation });
    }
}
