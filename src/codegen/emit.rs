//! One operation of the graph → Cranelift instructions on a 128-bit vector of lanes.
//!
//! Traps that shape this file: `fmin`/`fmax` cost seven instructions, a comparison with `bitselect` is recognised
//! as the single `min`/`max` instruction; a scalar float `select` becomes a jump, so single points use vectors too;
//! `fma` is never emitted, because results must not depend on the processor.

use std::collections::{HashMap, HashSet};

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, Type, Value, types};
use cranelift_frontend::FunctionBuilder;

use super::Precision;
use crate::ir::{Binary, Expr, Graph, Node, Unary, r0};

/// Emits operations into one function.
pub(super) struct Emitter<'a, 'f> {
    pub builder: &'a mut FunctionBuilder<'f>,
    pub precision: Precision,
    /// Intermediate results of R₀ for a pair of operands: value and weights share them.
    parts: HashMap<(Node, Node, Junction), Parts>,
    /// Pairs whose weights will be asked for: their value uses the same quotient.
    weighted: HashSet<(Node, Node, Junction)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Junction {
    And,
    Or,
}

/// A node's number, and the value that holds it.
pub(super) type Operand = (Node, Value);

/// What value and weights of u ∧ v or u ∨ v share.
#[derive(Clone, Copy)]
struct Parts {
    /// The operand that the result is near to on the small branch: the minimum for ∧, the maximum for ∨.
    near: Value,
    /// The other one.
    far: Value,
    /// u + v
    sum: Value,
    /// √(u² + v²), not less than max(|u|, |v|)
    h: Value,
    /// Mask of the small branch.
    small: Value,
    /// max(|u|, |v|) + h
    denominator: Value,
    /// Masks u < v and v < u: at a tie neither, and both operands get the same weight.
    less: Value,
    greater: Value,
    /// |τ| with the sign of m/M on the branch taken; only where weights are asked for.
    tau: Option<Value>,
}

impl<'a, 'f> Emitter<'a, 'f> {
    pub fn new(builder: &'a mut FunctionBuilder<'f>, precision: Precision, graph: &Graph) -> Self {
        let weights = graph.nodes().filter_map(|(_, expr)| match expr {
            Expr::Binary(Binary::AndWeight, u, v) => Some((u, v, Junction::And)),
            Expr::Binary(Binary::OrWeight, u, v) => Some((u, v, Junction::Or)),
            _ => None,
        });
        let weighted = weights.flat_map(|(u, v, junction)| [(u, v, junction), (v, u, junction)]).collect();
        Self { builder, precision, parts: HashMap::new(), weighted }
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
            Unary::Neg => {
                let sign = self.sign_bits();
                self.builder.ins().bxor(a, sign)
            }
            Unary::Abs => self.abs(a),
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

    /// b < a ? a : b, one instruction; the pattern is not recognised with the comparison turned round.
    fn max(&mut self, a: Value, b: Value) -> Value {
        let less = self.compare(FloatCC::LessThan, b, a);
        self.select(less, a, b)
    }

    /// A vector whose lanes have only their sign bit set. A constant, which is loaded once before a loop: `fneg`
    /// and `fabs` would build it anew at every use.
    fn sign_bits(&mut self) -> Value {
        self.constant(-0.0)
    }

    fn abs(&mut self, a: Value) -> Value {
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

    /// The parts for a pair of operands: see `ir::r0`, whose operations these are. A disjunction is the dual of a
    /// conjunction there; here its signs are worked into the formulas, which changes no bit.
    fn r0_parts(&mut self, (u, a): Operand, (v, b): Operand, junction: Junction) -> Parts {
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
        let h = self.max(root, magnitude);
        let zero = self.constant(0.0);
        let (near, far, small) = match junction {
            Junction::And => (min, max, self.compare(FloatCC::LessThan, zero, sum)),
            Junction::Or => (max, min, self.compare(FloatCC::LessThan, sum, zero)),
        };
        let denominator = self.builder.ins().fadd(magnitude, h);
        let mut parts = Parts { near, far, sum, h, small, denominator, less, greater, tau: None };
        if self.weighted.contains(&key) {
            parts.tau = Some(self.r0_tau(parts, junction));
        }
        self.parts.insert(key, parts);
        parts
    }

    /// The parts for operands in the order in which they were met first, and whether that is the other order.
    fn shared_parts(&mut self, u: Operand, v: Operand, junction: Junction) -> (Parts, bool) {
        if u.0 != v.0 && self.parts.contains_key(&(v.0, u.0, junction)) {
            (self.r0_parts(v, u, junction), true)
        } else {
            (self.r0_parts(u, v, junction), false)
        }
    }

    fn r0_value(&mut self, u: Operand, v: Operand, junction: Junction) -> Value {
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

    fn r0_tau(&mut self, p: Parts, junction: Junction) -> Value {
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
    fn r0_weight(&mut self, u: Operand, v: Operand, junction: Junction) -> Value {
        let (p, swapped) = self.shared_parts(u, v, junction);
        let tau = match p.tau {
            Some(tau) => tau,
            None => self.r0_tau(p, junction),
        };
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
        let factor = self.select(p.small, square, one);
        let twice = self.builder.ins().fadd(scale, scale);
        let greater = self.builder.ins().fmul(factor, twice);
        // u has the lesser weight where small == (u is the near operand)
        let u_is_near = match (junction, swapped) {
            (Junction::And, false) | (Junction::Or, true) => p.less,
            (Junction::And, true) | (Junction::Or, false) => p.greater,
        };
        let differs = self.builder.ins().bxor(p.small, u_is_near);
        self.select(differs, greater, lesser)
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
