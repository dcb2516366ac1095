//! `--sweep`: a command for each combination of values of some params, each in a folder of its own, with an
//! index, a table and a plot of the main figures.
//!
//! | file | what it holds |
//! |---|---|
//! | `options` | the options |
//! | `values` | what `--sweep` accepts, the grid, the names of folders |
//! | `commands` | what each command does in the folder of a combination |
//! | `task` | what all commands have in common: the folder, the index, the order of things |
//! | `figures` | the main figures of each command |
//! | `index` | `index.json` and the table |
//! | `plot` | the plot |
//!
//! Invariant: a combination that fails is noted in the index, and the others go on. The index is written
//! after each.

pub(in crate::cli) mod commands;
mod figures;
mod index;
pub(in crate::cli) mod options;
mod plot;
mod task;
mod values;
