//! The expression graph of ω: typed, interned, each node stored once; its meaning is the interpreter's.
//!
//! A [`Graph`] is a list of operations in which operands come before their uses, so every pass is one loop
//! over it. R-functions are operations of their own (not spelt out in square roots): each consumer chooses
//! its form.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | `graph`, `op`, `function`, `r0`, `form` | the graph, its operations, the forms in which R₀ is computed |
//! | `lookup` | fields that are looked up in a table |
//! | `interpreter` | the meaning of a graph |
//! | `parametrised` | a graph whose constants are parameters |
//! | `derived` | graphs made of a graph: gradient, contact, sign twin, what depends on time alone; and its rigid motion |
//! | `bounds` | ranges, magnitudes and rounding errors over boxes |
//! | `contraction` | boxes made smaller around the points at which a formula is positive |
//! | `on_path` | what is known of a leaf along a straight path |
//! | `exact` | true values, to 120 digits |
//! | `function_rules` | what all of these need to know of a function of the mathematical library |
//!
//! Invariant: nothing here knows the syntax or the code generator; equal expressions have equal [`Node`]s.

mod bounds;
mod contraction;
mod derived;
mod dump;
pub mod exact;
mod form;
mod function;
mod function_rules;
mod graph;
mod interpreter;
mod lookup;
mod on_path;
mod op;
mod parametrised;
pub mod r0;
mod real;

pub(crate) use bounds::choice::{Choice, choosing_numbers};
pub use bounds::error::{Arithmetic, Error, ErrorAnalysis, Inputs};
pub use bounds::float::FloatType;
pub use bounds::magnitude::Magnitudes;
pub use bounds::range::RangeEvaluator;
pub(crate) use bounds::range::{
    Affine, Limits, RangeRule, Region, SQUARES_OVERFLOW, SQUARES_UNDERFLOW, WEIGHT_ROUNDING,
};
pub(crate) use contraction::{
    Contracted, Contractor, LinearForm, SURFACE_ROUNDING, Wanted, close_reach, contract_linear,
    contract_linear_around, cube_around, is_nowhere_positive, reach,
};
pub(crate) use derived::contact::{contact, wall_velocity};
pub(crate) use derived::forward::forward_gradient;
pub(crate) use derived::framed::{Framed, framed};
pub use derived::gradient::gradient;
pub use derived::gradient::gradient_and_rate;
pub(crate) use derived::hoisted::{Hoisted, Outside, Uniforms, at_instant, hoisted};
pub use derived::localised::localised;
pub(crate) use derived::rigid::RigidMotion;
pub(crate) use derived::sign::SignRule;
pub(crate) use derived::trust::{Trust, TrustKind, is_far_away};
pub(crate) use derived::twin::twin;
pub use dump::dump;
pub use form::{Form, Forms};
pub use function::{BinaryFunction, UnaryFunction};
pub use graph::{Axis, Expr, Graph, Node};
pub use interpreter::{Given, Interpreter};
pub use lookup::{Lookup, Part, Tables};
pub(crate) use on_path::enclosure::{Enclosure, EnclosureEvaluator};
pub(crate) use on_path::polynomial::polynomial_on_path;
pub(crate) use op::R0;
pub use op::{Binary, Unary};
pub(crate) use parametrised::Scalar;
pub use real::Real;
