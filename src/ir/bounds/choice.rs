//! One of two values, by a number from 0 to 1: what `where` is made of, and the derivative of a minimum.

use crate::interval::Interval;
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// a·c + b·(1 − c), where c is a whole number or a share. Taken as a sum of products, its range would reach to zero
/// wherever c may be 0 or 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Choice {
    sum: Node,
    values: [Node; 2],
    /// c
    counts: Node,
    /// The number that c is taken from, which may be a parameter.
    one: Node,
}

impl Choice {
    /// The choices in a graph, ascending by node.
    pub fn all(graph: &Graph) -> Vec<Self> {
        graph.nodes().filter_map(|(node, _)| Self::of(graph, node)).collect()
    }

    fn of(graph: &Graph, sum: Node) -> Option<Self> {
        let Expr::Binary(Binary::Add, first, second) = graph.expr(sum) else { return None };
        Self::of_parts(graph, sum, [first, second]).or_else(|| Self::of_parts(graph, sum, [second, first]))
    }

    fn of_parts(graph: &Graph, sum: Node, [first, second]: [Node; 2]) -> Option<Self> {
        let Expr::Binary(Binary::MulOrZero, a, counts) = graph.expr(first) else { return None };
        let Expr::Binary(Binary::MulOrZero, b, rest) = graph.expr(second) else { return None };
        let Expr::Binary(Binary::Sub, one, subtracted) = graph.expr(rest) else { return None };
        let chooses = matches!(
            graph.expr(counts),
            Expr::Unary(Unary::Floor, _) | Expr::Binary(Binary::MinWeight | Binary::MaxWeight, ..)
        );
        (subtracted == counts && chooses).then_some(Self { sum, values: [a, b], counts, one })
    }

    /// The node that makes the choice.
    pub fn node(&self) -> Node {
        self.sum
    }

    /// a and b
    pub fn values(&self) -> [Node; 2] {
        self.values
    }

    /// c and the number that it is taken from
    pub fn share(&self) -> (Node, Node) {
        (self.counts, self.one)
    }

    /// An interval that contains the chosen value, from those of the nodes before it. `None` if c may be something else
    /// than a number from 0 to 1.
    pub fn range(&self, of: impl Fn(Node) -> Interval) -> Option<Interval> {
        let counts = of(self.counts);
        let chooses = of(self.one) == Interval::point(1.0) && counts.lo >= 0.0 && counts.hi <= 1.0;
        let [a, b] = self.values.map(of);
        chooses.then(|| match (counts.lo >= 1.0, counts.hi <= 0.0) {
            (true, _) => a,
            (_, true) => b,
            (false, false) => a.hull(b),
        })
    }
}

/// The numbers by which a graph chooses one of two values: ranges know what they do.
pub(crate) fn choosing_numbers(graph: &Graph) -> Vec<Node> {
    Choice::all(graph).into_iter().map(|choice| choice.counts).collect()
}

#[cfg(test)]
mod tests {
    use super::super::range::RangeEvaluator;
    use super::*;
    use crate::geom::Aabb;
    use crate::ir::Interpreter;
    use crate::ir::graph::Axis;
    use glam::DVec3;

    /// where(x >= 0, a, b), written as the language lowers it.
    fn choice(graph: &mut Graph, a: Node, b: Node) -> Node {
        let [half, one] = [0.5, 1.0].map(|number| graph.constant(number));
        let x = graph.coordinate(Axis::X);
        let sign = graph.unary(Unary::Sign, x);
        let halved = graph.binary(Binary::Mul, half, sign);
        let sum = graph.binary(Binary::Add, one, halved);
        let counts = graph.unary(Unary::Floor, sum);
        let rest = graph.binary(Binary::Sub, one, counts);
        let parts =
            [(a, counts), (b, rest)].map(|(value, factor)| graph.binary(Binary::MulOrZero, value, factor));
        graph.binary(Binary::Add, parts[0], parts[1])
    }

    #[test]
    fn an_open_choice_is_one_of_both_values_and_not_their_sum() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let three = graph.constant(3.0);
        let first = graph.binary(Binary::Add, x, three);
        let second = graph.binary(Binary::Add, y, three);
        let root = choice(&mut graph, first, second);
        let evaluator = RangeEvaluator::new(&graph, root);
        let over = |low: f64, high: f64| Aabb::new(DVec3::new(low, 4.0, 0.0), DVec3::new(high, 5.0, 0.0));
        let range = evaluator.eval(&over(-1.0, 2.0));
        assert!((range.lo - 2.0).abs() < 1e-12 && (range.hi - 8.0).abs() < 1e-12, "{range:?}");
        let range = evaluator.eval(&over(1.0, 2.0));
        assert!((range.lo - 4.0).abs() < 1e-12 && (range.hi - 5.0).abs() < 1e-12, "{range:?}");
    }

    #[test]
    fn a_value_that_may_be_undefined_leaves_an_open_choice_unknown() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let root_of_y = graph.unary(Unary::Sqrt, y);
        let root = choice(&mut graph, x, root_of_y);
        let evaluator = RangeEvaluator::new(&graph, root);
        let open = Aabb::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 4.0, 0.0));
        assert_eq!(evaluator.eval(&open), Interval::ALL);
        let mut value = [0.0];
        Interpreter::new(&graph, &[root]).eval_f64([0.5, -1.0, 0.0], &mut value);
        assert_eq!(value, [0.5]);
    }
}
