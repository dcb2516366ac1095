//! The options that all commands share.

use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use rfm::quantity::Dimension;

use super::values::{Definition, definition, threads};

#[derive(Debug, Clone, Args)]
pub(super) struct Shared {
    /// Set a param of the file, with a unit or in SI units (-D d=8mm, -D alpha="10 deg"); may be repeated
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = definition, global = true)]
    pub define: Vec<Definition>,
    /// Set params from a TOML or JSON file: `d = "8 mm"`, `alpha = 0.5`; -D goes before it; may be repeated
    #[arg(short = 'P', long, value_name = "FILE", global = true)]
    pub params: Vec<PathBuf>,
    /// Threads to use [default: all processors]; results do not depend on it
    #[arg(long, value_name = "N", value_parser = threads, global = true)]
    pub threads: Option<NonZeroUsize>,
    /// Print one JSON document on standard output instead of text
    #[arg(long, global = true)]
    pub json: bool,
    /// Let a file import and read files outside of its own folder
    #[arg(long, global = true, hide_short_help = true)]
    pub allow_outside: bool,
    /// Operations that a file may unroll to [default: 1000000, or 4 for each byte of a longer file with its imports]
    #[arg(long, value_name = "N", global = true, hide_short_help = true)]
    pub max_nodes: Option<usize>,
    /// What evaluates ω: machine code or the interpreter, which gives the same bits
    #[arg(long, value_enum, default_value_t = Engine::Auto, global = true, hide_short_help = true)]
    pub engine: Engine,
}

impl Shared {
    /// The kinds of quantities of the params that are given with a unit. A later one without a unit hides an earlier one.
    pub fn dimensions(&self) -> BTreeMap<String, Dimension> {
        let last: BTreeMap<&str, Option<Dimension>> =
            self.define.iter().map(|given| (given.name.as_str(), given.dimension)).collect();
        last.into_iter().filter_map(|(name, dimension)| Some((name.to_string(), dimension?))).collect()
    }

    /// Where those params stand that files set, by their names. Of two values for one param the later one counts.
    pub fn places(&self) -> BTreeMap<String, String> {
        let mut places = BTreeMap::new();
        for given in &self.define {
            match &given.place {
                Some(place) => places.insert(given.name.clone(), place.clone()),
                None => places.remove(&given.name),
            };
        }
        places
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Engine {
    /// Machine code where it can be made
    Auto,
    /// Machine code, or an error
    Jit,
    /// The interpreter
    Interp,
}

impl From<Engine> for rfm::Engine {
    fn from(engine: Engine) -> Self {
        match engine {
            Engine::Auto => Self::Auto,
            Engine::Jit => Self::Jit,
            Engine::Interp => Self::Interpreter,
        }
    }
}
