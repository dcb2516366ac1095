//! A solid taken apart into leaves: how they are joined, what each of them is, what is left of them in a box.

mod contacts;
mod faces;
pub mod known_ranges;
pub mod leaf_set;
mod pieces;
pub mod pruning;
mod shape;
pub mod tree;
pub mod words;
