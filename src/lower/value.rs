//! The values that an expression of the language can have.

use std::sync::Arc;

use crate::ir::Node;

/// The value of an expression.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// A number or a field. A number is a field that uses no coordinate.
    Number(Node),
    /// Three numbers or fields.
    Vector([Node; 3]),
    /// Numbers, vectors or lists in square brackets; three numbers are a vector.
    List(Arc<[Value]>),
    /// A text in quotes.
    Text(String),
    /// No value: a part of the expression was wrong, and that was reported.
    Failed,
}

impl Value {
    /// How many numbers it holds, and how deep lists are nested in it.
    pub fn extent(&self) -> (usize, usize) {
        match self {
            Self::List(members) => members.iter().fold((0, 1), |(count, depth), member| {
                let (inner, below) = member.extent();
                (count + inner, depth.max(below + 1))
            }),
            Self::Vector(_) => (3, 1),
            Self::Number(_) | Self::Text(_) | Self::Failed => (1, 0),
        }
    }

    /// The members of a list or of a vector; `None` for other values.
    pub fn members(&self) -> Option<Arc<[Self]>> {
        match self {
            Self::List(members) => Some(members.clone()),
            Self::Vector(parts) => Some(parts.map(Self::Number).into()),
            Self::Number(_) | Self::Text(_) | Self::Failed => None,
        }
    }

    /// The kind of the value with its article, for messages.
    pub fn describe(&self) -> &'static str {
        match self {
            Self::Number(_) => "a number",
            Self::Vector(_) => "a vector",
            Self::List(_) => "a list",
            Self::Text(_) => "a text",
            Self::Failed => "nothing",
        }
    }
}
