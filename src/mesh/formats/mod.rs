//! Meshes as files: one file of this folder for each format, and the table of all formats.
//!
//! Coordinates are in metres with z up, and triangles run counter-clockwise as seen from the fluid. Normals are
//! written where the format has them.
//!
//! The command line takes its help, its messages and its writers from [`FORMATS`]. A new format is a file here with a
//! constant `FORMAT`, and its line in the table.

use std::io::{self, Write};

use super::Mesh;

pub mod glb;
pub mod obj;
pub mod ply;
pub mod stl;
pub mod threemf;
pub mod vtp;

/// All formats, in the order in which help and messages name them.
pub static FORMATS: &[Format] =
    &[stl::FORMAT, ply::FORMAT, obj::FORMAT, vtp::FORMAT, glb::FORMAT, threemf::FORMAT];

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
