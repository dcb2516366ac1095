//! Files of params, as `-P` names them: TOML or JSON, one value for each param, those of imported files in tables of
//! their own.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::failure::Failure;
use super::input;
use super::output::Shown;
use super::values::{Definition, definition};

/// The params of files. Later files go before earlier ones.
pub(super) fn read(paths: &[PathBuf]) -> Result<Vec<Definition>, Failure> {
    let mut found = Vec::new();
    for path in paths {
        let text = input::read(path)?.text;
        for (name, value) in table(path, &text)? {
            match value {
                // those of an imported file: `[lib]` and `n = 7` set `lib.n`
                Value::Object(members) => {
                    for (member, value) in members {
                        let qualified = format!("{name}.{member}");
                        found.push(one(&place(path, &text, &member), &qualified, &value)?);
                    }
                }
                value => found.push(one(&place(path, &text, &name), &name, &value)?),
            }
        }
    }
    Ok(found)
}

fn table(path: &Path, text: &str) -> Result<Map<String, Value>, Failure> {
    let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let table = if is_json {
        serde_json::from_str(text).map_err(|error| error.to_string())
    } else {
        toml::from_str(text).map_err(|error: toml::de::Error| match error.span() {
            Some(span) => format!("line {}: {}", line(text, span.start), error.message()),
            None => error.message().to_string(),
        })
    };
    table.map_err(|error| Failure::usage(format!("cannot read the params of `{}`: {error}", path.shown())))
}

/// The file and the line in which a name is given its value.
fn place(path: &Path, text: &str, name: &str) -> String {
    // a TOML file may have comments
    let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let code = |line: &'_ str| -> String {
        if is_json { line.to_string() } else { line.split('#').next().unwrap_or_default().to_string() }
    };
    let is_given = |line: &str| {
        let bare = line.trim_start_matches([' ', '\t', '{', ',', '"', '\'']);
        let rest = bare.strip_prefix(name).map(|rest| rest.trim_start_matches([' ', '\t', '"', '\'']));
        rest.is_some_and(|rest| rest.starts_with(['=', ':']))
    };
    // members of an object may share a line, and then that line is the first one
    match text.lines().position(|line| code(line).split(',').any(is_given)) {
        Some(before) => format!("{}:{}", path.shown(), before + 1),
        None => path.shown(),
    }
}

/// The number of the line at a byte.
fn line(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|byte| *byte == b'\n').count()
}

fn one(place: &str, name: &str, value: &Value) -> Result<Definition, Failure> {
    let text = match value {
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Bool(is_so) => {
            let number = u8::from(*is_so);
            return Err(Failure::usage(format!("{place}: `{name}` is no number: write `{name} = {number}`")));
        }
        Value::Object(_) => {
            let message = format!(
                "{place}: `{name}` is a table: tables hold the params of imported files, as in `[lib]`"
            );
            return Err(Failure::usage(message));
        }
        Value::Null | Value::Array(_) => {
            let message =
                format!("{place}: `{name}` is no number: write `{name} = 0.5` or `{name} = \"8 mm\"`");
            return Err(Failure::usage(message));
        }
    };
    let given = definition(&format!("{name}={text}"))
        .map_err(|error| Failure::usage(format!("{place}: `{name}`: {error}")))?;
    Ok(Definition { place: Some(place.to_string()), ..given })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_param_is_found() {
        let path = Path::new("sizes.toml");
        let toml = "# r = 3\nradius = 1\n\"r\" = 2\n  h=\"8 mm\"\n";
        for (name, expected) in [("radius", 2), ("r", 3), ("h", 4)] {
            assert_eq!(place(path, toml, name), format!("sizes.toml:{expected}"), "{name}");
        }
        let json = "{ \"r\": 1, \"h\": 2,\n  \"w\" : 3 }";
        for (name, expected) in [("r", 1), ("h", 1), ("w", 2)] {
            assert_eq!(place(path, json, name), format!("sizes.toml:{expected}"), "{name}");
        }
        assert_eq!(place(path, "[a]\nb = 1", "a"), "sizes.toml");
    }

    #[test]
    fn tables_hold_the_params_of_imported_files() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.toml");
        std::fs::write(&path, "k = 1\n[lib]\nn = 7\nh = \"8 mm\"\n").unwrap();
        let read = |path: &Path| read(&[path.to_path_buf()]);
        let found = read(&path).unwrap();
        let values: Vec<(&str, f64)> = found.iter().map(|one| (one.name.as_str(), one.value)).collect();
        assert_eq!(values.len(), 3);
        for expected in [("k", 1.0), ("lib.n", 7.0), ("lib.h", 0.008)] {
            assert!(values.contains(&expected), "{values:?}");
        }
        std::fs::write(&path, "open = true\n").unwrap();
        assert!(format!("{:?}", read(&path).unwrap_err()).contains("write `open = 1`"));
    }
}
