//! Memory that pictures reuse. The system clears large new memory page by page, which costs as much as
//! drawing into it.
//!
//! Invariant: the earlier content of the memory has no effect, because every part is written before it is
//! read.

use std::sync::Mutex;

use super::particles::Disc;

/// The working memory of a picture besides its pixels.
#[derive(Debug, Default)]
pub(super) struct Workspace {
    /// The discs of all particles, and the order in which they are drawn.
    pub discs: Vec<Option<Disc>>,
    pub order: Vec<u64>,
    pub by_band: Vec<Vec<Disc>>,
    pub nearness: Vec<f32>,
    /// The nearness with a border.
    pub padded: Vec<f32>,
    pub light: Vec<f32>,
}

/// The workspaces that no picture uses.
#[derive(Debug, Default)]
pub(super) struct Spare(Mutex<Vec<Workspace>>);

impl Spare {
    /// Draws in a workspace, which is then kept for the next picture.
    pub fn lend<T>(&self, draw: impl FnOnce(&mut Workspace) -> T) -> T {
        // a list of spare memory is complete whenever it is unlocked
        let lock = || self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let free = lock().pop();
        let mut workspace = free.unwrap_or_default();
        let drawn = draw(&mut workspace);
        lock().push(workspace);
        drawn
    }
}
