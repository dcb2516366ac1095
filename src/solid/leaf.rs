//! The leaves of a solid: many, of few shapes. Leaves that differ in their constants alone share one program, so
//! that ten thousand balls are compiled as one.

use std::collections::HashMap;
use std::sync::OnceLock;

use glam::DVec3;

use smallvec::SmallVec;

use super::compiled::{LeafProgram, RangeProgram};
use super::prefix::Word;
use super::programs::Engine;
use crate::codegen;
use crate::field::Path;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{self, Enclosure, Expr, Graph, Interpreter, Node, RangeEvaluator, TaylorEvaluator};

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
    contact: OnceLock<Evaluator>,
    /// Coefficients along a path, if the leaf is a polynomial of degree two at most.
    along: OnceLock<Option<Evaluator>>,
    taylor: OnceLock<TaylorEvaluator>,
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

    /// The smallest or largest leaf of a tree in prefix form, as it says, and which it is, with whether it is negated;
    /// NaN if any leaf is.
    pub fn decide(&self, words: &[u32], at: &mut usize, p: DVec3) -> (f64, (u32, bool)) {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                let value = self.value(leaf, p);
                return (if negated { -value } else { value }, (leaf, negated));
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let mut best = self.decide(words, at, p);
        for _ in 1..parts {
            let next = self.decide(words, at, p);
            let wins = if all { next.0 < best.0 } else { next.0 > best.0 };
            if wins || next.0.is_nan() {
                best = next;
            }
        }
        best
    }

    /// Distance, outward normal and mean curvature, see `ir::contact`.
    #[inline]
    pub fn contact(&self, leaf: u32, p: DVec3) -> [f64; 5] {
        let (shape, constants) = self.of(leaf);
        let mut out = [0.0; 5];
        shape.contact(self.engine).point(p, constants, &mut out);
        out
    }

    pub fn values(&self, leaf: u32, points: [&[f64]; 3], out: &mut [f64]) {
        let (shape, constants) = self.of(leaf);
        shape.value(self.engine).many(points, constants, out);
    }

    /// What a leaf is along the whole path, if it is a polynomial of degree two at most.
    pub fn along(&self, leaf: u32, negated: bool, from: DVec3, to: DVec3) -> Option<Enclosure> {
        let (shape, constants) = self.of(leaf);
        let program = shape.along(self.engine)?;
        let mut parameters: SmallVec<[f64; 16]> = SmallVec::from_slice(constants);
        parameters.extend_from_slice(&(to - from).to_array());
        let mut out = [0.0; 6];
        program.point(from, &parameters, &mut out);
        let [a, b, c, d, e, f] = out;
        let coefficients = [(a, d), (b, e), (c, f)].map(|(value, error)| {
            let value = if negated { -value } else { value };
            // an error of zero says that the value is exact
            if error == 0.0 {
                Interval::new(value, value)
            } else {
                Interval::new((value - error).next_down(), (value + error).next_up())
            }
        });
        Some(Enclosure { coefficients, range: Interval::ALL })
    }

    /// An enclosure of a leaf over a part of a path.
    pub fn enclose(&self, leaf: u32, negated: bool, path: &Path, stretch: (f64, f64)) -> Enclosure {
        let (shape, constants) = self.of(leaf);
        let taylor = shape.taylor.get_or_init(|| TaylorEvaluator::new(&shape.graph, shape.root));
        let found = taylor.enclose(path.from.to_array(), path.to.to_array(), stretch, constants);
        if negated {
            Enclosure { coefficients: found.coefficients.map(|c| -c), range: -found.range }
        } else {
            found
        }
    }
}

impl Shape {
    fn new(graph: Graph, root: Node, parameters: usize) -> Self {
        let range = RangeEvaluator::new(&graph, root);
        let (range_code, value, gradient) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        let (contact, along, taylor) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Self {
            graph,
            root,
            parameters,
            leaves: 0,
            range,
            range_code,
            value,
            gradient,
            contact,
            along,
            taylor,
        }
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
    fn contact(&self, engine: Engine) -> &Evaluator {
        self.contact.get_or_init(|| {
            let mut graph = self.graph.clone();
            let outputs = ir::contact(&mut graph, self.root);
            let (graph, outputs, _) = crate::simplify::simplify(&graph, &outputs);
            Evaluator::new(engine, &graph, &outputs, self.parameters)
        })
    }

    fn along(&self, engine: Engine) -> Option<&Evaluator> {
        let make = || {
            let mut graph = self.graph.clone();
            let outputs = ir::along(&mut graph, self.root, self.parameters as u32)?;
            let (graph, outputs, _) = crate::simplify::simplify(&graph, &outputs);
            Some(Evaluator::new(engine, &graph, &outputs, self.parameters + 3))
        };
        self.along.get_or_init(make).as_ref()
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
