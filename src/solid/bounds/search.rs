//! The box of a solid: contraction of all space first, then subdivision from each side.
//!
//! A side is found by looking at the farthest cell first: it is made smaller, dropped if it is empty, or cut in
//! two, until a point of the solid is known to be as far out as the farthest cell. Whenever the search ends, all
//! cells together still hold the solid, so the box is right and can only be too large.

use std::collections::BinaryHeap;

use glam::DVec3;

use super::queue::Queued;
use crate::geom::Aabb;

/// Half the side of the cube in which solids are looked for. Programs answer no signs farther out than 2²⁵⁶.
pub const SEARCH_RADIUS: f64 = 1.809_251_394_333_065_6e75; // 2²⁵⁰

/// A side that reaches this far has no end: bounds of linear programs over the whole region lie a little
/// within it.
const OPEN: f64 = SEARCH_RADIUS * 1e-12;

/// Maximum number of cells looked at for one side.
const CELLS_OF_SIDE: usize = 600;

/// The most work for one side, in the unit below: fewer cells of a large solid. It is some tenths of a second.
const WORK_OF_SIDE: usize = 200_000;

/// Work for all sides together, each of which may take an equal part of what is left: a second or two, for solids that are
/// joined by arcs, of which each cell needs nearly all leaves.
const WORK_OF_SOLID: usize = 240_000;

/// Nodes of formulas that make a unit of work.
pub const NODES_PER_WORK: usize = 16;

/// The sides of a box.
const SIDES: usize = 6;

/// How often a side is looked for, each time in a box of which the longest side is less than half as long.
const MOST_REPEATS: usize = 4;

/// How close to a point of the solid a side is moved, relative to the longest side, for the given number of
/// first cells. Most sides reach the first goal within 50 cells; those that touch a thin curved edge would
/// need thousands.
const GOALS: [(usize, f64); 4] = [(100, 1e-6), (200, 1e-5), (300, 1e-4), (CELLS_OF_SIDE, 1e-3)];

/// How much a box is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// A box that may be far too large: linear forms are solved together.
    Large,
    /// One of many cells: derivatives are used.
    Cell,
    /// A box of one point, to find out whether it is inside.
    Point,
}

/// Something that makes a box smaller without losing a point of a solid. It works the better, the smaller the
/// box is.
pub trait Shrink {
    /// What is known of a box, handed on to the boxes within it.
    type Known: Clone;
    fn everything(&self) -> Self::Known;
    /// What is known of the smaller box; `None` if it is proven to be outside. `known` holds of a larger one.
    fn shrink(&self, known: &Self::Known, space: &mut Aabb, effort: Effort) -> Option<Self::Known>;
    /// What [`Shrink::shrink`] finds with [`Effort::Cell`], and a distance: every point of the solid in the
    /// smaller box is at least that far from `p`.
    fn shrink_from(&self, known: &Self::Known, space: &mut Aabb, p: DVec3) -> Option<(Self::Known, f64)>;
    /// What a call costs, in units that `WORK_OF_SIDE` knows.
    fn work(&self, known: &Self::Known) -> usize;
    /// Boxes that together hold the part of the solid in `space`.
    fn parts(&self, space: &Aabb) -> Vec<(Aabb, Self::Known)>;
    /// Whether a box lies inside the solid as a whole.
    fn is_inside(known: &Self::Known) -> bool;
}

/// A side of a box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Side {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Whether it is the side with the larger coordinate.
    pub upper: bool,
}

impl Side {
    /// The six sides of a box.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..3).flat_map(|axis| [false, true].map(|upper| Self { axis, upper }))
    }

    /// How far out a box reaches on this side.
    fn of(self, space: &Aabb) -> f64 {
        if self.upper { space.max[self.axis] } else { -space.min[self.axis] }
    }

    fn of_point(self, p: DVec3) -> f64 {
        if self.upper { p[self.axis] } else { -p[self.axis] }
    }

    fn set(self, space: &mut Aabb, reach: f64) {
        if self.upper {
            space.max[self.axis] = reach;
        } else {
            space.min[self.axis] = -reach;
        }
    }

    pub fn is_open(self, space: &Aabb) -> bool {
        self.of(space) >= OPEN
    }
}

/// A box around a solid, and whether a point of the solid is known near each of its sides.
pub struct Found {
    pub hull: Aabb,
    pub is_tight: bool,
}

/// The box in which solids are looked for.
pub const EVERYWHERE: Aabb = Aabb { min: DVec3::splat(-SEARCH_RADIUS), max: DVec3::splat(SEARCH_RADIUS) };

/// A box around the part of a solid that is in `hull`; `None` if it is proven to be empty.
pub fn search<S: Shrink>(solid: &S, mut hull: Aabb) -> Option<Found> {
    solid.shrink(&solid.everything(), &mut hull, Effort::Large)?;
    let mut cells = solid.parts(&hull);
    // a solid that does not end on one side need not be measured on the others
    let (open, closed): (Vec<Side>, Vec<Side>) = Side::all().partition(|side| side.is_open(&hull));
    let mut is_tight = true;
    let mut left = WORK_OF_SOLID;
    for (number, side) in open.into_iter().chain(closed).enumerate() {
        let mut is_near = false;
        let share = (left / (SIDES - number)).min(WORK_OF_SIDE);
        let mut work = share;
        // what is near enough is a part of the longest side, which may have been far too long
        for _ in 0..MOST_REPEATS {
            let longest = longest_side(&hull);
            let reach;
            (reach, cells) = Faces { solid, side, hull }.find(cells, &mut work)?;
            is_near = reach.is_near;
            side.set(&mut hull, reach.farthest);
            let held = cells.iter().fold(Aabb::EMPTY, |held, (space, _)| held.union(space));
            hull = hull.intersection(&held);
            if work == 0 || longest_side(&hull) > 0.5 * longest {
                break;
            }
        }
        left -= share - work;
        is_tight &= is_near;
        if side.is_open(&hull) {
            break;
        }
    }
    Some(Found { hull, is_tight })
}

/// The longest of the sides of a box that end, 0 if none does.
fn longest_side(hull: &Aabb) -> f64 {
    hull.size().to_array().into_iter().filter(|&side| side < OPEN).fold(0.0, f64::max)
}

/// The search for one side.
struct Faces<'a, S: Shrink> {
    solid: &'a S,
    side: Side,
    hull: Aabb,
}

/// How far a solid reaches to one side.
struct Reach {
    farthest: f64,
    /// Whether a point of the solid is known to be almost as far out.
    is_near: bool,
}

/// Boxes that hold a solid, each with what is known of it there.
type Cells<K> = Vec<(Aabb, K)>;

impl<S: Shrink> Faces<'_, S> {
    /// How far the solid reaches, and cells that hold it; `None` if there is no part of it. `work` is what may still be
    /// spent.
    fn find(&self, parts: Cells<S::Known>, work: &mut usize) -> Option<(Reach, Cells<S::Known>)> {
        let (side, hull) = (self.side, self.hull);
        let cell = |(space, known): (Aabb, S::Known)| {
            let space = space.intersection(&hull);
            (!space.is_empty()).then(|| Queued { rank: side.of(&space), space, known })
        };
        // the rank is how far out a box reaches
        let mut queue: BinaryHeap<Queued<S::Known>> = parts.into_iter().filter_map(cell).collect();
        // how far out a point of the solid is known
        let mut found = f64::NEG_INFINITY;
        let mut cells = 0;
        loop {
            let farthest = queue.pop()?;
            let goal = self.goal(&farthest, cells);
            if farthest.rank - found > goal {
                found = found.max(self.farthest_point(&farthest, goal));
            }
            if farthest.rank - found <= goal || cells == CELLS_OF_SIDE || *work == 0 {
                let reach = Reach { farthest: farthest.rank, is_near: farthest.rank - found <= goal };
                queue.push(farthest);
                return Some((reach, queue.into_iter().map(|cell| (cell.space, cell.known)).collect()));
            }
            cells += 1;
            *work = work.saturating_sub(self.solid.work(&farthest.known));
            for mut half in farthest.space.halves_seen_from(DVec3::ZERO) {
                if let Some(known) = self.solid.shrink(&farthest.known, &mut half, Effort::Cell) {
                    queue.push(Queued { rank: side.of(&half), space: half, known });
                }
            }
        }
    }

    fn goal(&self, cell: &Queued<S::Known>, cells: usize) -> f64 {
        if self.side.is_open(&cell.space) {
            return 0.0;
        }
        let relative = GOALS.iter().find(|(most, _)| cells < *most).map_or(1e-3, |(_, goal)| *goal);
        relative * longest_side(&self.hull)
    }

    /// How far out a point of the solid is known in a cell.
    fn farthest_point(&self, cell: &Queued<S::Known>, goal: f64) -> f64 {
        if S::is_inside(&cell.known) {
            return cell.rank;
        }
        let mut face = cell.space.centre();
        let inwards = 0.5 * goal;
        let sign = if self.side.upper { 1.0 } else { -1.0 };
        face[self.side.axis] = sign * (cell.rank - inwards);
        // the point of the side that is nearest to the origin: unbounded solids are often seen there
        let mut near = DVec3::ZERO.clamp(cell.space.min, cell.space.max);
        near[self.side.axis] = face[self.side.axis];
        let is_inside = |p: &DVec3| {
            let known = self.solid.shrink(&cell.known, &mut Aabb::new(*p, *p), Effort::Point);
            known.is_some_and(|known| S::is_inside(&known))
        };
        let is_open = self.side.is_open(&cell.space);
        let points = [Some(face), is_open.then_some(near), Some(cell.space.centre())];
        // the farthest come first
        let inside = points.into_iter().flatten().find(is_inside);
        inside.map_or(f64::NEG_INFINITY, |p| self.side.of_point(p))
    }
}
