//! Tables of numbers in files: lists of points, `points("naca2412.csv")`, and ground, `height_map("terrain.csv", …)`.

use std::sync::Arc;

use glam::DVec2;

use super::lowering::Lowering;
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::heights::{self, HeightMap};
use crate::syntax::ast::Argument;
use crate::table::Table;

impl Lowering<'_> {
    /// `points("wing.csv")`: the rows of a file as points of a plane, as vectors or, in a single column, as numbers.
    pub fn points(&mut self, values: &[Value], arguments: &[Argument]) -> Value {
        let span = self.user_span(arguments[0].value.span);
        let Some(path) = self.path(&values[0], "points(\"wing.csv\")", span) else { return Value::Failed };
        let refused = |reason: String| {
            Diagnostic::error(Code::FILE, span, format!("`{path}` cannot be read: {reason}")).help(
                "each line has the same count of numbers, one to three, with commas, semicolons or spaces between them",
            )
        };
        let text = match self.read_file(&path, span) {
            Ok(bytes) => {
                String::from_utf8(bytes.to_vec()).map_err(|_| refused("it is no text in UTF-8".into()))
            }
            Err(diagnostic) => Err(diagnostic),
        };
        match text.and_then(|text| numbers(&text).and_then(points_of).map_err(refused)) {
            Ok(rows) => {
                let mut members = Vec::with_capacity(rows.len());
                for row in rows {
                    let numbers: Vec<_> = row.into_iter().map(|number| self.constant(number)).collect();
                    members.push(match numbers[..] {
                        [a] => Value::Number(a),
                        [a, b, c] => Value::Vector([a, b, c]),
                        // two numbers: a point of the plane is a list
                        _ => Value::List(numbers.into_iter().map(Value::Number).collect()),
                    });
                }
                self.list(members, span)
            }
            Err(diagnostic) => self.fail(diagnostic),
        }
    }

    /// `height_map("terrain.csv", [0, 0], [100, 80])`: the ground below the heights of a map, which lies between two
    /// corners; a fourth argument multiplies the heights, and is the height of white in a picture.
    pub fn height_map(&mut self, values: &[Value], arguments: &[Argument]) -> Value {
        let span = self.user_span(arguments[0].value.span);
        let call = "height_map(\"terrain.csv\", [0, 0], [100, 80])";
        let Some(path) = self.path(&values[0], call, span) else { return Value::Failed };
        let corners = [1, 2].map(|i| self.corner(&values[i], arguments[i].value.span, call));
        let scale = self.factor(values.get(3).zip(arguments.get(3)), "the height of a map");
        let ([Some(low), Some(high)], Some(scale)) = (corners, scale) else { return Value::Failed };
        match self.heights(&path, [low, high], scale, span) {
            Ok(table) => self.table(&table, span),
            Err(diagnostic) => self.fail(diagnostic),
        }
    }

    /// Two constant numbers.
    fn corner(&mut self, value: &Value, span: Span, call: &str) -> Option<DVec2> {
        if let Value::List(pair) = value
            && let [Value::Number(a), Value::Number(b)] = pair[..]
        {
            let [a, b] = [a, b].map(|node| self.as_constant(node, span, "a corner of a map"));
            return Some(DVec2::new(a?, b?));
        }
        let at = self.user_span(span);
        let message = format!("expected a corner `[x, y]`, found {}", value.describe());
        self.report(Diagnostic::error(Code::WRONG_TYPE, at, message).help(format!("write `{call}`")));
        None
    }

    fn heights(
        &self,
        path: &str,
        [low, high]: [DVec2; 2],
        scale: f64,
        span: Span,
    ) -> Result<Arc<dyn Table>, Diagnostic> {
        let refused = |reason: String| {
            Diagnostic::error(Code::FILE, span, format!("`{path}` is no map of heights: {reason}"))
                .help("a map is a grey .png, or a text with the heights of one y on each line, the greatest y first")
        };
        let bytes = self.read_file(path, span)?;
        let bits = [low.x, low.y, high.x, high.y, scale].map(|c| format!("{:x}", c.to_bits())).join(" ");
        self.files.table(format!("heights {bits} {}", self.name_of_file(path)), || {
            let is_picture = path.to_lowercase().ends_with(".png");
            let mut rows = if is_picture {
                heights::rows_of_png(&bytes).map_err(refused)?
            } else {
                let text =
                    std::str::from_utf8(&bytes).map_err(|_| refused("it is no text in UTF-8".into()))?;
                numbers(text).map_err(refused)?
            };
            rows.iter_mut().flatten().for_each(|height| *height *= scale);
            Ok(Arc::new(HeightMap::new(&rows, low, high).map_err(refused)?) as Arc<dyn Table>)
        })
    }
}

/// Rows as points of one kind.
fn points_of(rows: Vec<Vec<f64>>) -> Result<Vec<Vec<f64>>, String> {
    let columns = rows.first().map_or(0, Vec::len);
    if columns > 3 {
        return Err(format!("its first row has {columns} numbers"));
    }
    if let Some(row) = rows.iter().position(|row| row.len() != columns) {
        return Err(format!("row {} has {} numbers and not {columns}", row + 1, rows[row].len()));
    }
    Ok(rows)
}

/// The numbers of each line. Lines in front of the first numbers are titles; empty lines and those that begin
/// with `#` are passed over.
fn numbers(text: &str) -> Result<Vec<Vec<f64>>, String> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim_start_matches('\u{feff}').trim();
        let between = |c: char| matches!(c, ',' | ';') || c.is_whitespace();
        let words: Vec<&str> = line.split(between).filter(|word| !word.is_empty()).collect();
        if words.is_empty() || line.starts_with('#') {
            continue;
        }
        let numbers: Result<Vec<f64>, _> = words.iter().map(|word| word.parse::<f64>()).collect();
        let Ok(numbers) = numbers else {
            if rows.is_empty() {
                continue;
            }
            return Err(format!("line {} has something else than numbers", i + 1));
        };
        if line.split(';').nth(1).is_some() && line.contains(',') {
            let number = i + 1;
            return Err(format!(
                "line {number} has commas between semicolons; numbers have a decimal point, as in 0.5"
            ));
        }
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(format!("line {} has a number that is not finite", i + 1));
        }
        rows.push(numbers);
    }
    if rows.is_empty() { Err("it has no numbers".into()) } else { Ok(rows) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_and_comments_are_no_rows() {
        let rows = |text: &str| numbers(text).and_then(points_of);
        let text = "NACA 0006\nx, y\n# upper\n1.0  0.0\n0.5,0.03\n\n0;0\n0.5 -0.03\n1 0\n";
        let expected =
            [[1.0, 0.0], [0.5, 0.03], [0.0, 0.0], [0.5, -0.03], [1.0, 0.0]].map(|row| row.to_vec());
        assert_eq!(rows(text).unwrap(), expected);
        assert_eq!(rows("3\n4\n").unwrap(), [[3.0], [4.0]]);
    }

    #[test]
    fn rows_that_differ_are_refused() {
        for (text, words) in [
            ("", "no numbers"),
            ("x;y\n0,5;0,25\n", "line 2 has commas between semicolons; numbers have a decimal point"),
            ("title\n", "no numbers"),
            ("1 2\n1 2 3\n", "row 2 has 3 numbers and not 2"),
            ("1 2 3 4\n", "its first row has 4 numbers"),
            ("1 2\nend\n", "line 2 has something else"),
            ("1 inf\n", "not finite"),
        ] {
            assert!(numbers(text).and_then(points_of).unwrap_err().contains(words), "{text}");
        }
    }
}
