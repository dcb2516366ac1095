//! A box around the points at which a formula is positive, from the formula alone.

use rustc_hash::FxHashMap;

use glam::DVec3;

use super::closer::closer;
use super::contractor::{Contractor, Wanted};
use super::cube::cube_around;
use super::linear::{LinearForm, contract_linear};
use super::sets::Contracted;
use crate::geom::Aabb;
use crate::ir::bounds::range::Region;
use crate::ir::derived::sign::SignRule;
use crate::ir::graph::{Expr, Graph, Node};
use crate::ir::interpreter::Interpreter;
use crate::ir::op::{Binary, Unary};

/// Half the side of the cube that is searched.
const FARTHEST: f64 = 1e60;

/// A box that reaches farther counts as having no end.
const OF_USE: f64 = 1e12;

/// Formulas with more nodes are skipped.
const MOST_NODES: usize = 20_000;

/// Rounds of contraction for each junction.
const ROUNDS: usize = 6;

/// Visits to nodes for a cube around a formula that contraction finds no end of: some hundredths of a second.
const MOST_VISITS: usize = 1_000_000;

/// A box is looked for once more from near if that one has a side this much shorter.
const WORTH: f64 = 0.8;

/// A box around the points at which a root is positive at any time. `None` if no end was found on some side,
/// or if there are no such points.
pub fn reach(graph: &Graph, root: Node) -> Option<Aabb> {
    let (graph, root) = folded(graph, root);
    if graph.len() > MOST_NODES {
        return None;
    }
    let mut junctions = Junctions::of(&graph);
    let mut found = junctions.above(root, false, 0.0);
    if !found.is_empty() && !has_ends(&found) {
        found = found.intersection(&junctions.by_choices(root));
    }
    (!found.is_empty() && has_ends(&found)).then_some(found)
}

/// The same, with sides that are near the points, mostly within a few per cent, and for more formulas. Where [`reach`] is as
/// near it has the bits of that. It takes longer, and finds more for params that are numbers than for arguments.
pub fn close_reach(graph: &Graph, root: Node) -> Option<Aabb> {
    let (graph, root) = folded(graph, root);
    let (graph, root) = (&graph, root);
    if graph.len() > MOST_NODES {
        return None;
    }
    let Some(found) = reach(graph, root) else {
        return within_cube(graph, root).filter(|found| !found.is_empty() && has_ends(found));
    };
    let near = from_near(graph, root, found);
    let is_worth_it = (0..3).any(|i| near.size()[i] < WORTH * found.size()[i]);
    Some(if is_worth_it && !near.is_empty() { near } else { found })
}

/// A box around the points at which a root is positive, from a cube around it. `None` if no cube was found.
fn within_cube(graph: &Graph, root: Node) -> Option<Aabb> {
    let (own, top) = graph.extract_cone(root);
    let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated: false };
    let cube = cube_around(&Contractor::new(&own, top), wanted, FARTHEST, MOST_VISITS)?;
    Some(from_near(graph, root, cube))
}

/// What subdivision leaves of a box around the points at which a root is positive.
fn from_near(graph: &Graph, root: Node, space: Aabb) -> Aabb {
    let (graph, root) = graph.extract_cone(root);
    let contractor = Contractor::new(&graph, root).without_ellipsoids();
    let interpreter = Interpreter::new(&graph, &[root]);
    let is_positive = |p: DVec3| {
        let mut value = [0.0];
        interpreter.eval_f64(p.to_array(), &mut value);
        value[0] > 0.0
    };
    closer(&contractor, space, is_positive)
}

/// Whether it is proven that a root is positive at no point and no time. Formulas that would take long are not
/// looked at.
pub fn is_nowhere_positive(graph: &Graph, root: Node) -> bool {
    /// Each box is contracted with the whole formula.
    const MOST_NODES: usize = 2000;
    const MOST_BOXES: usize = 100;
    let (graph, root) = folded(graph, root);
    if graph.len() > MOST_NODES {
        return false;
    }
    let mut junctions = Junctions::of(&graph);
    let mut waiting = vec![junctions.above(root, false, 0.0)];
    for _ in 0..MOST_BOXES {
        let Some(space) = waiting.pop() else { return true };
        let left = junctions.contracted(root, false, 0.0, space);
        if left.is_empty() {
            continue;
        }
        let (size, centre) = (left.size(), left.centre());
        if size.max_element() > OF_USE || value_at(&graph, root, centre) > 0.0 {
            return false;
        }
        let axis = size.max_position();
        let (mut low, mut high) = (left, left);
        low.max[axis] = centre[axis];
        high.min[axis] = centre[axis];
        waiting.extend([low, high]);
    }
    false
}

/// The value of a root at a point at the time 0.
fn value_at(graph: &Graph, root: Node, at: DVec3) -> f64 {
    let mut value = [0.0];
    Interpreter::new(graph, &[root]).eval_f64(at.to_array(), &mut value);
    value[0]
}

/// The graph of a root alone, with parts that use no coordinate replaced by their values, because rules look
/// for numbers.
fn folded(graph: &Graph, root: Node) -> (Graph, Node) {
    let mut out = Graph::like(graph);
    let mut image: FxHashMap<Node, Node> = FxHashMap::default();
    for node in graph.cone(root) {
        let expr = graph.expr(node).map(|operand| image[&operand]);
        let number = |node: Node| out.as_constant(node);
        let value = match expr {
            Expr::Unary(op, a) => number(a).map(|a| op.eval(a)),
            Expr::Binary(op, a, b) => number(a).zip(number(b)).map(|(a, b)| op.eval(a, b)),
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => None,
        };
        let new = match value {
            Some(value) => out.constant(value),
            None => out.intern(expr, None),
        };
        image.insert(node, new);
    }
    (out, image[&root])
}

/// The boxes of nodes that decide a sign, and of their complements.
struct Junctions<'g> {
    graph: &'g Graph,
    known: FxHashMap<(Node, bool, u64), Aabb>,
}

/// A node that is to be above −depth, negated or not.
#[derive(Clone, Copy)]
struct Term {
    node: Node,
    negated: bool,
    depth: f64,
}

/// Whether a box ends on all sides.
fn has_ends(found: &Aabb) -> bool {
    found.min.abs().max(found.max.abs()).max_element() < OF_USE
}

/// The most choices of parts that are looked at one by one, their terms, and the nodes of all their graphs.
const MOST_CHOICES: usize = 64;
const MOST_TERMS: usize = 2000;
const MOST_NODES_OF_CHOICES: usize = 1_000_000;

/// If u ∨ v > −c, one of u and v is above −c times this, because u ∨ v is at most (2 − √2)·max(u, v) where
/// both are negative.
const SHARE: f64 = 1.71;

impl<'g> Junctions<'g> {
    fn of(graph: &'g Graph) -> Self {
        Self { graph, known: FxHashMap::default() }
    }

    /// A box around the points at which a node, negated or not, is above −`depth`, which is not negative.
    fn above(&mut self, node: Node, negated: bool, depth: f64) -> Aabb {
        let key = (node, negated, depth.to_bits());
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        let found = match (SignRule::of(self.graph, node), negated) {
            (SignRule::All(u, v), false) | (SignRule::Any(u, v), true) => {
                let both = self.above(u, negated, depth).intersection(&self.above(v, negated, depth));
                self.contracted(node, negated, depth, both)
            }
            (SignRule::All(u, v), true) | (SignRule::Any(u, v), false) => {
                let depth = SHARE * depth;
                self.above(u, negated, depth).union(&self.above(v, negated, depth))
            }
            (SignRule::Not(u), _) => self.above(u, !negated, depth),
            (SignRule::Same(u), _) if depth == 0.0 => self.above(u, negated, depth),
            (SignRule::Same(_) | SignRule::Leaf, _) => match self.shifted(node) {
                Some((of, by)) => {
                    let depth = depth + if negated { -by } else { by };
                    self.above(of, negated, depth.max(0.0))
                }
                None => {
                    let everywhere = Aabb::new(DVec3::splat(-FARTHEST), DVec3::splat(FARTHEST));
                    self.contracted(node, negated, depth, everywhere)
                }
            },
        };
        self.known.insert(key, found);
        found
    }

    /// The boxes of all choices of one part of each "any of", together: a wedge that ends at one of two planes has an
    /// end with each of them, and none with either.
    fn by_choices(&self, root: Node) -> Aabb {
        let everywhere = Aabb::new(DVec3::splat(-FARTHEST), DVec3::splat(FARTHEST));
        let is_short =
            |choices: &Vec<_>| choices.len() > 1 && choices.len() * self.graph.len() <= MOST_NODES_OF_CHOICES;
        let Some(choices) = self.choices(root, false, 0.0).filter(is_short) else { return everywhere };
        let mut graph = self.graph.clone();
        let mut hull = Aabb::EMPTY;
        for terms in choices {
            let mut all: Option<Node> = None;
            for Term { node, negated, depth } in terms {
                let own = if negated { graph.unary(Unary::Neg, node) } else { node };
                let by = graph.constant(depth);
                let own = graph.binary(Binary::Add, own, by);
                all = Some(all.map_or(own, |all| graph.binary(Binary::And, all, own)));
            }
            let Some(all) = all else { return everywhere };
            hull = hull.union(&Junctions::of(&graph).contracted(all, false, 0.0, everywhere));
            if hull.size().min_element() > OF_USE {
                return everywhere;
            }
        }
        hull
    }

    /// The choices of one part of each "any of" under a node: the terms that are above minus their depths together.
    /// `None` if there are too many.
    fn choices(&self, node: Node, negated: bool, depth: f64) -> Option<Vec<Vec<Term>>> {
        let alone = || Some(vec![vec![Term { node, negated, depth }]]);
        match (SignRule::of(self.graph, node), negated) {
            (SignRule::All(u, v), false) | (SignRule::Any(u, v), true) => {
                let (first, second) = (self.choices(u, negated, depth)?, self.choices(v, negated, depth)?);
                let with = |a: &Vec<Term>| second.iter().map(|b| [&a[..], b].concat()).collect::<Vec<_>>();
                let terms = |choices: &[Vec<Term>]| choices.iter().map(Vec::len).sum::<usize>();
                let all = terms(&first) * second.len() + terms(&second) * first.len();
                let few = first.len() * second.len() <= MOST_CHOICES && all <= MOST_TERMS;
                few.then(|| first.iter().flat_map(with).collect())
            }
            (SignRule::All(u, v), true) | (SignRule::Any(u, v), false) => {
                let depth = SHARE * depth;
                let mut all = self.choices(u, negated, depth)?;
                all.extend(self.choices(v, negated, depth)?);
                (all.len() <= MOST_CHOICES).then_some(all)
            }
            (SignRule::Not(u), _) => self.choices(u, !negated, depth),
            (SignRule::Same(u), _) if depth == 0.0 => self.choices(u, negated, depth),
            (SignRule::Same(_) | SignRule::Leaf, _) => match self.shifted(node) {
                Some((of, by)) => {
                    self.choices(of, negated, (depth + if negated { -by } else { by }).max(0.0))
                }
                None => alone(),
            },
        }
    }

    /// A node that is the sum of another node and a number.
    fn shifted(&self, node: Node) -> Option<(Node, f64)> {
        let number = |node| self.graph.as_constant(node);
        match self.graph.expr(node) {
            Expr::Binary(Binary::Add, a, b) => {
                number(a).map(|by| (b, by)).or_else(|| number(b).map(|by| (a, by)))
            }
            Expr::Binary(Binary::Sub, a, b) => number(b).map(|by| (a, -by)),
            _ => None,
        }
    }

    fn contracted(&self, node: Node, negated: bool, depth: f64, mut space: Aabb) -> Aabb {
        let (mut graph, mut root) = self.graph.extract_cone(node);
        if depth > 0.0 {
            let by = graph.constant(if negated { -depth } else { depth });
            root = graph.binary(Binary::Add, root, by);
        }
        let contractor = Contractor::new(&graph, root).without_ellipsoids();
        let mut given: Vec<LinearForm> = Vec::new();
        for _ in 0..ROUNDS {
            if space.is_empty() {
                return Aabb::EMPTY;
            }
            let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated };
            let mut forms = Vec::new();
            match contractor.contract_given(&given, &wanted, &mut space, Some(&mut forms)) {
                Contracted::Nowhere => return Aabb::EMPTY,
                Contracted::Everywhere => return space,
                Contracted::Somewhere if !contract_linear(&forms, &mut space) => return Aabb::EMPTY,
                // the range that one round finds for a form helps the next round with the others
                Contracted::Somewhere => given = forms,
            }
        }
        space
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;

    #[test]
    fn a_turned_square_has_ends_and_half_of_space_has_none() {
        let mut graph = Graph::default();
        let [x, y, z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let one = graph.constant(1.0);
        let band = |graph: &mut Graph, e: Node| {
            let (low, high) = (graph.binary(Binary::Add, e, one), graph.binary(Binary::Sub, one, e));
            graph.binary(Binary::Mul, low, high)
        };
        let (sum, difference) = (graph.binary(Binary::Add, x, y), graph.binary(Binary::Sub, x, y));
        let bands = [sum, difference, z].map(|e| band(&mut graph, e));
        let square = graph.binary(Binary::And, bands[0], bands[1]);
        let cube = graph.binary(Binary::And, square, bands[2]);
        let found = reach(&graph, cube).unwrap();
        assert!((found.max - DVec3::ONE).abs().max_element() < 1e-9, "{found:?}");
        assert!((found.min + DVec3::ONE).abs().max_element() < 1e-9, "{found:?}");
        assert!(reach(&graph, square).is_none());
        assert!(reach(&graph, x).is_none());
        // in its middle the field of the cube is 0.43
        for (by, expected) in [(0.4, false), (0.45, true), (1.5, true)] {
            let by = graph.constant(by);
            let smaller = graph.binary(Binary::Sub, cube, by);
            assert_eq!(is_nowhere_positive(&graph, smaller), expected);
        }
    }
}
