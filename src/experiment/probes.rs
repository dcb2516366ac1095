//! The probes of a scene as the simulation takes them.

use super::bodies::Body;
use crate::diagnostic::{Code, Diagnostic};
use crate::lower::{Scene, SceneProbe};
use crate::sph::Probe;

/// A place nearer to a surface than this part of the spacing lies on it.
const ON_SURFACE: f64 = 1e-3;

/// A warning for each probe of a place that lies in a body at rest, where there is never any fluid.
pub(super) fn in_bodies(scene: &Scene, bodies: &[Body], spacing: f64) -> Vec<Diagnostic> {
    let told = |probe: &SceneProbe| {
        let (Probe::Pressure { at } | Probe::Velocity { at }) = probe.measured else { return None };
        // a place on the surface may be a rounding inside
        let is_deep = |body: &Body| body.solid.contact(at).distance < -ON_SURFACE * spacing;
        let holds =
            |body: &Body| body.obstacle.moving.is_none() && body.solid.sign(at) > 0.0 && is_deep(body);
        if !bodies.iter().any(holds) {
            return None;
        }
        let message = format!("the probe `{}` lies in an obstacle, or outside the container", probe.name);
        Some(
            Diagnostic::warning(Code::PROBE_IN_BODY, probe.span, message)
                .help("move it into the fluid; for the pressure on a wall, to a place on its surface"),
        )
    };
    scene.probes.iter().filter_map(told).collect()
}

/// The name under which a checkpoint keeps the [memory](crate::sph::Gauge::memory) of the probe with this
/// name.
pub fn probe_column(name: &str) -> String {
    format!("probe {name}")
}
