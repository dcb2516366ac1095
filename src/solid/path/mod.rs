//! Where a straight path meets a solid.

pub mod intervals;
pub mod sweep;
