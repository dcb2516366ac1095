//! Bends that have no room for their shape: `.bend(radius)` makes a circle of the x axis from -π·radius to π·radius, and
//! leaves out what lies beyond.

use std::f64::consts::PI;

use super::lowering::{Local, Lowering};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::{Aabb, significant};
use crate::ir::{self, Interpreter, Node};

/// Points of a shape's bounds at which it is looked for.
const POINTS: u32 = 2000;

/// Shapes with more operations are not looked at: at so many points they would take long.
const MOST_OPERATIONS: usize = 2000;

impl Lowering<'_> {
    /// Warns of a bend that leaves out a part of its shape, which is proven by points of that part.
    pub fn warn_of_lost_ends(&mut self, parameters: &[Local], span: Span) {
        let value = |name: &str| {
            let local = parameters.iter().find(|local| local.name == name)?;
            if let Value::Number(node) = local.value { Some(node) } else { None }
        };
        let (Some(shape), Some(radius)) = (value("shape"), value("radius")) else { return };
        let Some(radius) = self.known_value(radius).filter(|radius| *radius > 0.0) else { return };
        if self.has_open_params {
            return;
        }
        let Some(bounds) = ir::reach(&self.module.graph, shape) else { return };
        let room = PI * radius;
        let is_long = -bounds.min.x > room || bounds.max.x > room;
        if !is_long && bounds.max.z <= radius {
            return;
        }
        let Some(lost) = self.part_beyond(shape, &bounds, [room, radius]) else { return };
        let [left, right, top, room] = [bounds.min.x, bounds.max.x, bounds.max.z, room].map(significant);
        let along =
            format!("it reaches from x = {left} to {right}, and the circle from x = -{room} to {room}");
        let above = format!("it reaches up to z = {top}, and the middle of the circle is at z = {radius}");
        let why = match (is_long, bounds.max.z > radius) {
            (true, true) => format!("{along}; {above}"),
            (true, false) => along,
            (false, _) => above,
        };
        let enough = f64::max(bounds.max.x.max(-bounds.min.x) / PI, bounds.max.z);
        let percent = if lost < 0.01 { "less than 1".into() } else { format!("{:.0}", 100.0 * lost) };
        let message = format!("`.bend({radius})` leaves out {percent} % of its shape");
        self.report(
            Diagnostic::warning(Code::LOST_ENDS, self.user_span(span), message)
                .at(why)
                .help(format!("write `.bend({})`, or a larger radius", upwards(enough))),
        );
    }

    /// The part of a shape that lies beyond a bend, by points; `None` if no point of it does.
    fn part_beyond(&self, shape: Node, bounds: &Aabb, [room, radius]: [f64; 2]) -> Option<f64> {
        let (graph, root) = self.module.graph.extract_cone(shape);
        if graph.len() > MOST_OPERATIONS || graph.uses_time(root) {
            return None;
        }
        let program = Interpreter::new(&graph, &[root]);
        let (mut inside, mut beyond, mut omega) = (0, 0, [0.0]);
        for p in (0..POINTS).map(|k| bounds.evenly(k)) {
            program.eval_f64(p.to_array(), &mut omega);
            if omega[0] > 0.0 {
                inside += 1;
                beyond += u32::from(p.x.abs() > room || p.z > radius);
            }
        }
        (beyond > 0).then(|| f64::from(beyond) / f64::from(inside))
    }
}

/// A length of two digits that is not below another one, whose last digits may be those of rounding.
fn upwards(length: f64) -> f64 {
    let unit = 10f64.powf(length.log10().floor() - 1.0);
    significant((length / unit - 1e-6).ceil() * unit)
}

#[cfg(test)]
mod tests {
    use super::upwards;

    #[test]
    fn a_radius_with_two_digits_is_large_enough() {
        let shown = [0.123, 1.0, 1.000_000_001, 0.0501, 99.5].map(upwards);
        assert_eq!(shown, [0.13, 1.0, 1.0, 0.051, 100.0]);
    }
}
