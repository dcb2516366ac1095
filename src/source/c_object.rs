//! The header of an object file: its machine code as the functions that a C file would have.

use super::File;
use super::c::{CFile, Flavour};
use super::language::C;
use super::program::Program;
use crate::precision::Precision;

/// The name of the machine code of a program in an object file: for one point, or for blocks of points.
pub(super) fn raw_name(file: &File<'_>, program: &Program, precision: Precision, blocks: bool) -> String {
    let blocks = if blocks { "_blocks" } else { "" };
    format!("{}_raw_{}{blocks}{}", file.prefix, program.question.name(), C.suffix(precision))
}

/// The name of the machine code that finds what depends on time and params alone.
pub(super) fn raw_uniforms(file: &File<'_>, program: &Program) -> String {
    format!("{}_raw_uniforms_{}", file.prefix, program.question.name())
}

/// The header of an object file: its machine code as the functions that a C file would have.
pub(super) fn object_header(file: &File<'_>) -> String {
    let writer = CFile { file, flavour: Flavour::Header };
    let mut lines = vec!["/*".to_string()];
    lines.extend(file.title().iter().map(|line| format!(" * {line}")));
    lines.push(" * Functions of the object file beside it. Columns must not overlap.".into());
    lines.extend(writer.bits().iter().map(|line| format!(" * {line}")));
    lines.push(" */".into());
    lines.extend(writer.macros());
    lines.extend(writer.params());
    lines.extend(["", "#ifdef __cplusplus", "extern \"C\" {", "#endif"].map(String::from));
    for program in file.programs {
        lines.extend(writer.raw_declarations(program));
    }
    lines.extend(["#ifdef __cplusplus", "}", "#endif"].map(String::from));
    for program in file.programs {
        lines.extend(writer.raw_uniforms_call(program));
        for &precision in file.precisions {
            lines.extend(writer.raw_at(program, precision));
            lines.extend(writer.point(program, precision, None));
            lines.extend(writer.raw_columns(program, precision));
        }
    }
    lines.extend(["", "#endif"].map(String::from));
    lines.join("\n") + "\n"
}

impl CFile<'_> {
    fn raw_declarations(&self, program: &Program) -> Vec<String> {
        let mut lines = Vec::new();
        if program.uniforms.is_some() {
            let params = if self.file.params.is_empty() { "" } else { ", const double *params" };
            let name = raw_uniforms(self.file, program);
            lines.push(format!("void {name}(double t, double none, double nothing, double *u{params});"));
        }
        for &precision in self.file.precisions {
            let number = C.number(precision);
            let u = if program.uniforms.is_some() { format!(", const {number} *u") } else { String::new() };
            let [point, blocks] = [false, true].map(|blocks| raw_name(self.file, program, precision, blocks));
            lines.push(format!("void {point}({number} x, {number} y, {number} z, {number} *out{u});"));
            lines.push(format!("void {blocks}({number} *const *columns, size_t blocks{u});"));
        }
        lines
    }

    fn raw_uniforms_call(&self, program: &Program) -> Vec<String> {
        if program.uniforms.is_none() {
            return Vec::new();
        }
        let arguments = self.extra_arguments();
        let time = if self.file.moves { "t" } else { "0.0" };
        let params = if self.file.params.is_empty() { "" } else { ", (const double *)p" };
        vec![
            String::new(),
            format!(
                "RFM_INLINE void {}({}, double *u) {{",
                self.uniforms_name(program),
                arguments.trim_start_matches(", ")
            ),
            format!("    {}({time}, 0.0, 0.0, u{params});", raw_uniforms(self.file, program)),
            "}".into(),
        ]
    }

    /// The function for one point that the others call, over the machine code.
    fn raw_at(&self, program: &Program, precision: Precision) -> Vec<String> {
        let (number, question) = (C.number(precision), program.question);
        let results = question.results();
        let many = results.len() > 1;
        let mut lines = vec![String::new()];
        if many {
            lines.extend((C.structure)(&self.answer(precision), number, results));
        }
        let (arguments, u) = match program.uniforms {
            Some(_) => (format!(", const {number} *u"), ", u"),
            None => (String::new(), ""),
        };
        let result = if many { self.answer(precision) } else { number.into() };
        let name = self.at_name(program, precision);
        lines.push(format!("RFM_INLINE {result} {name}({number} x, {number} y, {number} z{arguments}) {{"));
        lines.push(format!("    {number} out[{}];", results.len()));
        if many {
            lines.push(format!("    {result} all;"));
        }
        lines.push(format!("    {}(x, y, z, out{u});", raw_name(self.file, program, precision, false)));
        if many {
            let fields = results.iter().enumerate();
            lines.extend(fields.map(|(i, field)| format!("    all.{field} = out[{i}];")));
            lines.push("    return all;".into());
        } else {
            lines.push("    return out[0];".into());
        }
        lines.push("}".into());
        lines
    }

    /// The function for columns over the machine code, which takes whole blocks; the last points come one by one.
    fn raw_columns(&self, program: &Program, precision: Precision) -> Vec<String> {
        let (number, question) = (C.number(precision), program.question);
        let results = question.results();
        let signature = self.columns_signature(question, precision);
        let mut lines = vec![String::new(), format!("{}{signature} {{", self.flavour.linkage())];
        lines.extend(self.fill_uniforms(program, precision));
        let u = if program.uniforms.is_some() { ", u" } else { "" };
        let lanes = precision.lanes();
        lines.push(format!("    {number} *columns[{}];", 3 + results.len()));
        lines.push("    size_t i;".into());
        for (i, axis) in ["x", "y", "z"].iter().enumerate() {
            lines.push(format!("    columns[{i}] = ({number} *){axis};"));
        }
        lines.extend(results.iter().enumerate().map(|(i, r)| format!("    columns[{}] = {r};", 3 + i)));
        lines
            .push(format!("    {}(columns, n / {lanes}{u});", raw_name(self.file, program, precision, true)));
        lines.push(format!("    for (i = n / {lanes} * {lanes}; i < n; i++) {{"));
        let call = format!("{}(x[i], y[i], z[i]{u})", self.at_name(program, precision));
        if let [result] = results {
            lines.push(format!("        {result}[i] = {call};"));
        } else {
            lines.push(format!("        const {} all = {call};", self.answer(precision)));
            lines.extend(results.iter().map(|r| format!("        {r}[i] = all.{r};")));
        }
        lines.extend(["    }".into(), "}".to_string()]);
        lines
    }
}
