//! Meshes as files: one file of this folder for each format, and the table of all formats.
//!
//! Coordinates are in metres, or in another unit where a format leaves the unit open. z points up, and
//! triangles run counter-clockwise as seen from the fluid. Normals are written where the format has them.
//!
//! The command line takes its help, its messages and its writers from [`FORMATS`]. A new format is a file
//! here with a constant `FORMAT`, declared as a module and listed in the table.

mod creases;
mod format;
pub mod glb;
pub mod obj;
pub mod ply;
pub mod stl;
pub mod threemf;
mod unit;
pub mod vtp;

pub use creases::split_creases;
pub use format::{Format, WriteMesh};
pub use unit::LengthUnit;

/// All formats, in the order in which help and messages name them.
pub static FORMATS: &[Format] =
    &[stl::FORMAT, ply::FORMAT, obj::FORMAT, vtp::FORMAT, glb::FORMAT, threemf::FORMAT];
