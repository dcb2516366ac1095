//! R₀ in its forms: the operations of `ir::r0`, bit for bit.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, Value};

use super::emitter::{Emitter, Junction, Operand, R0Parts};
use crate::ir::{Form, r0};

impl Emitter<'_, '_> {
    pub fn r0_value(&mut self, u: Operand, v: Operand, junction: Junction) -> Value {
        match self.forms.of(u.0, v.0) {
            Form::Stable | Form::Guarded => self.stable_value(u, v, junction),
            Form::Textbook => self.textbook_value(u.1, v.1, junction),
            Form::Scaled => self.scaled_value(u.1, v.1, junction),
        }
    }

    /// ∂/∂u, where u is the first operand.
    pub fn r0_weight(&mut self, u: Operand, v: Operand, junction: Junction) -> Value {
        match self.forms.of(u.0, v.0) {
            Form::Stable | Form::Guarded => self.stable_weight(u, v, junction),
            Form::Textbook => self.textbook_weight(u.1, v.1, junction),
            Form::Scaled => self.scaled_weight(u.1, v.1, junction),
        }
    }

    /// The parts for a pair of operands, by the operations of `ir::r0`. There a disjunction is the dual of a
    /// conjunction; here its signs are included in the formulas, which changes no bit.
    fn r0_parts(&mut self, (u, a): Operand, (v, b): Operand, junction: Junction) -> R0Parts {
        let key = (u, v, junction);
        if let Some(parts) = self.parts.get(&key) {
            return *parts;
        }
        let less = self.compare(FloatCC::LessThan, a, b);
        let greater = self.compare(FloatCC::LessThan, b, a);
        let min = self.select(less, a, b);
        let max = self.select(greater, a, b);
        let sum = self.builder.ins().fadd(a, b);
        let (a1, b1) = (self.abs(a), self.abs(b));
        let magnitude = self.max(a1, b1);
        let (a2, b2) = (self.builder.ins().fmul(a, a), self.builder.ins().fmul(b, b));
        let squares = self.builder.ins().fadd(a2, b2);
        let root = self.builder.ins().sqrt(squares);
        let h = self.max(magnitude, root);
        let zero = self.constant(0.0);
        let (near, far, small) = match junction {
            Junction::And => (min, max, self.compare(FloatCC::LessThan, zero, sum)),
            Junction::Or => (max, min, self.compare(FloatCC::LessThan, sum, zero)),
        };
        let denominator = self.builder.ins().fadd(magnitude, h);
        let mut parts = R0Parts { near, far, sum, h, small, denominator, less, greater, tau: None };
        if self.weighted.contains(&key) {
            parts.tau = Some(self.r0_tau(parts, junction));
        }
        self.parts.insert(key, parts);
        parts
    }

    /// The parts for operands in the order of their first occurrence, and whether that order is reversed.
    fn shared_parts(&mut self, u: Operand, v: Operand, junction: Junction) -> (R0Parts, bool) {
        if u.0 != v.0 && self.parts.contains_key(&(v.0, u.0, junction)) {
            (self.r0_parts(v, u, junction), true)
        } else {
            (self.r0_parts(u, v, junction), false)
        }
    }

    fn stable_value(&mut self, u: Operand, v: Operand, junction: Junction) -> Value {
        let (p, _) = self.shared_parts(u, v, junction);
        let ratio = match p.tau {
            Some(tau) => tau, // the same quotient on the small branch
            None => self.builder.ins().fdiv(p.near, p.denominator),
        };
        let correction = self.builder.ins().fmul(p.near, ratio);
        let (near, far) = match junction {
            Junction::And => {
                (self.builder.ins().fsub(p.near, correction), self.builder.ins().fsub(p.sum, p.h))
            }
            Junction::Or => {
                (self.builder.ins().fadd(p.near, correction), self.builder.ins().fadd(p.sum, p.h))
            }
        };
        self.select(p.small, near, far)
    }

    fn r0_tau(&mut self, p: R0Parts, junction: Junction) -> Value {
        let top = self.select(p.small, p.near, p.far);
        let tau = self.builder.ins().fdiv(top, p.denominator);
        let zero = self.constant(0.0);
        let singular = self.compare(FloatCC::Equal, p.denominator, zero);
        let at_corner = self.constant(match junction {
            Junction::And => -r0::SINGULAR_TAU,
            Junction::Or => r0::SINGULAR_TAU,
        });
        self.select(singular, at_corner, tau)
    }

    /// ∂/∂u, where u is the first operand.
    fn stable_weight(&mut self, u: Operand, v: Operand, junction: Junction) -> Value {
        let (p, swapped) = self.shared_parts(u, v, junction);
        let tau = match p.tau {
            Some(tau) => tau,
            None => self.r0_tau(p, junction),
        };
        let (lesser, greater) = self.weights_of_tau(tau, p.small, junction);
        // u has the smaller weight where small == (u is the near operand)
        let u_is_near = match (junction, swapped) {
            (Junction::And, false) | (Junction::Or, true) => p.less,
            (Junction::And, true) | (Junction::Or, false) => p.greater,
        };
        let differs = self.builder.ins().bxor(p.small, u_is_near);
        self.select(differs, greater, lesser)
    }

    /// (weight of m, weight of M) from τ with the sign of the branch.
    fn weights_of_tau(&mut self, tau: Value, small: Value, junction: Junction) -> (Value, Value) {
        let one = self.constant(1.0);
        let square = self.builder.ins().fmul(tau, tau);
        let below = self.builder.ins().fadd(one, square);
        let scale = self.builder.ins().fdiv(one, below);
        let rest = match junction {
            Junction::And => self.builder.ins().fsub(one, tau),
            Junction::Or => self.builder.ins().fadd(one, tau),
        };
        let rest_square = self.builder.ins().fmul(rest, rest);
        let lesser = self.builder.ins().fmul(rest_square, scale);
        let factor = self.select(small, square, one);
        let twice = self.builder.ins().fadd(scale, scale);
        let greater = self.builder.ins().fmul(factor, twice);
        (lesser, greater)
    }

    /// u + v ∓ √(u² + v²) as printed in every textbook. It loses all digits of a small result of large
    /// operands.
    fn textbook_value(&mut self, a: Value, b: Value, junction: Junction) -> Value {
        let sum = self.builder.ins().fadd(a, b);
        let h = self.hypotenuse(a, b);
        match junction {
            Junction::And => self.builder.ins().fsub(sum, h),
            Junction::Or => self.builder.ins().fadd(sum, h),
        }
    }

    /// 1 ∓ u/√(u² + v²), NaN at a corner.
    fn textbook_weight(&mut self, a: Value, b: Value, junction: Junction) -> Value {
        let h = self.hypotenuse(a, b);
        let one = self.constant(1.0);
        let cosine = self.builder.ins().fdiv(a, h);
        match junction {
            Junction::And => self.builder.ins().fsub(one, cosine),
            Junction::Or => self.builder.ins().fadd(one, cosine),
        }
    }

    fn hypotenuse(&mut self, a: Value, b: Value) -> Value {
        // in one order for both, so that the weights of both operands share the root
        let (a, b) = if a.as_u32() <= b.as_u32() { (a, b) } else { (b, a) };
        let (a2, b2) = (self.builder.ins().fmul(a, a), self.builder.ins().fmul(b, b));
        let squares = self.builder.ins().fadd(a2, b2);
        self.builder.ins().sqrt(squares)
    }

    /// The operations of `ir::r0::and_scaled`. Only the ratio q = m/M is squared, which avoids needless
    /// overflow.
    fn scaled(&mut self, a: Value, b: Value, junction: Junction) -> Scaled {
        let less = self.compare(FloatCC::LessThan, a, b);
        let greater = self.compare(FloatCC::LessThan, b, a);
        // one comparison for both, so that a NaN stays one of the two
        let (min, max) = (self.select(less, a, b), self.select(less, b, a));
        let sum = self.builder.ins().fadd(a, b);
        let (zero, one) = (self.constant(0.0), self.constant(1.0));
        let (near, far, small) = match junction {
            Junction::And => (min, max, self.compare(FloatCC::LessThan, zero, sum)),
            Junction::Or => (max, min, self.compare(FloatCC::LessThan, sum, zero)),
        };
        // on the small branch the operand close to the result is the smaller in magnitude
        let (m, big) = (self.select(small, near, far), self.select(small, far, near));
        let ratio = self.builder.ins().fdiv(m, big);
        // exact at a tie, and a number at 0/0 and ∞/∞
        let tie = self.compare(FloatCC::Equal, m, big);
        let q = self.select(tie, one, ratio);
        let q2 = self.builder.ins().fmul(q, q);
        let below = self.builder.ins().fadd(one, q2);
        let k = self.builder.ins().sqrt(below);
        let k1 = self.builder.ins().fadd(one, k);
        let tau = self.builder.ins().fdiv(q, k1);
        Scaled { m, big, q, k1, tau, small, less, greater }
    }

    fn scaled_value(&mut self, a: Value, b: Value, junction: Junction) -> Value {
        let s = self.scaled(a, b, junction);
        let correction = self.builder.ins().fmul(s.m, s.tau);
        let near = self.builder.ins().fsub(s.m, correction);
        let factor = self.builder.ins().fadd(s.k1, s.q);
        let far = self.builder.ins().fmul(s.big, factor);
        self.select(s.small, near, far)
    }

    fn scaled_weight(&mut self, a: Value, b: Value, junction: Junction) -> Value {
        let s = self.scaled(a, b, junction);
        // with the signs of the operands, τ has the form that `weights_of_tau` expects for ∧
        let turned = self.negate(s.tau);
        let tau = self.select(s.small, s.tau, turned);
        let (lesser, greater) = self.weights_of_tau(tau, s.small, Junction::And);
        let u_is_near = match junction {
            Junction::And => s.less,
            Junction::Or => s.greater,
        };
        let differs = self.builder.ins().bxor(s.small, u_is_near);
        self.select(differs, greater, lesser)
    }
}

/// Intermediate results of the scaled form.
struct Scaled {
    m: Value,
    big: Value,
    q: Value,
    /// 1 + √(1 + q²)
    k1: Value,
    tau: Value,
    small: Value,
    less: Value,
    greater: Value,
}
