//! The `rfm` program: arguments → [`cli::run`] → exit code.
//!
//! The commands belong to the program and not to the library, so that a change in them compiles them alone, and a
//! program that embeds obstacles does not compile them at all.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run(std::env::args_os())
}
