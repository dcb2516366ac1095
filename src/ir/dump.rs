//! The graph as text: one operation per line, with the place it came from.

use std::collections::HashMap;
use std::fmt::Write;

use crate::diagnostic::Source;
use crate::ir::graph::{Axis, Expr, Graph, Node};

/// Prints what the named roots use. `%3 = r0_and %1 %2   ; pawn.rfm:4:7`
pub fn dump(graph: &Graph, roots: &[(&str, Node)], sources: &[Source]) -> String {
    let nodes: Vec<Node> = roots.iter().map(|&(_, node)| node).collect();
    let used = graph.reachable(&nodes);
    let mut numbers: HashMap<Node, usize> = HashMap::new();
    let mut text = String::new();
    for (node, expr) in graph.nodes().filter(|(node, _)| used[node.index()]) {
        let number = numbers.len();
        numbers.insert(node, number);
        let line = match expr {
            Expr::Constant(bits) => format!("%{number} = {:?}", f64::from_bits(bits)),
            Expr::Coordinate(Axis::X) => format!("%{number} = x"),
            Expr::Coordinate(Axis::Y) => format!("%{number} = y"),
            Expr::Coordinate(Axis::Z) => format!("%{number} = z"),
            Expr::Coordinate(Axis::T) => format!("%{number} = t"),
            Expr::Uniform(i) => format!("%{number} = uniform {i}"),
            Expr::Parameter(i) => format!("%{number} = parameter {i}"),
            Expr::Unary(op, a) => format!("%{number} = {} %{}", op.name(), numbers[&a]),
            Expr::Binary(op, a, b) => format!("%{number} = {} %{} %{}", op.name(), numbers[&a], numbers[&b]),
            Expr::Lookup(lookup, at) => {
                let [x, y, z] = at.map(|node| numbers[&node]);
                let table = graph.tables()[lookup.table as usize].fingerprint();
                format!("%{number} = {} {table} %{x} %{y} %{z}", lookup.name())
            }
        };
        let place = graph.span(node).and_then(|span| {
            let source = sources.iter().find(|s| s.id == span.source)?;
            let at = source.position(span.start as usize);
            Some(format!("; {}:{}:{}", source.name, at.line, at.column))
        });
        // writing to a String cannot fail
        let _ = match place {
            Some(place) => writeln!(text, "{line:<32}{place}"),
            None => writeln!(text, "{line}"),
        };
    }
    for (name, node) in roots {
        let _ = writeln!(text, "{name} = %{}", numbers[node]);
    }
    text
}
