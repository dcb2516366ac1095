//! A box around a tree of leaves, made smaller without losing a point of the solid.
//!
//! Each member of "all of" makes the box smaller for the next one, and the linear forms of all members are
//! solved together. "Any of" gives the hull of what each member leaves. Members that are decided in the box
//! drop out of the tree. A point where a leaf is not a number is not in the solid, so a leaf that is positive
//! nowhere decides "all of" whatever the others are.

use std::sync::Arc;

use glam::DVec3;

use crate::geom::Aabb;
use crate::ir::{Contracted, LinearForm, contract_linear, contract_linear_around};
use crate::solid::leaves::leaf_set::{LeafTree, Leaves};
use crate::solid::leaves::words::{PAYLOAD, Word, skip};

use super::search::{Effort, NODES_PER_WORK, Shrink};

/// Rounds over the whole tree for a box of unknown size. Each halves it at least, or is the last.
const MOST_ROUNDS: usize = 24;

/// Rounds for a cell of a subdivision.
const ROUNDS_OF_CELL: usize = 2;

/// A round that leaves more than this of each side is the last one.
const WORTH_ANOTHER: f64 = 0.8;

/// Boxes larger than this come from leaves that are too weak alone.
const UNKNOWN_SIZE: f64 = 1e30;

/// Rounds in which leaves exchange their linear forms, leaves that take part, and forms that are exchanged.
const EXCHANGES: usize = 3;
const MOST_EXCHANGING: usize = 16;
const MOST_GIVEN: usize = 64;

/// The words of the part of a tree that still matters in a box; `None` if all of the box is inside.
pub type Remaining = Option<Arc<[u32]>>;

/// A tree of the leaves of a solid: that of the solid, or of its complement.
pub struct Tree {
    pub parts: Arc<LeafTree>,
    pub words: Arc<[u32]>,
}

impl Shrink for Tree {
    type Known = Remaining;

    fn everything(&self) -> Remaining {
        Some(self.words.clone())
    }

    fn shrink(&self, known: &Remaining, space: &mut Aabb, effort: Effort) -> Option<Remaining> {
        self.rounds(known, space, effort, None).map(|(known, _)| known)
    }

    fn shrink_from(&self, known: &Remaining, space: &mut Aabb, p: DVec3) -> Option<(Remaining, f64)> {
        self.rounds(known, space, Effort::Cell, Some(p))
    }

    fn work(&self, known: &Remaining) -> usize {
        let Some(words) = known else { return 1 };
        let leaf = |&word: &u32| match Word::read(word) {
            Word::Leaf { leaf, .. } => 1 + self.parts.leaves.contractor(leaf, false).0.len() / NODES_PER_WORK,
            Word::All(_) | Word::Any(_) => 1,
        };
        words.iter().map(leaf).sum()
    }

    fn is_inside(known: &Remaining) -> bool {
        known.is_none()
    }

    /// The members of "any of", each with the box that it had alone.
    fn parts(&self, space: &Aabb) -> Vec<(Aabb, Remaining)> {
        let Word::Any(count) = Word::read(self.words[0]) else {
            return vec![(*space, self.everything())];
        };
        let mut at = 1;
        let members = (0..count).filter_map(|_| {
            let begin = at;
            skip(&self.words, &mut at);
            let words: Arc<[u32]> = self.words[begin..at].into();
            let mut own = *space;
            let known = self.shrink(&Some(words), &mut own, Effort::Large)?;
            Some((own, known))
        });
        members.collect()
    }
}

impl Tree {
    /// Walks over the tree until that no longer pays. With a point `from` it also returns the least distance
    /// from there to all that is left.
    fn rounds(
        &self,
        known: &Remaining,
        space: &mut Aabb,
        effort: Effort,
        from: Option<DVec3>,
    ) -> Option<(Remaining, f64)> {
        let Some(words) = known else { return Some((None, 0.0)) };
        let mut words = words.clone();
        let rounds = if effort == Effort::Large { MOST_ROUNDS } else { ROUNDS_OF_CELL };
        let mut distance: f64 = 0.0;
        for _ in 0..rounds {
            let before = *space;
            let mut pass = Pass {
                leaves: &self.parts.leaves,
                words: &words,
                effort,
                from,
                origin: space.centre(),
                distance: 0.0,
                left: Vec::new(),
                forms: Vec::new(),
            };
            match pass.tree(&mut 0, space) {
                Contracted::Nowhere => return None,
                Contracted::Everywhere => return Some((None, 0.0)),
                Contracted::Somewhere => {}
            }
            if !pass.solve(0, space) {
                return None;
            }
            distance = pass.distance.max(distance);
            if pass.left.len() < words.len() {
                words = pass.left.into();
            }
            if (0..3).all(|axis| space.size()[axis] >= WORTH_ANOTHER * before.size()[axis]) {
                break;
            }
        }
        Some((Some(words), distance))
    }
}

/// One walk over a tree.
struct Pass<'a> {
    leaves: &'a Leaves,
    words: &'a [u32],
    effort: Effort,
    /// The point whose distance is asked for.
    from: Option<DVec3>,
    /// A bound from below of its distance from what was left of the tree that was walked last.
    distance: f64,
    /// Derivatives speak of distances from here.
    origin: DVec3,
    /// The part of the tree that still matters.
    left: Vec<u32>,
    /// Linear forms of the leaves joined by "all of" that is being walked.
    forms: Vec<LinearForm>,
}

impl Pass<'_> {
    fn tree(&mut self, at: &mut usize, space: &mut Aabb) -> Contracted {
        let code = self.words[*at];
        *at += 1;
        match Word::read(code) {
            Word::Leaf { leaf, negated } => {
                let verdict = self.leaf(leaf, negated, space);
                if verdict == Contracted::Somewhere {
                    self.left.push(code);
                }
                verdict
            }
            Word::All(parts) => self.all(code, parts, at, space),
            Word::Any(parts) => self.any(code, parts, at, space),
        }
    }

    fn leaf(&mut self, leaf: u32, negated: bool, space: &mut Aabb) -> Contracted {
        self.distance = 0.0;
        let (contractor, wanted) = self.leaves.contractor(leaf, negated);
        let is_large = self.effort == Effort::Large;
        let verdict = contractor.contract(&wanted, space, is_large.then_some(&mut self.forms));
        if verdict != Contracted::Somewhere || is_large || self.effort == Effort::Point {
            return verdict;
        }
        let count = self.forms.len();
        let verdict = contractor.contract_by_slopes(&wanted, space, (self.origin, &mut self.forms));
        if let (Some(p), Some(form)) = (self.from, self.forms.get(count)) {
            let local = Aabb::new(space.min - self.origin, space.max - self.origin);
            self.distance = form.distance(p - self.origin, &local);
        }
        verdict
    }

    /// Cuts off what the linear forms from `first` on exclude together. False if nothing is left.
    fn solve(&self, first: usize, space: &mut Aabb) -> bool {
        let forms = &self.forms[first..];
        match self.effort {
            Effort::Large => contract_linear(forms, space),
            Effort::Cell => contract_linear_around(self.origin, forms, space),
            Effort::Point => true,
        }
    }

    fn all(&mut self, code: u32, parts: u32, at: &mut usize, space: &mut Aabb) -> Contracted {
        let (start, first_form) = (self.left.len(), self.forms.len());
        self.left.push(code);
        let (mut count, mut missed, mut distance) = (0, false, 0.0_f64);
        for _ in 0..parts {
            if missed {
                skip(self.words, at);
                continue;
            }
            match self.tree(at, space) {
                Contracted::Nowhere => missed = true,
                Contracted::Everywhere => {}
                Contracted::Somewhere => {
                    count += 1;
                    distance = distance.max(self.distance);
                }
            }
        }
        self.distance = distance;
        if !missed && self.effort == Effort::Large && space.size().max_element() > UNKNOWN_SIZE {
            missed = !self.exchange(first_form, start, space);
        }
        missed = missed || !self.solve(first_form, space);
        self.forms.truncate(first_form);
        if missed {
            self.left.truncate(start);
            return Contracted::Nowhere;
        }
        self.close(start, code, count, Contracted::Everywhere)
    }

    /// Shares the linear forms among the leaves that are joined by "all of": a cone ends at its base, which
    /// its mantle does not know. False if nothing is left of the box.
    fn exchange(&mut self, first_form: usize, start: usize, space: &mut Aabb) -> bool {
        let leaves: Vec<(u32, bool)> = self.left[start + 1..]
            .iter()
            .map_while(|&word| match Word::read(word) {
                Word::Leaf { leaf, negated } => Some((leaf, negated)),
                Word::All(_) | Word::Any(_) => None,
            })
            .take(MOST_EXCHANGING)
            .collect();
        for _ in 0..EXCHANGES {
            let given: Vec<LinearForm> = self.forms[first_form..].iter().take(MOST_GIVEN).copied().collect();
            for &(leaf, negated) in &leaves {
                let (contractor, wanted) = self.leaves.contractor(leaf, negated);
                let forms = Some(&mut self.forms);
                if contractor.contract_given(&given, &wanted, space, forms) == Contracted::Nowhere {
                    return false;
                }
            }
            if !contract_linear(&self.forms[first_form..], space) {
                return false;
            }
        }
        true
    }

    fn any(&mut self, code: u32, parts: u32, at: &mut usize, space: &mut Aabb) -> Contracted {
        let (start, first_form) = (self.left.len(), self.forms.len());
        self.left.push(code);
        let (mut count, mut filled, mut hull, mut distance) = (0, false, Aabb::EMPTY, f64::INFINITY);
        for _ in 0..parts {
            if filled {
                skip(self.words, at);
                continue;
            }
            let (mut own, before) = (*space, self.left.len());
            let mut verdict = self.tree(at, &mut own);
            if verdict == Contracted::Somewhere && !self.solve(first_form, &mut own) {
                verdict = Contracted::Nowhere;
                self.left.truncate(before);
            }
            self.forms.truncate(first_form);
            match verdict {
                Contracted::Nowhere => {}
                Contracted::Everywhere => filled = true,
                Contracted::Somewhere => {
                    hull = hull.union(&own);
                    distance = distance.min(self.distance);
                    count += 1;
                }
            }
        }
        self.distance = if filled || count == 0 { 0.0 } else { distance };
        if filled {
            self.left.truncate(start);
            return Contracted::Everywhere;
        }
        if count > 0 {
            *space = space.intersection(&hull);
        }
        self.close(start, code, count, Contracted::Nowhere)
    }

    /// Ends a list of `count` members that are left. If none is left, its verdict is `neutral`.
    fn close(&mut self, start: usize, code: u32, count: u32, neutral: Contracted) -> Contracted {
        match count {
            0 => {
                self.left.truncate(start);
                return neutral;
            }
            1 => {
                self.left.remove(start);
            }
            _ => self.left[start] = code & !PAYLOAD | count,
        }
        Contracted::Somewhere
    }
}
