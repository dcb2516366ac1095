//! The cells of a box, found level by level: a flat grid of 64³, and below it eight children for each cell
//! that is divided further. Questions about them are answered in [`window`](super::window).
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

use glam::{DVec3, UVec3};
use rayon::prelude::*;

use crate::geom::Aabb;
use crate::solid::leaves::leaf_set::LeafTree;
use crate::solid::leaves::pruning::{Verdict, prune};
use crate::solid::leaves::words::{Word, leaf_count};

/// Levels of the flat grid: 2⁶ cells along a side.
pub(super) const DEPTH: u32 = 6;
pub const SIDE: u32 = 1 << DEPTH;

/// Cells of the flat grid are divided further only where more leaves than this are left, if the map answers for
/// distances: these need every leaf.
const FEW_LEAVES: usize = 4;

/// The same for maps of signs alone of a solid at rest. A batch of points costs 0.2 ns for each leaf, a range some 50: outlines of
/// hundreds of corners are meshed six times faster than with [`FEW_LEAVES`], balls and gears as fast.
const FEW_FOR_SIGNS: usize = 16;

/// The deepest level.
pub(super) const MAX_DEPTH: u32 = 10;

/// Below [`DEPTH`], a cell whose leaves have stayed the same for this number of levels is left as it is:
/// surfaces that lie on one another never part.
const LEVELS_IN_VAIN: u32 = 2;

/// Maximum number of ranges of leaves that are computed while a map is built, and so of the words that its
/// cells hold, 4 bytes each. A level that would exceed it is not begun: the cells above it stay as they are.
/// 10 000 balls need a third of it. Cells that a moving solid may touch are divided later, on demand, and do
/// not count.
const MOST_RANGES: usize = 1 << 24;

/// Cells that a moving leaf may pass are left at this depth and divided again for each window of time. About
/// eight of them lie side by side in the region that a paddle of a tenth of the box sweeps.
pub(super) const RESTLESS_DEPTH: u32 = 4;

/// What is known of a cell. The last two bits of a word say which case it is, the other bits where to go on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    Fluid,
    Inside,
    /// Where its program begins.
    Near(u32),
    /// Its first child.
    Divided(u32),
    /// The number of the restless cell that holds it, which is divided for each window of time.
    Restless(u32),
}

/// The cells of a box.
#[derive(Debug)]
pub struct Cells {
    pub domain: Aabb,
    /// Cells of the flat grid for each unit of length.
    pub(super) per_length: DVec3,
    /// x fastest, then y.
    pub(super) grid: Vec<u32>,
    /// First and last of the flat grid's cells that are not fluid, along each axis: most places need look no
    /// further.
    pub(super) occupied: [UVec3; 2],
    /// Eight in a row for each divided cell.
    pub(super) children: Vec<u32>,
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

/// A cell that may hold a surface, while the map is built.
#[derive(Debug, Clone)]
pub struct Pending {
    pub(super) depth: u32,
    /// Number of the cell along each axis at its depth.
    pub(super) at: UVec3,
    pub(super) words: Vec<u32>,
    pub(super) in_vain: u32,
    /// Where it stands among the children, below the flat grid.
    child: usize,
}

impl Cell {
    fn pack(self) -> u32 {
        match self {
            Self::Fluid => 0,
            Self::Inside => 1 << 2,
            Self::Restless(number) => number << 2 | 1,
            Self::Near(start) => start << 2 | 2,
            Self::Divided(first) => first << 2 | 3,
        }
    }

    #[inline]
    pub(super) fn unpack(word: u32) -> Self {
        match (word & 3, word >> 2) {
            (0, 0) => Self::Fluid,
            (0, _) => Self::Inside,
            (1, number) => Self::Restless(number),
            (2, start) => Self::Near(start),
            (_, first) => Self::Divided(first),
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
    /// Divides a box for a map with a reach, or with a reach of 0 for signs alone. `margin` is positive.
    pub fn new(parts: &LeafTree, domain: Aabb, margin: f64, reach: f64) -> Self {
        let few_leaves = if reach > 0.0 { FEW_LEAVES } else { FEW_FOR_SIGNS };
        let (mut cells, level) = Self::begin(parts, domain, margin);
        cells.refine(level, parts, (margin, few_leaves), |_| false);
        cells
    }

    /// Divides a box as far as it is the same during all of the parts' stretch of time. The cells that are
    /// left may change: those in which a leaf that moves matters at some time.
    pub fn lasting(parts: &LeafTree, domain: Aabb, margin: f64) -> (Self, Vec<Pending>) {
        let (mut cells, level) = Self::begin(parts, domain, margin);
        let is_left = |cell: &Pending| cell.depth == RESTLESS_DEPTH && cell.is_restless(parts);
        let left = cells.refine(level, parts, (margin, FEW_LEAVES), is_left);
        for (number, cell) in left.iter().enumerate() {
            cells.write(cell.depth, cell.at, cell.child, Cell::Restless(number as u32));
        }
        (cells, left)
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

    /// Divides cells of one level until few leaves are left in them, or the deepest level is reached; returns
    /// those that `leave` chooses.
    fn refine(
        &mut self,
        mut level: Vec<Pending>,
        parts: &LeafTree,
        (margin, few_leaves): (f64, usize),
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
                if is_final(depth, (count, few_leaves), cell.in_vain) {
                    done.push(cell)
                } else {
                    divided.push((cell, count))
                }
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
            Cell::Near(_) | Cell::Divided(_) | Cell::Restless(_) => self.counts.near += 1,
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
}

/// Whether a cell is not divided further that has kept its leaves for `in_vain` levels, for a map that calls `few`
/// of them few.
fn is_final(depth: u32, (leaves, few): (usize, usize), in_vain: u32) -> bool {
    let enough = leaves <= few || in_vain >= LEVELS_IN_VAIN;
    depth >= MAX_DEPTH || (depth >= DEPTH && enough)
}

pub(super) fn octant(at: UVec3, k: usize) -> UVec3 {
    let k = k as u32;
    2 * at + UVec3::new(k & 1, k >> 1 & 1, k >> 2)
}

/// Whether a cell of a moving solid's map is not divided further, see [`is_final`].
pub(super) fn is_final_in_motion(depth: u32, leaves: usize, in_vain: u32) -> bool {
    is_final(depth, (leaves, FEW_LEAVES), in_vain)
}

fn settled(verdict: Verdict) -> Cell {
    if verdict == Verdict::Inside { Cell::Inside } else { Cell::Fluid }
}
