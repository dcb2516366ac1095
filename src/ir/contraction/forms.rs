//! The linear forms in a graph: their coefficients, the values found for them, and consequences of other
//! forms.

use super::contractor::{Contractor, Scratch};
use super::linear::{LinearForm, LinearProgram, ZERO, plus};
use super::rule::{Degree, Rule};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::graph::{Axis, Expr, Node};
use crate::ir::op::{Binary, Unary};

/// Appends the forms among `nodes` with the values that contraction has left them.
pub fn collect(contractor: &Contractor, nodes: &[Node], scratch: &mut Scratch, out: &mut Vec<LinearForm>) {
    if nodes.is_empty() || out.len() >= LinearForm::MOST {
        return;
    }
    fill(contractor, scratch);
    for node in nodes {
        let [x, y, z, offset] = scratch.linear[node.index()];
        let range = scratch.values[node.index()].widened(2) - offset;
        if range.lo.is_finite() || range.hi.is_finite() {
            let offset = offset.lo.abs().max(offset.hi.abs());
            out.push(LinearForm::new([x, y, z], range, offset));
        }
    }
}

/// The ranges of other forms, the `nodes` of a graph, that follow from forms with known ranges. They serve
/// the next pass over the graph.
pub fn bound(
    contractor: &Contractor,
    nodes: &[Node],
    given: &[LinearForm],
    space: &Aabb,
    scratch: &mut Scratch,
) {
    fill(contractor, scratch);
    let solver = LinearProgram::new(given, space);
    for node in nodes {
        let [x, y, z, offset] = scratch.linear[node.index()];
        let size = offset.lo.abs().max(offset.hi.abs());
        if let Some(range) = solver.range([x, y, z], size) {
            scratch.known.push((*node, range + offset));
        }
    }
}

/// The coefficients of all nodes that are linear forms.
fn fill(contractor: &Contractor, scratch: &mut Scratch) {
    let Scratch { values, linear, .. } = scratch;
    linear.clear();
    for (i, rule) in contractor.rules[..values.len()].iter().enumerate() {
        let form = match contractor.degrees[i] {
            Degree::Other => [ZERO; 4],
            Degree::Number => [ZERO, ZERO, ZERO, values[i]],
            Degree::Linear => form(rule, linear),
        };
        linear.push(form);
    }
}

/// Coefficients of x, y, z and 1.
fn form(rule: &Rule, of: &[[Interval; 4]]) -> [Interval; 4] {
    let one = Interval::point(1.0);
    let get = |node: Node| of[node.index()];
    match *rule {
        Rule::Plain(Expr::Coordinate(Axis::X)) => [one, ZERO, ZERO, ZERO],
        Rule::Plain(Expr::Coordinate(Axis::Y)) => [ZERO, one, ZERO, ZERO],
        Rule::Plain(Expr::Coordinate(Axis::Z)) => [ZERO, ZERO, one, ZERO],
        Rule::Plain(Expr::Unary(Unary::Neg, a)) => get(a).map(|c| -c),
        Rule::Plain(Expr::Binary(Binary::Add, a, b)) => {
            let (a, b) = (get(a), get(b));
            std::array::from_fn(|i| plus(a[i], b[i]))
        }
        Rule::Plain(Expr::Binary(Binary::Sub, a, b)) => {
            let (a, b) = (get(a), get(b));
            std::array::from_fn(|i| plus(a[i], -b[i]))
        }
        Rule::Plain(Expr::Binary(Binary::Mul, a, b)) => {
            let (a, b) = (get(a), get(b));
            let (number, form) = if a[..3] == [ZERO; 3] { (a[3], b) } else { (b[3], a) };
            form.map(|c| if c == ZERO { c } else { number * c })
        }
        Rule::Plain(Expr::Binary(Binary::Div, a, b)) => {
            let (form, number) = (get(a), get(b)[3]);
            form.map(|c| if c == ZERO { c } else { c / number })
        }
        Rule::Plain(_) | Rule::Power { .. } | Rule::Slab { .. } => [Interval::ALL; 4],
    }
}
