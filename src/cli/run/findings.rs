//! What the audit of a run finds, as warnings with codes.

use rfm::diagnostic::Code;
use rfm::geom::significant;
use rfm::sph::{Finding, Simulation};

use super::super::failure::warn;

/// The code of a finding's message.
pub(super) fn code(finding: Finding) -> Code {
    match finding {
        Finding::Energy => Code::ENERGY_GREW,
        Finding::Volume => Code::VOLUME_CHANGED,
        Finding::Compression => Code::COMPRESSED,
        Finding::Speed => Code::SLOW_SOUND,
        Finding::Rows => Code::CROWDED,
    }
}

/// Warns of what the audit has found since the last call.
pub(super) fn tell_news(simulation: &mut Simulation) {
    let (step, time) = (simulation.steps(), significant(simulation.time()));
    for (finding, text) in simulation.news() {
        warn(code(finding), format!("step {step}, {time} s: {text}"));
    }
}

/// Repeats all that the audit has found, at the end of a run.
pub(super) fn repeat(simulation: &Simulation) {
    for (finding, text) in simulation.findings() {
        let code = code(finding);
        warn(code, format!("in this run {text}; `rfm explain {}` has more", code.0));
    }
}
