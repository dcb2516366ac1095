//! How far a fluid can fall under its weight.

use glam::DVec3;

use crate::Solid;
use crate::geom::Aabb;
use crate::ir::{Axis, Binary, Graph, Node};
use crate::solid::{Bounds, Engine};

/// The fastest part of a fluid is as fast as if it had fallen this much farther than its top lies above the bottom: the
/// front of a dam that breaks on a dry floor moves with 2√(gh), a body that falls as far with √(2gh).
const FRONT: f64 = 2.0;

/// The length along `gravity`, m, whose fall gives the greatest speed of a fluid at rest in a box; `fluid` is its shape
/// at the start. At most the box, which is also the answer where something `stirs` the fluid, and may lift it.
pub(super) fn height(fluid: &Solid, domain: &Aabb, gravity: DVec3, stirs: bool) -> f64 {
    let up = -gravity.normalize_or_zero();
    let height = up.abs().dot(domain.size());
    if stirs {
        return height;
    }
    let highest = |over: &Aabb| up.max(DVec3::ZERO).dot(over.max) + up.min(DVec3::ZERO).dot(over.min);
    match in_box(fluid, domain) {
        Some(Bounds::Within(bounds)) => height.min(FRONT * (highest(&bounds) - highest(domain) + height)),
        Some(Bounds::Empty | Bounds::Unbounded) | None => height,
    }
}

/// The bounds of the part of a solid that lies in a box, at the start; `None` if they cannot be found.
fn in_box(solid: &Solid, domain: &Aabb) -> Option<Bounds> {
    let (graph, root) = solid.formula();
    let mut graph = graph.clone();
    let inside = std::iter::zip(Axis::SPACE, std::iter::zip(domain.min.to_array(), domain.max.to_array()))
        .fold(root, |inside, (axis, ends)| between(&mut graph, inside, axis, ends));
    let part = Solid::new(solid.name(), &graph, inside, Engine::Interpreter).ok()?;
    Some(*part.at(0.0).bounds())
}

/// A field that is positive where another one is and a coordinate lies between two numbers.
fn between(graph: &mut Graph, field: Node, axis: Axis, (least, most): (f64, f64)) -> Node {
    let (along, least, most) = (graph.coordinate(axis), graph.constant(least), graph.constant(most));
    let (above, below) = (graph.binary(Binary::Sub, along, least), graph.binary(Binary::Sub, most, along));
    let within = graph.binary(Binary::Min, above, below);
    graph.binary(Binary::Min, field, within)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Program;

    #[test]
    fn a_fluid_falls_from_where_it_is() {
        let domain = Aabb::new(DVec3::ZERO, DVec3::new(2.0, 1.0, 8.0));
        let fall = |shape: &str, gravity: DVec3, stirs: bool| {
            let program = Program::from_source("f.rfm", format!("rfm 1\nsolid s = {shape}")).unwrap();
            height(&program.solid_with("s", Engine::Interpreter).unwrap(), &domain, gravity, stirs)
        };
        let near =
            |found: f64, truth: f64| assert!((found - truth).abs() < 1e-3 * truth, "{found}, not {truth}");
        let down = DVec3::new(0.0, 0.0, -9.81);
        near(fall("z <= 0.3", down, false), 0.6);
        near(fall("z <= 0.3", down, true), 8.0);
        near(fall("ball([1, 0.5, 3], 0.5)", down, false), 7.0);
        near(fall("ball([1, 0.5, 5], 0.5)", down, false), 8.0);
        // it falls upwards: from below, at 7.7
        near(fall("z >= 7.7", -down, false), 0.6);
        // along a slope the corner of the box that is farthest down counts
        let slope = DVec3::new(1.0, 0.0, -1.0);
        near(fall("z <= 0.3", slope, false), 2.0 * (2.0 + 0.3) / 2.0_f64.sqrt());
        // nothing is known of a fluid that is not there
        near(fall("z <= -1", down, false), 8.0);
    }
}
