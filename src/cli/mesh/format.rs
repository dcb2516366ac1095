//! The formats of meshes, by their names and by the endings of files.

use std::io::{self, Write};
use std::path::Path;

use clap::ValueEnum;

use super::super::Failure;
use crate::mesh::{self, Mesh};

/// A format and its writer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Format {
    /// Triangles as records, for nearly every program
    Stl,
    /// Shared vertices with normals, binary
    Ply,
    /// Shared vertices with normals, text
    Obj,
    /// For ParaView
    Vtp,
    /// For viewers and browsers
    Glb,
    /// For printers
    #[value(name = "3mf")]
    ThreeMf,
    #[value(skip)]
    StlText,
}

impl Format {
    /// The format that a path's ending names.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        Self::from_str(&ending, false).map_err(|_| {
            Failure::usage(format!(
                "cannot tell the mesh format of `{}`: the ending must be .stl, .ply, .obj, .vtp, .glb or .3mf",
                path.display()
            ))
        })
    }

    /// The format as text, if it is asked for.
    pub fn as_text(self, text: bool) -> Result<Self, Failure> {
        match (self, text) {
            (Self::Stl, true) => Ok(Self::StlText),
            (format, false) => Ok(format),
            _ => Err(Self::no_text()),
        }
    }

    pub fn no_text() -> Failure {
        Failure::usage("--ascii is for .stl files: the other formats are text or binary by themselves")
    }

    /// The ending of files of this format.
    pub fn ending(self) -> &'static str {
        match self {
            Self::Stl | Self::StlText => "stl",
            Self::Ply => "ply",
            Self::Obj => "obj",
            Self::Vtp => "vtp",
            Self::Glb => "glb",
            Self::ThreeMf => "3mf",
        }
    }

    pub fn write(self, mesh: &Mesh, mut out: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Stl => mesh::stl::write(mesh, &mut out),
            Self::Ply => mesh::ply::write(mesh, &mut out),
            Self::Obj => mesh::obj::write(mesh, &mut out),
            Self::Vtp => mesh::vtp::write(mesh, &mut out),
            Self::Glb => mesh::glb::write(mesh, &mut out),
            Self::ThreeMf => mesh::threemf::write(mesh, &mut out),
            Self::StlText => mesh::stl::write_ascii(mesh, &mut out),
        }
    }
}
