//! `.round(radius)`: the edges at which a shape's parts are joined by *and* and *or* become arcs.
//!
//! The value of R₀ is no distance, so no radius can be taken off it. The joints of the shape are made anew instead, from
//! the distances of its parts: with m the least of two distances a and b, the rounded *and* is the least of m and
//!
//! max(r, m) − √(max(r − a, 0)² + max(r − b, 0)²)
//!
//! which is m where one of both is beyond r, and the arc of radius r where none is. It is exact for planes at right angles,
//! three of them at a corner as well. The rounded *or* is its mirror image, −and(−a, −b).

use rustc_hash::FxHashMap;

use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::{self, Binary, Expr, Given, Graph, Interpreter, Node, Unary};

/// How many places a part is looked at to find what its slope is like.
const PLACES: u32 = 48;

/// Fewer places with a slope tell nothing.
const FEWEST_PLACES: usize = 16;

/// What counts as rounding, relative to the terms of a sum.
const ROUNDING: f64 = 1e-10;

/// Distances of first order level off at so many radii.
const FARTHEST: f64 = 8.0;

/// How far a rounded *or* reaches beyond both of its parts, as a part of the radius: 1 − 1/√2.
const FILLET: f64 = 0.292_893_218_813_452_5;

/// How a part's field becomes a distance, with g = |∇ω|.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Profile {
    /// g is this number everywhere: ω/g.
    Linear(f64),
    /// ω is a square of distances, so that g² − 2ω·∂²ω/∂n² is the square of this number everywhere, which is g on the
    /// surface: 2ω/(g + the number).
    Quadratic(f64),
    /// Something else: ω/√(g² + (ω/8r)²), which is right to first order.
    Other,
}

/// A node, or what it is outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Side {
    node: Node,
    negated: bool,
}

/// What a part of the shape is made of.
enum Joint {
    /// Another node holds the same points.
    Same(Side),
    /// R₀ operations, which have edges to round.
    And([Side; 2]),
    Or([Side; 2]),
    /// The least and the greatest, which stay as they are.
    Least([Side; 2]),
    Greatest([Side; 2]),
    /// No joint: a formula.
    Leaf,
}

/// The radius of edges that point outwards, and of those that point inwards if they are rounded.
struct Radii {
    outer: Node,
    inner: Option<Node>,
    /// That of `outer` with the present values of params.
    length: f64,
}

/// A part made anew.
#[derive(Clone, Copy)]
struct Rounded {
    field: Node,
    /// Positive wherever the field is, and bounded where the parts are.
    around: Node,
}

impl Lowering<'_> {
    /// The shape with round edges: `.round(radius)`, or `.round(radius, inner)` with another radius for edges that point
    /// inwards, 0 for none.
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
        let mut done: FxHashMap<Side, Rounded> = FxHashMap::default();
        for side in order {
            if self.over_budget(span) {
                return None;
            }
            let of = |parts: [Side; 2]| parts.map(|part| done[&part]);
            let new = match joints[&side] {
                Joint::Same(other) => done[&other],
                Joint::And(parts) => self.rounded_and(of(parts), &radii, span),
                Joint::Or(parts) => self.rounded_or(of(parts), &radii, span),
                Joint::Least(parts) => self.plain(Binary::Min, of(parts), span),
                Joint::Greatest(parts) => self.plain(Binary::Max, of(parts), span),
                Joint::Leaf => {
                    let distance = self.distance(side.node, within, &radii, span);
                    let field = if side.negated { self.unary(Unary::Neg, distance, span) } else { distance };
                    Rounded { field, around: field }
                }
            };
            done.insert(side, new);
        }
        let Rounded { field, around } = done[&root];
        let fillets = joints.values().any(|joint| matches!(joint, Joint::Or(_))) && radii.inner.is_some();
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

    /// The joints below a root, and an order in which parts come before what they are joined to.
    fn skeleton(&self, root: Side) -> (Vec<Side>, FxHashMap<Side, Joint>) {
        let mut joints = FxHashMap::default();
        let mut waiting = vec![root];
        while let Some(side) = waiting.pop() {
            if joints.contains_key(&side) {
                continue;
            }
            let joint = self.joint(side);
            match &joint {
                Joint::Same(part) => waiting.push(*part),
                Joint::And(parts) | Joint::Or(parts) | Joint::Least(parts) | Joint::Greatest(parts) => {
                    waiting.extend(parts);
                }
                Joint::Leaf => {}
            }
            joints.insert(side, joint);
        }
        // operands have lower numbers than what uses them
        let mut order: Vec<Side> = joints.keys().copied().collect();
        order.sort_by_key(|side| (side.node, side.negated));
        (order, joints)
    }

    /// How a part is joined. Factors that are positive numbers change no distance; *not* turns *and* into *or*.
    fn joint(&self, Side { node, negated }: Side) -> Joint {
        let graph = &self.module.graph;
        let side = |node: Node, turned: bool| Side { node, negated: negated != turned };
        let both = |a: Node, b: Node| [side(a, false), side(b, false)];
        let factor = |node: Node| graph.as_constant(node).filter(|factor| factor.is_normal());
        match graph.expr(node) {
            Expr::Unary(Unary::Neg, a) => Joint::Same(side(a, true)),
            Expr::Binary(Binary::Mul, a, b) => match (factor(a), factor(b)) {
                (Some(factor), _) => Joint::Same(side(b, factor < 0.0)),
                (None, Some(factor)) => Joint::Same(side(a, factor < 0.0)),
                (None, None) => Joint::Leaf,
            },
            Expr::Binary(Binary::Div, a, b) => match factor(b) {
                Some(factor) => Joint::Same(side(a, factor < 0.0)),
                None => Joint::Leaf,
            },
            Expr::Binary(Binary::And, a, b) if negated => Joint::Or(both(a, b)),
            Expr::Binary(Binary::And, a, b) => Joint::And(both(a, b)),
            Expr::Binary(Binary::Or, a, b) if negated => Joint::And(both(a, b)),
            Expr::Binary(Binary::Or, a, b) => Joint::Or(both(a, b)),
            Expr::Binary(Binary::Min, a, b) if negated => Joint::Greatest(both(a, b)),
            Expr::Binary(Binary::Min, a, b) => Joint::Least(both(a, b)),
            Expr::Binary(Binary::Max, a, b) if negated => Joint::Least(both(a, b)),
            Expr::Binary(Binary::Max, a, b) => Joint::Greatest(both(a, b)),
            Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Lookup(..) => Joint::Leaf,
        }
    }

    /// The least of two distances, or the greatest.
    fn plain(&mut self, op: Binary, parts: [Rounded; 2], span: Span) -> Rounded {
        let [a, b] = parts;
        Rounded {
            field: self.binary(op, a.field, b.field, span),
            around: self.binary(op, a.around, b.around, span),
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
        Rounded { field, around: self.binary(Binary::Min, parts[0].around, parts[1].around, span) }
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

    /// The distance from the surface of a part, see [`Profile`]. It has the sign of the part's field everywhere.
    fn distance(&mut self, leaf: Node, within: Option<Aabb>, radii: &Radii, span: Span) -> Node {
        let half = within.map_or(4.0 * radii.length, |within| within.size().max_element());
        let middle = within.map_or([0.0; 3], |within| within.centre().to_array());
        let is_one = |number: f64| (number - 1.0).abs() <= ROUNDING;
        match self.profile(leaf, middle, half) {
            Profile::Linear(slope) if is_one(slope) => leaf,
            Profile::Linear(slope) => {
                let slope = self.constant(slope);
                self.binary(Binary::Div, leaf, slope, span)
            }
            Profile::Quadratic(at_surface) => {
                let at_surface = self.constant(if is_one(at_surface) { 1.0 } else { at_surface });
                let slope = self.slope_of_leaf(leaf, span);
                let sum = self.binary(Binary::Add, slope, at_surface, span);
                let twice = self.binary(Binary::Add, leaf, leaf, span);
                self.binary(Binary::Div, twice, sum, span)
            }
            Profile::Other => {
                let slope = self.slope_of_leaf(leaf, span);
                let farthest = self.constant(FARTHEST);
                let farthest = self.binary(Binary::Mul, farthest, radii.outer, span);
                let part = self.binary(Binary::Div, leaf, farthest, span);
                let [slope, part] = [slope, part].map(|a| self.binary(Binary::Mul, a, a, span));
                let sum = self.binary(Binary::Add, slope, part, span);
                let root = self.unary(Unary::Sqrt, sum, span);
                self.binary(Binary::DivOrZero, leaf, root, span)
            }
        }
    }

    /// |∇ω|, without the directions in which ω does not change.
    fn slope_of_leaf(&mut self, leaf: Node, span: Span) -> Node {
        let gradient = ir::gradient(&mut self.module.graph, leaf);
        let parts: Vec<Node> =
            gradient.into_iter().filter(|part| self.module.graph.as_constant(*part) != Some(0.0)).collect();
        match *parts.as_slice() {
            [] => self.constant(0.0),
            [part] => self.unary(Unary::Abs, part, span),
            _ => {
                let squares: Vec<Node> =
                    parts.iter().map(|&part| self.binary(Binary::Mul, part, part, span)).collect();
                let sum = self.chain(Binary::Add, &squares, span);
                self.unary(Unary::Sqrt, sum, span)
            }
        }
    }

    /// What a part's slope is like at some places within a cube, with the params as they are and otherwise. Whatever is
    /// found here, the distance has the right sign: only its value may be of first order.
    fn profile(&self, leaf: Node, middle: [f64; 3], half: f64) -> Profile {
        let (mut graph, leaf) = self.module.graph.extract_cone(leaf);
        let slopes = Slopes::of(&mut graph, leaf);
        let params: Vec<f64> = self.module.params.iter().map(|param| param.value).collect();
        let others: Vec<f64> = params.iter().map(|value| 1.37 * value).collect();
        let has_params = !graph.parameters(leaf).is_empty();
        let mut found = Vec::new();
        for i in 0..PLACES {
            let parameters = if has_params && i % 2 == 1 { &others } else { &params };
            let point = std::array::from_fn(|axis| middle[axis] + half * spread(i, axis));
            found.extend(slopes.at(point, 7.0 * spread(i, 3), parameters));
        }
        if found.len() < FEWEST_PLACES {
            return Profile::Other;
        }
        let first = found[0];
        if found.iter().all(|at| (at.slope - first.slope).abs() <= ROUNDING * first.slope) {
            return Profile::Linear(first.slope);
        }
        let is_same = |at: &Slope| (at.square - first.square).abs() <= ROUNDING * (at.terms + first.terms);
        if first.square > 0.0 && found.iter().all(is_same) {
            // the one with the least rounding
            let best = found.iter().min_by(|a, b| a.terms.total_cmp(&b.terms)).unwrap_or(&first);
            return Profile::Quadratic(best.square.sqrt());
        }
        Profile::Other
    }
}

/// What a field is like at a place: g, g² − 2ω·∂²ω/∂n², and the sizes of both terms together.
#[derive(Debug, Clone, Copy)]
struct Slope {
    slope: f64,
    square: f64,
    terms: f64,
}

/// The program for [`Slope`].
struct Slopes(Interpreter);

impl Slopes {
    fn of(graph: &mut Graph, leaf: Node) -> Self {
        let gradient = ir::gradient(graph, leaf);
        let squares = gradient.map(|part| graph.binary(Binary::Mul, part, part));
        let sum = graph.binary(Binary::Add, squares[0], squares[1]);
        let sum = graph.binary(Binary::Add, sum, squares[2]);
        let slope = graph.unary(Unary::Sqrt, sum);
        let [a, b, c] = ir::gradient(graph, slope);
        let [x, y, z] = gradient;
        Self(Interpreter::new(graph, &[leaf, slope, x, y, z, a, b, c]))
    }

    /// `None` where the field has no value or no slope.
    fn at(&self, point: [f64; 3], time: f64, parameters: &[f64]) -> Option<Slope> {
        let mut out = [0.0; 8];
        self.0.eval_given(Given { point, time, parameters, uniforms: &[] }, &mut out);
        let [omega, slope, x, y, z, a, b, c] = out;
        let along = (x * a + y * b + z * c) / slope;
        let bent = 2.0 * omega * along;
        let found = Slope { slope, square: slope * slope - bent, terms: slope * slope + bent.abs() };
        (slope > 0.0 && found.terms.is_finite()).then_some(found)
    }
}

/// Numbers from −1 to 1 that fill cubes evenly: multiples of the powers of a generalised golden ratio.
fn spread(i: u32, axis: usize) -> f64 {
    const STEPS: [f64; 4] =
        [0.856_674_883_854_502_9, 0.733_891_856_627_126_1, 0.628_706_721_037_908_6, 0.538_597_257_132_362_5];
    2.0 * (0.5 + f64::from(i) * STEPS[axis]).fract() - 1.0
}
