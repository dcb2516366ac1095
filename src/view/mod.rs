//! The viewer's page: a document for a browser that shows particles, obstacles and their box, and the form in which
//! it is given frames, meshes and slices.
//!
//! [`Page`] writes one self-contained file, which needs neither a server nor a network. [`pack_frame`],
//! [`pack_mesh`] and [`pack_slice`] make the blocks that such a file holds and that a server sends. A block is the
//! length of its head (32 bits, little-endian), the head (JSON), and planes of bytes.
//!
//! Positions have 16 bits for each coordinate in a box ([`Lattice`]), arrays 8 bits ([`Levels`]). A plane holds one
//! byte of a number for all particles, and numbers are differences from the frame before, or from where velocities lead
//! ([`Motion`]), so that planes deflate well. A mesh that is only moved is given once, and frames say where its parts
//! are ([`pose`]).
//!
//! Invariant: text of the user reaches the page as JSON and is shown as text, never as part of the document.

mod block;
mod coarse;
mod levels;
mod page;
mod pose;
mod setting;
mod surface;

pub use block::{
    Frame, FrameHead, MeshRole, Motion, SliceHead, pack_frame, pack_mesh, pack_parts, pack_slice,
};
pub use coarse::coarse;
pub use levels::{Lattice, Levels, UNKNOWN_LEVEL};
pub use page::{Page, Sizes, document, solid};
pub use pose::{columns, pose};
pub use setting::{Array, Column, Corners, Outset, OutsetCut, Param, Plot, Setting, VELOCITY};
pub use surface::{pack_surface, reduced};
