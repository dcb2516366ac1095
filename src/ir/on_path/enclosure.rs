//! A leaf along a straight path, enclosed: u(t₀ + s) ∈ C₀ + C₁s + C₂s² for 0 ≤ s ≤ t₁ − t₀, with intervals as
//! coefficients.
//!
//! C₀ and C₁ are the value and the derivative at t₀, C₂ encloses half the second derivative over the whole
//! stretch: Taylor's theorem with its remainder. The enclosure narrows with the cube of the stretch. Where a
//! derivative does not exist (min and max at a tie, |a| at 0) its generalised gradient takes the place of C₁,
//! and C₂ is zero. Where the derivative is unknown, [`Enclosure::range`] still holds.

use std::cell::RefCell;

use crate::interval::Interval;
use crate::ir::bounds::range::{self, RangeRule};
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::lookup::{Lookup, Part, Tables};
use crate::ir::op::{Binary, Unary};

/// What is known of a leaf along a stretch of a path.
#[derive(Debug, Clone, Copy)]
pub struct Enclosure {
    /// Coefficients of 1, s and s²; all reals where a derivative is not known.
    pub coefficients: [Interval; 3],
    /// All values on the stretch.
    pub range: Interval,
}

/// A graph prepared for enclosures along paths.
#[derive(Debug, Clone)]
pub struct EnclosureEvaluator {
    steps: Vec<(Expr, RangeRule)>,
    root: Node,
    tables: Tables,
}

/// The Taylor coefficients of one node: at t₀, and over the stretch.
#[derive(Debug, Clone, Copy)]
struct Jet {
    at: [Interval; 2],
    over: [Interval; 3],
}

const ZERO: Interval = Interval::point(0.0);

thread_local! {
    static SCRATCH: RefCell<Vec<Jet>> = const { RefCell::new(Vec::new()) };
}

impl EnclosureEvaluator {
    /// Prepares a root of a graph.
    pub fn new(graph: &Graph, root: Node) -> Self {
        let steps = graph.nodes().map(|(_, expr)| (expr, RangeRule::of(graph, expr))).collect();
        Self { steps, root, tables: graph.tables().clone() }
    }

    /// The enclosure over the part [t₀, t₁] of the path between two points (x, y, z and time), for a graph
    /// with parameters.
    pub fn enclose(
        &self,
        from: [f64; 4],
        to: [f64; 4],
        (t0, t1): (f64, f64),
        parameters: &[f64],
    ) -> Enclosure {
        let stretch = Interval::new(0.0, (t1 - t0).next_up());
        let axes: [Jet; 4] = std::array::from_fn(|i| {
            let slope = Interval::point(to[i]) - Interval::point(from[i]);
            let place = |t| Interval::point(from[i]) + slope * t;
            let over = [place(Interval::new(t0, t1)), slope, ZERO];
            Jet { at: [place(Interval::point(t0)), slope], over }
        });
        SCRATCH.with_borrow_mut(|jets| {
            jets.clear();
            for &(expr, step) in &self.steps {
                let mut jet = jet(expr, jets, axes, parameters, &self.tables);
                if let RangeRule::Square(_) | RangeRule::Slab { .. } = step {
                    jet.over[0] = step.over(|node| jets[node.index()].over[0]).unwrap_or(jet.over[0]);
                }
                jets.push(jet.tightened(stretch));
            }
            let Jet { at, over } = jets[self.root.index()];
            let bounded = over[2].lo.is_finite() && over[2].hi.is_finite();
            let coefficients = if bounded { [at[0], at[1], over[2]] } else { [at[0], over[1], ZERO] };
            Enclosure { coefficients, range: over[0] }
        })
    }
}

impl Jet {
    fn constant(value: f64) -> Self {
        let value = Interval::new(value, value);
        Self { at: [value, ZERO], over: [value, ZERO, ZERO] }
    }

    /// A node whose range is known, but not its derivatives.
    fn rough(at: Interval, over: Interval) -> Self {
        Self { at: [at, Interval::ALL], over: [over, Interval::ALL, Interval::ALL] }
    }

    /// The range no wider than the mean-value form says.
    fn tightened(mut self, stretch: Interval) -> Self {
        if self.over[0] != Interval::ALL {
            let other = self.at[0] + self.over[1] * stretch;
            let (lo, hi) = (self.over[0].lo.max(other.lo), self.over[0].hi.min(other.hi));
            if lo <= hi {
                self.over[0] = Interval { lo, hi };
            }
        }
        self
    }
}

fn jet(expr: Expr, jets: &[Jet], axes: [Jet; 4], parameters: &[f64], tables: &Tables) -> Jet {
    match expr {
        Expr::Constant(bits) => Jet::constant(f64::from_bits(bits)),
        Expr::Coordinate(Axis::X) => axes[0],
        Expr::Coordinate(Axis::Y) => axes[1],
        Expr::Coordinate(Axis::Z) => axes[2],
        Expr::Coordinate(Axis::T) => axes[3],
        // leaves keep time itself: their uniforms are not hoisted here
        Expr::Uniform(_) => Jet::constant(f64::NAN),
        Expr::Parameter(i) => Jet::constant(parameters.get(i as usize).copied().unwrap_or(f64::NAN)),
        Expr::Unary(op, a) => unary(op, jets[a.index()]),
        Expr::Binary(op, a, b) => binary(op, jets[a.index()], jets[b.index()]),
        Expr::Lookup(at, place) => lookup(at, place.map(|node| jets[node.index()]), tables),
    }
}

/// The shape of a table is unknown: its slope is one of those that it has on the stretch.
fn lookup(lookup: Lookup, place: [Jet; 3], tables: &Tables) -> Jet {
    let at = lookup.range(tables, place.map(|jet| jet.at[0]));
    let over = lookup.range(tables, place.map(|jet| jet.over[0]));
    match lookup.part {
        Part::Value => {
            let slopes = lookup.slopes(tables, place.map(|jet| jet.over[0]));
            let along = |rate: fn(&Jet) -> Interval| {
                std::iter::zip(slopes, &place).fold(ZERO, |sum, (slope, jet)| sum + slope * rate(jet))
            };
            let slope = along(|jet| jet.over[1]);
            Jet { at: [at, along(|jet| jet.at[1])], over: [over, slope, Interval::ALL] }
        }
        Part::Slope(_) => Jet::rough(at, over),
    }
}

fn half(a: Interval) -> Interval {
    a * Interval::point(0.5)
}

/// f(a): with p = f′(a) and q = ½f″(a) as functions of a, the coefficients are f, p·a₁ and p·a₂ + q·a₁².
fn chain(
    a: Jet,
    value: impl Fn(Interval) -> Interval,
    derivatives: impl Fn(Interval, Interval) -> Option<[Interval; 2]>,
) -> Jet {
    let (at, over) = (value(a.at[0]), value(a.over[0]));
    let (Some([p, _]), Some([slope, bend])) = (derivatives(a.at[0], at), derivatives(a.over[0], over)) else {
        return Jet::rough(at, over);
    };
    Jet {
        at: [at, p * a.at[1]],
        over: [over, slope * a.over[1], slope * a.over[2] + bend * a.over[1].square()],
    }
}

fn unary(op: Unary, a: Jet) -> Jet {
    let one = Interval::point(1.0);
    let value = |a: Interval| range::unary(op, a);
    match op {
        Unary::Neg => Jet { at: a.at.map(|c| -c), over: a.over.map(|c| -c) },
        Unary::Abs => {
            if a.over[0].lo > 0.0 {
                a
            } else if a.over[0].hi < 0.0 {
                unary(Unary::Neg, a)
            } else {
                either(value(a.at[0]), value(a.over[0]), a, unary(Unary::Neg, a))
            }
        }
        Unary::Sqrt => chain(a, value, |a, root| {
            let slope = half(one / root);
            Some([slope, -half(half(slope / a))])
        }),
        Unary::Sign | Unary::Floor | Unary::Round => {
            let (at, over) = (value(a.at[0]), value(a.over[0]));
            if over.lo == over.hi { Jet::constant(over.lo) } else { Jet::rough(at, over) }
        }
        Unary::Call(function) => chain(a, value, |a, value| function.slope_and_bend(a, value)),
    }
}

fn binary(op: Binary, a: Jet, b: Jet) -> Jet {
    use Binary::{
        Add, And, AndWeight, Call, Div, DivOrZero, Max, MaxWeight, Min, MinWeight, Mul, MulOrZero, Or,
        OrWeight, PlainMax, PlainMin, Sub,
    };
    let (at, over) = (range::binary(op, a.at[0], b.at[0]), range::binary(op, a.over[0], b.over[0]));
    match op {
        Add => {
            Jet { at: [at, a.at[1] + b.at[1]], over: [over, a.over[1] + b.over[1], a.over[2] + b.over[2]] }
        }
        Sub => {
            Jet { at: [at, a.at[1] - b.at[1]], over: [over, a.over[1] - b.over[1], a.over[2] - b.over[2]] }
        }
        Mul => {
            let ([a0, a1, a2], [b0, b1, b2]) = (a.over, b.over);
            Jet {
                at: [at, a.at[0] * b.at[1] + a.at[1] * b.at[0]],
                over: [over, a0 * b1 + a1 * b0, a0 * b2 + a1 * b1 + a2 * b0],
            }
        }
        MulOrZero if over.lo == 0.0 && over.hi == 0.0 => Jet::constant(0.0),
        MulOrZero if !b.over[0].contains(0.0) => binary(Mul, a, b),
        Div | DivOrZero => {
            // q·b = a, coefficient by coefficient
            let ([_, a1, a2], [b0, b1, b2]) = (a.over, b.over);
            let slope = (a1 - over * b1) / b0;
            Jet {
                at: [at, (a.at[1] - at * b.at[1]) / b.at[0]],
                over: [over, slope, (a2 - over * b2 - slope * b1) / b0],
            }
        }
        Min | PlainMin if a.over[0].hi < b.over[0].lo => a,
        Min | PlainMin if b.over[0].hi < a.over[0].lo => b,
        Max | PlainMax if a.over[0].lo > b.over[0].hi => a,
        Max | PlainMax if b.over[0].lo > a.over[0].hi => b,
        Min | Max | PlainMin | PlainMax => either(at, over, a, b),
        And | Or => {
            // u + v ∓ √(u² + v²) for the derivatives; where the root vanishes, both weights lie between 0 and
            // 2
            let sum = binary(Add, a, b);
            let hypotenuse = unary(Unary::Sqrt, binary(Add, binary(Mul, a, a), binary(Mul, b, b)));
            let smooth = binary(if op == And { Sub } else { Add }, sum, hypotenuse);
            let weight = Interval { lo: 0.0, hi: 2.0_f64.next_up() };
            let mixed = |k: usize, of: fn(&Jet, usize) -> Interval, smooth: Interval| {
                if smooth == Interval::ALL { weight * of(&a, k) + weight * of(&b, k) } else { smooth }
            };
            Jet {
                at: [at, mixed(1, |jet, k| jet.at[k], smooth.at[1])],
                over: [over, mixed(1, |jet, k| jet.over[k], smooth.over[1]), smooth.over[2]],
            }
        }
        // these jump, or nothing is known of their derivatives
        MulOrZero | MinWeight | MaxWeight | AndWeight | OrWeight | Call(_) => Jet::rough(at, over),
    }
}

/// A function that is now one, now the other: its slope lies between theirs.
fn either(at: Interval, over: Interval, a: Jet, b: Jet) -> Jet {
    Jet { at: [at, a.at[1].hull(b.at[1])], over: [over, a.over[1].hull(b.over[1]), Interval::ALL] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::{Given, Interpreter};

    /// Values on random stretches against the enclosure, for every operation.
    #[test]
    fn no_value_is_outside_its_enclosure() {
        let mut graph = Graph::default();
        let (x, y, z) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y), graph.coordinate(Axis::Z));
        let half = graph.constant(0.5);
        let z2 = graph.binary(Binary::Mul, z, z);
        let inner = graph.binary(Binary::Add, y, z2);
        let positive = graph.binary(Binary::Add, inner, half);
        let t = graph.coordinate(Axis::T);
        let mut roots = Vec::new();
        for op in Unary::all() {
            let inside = graph.unary(op, positive);
            roots.push((op.name(), graph.binary(Binary::Mul, inside, x)));
            let moving = graph.binary(Binary::Add, positive, t);
            let inside = graph.unary(op, moving);
            roots.push((op.name(), graph.binary(Binary::Mul, inside, x)));
        }
        for op in Binary::all() {
            let inside = graph.binary(op, positive, x);
            roots.push((op.name(), graph.binary(Binary::Add, inside, z)));
        }
        let mut seed = 5u64;
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        for (name, root) in roots {
            let (small, root) = graph.extract_cone(root);
            let (enclosures, interpreter) =
                (EnclosureEvaluator::new(&small, root), Interpreter::new(&small, &[root]));
            for _ in 0..2_000 {
                let from: [f64; 4] = std::array::from_fn(|_| random());
                let to: [f64; 4] = std::array::from_fn(|_| random());
                let t0 = random();
                let t1 = t0 + (1.0 - t0) * random().powi(4);
                let Enclosure { coefficients: [c0, c1, c2], range } =
                    enclosures.enclose(from, to, (t0, t1), &[]);
                for k in 0..=4 {
                    let s = (t1 - t0) * f64::from(k) / 4.0;
                    let [x, y, z, time] = std::array::from_fn(|i| from[i] + (to[i] - from[i]) * (t0 + s));
                    let mut out = [0.0];
                    interpreter.eval_given(Given { time, ..Given::point([x, y, z]) }, &mut out);
                    let step = Interval::point(s);
                    let polynomial = c0 + c1 * step + c2 * step.square();
                    // the point itself is rounded
                    let slack = 1e-13 * (1.0 + out[0].abs());
                    let near = |over: Interval| over.lo - slack <= out[0] && out[0] <= over.hi + slack;
                    assert!(
                        out[0].is_nan() || near(polynomial) && near(range),
                        "{name}: {} not in {polynomial:?} or {range:?}",
                        out[0]
                    );
                }
            }
        }
    }

    #[test]
    fn enclosures_narrow_with_the_cube_of_the_stretch() {
        // √(x² + y²) past the axis at half a unit
        let mut g = Graph::default();
        let (x, y) = (g.coordinate(Axis::X), g.coordinate(Axis::Y));
        let (x2, y2) = (g.binary(Binary::Mul, x, x), g.binary(Binary::Mul, y, y));
        let sum = g.binary(Binary::Add, x2, y2);
        let root = g.unary(Unary::Sqrt, sum);
        let enclosures = EnclosureEvaluator::new(&g, root);
        let width = |w: f64| {
            let found = enclosures.enclose([-1.0, 0.5, 0.0, 0.0], [1.0, 0.5, 0.0, 0.0], (0.4, 0.4 + w), &[]);
            found.coefficients[2].width() * w * w
        };
        let ratio = width(1e-2) / width(1e-3);
        assert!((500.0..2000.0).contains(&ratio), "{ratio}");
    }
}
