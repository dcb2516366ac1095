//! The probes of a scene as the simulation takes them.

use crate::lower::Measured;
use crate::sph::Probe;

/// The probe for what a scene wants measured.
pub fn probe_of(measured: &Measured) -> Probe {
    match *measured {
        Measured::Height([x, y]) => Probe::Height { x, y },
        Measured::Pressure(at) => Probe::Pressure { at },
        Measured::Velocity(at) => Probe::Velocity { at },
        Measured::Force { body, about } => Probe::Force { obstacle: body, about },
        Measured::Flux { point, normal } => Probe::Flux { point, normal },
        Measured::Energy => Probe::Energy,
        Measured::Audit => Probe::Audit,
    }
}

/// The name under which a checkpoint keeps the [memory](crate::sph::Gauge::memory) of the probe with this
/// name.
pub fn probe_column(name: &str) -> String {
    format!("probe {name}")
}
