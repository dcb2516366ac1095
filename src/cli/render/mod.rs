//! `rfm render`: pictures and films of the frames that `rfm run` wrote, and of solids.
//!
//! | file | what it does |
//! |---|---|
//! | `options` | the flags, with the help that teaches them |
//! | `scene` | the folder of a run → a picture of each frame |
//! | `look` | the flags and what the scene states → the camera, the cut, the colours' ends |
//! | `bodies` | its obstacles, and how each of them is drawn |
//! | `solid` | an obstacle file → one picture, or a film of what moves |
//! | `film` | pictures → .png files, .gif, .apng |
//! | `ffmpeg` | pictures → .mp4, .webm |
//!
//! Invariant: everything is read and checked before the first file is written, and the bytes of .png, .gif and .apng do
//! not depend on the number of threads.

mod bodies;
mod ffmpeg;
mod film;
mod look;
mod options;
mod scene;
mod solid;

use super::failure::Failure;
use super::shared::Shared;
pub(super) use options::{Render, Surface};

pub(super) fn run(shared: &Shared, options: &Render) -> Result<(), Failure> {
    if options.subject.is_dir() { scene::run(shared, options) } else { solid::run(shared, options) }
}
