//! Sine and cosine as instructions on whole vectors, with the bits of `libm::sin` and `libm::cos`.
//!
//! Formulas of waves spend most of their time in these two functions. So nearly all arguments are answered by a few
//! dozen instructions for all lanes together: reduced by multiples of π/2, put into the polynomials of
//! K. C. Ng's fdlibm, which is what `libm` computes, and chosen by quadrant. Sine and cosine of one argument share all
//! but the choice.
//!
//! These instructions are functions of their own, compiled once in a process or an object file, and programs
//! call them. In place they would be no faster, but the program of a gyroid would take five times as long to
//! compile, and meshing compiles many that it uses for a few cells only.
//!
//! `double` and `single` say which arguments they leave to `libm`. It is called for a vector that holds one of them.

mod double;
mod functions;
mod quadrants;
mod single;
mod wanted;

pub(super) use functions::{address, define};
pub(super) use wanted::{Wanted, Waves, all, is_wave};
