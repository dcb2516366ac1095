//! One operation of the graph → Cranelift instructions on a 128-bit vector of lanes.
//!
//! Traps that shape this file: `fmin`/`fmax` cost seven instructions, a comparison with `bitselect` is recognised
//! as the single `min`/`max` instruction; a scalar float `select` becomes a jump, so single points use vectors too;
//! `fma` is never emitted, because results must not depend on the processor.

use std::collections::{HashMap, HashSet};

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, Type, Value, types};
use cranelift_frontend::FunctionBuilder;

use super::math_calls::HostFunction;
use super::r0::{Junction, Parts};
use super::{Forms, Precision};
use crate::ir::{Binary, Expr, Graph, Node, Unary};

/// Emits operations into one function.
pub(super) struct Emitter<'a, 'f> {
    pub builder: &'a mut FunctionBuilder<'f>,
    pub precision: Precision,
    pub forms: &'a Forms,
    /// The functions that the program calls.
    hosts: &'a Hosts,
    /// Intermediate results of R₀ for a pair of operands: value and weights share them.
    pub(super) parts: HashMap<(Node, Node, Junction), Parts>,
    /// Pairs whose weights will be asked for: their value uses the same quotient.
    pub(super) weighted: HashSet<(Node, Node, Junction)>,
}

/// The functions of the mathematical library that were declared in a program.
pub(super) type Hosts = HashMap<HostFunction, FuncRef>;

/// A node, and the value that holds it.
pub(super) type Operand = (Node, Value);

impl<'a, 'f> Emitter<'a, 'f> {
    pub fn new(
        builder: &'a mut FunctionBuilder<'f>,
        precision: Precision,
        (graph, forms): (&Graph, &'a Forms),
        hosts: &'a Hosts,
    ) -> Self {
        let weights = graph.nodes().filter_map(|(_, expr)| match expr {
            Expr::Binary(Binary::AndWeight, u, v) => Some((u, v, Junction::And)),
            Expr::Binary(Binary::OrWeight, u, v) => Some((u, v, Junction::Or)),
            _ => None,
        });
        let weighted = weights.flat_map(|(u, v, junction)| [(u, v, junction), (v, u, junction)]).collect();
        Self { builder, precision, forms, hosts, parts: HashMap::new(), weighted }
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

    /// A parameter or uniform in every lane; NaN if the program was given none.
    pub fn parameter(&mut self, parameters: Option<Value>, i: u32) -> Value {
        let Some(base) = parameters else { return self.constant(f64::NAN) };
        let (lane, vector) = (self.lane_type(), self.vector_type());
        let flags = MemFlagsData::trusted().with_readonly();
        let scalar = self.builder.ins().load(lane, flags, base, (i * lane.bytes()) as i32);
        self.builder.ins().splat(vector, scalar)
    }

    pub fn unary(&mut self, op: Unary, a: Value) -> Value {
        match op {
            Unary::Neg => self.negate(a),
            Unary::Abs => self.abs(a),
            Unary::Sqrt => self.builder.ins().sqrt(a),
            Unary::Sign => self.sign(a),
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

    /// A mask of all ones in the lanes where the comparison holds, as a vector of floats.
    pub(super) fn compare(&mut self, condition: FloatCC, a: Value, b: Value) -> Value {
        let mask = self.builder.ins().fcmp(condition, a, b);
        let vector = self.vector_type();
        self.builder.ins().bitcast(vector, MemFlagsData::new().with_endianness(ENDIANNESS), mask)
    }

    pub(super) fn select(&mut self, mask: Value, yes: Value, no: Value) -> Value {
        self.builder.ins().bitselect(mask, yes, no)
    }

    /// b < a ? a : b, one instruction; the pattern is not recognised with the comparison turned round.
    pub(super) fn max(&mut self, a: Value, b: Value) -> Value {
        let less = self.compare(FloatCC::LessThan, b, a);
        self.select(less, a, b)
    }

    /// A vector whose lanes have only their sign bit set. A constant, which is loaded once before a loop: `fneg`
    /// and `fabs` would build it anew at every use.
    fn sign_bits(&mut self) -> Value {
        self.constant(-0.0)
    }

    pub(super) fn negate(&mut self, a: Value) -> Value {
        let sign = self.sign_bits();
        self.builder.ins().bxor(a, sign)
    }

    pub(super) fn abs(&mut self, a: Value) -> Value {
        let sign = self.sign_bits();
        self.builder.ins().band_not(a, sign)
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

    /// A host function, lane by lane.
    ///
    /// # Panics
    /// If it was not declared: a bug of the caller.
    fn call(&mut self, function: HostFunction, operands: &[Value]) -> Value {
        let function = self.hosts[&function];
        let vector = self.vector_type();
        let first = self.call_in_lane(function, operands, 0);
        let mut result = self.builder.ins().scalar_to_vector(vector, first);
        for lane in 1..self.precision.lanes() as u8 {
            let value = self.call_in_lane(function, operands, lane);
            result = self.builder.ins().insertlane(result, value, lane);
        }
        result
    }

    fn call_in_lane(&mut self, function: FuncRef, operands: &[Value], lane: u8) -> Value {
        let arguments: Vec<Value> =
            operands.iter().map(|&v| self.builder.ins().extractlane(v, lane)).collect();
        let call = self.builder.ins().call(function, &arguments);
        self.builder.inst_results(call)[0]
    }
}

/// Only the byte order of a bitcast between lanes of one width, where it does not matter.
const ENDIANNESS: cranelift_codegen::ir::Endianness = cranelift_codegen::ir::Endianness::Little;
