//! Linear forms with known ranges, and the box around the points that they leave.
//!
//! Forms that are not parallel to the axes bound a coordinate only together, for example in a turned box or a
//! wedge of half-spaces. The largest coordinate is the solution of a linear program. Its dual gives
//! multipliers λ ≥ 0 of the constraints aᵢ·p ≤ bᵢ with Σ λᵢaᵢ = d, and then d·p ≤ Σ λᵢbᵢ. The multipliers are
//! found in floating point. The bound is then computed in intervals and includes the error of the
//! multipliers, so it holds for any of them.

use glam::{DMat3, DVec3};

use crate::geom::Aabb;
use crate::interval::Interval;

/// A linear form of the coordinates with known values: `slopes`·p ∈ `range`.
#[derive(Debug, Clone, Copy)]
pub struct LinearForm {
    /// The coefficients of x, y, z.
    pub slopes: [Interval; 3],
    /// The values where the formula is positive.
    pub range: Interval,
    /// The largest magnitude of the number that is added to it: its sum is rounded on that scale.
    offset: f64,
}

impl LinearForm {
    /// Maximum number of forms that are used. More would cost more than they gain.
    pub const MOST: usize = 4096;

    /// slopes·p ∈ range, computed with a number of this magnitude added.
    pub fn new(slopes: [Interval; 3], range: Interval, offset: f64) -> Self {
        Self { slopes, range, offset }
    }

    /// slopes·p ≥ least
    pub(super) fn at_least(slopes: [Interval; 3], least: f64) -> Self {
        Self { slopes, range: Interval { lo: least, hi: f64::INFINITY }, offset: least.abs() }
    }
}

impl LinearForm {
    /// A lower bound of the distance between a point and the points of a box that the form leaves. All points
    /// are relative to the origin of the form.
    pub fn distance(&self, p: DVec3, over: &Aabb) -> f64 {
        let middle = DVec3::from_array(self.slopes.map(|slope| 0.5 * (slope.lo + slope.hi)));
        let error = DVec3::from_array(self.slopes.map(|slope| 0.5 * slope.width().next_up()));
        let reach = over.min.abs().max(over.max.abs());
        // middle·q is at least this for all remaining q
        let least = self.range.lo - error.dot(reach);
        let rounding = 1e-14 * (middle.abs().dot(reach + p.abs()) + self.range.lo.abs());
        let distance = (least - middle.dot(p) - rounding) / middle.length() * (1.0 - 1e-14);
        // NaN for slopes that are not known
        if distance > 0.0 && distance.is_finite() { distance } else { 0.0 }
    }
}

/// aᵢ·p ≤ b
#[derive(Clone, Copy)]
struct Constraint {
    slopes: [Interval; 3],
    most: f64,
    /// Middles of the slopes.
    normal: DVec3,
    /// Its length.
    length: f64,
}

impl Constraint {
    fn new(slopes: [Interval; 3], most: f64, normal: DVec3) -> Self {
        Self { slopes, most, normal, length: normal.length() }
    }
}

pub const ZERO: Interval = Interval::point(0.0);

/// Maximum number of steps of one linear program. Some five are needed.
const MOST_PIVOTS: usize = 60;

/// Number of rounds over the six sides. The search region is huge, so several rounds are needed if a
/// multiplier misses a millionth of a millionth of a side.
const MOST_ROUNDS: usize = 8;

pub fn plus(a: Interval, b: Interval) -> Interval {
    if a == ZERO {
        b
    } else if b == ZERO {
        a
    } else {
        a + b
    }
}

/// A box and forms with known ranges, from which the ranges of other forms follow.
pub struct LinearProgram {
    constraints: Vec<Constraint>,
    /// The largest magnitudes of the coordinates.
    reach: DVec3,
}

impl LinearProgram {
    pub fn new(given: &[LinearForm], space: &Aabb) -> Self {
        let turned: Vec<&LinearForm> = given.iter().filter(|form| is_turned(form)).collect();
        Self {
            constraints: constraints(&turned, space, Vec::new()),
            reach: space.min.abs().max(space.max.abs()),
        }
    }

    /// The values of slopes·p, computed with a number of this magnitude added. `None` if this adds nothing to
    /// the box.
    pub fn range(&self, slopes: [Interval; 3], offset: f64) -> Option<Interval> {
        if !is_turned(&LinearForm::new(slopes, Interval::ALL, offset)) {
            return None;
        }
        let direction = DVec3::from_array(slopes.map(|slope| 0.5 * (slope.lo + slope.hi)));
        let (hi, lo) = (largest(&self.constraints, direction)?, -largest(&self.constraints, -direction)?);
        // the slopes are not exactly the direction, and programs round their sum
        let error = DVec3::from_array(slopes.map(|slope| slope.width().next_up()));
        let rounding = 4.0 * f64::EPSILON * (direction.abs().dot(self.reach) + offset);
        let slack = error.dot(self.reach) + rounding;
        (lo - slack <= hi + slack).then_some(Interval { lo: lo - slack, hi: hi + slack })
    }
}

/// Finds the smallest box around the points of a box that remain under forms of their distance from an
/// origin. False if no point remains.
pub fn contract_linear_around(origin: DVec3, forms: &[LinearForm], space: &mut Aabb) -> bool {
    // a single form has already cut off what it can
    if forms.len() < 2 {
        return true;
    }
    // the differences are rounded
    let slack = 4.0 * f64::EPSILON * (space.min.abs().max(space.max.abs()) + origin.abs());
    let mut local = Aabb::new(space.min - origin - slack, space.max - origin + slack);
    if !contract_linear(forms, &mut local) {
        return false;
    }
    let left = Aabb::new(local.min + origin - slack, local.max + origin + slack).intersection(space);
    *space = left;
    !left.is_empty()
}

/// Finds the smallest box around the points of a box that remain under all forms. False if no point remains.
pub fn contract_linear(forms: &[LinearForm], space: &mut Aabb) -> bool {
    let turned: Vec<&LinearForm> = forms.iter().filter(|form| is_turned(form)).collect();
    if turned.is_empty() {
        return true;
    }
    let mut known = constraints(&turned, space, Vec::new());
    for _ in 0..MOST_ROUNDS {
        let before = *space;
        for axis in 0..3 {
            for upper in [true, false] {
                let direction = DVec3::AXES[axis] * if upper { 1.0 } else { -1.0 };
                let Some(most) = largest(&known, direction) else { continue };
                if upper && most < space.max[axis] {
                    space.max[axis] = most;
                } else if !upper && -most > space.min[axis] {
                    space.min[axis] = -most;
                } else {
                    continue;
                }
                known = constraints(&turned, space, known);
                if space.min[axis] > space.max[axis] {
                    return false;
                }
            }
        }
        if !is_smaller(space, &before) {
            break;
        }
    }
    true
}

/// Whether a side has become shorter by a hundredth.
fn is_smaller(now: &Aabb, before: &Aabb) -> bool {
    (0..3).any(|axis| now.size()[axis] < 0.99 * before.size()[axis])
}

/// Whether a form depends on more than one coordinate. Other forms are already part of the box.
fn is_turned(form: &LinearForm) -> bool {
    let is_known = form.slopes.iter().all(|slope| slope.lo.is_finite() && slope.hi.is_finite());
    is_known && form.slopes.iter().filter(|&&slope| slope != ZERO).count() > 1
}

/// The sides of the box in the order +x, +y, +z, −x, −y, −z, then both sides of each form. They replace
/// others that are no longer needed.
fn constraints(forms: &[&LinearForm], space: &Aabb, mut out: Vec<Constraint>) -> Vec<Constraint> {
    out.clear();
    out.reserve(6 + 2 * forms.len());
    for (sign, corner) in [(1.0, space.max), (-1.0, -space.min)] {
        for axis in 0..3 {
            let normal = DVec3::AXES[axis] * sign;
            out.push(Constraint::new(normal.to_array().map(Interval::point), corner[axis], normal));
        }
    }
    let reach = space.min.abs().max(space.max.abs());
    for form in forms {
        let normal = DVec3::from_array(form.slopes.map(|slope| 0.5 * (slope.lo + slope.hi)));
        // programs round the sum of three products and a number
        let rounding = 4.0 * f64::EPSILON * (normal.abs().dot(reach) + form.offset);
        if form.range.hi.is_finite() {
            out.push(Constraint::new(form.slopes, form.range.hi + rounding, normal));
        }
        if form.range.lo.is_finite() {
            let slopes = form.slopes.map(|slope| -slope);
            out.push(Constraint::new(slopes, rounding - form.range.lo, -normal));
        }
    }
    out
}

/// A bound of direction·p under constraints, the first six of which are a box.
fn largest(constraints: &[Constraint], direction: DVec3) -> Option<f64> {
    let mut basis: [usize; 3] =
        std::array::from_fn(|axis| if direction[axis] < 0.0 { axis + 3 } else { axis });
    for _ in 0..MOST_PIVOTS {
        let inverse = inverse_of(constraints, basis)?;
        let multipliers = (inverse * direction).max(DVec3::ZERO);
        let Some(entering) = most_violated(constraints, basis, &inverse) else { break };
        let weights = inverse * constraints[entering].normal;
        let leaving = (0..3)
            .filter(|&i| weights[i] > 1e-12)
            .min_by(|&i, &j| (multipliers[i] / weights[i]).total_cmp(&(multipliers[j] / weights[j])))?;
        basis[leaving] = entering;
    }
    let multipliers = inverse_of(constraints, basis)? * direction;
    proven(constraints, basis, multipliers.max(DVec3::ZERO), direction)
}

fn inverse_of(constraints: &[Constraint], basis: [usize; 3]) -> Option<DMat3> {
    let [a, b, c] = basis.map(|i| &constraints[i]);
    let matrix = DMat3::from_cols(a.normal, b.normal, c.normal);
    let scale = a.length * b.length * c.length;
    (matrix.determinant().abs() > 1e-10 * scale).then(|| matrix.inverse())
}

/// The constraint that the vertex of a basis violates most, if it violates one.
fn most_violated(constraints: &[Constraint], basis: [usize; 3], inverse: &DMat3) -> Option<usize> {
    let bounds = basis.map(|i| constraints[i].most);
    let mut worst = (0.0, None);
    for (i, constraint) in constraints.iter().enumerate().filter(|(i, _)| !basis.contains(i)) {
        let weights = inverse * constraint.normal;
        let size = weights.abs().max_element();
        let (mut rest, mut scale) = (constraint.most, constraint.most.abs());
        for k in 0..3 {
            if weights[k].abs() > 1e-12 * size {
                rest -= weights[k] * bounds[k];
                scale += (weights[k] * bounds[k]).abs();
            }
        }
        let rest = rest / constraint.length;
        if rest < worst.0 && rest * constraint.length < -1e-11 * scale {
            worst = (rest, Some(i));
        }
    }
    worst.1
}

/// The bound that multipliers prove: Σ λb, plus the worst effect in the box of their error in the direction.
fn proven(
    constraints: &[Constraint],
    basis: [usize; 3],
    multipliers: DVec3,
    direction: DVec3,
) -> Option<f64> {
    let mut bound = ZERO;
    let mut missing = direction.to_array().map(Interval::point);
    for (i, multiplier) in basis.into_iter().zip(multipliers.to_array()) {
        if multiplier == 0.0 {
            continue;
        }
        let multiplier = Interval::point(multiplier);
        bound = plus(bound, scaled(multiplier, Interval::point(constraints[i].most)));
        for (missing, slope) in missing.iter_mut().zip(constraints[i].slopes) {
            if slope != ZERO {
                *missing = plus(*missing, -scaled(multiplier, slope));
            }
        }
    }
    for (axis, missing) in missing.into_iter().enumerate() {
        if missing != ZERO {
            let side = Interval { lo: -constraints[axis + 3].most, hi: constraints[axis].most };
            bound = plus(bound, missing * side);
        }
    }
    (!bound.hi.is_nan()).then_some(bound.hi)
}

/// A product that is exact for a factor of 1.
fn scaled(factor: Interval, a: Interval) -> Interval {
    if factor == Interval::point(1.0) { a } else { factor * a }
}
