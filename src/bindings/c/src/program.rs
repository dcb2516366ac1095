//! Files and texts, checked.

use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};

use library::compile::files_beside;
use library::diagnostic::Source;
use library::files::Files;
use library::lower::Options;
use library::{Error, Program};

use crate::error::{RfmError, RfmStatus, answer, attempt, read_text, text};

/// A value for a param of a file.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmParam {
    /// Name of the param.
    pub name: *const c_char,
    /// Its value.
    pub value: f64,
}

/// A checked file.
pub struct RfmProgram {
    pub program: Program,
    solids: Vec<CString>,
}

/// The params that a caller gives.
///
/// # Safety
/// There are `count` of them, whose names end with zero bytes.
// SAFETY: the caller promises what the reads need
unsafe fn options(params: *const RfmParam, count: usize) -> Result<Options, RfmError> {
    let mut options = Options::default();
    if params.is_null() && count > 0 {
        return Err(RfmError::bad("params is null"));
    }
    for i in 0..count {
        // SAFETY: the caller promises that number of params
        let param = unsafe { *params.add(i) };
        // SAFETY: and that their names end with zero bytes
        let name = unsafe { read_text(param.name, "the name of a param") }?;
        options.overrides.insert(name.to_string(), param.value);
    }
    Ok(options)
}

fn checked(source: Source, options: Options) -> Result<RfmProgram, RfmError> {
    let program = Program::check(source, options)?;
    let solids = program.module().solids.iter().map(|solid| text(&solid.name)).collect();
    Ok(RfmProgram { program, solids })
}

/// Checks a text with the name that messages show, which a caller knows as `called`.
///
/// # Safety
/// Both are null, or end with zero bytes; there are `count` params, whose names do so, too.
// SAFETY: the caller promises what the reads need
unsafe fn checked_text(
    (text, name, called): (*const c_char, *const c_char, &str),
    (params, count): (*const RfmParam, usize),
    files: impl FnOnce(&str) -> Files,
) -> Result<RfmProgram, RfmError> {
    // SAFETY: the caller promises texts
    let (text, name) = unsafe { (read_text(text, "text")?, read_text(name, called)?) };
    // SAFETY: the caller promises that number of params
    let mut options = unsafe { options(params, count) }?;
    options.files = files(name);
    checked(Source::file(name, text), options)
}

/// Reads and checks a file, with values for `count` of its params; `params` may be null if there are none. `program` is
/// null after a failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_load_file(
    path: *const c_char,
    params: *const RfmParam,
    count: usize,
    program: *mut *mut RfmProgram,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let load = || {
        // SAFETY: the caller promises a text
        let path = unsafe { read_text(path, "path") }?;
        // SAFETY: the caller promises that number of params
        let mut options = unsafe { options(params, count) }?;
        options.files = files_beside(path, false);
        let read = std::fs::read(path).and_then(library::compile::text_of);
        let text = read.map_err(|error| Error::File { path: path.to_string(), error })?;
        checked(Source::file(path, text), options)
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((program, "program"), error, load) }
}

/// Checks a text, with values for `count` of its params. Messages show `name` in place of a path. The text may name no other
/// files, see `rfm_load_text_as`. `program` is null after a failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_load_text(
    text: *const c_char,
    name: *const c_char,
    params: *const RfmParam,
    count: usize,
    program: *mut *mut RfmProgram,
    error: *mut *mut RfmError,
) -> RfmStatus {
    // SAFETY: the caller promises texts and params
    let load = || unsafe { checked_text((text, name, "name"), (params, count), |_| Files::default()) };
    // SAFETY: null, or the caller's
    unsafe { hand_out((program, "program"), error, load) }
}

/// Checks a text that stands for the file with a path, which is not read: the text may name other files in its folder and
/// below, and messages show `path`. `program` is null after a failure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_load_text_as(
    text: *const c_char,
    path: *const c_char,
    params: *const RfmParam,
    count: usize,
    program: *mut *mut RfmProgram,
    error: *mut *mut RfmError,
) -> RfmStatus {
    // SAFETY: the caller promises texts and params
    let load =
        || unsafe { checked_text((text, path, "path"), (params, count), |path| files_beside(path, false)) };
    // SAFETY: null, or the caller's
    unsafe { hand_out((program, "program"), error, load) }
}

/// Makes a handle and gives it to the caller: null if it could not be made, so that what an earlier call gave is never
/// taken for the result of this one.
///
/// # Safety
/// `to` and `error` are null or may be written to.
// SAFETY: the caller promises what the writes need
pub unsafe fn hand_out<T>(
    (to, name): (*mut *mut T, &str),
    error: *mut *mut RfmError,
    make: impl FnOnce() -> Result<T, RfmError>,
) -> RfmStatus {
    let work = || {
        if to.is_null() {
            return Err(RfmError::bad(format!("{name} is null")));
        }
        // SAFETY: the caller may have it written
        unsafe { to.write(null_mut()) };
        let handle = Box::into_raw(Box::new(make()?));
        // SAFETY: the caller may have it written
        unsafe { to.write(handle) };
        Ok(())
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, work) }
}

/// The number of solids of a program.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_solid_count(program: *const RfmProgram) -> usize {
    // SAFETY: null, or a program
    unsafe { program.as_ref() }.map_or(0, |program| program.solids.len())
}

/// The name of solid `index` of a program; null if there are not so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_solid_name(program: *const RfmProgram, index: usize) -> *const c_char {
    // SAFETY: null, or a program
    let name = unsafe { program.as_ref() }.and_then(|program| program.solids.get(index));
    name.map_or(null(), |name| name.as_ptr())
}

/// Frees a program; does nothing with null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_program_free(program: *mut RfmProgram) {
    if !program.is_null() {
        // SAFETY: `hand_out` made it, and the caller frees it once
        answer((), || drop(unsafe { Box::from_raw(program) }));
    }
}
