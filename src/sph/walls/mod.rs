//! Walls without wall particles: what they add to sums over neighbours, and how they stop particles.
//!
//! ```text
//! Field::faces ─▶ Coverage: λ, ∇λ, K in closed form ─▶ density, pressure, viscosity
//! Field::first_entry ─▶ Contact ─▶ Boundary::collide: position and velocity
//! ```

mod boundary;
mod contact;
mod coverage;
mod friction;
mod kernel;
mod symmetric;
mod way_out;

pub use boundary::Obstacle;
pub(super) use boundary::{Boundary, Fault, MARKED, UNKNOWN};
pub(super) use contact::Trouble;
pub use contact::{Contact, Undefined, bounce, first_contact, push_out};
pub(super) use coverage::Coverage;
pub(super) use friction::{Friction, WallDrag};
pub(super) use kernel::Wall;
pub use kernel::WallKernel;
