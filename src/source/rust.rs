//! Files in Rust: modules that need nothing but the standard library.

use std::collections::BTreeSet;

use super::language::RUST;
use super::operations::{Names, Operation, WEIGHTED_FIELDS};
use super::program::{Program, Question};
use super::statements::{Own, Part, Statements, Writer};
use super::{File, Math, OpenParam, PARAMS, SourceError};
use crate::ir::Forms;
use crate::precision::Precision;

/// A module with everything in it.
pub(super) fn source(file: &File<'_>) -> Result<String, SourceError> {
    let writer = RustFile { file };
    let mut lines = writer.head();
    lines.extend(writer.params());
    let mut operations: BTreeSet<(Operation, bool)> = BTreeSet::new();
    let mut functions = Vec::new();
    for program in file.programs {
        functions.extend(writer.uniforms(program)?);
        for &precision in file.precisions {
            functions.extend(writer.body(program, precision, &mut operations)?);
            functions.extend(writer.point(program, precision));
            functions.extend(writer.columns(program, precision));
        }
    }
    lines.extend(writer.operations(&operations));
    lines.extend(functions);
    Ok(lines.join("\n") + "\n")
}

struct RustFile<'a> {
    file: &'a File<'a>,
}

impl RustFile<'_> {
    fn names(&self) -> Names<'_> {
        Names { prefix: self.file.prefix }
    }

    fn head(&self) -> Vec<String> {
        let mut lines: Vec<String> = self.file.title().iter().map(|line| format!("// {line}")).collect();
        lines.push("//".into());
        lines.push(
            "// Put it beside your own modules and write `mod`, or compile it with rustc alone.".into(),
        );
        lines.extend(
            match self.file.options.math {
                Math::System => [
                    "// The values have the bits of rfm, except where sin, exp and the like of the standard library are",
                    "// called: their last bits differ between systems.",
                ],
                Math::Rfm => [
                    "// The values have the bits of rfm. Functions such as sin and exp come from the crate libm 0.2.",
                    "//",
                ],
            }
            .map(String::from),
        );
        lines.push("// A point whose coordinates are not finite has the value NaN.".into());
        lines
    }

    fn params(&self) -> Vec<String> {
        let File { prefix, params, .. } = self.file;
        if params.is_empty() {
            return Vec::new();
        }
        let mut lines = vec![String::new(), format!("/// {PARAMS}")];
        lines.push("#[allow(non_camel_case_types)]".into());
        lines.push("#[derive(Debug, Clone, Copy, PartialEq)]".into());
        lines.push(format!("pub struct {prefix}_params {{"));
        for OpenParam { param, field, .. } in params {
            let doc = param.doc.as_ref().map_or(String::new(), |doc| format!(": {doc}"));
            lines.push(format!("    /// `{}`, in the file {:?}{doc}", param.name, param.value));
            lines.push(format!("    pub {field}: f64,"));
        }
        lines.push("}".into());
        lines.push(String::new());
        lines.push("/// The values that the file gives them.".into());
        lines.push("#[allow(dead_code, non_upper_case_globals)]".into());
        lines.push(format!("pub const {prefix}_defaults: {prefix}_params = {prefix}_params {{"));
        for OpenParam { param, field, .. } in params {
            lines.push(format!(
                "    {field}: {},",
                RUST.constant(param.value, Precision::F64).unwrap_or_default()
            ));
        }
        lines.push("};".into());
        lines
    }

    fn extra_arguments(&self) -> String {
        let time = if self.file.moves { ", t: f64" } else { "" };
        let params = if self.file.params.is_empty() {
            String::new()
        } else {
            format!(", p: &{}_params", self.file.prefix)
        };
        format!("{time}{params}")
    }

    fn operations(&self, operations: &BTreeSet<(Operation, bool)>) -> Vec<String> {
        let names = self.names();
        let mut lines = Vec::new();
        for precision in self.file.precisions {
            let (number, single) = (RUST.number(*precision), *precision == Precision::F32);
            lines.push(String::new());
            lines.push("#[allow(dead_code)]".into());
            lines.extend((RUST.pick)(number, &names.pick(&RUST, *precision)).lines().map(String::from));
            let needed = || operations.iter().filter(|(_, is_single)| *is_single == single);
            if needed().any(|(operation, _)| matches!(operation, Operation::Weighted(..))) {
                lines.push(String::new());
                lines.extend((RUST.structure)(&names.joint(&RUST, *precision), number, &WEIGHTED_FIELDS));
            }
            for (operation, _) in needed() {
                lines.push(String::new());
                lines.extend(operation.definition(&RUST, *precision, &names));
            }
        }
        lines
    }

    fn writer<'w>(
        &'w self,
        names: &'w Names<'w>,
        precision: Precision,
        parameter: &'w dyn Fn(u32) -> String,
    ) -> Writer<'w> {
        Writer {
            language: &RUST,
            precision,
            names,
            math: self.file.options.math,
            axes: ["x", "y", "z", "t"],
            parameter,
            uniform: &|i| format!("u[{i}]"),
            gathered: None,
            values: "v",
            own: Own::Nothing,
        }
    }

    fn uniforms_name(&self, program: &Program) -> String {
        format!("{}_uniforms_{}", self.file.prefix, program.question.name())
    }

    fn uniforms(&self, program: &Program) -> Result<Vec<String>, SourceError> {
        let Some((graph, roots)) = &program.uniforms else { return Ok(Vec::new()) };
        let names = self.names();
        let parameter = |i: u32| format!("p.{}", self.file.field(i));
        let writer = self.writer(&names, Precision::F64, &parameter);
        let forms = Forms::default();
        let made = writer.statements(&Part { graph, inputs: &[], outputs: roots, forms: &forms })?;
        let arguments = self.extra_arguments();
        let mut lines = vec![String::new(), "#[allow(unused_variables, unused_parens, clippy::all)]".into()];
        lines.push(format!(
            "fn {}({}) -> [f64; {}] {{",
            self.uniforms_name(program),
            arguments.trim_start_matches(", "),
            roots.len()
        ));
        lines.extend(made.lines.iter().map(|line| format!("    {line}")));
        lines.push(format!("    [{}]", made.outputs.join(", ")));
        lines.push("}".into());
        Ok(lines)
    }

    fn at_name(&self, program: &Program, precision: Precision) -> String {
        format!("{}_at_{}{}", self.file.prefix, program.question.name(), RUST.suffix(precision))
    }

    fn body(
        &self,
        program: &Program,
        precision: Precision,
        operations: &mut BTreeSet<(Operation, bool)>,
    ) -> Result<Vec<String>, SourceError> {
        let names = self.names();
        let parameter = |_: u32| String::new();
        let writer = self.writer(&names, precision, &parameter);
        let Program { graph, outputs, question, .. } = program;
        let part = Part { graph, inputs: &[], outputs, forms: program.forms(precision) };
        let Statements { lines: statements, outputs, operations: called, .. } = writer.statements(&part)?;
        operations.extend(called.into_iter().map(|operation| (operation, precision == Precision::F32)));
        let number = RUST.number(precision);
        let u = match program.uniforms {
            Some(_) => format!(", u: &[{number}; {}]", program.uniform_count()),
            None => String::new(),
        };
        let mut lines = vec![String::new(), "#[inline(always)]".into()];
        lines.push("#[allow(unused_variables, unused_parens, clippy::all)]".into());
        lines.push(format!(
            "fn {}(x: {number}, y: {number}, z: {number}{u}) -> [{number}; {}] {{",
            self.at_name(program, precision),
            question.results().len()
        ));
        lines.extend(statements.iter().map(|line| format!("    {line}")));
        lines.push(format!("    [{}]", outputs.join(", ")));
        lines.push("}".into());
        Ok(lines)
    }

    /// The line that finds `u`, if the program has uniforms; and how it is handed on.
    fn fill_uniforms(&self, program: &Program, precision: Precision) -> (Option<String>, &'static str) {
        if program.uniforms.is_none() {
            return (None, "");
        }
        let values = match (self.file.moves, self.file.params.is_empty()) {
            (true, true) => "t",
            (true, false) => "t, p",
            (false, _) => "p",
        };
        let single = if precision == Precision::F32 { ".map(|value| value as f32)" } else { "" };
        (Some(format!("    let u = {}({values}){single};", self.uniforms_name(program))), ", &u")
    }

    fn point(&self, program: &Program, precision: Precision) -> Vec<String> {
        let (number, question) = (RUST.number(precision), program.question);
        let name = format!("{}_{}{}", self.file.prefix, question.name(), RUST.suffix(precision));
        let (fill, u) = self.fill_uniforms(program, precision);
        let extra = self.extra_arguments();
        let result = match question {
            Question::Gradient => format!("({number}, [{number}; 3])"),
            Question::Omega | Question::Sign | Question::Distance => number.into(),
        };
        let mut lines = vec![String::new(), format!("/// {}.", question.meaning())];
        lines.push("#[allow(dead_code, unused_variables)]".into());
        lines.push(format!("pub fn {name}(x: {number}, y: {number}, z: {number}{extra}) -> {result} {{"));
        lines.extend(fill);
        let call = format!("{}(x, y, z{u})", self.at_name(program, precision));
        lines.extend(match question {
            Question::Gradient => {
                vec![format!("    let [omega, gx, gy, gz] = {call};"), "    (omega, [gx, gy, gz])".into()]
            }
            Question::Omega | Question::Sign | Question::Distance => vec![format!("    {call}[0]")],
        });
        lines.push("}".into());
        lines
    }

    fn columns(&self, program: &Program, precision: Precision) -> Vec<String> {
        let (number, question) = (RUST.number(precision), program.question);
        let name = format!("{}_{}_many{}", self.file.prefix, question.name(), RUST.suffix(precision));
        let (fill, u) = self.fill_uniforms(program, precision);
        let columns: Vec<String> =
            question.results().iter().map(|r| format!("{r}: &mut [{number}]")).collect();
        let mut lines =
            vec![String::new(), format!("/// {}: at the points of three columns.", question.meaning())];
        lines.push("///".into());
        lines.push("/// # Panics".into());
        lines.push("/// If the columns differ in length.".into());
        lines.push("#[allow(dead_code, unused_variables, clippy::too_many_arguments)]".into());
        lines.push(format!(
            "pub fn {name}(x: &[{number}], y: &[{number}], z: &[{number}]{}, {}) {{",
            self.extra_arguments(),
            columns.join(", ")
        ));
        lines.push("    let n = x.len();".into());
        lines.push("    let (y, z) = (&y[..n], &z[..n]);".into());
        for result in question.results() {
            lines.push(format!("    let {result} = &mut {result}[..n];"));
        }
        lines.extend(fill);
        lines.push("    for i in 0..n {".into());
        lines.push(format!("        let all = {}(x[i], y[i], z[i]{u});", self.at_name(program, precision)));
        lines.extend(
            question.results().iter().enumerate().map(|(k, r)| format!("        {r}[i] = all[{k}];")),
        );
        lines.extend(["    }".into(), "}".to_string()]);
        lines
    }
}
