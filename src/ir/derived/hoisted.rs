//! What depends on time alone, found once for each instant rather than at each point.
//!
//! A solid that turns by the angle 2πt has sin 2πt and cos 2πt in its formula. They are the same at every
//! point: here such nodes are taken out of a graph, and what is left reads them as [`Expr::Uniform`]s. A
//! program of the rest costs what that of a solid at rest costs, and needs no compilation for another
//! instant.

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{RangeEvaluator, Region};
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::interpreter::{Given, Interpreter};

/// The numbers of a graph that depend on time alone.
#[derive(Debug, Clone)]
pub struct Uniforms {
    /// The formulas alone.
    graph: Graph,
    interpreter: Interpreter,
    ranges: RangeEvaluator,
    roots: Vec<Node>,
}

/// A graph without time.
#[derive(Debug, Clone)]
pub struct Hoisted {
    /// The graph, with uniforms in place of what was taken out.
    pub graph: Graph,
    /// The outputs in it.
    pub outputs: Vec<Node>,
    /// What was taken out.
    pub uniforms: Uniforms,
    /// What has become of each node; `None` for those that were taken out or are not used.
    pub image: Vec<Option<Node>>,
}

impl Uniforms {
    /// How many they are.
    pub fn len(&self) -> usize {
        self.roots.len()
    }

    /// Their formulas: a graph of time, and of parameters if [`Outside::TimeAndParameters`] was taken out; and
    /// the nodes of the numbers in it.
    pub fn formulas(&self) -> (&Graph, &[Node]) {
        (&self.graph, &self.roots)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.roots.is_empty()
    }

    /// Their values at a time, in `f64`.
    pub fn at(&self, time: f64, parameters: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.roots.len()];
        self.fill(time, parameters, &mut values);
        values
    }

    /// Writes their values at a time to a slice of their number.
    pub fn fill(&self, time: f64, parameters: &[f64], values: &mut [f64]) {
        self.interpreter.eval_given(Given { time, parameters, ..Given::point([f64::NAN; 3]) }, values);
    }

    /// Their ranges over a stretch of time. At an instant these are their values, because all that uses them takes those:
    /// the angle atan2(sin 0, −1) is π, and a range around the computed sine would reach to −π.
    pub fn over(&self, time: Interval, parameters: &[f64]) -> Vec<Interval> {
        if self.is_empty() {
            return Vec::new();
        }
        let all = self.ranges.all_with(&Region { time, parameters, ..Region::of(&Aabb::EMPTY) });
        let ranges = self.roots.iter().map(|root| all[root.index()]);
        if time.lo < time.hi {
            return ranges.collect();
        }
        let values = self.at(time.lo, parameters).into_iter();
        let value =
            |(range, value): (Interval, f64)| if value.is_finite() { Interval::point(value) } else { range };
        ranges.zip(values).map(value).collect()
    }
}

/// A range that is wider than this, or than this part of its numbers, is that of a change.
const ROUNDED: f64 = 1e-14;

impl Uniforms {
    /// The bits of their values if they stay the same between two times, s; `None` if any is not known to.
    pub fn at_rest(&self, from: f64, to: f64) -> Option<Vec<u64>> {
        let bits = |time: f64| self.at(time, &[]).into_iter().map(f64::to_bits).collect::<Vec<_>>();
        let now = bits(to);
        // what is proven between is rounded outwards
        let is_still = |range: Interval| range.hi - range.lo <= ROUNDED * (1.0 + range.lo.abs());
        let stay = || self.over(Interval::new(from.min(to), from.max(to)), &[]).into_iter().all(is_still);
        (from == to || (bits(from) == now && stay())).then_some(now)
    }
}

/// What does not differ from point to point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// Time. Parameters are constants of a leaf: nothing is gained by taking them out.
    Time,
    /// Time, and parameters that the whole formula shares.
    TimeAndParameters,
}

/// Takes out the largest parts of some outputs that depend on time alone, or on parameters as well.
pub fn hoisted(graph: &Graph, outputs: &[Node], outside: Outside) -> Hoisted {
    let mut varies = vec![false; graph.len()];
    let mut uses_space = vec![false; graph.len()];
    for (node, expr) in graph.nodes() {
        let any = |of: &[bool]| expr.operands().any(|operand| of[operand.index()]);
        let is_outside = expr == Expr::Coordinate(Axis::T)
            || (outside == Outside::TimeAndParameters && matches!(expr, Expr::Parameter(_)));
        varies[node.index()] = is_outside || any(&varies);
        let is_place = matches!(expr, Expr::Coordinate(Axis::X | Axis::Y | Axis::Z));
        uses_space[node.index()] = is_place || any(&uses_space);
    }
    let alone = |node: Node| varies[node.index()] && !uses_space[node.index()];
    // what is left needs, down to the parts that are taken out
    let mut needed = vec![false; graph.len()];
    outputs.iter().for_each(|output| needed[output.index()] = true);
    for i in (0..graph.len()).rev() {
        let node = graph.node(i);
        if needed[i] && !alone(node) {
            graph.expr(node).operands().for_each(|operand| needed[operand.index()] = true);
        }
    }
    let mut rest = Graph::like(graph);
    let mut image: Vec<Option<Node>> = vec![None; graph.len()];
    let mut roots = Vec::new();
    for (node, expr) in graph.nodes().filter(|(node, _)| needed[node.index()]) {
        let new = if alone(node) {
            roots.push(node);
            Expr::Uniform(roots.len() as u32 - 1)
        } else {
            expr.map(|operand| image[operand.index()].unwrap_or(operand))
        };
        image[node.index()] = Some(rest.intern(new, graph.span(node)));
    }
    let outputs: Vec<Node> = outputs.iter().map(|output| image[output.index()].unwrap_or(*output)).collect();
    let (alone, roots) = graph.extract(&roots);
    let interpreter = Interpreter::new(&alone, &roots);
    let ranges = RangeEvaluator::new(&alone, roots.last().copied().unwrap_or(outputs[0]));
    Hoisted { graph: rest, outputs, uniforms: Uniforms { graph: alone, interpreter, ranges, roots }, image }
}

/// The formula at an instant: what depends on time alone is a number, which has no range.
pub fn at_instant(graph: &Graph, root: Node, time: f64) -> (Graph, Node) {
    let Hoisted { graph, outputs, uniforms, .. } = hoisted(graph, &[root], Outside::Time);
    let values = uniforms.at(time, &[]);
    let mut now = Graph::like(&graph);
    let mut image: Vec<Node> = Vec::with_capacity(graph.len());
    for (node, expr) in graph.nodes() {
        let new = match expr {
            Expr::Uniform(k) => Expr::Constant(values[k as usize].to_bits()),
            _ => expr.map(|operand| image[operand.index()]),
        };
        image.push(now.intern(new, graph.span(node)));
    }
    (now, image[outputs[0].index()])
}
