//! The `rfm` program: arguments → [`rfm::cli::run`] → exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    rfm::cli::run(std::env::args_os())
}
