//! Formulas that are too long for one function of C: steps over blocks of points, from a table.
//!
//! These are the steps of the machine code, see `solid::programs::block_plan`: parts of one shape share a function
//! and differ in a table of constants, and each operation that joins them is a short loop. A solid of 500 balls is
//! compiled as one ball.

use std::cell::RefCell;
use std::collections::HashMap;

use super::SourceError;
use super::c_chunks::{Chunk, chunks};
use super::language::C;
use super::operations::{Operation, WEIGHTED_FIELDS};
use super::program::{Program, Question};
use super::statements::{Part, Statements, Writer};
use crate::ir::{Axis, Binary, Expr, Form, Forms, Graph, Node};
use crate::precision::Precision;
use crate::solid::{BlockPlan, BlockStep, ColumnPlace, JoiningOperation, Piece};

/// A function with more operations than this is divided: gcc -O3 needs time that grows faster than its length.
pub(super) const LONGEST_FUNCTION: usize = 1500;

/// Greatest count of numbers that a block keeps at a time, over all its points: most of a first-level cache.
const CACHED_BYTES: usize = 24 << 10;

/// Least and greatest number of points of a block.
const SHORTEST: usize = 32;
const LONGEST: usize = 256;

/// How the functions of a block write the coordinates of a point.
const IN_COLUMNS: [&str; 4] = ["x[i]", "y[i]", "z[i]", "t"];

/// A program as steps.
pub(super) struct Blocks {
    plan: BlockPlan,
    steps: Vec<Step>,
    /// Columns of a block: those of the plan, and those that the chunks of long pieces hand on.
    columns: usize,
    precision: Precision,
    /// Points of a block.
    points: usize,
    /// Whether the functions take what depends on time and params alone.
    has_uniforms: bool,
}

/// A step of the plan, or a part of one.
enum Step {
    Planned(BlockStep),
    /// A chunk of a piece, by the piece's number. `constants` says where those of a piece with parameters begin.
    Chunk {
        piece: usize,
        chunk: Chunk,
        constants: Option<usize>,
        reads: Vec<ColumnPlace>,
        writes: Vec<ColumnPlace>,
    },
}

/// What a step does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Action {
    Piece(usize),
    Join(Binary, Form),
    Weighted(Binary, Form),
    Negate,
    Copy,
}

/// A function that steps call.
struct Called {
    name: String,
    /// Whether it is a piece of arithmetic, which is given the points.
    is_piece: bool,
    has_constants: bool,
    /// How many columns it is given.
    columns: usize,
}

/// What is written for the steps.
#[derive(Default)]
struct Written {
    made: Statements,
    called: Vec<Called>,
    constants: Vec<f64>,
    /// The table: the number of a function, counted from 1, its constants and its columns.
    table: Vec<i64>,
    actions: Vec<(Action, usize)>,
    /// Functions of chunks by their texts.
    chunks: HashMap<String, usize>,
}

impl Blocks {
    /// `None` if the graph has no parts that would be steps.
    pub fn of(program: &Program, precision: Precision) -> Option<Self> {
        let plan = BlockPlan::new(&program.graph, &program.outputs, program.forms(precision))?;
        let mut columns = plan.columns;
        let mut steps = Vec::with_capacity(plan.steps.len());
        for step in &plan.steps {
            match divided(&plan, &program.graph, step, &mut columns) {
                Some(chunks) => steps.extend(chunks),
                None => steps.push(Step::Planned(step.clone())),
            }
        }
        let size = match precision {
            Precision::F64 => 8,
            Precision::F32 => 4,
        };
        let fitting = CACHED_BYTES / (size * columns.max(1));
        let points = (fitting / SHORTEST * SHORTEST).clamp(SHORTEST, LONGEST);
        Some(Self { plan, steps, columns, precision, points, has_uniforms: program.uniforms.is_some() })
    }

    /// The functions and tables: in the end a function that evaluates one block.
    pub fn write(
        &self,
        writer: &Writer<'_>,
        name: &str,
        program: &Program,
    ) -> Result<Statements, SourceError> {
        let mut written = Written { constants: self.plan.constants.clone(), ..Written::default() };
        for step in &self.steps {
            match step {
                Step::Planned(step) => {
                    let called = self.planned(Action::of(step), name, (writer, program), &mut written)?;
                    written.table.push(called as i64 + 1);
                    written.table.extend(operands(step));
                }
                Step::Chunk { piece, chunk, constants, reads, writes } => {
                    let function = format!("{name}_chunk{}", written.chunks.len());
                    let graph = self.plan.pieces[*piece].shape.as_ref().unwrap_or(&program.graph);
                    self.chunk((graph, chunk, *constants), &function, writer, &mut written)?;
                    written.table.extend(reads.iter().chain(writes).map(column));
                }
            }
        }
        let Written { mut made, called, constants, table, .. } = written;
        let lines = &mut made.lines;
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
        self.run(name, &called, lines);
        Ok(made)
    }

    /// The number of the function for what a step of the plan does, which is written if it is new.
    fn planned(
        &self,
        action: Action,
        name: &str,
        (writer, program): (&Writer<'_>, &Program),
        written: &mut Written,
    ) -> Result<usize, SourceError> {
        if let Some((_, called)) = written.actions.iter().find(|(known, _)| *known == action) {
            return Ok(*called);
        }
        let function = format!("{name}_{}", action.name());
        let called = match action {
            Action::Piece(number) => {
                let piece = &self.plan.pieces[number];
                self.piece(piece, &function, (writer, program), &mut written.made)?;
                let columns = piece.inputs.len() + piece.outputs.len();
                Called { name: function, is_piece: true, has_constants: piece.parameters > 0, columns }
            }
            Action::Join(..) | Action::Weighted(..) | Action::Negate | Action::Copy => {
                self.action(action, &function, writer, &mut written.made)?;
                Called { name: function, is_piece: false, has_constants: false, columns: action.columns() }
            }
        };
        written.called.push(called);
        written.actions.push((action, written.called.len() - 1));
        Ok(written.called.len() - 1)
    }

    /// A chunk of a long piece: its function, if none has its text yet, and its first numbers in the table.
    fn chunk(
        &self,
        (graph, chunk, constants): (&Graph, &Chunk, Option<usize>),
        name: &str,
        writer: &Writer<'_>,
        written: &mut Written,
    ) -> Result<(), SourceError> {
        let gathered = RefCell::new(Vec::new());
        let parameter = |i: u32| format!("c[{i}]");
        let writer = Writer { axes: IN_COLUMNS, gathered: Some(&gathered), parameter: &parameter, ..*writer };
        let inputs: Vec<(Node, String)> =
            chunk.reads.iter().enumerate().map(|(i, &node)| (node, format!("r{i}[i]"))).collect();
        let forms = Forms::default(); // a piece has no R₀
        let part = Part { graph, inputs: &inputs, outputs: &chunk.writes, forms: &forms };
        let body = writer.statements(&part)?;
        let text = body.lines.join("\n") + &body.outputs.join(",");
        let gathered = gathered.into_inner();
        let has_constants = constants.is_some() || !gathered.is_empty();
        let known = written.chunks.get(&text).copied();
        let called = known.unwrap_or_else(|| {
            let counts = [chunk.reads.len(), chunk.writes.len()];
            self.loop_of(name, counts, has_constants, &body, &mut written.made);
            let columns = chunk.reads.len() + chunk.writes.len();
            written.called.push(Called { name: name.into(), is_piece: true, has_constants, columns });
            written.chunks.insert(text, written.called.len() - 1);
            written.called.len() - 1
        });
        written.table.push(called as i64 + 1);
        if let Some(first) = constants {
            written.table.push(first as i64);
        } else if has_constants {
            written.table.push(written.constants.len() as i64);
            written.constants.extend(gathered);
        }
        Ok(())
    }

    /// A piece of arithmetic as a loop over the points of a block.
    fn piece(
        &self,
        piece: &Piece,
        name: &str,
        (writer, program): (&Writer<'_>, &Program),
        made: &mut Statements,
    ) -> Result<(), SourceError> {
        let graph = piece.shape.as_ref().unwrap_or(&program.graph);
        let inputs: Vec<(Node, String)> =
            piece.inputs.iter().enumerate().map(|(i, &node)| (node, format!("r{i}[i]"))).collect();
        let parameter = |i: u32| format!("c[{i}]");
        let writer = Writer { axes: IN_COLUMNS, parameter: &parameter, ..*writer };
        let forms = Forms::default(); // a piece has no R₀
        let part = Part { graph, inputs: &inputs, outputs: &piece.outputs, forms: &forms };
        let body = writer.statements(&part)?;
        let counts = [piece.inputs.len(), piece.outputs.len()];
        self.loop_of(name, counts, piece.parameters > 0, &body, made);
        Ok(())
    }

    /// A function that computes statements for the points of a block.
    fn loop_of(
        &self,
        name: &str,
        [reads, writes]: [usize; 2],
        has_constants: bool,
        body: &Statements,
        made: &mut Statements,
    ) {
        made.operations.extend(&body.operations);
        made.functions.extend(&body.functions);
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
        let unused = [("u", self.has_uniforms), ("c", has_constants)];
        let unused = unused.iter().filter(|(_, is)| *is).map(|(name, _)| format!(" (void){name};"));
        lines.push(format!("    (void)x; (void)y; (void)z;{}", unused.collect::<String>()));
        lines.push("    for (i = 0; i < n; i++) {".into());
        lines.extend(body.lines.iter().map(|line| format!("        {line}")));
        lines.extend(body.outputs.iter().enumerate().map(|(i, text)| format!("        w{i}[i] = {text};")));
        lines.extend(["    }".into(), "}".to_string()]);
    }

    /// The loop of an operation that joins columns.
    fn action(
        &self,
        action: Action,
        function: &str,
        writer: &Writer<'_>,
        made: &mut Statements,
    ) -> Result<(), SourceError> {
        let number = C.number(self.precision);
        let column = |name: &str| format!("const {number} *RFM_RESTRICT {name}");
        let result = |name: &str| format!("{number} *RFM_RESTRICT {name}");
        let (arguments, body) = match action {
            Action::Piece(_) => return Ok(()),
            Action::Copy => (vec![column("a"), result("w")], vec!["w[i] = a[i];".to_string()]),
            Action::Negate => (vec![column("a"), result("w")], vec!["w[i] = -a[i];".to_string()]),
            Action::Join(op, form) => {
                let mut graph = Graph::default();
                let operands = [Axis::X, Axis::Y].map(|axis| graph.coordinate(axis));
                let root = graph.intern(Expr::Binary(op, operands[0], operands[1]), None);
                let writer = Writer { axes: ["a[i]", "b[i]", "", ""], ..*writer };
                let forms = Forms::all(form);
                let part = Part { graph: &graph, inputs: &[], outputs: &[root], forms: &forms };
                let found = writer.statements(&part)?;
                made.operations.extend(found.operations);
                let mut body = found.lines;
                body.push(format!("w[i] = {};", found.outputs[0]));
                (vec![column("a"), column("b"), result("w")], body)
            }
            Action::Weighted(op, form) => {
                let Some(r0) = op.r0() else { unreachable!("{op:?} has no weights") };
                let operation = Operation::Weighted(r0.into(), form.into());
                made.operations.insert(operation);
                let joint = writer.names.joint(&C, self.precision);
                let call = writer.names.operation(operation, &C, self.precision);
                let mut body = vec![format!("const {joint} all = {call}(a[i], b[i]);")];
                body.extend(WEIGHTED_FIELDS.map(|field| format!("{field}[i] = all.{field};")));
                let mut arguments = vec![column("a"), column("b")];
                arguments.extend(WEIGHTED_FIELDS.map(result));
                (arguments, body)
            }
        };
        made.lines.push(String::new());
        made.lines.push(format!("RFM_NOINLINE void {function}(size_t n, {}) {{", arguments.join(", ")));
        made.lines.push("    size_t i;".into());
        made.lines.push("    for (i = 0; i < n; i++) {".into());
        made.lines.extend(body.into_iter().map(|line| format!("        {line}")));
        made.lines.extend(["    }".into(), "}".to_string()]);
        Ok(())
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
        let mut lines = vec![
            "    size_t at;".to_string(),
            format!(
                "    {number} *columns = ({number} *)malloc((size_t){columns} * {points} * sizeof({number}));"
            ),
            "    if (!columns) {".into(),
            "        for (at = 0; at < n; at++) {".into(),
        ];
        lines.extend(results.iter().map(|result| format!("            {result}[at] = NAN;")));
        lines.extend(["        }", "        return;", "    }"].map(String::from));
        lines.push(format!("    for (at = 0; at < n; at += {points}) {{"));
        lines.push(format!("        const size_t m = n - at < {points} ? n - at : {points};"));
        lines.push(format!("        {number} *out[{}];", results.len()));
        lines.extend(
            results.iter().enumerate().map(|(i, result)| format!("        out[{i}] = {result} + at;")),
        );
        lines.push(format!("        {name}(m, x + at, y + at, z + at{u}, columns, {points}, out);"));
        lines.extend(["    }", "    free(columns);"].map(String::from));
        lines
    }

    fn uniforms_argument(&self) -> &'static str {
        if self.has_uniforms { ", u" } else { "" }
    }
}

impl Action {
    fn of(step: &BlockStep) -> Self {
        match *step {
            BlockStep::Arithmetic { program, .. } => Self::Piece(program),
            BlockStep::Junction { op: JoiningOperation::Negate, .. } => Self::Negate,
            BlockStep::Junction { op: JoiningOperation::Binary(op), form, weights: None, .. } => {
                Self::Join(op, form)
            }
            BlockStep::Junction { op: JoiningOperation::Binary(op), form, weights: Some(_), .. } => {
                Self::Weighted(op, form)
            }
            BlockStep::Copy { .. } => Self::Copy,
        }
    }

    /// The name of its function.
    fn name(self) -> String {
        match self {
            Self::Piece(number) => format!("part{number}"),
            Self::Join(op, form) => format!("{}_{}", op.name(), form.name()),
            Self::Weighted(op, form) => format!("{}_weighted_{}", op.name(), form.name()),
            Self::Negate => "negate".into(),
            Self::Copy => "copy".into(),
        }
    }

    /// How many columns it reads and writes; a piece says it itself.
    fn columns(self) -> usize {
        match self {
            Self::Piece(_) => 0,
            Self::Join(..) => 3,
            Self::Weighted(..) => 5,
            Self::Negate | Self::Copy => 2,
        }
    }
}

/// The number of a column in the table.
fn column(place: &ColumnPlace) -> i64 {
    match *place {
        ColumnPlace::Own(number) => i64::from(number),
        ColumnPlace::Output(number) => -1 - i64::from(number),
    }
}

/// The numbers of a step in the table, in the order of the arguments of its function.
fn operands(step: &BlockStep) -> Vec<i64> {
    match step {
        BlockStep::Arithmetic { parameters, reads, writes, .. } => {
            let constants = (!parameters.is_empty()).then_some(parameters.start as i64);
            constants.into_iter().chain(reads.iter().chain(writes).map(column)).collect()
        }
        BlockStep::Junction { op: JoiningOperation::Negate, operands: [a, _], value, .. } => {
            [a, value].map(column).to_vec()
        }
        BlockStep::Junction { operands: [a, b], value, weights, .. } => {
            [a, b, value].into_iter().chain(weights.iter().flatten()).map(column).collect()
        }
        BlockStep::Copy { from, to } => [from, to].map(column).to_vec(),
    }
}

/// The chunks of a step that is a long piece of arithmetic. What they hand on gets columns behind the first `columns`,
/// which grow to hold it.
fn divided(plan: &BlockPlan, graph: &Graph, step: &BlockStep, columns: &mut usize) -> Option<Vec<Step>> {
    let BlockStep::Arithmetic { program, reads, writes, parameters } = step else { return None };
    let piece = &plan.pieces[*program];
    let graph = piece.shape.as_ref().unwrap_or(graph);
    let constants = piece.shape.is_some().then_some(parameters.start);
    let chunks = chunks(graph, &piece.inputs, &piece.outputs)?;
    let mut last_read: HashMap<Node, usize> = HashMap::new();
    for (i, chunk) in chunks.iter().enumerate() {
        last_read.extend(chunk.reads.iter().map(|&node| (node, i)));
    }
    let given = piece.inputs.iter().copied().zip(reads.iter().copied());
    let results = piece.outputs.iter().copied().zip(writes.iter().copied());
    let mut places: HashMap<Node, ColumnPlace> = given.chain(results).collect();
    let mut free: Vec<u32> = Vec::new();
    let mut next = plan.columns as u32;
    let mut steps = Vec::with_capacity(chunks.len());
    for (i, chunk) in chunks.into_iter().enumerate() {
        let read: Vec<ColumnPlace> = chunk.reads.iter().map(|node| places[node]).collect();
        let mut written = Vec::with_capacity(chunk.writes.len());
        for node in &chunk.writes {
            let place = *places.entry(*node).or_insert_with(|| {
                ColumnPlace::Own(free.pop().unwrap_or_else(|| {
                    next += 1;
                    next - 1
                }))
            });
            written.push(place);
        }
        for node in chunk.reads.iter().filter(|node| last_read[*node] == i) {
            if let Some(ColumnPlace::Own(column)) = places.get(node)
                && *column as usize >= plan.columns
            {
                free.push(*column);
            }
        }
        steps.push(Step::Chunk { piece: *program, chunk, constants, reads: read, writes: written });
    }
    *columns = (*columns).max(next as usize);
    Some(steps)
}
