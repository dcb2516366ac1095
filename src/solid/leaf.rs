//! The leaves of a solid: many, of few shapes. Leaves that differ in their constants alone share one program, so
//! that ten thousand balls are compiled as one.

use std::collections::HashMap;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use smallvec::SmallVec;

use super::compiled::{LeafProgram, RangeProgram};
use super::prefix::{self, Word};
use super::programs::Engine;
use crate::codegen;
use crate::field::Path;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{
    self, Enclosure, EnclosureEvaluator, Expr, Given, Graph, Hoisted, Interpreter, Node, RangeEvaluator,
    Region, Uniforms,
};

/// From so many leaves of one shape on, their ranges come from machine code: making it costs as much time as some
/// thousand ranges by the interpreter. Their number decides, not that of the calls, so that the bounds of one leaf
/// never depend on what was asked before.
const MANY_LEAVES: usize = 8;

/// A shape of leaves.
struct Shape {
    /// What depends on time alone was taken out of it.
    graph: Graph,
    root: Node,
    parameters: usize,
    leaves: usize,
    /// Nothing for a leaf at rest.
    motion: Option<Motion>,
    range: RangeEvaluator,
    range_code: OnceLock<Option<RangeProgram>>,
    value: OnceLock<Evaluator>,
    gradient: OnceLock<Evaluator>,
    contact: OnceLock<Evaluator>,
    /// Coefficients along a path, if the leaf is a polynomial of degree two at most.
    along: OnceLock<Option<Evaluator>>,
    taylor: OnceLock<EnclosureEvaluator>,
}

/// What is peculiar to leaves that move.
struct Motion {
    /// The leaf as a formula of time.
    graph: Graph,
    root: Node,
    uniforms: Uniforms,
    /// With these uniforms, as the graph of the shape.
    velocity: (Graph, Vec<Node>),
    velocity_code: OnceLock<Evaluator>,
}

struct Evaluator {
    code: Option<LeafProgram>,
    interpreter: Interpreter,
}

struct Leaf {
    shape: u32,
    /// Where its constants begin.
    first: u32,
    /// Where the numbers begin that depend on time alone.
    first_uniform: u32,
    /// Whether machine code may answer for its range; of leaves that move [`Ranges`] says it.
    tame: bool,
}

/// The leaves of a solid at all times.
pub(super) struct Store {
    engine: Engine,
    shapes: Vec<Shape>,
    leaves: Vec<Leaf>,
    constants: Vec<f64>,
    uniforms: usize,
}

/// The leaves during a stretch of time: values are those at its end, ranges hold all of it.
pub(super) struct Leaves {
    store: Arc<Store>,
    from: f64,
    to: f64,
    /// What depends on time alone, at the end.
    uniforms: Vec<f64>,
    ranges: OnceLock<Ranges>,
}

/// What depends on time alone, during the stretch.
struct Ranges {
    uniforms: Vec<Interval>,
    /// The same numbers, for machine code.
    pairs: Vec<[f64; 2]>,
    /// Of leaves that move: whether machine code may answer for their range.
    tame: Vec<bool>,
}

/// Numbers of one leaf that depend on time alone.
type Uniform = SmallVec<[f64; 16]>;

impl Store {
    pub fn new(engine: Engine, graph: &Graph, nodes: &[Node]) -> Self {
        let mut known: HashMap<Vec<Expr>, u32> = HashMap::new();
        let (shapes, leaves, constants) = (Vec::new(), Vec::new(), Vec::new());
        let mut out = Self { engine, shapes, leaves, constants, uniforms: 0 };
        for &node in nodes {
            let (shape, root, constants) = graph.parametrised(node);
            let next = out.shapes.len() as u32;
            let number = *known.entry(shape.exprs().to_vec()).or_insert(next);
            if number == next {
                out.shapes.push(Shape::new(shape, root, constants.len()));
            }
            let shape = &mut out.shapes[number as usize];
            shape.leaves += 1;
            let still = shape.motion.is_none();
            let tame = still && shape.range_stays_finite(&constants, &[]);
            let (first, first_uniform) = (out.constants.len() as u32, out.uniforms as u32);
            out.leaves.push(Leaf { shape: number, first, first_uniform, tame });
            out.constants.extend(constants);
            out.uniforms += shape.uniforms();
        }
        out
    }

    fn of(&self, leaf: u32) -> (&Shape, &[f64]) {
        let leaf = &self.leaves[leaf as usize];
        let shape = &self.shapes[leaf.shape as usize];
        let first = leaf.first as usize;
        (shape, &self.constants[first..first + shape.parameters])
    }

    /// The leaves that move, with their shapes and constants.
    fn moving(&self) -> impl Iterator<Item = (usize, &Shape, &Motion, &[f64])> {
        (0..self.leaves.len()).filter_map(|i| {
            let (shape, constants) = self.of(i as u32);
            Some((i, shape, shape.motion.as_ref()?, constants))
        })
    }

    /// The leaves during a stretch of time.
    pub fn during(self: &Arc<Self>, from: f64, to: f64) -> Leaves {
        let mut uniforms = vec![0.0; self.uniforms];
        if self.uniforms > 0 {
            for (i, shape, motion, constants) in self.moving() {
                let first = self.leaves[i].first_uniform as usize;
                motion.uniforms.fill(to, constants, &mut uniforms[first..first + shape.uniforms()]);
            }
        }
        Leaves { store: self.clone(), from, to, uniforms, ranges: OnceLock::new() }
    }
}

impl Leaves {
    /// Whether a leaf depends on time.
    pub fn moves(&self, leaf: u32) -> bool {
        self.store.of(leaf).0.motion.is_some()
    }

    fn of(&self, leaf: u32) -> (&Shape, &[f64], &[f64]) {
        let (shape, constants) = self.store.of(leaf);
        let first = self.store.leaves[leaf as usize].first_uniform as usize;
        (shape, constants, &self.uniforms[first..first + shape.uniforms()])
    }

    fn ranges(&self) -> &Ranges {
        self.ranges.get_or_init(|| {
            let time = Interval::new(self.from.min(self.to), self.from.max(self.to));
            let mut uniforms = Vec::with_capacity(self.store.uniforms);
            let mut tame: Vec<bool> = self.store.leaves.iter().map(|leaf| leaf.tame).collect();
            for (i, shape, motion, constants) in self.store.moving() {
                let own = motion.uniforms.over(time, constants);
                tame[i] = shape.range_stays_finite(constants, &own);
                uniforms.extend(own);
            }
            let pairs = uniforms.iter().map(|u| [u.lo, u.hi]).collect();
            Ranges { uniforms, pairs, tame }
        })
    }

    pub fn len(&self) -> usize {
        self.store.leaves.len()
    }

    pub fn shapes(&self) -> usize {
        self.store.shapes.len()
    }

    /// Which shape a leaf has.
    pub fn shape_of(&self, leaf: u32) -> usize {
        self.store.leaves[leaf as usize].shape as usize
    }

    /// Operations of a leaf's formula, constants and coordinates not counted.
    pub fn operations(&self, leaf: u32) -> usize {
        let (shape, ..) = self.of(leaf);
        let graph = shape.motion.as_ref().map_or(&shape.graph, |motion| &motion.graph);
        graph.nodes().filter(|(_, expr)| expr.operands().next().is_some()).count()
    }

    /// An interval that contains the leaf's value at every point of a box, at all times of the stretch.
    pub fn range(&self, leaf: u32, over: &Aabb) -> Interval {
        let (shape, constants, uniforms) = self.of(leaf);
        if uniforms.is_empty() {
            let by_code = self.store.engine != Engine::Interpreter && self.store.leaves[leaf as usize].tame;
            if by_code
                && let Some(range) = shape.range_code().and_then(|code| code.call(over, constants, &[]))
            {
                return range;
            }
            return shape.range.eval_with(&Region { parameters: constants, ..Region::of(over) });
        }
        let ranges = self.ranges();
        let first = self.store.leaves[leaf as usize].first_uniform as usize;
        let own = first..first + uniforms.len();
        let by_code = self.store.engine != Engine::Interpreter && ranges.tame[leaf as usize];
        if by_code
            && let Some(code) = shape.range_code()
            && let Some(range) = code.call(over, constants, &ranges.pairs[own.clone()])
        {
            return range;
        }
        let uniforms = &ranges.uniforms[own];
        shape.range.eval_with(&Region { parameters: constants, uniforms, ..Region::of(over) })
    }

    #[inline]
    pub fn value(&self, leaf: u32, p: DVec3) -> f64 {
        let (shape, constants, uniforms) = self.of(leaf);
        let mut out = [0.0];
        shape.value(self.store.engine).point(p, constants, uniforms, &mut out);
        out[0]
    }

    /// Value and gradient.
    pub fn gradient(&self, leaf: u32, p: DVec3) -> (f64, DVec3) {
        self.gradient_along(leaf, p, 1.0)
    }

    /// Value and gradient after a part of the stretch of time.
    pub fn gradient_along(&self, leaf: u32, p: DVec3, part: f64) -> (f64, DVec3) {
        let (shape, constants, at_end) = self.of(leaf);
        let mut uniforms = Uniform::from_slice(at_end);
        if let Some(motion) = &shape.motion
            && part < 1.0
        {
            motion.uniforms.fill(self.from + part * (self.to - self.from), constants, &mut uniforms);
        }
        let mut out = [0.0; 4];
        shape.gradient(self.store.engine).point(p, constants, &uniforms, &mut out);
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

    /// Whether a tree in prefix form is surely negative all over a box, at all times of the stretch.
    pub fn is_negative(&self, words: &[u32], over: &Aabb) -> bool {
        let negative = prefix::is_negative(words, &mut 0, &mut |leaf, negated| {
            let range = self.range(leaf, over);
            (range != Interval::ALL).then_some(if negated { range.lo > 0.0 } else { range.hi < 0.0 })
        });
        negative == Some(true)
    }

    /// Distance, outward normal and mean curvature, see `ir::contact`.
    #[inline]
    pub fn contact(&self, leaf: u32, p: DVec3) -> [f64; 5] {
        let (shape, constants, uniforms) = self.of(leaf);
        let mut out = [0.0; 5];
        shape.contact(self.store.engine).point(p, constants, uniforms, &mut out);
        out
    }

    /// Velocity of the leaf's surface along its normal, see `ir::wall_velocity`.
    pub fn velocity(&self, leaf: u32, p: DVec3) -> DVec3 {
        let (shape, constants, uniforms) = self.of(leaf);
        let Some(motion) = &shape.motion else { return DVec3::ZERO };
        let mut out = [0.0; 3];
        motion.velocity(shape, self.store.engine).point(p, constants, uniforms, &mut out);
        DVec3::from_array(out)
    }

    pub fn values(&self, leaf: u32, points: [&[f64]; 3], out: &mut [f64]) {
        let (shape, constants, uniforms) = self.of(leaf);
        shape.value(self.store.engine).many(points, constants, uniforms, out);
    }

    /// What a leaf is along the whole path, passed during the stretch of time, if it is a polynomial of degree two at most.
    pub fn along(&self, leaf: u32, negated: bool, from: DVec3, to: DVec3) -> Option<Enclosure> {
        let (shape, constants, _) = self.of(leaf);
        let program = shape.along(self.store.engine)?;
        let mut parameters: SmallVec<[f64; 16]> = SmallVec::from_slice(constants);
        parameters.extend_from_slice(&(to - from).to_array());
        parameters.extend_from_slice(&[self.to - self.from, self.from]);
        let mut out = [0.0; 6];
        program.point(from, &parameters, &[], &mut out);
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
        let (shape, constants, _) = self.of(leaf);
        let (graph, root) = shape.formula();
        let taylor = shape.taylor.get_or_init(|| EnclosureEvaluator::new(graph, root));
        let (from, to) = (path.from.extend(self.from).to_array(), path.to.extend(self.to).to_array());
        let found = taylor.enclose(from, to, stretch, constants);
        if negated {
            Enclosure { coefficients: found.coefficients.map(|c| -c), range: -found.range }
        } else {
            found
        }
    }
}

impl Motion {
    #[inline]
    fn velocity(&self, shape: &Shape, engine: Engine) -> &Evaluator {
        let (graph, outputs) = &self.velocity;
        let make = || Evaluator::new(engine, graph, outputs, shape.parameters);
        self.velocity_code.get_or_init(make)
    }
}

impl Shape {
    fn new(graph: Graph, root: Node, parameters: usize) -> Self {
        let (graph, root, motion) = if graph.uses_time(root) {
            let mut all = graph.clone();
            let [x, y, z] = ir::wall_velocity(&mut all, root);
            let (all, outputs, _) = crate::simplify::simplify(&all, &[root, x, y, z]);
            let Hoisted { graph: rest, outputs, uniforms, .. } = ir::hoisted(&all, &outputs);
            let velocity = rest.extract(&outputs[1..]);
            let motion = Motion { graph, root, uniforms, velocity, velocity_code: OnceLock::new() };
            let (rest, root) = rest.extract_cone(outputs[0]);
            (rest, root, Some(motion))
        } else {
            (graph, root, None)
        };
        let range = RangeEvaluator::new(&graph, root);
        let (range_code, value, gradient) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        let (contact, along, taylor) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Self {
            graph,
            root,
            parameters,
            leaves: 0,
            motion,
            range,
            range_code,
            value,
            gradient,
            contact,
            along,
            taylor,
        }
    }

    /// How many numbers of it depend on time alone.
    #[inline]
    fn uniforms(&self) -> usize {
        self.motion.as_ref().map_or(0, |motion| motion.uniforms.len())
    }

    /// Whether machine code may answer for the range of a leaf with these numbers.
    fn range_stays_finite(&self, parameters: &[f64], uniforms: &[Interval]) -> bool {
        let numbers = Region { parameters, uniforms, ..Region::of(&Aabb::EMPTY) };
        codegen::range_stays_finite(&self.graph, &self.range, numbers)
    }

    /// The leaf as a formula of place and time.
    fn formula(&self) -> (&Graph, Node) {
        self.motion.as_ref().map_or((&self.graph, self.root), |motion| (&motion.graph, motion.root))
    }

    #[inline]
    fn range_code(&self) -> Option<&RangeProgram> {
        // those of a leaf that moves are asked for again and again
        if self.leaves < MANY_LEAVES && self.motion.is_none() {
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
            let (graph, root) = self.formula();
            let mut graph = graph.clone();
            let outputs = ir::polynomial_on_path(&mut graph, root, self.parameters as u32)?;
            let (graph, outputs, _) = crate::simplify::simplify(&graph, &outputs);
            Some(Evaluator::new(engine, &graph, &outputs, self.parameters + 5))
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
    fn point(&self, p: DVec3, constants: &[f64], uniforms: &[f64], out: &mut [f64]) {
        match &self.code {
            Some(code) => code.call(p, constants, uniforms, out),
            None => self.interpret(p.to_array(), constants, uniforms, out),
        }
    }

    fn many(&self, points: [&[f64]; 3], constants: &[f64], uniforms: &[f64], out: &mut [f64]) {
        if let Some(code) = &self.code {
            return code.call_many(points, constants, uniforms, out);
        }
        for (i, out) in out.iter_mut().enumerate() {
            let p = points.map(|column| column[i]);
            self.interpret(p, constants, uniforms, std::slice::from_mut(out));
        }
    }

    fn interpret(&self, p: [f64; 3], parameters: &[f64], uniforms: &[f64], out: &mut [f64]) {
        self.interpreter.eval_given(Given { parameters, uniforms, ..Given::point(p) }, out);
    }
}
