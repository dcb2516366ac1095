//! The scheme of each method.

use super::Method;
use super::scheme::{Scheme, Start};
use crate::sph::core::Core;

macro_rules! start {
    ($($(#[$about:meta])* $method:ident),* $(,)?) => {
        /// Makes the scheme of the core's method and finds densities and forces of the first instant. If the
        /// fluid continues from a checkpoint, its values replace them afterwards.
        pub(in crate::sph) fn start(core: &mut Core, is_new: bool) -> Box<dyn Scheme> {
            match core.parameters.method {
                $(Method::$method(numbers) => numbers.start(core, is_new)),*
            }
        }
    };
}

for_all_methods!(start);
