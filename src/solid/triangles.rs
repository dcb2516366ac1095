//! Solids that are a mesh alone, perhaps moved, turned, scaled or mirrored: their surfaces are known exactly.

use glam::{DMat3, DVec3};

use super::construction::Solid;
use crate::ir::{Axis, Binary, Expr, Graph, Node, Part, Unary};

/// A formula with more operations than this is not asked whether it is a mesh alone.
const MOST_OPERATIONS: usize = 1000;

/// Corners, and three of their numbers for each triangle, counter-clockwise from outside.
pub type Triangles = (Vec<DVec3>, Vec<[u32; 3]>);

/// A number that depends on x, y and z as slope · (x, y, z) + offset.
#[derive(Clone, Copy)]
struct Affine {
    slope: DVec3,
    offset: f64,
}

impl Affine {
    fn is_constant(self) -> bool {
        self.slope == DVec3::ZERO
    }

    fn scaled(self, factor: f64) -> Self {
        Self { slope: factor * self.slope, offset: factor * self.offset }
    }

    fn plus(self, other: Self) -> Self {
        Self { slope: self.slope + other.slope, offset: self.offset + other.offset }
    }
}

impl Solid {
    /// The triangles of a solid that is nothing but a mesh in coordinates that depend linearly on the place. `None`
    /// for any other solid.
    pub fn triangles(&self) -> Option<Triangles> {
        let (graph, root) = self.formula();
        if graph.len() > MOST_OPERATIONS {
            return None;
        }
        let known = affine_nodes(graph, self.time());
        let (lookup, at) = lookup_below(graph, root, &known)?;
        let (mut places, mut triangles) = graph.tables()[lookup as usize].triangles()?;
        let [x, y, z] = at.map(|node| known[node.index()]);
        let (x, y, z) = (x?, y?, z?);
        let into_mesh = DMat3::from_cols(x.slope, y.slope, z.slope).transpose();
        let (out, offset) = (into_mesh.inverse(), DVec3::new(x.offset, y.offset, z.offset));
        if !(out.is_finite() && offset.is_finite()) {
            return None;
        }
        places.iter_mut().for_each(|p| *p = out * (*p - offset));
        if into_mesh.determinant() < 0.0 {
            triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        Some((places, triangles))
    }
}

/// The table whose value times a positive number is a node, and where it is looked up.
fn lookup_below(graph: &Graph, mut node: Node, known: &[Option<Affine>]) -> Option<(u32, [Node; 3])> {
    let is_positive = |node: Node| known[node.index()].is_some_and(|n| n.is_constant() && n.offset > 0.0);
    loop {
        node = match graph.expr(node) {
            Expr::Lookup(lookup, at) if lookup.part == Part::Value => return Some((lookup.table, at)),
            Expr::Binary(Binary::Mul | Binary::Div, a, b) if is_positive(b) => a,
            Expr::Binary(Binary::Mul, a, b) if is_positive(a) => b,
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Lookup(..) => return None,
        }
    }
}

/// Which nodes depend linearly on the place at an instant, and how.
fn affine_nodes(graph: &Graph, time: f64) -> Vec<Option<Affine>> {
    let constant = |offset| Affine { slope: DVec3::ZERO, offset };
    let mut known: Vec<Option<Affine>> = Vec::with_capacity(graph.len());
    for (_, expr) in graph.nodes() {
        let of = |node: Node| known[node.index()];
        let found = match expr {
            Expr::Constant(bits) => Some(constant(f64::from_bits(bits))),
            Expr::Coordinate(Axis::X) => Some(Affine { slope: DVec3::X, offset: 0.0 }),
            Expr::Coordinate(Axis::Y) => Some(Affine { slope: DVec3::Y, offset: 0.0 }),
            Expr::Coordinate(Axis::Z) => Some(Affine { slope: DVec3::Z, offset: 0.0 }),
            Expr::Coordinate(Axis::T) => Some(constant(time)),
            Expr::Unary(Unary::Neg, a) => of(a).map(|a| a.scaled(-1.0)),
            Expr::Unary(op, a) => of(a).filter(|a| a.is_constant()).map(|a| constant(op.eval(a.offset))),
            Expr::Binary(op, a, b) => of(a).zip(of(b)).and_then(|(a, b)| match op {
                _ if a.is_constant() && b.is_constant() => Some(constant(op.eval(a.offset, b.offset))),
                Binary::Add => Some(a.plus(b)),
                Binary::Sub => Some(a.plus(b.scaled(-1.0))),
                Binary::Mul if b.is_constant() => Some(a.scaled(b.offset)),
                Binary::Mul if a.is_constant() => Some(b.scaled(a.offset)),
                Binary::Div if b.is_constant() => Some(a.scaled(1.0 / b.offset)),
                _ => None,
            }),
            Expr::Parameter(_) | Expr::Uniform(_) | Expr::Lookup(..) => None,
        };
        known.push(found);
    }
    known
}
