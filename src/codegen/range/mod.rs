//! Ranges in machine code: the interval of every node in one register, as [−lo, hi].
//!
//! With the lower bound negated both bounds are rounded in the same direction, upwards. If the caller sets
//! the processor to round upwards ([`Rounding::Upward`]), a single instruction gives a bound at or above the
//! exact one. Otherwise ([`Rounding::Nearest`]) |v|·2⁻⁵² + 2⁻¹⁰⁰⁰ is added after each operation. The rules
//! are those of `ir::bounds::range`, except for choices (`ir::bounds::choice`): here these are sums of
//! products, and reach to zero where they are open. Bounds may be wider by a few ulp, those of R₀ by a few
//! ulp of its larger operand.
//!
//! Only graphs and boxes are accepted for which `instructions` has shown that neither infinity nor NaN can
//! arise, so min and max need not check for them. The interpreter answers for others. The program itself
//! detects a divisor that may vanish, a root of a number that may be negative, and a called function that may
//! be undefined; it then answers NaN.

mod angles;
mod calls;
mod functions;
mod instructions;
mod steps;

use std::collections::{HashMap, HashSet};

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{FuncRef, InstBuilder, MemFlagsData, StackSlot, Value, types};
use cranelift_frontend::FunctionBuilder;

use instructions::{Instruction, LEAST_DIVISOR, RangeBinary, RangeUnary};

use super::emitter::{Emitter, Hosts};
use super::request::{Request, Rounding, Shape, pointers};
use crate::ir::{Affine, Node, Unary};
use crate::precision::Precision;

pub(super) use calls::{declare, register};
pub(super) use instructions::Instructions;
pub use instructions::{REACH, knows, stays_finite, supports};

/// Relative errors of one rounded operation, in either rounding: 2⁻⁵².
const ULP: f64 = f64::EPSILON;

/// Relative widening of a product of two sums: three roundings of the bound itself, and one and a half of the
/// program whose values it must contain.
const MARGIN: f64 = 8.0 * ULP;

/// Widening of R₀, relative to √(u² + v²): 3 ulp of the root itself, 2.3 ulp of the result in the program
/// (see `ir::r0`), which is at most 2.5 roots, and in [`Rounding::Nearest`] the halves of an ulp of the sums.
const R0_MARGIN: f64 = 16.0 * ULP;

/// Absolute widening of R₀, because operands below 2⁻⁵⁰⁰ may have squares that underflow. It is more than
/// their result, and more than the root of the lost part.
const R0_UNDERFLOW: f64 = 1e-147;

/// Sums of squares may reach this far below zero in [`Rounding::Nearest`].
const LOST_BELOW_ZERO: f64 = 1e-290;

/// `fn(box: *const [f64; 6], out: *mut [f64; 2])`: the low x, y, z and the high ones in, (low, high) of each
/// output out; pointers to parameters, and to a pair (low, high) for each uniform, follow if there are any.
pub(super) fn emit(
    builder: &mut FunctionBuilder<'_>,
    request: Request<'_>,
    Instructions(instructions): &Instructions,
    host: Option<FuncRef>,
) {
    let block = builder.create_block();
    builder.append_block_params_for_function_params(block);
    builder.switch_to_block(block);
    builder.seal_block(block);
    let arguments = builder.block_params(block).to_vec();
    let (input, output) = (arguments[0], arguments[1]);
    let [parameters, uniforms] = pointers(request, &arguments[2..]);
    let hosts = Hosts::default(); // no instruction calls a function for one number, so no lane needs one
    let emitter = Emitter::new(builder, (Precision::F64, 0), (request.graph, request.forms), &hosts);
    let (numbers, values) = (HashMap::new(), HashMap::new());
    let (rounding, function) = match request.shape {
        Shape::Slopes(rounding) => {
            let cone: HashSet<Node> = request.graph.cone(request.outputs[0]).into_iter().collect();
            (rounding, Some(cone))
        }
        Shape::Range(rounding) => (rounding, None),
        Shape::Point | Shape::Batch => unreachable!("only ranges come here"),
    };
    let mut ranges = Ranges { emitter, rounding, host, numbers, values, pole: None, bounds: None };
    let axes: [Value; 3] = std::array::from_fn(|i| {
        let pair = ranges.load_pair(input, [8 * i as i32, 8 * (i as i32 + 3)]);
        ranges.flip(pair, BoundLane::Low)
    });
    for ((node, _), &instruction) in std::iter::zip(request.graph.nodes(), instructions) {
        let value = match instruction {
            Instruction::Constant(c) => ranges.number(node, RangeNumber::Constant(c)),
            Instruction::Coordinate(axis) => axes[axis],
            Instruction::Parameter(i) => {
                let splat = ranges.emitter.parameter(parameters, i);
                ranges.number(node, RangeNumber::Parameter(splat))
            }
            Instruction::Uniform(i) => ranges.uniform(uniforms, i),
            Instruction::Square(a) => ranges.square(ranges.values[&a]),
            Instruction::Slab { of, first, second } => ranges.slab(ranges.values[&of], first, second),
            Instruction::Unary(op, a) => ranges.unary(op, ranges.values[&a]),
            Instruction::Binary(op, a, b) => ranges.binary(op, a, b),
            Instruction::Share(a, b) => ranges.share(ranges.values[&a], ranges.values[&b]),
            Instruction::Divide(a, number) => ranges.divide(ranges.values[&a], ranges.numbers[&number]),
            Instruction::Quotient(a, b) => ranges.quotient(ranges.values[&a], ranges.values[&b]),
            Instruction::Choice { values: [a, b], share } => {
                ranges.choice([ranges.values[&a], ranges.values[&b]], ranges.values[&share])
            }
            Instruction::Call(function, operands) => {
                ranges.call(function, operands.map(|node| ranges.values[&node]))
            }
        };
        if function.as_ref().is_some_and(|cone| cone.contains(&node)) {
            ranges.forbid_jumps(instruction, value);
        }
        ranges.values.insert(node, value);
    }
    for (i, node) in request.outputs.iter().enumerate() {
        let range = ranges.flip(ranges.values[node], BoundLane::Low);
        let range = ranges.unless_at_a_pole(range);
        ranges.emitter.builder.ins().store(MemFlagsData::new(), range, output, 16 * i as i32);
    }
    ranges.emitter.builder.ins().return_(&[]);
}

/// A node with one value.
#[derive(Clone, Copy)]
enum RangeNumber {
    Constant(f64),
    /// In both lanes.
    Parameter(Value),
}

/// The lane of a register that holds −lo, or that of hi.
#[derive(Clone, Copy, PartialEq)]
enum BoundLane {
    Low,
    High,
}

struct Ranges<'a, 'f> {
    emitter: Emitter<'a, 'f>,
    rounding: Rounding,
    /// The function that finds ranges which are not computed here.
    host: Option<FuncRef>,
    numbers: HashMap<Node, RangeNumber>,
    values: HashMap<Node, Value>,
    /// A mask: ones in a lane if there is no answer. `None` if there always is an answer.
    pole: Option<Value>,
    /// The place of the bounds with which a function is called.
    bounds: Option<StackSlot>,
}

impl Ranges<'_, '_> {
    fn unary(&mut self, op: RangeUnary, a: Value) -> Value {
        match op {
            RangeUnary::Neg => self.swap(a),
            RangeUnary::Abs => self.magnitudes(a),
            RangeUnary::Sqrt => self.sqrt(a),
            RangeUnary::Sign => self.emitter.unary(Unary::Sign, a),
            // −floor(lo) is the ceiling of −lo
            RangeUnary::Floor => {
                let low = self.emitter.builder.ins().ceil(a);
                let high = self.emitter.builder.ins().floor(a);
                self.lanes(low, high)
            }
            RangeUnary::Round => self.emitter.builder.ins().nearest(a),
            RangeUnary::Atan => self.atan(a),
        }
    }

    fn binary(&mut self, op: RangeBinary, u: Node, v: Node) -> Value {
        let (a, b) = (self.values[&u], self.values[&v]);
        match op {
            RangeBinary::Add => self.add(a, b),
            RangeBinary::Sub => {
                let b = match self.numbers.get(&v) {
                    Some(&RangeNumber::Constant(c)) => self.pair(c, -c),
                    _ => self.swap(b),
                };
                self.add(a, b)
            }
            RangeBinary::Mul => match (self.numbers.get(&u).copied(), self.numbers.get(&v).copied()) {
                (Some(number), _) => self.times(b, number),
                (_, Some(number)) => self.times(a, number),
                _ => self.multiply(a, b),
            },
            // the hull with 0, unless the second factor is one number
            RangeBinary::MulOrZero => {
                let product = self.multiply(a, b);
                let zero = self.pair(0.0, 0.0);
                let hull = self.emitter.max(product, zero);
                let swapped = self.swap(b);
                let width = self.fadd(b, swapped);
                let is_number = self.emitter.compare(FloatCC::Equal, width, zero);
                self.emitter.select(is_number, product, hull)
            }
            RangeBinary::Min => {
                // −min(lo) = max(−lo)
                let (low, high) = (self.emitter.max(a, b), self.min(a, b));
                self.lanes(low, high)
            }
            RangeBinary::Max => {
                let (low, high) = (self.min(a, b), self.emitter.max(a, b));
                self.lanes(low, high)
            }
            RangeBinary::And => self.r0(a, b, BoundLane::High),
            RangeBinary::Or => self.r0(a, b, BoundLane::Low),
            RangeBinary::Atan2 => self.atan2(a, b).0,
            RangeBinary::AndWeight => self.weight(a, b).0,
            RangeBinary::OrWeight => {
                let (a, b) = (self.swap(a), self.swap(b));
                self.weight(a, b).0
            }
        }
    }

    /// The range of a number, which is kept for operations that are cheaper with one.
    fn number(&mut self, node: Node, number: RangeNumber) -> Value {
        self.numbers.insert(node, number);
        match number {
            RangeNumber::Constant(c) => self.pair(-c, c),
            RangeNumber::Parameter(splat) => self.flip(splat, BoundLane::Low),
        }
    }

    /// A uniform: its bounds as given, or NaN if the program was given none.
    fn uniform(&mut self, uniforms: Option<Value>, i: u32) -> Value {
        let Some(base) = uniforms else { return self.pair(f64::NAN, f64::NAN) };
        let flags = MemFlagsData::new();
        let pair = self.emitter.builder.ins().load(types::F64X2, flags, base, 16 * i as i32);
        self.flip(pair, BoundLane::Low)
    }

    /// Two numbers in memory. They are read one by one, because numbers that were just written one by one
    /// cannot be read quickly as one vector.
    fn load_pair(&mut self, base: Value, offsets: [i32; 2]) -> Value {
        let [low, high] = offsets
            .map(|offset| self.emitter.builder.ins().load(types::F64, MemFlagsData::new(), base, offset));
        let low = self.emitter.builder.ins().splat(types::F64X2, low);
        self.emitter.builder.ins().insertlane(low, high, 1)
    }

    /// A constant with two different lanes.
    fn pair(&mut self, low: f64, high: f64) -> Value {
        let bytes: Vec<u8> = [low, high].iter().flat_map(|c| c.to_bits().to_le_bytes()).collect();
        let handle = self.emitter.builder.func.dfg.constants.insert(bytes.into());
        self.emitter.builder.ins().vconst(types::F64X2, handle)
    }

    /// A constant with `inside` in the given lane and `outside` in the other.
    fn signed(&mut self, lane: BoundLane, inside: f64, outside: f64) -> Value {
        match lane {
            BoundLane::Low => self.pair(inside, outside),
            BoundLane::High => self.pair(outside, inside),
        }
    }

    /// Negates one lane.
    fn flip(&mut self, v: Value, lane: BoundLane) -> Value {
        let mask = self.signed(lane, -0.0, 0.0);
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

    fn fadd(&mut self, a: Value, b: Value) -> Value {
        self.emitter.builder.ins().fadd(a, b)
    }

    fn fmul(&mut self, a: Value, b: Value) -> Value {
        self.emitter.builder.ins().fmul(a, b)
    }

    /// A result of one operation, not below the exact one.
    fn up(&mut self, v: Value) -> Value {
        if self.rounding == Rounding::Upward {
            return v;
        }
        let magnitude = self.emitter.abs(v);
        let (ulp, least) = (self.emitter.constant(ULP), self.emitter.constant(2f64.powi(-1000)));
        let margin = self.fmul(magnitude, ulp);
        let margin = self.fadd(margin, least);
        self.fadd(v, margin)
    }

    fn add(&mut self, a: Value, b: Value) -> Value {
        let sum = self.fadd(a, b);
        self.up(sum)
    }

    /// A vector, with its lanes exchanged if a number is negative, and the number's magnitude in both lanes.
    fn turned(&mut self, v: Value, number: RangeNumber) -> (Value, Value) {
        match number {
            RangeNumber::Constant(c) => {
                let v = if c < 0.0 { self.swap(v) } else { v };
                (v, self.emitter.constant(c.abs()))
            }
            RangeNumber::Parameter(splat) => {
                let zero = self.emitter.constant(0.0);
                let negative = self.emitter.compare(FloatCC::LessThan, splat, zero);
                let swapped = self.swap(v);
                (self.emitter.select(negative, swapped, v), self.emitter.abs(splat))
            }
        }
    }

    fn times(&mut self, v: Value, number: RangeNumber) -> Value {
        let (v, magnitude) = self.turned(v, number);
        let product = self.fmul(v, magnitude);
        self.up(product)
    }

    fn divide(&mut self, v: Value, number: RangeNumber) -> Value {
        let (v, magnitude) = self.turned(v, number);
        let quotient = self.emitter.builder.ins().fdiv(v, magnitude);
        self.up(quotient)
    }

    /// Division by a range that should not hold 0: multiplication by its reciprocals [−1/hi, 1/lo], which are
    /// −1 over the bounds of −b.
    fn quotient(&mut self, a: Value, b: Value) -> Value {
        let turned = self.swap(b);
        // −lo or hi is far below 0
        let nearest = self.min(b, turned);
        let limit = self.emitter.constant(-LEAST_DIVISOR);
        let is_near = self.emitter.compare(FloatCC::GreaterThan, nearest, limit);
        self.fail_where(is_near);
        let minus_one = self.emitter.constant(-1.0);
        let reciprocals = self.emitter.builder.ins().fdiv(minus_one, turned);
        let reciprocals = self.up(reciprocals);
        self.multiply(a, reciprocals)
    }

    /// Notes that there is no answer where a mask has ones.
    fn fail_where(&mut self, mask: Value) {
        self.pole = Some(match self.pole {
            Some(pole) => self.emitter.builder.ins().bor(pole, mask),
            None => mask,
        });
    }

    /// A range, or NaN where there is no answer.
    fn unless_at_a_pole(&mut self, range: Value) -> Value {
        let Some(pole) = self.pole else { return range };
        let unknown = self.emitter.constant(f64::NAN);
        self.emitter.select(pole, unknown, range)
    }

    /// The largest of the four products of bounds, and of their negatives.
    fn multiply(&mut self, a: Value, b: Value) -> Value {
        let (a_low, a_high) = (self.both(a, BoundLane::Low), self.both(a, BoundLane::High));
        let (b_low, b_high) = (self.both(b, BoundLane::Low), self.both(b, BoundLane::High));
        let (a_turned, b_turned) = (self.swap(a), self.swap(b));
        let (a_low, a_high) = (self.emitter.negate(a_low), self.emitter.negate(a_high));
        let products = [(a, b_high), (a_turned, b_low), (b, a_low), (b_turned, a_high)];
        let [p, q, r, s] = products.map(|(one, other)| self.fmul(one, other));
        let (pq, rs) = (self.emitter.max(p, q), self.emitter.max(r, s));
        let largest = self.emitter.max(pq, rs);
        self.up(largest)
    }

    /// One lane in both.
    fn both(&mut self, v: Value, lane: BoundLane) -> Value {
        let first = if lane == BoundLane::Low { 0 } else { 8 };
        self.shuffle(v, v, std::array::from_fn(|i| first + i as u8 % 8))
    }

    /// [−smallest, largest] magnitude in an interval.
    fn magnitudes(&mut self, v: Value) -> Value {
        let turned = self.swap(v);
        let largest = self.emitter.max(v, turned);
        let nearest = self.min(v, turned);
        let zero = self.emitter.constant(0.0);
        let nearest = self.min(nearest, zero);
        self.lanes(nearest, largest)
    }

    fn square(&mut self, v: Value) -> Value {
        let ends = self.magnitudes(v);
        let magnitudes = self.emitter.abs(ends);
        let squares = self.fmul(ends, magnitudes);
        let wide = self.up(squares);
        self.not_negative(wide)
    }

    /// Cuts off the part below zero that rounding to nearest and widening added: −lo ≤ 0.
    fn not_negative(&mut self, v: Value) -> Value {
        if self.rounding == Rounding::Upward {
            return v;
        }
        let limit = self.pair(0.0, f64::MAX);
        self.min(v, limit)
    }

    fn sqrt(&mut self, v: Value) -> Value {
        // rounding may have moved it below zero
        let lost = if self.rounding == Rounding::Upward { 0.0 } else { LOST_BELOW_ZERO };
        let most = self.pair(lost, f64::INFINITY);
        let is_negative = self.emitter.compare(FloatCC::LessThan, most, v);
        self.fail_where(is_negative);
        let limit = self.pair(-0.0, f64::MAX);
        let v = self.min(v, limit);
        let magnitude = self.emitter.abs(v);
        let root = self.emitter.builder.ins().sqrt(magnitude);
        // downwards by a factor, because the root itself was rounded upwards
        let signs = self.pair(-(1.0 - 2.0 * ULP), 1.0);
        let ends = self.fmul(root, signs);
        let wide = self.up(ends);
        self.not_negative(wide)
    }

    /// (p·e + q)·(r·e + s) of one node e, where p and r are ±1, from the values at the ends of e and at the
    /// point t of e nearest to the vertex.
    fn slab(&mut self, e: Value, first: Affine, second: Affine) -> Value {
        let plain = self.flip(e, BoundLane::Low);
        let turned = self.swap(plain);
        // a concave product has its largest value at t and its least at an end, so it is evaluated at [lo, t]
        // and [hi, t]; a convex one at [t, lo] and [t, hi]
        let concave = first.slope != second.slope;
        let (at_vertex, near, far) =
            if concave { (BoundLane::High, turned, plain) } else { (BoundLane::Low, plain, turned) };
        let (middle, slack) = self.vertex(first, second, at_vertex);
        let (above, below) = (self.emitter.max(near, middle), self.min(far, middle));
        let places = [self.min(above, far), self.emitter.max(below, near)];
        let [f, g] = places.map(|at| {
            let (p, q) = (self.factor(at, first), self.factor(at, second));
            let p = self.flip(p, BoundLane::Low);
            self.fmul(p, q)
        });
        let range = self.emitter.max(f, g);
        let magnitude = self.emitter.abs(range);
        let margin = self.emitter.constant(MARGIN);
        let margin = self.fmul(magnitude, margin);
        let margin = match slack {
            Some(slack) => self.fadd(margin, slack),
            None => margin,
        };
        self.add(range, margin)
    }

    /// slope · e ± offset for one value of e in each lane.
    fn factor(&mut self, e: Value, affine: Affine) -> Value {
        let Some(offset) = affine.offset else {
            return if affine.slope < 0.0 { self.emitter.negate(e) } else { e };
        };
        let offset = self.splat(offset);
        match (affine.slope < 0.0, affine.minus) {
            (false, false) => self.fadd(e, offset),
            (false, true) => self.emitter.builder.ins().fsub(e, offset),
            (true, _) => self.emitter.builder.ins().fsub(offset, e),
        }
    }

    /// A number in both lanes.
    fn splat(&mut self, node: Node) -> Value {
        // offsets are numbers: see `ir::bounds::range`
        match self.numbers[&node] {
            RangeNumber::Constant(c) => self.emitter.constant(c),
            RangeNumber::Parameter(splat) => splat,
        }
    }

    /// The vertex of a slab, halfway between its roots, in both lanes. Where rounding moves it by d, also d²
    /// in the lane of the value there, which misses the extreme value by d².
    fn vertex(&mut self, first: Affine, second: Affine, at_vertex: BoundLane) -> (Value, Option<Value>) {
        // the root of slope·e ± offset is ∓slope·offset
        let sign = |affine: Affine| if affine.minus { affine.slope } else { -affine.slope };
        let known = |affine: Affine| match affine.offset {
            None => Some(0.0),
            Some(node) => match self.numbers.get(&node) {
                Some(RangeNumber::Constant(c)) => Some(sign(affine) * c),
                _ => None,
            },
        };
        if let (Some(p), Some(q)) = (known(first), known(second)) {
            let sum = p + q;
            // the error of the sum, exactly (Knuth 1969)
            let (q_part, p_part) = (sum - p, sum - (sum - p));
            let exact = (p - p_part) + (q - q_part) == 0.0;
            let d = ULP * (p.abs() + q.abs());
            let slack = (!exact).then(|| self.signed(at_vertex, d * d, 0.0));
            return (self.emitter.constant(0.5 * sum), slack);
        }
        let mut roots = [first, second].map(|affine| match affine.offset {
            None => self.emitter.constant(0.0),
            Some(node) => {
                let splat = self.splat(node);
                if sign(affine) < 0.0 { self.emitter.negate(splat) } else { splat }
            }
        });
        let (sum, half) = (self.fadd(roots[0], roots[1]), self.emitter.constant(0.5));
        roots = roots.map(|root| self.emitter.abs(root));
        let (size, ulp) = (self.fadd(roots[0], roots[1]), self.signed(at_vertex, ULP, 0.0));
        let d = self.fmul(size, ulp);
        (self.fmul(sum, half), Some(self.fmul(d, d)))
    }

    /// The range of a ∧ b or a ∨ b: in the lane `and` the upper bound of a conjunction, in the other that of
    /// a disjunction, because −(u ∧ v) = −u ∨ −v.
    ///
    /// The bounds are u + v ∓ √(u² + v²) as written, widened by the cancelled digits. Where hardly any digit
    /// is left, the operands themselves bound the result and keep its sign exact: u ∧ v ≤ min(u, v), and with
    /// m = max(u, v) u ∨ v ≤ 4m where m > 0, ≤ ½m where m < 0 (2 + √2 and 2 − √2 but for underflow in the
    /// program). So no division has to follow the root.
    fn r0(&mut self, a: Value, b: Value, and: BoundLane) -> Value {
        let lost = self.emitter.constant(R0_UNDERFLOW);
        let sum = self.fadd(a, b);
        let sum = self.fadd(sum, lost);
        let (a2, b2) = (self.fmul(a, a), self.fmul(b, b));
        let squares = self.fadd(a2, b2);
        let root = self.emitter.builder.ins().sqrt(squares);
        let signs = self.signed(and, R0_MARGIN - 1.0, R0_MARGIN + 1.0);
        let root = self.fmul(root, signs);
        let bound = self.fadd(sum, root);

        let (least, most) = (self.min(a, b), self.emitter.max(a, b));
        let limit = match and {
            BoundLane::Low => self.lanes(least, most),
            BoundLane::High => self.lanes(most, least),
        };
        let (positive, negative) = (self.signed(and, 1.0, 4.0), self.signed(and, 1.0, 0.5));
        let (one, other) = (self.fmul(limit, positive), self.fmul(limit, negative));
        let limit = self.emitter.max(one, other);
        self.min(bound, limit)
    }
}
