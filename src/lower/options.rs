//! What a lowering is asked for besides its file: values of params, limits, and the words of advice about them.

use std::collections::BTreeMap;

use super::module::OpenParams;
use crate::files::Files;
use crate::quantity::Dimension;
use crate::sph::Method;

/// Limits and overrides of a lowering.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Values for params in SI units, as `-D name=value` and arguments of programs give them.
    pub overrides: BTreeMap<String, f64>,
    /// Dimensions of those overrides that were given with a unit.
    pub dimensions: BTreeMap<String, Dimension>,
    /// Where those overrides stand that a file of params gives, such as `params.toml:3`. The others are set as `set_by`
    /// says.
    pub places: BTreeMap<String, String>,
    /// What sets those overrides that stand in no file, so that advice about them is written as it is read there.
    pub set_by: SetBy,
    /// Most operations to which a file may unroll. `None` for [`MAX_NODES`](super::MAX_NODES), or
    /// [`NODES_PER_BYTE`](super::NODES_PER_BYTE) for each byte of the file and of those that it imports if that is more.
    pub max_nodes: Option<usize>,
    /// The method of every scene, in place of the one that it states. Defaults that depend on the method
    /// follow it.
    pub method: Option<Method>,
    /// Params that stay open: solids have them as `Expr::Parameter` with their number in
    /// [`Module::params`](super::Module::params). No scene is read then. `None` if all params are constants.
    pub open: Option<OpenParams>,
    /// The files that the file may name. By default there are none.
    pub files: Files,
}

/// What gives params their values where no file does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SetBy {
    /// Flags of the program: `-D d="8 mm"`.
    #[default]
    CommandLine,
    /// Arguments of Python's functions: `load(path, d="8 mm")`.
    Python,
}

impl SetBy {
    /// The words that give a param a value, which is written as it is given: a number, or a text in quotes.
    fn written(self, name: &str, value: &str) -> String {
        match self {
            Self::CommandLine => format!("-D {name}={value}"),
            // the params of an imported file have a dot in their names, which no argument has
            Self::Python if name.contains('.') => format!("**{{\"{name}\": {value}}}"),
            Self::Python => format!("{name}={value}"),
        }
    }

    /// The whole command or call that gives a param a value, as far as one is needed to be understood.
    pub(super) fn shown(self, name: &str, value: &str) -> String {
        let written = self.written(name, value);
        match self {
            Self::CommandLine => written,
            Self::Python => format!("rfm.load(path, {written})"),
        }
    }

    /// How the limit of operations is raised; `None` where it cannot be.
    pub(super) fn more_operations(self) -> Option<&'static str> {
        match self {
            Self::CommandLine => Some("allow more with --max-nodes"),
            Self::Python => None,
        }
    }
}

impl Options {
    /// How a param is given a value where it is given one now: by `-D d=8mm`, by an argument, or by a line of a file.
    pub(super) fn setting(&self, name: &str, value: &str) -> String {
        let written = self.written(name, value);
        match self.places.get(name) {
            None => format!("write {written}"),
            Some(place) => format!("write {written} at {place}"),
        }
    }

    /// The words that give a param a value, in a file, after the command or in a call.
    pub(super) fn written(&self, name: &str, value: &str) -> String {
        let in_file = self.places.contains_key(name);
        let quoted = format!("\"{value}\"");
        if in_file { format!("{name} = {quoted}") } else { self.set_by.written(name, &quoted) }
    }

    /// How a param `p` that is still to be declared is given its value, by what sets the param `name` now.
    pub(super) fn setting_of_new_param(&self, name: &str) -> String {
        match self.places.get(name) {
            None => format!("write `{}`", self.set_by.shown("p", "…")),
            Some(_) => "set `p` here".into(),
        }
    }

    /// A message about the value that a param is given, with the place of that value if it stands in a file.
    pub(super) fn about_setting(&self, name: &str, message: String) -> String {
        match self.places.get(name) {
            None => message,
            Some(place) => format!("{place}: {message}"),
        }
    }
}
