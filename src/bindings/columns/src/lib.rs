//! Solids evaluated over the memory of other languages: what the bindings have in common.
//!
//! | file | what it has |
//! |---|---|
//! | `memory` | columns with any distance between their numbers, and how they are read and written |
//! | `number` | f32 and f64 |
//! | `collision` | particles that have entered a solid: put back and reflected |
//! | `volume` | the volume of a solid, and what is doubtful about it |

#![warn(missing_docs)]

mod collision;
mod memory;
mod number;
mod volume;

pub use collision::{Collisions, Found, Obstacle, PARTICLES, Particles};
pub use memory::{Column, Job, Vectors};
pub use number::Number;
pub use volume::{Measured, NoVolume, volume};
