//! What every format of meshes has: a name, a line of help and a writer.

use std::io::{self, Write};

use super::super::Mesh;
use super::unit::LengthUnit;

/// A file format for meshes.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// The ending of its files, in lower case and without the dot. It is also the format's name.
    pub ending: &'static str,
    /// What the format holds or is for, as one line of help.
    pub purpose: &'static str,
    /// Whether its numbers are always metres.
    pub only_metres: bool,
    /// Whether coordinates are rounded to single precision.
    pub single: bool,
    /// Writes a mesh in this format.
    pub write: WriteMesh,
    /// Writes a mesh as text, if the format has a text form beside its binary one.
    pub write_text: Option<WriteMesh>,
}

/// Writes a mesh to a stream, in a unit. Its errors are those of the stream, the limits of the format, and
/// [`io::ErrorKind::InvalidInput`] for another unit than metres if the format has no other.
pub type WriteMesh = fn(&Mesh, LengthUnit, &mut dyn Write) -> io::Result<()>;

/// Refuses another unit than metres for a format that knows no other.
pub(super) fn in_metres(unit: LengthUnit) -> io::Result<()> {
    if unit == LengthUnit::METRE {
        return Ok(());
    }
    Err(io::Error::new(
        io::ErrorKind::InvalidInput,
        format!("the format is in metres, not in {}", unit.plural),
    ))
}
