//! Cranelift instructions on a 128-bit vector of lanes, one function at a time.
//!
//! Traps that shape this file: `fmin`/`fmax` cost seven instructions, but a comparison with `bitselect` is
//! recognised as the single `min`/`max` instruction. A scalar float `select` becomes a jump, so single points
//! use vectors, too. `fma` is never emitted, because results must not depend on the processor.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, Type, Value, types};
use cranelift_frontend::FunctionBuilder;

use super::host_functions::HostFunction;
use super::machine::number_type;
use super::sine::{Wanted, Waves};
use crate::ir::{Binary, Expr, Forms, Graph, Lookup, Node, Tables, UnaryFunction};
use crate::precision::Precision;
use crate::table::Table;

/// Emits instructions into one function.
pub(super) struct Emitter<'a, 'f> {
    pub builder: &'a mut FunctionBuilder<'f>,
    pub precision: Precision,
    /// Lanes that hold a point. Functions of the library are called for these lanes only; otherwise a single
    /// point would pay for the origin as well. Functions of `sine` take a whole vector.
    lanes: u8,
    pub forms: &'a Forms,
    pub hosts: &'a Hosts,
    /// Intermediate results of R₀ for a pair of operands: value and weights share them.
    pub parts: HashMap<(Node, Node, Junction), R0Parts>,
    /// Pairs whose weights will be needed. Their value uses the same quotient.
    pub weighted: HashSet<(Node, Node, Junction)>,
    /// Sines and cosines that were found together for one argument.
    pub waves: HashMap<Node, Waves>,
}

/// The functions that a program calls.
#[derive(Default)]
pub(super) struct Hosts {
    /// The functions of the mathematical library.
    pub functions: HashMap<HostFunction, FuncRef>,
    /// The functions of `sine`: the results of a node that are needed, and the function that finds them.
    pub waves: HashMap<Node, (Wanted, FuncRef)>,
}

/// A node, and the value that holds it.
pub(super) type Operand = (Node, Value);

/// ∧ or ∨
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Junction {
    And,
    Or,
}

/// Intermediate results that value and weights of u ∧ v or u ∨ v share.
#[derive(Clone, Copy)]
pub(super) struct R0Parts {
    /// The operand close to the result on the small branch: the minimum for ∧, the maximum for ∨.
    pub near: Value,
    /// The other one.
    pub far: Value,
    /// u + v
    pub sum: Value,
    /// √(u² + v²), not less than max(|u|, |v|)
    pub h: Value,
    /// Mask of the small branch.
    pub small: Value,
    /// max(|u|, |v|) + h
    pub denominator: Value,
    /// Masks u < v and v < u. At a tie neither is set, and both operands get the same weight.
    pub less: Value,
    pub greater: Value,
    /// |τ| with the sign of m/M on the branch taken; only where weights are asked for.
    pub tau: Option<Value>,
}

impl<'a, 'f> Emitter<'a, 'f> {
    pub fn new(
        builder: &'a mut FunctionBuilder<'f>,
        (precision, lanes): (Precision, u8),
        (graph, forms): (&Graph, &'a Forms),
        hosts: &'a Hosts,
    ) -> Self {
        let weights = graph.nodes().filter_map(|(_, expr)| match expr {
            Expr::Binary(Binary::AndWeight, u, v) => Some((u, v, Junction::And)),
            Expr::Binary(Binary::OrWeight, u, v) => Some((u, v, Junction::Or)),
            _ => None,
        });
        let weighted = weights.flat_map(|(u, v, junction)| [(u, v, junction), (v, u, junction)]).collect();
        let (parts, waves) = (HashMap::new(), HashMap::new());
        Self { builder, precision, lanes, forms, hosts, parts, weighted, waves }
    }

    pub fn lane_type(&self) -> Type {
        number_type(self.precision)
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

    /// A mask of all ones in the lanes where the comparison holds, as a vector of floats.
    pub fn compare(&mut self, condition: FloatCC, a: Value, b: Value) -> Value {
        let mask = self.builder.ins().fcmp(condition, a, b);
        let vector = self.vector_type();
        self.builder.ins().bitcast(vector, MemFlagsData::new().with_endianness(ENDIANNESS), mask)
    }

    pub fn select(&mut self, mask: Value, yes: Value, no: Value) -> Value {
        self.builder.ins().bitselect(mask, yes, no)
    }

    /// b < a ? a : b, one instruction. The pattern is not recognised if the comparison is reversed.
    pub fn max(&mut self, a: Value, b: Value) -> Value {
        let less = self.compare(FloatCC::LessThan, b, a);
        self.select(less, a, b)
    }

    /// A vector whose lanes have only their sign bit set. It is a constant, loaded once before a loop; `fneg`
    /// and `fabs` would build it again at every use.
    fn sign_bits(&mut self) -> Value {
        self.constant(-0.0)
    }

    pub fn negate(&mut self, a: Value) -> Value {
        let sign = self.sign_bits();
        self.builder.ins().bxor(a, sign)
    }

    pub fn abs(&mut self, a: Value) -> Value {
        let sign = self.sign_bits();
        self.builder.ins().band_not(a, sign)
    }

    /// The sine or the cosine of a node in every lane.
    ///
    /// # Panics
    /// If this was not declared as needed: a bug of the caller.
    pub fn wave(&mut self, function: UnaryFunction, (node, x): (Node, Value)) -> Value {
        let waves = match self.waves.get(&node) {
            Some(&waves) => waves,
            None => {
                let (wanted, function) = self.hosts.waves[&node];
                let x = if self.lanes == 1 { self.in_all_lanes(x) } else { x };
                let call = self.builder.ins().call(function, &[x]);
                let waves = wanted.of(self.builder.inst_results(call));
                self.waves.insert(node, waves);
                waves
            }
        };
        let found = if function == UnaryFunction::Sin { waves.sine } else { waves.cosine };
        found.expect("every use is declared")
    }

    /// The number of the first lane in all lanes, because lanes without a point may hold numbers that take a
    /// function's slow path.
    fn in_all_lanes(&mut self, x: Value) -> Value {
        let (first, vector) = (self.builder.ins().extractlane(x, 0), self.vector_type());
        self.builder.ins().splat(vector, first)
    }

    /// Calls a host function, lane by lane.
    ///
    /// # Panics
    /// If it was not declared: a bug of the caller.
    pub fn call(&mut self, function: HostFunction, operands: &[Value]) -> Value {
        self.call_behind(function, &[], operands)
    }

    /// Looks up a table, lane by lane. The program then contains the address of the table.
    ///
    /// # Panics
    /// If its function was not declared: a bug of the caller.
    pub fn lookup(&mut self, lookup: Lookup, tables: &Tables, at: [Value; 3]) -> Value {
        let table: *const Arc<dyn Table> = &raw const tables[lookup.table as usize];
        let address = self.builder.ins().iconst(types::I64, table.addr() as i64);
        self.call_behind(HostFunction::Table(lookup.part), &[address], &at)
    }

    /// Calls a host function, lane by lane. Arguments that all lanes share come before the others. Lanes
    /// without a point are zero.
    fn call_behind(&mut self, function: HostFunction, shared: &[Value], operands: &[Value]) -> Value {
        let function = self.hosts.functions[&function];
        let vector = self.vector_type();
        let first = self.call_in_lane(function, shared, operands, 0);
        let mut result = self.builder.ins().scalar_to_vector(vector, first);
        for lane in 1..self.lanes {
            let value = self.call_in_lane(function, shared, operands, lane);
            result = self.builder.ins().insertlane(result, value, lane);
        }
        result
    }

    fn call_in_lane(&mut self, function: FuncRef, shared: &[Value], operands: &[Value], lane: u8) -> Value {
        let mut arguments = shared.to_vec();
        arguments.extend(operands.iter().map(|&v| self.builder.ins().extractlane(v, lane)));
        let call = self.builder.ins().call(function, &arguments);
        self.builder.inst_results(call)[0]
    }
}

/// The byte order of bitcasts between lanes of one width, where it does not matter.
pub(super) const ENDIANNESS: cranelift_codegen::ir::Endianness = cranelift_codegen::ir::Endianness::Little;
