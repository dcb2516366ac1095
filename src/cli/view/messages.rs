//! What went wrong, as text for the page.

use super::super::failure::Failure;
use rfm::Error;
use rfm::diagnostic::{Diagnostics, Style, render};

pub(super) fn plain(diagnostics: &Diagnostics) -> String {
    render(diagnostics, Style::Panel)
}

pub(super) fn refused(error: Error) -> String {
    match error {
        Error::Diagnostics(diagnostics) => plain(&diagnostics),
        other => other.to_string(),
    }
}

pub(super) fn message(failure: Failure) -> String {
    match failure {
        Failure::Usage(message) | Failure::Numerical(message) => message,
        Failure::Findings | Failure::Params | Failure::Interrupted | Failure::ClosedPipe => {
            "the file has mistakes".into()
        }
    }
}
