//! `.round(radius)`: the edges at which a shape's parts are joined by *and* and *or* become arcs.
//!
//! The value of R₀ is not a distance, so no radius can be subtracted from it. Instead, the joints of the
//! shape are rebuilt from the distances of its parts: with m the least of two distances a and b, the rounded
//! *and* is the least of m and
//!
//! max(r, m) − √(max(r − a, 0)² + max(r − b, 0)²)
//!
//! which is m where one of both is beyond r, and the arc of radius r where none is. It is exact for planes at
//! right angles, three of them at a corner as well. The rounded *or* is its mirror image, −and(−a, −b).

use rustc_hash::FxHashMap;

use super::distances::{Known, Square};
use super::joints::{Joint, Side};
use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::{self, Binary, Node, Unary};

/// Distances of first order level off at this number of radii.
const FARTHEST: f64 = 8.0;

/// The radius of edges that point outwards, and of those that point inwards if they are rounded.
struct Radii {
    outer: Node,
    inner: Option<Node>,
    /// That of `outer` with the present values of params.
    length: f64,
}

/// A rebuilt part.
#[derive(Clone, Copy)]
struct Rounded {
    field: Node,
    /// The most rounded *or*s on the way to a part.
    fillets: i32,
    /// Half of the thickness of a single formula. Infinite where none is known.
    half: f64,
    /// How a single formula that is a square of distances grows.
    square: Option<Square>,
}

impl Lowering<'_> {
    /// The shape with round edges: `.round(radius)`, or `.round(radius, inner)` with another radius for edges
    /// that point inwards, 0 for none.
    pub fn rounded_shape(&mut self, shape: Node, values: &[(Value, Span)], span: Span) -> Option<Node> {
        let radii = self.radii(values)?;
        let root = Side { node: shape, negated: false };
        let (order, joints) = self.skeleton(root);
        if !joints.values().any(|joint| matches!(joint, Joint::And(_) | Joint::Or(_))) {
            let message = "`.round` finds no edge: no `and`, `or` or `\\` is outermost in this shape";
            let warning = Diagnostic::warning(Code::NO_EDGE, self.user_span(span), message);
            self.report(warning.help("round a shape first, then bend, twist or taper it"));
        }
        let within = ir::reach(&self.module.graph, shape);
        let mut thinnest = f64::INFINITY;
        let mut done: FxHashMap<Side, Rounded> = FxHashMap::default();
        for &side in &order {
            if self.over_budget(span) {
                return None;
            }
            let of = |parts: [Side; 2]| parts.map(|part| done[&part]);
            let new = match joints[&side] {
                Joint::Same(other) => done[&other],
                Joint::And(parts) => {
                    let parts = of(parts);
                    thinnest = parts.iter().fold(thinnest, |least, part| least.min(part.half));
                    self.rounded_and(parts, &radii, span)
                }
                Joint::Or(parts) => self.rounded_or(of(parts), &radii, span),
                Joint::Least(parts) => self.plain(Binary::Min, of(parts), span),
                Joint::Greatest(parts) => self.plain(Binary::Max, of(parts), span),
                Joint::Leaf => {
                    let Known { field, greatest, square } = self.distance(side.node, within, &radii, span);
                    if side.negated {
                        let field = self.unary(Unary::Neg, field, span);
                        Rounded { field, fillets: 0, half: f64::INFINITY, square: None }
                    } else {
                        Rounded { field, fillets: 0, half: greatest, square }
                    }
                }
            };
            done.insert(side, new);
        }
        let Rounded { field, fillets, .. } = done[&root];
        if !self.warn_of_nothing_left(field, within, radii.length, span) {
            self.warn_of_thin_part(thinnest, radii.length, span);
        }
        let Some(inner) = radii.inner.filter(|_| fillets > 0) else { return Some(field) };
        let depth = self.constant(fillet_depth(fillets));
        let wider = self.binary(Binary::Mul, depth, inner, span);
        let around = self.wider_parts((&order, &joints), &done, wider, span);
        let Some(around) = around else { return Some(field) };
        // the ball around it tells where it ends only roughly
        self.module.graph.enclose(field, around);
        Some(self.around(field, around, span))
    }

    /// The parts grown by a length and joined by the least and the greatest: positive wherever the rounded shape is, which
    /// reaches beyond its parts by no more, see [`fillet_depth`], and bounded where they are.
    fn wider_parts(
        &mut self,
        (order, joints): (&[Side], &FxHashMap<Side, Joint>),
        rounded: &FxHashMap<Side, Rounded>,
        by: Node,
        span: Span,
    ) -> Option<Node> {
        let mut wider: FxHashMap<Side, Node> = FxHashMap::default();
        for side in order {
            let node = match joints[side] {
                Joint::Same(other) => wider[&other],
                Joint::And([a, b]) | Joint::Least([a, b]) => {
                    self.binary(Binary::Min, wider[&a], wider[&b], span)
                }
                Joint::Or([a, b]) | Joint::Greatest([a, b]) => {
                    self.binary(Binary::Max, wider[&a], wider[&b], span)
                }
                // in which ω stands once, so that it shows where the part ends
                Joint::Leaf => match rounded[side].square {
                    Some(square) => self.offset_square(side.node, square, by, span),
                    None => self.binary(Binary::Add, rounded[side].field, by, span),
                },
            };
            wider.insert(*side, node);
        }
        order.last().map(|root| wider[root])
    }

    fn radii(&mut self, values: &[(Value, Span)]) -> Option<Radii> {
        let mut radius = |at: usize, what: &str, or_zero: bool| {
            let (value, span) = &values[at];
            let node = self.as_number(value, *span)?;
            let Some(known) = self.known_value(node) else {
                self.as_constant(node, *span, what);
                return None;
            };
            if known.is_finite() && (known > 0.0 || or_zero && known == 0.0) {
                return Some((node, known));
            }
            let message = format!("{what} must be positive, found {known}");
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, self.user_span(*span), message));
            None
        };
        let (outer, length) = radius(0, "the radius of edges", false)?;
        let inner = match values.len() {
            1 => Some(outer),
            _ => {
                let (inner, known) = radius(1, "the radius of inner edges", true)?;
                if known == 0.0 {
                    self.fix(inner);
                }
                (known > 0.0).then_some(inner)
            }
        };
        Some(Radii { outer, inner, length })
    }

    /// The least of two distances, or the greatest.
    fn plain(&mut self, op: Binary, parts: [Rounded; 2], span: Span) -> Rounded {
        let [a, b] = parts;
        Rounded {
            field: self.binary(op, a.field, b.field, span),
            fillets: a.fillets.max(b.fillets),
            half: f64::INFINITY,
            square: None,
        }
    }

    fn rounded_and(&mut self, parts: [Rounded; 2], radii: &Radii, span: Span) -> Rounded {
        let [a, b] = parts.map(|part| part.field);
        let least = self.binary(Binary::Min, a, b, span);
        let [short_a, short_b] = [a, b].map(|distance| self.binary(Binary::Sub, radii.outer, distance, span));
        let short = self.length_of_positive(short_a, short_b, span);
        let level = self.binary(Binary::Max, radii.outer, least, span);
        let arc = self.binary(Binary::Sub, level, short, span);
        // never above the least but for rounding; said twice, bounds are found from either part
        let field = self.binary(Binary::Min, least, arc, span);
        Rounded { field, fillets: parts[0].fillets.max(parts[1].fillets), half: f64::INFINITY, square: None }
    }

    fn rounded_or(&mut self, parts: [Rounded; 2], radii: &Radii, span: Span) -> Rounded {
        let Some(radius) = radii.inner else { return self.plain(Binary::Max, parts, span) };
        let [a, b] = parts.map(|part| part.field);
        let most = self.binary(Binary::Max, a, b, span);
        let [over_a, over_b] = [a, b].map(|distance| self.binary(Binary::Add, radius, distance, span));
        let over = self.length_of_positive(over_a, over_b, span);
        let negative = self.unary(Unary::Neg, radius, span);
        let level = self.binary(Binary::Min, negative, most, span);
        let arc = self.binary(Binary::Add, level, over, span);
        Rounded {
            field: self.binary(Binary::Max, most, arc, span),
            fillets: 1 + parts[0].fillets.max(parts[1].fillets),
            half: f64::INFINITY,
            square: None,
        }
    }

    /// √(max(a, 0)² + max(b, 0)²)
    fn length_of_positive(&mut self, a: Node, b: Node, span: Span) -> Node {
        let zero = self.constant(0.0);
        let squares = [a, b].map(|a| {
            let positive = self.binary(Binary::Max, a, zero, span);
            self.binary(Binary::Mul, positive, positive, span)
        });
        let sum = self.binary(Binary::Add, squares[0], squares[1], span);
        self.unary(Unary::Sqrt, sum, span)
    }

    /// The distance from the surface of a part: exact where that follows from its slope, and otherwise
    /// ω/√(g² + (ω/8r)²), which is right to first order. It has the sign of the part's field, but for
    /// rounding at the surface.
    fn distance(&mut self, leaf: Node, within: Option<Aabb>, radii: &Radii, span: Span) -> Known {
        if let Some(distance) = self.exact_distance(leaf, (within, 4.0 * radii.length), span) {
            return distance;
        }
        let slope = self.slope_of_leaf(leaf, span);
        let farthest = self.constant(FARTHEST);
        let farthest = self.binary(Binary::Mul, farthest, radii.outer, span);
        let part = self.binary(Binary::Div, leaf, farthest, span);
        let [slope, part] = [slope, part].map(|a| self.binary(Binary::Mul, a, a, span));
        let sum = self.binary(Binary::Add, slope, part, span);
        let root = self.unary(Unary::Sqrt, sum, span);
        let field = self.binary(Binary::DivOrZero, leaf, root, span);
        self.module.graph.enclose(field, leaf);
        Known { field, greatest: f64::INFINITY, square: None }
    }
}

/// How far a chain of rounded *or*s reaches beyond its parts, as a part of the radius r: 1 − 2^(−n/2). A rounded *or* of a and
/// b that is above −s·r, with s below 1, has one of both above −(1 − (1 − s)/√2)·r, as the arc says. So n of them that are
/// positive, s = 0, have a part above minus this, and no chain reaches farther than r.
fn fillet_depth(fillets: i32) -> f64 {
    1.0 - 0.5_f64.powf(0.5 * f64::from(fillets))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_fillets_reaches_as_far_as_its_arcs() {
        // the farthest point of the arc of two planes, which is a part of the next one
        let next = |depth: f64| 1.0 - (1.0 - depth) / 2_f64.sqrt();
        let mut depth = 0.0;
        for fillets in 1..60 {
            depth = next(depth);
            assert!((fillet_depth(fillets) - depth).abs() < 1e-14, "{fillets}");
        }
        assert!(depth < 1.0);
    }
}
