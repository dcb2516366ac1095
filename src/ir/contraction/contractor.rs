//! Contraction over all nodes of a graph: values forwards, remaining parts of operands backwards.

use std::cell::RefCell;

use smallvec::SmallVec;

use super::backward;
use super::forward::{POSITIVE, numbers};
use super::quadric::is_quadric;
use super::rule::{Degree, Rule};
use super::sets::meet;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::choice::Choice;
use crate::ir::bounds::range::{Affine, Region, is_zero};
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::lookup::Tables;
use crate::ir::op::Binary;

/// A graph prepared for contraction.
#[derive(Debug, Clone)]
pub struct Contractor {
    pub(super) rules: Vec<Rule>,
    pub(super) degrees: Vec<Degree>,
    root: Node,
    /// Whether the root is a number only if the node is.
    pub(super) needed: Vec<bool>,
    pub(super) operands: Vec<SmallVec<[Operand; 3]>>,
    /// In the order of the nodes.
    choices: Vec<Choice>,
    /// Linear forms that are operands of something else, or the root.
    pub(super) forms: Vec<Node>,
    coordinates: [Option<Node>; 3],
    /// Whether the root is a form of second degree.
    pub(super) is_quadric: bool,
    pub(super) tables: Tables,
    /// The angles that the root needs.
    pub(super) angles: Vec<Angle>,
}

/// An angle atan2(a, b), which jumps where a = 0 and b < 0.
#[derive(Debug, Clone, Copy)]
pub(super) struct Angle {
    pub node: Node,
    pub a: Node,
    pub b: Node,
}

/// An operand of a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operand {
    pub node: Node,
    /// Whether the node that reads it is a number only if this one is.
    pub needed: bool,
}

/// The question about a formula.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// Time, and the numbers that the formula takes. Its space is not used.
    pub region: Region<'a>,
    /// Whether the formula is to be negative instead of positive.
    pub negated: bool,
}

/// Intervals of the nodes, kept between calls.
#[derive(Default)]
pub(super) struct Scratch {
    pub values: Vec<Interval>,
    /// Whether a node may be undefined somewhere.
    pub may_fail: Vec<bool>,
    /// Whether a node may be infinite somewhere. Values that are read from outside are finite, even if they
    /// are not bounded.
    pub may_be_infinite: Vec<bool>,
    pub slopes: Vec<[Interval; 3]>,
    pub linear: Vec<[Interval; 4]>,
    /// Known values of some nodes, in the order of the nodes.
    pub known: Vec<(Node, Interval)>,
}

thread_local! {
    pub(super) static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// The angles without which the root is no number.
fn angles(graph: &Graph, needed: &[bool]) -> Vec<Angle> {
    let angle = |(node, expr): (Node, Expr)| match expr {
        Expr::Binary(Binary::Call(BinaryFunction::Atan2), a, b) => Some(Angle { node, a, b }),
        Expr::Unary(..)
        | Expr::Binary(..)
        | Expr::Constant(_)
        | Expr::Coordinate(_)
        | Expr::Parameter(_)
        | Expr::Uniform(_)
        | Expr::Lookup(..) => None,
    };
    let is_needed = |angle: &Angle| needed[angle.node.index()] && needed[angle.a.index()];
    graph.nodes().filter_map(angle).filter(is_needed).collect()
}

impl Contractor {
    /// Prepares a root of a graph.
    pub fn new(graph: &Graph, root: Node) -> Self {
        let rules = Rule::all(graph);
        let mut degrees: Vec<Degree> = Vec::with_capacity(rules.len());
        for rule in &rules {
            degrees.push(rule.degree(|node| degrees[node.index()]));
        }
        let operands = rules.iter().map(|rule| {
            let needed: Vec<Node> = rule.needed(graph).collect();
            rule.operands().map(|node| Operand { node, needed: needed.contains(&node) }).collect()
        });
        let operands: Vec<SmallVec<[Operand; 3]>> = operands.collect();
        let mut needed = vec![false; rules.len()];
        needed[root.index()] = true;
        let mut read_by_other = vec![false; rules.len()];
        read_by_other[root.index()] = true;
        for i in (0..=root.index()).rev() {
            for operand in &operands[i] {
                needed[operand.node.index()] |= needed[i] && operand.needed;
                read_by_other[operand.node.index()] |= needed[i] && degrees[i] == Degree::Other;
            }
        }
        let is_form = |&(node, expr): &(Node, Expr)| {
            degrees[node.index()] == Degree::Linear
                && read_by_other[node.index()]
                && needed[node.index()]
                && !matches!(expr, Expr::Coordinate(_))
        };
        let forms = graph.nodes().filter(is_form).map(|(node, _)| node).collect();
        let coordinates = Axis::SPACE.map(|axis| graph.find(Expr::Coordinate(axis)));
        let tables = graph.tables().clone();
        let angles = angles(graph, &needed);
        Self {
            is_quadric: is_quadric(&rules, root),
            rules,
            degrees,
            root,
            needed,
            operands,
            choices: Choice::all(graph),
            forms,
            coordinates,
            tables,
            angles,
        }
    }

    /// The number of nodes that a call visits.
    pub fn len(&self) -> usize {
        self.rules.len()
    }

    /// Whether the root needs an angle that jumps.
    pub fn has_angles(&self) -> bool {
        !self.angles.is_empty()
    }

    /// Runs forwards and backwards. `None` if the root is positive nowhere, true if it is positive
    /// everywhere.
    pub(super) fn pass(&self, region: &Region<'_>, negated: bool, scratch: &mut Scratch) -> Option<bool> {
        self.forward(region, scratch)?;
        let Scratch { values, may_fail, .. } = scratch;
        let root = self.root.index();
        let signed = if negated { -values[root] } else { values[root] };
        if signed.hi <= 0.0 {
            return None;
        }
        if signed.lo > 0.0 && !may_fail[root] {
            return Some(true);
        }
        let positive = meet(signed, POSITIVE)?;
        values[root] = if negated { -positive } else { positive };
        for i in (0..=root).rev() {
            if self.needed[i] {
                self.backward(i, values)?;
            }
        }
        Some(false)
    }

    /// Finds the numbers that each node may be. `None` if a node that the root needs is undefined everywhere.
    pub(super) fn forward(&self, region: &Region<'_>, scratch: &mut Scratch) -> Option<()> {
        let Scratch { values, may_fail, may_be_infinite, known, .. } = scratch;
        let mut known = known.iter().peekable();
        let mut choices = self.choices.iter().peekable();
        values.clear();
        may_fail.clear();
        may_be_infinite.clear();
        for (i, rule) in self.rules[..=self.root.index()].iter().enumerate() {
            let of = |node: Node| values[node.index()];
            let infinite = |node: Node| may_be_infinite[node.index()];
            let (mut is_open, mut fails, mut reads_infinity) = (false, false, false);
            for &Operand { node, needed } in &self.operands[i] {
                let is_unknown = may_fail[node.index()];
                fails |= is_unknown;
                // an operand that may be undefined where the node is defined does not restrict the node
                is_open |= is_unknown && !needed;
                reads_infinity |= infinite(node);
            }
            let found = numbers(rule, of, region, &self.tables);
            fails |= found.may_fail || reads_infinity && rule.fails_at_infinity(of, infinite);
            let is_infinite =
                found.range.is_some_and(|range| !range.is_bounded()) && rule.may_be_infinite(of, infinite);
            // a choice that is decided leaves out the operand that may be undefined
            let is_left_out = matches!(*rule, Rule::Plain(Expr::Binary(Binary::MulOrZero, _, b))
                if is_zero(of(b)) && !may_fail[b.index()]);
            let (is_open, fails) = (is_open && !is_left_out, fails && !is_left_out);
            let value = match (found.range, is_open) {
                (Some(range), false) => range,
                (None, false) if self.needed[i] => return None,
                // undefined where its value does not matter, or computed from something undefined: nothing is
                // known
                (None, false) | (Some(_) | None, true) => Interval::ALL,
            };
            let value = match choices.next_if(|choice| choice.node().index() == i) {
                // where an operand is undefined, the value is undefined, too, or that operand is not chosen
                Some(choice) => choice.range(of).and_then(|range| meet(value, range)).unwrap_or(value),
                None => value,
            };
            let value = match known.next_if(|(node, _)| node.index() == i) {
                Some((_, range)) => meet(value, *range)?,
                None => value,
            };
            values.push(value);
            may_fail.push(fails);
            may_be_infinite.push(is_infinite);
        }
        Some(())
    }

    /// Restricts the operands of a node by its value.
    fn backward(&self, i: usize, values: &mut [Interval]) -> Option<()> {
        let value = values[i];
        match self.rules[i] {
            Rule::Power { of, exponent } => {
                values[of.index()] = backward::power(value, values[of.index()], exponent)?;
            }
            Rule::Slab { of, first, second } => {
                let line = |affine: Affine| (affine.slope, affine.number(|node| values[node.index()]));
                let (first, second) = (line(first), line(second));
                values[of.index()] = backward::slab(value, values[of.index()], first, second)?;
            }
            Rule::Plain(Expr::Unary(op, a)) => {
                values[a.index()] = backward::unary(op, value, values[a.index()])?;
            }
            Rule::Plain(Expr::Binary(op, a, b)) => {
                let [left, right] = backward::binary(op, value, values[a.index()], values[b.index()])?;
                let [needs_a, needs_b] =
                    [0, 1].map(|side| self.operands[i].get(side).is_some_and(|o| o.needed));
                if a == b {
                    if needs_a && needs_b {
                        values[a.index()] = meet(left, right)?;
                    }
                    return Some(());
                }
                if needs_a {
                    values[a.index()] = left;
                }
                if needs_b {
                    values[b.index()] = right;
                }
            }
            Rule::Plain(Expr::Lookup(lookup, at)) => {
                let reach = lookup.reach(&self.tables, value.lo);
                for (axis, node) in at.into_iter().enumerate() {
                    let left = Interval { lo: reach.min[axis], hi: reach.max[axis] };
                    values[node.index()] = meet(left, values[node.index()])?;
                }
            }
            Rule::Plain(Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_)) => {}
        }
        Some(())
    }

    /// The remaining part of a box.
    pub(super) fn read_box(&self, values: &[Interval], space: &mut Aabb) -> Option<()> {
        for (axis, node) in self.coordinates.into_iter().enumerate() {
            let Some(value) = node.and_then(|node| values.get(node.index())) else { continue };
            let left = meet(Interval { lo: space.min[axis], hi: space.max[axis] }, *value)?;
            (space.min[axis], space.max[axis]) = (left.lo, left.hi);
        }
        Some(())
    }

    /// Without boxes around ellipsoids. What is added to a formula must not depend on whether its params are numbers or
    /// arguments, of which there is no matrix.
    pub(super) fn without_ellipsoids(self) -> Self {
        Self { is_quadric: false, ..self }
    }

    pub(super) fn root(&self) -> Node {
        self.root
    }
}
