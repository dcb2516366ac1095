//! The grammar as the parser generator reads it, and the limits of what it accepts.

use pest_derive::Parser;

#[derive(Parser)]
#[grammar = "grammar/rfm.pest"]
pub(super) struct Grammar;

/// The newest edition of the language that this program reads.
pub const EDITION: u32 = 1;

/// The most levels of an expression's tree: what the recursive stages can take on any stack.
pub(super) const DEEPEST_TREE: usize = 500;
