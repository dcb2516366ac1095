//! Formulas in pieces: `round(z/d)` has one value on each side of its jumps.
//!
//! A box in which a formula may jump has a range that mixes both sides: the coils one pitch below and one
//! pitch above a coil of a spring seem to meet. If each value of the jump is treated separately, the bounds
//! are those of two smooth formulas, and a box that is far from the surface is recognised as far.

use std::sync::OnceLock;

use rustc_hash::FxHashSet;
use smallvec::SmallVec;

use crate::codegen;
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{Expr, Graph, Node, RangeEvaluator, Region, Unary, choosing_numbers};
use crate::solid::programs::compiled::RangeProgram;

/// Jumps of a formula that are looked at, those that others depend on first.
const MOST_JUMPS: usize = 3;

/// Values of one jump in a box. Boxes with more of them are large.
const MOST_VALUES: f64 = 4.0;

/// Whole numbers up to here have neighbours at a distance of 1.
const LARGEST_JUMP: f64 = 1e15;

/// Pieces of a formula in a box.
const MOST_PIECES: usize = 8;

/// A formula at rest with numbers in place of its jumps.
pub struct Pieces {
    /// The jump of number i is its uniform i.
    formula: Ranges,
    jumps: Vec<Jump>,
}

struct Jump {
    operation: Unary,
    /// It may depend on earlier jumps.
    argument: Ranges,
}

/// Ranges of one formula.
struct Ranges {
    graph: Graph,
    evaluator: RangeEvaluator,
    parameters: usize,
    code: OnceLock<Option<RangeProgram>>,
}

/// The values of some jumps of a formula.
type Values = SmallVec<[f64; MOST_JUMPS]>;

impl Pieces {
    /// `None` for a formula without jumps.
    pub fn new(graph: &Graph, root: Node, parameters: usize) -> Option<Self> {
        let used = graph.reachable(&[root]);
        // an operation that only chooses between two values has ranges that know it
        let known: FxHashSet<Node> = choosing_numbers(graph).into_iter().collect();
        let mut out = Graph::like(graph);
        let mut image: Vec<Option<Node>> = Vec::with_capacity(graph.len());
        let mut jumps: Vec<Jump> = Vec::new();
        for (node, expr) in graph.nodes() {
            let new = match expr {
                _ if !used[node.index()] => None,
                Expr::Unary(operation @ (Unary::Floor | Unary::Round), argument)
                    if jumps.len() < MOST_JUMPS && !known.contains(&node) =>
                {
                    let argument = Ranges::new(&out, image[argument.index()]?, parameters);
                    jumps.push(Jump { operation, argument });
                    Some(out.intern(Expr::Uniform(jumps.len() as u32 - 1), graph.span(node)))
                }
                other => {
                    // operands of what is used are used, and come before it
                    other.operands().map(|operand| image[operand.index()]).collect::<Option<Vec<_>>>()?;
                    let mapped = other.map(|operand| image[operand.index()].unwrap_or(operand));
                    Some(out.intern(mapped, graph.span(node)))
                }
            };
            image.push(new);
        }
        let formula = Ranges::new(&out, image[root.index()]?, parameters);
        (!jumps.is_empty()).then_some(Self { formula, jumps })
    }

    /// Whether machine code may answer for a leaf with these numbers.
    pub fn is_tame(&self, parameters: &[f64]) -> bool {
        let everywhere =
            Aabb::new(-codegen::RANGE_REACH * glam::DVec3::ONE, codegen::RANGE_REACH * glam::DVec3::ONE);
        let mut values: SmallVec<[Interval; MOST_JUMPS]> = SmallVec::new();
        for jump in &self.jumps {
            let numbers = Region { parameters, uniforms: &values, ..Region::of(&everywhere) };
            if !jump.argument.is_tame(numbers) {
                return false;
            }
            let argument = jump.argument.evaluator.eval_with(&numbers);
            values.push(Interval::new(jump.operation.eval(argument.lo), jump.operation.eval(argument.hi)));
        }
        self.formula.is_tame(Region { parameters, uniforms: &values, ..Region::of(&everywhere) })
    }

    /// The range over a box, as the hull of the ranges of the pieces in it. `None` where there is one piece or very
    /// many, or one that may be undefined.
    pub fn range(&self, over: &Aabb, parameters: &[f64], by_code: bool) -> Option<Interval> {
        let mut pieces: SmallVec<[Values; MOST_PIECES]> = SmallVec::from_iter([Values::new()]);
        for jump in &self.jumps {
            let mut longer = SmallVec::new();
            for values in &pieces {
                let argument = jump.argument.range(over, parameters, values, by_code);
                let (first, last) = (jump.operation.eval(argument.lo), jump.operation.eval(argument.hi));
                let width = last - first;
                if !width.is_finite() || width >= MOST_VALUES || first.abs().max(last.abs()) > LARGEST_JUMP {
                    return None;
                }
                for further in 0..=width as u32 {
                    longer.push(values.iter().copied().chain([first + f64::from(further)]).collect());
                }
            }
            if longer.len() > MOST_PIECES {
                return None;
            }
            pieces = longer;
        }
        if pieces.len() < 2 {
            return None;
        }
        let ranges = pieces.iter().map(|values| self.formula.range(over, parameters, values, by_code));
        ranges.map(|range| (range != Interval::ALL).then_some(range)).reduce(|a, b| Some(a?.hull(b?)))?
    }
}

impl Ranges {
    fn new(graph: &Graph, root: Node, parameters: usize) -> Self {
        let (graph, root) = graph.extract_cone(root);
        let evaluator = RangeEvaluator::new(&graph, root);
        Self { graph, evaluator, parameters, code: OnceLock::new() }
    }

    fn is_tame(&self, numbers: Region<'_>) -> bool {
        codegen::range_stays_finite(&self.graph, &self.evaluator, numbers)
    }

    fn range(&self, over: &Aabb, parameters: &[f64], jumps: &[f64], by_code: bool) -> Interval {
        // the root is the last node of its cone
        let compile = || {
            RangeProgram::with_parameters(&self.graph, self.graph.node(self.graph.len() - 1), self.parameters)
                .ok()
        };
        if by_code
            && let Some(code) = self.code.get_or_init(compile)
            && let pairs = jumps.iter().map(|&value| [value; 2]).collect::<SmallVec<[[f64; 2]; MOST_JUMPS]>>()
            && let Some(range) = code.call(over, parameters, &pairs)
        {
            return range;
        }
        let uniforms: SmallVec<[Interval; MOST_JUMPS]> =
            jumps.iter().map(|&value| Interval::point(value)).collect();
        self.evaluator.eval_with(&Region { parameters, uniforms: &uniforms, ..Region::of(over) })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::ir::{Axis, Binary, Given, Interpreter};

    /// 0.04 − (z − 0.3·round(z/0.3 − x))², and what is repeated twice: 0.01 − (x − round(x))² − (y − floor(y))²
    fn formulas() -> [(Graph, Node); 2] {
        let mut coils = Graph::default();
        let [x, z] = [Axis::X, Axis::Z].map(|axis| coils.coordinate(axis));
        let [pitch, most] = [0.3, 0.04].map(|number| coils.constant(number));
        let turns = coils.binary(Binary::Div, z, pitch);
        let turns = coils.binary(Binary::Sub, turns, x);
        let turn = coils.unary(Unary::Round, turns);
        let middle = coils.binary(Binary::Mul, turn, pitch);
        let height = coils.binary(Binary::Sub, z, middle);
        let square = coils.binary(Binary::Mul, height, height);
        let first = coils.binary(Binary::Sub, most, square);

        let mut cells = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| cells.coordinate(axis));
        let squares = [(x, Unary::Round), (y, Unary::Floor)].map(|(place, step)| {
            let middle = cells.unary(step, place);
            let way = cells.binary(Binary::Sub, place, middle);
            cells.binary(Binary::Mul, way, way)
        });
        let most = cells.constant(0.01);
        let rest = cells.binary(Binary::Sub, most, squares[0]);
        let second = cells.binary(Binary::Sub, rest, squares[1]);
        [(coils, first), (cells, second)]
    }

    #[test]
    fn ranges_of_pieces_hold_every_value_and_are_narrow_beside_a_jump() {
        let mut narrower = 0;
        for (graph, root) in formulas() {
            let pieces = Pieces::new(&graph, root, 0).unwrap();
            assert!(pieces.is_tame(&[]));
            let whole = RangeEvaluator::new(&graph, root);
            let interpreter = Interpreter::new(&graph, &[root]);
            for i in 0..2000 {
                let at = |k: u32| f64::from((i * 7919 + k * 104_729) % 10_007) / 10_007.0;
                let low = DVec3::new(at(1), at(2), at(3)) * 4.0 - 2.0;
                let over = Aabb::new(low, low + DVec3::new(at(4), at(5), at(6)) * 0.2);
                for by_code in [false, true] {
                    let Some(range) = pieces.range(&over, &[], by_code) else { continue };
                    narrower += usize::from(range.width() < 0.9 * whole.eval(&over).width());
                    for k in 0..27 {
                        let part = DVec3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)) / 2.0;
                        let p = over.min + part * over.size();
                        let mut value = [0.0];
                        interpreter.eval_f64(p.to_array(), &mut value);
                        assert!(range.lo <= value[0] && value[0] <= range.hi, "{value:?} {range:?} {over:?}");
                    }
                }
            }
        }
        assert!(narrower > 300, "{narrower}");
    }

    /// 0.2 − (x − p₀·round(x/p₀ + 0.4·floor(y/p₁)))²: a jump that depends on another one, and two parameters
    #[test]
    fn jumps_of_jumps_and_parameters() {
        let mut graph = Graph::default();
        let [x, y] = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
        let [wide, high] = [0, 1].map(|number| graph.intern(Expr::Parameter(number), None));
        let [part, most] = [0.4, 0.2].map(|number| graph.constant(number));
        let row = graph.binary(Binary::Div, y, high);
        let row = graph.unary(Unary::Floor, row);
        let shift = graph.binary(Binary::Mul, part, row);
        let column = graph.binary(Binary::Div, x, wide);
        let column = graph.binary(Binary::Add, column, shift);
        let column = graph.unary(Unary::Round, column);
        let middle = graph.binary(Binary::Mul, column, wide);
        let way = graph.binary(Binary::Sub, x, middle);
        let square = graph.binary(Binary::Mul, way, way);
        let root = graph.binary(Binary::Sub, most, square);
        let pieces = Pieces::new(&graph, root, 2).unwrap();
        assert_eq!(pieces.jumps.len(), 2);
        let interpreter = Interpreter::new(&graph, &[root]);
        let parameters = [0.7, 0.9];
        assert!(pieces.is_tame(&parameters));
        let mut seen = 0;
        for i in 0..2000 {
            let at = |k: u32| f64::from((i * 7919 + k * 104_729) % 10_007) / 10_007.0;
            let low = DVec3::new(at(1), at(2), at(3)) * 4.0 - 2.0;
            let over = Aabb::new(low, low + DVec3::new(at(4), at(5), at(6)) * 0.3);
            let ranges = [false, true].map(|by_code| pieces.range(&over, &parameters, by_code));
            let [Some(range), Some(by_code)] = ranges else {
                assert_eq!(ranges, [None; 2]);
                continue;
            };
            seen += 1;
            for k in 0..9 {
                let part = DVec3::new(f64::from(k % 3), f64::from(k / 3), 0.0) / 2.0;
                let p = (over.min + part * over.size()).to_array();
                let mut value = [0.0];
                interpreter.eval_given(Given { parameters: &parameters, ..Given::point(p) }, &mut value);
                for range in [range, by_code] {
                    assert!(range.lo <= value[0] && value[0] <= range.hi, "{value:?} {range:?} {over:?}");
                }
            }
        }
        assert!(seen > 300, "{seen}");
    }

    #[test]
    fn a_box_between_two_coils_is_seen_to_be_outside() {
        let [(graph, root), _] = formulas();
        // round(z/0.3) jumps at 0.15: both coils are 0.15 away, but with either of both numbers the formula seems to be
        // anywhere up to its greatest value
        let over = Aabb::new(DVec3::new(-0.01, 0.0, 0.14), DVec3::new(0.01, 0.0, 0.16));
        let range = Pieces::new(&graph, root, 0).unwrap().range(&over, &[], true).unwrap();
        assert!(RangeEvaluator::new(&graph, root).eval(&over).hi >= 0.04);
        assert!(range.hi < 0.04 - 0.13 * 0.13, "{range:?}");
    }

    #[test]
    fn formulas_without_jumps_and_boxes_with_many_have_no_pieces() {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        assert!(Pieces::new(&graph, x, 0).is_none());
        let root = graph.unary(Unary::Floor, x);
        let pieces = Pieces::new(&graph, root, 0).unwrap();
        let over = |width: f64| Aabb::new(DVec3::ZERO, DVec3::splat(width));
        assert_eq!(pieces.range(&over(0.5), &[], true), None);
        assert_eq!(pieces.range(&over(2.5), &[], true), Some(Interval::new(0.0, 2.0)));
        assert_eq!(pieces.range(&over(100.0), &[], true), None);
        assert_eq!(pieces.range(&over(f64::INFINITY), &[], false), None);
        // where whole numbers are farther apart than 1
        let far = Aabb::new(DVec3::splat(1e16), DVec3::splat(1e16 + 2.0));
        assert_eq!(pieces.range(&far, &[], false), None);
    }
}
