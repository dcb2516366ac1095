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
mod contractor;
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
pub use far::Far;
pub use growth::Scales;
pub use linear::{LinearForm, contract_linear, contract_linear_around};
pub use reach::{is_nowhere_positive, reach};
pub use sets::Contracted;
pub use slopes::SURFACE_ROUNDING;
