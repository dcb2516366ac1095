//! Text → [`Ast`].
//!
//! Invariant: the parser generator's types never leave this module, and nothing is concluded here: no name is
//! looked up, no number computed. Every node carries its span.

pub mod ast;
mod build;
mod parse;
mod print;

pub use ast::Ast;
pub use parse::{EDITION, parse};
pub use print::print;
