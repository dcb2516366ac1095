//! Graphs derived from a graph: what is computed beside ω itself.

pub mod contact;
pub mod forward;
pub mod framed;
pub mod gradient;
pub mod hoisted;
pub mod localised;
pub mod rigid;
pub mod sign;
pub mod trust;
pub mod twin;
