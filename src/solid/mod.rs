//! A compiled obstacle: one graph, and the programs derived from it on demand.
//!
//! Cheap to clone, usable from any thread; owns its machine code and frees it with the last clone.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | `construction`, `evaluation`, `contact` | [`Solid`], its programs and its values |
//! | `engine`, `moment` | machine code or the interpreter; a solid at a time, or during a stretch of time |
//! | `nearest`, `confirm` | distances with proofs; contacts that are compared with the signs around them |
//! | `twin`, `walls`, `surface`, `depth` | its views: sign, walls of a fluid, the cheapest field, depth |
//! | `programs` | compiled code, the programs made on demand, programs over blocks of points |
//! | `leaves` | a solid taken apart into leaves, and what is left of it in a box |
//! | `path` | where a straight path meets a solid |
//! | `cells` | boxes divided into cells, for solids at rest and for solids that move |
//! | `lints` | what in a solid is most likely not meant |
//! | `triangles` | the surface of a solid that is a mesh alone |
//! | `bounds`, `tolerance`, `inspection` | its extent, its certified errors, its leaves for people |
//!
//! Invariant: a [`Solid`] answers for every point, every engine gives the same bits, and a program is
//! compiled only when it is first asked for.

mod bounds;
mod cells;
mod confirm;
mod construction;
mod contact;
mod depth;
mod engine;
mod evaluation;
mod inspection;
mod leaves;
mod lints;
mod moment;
mod nearest;
mod path;
mod programs;
mod surface;
mod tolerance;
mod triangles;
mod twin;
mod walls;

pub use bounds::extent::Bounds;
pub use bounds::unbounded::Unbounded;
pub use cells::map::{CellMap, CellStats, Place};
pub use cells::moving::MovingMap;
pub use construction::Solid;
pub use contact::Contact;
pub use depth::Depth;
pub use engine::{Engine, ProgramKind};
pub use inspection::{LeafInfo, Remainder};
pub use lints::{Break, Breakage, Idle, ThinPart, TurnedChain, Uneven, turned_chains};
pub use nearest::{Distance, Distances};
pub(crate) use programs::block_plan::{BlockPlan, BlockStep, Operation as JoiningOperation, Piece};
pub(crate) use programs::columns::ColumnPlace;
pub use programs::compiled::RangeProgram;
pub use programs::on_demand::Lane;
pub use tolerance::{Chosen, OutOfTolerance, ProgramVariant};
pub use twin::Twin;
