//! From text to [`Ast`], and to the same text in its layout.
//!
//! Invariant: the parser generator's types never leave this module, and it concludes nothing: it looks up no
//! name and computes no number. Every node carries its span.

pub mod ast;
mod block_form;
mod brackets;
mod build;
mod code;
pub mod foreign;
mod format;
mod grammar;
mod parse;
mod print;
mod slips;
mod tokens;
mod words;

pub use ast::Ast;
pub use block_form::block_form;
pub use format::{Spelling, format};
pub use grammar::EDITION;
pub use parse::parse;
pub use print::print;
pub use words::KEYWORDS;
