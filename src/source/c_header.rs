//! Headers of C: what a file and an object file declare.

use super::File;
use super::c::{CFile, Flavour};
use super::c_linkage::{guard, in_c};

/// The header of a translation unit.
pub(super) fn header(file: &File<'_>) -> String {
    declared(file, &[])
}

/// The header of an object file.
pub(super) fn object_header(file: &File<'_>) -> String {
    let mut remarks = vec!["Functions of the object file beside it. Columns must not overlap."];
    remarks.extend(CFile { file, flavour: Flavour::Unit }.bits());
    declared(file, &remarks)
}

/// The declarations of all functions, with remarks in the head.
fn declared(file: &File<'_>, remarks: &[&str]) -> String {
    let writer = CFile { file, flavour: Flavour::Unit };
    let guard = guard(file, "H");
    let mut lines = vec!["/*".to_string()];
    lines.extend(file.title().iter().map(|line| format!(" * {line}")));
    lines.extend(remarks.iter().map(|line| format!(" * {line}")));
    lines.push(" */".into());
    lines.extend([format!("#ifndef {guard}"), format!("#define {guard}"), String::new()]);
    lines.extend(["#include <stddef.h>".to_string(), String::new()]);
    lines.extend(in_c(writer.params().into_iter().chain([String::new()]).chain(writer.declarations())));
    lines.extend(["", "#endif"].map(String::from));
    lines.join("\n") + "\n"
}
