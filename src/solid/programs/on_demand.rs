//! The programs of one graph: made on first use, for each precision and shape, with the interpreter behind
//! them.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

use super::block_program::BlockProgram;
use super::compiled::{BatchProgram, PointProgram};
use super::number::{Number, UniformValues};
use crate::codegen::{CodegenError, Form, Forms, Precision};
use crate::ir::{
    self, Axis, Binary, Expr, Graph, Hoisted, Interpreter, Magnitudes, Node, Outside, Unary, Uniforms,
};
use crate::solid::engine::Engine;

/// Where a program gives NaN although its formula might not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Guard {
    /// Where a coordinate is not finite: such a point is neither inside nor outside.
    Infinite,
    /// Where a coordinate is not finite, and beyond the distances for which `ir::twin` has proven that leaves
    /// are numbers (f32: 4e9, f64: 1e77).
    FarAway,
}

/// The forms of `f64` and of `f32`: the stable one gives way to the scaled one where squares may leave the
/// range.
pub fn forms(graph: &Graph, form: Form) -> [Forms; 2] {
    if form != Form::Stable {
        return [Forms::all(form), Forms::all(form)];
    }
    let magnitudes = Magnitudes::within_reach(graph);
    [Precision::F64, Precision::F32].map(|precision| magnitudes.forms(graph, form, precision))
}

type Slot<P> = OnceLock<Result<P, CodegenError>>;

/// Graphs with more nodes than this are answered by their program over blocks for single points too: one
/// program of 500 balls (4 500 nodes) takes some 30 ms to be made, which pays only for very many single
/// points.
const LARGE: usize = 1500;

/// After so many single points they have cost what the program for them takes to be made, for a graph of up to
/// [`HUGE`] nodes. A block computes sixteen points at least.
const MANY_POINTS: u32 = 4096;

/// What it takes grows faster than the graph: there are no programs for single points of larger ones.
const HUGE: usize = 16_000;

/// The compiled programs of one precision.
pub struct Compiled<T> {
    point: Slot<PointProgram<T>>,
    batch: Slot<Many<T>>,
    /// Single points that the program over blocks has answered for.
    points: AtomicU32,
}

/// What answers for many points.
enum Many<T> {
    /// One loop with all operations in it.
    Loop(Box<BatchProgram<T>>),
    /// Step by step, for graphs with R₀ or with many leaves.
    Blocks(BlockProgram<T>),
}

/// A type that solids have programs for: `f32` or `f64`.
pub trait Lane: Number {
    /// The programs that compute with it.
    #[doc(hidden)]
    fn compiled(programs: &Programs) -> &Compiled<Self>;
}

impl Lane for f32 {
    #[inline]
    fn compiled(programs: &Programs) -> &Compiled<Self> {
        &programs.single
    }
}

impl Lane for f64 {
    #[inline]
    fn compiled(programs: &Programs) -> &Compiled<Self> {
        &programs.double
    }
}

impl<T> Compiled<T> {
    fn new() -> Self {
        Self { point: OnceLock::new(), batch: OnceLock::new(), points: AtomicU32::new(0) }
    }
}

/// A graph with its outputs and all that evaluates it.
pub struct Programs {
    pub graph: Graph,
    pub outputs: Vec<Node>,
    /// How R₀ is evaluated in `f64` and in `f32`.
    forms: [Forms; 2],
    pub interpreter: Interpreter,
    /// What depends on time alone, or on parameters; `None` if the solid is at rest and has none.
    pub uniforms: Option<Uniforms>,
    double: Compiled<f64>,
    single: Compiled<f32>,
}

impl Programs {
    pub fn new(graph: Graph, outputs: Vec<Node>, guard: Guard, form: Form) -> Self {
        let forms = forms(&graph, form);
        Self::with_forms(graph, outputs, guard, forms)
    }

    /// With the forms of R₀ in `f64` and in `f32`.
    pub fn with_forms(mut graph: Graph, outputs: Vec<Node>, guard: Guard, mut forms: [Forms; 2]) -> Self {
        let moves = outputs.iter().any(|&output| graph.uses_time(output));
        let mut axes = Axis::SPACE.map(|axis| graph.coordinate(axis)).to_vec();
        if moves {
            axes.push(graph.coordinate(Axis::T));
        }
        let sum = |graph: &mut Graph, axes: &[Node]| {
            axes[1..].iter().fold(axes[0], |sum, &axis| graph.binary(Binary::Add, sum, axis))
        };
        let size = match guard {
            Guard::Infinite => sum(&mut graph, &axes),
            Guard::FarAway => {
                let magnitudes: Vec<Node> = axes.iter().map(|&c| graph.unary(Unary::Abs, c)).collect();
                let size = sum(&mut graph, &magnitudes);
                let square = graph.binary(Binary::Mul, size, size);
                graph.binary(Binary::Mul, square, square) // overflows where it should
            }
        };
        let guard = graph.binary(Binary::Sub, size, size); // 0, or NaN
        let outputs: Vec<Node> = match outputs[..] {
            [root] => vec![guarded(&mut graph, root, guard, &mut forms)],
            _ => outputs.into_iter().map(|output| graph.binary(Binary::Add, output, guard)).collect(),
        };
        // what the guard has replaced is no longer computed
        let used = graph.reachable(&outputs);
        let (graph, outputs) = graph.extract(&outputs);
        let forms = forms.map(|forms| forms.kept(&used, &graph));
        let (graph, outputs, forms, uniforms) = if moves || graph.uses_parameters(&outputs) {
            let Hoisted { graph, outputs, uniforms, image } =
                ir::hoisted(&graph, &outputs, Outside::TimeAndParameters);
            let forms = forms.map(|forms| forms.mapped(|node| image[node.index()]));
            (graph, outputs, forms, Some(uniforms))
        } else {
            (graph, outputs, forms, None)
        };
        let interpreter = Interpreter::with_forms(&graph, &outputs, forms.each_ref());
        let (double, single) = (Compiled::new(), Compiled::new());
        Self { graph, outputs, forms, interpreter, uniforms, double, single }
    }

    /// What depends on time alone, at one time.
    pub fn uniforms_at(&self, time: f64) -> UniformValues {
        let Some(uniforms) = &self.uniforms else { return UniformValues::NONE };
        let double = uniforms.at(time, &[]);
        let single = double.iter().map(|&value| value as f32).collect();
        UniformValues { double, single }
    }

    /// The forms of R₀ in one precision.
    pub fn forms(&self, precision: Precision) -> &Forms {
        match precision {
            Precision::F64 => &self.forms[0],
            Precision::F32 => &self.forms[1],
        }
    }

    #[inline]
    fn point_program<T: Lane>(&self) -> Result<&PointProgram<T>, CodegenError> {
        let slot = &T::compiled(self).point;
        slot.get_or_init(|| PointProgram::compile(&self.graph, &self.outputs, self.forms(T::PRECISION)))
            .as_ref()
            .map_err(Clone::clone)
    }

    fn batch_program<T: Lane>(&self) -> Result<&Many<T>, CodegenError> {
        let compile = || match BlockProgram::compile(&self.graph, &self.outputs, self.forms(T::PRECISION))? {
            Some(program) => Ok(Many::Blocks(program)),
            None => BatchProgram::compile(&self.graph, &self.outputs, self.forms(T::PRECISION))
                .map(Box::new)
                .map(Many::Loop),
        };
        T::compiled(self).batch.get_or_init(compile).as_ref().map_err(Clone::clone)
    }

    /// The program over blocks of a graph too large for one of single points.
    #[inline]
    fn large_program<T: Lane>(&self) -> Option<&BlockProgram<T>> {
        if self.graph.len() <= LARGE {
            return None;
        }
        match self.batch_program() {
            Ok(Many::Blocks(program)) => Some(program),
            _ => None,
        }
    }

    /// Whether a program for single points pays for a graph that is answered by its program over blocks. One more
    /// point is counted.
    fn has_many_points<T: Lane>(&self) -> bool {
        let points = &T::compiled(self).points;
        self.graph.len() <= HUGE
            && (points.load(Ordering::Relaxed) >= MANY_POINTS
                || points.fetch_add(1, Ordering::Relaxed) >= MANY_POINTS)
    }

    /// Makes the program for single points now, rather than when it is first asked for.
    ///
    /// # Errors
    /// If no machine code can be made here.
    pub fn require_machine_code(&self) -> Result<(), CodegenError> {
        match self.large_program::<f64>() {
            Some(_) => Ok(()),
            None => self.point_program::<f64>().map(|_| ()),
        }
    }

    pub fn is_compiled(&self, engine: Engine) -> bool {
        engine != Engine::Interpreter && self.require_machine_code().is_ok()
    }

    /// All outputs at a point. Inlined, so that a point made of three loose numbers is not written to memory
    /// and read back as a vector: that stalls for longer than the whole program takes.
    #[inline]
    pub fn point<T: Lane>(&self, engine: Engine, uniforms: &UniformValues, p: [T; 3], out: &mut [T]) {
        let uniforms = T::uniforms(uniforms);
        if engine == Engine::Interpreter {
            T::interpret(&self.interpreter, p, uniforms, out);
        } else if let Some(program) = self.large_program::<T>().filter(|_| !self.has_many_points::<T>()) {
            program.call_one(p, uniforms, out);
        } else if let Ok(program) = self.point_program::<T>() {
            program.call(p, uniforms, out);
        } else {
            T::interpret(&self.interpreter, p, uniforms, out);
        }
    }

    /// All outputs at many points.
    pub fn batch<T: Lane, const N: usize>(
        &self,
        engine: Engine,
        uniforms: &UniformValues,
        points: [&[T]; 3],
        mut out: [&mut [T]; N],
    ) {
        let uniforms = T::uniforms(uniforms);
        if engine != Engine::Interpreter
            && let Ok(program) = self.batch_program::<T>()
        {
            match program {
                Many::Loop(program) => program.call(points, uniforms, out),
                Many::Blocks(program) => program.call(points, uniforms, out),
            }
            return;
        }
        let mut one = [T::default(); N];
        for i in 0..points[0].len() {
            T::interpret(&self.interpreter, points.map(|column| column[i]), uniforms, &mut one);
            for (column, value) in out.iter_mut().zip(one) {
                column[i] = value;
            }
        }
    }
}

/// The root with a guard, 0 or NaN, in it. Below R₀, which hands a NaN on from either operand, adding it to
/// one leaf costs less than adding it to the result. Pairs of operands that become others keep their forms.
fn guarded(graph: &mut Graph, root: Node, guard: Node, forms: &mut [Forms; 2]) -> Node {
    let mut above = Vec::new();
    let mut node = root;
    while let Expr::Binary(op @ (Binary::And | Binary::Or), first, second) = graph.expr(node) {
        above.push((op, second, forms.each_ref().map(|forms| forms.of(first, second))));
        node = first;
    }
    let leaf = graph.binary(Binary::Add, node, guard);
    above.into_iter().rev().fold(leaf, |below, (op, other, form)| {
        forms.iter_mut().zip(form).for_each(|(forms, form)| forms.set(below, other, form));
        graph.binary(op, below, other)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Program;
    use glam::DVec3;

    /// A large formula is answered by blocks at first and by a program for single points later, with the same bits.
    #[test]
    fn many_single_points_of_a_large_formula_have_the_bits_of_the_first() {
        let text = "rfm 1\nsolid s = any i in 0..250: ball([0.3*i, random(1, i), 0], 0.2)";
        let program = Program::from_source("t.rfm", text).unwrap();
        let [auto, interpreted] =
            [Engine::Auto, Engine::Interpreter].map(|engine| program.solid_with("s", engine).unwrap());
        let at = |i: u32| DVec3::new(0.01 * f64::from(i), 0.3 + 1e-4 * f64::from(i), 0.1);
        for i in 0..MANY_POINTS + 100 {
            let found = auto.omega_grad(at(i));
            if !(50..=MANY_POINTS).contains(&i) {
                assert_eq!(found, interpreted.omega_grad(at(i)), "point {i}");
            }
        }
    }
}
