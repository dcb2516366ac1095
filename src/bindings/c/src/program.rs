//! Files and texts, checked.

use std::ffi::{CString, c_char};
use std::ptr::null;

use library::compile::files_beside;
use library::diagnostic::Source;
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
        // SAFETY: the caller promises so many params
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

/// Reads and checks a file, with values for `count` of its params; `params` may be null if there are none.
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
        // SAFETY: the caller promises so many params
        let mut options = unsafe { options(params, count) }?;
        options.files = files_beside(path, false);
        let read = std::fs::read(path).and_then(library::compile::text_of);
        let text = read.map_err(|error| Error::File { path: path.to_string(), error })?;
        // SAFETY: the caller may have it written
        unsafe { hand_out(program, "program", checked(Source::file(path, text), options)?) }
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, load) }
}

/// Checks a text, with values for `count` of its params. Messages show `name` in place of a path. The text may name no other
/// files, see `rfm_load_text_as`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_load_text(
    text: *const c_char,
    name: *const c_char,
    params: *const RfmParam,
    count: usize,
    program: *mut *mut RfmProgram,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let load = || {
        // SAFETY: the caller promises texts
        let (text, name) = unsafe { (read_text(text, "text")?, read_text(name, "name")?) };
        // SAFETY: the caller promises so many params
        let options = unsafe { options(params, count) }?;
        // SAFETY: the caller may have it written
        unsafe { hand_out(program, "program", checked(Source::file(name, text), options)?) }
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, load) }
}

/// Checks a text that stands for the file with a path, which is not read: the text may name other files in its folder and
/// below, and messages show `path`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_load_text_as(
    text: *const c_char,
    path: *const c_char,
    params: *const RfmParam,
    count: usize,
    program: *mut *mut RfmProgram,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let load = || {
        // SAFETY: the caller promises texts
        let (text, path) = unsafe { (read_text(text, "text")?, read_text(path, "path")?) };
        // SAFETY: the caller promises so many params
        let mut options = unsafe { options(params, count) }?;
        options.files = files_beside(path, false);
        // SAFETY: the caller may have it written
        unsafe { hand_out(program, "program", checked(Source::file(path, text), options)?) }
    };
    // SAFETY: null, or the caller's
    unsafe { attempt(error, load) }
}

/// Gives a new handle to the caller.
///
/// # Safety
/// `to` is null or may be written to.
// SAFETY: the caller promises what the one write needs
pub unsafe fn hand_out<T>(to: *mut *mut T, name: &str, handle: T) -> Result<(), RfmError> {
    if to.is_null() {
        return Err(RfmError::bad(format!("{name} is null")));
    }
    // SAFETY: the caller may have it written
    unsafe { to.write(Box::into_raw(Box::new(handle))) };
    Ok(())
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
