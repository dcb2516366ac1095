//! The room of one block of points, and what walks through a table of steps over it.

use super::language::C;
use super::program::Question;
use super::statements::Statements;
use crate::precision::Precision;

/// Greatest count of bytes that a block keeps at a time, over all its points: most of a first-level cache.
const CACHED_BYTES: usize = 24 << 10;

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

/// A function that steps call.
pub(super) struct Called {
    pub name: String,
    /// Whether it is a piece of arithmetic, which is given the points.
    pub is_piece: bool,
    pub has_constants: bool,
    /// How many columns it is given.
    pub columns: usize,
}

/// A long formula as functions and tables.
pub(super) struct Long {
    pub made: Statements,
    /// Lines of its functions, which take a compiler far longer than those of tables.
    pub length: usize,
}

impl Room {
    pub fn new(precision: Precision, columns: usize, has_uniforms: bool) -> Self {
        let fitting = CACHED_BYTES / (size(precision) * columns.max(1));
        let points = (fitting / SHORTEST * SHORTEST).clamp(SHORTEST, LONGEST);
        Self { precision, columns, points, has_uniforms }
    }

    /// A function that computes statements for the points of a block, and those of `mend` where the first result is NaN.
    pub fn loop_of(
        &self,
        name: &str,
        [reads, writes]: [usize; 2],
        has_constants: bool,
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
        if has_constants {
            arguments.push(format!("const {number} *RFM_RESTRICT c"));
        }
        arguments.extend((0..reads).map(|i| format!("const {number} *RFM_RESTRICT r{i}")));
        arguments.extend((0..writes).map(|i| format!("{number} *RFM_RESTRICT w{i}")));
        let lines = &mut made.lines;
        lines.push(String::new());
        lines.push(format!("RFM_NOINLINE void {name}({}) {{", arguments.join(", ")));
        lines.push("    size_t i;".into());
        lines.extend(mend.map(|_| "    int any = 0;".to_string()));
        let unused = [("u", self.has_uniforms), ("c", has_constants)];
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

    /// The constants, the table of steps, and the function that takes them: the number of a function, counted from 1, its
    /// constants and its columns.
    pub fn tables(
        &self,
        name: &str,
        called: &[Called],
        (constants, table): (&[f64], &[i64]),
        lines: &mut Vec<String>,
    ) {
        let number = C.number(self.precision);
        if !constants.is_empty() {
            let constants: Vec<String> =
                constants.iter().filter_map(|&value| C.constant(value, self.precision)).collect();
            lines.push(String::new());
            lines.push(format!("static const {number} {name}_constants[{}] = {{", constants.len()));
            lines.extend(constants.chunks(8).map(|row| format!("    {},", row.join(", "))));
            lines.push("};".into());
        }
        let numbers: Vec<String> = table.iter().chain([&0]).map(ToString::to_string).collect();
        lines.push(String::new());
        lines.push(format!("static const int {name}_steps[{}] = {{", numbers.len()));
        lines.extend(numbers.chunks(20).map(|row| format!("    {},", row.join(", "))));
        lines.push("};".into());
        self.run(name, called, lines);
    }

    /// The function that takes the steps for one block of points. Columns of the caller are −1, −2 …
    fn run(&self, name: &str, called: &[Called], lines: &mut Vec<String>) {
        let number = C.number(self.precision);
        let u = if self.has_uniforms { format!(", const {number} *u") } else { String::new() };
        lines.push(String::new());
        lines.push("/* n points, as many as a column of its own has room for: stride. */".into());
        lines.push(format!(
            "static void {name}(size_t n, const {number} *x, const {number} *y, const {number} *z{u}, \
             {number} *columns, size_t stride, {number} *const *out) {{"
        ));
        lines.push(format!("    const int *s = {name}_steps;"));
        lines.push(
            "#define RFM_COLUMN(k) (s[k] < 0 ? out[-1 - s[k]] : columns + (size_t)s[k] * stride)".into(),
        );
        lines.push("    while (*s) {".into());
        lines.push("        switch (*s++) {".into());
        for (i, function) in called.iter().enumerate() {
            let mut arguments = vec!["n".to_string()];
            if function.is_piece {
                arguments.extend(["x", "y", "z"].map(String::from));
                arguments.extend(self.has_uniforms.then(|| "u".to_string()));
            }
            arguments.extend(function.has_constants.then(|| format!("{name}_constants + s[0]")));
            let first = usize::from(function.has_constants);
            let last = first + function.columns;
            arguments.extend((first..last).map(|k| format!("RFM_COLUMN({k})")));
            lines.push(format!("        case {}:", i + 1));
            lines.push(format!("            {}({});", function.name, arguments.join(", ")));
            lines.push(format!("            s += {last};"));
            lines.push("            break;".into());
        }
        lines.extend(["        default:", "            return;", "        }", "    }"].map(String::from));
        lines.push("#undef RFM_COLUMN".into());
        lines.push("}".into());
    }

    /// The body of the function for one point.
    pub fn point(&self, name: &str, number: &str, question: Question) -> Vec<String> {
        let results = question.results();
        let u = self.uniforms_argument();
        let mut lines = vec![format!("    {number} columns[{}];", self.columns.max(1))];
        lines.push(format!("    {number} all[{}];", results.len()));
        let places: Vec<String> = (0..results.len()).map(|i| format!("all + {i}")).collect();
        lines.push(format!("    {number} *out[{}];", results.len()));
        lines.extend(places.iter().enumerate().map(|(i, place)| format!("    out[{i}] = {place};")));
        lines.push(format!("    {name}(1, &x, &y, &z{u}, columns, 1, out);"));
        if question == Question::Gradient {
            lines.extend((0..3).map(|i| format!("    gradient[{i}] = all[{}];", i + 1)));
        }
        lines.push("    return all[0];".into());
        lines
    }

    /// The body of the function for columns.
    pub fn columns(&self, name: &str, number: &str, question: Question) -> Vec<String> {
        let results = question.results();
        let u = self.uniforms_argument();
        let (points, columns) = (self.points, self.columns.max(1));
        let mut lines = vec!["    size_t at;".to_string()];
        let on_stack = columns * points * size(self.precision) <= CACHED_BYTES;
        if on_stack {
            lines.push(format!("    {number} columns[{columns} * {points}];"));
        } else {
            lines.push(format!(
                "    {number} *columns = ({number} *)malloc((size_t){columns} * {points} * sizeof({number}));"
            ));
            lines.extend(["    if (!columns) {", "        for (at = 0; at < n; at++) {"].map(String::from));
            lines.extend(results.iter().map(|result| format!("            {result}[at] = NAN;")));
            lines.extend(["        }", "        return;", "    }"].map(String::from));
        }
        lines.push(format!("    for (at = 0; at < n; at += {points}) {{"));
        lines.push(format!("        const size_t m = n - at < {points} ? n - at : {points};"));
        lines.push(format!("        {number} *out[{}];", results.len()));
        lines.extend(
            results.iter().enumerate().map(|(i, result)| format!("        out[{i}] = {result} + at;")),
        );
        lines.push(format!("        {name}(m, x + at, y + at, z + at{u}, columns, {points}, out);"));
        lines.push("    }".into());
        lines.extend((!on_stack).then(|| "    free(columns);".to_string()));
        lines
    }

    fn uniforms_argument(&self) -> &'static str {
        if self.has_uniforms { ", u" } else { "" }
    }
}

/// Bytes of a number.
fn size(precision: Precision) -> usize {
    match precision {
        Precision::F64 => 8,
        Precision::F32 => 4,
    }
}
