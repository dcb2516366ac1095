//! How a fluid begins: particles on a lattice, without those that obstacles leave no room for.

mod block;
mod carve;
mod deepest;
mod error;
mod rows;

pub use block::{Fill, FluidBlock, FluidShape, MAX_SITES};
pub use carve::{carve, carve_cells, make_room};
pub use error::{Carved, SeedError};
pub use rows::Rows;
