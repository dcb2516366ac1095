//! In which form R₀ is evaluated: one for a whole program, another one for pairs of operands that need it.

use std::collections::BTreeMap;

use crate::ir::graph::{Graph, Node};
use crate::ir::op::{Binary, R0};
use crate::ir::r0;
use crate::ir::real::Real;

/// How R₀ is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Form {
    /// Half-angle form: ≤ 2 ulp, exact sign for all finite operands, finite gradient at corners.
    #[default]
    Stable,
    /// The textbook's formula where it loses at most four bits, the stable form for the run of 16 points in
    /// which it loses more: ≤ 14 ulp. It is used over blocks only. A single point gets the stable form,
    /// unless its graph is so large that blocks answer for single points too.
    Guarded,
    /// u + v ∓ √(u² + v²) as written: cheapest, loses digits and at worst the sign where operands cancel.
    Textbook,
    /// The stable form on m/M: neither overflows nor underflows before its result does; one more division.
    Scaled,
}

/// The forms of one program: value and weights of a pair of operands have the same one.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Forms {
    default: Form,
    /// By the pair, the lesser node first.
    exceptions: BTreeMap<(Node, Node), Form>,
}

impl Forms {
    /// One form for every operation.
    pub const fn all(form: Form) -> Self {
        Self { default: form, exceptions: BTreeMap::new() }
    }

    /// Another form for ∧ and ∨ of two operands, in either order.
    pub fn set(&mut self, u: Node, v: Node, form: Form) {
        if form == self.default {
            self.exceptions.remove(&pair(u, v));
        } else {
            self.exceptions.insert(pair(u, v), form);
        }
    }

    /// The form for ∧ and ∨ of two operands and for their weights.
    pub fn of(&self, u: Node, v: Node) -> Form {
        self.exceptions.get(&pair(u, v)).copied().unwrap_or(self.default)
    }

    /// The forms for a graph that keeps only these nodes of the present one, in their order.
    #[must_use]
    pub fn kept(&self, kept: &[bool], graph: &Graph) -> Self {
        let numbers: Vec<usize> = kept
            .iter()
            .scan(0, |next, &kept| {
                let number = *next;
                *next += usize::from(kept);
                Some(number)
            })
            .collect();
        self.mapped(|node| kept[node.index()].then(|| graph.node(numbers[node.index()])))
    }

    /// The forms for a graph that has these images of the present one's nodes.
    #[must_use]
    pub fn mapped(&self, of: impl Fn(Node) -> Option<Node>) -> Self {
        let exceptions =
            self.exceptions.iter().filter_map(|(&(u, v), &form)| Some((pair(of(u)?, of(v)?), form)));
        Self { default: self.default, exceptions: exceptions.collect() }
    }

    /// How many pairs of operands do not have the default form.
    pub fn exceptions(&self) -> usize {
        self.exceptions.len()
    }
}

fn pair(u: Node, v: Node) -> (Node, Node) {
    if u <= v { (u, v) } else { (v, u) }
}

impl Form {
    /// Its name in options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Guarded => "guarded",
            Self::Textbook => "textbook",
            Self::Scaled => "scaled",
        }
    }

    /// The value of an operation with R₀ in this form; other operations have one value.
    pub fn eval<T: Real>(self, op: Binary, u: T, v: T) -> T {
        let Some(r0) = op.r0() else { return op.eval(u, v) };
        match (self, r0) {
            (Self::Stable | Self::Guarded, _) => op.eval(u, v),
            (Self::Scaled, R0::And) => r0::and_scaled(u, v),
            (Self::Scaled, R0::Or) => r0::or_scaled(u, v),
            (Self::Scaled, R0::AndWeight) => r0::and_weights_scaled(u, v).0,
            (Self::Scaled, R0::OrWeight) => r0::or_weights_scaled(u, v).0,
            (Self::Textbook, R0::And) => r0::and_textbook(u, v),
            (Self::Textbook, R0::Or) => r0::or_textbook(u, v),
            (Self::Textbook, R0::AndWeight) => r0::and_weight_textbook(u, v),
            (Self::Textbook, R0::OrWeight) => r0::or_weight_textbook(u, v),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;

    #[test]
    fn a_pair_has_one_form_in_either_order() {
        let mut graph = Graph::default();
        let [x, y, z] = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let mut forms = Forms::default();
        forms.set(y, x, Form::Scaled);
        assert_eq!(
            (forms.of(x, y), forms.of(y, x), forms.of(x, z)),
            (Form::Scaled, Form::Scaled, Form::Stable)
        );
        forms.set(x, y, Form::Stable);
        assert_eq!(forms, Forms::all(Form::Stable));
    }
}
