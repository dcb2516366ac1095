//! The methods that find the pressure. Each method has a folder, which declares it and holds its scheme: a
//! readable `step` over the stages of [`Core`](super::core::Core).
//!
//! To add a method, add a folder with its numbers, their declaration and limits (`mod.rs`) and its scheme
//! (`scheme.rs`), and in this file a `mod` line and a line in the list of methods. `rfm explain --methods`
//! then writes the page beside it.

/// Passes the list of all methods, in the order in which they are shown, to a macro.
macro_rules! for_all_methods {
    ($make:ident) => {
        $make! {
            /// Weakly compressible: density from the equation of continuity, pressure by Tait's equation.
            Wcsph,
            /// Divergence-free (Bender & Koschier 2017): the pressure is solved for, so that the density
            /// stays constant.
            Dfsph,
            /// The method of the paper, equations 8–14, corrected.
            Paper,
        }
    };
}

mod bodies_of_fluid;
mod crowding;
mod declaration;
mod dfsph;
mod free_surface;
mod images;
mod near_walls;
mod negative_pressure;
mod numerics;
mod paper;
mod reference;
mod roughness;
mod scheme;
mod shifting;
mod start;
mod tension;
mod viscosity;
mod wcsph;
mod wetting;

pub use declaration::{FluidDefaults, KeyBlock, KeyInfo, KeyReader, MethodInfo, Support};
pub use dfsph::Dfsph;
pub use negative_pressure::NegativePressure;
pub use paper::Paper;
pub use reference::{method_reference, methods_overview, methods_reference};
pub(crate) use wcsph::ClampedBy;
pub use wcsph::{Gradients, Wcsph};

use declaration::{Declaration, check, read, words};

pub(super) use numerics::{COURANT, Noted, Numerics, StatedSound};
pub(super) use scheme::Scheme;
pub(super) use start::start;

use super::error::ParameterError;
use super::pass::Pass;
use super::scales::Scales;

/// Makes the type [`Method`] from a list of methods, and forwards its functions to the method that is chosen.
macro_rules! methods {
    ($($(#[$about:meta])* $method:ident),* $(,)?) => {
        /// A method that finds the pressure, with its numbers. Every method has density and motion; its
        /// numbers decide what else runs.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Method {
            $($(#[$about])* $method($method)),*
        }

        impl Method {
            /// All methods with their default numbers.
            pub fn all() -> Vec<Self> {
                vec![$(Self::$method($method::default())),*]
            }

            /// The method's declaration in words, for messages and tables.
            pub fn info(&self) -> MethodInfo {
                match self { $(Self::$method(_) => MethodInfo::of::<$method>()),* }
            }

            /// The method's name, as scenes write it.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$method(_) => $method::NAME),* }
            }

            /// The defaults of a fluid in this method.
            pub fn fluid(&self) -> FluidDefaults {
                match self { $(Self::$method(_) => $method::FLUID),* }
            }

            /// The support radius that suits the method's numbers, for a fluid with surface tension or
            /// without.
            pub fn support(&self, has_tension: bool) -> Support {
                match self { $(Self::$method(numbers) => numbers.support(has_tension)),* }
            }

            /// Takes up whether the fluid of a scene has a free surface, on which some numbers depend that are
            /// not stated.
            pub(crate) fn settle(&mut self, has_surface: &dyn Fn() -> bool) {
                match self { $(Self::$method(numbers) => numbers.settle(has_surface)),* }
            }

            /// Sets the numbers of the method from the keys that a scene states.
            pub fn read(&mut self, reader: &mut dyn KeyReader) {
                match self { $(Self::$method(numbers) => read(numbers, reader)),* }
            }

            /// The keys of the method that hold words, with the words that its numbers have.
            pub fn words(&self) -> Vec<(&'static str, &'static str)> {
                match self { $(Self::$method(numbers) => words(numbers)),* }
            }

            /// Checks the numbers of the method against the bounds of its keys.
            ///
            /// # Errors
            /// The first number that its bound does not admit.
            pub(super) fn check(&self) -> Result<(), ParameterError> {
                match self { $(Self::$method(numbers) => check(numbers)),* }
            }

            /// The method's own passes, each with the reason if it does not run.
            pub(super) fn passes(&self, scales: &Scales) -> Vec<(Pass, Option<&'static str>)> {
                match self {
                    $(Self::$method(numbers) => {
                        $method::PASSES.iter().map(|(pass, absence)| (*pass, absence(numbers, scales))).collect()
                    })*
                }
            }

            pub(super) fn numerics(&self) -> &dyn Numerics {
                match self { $(Self::$method(numbers) => numbers),* }
            }
        }

        $(impl From<$method> for Method {
            fn from(numbers: $method) -> Self {
                Self::$method(numbers)
            }
        })*
    };
}

for_all_methods!(methods);

impl Method {
    /// The method with this name and default numbers; `None` if there is no such method.
    pub fn named(name: &str) -> Option<Self> {
        Self::all().into_iter().find(|method| method.name() == name)
    }

    /// The names of the methods that have a key in a block.
    pub fn with_key(block: KeyBlock, key: &str) -> Vec<&'static str> {
        let has_key = |method: &Self| method.info().key(block, key).is_some();
        Self::all().into_iter().filter(has_key).map(|method| method.name()).collect()
    }
}

impl Default for Method {
    fn default() -> Self {
        Self::Wcsph(Wcsph::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reader that states the default of each key whose value is a word that is not derived.
    struct DefaultWords(MethodInfo);

    impl KeyReader for DefaultWords {
        fn number(
            &mut self,
            _: KeyBlock,
            _: &'static str,
            _: crate::quantity::Dimension,
            _: crate::quantity::Bound,
        ) -> Option<f64> {
            None
        }

        fn count(&mut self, _: KeyBlock, _: &'static str, _: u32) -> Option<u32> {
            None
        }

        fn word(&mut self, block: KeyBlock, key: &'static str, words: &[&'static str]) -> Option<usize> {
            let default = &self.0.key(block, key)?.default;
            words.iter().position(|word| word == default)
        }
    }

    #[test]
    fn a_key_that_states_its_default_changes_nothing() {
        for method in Method::all() {
            let mut read = method;
            read.read(&mut DefaultWords(method.info()));
            assert_eq!(read, method);
        }
    }

    #[test]
    fn only_what_is_not_stated_depends_on_the_surface_of_the_fluid() {
        let settled = |wcsph: Wcsph, has_surface: bool| {
            let mut method = Method::from(wcsph);
            method.settle(&|| has_surface);
            let Method::Wcsph(wcsph) = method else { panic!("{method:?}") };
            (wcsph.gradients(), wcsph.negative_pressure())
        };
        let (pairs, differences) = (Gradients::Pairs, Gradients::Differences);
        let (clamp, keep) = (NegativePressure::Clamp, NegativePressure::Keep);
        let open = Wcsph::default();
        assert_eq!(settled(open, false), (differences, keep));
        assert_eq!(settled(open, true), (pairs, clamp));
        // differences need the drift, which the scene rules out
        assert_eq!(settled(Wcsph { shifting: Some(0.0), ..open }, false), (pairs, clamp));
        assert_eq!(settled(Wcsph { gradients: Some(pairs), ..open }, false), (pairs, clamp));
        assert_eq!(settled(Wcsph { gradients: Some(differences), ..open }, true), (differences, clamp));
        for (stated, has_surface) in [(clamp, false), (keep, true)] {
            let negative_pressure = Some(stated);
            assert_eq!(settled(Wcsph { negative_pressure, ..open }, has_surface).1, stated);
        }
        for asks_nothing in [Wcsph { shifting: Some(0.0), ..open }, Wcsph { gradients: Some(pairs), ..open }]
        {
            Method::from(asks_nothing).settle(&|| panic!("the answer would not matter"));
        }
        let stated = Dfsph { shifting: Some(1.0), ..Dfsph::default() };
        for mut method in [Method::from(stated), Method::from(Paper::default())] {
            let before = method;
            method.settle(&|| panic!("they do not ask"));
            assert_eq!(method, before);
        }
        // the drift of a fluid that fills its room is among the passes
        for has_surface in [false, true] {
            let mut method = Method::from(Dfsph::default());
            method.settle(&|| has_surface);
            assert!(matches!(method, Method::Dfsph(dfsph) if dfsph.fills_room != has_surface));
        }
    }

    #[test]
    fn declarations_are_complete() {
        for method in Method::all() {
            let info = method.info();
            assert_eq!(Method::named(info.name), Some(method));
            assert_eq!(method.check(), Ok(()), "the defaults of {}", info.name);
            for (i, key) in info.keys.iter().enumerate() {
                assert!(!key.about.is_empty() && !key.default.is_empty(), "{}: {}", info.name, key.name);
                let again =
                    info.keys[..i].iter().any(|other| (other.block, other.name) == (key.block, key.name));
                assert!(!again, "{} declares {} twice", info.name, key.name);
            }
        }
        assert_eq!(Method::with_key(KeyBlock::Fluid, "shifting"), ["wcsph", "dfsph"]);
        assert_eq!(Method::named("sph"), None);
    }
}
