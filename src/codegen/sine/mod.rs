//! Sine and cosine as instructions on whole vectors, with the bits of `libm::sin` and `libm::cos`.
//!
//! Formulas of waves spend most of their time in these two functions. So nearly all arguments are computed by
//! a few dozen instructions for all lanes together. They reduce the arguments by multiples of π/2, evaluate
//! the polynomials of K. C. Ng's fdlibm, which `libm` uses, and choose by quadrant. Sine and cosine of one
//! argument share everything but the choice.
//!
//! These instructions are separate functions, compiled once in a process or an object file, which programs
//! call. Inlined they would be no faster, but the program of a gyroid would take five times as long to
//! compile, and meshing compiles many programs for a few cells only.
//!
//! Sources in C have the same operations, from the same constants, see `source::c_waves`.
//!
//! `double` and `single` list the arguments that they leave to `libm`, which is called for vectors that hold
//! one of them.

pub(crate) mod double;
mod functions;
pub(crate) mod quadrants;
pub(crate) mod single;
mod wanted;

pub(super) use functions::{address, define};
pub(super) use wanted::{Wanted, Waves, all, is_wave};
