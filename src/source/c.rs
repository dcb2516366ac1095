//! Files in C and CUDA: heads, parameters, functions for one point and for columns.

use std::collections::BTreeSet;

use super::c_blocks::Blocks;
use super::c_folds::Folds;
use super::c_linkage::{columns_name, function_name, guard, in_c};
use super::c_room::{Long, Room};
use super::c_table::Table;
use super::language::{C, Function};
use super::operations::{Names, Operation, WEIGHTED_FIELDS};
use super::program::{Program, Question};
use super::statements::{Own, Part, Statements, Writer};
use super::{File, Math, OpenParam, PARAMS, SourceError};
use crate::ir::Forms;
use crate::precision::Precision;

/// A function with more operations than this is divided: gcc -O3 needs time that grows faster than its length.
const LONGEST_FUNCTION: usize = 1500;

/// A function with more operations than this is not inlined in each of those that call it.
const LONGEST_INLINED: usize = 200;

/// gcc takes the choices of one result after the other for partly redundant and moves them into branches, which it then
/// does not vectorise. Clang does not. Functions with options of their own are not inlined into those without, so a header leaves
/// that to the command.
const LEFT_WHOLE: [&str; 3] = [
    "#if defined(__GNUC__) && !defined(__clang__)",
    "#pragma GCC optimize (\"no-tree-pre\") /* choices stay choices, and loops are vectorised */",
    "#endif",
];

/// The kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flavour {
    /// One translation unit.
    Unit,
    /// A header with everything in it.
    Header,
    /// A file whose functions are compiled for the processor and for the graphics card.
    Cuda,
}

impl Flavour {
    /// What stands before the functions that others call.
    fn linkage(self) -> &'static str {
        match self {
            Self::Unit => "",
            Self::Header => "static inline ",
            Self::Cuda => "static inline __host__ __device__ ",
        }
    }
}

/// A file with everything in it.
pub(super) fn source(file: &File<'_>, flavour: Flavour) -> Result<String, SourceError> {
    let writer = CFile { file, flavour };
    let mut lines = writer.head();
    lines.extend(writer.macros());
    match flavour {
        Flavour::Unit => lines.extend(LEFT_WHOLE.map(String::from)),
        Flavour::Header => {
            lines.push("/* gcc vectorises loops over points if it is called with -fno-tree-pre */".into())
        }
        Flavour::Cuda => {}
    }
    lines.extend(writer.params());
    if flavour == Flavour::Unit {
        // a compiler of C++ may be given a .c file, and its names must be those of the header
        lines.push(String::new());
        lines.extend(in_c(writer.declarations()));
    }
    let mut operations: BTreeSet<(Operation, bool)> = BTreeSet::new();
    let mut called: BTreeSet<(Function, bool)> = BTreeSet::new();
    let mut functions = Vec::new();
    for program in file.programs {
        let uniforms = writer.uniforms(program)?;
        called.extend(uniforms.functions.iter().map(|&function| (function, false)));
        functions.extend(uniforms.lines);
        for &precision in file.precisions {
            let (body, steps) = writer.body(program, precision)?;
            operations.extend(body.operations.iter().map(|&op| (op, precision == Precision::F32)));
            called.extend(body.functions.iter().map(|&function| (function, precision == Precision::F32)));
            functions.extend(body.lines);
            let long = steps.as_ref().filter(|steps| steps.are_for_points);
            functions.extend(writer.point(program, precision, long));
            functions.extend(writer.columns(program, precision, steps.as_ref()));
            if flavour == Flavour::Cuda {
                functions.extend(writer.kernel(program, precision));
            }
        }
    }
    lines.extend(writer.library(&called));
    lines.extend(writer.operations(&operations));
    lines.extend(functions);
    if flavour != Flavour::Unit {
        lines.push(String::new());
        lines.push("#endif".into());
    }
    Ok(lines.join("\n") + "\n")
}

/// A body of one program in one precision: what the functions for points and columns call.
#[derive(Default)]
struct Body {
    lines: Vec<String>,
    operations: BTreeSet<Operation>,
    functions: BTreeSet<Function>,
}

/// A program as steps over blocks of points.
struct Steps {
    /// The function of one block.
    name: String,
    room: Room,
    table: Table,
    /// Whether single points take them as well: the formula is too long for one function.
    are_for_points: bool,
}

pub(super) struct CFile<'a> {
    pub file: &'a File<'a>,
    pub flavour: Flavour,
}

impl CFile<'_> {
    fn names(&self) -> Names<'_> {
        Names { prefix: self.file.prefix }
    }

    /// What a header says of the last bits of values.
    pub(super) fn bits(&self) -> &'static [&'static str] {
        match self.file.options.math {
            Math::System => &[
                "The values have the bits of rfm, except where sin, exp and the like of <math.h> are called: their",
                "last bits differ between systems.",
            ],
            Math::Rfm => &[
                "The values have the bits of rfm. Functions such as rfm_math_sin are in the C library of rfm.",
            ],
        }
    }

    fn head(&self) -> Vec<String> {
        let mut lines = vec!["/*".to_string()];
        let mut say = |line: &str| lines.push(format!(" * {line}").trim_end().to_string());
        self.file.title().iter().for_each(|line| say(line));
        say("");
        match self.flavour {
            Flavour::Unit | Flavour::Header => {
                say("Compile with -O3 -march=native -ffp-contract=off -fno-math-errno -fno-trapping-math.");
                say(
                    "Without -ffp-contract=off the last bits depend on the processor, without the other two the loops",
                );
                say("over columns are not vectorised. -ffast-math is refused: it would break signs and NaN.");
            }
            Flavour::Cuda => {
                say(
                    "Compile with nvcc -fmad=false: without it the last bits differ from those on the processor.",
                );
            }
        }
        self.bits().iter().for_each(|line| say(line));
        say("");
        say("A point whose coordinates are not finite has the value NaN. Columns must not overlap.");
        lines.push(" */".into());
        lines
    }

    fn macros(&self) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        if self.flavour != Flavour::Unit {
            let guard = guard(self.file, "SOURCE_H");
            lines.extend([format!("#ifndef {guard}"), format!("#define {guard}")]);
        }
        lines.extend(
            ["#include <float.h>", "#include <math.h>", "#include <stddef.h>", "#include <stdlib.h>", ""]
                .map(String::from),
        );
        let fast = "#error \"compile without -ffast-math: it breaks signs and NaN\"";
        let is_fast = "#if defined(__FAST_MATH__) || defined(_M_FP_FAST) || __FINITE_MATH_ONLY__ + 0 > 0";
        lines.extend([is_fast, fast, "#endif"].map(String::from));
        let wide = "#error \"compile with -msse2 -mfpmath=sse: wider arithmetic rounds otherwise\"";
        lines.extend(
            ["#if FLT_EVAL_METHOD + 0 == 1 || FLT_EVAL_METHOD + 0 == 2", wide, "#endif"].map(String::from),
        );
        if self.flavour == Flavour::Cuda {
            let plain = ["#ifndef __CUDACC__", "#define __host__", "#define __device__", "#endif"];
            lines.extend(plain.map(String::from));
        }
        let qualifiers = if self.flavour == Flavour::Cuda { "__host__ __device__ " } else { "" };
        lines.extend([
            "#ifndef RFM_INLINE".into(),
            "#if defined(__GNUC__) || defined(__clang__)".into(),
            format!("#define RFM_INLINE static inline {qualifiers}__attribute__((always_inline, unused))"),
            // many functions that are called once: in one another, they would take a compiler minutes
            "#define RFM_NOINLINE static __attribute__((noinline))".into(),
            "#else".into(),
            "#define RFM_NOINLINE static".into(),
            format!("#define RFM_INLINE static inline {qualifiers}").trim_end().to_string(),
            "#endif".into(),
            "#if defined(__GNUC__) || defined(__clang__) || defined(_MSC_VER)".into(),
            "#define RFM_RESTRICT __restrict".into(),
            "#else".into(),
            "#define RFM_RESTRICT restrict".into(),
            "#endif".into(),
            "#endif".into(),
        ]);
        lines
    }

    /// The structure of params, with the values of the file.
    pub fn params(&self) -> Vec<String> {
        let File { prefix, params, .. } = self.file;
        if params.is_empty() {
            return Vec::new();
        }
        let mut lines = vec![String::new(), format!("/* {PARAMS} */")];
        lines.push("typedef struct {".into());
        for OpenParam { param, field, .. } in params {
            let doc =
                param.doc.as_ref().map_or(String::new(), |doc| format!(": {}", doc.replace("*/", "* /")));
            lines.push(format!("    double {field}; /* {} = {:?}{doc} */", param.name, param.value));
        }
        lines.push(format!("}} {prefix}_params;"));
        let values: Vec<String> =
            params.iter().filter_map(|open| C.constant(open.param.value, Precision::F64)).collect();
        let comment = "/* The values that the file gives them: start from a copy. */";
        lines.extend([comment.into(), "#if defined(__GNUC__) || defined(__clang__)".into()]);
        lines.extend(["__attribute__((unused))".into(), "#endif".to_string()]);
        lines.push(format!("static const {prefix}_params {prefix}_defaults = {{ {} }};", values.join(", ")));
        lines
    }

    /// Arguments between the point and the results.
    fn extra_arguments(&self) -> String {
        let time = if self.file.moves { ", double t" } else { "" };
        let params = if self.file.params.is_empty() {
            String::new()
        } else {
            format!(", const {}_params *p", self.file.prefix)
        };
        format!("{time}{params}")
    }

    fn extra_values(&self) -> &'static str {
        match (self.file.moves, self.file.params.is_empty()) {
            (false, true) => "",
            (true, true) => ", t",
            (false, false) => ", p",
            (true, false) => ", t, p",
        }
    }

    fn point_signature(&self, question: Question, precision: Precision) -> String {
        let (number, name) = (C.number(precision), function_name(self.file, question, precision));
        let results =
            if question == Question::Gradient { format!(", {number} gradient[3]") } else { String::new() };
        format!("{number} {name}({number} x, {number} y, {number} z{}{results})", self.extra_arguments())
    }

    fn columns_signature(&self, question: Question, precision: Precision) -> String {
        let (number, name) = (C.number(precision), columns_name(self.file, question, precision));
        let points: Vec<String> = ["x", "y", "z"].map(|axis| format!("const {number} *{axis}")).to_vec();
        let results: Vec<String> = question.results().iter().map(|r| format!("{number} *{r}")).collect();
        format!(
            "void {name}(size_t n, {}{}, {})",
            points.join(", "),
            self.extra_arguments(),
            results.join(", ")
        )
    }

    pub fn declarations(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for program in self.file.programs {
            let question = program.question;
            lines.push(format!("/* {}; at one point, and at n points in columns. */", question.meaning()));
            for &precision in self.file.precisions {
                lines.push(self.point_signature(question, precision) + ";");
                lines.push(self.columns_signature(question, precision) + ";");
            }
        }
        lines
    }

    /// Declarations of the functions that the C library of `rfm` has.
    fn library(&self, called: &BTreeSet<(Function, bool)>) -> Vec<String> {
        if self.file.options.math == Math::System || called.is_empty() {
            return Vec::new();
        }
        let precision = |single| if single { Precision::F32 } else { Precision::F64 };
        let declarations = called.iter().map(|(function, single)| function.declaration(precision(*single)));
        std::iter::once(String::new()).chain(in_c(declarations)).collect()
    }

    /// The operations that the functions of a file call.
    fn operations(&self, operations: &BTreeSet<(Operation, bool)>) -> Vec<String> {
        let names = self.names();
        let mut lines = vec![String::new()];
        for precision in self.file.precisions {
            let (number, single) = (C.number(*precision), *precision == Precision::F32);
            lines.push((C.pick)(number, &names.pick(&C, *precision)));
            let needed = || operations.iter().filter(|(_, is_single)| *is_single == single);
            if needed().any(|(operation, _)| matches!(operation, Operation::Weighted(..))) {
                lines.extend((C.structure)(&names.joint(&C, *precision), number, &WEIGHTED_FIELDS));
            }
            for (operation, _) in needed() {
                lines.push(String::new());
                lines.extend(operation.definition(&C, *precision, &names));
            }
        }
        lines
    }

    fn writer<'w>(
        &'w self,
        names: &'w Names<'w>,
        precision: Precision,
        uniform: &'w dyn Fn(u32) -> String,
        parameter: &'w dyn Fn(u32) -> String,
    ) -> Writer<'w> {
        let math = self.file.options.math;
        let axes = ["x", "y", "z", "t"];
        let own = if self.flavour == Flavour::Cuda { Own::Nothing } else { Own::Waves };
        Writer {
            language: &C,
            precision,
            names,
            math,
            axes,
            parameter,
            uniform,
            gathered: None,
            values: "v",
            own,
        }
    }

    fn uniforms_name(&self, program: &Program) -> String {
        format!("{}_uniforms_{}", self.file.prefix, program.question.name())
    }

    /// The function that finds what depends on time and params alone, in `double`.
    fn uniforms(&self, program: &Program) -> Result<Body, SourceError> {
        let Some((graph, roots)) = &program.uniforms else { return Ok(Body::default()) };
        let names = self.names();
        let parameter = |i: u32| format!("p->{}", self.file.field(i));
        let writer = self.writer(&names, Precision::F64, &|_| String::new(), &parameter);
        let writer = Writer { own: Own::Nothing, ..writer };
        let forms = Forms::default();
        let made = writer.statements(&Part { graph, inputs: &[], outputs: roots, forms: &forms })?;
        let arguments = self.extra_arguments();
        let arguments = arguments.trim_start_matches(", ");
        let name = self.uniforms_name(program);
        let is_long = made.lines.len() > LONGEST_INLINED && self.flavour != Flavour::Cuda;
        let linkage = if is_long { "RFM_NOINLINE" } else { "RFM_INLINE" };
        let mut lines = vec![String::new(), format!("{linkage} void {name}({arguments}, double *u) {{")];
        lines.extend(made.lines.iter().map(|line| format!("    {line}")));
        lines.extend(made.outputs.iter().enumerate().map(|(i, text)| format!("    u[{i}] = {text};")));
        if self.file.moves && !roots.iter().any(|&root| graph.uses_time(root)) {
            lines.push("    (void)t;".into());
        }
        if !self.file.params.is_empty() && !graph.uses_parameters(roots) {
            lines.push("    (void)p;".into());
        }
        lines.push("}".into());
        Ok(Body { lines, operations: made.operations, functions: made.functions })
    }

    /// Lines that fill `u`, if the program has uniforms.
    fn fill_uniforms(&self, program: &Program, precision: Precision) -> Vec<String> {
        let count = program.uniform_count();
        let mut lines = Vec::new();
        if program.uniforms.is_none() {
            if self.file.moves {
                lines.push("    (void)t;".into());
            }
            if !self.file.params.is_empty() {
                lines.push("    (void)p;".into());
            }
            return lines;
        }
        let call =
            format!("{}({}", self.uniforms_name(program), self.extra_values().trim_start_matches(", "));
        let size = count.max(1);
        match precision {
            Precision::F64 => {
                lines.push(format!("    double u[{size}];"));
                lines.push(format!("    {call}, u);"));
            }
            Precision::F32 => {
                lines.push(format!("    double wide[{size}];"));
                lines.push(format!("    float u[{size}];"));
                lines.push("    int k;".into());
                lines.push(format!("    {call}, wide);"));
                lines.push(format!("    for (k = 0; k < {count}; k++) u[k] = (float)wide[k];"));
            }
        }
        lines
    }

    fn at_name(&self, program: &Program, precision: Precision) -> String {
        format!("{}_at_{}{}", self.file.prefix, program.question.name(), C.suffix(precision))
    }

    /// A program that is too long for one function: in parts where it has them, or as a chain, whichever has the shorter
    /// functions.
    fn long(&self, program: &Program, precision: Precision) -> Result<Long, SourceError> {
        let (names, name) = (self.names(), self.at_name(program, precision));
        let uniform = |i: u32| format!("u[{i}]");
        let writer = self.writer(&names, precision, &uniform, &|_| String::new());
        let chain = Folds::of(program, precision).write(&writer, &name, program)?;
        if let Some(blocks) = Blocks::of(program, precision) {
            let parts = blocks.write(&writer, &name, program)?;
            if parts.length < chain.length {
                return Ok(parts);
            }
        }
        Ok(chain)
    }

    fn body(&self, program: &Program, precision: Precision) -> Result<(Body, Option<Steps>), SourceError> {
        if self.flavour != Flavour::Cuda && program.operations() > LONGEST_FUNCTION {
            let Long { made, room, table, .. } = self.long(program, precision)?;
            let Statements { lines, operations, functions, .. } = made;
            let steps = Steps { name: self.at_name(program, precision), room, table, are_for_points: true };
            return Ok((Body { lines, operations, functions }, Some(steps)));
        }
        let mut body = self.whole(program, precision)?;
        if self.flavour == Flavour::Cuda {
            return Ok((body, None));
        }
        let Some(folds) = Folds::of_calls(program, precision) else { return Ok((body, None)) };
        let names = self.names();
        let uniform = |i: u32| format!("u[{i}]");
        let writer = self.writer(&names, precision, &uniform, &|_| String::new());
        let name = format!("{}_steps_{}{}", self.file.prefix, program.question.name(), C.suffix(precision));
        let Long { made, room, table, .. } = folds.write(&writer, &name, program)?;
        body.lines.extend(made.lines);
        body.operations.extend(made.operations);
        body.functions.extend(made.functions);
        Ok((body, Some(Steps { name, room, table, are_for_points: false })))
    }

    /// A program as one function, for one point.
    fn whole(&self, program: &Program, precision: Precision) -> Result<Body, SourceError> {
        let names = self.names();
        let parameter = |_: u32| String::new();
        let uniform = |i: u32| format!("u[{i}]");
        let writer = self.writer(&names, precision, &uniform, &parameter);
        let Program { graph, outputs, question, .. } = program;
        let part = Part { graph, inputs: &[], outputs, forms: program.forms(precision) };
        let Statements { lines: statements, outputs, operations, functions } = writer.statements(&part)?;
        let (number, name) = (C.number(precision), self.at_name(program, precision));
        let mut lines = vec![String::new()];
        let many = question.results().len() > 1;
        if many {
            lines.extend((C.structure)(&self.answer(precision), number, question.results()));
        }
        let uniforms =
            if program.uniforms.is_some() { format!(", const {number} *u") } else { String::new() };
        let result = if many { self.answer(precision) } else { number.into() };
        lines.push(format!("RFM_INLINE {result} {name}({number} x, {number} y, {number} z{uniforms}) {{"));
        lines.extend(statements.iter().map(|line| format!("    {line}")));
        if many {
            lines.push(format!("    {result} all;"));
            let results = question.results().iter().zip(&outputs);
            lines.extend(results.map(|(field, text)| format!("    all.{field} = {text};")));
            lines.push("    return all;".into());
        } else {
            lines.push(format!("    return {};", outputs[0]));
        }
        if program.uniform_count() == 0 && program.uniforms.is_some() {
            lines.insert(lines.len() - 1, "    (void)u;".into());
        }
        lines.push("}".into());
        Ok(Body { lines, operations, functions })
    }

    /// The structure of ω and ∇ω.
    fn answer(&self, precision: Precision) -> String {
        format!("{}_answer{}", self.file.prefix, C.suffix(precision))
    }

    /// The function for one point.
    fn point(&self, program: &Program, precision: Precision, steps: Option<&Steps>) -> Vec<String> {
        let question = program.question;
        let mut lines = vec![
            String::new(),
            format!("{}{} {{", self.flavour.linkage(), self.point_signature(question, precision)),
        ];
        lines.extend(self.fill_uniforms(program, precision));
        let name = self.at_name(program, precision);
        let u = if program.uniforms.is_some() { ", u" } else { "" };
        if let Some(Steps { name, room, table, .. }) = steps {
            lines.extend(room.point(name, question, table));
        } else if question == Question::Gradient {
            lines.push(format!("    const {} all = {name}(x, y, z{u});", self.answer(precision)));
            let parts = ["gx", "gy", "gz"].iter().enumerate();
            lines.extend(parts.map(|(i, field)| format!("    gradient[{i}] = all.{field};")));
            lines.push("    return all.omega;".into());
        } else {
            lines.push(format!("    return {name}(x, y, z{u});"));
        }
        lines.push("}".into());
        lines
    }

    /// The function for columns.
    fn columns(&self, program: &Program, precision: Precision, steps: Option<&Steps>) -> Vec<String> {
        let question = program.question;
        let signature = self
            .columns_signature(question, precision)
            .replace(" *", " *RFM_RESTRICT ")
            .replace("RFM_RESTRICT p", "p");
        let mut lines = vec![String::new(), format!("{}{signature} {{", self.flavour.linkage())];
        lines.extend(self.fill_uniforms(program, precision));
        let name = self.at_name(program, precision);
        let u = if program.uniforms.is_some() { ", u" } else { "" };
        if let Some(Steps { name, room, table, .. }) = steps {
            lines.extend(room.columns(name, question, table));
            lines.push("}".into());
            return lines;
        }
        lines.push("    size_t i;".into());
        lines.push("    for (i = 0; i < n; i++) {".into());
        let call = format!("{name}(x[i], y[i], z[i]{u})");
        if let [result] = question.results() {
            lines.push(format!("        {result}[i] = {call};"));
        } else {
            lines.push(format!("        const {} all = {call};", self.answer(precision)));
            lines.extend(question.results().iter().map(|r| format!("        {r}[i] = all.{r};")));
        }
        lines.extend(["    }".into(), "}".to_string()]);
        lines
    }

    /// The kernel of CUDA for columns in the memory of the device.
    fn kernel(&self, program: &Program, precision: Precision) -> Vec<String> {
        let question = program.question;
        let name = columns_name(self.file, question, precision);
        let kernel = name.replace("_many", "_kernel");
        let signature = self.columns_signature(question, precision).replace(&name, &kernel);
        let signature = signature.replace(&format!(", const {}_params *p", self.file.prefix), "");
        let params = if self.file.params.is_empty() {
            String::new()
        } else {
            format!(", {}_params params", self.file.prefix)
        };
        let signature = signature.replacen(')', &format!("{params})"), 1);
        let (number, at) = (C.number(precision), function_name(self.file, question, precision));
        let mut lines = vec![String::new(), "#ifdef __CUDACC__".into()];
        lines.push("/* Any number of threads: each takes every gridDim.x * blockDim.x-th point. */".into());
        lines.push(format!("static __global__ {signature} {{"));
        if !self.file.params.is_empty() {
            lines.push(format!("    const {}_params *p = &params;", self.file.prefix));
        }
        lines.push("    size_t i;".into());
        lines.push("    for (i = blockIdx.x * (size_t)blockDim.x + threadIdx.x; i < n; i += gridDim.x * (size_t)blockDim.x) {".into());
        let extra = self.extra_values();
        if question == Question::Gradient {
            lines.push(format!("        {number} gradient[3];"));
            lines.push(format!("        omega[i] = {at}(x[i], y[i], z[i]{extra}, gradient);"));
            let parts = ["gx", "gy", "gz"].iter().enumerate();
            lines.extend(parts.map(|(k, column)| format!("        {column}[i] = gradient[{k}];")));
        } else {
            lines.push(format!("        {}[i] = {at}(x[i], y[i], z[i]{extra});", question.results()[0]));
        }
        lines.extend(["    }", "}", "#endif"].map(String::from));
        lines
    }
}
