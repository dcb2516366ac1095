//! One test binary: one link of the code generator.

mod agreement;
mod bad_input;
mod cli;
mod diagnostics;
mod examples;
mod numbers;
mod pipeline;
mod properties;
mod tidy;
mod tool;
