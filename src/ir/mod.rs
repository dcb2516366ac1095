//! The expression graph of ω: typed, interned, each node stored once; its meaning is the interpreter's.
//!
//! A [`Graph`] is a list of operations in which operands come before their uses, so every pass is one loop over
//! it. R-functions are operations of their own (not spelt out in square roots): each consumer chooses its form.
//!
//! Invariant: nothing here knows the syntax or the code generator; equal expressions have equal [`Node`]s.

mod adjoint;
mod along;
mod big;
mod contact;
mod dump;
mod error;
mod eval;
pub mod exact;
mod float;
mod forms;
mod function;
mod function_rules;
mod graph;
mod growth;
mod local;
mod op;
pub mod r0;
mod range;
mod real;
mod sign;
mod taylor;
mod time;
mod twin;
mod upper;

pub use adjoint::{gradient, gradient_and_rate};
pub use along::along;
pub use contact::{contact, wall_velocity};
pub use dump::dump;
pub use error::{Arithmetic, Error, ErrorAnalysis, Inputs};
pub use eval::{Given, Interpreter};
pub use float::FloatType;
pub use forms::{Form, Forms};
pub use function::{BinaryFunction, UnaryFunction};
pub use graph::{Axis, Expr, Graph, Node};
pub use growth::Growth;
pub use local::localised;
pub use op::{Binary, R0, Unary};
pub use range::{Affine, RangeEvaluator, Region, Step as RangeStep};
pub use real::Real;
pub use sign::SignRule;
pub use taylor::{Enclosure, TaylorEvaluator};
pub use time::{Hoisted, Uniforms, hoisted};
pub use twin::twin;
