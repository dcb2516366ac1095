//! Likely mistakes in a solid: parts without an effect, operands of very different size, a formula that jumps
//! or has no value.
//!
//! | file | what it finds |
//! |---|---|
//! | `operands` | the operands of all `and` and `or`, as a tree |
//! | `idle` | operands whose removal changes nothing: proven by ranges over all of space |
//! | `uneven` | operands whose gradients differ by a large factor |
//! | `chains` | chains of comparisons of which the other order decides |
//! | `breaks` | places where ω jumps across its surface, and where it has no value |
//! | `seams` | lines within a solid, and parts of space, on which ω is zero |
//! | `thin` | walls and gaps that are thinner than a length |
//! | `crossings` | points of the surface, between the nodes of a coarse lattice |
//!
//! Invariant: nothing is reported that was only guessed. A search that reaches its budget finds nothing more.

mod breaks;
mod chains;
mod crossings;
mod idle;
mod operands;
mod seams;
mod thin;
mod uneven;

pub use breaks::{Break, Breakage};
pub use chains::{TurnedChain, turned_chains};
pub use idle::Idle;
pub use thin::ThinPart;
pub use uneven::Uneven;
