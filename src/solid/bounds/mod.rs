//! Where a solid is.

pub mod extent;
mod search;
