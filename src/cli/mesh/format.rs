//! The formats of meshes on the command line: choices, help and messages, all from the table of the library.

use std::path::Path;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::super::failure::Failure;
use crate::cli::output::Shown;
use rfm::mesh::{FORMATS, Format, LengthUnit, WriteMesh};

/// The parser of a format's name, which is the ending of its files.
pub(in crate::cli) fn format_name() -> impl TypedValueParser<Value = Format> {
    let names = FORMATS.iter().map(|format| PossibleValue::new(format.ending).help(format.purpose));
    let unknown = "clap lets only the names of formats through";
    PossibleValuesParser::new(names)
        .try_map(move |name| FORMATS.iter().find(|format| format.ending == name).copied().ok_or(unknown))
}

/// The parser of a unit's name.
pub(in crate::cli) fn unit_name() -> impl TypedValueParser<Value = LengthUnit> {
    let names = LengthUnit::ALL.map(|unit| PossibleValue::new(unit.name).help(unit.plural));
    let unknown = "clap lets only the names of units through";
    PossibleValuesParser::new(names).try_map(move |name| LengthUnit::named(&name).ok_or(unknown))
}

/// The help of `--unit`.
pub(in crate::cli) fn unit_help() -> String {
    let (open, fixed): (Vec<&Format>, Vec<&Format>) = FORMATS.iter().partition(|format| !format.only_metres);
    format!(
        "Unit of the numbers in {} files [default: m]; {} files are in metres. Programs for printers take the numbers of \
         .stl for mm",
        endings(open).join(" "),
        endings(fixed).join(" ")
    )
}

/// Refuses another unit than metres for a format that knows no other.
pub(super) fn unit_fits(format: Format, unit: Option<LengthUnit>) -> Result<LengthUnit, Failure> {
    let unit = unit.unwrap_or(LengthUnit::METRE);
    if format.only_metres && unit != LengthUnit::METRE {
        let open = one_of(FORMATS.iter().filter(|format| !format.only_metres));
        return Err(Failure::usage(format!(
            "--unit {}: .{} files are always in metres; {open} files may be in another unit",
            unit.name, format.ending
        )));
    }
    Ok(unit)
}

/// The format that a path's ending names.
pub(super) fn of_path(path: &Path) -> Result<Format, Failure> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let found = FORMATS.iter().find(|format| format.ending == ending);
    found.copied().ok_or_else(|| {
        Failure::usage(format!(
            "cannot tell the mesh format of `{}`: the ending must be {}, or .html for a page that shows it",
            path.shown(),
            one_of(FORMATS)
        ))
    })
}

/// Whether a path names a page for a browser, which is no format for other programs.
pub(super) fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("html"))
}

/// The writer of a format: that of its text form if `ascii` is set.
pub(super) fn writer(format: Format, ascii: bool) -> Result<WriteMesh, Failure> {
    if ascii { format.write_text.ok_or_else(no_text) } else { Ok(format.write) }
}

/// The failure of `--ascii` without a file whose format has a text form.
pub(super) fn no_text() -> Failure {
    let with_text = one_of(with_text());
    Failure::usage(format!(
        "--ascii is for {with_text} files: the other formats are text or binary by themselves"
    ))
}

/// The failure of a command that has nowhere to put its mesh.
pub(super) fn no_output() -> Failure {
    let (first, others) = (FORMATS[0].ending, endings(&FORMATS[1..]).join(", "));
    Failure::usage(format!("no output: give -o FILE.{first} (or {others}), or --json for the figures alone"))
}

/// The help of `--output`.
pub(in crate::cli) fn output_help() -> String {
    format!(
        "Where the mesh goes; the ending chooses the format: {}, or .html for a page that shows it. With --fluid a folder [default: surface/ in that of \
         the run], or a file for one frame",
        endings(FORMATS).join(" ")
    )
}

/// The help of `--ascii`.
pub(in crate::cli) fn ascii_help() -> String {
    format!("Write {} as text", one_of(with_text()))
}

fn with_text() -> impl Iterator<Item = &'static Format> {
    FORMATS.iter().filter(|format| format.write_text.is_some())
}

/// The endings of formats, each with its dot.
fn endings(formats: impl IntoIterator<Item = &'static Format>) -> Vec<String> {
    formats.into_iter().map(|format| format!(".{}", format.ending)).collect()
}

/// Endings as a choice: `.a, .b or .c`.
fn one_of(formats: impl IntoIterator<Item = &'static Format>) -> String {
    let endings = endings(formats);
    match endings.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => endings.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_and_messages_name_every_format() {
        let message = |failure: Failure| match failure {
            Failure::Usage(message) => message,
            other => panic!("{other:?}"),
        };
        let unknown = message(of_path(Path::new("pawn.3ds")).unwrap_err());
        for text in [output_help(), unknown, message(no_output())] {
            for format in FORMATS {
                assert!(text.contains(&format!(".{}", format.ending)), "{text}");
            }
        }
    }

    #[test]
    fn formats_are_found_by_endings_in_any_case() {
        for format in FORMATS {
            let path = format!("pawn.{}", format.ending.to_uppercase());
            assert_eq!(of_path(Path::new(&path)).unwrap().ending, format.ending);
        }
        assert!(of_path(Path::new("stl")).is_err() && of_path(Path::new("pawn.st")).is_err());
    }

    #[test]
    fn text_is_written_where_a_format_has_it() {
        for format in FORMATS {
            assert!(writer(*format, false).is_ok());
            assert_eq!(writer(*format, true).is_ok(), format.write_text.is_some());
        }
    }
}
