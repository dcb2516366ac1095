//! Walls without wall particles: what they add to sums over neighbours, and how they stop particles.
//!
//! ```text
//! Field::omega ─▶ Maps: λ, ∇λ, K of obstacles by their volume ─▶ Coverage ─▶ density, pressure
//! Field::faces ─▶ Coverage: λ, ∇λ, K of faces in closed form ─▶ viscosity, and obstacles too large for maps
//! Walls::surroundings ─▶ BroadPhase: which obstacles may be near a place
//! Moving::placement ─▶ StepLimits: how long a step may be
//! Field::first_entry ─▶ Contact ─▶ Boundary::collide: position and velocity
//! ```

mod all_directions;
mod behind;
mod boundary;
mod broad_phase;
mod collide;
mod contact;
mod corner;
mod coverage;
mod flight;
mod friction;
mod kernel;
mod layers;
mod motion;
mod of_box;
mod recess;
mod shares;
mod symmetric;
mod volume;
mod way_out;

pub(super) use behind::{Behind, Carried};
pub use boundary::Obstacle;
pub(super) use boundary::{Boundary, Fault, MARKED, UNKNOWN};
pub(super) use broad_phase::BroadPhase;
pub use collide::{Collision, Rebound, collide, put_back};
pub(super) use contact::Trouble;
pub use contact::{Contact, Undefined, bounce, first_contact, push_out};
pub(super) use coverage::{Coverage, inverse_above};
pub(super) use friction::{Friction, WallDrag};
pub use kernel::WallKernel;
pub(super) use layers::{ViscousForces, Wall};
pub(super) use motion::StepLimits;
pub(super) use shares::{NearMotion, Pushed, Share};
pub(super) use symmetric::Symmetric;
pub(super) use volume::Maps;
pub use volume::{ChangingShape, RigidPart};
