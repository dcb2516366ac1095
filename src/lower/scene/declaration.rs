//! How the keys of a scene are declared: once, beside their reader, with what they may hold, what holds
//! without them and what they mean. The reader takes bounds and defaults from there, `rfm explain` and
//! editors their texts.
//!
//! Keys of methods are declared by the methods, see [`crate::sph`].

use glam::DVec3;

use crate::quantity::{Bound, Dimension};

/// A key of a block that every method has.
#[derive(Debug, Clone, Copy)]
pub struct SceneKey {
    /// The key's name, as scenes write it.
    pub name: &'static str,
    /// What it may hold.
    pub value: KeyValue,
    /// What holds without it.
    pub without: Without,
    /// Its meaning, in one line.
    pub about: &'static str,
}

/// What a key may hold.
#[derive(Debug, Clone, Copy)]
pub enum KeyValue {
    /// A number that the bound admits.
    Number(Dimension, Bound),
    /// A whole number of at least this.
    Count(u32),
    /// A vector of three numbers.
    Vector(Dimension),
    /// A formula of place or time, or three of them.
    Formulas(Dimension),
    /// One of a few words.
    Words(&'static [&'static str]),
    /// The name of a method.
    MethodName,
    /// What a probe is known to measure, a number or a vector.
    Measured,
    /// A block with these keys.
    Block(&'static [SceneKey]),
    /// Something else, such as a solid or a name.
    Other,
}

/// What holds without a key.
#[derive(Debug, Clone, Copy)]
pub enum Without {
    /// This number.
    Is(f64),
    /// This vector.
    Is3([f64; 3]),
    /// What these words say.
    Text(&'static str),
    /// The key must be there, or another one in its place.
    Required,
}

impl SceneKey {
    /// The unit of its numbers in words; `None` for plain numbers and other values.
    pub fn unit(&self) -> Option<String> {
        match self.value {
            KeyValue::Number(dimension, _) | KeyValue::Vector(dimension) | KeyValue::Formulas(dimension) => {
                dimension.unit().map(|unit| unit.replace("^2", "²").replace("^3", "³"))
            }
            KeyValue::Measured => Some("that of the figures".into()),
            KeyValue::Count(_)
            | KeyValue::Words(_)
            | KeyValue::MethodName
            | KeyValue::Block(_)
            | KeyValue::Other => None,
        }
    }

    /// What holds without it in words; `None` if it must be there.
    pub fn default(&self) -> Option<String> {
        match self.without {
            Without::Is(number) => Some(number.to_string()),
            Without::Is3([x, y, z]) => Some(format!("[{x}, {y}, {z}]")),
            Without::Text(text) => Some(text.into()),
            Without::Required => None,
        }
    }

    /// The dimension of its numbers.
    pub(in crate::lower) fn dimension(&self) -> Dimension {
        match self.value {
            KeyValue::Number(dimension, _) | KeyValue::Vector(dimension) | KeyValue::Formulas(dimension) => {
                dimension
            }
            KeyValue::Count(_)
            | KeyValue::Words(_)
            | KeyValue::MethodName
            | KeyValue::Measured
            | KeyValue::Block(_)
            | KeyValue::Other => Dimension::NONE,
        }
    }

    /// The bound of its number.
    pub(in crate::lower) fn bound(&self) -> Option<Bound> {
        match self.value {
            KeyValue::Number(_, bound) => Some(bound),
            _ => None,
        }
    }

    /// The words that it accepts; none if it accepts something else.
    pub(in crate::lower) fn words(&self) -> &'static [&'static str] {
        match self.value {
            KeyValue::Words(words) => words,
            _ => &[],
        }
    }

    /// The keys of the block that it opens; `None` if it has a value.
    pub(in crate::lower) fn block(&self) -> Option<&'static [SceneKey]> {
        match self.value {
            KeyValue::Block(keys) => Some(keys),
            _ => None,
        }
    }

    /// The number that holds without it; `None` if that is no number.
    pub(in crate::lower) fn number_without(&self) -> Option<f64> {
        match self.without {
            Without::Is(number) => Some(number),
            Without::Is3(_) | Without::Text(_) | Without::Required => None,
        }
    }

    /// The vector that holds without it; `None` if that is no vector.
    pub(in crate::lower) fn vector_without(&self) -> Option<DVec3> {
        match self.without {
            Without::Is3(vector) => Some(DVec3::from_array(vector)),
            Without::Is(_) | Without::Text(_) | Without::Required => None,
        }
    }
}

/// The names of keys.
pub(in crate::lower) fn names(keys: &[SceneKey]) -> impl Iterator<Item = &'static str> {
    keys.iter().map(|key| key.name)
}

/// Declares the keys of a block as constants in a module, with the list `ALL` of them.
macro_rules! declare_keys {
    (
        $(#[$meta:meta])*
        mod $module:ident {
            $($constant:ident = $name:literal, $value:expr, $without:expr, $about:literal;)+
        }
    ) => {
        $(#[$meta])*
        pub(in crate::lower) mod $module {
            // no block has keys of every kind
            #[allow(unused_imports)]
            use crate::lower::scene::declaration::{
                KeyValue::{Block, Count, Formulas, Measured, MethodName, Number, Other, Vector, Words},
                SceneKey,
                Without::{Is, Is3, Required, Text},
            };
            #[allow(unused_imports)]
            use crate::quantity::{Bound, Dimension};

            $(
                #[doc = $about]
                pub const $constant: SceneKey =
                    SceneKey { name: $name, value: $value, without: $without, about: $about };
            )+

            /// All keys of the block, in the order in which they are listed.
            pub const ALL: &[SceneKey] = &[$($constant),+];
        }
    };
}
pub(in crate::lower) use declare_keys;
