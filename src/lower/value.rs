//! What an expression of the language can be.

use crate::ir::Node;

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// A number or a field: a number is a field that uses no coordinate.
    Number(Node),
    Vector([Node; 3]),
    Text(String),
    /// A part of it was in error, and that was reported.
    Failed,
}

impl Value {
    /// With its article, for messages.
    pub fn describe(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Vector(_) => "a vector",
            Self::Text(_) => "a text",
            Self::Failed => "nothing",
        }
    }
}
