//! Certified rounding errors: a bound of |computed ω − exact ω| for every point of a box.
//!
//! This is forward analysis, one operation after the other. Each node has a range of its exact values
//! (`ir::bounds::range`) and an [`Error`]: an absolute bound, and beside it a relative one with a tiny
//! remainder for underflow, |computed − exact| ≤ ρ·|exact| + α. The latter alone survives products, sums of
//! squares and their roots near zero. An operation hands on the errors of its operands through its
//! derivatives over the box and adds its own rounding:
//!
//! - R₀ hands them on through its weights, 1 ∓ u/√(u² + v²), which lie in [0, 2] and depend on the direction
//!   of (u, v) only, so the worst over two ranges is known from the directions of their corners; and because
//!   R₀ is homogeneous of degree 1 with Σ wᵢ|uᵢ| ≤ √2·|ω|, relative errors grow by √2 at most.
//! - R₀'s own rounding, with u the unit roundoff: stable form 4u·|ω|, scaled form 7u·|ω| (from the error
//!   bounds of the factors of m·(1 − τ), of s + H and of M·(1 + k + q), Higham 2002, chapter 3), textbook
//!   form u·|s| + 2u·h + u·|ω|; where squares underflow, √(2η) more.
//! - Functions of the mathematical library err by at most one unit in the last place (the tests of the `libm`
//!   crate hold them to that); two are charged.
//!
//! What is not known — a root that may meet a negative number, a divisor that may vanish, an overflow — is ∞.
//! All bounds are computed with every operation rounded upwards. Ranges of a whole box add up worst cases of
//! different places, so a box is divided where its bound is largest, until no point would do much better.

mod arithmetic;
mod certificate;
mod rules;
mod weights;

pub use arithmetic::{Arithmetic, Error, FOLDING, Inputs};
pub use certificate::ErrorAnalysis;
