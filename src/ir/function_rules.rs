//! What every analysis needs to know of a function of the mathematical library, all in one place.
//!
//! For f(a): the derivative as nodes of a graph, the range over an interval, f′ and ½f″ over an interval, the
//! error that f hands on from its operand, and its true value.

use super::bounds::upper::{add, div, magnitude, mul, smallest_magnitude};
use crate::interval::Interval;
use crate::ir::exact::big::{Big, number, one};
use crate::ir::function::{BinaryFunction, UnaryFunction};
use crate::ir::graph::{Graph, Node};
use crate::ir::op::{Binary, Unary};

/// What is multiplied by the derivative of f(a): the factor, the operand a, and the node f(a).
#[derive(Debug, Clone, Copy)]
pub(super) struct Chain {
    pub adjoint: Node,
    pub operand: Node,
    pub value: Node,
}

impl UnaryFunction {
    /// adjoint · f′(a)
    pub(super) fn derivative(self, graph: &mut Graph, chain: Chain) -> Node {
        use Binary::{Add, Div, DivOrZero, Mul, Sub};
        let Chain { adjoint, operand: a, value } = chain;
        match self {
            Self::Sin => {
                let cos = graph.unary(Unary::Call(Self::Cos), a);
                graph.binary(Mul, adjoint, cos)
            }
            Self::Cos => {
                let sin = graph.unary(Unary::Call(Self::Sin), a);
                let product = graph.binary(Mul, adjoint, sin);
                graph.unary(Unary::Neg, product)
            }
            // 1 + tan²
            Self::Tan => {
                let one = graph.constant(1.0);
                let square = graph.binary(Mul, value, value);
                let factor = graph.binary(Add, one, square);
                graph.binary(Mul, adjoint, factor)
            }
            // ±1/√(1 − a²)
            Self::Asin | Self::Acos => {
                let one = graph.constant(1.0);
                let square = graph.binary(Mul, a, a);
                let rest = graph.binary(Sub, one, square);
                let root = graph.unary(Unary::Sqrt, rest);
                let quotient = graph.binary(DivOrZero, adjoint, root);
                if self == Self::Asin { quotient } else { graph.unary(Unary::Neg, quotient) }
            }
            Self::Atan => {
                let one = graph.constant(1.0);
                let square = graph.binary(Mul, a, a);
                let sum = graph.binary(Add, one, square);
                graph.binary(Div, adjoint, sum)
            }
            Self::Exp => graph.binary(Mul, adjoint, value),
            Self::Ln => graph.binary(Div, adjoint, a),
            Self::Log2 | Self::Log10 => {
                let quotient = graph.binary(Div, adjoint, a);
                let factor = graph.constant(self.per_ln());
                graph.binary(Mul, quotient, factor)
            }
            Self::Sinh => {
                let cosh = graph.unary(Unary::Call(Self::Cosh), a);
                graph.binary(Mul, adjoint, cosh)
            }
            Self::Cosh => {
                let sinh = graph.unary(Unary::Call(Self::Sinh), a);
                graph.binary(Mul, adjoint, sinh)
            }
            // 1 − tanh²
            Self::Tanh => {
                let one = graph.constant(1.0);
                let square = graph.binary(Mul, value, value);
                let factor = graph.binary(Sub, one, square);
                graph.binary(Mul, adjoint, factor)
            }
        }
    }

    /// What a logarithm is per natural logarithm.
    fn per_ln(self) -> f64 {
        match self {
            Self::Log2 => std::f64::consts::LOG2_E,
            Self::Log10 => std::f64::consts::LOG10_E,
            Self::Sin
            | Self::Cos
            | Self::Tan
            | Self::Asin
            | Self::Acos
            | Self::Atan
            | Self::Exp
            | Self::Ln
            | Self::Sinh
            | Self::Cosh
            | Self::Tanh => 1.0,
        }
    }

    /// The range over an interval; all reals where the function may be undefined.
    pub(super) fn range(self, a: Interval) -> Interval {
        match self {
            // an operand that has overflowed has no sine and no cosine
            Self::Sin | Self::Cos if a.lo == f64::NEG_INFINITY || a.hi == f64::INFINITY => Interval::ALL,
            Self::Sin => a.sin(),
            Self::Cos => a.cos(),
            Self::Atan => a.increasing(libm::atan),
            Self::Exp => a.increasing(libm::exp),
            Self::Ln if a.lo > 0.0 => a.increasing(libm::log),
            Self::Log2 if a.lo > 0.0 => a.increasing(libm::log2),
            Self::Log10 if a.lo > 0.0 => a.increasing(libm::log10),
            Self::Sinh => a.increasing(libm::sinh),
            Self::Cosh => a.abs().increasing(libm::cosh),
            Self::Tanh => a.increasing(libm::tanh),
            Self::Asin if a.lo >= -1.0 && a.hi <= 1.0 => a.increasing(libm::asin),
            Self::Acos if a.lo >= -1.0 && a.hi <= 1.0 => (-a).increasing(|x| libm::acos(-x)),
            Self::Tan if a.lo > -1.57 && a.hi < 1.57 => a.increasing(libm::tan),
            Self::Ln | Self::Log2 | Self::Log10 | Self::Asin | Self::Acos | Self::Tan => Interval::ALL,
        }
    }

    /// The bounds of its range, low and high, from those of its operand.
    pub(crate) fn bounds(self, [lo, hi]: [f64; 2]) -> [f64; 2] {
        let found = self.range(Interval::new(lo, hi));
        [found.lo, found.hi]
    }

    /// [f′, ½f″] over an interval, from the operand's range and that of f. `None` for functions without such
    /// a rule: along a path only their range is known.
    pub(super) fn slope_and_bend(self, a: Interval, value: Interval) -> Option<[Interval; 2]> {
        let one = Interval::point(1.0);
        let half = |a: Interval| a * Interval::point(0.5);
        match self {
            Self::Sin => Some([a.cos(), -half(value)]),
            Self::Cos => Some([-a.sin(), -half(value)]),
            Self::Tan => {
                let slope = one + value.square();
                Some([slope, value * slope])
            }
            Self::Atan => {
                let slope = one / (one + a.square());
                Some([slope, -(a * slope.square())])
            }
            Self::Exp => Some([value, half(value)]),
            Self::Ln | Self::Log2 | Self::Log10 => {
                let (slope, factor) = (one / a, Interval::point(self.per_ln()).widened(1));
                Some([slope * factor, -half(slope.square()) * factor])
            }
            Self::Sinh => Some([Self::Cosh.range(a), half(value)]),
            Self::Cosh => Some([Self::Sinh.range(a), half(value)]),
            Self::Tanh => {
                let slope = one - value.square();
                Some([slope, -(value * slope)])
            }
            Self::Asin | Self::Acos => None,
        }
    }

    /// A bound of |f(â) − f(a)| for |â − a| ≤ `error`, both in the interval `a`; `None` where f may be
    /// undefined or is too steep.
    pub(super) fn propagated(self, a: Interval, error: f64) -> Option<f64> {
        match self {
            Self::Sin | Self::Cos | Self::Atan | Self::Tanh => Some(error),
            Self::Tan if magnitude(a) < 1.57 => {
                let steepest = magnitude(a.increasing(libm::tan));
                Some(mul(error, add(1.0, mul(steepest, steepest))))
            }
            Self::Exp => Some(mul(error, a.increasing(libm::exp).hi)),
            Self::Ln if a.lo > 0.0 => Some(div(error, a.lo)),
            Self::Log2 | Self::Log10 if a.lo > 0.0 => Some(mul(div(error, a.lo), self.per_ln().next_up())),
            Self::Sinh => Some(mul(error, magnitude(Self::Cosh.range(a)))),
            Self::Cosh => Some(mul(error, magnitude(Self::Sinh.range(a)))),
            Self::Asin | Self::Acos if magnitude(a) < 1.0 => {
                let rest = (Interval::point(1.0) - a.square()).sqrt();
                Some(div(error, rest.lo))
            }
            Self::Tan | Self::Ln | Self::Log2 | Self::Log10 | Self::Asin | Self::Acos => None,
        }
    }

    /// Whether a value close to the largest number may come out infinite: sinh and cosh are found from eᵃ,
    /// which is twice as large.
    pub(super) fn overflows_early(self) -> bool {
        match self {
            Self::Sinh | Self::Cosh => true,
            Self::Sin | Self::Cos | Self::Tan | Self::Asin | Self::Acos | Self::Atan => false,
            Self::Exp | Self::Ln | Self::Log2 | Self::Log10 | Self::Tanh => false,
        }
    }

    /// Whether its value may be infinite at a finite operand without an overflow. No double lies exactly at a
    /// pole of the tangent.
    pub(super) fn has_pole(self) -> bool {
        match self {
            Self::Ln | Self::Log2 | Self::Log10 => true,
            Self::Sin | Self::Cos | Self::Tan | Self::Asin | Self::Acos | Self::Atan => false,
            Self::Exp | Self::Sinh | Self::Cosh | Self::Tanh => false,
        }
    }

    /// Whether it is undefined at ±∞ though it is defined at all numbers before it.
    pub(super) fn fails_at_infinity(self) -> bool {
        match self {
            Self::Sin | Self::Cos | Self::Tan => true,
            Self::Asin | Self::Acos | Self::Atan | Self::Exp | Self::Ln | Self::Log2 | Self::Log10 => false,
            Self::Sinh | Self::Cosh | Self::Tanh => false,
        }
    }

    /// The true value; `None` where there is none.
    pub(super) fn exact(self, a: &Big) -> Option<Big> {
        let within_one = *a >= -one() && *a <= one();
        match self {
            Self::Sin => Some(a.sin()),
            Self::Cos => Some(a.cos()),
            Self::Tan => Some(a.tan()),
            Self::Asin if within_one => Some(a.asin()),
            Self::Acos if within_one => Some(a.acos()),
            Self::Atan => Some(a.atan()),
            Self::Exp => Some(a.exp()),
            Self::Ln if *a > Big::ZERO => Some(a.ln()),
            Self::Log2 if *a > Big::ZERO => Some(a.ln() / number(2).ln()),
            Self::Log10 if *a > Big::ZERO => Some(a.ln() / number(10).ln()),
            Self::Sinh => {
                let up = a.exp();
                let down = one() / &up;
                Some((up - down) / number(2))
            }
            Self::Cosh => {
                let up = a.exp();
                let down = one() / &up;
                Some((up + down) / number(2))
            }
            Self::Tanh => {
                let square = (a * number(2)).exp();
                Some((&square - one()) / (&square + one()))
            }
            Self::Asin | Self::Acos | Self::Ln | Self::Log2 | Self::Log10 => None,
        }
    }
}

/// What is multiplied by a derivative of f(a, b): the factor, the operands, and the node f(a, b).
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainOfTwo {
    pub adjoint: Node,
    pub operands: [Node; 2],
    pub value: Node,
}

impl BinaryFunction {
    /// Whether its value may be infinite at finite operands without an overflow: 0⁻¹.
    pub(super) fn has_pole(self) -> bool {
        match self {
            Self::Pow => true,
            Self::Atan2 => false,
        }
    }

    /// adjoint · ∂f/∂a, or with `first` unset adjoint · ∂f/∂b.
    pub(super) fn derivative(self, graph: &mut Graph, chain: ChainOfTwo, first: bool) -> Node {
        use Binary::{Add, DivOrZero, Mul, Sub};
        let ChainOfTwo { adjoint, operands: [a, b], value } = chain;
        match self {
            // b·a^(b−1)
            Self::Pow if first => {
                let one = graph.constant(1.0);
                let exponent = graph.binary(Sub, b, one);
                let power = graph.binary(Binary::Call(Self::Pow), a, exponent);
                let factor = graph.binary(Mul, b, power);
                graph.binary(Mul, adjoint, factor)
            }
            // a^b·ln a
            Self::Pow => {
                let ln = graph.unary(Unary::Call(UnaryFunction::Ln), a);
                let factor = graph.binary(Mul, value, ln);
                graph.binary(Mul, adjoint, factor)
            }
            // b/(a² + b²) and −a/(a² + b²)
            Self::Atan2 => {
                let (a2, b2) = (graph.binary(Mul, a, a), graph.binary(Mul, b, b));
                let sum = graph.binary(Add, a2, b2);
                let product = graph.binary(Mul, adjoint, if first { b } else { a });
                let quotient = graph.binary(DivOrZero, product, sum);
                if first { quotient } else { graph.unary(Unary::Neg, quotient) }
            }
        }
    }

    /// The range over two intervals; all reals where the function may be undefined.
    pub(super) fn range(self, a: Interval, b: Interval) -> Interval {
        match self {
            Self::Pow if a.lo > 0.0 => {
                let corners = [(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)];
                let corners = corners.map(|(a, b)| libm::pow(a, b));
                let lo = corners.into_iter().fold(f64::INFINITY, f64::min);
                let hi = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
                Interval::new(lo, hi).widened(4)
            }
            // a fixed power, which grows with |a|
            Self::Pow if b.lo == b.hi && b.lo > 0.0 && (b.lo.fract() == 0.0 || a.lo >= 0.0) => {
                // powers of small numbers are small, and not 0
                let outward = |power: f64, a: f64| match power == 0.0 && a != 0.0 {
                    true => f64::from_bits(1).copysign(power),
                    false => power,
                };
                let at = |a: f64| outward(libm::pow(a, b.lo), a);
                let is_even = b.lo % 2.0 == 0.0;
                let range = if is_even && a.contains(0.0) {
                    Interval::new(0.0, at(a.lo).max(at(a.hi)))
                } else if is_even {
                    // a is negative
                    Interval::new(at(a.hi), at(a.lo))
                } else {
                    Interval::new(at(a.lo), at(a.hi))
                };
                let widened = range.widened(4);
                if range.lo >= 0.0 { Interval { lo: widened.lo.max(0.0), ..widened } } else { widened }
            }
            Self::Pow => Interval::ALL,
            // around the origin, and at the cut behind it
            Self::Atan2 if a.contains(0.0) && b.lo <= 0.0 => {
                Interval::new(-std::f64::consts::PI, std::f64::consts::PI).widened(1)
            }
            // the corners have the extreme angles
            Self::Atan2 => {
                let corners = [(a.lo, b.lo), (a.lo, b.hi), (a.hi, b.lo), (a.hi, b.hi)];
                let corners = corners.map(|(a, b)| libm::atan2(a, b));
                let lo = corners.into_iter().fold(f64::INFINITY, f64::min);
                let hi = corners.into_iter().fold(f64::NEG_INFINITY, f64::max);
                Interval::new(lo.next_down(), hi.next_up()).widened(3)
            }
        }
    }

    /// The bounds of its range, low and high, from those of its operands.
    pub(crate) fn bounds(self, [a_low, a_high]: [f64; 2], [b_low, b_high]: [f64; 2]) -> [f64; 2] {
        let found = self.range(Interval::new(a_low, a_high), Interval::new(b_low, b_high));
        [found.lo, found.hi]
    }

    /// A bound of |f(â, b̂) − f(a, b)| for operands in two intervals that are off by `errors` at most, and
    /// values of f in `range`; `None` where f may be undefined or jumps.
    pub(super) fn propagated(self, [a, b]: [Interval; 2], errors: [f64; 2], range: Interval) -> Option<f64> {
        match self {
            // a^b = exp(b·ln a)
            Self::Pow => {
                if a.lo <= 0.0 {
                    // b·|a|^(b − 1) is the slope of a whole power
                    let is_whole = b.lo == b.hi && b.lo >= 1.0 && b.lo.fract() == 0.0 && errors[1] == 0.0;
                    let largest = libm::pow(add(magnitude(a), errors[0]), b.lo - 1.0).next_up().next_up();
                    return is_whole.then(|| mul(mul(b.lo, largest), errors[0]));
                }
                let logarithm = magnitude(a.increasing(libm::log));
                let change = add(mul(magnitude(b), div(errors[0], a.lo)), mul(logarithm, errors[1]));
                // eᵗ − 1 ≤ t·(1 + t) and eᵗ ≤ 1 + 2t for t ≤ 1
                if change > 1.0 {
                    return None;
                }
                let largest = mul(magnitude(range), add(1.0, mul(2.0, change)));
                Some(mul(largest, mul(change, add(1.0, change))))
            }
            // the gradient is as long as 1/√(a² + b²), away from the cut
            Self::Atan2 => {
                if b.lo <= 0.0 && a.contains(0.0) {
                    return None;
                }
                let squares = smallest_magnitude(a).powi(2) + smallest_magnitude(b).powi(2);
                let distance = squares.sqrt() * (1.0 - 1e-15);
                Some(div(add(errors[0], errors[1]), distance))
            }
        }
    }

    /// The true value; `None` where there is none.
    pub(super) fn exact(self, a: &Big, b: &Big) -> Option<Big> {
        match self {
            Self::Pow if *a > Big::ZERO => Some(a.powf(b)),
            Self::Pow => None,
            Self::Atan2 if *a != Big::ZERO || *b != Big::ZERO => Some(a.atan2(b)),
            Self::Atan2 => Some(Big::ZERO),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Powers of points lie in the ranges of powers, for bases of either sign.
    #[test]
    fn ranges_of_powers_hold_them() {
        let bases = [(-2.0, 3.0), (-3.0, -0.5), (-1.0, 0.0), (0.0, 1.5), (0.25, 4.0), (-0.0, 0.0)];
        let mut bounded = 0;
        for exponent in [1.0, 2.0, 3.0, 66.0, 67.0, 0.5, 2.5, -1.0, -2.0, -0.5] {
            for (lo, hi) in bases {
                let range = BinaryFunction::Pow.range(Interval::new(lo, hi), Interval::point(exponent));
                bounded += usize::from(range != Interval::ALL);
                for i in 0..=64 {
                    let a = lo + (hi - lo) * f64::from(i) / 64.0;
                    let power = libm::pow(a, exponent);
                    let may_be_anything = range == Interval::ALL;
                    assert!(
                        may_be_anything || range.lo <= power && power <= range.hi,
                        "{a}^{exponent}: {range:?}"
                    );
                }
            }
        }
        // whole exponents above 0 over all bases, others over those that are not negative, negative ones over positive ones
        assert_eq!(bounded, 5 * 6 + 2 * 3 + 3);
    }
}
