//! Headers of C: what a file and an object file declare, and the names of its functions.

use super::File;
use super::c::{CFile, Flavour};
use super::language::C;
use super::program::Question;
use crate::precision::Precision;

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

/// Declarations of functions that have the linkage of C in C++ as well.
pub(super) fn in_c(declarations: impl IntoIterator<Item = String>) -> Vec<String> {
    let [begin, end] =
        [["#ifdef __cplusplus", "extern \"C\" {", "#endif"], ["#ifdef __cplusplus", "}", "#endif"]];
    begin.map(String::from).into_iter().chain(declarations).chain(end.map(String::from)).collect()
}

/// The macro that keeps a header from being read twice. Its case is that of the prefix: `a` and `A` are two solids.
pub(super) fn guard(file: &File<'_>, what: &str) -> String {
    format!("RFM_{}_{what}", file.prefix)
}

/// The name of the function for one point.
pub(super) fn function_name(file: &File<'_>, question: Question, precision: Precision) -> String {
    format!("{}_{}{}", file.prefix, question.name(), C.suffix(precision))
}

/// The name of the function for columns.
pub(super) fn columns_name(file: &File<'_>, question: Question, precision: Precision) -> String {
    format!("{}_{}_many{}", file.prefix, question.name(), C.suffix(precision))
}
