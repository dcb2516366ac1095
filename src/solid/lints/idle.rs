//! Operands of `and` and `or` whose removal changes nothing.
//!
//! Points of a lattice show that most operands matter. For each of the others, all of space is divided into
//! boxes, in which ranges of the leaves must prove that it does not matter.

use glam::DVec3;

use super::operands::{Operands, Sign};
use crate::diagnostic::{SourceId, Span};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::solid::bounds::search::SEARCH_RADIUS;
use crate::solid::construction::Solid;
use crate::solid::leaves::leaf_set::Leaves;

/// Points along each side of the lattice.
const POINTS: usize = 17;

/// The lattice covers the bounds and a margin around them, as a part of their longest side, because an
/// operand that cuts something off shows there.
const MARGIN: f64 = 0.3;

/// Maximum number of operations that are spent on one operand: some tenths of a second.
const OPERATIONS_OF_ONE: usize = 8_000_000;

/// What a leaf costs beside its operations, for its range and the signs of its operands, in operations.
const OPERATIONS_BESIDE: usize = 4;

/// How many values cost as much as a range.
const VALUES_PER_RANGE: usize = 4;

/// Boxes that are smaller than this part of the solid decide nothing: the surfaces touch.
const SMALLEST: f64 = 1e-4;

/// Operands that could be left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Idle {
    /// Where they are written.
    pub spans: Vec<Span>,
    /// Whether the budget ended before all operands were looked at.
    pub is_cut: bool,
}

/// What came of the search for one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Proof {
    /// The solid is the same without it.
    Idle,
    /// It matters at a point, or boxes became too small to decide.
    Open,
    /// The budget ended.
    Cut,
}

impl Solid {
    /// The places in a text of operands that could be left out: the solid has the same points without each of
    /// them, and without all of them together. Nothing is known for a solid that moves or has no bounds.
    /// `budget` counts operations, and may be shared by many solids.
    pub fn idle_operands(&self, source: SourceId, budget: &mut usize) -> Idle {
        let mut found = Idle::default();
        let (graph, root) = self.formula();
        let (Some(bounds), false) = (self.bounds().aabb(), self.moves()) else { return found };
        let Some(operands) = Operands::of(graph, root) else { return found };
        let candidates = operands.candidates(source);
        if candidates.is_empty() {
            return found;
        }
        let Some(parts) = self.parts() else { return found };
        let search = Search::new(&operands, &parts.leaves, bounds);
        let Some(left) = search.seen_nowhere(&candidates, budget) else {
            return Idle { is_cut: true, ..found };
        };
        let mut removed = vec![false; operands.all.len()];
        for operand in left {
            let is_part_of_removed =
                removed.iter().enumerate().any(|(i, &gone)| gone && operands.is_within(operand, i));
            if is_part_of_removed {
                continue;
            }
            match search.prove(operand, &removed, budget) {
                Proof::Idle => {
                    removed[operand] = true;
                    found.spans.extend(operands.all[operand].span);
                }
                Proof::Open => {}
                Proof::Cut => found.is_cut = true,
            }
        }
        found
    }
}

impl Operands {
    /// Operands that a person has written as such, and could remove: each at a place of its own in the text.
    /// The members of a fold and the parts of a standard solid share theirs.
    fn candidates(&self, source: SourceId) -> Vec<usize> {
        let place = |i: usize| self.all[i].span.filter(|span| span.source == source);
        let is_outermost = |i: &usize| match self.all[*i].joined {
            Some((parent, other)) => place(*i) != place(parent) && place(*i) != place(other),
            None => false,
        };
        let outermost: Vec<usize> =
            (0..self.all.len()).filter(|&i| place(i).is_some()).filter(is_outermost).collect();
        let times = |i: usize| {
            let written = |&other: &usize| place(other) == place(i) && other != i;
            outermost.iter().filter(|other| written(other)).count()
        };
        outermost.iter().copied().filter(|&i| times(i) == 0).collect()
    }
}

struct Search<'a> {
    operands: &'a Operands,
    leaves: &'a Leaves,
    bounds: Aabb,
    /// What the signs of all operands in a box cost, in operations.
    cost: usize,
}

impl<'a> Search<'a> {
    fn new(operands: &'a Operands, leaves: &'a Leaves, bounds: Aabb) -> Self {
        let of_leaf = |leaf: u32| leaves.operations(leaf) + OPERATIONS_BESIDE;
        let cost = (0..operands.leaves as u32).map(of_leaf).sum();
        Self { operands, leaves, bounds, cost }
    }

    /// Those of some operands that matter at no point of a lattice; `None` if the budget ends before.
    fn seen_nowhere(&self, candidates: &[usize], budget: &mut usize) -> Option<Vec<usize>> {
        let space = self.bounds.grown(MARGIN * self.bounds.size().max_element());
        let step = space.size() / (POINTS - 1) as f64;
        let none = vec![false; self.operands.all.len()];
        let mut left = candidates.to_vec();
        for plane in 0..POINTS {
            if left.is_empty() {
                break;
            }
            *budget = budget.checked_sub(POINTS * POINTS * self.cost / VALUES_PER_RANGE)?;
            let points: Vec<DVec3> = (0..POINTS * POINTS)
                .map(|i| {
                    space.min + step * DVec3::new((i % POINTS) as f64, (i / POINTS) as f64, plane as f64)
                })
                .collect();
            let columns: [Vec<f64>; 3] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect());
            let values: Vec<Vec<f64>> = (0..self.operands.leaves as u32)
                .map(|leaf| {
                    let mut out = vec![0.0; points.len()];
                    self.leaves.values(leaf, columns.each_ref().map(|c| &c[..]), &mut out);
                    out
                })
                .collect();
            for i in 0..points.len() {
                let signs: Vec<Sign> = values.iter().map(|of_leaf| sign_of(of_leaf[i])).collect();
                let idle = self.operands.without_effect(&signs, &none);
                left.retain(|&operand| idle[operand]);
            }
        }
        Some(left)
    }

    /// Whether all of space is proven to have the same points without an operand.
    fn prove(&self, operand: usize, removed: &[bool], budget: &mut usize) -> Proof {
        let smallest = SMALLEST * self.bounds.size().max_element();
        let mut open = vec![Aabb::new(DVec3::splat(-SEARCH_RADIUS), DVec3::splat(SEARCH_RADIUS))];
        let mut own = OPERATIONS_OF_ONE.min(*budget);
        while let Some(space) = open.pop() {
            let Some(rest) = own.checked_sub(self.cost) else { return Proof::Cut };
            (own, *budget) = (rest, *budget - self.cost);
            let known = |leaf: u32| Sign::of(self.leaves.range(leaf, &space));
            let signs: Vec<Sign> = (0..self.operands.leaves as u32).map(known).collect();
            if self.operands.without_effect(&signs, removed)[operand] {
                continue;
            }
            if space.size().max_element() < smallest || self.matters_at(space.centre(), operand, removed) {
                return Proof::Open;
            }
            open.extend(space.halves_seen_from(DVec3::ZERO));
        }
        Proof::Idle
    }

    fn matters_at(&self, p: DVec3, operand: usize, removed: &[bool]) -> bool {
        let sign = |leaf| sign_of(self.leaves.value(leaf, p));
        let signs: Vec<Sign> = (0..self.operands.leaves as u32).map(sign).collect();
        !self.operands.without_effect(&signs, removed)[operand]
    }
}

/// The sign at a point. A surface through it leaves it open.
fn sign_of(value: f64) -> Sign {
    if value.is_nan() { Sign::Unknown } else { Sign::of(Interval::point(value)) }
}
