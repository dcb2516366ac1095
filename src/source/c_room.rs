//! The room of one block of points, and the functions that walk through columns in blocks.

use super::c_table::{CACHED_BYTES, NumbersOfCall, Table, size};
use super::language::C;
use super::program::Question;
use super::statements::Statements;
use crate::precision::Precision;

/// Least and greatest number of points of a block.
const SHORTEST: usize = 32;
const LONGEST: usize = 256;

/// How the functions of a block write the coordinates of a point.
pub(super) const IN_COLUMNS: [&str; 4] = ["x[i]", "y[i]", "z[i]", "t"];

/// The columns of a block.
pub(super) struct Room {
    pub precision: Precision,
    pub columns: usize,
    /// Points of a block.
    points: usize,
    /// Whether the functions take what depends on time and params alone.
    has_uniforms: bool,
}

/// A long formula as functions and tables.
pub(super) struct Long {
    pub made: Statements,
    /// Lines of its functions, which take a compiler far longer than those of tables.
    pub length: usize,
    pub room: Room,
    pub table: Table,
}

impl Room {
    pub fn new(precision: Precision, columns: usize, has_uniforms: bool) -> Self {
        let fitting = CACHED_BYTES / (size(precision) * columns.max(1));
        let points = (fitting / SHORTEST * SHORTEST).clamp(SHORTEST, LONGEST);
        Self { precision, columns, points, has_uniforms }
    }

    /// The precision, and whether there are uniforms.
    pub fn kind(&self) -> (Precision, bool) {
        (self.precision, self.has_uniforms)
    }

    /// A function that computes statements for the points of a block, and those of `mend` where the first result is NaN.
    pub fn loop_of(
        &self,
        name: &str,
        [reads, writes]: [usize; 2],
        has_numbers: bool,
        (body, mend): (&Statements, Option<&Statements>),
        made: &mut Statements,
    ) {
        for statements in [Some(body), mend].into_iter().flatten() {
            made.operations.extend(&statements.operations);
            made.functions.extend(&statements.functions);
        }
        let number = C.number(self.precision);
        let mut arguments = vec!["size_t n".to_string()];
        arguments.extend(["x", "y", "z"].map(|axis| format!("const {number} *RFM_RESTRICT {axis}")));
        if self.has_uniforms {
            arguments.push(format!("const {number} *RFM_RESTRICT u"));
        }
        if has_numbers {
            arguments.push(format!("const {number} *RFM_RESTRICT c"));
        }
        arguments.extend((0..reads).map(|i| format!("const {number} *RFM_RESTRICT r{i}")));
        arguments.extend((0..writes).map(|i| format!("{number} *RFM_RESTRICT w{i}")));
        let lines = &mut made.lines;
        lines.push(String::new());
        lines.push(format!("RFM_NOINLINE void {name}({}) {{", arguments.join(", ")));
        lines.push("    size_t i;".into());
        lines.extend(mend.map(|_| "    int any = 0;".to_string()));
        let unused = [("u", self.has_uniforms), ("c", has_numbers)];
        let unused = unused.iter().filter(|(_, is)| *is).map(|(name, _)| format!(" (void){name};"));
        lines.push(format!("    (void)x; (void)y; (void)z;{}", unused.collect::<String>()));
        let inner = |body: &Statements| {
            let results = body.outputs.iter().enumerate().map(|(i, text)| format!("w{i}[i] = {text};"));
            let inner: Vec<String> = body.lines.iter().cloned().chain(results).collect();
            inner.into_iter().map(|line| format!("        {line}"))
        };
        lines.push("    for (i = 0; i < n; i++) {".into());
        lines.extend(inner(body));
        lines.push("    }".into());
        if let Some(mend) = mend {
            lines.push("    for (i = 0; i < n; i++) any |= w0[i] != w0[i];".into());
            lines.push("    for (i = 0; any && i < n; i++) {".into());
            lines.push("        if (w0[i] == w0[i]) continue;".into());
            lines.extend(inner(mend));
            lines.push("    }".into());
        }
        lines.push("}".into());
    }

    /// The body of the function for one point.
    pub fn point(&self, name: &str, question: Question, table: &Table) -> Vec<String> {
        let number = C.number(self.precision);
        let results = question.results();
        let missing = match question {
            Question::Gradient => "        gradient[0] = gradient[1] = gradient[2] = NAN;",
            Question::Omega | Question::Sign | Question::Distance => "",
        };
        let missing: Vec<String> = [missing, "        return NAN;"].map(String::from).into();
        let NumbersOfCall { declared, before, argument, after } =
            table.numbers_of_call(name, self.precision, &missing);
        let u = self.uniforms_argument();
        let mut lines = vec![format!("    {number} columns[{}];", self.columns.max(1))];
        lines.push(format!("    {number} all[{}];", results.len()));
        lines.push(format!("    {number} *out[{}];", results.len()));
        lines.extend(declared);
        lines.extend((0..results.len()).map(|i| format!("    out[{i}] = all + {i};")));
        lines.extend(before);
        lines.push(format!("    {name}(1, &x, &y, &z{u}{argument}, columns, 1, out);"));
        if question == Question::Gradient {
            lines.extend((0..3).map(|i| format!("    gradient[{i}] = all[{}];", i + 1)));
        }
        lines.extend(after);
        lines.push("    return all[0];".into());
        lines
    }

    /// The body of the function for columns.
    pub fn columns(&self, name: &str, question: Question, table: &Table) -> Vec<String> {
        let number = C.number(self.precision);
        let results = question.results();
        let (points, columns) = (self.points, self.columns.max(1));
        let on_stack = columns * points * size(self.precision) <= CACHED_BYTES;
        let nothing = |also: Option<&str>| {
            let mut lines = vec!["        for (at = 0; at < n; at++) {".to_string()];
            lines.extend(results.iter().map(|result| format!("            {result}[at] = NAN;")));
            lines.push("        }".into());
            lines.extend(also.map(String::from));
            lines.push("        return;".into());
            lines
        };
        let free = (!on_stack).then_some("        free(columns);");
        let NumbersOfCall { declared, before, argument, after } =
            table.numbers_of_call(name, self.precision, &nothing(free));
        let mut lines = vec!["    size_t at;".to_string()];
        lines.push(match on_stack {
            true => format!("    {number} columns[{columns} * {points}];"),
            false => format!(
                "    {number} *columns = ({number} *)malloc((size_t){columns} * {points} * sizeof({number}));"
            ),
        });
        lines.extend(declared);
        if !on_stack {
            let free = (!after.is_empty()).then_some("        free(c);");
            lines.push("    if (!columns) {".into());
            lines.extend(nothing(free));
            lines.push("    }".into());
        }
        lines.extend(before);
        let u = self.uniforms_argument();
        lines.push(format!("    for (at = 0; at < n; at += {points}) {{"));
        lines.push(format!("        const size_t m = n - at < {points} ? n - at : {points};"));
        lines.push(format!("        {number} *out[{}];", results.len()));
        lines.extend(
            results.iter().enumerate().map(|(i, result)| format!("        out[{i}] = {result} + at;")),
        );
        lines
            .push(format!("        {name}(m, x + at, y + at, z + at{u}{argument}, columns, {points}, out);"));
        lines.push("    }".into());
        lines.extend(after);
        lines.extend((!on_stack).then(|| "    free(columns);".to_string()));
        lines
    }

    fn uniforms_argument(&self) -> &'static str {
        if self.has_uniforms { ", u" } else { "" }
    }
}
