//! How far the estimate of a contact can be trusted, by what its formula is made of.
//!
//! `ir::contact` takes a leaf for a quadric along its normal. That is right for the standard solids, whose leaves are of
//! degree two in the coordinates and in lengths √(x² + y²). It says little of other formulas, which may be endlessly steep or
//! flat somewhere, and on a crease, where a formula has one slope on each side.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::ir::derived::contact::leaves;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::interpreter::{Given, Interpreter};
use crate::ir::op::{Binary, Unary};
use crate::ir::real::Real;

/// Solids of more leaves are not looked into: what is near a place comes from their parts.
const MOST_LEAVES: usize = 256;

/// Creases beyond this number are not looked at: each takes a part of the time of a contact.
const MOST_CREASES: usize = 16;

/// Roots of sums of more squares are not taken for lengths. A sum may repeat its parts, and a chain of such sums has endlessly
/// many squares.
const MOST_SQUARES: usize = 16;

/// A point is on a crease if it is nearer than this part of its coordinates and of the lengths in the formula.
const ON_CREASE: f64 = 1e-6;

/// Second derivatives differ by more than rounding above this part of the largest.
const SAME_BEND: f64 = 1e-6;

/// A surface may be nearer in another direction where the sum of its two curvatures, times the distance, is more than this; and
/// where the distance is more than this many times that of the point from the origin.
const BENT_AROUND: f64 = 1.0;
const FAR_AWAY: f64 = 8.0;

/// A surface counts as flat if its curvature times the distance is less.
const FLAT: f64 = 1e-9;

/// The time at which a formula that moves is looked at, in seconds: at 0 many have a place of their own.
const SOME_TIME: f64 = 0.37;

/// What the leaves of a formula are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TrustKind {
    /// Planes, balls and cylinders, and what lengths make of them: the estimate is the distance of the leaf.
    Exact,
    /// Other quadrics, and lengths in stretched coordinates: the estimate is exact along a normal, or nearly so, which may not
    /// be that of the nearest place.
    Bent,
    /// All other formulas.
    Doubtful,
}

/// What is known of the estimates of a formula's contacts.
#[derive(Debug, Clone)]
pub struct Trust {
    pub kind: TrustKind,
    /// Whether no doubtful leaf has an edge of its own.
    pub is_smooth: bool,
    creases: Vec<Crease>,
}

/// Where some linear forms vanish together: the first, and the others.
#[derive(Debug, Clone)]
struct Crease {
    first: Linear,
    others: Vec<Linear>,
}

/// A linear form, which counts as zero below some rounding and a part of a distance.
#[derive(Debug, Clone, Copy)]
struct Linear {
    normal: DVec3,
    at_origin: f64,
    rounding: f64,
    near: f64,
}

impl Trust {
    /// That of a whole formula.
    pub fn of(graph: &Graph, root: Node) -> Self {
        let mut trust = Self { kind: TrustKind::Exact, is_smooth: true, creases: Vec::new() };
        for leaf in leaves(graph, root, MOST_LEAVES).unwrap_or_default() {
            let mut creases = Vec::new();
            let kind = kind_of_leaf(graph, leaf, &mut creases);
            trust.kind = trust.kind.max(kind);
            trust.creases.extend(creases);
            trust.is_smooth &= kind != TrustKind::Doubtful || is_smooth(graph, leaf);
        }
        trust.creases.truncate(MOST_CREASES);
        trust
    }

    /// Whether the estimate at a point, by so much, is to be compared with the signs before and behind it.
    #[inline]
    pub fn is_doubtful_at(&self, p: DVec3, distance: f64) -> bool {
        self.kind == TrustKind::Doubtful || self.is_on_crease(p, distance)
    }

    /// Whether a point is where a formula has one slope on each side.
    #[inline]
    pub fn is_on_crease(&self, p: DVec3, distance: f64) -> bool {
        self.creases.iter().any(|crease| {
            is_zero(crease.first, p, distance) && crease.others.iter().all(|form| is_zero(*form, p, distance))
        })
    }

    /// Whether the surface may be nearer in another direction than in that of the estimate: where it bends around the point,
    /// and where the estimate is much farther away than the origin.
    #[inline]
    pub fn may_be_beside(&self, p: DVec3, distance: f64, mean_curvature: f64) -> bool {
        self.is_looked_around() && bends_around(p, distance, mean_curvature)
    }

    /// Formulas with edges of their own, as those of blends and rounded solids, have too many of such places.
    fn is_looked_around(&self) -> bool {
        self.kind == TrustKind::Bent || self.kind == TrustKind::Doubtful && self.is_smooth
    }

    /// Whether an estimate may have to be compared with signs at all.
    #[inline]
    pub fn is_in_doubt(&self, p: DVec3, distance: f64, mean_curvature: f64) -> bool {
        self.is_doubtful_at(p, distance) || self.may_be_beside(p, distance, mean_curvature)
    }

    /// Whether the formula may bend although it is flat at a point: in the middle of a valley.
    #[inline]
    pub fn may_be_flat(&self, distance: f64, mean_curvature: f64) -> bool {
        self.kind == TrustKind::Doubtful && self.is_smooth && (distance * mean_curvature).abs() <= FLAT
    }

    /// Whether some of the estimates at points may have to be compared with signs: one test for all, without branches.
    #[inline]
    pub fn has_doubts<T: Real>(&self, points: [&[T]; 3], distance: &[T], curvature: &[T]) -> bool {
        let [x, y, z] = points;
        let point = |i: usize| DVec3::new(x[i].to_f64(), y[i].to_f64(), z[i].to_f64());
        let mut found = self.kind == TrustKind::Doubtful;
        for crease in &self.creases {
            for (i, distance) in distance.iter().enumerate() {
                found |= is_zero(crease.first, point(i), distance.to_f64());
            }
        }
        if self.kind == TrustKind::Bent {
            for (i, (distance, curvature)) in distance.iter().zip(curvature).enumerate() {
                found |= bends_around(point(i), distance.to_f64(), curvature.to_f64());
            }
        }
        found
    }
}

/// Whether a surface bends around a point, or is so far that it may.
#[inline]
fn bends_around(p: DVec3, distance: f64, mean_curvature: f64) -> bool {
    (-2.0 * distance * mean_curvature > BENT_AROUND) | is_far_away(p, distance)
}

/// Whether a distance is far longer than the coordinates of its point.
#[inline]
pub fn is_far_away(p: DVec3, distance: f64) -> bool {
    distance.abs() > FAR_AWAY * p.abs().max_element()
}

#[inline]
fn is_zero(form: Linear, p: DVec3, distance: f64) -> bool {
    (form.normal.dot(p) + form.at_origin).abs() <= form.rounding + form.near * distance.abs()
}

impl Linear {
    fn new(normal: DVec3, at_origin: f64) -> Self {
        Self { normal, at_origin, rounding: ON_CREASE * at_origin.abs(), near: ON_CREASE * normal.length() }
    }

    fn times(self, by: f64) -> Self {
        Self::new(by * self.normal, by * self.at_origin)
    }

    fn plus(self, other: Self) -> Self {
        Self::new(self.normal + other.normal, self.at_origin + other.at_origin)
    }
}

impl Crease {
    fn of_one(first: Linear) -> Self {
        Self { first, others: Vec::new() }
    }

    fn of_all(mut forms: Vec<Linear>) -> Option<Self> {
        let first = forms.pop()?;
        Some(Self { first, others: forms })
    }
}

/// The kind of a formula that no logic joins, and the creases within it.
fn kind_of_leaf(graph: &Graph, leaf: Node, creases: &mut Vec<Crease>) -> TrustKind {
    let mut terms: FxHashMap<Node, Term> = FxHashMap::default();
    for node in graph.cone(leaf) {
        let mut term = Term::of(graph, node, &terms, creases).unwrap_or(Term::OTHER);
        term.is_stretched |= graph.expr(node).operands().any(|operand| terms[&operand].is_stretched);
        terms.insert(node, term);
    }
    let Term { degree, is_polynomial, is_stretched, .. } = terms[&leaf];
    match degree {
        0..=2 if is_stretched => TrustKind::Bent,
        0 | 1 => TrustKind::Exact,
        2 if is_polynomial && !bends_evenly(graph, leaf) => TrustKind::Bent,
        2 => TrustKind::Exact,
        _ => TrustKind::Doubtful,
    }
}

/// Whether a formula has no edge: neither a root nor a choice.
fn is_smooth(graph: &Graph, leaf: Node) -> bool {
    graph.cone(leaf).into_iter().all(|node| match graph.expr(node) {
        Expr::Unary(Unary::Neg | Unary::Call(_), _)
        | Expr::Binary(
            Binary::Add | Binary::Sub | Binary::Mul | Binary::Div | Binary::DivOrZero | Binary::Call(_),
            ..,
        )
        | Expr::Constant(_)
        | Expr::Coordinate(_)
        | Expr::Parameter(_)
        | Expr::Uniform(_) => true,
        Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) => false,
    })
}

/// What is known of a node: its degree, where lengths and distances count as coordinates.
#[derive(Clone, Copy)]
struct Term {
    degree: u32,
    /// Whether it is a polynomial in the coordinates.
    is_polynomial: bool,
    /// Whether a length in it grows faster in one direction than in another.
    is_stretched: bool,
    linear: Option<Linear>,
}

impl Term {
    const NUMBER: Self = Self { degree: 0, is_polynomial: true, is_stretched: false, linear: None };

    /// What has a higher degree than two, or none.
    const OTHER: Self = Self { degree: 3, is_polynomial: false, is_stretched: false, linear: None };

    const LENGTH: Self = Self { degree: 1, is_polynomial: false, is_stretched: false, linear: None };

    /// `None` for nodes of a higher degree, or of none.
    fn of(
        graph: &Graph,
        node: Node,
        known: &FxHashMap<Node, Self>,
        creases: &mut Vec<Crease>,
    ) -> Option<Self> {
        let expr = graph.expr(node);
        let varies = expr.operands().any(|operand| known[&operand].degree > 0);
        match expr {
            Expr::Constant(bits) => {
                let linear = Some(Linear::new(DVec3::ZERO, f64::from_bits(bits)));
                Some(Self { linear, ..Self::NUMBER })
            }
            Expr::Coordinate(axis) => Some(Self::coordinate(axis)),
            Expr::Parameter(_) | Expr::Uniform(_) => Some(Self::NUMBER),
            // a table holds distances
            Expr::Lookup(..) => Some(if varies { Self::LENGTH } else { Self::NUMBER }),
            Expr::Unary(op, a) => Self::unary(graph, op, a, known, creases),
            Expr::Binary(op, a, b) => Self::binary(op, known[&a], known[&b], creases),
        }
    }

    fn coordinate(axis: Axis) -> Self {
        let normal = match axis {
            Axis::X => DVec3::X,
            Axis::Y => DVec3::Y,
            Axis::Z => DVec3::Z,
            Axis::T => return Self::NUMBER,
        };
        Self { degree: 1, linear: Some(Linear::new(normal, 0.0)), ..Self::NUMBER }
    }

    fn unary(
        graph: &Graph,
        op: Unary,
        a: Node,
        known: &FxHashMap<Node, Self>,
        creases: &mut Vec<Crease>,
    ) -> Option<Self> {
        let term = known[&a];
        match op {
            Unary::Neg => Some(Self { linear: term.linear.map(|form| form.times(-1.0)), ..term }),
            // steps: the same number for all of a piece
            Unary::Sign | Unary::Floor | Unary::Round => Some(Self::NUMBER),
            Unary::Abs | Unary::Sqrt | Unary::Call(_) if term.degree == 0 => Some(Self::NUMBER),
            Unary::Abs if term.degree == 1 => {
                creases.extend(term.linear.map(Crease::of_one));
                Some(Self::LENGTH)
            }
            Unary::Sqrt => {
                let squares = squares(graph, a)?;
                if squares.iter().any(|square| known[square].degree > 1) {
                    return None;
                }
                let forms: Option<Vec<Linear>> = squares.iter().map(|square| known[square].linear).collect();
                let is_stretched = match &forms {
                    Some(forms) => !are_axes(forms),
                    // numbers that are not known yet
                    None if squares.iter().all(|square| known[square].is_polynomial) => {
                        squares.iter().any(|square| known[square].degree == 0) || !bends_evenly(graph, a)
                    }
                    None => false,
                };
                creases.extend(forms.and_then(Crease::of_all));
                Some(Self { is_stretched, ..Self::LENGTH })
            }
            Unary::Abs | Unary::Call(_) => None,
        }
    }

    fn binary(op: Binary, a: Self, b: Self, creases: &mut Vec<Crease>) -> Option<Self> {
        let is_polynomial = a.is_polynomial && b.is_polynomial;
        let degree = a.degree.max(b.degree);
        if degree == 0 && !matches!(op, Binary::Add | Binary::Sub | Binary::Mul | Binary::Div) {
            return Some(Self::NUMBER);
        }
        let sum = |sign: f64| a.linear.and_then(|form| Some(form.plus(b.linear?.times(sign))));
        let scaled = |form: Option<Linear>, by: f64| form.map(|form| form.times(by));
        let number =
            |term: Self| if term.degree == 0 { term.linear.map(|form| form.at_origin) } else { None };
        match op {
            Binary::Add => Some(Self { degree, is_polynomial, linear: sum(1.0), ..a }),
            Binary::Sub => Some(Self { degree, is_polynomial, linear: sum(-1.0), ..a }),
            Binary::Mul | Binary::MulOrZero if a.degree + b.degree <= 2 => {
                let by_b = number(b).and_then(|by| scaled(a.linear, by));
                let linear = by_b.or_else(|| number(a).and_then(|by| scaled(b.linear, by)));
                Some(Self { degree: a.degree + b.degree, is_polynomial, linear, ..a })
            }
            Binary::Div | Binary::DivOrZero if b.degree == 0 => {
                Some(Self { linear: number(b).and_then(|by| scaled(a.linear, 1.0 / by)), ..a })
            }
            Binary::Min | Binary::PlainMin | Binary::Max | Binary::PlainMax if degree == 1 => {
                creases.extend(sum(-1.0).map(Crease::of_one));
                Some(Self::LENGTH)
            }
            Binary::Mul
            | Binary::MulOrZero
            | Binary::Div
            | Binary::DivOrZero
            | Binary::Min
            | Binary::PlainMin
            | Binary::Max
            | Binary::PlainMax
            | Binary::MinWeight
            | Binary::MaxWeight
            | Binary::And
            | Binary::Or
            | Binary::AndWeight
            | Binary::OrWeight
            | Binary::Call(_) => None,
        }
    }
}

/// The nodes whose squares a node is the sum of; `None` for other nodes, and if there are more than [`MOST_SQUARES`].
fn squares(graph: &Graph, node: Node) -> Option<Vec<Node>> {
    let (mut waiting, mut found) = (vec![node], Vec::new());
    while let Some(node) = waiting.pop() {
        // each that waits is a square at least
        if found.len() + waiting.len() >= MOST_SQUARES {
            return None;
        }
        match graph.expr(node) {
            Expr::Binary(Binary::Add, a, b) => waiting.extend([a, b]),
            Expr::Binary(Binary::Mul, a, b) if a == b => found.push(a),
            Expr::Unary(..)
            | Expr::Binary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => return None,
        }
    }
    Some(found)
}

/// Whether the root of the sum of the squares of linear forms is a length, or a multiple of one: whether they grow equally fast
/// in directions at right angles.
fn are_axes(forms: &[Linear]) -> bool {
    let squared = |form: &Linear| form.normal.length_squared();
    let largest = forms.iter().map(squared).fold(0.0, f64::max);
    let is_small = |difference: f64| difference.abs() <= SAME_BEND * largest;
    forms.iter().enumerate().all(|(i, form)| {
        is_small(squared(form) - largest)
            && forms[..i].iter().all(|other| is_small(form.normal.dot(other.normal)))
    })
}

/// Whether a polynomial of degree two bends equally in all directions in which it bends at all.
fn bends_evenly(graph: &Graph, leaf: Node) -> bool {
    let (graph, leaf) = graph.extract_cone(leaf);
    if graph.uses_parameters(&[leaf]) || graph.exprs().iter().any(|expr| matches!(expr, Expr::Uniform(_))) {
        return false;
    }
    let formula = Interpreter::new(&graph, &[leaf]);
    let value = |p: DVec3| {
        let mut out = [0.0];
        let given = Given { time: SOME_TIME, ..Given::point(p.to_array()) };
        formula.eval_given(given, &mut out);
        out[0]
    };
    let at_origin = value(DVec3::ZERO);
    let along = DVec3::AXES.map(&value);
    let bend = |i: usize, j: usize| {
        let (a, b) = (DVec3::AXES[i], DVec3::AXES[j]);
        value(a + b) - along[i] - along[j] + at_origin
    };
    let rows: [DVec3; 3] = [0, 1, 2].map(|i| DVec3::new(bend(i, 0), bend(i, 1), bend(i, 2)));
    // without a slope in the directions in which it does not bend: H² = λH with λ = tr H²/tr H, and Hg = λg
    let largest = rows.iter().map(|row| row.abs().max_element()).fold(0.0, f64::max);
    let factor =
        rows.iter().map(|row| row.length_squared()).sum::<f64>() / (rows[0].x + rows[1].y + rows[2].z);
    let differs = |i: usize, j: usize| {
        let error = rows[i].dot(rows[j]) - factor * rows[i][j];
        error.is_nan() || error.abs() > SAME_BEND * largest * largest
    };
    let slope = DVec3::from_array([0, 1, 2].map(|i| along[i] - at_origin - 0.5 * rows[i][i]));
    let aside = slope - DVec3::from_array(rows.map(|row| row.dot(slope))) / factor;
    let is_straight = aside.length() <= SAME_BEND * slope.length().max(largest);
    is_straight && !(0..9).any(|k| differs(k / 3, k % 3))
}
