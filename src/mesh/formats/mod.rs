//! Meshes as files: each format has a writer of its own.
//!
//! Coordinates are metres with z up, triangles counter-clockwise seen from the fluid. Normals are written where the
//! format has them.

pub mod glb;
pub mod obj;
pub mod ply;
pub mod stl;
pub mod threemf;
pub mod vtp;
