//! Reverse mode: the gradient of a node as further nodes of the same graph.
//!
//! Each operation hands its adjoint on to its operands, multiplied by its derivative; one sweep from the root
//! down gives all three partial derivatives, whose code is then generated like any other. At singular points
//! the derivative is one member of the limit set: 0 for √a at a = 0 and |a| at 0, ½ and ½ for min and max at
//! a tie, equal weights for R₀ at a corner.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ir::function_rules::{Chain, ChainOfTwo};
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::lookup::{Lookup, Part};
use crate::ir::op::{Binary, Unary};

/// (∂root/∂x, ∂root/∂y, ∂root/∂z). The work grows with what the root uses, not with the graph.
pub fn gradient(graph: &mut Graph, root: Node) -> [Node; 3] {
    let [x, y, z, _] = gradient_and_rate(graph, root);
    [x, y, z]
}

/// The gradient, and ∂root/∂t at a fixed place.
pub fn gradient_and_rate(graph: &mut Graph, root: Node) -> [Node; 4] {
    partials_within(graph, root, 0)
}

/// How deeply choices may be nested if the operands that they leave out are to be left out of the gradient as
/// well.
const DEEPEST_CHOICE: usize = 12;

/// The partial derivatives of a root inside the given number of choices.
fn partials_within(graph: &mut Graph, root: Node, choices: usize) -> [Node; 4] {
    let cone = graph.cone(root);
    let depends = depends_on_coordinates(graph, &cone);
    let mut adjoints: FxHashMap<Node, Node> = FxHashMap::default();
    adjoints.insert(root, graph.constant(1.0));
    let (mut partials, mut chosen) = ([None; 4], [None; 4]);
    for &node in cone.iter().rev() {
        let Some(&adjoint) = adjoints.get(&node) else { continue };
        if let Expr::Coordinate(axis) = graph.expr(node) {
            partials[axis as usize] = Some(adjoint);
            continue;
        }
        if let Expr::Binary(Binary::MulOrZero, a, b) = graph.expr(node)
            && !depends.contains(&b)
            && choices < DEEPEST_CHOICE
        {
            // what is left out may have no derivative: a factor 0 further down would not make it one
            for (sum, inner) in chosen.iter_mut().zip(partials_within(graph, a, choices + 1)) {
                if graph.as_constant(inner) != Some(0.0) {
                    let counted = graph.binary(Binary::MulOrZero, inner, b);
                    let part = graph.binary(Binary::Mul, adjoint, counted);
                    *sum = Some(sum.map_or(part, |so_far| graph.binary(Binary::Add, so_far, part)));
                }
            }
            continue;
        }
        for (operand, contribution) in
            contributions(graph, node, adjoint, |operand| depends.contains(&operand))
        {
            let sum = match adjoints.get(&operand) {
                None => contribution,
                Some(&so_far) => graph.binary(Binary::Add, so_far, contribution),
            };
            adjoints.insert(operand, sum);
        }
    }
    std::array::from_fn(|i| match (partials[i], chosen[i]) {
        (Some(a), Some(b)) => graph.binary(Binary::Add, a, b),
        (one, other) => one.or(other).unwrap_or_else(|| graph.constant(0.0)),
    })
}

/// Constants need no adjoint, and neither do steps: leaving them out keeps dead multiplications out of the graph.
fn depends_on_coordinates(graph: &Graph, cone: &[Node]) -> FxHashSet<Node> {
    let mut depends = FxHashSet::default();
    for &node in cone {
        let expr = graph.expr(node);
        let is_step = match expr {
            Expr::Unary(op, _) => op.is_step(),
            Expr::Lookup(Lookup { part, .. }, _) => part != Part::Value,
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Binary(..) => false,
        };
        let is_varied = matches!(expr, Expr::Coordinate(_)) || expr.operands().any(|o| depends.contains(&o));
        if is_varied && !is_step {
            depends.insert(node);
        }
    }
    depends
}

/// For each operand, what a node's adjoint adds to that of the operand.
fn contributions(
    graph: &mut Graph,
    node: Node,
    adjoint: Node,
    depends: impl Fn(Node) -> bool,
) -> Vec<(Node, Node)> {
    let mut out = Vec::with_capacity(2);
    match graph.expr(node) {
        Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_) => {}
        Expr::Unary(op, a) => {
            if depends(a) {
                let contribution = unary(graph, op, node, a, adjoint);
                out.push((a, contribution));
            }
        }
        Expr::Binary(op, a, b) => {
            if depends(a)
                && let Some(contribution) = binary(graph, op, node, [a, b], Side::First, adjoint)
            {
                out.push((a, contribution));
            }
            if depends(b)
                && let Some(contribution) = binary(graph, op, node, [a, b], Side::Second, adjoint)
            {
                out.push((b, contribution));
            }
        }
        // steps are not among what depends on coordinates: this is the value
        Expr::Lookup(lookup, at) => {
            let span = graph.span(node);
            for (axis, operand) in at.into_iter().enumerate().filter(|(_, operand)| depends(*operand)) {
                let slope = graph.intern(Expr::Lookup(lookup.with(Part::Slope(axis as u8)), at), span);
                let contribution = graph.binary(Binary::Mul, adjoint, slope);
                out.push((operand, contribution));
            }
        }
    }
    out
}

/// For each operand that depends on coordinates, the derivative of a node by it.
pub(super) fn partials_of(
    graph: &mut Graph,
    node: Node,
    depends: impl Fn(Node) -> bool,
) -> Vec<(Node, Node)> {
    let one = graph.constant(1.0);
    let mut out = contributions(graph, node, one, depends);
    for (_, partial) in &mut out {
        if let Expr::Binary(Binary::Mul, a, b) = graph.expr(*partial)
            && (a == one || b == one)
        {
            *partial = if a == one { b } else { a };
        }
    }
    out
}

/// adjoint · ∂op(a)/∂a
fn unary(graph: &mut Graph, op: Unary, node: Node, a: Node, adjoint: Node) -> Node {
    use Binary::{Add, DivOrZero, Mul};
    match op {
        Unary::Neg => graph.unary(Unary::Neg, adjoint),
        Unary::Abs => {
            let sign = graph.unary(Unary::Sign, a);
            graph.binary(Mul, adjoint, sign)
        }
        Unary::Sqrt => {
            let twice = graph.binary(Add, node, node);
            graph.binary(DivOrZero, adjoint, twice)
        }
        Unary::Sign | Unary::Floor | Unary::Round => graph.constant(0.0),
        Unary::Call(function) => function.derivative(graph, Chain { adjoint, operand: a, value: node }),
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    First,
    Second,
}

/// adjoint · ∂op(a, b)/∂(the operand of one side); `None` where the derivative is zero.
fn binary(
    graph: &mut Graph,
    op: Binary,
    node: Node,
    [a, b]: [Node; 2],
    side: Side,
    adjoint: Node,
) -> Option<Node> {
    use Binary::{
        Add, And, AndWeight, Call, Div, DivOrZero, Max, MaxWeight, Min, MinWeight, Mul, MulOrZero, Or,
        OrWeight, PlainMax, PlainMin, Sub,
    };
    let first = side == Side::First;
    // (this operand, the other one)
    let (this, other) = if first { (a, b) } else { (b, a) };
    let weighted = |graph: &mut Graph, weight: Binary| {
        let weight = graph.binary(weight, this, other);
        graph.binary(Mul, adjoint, weight)
    };
    Some(match op {
        Add => adjoint,
        Sub if first => adjoint,
        Sub => graph.unary(Unary::Neg, adjoint),
        Mul => graph.binary(Mul, adjoint, other),
        Div | DivOrZero if first => graph.binary(op, adjoint, b),
        Div | DivOrZero => {
            let product = graph.binary(Mul, adjoint, node);
            let quotient = graph.binary(op, product, b);
            graph.unary(Unary::Neg, quotient)
        }
        MulOrZero if first => graph.binary(MulOrZero, adjoint, b),
        MulOrZero => {
            let sign = graph.unary(Unary::Sign, b);
            let counts = graph.unary(Unary::Abs, sign);
            let counted = graph.binary(MulOrZero, a, counts);
            graph.binary(Mul, adjoint, counted)
        }
        Min | PlainMin => weighted(graph, MinWeight),
        Max | PlainMax => weighted(graph, MaxWeight),
        And => weighted(graph, AndWeight),
        Or => weighted(graph, OrWeight),
        MinWeight | MaxWeight => return None,
        Call(function) => {
            function.derivative(graph, ChainOfTwo { adjoint, operands: [a, b], value: node }, first)
        }
        // w = 1 ∓ a/h with h² = a² + b²: ∂a = ∓b²/h³, ∂b = ±ab/h³
        AndWeight | OrWeight => {
            let sum = sum_of_squares(graph, a, b);
            let h = graph.unary(Unary::Sqrt, sum);
            let cube = graph.binary(Mul, sum, h);
            let top = graph.binary(Mul, other, b);
            let product = graph.binary(Mul, adjoint, top);
            let quotient = graph.binary(DivOrZero, product, cube);
            if first == (op == AndWeight) { graph.unary(Unary::Neg, quotient) } else { quotient }
        }
    })
}

fn sum_of_squares(graph: &mut Graph, a: Node, b: Node) -> Node {
    let (a2, b2) = (graph.binary(Binary::Mul, a, a), graph.binary(Binary::Mul, b, b));
    graph.binary(Binary::Add, a2, b2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Axis, BinaryFunction, Given, Interpreter};

    /// Derivatives against central differences at smooth points: h = 1e-5 leaves ~1e-9 of either error.
    #[test]
    fn every_operation_has_its_derivative() {
        let points = [[0.3, 0.5, -0.2, 0.1], [0.7, 0.2, 0.4, -0.2], [0.15, 0.6, 0.9, 0.3]];
        let mut roots = Vec::new();
        let mut graph = Graph::default();
        let (x, y, z) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y), graph.coordinate(Axis::Z));
        let z2 = graph.binary(Binary::Mul, z, z);
        let t = graph.coordinate(Axis::T);
        let tz2 = graph.binary(Binary::Add, z2, t);
        let inner = graph.binary(Binary::Add, y, tz2);
        for op in Unary::all() {
            let inside = graph.unary(op, x);
            roots.push((op.name(), graph.binary(Binary::Mul, inside, inner)));
        }
        for op in Binary::all() {
            let inside = graph.binary(op, x, inner);
            roots.push((op.name(), graph.binary(Binary::Add, inside, z)));
            let negative = graph.unary(Unary::Neg, inner);
            if op != Binary::Call(BinaryFunction::Pow) {
                roots.push((op.name(), graph.binary(op, x, negative)));
            }
        }
        for (name, root) in roots {
            let partials = gradient_and_rate(&mut graph, root);
            let mut outputs = vec![root];
            outputs.extend(partials);
            let (small, outputs) = graph.extract(&outputs);
            let interpreter = Interpreter::new(&small, &outputs);
            let value = |[x, y, z, time]: [f64; 4]| {
                let mut out = [0.0; 5];
                interpreter.eval_given(Given { time, ..Given::point([x, y, z]) }, &mut out);
                out
            };
            for p in points {
                for axis in 0..4 {
                    let h = 1e-5;
                    let (mut low, mut high) = (p, p);
                    low[axis] -= h;
                    high[axis] += h;
                    let difference = (value(high)[0] - value(low)[0]) / (2.0 * h);
                    let exact = value(p)[axis + 1];
                    assert!(
                        (difference - exact).abs() < 1e-7 * (1.0 + exact.abs()),
                        "{name} at {p:?}, axis {axis}: {exact} against {difference}"
                    );
                }
            }
        }
    }

    #[test]
    fn singular_points_are_finite() {
        let mut graph = Graph::default();
        let (x, y) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y));
        let r2 = sum_of_squares(&mut graph, x, y);
        let rho = graph.unary(Unary::Sqrt, r2);
        let corner = graph.binary(Binary::And, x, y);
        let abs = graph.unary(Unary::Abs, x);
        for root in [rho, corner, abs] {
            let partials = gradient(&mut graph, root);
            let interpreter = Interpreter::new(&graph, &partials);
            let mut out = [f64::NAN; 3];
            interpreter.eval_f64([0.0, 0.0, 0.0], &mut out);
            assert!(out.iter().all(|g| g.is_finite()), "{out:?}");
        }
    }
}
