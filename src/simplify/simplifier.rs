//! The new graph while it is made, and the record of the rules that made it.

use std::collections::BTreeMap;

use crate::diagnostic::Span;
use crate::ir::{Expr, Graph, Node};

/// What simplification did: the use of each rule, by its equation.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Applied(pub BTreeMap<&'static str, Uses>);

/// The uses of one rule.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Uses {
    /// How often it was applied.
    pub count: usize,
    /// Where what was rewritten stands: the first [`MOST_PLACES`] different places, in the order of the
    /// graph.
    pub places: Vec<Span>,
}

/// Places that are kept of each rule.
pub const MOST_PLACES: usize = 8;

impl Uses {
    fn note(&mut self, span: Option<Span>) {
        self.count += 1;
        if let Some(span) = span.filter(|span| !self.places.contains(span) && self.places.len() < MOST_PLACES)
        {
            self.places.push(span);
        }
    }
}

/// An equation read from left to right, with the condition under which it holds.
pub(super) struct Rule {
    /// The equation as `rfm explain` prints it.
    pub equation: &'static str,
    /// The simplified node, if the left side and the condition fit.
    pub apply: fn(&mut Simplifier, Expr, Option<Span>) -> Option<Node>,
}

/// The simplified graph so far.
pub(super) struct Simplifier {
    pub graph: Graph,
    pub applied: Applied,
    rules: &'static [Rule],
}

impl Simplifier {
    /// For the nodes of a graph.
    pub fn new(graph: &Graph, rules: &'static [Rule]) -> Self {
        Self { graph: Graph::like(graph), applied: Applied::default(), rules }
    }

    /// The node of an expression over simplified operands, itself simplified.
    pub fn make(&mut self, expr: Expr, span: Option<Span>) -> Node {
        for rule in self.rules {
            if let Some(result) = (rule.apply)(self, expr, span) {
                self.applied.0.entry(rule.equation).or_default().note(span);
                return result;
            }
        }
        self.graph.intern(expr, span)
    }
}
