//! A box divided into cells that know what matters in them: fluid, inside, or the few leaves of a surface nearby.
//!
//! Cells are found by the ranges of the leaves, recursively: where a part is proven to be outside or inside it is
//! dropped from the cell and from all cells within it. A point far from every surface then costs one look-up, and one
//! near a surface the evaluation of the leaves that are left there, however many the solid has. Sign, zero set and
//! the gradient on the surface are exactly those of the twin; the value off the surface is that of the leaf that
//! decides in the cell, and jumps between cells.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::leaf::Leaves;
use super::logic::{Logic, Pruned};
use super::{Parts, Solid, Twin};
use crate::field::{Field, Points};
use crate::geom::Aabb;
use crate::interval::Interval;

/// Cells are divided to this depth wherever there may be a surface: 2⁶ along a side.
const DEPTH: u32 = 6;

/// Deeper, up to [`MAX_DEPTH`], only where more leaves than this are left.
const FEW_LEAVES: usize = 4;
const MAX_DEPTH: u32 = 10;

/// Below [`DEPTH`] a cell whose leaves have stayed the same for so many levels is left as it is: surfaces that lie on
/// one another never part, and would cost time and memory as 4ⁿ.
const LEVELS_IN_VAIN: u32 = 2;

/// Points that are evaluated together.
const RUN: usize = 64;

/// Neighbouring points in one cell from which their joint evaluation pays.
const SHORTEST_RUN: usize = 4;

/// What a place is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Proven to be outside.
    Fluid,
    /// Proven to be inside.
    Inside,
    /// There may be a surface.
    Near,
}

/// A solid specialised to the cells of a box.
pub struct CellMap {
    twin: Twin,
    parts: Arc<Parts>,
    domain: Aabb,
    /// Eight children in a row for each divided cell; the root is the first.
    cells: Vec<Cell>,
    /// What is left of the solid in near cells, each different one once: see [`encode`].
    programs: Vec<u32>,
    stats: CellStats,
}

/// Counts of a cell map.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct CellStats {
    pub leaves: usize,
    /// Programs that had to be compiled for them.
    pub shapes: usize,
    pub fluid: usize,
    pub inside: usize,
    pub near: usize,
    /// Different specialised programs of near cells.
    pub programs: usize,
    /// Leaves in near cells, all together.
    pub leaves_in_cells: usize,
}

#[derive(Debug, Clone, Copy)]
enum Cell {
    Fluid,
    Inside,
    /// Where its program begins.
    Near(u32),
    /// Its first child.
    Divided(u32),
}

/// A cell while the map is built.
enum Node {
    Fluid,
    Inside,
    Near(Logic),
    Divided(Box<[Node; 8]>),
}

impl CellMap {
    /// Divides a box. Nothing if the solid cannot be taken apart, or the box is not finite.
    pub fn new(solid: &Solid, domain: Aabb) -> Option<Self> {
        if domain.is_empty() || !domain.is_finite() {
            return None;
        }
        let parts = solid.parts()?;
        let all = Undivided { leaves: parts.leaves.len(), in_vain: 0, depth: 0 };
        let root = divide(&parts.leaves, &parts.logic, domain, all);
        let leaves = &parts.leaves;
        let stats = CellStats { leaves: leaves.len(), shapes: leaves.shapes(), ..CellStats::default() };
        let (cells, programs) = (vec![Cell::Fluid], Vec::new());
        let mut map = Self { twin: solid.twin(), parts, domain, cells, programs, stats };
        map.place(0, root, &mut HashMap::new());
        Some(map)
    }

    pub fn stats(&self) -> CellStats {
        self.stats
    }

    /// What is known of a place; near for points outside the box.
    pub fn place_of(&self, p: DVec3) -> Place {
        match self.find(p) {
            Some((Cell::Fluid, _)) => Place::Fluid,
            Some((Cell::Inside, _)) => Place::Inside,
            _ => Place::Near,
        }
    }

    /// Writes a finished cell to its place, and its children behind all cells.
    fn place(&mut self, at: usize, node: Node, known: &mut HashMap<Vec<u32>, u32>) {
        let cell = match node {
            Node::Fluid => {
                self.stats.fluid += 1;
                Cell::Fluid
            }
            Node::Inside => {
                self.stats.inside += 1;
                Cell::Inside
            }
            Node::Near(logic) => {
                let mut code = Vec::new();
                encode(&logic, &mut code);
                self.stats.near += 1;
                logic.for_leaves(&mut |_| self.stats.leaves_in_cells += 1);
                let start = *known.entry(code).or_insert_with_key(|code| {
                    self.stats.programs += 1;
                    let start = self.programs.len() as u32;
                    self.programs.extend(code);
                    start
                });
                Cell::Near(start)
            }
            Node::Divided(children) => {
                let first = self.cells.len();
                self.cells.resize(first + 8, Cell::Fluid);
                for (i, child) in children.into_iter().enumerate() {
                    self.place(first + i, child, known);
                }
                Cell::Divided(first as u32)
            }
        };
        self.cells[at] = cell;
    }

    /// The undivided cell of a point, with its box.
    fn find(&self, p: DVec3) -> Option<(Cell, Aabb)> {
        if !self.domain.contains(p) {
            return None; // NaN included
        }
        let (mut cell, mut bounds) = (self.cells[0], self.domain);
        while let Cell::Divided(first) = cell {
            let centre = bounds.centre();
            let upper = p.cmpge(centre);
            cell = self.cells[first as usize + upper.bitmask() as usize];
            bounds = Aabb {
                min: DVec3::select(upper, centre, bounds.min),
                max: DVec3::select(upper, bounds.max, centre),
            };
        }
        Some((cell, bounds))
    }

    /// What stands for ω where only its sign is known: about the distance that is known to be free.
    fn stand_in(bounds: &Aabb) -> f64 {
        bounds.size().min_element()
    }

    /// The value of a program at a point, and the word of the leaf that decides. NaN if any leaf is.
    fn run(&self, at: &mut usize, p: DVec3) -> (f64, u32) {
        let word = self.programs[*at];
        *at += 1;
        let (kind, payload) = (word >> KIND_SHIFT, word & PAYLOAD);
        if kind == LEAF {
            return (signed(self.parts.leaves.value(payload >> 1, p), word), word);
        }
        let mut best = self.run(at, p);
        for _ in 1..payload {
            let next = self.run(at, p);
            let wins = if kind == ALL { next.0 < best.0 } else { next.0 > best.0 };
            if wins || next.0.is_nan() {
                best = next;
            }
        }
        best
    }

    /// The value of a program at up to [`RUN`] points.
    fn run_many(&self, at: &mut usize, points: [&[f64]; 3], out: &mut [f64]) {
        let word = self.programs[*at];
        *at += 1;
        let (kind, payload) = (word >> KIND_SHIFT, word & PAYLOAD);
        if kind == LEAF {
            self.parts.leaves.values(payload >> 1, points, out);
            if word & 1 == 1 {
                out.iter_mut().for_each(|v| *v = -*v);
            }
            return;
        }
        self.run_many(at, points, out);
        let mut other = [0.0; RUN];
        let other = &mut other[..out.len()];
        for _ in 1..payload {
            self.run_many(at, points, other);
            for (best, next) in out.iter_mut().zip(&*other) {
                let wins = if kind == ALL { *next < *best } else { *next > *best };
                if wins || next.is_nan() {
                    *best = *next;
                }
            }
        }
    }

    /// The hull of what is known over a box that lies in a cell.
    fn range_in(&self, cell: Cell, bounds: Aabb, over: &Aabb) -> Interval {
        match cell {
            Cell::Fluid => Interval::point(-Self::stand_in(&bounds)),
            Cell::Inside => Interval::point(Self::stand_in(&bounds)),
            Cell::Near(_) => Interval::ALL,
            Cell::Divided(first) => {
                let centre = bounds.centre();
                let mut range: Option<Interval> = None;
                for (i, corner) in bounds.corners().into_iter().enumerate() {
                    let child = Aabb::new(corner.min(centre), corner.max(centre));
                    if child.intersection(over).is_empty() {
                        continue;
                    }
                    let part = self.range_in(self.cells[first as usize + i], child, over);
                    let hull = range.map_or(part, |so_far| so_far.hull(part));
                    if hull.lo <= 0.0 && hull.hi >= 0.0 {
                        return Interval::ALL; // undecided already
                    }
                    range = Some(hull);
                }
                range.unwrap_or(Interval::ALL)
            }
        }
    }
}

impl Field for CellMap {
    fn omega(&self, p: DVec3) -> f64 {
        match self.find(p) {
            None => self.twin.omega(p),
            Some((Cell::Fluid, bounds)) => -Self::stand_in(&bounds),
            Some((Cell::Inside, bounds)) => Self::stand_in(&bounds),
            Some((Cell::Near(program), _)) => self.run(&mut (program as usize), p).0,
            Some((Cell::Divided(_), _)) => f64::NAN, // `find` ends at undivided cells
        }
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let Some((Cell::Near(program), _)) = self.find(p) else { return self.twin.omega_grad(p) };
        let (value, word) = self.run(&mut (program as usize), p);
        let gradient = self.parts.leaves.gradient((word & PAYLOAD) >> 1, p).1;
        (value, if word & 1 == 1 { -gradient } else { gradient })
    }

    fn continuous(&self, p: DVec3) -> f64 {
        self.twin.omega(p)
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        let mut i = 0;
        while i < points.len() {
            let Some((cell, bounds)) = self.find(points.get(i)) else {
                omega[i] = self.twin.omega(points.get(i));
                i += 1;
                continue;
            };
            let end = (i + RUN).min(points.len());
            let length = (i + 1..end).take_while(|&j| bounds.contains(points.get(j))).count() + 1;
            let run = i..i + length;
            match cell {
                Cell::Near(program) if length >= SHORTEST_RUN => {
                    let columns = [points.x, points.y, points.z].map(|c| &c[run.clone()]);
                    self.run_many(&mut (program as usize), columns, &mut omega[run]);
                }
                Cell::Near(program) => {
                    for j in run {
                        omega[j] = self.run(&mut (program as usize), points.get(j)).0;
                    }
                }
                Cell::Inside => omega[run].fill(Self::stand_in(&bounds)),
                Cell::Fluid | Cell::Divided(_) => omega[run].fill(-Self::stand_in(&bounds)),
            }
            i += length;
        }
    }

    fn range(&self, over: &Aabb) -> Interval {
        if self.domain.union(over) != self.domain {
            return self.twin.range(over);
        }
        self.range_in(self.cells[0], self.domain, over)
    }
}

// A program is a tree in prefix form: a word for each node, its kind above, below it the number of parts, or the
// number of the leaf and whether it is negated.
const KIND_SHIFT: u32 = 30;
const PAYLOAD: u32 = (1 << KIND_SHIFT) - 1;
const LEAF: u32 = 0;
const ALL: u32 = 1;
const ANY: u32 = 2;

fn encode(logic: &Logic, out: &mut Vec<u32>) {
    let (kind, parts) = match logic {
        Logic::Leaf { leaf, negated } => return out.push(leaf << 1 | u32::from(*negated)),
        Logic::All(parts) => (ALL, parts),
        Logic::Any(parts) => (ANY, parts),
    };
    out.push(kind << KIND_SHIFT | parts.len() as u32);
    parts.iter().for_each(|part| encode(part, out));
}

fn signed(value: f64, word: u32) -> f64 {
    if word & 1 == 1 { -value } else { value }
}

/// How a cell has come to be.
#[derive(Debug, Clone, Copy)]
struct Undivided {
    depth: u32,
    /// Leaves of the cell above.
    leaves: usize,
    /// Levels above since a leaf was last dropped.
    in_vain: u32,
}

fn divide(leaves: &Leaves, logic: &Logic, bounds: Aabb, cell: Undivided) -> Node {
    let logic = match logic.prune_in(leaves, &bounds) {
        Pruned::Outside => return Node::Fluid,
        Pruned::Inside => return Node::Inside,
        Pruned::Near(logic) => logic,
    };
    let Undivided { depth, .. } = cell;
    let mut count = 0;
    logic.for_leaves(&mut |_| count += 1);
    let in_vain = if count < cell.leaves { 0 } else { cell.in_vain + 1 };
    if depth >= MAX_DEPTH || (depth >= DEPTH && (count <= FEW_LEAVES || in_vain >= LEVELS_IN_VAIN)) {
        return Node::Near(logic);
    }
    let below = Undivided { depth: depth + 1, leaves: count, in_vain };
    let centre = bounds.centre();
    let child =
        |corner: DVec3| divide(leaves, &logic, Aabb::new(corner.min(centre), corner.max(centre)), below);
    // the upper levels in parallel; the tree is the same for any number of threads
    let children: Vec<Node> = if depth < 3 {
        bounds.corners().into_par_iter().map(child).collect()
    } else {
        bounds.corners().into_iter().map(child).collect()
    };
    match children.try_into() {
        Ok(children) => Node::Divided(Box::new(children)),
        Err(_) => Node::Near(logic), // a box has eight corners
    }
}
