//! Graphs in 120-digit arithmetic: independent truth for the errors of every program.

pub(super) mod big;
mod evaluate;

pub use evaluate::{Exact, evaluate, evaluate_at};
