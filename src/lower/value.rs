//! The values that an expression of the language can have.

use crate::ir::Node;

/// The value of an expression.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// A number or a field. A number is a field that uses no coordinate.
    Number(Node),
    /// Three numbers or fields.
    Vector([Node; 3]),
    /// A text in quotes.
    Text(String),
    /// No value: a part of the expression was wrong, and that was reported.
    Failed,
}

impl Value {
    /// The kind of the value with its article, for messages.
    pub fn describe(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Vector(_) => "a vector",
            Self::Text(_) => "a text",
            Self::Failed => "nothing",
        }
    }
}
