//! `rfm` compiles obstacles written as R-functions into machine code for ω(x, y, z) and ∇ω, and gives them to
//! a mesher, a fluid solver, pictures and other programs.
//!
//! ```text
//! source text ─ syntax ─▶ Ast ─ lower ─▶ ir::Graph ─ simplify ─▶ ir::Graph ─ codegen ─▶ Solid
//!                                                                                        │
//!                                       slice · mesh · sph · render · your own program ◀─┘
//! ```
//!
//! Each stage is a function from data to data, and what it makes can be printed (`rfm explain --show …`). The
//! consumers know only the traits [`Field`] and [`field::Walls`], never the compiler.
//!
//! Sign convention, everywhere: **ω > 0 inside the obstacle, 0 on its surface, < 0 in the fluid**; the
//! outward unit normal is −∇ω/|∇ω|.
//!
//! What a program that embeds obstacles uses:
//!
//! | module | what it has |
//! |---|---|
//! | [`Program`], [`Solid`], [`solid`] | a file, compiled; ω, ∇ω, signs, contacts, ranges, paths, cell maps |
//! | [`compile`] | what a file defines, as data: params, solids, scenes with their fluids, obstacles and probes |
//! | [`field`] | the traits [`Field`] and [`field::Walls`], which closures may implement as well |
//! | [`mesh`], [`mod@slice`], [`render`], [`fluid_surface`] | meshes, plots, pictures, surfaces of fluids |
//! | [`view`] | a page for a browser that shows particles and meshes |
//! | [`source`] | a solid as source text: C, CUDA, Rust, WGSL, GLSL |
//! | [`files`] | where the files come from that a file names |
//! | [`Experiment`], [`experiment`], [`sph`] | scenes, and the fluid solver without them |
//! | [`diagnostic`] | messages with their places in a file |
//! | [`geom`], [`interval`], [`precision`], [`quantity`] | boxes, guaranteed ranges, number types, units |
//!
//! With `default-features = false` a program that embeds the library does not compile the command line.
//!
//! The stages of the compiler (`syntax`, `ir`, `lower`, `simplify`, `codegen`) are not part of the interface,
//! but for what [`compile`] shows of them: they are reachable for this package's own program, tests and
//! benches, and change without notice. The commands (`cli`) belong to the program `rfm` and not to this
//! library.

#![warn(missing_docs)]

pub mod compile;
pub mod diagnostic;
pub mod experiment;
pub mod field;
pub mod files;
pub mod fluid_surface;
pub mod geom;
pub mod interval;
pub mod mesh;
pub mod precision;
pub mod quantity;
pub mod render;
pub mod slice;
pub mod solid;
pub mod source;
pub mod sph;
pub mod view;

mod heights;
mod lettering;
mod random;
mod table;
mod triangles;

#[doc(hidden)]
pub mod codegen;
#[doc(hidden)]
pub mod ir;
#[doc(hidden)]
pub mod lower;
#[doc(hidden)]
pub mod simplify;
#[doc(hidden)]
pub mod syntax;

pub use compile::{Error, Program};
pub use experiment::Experiment;
pub use field::Field;
pub use glam;
pub use precision::Precision;
pub use solid::{Engine, Solid};
