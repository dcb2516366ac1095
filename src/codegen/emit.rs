//! One operation of the graph → Cranelift instructions on a 128-bit vector of lanes.
//!
//! Traps that shape this file: `fmin`/`fmax` cost seven instructions, a comparison with `bitselect` is recognised
//! as the single `min`/`max` instruction; a scalar float `select` becomes a jump, so single points use vectors too;
//! `fma` is never emitted, because results must not depend on the processor.

use std::collections::HashMap;

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, Type, Value, types};
use cranelift_frontend::FunctionBuilder;

use super::Precision;
use crate::ir::{Binary, Node, Unary, r0};

/// Emits operations into one function.
pub(super) struct Emitter<'a, 'f> {
    pub builder: &'a mut FunctionBuilder<'f>,
    pub precision: Precision,
    /// Intermediate results of R₀ for a pair of operands: value and weights share them.
    parts: HashMap<(Node, Node, bool), Parts>,
}

/// A node's number, and the value that holds it.
pub(super) type Operand = (Node, Value);

#[derive(Clone, Copy)]
struct Parts {
    min: Value,
    max: Value,
    sum: Value,
    h: Value,
    small: Value,
    denominator: Value,
    /// The masks u < v and u > v: at a tie neither, and both operands get the same weight.
    less: Value,
    greater: Value,
    tau: Option<Value>,
}

impl<'a, 'f> Emitter<'a, 'f> {
    pub fn new(builder: &'a mut FunctionBuilder<'f>, precision: Precision) -> Self {
        Self { builder, precision, parts: HashMap::new() }
    }

    pub fn lane_type(&self) -> Type {
        match self.precision {
            Precision::F32 => types::F32,
            Precision::F64 => types::F64,
        }
    }

    pub fn vector_type(&self) -> Type {
        match self.precision {
            Precision::F32 => types::F32X4,
            Precision::F64 => types::F64X2,
        }
    }

    pub fn constant(&mut self, value: f64) -> Value {
        let scalar = match self.precision {
            Precision::F32 => self.builder.ins().f32const(value as f32),
            Precision::F64 => self.builder.ins().f64const(value),
        };
        let vector = self.vector_type();
        self.builder.ins().splat(vector, scalar)
    }

    pub fn unary(&mut self, op: Unary, a: Value, host: Option<FuncRef>) -> Value {
        if let Some(host) = host {
            return self.call(host, &[a]);
        }
        match op {
            Unary::Neg => self.builder.ins().fneg(a),
            Unary::Abs => self.builder.ins().fabs(a),
            Unary::Sqrt => self.builder.ins().sqrt(a),
            Unary::Sign => self.sign(a),
            // the others have a host function
            _ => self.constant(f64::NAN),
        }
    }

    pub fn binary(&mut self, op: Binary, (u, a): Operand, (v, b): Operand, host: Option<FuncRef>) -> Value {
        if let Some(host) = host {
            return self.call(host, &[a, b]);
        }
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
            Binary::Min => self.ordered(FloatCC::LessThan, a, b),
            Binary::Max => self.ordered(FloatCC::GreaterThan, a, b),
            Binary::MinWeight => self.tie_weight(FloatCC::LessThan, a, b),
            Binary::MaxWeight => self.tie_weight(FloatCC::GreaterThan, a, b),
            Binary::And => self.r0_value((u, a), (v, b), false),
            Binary::Or => self.r0_value((u, a), (v, b), true),
            Binary::AndWeight => self.r0_weight((u, a), (v, b), false),
            Binary::OrWeight => self.r0_weight((u, a), (v, b), true),
            // the others have a host function
            Binary::Pow | Binary::Atan2 => self.constant(f64::NAN),
        }
    }

    /// A mask of all ones in the lanes where the comparison holds, as a vector of floats.
    fn compare(&mut self, condition: FloatCC, a: Value, b: Value) -> Value {
        let mask = self.builder.ins().fcmp(condition, a, b);
        let vector = self.vector_type();
        self.builder.ins().bitcast(vector, MemFlagsData::new().with_endianness(ENDIANNESS), mask)
    }

    fn select(&mut self, mask: Value, yes: Value, no: Value) -> Value {
        self.builder.ins().bitselect(mask, yes, no)
    }

    /// a > b ? a : b, one instruction.
    fn max(&mut self, a: Value, b: Value) -> Value {
        let greater = self.compare(FloatCC::GreaterThan, a, b);
        self.select(greater, a, b)
    }

    /// As `ir` defines min and max: never a number for a NaN.
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

    /// The parts of u ∧ v, or of ¬u ∧ ¬v for a disjunction: see `ir::r0`, whose operations these are.
    fn r0_parts(&mut self, (u, a): Operand, (v, b): Operand, dual: bool) -> Parts {
        if let Some(parts) = self.parts.get(&(u, v, dual)) {
            return *parts;
        }
        let (a, b) = if dual { (self.builder.ins().fneg(a), self.builder.ins().fneg(b)) } else { (a, b) };
        let less = self.compare(FloatCC::LessThan, a, b);
        let min = self.select(less, a, b);
        let greater = self.compare(FloatCC::GreaterThan, a, b);
        let max = self.select(greater, a, b);
        let sum = self.builder.ins().fadd(a, b);
        let minus_min = self.builder.ins().fneg(min);
        let magnitude = self.max(max, minus_min);
        let (a2, b2) = (self.builder.ins().fmul(a, a), self.builder.ins().fmul(b, b));
        let squares = self.builder.ins().fadd(a2, b2);
        let root = self.builder.ins().sqrt(squares);
        let h = self.max(root, magnitude);
        let zero = self.constant(0.0);
        let small = self.compare(FloatCC::GreaterThan, sum, zero);
        let denominator = self.builder.ins().fadd(magnitude, h);
        let parts = Parts { min, max, sum, h, small, denominator, less, greater, tau: None };
        self.parts.insert((u, v, dual), parts);
        parts
    }

    /// The parts for operands in the order in which they were met first, and whether that is the other order.
    fn shared_parts(&mut self, u: Operand, v: Operand, dual: bool) -> (Parts, bool) {
        if self.parts.contains_key(&(v.0, u.0, dual)) && u.0 != v.0 {
            (self.r0_parts(v, u, dual), true)
        } else {
            (self.r0_parts(u, v, dual), false)
        }
    }

    fn r0_value(&mut self, u: Operand, v: Operand, dual: bool) -> Value {
        let (p, _) = self.shared_parts(u, v, dual);
        let ratio = self.builder.ins().fdiv(p.min, p.denominator);
        let correction = self.builder.ins().fmul(p.min, ratio);
        let near = self.builder.ins().fsub(p.min, correction);
        let far = self.builder.ins().fsub(p.sum, p.h);
        let value = self.select(p.small, near, far);
        if dual { self.builder.ins().fneg(value) } else { value }
    }

    /// ∂/∂u, where u is the first operand.
    fn r0_weight(&mut self, u: Operand, v: Operand, dual: bool) -> Value {
        let (p, swapped) = self.shared_parts(u, v, dual);
        let key = if swapped { (v.0, u.0, dual) } else { (u.0, v.0, dual) };
        let tau = match p.tau {
            Some(tau) => tau,
            None => {
                let tau = self.r0_tau(p);
                self.parts.insert(key, Parts { tau: Some(tau), ..p });
                tau
            }
        };
        let one = self.constant(1.0);
        let square = self.builder.ins().fmul(tau, tau);
        let below = self.builder.ins().fadd(one, square);
        let scale = self.builder.ins().fdiv(one, below);
        let rest = self.builder.ins().fsub(one, tau);
        let rest_square = self.builder.ins().fmul(rest, rest);
        let lesser = self.builder.ins().fmul(rest_square, scale);
        let factor = self.select(p.small, square, one);
        let twice = self.builder.ins().fadd(scale, scale);
        let greater = self.builder.ins().fmul(factor, twice);
        // u has the lesser weight where small == (u < v)
        let u_less = if swapped { p.greater } else { p.less };
        let differs = self.builder.ins().bxor(p.small, u_less);
        self.select(differs, greater, lesser)
    }

    fn r0_tau(&mut self, p: Parts) -> Value {
        let top = self.select(p.small, p.min, p.max);
        let tau = self.builder.ins().fdiv(top, p.denominator);
        let zero = self.constant(0.0);
        let singular = self.compare(FloatCC::Equal, p.denominator, zero);
        let at_corner = self.constant(-r0::SINGULAR_TAU);
        self.select(singular, at_corner, tau)
    }

    /// A host function, lane by lane.
    fn call(&mut self, function: FuncRef, operands: &[Value]) -> Value {
        let mut result = None;
        for lane in 0..self.precision.lanes() as u8 {
            let arguments: Vec<Value> =
                operands.iter().map(|&v| self.builder.ins().extractlane(v, lane)).collect();
            let call = self.builder.ins().call(function, &arguments);
            let value = self.builder.inst_results(call)[0];
            result = Some(match result {
                None => {
                    let vector = self.vector_type();
                    self.builder.ins().scalar_to_vector(vector, value)
                }
                Some(so_far) => self.builder.ins().insertlane(so_far, value, lane),
            });
        }
        match result {
            Some(value) => value,
            None => self.constant(f64::NAN),
        }
    }
}

/// Only the byte order of a bitcast between lanes of one width, where it does not matter.
const ENDIANNESS: cranelift_codegen::ir::Endianness = cranelift_codegen::ir::Endianness::Little;
