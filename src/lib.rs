//! `rfm` compiles obstacles written as R-functions into machine code for ω(x, y, z) and ∇ω, and gives them to a
//! mesher, a fluid solver, pictures and other programs.
//!
//! ```text
//! source text ─ syntax ─▶ Ast ─ lower ─▶ ir::Graph ─ simplify ─▶ ir::Graph ─ codegen ─▶ Solid
//!                                                                                        │
//!                                       slice · mesh · sph · render · your own program ◀─┘
//! ```
//!
//! Each stage is a function from data to data, and what it makes can be printed (`rfm explain --show …`). The
//! consumers know only the [`field::Field`] trait, never the compiler.
//!
//! Sign convention, everywhere: **ω > 0 inside the obstacle, 0 on its surface, < 0 in the fluid**; the outward
//! unit normal is −∇ω/|∇ω|.

pub mod cli;
pub mod codegen;
pub mod compile;
pub mod diagnostic;
pub mod experiment;
pub mod field;
pub mod fluid_surface;
pub mod geom;
pub mod interval;
pub mod ir;
mod lettering;
pub mod lower;
pub mod mesh;
pub mod render;
pub mod simplify;
pub mod slice;
pub mod solid;
pub mod sph;
pub mod syntax;

pub use compile::{Error, Program};
pub use experiment::Experiment;
pub use field::Field;
pub use glam;
pub use solid::{Engine, Solid};
