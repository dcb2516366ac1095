//! The cells in which something moves, divided for a window of time on demand.
//!
//! A moving body may touch a large part of its box, while the fluid beside it touches only a small part of
//! that. Dividing all of it again for each window cost ten times as much as a step of a fluid of some hundred
//! particles.
//!
//! Invariant: what a cell keeps depends on the cell and on the window alone, and not on what was asked before.

use std::collections::{HashMap, HashSet};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use glam::UVec3;

use super::grid::{Counts, DEPTH, Pending, RESTLESS_DEPTH, SIDE, bounds, is_final_in_motion, judged, octant};
use crate::geom::Aabb;
use crate::solid::leaves::leaf_set::LeafTree;
use crate::solid::leaves::pruning::Verdict;
use crate::solid::leaves::words::leaf_count;

/// Maximum number of different trees that are found by their numbers. Cells with other trees are searched at
/// each request.
const MOST_TREES: usize = 1 << 10;

/// The note of a cell of the flat grid about which nothing is known yet.
const UNKNOWN: u32 = 0;
/// The note of a cell that is fluid.
const FLUID: u32 = 1;
/// The note of a cell inside the solid.
const INSIDE: u32 = 2;
/// The note of a cell that is searched each time, because it is divided, or has a tree without a number.
const ELSEWHERE: u32 = 3;
/// The note of a cell whose tree has the number 0; the others follow.
const FIRST_TREE: u32 = 4;

const _: () = assert!(RESTLESS_DEPTH < DEPTH, "restless cells hold cells of the flat grid");

/// The restless cells of a box during a window of time.
pub(super) struct Restless {
    domain: Aabb,
    /// How far cells are grown.
    margin: f64,
    /// The solid during the window.
    parts: Arc<LeafTree>,
    /// The cells, all at [`RESTLESS_DEPTH`].
    left: Arc<[Pending]>,
    /// How each is divided.
    divided: Vec<OnceLock<Divided>>,
    /// What is known of the cells of the flat grid, x fastest, then y: they are needed all the time. Empty if
    /// no cell is restless.
    noted: Vec<AtomicU32>,
    trees: Trees,
}

/// What is left of the solid in cells: each different tree once, in prefix form.
struct Trees {
    numbers: Mutex<HashMap<Arc<[u32]>, u32>>,
    by_number: Vec<OnceLock<Arc<[u32]>>>,
}

/// What is known of a cell, or of one that holds it.
enum Node {
    Fluid,
    Inside,
    /// What is left of the solid, and its number among the trees.
    Near(Arc<[u32]>, u32),
    Divided(Box<Divided>),
}

/// A cell that is divided further.
pub(super) struct Divided {
    /// What is left of the solid, in prefix form.
    words: Arc<[u32]>,
    /// The leaves of that.
    count: usize,
    in_vain: u32,
    octants: [OnceLock<Node>; 8],
}

/// What is found where a cell is.
pub(super) enum Seen<'a> {
    Fluid,
    Inside,
    /// What is left of the solid, in prefix form.
    Near(&'a [u32]),
    Divided(&'a Divided),
}

impl Divided {
    fn new(words: Arc<[u32]>, in_vain: u32) -> Self {
        Self { count: leaf_count(&words), words, in_vain, octants: Default::default() }
    }
}

impl Node {
    fn seen(&self) -> Seen<'_> {
        match self {
            Self::Fluid => Seen::Fluid,
            Self::Inside => Seen::Inside,
            Self::Near(words, _) => Seen::Near(words),
            Self::Divided(divided) => Seen::Divided(divided),
        }
    }
}

impl Trees {
    fn new(most: usize) -> Self {
        let by_number = (0..most).map(|_| OnceLock::new()).collect();
        Self { numbers: Mutex::default(), by_number }
    }

    /// The tree that has these words, and its number.
    fn kept(&self, words: Vec<u32>) -> (Arc<[u32]>, u32) {
        let mut numbers = self.numbers.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((tree, number)) = numbers.get_key_value(&words[..]) {
            return (tree.clone(), *number);
        }
        let (tree, number): (Arc<[u32]>, _) = (words.into(), numbers.len() as u32);
        if let Some(place) = self.by_number.get(number as usize) {
            place.get_or_init(|| tree.clone());
        }
        numbers.insert(tree.clone(), number);
        (tree, number)
    }

    #[inline]
    fn get(&self, number: u32) -> Option<&Arc<[u32]>> {
        self.by_number.get(number as usize)?.get()
    }
}

impl Restless {
    /// The cells that [`Cells::lasting`](super::grid::Cells::lasting) has left, for a solid during a window
    /// of time. They are grown by a positive margin.
    pub fn new(left: Arc<[Pending]>, parts: Arc<LeafTree>, domain: Aabb, margin: f64) -> Self {
        let divided = left.iter().map(|_| OnceLock::new()).collect();
        let (noted, trees) =
            if left.is_empty() { (0, 0) } else { ((SIDE * SIDE * SIDE) as usize, MOST_TREES) };
        let noted = (0..noted).map(|_| AtomicU32::new(UNKNOWN)).collect();
        Self { domain, margin, parts, left, divided, noted, trees: Trees::new(trees) }
    }

    /// What is known of a cell of the flat grid, by the number of the restless cell that holds it.
    #[inline]
    pub fn at(&self, number: u32, at: UVec3) -> Seen<'_> {
        let note = &self.noted[((at.z * SIDE + at.y) * SIDE + at.x) as usize];
        match note.load(Ordering::Acquire) {
            FLUID => Seen::Fluid,
            INSIDE => Seen::Inside,
            UNKNOWN | ELSEWHERE => self.look(note, number, at),
            tree => match self.trees.get(tree - FIRST_TREE) {
                Some(words) => Seen::Near(words),
                None => self.look(note, number, at),
            },
        }
    }

    /// Looks for a cell of the flat grid, and notes what it is.
    #[cold]
    fn look<'a>(&'a self, note: &AtomicU32, number: u32, at: UVec3) -> Seen<'a> {
        let mut parent = self.root(number as usize);
        let mut depth = RESTLESS_DEPTH + 1;
        let node = loop {
            let place = at >> (DEPTH - depth);
            let in_parent = place & UVec3::ONE;
            let k = (in_parent.z << 2 | in_parent.y << 1 | in_parent.x) as usize;
            match self.node(parent, (depth, place), k) {
                Node::Divided(divided) if depth < DEPTH => (parent, depth) = (divided, depth + 1),
                node => break node,
            }
        };
        let found = match node {
            Node::Fluid => FLUID,
            Node::Inside => INSIDE,
            Node::Near(_, tree) if (*tree as usize) < MOST_TREES => FIRST_TREE + tree,
            Node::Near(..) | Node::Divided(_) => ELSEWHERE,
        };
        note.store(found, Ordering::Release);
        node.seen()
    }

    /// What is known of one of the eight parts of a cell: the one of the number `k`, with its depth and its
    /// number along each axis.
    pub fn octant<'a>(&'a self, parent: &'a Divided, place: (u32, UVec3), k: usize) -> Seen<'a> {
        self.node(parent, place, k).seen()
    }

    fn node<'a>(&self, parent: &'a Divided, place: (u32, UVec3), k: usize) -> &'a Node {
        parent.octants[k].get_or_init(|| self.judge(parent, place))
    }

    fn root(&self, number: usize) -> &Divided {
        let cell = &self.left[number];
        self.divided[number].get_or_init(|| Divided::new(cell.words.as_slice().into(), cell.in_vain))
    }

    /// Finds out what is known of a part of a cell.
    fn judge(&self, parent: &Divided, (depth, at): (u32, UVec3)) -> Node {
        let over = bounds(&self.domain, depth, at).grown(self.margin);
        let words = match judged(&self.parts, &over, &parent.words) {
            (Verdict::Outside, _) => return Node::Fluid,
            (Verdict::Inside, _) => return Node::Inside,
            (Verdict::Near, words) => words,
        };
        let count = leaf_count(&words);
        let in_vain = if count < parent.count { 0 } else { parent.in_vain + 1 };
        if is_final_in_motion(depth, count, in_vain) {
            let (tree, number) = self.trees.kept(words);
            Node::Near(tree, number)
        } else {
            Node::Divided(Box::new(Divided::new(words.into(), in_vain)))
        }
    }

    /// Counts all cells, which are divided for that.
    pub fn counts(&self) -> Counts {
        let (mut counts, mut known) = (Counts::default(), HashSet::new());
        for (number, cell) in self.left.iter().enumerate() {
            self.count_below(self.root(number), (cell.depth, cell.at), &mut counts, &mut known);
        }
        counts.programs = known.len();
        counts
    }

    fn count_below(
        &self,
        parent: &Divided,
        (depth, at): (u32, UVec3),
        counts: &mut Counts,
        known: &mut HashSet<u32>,
    ) {
        for k in 0..8 {
            let place = (depth + 1, octant(at, k));
            match self.node(parent, place, k) {
                Node::Fluid => counts.fluid += 1,
                Node::Inside => counts.inside += 1,
                Node::Near(words, tree) => {
                    counts.near += 1;
                    counts.leaves_in_cells += leaf_count(words);
                    known.insert(*tree);
                }
                Node::Divided(divided) => self.count_below(divided, place, counts, known),
            }
        }
    }
}
