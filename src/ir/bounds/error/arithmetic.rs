//! How a node is computed, and what is known of the error of its value.

use crate::ir::form::Forms;
use crate::precision::Precision;

/// How the coordinates of a point reach the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inputs {
    /// They are numbers of the program's type.
    Exact,
    /// They are rounded to it once.
    Rounded,
    /// An origin is subtracted in `f64` before; the constants of the graph were folded with it, see
    /// [`localised`](crate::ir::localised).
    Shifted,
}

/// One way to compute a node.
#[derive(Debug, Clone, Copy)]
pub struct Arithmetic<'a> {
    /// The type of every intermediate result.
    pub precision: Precision,
    /// How R₀ is evaluated.
    pub forms: &'a Forms,
    /// How coordinates reach the program.
    pub inputs: Inputs,
}

/// |computed − exact| ≤ `absolute`, and ≤ `relative`·|exact| + `remainder`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Error {
    /// Bound of |computed − exact|.
    pub absolute: f64,
    /// The part of the other bound that is proportional to |exact|.
    pub relative: f64,
    /// The rest of it, for underflow.
    pub remainder: f64,
}

/// Relative error of a constant that was folded with an origin, see [`localised`](crate::ir::localised).
pub const FOLDING: f64 = 1.0 / (1u64 << 50) as f64;
