//! Where a solid is.
//!
//! | file | what it holds |
//! |---|---|
//! | `extent` | what is known of it |
//! | `contraction` | boxes around trees of leaves, made smaller from all conjuncts together |
//! | `whole` | the same for solids that are too large to be taken apart |
//! | `search` | contraction first, then subdivision from each side |
//! | `queue` | boxes that wait for it |
//! | `far` | a cube that holds a solid whose bounds were not found from near |
//! | `operands` | a box from those of the operands, each in coordinates of its own |
//! | `find`, `found` | the bounds of a solid, and the sides to which no end was found |
//! | `unbounded` | which operand has no box, and to which sides |

pub mod contraction;
pub mod extent;
pub mod far;
pub mod find;
pub mod found;
pub mod operands;
pub mod queue;
pub mod search;
pub mod unbounded;
pub mod whole;
