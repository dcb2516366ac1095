//! One test binary: one link of the code generator.

mod agreement;
mod bad_input;
mod cells;
mod cli;
mod contact;
mod diagnostics;
mod examples;
mod meshes;
mod numbers;
mod pipeline;
mod properties;
mod ranges;
mod tidy;
mod tool;
