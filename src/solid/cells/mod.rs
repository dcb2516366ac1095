//! A box divided into cells that know what of a solid matters in them; for a solid at rest and for one that
//! moves.

mod demanded;
mod gradients;
pub mod grid;
pub mod map;
pub mod moving;
mod restless;
mod values;
mod window;
