//! Chains of comparisons that a part of a solid fulfils only in the other order: `a <= e <= b` is the product
//! (e − a)·(b − e), which is positive where b < e < a as well.

use std::collections::HashMap;

use glam::DVec3;

use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::{Binary, Expr, Given, Graph, Interpreter, Node};

/// Points along each side of the lattice on which such places are looked for.
const POINTS: usize = 16;

/// Formulas with more operations are not looked at: at the points of the lattice they would take seconds.
const MOST_OPERATIONS: usize = 4000;

/// A chain that is fulfilled in the other order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnedChain {
    /// Where the chain is written.
    pub span: Span,
    /// A point that is inside or outside of the solid for no other reason.
    pub at: DVec3,
    /// Whether it is inside.
    pub is_inside: bool,
}

/// The chains of a formula, as it was written, whose other order decides about some point of a box. `is_chain` tells
/// where chains are written. `budget` counts operations, and may be shared by many solids: those for which it does not
/// suffice are not looked at.
pub fn turned_chains(
    (graph, root): (&Graph, Node),
    is_chain: impl Fn(Span) -> bool,
    over: &Aabb,
    time: f64,
    budget: &mut usize,
) -> Vec<TurnedChain> {
    let (mut graph, root) = graph.extract_cone(root);
    let mut chains = chains(&graph, is_chain);
    if chains.is_empty() {
        return Vec::new();
    }
    let mut outputs = vec![root];
    for &(_, chain) in &chains {
        if graph.len() > MOST_OPERATIONS {
            break;
        }
        outputs.push(in_one_order(&mut graph, root, chain));
    }
    chains.truncate(outputs.len() - 1);
    let Some(rest) = budget.checked_sub(graph.len() * POINTS.pow(3)) else { return Vec::new() };
    *budget = rest;
    let program = Interpreter::new(&graph, &outputs);
    let mut values = vec![0.0; outputs.len()];
    let mut found: Vec<TurnedChain> = Vec::new();
    for at in points(over) {
        program.eval_given(Given { time, ..Given::point(at.to_array()) }, &mut values);
        for (&(span, _), in_one_order) in chains.iter().zip(&values[1..]) {
            // within a fold or a function, one place in the text has become several chains
            if values[0] * in_one_order < 0.0 && found.iter().all(|known| known.span != span) {
                found.push(TurnedChain { span, at, is_inside: values[0] > 0.0 });
            }
        }
    }
    found
}

/// The products that chains have become, each with its place. Ends that are constants are compared when the file is
/// read.
fn chains(graph: &Graph, is_chain: impl Fn(Span) -> bool) -> Vec<(Span, Node)> {
    let of_chain = |(node, expr): (Node, Expr)| {
        let Expr::Binary(Binary::Mul, above, below) = expr else { return None };
        let span = graph.span(node).filter(|span| is_chain(*span))?;
        let ends = match (graph.expr(above), graph.expr(below)) {
            (Expr::Binary(Binary::Sub, _, low), Expr::Binary(Binary::Sub, high, _)) => [low, high],
            _ => return None,
        };
        let are_constant = ends.into_iter().all(|end| graph.as_constant(end).is_some());
        (!are_constant).then_some((span, node))
    };
    graph.nodes().filter_map(of_chain).collect()
}

/// The formula in which both comparisons of a chain are joined by *and*.
fn in_one_order(graph: &mut Graph, root: Node, chain: Node) -> Node {
    let nodes: Vec<(Node, Expr)> = graph.nodes().filter(|(node, _)| *node <= root).collect();
    let mut image: HashMap<Node, Node> = HashMap::new();
    for (node, expr) in nodes {
        let expr = match expr {
            Expr::Binary(Binary::Mul, above, below) if node == chain => {
                Expr::Binary(Binary::And, above, below)
            }
            other => other,
        };
        let new = graph.intern(expr.map(|operand| image[&operand]), None);
        image.insert(node, new);
    }
    image[&root]
}

/// The middles of the cells of a lattice over a box.
fn points(over: &Aabb) -> impl Iterator<Item = DVec3> + '_ {
    let cell = over.size() / POINTS as f64;
    (0..POINTS.pow(3)).map(move |i| {
        let place = DVec3::new((i % POINTS) as f64, (i / POINTS % POINTS) as f64, (i / POINTS.pow(2)) as f64);
        over.min + cell * (place + 0.5)
    })
}
