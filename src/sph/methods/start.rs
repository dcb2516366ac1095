//! Which scheme a method has.

use super::scheme::Scheme;
use super::{Method, dfsph, paper, wcsph};
use crate::sph::core::Core;

/// Makes the scheme of the core's method and finds densities and forces of the first instant. If the fluid
/// goes on from a checkpoint, those of the checkpoint replace them afterwards.
pub(in crate::sph) fn start(core: &mut Core, is_new: bool) -> Box<dyn Scheme> {
    match core.parameters.method {
        Method::Paper(numbers) => Box::new(paper::PaperScheme::start(numbers, core)),
        Method::Wcsph(numbers) => {
            if is_new {
                dfsph::spread(core);
            }
            Box::new(wcsph::Weakly::start(&numbers, core))
        }
        Method::Dfsph(numbers) => Box::new(dfsph::DivergenceFree::start(numbers, core, is_new)),
    }
}
