//! How a command ends if it does not succeed, and the lines that people read on standard error.

use std::fmt::Display;
use std::process::ExitCode;

use rfm::diagnostic::{Code, printable};

/// Why a command stopped. Its message is printed once, by [`Failure::report`].
#[derive(Debug)]
pub(super) enum Failure {
    /// The input has findings, which have been printed already.
    Findings,
    /// A wrong flag, or a file that cannot be read or written.
    Usage(String),
    /// Flags that set params as the file does not allow, which has been printed already.
    Params,
    /// A run whose numbers became useless.
    Numerical(String),
    /// The user stopped the command, and it ended in order.
    Interrupted,
    /// The reader of our output closed it: nothing is left to do, and nothing is wrong.
    ClosedPipe,
}

impl Failure {
    /// A wrong flag, or a file that cannot be read or written.
    pub fn usage(message: impl Display) -> Self {
        Self::Usage(message.to_string())
    }

    /// Prints the message, if there is one, and gives the exit code.
    pub fn report(self) -> ExitCode {
        match self {
            Self::ClosedPipe => ExitCode::SUCCESS,
            Self::Findings => ExitCode::from(1),
            Self::Params => ExitCode::from(2),
            Self::Usage(message) => {
                complain(&message);
                ExitCode::from(2)
            }
            Self::Numerical(message) => {
                complain(&message);
                ExitCode::from(3)
            }
            Self::Interrupted => ExitCode::from(130),
        }
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

/// Prints an error.
pub(super) fn complain(message: &str) {
    let red = anstyle::AnsiColor::Red.on_default().bold();
    anstream::eprintln!("{red}error{red:#}: {}", printable(message));
}

/// Prints a warning with its code.
pub(super) fn warn(code: Code, message: impl Display) {
    let yellow = anstyle::AnsiColor::Yellow.on_default().bold();
    anstream::eprintln!("{yellow}warning[{}]{yellow:#}: {}", code.0, printable(&message.to_string()));
}

/// Prints a remark that is no finding. It goes to standard error and is never part of the data.
pub(super) fn note(message: impl Display) {
    let blue = anstyle::AnsiColor::Blue.on_default().bold();
    anstream::eprintln!("{blue}note{blue:#}: {}", printable(&message.to_string()));
}
