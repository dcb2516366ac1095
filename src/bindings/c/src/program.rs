//! Files and texts, checked.

use std::ffi::{CString, c_char};
use std::ptr::{null, null_mut};

use library::compile::files_beside;
use library::diagnostic::Source;
use library::files::Files;
use library::lower::{Options, ParamValue};
use library::quantity::parse_quantity;
use library::{Error, Program};

use crate::error::{Message, RfmDiagnostic, RfmError, RfmStatus, answer, attempt, read_text, text};

/// A value for a param of a file.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmParam {
    /// Name of the param.
    pub name: *const c_char,
    /// Its value.
    pub value: f64,
}

/// What a file says of one of its params. Its texts live as long as the program.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct RfmParamInfo {
    /// Name of the param.
    pub name: *const c_char,
    /// Its value, in SI units.
    pub value: f64,
    /// The least value that the file allows, in SI units; minus infinity if it states no range.
    pub low: f64,
    /// The greatest one; infinity if the file states no range.
    pub high: f64,
    /// The unit in which the file writes the value, such as "mm"; null if it writes none.
    pub unit: *const c_char,
    /// The text that the file has behind the param; null if it has none.
    pub description: *const c_char,
}

/// A checked file.
pub struct RfmProgram {
    pub program: Program,
    solids: Vec<CString>,
    params: Vec<Param>,
    warnings: Vec<Message>,
}

/// The texts of a param.
struct Param {
    name: CString,
    unit: Option<CString>,
    description: Option<CString>,
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
    Ok(RfmProgram::new(Program::check(source, options)?))
}

impl RfmProgram {
    fn new(program: Program) -> Self {
        let solids = program.module().solids.iter().map(|solid| text(&solid.name)).collect();
        let param = |param: &ParamValue| Param {
            name: text(&param.name),
            unit: param.unit.as_ref().map(|(_, written)| text(written)),
            description: param.doc.as_ref().map(text),
        };
        let params = program.params().iter().map(param).collect();
        let warnings = Message::all(&program.warnings());
        Self { program, solids, params, warnings }
    }
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

/// The same file with other values for `count` of its params, as a program of its own; those that are not named keep
/// theirs. The file is checked with all of them at once. Each is written as `rfm -D` takes it: "r=0.008", or "r=8 mm",
/// whose unit must fit the one that the file writes the param in; a number without a unit is in SI units. `then` is null
/// after a failure, and is not the place of the handle given.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_program_with(
    program: *const RfmProgram,
    settings: *const *const c_char,
    count: usize,
    then: *mut *mut RfmProgram,
    error: *mut *mut RfmError,
) -> RfmStatus {
    let set = || {
        // SAFETY: null, or a program
        let this = unsafe { program.as_ref() }.ok_or_else(|| RfmError::bad("program is null"))?;
        if settings.is_null() && count > 0 {
            return Err(RfmError::bad("settings is null"));
        }
        let mut quantities = Vec::new();
        for i in 0..count {
            // SAFETY: the caller promises that number of texts
            let setting = unsafe { read_text(*settings.add(i), "a setting") }?;
            let Some((name, value)) = setting.split_once('=') else {
                return Err(RfmError::bad(format!("`{setting}` is no setting, expected `name=value`")));
            };
            let (value, dimension) =
                parse_quantity(value).map_err(|why| RfmError::bad(format!("`{setting}`: {why}")))?;
            quantities.push((name.trim(), value, dimension));
        }
        Ok(RfmProgram::new(this.program.with_quantities(quantities)?))
    };
    // SAFETY: null, or the caller's
    unsafe { hand_out((then, "then"), error, set) }
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

/// The number of solids of a program; 0 for null.
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

/// The number of params of a program; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_param_count(program: *const RfmProgram) -> usize {
    // SAFETY: null, or a program
    unsafe { program.as_ref() }.map_or(0, |program| program.params.len())
}

/// Param `index` of a program, in the order of the file; false if there are not so many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_param(
    program: *const RfmProgram,
    index: usize,
    param: *mut RfmParamInfo,
) -> bool {
    // SAFETY: null, or a program
    let Some(this) = (unsafe { program.as_ref() }) else { return false };
    let found = this.params.get(index).zip(this.program.params().get(index));
    let Some((texts, known)) = found.filter(|_| !param.is_null()) else { return false };
    let (low, high) = known.range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let pointer = |text: &Option<CString>| text.as_ref().map_or(null(), |text| text.as_ptr());
    let (unit, description) = (pointer(&texts.unit), pointer(&texts.description));
    let info = RfmParamInfo { name: texts.name.as_ptr(), value: known.value, low, high, unit, description };
    // SAFETY: the caller may have it written
    unsafe { param.write(info) };
    true
}

/// The number of messages that do not prevent the use of a program; 0 for null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_warning_count(program: *const RfmProgram) -> usize {
    // SAFETY: null, or a program
    unsafe { program.as_ref() }.map_or(0, |program| program.warnings.len())
}

/// Message `index` of those that do not prevent the use of a program; false if there are not so many. `rfm check` also
/// measures the solids, and may tell of more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_warning(
    program: *const RfmProgram,
    index: usize,
    warning: *mut RfmDiagnostic,
) -> bool {
    // SAFETY: null, or a program; and room for one, or null
    unsafe { program.as_ref().is_some_and(|program| Message::show(&program.warnings, index, warning)) }
}

/// Frees a program; does nothing with null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rfm_program_free(program: *mut RfmProgram) {
    if !program.is_null() {
        // SAFETY: `hand_out` made it, and the caller frees it once
        answer((), || drop(unsafe { Box::from_raw(program) }));
    }
}
