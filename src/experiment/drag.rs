//! Whether the mean force on a body holds a drag that the method makes too large.

use super::bodies::Body;
use super::wall_speed;
use crate::diagnostic::{Code, Diagnostic};
use crate::field::Moving;
use crate::geom::{Aabb, Placement};
use crate::lower::{AskedMean, Scene, SceneProbe};
use crate::sph::{Parameters, Probe};

/// A body counts as at rest if it moves less than this part of the support radius while its mean force is
/// taken: less than is seen of its surface. A body that comes to rest slowly never stops completely.
const STILL: f64 = 1e-3;

/// Instants at which a body is looked at while its mean force is taken.
const INSTANTS: usize = 61;

/// A warning for each mean of the force on a body that moves meanwhile, with a method that makes its drag too large.
///
/// Bodies at rest, from the start or by now, get no warning. Neither does a vessel: besides its weight, only
/// the walls of the vessel act on the fluid, so the mean force on them is the fluid's weight and the change
/// of its momentum over the time, however much the fluid resists being sheared. (In vessels of six to twenty
/// spacings that were thrown sideways or upwards it was right to 0.1 %. Where a wall of the box is its floor
/// or lid, that wall bears a share of its own.) An obstacle in it would share that force, and the torque on a
/// vessel that turns is what the fluid resists.
pub(super) fn warnings(scene: &Scene, parameters: &Parameters, bodies: &[Body]) -> Vec<Diagnostic> {
    let is_thick = parameters.viscosity >= parameters.rest_density * parameters.numerical_viscosity();
    if is_thick || !parameters.drag_is_too_large() {
        return Vec::new();
    }
    let told = |probe: &SceneProbe| {
        let (Probe::Force { obstacle: number, .. }, Some(mean)) = (probe.measured, &probe.mean) else {
            return None;
        };
        let body = bodies.get(number)?;
        let moving = body.obstacle.moving.as_deref()?;
        let window = Window { from: mean.from, until: scene.run.until };
        let is_vessel = number == 0 && scene.container.is_some() && scene.obstacles.is_empty();
        let holds = |mean: &AskedMean| match window.placements(moving) {
            Some(places) => !mean.torque || places.windows(2).all(|two| two[0].rotation == two[1].rotation),
            // a vessel that changes its shape pushes the fluid about
            None => false,
        };
        let still = STILL * parameters.support_radius;
        if (is_vessel && holds(mean)) || window.is_at_rest(body, moving, &scene.domain, still) {
            return None;
        }
        let message = "with pressures in pairs the drag of a body that moves through the fluid is several times too large";
        let help = "write `gradients: differences` with `method: wcsph`";
        Some(Diagnostic::warning(Code::DRAG, probe.span, message).help(help))
    };
    scene.probes.iter().filter_map(told).collect()
}

/// The time over which a mean is taken, s.
#[derive(Clone, Copy)]
struct Window {
    from: f64,
    until: f64,
}

impl Window {
    /// Its beginning, its end, and instants between them that no period of a motion divides.
    fn instants(self) -> impl Iterator<Item = f64> {
        let length = (self.until - self.from).max(0.0);
        let between = (0..INSTANTS).map(move |k| (k as f64 + 0.618) / INSTANTS as f64);
        [0.0].into_iter().chain(between).chain([1.0]).map(move |part| self.from + part * length)
    }

    /// Where a body is at the instants; `None` if it changes its shape.
    fn placements(self, moving: &dyn Moving) -> Option<Vec<Placement>> {
        self.instants().map(|time| moving.placement(time)).collect()
    }

    /// Whether no place of a body in a box moves by more than `way`, m. A body that is not known to be at
    /// rest counts as moving.
    fn is_at_rest(self, body: &Body, moving: &dyn Moving, domain: &Aabb, way: f64) -> bool {
        let parts = &body.obstacle.parts;
        if !parts.is_empty() {
            let moving = parts.iter().filter_map(|part| part.moving.as_deref());
            return moving.map(|part| self.placements(part)).all(|places| stays(places, domain, way));
        }
        if let Some(places) = self.placements(moving) {
            return stays(Some(places), domain, way);
        }
        // for many parts, the gradient would be one large program, which nothing else needs
        !body.solid.has_many_leaves()
            && self.instants().all(|time| {
                wall_speed::moved(&body.solid, domain, [self.from, time]).is_some_and(|moved| moved <= way)
            })
    }
}

/// Whether no place of a body in a box is farther than `way`, m, from where it was at the first of some instants.
fn stays(places: Option<Vec<Placement>>, domain: &Aabb, way: f64) -> bool {
    let Some(places) = places else { return false };
    let Some(first) = places.first() else { return true };
    // no place in a box moves more than its corners
    let moved = |place: &Placement| {
        domain.corners().into_iter().any(|corner| place.apply(first.back(corner)).distance(corner) > way)
    };
    !places.iter().any(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Engine, Experiment, Program};

    /// Whether there is a warning for a scene with a body, and with a probe of its mean force over the second
    /// half of two seconds.
    #[track_caller]
    fn is_told(body: &str, solid: &str, more: &str) -> bool {
        let text = format!(
            "rfm 1\nsolid it = {solid}\nsolid other = sphere(0.1).move([0.5, 0.5, 0.2])\nscene s {{\n\
             box {{ min: [-0.5, -0.5, -0.5], max: [2, 1.5, 1.5] }}\n{body} {{ solid: it }}\n{more}\n\
             fluid water {{ shape: box([0.1, 0.1, 0.1], [0.9, 0.9, 0.4]), density: 1000, spacing: 0.1 }}\n\
             method: wcsph\nrun {{ until: 2 s, save_every: 0.1 s }}\n}}"
        );
        let program = Program::from_source("drag.rfm", text).unwrap();
        let experiment = Experiment::new(&program, "s", Engine::Interpreter).unwrap();
        experiment.warnings.iter().any(|warning| warning.code == Code::DRAG)
    }

    const PROBE: &str = "probe f { force: it, every: 10 ms, from: 1 s }";

    #[test]
    fn a_body_is_told_of_if_it_moves_while_its_mean_force_is_taken() {
        for (solid, expected) in [
            ("sphere(0.15).move([0.4, 0.4, 0.7 - 0.4*t])", true),
            ("sphere(0.15).move([0.4, 0.4, 0.7 - 0.4*min(t, 1)])", false),
            // it slows down, and it begins late
            ("sphere(0.15).move([0.4, 0.4, 0.7 - 0.4*min(t, 1.1)])", true),
            ("sphere(0.15).move([0.4, 0.4, 0.7 - 0.4*max(t - 1.9, 0)])", true),
            ("sphere(0.15).move([0.4, 0.4, 0.7 - 0.4*(1 - exp(-20*t))])", false),
            // one that changes its shape
            ("sphere(0.05 + 0.1*min(t, 1)).move([0.4, 0.4, 0.3])", false),
            ("sphere(0.05 + 0.05*t).move([0.4, 0.4, 0.3])", true),
            // what turns within its surface
            ("cylinder(0.2, 0.3).rotate_z(t).move([0.4, 0.4, 0.1])", true),
            ("cylinder(0.2, 0.3).rotate_z(min(t, 1)).move([0.4, 0.4, 0.1])", false),
            // parts that move differently
            (
                "sphere(0.1).move([0.3 + 0.1*min(t, 1), 0.4, 0.3]) or sphere(0.1).move([0.7, 0.2*min(t, 0.5), 0.3])",
                false,
            ),
            (
                "sphere(0.1).move([0.3 + 0.1*min(t, 1), 0.4, 0.3]) or sphere(0.1).move([0.7, 0.2*t, 0.3])",
                true,
            ),
        ] {
            assert_eq!(is_told("obstacle", solid, PROBE), expected, "{solid}");
        }
    }

    #[test]
    fn a_vessel_that_moves_with_its_fluid_is_not_told_of() {
        let tank = "box([0, 0, 0], [1, 1, 1])";
        let torque = "probe f { force: it, about: [0.5, 0.5, 0], every: 10 ms, from: 1 s }";
        let obstacle = format!("obstacle {{ solid: other }}\n{PROBE}");
        for (motion, more, expected) in [
            ("move([0.1*t^2, 0, 0])", PROBE, false),
            ("rotate_z(0.2*t)", PROBE, false),
            // a torque only of one that does not turn, a force only of one that bears all of it
            ("move([0.1*t^2, 0, 0])", torque, false),
            ("rotate_z(0.2*t)", torque, true),
            ("move([0.1*t^2, 0, 0])", &obstacle, true),
        ] {
            assert_eq!(is_told("container", &format!("{tank}.{motion}"), more), expected, "{motion} {more}");
        }
        let squeezed = "box([0, 0, 0], [1, 1, 1 - 0.05*t])";
        assert!(is_told("container", squeezed, PROBE));
    }
}
