//! Contraction: a box made smaller without losing a point at which a formula is positive.
//!
//! | file | content |
//! |---|---|
//! | `rule` | how the nodes of a graph are read: powers and slabs are one operation |
//! | `forward` | the numbers that an operation may give |
//! | `backward` | the operands that may give a number |
//! | `sets` | intervals as sets of numbers, and the possible results for a box |
//! | `contractor` | both, over all nodes of a graph |
//! | `forms` | the linear forms in a graph |
//! | `growth`, `far` | formulas far from the origin, by the powers with which they grow |
//! | `cube` | a cube beyond which a formula is positive nowhere |
//! | `closer` | a box made smaller by subdivision from each side |
//! | `reach` | a box around the points at which a formula is positive, for what is made of that formula |
//! | `hull` | a box made smaller by values (hull consistency) |
//! | `slopes` | a box made smaller by derivatives (the mean value form) |
//! | `linear` | linear forms with known ranges, and the box around them (linear programming) |
//! | `quadric` | the box around an ellipsoid |
//!
//! Intervals here hold the *numbers* that a node may be. Where a formula is positive every operand that it
//! needs is a number, so an undefined operation restricts its operands and does not make the whole formula
//! unknown.
//!
//! Invariant: the parts that are cut off hold no point at which the formula is positive, over the reals or as
//! programs in `f64` evaluate it. Backward rules therefore first widen a value by the rounding error of its
//! operation.

mod backward;
mod closer;
mod contractor;
mod cube;
mod far;
mod forms;
mod forward;
mod growth;
mod hull;
mod linear;
mod quadric;
mod reach;
mod rule;
mod sets;
mod slopes;

pub use contractor::{Contractor, Wanted};
pub use cube::cube_around;
pub use linear::{LinearForm, contract_linear, contract_linear_around};
pub use reach::{close_reach, is_nowhere_positive, reach};
pub use sets::Contracted;
pub use slopes::SURFACE_ROUNDING;
