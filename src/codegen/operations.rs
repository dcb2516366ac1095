//! One operation of the graph → instructions.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, Value};

use super::emitter::{Emitter, Junction, Operand};
use super::host_functions::HostFunction;
use crate::ir::{Binary, Unary};

impl Emitter<'_, '_> {
    pub fn unary(&mut self, op: Unary, a: Value) -> Value {
        match op {
            Unary::Neg => self.negate(a),
            Unary::Abs => self.abs(a),
            Unary::Sqrt => self.builder.ins().sqrt(a),
            Unary::Sign => self.sign(a),
            Unary::Floor => self.builder.ins().floor(a),
            Unary::Round => self.builder.ins().nearest(a),
            Unary::Call(function) => self.call(HostFunction::Unary(function), &[a]),
        }
    }

    pub fn binary(&mut self, op: Binary, (u, a): Operand, (v, b): Operand) -> Value {
        match op {
            Binary::Add => self.builder.ins().fadd(a, b),
            Binary::Sub => self.builder.ins().fsub(a, b),
            Binary::Mul => self.builder.ins().fmul(a, b),
            Binary::Div => self.builder.ins().fdiv(a, b),
            Binary::DivOrZero => {
                let zero = self.constant(0.0);
                let is_zero = self.compare(FloatCC::Equal, b, zero);
                let quotient = self.builder.ins().fdiv(a, b);
                self.select(is_zero, zero, quotient)
            }
            Binary::MulOrZero => {
                let zero = self.constant(0.0);
                let is_zero = self.compare(FloatCC::Equal, b, zero);
                let product = self.builder.ins().fmul(a, b);
                self.select(is_zero, zero, product)
            }
            Binary::Min => self.ordered(FloatCC::LessThan, a, b),
            Binary::Max => self.ordered(FloatCC::GreaterThan, a, b),
            Binary::PlainMin => {
                let less = self.compare(FloatCC::LessThan, a, b);
                self.select(less, a, b)
            }
            Binary::PlainMax => self.max(a, b),
            Binary::MinWeight => self.tie_weight(FloatCC::LessThan, a, b),
            Binary::MaxWeight => self.tie_weight(FloatCC::GreaterThan, a, b),
            Binary::And => self.r0_value((u, a), (v, b), Junction::And),
            Binary::Or => self.r0_value((u, a), (v, b), Junction::Or),
            Binary::AndWeight => self.r0_weight((u, a), (v, b), Junction::And),
            Binary::OrWeight => self.r0_weight((u, a), (v, b), Junction::Or),
            Binary::Call(function) => self.call(HostFunction::Binary(function), &[a, b]),
        }
    }

    /// Min or max as `ir` defines them: NaN if an operand is NaN.
    fn ordered(&mut self, condition: FloatCC, a: Value, b: Value) -> Value {
        let first = self.compare(condition, a, b);
        let is_number = self.compare(FloatCC::Equal, a, a);
        let other = self.select(is_number, b, a);
        self.select(first, a, other)
    }

    fn tie_weight(&mut self, condition: FloatCC, a: Value, b: Value) -> Value {
        let (zero, half, one) = (self.constant(0.0), self.constant(0.5), self.constant(1.0));
        let tie = self.compare(FloatCC::Equal, a, b);
        let other = self.select(tie, half, zero);
        let first = self.compare(condition, a, b);
        self.select(first, one, other)
    }

    fn sign(&mut self, a: Value) -> Value {
        let (zero, one, minus_one) = (self.constant(0.0), self.constant(1.0), self.constant(-1.0));
        let negative = self.compare(FloatCC::LessThan, a, zero);
        let other = self.select(negative, minus_one, a);
        let positive = self.compare(FloatCC::GreaterThan, a, zero);
        self.select(positive, one, other)
    }
}
