//! Statuses and error objects, and how a panic becomes one.

use std::any::Any;
use std::ffi::{CStr, CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::{null, null_mut};

use library::diagnostic::{Diagnostics, Severity};

use super::environment::Hosts;

/// How a function ended.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RfmStatus {
    /// It did what it was asked.
    RFM_OK = 0,
    /// A pointer is null that must not be, a text is not UTF-8, a number is out of range, or what is asked for cannot be made
    /// of what is given, as the mesh of a solid without an end.
    RFM_BAD_ARGUMENT = 1,
    /// A file could not be read.
    RFM_FILE = 2,
    /// A file has mistakes; the error object lists them.
    RFM_MISTAKES = 3,
    /// There is no solid of this name.
    RFM_UNKNOWN_NAME = 4,
    /// No machine code can be made here.
    RFM_NO_MACHINE_CODE = 5,
    /// A bug of the library. The handles stay usable.
    RFM_INTERNAL = 6,
}

use RfmStatus::*;

/// How serious a message is.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RfmSeverity {
    /// The file is accepted, but something about it is odd.
    RFM_WARNING = 0,
    /// The file is refused.
    RFM_ERROR = 1,
}

/// A message about a file. Its texts live as long as the error object, or the program, that it comes from.
#[repr(C)]
pub struct RfmDiagnostic {
    /// How serious it is.
    pub severity: RfmSeverity,
    /// Its code, such as "E0201", which `rfm explain` explains.
    pub code: *const c_char,
    /// What was found.
    pub message: *const c_char,
    /// The file as the caller named it.
    pub file: *const c_char,
    /// The first line, from 1.
    pub line: usize,
    /// The first column in characters, from 1.
    pub column: usize,
    /// What would be accepted; null if nothing is known.
    pub help: *const c_char,
}

/// Why a function failed.
pub struct RfmError {
    status: RfmStatus,
    message: CString,
    diagnostics: Vec<Message>,
}

/// A message about a file, with its texts.
pub struct Message {
    severity: RfmSeverity,
    texts: [CString; 3],
    help: Option<CString>,
    place: [usize; 2],
}

/// A text for C: zero bytes in it are shown as another character.
pub fn text(of: impl ToString) -> CString {
    CString::new(of.to_string().replace('\0', "\u{fffd}")).unwrap_or_default()
}

impl RfmError {
    pub fn new(status: RfmStatus, message: impl ToString) -> Self {
        Self { status, message: text(message), diagnostics: Vec::new() }
    }

    pub fn bad(message: impl ToString) -> Self {
        Self::new(RFM_BAD_ARGUMENT, message)
    }

    fn panicked(cause: &(dyn Any + Send)) -> Self {
        let cause = cause.downcast_ref::<&str>().copied().or(cause.downcast_ref::<String>().map(|s| &**s));
        Self::new(RFM_INTERNAL, format!("a bug of rfm: {}", cause.unwrap_or("unknown")))
    }
}

impl Message {
    /// All messages of some diagnostics.
    pub fn all(found: &Diagnostics) -> Vec<Self> {
        let message = |message: &library::diagnostic::Diagnostic| {
            let span = message.primary.span;
            let source = found.source(span.source);
            let place = source.map(|source| source.position(span.start as usize));
            Self {
                severity: match message.severity {
                    Severity::Warning => RfmSeverity::RFM_WARNING,
                    Severity::Error => RfmSeverity::RFM_ERROR,
                },
                texts: [text(message.code.0), text(&message.message), text(source.map_or("", |s| &s.name))],
                help: message.help.as_ref().map(text),
                place: place.map_or([0, 0], |place| [place.line, place.column]),
            }
        };
        found.list.iter().map(message).collect()
    }

    /// Message `index` of a list, as C sees it; false if there are not so many.
    ///
    /// # Safety
    /// `to` is null or may be written to.
    // SAFETY: the caller promises what the one write needs
    pub unsafe fn show(list: &[Self], index: usize, to: *mut RfmDiagnostic) -> bool {
        let Some(found) = list.get(index).filter(|_| !to.is_null()) else { return false };
        let [code, message, file] = found.texts.each_ref().map(|text| text.as_ptr());
        let ([line, column], severity) = (found.place, found.severity);
        let help = found.help.as_ref().map_or(null(), |help| help.as_ptr());
        // SAFETY: the caller may have it written
        unsafe { to.write(RfmDiagnostic { severity, code, message, file, line, column, help }) };
        true
    }
}

impl From<Diagnostics> for RfmError {
    fn from(found: Diagnostics) -> Self {
        Self { status: RFM_MISTAKES, message: text(&found), diagnostics: Message::all(&found) }
    }
}

impl From<library::Error> for RfmError {
    fn from(error: library::Error) -> Self {
        match error {
            library::Error::Diagnostics(found) => found.into(),
            library::Error::File { .. } => Self::new(RFM_FILE, error),
            library::Error::UnknownName { .. } => Self::new(RFM_UNKNOWN_NAME, error),
            library::Error::Codegen(_) => Self::new(RFM_NO_MACHINE_CODE, error),
        }
    }
}

/// Runs a function that may fail. `error` is where the caller wants an error object, or null.
///
/// # Safety
/// `error` is null or may be written to.
// SAFETY: the caller promises what the one write needs
pub unsafe fn attempt(error: *mut *mut RfmError, work: impl FnOnce() -> Result<(), RfmError>) -> RfmStatus {
    let _hosts = Hosts::leave();
    let result =
        catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|cause| Err(RfmError::panicked(&*cause)));
    let (status, object) = match result {
        Ok(()) => (RFM_OK, null_mut()),
        Err(found) => (found.status, Box::into_raw(Box::new(found))),
    };
    if error.is_null() {
        // SAFETY: it was made by a box just now, or is null
        unsafe { rfm_error_free(object) };
    } else {
        // SAFETY: the caller may have it written
        unsafe { error.write(object) };
    }
    status
}

/// Runs a function that answers with numbers; after a panic the answer is `otherwise`.
#[inline]
pub fn answer<R>(otherwise: R, work: impl FnOnce() -> R) -> R {
    let _hosts = Hosts::leave();
    catch_unwind(AssertUnwindSafe(work)).unwrap_or(otherwise)
}

/// A text of the caller.
///
/// # Safety
/// It is null, or ends with a zero byte.
// SAFETY: the caller promises what the one read needs
pub unsafe fn read_text<'a>(given: *const c_char, name: &str) -> Result<&'a str, RfmError> {
    if given.is_null() {
        return Err(RfmError::bad(format!("{name} is null")));
    }
    // SAFETY: the caller promises that it ends with a zero byte
    let text = unsafe { CStr::from_ptr(given) };
    text.to_str().map_err(|_| RfmError::bad(format!("{name} is not UTF-8")))
}

/// How the function that made the error ended; RFM_OK for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_error_status(error: *const RfmError) -> RfmStatus {
    // SAFETY: null, or an error object
    unsafe { error.as_ref() }.map_or(RFM_OK, |error| error.status)
}

/// What happened, as `rfm` prints it. It lives as long as the error object; empty for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_error_message(error: *const RfmError) -> *const c_char {
    // SAFETY: null, or an error object
    unsafe { error.as_ref() }.map_or(c"".as_ptr(), |error| error.message.as_ptr())
}

/// The number of messages about a file; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_error_count(error: *const RfmError) -> usize {
    // SAFETY: null, or an error object
    unsafe { error.as_ref() }.map_or(0, |error| error.diagnostics.len())
}

/// Message `index` about a file; false if there are not so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_error_diagnostic(
    error: *const RfmError,
    index: usize,
    diagnostic: *mut RfmDiagnostic,
) -> bool {
    // SAFETY: null, or an error object; and room for one, or null
    unsafe { error.as_ref().is_some_and(|error| Message::show(&error.diagnostics, index, diagnostic)) }
}

/// Frees an error object; does nothing with null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_error_free(error: *mut RfmError) {
    if !error.is_null() {
        // SAFETY: `attempt` made it, and the caller frees it once
        answer((), || drop(unsafe { Box::from_raw(error) }));
    }
}
