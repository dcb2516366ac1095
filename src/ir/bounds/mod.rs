//! What is certain about the values of a graph over a box: ranges, magnitudes, rounding errors.

pub(in crate::ir) mod choice;
pub mod error;
pub mod float;
pub mod magnitude;
pub mod range;
pub mod upper;
