//! Why a slice could not be drawn.

use std::{fmt, io};

use super::Window;

/// Why a slice could not be drawn.
#[derive(Debug)]
pub enum SliceError {
    /// The window has no area or is not finite.
    Window(Window),
    /// The number of samples along the longer side is outside 2 ..= 8192.
    Resolution(usize),
    /// A picture with this many pixels per unit of the drawing cannot be made.
    Scale(f32),
    /// The rasteriser refused the drawing. For drawings of this module that is a bug of ours.
    Drawing(String),
    /// The output could not be written.
    Io(io::Error),
}

impl fmt::Display for SliceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Window(Window { min, max }) => {
                write!(
                    f,
                    "nothing to draw in the window {min} .. {max}: expected finite sides longer than zero"
                )
            }
            Self::Resolution(samples) => write!(f, "{samples} samples along a side: expected 2 to 8192"),
            Self::Scale(scale) => write!(f, "cannot draw {scale} pixels per unit: expected 0.1 to 16"),
            Self::Drawing(reason) => write!(f, "the drawing is not valid: {reason}"),
            Self::Io(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for SliceError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        if let Self::Io(error) = self { Some(error) } else { None }
    }
}

impl From<io::Error> for SliceError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
