//! What is known of a leaf along a straight path: for leaves of low degree in closed form, for others as an
//! enclosure.

pub mod enclosure;
pub mod polynomial;
