//! Files of params, as `-P` names them: TOML or JSON, one value for each param.

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
        for (name, value) in table(path)? {
            found.push(one(path, &name, &value)?);
        }
    }
    Ok(found)
}

fn table(path: &Path) -> Result<Map<String, Value>, Failure> {
    let text = input::read(path)?.text;
    let is_json = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let table = if is_json {
        serde_json::from_str(&text).map_err(|error| error.to_string())
    } else {
        toml::from_str(&text).map_err(|error: toml::de::Error| error.message().to_string())
    };
    table.map_err(|error| Failure::usage(format!("cannot read the params of `{}`: {error}", path.shown())))
}

fn one(path: &Path, name: &str, value: &Value) -> Result<Definition, Failure> {
    let text = match value {
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Null | Value::Bool(_) | Value::Array(_) | Value::Object(_) => {
            let message = format!(
                "`{name}` in `{}` is no number: write `{name} = 0.5` or `{name} = \"8 mm\"`",
                path.shown()
            );
            return Err(Failure::usage(message));
        }
    };
    definition(&format!("{name}={text}"))
        .map_err(|error| Failure::usage(format!("`{name}` in `{}`: {error}", path.shown())))
}
