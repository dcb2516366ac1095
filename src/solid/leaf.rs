//! The leaves of a solid: many, of few shapes. Leaves that differ in their constants alone share one program, so
//! that ten thousand balls are compiled as one.

use std::collections::HashMap;
use std::sync::OnceLock;

use glam::DVec3;

use super::compiled::{LeafProgram, RangeProgram};
use super::programs::Engine;
use crate::codegen;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Expr, Graph, Interpreter, Node, RangeEvaluator};

/// From so many leaves of one shape on, their ranges come from machine code: making it costs as much time as some
/// thousand ranges by the interpreter. Their number decides, not that of the calls, so that the bounds of one leaf
/// never depend on what was asked before.
const MANY_LEAVES: usize = 8;

/// A shape of leaves.
struct Shape {
    graph: Graph,
    root: Node,
    parameters: usize,
    leaves: usize,
    range: RangeEvaluator,
    range_code: OnceLock<Option<RangeProgram>>,
    value: OnceLock<Evaluator>,
    gradient: OnceLock<Evaluator>,
}

struct Evaluator {
    code: Option<LeafProgram>,
    interpreter: Interpreter,
}

struct Leaf {
    shape: u32,
    /// Where its constants begin.
    first: u32,
    /// Whether machine code may answer for its range.
    tame: bool,
}

pub(super) struct Leaves {
    engine: Engine,
    shapes: Vec<Shape>,
    leaves: Vec<Leaf>,
    constants: Vec<f64>,
}

impl Leaves {
    pub fn new(engine: Engine, graph: &Graph, nodes: &[Node]) -> Self {
        let mut known: HashMap<Vec<Expr>, u32> = HashMap::new();
        let mut out = Self { engine, shapes: Vec::new(), leaves: Vec::new(), constants: Vec::new() };
        for &node in nodes {
            let (shape, root, constants) = graph.parametrised(node);
            let next = out.shapes.len() as u32;
            let number = *known.entry(shape.exprs().to_vec()).or_insert(next);
            if number == next {
                out.shapes.push(Shape::new(shape, root, constants.len()));
            }
            let shape = &mut out.shapes[number as usize];
            shape.leaves += 1;
            let tame = codegen::range_stays_finite(&shape.graph, &shape.range, &constants);
            out.leaves.push(Leaf { shape: number, first: out.constants.len() as u32, tame });
            out.constants.extend(constants);
        }
        out
    }

    pub fn len(&self) -> usize {
        self.leaves.len()
    }

    pub fn shapes(&self) -> usize {
        self.shapes.len()
    }

    /// Which shape a leaf has.
    pub fn shape_of(&self, leaf: u32) -> usize {
        self.leaves[leaf as usize].shape as usize
    }

    /// Operations of a leaf's formula, constants and coordinates not counted.
    pub fn operations(&self, leaf: u32) -> usize {
        let (shape, _) = self.of(leaf);
        shape.graph.nodes().filter(|(_, expr)| expr.operands().next().is_some()).count()
    }

    /// An interval that contains the leaf's value at every point of a box.
    pub fn range(&self, leaf: u32, over: &Aabb) -> Interval {
        let (shape, constants) = self.of(leaf);
        let by_code = self.engine != Engine::Interpreter && self.leaves[leaf as usize].tame;
        if by_code && let Some(range) = shape.range_code().and_then(|code| code.call(over, constants)) {
            return range;
        }
        shape.range.eval_with(over, constants)
    }

    fn of(&self, leaf: u32) -> (&Shape, &[f64]) {
        let leaf = &self.leaves[leaf as usize];
        let shape = &self.shapes[leaf.shape as usize];
        let first = leaf.first as usize;
        (shape, &self.constants[first..first + shape.parameters])
    }

    #[inline]
    pub fn value(&self, leaf: u32, p: DVec3) -> f64 {
        let (shape, constants) = self.of(leaf);
        let mut out = [0.0];
        shape.value(self.engine).point(p, constants, &mut out);
        out[0]
    }

    /// Value and gradient.
    pub fn gradient(&self, leaf: u32, p: DVec3) -> (f64, DVec3) {
        let (shape, constants) = self.of(leaf);
        let mut out = [0.0; 4];
        shape.gradient(self.engine).point(p, constants, &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    pub fn values(&self, leaf: u32, points: [&[f64]; 3], out: &mut [f64]) {
        let (shape, constants) = self.of(leaf);
        shape.value(self.engine).many(points, constants, out);
    }
}

impl Shape {
    fn new(graph: Graph, root: Node, parameters: usize) -> Self {
        let range = RangeEvaluator::new(&graph, root);
        let (range_code, value, gradient) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Self { graph, root, parameters, leaves: 0, range, range_code, value, gradient }
    }

    #[inline]
    fn range_code(&self) -> Option<&RangeProgram> {
        if self.leaves < MANY_LEAVES {
            return None;
        }
        let compile = || RangeProgram::with_parameters(&self.graph, self.root, self.parameters).ok();
        self.range_code.get_or_init(compile).as_ref()
    }

    #[inline]
    fn value(&self, engine: Engine) -> &Evaluator {
        self.value.get_or_init(|| Evaluator::new(engine, &self.graph, &[self.root], self.parameters))
    }

    fn gradient(&self, engine: Engine) -> &Evaluator {
        self.gradient.get_or_init(|| {
            let mut graph = self.graph.clone();
            let [x, y, z] = ir::gradient(&mut graph, self.root);
            let (graph, outputs, _) = crate::simplify::simplify(&graph, &[self.root, x, y, z]);
            Evaluator::new(engine, &graph, &outputs, self.parameters)
        })
    }
}

impl Evaluator {
    fn new(engine: Engine, graph: &Graph, outputs: &[Node], parameters: usize) -> Self {
        let code = match engine {
            Engine::Interpreter => None,
            Engine::Auto | Engine::Jit => LeafProgram::compile(graph, outputs, parameters).ok(),
        };
        Self { code, interpreter: Interpreter::new(graph, outputs) }
    }

    #[inline]
    fn point(&self, p: DVec3, constants: &[f64], out: &mut [f64]) {
        match &self.code {
            Some(code) => code.call(p, constants, out),
            None => self.interpreter.eval_with(p.to_array(), constants, out),
        }
    }

    fn many(&self, points: [&[f64]; 3], constants: &[f64], out: &mut [f64]) {
        if let Some(code) = &self.code {
            return code.call_many(points, constants, out);
        }
        for (i, out) in out.iter_mut().enumerate() {
            let p = points.map(|column| column[i]);
            self.interpreter.eval_with(p, constants, std::slice::from_mut(out));
        }
    }
}
