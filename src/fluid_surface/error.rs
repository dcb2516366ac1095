//! Why a file cannot be read.

use std::fmt;

/// Why a file is no frame.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameError {
    /// The file is not an XML document, or one of another kind. The text says what was found.
    NotPolyData(String),
    /// The file stores arrays in a way that cannot be read. The text names it.
    Unsupported(String),
    /// Something is missing. The text names it.
    Missing(&'static str),
    /// A number or a block cannot be read. The text names it.
    Malformed(&'static str),
    /// The file ends before its data.
    Truncated,
    /// The array has another length than the piece states.
    Count {
        /// The number of coordinates that the piece states.
        expected: usize,
        /// The number of coordinates in the array.
        found: usize,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotPolyData(found) => write!(f, "it is not VTK PolyData: {found}"),
            Self::Unsupported(what) => write!(f, "{what} cannot be read; write it without"),
            Self::Missing(what) => write!(f, "it has no {what}"),
            Self::Malformed(what) => write!(f, "{what} cannot be read"),
            Self::Truncated => write!(f, "it ends before its data: it was cut off"),
            Self::Count { expected, found } => {
                write!(f, "it should have {expected} coordinates and has {found}")
            }
        }
    }
}

impl std::error::Error for FrameError {}
