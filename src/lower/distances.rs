//! Distances of single formulas, where they follow from the slope of the field.

use super::lowering::Lowering;
use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::ir::{self, Axis, Binary, Expr, Given, Graph, Interpreter, Node, Unary};

/// How many places a part is looked at to find what its slope is like.
const PLACES: u32 = 48;

/// With fewer places that have a slope, nothing can be said.
const FEWEST_PLACES: usize = 16;

/// What counts as rounding, relative to the terms of a sum.
const ROUNDING: f64 = 1e-10;

/// The distance from the surface of a formula.
pub(super) struct Known {
    pub field: Node,
    /// The greatest distance within: half of the thickness. Infinite where none is known.
    pub greatest: f64,
    /// Where the formula is proven to be a square of distances.
    pub square: Option<Square>,
}

/// A field that falls off as a square of distances: ω = kδ − cδ²/2 at the depth δ, everywhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct Square {
    /// k: the slope on the surface.
    pub at_surface: f64,
    /// c > 0: how fast it falls inwards.
    pub bend: f64,
}

/// How a part's field becomes a distance, with g = |∇ω|.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Profile {
    /// g is this number everywhere: ω/g.
    Linear(f64),
    /// ω is a square of distances, so that g² − 2ω·∂²ω/∂n² is the square of a number everywhere, which is g on the
    /// surface: 2ω/(g + the number).
    Quadratic { at_surface: f64, second: Option<f64> },
    /// Something else.
    Other,
}

impl Lowering<'_> {
    /// The distance from the surface of a formula, with the sign of its field; `None` where it does not
    /// follow from the slope. The formula is looked at in a cube around the box that it is known to be in, or
    /// around the origin with this half side.
    pub(super) fn exact_distance(
        &mut self,
        leaf: Node,
        (within, half): (Option<Aabb>, f64),
        span: Span,
    ) -> Option<Known> {
        let half = within.map_or(half, |within| within.size().max_element());
        let middle = within.map_or([0.0; 3], |within| within.centre().to_array());
        let is_one = |number: f64| (number - 1.0).abs() <= ROUNDING;
        let endless = |field| Some(Known { field, greatest: f64::INFINITY, square: None });
        match self.profile(leaf, middle, half) {
            Profile::Linear(slope) if is_one(slope) => endless(leaf),
            Profile::Linear(slope) => {
                let slope = self.constant(slope);
                endless(self.binary(Binary::Div, leaf, slope, span))
            }
            Profile::Quadratic { at_surface, second } => {
                let bent = second.filter(|second| *second < 0.0);
                // the depth at which the slope has fallen to zero
                let greatest = bent.map_or(f64::INFINITY, |second| at_surface / -second);
                // for a formula in pieces the places that were looked at prove nothing elsewhere
                let square = bent
                    .filter(|_| self.is_polynomial(leaf))
                    .map(|second| Square { at_surface, bend: -second });
                let at_surface = self.constant(if is_one(at_surface) { 1.0 } else { at_surface });
                let slope = self.slope_of_leaf(leaf, span);
                let field = match bent.filter(|_| self.divides(slope)) {
                    Some(second) => self.distance_by_root(leaf, at_surface, second, span),
                    None => {
                        let sum = self.binary(Binary::Add, slope, at_surface, span);
                        let twice = self.binary(Binary::Add, leaf, leaf, span);
                        self.binary(Binary::Div, twice, sum, span)
                    }
                };
                self.module.graph.enclose(field, leaf);
                Some(Known { field, greatest, square })
            }
            Profile::Other => None,
        }
    }

    /// (k − √(k² + 2cω))/−c, where k is the slope on the surface and c = ∂²ω/∂n² is the same everywhere. It is
    /// 2ω/(g + k) without g, of which no range is known where it divides by what may be zero, as on the axis of a
    /// torus. Here ω stands once, so the range is exact, and bounds are found. Within rounding of the surface it is zero.
    fn distance_by_root(&mut self, leaf: Node, at_surface: Node, second: f64, span: Span) -> Node {
        let [zero, twice, curved] = [0.0, 2.0 * second, -second].map(|number| self.constant(number));
        let square = self.binary(Binary::Mul, at_surface, at_surface, span);
        let bent = self.binary(Binary::Mul, leaf, twice, span);
        let sum = self.binary(Binary::Add, square, bent, span);
        let sum = self.binary(Binary::Max, sum, zero, span);
        let slope = self.unary(Unary::Sqrt, sum, span);
        let difference = self.binary(Binary::Sub, at_surface, slope, span);
        self.binary(Binary::Div, difference, curved, span)
    }

    /// Whether a formula is a polynomial of the coordinates. What holds of it at places in general position then holds
    /// everywhere.
    fn is_polynomial(&self, formula: Node) -> bool {
        Self::is_of_sums(&self.module.graph, formula, false)
    }

    /// Whether a formula is made of sums, products and quotients by numbers, and perhaps of roots.
    fn is_of_sums(graph: &Graph, formula: Node, with_roots: bool) -> bool {
        let varies = |node: Node| Axis::SPACE.iter().any(|&axis| graph.uses(node, axis));
        graph.cone(formula).into_iter().filter(|&node| varies(node)).all(|node| match graph.expr(node) {
            Expr::Coordinate(_)
            | Expr::Unary(Unary::Neg, _)
            | Expr::Binary(Binary::Add | Binary::Sub | Binary::Mul, ..) => true,
            Expr::Unary(Unary::Sqrt, _) => with_roots,
            Expr::Binary(Binary::Div, _, divisor) => !varies(divisor),
            Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Constant(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => false,
        })
    }

    /// Whether a formula divides by something that may be zero.
    fn divides(&self, formula: Node) -> bool {
        let graph = &self.module.graph;
        let is_quotient = |node: &Node| matches!(graph.expr(*node), Expr::Binary(Binary::DivOrZero, ..));
        graph.cone(formula).iter().any(is_quotient)
    }

    /// |∇ω|, without the directions in which ω does not change.
    pub(super) fn slope_of_leaf(&mut self, leaf: Node, span: Span) -> Node {
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

    /// Examines the slope of a part at some places within a cube, with the present params and with others.
    /// Whatever is found here, the distance has the right sign, but for rounding at the surface. Its value is wrong
    /// where a formula in pieces has another slope than at all of these places, and an offset is then wrong by as much.
    fn profile(&self, leaf: Node, middle: [f64; 3], half: f64) -> Profile {
        let (mut graph, leaf) = self.module.graph.extract_cone(leaf);
        let slopes = Slopes::of(&mut graph, leaf);
        let params: Vec<f64> = self.module.params.iter().map(|param| param.value).collect();
        let others: Vec<f64> =
            params.iter().map(|value| if *value == 0.0 { 0.1 } else { 1.37 * value }).collect();
        let has_params = !graph.parameters(leaf).is_empty();
        let mut found = Vec::new();
        for i in 0..PLACES {
            let parameters = if has_params && i % 2 == 1 { &others } else { &params };
            let point = std::array::from_fn(|axis| middle[axis] + half * spread(i, axis));
            found.extend(slopes.at(point, 7.0 * spread(i, 3), parameters));
        }
        match Slope::profile(&found) {
            // the first place is the middle, which may be the axis of a cone, where the slope is that of no side
            Profile::Other if Self::is_of_sums(&graph, leaf, true) => {
                Slope::profile(found.get(1..).unwrap_or_default())
            }
            known => known,
        }
    }
}

/// The figures of a field at a place: g, ∂²ω/∂n², g² − 2ω·∂²ω/∂n², and the sizes of both terms together.
#[derive(Debug, Clone, Copy)]
struct Slope {
    slope: f64,
    second: f64,
    square: f64,
    terms: f64,
}

impl Slope {
    /// What all places have in common.
    fn profile(found: &[Self]) -> Profile {
        let [first, ..] = found else { return Profile::Other };
        if found.len() < FEWEST_PLACES {
            return Profile::Other;
        }
        if found.iter().all(|at| (at.slope - first.slope).abs() <= ROUNDING * first.slope) {
            return Profile::Linear(first.slope);
        }
        let is_same = |at: &Self| (at.square - first.square).abs() <= ROUNDING * (at.terms + first.terms);
        if first.square > 0.0 && found.iter().all(is_same) {
            // the one with the least rounding
            let best = found.iter().min_by(|a, b| a.terms.total_cmp(&b.terms)).unwrap_or(first);
            let has_same = |at: &Self| (at.second - best.second).abs() <= 1e-8 * best.second.abs();
            let second = found.iter().all(has_same).then_some(best.second);
            return Profile::Quadratic { at_surface: best.square.sqrt(), second };
        }
        Profile::Other
    }
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
        let second = (x * a + y * b + z * c) / slope;
        let bent = 2.0 * omega * second;
        let found = Slope { slope, second, square: slope * slope - bent, terms: slope * slope + bent.abs() };
        (slope > 0.0 && found.terms.is_finite()).then_some(found)
    }
}

/// Numbers from −1 to 1 that fill cubes evenly: multiples of the powers of a generalised golden ratio.
fn spread(i: u32, axis: usize) -> f64 {
    const STEPS: [f64; 4] =
        [0.856_674_883_854_502_9, 0.733_891_856_627_126_1, 0.628_706_721_037_908_6, 0.538_597_257_132_362_5];
    2.0 * (0.5 + f64::from(i) * STEPS[axis]).fract() - 1.0
}
