//! A formula in the coordinates of its linear forms.
//!
//! A solid that is deformed and then turned has x, y and z in its formula only through the coordinates of the
//! deformation: three linear forms, such as x cos φ + y sin φ. With these as coordinates it is the deformed solid alone.

use rustc_hash::FxHashMap;

use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// A formula in other coordinates.
#[derive(Debug)]
pub struct Framed {
    /// The formula, whose x, y and z are the forms.
    pub graph: Graph,
    /// Its root.
    pub root: Node,
    /// The forms, in the graph that the formula comes from: up to three.
    pub forms: Vec<Node>,
}

/// How a node depends on the place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Degree {
    Constant,
    Linear,
    Other,
}

/// A root in the coordinates of its linear forms. Its values are the same to the last bit. `None` if there are more than
/// three forms, or if they are the coordinates.
pub fn framed(graph: &Graph, root: Node) -> Option<Framed> {
    let cone = graph.cone(root);
    let mut degrees: FxHashMap<Node, Degree> = FxHashMap::default();
    for &node in &cone {
        let degree = degree(graph.expr(node), |node| degrees[&node]);
        degrees.insert(node, degree);
    }
    let is_linear = |node: &Node| degrees[node] == Degree::Linear;
    let mut forms: Vec<Node> = Vec::new();
    for &node in cone.iter().filter(|&node| degrees[node] == Degree::Other) {
        for operand in graph.expr(node).operands().filter(is_linear) {
            let form = without_numbers(graph, operand, &degrees);
            if !forms.contains(&form) {
                forms.push(form);
            }
        }
    }
    let is_coordinate = |&form: &Node| matches!(graph.expr(form), Expr::Coordinate(_));
    if forms.is_empty() || forms.len() > Axis::SPACE.len() || forms.iter().all(is_coordinate) {
        return None;
    }
    let (graph, root) = rebuilt(graph, root, &forms)?;
    Some(Framed { graph, root, forms })
}

fn degree(expr: Expr, of: impl Fn(Node) -> Degree) -> Degree {
    use Degree::{Constant, Linear, Other};
    let all_constant = expr.operands().all(|operand| of(operand) == Constant);
    match expr {
        Expr::Coordinate(Axis::X | Axis::Y | Axis::Z) => Linear,
        Expr::Coordinate(Axis::T) | Expr::Constant(_) | Expr::Parameter(_) | Expr::Uniform(_) => Constant,
        Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) if all_constant => Constant,
        Expr::Unary(Unary::Neg, a) => of(a),
        Expr::Binary(Binary::Add | Binary::Sub, a, b) if of(a) != Other && of(b) != Other => Linear,
        Expr::Binary(Binary::Mul, a, b) if [of(a), of(b)].contains(&Constant) => {
            if of(a) == Constant {
                of(b)
            } else {
                of(a)
            }
        }
        Expr::Binary(Binary::Div, a, b) if of(b) == Constant => of(a),
        Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) => Other,
    }
}

/// The part of a linear form that is left without the numbers added to it and its factors.
fn without_numbers(graph: &Graph, mut form: Node, degrees: &FxHashMap<Node, Degree>) -> Node {
    let is_number = |node: Node| degrees[&node] == Degree::Constant;
    loop {
        form = match graph.expr(form) {
            Expr::Unary(Unary::Neg, a) => a,
            Expr::Binary(Binary::Add | Binary::Sub | Binary::Mul | Binary::Div, a, b) if is_number(b) => a,
            Expr::Binary(Binary::Add | Binary::Sub | Binary::Mul, a, b) if is_number(a) => b,
            Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => return form,
        }
    }
}

/// The root with coordinates in place of the forms; `None` if it also depends on the place in another way.
fn rebuilt(graph: &Graph, root: Node, forms: &[Node]) -> Option<(Graph, Node)> {
    let mut out = Graph::like(graph);
    let mut image: FxHashMap<Node, Node> = FxHashMap::default();
    for (&form, axis) in forms.iter().zip(Axis::SPACE) {
        let coordinate = out.coordinate(axis);
        image.insert(form, coordinate);
    }
    // what only forms are made of has no image
    for node in graph.cone(root) {
        let expr = graph.expr(node);
        let is_known = expr.operands().all(|operand| image.contains_key(&operand));
        let is_place = matches!(expr, Expr::Coordinate(Axis::X | Axis::Y | Axis::Z));
        if !image.contains_key(&node) && is_known && !is_place {
            let new = out.intern(expr.map(|operand| image[&operand]), graph.span(node));
            image.insert(node, new);
        }
    }
    image.get(&root).map(|&root| (out, root))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Interpreter;

    /// y′ − 3x′² with x′ = 0.6x + 0.8y, y′ = 0.6y − 0.8x is y − 3x².
    #[test]
    fn a_turned_parabola_is_a_parabola() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let [c, s, three, one] = [0.6, 0.8, 3.0, 1.0].map(|number| graph.constant(number));
        let mut form = |op, a, p, b, q| {
            let (a, b) = (graph.binary(Binary::Mul, a, p), graph.binary(Binary::Mul, b, q));
            graph.binary(op, a, b)
        };
        let (u, v) = (form(Binary::Add, c, x, s, y), form(Binary::Sub, c, y, s, x));
        let square = graph.binary(Binary::Mul, u, u);
        let square = graph.binary(Binary::Mul, three, square);
        let moved = graph.binary(Binary::Add, v, one);
        let root = graph.binary(Binary::Sub, moved, square);
        let found = framed(&graph, root).unwrap();
        assert_eq!(found.forms.len(), 2);
        let value = |graph: &Graph, root: Node, p: [f64; 3]| {
            let mut value = [0.0];
            Interpreter::new(graph, &[root]).eval_f64(p, &mut value);
            value[0]
        };
        for p in [[0.3, -0.2, 0.0], [2.0, 5.0, 1.0]] {
            let forms: Vec<f64> = found.forms.iter().map(|&form| value(&graph, form, p)).collect();
            assert_eq!(value(&graph, root, p), value(&found.graph, found.root, [forms[0], forms[1], 0.0]));
        }
        // x is used beside the form
        let product = graph.binary(Binary::Mul, root, x);
        assert!(framed(&graph, product).is_some_and(|found| found.forms.len() == 3));
        let alone = graph.binary(Binary::Mul, x, y);
        assert!(framed(&graph, alone).is_none());
    }
}
