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

use super::distances::Known;
use super::joints::{Joint, Side};
use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::{self, Binary, Node, Unary};

/// Distances of first order level off at this number of radii.
const FARTHEST: f64 = 8.0;

/// How far a rounded *or* reaches beyond both of its parts, as a part of the radius: 1 − 1/√2.
const FILLET: f64 = 0.292_893_218_813_452_5;

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
    /// Positive wherever the field is, and bounded where the parts are.
    around: Node,
    /// Half of the thickness of a single formula. Infinite where none is known.
    half: f64,
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
        for side in order {
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
                    let Known { field, greatest, .. } = self.distance(side.node, within, &radii, span);
                    if side.negated {
                        let field = self.unary(Unary::Neg, field, span);
                        Rounded { field, around: field, half: f64::INFINITY }
                    } else {
                        Rounded { field, around: field, half: greatest }
                    }
                }
            };
            done.insert(side, new);
        }
        let Rounded { field, around, .. } = done[&root];
        let fillets = joints.values().any(|joint| matches!(joint, Joint::Or(_))) && radii.inner.is_some();
        if !self.warn_of_nothing_left(field, within, radii.length, span) {
            self.warn_of_thin_part(thinnest, radii.length, span);
        }
        Some(if fillets { self.around(field, around, span) } else { field })
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
            around: self.binary(op, a.around, b.around, span),
            half: f64::INFINITY,
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
        let around = self.binary(Binary::Min, parts[0].around, parts[1].around, span);
        Rounded { field, around, half: f64::INFINITY }
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
        let part = self.constant(FILLET);
        let wider = self.binary(Binary::Mul, part, radius, span);
        let around = self.binary(Binary::Max, parts[0].around, parts[1].around, span);
        Rounded {
            field: self.binary(Binary::Max, most, arc, span),
            around: self.binary(Binary::Add, around, wider, span),
            half: f64::INFINITY,
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
