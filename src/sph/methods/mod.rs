//! How pressure is found: a folder for each method, which declares it and holds its scheme, a readable `step` over the
//! stages of [`Core`].
//!
//! To add a method: a folder with its numbers, their [`Declaration`] and their [`Numerics`], and one line in the list at
//! the end of this file.

mod declaration;
mod dfsph;
mod negative_pressure;
mod numerics;
mod paper;
mod reference;
mod shifting;
mod tension;
mod wcsph;

pub use declaration::{FluidDefaults, KeyBlock, KeyInfo, KeyReader, MethodInfo, Support};
pub use dfsph::Dfsph;
pub use negative_pressure::NegativePressure;
pub use paper::Paper;
pub use reference::{overview, reference};
pub use wcsph::{Gradients, Wcsph};

use declaration::{Declaration, check, read};

pub(super) use numerics::{Numerics, Scheme};

use super::params::{ParameterError, Parameters};
use super::passes::Pass;

/// Makes the type [`Method`] of a list of methods, and hands its questions to the one that is chosen.
macro_rules! methods {
    ($($(#[$about:meta])* $method:ident),* $(,)?) => {
        /// How pressure is found. Every method has density and motion; what else runs, its numbers decide.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Method {
            $($(#[$about])* $method($method)),*
        }

        impl Method {
            /// All methods with their default numbers.
            pub fn all() -> Vec<Self> {
                vec![$(Self::$method($method::default())),*]
            }

            /// The method in words.
            pub fn info(&self) -> MethodInfo {
                match self { $(Self::$method(_) => MethodInfo::of::<$method>()),* }
            }

            /// As scenes write it.
            pub fn name(&self) -> &'static str {
                match self { $(Self::$method(_) => $method::NAME),* }
            }

            /// What a fluid is like unless its scene says otherwise.
            pub fn fluid(&self) -> FluidDefaults {
                match self { $(Self::$method(_) => $method::FLUID),* }
            }

            /// Reads the keys that a scene states into the method's numbers.
            pub fn read(&mut self, reader: &mut dyn KeyReader) {
                match self { $(Self::$method(numbers) => read(numbers, reader)),* }
            }

            /// # Errors
            /// The first number that its bound does not admit.
            pub(super) fn check(&self) -> Result<(), ParameterError> {
                match self { $(Self::$method(numbers) => check(numbers)),* }
            }

            /// The method's own passes, each with the reason if it does not run.
            pub(super) fn passes(&self, parameters: &Parameters) -> Vec<(Pass, Option<&'static str>)> {
                match self {
                    $(Self::$method(numbers) => {
                        $method::PASSES.iter().map(|(pass, absence)| (*pass, absence(numbers, parameters))).collect()
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

methods! {
    /// Equations 8–14 of the paper, corrected.
    Paper,
    /// Weakly compressible: density from the equation of continuity, pressure by Tait's equation.
    Wcsph,
    /// Divergence-free (Bender & Koschier 2017): pressure is solved for, so that the density stays.
    Dfsph,
}

impl Method {
    /// A method by its name, with its default numbers.
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
        Self::Paper(Paper::default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States nothing, or the first word of each key.
    struct FirstWords(bool);

    impl KeyReader for FirstWords {
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

        fn word(&mut self, _: KeyBlock, _: &'static str, _: &[&'static str]) -> Option<usize> {
            self.0.then_some(0)
        }
    }

    #[test]
    fn the_first_word_of_a_key_is_its_default() {
        for method in Method::all() {
            for state_words in [false, true] {
                let mut read = method;
                read.read(&mut FirstWords(state_words));
                assert_eq!(read, method);
            }
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
