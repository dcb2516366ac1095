//! Ranges in machine code: the interval of every node in one register, as [−lo, hi].
//!
//! With the lower bound negated both bounds are rounded in the same direction: upwards, by adding |v|·2⁻⁵² + 2⁻¹⁰⁰⁰
//! to a result that was rounded to nearest. The rules are those of `ir::range`; bounds may be wider by an ulp.
//!
//! Only graphs are taken whose every node is finite over [`REACH`], so that no infinity or NaN can arise for a box
//! within it: then min and max need not look for them. Elsewhere the interpreter answers.

use std::collections::HashMap;

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value, types};
use cranelift_frontend::FunctionBuilder;
use glam::DVec3;

use super::emit::Emitter;
use super::{Precision, Request};
use crate::geom::Aabb;
use crate::ir::{Affine, Axis, Binary, Expr, Graph, Node, RangeEvaluator, RangeStep, Unary};

/// Boxes within this distance of the origin are answered by machine code.
pub const REACH: f64 = 1e9;

/// Whether machine code can answer for this graph.
pub fn supports(graph: &Graph, root: Node) -> bool {
    let over = Aabb::new(DVec3::splat(-REACH), DVec3::splat(REACH));
    let ranges = RangeEvaluator::new(graph, root).all(&over);
    graph.nodes().all(|(node, expr)| {
        let range = ranges[node.index()];
        let known = match expr {
            Expr::Constant(_) | Expr::Coordinate(_) => true,
            Expr::Parameter(_) => false,
            Expr::Unary(op, _) => matches!(op, Unary::Neg | Unary::Abs | Unary::Sqrt),
            Expr::Binary(Binary::Div, _, b) => graph.as_constant(b).is_some_and(|c| c != 0.0),
            Expr::Binary(op, ..) => {
                use Binary::{Add, And, Max, Min, Mul, Or, PlainMax, PlainMin, Sub};
                matches!(op, Add | Sub | Mul | Min | Max | PlainMin | PlainMax | And | Or)
            }
        };
        known && range.lo.abs() < 1e300 && range.hi.abs() < 1e300
    })
}

/// `fn(box: *const [f64; 6], out: *mut [f64; 2])`: x, y, z as pairs (low, high) in, (low, high) of the root out.
pub(super) fn emit(builder: &mut FunctionBuilder<'_>, request: Request<'_>) {
    let block = builder.create_block();
    builder.append_block_params_for_function_params(block);
    builder.switch_to_block(block);
    builder.seal_block(block);
    let (input, output) = (builder.block_params(block)[0], builder.block_params(block)[1]);
    let emitter = Emitter::new(builder, Precision::F64, request.forms, request.graph);
    let mut ranges = Ranges { emitter };
    let axes: [Value; 3] = std::array::from_fn(|i| {
        let pair = ranges.emitter.builder.ins().load(types::F64X2, MemFlagsData::new(), input, 16 * i as i32);
        ranges.flip(pair)
    });
    let mut values: HashMap<Node, Value> = HashMap::new();
    for (node, expr) in request.graph.nodes() {
        let value = match RangeStep::of(request.graph, expr) {
            RangeStep::Square(a) => ranges.square(values[&a]),
            RangeStep::Slab { of, first, second } => ranges.slab(values[&of], first, second),
            RangeStep::Plain(expr) => ranges.plain(request.graph, expr, &values, axes),
        };
        values.insert(node, value);
    }
    let root = ranges.flip(values[&request.outputs[0]]);
    ranges.emitter.builder.ins().store(MemFlagsData::new(), root, output, 0);
    ranges.emitter.builder.ins().return_(&[]);
}

struct Ranges<'a, 'f> {
    emitter: Emitter<'a, 'f>,
}

impl Ranges<'_, '_> {
    fn plain(&mut self, graph: &Graph, expr: Expr, values: &HashMap<Node, Value>, axes: [Value; 3]) -> Value {
        match expr {
            Expr::Constant(bits) => self.point(f64::from_bits(bits)),
            Expr::Coordinate(Axis::X) => axes[0],
            Expr::Coordinate(Axis::Y) => axes[1],
            Expr::Coordinate(Axis::Z) => axes[2],
            Expr::Parameter(_) => self.point(f64::NAN), // `supports` refuses parameters
            Expr::Unary(Unary::Neg, a) => self.swap(values[&a]),
            Expr::Unary(Unary::Abs, a) => {
                let (low, high) = self.magnitudes(values[&a]);
                let plain = self.lanes(low, high);
                self.flip(plain)
            }
            Expr::Unary(_, a) => self.sqrt(values[&a]),
            Expr::Binary(op, a, b) => self.binary(graph, op, (a, values[&a]), (b, values[&b])),
        }
    }

    fn binary(&mut self, graph: &Graph, op: Binary, (u, a): (Node, Value), (v, b): (Node, Value)) -> Value {
        match op {
            Binary::Add => self.add(a, b),
            Binary::Sub => {
                let b = self.swap(b);
                self.add(a, b)
            }
            Binary::Mul => self.multiply(a, b),
            Binary::Div => {
                // by a constant: see `supports`
                let divisor = graph.as_constant(v).unwrap_or(1.0);
                let a = if divisor < 0.0 { self.swap(a) } else { a };
                let magnitude = self.emitter.constant(divisor.abs());
                let quotient = self.emitter.builder.ins().fdiv(a, magnitude);
                self.up(quotient)
            }
            Binary::Min | Binary::PlainMin => {
                // −min(lo) = max(−lo)
                let (low, high) = (self.emitter.max(a, b), self.min(a, b));
                self.lanes(low, high)
            }
            Binary::Max | Binary::PlainMax => {
                let (low, high) = (self.min(a, b), self.emitter.max(a, b));
                self.lanes(low, high)
            }
            _ => {
                // R₀ grows with each operand: both ends at once, widened by 4 ulp, zeros kept
                let (a, b) = (self.flip(a), self.flip(b));
                let junction =
                    if op == Binary::And { super::r0::Junction::And } else { super::r0::Junction::Or };
                let ends = self.emitter.r0_value((u, a), (v, b), junction);
                let ends = self.flip(ends);
                let magnitude = self.emitter.abs(ends);
                let four_ulp = self.emitter.constant(2f64.powi(-50));
                let margin = self.emitter.builder.ins().fmul(magnitude, four_ulp);
                self.emitter.builder.ins().fadd(ends, margin)
            }
        }
    }

    /// A constant with two different lanes.
    fn pair(&mut self, low: f64, high: f64) -> Value {
        let bytes: Vec<u8> = [low, high].iter().flat_map(|c| c.to_bits().to_le_bytes()).collect();
        let handle = self.emitter.builder.func.dfg.constants.insert(bytes.into());
        self.emitter.builder.ins().vconst(types::F64X2, handle)
    }

    /// [−c, c]
    fn point(&mut self, c: f64) -> Value {
        self.pair(-c, c)
    }

    /// Negates the lower lane.
    fn flip(&mut self, v: Value) -> Value {
        let mask = self.pair(-0.0, 0.0);
        self.emitter.builder.ins().bxor(v, mask)
    }

    /// The lower lane of one vector with the upper lane of another.
    fn lanes(&mut self, low: Value, high: Value) -> Value {
        self.shuffle(low, high, [0, 1, 2, 3, 4, 5, 6, 7, 24, 25, 26, 27, 28, 29, 30, 31])
    }

    /// −x of an interval x: the bounds change places.
    fn swap(&mut self, v: Value) -> Value {
        self.shuffle(v, v, [8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7])
    }

    fn shuffle(&mut self, a: Value, b: Value, bytes: [u8; 16]) -> Value {
        let flags = MemFlagsData::new().with_endianness(cranelift_codegen::ir::Endianness::Little);
        let ins = |e: &mut Emitter<'_, '_>, v| e.builder.ins().bitcast(types::I8X16, flags, v);
        let (a, b) = (ins(&mut self.emitter, a), ins(&mut self.emitter, b));
        let mask = self.emitter.builder.func.dfg.immediates.push(bytes.to_vec().into());
        let mixed = self.emitter.builder.ins().shuffle(a, b, mask);
        self.emitter.builder.ins().bitcast(types::F64X2, flags, mixed)
    }

    fn min(&mut self, a: Value, b: Value) -> Value {
        let less = self.emitter.compare(FloatCC::LessThan, a, b);
        self.emitter.select(less, a, b)
    }

    /// Not below the neighbour above what was rounded to nearest.
    fn up(&mut self, v: Value) -> Value {
        let magnitude = self.emitter.abs(v);
        let (ulp, least) = (self.emitter.constant(2f64.powi(-52)), self.emitter.constant(2f64.powi(-1000)));
        let margin = self.emitter.builder.ins().fmul(magnitude, ulp);
        let margin = self.emitter.builder.ins().fadd(margin, least);
        self.emitter.builder.ins().fadd(v, margin)
    }

    fn add(&mut self, a: Value, b: Value) -> Value {
        let sum = self.emitter.builder.ins().fadd(a, b);
        self.up(sum)
    }

    fn multiply(&mut self, a: Value, b: Value) -> Value {
        let (a, b) = (self.flip(a), self.flip(b));
        let crossed = self.swap(b);
        let (p, q) = (self.emitter.builder.ins().fmul(a, b), self.emitter.builder.ins().fmul(a, crossed));
        let (high, low) = (self.emitter.max(p, q), self.min(p, q));
        let (high2, low2) = (self.swap(high), self.swap(low));
        let (high, low) = (self.emitter.max(high, high2), self.min(low, low2));
        let plain = self.lanes(low, high);
        let product = self.flip(plain);
        self.up(product)
    }

    /// Smallest and largest magnitude in an interval, each in both lanes.
    fn magnitudes(&mut self, v: Value) -> (Value, Value) {
        let turned = self.swap(v);
        let largest = self.emitter.max(v, turned);
        let nearest = self.min(v, turned);
        let nearest = self.emitter.negate(nearest);
        let zero = self.emitter.constant(0.0);
        (self.emitter.max(nearest, zero), largest)
    }

    fn square(&mut self, v: Value) -> Value {
        let (low, high) = self.magnitudes(v);
        let ends = self.lanes(low, high);
        let squares = self.emitter.builder.ins().fmul(ends, ends);
        let signed = self.flip(squares);
        let wide = self.up(signed);
        self.not_negative(wide)
    }

    /// Cuts off what rounding put below zero: −lo ≤ 0.
    fn not_negative(&mut self, v: Value) -> Value {
        let limit = self.pair(0.0, f64::MAX);
        self.min(v, limit)
    }

    fn sqrt(&mut self, v: Value) -> Value {
        // `supports` has shown that the operand is not negative, but rounding here may be an ulp wider
        let v = self.not_negative(v);
        let magnitude = self.emitter.abs(v);
        let root = self.emitter.builder.ins().sqrt(magnitude);
        let signed = self.flip(root);
        let wide = self.up(signed);
        self.not_negative(wide)
    }

    /// (p·e + q)·(r·e + s) of one node e: at both ends of e, and at its vertex if e contains it.
    fn slab(&mut self, e: Value, first: Affine, second: Affine) -> Value {
        let plain = self.flip(e);
        // the ends as two point intervals: [−a, a]
        let turned = self.swap(plain);
        let (both_low, both_high) = (self.lanes(plain, turned), self.lanes(turned, plain));
        let (low, high) = (self.flip(both_low), self.flip(both_high));
        let (at_low, at_high) = (self.slab_at(low, first, second), self.slab_at(high, first, second));
        let ends = self.emitter.max(at_low, at_high);
        // the vertex lies halfway between the roots; widened by its own rounding, then clamped into e: outside e it
        // becomes the nearer end, which counts already
        let middle = -0.5 * (first.offset * first.slope + second.offset * second.slope);
        let vertex = self.point(middle);
        let vertex = self.up(vertex);
        let vertex = self.up(vertex);
        let clamped = self.clamp(vertex, e);
        let at_vertex = self.slab_at(clamped, first, second);
        self.emitter.max(ends, at_vertex)
    }

    /// The part of an interval nearest to another: its intersection, or the nearer end of the other.
    fn clamp(&mut self, v: Value, within: Value) -> Value {
        let (v, within) = (self.flip(v), self.flip(within));
        let turned = self.swap(within);
        let (low, high) = (self.lanes(within, turned), self.lanes(turned, within));
        let at_least = self.emitter.max(v, low);
        let clamped = self.min(at_least, high);
        self.flip(clamped)
    }

    fn slab_at(&mut self, e: Value, first: Affine, second: Affine) -> Value {
        let mut factor = |affine: Affine| {
            let signed = if affine.slope < 0.0 { self.swap(e) } else { e };
            if affine.offset == 0.0 {
                return signed;
            }
            let offset = self.point(affine.offset);
            self.add(signed, offset)
        };
        let (p, q) = (factor(first), factor(second));
        self.multiply(p, q)
    }
}
