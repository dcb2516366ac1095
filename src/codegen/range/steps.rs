//! Ranges of functions that jump: shares, weights of R₀, steps. If the range of a derivative is wanted, the
//! function itself must not jump, or the mean value theorem does not hold.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, Value};

use super::instructions::{Instruction, RangeBinary, RangeUnary};
use super::{BoundLane, Ranges};
use crate::ir::{SQUARES_OVERFLOW, SQUARES_UNDERFLOW, WEIGHT_ROUNDING};

impl Ranges<'_, '_> {
    /// From 0 to 1, or one of them where the ranges do not overlap.
    pub(super) fn share(&mut self, a: Value, b: Value) -> Value {
        let turned = self.swap(b);
        // b.hi − a.lo and a.hi − b.lo, whose signs are exact
        let gaps = self.fadd(a, turned);
        let zero = self.emitter.constant(0.0);
        let [b_is_less, a_is_less] = [BoundLane::Low, BoundLane::High].map(|lane| {
            let gap = self.both(gaps, lane);
            self.emitter.compare(FloatCC::LessThan, gap, zero)
        });
        let (any, all) = (self.pair(0.0, 1.0), self.pair(-1.0, 1.0));
        let share = self.emitter.select(a_is_less, all, any);
        self.emitter.select(b_is_less, zero, share)
    }

    /// 1 − u/√(u² + v²), the derivative of u ∧ v by u: it falls with u, and grows with |v| where u is
    /// positive. With −u and −v it is that of u ∨ v. Also returns a mask of where it may jump.
    pub(super) fn weight(&mut self, u: Value, v: Value) -> (Value, Value) {
        let (sizes_u, sizes_v) = (self.magnitudes(u), self.magnitudes(v));
        let (zero, one) = (self.emitter.constant(0.0), self.emitter.constant(1.0));
        // u.hi for the least weight, u.lo for the greatest
        let turned = self.flip(u, BoundLane::Low);
        let ends = self.swap(turned);
        let [near, far] = [BoundLane::Low, BoundLane::High].map(|lane| self.both(sizes_v, lane));
        let near = self.emitter.negate(near);
        let is_positive = self.emitter.compare(FloatCC::LessThan, zero, ends);
        let least_v = self.emitter.select(is_positive, near, far);
        let most_v = self.emitter.select(is_positive, far, near);
        let beside = self.lanes(least_v, most_v);
        let (a, b) = (self.fmul(ends, ends), self.fmul(beside, beside));
        let squares = self.fadd(a, b);
        let root = self.emitter.builder.ins().sqrt(squares);
        let share = self.emitter.builder.ins().fdiv(ends, root);
        let weights = self.emitter.builder.ins().fsub(one, share);
        let weights = self.flip(weights, BoundLane::Low);
        let margin = self.emitter.constant(WEIGHT_ROUNDING);
        let wide = self.fadd(weights, margin);
        let limit = self.pair(0.0, 2.0_f64.next_up());
        let within = self.min(wide, limit);

        // [−nearest, farthest] of both
        let (less, more) = (self.min(sizes_u, sizes_v), self.emitter.max(sizes_u, sizes_v));
        let reach = self.lanes(less, more);
        let allowed = self.pair(-SQUARES_UNDERFLOW, SQUARES_OVERFLOW);
        let is_known = self.emitter.compare(FloatCC::LessThan, reach, allowed);
        let turned = self.swap(is_known);
        let is_known = self.emitter.builder.ins().band(is_known, turned);
        (self.emitter.select(is_known, within, limit), self.emitter.builder.ins().bnot(is_known))
    }

    /// A mask: ones where a range holds more than one number.
    fn varies(&mut self, range: Value) -> Value {
        let turned = self.swap(range);
        let width = self.fadd(range, turned);
        let zero = self.emitter.constant(0.0);
        self.emitter.compare(FloatCC::NotEqual, width, zero)
    }

    /// One of the two values where its share is 1 or 0, otherwise the hull of both.
    pub(super) fn choice(&mut self, [a, b]: [Value; 2], share: Value) -> Value {
        let [least, most] = [BoundLane::Low, BoundLane::High].map(|lane| self.both(share, lane));
        let (zero, minus_one) = (self.emitter.constant(0.0), self.emitter.constant(-1.0));
        let is_first = self.emitter.compare(FloatCC::LessThanOrEqual, least, minus_one);
        let is_second = self.emitter.compare(FloatCC::LessThanOrEqual, most, zero);
        // both lanes grow with the range
        let hull = self.emitter.max(a, b);
        let other = self.emitter.select(is_second, b, hull);
        self.emitter.select(is_first, a, other)
    }

    /// Ensures that there is no answer where a node may jump.
    pub(super) fn forbid_jumps(&mut self, instruction: Instruction, value: Value) {
        match instruction {
            Instruction::Unary(RangeUnary::Sign | RangeUnary::Floor | RangeUnary::Round, _)
            | Instruction::Share(..) => {
                let steps = self.varies(value);
                self.fail_where(steps);
            }
            // a choice that is not decided
            Instruction::Binary(RangeBinary::MulOrZero, _, b) => {
                let b = self.values[&b];
                let (is_open, turned) = (self.varies(b), self.swap(b));
                let nearest = self.min(b, turned);
                let nearest = self.min_of_lanes(nearest);
                let zero = self.emitter.constant(0.0);
                let holds_zero = self.emitter.compare(FloatCC::LessThanOrEqual, zero, nearest);
                let open = self.emitter.builder.ins().band(is_open, holds_zero);
                self.fail_where(open);
            }
            Instruction::Binary(RangeBinary::Atan2, a, b) => {
                let (_, jumps) = self.atan2(self.values[&a], self.values[&b]);
                self.fail_where(jumps);
            }
            Instruction::Binary(RangeBinary::AndWeight | RangeBinary::OrWeight, a, b) => {
                let (_, jumps) = self.weight(self.values[&a], self.values[&b]);
                self.fail_where(jumps);
            }
            // continuous, or without an answer at jumps
            Instruction::Unary(
                RangeUnary::Neg | RangeUnary::Abs | RangeUnary::Sqrt | RangeUnary::Atan,
                _,
            )
            | Instruction::Binary(
                RangeBinary::Add
                | RangeBinary::Sub
                | RangeBinary::Mul
                | RangeBinary::Min
                | RangeBinary::Max
                | RangeBinary::And
                | RangeBinary::Or,
                ..,
            )
            | Instruction::Constant(_)
            | Instruction::Coordinate(_)
            | Instruction::Parameter(_)
            | Instruction::Uniform(_)
            | Instruction::Square(_)
            | Instruction::Slab { .. }
            | Instruction::Divide(..)
            | Instruction::Quotient(..)
            | Instruction::Call(..)
            // its share must not be open
            | Instruction::Choice { .. } => {}
        }
    }

    /// The smaller lane in both.
    fn min_of_lanes(&mut self, v: Value) -> Value {
        let turned = self.swap(v);
        self.min(v, turned)
    }
}
