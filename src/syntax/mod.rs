//! From text to [`Ast`].
//!
//! Invariant: the parser generator's types never leave this module, and it concludes nothing: it looks up no
//! name and computes no number. Every node carries its span.

pub mod ast;
mod build;
mod parse;
mod print;

pub use ast::Ast;
pub use parse::{EDITION, parse};
pub use print::print;
