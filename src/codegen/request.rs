//! A request for compilation: a graph, its outputs, and the shape of the function.

use cranelift_codegen::ir::Value;

use crate::ir::{Forms, Graph, Node};
use crate::precision::Precision;

/// The rounding of the processor while a range program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Rounding {
    /// Towards +∞, as set by the caller.
    Upward,
    /// To nearest, as everywhere else.
    Nearest,
}

/// The shape of a program's call. Pointers to parameters and uniforms, if it takes any, come last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// `fn(x, y, z, out: *mut T)`: the outputs at one point, one after the other.
    Point,
    /// `fn(columns: *const *mut T, blocks: usize)`: columns x, y, z, then one per input and one per output,
    /// all of them `blocks` × [`Precision::lanes`] long, without requirements of alignment.
    Batch,
    /// `fn(box: *const [f64; 6], out: *mut [f64; 2])`: the range of the one output over a box, called with
    /// this rounding. For `f64` only, and only for graphs that `range_is_supported` accepts.
    Range(Rounding),
    /// The ranges of several outputs, called like [`Shape::Range`]. All but the first are derivatives of the
    /// first, and NaN where it may jump.
    Slopes(Rounding),
}

/// A request for compilation.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    /// The graph. Only the nodes that the outputs need are computed.
    pub graph: &'a Graph,
    /// Nodes that a batch program reads from columns instead of computing them; other shapes have none.
    pub inputs: &'a [Node],
    /// The nodes whose values are wanted.
    pub outputs: &'a [Node],
    /// The type of the numbers.
    pub precision: Precision,
    /// The shape of the program's call.
    pub shape: Shape,
    /// The form in which R₀ is evaluated.
    pub forms: &'a Forms,
    /// Whether the function takes one more argument, a pointer to the parameters of the graph.
    pub parameters: bool,
    /// Whether it takes another one after that, a pointer to the graph's uniforms: numbers of the program's
    /// type, or for ranges pairs of bounds. No program knows time itself, see
    /// `ir::hoisted`.
    pub uniforms: bool,
}

impl Precision {
    /// Points in a block of the batch program.
    pub const fn lanes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 2,
        }
    }
}

/// The pointers to parameters and uniforms, if a program has them, from its last arguments.
pub(super) fn pointers(request: Request<'_>, last: &[Value]) -> [Option<Value>; 2] {
    let parameters = if request.parameters { last.first() } else { None };
    let uniforms = if request.uniforms { last.last() } else { None };
    [parameters.copied(), uniforms.copied()]
}
