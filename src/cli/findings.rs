//! Messages of `rfm check` in the forms that people and other programs read, and the fixes that it applies.

use std::io::{self, Write};
use std::path::Path;

use serde_json::json;

use super::args::MessageFormat;
use super::failure::{Failure, note};
use super::message::Message;
use super::shared::Shared;
use super::values::Deny;
use super::{input, output};
use crate::cli::output::Shown;
use rfm::diagnostic::{Diagnostic, Severity, Source, explain, printable_line};

/// Prints messages in a form with one line for each. Other forms are printed as a whole, at the end.
pub(super) fn write(messages: &[Message], format: MessageFormat) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match format {
        MessageFormat::Human => {}
        MessageFormat::Short => {
            for m in messages {
                let place = format!("{}:{}:{}", m.file, m.line, m.column);
                let line = format!("{place}: {}[{}]: {}", m.severity, m.code, m.message);
                writeln!(out, "{}", printable_line(&line))?;
            }
        }
        MessageFormat::Json => {
            for m in messages {
                writeln!(out, "{}", output::json_line(m)?)?;
            }
        }
        MessageFormat::Sarif => writeln!(out, "{}", output::json_line(&sarif(messages))?)?,
        MessageFormat::Github => {
            for m in messages {
                writeln!(out, "{}", printable_line(&github(m)))?;
            }
        }
    }
    Ok(())
}

/// A command of GitHub Actions, in which `%`, line ends and separators are escaped.
fn github(m: &Message) -> String {
    let data = |text: &str| text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    let property = |text: &str| data(text).replace(':', "%3A").replace(',', "%2C");
    let help = m.help.as_ref().map_or_else(String::new, |help| format!("\n{help}"));
    format!(
        "::{} file={},line={},endLine={},col={},endColumn={},title={}::{}",
        m.severity,
        property(&m.file),
        m.line,
        m.end_line,
        m.column,
        m.end_column,
        property(m.code),
        data(&format!("{}{help}", m.message))
    )
}

/// All messages as one document of the Static Analysis Results Interchange Format, version 2.1.0.
fn sarif(messages: &[Message]) -> serde_json::Value {
    let mut codes: Vec<&str> = messages.iter().map(|m| m.code).collect();
    codes.sort_unstable();
    codes.dedup();
    let rule =
        |code: &&str| json!({ "id": code, "fullDescription": { "text": explain(code).unwrap_or("") } });
    let rules: Vec<_> = codes.iter().map(rule).collect();
    let region = |line: usize, column: usize, end_line: usize, end_column: usize| json!({ "startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column });
    let result = |m: &Message| {
        let file = json!({ "uri": m.file.replace('\\', "/") });
        let place = json!({
            "artifactLocation": file,
            "region": region(m.line, m.column, m.end_line, m.end_column),
        });
        let help = m.help.as_ref().map_or_else(String::new, |help| format!("\n{help}"));
        let mut result = json!({
            "ruleId": m.code,
            "level": m.severity,
            "message": { "text": format!("{}{help}", m.message) },
            "locations": [{ "physicalLocation": place }],
        });
        if let Some(fix) = &m.fix {
            let replacement = json!({
                "deletedRegion": region(fix.line, fix.column, fix.end_line, fix.end_column),
                "insertedContent": { "text": fix.replacement },
            });
            let change = json!({ "artifactLocation": file, "replacements": [replacement] });
            result["fixes"] = json!([{ "artifactChanges": [change] }]);
        }
        result
    };
    let driver = json!({ "name": "rfm", "version": env!("CARGO_PKG_VERSION"), "rules": rules });
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": driver },
            "columnKind": "unicodeCodePoints",
            "results": messages.iter().map(result).collect::<Vec<_>>(),
        }],
    })
}

/// Applies the safe fixes of a file until there are none, and writes it if there were any.
pub(super) fn fix(shared: &Shared, path: &Path) -> Result<(), Failure> {
    /// A fix may show the next one; none is known that does.
    const ROUNDS: usize = 10;
    if path == Path::new("-") {
        return Err(Failure::usage("standard input cannot be fixed: name a file"));
    }
    let mut source = input::read(path)?;
    let mut count = 0;
    for _ in 0..ROUNDS {
        let messages = match input::check(shared, source.clone(), input::files(shared, &source)) {
            Ok(program) => program.warnings(),
            Err(messages) => messages,
        };
        let mut edits: Vec<_> =
            messages.list.iter().filter_map(|m| m.edit_of(&source)).filter(|edit| edit.is_safe).collect();
        edits.sort_by_key(|edit| edit.span.start);
        edits.dedup_by(|b, a| b.span.start < a.span.end || a == b);
        if edits.is_empty() {
            break;
        }
        count += edits.len();
        let mut text = source.text.to_string();
        for edit in edits.iter().rev() {
            text.replace_range(edit.span.range(), &edit.replacement);
        }
        source = Source::file(source.name.clone(), text);
    }
    if count > 0 {
        output::replace(path, &source.text)?;
        note(format!("{}: {count} fix{} applied", path.shown(), if count == 1 { "" } else { "es" }));
    }
    Ok(())
}

/// Whether any of the messages is an error, or a warning that counts as one.
pub(super) fn fail(messages: &[Diagnostic], denied: &[Deny]) -> bool {
    messages.iter().any(|m| m.severity == Severity::Error || denied.iter().any(|deny| deny.covers(m)))
}
