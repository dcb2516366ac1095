//! A file after lowering: its graph, and what the file defines in it.

use std::collections::{BTreeMap, BTreeSet};

use super::scene::{Scene, Tolerance};
use crate::diagnostic::Span;
use crate::ir::{Graph, Node};
use crate::quantity::{Dimension, Unit, in_unit};

/// What a file defines, after lowering.
#[derive(Debug, Clone, Default)]
pub struct Module {
    /// The expressions of all items.
    pub graph: Graph,
    /// The params, in the order of the file.
    pub params: Vec<ParamValue>,
    /// Numbers of open params whose values have decided how a solid is built, such as the length of a range. They
    /// must be constants, see [`Options::open`](super::Options::open).
    pub fixed: BTreeSet<u32>,
    /// The solids, in the order of the file.
    pub solids: Vec<NamedSolid>,
    /// The scenes, in the order of the file.
    pub scenes: Vec<Scene>,
    /// Sizes of standard solids that depend on the place.
    pub varying_sizes: Vec<VaryingSize>,
    /// Dimensions of those params and names of the file, imports apart, whose units tell them.
    pub dimensions: BTreeMap<String, Dimension>,
}

/// A `param` with the value that it has in this lowering.
#[derive(Debug, Clone, PartialEq)]
pub struct ParamValue {
    /// Name of the param.
    pub name: String,
    /// Value in SI units, from the file or from an override.
    pub value: f64,
    /// Least and greatest value in SI units, if the file states them.
    pub range: Option<(f64, f64)>,
    /// The unit in which the file writes the value, and its text there, if it has one.
    pub unit: Option<(Unit, String)>,
    /// The text that the file has behind the param, if any.
    pub doc: Option<String>,
    /// Place of the name in its definition.
    pub span: Span,
}

impl ParamValue {
    /// A value of this param as a text, in the unit that the file uses for it.
    pub fn shown(&self, value: f64) -> String {
        match &self.unit {
            Some((unit, text)) => in_unit(value, *unit, text),
            None => value.to_string(),
        }
    }
}

/// A `solid` of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedSolid {
    /// Name of the solid.
    pub name: String,
    /// Its ω in the graph of the [`Module`].
    pub node: Node,
    /// The largest error of ω that is accepted, as `@tolerance(…)` states it.
    pub tolerance: Option<Tolerance>,
    /// Place of the name in its definition.
    pub span: Span,
}

/// A size of a standard solid that depends on the place, as in `sphere(x)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VaryingSize {
    /// Name of the solid.
    pub function: String,
    /// Name of the size.
    pub parameter: String,
    /// Place of its value.
    pub value: Span,
    /// Place of the call.
    pub call: Span,
}

/// Which params stay open, and for which solids.
#[derive(Debug, Clone, Default)]
pub struct OpenParams {
    /// Names of those that are constants all the same.
    pub fixed: BTreeSet<String>,
    /// The solids that are read, with what they are made of; `None` for all of them.
    pub solids: Option<BTreeSet<String>>,
}
