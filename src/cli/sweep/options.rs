//! The options of commands that can be swept.

use std::path::PathBuf;

use clap::Args;

use super::values::{Sweep, sweep};

/// Options of commands that can be swept.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Sweeps")]
pub(in crate::cli) struct SweepOptions {
    /// Repeat the command for N values of a param from A to B, both included, or for those of a list, NAME=A,B,…, in
    /// folders of their own, with index.json, a table and a plot beside them; several make a grid. The unit stands
    /// behind the last number: --sweep alpha="0..30 deg:4"
    #[arg(long, value_name = "NAME=A..B:N|A,B,…", value_parser = sweep)]
    pub sweep: Vec<Sweep>,
    /// The folder of a sweep [default: the file's name + .sweep]
    #[arg(long, value_name = "DIR", requires = "sweep")]
    pub into: Option<PathBuf>,
}

/// What becomes of a sweep that a folder holds already, for commands that have no such options of their own.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Sweeps")]
pub(in crate::cli) struct Again {
    /// Go on with the sweep that the folder holds: values without figures, or with new ones
    #[arg(long, requires = "sweep")]
    pub resume: bool,
    /// Replace the sweep that the folder holds; without a sweep the file is replaced anyway
    #[arg(long, conflicts_with = "resume")]
    pub force: bool,
}
