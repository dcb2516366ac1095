//! The cells of a box, found level by level: a flat grid of 64³, and below it eight children for each cell
//! that is divided further.
//!
//! Each cell is judged with a margin: by the ranges of the leaves over the cell *grown* by it. A cell without
//! a surface is then farther than the margin from every surface, and one near a surface keeps every leaf that
//! decides within the margin of any of its points.
//!
//! No other leaf matters for the distance either. Let a tree combine the distances u and v, up to the margin
//! r, by min and max, and let v be that of a dropped leaf. It has no zero within r, so |v| ≥ r. Cutting off
//! distances at ±r commutes with min and max, and min(u, r) = u for a u that is cut off. So without v the
//! tree has the same distance wherever that is less than r, found by the same leaf.

use std::collections::HashMap;
use std::ops::ControlFlow;

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use crate::geom::Aabb;
use crate::solid::leaves::leaf_set::LeafTree;
use crate::solid::leaves::pruning::{Verdict, prune};
use crate::solid::leaves::words::{Word, leaf_count};

/// Levels of the flat grid: 2⁶ cells along a side.
pub(super) const DEPTH: u32 = 6;
pub const SIDE: u32 = 1 << DEPTH;

/// Cells of the flat grid are divided further only where more leaves than this are left.
const FEW_LEAVES: usize = 4;

/// The deepest level.
const MAX_DEPTH: u32 = 10;

/// Below [`DEPTH`] a cell whose leaves have stayed the same for so many levels is left as it is: surfaces
/// that lie on one another never part.
const LEVELS_IN_VAIN: u32 = 2;

/// Ranges of leaves asked for while a map is built, and with that the words that its cells hold, 4 bytes
/// each. A level that would exceed it is not begun: the cells above it stay as they are. 10 000 balls need a
/// third of it.
const MOST_RANGES: usize = 1 << 24;

/// Cells that a moving leaf may pass are left at this depth and divided anew for each window of time. Some
/// eight of them lie side by side in what a paddle of a tenth of the box sweeps.
const RESTLESS_DEPTH: u32 = 4;

/// What is known of a cell; its last two bits say which, the others where to go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    Fluid,
    Inside,
    /// Where its program begins.
    Near(u32),
    /// Its first child.
    Divided(u32),
}

/// The cells of a box.
#[derive(Debug, Clone)]
pub struct Cells {
    pub domain: Aabb,
    /// Cells of the flat grid for each unit of length.
    per_length: DVec3,
    /// x fastest, then y.
    grid: Vec<u32>,
    /// First and last of the flat grid's cells that are not fluid, along each axis: most places need look no
    /// further.
    occupied: [UVec3; 2],
    /// Eight in a row for each divided cell.
    children: Vec<u32>,
    /// What is left of the solid in near cells, each different one once, in prefix form.
    pub programs: Vec<u32>,
    pub counts: Counts,
}

#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    pub fluid: usize,
    pub inside: usize,
    pub near: usize,
    pub programs: usize,
    pub leaves_in_cells: usize,
}

/// An undivided cell and its place. Two points are in one cell if their places are equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found {
    pub cell: Cell,
    pub depth: u32,
    pub place: u32,
}

/// A cell that may hold a surface, while the map is built.
#[derive(Debug, Clone)]
pub struct Pending {
    depth: u32,
    /// Number of the cell along each axis at its depth.
    at: UVec3,
    words: Vec<u32>,
    in_vain: u32,
    /// Where it stands among the children, below the flat grid.
    child: usize,
}

impl Cell {
    fn pack(self) -> u32 {
        match self {
            Self::Fluid => 0,
            Self::Inside => 1,
            Self::Near(start) => start << 2 | 2,
            Self::Divided(first) => first << 2 | 3,
        }
    }

    #[inline]
    fn unpack(word: u32) -> Self {
        match word & 3 {
            0 => Self::Fluid,
            1 => Self::Inside,
            2 => Self::Near(word >> 2),
            _ => Self::Divided(word >> 2),
        }
    }
}

/// What is known of a box, and what is left of the solid in it.
pub(super) fn judged(parts: &LeafTree, over: &Aabb, words: &[u32]) -> (Verdict, Vec<u32>) {
    let mut left = Vec::new();
    let verdict = prune(words, &mut |leaf| parts.leaves.range_among_many(leaf, over), &mut left);
    (verdict, left)
}

/// The box of a cell.
pub(super) fn bounds(domain: &Aabb, depth: u32, at: UVec3) -> Aabb {
    let size = domain.size() / f64::from(1u32 << depth);
    let corner = domain.min + size * at.as_dvec3();
    Aabb::new(corner, corner + size)
}

impl Pending {
    /// Whether a leaf that moves is left in it.
    fn is_restless(&self, parts: &LeafTree) -> bool {
        let moves =
            |&word: &u32| matches!(Word::read(word), Word::Leaf { leaf, .. } if parts.leaves.moves(leaf));
        self.words.iter().any(moves)
    }
}

impl Cells {
    /// Divides a box; `margin` is positive.
    pub fn new(parts: &LeafTree, domain: Aabb, margin: f64) -> Self {
        let (mut cells, level) = Self::begin(parts, domain, margin);
        cells.refine(level, parts, margin, |_| false);
        cells
    }

    /// Divides a box as far as it is the same during all of the parts' stretch of time. The cells that are
    /// left may change: those in which a leaf that moves matters at some time.
    pub fn lasting(parts: &LeafTree, domain: Aabb, margin: f64) -> (Self, Vec<Pending>) {
        let (mut cells, level) = Self::begin(parts, domain, margin);
        let left = cells
            .refine(level, parts, margin, |cell| cell.depth == RESTLESS_DEPTH && cell.is_restless(parts));
        (cells, left)
    }

    /// What [`Cells::lasting`] has found, with the cells that it has left divided for a shorter stretch of
    /// time.
    pub fn completed(&self, left: &[Pending], parts: &LeafTree, margin: f64) -> Self {
        let mut cells = self.clone();
        cells.refine(left.to_vec(), parts, margin, |_| false);
        cells
    }

    /// The box as one cell, unless it is settled at once.
    fn begin(parts: &LeafTree, domain: Aabb, margin: f64) -> (Self, Vec<Pending>) {
        let mut cells = Self {
            domain,
            per_length: f64::from(SIDE) / domain.size(),
            grid: vec![Cell::Fluid.pack(); (SIDE * SIDE * SIDE) as usize],
            occupied: [UVec3::MAX, UVec3::ZERO],
            children: Vec::new(),
            programs: Vec::new(),
            counts: Counts::default(),
        };
        let level = match judged(parts, &domain.grown(margin), &parts.words) {
            (Verdict::Near, words) => {
                vec![Pending { depth: 0, at: UVec3::ZERO, words, in_vain: 0, child: 0 }]
            }
            (verdict, _) => {
                cells.settle(0, UVec3::ZERO, 0, settled(verdict));
                Vec::new()
            }
        };
        (cells, level)
    }

    /// Divides cells of one level until little is left in them, or the deepest level is reached; gives back those
    /// that `leave` says.
    fn refine(
        &mut self,
        mut level: Vec<Pending>,
        parts: &LeafTree,
        margin: f64,
        leave: impl Fn(&Pending) -> bool,
    ) -> Vec<Pending> {
        let domain = self.domain;
        let judge = |depth: u32, at: UVec3, words: &[u32]| {
            judged(parts, &bounds(&domain, depth, at).grown(margin), words)
        };
        let mut known = HashMap::new();
        let mut spent = 0;
        let mut all_left = Vec::new();
        loop {
            let (left, rest): (Vec<_>, Vec<_>) = level.into_iter().partition(&leave);
            all_left.extend(left);
            level = rest;
            let Some(depth) = level.first().map(|cell: &Pending| cell.depth) else { return all_left };
            let leaves: Vec<usize> = level.iter().map(|cell| leaf_count(&cell.words)).collect();
            spent += 8 * leaves.iter().sum::<usize>();
            if spent > MOST_RANGES || depth >= MAX_DEPTH {
                level.into_iter().for_each(|cell| self.finish(cell, &mut known));
                return all_left;
            }
            let (mut divided, mut done) = (Vec::new(), Vec::new());
            for (cell, count) in level.into_iter().zip(leaves) {
                let enough = count <= FEW_LEAVES || cell.in_vain >= LEVELS_IN_VAIN;
                if depth >= DEPTH && enough { done.push(cell) } else { divided.push((cell, count)) }
            }
            done.into_iter().for_each(|cell| self.finish(cell, &mut known));
            let octants = |(cell, _): &(Pending, usize)| -> [(Verdict, Vec<u32>); 8] {
                std::array::from_fn(|k| judge(depth + 1, octant(cell.at, k), &cell.words))
            };
            // collected in order: the map is the same for any number of threads
            let octants: Vec<_> = divided.par_iter().map(octants).collect();
            level = Vec::new();
            for ((cell, count), octants) in divided.into_iter().zip(octants) {
                let first = self.divide(&cell);
                for (k, (verdict, words)) in octants.into_iter().enumerate() {
                    let (at, child) = (octant(cell.at, k), first + k);
                    if verdict == Verdict::Near {
                        let in_vain = if leaf_count(&words) < count { 0 } else { cell.in_vain + 1 };
                        level.push(Pending { depth: depth + 1, at, words, in_vain, child });
                    } else {
                        self.settle(depth + 1, at, child, settled(verdict));
                    }
                }
            }
        }
    }

    /// Makes room for the children of a cell below the flat grid, and returns where they begin.
    fn divide(&mut self, cell: &Pending) -> usize {
        if cell.depth < DEPTH {
            return 0;
        }
        let first = self.children.len();
        self.children.resize(first + 8, Cell::Fluid.pack());
        self.write(cell.depth, cell.at, cell.child, Cell::Divided(first as u32));
        first
    }

    /// Keeps what is left of the solid in a cell that is not divided.
    fn finish(&mut self, cell: Pending, known: &mut HashMap<Vec<u32>, u32>) {
        self.counts.leaves_in_cells += leaf_count(&cell.words);
        let (programs, counts) = (&mut self.programs, &mut self.counts);
        let start = *known.entry(cell.words).or_insert_with_key(|words| {
            counts.programs += 1;
            let start = programs.len() as u32;
            programs.extend(words);
            start
        });
        self.settle(cell.depth, cell.at, cell.child, Cell::Near(start));
    }

    fn settle(&mut self, depth: u32, at: UVec3, child: usize, cell: Cell) {
        match cell {
            Cell::Fluid => self.counts.fluid += 1,
            Cell::Inside => self.counts.inside += 1,
            Cell::Near(_) | Cell::Divided(_) => self.counts.near += 1,
        }
        self.write(depth, at, child, cell);
    }

    fn write(&mut self, depth: u32, at: UVec3, child: usize, cell: Cell) {
        if depth > DEPTH {
            self.children[child] = cell.pack();
            return;
        }
        // a cell above the flat grid fills a cube of it
        let side = 1 << (DEPTH - depth);
        let first = at * side;
        if cell != Cell::Fluid {
            let [low, high] = self.occupied;
            self.occupied = [low.min(first), high.max(first + side - 1)];
        }
        for z in first.z..first.z + side {
            for y in first.y..first.y + side {
                let row = ((z * SIDE + y) * SIDE + first.x) as usize;
                self.grid[row..row + side as usize].fill(cell.pack());
            }
        }
    }

    /// The undivided cell of a point; `None` outside the box, and for NaN.
    #[inline]
    pub fn find(&self, p: DVec3) -> Option<Found> {
        let q = (p - self.domain.min) * self.per_length;
        let within = q.cmpge(DVec3::ZERO).all() && q.cmple(DVec3::splat(f64::from(SIDE))).all();
        if !within {
            return None;
        }
        let at = q.as_uvec3().min(UVec3::splat(SIDE - 1));
        let place = (at.z * SIDE + at.y) * SIDE + at.x;
        let [low, high] = self.occupied;
        let is_occupied = at.cmpge(low).all() && at.cmple(high).all();
        let cell = if is_occupied { Cell::unpack(self.grid[place as usize]) } else { Cell::Fluid };
        match cell {
            Cell::Divided(first) => Some(self.descend(first, q - at.as_dvec3())),
            cell => Some(Found { cell, depth: DEPTH, place }),
        }
    }

    /// Below the flat grid; `q` is the place in the cell, 0 to 1.
    fn descend(&self, mut first: u32, mut q: DVec3) -> Found {
        let mut depth = DEPTH + 1;
        loop {
            let upper = q.cmpge(DVec3::splat(0.5));
            q = 2.0 * q - DVec3::select(upper, DVec3::ONE, DVec3::ZERO);
            let place = first + upper.bitmask();
            match Cell::unpack(self.children[place as usize]) {
                Cell::Divided(below) => (first, depth) = (below, depth + 1),
                // places of the grid come first
                cell => return Found { cell, depth, place: SIDE * SIDE * SIDE + place },
            }
        }
    }

    /// The box of the cell, `depth` levels deep, that holds a point of the domain.
    pub fn bounds_at(&self, p: DVec3, depth: u32) -> Aabb {
        let side = f64::from(1u32 << depth);
        let q = (p - self.domain.min) * self.per_length * (side / f64::from(SIDE));
        bounds(&self.domain, depth, q.clamp(DVec3::ZERO, DVec3::splat(side - 1.0)).as_uvec3())
    }

    /// Whether a box within the domain touches fluid alone, as far as the flat grid says, and no more than `most` of its
    /// cells.
    pub fn is_fluid(&self, over: &Aabb, most: usize) -> bool {
        let touched = self.touched(over, most);
        touched.is_some_and(|mut cells| cells.all(|(_, cell)| cell == Cell::Fluid))
    }

    /// Visits the undivided cells that a box within the domain touches, and perhaps some beside it, with their depths. The
    /// visit ends where `visit` breaks it off. `None` if the box touches more than `most` cells of the flat grid.
    pub fn visit<B>(
        &self,
        over: &Aabb,
        most: usize,
        visit: &mut impl FnMut(Cell, u32) -> ControlFlow<B>,
    ) -> Option<ControlFlow<B>> {
        // points that rounding puts into the next cell are in it
        let largest = over.min.abs().max(over.max.abs()).max_element();
        let wider = over.grown(1e-9 * self.shortest_side(MAX_DEPTH) + 64.0 * f64::EPSILON * largest);
        for (at, cell) in self.touched(over, most)? {
            let found = match cell {
                Cell::Divided(first) => self.visit_below((DEPTH, at, first), &wider, visit),
                cell => visit(cell, DEPTH),
            };
            if found.is_break() {
                return Some(found);
            }
        }
        Some(ControlFlow::Continue(()))
    }

    fn visit_below<B>(
        &self,
        (depth, at, first): (u32, UVec3, u32),
        over: &Aabb,
        visit: &mut impl FnMut(Cell, u32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        for k in 0..8 {
            let at = octant(at, k);
            let of_child = bounds(&self.domain, depth + 1, at);
            if !(of_child.min.cmple(over.max).all() && over.min.cmple(of_child.max).all()) {
                continue;
            }
            match Cell::unpack(self.children[first as usize + k]) {
                Cell::Divided(below) => self.visit_below((depth + 1, at, below), over, visit)?,
                cell => visit(cell, depth + 1)?,
            }
        }
        ControlFlow::Continue(())
    }

    /// The cells of the flat grid that a box within the domain touches, with their numbers along the axes; `None` if they are
    /// more than `most`.
    fn touched(&self, over: &Aabb, most: usize) -> Option<impl Iterator<Item = (UVec3, Cell)> + '_> {
        let number = |p: DVec3| {
            let q = (p - self.domain.min) * self.per_length;
            q.clamp(DVec3::ZERO, DVec3::splat(f64::from(SIDE - 1))).as_uvec3()
        };
        let (low, high) = (number(over.min), number(over.max));
        let size = high - low + 1;
        if (size.x * size.y * size.z) as usize > most {
            return None;
        }
        let rows = (low.z..=high.z).flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)));
        Some(rows.flat_map(move |(y, z)| {
            (low.x..=high.x).map(move |x| {
                let word = self.grid[((z * SIDE + y) * SIDE + x) as usize];
                (UVec3::new(x, y, z), Cell::unpack(word))
            })
        }))
    }

    /// The shortest side of a cell.
    #[inline]
    pub fn shortest_side(&self, depth: u32) -> f64 {
        self.domain.size().min_element() / f64::from(1u32 << depth)
    }
}

pub(super) fn octant(at: UVec3, k: usize) -> UVec3 {
    let k = k as u32;
    2 * at + UVec3::new(k & 1, k >> 1 & 1, k >> 2)
}

fn settled(verdict: Verdict) -> Cell {
    if verdict == Verdict::Inside { Cell::Inside } else { Cell::Fluid }
}
