//! Bounds of a solid that is too large to be taken apart: each junction is visited once, whatever uses it.

use std::borrow::Cow;

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{Contracted, Contractor, Graph, Node, Region, SignRule, Wanted, at_instant, contract_linear};
use crate::solid::construction::Solid;

use super::search::{Effort, NODES_PER_WORK, SEARCH_RADIUS, Shrink};
use glam::DVec3;

/// Number of leaves that get a box of their own. Solids that cannot be taken apart have few leaves, and use
/// each of them often.
const MOST_LEAVES: usize = 50_000;

/// Walks over all nodes that a cell takes: forwards, backwards and with slopes, for two halves and some points. A
/// tree of leaves visits the few that are left in the cell.
const WALKS_OF_CELL: usize = 8;

/// The formula of a solid as one.
pub struct WholeFormula {
    contractor: Contractor,
    time: Interval,
    /// Whether the complement is meant.
    negated: bool,
    /// What is known from the boxes of its leaves; `None` if they prove it to be empty.
    hull: Option<Aabb>,
}

impl WholeFormula {
    pub fn of(solid: &Solid, negated: bool) -> Self {
        let time = solid.moment.interval();
        let now = at_its_time(solid);
        let (graph, root) = (now.0.as_ref(), now.1);
        let hull = joined_boxes(graph, root, time, negated);
        Self { contractor: Contractor::new(graph, root), time, negated, hull }
    }

    /// Whether it needs an angle that jumps.
    pub fn has_angles(&self) -> bool {
        self.contractor.has_angles()
    }

    fn contract(&self, space: &mut Aabb, effort: Effort) -> Contracted {
        let wanted =
            Wanted { region: Region { time: self.time, ..Region::of(&Aabb::EMPTY) }, negated: self.negated };
        let mut forms = Vec::new();
        let wants_forms = (effort == Effort::Large).then_some(&mut forms);
        let verdict = self.contractor.contract(&wanted, space, wants_forms);
        match verdict {
            Contracted::Somewhere if !contract_linear(&forms, space) => Contracted::Nowhere,
            Contracted::Somewhere if effort == Effort::Cell => {
                let origin = space.centre();
                self.contractor.contract_by_slopes(&wanted, space, (origin, &mut forms))
            }
            verdict => verdict,
        }
    }
}

impl Shrink for WholeFormula {
    /// Whether all of the box is inside.
    type Known = bool;

    fn everything(&self) -> bool {
        false
    }

    fn shrink(&self, known: &bool, space: &mut Aabb, effort: Effort) -> Option<bool> {
        if *known {
            return Some(true);
        }
        *space = space.intersection(&self.hull?);
        if space.is_empty() {
            return None;
        }
        match self.contract(space, effort) {
            Contracted::Nowhere => None,
            Contracted::Everywhere => Some(true),
            Contracted::Somewhere => Some(false),
        }
    }

    fn shrink_from(&self, known: &bool, space: &mut Aabb, _: DVec3) -> Option<(bool, f64)> {
        self.shrink(known, space, Effort::Cell).map(|known| (known, 0.0))
    }

    fn work(&self, _: &bool) -> usize {
        1 + WALKS_OF_CELL * self.contractor.len() / NODES_PER_WORK
    }

    fn parts(&self, space: &Aabb) -> Vec<(Aabb, bool)> {
        vec![(*space, false)]
    }

    fn is_inside(known: &bool) -> bool {
        *known
    }
}

/// The formula of a solid; at an instant without its time.
pub fn at_its_time(solid: &Solid) -> (Cow<'_, Graph>, Node) {
    let (graph, root) = solid.formula();
    let time = solid.moment.interval();
    if solid.moves() && time.lo == time.hi {
        let (graph, root) = at_instant(graph, root, time.lo);
        (Cow::Owned(graph), root)
    } else {
        (Cow::Borrowed(graph), root)
    }
}

/// Where a junction is positive and where it is negative.
#[derive(Clone, Copy)]
struct Signs {
    positive: Aabb,
    negative: Aabb,
}

/// A box around the points where a root is positive, or negative, from the boxes of its leaves. `None` if
/// there are none.
fn joined_boxes(graph: &Graph, root: Node, time: Interval, negated: bool) -> Option<Aabb> {
    let everywhere = Aabb::new(DVec3::splat(-SEARCH_RADIUS), DVec3::splat(SEARCH_RADIUS));
    let mut used = vec![false; root.index() + 1];
    used[root.index()] = true;
    for i in (0..=root.index()).rev() {
        if used[i] {
            SignRule::of(graph, graph.node(i)).operands().for_each(|operand| used[operand.index()] = true);
        }
    }
    let mut leaves = 0;
    let mut signs = vec![Signs { positive: everywhere, negative: everywhere }; root.index() + 1];
    for i in (0..=root.index()).filter(|&i| used[i]) {
        let of = |node: Node| signs[node.index()];
        let node = graph.node(i);
        signs[i] = match SignRule::of(graph, node) {
            SignRule::All(a, b) => Signs {
                positive: of(a).positive.intersection(&of(b).positive),
                negative: of(a).negative.union(&of(b).negative),
            },
            SignRule::Any(a, b) => Signs {
                positive: of(a).positive.union(&of(b).positive),
                negative: of(a).negative.intersection(&of(b).negative),
            },
            SignRule::Not(a) => Signs { positive: of(a).negative, negative: of(a).positive },
            SignRule::Same(a) => of(a),
            SignRule::Leaf => {
                leaves += 1;
                if leaves > MOST_LEAVES { of(node) } else { leaf(graph, node, time, everywhere) }
            }
        };
        // the union with an empty box must not be made of its corners
        let Signs { positive, negative } = signs[i];
        let tidy = |space: Aabb| if space.is_empty() { Aabb::EMPTY } else { space };
        signs[i] = Signs { positive: tidy(positive), negative: tidy(negative) };
    }
    let Signs { positive, negative } = signs[root.index()];
    let found = if negated { negative } else { positive };
    (!found.is_empty()).then_some(found)
}

fn leaf(graph: &Graph, node: Node, time: Interval, everywhere: Aabb) -> Signs {
    let (graph, root) = graph.extract_cone(node);
    let contractor = Contractor::new(&graph, root);
    let within = |negated: bool| {
        let wanted = Wanted { region: Region { time, ..Region::of(&Aabb::EMPTY) }, negated };
        let (mut space, mut forms) = (everywhere, Vec::new());
        match contractor.contract(&wanted, &mut space, Some(&mut forms)) {
            Contracted::Nowhere => Aabb::EMPTY,
            Contracted::Everywhere => everywhere,
            Contracted::Somewhere if contract_linear(&forms, &mut space) => space,
            Contracted::Somewhere => Aabb::EMPTY,
        }
    };
    Signs { positive: within(false), negative: within(true) }
}
