//! The parts of an obstacle that move differently, each without deformation: gates of one solid that lift one
//! after another, a frame with a drum that turns in it.

use std::sync::Arc;

use crate::compile::Error;
use crate::field::{Moving, Walls};
use crate::ir::{Node, RigidMotion, SignRule};
use crate::sph::RigidPart;
use crate::{Engine, Program};

/// The most parts of an obstacle: each has a map of its own.
const MOST_PARTS: usize = 16;

/// Instants of a run at which a shape is tested for deformation.
const INSTANTS: usize = 61;

/// Whether a shape moves as a whole during a run that ends at a time, s.
pub(super) fn keeps_its_shape(program: &Program, shape: Node, until: f64) -> bool {
    let motion = RigidMotion::of(&program.module().graph, shape);
    // instants that no period of a motion divides
    let mut instants = (0..INSTANTS).map(|i| until * (i as f64 + 0.618) / INSTANTS as f64);
    motion.is_some_and(|motion| instants.all(|time| motion.placement(time).is_some()))
}

/// The parts of a shape during a run that ends at a time, s; none if it moves as a whole, or if parts of it
/// are deformed.
///
/// A union is divided until each of its parts moves as one.
pub(super) fn of(
    program: &Program,
    (name, shape): (&str, Node),
    until: f64,
    engine: Engine,
) -> Result<Vec<RigidPart>, Error> {
    let graph = &program.module().graph;
    let (mut left, mut rigid) = (vec![shape], Vec::new());
    while let Some(node) = left.pop() {
        if left.len() + rigid.len() >= MOST_PARTS {
            return Ok(Vec::new());
        }
        if keeps_its_shape(program, node, until) {
            rigid.push(node);
            continue;
        }
        match SignRule::of(graph, node) {
            SignRule::Any(a, b) => left.extend([b, a]),
            SignRule::Same(a) => left.push(a),
            SignRule::All(..) | SignRule::Not(_) | SignRule::Leaf => return Ok(Vec::new()),
        }
    }
    if rigid.len() < 2 {
        return Ok(Vec::new());
    }
    let part = |node: Node| -> Result<RigidPart, Error> {
        let solid = program.compile(name, node, engine)?;
        let field: Arc<dyn Walls> = Arc::new(solid.at(0.0));
        let moving = solid.moves().then(|| Arc::new(solid) as Arc<dyn Moving>);
        Ok(RigidPart { field, moving })
    };
    rigid.into_iter().map(part).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moving_and_still(solid: &str) -> [usize; 2] {
        let program = Program::from_source("t.rfm", format!("rfm 1\nsolid s = {solid}")).unwrap();
        let shape = program.module().solids[0].node;
        let parts = of(&program, ("s", shape), 2.0, Engine::Interpreter).unwrap();
        let moving = parts.iter().filter(|part| part.moving.is_some()).count();
        [moving, parts.len() - moving]
    }

    #[test]
    fn unions_are_divided_until_each_part_moves_as_one() {
        let gate = "box([0, 0, 0], [1, 1, 1])";
        let gates = format!("{gate} or any k in 1..3: {gate}.move([3*k, 0, k*t])");
        assert_eq!(moving_and_still(&gates), [2, 1]);
        assert_eq!(
            moving_and_still(&format!("{gate} or (ball([0, 0, 0], 1) or {gate}).rotate_z(t)")),
            [1, 1]
        );
        // later than it seems at first
        let later = format!("{gate}.move([0, 0, max(t - 1.9, 0)]) or {gate}.move([3, 0, 0])");
        assert_eq!(moving_and_still(&later), [1, 1]);
    }

    #[test]
    fn what_moves_as_one_or_is_deformed_is_not_divided() {
        for solid in [
            "(ball([0, 0, 0], 1) or box([0, 0, 0], [2, 1, 1])).rotate_z(t)",
            "ball([0, 0, 0], 1 + 0.1*sin(t)) or box([0, 0, 0], [2, 1, 1])",
            "box([0, 0, 0], [1, 1, 1]).move([0, 0, t]) and box([0, 0, 0], [1, 1, 3])",
            "any k in 0..40: box([0, 0, 0], [1, 1, 1]).move([3*k, 0, k*t])",
            "ball([0, 0, 0], 1)",
        ] {
            assert_eq!(moving_and_still(solid), [0, 0], "{solid}");
        }
    }
}
