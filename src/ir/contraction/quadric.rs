//! The box around an ellipsoid, from the inverse of the matrix of its form.
//!
//! Products such as x·y leave none of their factors an end by itself. Where a formula is a form of second degree,
//! r² − (p − m)ᵀA(p − m) with A positive definite, it is positive as far as r·√(A⁻¹)ᵢᵢ from m along the axis i.

use glam::{DMat3, DVec3};

use super::rule::{Degree, Rule};
use crate::geom::{Aabb, eigen};
use crate::interval::Interval;
use crate::ir::bounds::range::Affine;
use crate::ir::graph::{Axis, Expr, Node};
use crate::ir::op::{Binary, Unary};

/// The coefficients of x², y², z², xy, yz, zx, x, y, z and 1.
type Form = [Coefficient; 10];

/// The places of x, y, z and of 1 in a form.
const LINEAR: usize = 6;
const NUMBER: usize = 9;

/// The greatest axis of an ellipsoid over the shortest: flatter ones are not told from slabs.
const LONGEST: f64 = 1e3;

/// Numbers with wider ranges than this part of them are not known well enough.
const NARROW: f64 = 1e-13;

/// Smaller coefficients have lost digits.
const LEAST_CURVED: f64 = 1e-280;

/// Rounding of a coefficient beside that of the operations that make it.
const ROUNDINGS: f64 = 1024.0;

#[derive(Debug, Clone, Copy, Default)]
struct Coefficient {
    value: f64,
    /// The sum of the absolute values of its terms, to which rounding is relative.
    size: f64,
}

impl Coefficient {
    fn of(value: f64) -> Self {
        Self { value, size: value.abs() }
    }

    fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, size: self.size + other.size }
    }

    fn times(self, other: Self) -> Self {
        Self { value: self.value * other.value, size: self.size * other.size }
    }
}

/// The degree of a node: 0, 1, 2, or more.
fn degrees(rules: &[Rule]) -> Vec<u8> {
    let mut found: Vec<u8> = Vec::with_capacity(rules.len());
    for rule in rules {
        let of = |node: Node| found[node.index()];
        let degree = match *rule {
            Rule::Plain(Expr::Coordinate(Axis::X | Axis::Y | Axis::Z)) => 1,
            Rule::Plain(Expr::Unary(Unary::Neg, a)) => of(a),
            Rule::Plain(Expr::Binary(Binary::Add | Binary::Sub, a, b)) => of(a).max(of(b)),
            Rule::Plain(Expr::Binary(Binary::Mul, a, b)) => of(a).saturating_add(of(b)),
            Rule::Plain(Expr::Binary(Binary::Div, a, b)) if of(b) == 0 => of(a),
            Rule::Power { of: a, exponent } => {
                of(a).saturating_mul(u8::try_from(exponent).unwrap_or(u8::MAX))
            }
            Rule::Slab { of: a, .. } => of(a).saturating_mul(2),
            Rule::Plain(_) if rule.operands().all(|operand| of(operand) == 0) => 0,
            Rule::Plain(_) => u8::MAX,
        };
        found.push(degree);
    }
    found
}

/// Whether the root of some rules is a form of second degree.
pub fn is_quadric(rules: &[Rule], root: Node) -> bool {
    degrees(&rules[..=root.index()])[root.index()] == 2
}

/// A box around the points where the root of some rules is positive, or negative; `None` where it is no ellipsoid. `values`
/// are those of the numbers among the nodes.
pub fn ellipsoid(
    (rules, degrees): (&[Rule], &[Degree]),
    root: Node,
    values: &[Interval],
    negated: bool,
) -> Option<Aabb> {
    let root = root.index();
    let mut forms: Vec<Option<Form>> = Vec::with_capacity(root + 1);
    for (i, rule) in rules[..=root].iter().enumerate() {
        let form = match degrees[i] {
            Degree::Number => number(values[i]),
            Degree::Linear | Degree::Other => form(rule, &forms, values),
        };
        forms.push(form);
    }
    let form = forms.pop()??;
    let sign = if negated { 1.0 } else { -1.0 };
    // two linear forms are multiplied, and both the formula and its coefficients are rounded
    let rounding = 4.0 * root as f64 * (f64::EPSILON + NARROW) + ROUNDINGS * f64::EPSILON;
    around(&form, sign, rounding)
}

fn number(value: Interval) -> Option<Form> {
    let mut form = Form::default();
    let middle = 0.5 * (value.lo + value.hi);
    form[NUMBER] = Coefficient::of(middle);
    (value.hi - value.lo <= NARROW * middle.abs()).then_some(form)
}

fn form(rule: &Rule, forms: &[Option<Form>], values: &[Interval]) -> Option<Form> {
    let get = |node: Node| forms[node.index()];
    match *rule {
        Rule::Plain(Expr::Coordinate(axis)) => {
            let place = Axis::SPACE.iter().position(|own| *own == axis)?;
            let mut form = Form::default();
            form[LINEAR + place] = Coefficient::of(1.0);
            Some(form)
        }
        Rule::Plain(Expr::Unary(Unary::Neg, a)) => Some(scaled(&get(a)?, Coefficient::of(-1.0))),
        Rule::Plain(Expr::Binary(Binary::Add, a, b)) => Some(sum(&get(a)?, &get(b)?)),
        Rule::Plain(Expr::Binary(Binary::Sub, a, b)) => {
            Some(sum(&get(a)?, &scaled(&get(b)?, Coefficient::of(-1.0))))
        }
        Rule::Plain(Expr::Binary(Binary::Mul, a, b)) => product(&get(a)?, &get(b)?),
        Rule::Plain(Expr::Binary(Binary::Div, a, b)) => {
            let (form, divisor) = (get(a)?, get(b)?[NUMBER].value);
            (divisor != 0.0).then(|| scaled(&form, Coefficient::of(1.0 / divisor)))
        }
        Rule::Power { of, exponent } => {
            let base = get(of)?;
            (1..exponent).try_fold(base, |power, _| product(&power, &base))
        }
        Rule::Slab { of, first, second } => {
            let base = get(of)?;
            let line = |affine: Affine| {
                let offset = number(Interval::point(affine.number(|node| values[node.index()])))?;
                Some(sum(&scaled(&base, Coefficient::of(affine.slope)), &offset))
            };
            product(&line(first)?, &line(second)?)
        }
        Rule::Plain(_) => None,
    }
}

fn scaled(form: &Form, factor: Coefficient) -> Form {
    form.map(|coefficient| coefficient.times(factor))
}

fn sum(a: &Form, b: &Form) -> Form {
    std::array::from_fn(|i| a[i].plus(b[i]))
}

/// The product of two forms; `None` if it is of a higher degree.
fn product(a: &Form, b: &Form) -> Option<Form> {
    let is_zero = |part: &[Coefficient]| part.iter().all(|coefficient| coefficient.size == 0.0);
    let is_number = |form: &Form| is_zero(&form[..NUMBER]);
    if is_number(a) {
        return Some(scaled(b, a[NUMBER]));
    }
    if is_number(b) {
        return Some(scaled(a, b[NUMBER]));
    }
    if !is_zero(&a[..LINEAR]) || !is_zero(&b[..LINEAR]) {
        return None;
    }
    let both = |i: usize, j: usize| a[LINEAR + i].times(b[LINEAR + j]);
    let mixed = |i: usize, j: usize| both(i, j).plus(both(j, i));
    let line = |i: usize| a[LINEAR + i].times(b[NUMBER]).plus(a[NUMBER].times(b[LINEAR + i]));
    Some([
        both(0, 0),
        both(1, 1),
        both(2, 2),
        mixed(0, 1),
        mixed(1, 2),
        mixed(2, 0),
        line(0),
        line(1),
        line(2),
        a[NUMBER].times(b[NUMBER]),
    ])
}

/// The box in which a form times a sign is negative, for rounding errors of this part of each of its terms.
fn around(form: &Form, sign: f64, rounding: f64) -> Option<Aabb> {
    let [xx, yy, zz, xy, yz, zx, x, y, z, one] = form.map(|coefficient| sign * coefficient.value);
    let matrix = DMat3::from_cols(
        DVec3::new(xx, 0.5 * xy, 0.5 * zx),
        DVec3::new(0.5 * xy, yy, 0.5 * yz),
        DVec3::new(0.5 * zx, 0.5 * yz, zz),
    );
    if !matrix.is_finite() {
        return None;
    }
    let (curvatures, axes) = eigen(matrix);
    let (least, most) = (curvatures.min_element(), curvatures.max_element());
    // what rounding makes of the terms of each degree
    let [bent, sloped, level] = [&form[..LINEAR], &form[LINEAR..NUMBER], &form[NUMBER..]]
        .map(|part| rounding * part.iter().map(|c| c.size).sum::<f64>());
    let is_known = most > LEAST_CURVED && 64.0 * bent < least && least * LONGEST * LONGEST > most;
    if !is_known {
        return None;
    }
    let inverse = axes * DMat3::from_diagonal(curvatures.recip()) * axes.transpose();
    let slope = DVec3::new(x, y, z);
    let middle = -0.5 * (inverse * slope);
    let farthest = middle.length();
    let square = -one - 0.5 * slope.dot(middle);
    // |p|² is at most 2|p − m|² + 2|m|², and |p| at most |m| + |p − m|²/2s + s/2 for any length s
    let length = (square.abs() / least).sqrt().max(farthest).max(f64::MIN_POSITIVE);
    let lost = 2.0 * bent + sloped / (2.0 * length);
    let error = 2.0 * bent * farthest * farthest + sloped * (farthest + 0.5 * length) + level;
    let is_convex = 4.0 * lost < least;
    if !is_convex {
        return None;
    }
    let grown = (square + error + ROUNDINGS * f64::EPSILON * square.abs()) / (1.0 - lost / least);
    if grown.is_nan() || grown < 0.0 {
        // it is empty, or smaller than rounding; other rules decide that
        return None;
    }
    let ends = DVec3::new(inverse.col(0).x, inverse.col(1).y, inverse.col(2).z) * grown;
    let reach = ends.map(f64::sqrt) * (1.0 + 1e-12) + DVec3::splat(1e-12 * farthest);
    (reach.is_finite() && middle.is_finite()).then(|| Aabb::new(middle - reach, middle + reach))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Binary, Contracted, Contractor, Graph, Region, Wanted};

    /// The box of 1 − x² − y² − z² + a·x·y + b·y·z + c·x, as the contraction finds it.
    fn found([a, b, c]: [f64; 3]) -> Aabb {
        let mut g = Graph::default();
        let [x, y, z] = Axis::SPACE.map(|axis| g.coordinate(axis));
        let mut omega = g.constant(1.0);
        for axis in [x, y, z] {
            let square = g.binary(Binary::Mul, axis, axis);
            omega = g.binary(Binary::Sub, omega, square);
        }
        for (factor, [p, q]) in [(a, [x, y]), (b, [y, z])] {
            let factor = g.constant(factor);
            let both = g.binary(Binary::Mul, p, q);
            let term = g.binary(Binary::Mul, factor, both);
            omega = g.binary(Binary::Add, omega, term);
        }
        let factor = g.constant(c);
        let term = g.binary(Binary::Mul, factor, x);
        omega = g.binary(Binary::Add, omega, term);
        let mut space = Aabb::new(DVec3::splat(-1e30), DVec3::splat(1e30));
        let wanted = Wanted { region: Region::of(&Aabb::EMPTY), negated: false };
        let verdict = Contractor::new(&g, omega).contract(&wanted, &mut space, Some(&mut Vec::new()));
        assert_eq!(verdict, Contracted::Somewhere);
        space
    }

    #[test]
    fn ellipsoids_end_where_their_tangents_are_parallel_to_the_axes() {
        // x² + y² − xy ≤ 1: x² ≤ 4/3, and z² ≤ 1
        let end = (4.0_f64 / 3.0).sqrt();
        let space = found([1.0, 0.0, 0.0]);
        assert!((space.max - DVec3::new(end, end, 1.0)).abs().max_element() < 1e-9, "{space:?}");
        // A = [[1, −½, 0], [−½, 1, −½], [0, −½, 1]] has A⁻¹ = [[3/2, 1, ½], [1, 2, 1], [½, 1, 3/2]]
        let space = found([1.0, 1.0, 0.0]);
        let ends = DVec3::new(1.5, 2.0, 1.5).map(f64::sqrt);
        assert!((space.max - ends).abs().max_element() < 1e-9, "{space:?}");
        assert!((space.min + ends).abs().max_element() < 1e-9, "{space:?}");
        // beside the origin: the middle is A⁻¹(c/2, 0, 0), and r² = 1 + (A⁻¹)₁₁·c²/4
        let space = found([1.0, 1.0, 2.0]);
        let (middle, ends) = (DVec3::new(1.5, 1.0, 0.5), ends * 2.5_f64.sqrt());
        assert!((space.max - middle - ends).abs().max_element() < 1e-9, "{space:?}");
        assert!((space.min - middle + ends).abs().max_element() < 1e-9, "{space:?}");
    }

    #[test]
    fn what_is_no_ellipsoid_keeps_its_box() {
        // a cylinder, and a hyperboloid
        for a in [2.0, 3.0] {
            assert!(found([a, 0.0, 0.0]).size().max_element() > 1e20, "{a}");
        }
    }
}
