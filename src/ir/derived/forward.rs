//! Forward mode: the gradient of each node from those of its operands.
//!
//! It costs three numbers for each node, where [`gradient`](super::gradient::gradient) costs one, and is what ranges of
//! derivatives are found from: that of a minimum is the derivative of one operand or of the other, and their hull where
//! both may be the smaller one. Reverse mode multiplies by a share of 0 to 1 for each of them, so that of nearly equal
//! derivatives anything is possible from nothing to their sum.

use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

use super::gradient::partials_of;

/// Derivatives by x, y and z; `None` for zero.
type Slopes = [Option<Node>; 3];

/// (∂root/∂x, ∂root/∂y, ∂root/∂z), of which each minimum is a choice that `RangeEvaluator` and range programs know.
pub fn forward_gradient(graph: &mut Graph, root: Node) -> [Node; 3] {
    let cone = graph.cone(root);
    let mut slopes: Vec<Slopes> = Vec::with_capacity(cone.len());
    for &node in &cone {
        let of = |operand: Node| {
            // operands come before their uses, and are in the cone with them
            let place = cone.binary_search(&operand);
            place.map_or([None; 3], |place| slopes[place])
        };
        let new = slopes_of(graph, node, of);
        slopes.push(new);
    }
    let own = slopes.last().copied().unwrap_or([None; 3]);
    own.map(|slope| slope.unwrap_or_else(|| graph.constant(0.0)))
}

fn slopes_of(graph: &mut Graph, node: Node, of: impl Fn(Node) -> Slopes) -> Slopes {
    let expr = graph.expr(node);
    match expr {
        Expr::Coordinate(axis) => std::array::from_fn(|i| (axis as usize == i).then(|| graph.constant(1.0))),
        Expr::Binary(Binary::Add, a, b) => each(of(a), of(b), |one, other| match (one, other) {
            (Some(a), Some(b)) => Some(graph.binary(Binary::Add, a, b)),
            (one, other) => one.or(other),
        }),
        Expr::Binary(Binary::Sub, a, b) => each(of(a), of(b), |one, other| match (one, other) {
            (Some(a), Some(b)) => Some(graph.binary(Binary::Sub, a, b)),
            (one, None) => one,
            (None, Some(b)) => Some(graph.unary(Unary::Neg, b)),
        }),
        Expr::Unary(Unary::Neg, a) => of(a).map(|slope| slope.map(|a| graph.unary(Unary::Neg, a))),
        Expr::Binary(Binary::Min | Binary::PlainMin, a, b) => {
            let share = graph.binary(Binary::MinWeight, a, b);
            each(of(a), of(b), |one, other| choice(graph, [one, other], share))
        }
        Expr::Binary(Binary::Max | Binary::PlainMax, a, b) => {
            let share = graph.binary(Binary::MaxWeight, a, b);
            each(of(a), of(b), |one, other| choice(graph, [one, other], share))
        }
        // what is left out may have no derivative
        Expr::Binary(Binary::MulOrZero, a, b) if of(b) == [None; 3] => {
            of(a).map(|slope| slope.map(|a| graph.binary(Binary::MulOrZero, a, b)))
        }
        Expr::Unary(Unary::Sqrt, sum) if let Some(parts) = parts_of_length(graph, sum) => {
            let slopes: Vec<Slopes> = parts.iter().map(|part| of(*part)).collect();
            slopes_of_length(graph, &parts, &slopes)
        }
        Expr::Constant(_) | Expr::Parameter(_) | Expr::Uniform(_) => [None; 3],
        Expr::Unary(op, _) if op.is_step() => [None; 3],
        Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) => {
            let mut sum: Slopes = [None; 3];
            for (operand, factor) in partials_of(graph, node, |operand| of(operand) != [None; 3]) {
                for (so_far, slope) in sum.iter_mut().zip(of(operand)) {
                    let Some(slope) = slope else { continue };
                    let term = product(graph, factor, slope);
                    *so_far = Some(so_far.map_or(term, |so_far| graph.binary(Binary::Add, so_far, term)));
                }
            }
            sum
        }
    }
}

/// A length of more parts is a root like others: each part asks for the length of all others, and sums may share sums.
pub(in crate::ir) const MOST_PARTS: usize = 8;

/// a, b, … of a² + b² + …, if a node is a sum of two squares or more.
fn parts_of_length(graph: &Graph, sum: Node) -> Option<Vec<Node>> {
    let (mut parts, mut waiting) = (Vec::new(), vec![sum]);
    while let Some(node) = waiting.pop() {
        if parts.len() + waiting.len() >= MOST_PARTS {
            return None;
        }
        match graph.expr(node) {
            Expr::Binary(Binary::Add, a, b) => waiting.extend([b, a]),
            Expr::Binary(Binary::Mul, a, b) if a == b => parts.push(a),
            Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => return None,
        }
    }
    (parts.len() > 1).then_some(parts)
}

/// The derivatives of √(a² + b² + …): those of each part, times its share a/√(a² + …). This is from −1 to 1 also where
/// all parts vanish and the root has no derivative; a quotient by the root would have any size near there.
fn slopes_of_length(graph: &mut Graph, parts: &[Node], slopes: &[Slopes]) -> Slopes {
    let one = graph.constant(1.0);
    let mut sum: Slopes = [None; 3];
    for (k, (&part, slopes)) in
        parts.iter().zip(slopes).enumerate().filter(|(_, (_, slopes))| **slopes != [None; 3])
    {
        let others = parts.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, part)| *part);
        let others = length(graph, &others.collect::<Vec<_>>());
        // the weight of R₀, whose range is known at the corner
        let weight = graph.binary(Binary::AndWeight, part, others);
        let share = graph.binary(Binary::Sub, one, weight);
        for (so_far, slope) in sum.iter_mut().zip(slopes) {
            let Some(slope) = slope else { continue };
            let term = product(graph, share, *slope);
            *so_far = Some(so_far.map_or(term, |so_far| graph.binary(Binary::Add, so_far, term)));
        }
    }
    sum
}

/// √(a² + b² + …); a itself if it is the only part.
fn length(graph: &mut Graph, parts: &[Node]) -> Node {
    let mut sum = None;
    for &part in parts {
        let square = graph.binary(Binary::Mul, part, part);
        sum = Some(sum.map_or(square, |sum| graph.binary(Binary::Add, sum, square)));
    }
    match (parts, sum) {
        ([part], _) => *part,
        (_, Some(sum)) => graph.unary(Unary::Sqrt, sum),
        (_, None) => graph.constant(0.0),
    }
}

fn each(a: Slopes, b: Slopes, mut of: impl FnMut(Option<Node>, Option<Node>) -> Option<Node>) -> Slopes {
    std::array::from_fn(|i| of(a[i], b[i]))
}

/// first·share + second·(1 − share), written as ranges know it.
fn choice(graph: &mut Graph, slopes: [Option<Node>; 2], share: Node) -> Option<Node> {
    if slopes == [None; 2] || slopes[0] == slopes[1] {
        return slopes[0];
    }
    let one = graph.constant(1.0);
    let rest = graph.binary(Binary::Sub, one, share);
    let [first, second] = [(slopes[0], share), (slopes[1], rest)].map(|(slope, counts)| {
        let slope = slope.unwrap_or_else(|| graph.constant(0.0));
        graph.binary(Binary::MulOrZero, slope, counts)
    });
    Some(graph.binary(Binary::Add, first, second))
}

fn product(graph: &mut Graph, factor: Node, slope: Node) -> Node {
    match (graph.as_constant(factor), graph.as_constant(slope)) {
        (Some(1.0), _) => slope,
        (_, Some(1.0)) => factor,
        _ => graph.binary(Binary::Mul, factor, slope),
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geom::Aabb;
    use crate::interval::Interval;
    use crate::ir::{Axis, Interpreter, RangeEvaluator, gradient};

    /// min(max(2x + y·z, x − y), |x|·√(y² + 1)) − 3∧x
    fn formula(graph: &mut Graph) -> Node {
        use Binary::{Add, And, Max, Min, Mul, Sub};
        let [x, y, z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let [one, two, three] = [1.0, 2.0, 3.0].map(|number| graph.constant(number));
        let (double, product) = (graph.binary(Mul, two, x), graph.binary(Mul, y, z));
        let (sum, difference) = (graph.binary(Add, double, product), graph.binary(Sub, x, y));
        let larger = graph.binary(Max, sum, difference);
        let square = graph.binary(Mul, y, y);
        let grown = graph.binary(Add, square, one);
        let (root, size) = (graph.unary(Unary::Sqrt, grown), graph.unary(Unary::Abs, x));
        let other = graph.binary(Mul, size, root);
        let smaller = graph.binary(Min, larger, other);
        let joined = graph.binary(And, three, x);
        graph.binary(Sub, smaller, joined)
    }

    #[test]
    fn it_is_the_gradient_of_reverse_mode() {
        let mut graph = Graph::default();
        let root = formula(&mut graph);
        let (forward, reverse) = (forward_gradient(&mut graph, root), gradient(&mut graph, root));
        let interpreter = Interpreter::new(&graph, &[forward, reverse].concat());
        for i in 0..1000 {
            let at = |k: u32| f64::from((i * 7919 + k * 104_729) % 10_007) / 2500.0 - 2.0;
            let mut values = [0.0; 6];
            interpreter.eval_f64([at(1), at(2), at(3)], &mut values);
            let (a, b) = values.split_at(3);
            // some roundings apart, of sums of a few numbers below 10
            assert!(std::iter::zip(a, b).all(|(a, b)| (a - b).abs() < 1e-14 * 10.0), "{values:?}");
        }
    }

    /// √(x² + y²) and √(x² + y² + z²), which have no derivative where all parts vanish.
    #[test]
    fn slopes_of_lengths_are_bounded() {
        let mut graph = Graph::default();
        let parts = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let roots = [length(&mut graph, &parts[..2]), length(&mut graph, &parts)];
        for (root, count) in roots.into_iter().zip([2, 3]) {
            let (forward, reverse) = (forward_gradient(&mut graph, root), gradient(&mut graph, root));
            let interpreter = Interpreter::new(&graph, &[forward, reverse].concat());
            let mut values = [0.0; 6];
            interpreter.eval_f64([0.75, -2.0, 0.5], &mut values);
            // some roundings of numbers up to 2 apart
            assert!((0..3).all(|i| (values[i] - values[i + 3]).abs() < 1e-15), "{values:?}");
            let around = Aabb::new(DVec3::splat(-0.5), DVec3::splat(1.0));
            let beside = Aabb::new(DVec3::new(1.0, -0.1, -0.1), DVec3::new(2.0, 0.1, 0.1));
            for (axis, slope) in forward.into_iter().enumerate().take(count) {
                let range = |over| RangeEvaluator::new(&graph, slope).eval(over);
                let (any, some) = (range(&around), range(&beside));
                assert!(any.lo >= -1.0 - 1e-15 && any.hi <= 1.0 + 1e-15, "{any:?}");
                let expected = if axis == 0 { Interval::new(0.98, 1.0) } else { Interval::new(-0.1, 0.1) };
                assert!(some.lo >= expected.lo - 1e-12 && some.hi <= expected.hi + 1e-12, "{some:?}");
            }
        }
    }

    #[test]
    fn of_nearly_equal_operands_the_range_is_their_hull() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let steep = graph.constant(1.25);
        let steeper = graph.binary(Binary::Mul, steep, x);
        let [a, b] = [x, steeper].map(|along| graph.binary(Binary::Add, along, y));
        let root = graph.binary(Binary::Min, a, b);
        let [slope, other, _] = forward_gradient(&mut graph, root);
        let over = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
        let range = |node: Node| RangeEvaluator::new(&graph, node).eval(&over);
        assert_eq!(range(slope), Interval::new(1.0, 1.25));
        assert_eq!(range(other), Interval::point(1.0));
    }
}
