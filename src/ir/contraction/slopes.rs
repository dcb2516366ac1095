//! Contraction of a box by derivatives.
//!
//! By the mean value theorem, u(p) ∈ u(c) + G·(p − c) for every point p of a box, where c is its centre and G
//! an enclosure of the (generalised) gradient over the box. The error of this shrinks with the square of the
//! box's size, that of values alone with its size.

use glam::DVec3;
use smallvec::{SmallVec, smallvec};

use super::backward;
use super::contractor::{Contractor, SCRATCH, Scratch, Wanted};
use super::forward::{power, whole_exponent};
use super::linear::LinearForm;
use super::rule::Rule;
use super::sets::{Contracted, meet};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::bounds::range::{Region, conjunction_weight, is_zero};
use crate::ir::derived::forward::MOST_PARTS;
use crate::ir::function::BinaryFunction;
use crate::ir::graph::{Axis, Expr, Node};
use crate::ir::lookup::{Part, Tables};
use crate::ir::op::{Binary, Unary};

/// Largest motion of a surface by rounding, relative to the coordinates of its points.
pub const SURFACE_ROUNDING: f64 = 1e-13;

const ZERO: Interval = Interval::point(0.0);
const ONE: Interval = Interval::point(1.0);
const TWO: Interval = Interval::point(2.0);

type Slopes = [Interval; 3];

/// Something for each part of a length.
type Parts<T> = SmallVec<[T; 4]>;

impl Contractor {
    /// Cuts off the parts that the formula's derivatives exclude. This pays in boxes that are small on the
    /// scale of the formula. `forms` receives the linear forms in the distance from an origin that follow.
    pub fn contract_by_slopes(
        &self,
        wanted: &Wanted<'_>,
        space: &mut Aabb,
        forms: (DVec3, &mut Vec<LinearForm>),
    ) -> Contracted {
        SCRATCH.with_borrow_mut(|scratch| {
            scratch.known.clear();
            contract(self, wanted, space, forms, scratch)
        })
    }
}

impl Contractor {
    /// Enclosures of the (generalised) derivatives over a region. `None` if the formula may be undefined
    /// there.
    pub fn slopes(&self, region: &Region<'_>) -> Option<[Interval; 3]> {
        SCRATCH.with_borrow_mut(|scratch| {
            scratch.known.clear();
            self.forward(region, scratch)?;
            if scratch.may_fail[self.root().index()] {
                return None;
            }
            fill(self, scratch);
            Some(scratch.slopes[self.root().index()])
        })
    }
}

impl Contractor {
    /// The values over a region. `None` if the formula may be undefined there.
    pub fn values(&self, region: &Region<'_>) -> Option<Interval> {
        SCRATCH.with_borrow_mut(|scratch| {
            scratch.known.clear();
            self.forward(region, scratch)?;
            let root = self.root().index();
            (!scratch.may_fail[root]).then(|| scratch.values[root])
        })
    }
}

/// Cuts off the parts that the derivatives exclude. `forms` receives the linear forms in p − `origin` that
/// follow, so that several formulas can be solved together.
fn contract(
    contractor: &Contractor,
    wanted: &Wanted<'_>,
    space: &mut Aabb,
    (origin, forms): (DVec3, &mut Vec<LinearForm>),
    scratch: &mut Scratch,
) -> Contracted {
    let centre = space.centre();
    let root = contractor.root().index();
    let point = Aabb::new(centre, centre);
    let value = |scratch: &mut Scratch, over: &Aabb| {
        contractor.forward(&Region { space: over, ..wanted.region }, scratch)?;
        (!scratch.may_fail[root]).then(|| scratch.values[root])
    };
    // where the formula may be undefined it has no gradient
    let Some(at_centre) = value(scratch, &point) else { return Contracted::Somewhere };
    if value(scratch, space).is_none() {
        return Contracted::Somewhere;
    }
    fill(contractor, scratch);
    let sign = |a: Interval| if wanted.negated { -a } else { a };
    let slopes = scratch.slopes[root].map(sign);
    let most = sign(at_centre).hi;
    let verdict = solve(most, slopes, centre, space);
    if verdict == Contracted::Somewhere {
        let to_centre = (centre - origin).to_array().map(|x| Interval::point(x).widened(1));
        let moved = slopes.iter().zip(to_centre).fold(ZERO, |sum, (&slope, x)| sum + slope * x);
        let least = (moved - Interval::point(most)).lo;
        forms.push(LinearForm::at_least(slopes, least));
    }
    verdict
}

/// The remaining part of a box, where `most` + slopes·(p − centre) may be positive.
fn solve(most: f64, slopes: Slopes, centre: DVec3, space: &mut Aabb) -> Contracted {
    let offset = |space: &Aabb, axis: usize| Interval {
        lo: (space.min[axis] - centre[axis]).next_down(),
        hi: (space.max[axis] - centre[axis]).next_up(),
    };
    for axis in 0..3 {
        let others = (0..3).filter(|&other| other != axis);
        let gained =
            others.fold(Interval::point(most), |sum, other| sum + slopes[other] * offset(space, other));
        if !gained.hi.is_finite() {
            continue;
        }
        let needed = Interval { lo: -gained.hi, hi: f64::INFINITY };
        let Some(left) = backward::factor(needed, slopes[axis], offset(space, axis)) else {
            return Contracted::Nowhere;
        };
        // programs round a formula, which moves its surface a little
        let slack =
            SURFACE_ROUNDING * (space.min[axis].abs().max(space.max[axis].abs()) + space.size()[axis]);
        let kept = Interval { lo: centre[axis] + left.lo - slack, hi: centre[axis] + left.hi + slack };
        let Some(kept) = meet(Interval { lo: space.min[axis], hi: space.max[axis] }, kept) else {
            return Contracted::Nowhere;
        };
        (space.min[axis], space.max[axis]) = (kept.lo, kept.hi);
    }
    Contracted::Somewhere
}

/// The slopes of all nodes, from their values.
fn fill(contractor: &Contractor, scratch: &mut Scratch) {
    let Scratch { values, slopes, .. } = scratch;
    slopes.clear();
    for (i, rule) in contractor.rules[..=contractor.root().index()].iter().enumerate() {
        let of = |node: Node| (values[node.index()], slopes[node.index()]);
        let slope = match *rule {
            Rule::Power { of: base, exponent } => {
                let (a, da) = of(base);
                let factor = Interval::point(f64::from(exponent)) * power(a, exponent - 1);
                scaled(factor, da)
            }
            Rule::Slab { of: e, first, second } => {
                let (value, de) = of(e);
                let line = |affine: crate::ir::Affine| {
                    let offset = affine.number(|node| values[node.index()]);
                    (Interval::point(affine.slope), Interval::new(offset, offset))
                };
                let ((p, q), (r, s)) = (line(first), line(second));
                let factor = TWO * p * r * value + (p * s + r * q);
                scaled(factor, de)
            }
            Rule::Plain(Expr::Unary(Unary::Sqrt, sum))
                if let Some(parts) = parts_of_length(&contractor.rules, sum) =>
            {
                slopes_of_length(&parts.into_iter().map(of).collect::<Parts<_>>())
            }
            Rule::Plain(expr) => plain(expr, of, values[i], &contractor.tables),
        };
        slopes.push(slope);
    }
}

/// a, b, … of a² + b² + …, if a node is a sum of two squares or more.
fn parts_of_length(rules: &[Rule], sum: Node) -> Option<Parts<Node>> {
    let (mut parts, mut waiting): (Parts<Node>, Parts<Node>) = (Parts::new(), smallvec![sum]);
    while let Some(node) = waiting.pop() {
        if parts.len() + waiting.len() >= MOST_PARTS {
            return None;
        }
        match rules[node.index()] {
            Rule::Plain(Expr::Binary(Binary::Add, a, b)) => waiting.extend([a, b]),
            Rule::Power { of, exponent: 2 } => parts.push(of),
            Rule::Plain(_) | Rule::Power { .. } | Rule::Slab { .. } => return None,
        }
    }
    (parts.len() > 1).then_some(parts)
}

/// The slopes of √(a² + b² + …) from the values and slopes of its parts. The share of each is a/√(a² + …), from −1
/// to 1 also where all parts vanish; a quotient by the root would have any size near there.
fn slopes_of_length(parts: &[(Interval, Slopes)]) -> Slopes {
    let mut sum = [ZERO; 3];
    for (k, &(part, slopes)) in parts.iter().enumerate().filter(|(_, (_, slopes))| *slopes != [ZERO; 3]) {
        let others: Parts<Interval> =
            parts.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, (value, _))| *value).collect();
        let others = match others[..] {
            [other] => other,
            _ => others.iter().fold(ZERO, |sum, other| sum + other.square()).sqrt(),
        };
        let share = scaled(ONE - conjunction_weight(part, others), slopes);
        // a sum is rounded outwards, and zeros are to stay zeros
        sum = std::array::from_fn(|i| match (sum[i] == ZERO, share[i] == ZERO) {
            (true, _) => share[i],
            (false, true) => sum[i],
            (false, false) => sum[i] + share[i],
        });
    }
    sum
}

fn plain(expr: Expr, of: impl Fn(Node) -> (Interval, Slopes), value: Interval, tables: &Tables) -> Slopes {
    match expr {
        Expr::Constant(_) | Expr::Parameter(_) | Expr::Uniform(_) | Expr::Coordinate(Axis::T) => [ZERO; 3],
        Expr::Coordinate(Axis::X) => [ONE, ZERO, ZERO],
        Expr::Coordinate(Axis::Y) => [ZERO, ONE, ZERO],
        Expr::Coordinate(Axis::Z) => [ZERO, ZERO, ONE],
        Expr::Unary(op, a) => {
            let (a, da) = of(a);
            let factor = match op {
                Unary::Neg => -ONE,
                Unary::Abs => Interval {
                    lo: if a.lo >= 0.0 { 1.0 } else { -1.0 },
                    hi: if a.hi <= 0.0 { -1.0 } else { 1.0 },
                },
                Unary::Sqrt => ONE / (TWO * value),
                // between their jumps they are constant
                Unary::Sign | Unary::Floor | Unary::Round if value.lo == value.hi => return [ZERO; 3],
                Unary::Sign | Unary::Floor | Unary::Round => return constant_or_unknown(da),
                // a tangent jumps at its poles
                Unary::Call(_) if !(value.lo.is_finite() && value.hi.is_finite()) => {
                    return constant_or_unknown(da);
                }
                Unary::Call(function) => {
                    function.slope_and_bend(a, value).map_or(Interval::ALL, |[slope, _]| slope)
                }
            };
            scaled(factor, da)
        }
        Expr::Binary(op, a, b) => binary(op, of(a), of(b), value),
        Expr::Lookup(lookup, at) => {
            let slopes = match lookup.part {
                Part::Value => lookup.slopes(tables, at.map(|node| of(node).0)),
                Part::Slope(_) => [Interval::ALL; 3], // it jumps
            };
            let parts: [Slopes; 3] = std::array::from_fn(|axis| scaled(slopes[axis], of(at[axis]).1));
            std::array::from_fn(|i| parts[0][i] + parts[1][i] + parts[2][i])
        }
    }
}

fn binary(op: Binary, (a, da): (Interval, Slopes), (b, db): (Interval, Slopes), value: Interval) -> Slopes {
    let mixed = |f: Interval, g: Interval| -> Slopes {
        let (da, db) = (scaled(f, da), scaled(g, db));
        std::array::from_fn(|i| da[i] + db[i])
    };
    match op {
        Binary::Add => std::array::from_fn(|i| da[i] + db[i]),
        Binary::Sub => std::array::from_fn(|i| da[i] - db[i]),
        Binary::MulOrZero if is_zero(b) => [ZERO; 3],
        Binary::Mul => mixed(b, a),
        Binary::MulOrZero if !b.contains(0.0) => mixed(b, a),
        Binary::Div | Binary::DivOrZero if !b.contains(0.0) => mixed(ONE / b, -(value / b)),
        // between their jumps they are constant
        Binary::MinWeight | Binary::MaxWeight if value.lo == value.hi => [ZERO; 3],
        Binary::AndWeight if let Some([by_a, by_b]) = slopes_of_weight(a, b) => mixed(by_a, by_b),
        Binary::OrWeight if let Some([by_a, by_b]) = slopes_of_weight(a, b) => mixed(-by_a, -by_b),
        Binary::Min | Binary::PlainMin if a.hi < b.lo => da,
        Binary::Min | Binary::PlainMin if b.hi < a.lo => db,
        Binary::Max | Binary::PlainMax if a.lo > b.hi => da,
        Binary::Max | Binary::PlainMax if b.lo > a.hi => db,
        Binary::Min | Binary::PlainMin | Binary::Max | Binary::PlainMax => {
            std::array::from_fn(|i| da[i].hull(db[i]))
        }
        Binary::And => mixed(conjunction_weight(a, b), conjunction_weight(b, a)),
        Binary::Or => mixed(conjunction_weight(-a, -b), conjunction_weight(-b, -a)),
        Binary::Call(BinaryFunction::Pow) if let Some(exponent) = whole_exponent(b) => {
            scaled(b * power(a, exponent - 1), da)
        }
        Binary::Call(BinaryFunction::Pow) if b.lo == b.hi && a.lo > 0.0 => scaled(b * (value / a), da),
        // an angle jumps where it turns from π to −π
        Binary::Call(BinaryFunction::Atan2) if a.contains(0.0) && b.lo <= 0.0 => {
            let (da, db) = (constant_or_unknown(da), constant_or_unknown(db));
            std::array::from_fn(|i| da[i].hull(db[i]))
        }
        Binary::Call(BinaryFunction::Atan2) => {
            let squares = a.square() + b.square();
            mixed(b / squares, -(a / squares))
        }
        Binary::Div
        | Binary::DivOrZero
        | Binary::MulOrZero
        | Binary::MinWeight
        | Binary::MaxWeight
        | Binary::AndWeight
        | Binary::OrWeight
        | Binary::Call(BinaryFunction::Pow) => {
            let (da, db) = (constant_or_unknown(da), constant_or_unknown(db));
            std::array::from_fn(|i| da[i].hull(db[i]))
        }
    }
}

/// The derivatives of 1 − u/√(u² + v²), which are −v²/(u² + v²)^(3/2) and u·v/(u² + v²)^(3/2). `None` if both
/// may vanish.
fn slopes_of_weight(u: Interval, v: Interval) -> Option<[Interval; 2]> {
    let squares = u.square() + v.square();
    let cubes = squares * squares.sqrt();
    (cubes.lo > f64::MIN_POSITIVE).then(|| [-v.square() / cubes, u * v / cubes])
}

/// A factor times slopes. Where the argument is constant the slope is zero, however steep the function.
fn scaled(factor: Interval, slopes: Slopes) -> Slopes {
    slopes.map(|slope| if slope == ZERO { ZERO } else { factor * slope })
}

fn constant_or_unknown(slopes: Slopes) -> Slopes {
    slopes.map(|slope| if slope == ZERO { ZERO } else { Interval::ALL })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::graph::Graph;

    /// √(max(x, 0)² + y²): where it has no derivative either, each slope is from −1 to 1, and where one part vanishes
    /// it is that of the other.
    #[test]
    fn slopes_of_lengths_are_bounded() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let zero = graph.constant(0.0);
        let part = graph.binary(Binary::Max, x, zero);
        let squares = [part, y].map(|part| graph.binary(Binary::Mul, part, part));
        let sum = graph.binary(Binary::Add, squares[0], squares[1]);
        let root = graph.unary(Unary::Sqrt, sum);
        let contractor = Contractor::new(&graph, root);
        let slopes = |min: DVec3, max: DVec3| contractor.slopes(&Region::of(&Aabb::new(min, max)));
        let around = slopes(DVec3::splat(-1.0), DVec3::splat(1.0)).unwrap();
        assert!(around.iter().all(|slope| slope.lo >= -1.0 - 1e-12 && slope.hi <= 1.0 + 1e-12), "{around:?}");
        let beside = slopes(DVec3::new(-2.0, 1.0, 0.0), DVec3::new(-1.0, 2.0, 1.0)).unwrap();
        assert!(beside[0] == ZERO && beside[2] == ZERO, "{beside:?}");
        assert!((beside[1].lo - 1.0).abs() < 1e-12 && (beside[1].hi - 1.0).abs() < 1e-12, "{beside:?}");
    }
}
