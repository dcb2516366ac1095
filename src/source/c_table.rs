//! The table of steps over blocks of points, and the function that takes them.
//!
//! A step is the number of a function with its columns; steps of one function may differ in numbers, which stand in a
//! table of their own. Those that time and params decide are filled in at each call.

use super::language::C;
use crate::ir::Scalar;
use crate::precision::Precision;

/// Greatest count of bytes that a block keeps at a time, over all its points: most of a first-level cache.
pub(super) const CACHED_BYTES: usize = 24 << 10;

/// A function that steps call.
pub(super) struct Called {
    pub name: String,
    /// Whether it is a piece of arithmetic, which is given the points.
    pub is_piece: bool,
    pub has_numbers: bool,
    /// How many columns it is given.
    pub columns: usize,
}

/// Steps, and the numbers in which they differ.
#[derive(Default)]
pub(super) struct Table {
    pub numbers: Vec<Scalar>,
    /// For each step the number of a function, counted from 1, the place of its numbers if it has any, and its columns.
    pub steps: Vec<i64>,
}

impl Table {
    /// Whether some numbers are known at a call alone.
    fn is_filled(&self) -> bool {
        self.numbers.iter().any(|number| matches!(number, Scalar::Uniform { .. }))
    }

    /// The numbers, the steps, and the function that takes them, with uniforms as an argument where there are any.
    pub fn write(
        &self,
        name: &str,
        called: &[Called],
        (precision, has_uniforms): (Precision, bool),
        lines: &mut Vec<String>,
    ) {
        let number = C.number(precision);
        if !self.numbers.is_empty() {
            let constant = |scalar: &Scalar| match scalar {
                Scalar::Constant(value) => C.constant(*value, precision),
                Scalar::Uniform { .. } => C.constant(0.0, precision),
            };
            let constants: Vec<String> = self.numbers.iter().filter_map(constant).collect();
            lines.push(String::new());
            lines.push(format!("static const {number} {name}_constants[{}] = {{", constants.len()));
            lines.extend(constants.chunks(8).map(|row| format!("    {},", row.join(", "))));
            lines.push("};".into());
        }
        if self.is_filled() {
            self.write_filling(name, number, lines);
        }
        let numbers: Vec<String> = self.steps.iter().chain([&0]).map(ToString::to_string).collect();
        lines.push(String::new());
        lines.push(format!("static const int {name}_steps[{}] = {{", numbers.len()));
        lines.extend(numbers.chunks(20).map(|row| format!("    {},", row.join(", "))));
        lines.push("};".into());
        self.write_run(name, called, (number, has_uniforms), lines);
    }

    /// The function that gives all numbers with the uniforms among them. A negative uniform k is written as −1 − k.
    fn write_filling(&self, name: &str, number: &str, lines: &mut Vec<String>) {
        let places = self.numbers.iter().enumerate().filter_map(|(place, scalar)| match *scalar {
            Scalar::Constant(_) => None,
            Scalar::Uniform { index, negated: false } => Some(format!("{place}, {index}")),
            Scalar::Uniform { index, negated: true } => Some(format!("{place}, {}", -1 - i64::from(index))),
        });
        let places: Vec<String> = places.collect();
        let (numbers, filled) = (self.numbers.len(), 2 * places.len());
        lines.push(String::new());
        lines.push(format!("static const int {name}_filled[{filled}] = {{"));
        lines.extend(places.chunks(10).map(|row| format!("    {},", row.join(", "))));
        lines.extend(["};", ""].map(String::from));
        lines.push(format!("static void {name}_fill(const {number} *u, {number} *c) {{"));
        lines.push(format!("    const int *s = {name}_filled;"));
        lines.push("    int k;".into());
        lines.push(format!("    for (k = 0; k < {numbers}; k++) c[k] = {name}_constants[k];"));
        lines.push(format!(
            "    for (k = 0; k < {filled}; k += 2) c[s[k]] = s[k + 1] < 0 ? -u[-1 - s[k + 1]] : u[s[k + 1]];"
        ));
        lines.push("}".into());
    }

    /// The function that takes the steps for one block of points. Columns of the caller are −1, −2 …
    fn write_run(
        &self,
        name: &str,
        called: &[Called],
        (number, has_uniforms): (&str, bool),
        lines: &mut Vec<String>,
    ) {
        let mut given = String::new();
        given.extend(has_uniforms.then(|| format!(", const {number} *u")));
        given.extend(self.is_filled().then(|| format!(", const {number} *c")));
        let numbers = if self.is_filled() { "c".into() } else { format!("{name}_constants") };
        lines.push(String::new());
        lines.push("/* n points, as many as a column of its own has room for: stride. */".into());
        lines.push(format!(
            "static void {name}(size_t n, const {number} *x, const {number} *y, const {number} *z{given}, \
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
                arguments.extend(has_uniforms.then(|| "u".to_string()));
            }
            arguments.extend(function.has_numbers.then(|| format!("{numbers} + s[0]")));
            let first = usize::from(function.has_numbers);
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

    /// What a caller of the steps does before and after: it needs the numbers. `missing` is what it does without memory.
    pub fn numbers_of_call(&self, name: &str, precision: Precision, missing: &[String]) -> NumbersOfCall {
        if !self.is_filled() {
            return NumbersOfCall::default();
        }
        let (number, count) = (C.number(precision), self.numbers.len());
        let fill = format!("    {name}_fill(u, c);");
        if count * size(precision) <= CACHED_BYTES {
            let declared = vec![format!("    {number} c[{count}];")];
            return NumbersOfCall { declared, before: vec![fill], argument: ", c", after: Vec::new() };
        }
        let declared =
            vec![format!("    {number} *c = ({number} *)malloc((size_t){count} * sizeof({number}));")];
        let mut before = vec!["    if (!c) {".to_string()];
        before.extend(missing.iter().cloned());
        before.extend(["    }".into(), fill]);
        NumbersOfCall { declared, before, argument: ", c", after: vec!["    free(c);".into()] }
    }
}

/// Lines of a function that calls the steps.
#[derive(Default)]
pub(super) struct NumbersOfCall {
    pub declared: Vec<String>,
    pub before: Vec<String>,
    /// How the numbers are given.
    pub argument: &'static str,
    pub after: Vec<String>,
}

/// Bytes of a number.
pub(super) fn size(precision: Precision) -> usize {
    match precision {
        Precision::F64 => 8,
        Precision::F32 => 4,
    }
}
