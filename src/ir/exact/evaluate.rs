//! The true values of a graph.
//!
//! R₀ is computed as the textbook prints it, u + v ∓ √(u² + v²): with 400 bits its cancellation costs
//! nothing, and it shares no formula with the programs that it judges. A point where an operation has no
//! value, or where a derivative has no limit, has no truth.

use super::big::{Big, PRECISION, big, number, one};
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// A real number to 120 digits.
#[derive(Debug, Clone)]
pub struct Exact(Big);

impl Exact {
    /// The nearest double.
    pub fn to_f64(&self) -> f64 {
        self.0.to_f64().value()
    }

    /// |found − self|; infinite if `found` is not finite.
    pub fn error_of(&self, found: f64) -> f64 {
        match big(found) {
            Some(found) => (found - &self.0).to_f64().value().abs(),
            None => f64::INFINITY,
        }
    }

    /// −1, 0 or 1
    pub fn sign(&self) -> f64 {
        if self.0 > Big::ZERO {
            1.0
        } else if self.0 < Big::ZERO {
            -1.0
        } else {
            0.0
        }
    }
}

/// The exact values of some nodes at a point; `None` if one of the operations they need is undefined there,
/// and for formulas of time.
pub fn evaluate(graph: &Graph, outputs: &[Node], point: [f64; 3]) -> Option<Vec<Exact>> {
    evaluate_at(graph, outputs, point, f64::NAN)
}

/// The exact values of some nodes at a point and a time.
pub fn evaluate_at(graph: &Graph, outputs: &[Node], point: [f64; 3], time: f64) -> Option<Vec<Exact>> {
    let used = graph.reachable(outputs);
    let mut values: Vec<Option<Big>> = Vec::with_capacity(graph.len());
    for (node, expr) in graph.nodes() {
        if !used[node.index()] {
            values.push(None);
            continue;
        }
        let of = |node: Node| values[node.index()].as_ref();
        let value = match expr {
            Expr::Constant(bits) => big(f64::from_bits(bits))?,
            Expr::Coordinate(Axis::X) => big(point[0])?,
            Expr::Coordinate(Axis::Y) => big(point[1])?,
            Expr::Coordinate(Axis::Z) => big(point[2])?,
            Expr::Coordinate(Axis::T) => big(time)?,
            Expr::Parameter(_) | Expr::Uniform(_) | Expr::Lookup(..) => return None,
            Expr::Unary(op, a) => unary(op, of(a)?)?,
            Expr::Binary(op, a, b) => binary(op, of(a)?, of(b)?)?,
        };
        // a zero may have come out with unlimited digits, and such a number has no sine
        values.push(Some(value.with_precision(PRECISION).value()));
    }
    outputs.iter().map(|output| values[output.index()].clone().map(Exact)).collect()
}

fn unary(op: Unary, a: &Big) -> Option<Big> {
    let positive = *a > Big::ZERO;
    let zero = *a == Big::ZERO;
    Some(match op {
        Unary::Neg => -a,
        Unary::Abs => {
            if positive {
                a.clone()
            } else {
                -a
            }
        }
        Unary::Sqrt if zero => Big::ZERO,
        Unary::Sqrt if positive => a.sqrt(),
        Unary::Sign if zero => Big::ZERO,
        Unary::Sign => {
            if positive {
                one()
            } else {
                -one()
            }
        }
        Unary::Floor => a.floor(),
        Unary::Round => nearest_whole(a),
        Unary::Sqrt => return None,
        Unary::Call(function) => function.exact(a)?,
    })
}

/// Halfway between two whole numbers it is the even one.
fn nearest_whole(a: &Big) -> Big {
    let half = one() / number(2);
    let up = (a + &half).floor();
    let is_halfway = &up - a == half;
    let is_odd = (&up / number(2)).floor() * number(2) != up;
    if is_halfway && is_odd { up - one() } else { up }
}

fn binary(op: Binary, a: &Big, b: &Big) -> Option<Big> {
    let hypotenuse = || {
        let squares = a * a + b * b;
        if squares == Big::ZERO { Big::ZERO } else { squares.sqrt() }
    };
    // 1 ∓ a/h, which has no limit at h = 0
    let cosine = || {
        let h = hypotenuse();
        (h != Big::ZERO).then(|| a / h)
    };
    // a tie has two one-sided derivatives
    let step = |first: bool| (a != b).then(|| if first { one() } else { Big::ZERO });
    Some(match op {
        Binary::Add => a + b,
        Binary::Sub => a - b,
        Binary::Mul => a * b,
        Binary::Div | Binary::DivOrZero if *b != Big::ZERO => a / b,
        Binary::DivOrZero => Big::ZERO,
        Binary::MulOrZero => a * b,
        Binary::Div => return None,
        Binary::Min | Binary::PlainMin => (if a < b { a } else { b }).clone(),
        Binary::Max | Binary::PlainMax => (if a > b { a } else { b }).clone(),
        Binary::MinWeight => step(a < b)?,
        Binary::MaxWeight => step(a > b)?,
        Binary::Call(function) => function.exact(a, b)?,
        Binary::And => a + b - hypotenuse(),
        Binary::Or => a + b + hypotenuse(),
        Binary::AndWeight => one() - cosine()?,
        Binary::OrWeight => one() + cosine()?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cancellation_costs_nothing() {
        let mut graph = Graph::default();
        let (x, y) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y));
        let both = graph.binary(Binary::And, x, y);
        let weight = graph.binary(Binary::AndWeight, x, y);
        let exact = evaluate(&graph, &[both, weight], [1.0, 2f64.powi(-60), 0.0]).unwrap();
        // 1 ∧ ε = ε − ε²/2 + … , and the weight of 1 is ε²/2 − …
        assert_eq!(exact[0].to_f64(), 2f64.powi(-60));
        assert!((exact[1].to_f64() / 2f64.powi(-121) - 1.0).abs() < 1e-15);
        assert!(evaluate(&graph, &[both], [0.0, 0.0, 0.0]).unwrap()[0].to_f64() == 0.0);
        assert!(evaluate(&graph, &[weight], [0.0, 0.0, 0.0]).is_none());
    }

    #[test]
    fn functions_agree_with_doubles() {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        for op in Unary::all() {
            let root = graph.unary(op, x);
            let value = evaluate(&graph, &[root], [0.7, 0.0, 0.0]).unwrap()[0].to_f64();
            assert!((value - op.eval(0.7)).abs() < 1e-15, "{}: {value}", op.name());
        }
    }
}
