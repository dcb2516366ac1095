//! What bodies take of the kernels near them, by their volume: λ = ∫ W, ∇λ and K = ∫ y ⊗ ∇W over all bodies
//! at rest in the box, over each body, or part of one, that moves without changing its shape, and over each
//! that changes it, at instants.
//!
//! The box has a lattice with [`CELLS`](lattice::CELLS) cells along a support radius. How far bodies fill its
//! cells is found from their fields ([`fractions`]), and what the filled cells add to a node from a table
//! ([`stencil`]). Between the nodes λ is a cubic spline, and ∇λ the gradient of that spline, so that a
//! particle that moves among bodies gets back the energy that it gave: a wall whose ∇λ is not that of its λ
//! keeps accelerating particles. (With closed forms for each face, and the distance from the surface's
//! curvature, one particle doubled its energy within a second at the collar of a pawn, whose rim is sharper
//! than the kernel.) Density maps interpolate such an integral too (Koschier & Bender 2017).
//!
//! Errors at a plane: 0.0006 of λ, 0.4 % of the largest ∇λ.
//!
//! Nodes lie in bricks, which are made only when a particle first comes near.

mod changing;
mod fractions;
mod lattice;
mod map;
mod maps;
mod sparse;
mod stencil;
#[cfg(test)]
mod tests;

pub use self::changing::ChangingShape;
pub(in crate::sph) use self::map::Taken;
pub use self::maps::RigidPart;
pub(in crate::sph) use self::maps::{Known, Mapped, Maps};
