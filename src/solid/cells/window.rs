//! What the cells of a box hold during a window of time, or always if nothing in the box moves.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::{DVec3, UVec3};

use super::grid::{Cell, Cells, Counts, DEPTH, MAX_DEPTH, Pending, SIDE, bounds, octant};
use super::restless::{Divided, Restless, Seen};
use crate::geom::Aabb;
use crate::solid::leaves::leaf_set::LeafTree;

/// The cells of a box during a window of time: those that last, and those in which something moves.
pub(super) struct Window {
    cells: Arc<Cells>,
    restless: Restless,
}

/// What is known of an undivided cell.
#[derive(Debug, Clone, Copy)]
pub(super) enum Known<'a> {
    Fluid,
    Inside,
    /// What is left of the solid: a tree in prefix form, behind which others may follow.
    Near(&'a [u32]),
}

/// An undivided cell and its place. Two points are in one cell if their places are equal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found<'a> {
    pub cell: Known<'a>,
    pub depth: u32,
    pub place: u64,
}

/// The cells of the flat grid that a box touches.
struct Touched<I> {
    /// Whether some lie beyond what is occupied. They are fluid.
    beyond: bool,
    /// The others, with their numbers along the axes.
    cells: I,
}

/// What is known of a cell that may be divided.
enum Part<'a> {
    Known(Known<'a>),
    /// Its first child among those that last.
    Lasting(u32),
    /// It is divided for the window.
    Moving(&'a Divided),
}

/// A bit above all places of cells that last: those of the others have it.
const MOVING: u64 = 1 << 40;

/// Bits of a place that say which part of a cell of the flat grid is meant: three for each level, and one before them.
const BELOW: u32 = 3 * (MAX_DEPTH - DEPTH) + 1;

impl Window {
    /// The cells of a solid at rest, or of one moment.
    pub fn at_rest(cells: Cells, parts: Arc<LeafTree>, margin: f64) -> Self {
        Self::new(Arc::new(cells), Arc::new([]), parts, margin)
    }

    /// The cells that last, and those left of them, for the parts of a solid during a window of time.
    /// `margin` is that by which cells were grown.
    pub fn new(cells: Arc<Cells>, left: Arc<[Pending]>, parts: Arc<LeafTree>, margin: f64) -> Self {
        let restless = Restless::new(left, parts, cells.domain, margin);
        Self { cells, restless }
    }

    pub fn domain(&self) -> Aabb {
        self.cells.domain
    }

    /// A box that holds all cells of the flat grid but those that are fluid.
    pub fn occupied(&self) -> Aabb {
        let [low, high] = self.cells.occupied;
        if low.cmpgt(high).any() {
            return Aabb::EMPTY;
        }
        let [first, last] = [low, high].map(|at| bounds(&self.cells.domain, DEPTH, at));
        self.widened(&first.union(&last))
    }

    /// A box with the points that rounding puts into its cells.
    fn widened(&self, over: &Aabb) -> Aabb {
        let largest = over.min.abs().max(over.max.abs()).max_element();
        over.grown(1e-9 * self.shortest_side(MAX_DEPTH) + 64.0 * f64::EPSILON * largest)
    }

    /// Counts all cells. Those in which something moves are divided for that.
    pub fn counts(&self) -> Counts {
        let (lasting, moving) = (self.cells.counts, self.restless.counts());
        Counts {
            fluid: lasting.fluid + moving.fluid,
            inside: lasting.inside + moving.inside,
            near: lasting.near + moving.near,
            programs: lasting.programs + moving.programs,
            leaves_in_cells: lasting.leaves_in_cells + moving.leaves_in_cells,
        }
    }

    /// What is known of a cell; `at` is its number along each axis of the flat grid, if it is one of that.
    #[inline]
    fn part(&self, cell: Cell, at: UVec3) -> Part<'_> {
        match cell {
            Cell::Fluid => Part::Known(Known::Fluid),
            Cell::Inside => Part::Known(Known::Inside),
            Cell::Near(start) => Part::Known(Known::Near(&self.cells.programs[start as usize..])),
            Cell::Divided(first) => Part::Lasting(first),
            Cell::Restless(number) => part_of(self.restless.at(number, at)),
        }
    }

    /// The undivided cell of a point; `None` outside the box, and for NaN.
    #[inline]
    pub fn find(&self, p: DVec3) -> Option<Found<'_>> {
        let cells = &*self.cells;
        let q = (p - cells.domain.min) * cells.per_length;
        let within = q.cmpge(DVec3::ZERO).all() && q.cmple(DVec3::splat(f64::from(SIDE))).all();
        if !within {
            return None;
        }
        let at = q.as_uvec3().min(UVec3::splat(SIDE - 1));
        let place = u64::from((at.z * SIDE + at.y) * SIDE + at.x);
        let [low, high] = cells.occupied;
        let is_occupied = at.cmpge(low).all() && at.cmple(high).all();
        let cell = if is_occupied { Cell::unpack(cells.grid[place as usize]) } else { Cell::Fluid };
        match self.part(cell, at) {
            Part::Known(cell) => Some(Found { cell, depth: DEPTH, place }),
            divided => Some(self.descend(divided, place, at, q - at.as_dvec3())),
        }
    }

    /// Below a cell of the flat grid; `q` is the place in it, 0 to 1.
    fn descend<'a>(&'a self, mut part: Part<'a>, mut place: u64, mut at: UVec3, mut q: DVec3) -> Found<'a> {
        let mut depth = DEPTH;
        // a cell of a window is identified by the cell of the flat grid that holds it, and by the octants on
        // the way from there
        let (holder, mut way) = (MOVING | place << BELOW, 1);
        loop {
            part = match part {
                Part::Known(cell) => return Found { cell, depth, place },
                Part::Lasting(first) => {
                    let child = first + next_octant(&mut q, &mut at);
                    // places of the grid come first
                    place = u64::from(SIDE * SIDE * SIDE + child);
                    self.part(Cell::unpack(self.cells.children[child as usize]), at)
                }
                Part::Moving(divided) => {
                    let k = next_octant(&mut q, &mut at);
                    way = way << 3 | u64::from(k);
                    place = holder | way;
                    part_of(self.restless.octant(divided, (depth + 1, at), k as usize))
                }
            };
            depth += 1;
        }
    }

    /// The box of the cell, `depth` levels deep, that holds a point of the domain.
    pub fn bounds_at(&self, p: DVec3, depth: u32) -> Aabb {
        let side = f64::from(1u32 << depth);
        let q = (p - self.cells.domain.min) * self.cells.per_length * (side / f64::from(SIDE));
        bounds(&self.cells.domain, depth, q.clamp(DVec3::ZERO, DVec3::splat(side - 1.0)).as_uvec3())
    }

    /// Whether a box within the domain touches fluid alone, as far as the flat grid says, and no more than
    /// `most` of its cells that are occupied.
    pub fn is_fluid(&self, over: &Aabb, most: usize) -> bool {
        let is_fluid = |(at, cell)| matches!(self.part(cell, at), Part::Known(Known::Fluid));
        self.touched(over, most).is_some_and(|mut touched| touched.cells.all(is_fluid))
    }

    /// Visits the undivided cells that a box within the domain touches, and perhaps some beside it, with
    /// their depths: once for all that lie beyond what is occupied. The visit ends when `visit` breaks. `None` if
    /// the box touches more than `most` cells of the flat grid that are occupied.
    pub fn visit<'a, B>(
        &'a self,
        over: &Aabb,
        most: usize,
        visit: &mut impl FnMut(Known<'a>, u32) -> ControlFlow<B>,
    ) -> Option<ControlFlow<B>> {
        // points that rounding puts into the next cell are in it
        let wider = self.widened(over);
        let Touched { beyond, cells } = self.touched(over, most)?;
        if beyond && let ControlFlow::Break(found) = visit(Known::Fluid, DEPTH) {
            return Some(ControlFlow::Break(found));
        }
        for (at, cell) in cells {
            let found = self.visit_part(self.part(cell, at), (DEPTH, at), &wider, visit);
            if found.is_break() {
                return Some(found);
            }
        }
        Some(ControlFlow::Continue(()))
    }

    fn visit_part<'a, B>(
        &'a self,
        part: Part<'a>,
        (depth, at): (u32, UVec3),
        over: &Aabb,
        visit: &mut impl FnMut(Known<'a>, u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if let Part::Known(cell) = part {
            return visit(cell, depth);
        }
        for k in 0..8 {
            let place = (depth + 1, octant(at, k));
            let of_child = bounds(&self.cells.domain, place.0, place.1);
            if !(of_child.min.cmple(over.max).all() && over.min.cmple(of_child.max).all()) {
                continue;
            }
            let child = match part {
                Part::Known(cell) => Part::Known(cell),
                Part::Lasting(first) => {
                    self.part(Cell::unpack(self.cells.children[first as usize + k]), place.1)
                }
                Part::Moving(divided) => part_of(self.restless.octant(divided, place, k)),
            };
            self.visit_part(child, place, over, visit)?;
        }
        ControlFlow::Continue(())
    }

    /// The cells of the flat grid that a box within the domain touches; `None` if more than `most` of them are
    /// occupied.
    fn touched(&self, over: &Aabb, most: usize) -> Option<Touched<impl Iterator<Item = (UVec3, Cell)> + '_>> {
        let cells = &*self.cells;
        let number = |p: DVec3| {
            let q = (p - cells.domain.min) * cells.per_length;
            q.clamp(DVec3::ZERO, DVec3::splat(f64::from(SIDE - 1))).as_uvec3()
        };
        let (first, last) = (number(over.min), number(over.max));
        let [low, high] = [first.max(cells.occupied[0]), last.min(cells.occupied[1])];
        let beyond = [low, high] != [first, last];
        let size = (high + 1).saturating_sub(low);
        if (size.x * size.y * size.z) as usize > most {
            return None;
        }
        let rows = (low.z..=high.z).flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)));
        let cells = rows.flat_map(move |(y, z)| {
            (low.x..=high.x).map(move |x| {
                let word = cells.grid[((z * SIDE + y) * SIDE + x) as usize];
                (UVec3::new(x, y, z), Cell::unpack(word))
            })
        });
        Some(Touched { beyond, cells })
    }

    /// The shortest side of a cell.
    #[inline]
    pub fn shortest_side(&self, depth: u32) -> f64 {
        self.cells.domain.size().min_element() / f64::from(1u32 << depth)
    }
}

/// The number of the octant of a cell in which a place lies, 0 to 1 along each axis. The place becomes that
/// in the octant, and the cell's number along each axis the octant's.
#[inline]
fn next_octant(q: &mut DVec3, at: &mut UVec3) -> u32 {
    let upper = q.cmpge(DVec3::splat(0.5));
    *q = 2.0 * *q - DVec3::select(upper, DVec3::ONE, DVec3::ZERO);
    let k = upper.bitmask();
    *at = octant(*at, k as usize);
    k
}

#[inline]
fn part_of(seen: Seen<'_>) -> Part<'_> {
    match seen {
        Seen::Fluid => Part::Known(Known::Fluid),
        Seen::Inside => Part::Known(Known::Inside),
        Seen::Near(words) => Part::Known(Known::Near(words)),
        Seen::Divided(divided) => Part::Moving(divided),
    }
}
