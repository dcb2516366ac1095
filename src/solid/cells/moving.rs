//! A cell map of a solid that moves: rebuilt only where it may have changed, and only from time to time.
//!
//! Ranges over a cell *and a stretch of time* judge a cell for all of that time. For the whole run this
//! settles the cells that the solid never comes near, those that it never leaves, and those in which nothing
//! but parts at rest matters. The others are divided again for each *window* of time, a stretch of some
//! steps, as far as they are asked for. In between, a step costs what it costs with a solid at rest.
//!
//! Windows begin at whole multiples of their length, so that an answer does not depend on the steps before.

use std::sync::{Arc, Mutex, PoisonError};

use super::grid::{Cells, Pending};
use super::map::{CellMap, CellStats, margin};
use super::window::Window;
use crate::field::{Moving, Walls};
use crate::geom::{Aabb, Placement};
use crate::solid::construction::Solid;

/// A solid that moves, prepared for a box and a run.
pub struct MovingMap {
    solid: Solid,
    /// Right for the whole run, except in the cells that are `restless`.
    lasting: Arc<Cells>,
    restless: Arc<[Pending]>,
    reach: f64,
    run: (f64, f64),
    window: f64,
    current: Mutex<Option<(u64, Arc<Window>)>>,
}

/// A window also holds this part of the next one, so that a step which begins in it ends in it.
const OVERLAP: f64 = 0.5;

/// Maximum number of windows of a run: the rounding of their beginnings stays below a millionth of one.
const MOST_WINDOWS: f64 = 1e9;

impl MovingMap {
    /// Prepares a solid in a box for a run from one time to another, in windows of time of the length
    /// `window`, all in seconds. For `reach` see [`CellMap::with_reach`].
    ///
    /// The right window is some 16 steps long: a shorter one is left too often, and in a longer one more
    /// cells are near a surface. Steps longer than half of it are answered without a map.
    ///
    /// `None` if the solid cannot be taken apart, if one of the numbers is not finite, or if the window is
    /// not positive.
    pub fn new(solid: &Solid, domain: Aabb, reach: f64, run: (f64, f64), window: f64) -> Option<Self> {
        let ordered = run.0.is_finite() && run.1.is_finite() && run.0 <= run.1;
        let sensible = window > 0.0 && window.is_finite() && reach >= 0.0 && reach.is_finite();
        if domain.is_empty() || !domain.is_finite() || !ordered || !sensible {
            return None;
        }
        let parts = solid.between(run.0 - window, run.1 + (1.0 + OVERLAP) * window).parts()?;
        let (lasting, restless) = Cells::lasting(&parts, domain, margin(&domain, reach));
        let (lasting, restless) = (Arc::new(lasting), restless.into());
        let current = Mutex::new(None);
        Some(Self { solid: solid.clone(), lasting, restless, reach, run, window, current })
    }

    /// The map during a step; `None` if the step is too long, or outside the run.
    pub fn between(&self, from: f64, to: f64) -> Option<CellMap> {
        let number = ((from - self.run.0) / self.window).floor();
        // a little earlier, because it is rounded
        let begin = self.run.0 + (number - 1e-6) * self.window;
        let end = begin + (1.0 + OVERLAP) * self.window;
        let in_run = (0.0..MOST_WINDOWS).contains(&number) && from <= self.run.1;
        if !(in_run && begin <= from && from <= to && to <= end) {
            return None;
        }
        let cells = self.cells(number as u64, begin, end)?;
        CellMap::of(&self.solid.between(from, to), cells, self.reach)
    }

    /// The cells of one window: those of the last call, or new ones.
    fn cells(&self, number: u64, begin: f64, end: f64) -> Option<Arc<Window>> {
        let lock = || self.current.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((known, cells)) = &*lock()
            && *known == number
        {
            return Some(cells.clone());
        }
        // not while the lock is held: this thread may take up other work of the pool
        let parts = self.solid.between(begin, end).parts()?;
        let margin = margin(&self.lasting.domain, self.reach);
        let cells = Arc::new(Window::new(self.lasting.clone(), self.restless.clone(), parts, margin));
        *lock() = Some((number, cells.clone()));
        Some(cells)
    }

    /// How many cells may be divided again for each window. The box has 4096 on their level.
    pub fn restless(&self) -> usize {
        self.restless.len()
    }

    /// How the box is divided during a step; `None` if [`MovingMap::between`] has no map.
    pub fn stats(&self, from: f64, to: f64) -> Option<CellStats> {
        Some(self.between(from, to)?.stats())
    }
}

impl Moving for MovingMap {
    fn during(&self, from: f64, to: f64) -> Box<dyn Walls> {
        match self.between(from, to) {
            Some(map) => Box::new(map),
            None => Box::new(self.solid.between(from, to)),
        }
    }

    fn moves(&self) -> bool {
        self.solid.moves()
    }

    fn placement(&self, time: f64) -> Option<Placement> {
        self.solid.placement(time)
    }
}

impl std::fmt::Debug for MovingMap {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (solid, restless) = (self.solid.name(), self.restless.len());
        write!(f, "MovingMap({solid:?}, {restless} restless cells, windows of {} s)", self.window)
    }
}
