//! The interpreter: the meaning of a graph, the oracle of the tests, and the engine where no machine code may run.

use std::cell::RefCell;

use super::graph::{Axis, Expr, Graph, Node};
use super::real::Real;

/// A graph with its outputs, evaluated operation by operation in `f64` or `f32`.
#[derive(Debug, Clone)]
pub struct Interpreter {
    exprs: Vec<Expr>,
    outputs: Vec<Node>,
}

thread_local! {
    // values of the nodes of one evaluation: kept, so that an evaluation does not allocate
    static SCRATCH_64: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
    static SCRATCH_32: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
}

impl Interpreter {
    pub fn new(graph: &Graph, outputs: &[Node]) -> Self {
        Self { exprs: graph.nodes().map(|(_, expr)| expr).collect(), outputs: outputs.to_vec() }
    }

    /// All outputs at a point; `out` is as long as the outputs.
    pub fn eval_f64(&self, point: [f64; 3], out: &mut [f64]) {
        SCRATCH_64.with_borrow_mut(|scratch| self.eval(point, &[], scratch, out));
    }

    /// All outputs at a point, for a graph with parameters.
    pub fn eval_with(&self, point: [f64; 3], parameters: &[f64], out: &mut [f64]) {
        SCRATCH_64.with_borrow_mut(|scratch| self.eval(point, parameters, scratch, out));
    }

    /// All outputs, every operation carried out in `f32`.
    pub fn eval_f32(&self, point: [f32; 3], out: &mut [f32]) {
        SCRATCH_32.with_borrow_mut(|scratch| self.eval(point, &[], scratch, out));
    }

    fn eval<T: Real>(&self, point: [T; 3], parameters: &[T], values: &mut Vec<T>, out: &mut [T]) {
        values.clear();
        for &expr in &self.exprs {
            let value = match expr {
                Expr::Constant(bits) => T::from_f64(f64::from_bits(bits)),
                Expr::Coordinate(Axis::X) => point[0],
                Expr::Coordinate(Axis::Y) => point[1],
                Expr::Coordinate(Axis::Z) => point[2],
                Expr::Parameter(i) => parameters.get(i as usize).copied().unwrap_or(T::from_f64(f64::NAN)),
                Expr::Unary(op, a) => op.eval(values[a.index()]),
                Expr::Binary(op, a, b) => op.eval(values[a.index()], values[b.index()]),
            };
            values.push(value);
        }
        for (out, node) in out.iter_mut().zip(&self.outputs) {
            *out = values[node.index()];
        }
    }
}
