//! A shape of leaves: those that differ in their constants alone, and so share their programs.

use std::sync::OnceLock;

use glam::DVec3;

use super::pieces::Pieces;
use crate::codegen;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{
    self, Binary, Contractor, EnclosureEvaluator, Expr, Given, Graph, Hoisted, Interpreter, Node, Outside,
    RangeEvaluator, Region, Trust, Unary, Uniforms,
};
use crate::simplify::simplify;
use crate::solid::engine::Engine;
use crate::solid::programs::compiled::{LeafProgram, RangeProgram};

/// From this number of leaves of one shape on, their ranges come from machine code; compiling takes as long
/// as about a thousand ranges by the interpreter. The number of leaves decides, not that of the calls, so
/// that the bounds of a leaf never depend on what was asked before.
const MANY_LEAVES: usize = 8;

/// If all leaves of a shape together have at least this many operations, machine code pays for callers that
/// ask for some ten thousand ranges, as the search for thin parts and the cell map do.
const MANY_OPERATIONS: usize = 24;

/// What a function of the library costs, in operations.
const OPERATIONS_OF_A_CALL: usize = 8;

/// How many ranges are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// A few for each leaf.
    Few,
    /// The number that a grid of cells needs.
    Many,
}

/// A shape of leaves.
pub struct Shape {
    /// What depends on time alone was taken out of it.
    pub graph: Graph,
    root: Node,
    pub parameters: usize,
    pub leaves: usize,
    /// What a range costs, in operations.
    operations: usize,
    /// `None` for a leaf at rest.
    pub motion: Option<Motion>,
    pub range: RangeEvaluator,
    range_code: OnceLock<Option<RangeProgram>>,
    value: OnceLock<Evaluator>,
    gradient: OnceLock<Evaluator>,
    contact: OnceLock<Evaluator>,
    trust: OnceLock<Trust>,
    /// Coefficients along a path, if the leaf is a polynomial of degree two at most.
    polynomial: OnceLock<Option<Evaluator>>,
    enclosures: OnceLock<EnclosureEvaluator>,
    slopes: OnceLock<Option<SlopeProgram>>,
    pieces: OnceLock<Option<Pieces>>,
    contractor: OnceLock<Contractor>,
}

/// Ranges of a shape's derivatives by machine code.
pub struct SlopeProgram {
    graph: Graph,
    ranges: RangeEvaluator,
    code: RangeProgram,
}

impl SlopeProgram {
    /// `None` where it does not pay, and where only the interpreter knows the operations.
    fn new(shape: &Shape, engine: Engine) -> Option<Self> {
        if engine == Engine::Interpreter || shape.motion.is_some() || !shape.pays(Demand::Many) {
            return None;
        }
        let mut graph = shape.graph.clone();
        // what reverse mode does not know: which operand is chosen, and lengths that vanish
        let needs_forward_mode = |expr: &Expr| match expr {
            Expr::Unary(Unary::Sqrt, _) => true,
            Expr::Binary(op, ..) => {
                matches!(op, Binary::Min | Binary::PlainMin | Binary::Max | Binary::PlainMax)
            }
            Expr::Unary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => false,
        };
        let (graph, roots) = if graph.exprs().iter().any(needs_forward_mode) {
            let [x, y, z] = ir::forward_gradient(&mut graph, shape.root);
            graph.extract(&[shape.root, x, y, z])
        } else {
            // reverse mode has fewer operations
            let [x, y, z] = ir::gradient(&mut graph, shape.root);
            let (graph, roots, _) = simplify(&graph, &[shape.root, x, y, z]);
            (graph, roots)
        };
        let function = *roots.first()?;
        let code = RangeProgram::of_slopes(&graph, roots.try_into().ok()?, shape.parameters).ok()?;
        let ranges = RangeEvaluator::new(&graph, function);
        Some(Self { graph, ranges, code })
    }

    /// Whether it may answer for a leaf at rest with these numbers.
    pub fn is_tame(&self, parameters: &[f64]) -> bool {
        let numbers = Region { parameters, ..Region::of(&Aabb::EMPTY) };
        codegen::range_stays_finite(&self.graph, &self.ranges, numbers)
    }

    /// Enclosures of the derivatives of a tame leaf over a box; `None` if it reaches too far out, or the leaf may
    /// jump or be undefined there.
    pub fn over(&self, over: &Aabb, parameters: &[f64]) -> Option<[Interval; 3]> {
        let [_, x, y, z] = self.code.call_all(over, parameters, &[])?;
        Some([x, y, z])
    }
}

/// What is peculiar to leaves that move.
pub struct Motion {
    /// The leaf as a formula of time.
    pub graph: Graph,
    root: Node,
    pub uniforms: Uniforms,
    /// With these uniforms, as the graph of the shape.
    velocity: (Graph, Vec<Node>),
    velocity_code: OnceLock<Evaluator>,
}

pub struct Evaluator {
    code: Option<LeafProgram>,
    interpreter: Interpreter,
}

/// What a node costs, in operations.
fn operations(expr: &Expr) -> usize {
    match expr {
        Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_) => 0,
        Expr::Unary(Unary::Call(_), _) | Expr::Binary(Binary::Call(_), ..) | Expr::Lookup(..) => {
            OPERATIONS_OF_A_CALL
        }
        Expr::Unary(..) | Expr::Binary(..) => 1,
    }
}

impl Motion {
    #[inline]
    pub fn velocity(&self, shape: &Shape, engine: Engine) -> &Evaluator {
        let (graph, outputs) = &self.velocity;
        let make = || Evaluator::new(engine, graph, outputs, shape.parameters);
        self.velocity_code.get_or_init(make)
    }
}

impl Shape {
    pub fn new(graph: Graph, root: Node, parameters: usize) -> Self {
        let (graph, root, motion) = if graph.uses_time(root) {
            let mut all = graph.clone();
            let [x, y, z] = ir::wall_velocity(&mut all, root);
            let (all, outputs, _) = simplify(&all, &[root, x, y, z]);
            let Hoisted { graph: rest, outputs, uniforms, .. } = ir::hoisted(&all, &outputs, Outside::Time);
            let velocity = rest.extract(&outputs[1..]);
            let motion = Motion { graph, root, uniforms, velocity, velocity_code: OnceLock::new() };
            let (rest, root) = rest.extract_cone(outputs[0]);
            (rest, root, Some(motion))
        } else {
            (graph, root, None)
        };
        let range = RangeEvaluator::new(&graph, root);
        let operations = graph.exprs().iter().map(operations).sum();
        let (range_code, value, gradient) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        let (contact, polynomial, enclosures) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        let slopes = OnceLock::new();
        Self {
            graph,
            root,
            parameters,
            leaves: 0,
            operations,
            motion,
            range,
            range_code,
            value,
            gradient,
            contact,
            trust: OnceLock::new(),
            polynomial,
            enclosures,
            slopes,
            pieces: OnceLock::new(),
            contractor: OnceLock::new(),
        }
    }

    /// How many numbers of it depend on time alone.
    #[inline]
    pub fn uniforms(&self) -> usize {
        self.motion.as_ref().map_or(0, |motion| motion.uniforms.len())
    }

    /// Whether machine code may answer for the range of a leaf with these numbers.
    pub fn range_stays_finite(&self, parameters: &[f64], uniforms: &[Interval]) -> bool {
        let numbers = Region { parameters, uniforms, ..Region::of(&Aabb::EMPTY) };
        codegen::range_stays_finite(&self.graph, &self.range, numbers)
    }

    /// The leaf as a formula of place and time.
    pub fn formula(&self) -> (&Graph, Node) {
        self.motion.as_ref().map_or((&self.graph, self.root), |motion| (&motion.graph, motion.root))
    }

    /// Whether ranges come from machine code.
    pub fn pays(&self, demand: Demand) -> bool {
        match demand {
            // those of a leaf that moves are needed again and again
            Demand::Few => self.leaves >= MANY_LEAVES || self.motion.is_some(),
            Demand::Many => self.leaves * self.operations >= MANY_OPERATIONS || self.pays(Demand::Few),
        }
    }

    #[inline]
    pub fn range_code(&self, demand: Demand) -> Option<&RangeProgram> {
        if !self.pays(demand) {
            return None;
        }
        let compile = || RangeProgram::with_parameters(&self.graph, self.root, self.parameters).ok();
        self.range_code.get_or_init(compile).as_ref()
    }

    #[inline]
    pub fn contact(&self, engine: Engine) -> &Evaluator {
        self.contact.get_or_init(|| {
            let mut graph = self.graph.clone();
            let outputs = ir::contact(&mut graph, self.root);
            let (graph, outputs, _) = simplify(&graph, &outputs);
            Evaluator::new(engine, &graph, &outputs, self.parameters)
        })
    }

    /// How far the estimates of its contacts can be trusted.
    #[inline]
    pub fn trust(&self) -> &Trust {
        self.trust.get_or_init(|| Trust::of(&self.graph, self.root))
    }

    /// Coefficients along a path and their errors; `None` unless the leaf is a polynomial of degree two at
    /// most.
    pub fn polynomial(&self, engine: Engine) -> Option<&Evaluator> {
        let make = || {
            let (graph, root) = self.formula();
            let mut graph = graph.clone();
            let outputs = ir::polynomial_on_path(&mut graph, root, self.parameters as u32)?;
            let (graph, outputs, _) = simplify(&graph, &outputs);
            Some(Evaluator::new(engine, &graph, &outputs, self.parameters + 5))
        };
        self.polynomial.get_or_init(make).as_ref()
    }

    /// Enclosures along paths.
    pub fn enclosures(&self) -> &EnclosureEvaluator {
        self.enclosures.get_or_init(|| {
            let (graph, root) = self.formula();
            EnclosureEvaluator::new(graph, root)
        })
    }

    /// Ranges of the derivatives by machine code, where it pays.
    pub fn slopes(&self, engine: Engine) -> Option<&SlopeProgram> {
        self.slopes.get_or_init(|| SlopeProgram::new(self, engine)).as_ref()
    }

    /// The formula between its jumps; `None` without jumps, and for leaves that move.
    pub fn pieces(&self) -> Option<&Pieces> {
        let make = || match self.motion {
            Some(_) => None,
            None => Pieces::new(&self.graph, self.root, self.parameters),
        };
        self.pieces.get_or_init(make).as_ref()
    }

    /// Derivatives over boxes, and what makes boxes smaller around the points where a leaf is positive.
    pub fn contractor(&self) -> &Contractor {
        self.contractor.get_or_init(|| Contractor::new(&self.graph, self.root))
    }

    #[inline]
    pub fn value(&self, engine: Engine) -> &Evaluator {
        self.value.get_or_init(|| Evaluator::new(engine, &self.graph, &[self.root], self.parameters))
    }

    pub fn gradient(&self, engine: Engine) -> &Evaluator {
        self.gradient.get_or_init(|| {
            let mut graph = self.graph.clone();
            let [x, y, z] = ir::gradient(&mut graph, self.root);
            let (graph, outputs, _) = simplify(&graph, &[self.root, x, y, z]);
            Evaluator::new(engine, &graph, &outputs, self.parameters)
        })
    }
}

impl Evaluator {
    pub fn new(engine: Engine, graph: &Graph, outputs: &[Node], parameters: usize) -> Self {
        let code = match engine {
            Engine::Interpreter => None,
            Engine::Auto | Engine::Jit => LeafProgram::compile(graph, outputs, parameters).ok(),
        };
        Self { code, interpreter: Interpreter::new(graph, outputs) }
    }

    #[inline]
    pub fn point(&self, p: DVec3, constants: &[f64], uniforms: &[f64], out: &mut [f64]) {
        match &self.code {
            Some(code) => code.call(p, constants, uniforms, out),
            None => self.interpret(p.to_array(), constants, uniforms, out),
        }
    }

    /// All outputs at many points.
    pub fn many<const N: usize>(
        &self,
        points: [&[f64]; 3],
        constants: &[f64],
        uniforms: &[f64],
        mut out: [&mut [f64]; N],
    ) {
        if let Some(code) = &self.code {
            return code.call_many(points, constants, uniforms, out);
        }
        for i in 0..points[0].len() {
            let mut found = [0.0; N];
            self.interpret(points.map(|column| column[i]), constants, uniforms, &mut found);
            out.iter_mut().zip(found).for_each(|(column, value)| column[i] = value);
        }
    }

    pub fn interpret(&self, p: [f64; 3], parameters: &[f64], uniforms: &[f64], out: &mut [f64]) {
        self.interpreter.eval_given(Given { parameters, uniforms, ..Given::point(p) }, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;

    /// Ranges of the slopes of min(x + y, 1.25·x + y, 4 − |z|) by machine code, where it may be either of the
    /// first two.
    #[test]
    fn slopes_of_a_minimum_are_those_of_either_operand() {
        let mut graph = Graph::default();
        let [x, y, z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let [steep, four] = [1.25, 4.0].map(|number| graph.constant(number));
        let steeper = graph.binary(Binary::Mul, steep, x);
        let [a, b] = [x, steeper].map(|along| graph.binary(Binary::Add, along, y));
        let size = graph.unary(Unary::Abs, z);
        let lid = graph.binary(Binary::Sub, four, size);
        let smaller = graph.binary(Binary::Min, a, b);
        let root = graph.binary(Binary::Min, smaller, lid);
        let (graph, root) = graph.extract_cone(root);
        let mut shape = Shape::new(graph, root, 0);
        shape.leaves = MANY_LEAVES;
        let Some(program) = shape.slopes(Engine::Auto) else {
            // where there is no code generator the interpreter answers
            return assert!(RangeProgram::with_parameters(&shape.graph, root, 0).is_err());
        };
        assert!(program.is_tame(&[]));
        let over = |low: f64, high: f64| Aabb::new(DVec3::splat(low), DVec3::splat(high));
        let holds = |found: Interval, low: f64, high: f64| {
            let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
            near(found.lo, low) && near(found.hi, high)
        };
        // both of the first two, and never the third
        let slopes = program.over(&over(-1.0, 1.0), &[]).unwrap();
        assert!(holds(slopes[0], 1.0, 1.25) && holds(slopes[1], 1.0, 1.0), "{slopes:?}");
        assert!(holds(slopes[2], 0.0, 0.0), "{slopes:?}");
        // the first one alone, and the second one
        let small = |x: f64| Aabb::new(DVec3::new(x, 0.0, 0.0), DVec3::new(x + 0.1, 0.01, 0.01));
        let slopes = [small(1.0), small(-1.1)].map(|over| program.over(&over, &[]).unwrap());
        assert!(holds(slopes[0][0], 1.0, 1.0) && holds(slopes[1][0], 1.25, 1.25), "{slopes:?}");
        // all three
        let slopes = program.over(&over(-4.0, 4.0), &[]).unwrap();
        assert!(
            holds(slopes[0], 0.0, 1.25) && holds(slopes[1], 0.0, 1.0) && holds(slopes[2], -1.0, 1.0),
            "{slopes:?}"
        );
    }
}
