//! Obstacles that are one shape or another, as the time says: `if t <= 1 then gate else sphere(0.1)`.
//!
//! Between two switches such a solid is at rest, and a solid at rest costs a part of one that changes its shape: its
//! formula has no time, its contacts need not be searched for, and its map is made once. So it is compiled for each of its
//! shapes, as soon as a step needs it. A step with a switch takes the solid with its time.

use std::sync::{Arc, Mutex, PoisonError};

use crate::Engine;
use crate::Solid;
use crate::field::{Moving, Walls};
use crate::geom::Placement;
use crate::ir::{Binary, Expr, Graph, Node, Outside, Uniforms, at_instant, hoisted};

/// The most shapes of one solid: each is compiled.
const MOST_SHAPES: usize = 8;

/// The most switches: at all other times it must be at rest.
const MOST_SWITCHES: usize = 32;

/// Stretches of a run in which a solid is looked at first. A shape that stays for less between two stretches may be passed
/// over; a step that meets it takes the solid with its time.
const STRETCHES: u32 = 512;

/// A stretch in which a solid changes is halved so often until it is a switch: it is far shorter than any step then. What takes
/// longer to change is no switch, however long the run is.
const MOST_HALVINGS: u32 = 32;

/// A solid that is at rest but for switches.
pub(super) struct Switched {
    whole: Solid,
    engine: Engine,
    /// The numbers of its formula that depend on time alone.
    numbers: Uniforms,
    /// The shapes that were needed so far, each with those numbers' bits; `None` for one that cannot be compiled alone.
    shapes: Mutex<Vec<(Vec<u64>, Option<Solid>)>>,
}

impl Switched {
    /// The solid with the shape `shape` in a run that ends at `until`, s; `None` if it is not known to be at rest between a
    /// few switches.
    pub fn of(graph: &Graph, shape: Node, whole: &Solid, until: f64, engine: Engine) -> Option<Arc<Self>> {
        let numbers = hoisted(graph, &[shape], Outside::Time).uniforms;
        let at = |k: u32| until * f64::from(k) / f64::from(STRETCHES);
        let mut stretches: Vec<(f64, f64, u32)> = (0..STRETCHES).map(|k| (at(k), at(k + 1), 0)).collect();
        let (mut switches, mut shapes) = (0, Vec::new());
        while let Some((from, to, halvings)) = stretches.pop() {
            match numbers.at_rest(from, to) {
                Some(key) if shapes.contains(&key) => {}
                Some(key) => shapes.push(key),
                None if halvings < MOST_HALVINGS => {
                    let middle = 0.5 * (from + to);
                    stretches.extend([(from, middle, halvings + 1), (middle, to, halvings + 1)]);
                }
                None => switches += 1,
            }
            if switches > MOST_SWITCHES || shapes.len() > MOST_SHAPES {
                return None;
            }
        }
        let switched = Self { whole: whole.clone(), engine, numbers, shapes: Mutex::default() };
        Some(Arc::new(switched))
    }

    /// The solid as one at rest; `None` if it switches between two times, s, or has had too many shapes.
    fn at_rest(&self, from: f64, to: f64) -> Option<Solid> {
        let key = self.numbers.at_rest(from, to)?;
        let mut shapes = self.shapes.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, solid)) = shapes.iter().find(|(known, _)| *known == key) {
            return solid.clone();
        }
        if shapes.len() >= MOST_SHAPES {
            return None;
        }
        let (graph, root) = self.whole.formula();
        let (graph, root) = at_instant(graph, root, to);
        let (graph, root) = without_choices(&graph, root);
        let solid = Solid::new(self.whole.name(), &graph, root, self.engine).ok();
        shapes.push((key, solid.clone()));
        solid
    }
}

/// A formula with what is chosen in place of choices a·1 + b·0. (As sums they are doubtful: each of their contacts was
/// searched for, and a run with a gate that opens took six times as long.)
fn without_choices(graph: &Graph, root: Node) -> (Graph, Node) {
    let mut chosen = Graph::like(graph);
    let mut image: Vec<Node> = Vec::with_capacity(graph.len());
    for (node, expr) in graph.nodes() {
        let of = |operand: Node| image[operand.index()];
        let number = |operand: Node| chosen.as_constant(of(operand));
        let only = match expr {
            Expr::Binary(Binary::MulOrZero, a, b) if number(b) == Some(1.0) => Some(of(a)),
            Expr::Binary(Binary::MulOrZero, _, b) if number(b) == Some(0.0) => Some(of(b)),
            Expr::Binary(Binary::Add, a, b) if number(b) == Some(0.0) => Some(of(a)),
            Expr::Binary(Binary::Add, a, b) if number(a) == Some(0.0) => Some(of(b)),
            Expr::Binary(..)
            | Expr::Unary(..)
            | Expr::Constant(_)
            | Expr::Coordinate(_)
            | Expr::Parameter(_)
            | Expr::Uniform(_)
            | Expr::Lookup(..) => None,
        };
        let new = only.unwrap_or_else(|| chosen.intern(expr.map(of), graph.span(node)));
        image.push(new);
    }
    let root = image[root.index()];
    (chosen, root)
}

impl Moving for Switched {
    fn during(&self, from: f64, to: f64) -> Box<dyn Walls> {
        Box::new(self.at_rest(from, to).unwrap_or_else(|| self.whole.between(from, to)))
    }

    fn placement(&self, time: f64) -> Option<Placement> {
        self.whole.placement(time)
    }

    fn is_same(&self, a: f64, b: f64) -> bool {
        let key = |time: f64| self.numbers.at_rest(time, time);
        key(a).is_some_and(|now| key(b) == Some(now))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::Program;

    fn switched(solid: &str) -> Option<Arc<Switched>> {
        switched_until(solid, 2.0)
    }

    fn switched_until(solid: &str, until: f64) -> Option<Arc<Switched>> {
        let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {solid}")).unwrap();
        let whole = program.solid_with("s", Engine::Interpreter).unwrap();
        Switched::of(
            &program.module().graph,
            program.module().solids[0].node,
            &whole,
            until,
            Engine::Interpreter,
        )
    }

    #[test]
    fn between_its_switches_a_solid_is_at_rest() {
        let gate = switched("if t < 0.7 then ball([0, 0, 0], 1) else ball([5, 0, 0], 1)").unwrap();
        let [here, there] = [DVec3::ZERO, DVec3::new(5.0, 0.0, 0.0)];
        for (from, to, is_here) in [(0.0, 0.1, true), (0.5, 0.69, true), (0.71, 0.72, false)] {
            let solid = gate.at_rest(from, to).unwrap();
            assert!(!solid.moves());
            assert_eq!((solid.omega(here) > 0.0, solid.omega(there) > 0.0), (is_here, !is_here));
        }
        assert!(gate.at_rest(0.65, 0.75).is_none());
        assert!(gate.is_same(0.1, 0.6) && !gate.is_same(0.6, 0.8) && gate.is_same(0.8, 1.9));
        assert_eq!(gate.shapes.lock().unwrap().len(), 2);
        // what is asked for a step that switches has its time
        assert_eq!(gate.during(0.65, 0.75).omega(there), gate.during(0.8, 0.9).omega(there));
    }

    #[test]
    fn what_moves_or_switches_all_the_time_is_not_at_rest() {
        // a valve that closes within a stretch moves nevertheless, whether the run is short or long
        let valve = "ball([clamp((t - 0.3)/0.04, 0, 1), 0, 0], 1)";
        let gate = "if t < 0.3 then ball([0, 0, 0], 1) else ball([1, 0, 0], 1)";
        for until in [0.5, 2.0, 200.0, 1e4] {
            assert!(switched_until(valve, until).is_none(), "{until}");
            assert!(switched_until(gate, until).is_some(), "{until}");
        }
        for solid in [
            "ball([0, 0, 0], 1 + 0.1*sin(t))",
            "ball([floor(40*t), 0, 0], 1)",
            "ball([max(t - 1, 0), 0, 0], 1)",
            // at rest but for a twentieth of a second
            "ball([0, 0, 0], 1 + clamp(10*t, 0, 0.5))",
        ] {
            assert!(switched(solid).is_none(), "{solid}");
        }
    }
}
