//! Sines and cosines that programs compute themselves have the bits of `libm`, which the interpreter calls.

use super::compiled::{BatchProgram, PointProgram};
use super::number::Number;
use crate::codegen::Forms;
use crate::ir::{Axis, Binary, Graph, Interpreter, Node, Unary, UnaryFunction};

const SINE: Unary = Unary::Call(UnaryFunction::Sin);
const COSINE: Unary = Unary::Call(UnaryFunction::Cos);

/// High words of arguments at which `libm` changes its ways, and at which programs call it.
const BOUNDS: [u32; 15] = [
    0x0010_0000, // normal numbers
    0x3e46_a09e, // cos x = 1
    0x3e50_0000, // sin x = x
    0x3fe9_21fb, // π/4
    0x3ff9_21fb, // and multiples of it
    0x4002_d97c,
    0x4009_21fb,
    0x400f_6a7a,
    0x4012_d97c,
    0x4015_fdbc,
    0x4019_21fb,
    0x401c_463b,
    0x40e9_21fb, // 2¹⁵ π/2
    0x4139_21fb, // 2²⁰ π/2
    0x7ff0_0000, // infinity
];

struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mixed = (self.0 ^ self.0 >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ mixed >> 29
    }

    /// From −1 to 1.
    fn signed(&mut self) -> f64 {
        (self.bits() >> 10) as f64 / (1u64 << 53) as f64 - 1.0
    }

    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }

    /// Below 2 to some power.
    fn whole(&mut self, powers: u64) -> f64 {
        let limit = 1 << self.below(powers);
        self.below(limit) as f64
    }

    /// A number a few units in the last place beside another.
    fn beside(&mut self, x: f64) -> f64 {
        f64::from_bits(x.to_bits().wrapping_add(self.below(9)).wrapping_sub(4))
    }

    fn argument(&mut self) -> f64 {
        let quarter = std::f64::consts::FRAC_PI_2;
        match self.below(14) {
            0 => f64::from_bits(self.bits()),
            1 => 8.0 * self.signed(),
            2 => 100.0 * self.signed(),
            3 => 60_000.0 * self.signed(),
            4 => self.signed() * 2f64.powi(self.below(60) as i32 - 32),
            // halfway between multiples, too
            5 => {
                let multiple = self.below(80) as f64 - 40.0;
                self.beside(0.5 * quarter * multiple)
            }
            6 => {
                let multiple = self.whole(22);
                self.beside(quarter * multiple)
            }
            7 => {
                let word = BOUNDS[self.below(BOUNDS.len() as u64) as usize] + self.below(5) as u32 - 2;
                f64::from_bits(self.below(2) << 63 | u64::from(word) << 32 | self.bits() >> 32)
            }
            // where what remains is 2⁻¹⁶ of the argument, and where 2⁻¹⁶ is left to the next quadrant
            8 => {
                let multiple = quarter * self.whole(15);
                multiple * (1.0 + self.signed().signum() / 65_536.0 * (1.0 + 1e-4 * self.signed()))
            }
            9 => {
                let multiple = quarter * (self.whole(15) + 0.5);
                multiple + self.signed().signum() / 65_536.0 * (1.0 + 1e-4 * self.signed())
            }
            10 => quarter * self.below(64) as f64 + self.signed() * 2f64.powi(-(self.below(40) as i32)),
            11 => f64::from(f32::from_bits(self.bits() as u32)),
            // a few units of `f32` beside what it has for multiples, and beside where it is reduced otherwise
            12 => {
                let bits = match self.below(4) {
                    0 => 0x4dc9_0fdb,
                    _ => ((0.5 * quarter * self.below(40) as f64) as f32).to_bits(),
                };
                f64::from(f32::from_bits(bits.wrapping_add(self.below(9) as u32).wrapping_sub(4)))
            }
            _ => {
                let special = [0.0, 5e-324, 1e-310, f64::MIN_POSITIVE, f64::INFINITY, f64::NAN, f64::MAX];
                special[self.below(special.len() as u64) as usize].copysign(self.signed())
            }
        }
    }
}

#[track_caller]
fn assert_same<T: Number>(found: T, expected: T, what: &str, x: T) {
    let [found, expected, x] = [found, expected, x].map(T::to_f64);
    let same = found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan();
    assert!(same, "{what} {x:e} ({:#x}) is {expected:e}, not {found:e}", x.to_bits());
}

fn axes(graph: &mut Graph) -> [Node; 3] {
    [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis))
}

/// One argument with both, one with each, many at a time.
fn compare<T: Number>(arguments: usize, mut argument: impl FnMut(usize) -> T) {
    let mut graph = Graph::default();
    let [x, y, z] = axes(&mut graph);
    let outputs = [(SINE, x), (COSINE, x), (COSINE, y), (SINE, z)].map(|(f, at)| graph.unary(f, at));
    let program = BatchProgram::<T>::compile(&graph, &outputs, &Forms::default()).unwrap();
    const BLOCK: usize = 999;
    for _ in 0..arguments.div_ceil(3 * BLOCK) {
        let columns: [Vec<T>; 3] = std::array::from_fn(|axis| (0..BLOCK).map(|_| argument(axis)).collect());
        let mut found: [Vec<T>; 4] = std::array::from_fn(|_| vec![T::default(); BLOCK]);
        program.call(columns.each_ref().map(|c| &c[..]), &[], found.each_mut().map(|c| &mut c[..]));
        let [x, y, z] = &columns;
        for i in 0..BLOCK {
            assert_same(found[0][i], SINE.eval(x[i]), "sin", x[i]);
            assert_same(found[1][i], COSINE.eval(x[i]), "cos", x[i]);
            assert_same(found[2][i], COSINE.eval(y[i]), "cos", y[i]);
            assert_same(found[3][i], SINE.eval(z[i]), "sin", z[i]);
        }
    }
}

#[test]
fn waves_have_the_bits_of_the_library() {
    let mut random = Random(1);
    compare(3_000_000, |_| random.argument());
    compare(3_000_000, |_| random.argument() as f32);
}

#[test]
#[ignore = "some minutes"]
fn study_of_waves_for_a_billion_arguments() {
    let mut random = Random(2);
    compare(1_000_000_000, |_| random.argument());
}

#[test]
#[ignore = "some minutes"]
fn study_of_waves_for_all_numbers_in_f32() {
    let mut numbers = [0u32; 3];
    compare(3 << 32, |axis| {
        numbers[axis] = numbers[axis].wrapping_add(0x9e37_79b1); // odd, so that none is left out
        f32::from_bits(numbers[axis])
    });
}

fn compare_one_by_one<T: Number>(arguments: usize, mut argument: impl FnMut() -> T) {
    let mut graph = Graph::default();
    let [x, y, z] = axes(&mut graph);
    let outputs = [(SINE, x), (COSINE, x), (SINE, y), (COSINE, z)].map(|(f, at)| graph.unary(f, at));
    let program = PointProgram::<T>::compile(&graph, &outputs, &Forms::default()).unwrap();
    for _ in 0..arguments / 3 {
        let [x, y, z] = std::array::from_fn(|_| argument());
        let mut found = [T::default(); 4];
        program.call([x, y, z], &[], &mut found);
        assert_same(found[0], SINE.eval(x), "sin", x);
        assert_same(found[1], COSINE.eval(x), "cos", x);
        assert_same(found[2], SINE.eval(y), "sin", y);
        assert_same(found[3], COSINE.eval(z), "cos", z);
    }
}

#[test]
fn waves_at_one_point_have_the_bits_of_the_library() {
    let mut random = Random(3);
    compare_one_by_one(500_000, || random.argument());
    compare_one_by_one(500_000, || random.argument() as f32);
}

/// Rare arguments beside common ones, while many other values wait in registers.
#[test]
fn rare_arguments_disturb_nothing_around_them() {
    let mut graph = Graph::default();
    let axes = axes(&mut graph);
    // polynomials that are computed before and used after the waves
    let powers: Vec<Node> = (0..24).fold(axes.to_vec(), |mut powers, i| {
        let next = graph.binary(if i % 3 == 0 { Binary::Mul } else { Binary::Add }, powers[i], powers[i + 2]);
        powers.push(next);
        powers
    });
    let waves: Vec<Node> = powers
        .iter()
        .step_by(2)
        .flat_map(|&power| [SINE, COSINE].map(|function| graph.unary(function, power)))
        .collect();
    let sum = |graph: &mut Graph, nodes: &[Node]| {
        nodes.iter().copied().reduce(|a, b| graph.binary(Binary::Add, a, b)).unwrap()
    };
    let sums = [sum(&mut graph, &powers), sum(&mut graph, &waves)];
    let outputs = [sums[0], sums[1], graph.binary(Binary::Mul, sums[0], sums[1])];
    let program = BatchProgram::<f64>::compile(&graph, &outputs, &Forms::default()).unwrap();
    let interpreter = Interpreter::new(&graph, &outputs);
    let mut random = Random(4);
    for _ in 0..3000 {
        let columns: [[f64; 5]; 3] =
            std::array::from_fn(|_| [1.0, 0.1, 10.0, 1e3, 1e6].map(|size| size * random.signed()));
        let mut found = [[0.0; 5]; 3];
        program.call(columns.each_ref().map(|c| &c[..]), &[], found.each_mut().map(|c| &mut c[..]));
        for i in 0..5 {
            let mut expected = [0.0; 3];
            interpreter.eval_f64(columns.map(|c| c[i]), &mut expected);
            for (column, expected) in std::iter::zip(found, expected) {
                assert_same(column[i], expected, "the sum at", columns[0][i]);
            }
        }
    }
}
