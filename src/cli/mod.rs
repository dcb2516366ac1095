//! The command line: one file per subcommand; the only part of the crate that touches files and terminals.
//!
//! Data goes to standard output, messages and progress bars to standard error. Exit codes: 0 fine; 1 the input
//! has findings; 2 usage or file error; 3 numerical failure in a run; 130 interrupted.

/// One line of data on standard output.
macro_rules! say {
    ($($words:tt)*) => { $crate::cli::output::line(format_args!($($words)*)) };
}

mod args;
mod check;
mod choose;
mod eval;
mod explain;
mod input;
mod mesh;
mod output;
mod plot;
mod progress;
mod report;
mod run;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::Parser;

/// Why a command stopped; its message is printed once, here.
#[derive(Debug)]
enum Failure {
    /// The input has findings, which were printed already.
    Findings,
    /// A wrong flag, a file that cannot be read or written.
    Usage(String),
    /// A run whose numbers became useless.
    Numerical(String),
    /// Stopped by the user, in order.
    Interrupted,
    /// Somebody closed our output: nothing is left to do, and nothing is wrong.
    ClosedPipe,
}

impl Failure {
    fn usage(message: impl std::fmt::Display) -> Self {
        Self::Usage(message.to_string())
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        match error.kind() {
            std::io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            _ => Self::Usage(error.to_string()),
        }
    }
}

/// Runs the program with the arguments of a process.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments = match args::Arguments::try_parse_from(arguments) {
        Ok(arguments) => arguments,
        Err(error) => {
            // help and version count as errors of clap; printing can only fail if nobody reads
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    match command(arguments) {
        Ok(()) | Err(Failure::ClosedPipe) => ExitCode::SUCCESS,
        Err(Failure::Findings) => ExitCode::from(1),
        Err(Failure::Usage(message)) => {
            complain(&message);
            ExitCode::from(2)
        }
        Err(Failure::Numerical(message)) => {
            complain(&message);
            ExitCode::from(3)
        }
        Err(Failure::Interrupted) => ExitCode::from(130),
    }
}

fn command(arguments: args::Arguments) -> Result<(), Failure> {
    if let Some(threads) = arguments.shared.threads {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global();
        pool.map_err(|e| Failure::usage(format!("cannot start {threads} threads: {e}")))?;
    }
    let shared = arguments.shared;
    match arguments.command {
        args::Command::Check(options) => check::run(&shared, &options),
        args::Command::Eval(options) => eval::run(&shared, &options),
        args::Command::Mesh(options) => mesh::run(&shared, &options),
        args::Command::Run(options) => run::run(&shared, &options),
        args::Command::Report(options) => report::run(&shared, &options),
        args::Command::Explain(options) => explain::run(&shared, &options),
    }
}

fn complain(message: &str) {
    let red = anstyle::AnsiColor::Red.on_default().bold();
    anstream::eprintln!("{red}error{red:#}: {message}");
}

/// A remark that is no finding: on standard error, never part of the data.
fn note(message: impl std::fmt::Display) {
    let blue = anstyle::AnsiColor::Blue.on_default().bold();
    anstream::eprintln!("{blue}note{blue:#}: {message}");
}
