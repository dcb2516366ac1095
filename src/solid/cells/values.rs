//! The value of a tree of leaves, continuous in space, from the few leaves that can decide it in a part of a box.
//!
//! The programs of a cell map's cells keep the sign of the whole tree, not its value, which jumps from cell to
//! cell. Here a member of "all of" is left out of a part of the box only if another one is smaller all over
//! it, and a member of "any of" if another one is larger. So every part gives the same bits as the whole tree.

use std::collections::VecDeque;

use glam::DVec3;
use smallvec::SmallVec;

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::solid::leaves::leaf_set::{LeafTree, Leaves};
use crate::solid::leaves::words::{PAYLOAD, Word, leaf_count};

/// Parts with no more leaves than this are not divided further.
const FEW_LEAVES: usize = 16;

/// The box is halved along each axis so many times at most. Few points are asked for: the values in the cells
/// of a mesh that signs leave open.
const MAX_DEPTH: u32 = 5;

/// Ranges of leaves asked for while a box is divided; the parts that are left then stay as they are.
const MOST_RANGES: usize = 1 << 23;

/// A tree of leaves, specialised to the parts of a box.
pub struct LocalValues {
    domain: Aabb,
    /// The box, and eight children in a row for each part that is divided.
    parts: Vec<Part>,
    /// The trees of all parts, in prefix form.
    words: Vec<u32>,
}

#[derive(Clone, Copy)]
enum Part {
    /// Where its tree begins.
    Whole(u32),
    /// Its first child.
    Divided(u32),
}

/// A part that may be divided.
struct Pending {
    part: usize,
    bounds: Aabb,
    words: Vec<u32>,
    depth: u32,
}

impl LocalValues {
    /// Divides a box where the tree may vanish. It runs on one thread, because threads of a pool wait for it.
    pub fn new(tree: &LeafTree, domain: Aabb) -> Self {
        let mut out = Self { domain, parts: vec![Part::Whole(0)], words: Vec::new() };
        let (range, words) = decisive(&tree.leaves, &tree.words, &domain);
        let mut spent = leaf_count(&tree.words);
        let mut open = VecDeque::new();
        out.add(range, Pending { part: 0, bounds: domain, words, depth: 0 }, &mut open);
        // the coarse parts come first, so that a budget that runs out leaves none of them whole
        while let Some(Pending { part, bounds, words, depth }) = open.pop_front() {
            spent += 8 * leaf_count(&words);
            if spent > MOST_RANGES {
                out.keep(part, &words);
                continue;
            }
            let first = out.parts.len();
            out.parts.resize(first + 8, Part::Whole(0));
            out.parts[part] = Part::Divided(first as u32);
            let centre = bounds.centre();
            for (i, corner) in bounds.corners().into_iter().enumerate() {
                let bounds = Aabb::new(corner.min(centre), corner.max(centre));
                let (range, words) = decisive(&tree.leaves, &words, &bounds);
                out.add(range, Pending { part: first + i, bounds, words, depth: depth + 1 }, &mut open);
            }
        }
        out
    }

    /// Keeps the tree of a part, or leaves it to be divided.
    fn add(&mut self, range: Interval, part: Pending, open: &mut VecDeque<Pending>) {
        let is_settled = range.lo > 0.0 || range.hi < 0.0;
        if is_settled || part.depth == MAX_DEPTH || leaf_count(&part.words) <= FEW_LEAVES {
            self.keep(part.part, &part.words);
        } else {
            open.push_back(part);
        }
    }

    fn keep(&mut self, part: usize, words: &[u32]) {
        self.parts[part] = Part::Whole(self.words.len() as u32);
        self.words.extend_from_slice(words);
    }

    /// The value of the tree at a point of the box, and the leaf that decides there with whether it is negated.
    /// `None` outside the box, and for NaN.
    #[inline]
    pub fn decide(&self, leaves: &Leaves, p: DVec3) -> Option<(f64, (u32, bool))> {
        if !self.domain.contains(p) {
            return None;
        }
        let (mut bounds, mut part) = (self.domain, self.parts[0]);
        loop {
            match part {
                Part::Whole(start) => return Some(leaves.decide(&self.words, &mut (start as usize), p)),
                Part::Divided(first) => {
                    let centre = bounds.centre();
                    let upper = p.cmpgt(centre);
                    bounds = Aabb::new(
                        DVec3::select(upper, centre, bounds.min),
                        DVec3::select(upper, bounds.max, centre),
                    );
                    part = self.parts[(first + upper.bitmask()) as usize];
                }
            }
        }
    }
}

/// The range of a tree over a box, and the part of it that can decide its value there.
fn decisive(leaves: &Leaves, words: &[u32], over: &Aabb) -> (Interval, Vec<u32>) {
    let mut left = Vec::new();
    let range = Decisive { leaves, words, over, left: &mut left }.tree(&mut 0);
    (range, left)
}

struct Decisive<'a> {
    leaves: &'a Leaves,
    words: &'a [u32],
    over: &'a Aabb,
    left: &'a mut Vec<u32>,
}

/// A member of a list: where it begins and ends among the words that are left, and its range.
type Member = (usize, usize, Interval);

impl Decisive<'_> {
    /// The range of the tree at `at`; all numbers if a leaf may be NaN.
    fn tree(&mut self, at: &mut usize) -> Interval {
        let code = self.words[*at];
        *at += 1;
        let (parts, all) = match Word::read(code) {
            Word::Leaf { leaf, negated } => {
                self.left.push(code);
                let range = self.leaves.range(leaf, self.over);
                return if negated { -range } else { range };
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let start = self.left.len();
        self.left.push(code);
        let members: SmallVec<[Member; 8]> = (0..parts)
            .map(|_| {
                let begin = self.left.len();
                let range = self.tree(at);
                (begin, self.left.len(), range)
            })
            .collect();
        self.keep_decisive(start, all, &members)
    }

    /// Drops the members of a list that cannot decide it, and returns the list's range.
    fn keep_decisive(&mut self, start: usize, all: bool, members: &[Member]) -> Interval {
        let range = |member: &Member| member.2;
        let ends = members.iter().map(range).map(|Interval { lo, hi }| if all { (hi, lo) } else { (lo, hi) });
        // the value of the list lies between these
        let (near, far) = if all {
            ends.fold((f64::INFINITY, f64::INFINITY), |(a, b), (x, y)| (x.min(a), y.min(b)))
        } else {
            ends.fold((f64::NEG_INFINITY, f64::NEG_INFINITY), |(a, b), (x, y)| (x.max(a), y.max(b)))
        };
        let (mut end, mut count) = (start + 1, 0);
        for &(first, last, Interval { lo, hi }) in members {
            // a member that may be NaN has infinite ends and stays
            if if all { lo > near } else { hi < near } {
                continue;
            }
            self.left.copy_within(first..last, end);
            end += last - first;
            count += 1;
        }
        self.left.truncate(end);
        if count == 1 {
            self.left.remove(start);
        } else {
            self.left[start] = self.left[start] & !PAYLOAD | count;
        }
        let may_be_nan = members.iter().any(|member| range(member) == Interval::ALL);
        match (may_be_nan, all) {
            (true, _) => Interval::ALL,
            (false, true) => Interval { lo: far, hi: near },
            (false, false) => Interval { lo: near, hi: far },
        }
    }
}
