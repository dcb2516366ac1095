//! The interpreter: the meaning of a graph, the oracle of the tests, and the engine where no machine code may
//! run.

use std::cell::RefCell;

use crate::ir::form::{Form, Forms};
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::lookup::Tables;
use crate::ir::real::Real;

/// A graph with its outputs, evaluated operation by operation in `f64` or `f32`.
#[derive(Debug, Clone)]
pub struct Interpreter {
    /// Operations, and the form of each in `f64` and in `f32`.
    steps: Vec<(Expr, [Form; 2])>,
    outputs: Vec<Node>,
    tables: Tables,
}

/// The numbers that a graph is evaluated for.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a, T> {
    /// x, y and z.
    pub point: [T; 3],
    /// Seconds.
    pub time: T,
    /// See [`Expr::Parameter`].
    pub parameters: &'a [T],
    /// See [`Expr::Uniform`].
    pub uniforms: &'a [T],
}

impl<T: Real> Given<'_, T> {
    /// A point alone: time is not a number, and neither are parameters.
    pub fn point(point: [T; 3]) -> Self {
        Self { point, time: T::from_f64(f64::NAN), parameters: &[], uniforms: &[] }
    }
}

thread_local! {
    // values of the nodes of one evaluation: kept, so that an evaluation does not allocate
    static SCRATCH_64: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
    static SCRATCH_32: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
}

impl Interpreter {
    /// With R₀ in its stable form.
    pub fn new(graph: &Graph, outputs: &[Node]) -> Self {
        let stable = Forms::all(Form::Stable);
        Self::with_forms(graph, outputs, [&stable, &stable])
    }

    /// With R₀ in the forms given for `f64` and for `f32`.
    pub fn with_forms(graph: &Graph, outputs: &[Node], forms: [&Forms; 2]) -> Self {
        let step = |expr| match expr {
            Expr::Binary(_, a, b) => (expr, forms.map(|forms| forms.of(a, b))),
            expr => (expr, [Form::Stable; 2]),
        };
        let steps = graph.nodes().map(|(_, expr)| step(expr)).collect();
        Self { steps, outputs: outputs.to_vec(), tables: graph.tables().clone() }
    }

    /// All outputs at a point; `out` is as long as the outputs.
    pub fn eval_f64(&self, point: [f64; 3], out: &mut [f64]) {
        self.eval_given(Given::point(point), out);
    }

    /// All outputs at a point, for a graph with parameters.
    pub fn eval_with(&self, point: [f64; 3], parameters: &[f64], out: &mut [f64]) {
        self.eval_given(Given { parameters, ..Given::point(point) }, out);
    }

    /// All outputs for all that a graph may ask for.
    pub fn eval_given(&self, given: Given<'_, f64>, out: &mut [f64]) {
        SCRATCH_64.with_borrow_mut(|scratch| self.eval(0, given, scratch, out));
    }

    /// All outputs, every operation carried out in `f32`.
    pub fn eval_f32(&self, point: [f32; 3], out: &mut [f32]) {
        self.eval_given_f32(Given::point(point), out);
    }

    /// [`Interpreter::eval_given`] in `f32`.
    pub fn eval_given_f32(&self, given: Given<'_, f32>, out: &mut [f32]) {
        SCRATCH_32.with_borrow_mut(|scratch| self.eval(1, given, scratch, out));
    }

    fn eval<T: Real>(&self, precision: usize, given: Given<'_, T>, values: &mut Vec<T>, out: &mut [T]) {
        let number = |list: &[T], i: u32| list.get(i as usize).copied().unwrap_or(T::from_f64(f64::NAN));
        values.clear();
        for &(expr, forms) in &self.steps {
            let value = match expr {
                Expr::Constant(bits) => T::from_f64(f64::from_bits(bits)),
                Expr::Coordinate(Axis::X) => given.point[0],
                Expr::Coordinate(Axis::Y) => given.point[1],
                Expr::Coordinate(Axis::Z) => given.point[2],
                Expr::Coordinate(Axis::T) => given.time,
                Expr::Parameter(i) => number(given.parameters, i),
                Expr::Uniform(i) => number(given.uniforms, i),
                Expr::Unary(op, a) => op.eval(values[a.index()]),
                Expr::Binary(op, a, b) => forms[precision].eval(op, values[a.index()], values[b.index()]),
                Expr::Lookup(lookup, at) => lookup.eval(&self.tables, at.map(|node| values[node.index()])),
            };
            values.push(value);
        }
        for (out, node) in out.iter_mut().zip(&self.outputs) {
            *out = values[node.index()];
        }
    }
}
