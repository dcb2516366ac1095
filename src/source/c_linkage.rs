//! What the functions of a C file are called, and how others find them.

use super::File;
use super::language::C;
use super::program::Question;
use crate::precision::Precision;

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
