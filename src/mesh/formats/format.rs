//! What every format of meshes has: a name, a line of help and a writer.

use std::io::{self, Write};

use super::super::Mesh;

/// A file format for meshes.
#[derive(Debug, Clone, Copy)]
pub struct Format {
    /// The ending of its files, in lower case and without the dot. It is also the format's name.
    pub ending: &'static str,
    /// What the format holds or is for, as one line of help.
    pub purpose: &'static str,
    /// Writes a mesh in this format.
    pub write: WriteMesh,
    /// Writes a mesh as text, if the format has a text form beside its binary one.
    pub write_text: Option<WriteMesh>,
}

/// Writes a mesh to a stream. Its errors are those of the stream, and the limits of the format.
pub type WriteMesh = fn(&Mesh, &mut dyn Write) -> io::Result<()>;
