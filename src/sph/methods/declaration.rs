//! The declaration of a method of the solver: its keys, defaults, passes and saved columns.
//!
//! The reader of scenes, `rfm explain`, the checks of parameters and the tables of the manual all read these
//! declarations. No other place describes a single method.

use crate::precision::Precision;
use crate::quantity::{Bound, Dimension};
use crate::sph::error::ParameterError;
use crate::sph::pass::Pass;
use crate::sph::scales::Scales;

/// The block of a scene that a key stands in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyBlock {
    /// `fluid { … }`
    Fluid,
    /// `solver { … }`
    Solver,
}

impl KeyBlock {
    /// The word that opens the block.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fluid => "fluid",
            Self::Solver => "solver",
        }
    }
}

/// A key of a scene that belongs to a method with the numbers `M`.
pub struct Key<M: 'static> {
    /// The key's name, as scenes write it.
    pub name: &'static str,
    /// The block that it stands in.
    pub block: KeyBlock,
    /// Its meaning, in one line.
    pub about: &'static str,
    /// The values that it may hold, and the number that they set.
    pub value: Value<M>,
}

/// Sets the numbers of a method for a word of a key.
pub type Setter<M> = fn(&mut M);

/// The values that a key may hold.
pub enum Value<M: 'static> {
    /// A number with a unit.
    Number {
        /// Its dimension; [`Dimension::NONE`] for a plain number.
        dimension: Dimension,
        /// The condition that it must fulfil.
        bound: Bound,
        /// Returns the number; `None` if it is derived from others.
        get: fn(&M) -> Option<f64>,
        /// Sets the number.
        set: fn(&mut M, f64),
        /// How the number is derived if it is not stated, in words; empty if it never is derived.
        derived: &'static str,
    },
    /// A whole number of at least `least`.
    Count {
        /// The smallest that is accepted.
        least: u32,
        /// Returns the number.
        get: fn(&M) -> u32,
        /// Sets the number.
        set: fn(&mut M, u32),
    },
    /// One of a few words.
    Word {
        /// The words, each with the function that sets it.
        words: &'static [(&'static str, Setter<M>)],
        /// Returns the word that the numbers have.
        get: fn(&M) -> &'static str,
        /// How the word is derived if it is not stated; empty if the first is the default.
        derived: &'static str,
    },
}

/// The defaults of a fluid in a method, for keys that its scene does not state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FluidDefaults {
    /// Dynamic viscosity, Pa·s.
    pub viscosity: f64,
    /// Surface tension, N/m.
    pub surface_tension: f64,
    /// The number of particles that fill the shape if the scene states neither the number nor the size.
    /// `None`: as many as fill it with a mass of 0.02 kg.
    pub particles: Option<usize>,
    /// Support radius of the kernel.
    pub support: Support,
    /// Precision of the sums over neighbours.
    pub precision: Precision,
    /// Whether the length of steps follows the state, unless the scene states it.
    pub adaptive: bool,
}

/// The size of a support radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Support {
    /// A length, m.
    Metres(f64),
    /// A number of particle spacings.
    Spacings(f64),
}

impl Support {
    /// The support radius of particles with this spacing, m.
    pub fn radius(self, spacing: f64) -> f64 {
        match self {
            Self::Metres(length) => length,
            Self::Spacings(count) => count * spacing,
        }
    }
}

/// The function that says why a pass of a method does not run with given numbers; it returns `None` if the
/// pass runs.
pub type Absence<M> = fn(&M, &Scales) -> Option<&'static str>;

/// The declaration of a method. The type that implements it holds the method's numbers.
pub(in crate::sph) trait Declaration: Default + 'static {
    /// The method's name, as scenes write it.
    const NAME: &'static str;
    /// The method, in a few words.
    const TITLE: &'static str;
    /// How pressure is found, in a few words.
    const PRESSURE: &'static str;
    /// Kernels, and neighbours within their support.
    const KERNEL: &'static str;
    /// How long steps are.
    const STEP: &'static str;
    /// The defaults of a fluid.
    const FLUID: FluidDefaults;
    /// Keys that the method declares, besides those that every method has.
    const KEYS: &'static [Key<Self>];
    /// Passes besides those that every method has, each with the reason if it does not run.
    const PASSES: &'static [(Pass, Absence<Self>)];
    /// Columns of a checkpoint of any scene, besides those that every method has.
    const SAVES: &'static [&'static str];
    /// Another support radius than that of the fluid's defaults, and when [`Declaration::support`] returns
    /// it, in words.
    const OTHER_SUPPORT: Option<(Support, &'static str)> = None;

    /// Takes up whether the fluid of a scene has a free surface. The search for one takes time, so a method asks
    /// only if it must.
    fn settle(&mut self, _has_surface: &dyn Fn() -> bool) {}

    /// The support radius that suits these numbers, for a fluid with surface tension or without.
    fn support(&self, _has_tension: bool) -> Support {
        Self::FLUID.support
    }
}

/// A source of values for keys: the reader of a scene implements it. Values out of range are reported to the
/// user there.
pub trait KeyReader {
    /// A number in SI units; `None` if the key is absent, or if its value was wrong and was reported.
    fn number(
        &mut self,
        block: KeyBlock,
        key: &'static str,
        dimension: Dimension,
        bound: Bound,
    ) -> Option<f64>;

    /// A whole number of at least `least`; `None` if the key is absent, or if its value was wrong and was
    /// reported.
    fn count(&mut self, block: KeyBlock, key: &'static str, least: u32) -> Option<u32>;

    /// The index of one of the words; `None` if the key is absent, or if its value was wrong and was
    /// reported.
    fn word(&mut self, block: KeyBlock, key: &'static str, words: &[&'static str]) -> Option<usize>;
}

/// Sets the numbers of a method from the keys that a scene states.
pub(super) fn read<M: Declaration>(numbers: &mut M, reader: &mut dyn KeyReader) {
    for Key { name, block, value, .. } in M::KEYS {
        match value {
            Value::Number { dimension, bound, set, .. } => {
                if let Some(number) = reader.number(*block, name, *dimension, *bound) {
                    set(numbers, number);
                }
            }
            Value::Count { least, set, .. } => {
                if let Some(count) = reader.count(*block, name, *least) {
                    set(numbers, count);
                }
            }
            Value::Word { words, .. } => {
                let known: Vec<&'static str> = words.iter().map(|(word, _)| *word).collect();
                if let Some((_, set)) = reader.word(*block, name, &known).and_then(|index| words.get(index)) {
                    set(numbers);
                }
            }
        }
    }
}

/// The keys of a method that hold words, with the words that its numbers have.
pub(super) fn words<M: Declaration>(numbers: &M) -> Vec<(&'static str, &'static str)> {
    let word = |key: &Key<M>| match &key.value {
        Value::Word { get, .. } => Some((key.name, get(numbers))),
        Value::Number { .. } | Value::Count { .. } => None,
    };
    M::KEYS.iter().filter_map(word).collect()
}

/// Checks the numbers of a method against the bounds of its keys.
///
/// # Errors
/// The first number that its key's bound does not admit.
pub(super) fn check<M: Declaration>(numbers: &M) -> Result<(), ParameterError> {
    for Key { name, value, .. } in M::KEYS {
        match value {
            Value::Number { bound, get, .. } => {
                if let Some(found) = get(numbers).filter(|found| !bound.admits(*found)) {
                    return Err(ParameterError { name, found, expected: bound.to_string() });
                }
            }
            Value::Count { least, get, .. } => {
                let found = get(numbers);
                if found < *least {
                    let expected = format!("a whole number of at least {least}");
                    return Err(ParameterError { name, found: f64::from(found), expected });
                }
            }
            Value::Word { .. } => {}
        }
    }
    Ok(())
}

/// A method's declaration in words, for messages and tables.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodInfo {
    /// The method's name, as scenes write it.
    pub name: &'static str,
    /// The method, in a few words.
    pub title: &'static str,
    /// How pressure is found, in a few words.
    pub pressure: &'static str,
    /// Kernels, and neighbours within their support.
    pub kernel: &'static str,
    /// How long steps are.
    pub step: &'static str,
    /// The defaults of a fluid.
    pub fluid: FluidDefaults,
    /// The keys that the method declares, in the order in which they are read.
    pub keys: Vec<KeyInfo>,
    /// The passes that the method declares.
    pub passes: Vec<Pass>,
    /// Names of the columns that the method adds to a checkpoint.
    pub saves: &'static [&'static str],
    /// Another support radius than that of the fluid's defaults, and when it is used.
    pub other_support: Option<(Support, &'static str)>,
}

/// A key's declaration in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyInfo {
    /// The key's name, as scenes write it.
    pub name: &'static str,
    /// The block that it stands in.
    pub block: KeyBlock,
    /// Its meaning, in one line.
    pub about: &'static str,
    /// Its unit; `None` for plain numbers and words.
    pub unit: Option<&'static str>,
    /// The values that it accepts: the range of a number, or the words.
    pub accepts: String,
    /// Its value if it is not stated.
    pub default: String,
}

impl MethodInfo {
    pub(super) fn of<M: Declaration>() -> Self {
        Self {
            name: M::NAME,
            title: M::TITLE,
            pressure: M::PRESSURE,
            kernel: M::KERNEL,
            step: M::STEP,
            fluid: M::FLUID,
            keys: M::KEYS.iter().map(KeyInfo::of).collect(),
            passes: M::PASSES.iter().map(|(pass, _)| *pass).collect(),
            saves: M::SAVES,
            other_support: M::OTHER_SUPPORT,
        }
    }

    /// The key with this name in a block; `None` if the method does not have it.
    pub fn key(&self, block: KeyBlock, name: &str) -> Option<&KeyInfo> {
        self.keys.iter().find(|key| key.block == block && key.name == name)
    }
}

impl KeyInfo {
    fn of<M: Declaration>(key: &Key<M>) -> Self {
        let numbers = M::default();
        let (unit, accepts, default) = match &key.value {
            Value::Number { dimension, bound, get, derived, .. } => {
                let default = get(&numbers).map_or_else(|| (*derived).to_string(), |x| x.to_string());
                (dimension.unit(), bound.to_string(), default)
            }
            Value::Count { least, get, .. } => {
                (None, format!("a whole number of at least {least}"), get(&numbers).to_string())
            }
            Value::Word { words, derived, .. } => {
                let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
                let default =
                    if derived.is_empty() { known.first().copied().unwrap_or_default() } else { derived };
                (None, known.join(", "), default.to_string())
            }
        };
        Self { name: key.name, block: key.block, about: key.about, unit, accepts, default }
    }
}
