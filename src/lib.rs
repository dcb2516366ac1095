//! `rfm` compiles obstacles written as R-functions into machine code for ω(x, y, z) and ∇ω.

pub mod field;
pub mod geom;
pub mod interval;
pub mod sph;

pub use glam;
