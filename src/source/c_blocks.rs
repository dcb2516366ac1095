//! Formulas that are too long for one function of C: steps over blocks of points, from a table.
//!
//! These are the steps of the machine code, see `solid::programs::block_plan`: parts of one shape share a function
//! and differ in a table of constants, and each operation that joins them is a short loop. A solid of 500 balls is
//! compiled as one ball.

use super::language::C;
use super::operations::{Operation, WEIGHTED_FIELDS};
use super::program::{Program, Question};
use super::statements::{Part, Statements, Writer};
use super::{SourceError, c};
use crate::ir::{Axis, Binary, Expr, Form, Forms, Graph, Node};
use crate::precision::Precision;
use crate::solid::{BlockPlan, BlockStep, ColumnPlace, JoiningOperation, Piece};

/// A function with more operations than this is divided: gcc -O3 needs time that grows faster than its length.
pub(super) const LONGEST_FUNCTION: usize = 1500;

/// Numbers that a block may keep at a time, for as many points as it has: most of a first-level cache.
const CACHED_BYTES: usize = 24 << 10;

/// Points of a block, at least and at most.
const SHORTEST: usize = 32;
const LONGEST: usize = 256;

/// A program as steps.
pub(super) struct Blocks {
    plan: BlockPlan,
    precision: Precision,
    /// Points of a block.
    points: usize,
    /// Whether the functions take what depends on time and params alone.
    has_uniforms: bool,
}

/// What a step does, as the number that the table has for it: its place in this list, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Action {
    Piece(usize),
    Join(Binary, Form),
    Weighted(Binary, Form),
    Negate,
    Copy,
}

impl Blocks {
    /// `None` if the graph has no parts that would be steps.
    pub fn of(program: &Program, precision: Precision) -> Option<Self> {
        let plan = BlockPlan::new(&program.graph, &program.outputs, program.forms(precision))?;
        let size = match precision {
            Precision::F64 => 8,
            Precision::F32 => 4,
        };
        let fitting = CACHED_BYTES / (size * plan.columns.max(1));
        let points = (fitting / SHORTEST * SHORTEST).clamp(SHORTEST, LONGEST);
        Some(Self { plan, precision, points, has_uniforms: program.uniforms.is_some() })
    }

    /// The functions and tables: in the end a function that evaluates one block.
    pub fn write(
        &self,
        writer: &Writer<'_>,
        name: &str,
        program: &Program,
    ) -> Result<Statements, SourceError> {
        let mut made = Statements::default();
        let number = c::number(self.precision);
        for (i, piece) in self.plan.pieces.iter().enumerate() {
            self.piece(piece, &format!("{name}_part{i}"), (writer, program), &mut made)?;
        }
        let actions = self.actions();
        for &action in &actions {
            self.action(action, name, writer, &mut made)?;
        }
        self.table(name, &actions, &mut made.lines);
        if !self.plan.constants.is_empty() {
            let constants: Vec<String> =
                self.plan.constants.iter().filter_map(|&value| C.constant(value, self.precision)).collect();
            made.lines.push(String::new());
            made.lines.push(format!("static const {number} {name}_constants[{}] = {{", constants.len()));
            made.lines.extend(constants.chunks(8).map(|row| format!("    {},", row.join(", "))));
            made.lines.push("};".into());
        }
        self.run(name, &actions, program, &mut made.lines);
        Ok(made)
    }

    /// What the steps do, each once, in the order in which it is met.
    fn actions(&self) -> Vec<Action> {
        let mut actions: Vec<Action> = Vec::new();
        for step in &self.plan.steps {
            let action = Action::of(step);
            if !actions.contains(&action) {
                actions.push(action);
            }
        }
        actions
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
        let writer = Writer { axes: ["x[i]", "y[i]", "z[i]", "t"], parameter: &parameter, ..*writer };
        let forms = Forms::default(); // a piece has no R₀
        let part = Part { graph, inputs: &inputs, outputs: &piece.outputs, forms: &forms };
        let body = writer.statements(&part)?;
        made.operations.extend(body.operations);
        let number = c::number(self.precision);
        let mut arguments = vec!["size_t n".to_string()];
        arguments.extend(["x", "y", "z"].map(|axis| format!("const {number} *RFM_RESTRICT {axis}")));
        if program.uniforms.is_some() {
            arguments.push(format!("const {number} *RFM_RESTRICT u"));
        }
        if piece.parameters > 0 {
            arguments.push(format!("const {number} *RFM_RESTRICT c"));
        }
        let reads = (0..piece.inputs.len()).map(|i| format!("const {number} *RFM_RESTRICT r{i}"));
        let writes = (0..piece.outputs.len()).map(|i| format!("{number} *RFM_RESTRICT w{i}"));
        arguments.extend(reads.chain(writes));
        let lines = &mut made.lines;
        lines.push(String::new());
        lines.push(format!("static void {name}({}) {{", arguments.join(", ")));
        lines.push("    size_t i;".into());
        lines.push("    (void)x; (void)y; (void)z;".into());
        if program.uniforms.is_some() {
            lines.push("    (void)u;".into());
        }
        lines.push("    for (i = 0; i < n; i++) {".into());
        lines.extend(body.lines.iter().map(|line| format!("        {line}")));
        lines.extend(body.outputs.iter().enumerate().map(|(i, text)| format!("        w{i}[i] = {text};")));
        lines.extend(["    }".into(), "}".to_string()]);
        Ok(())
    }

    /// The loop of an operation that joins columns.
    fn action(
        &self,
        action: Action,
        name: &str,
        writer: &Writer<'_>,
        made: &mut Statements,
    ) -> Result<(), SourceError> {
        let number = c::number(self.precision);
        let function = format!("{name}_{}", action.name());
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
        made.lines.push(format!("static void {function}(size_t n, {}) {{", arguments.join(", ")));
        made.lines.push("    size_t i;".into());
        made.lines.push("    for (i = 0; i < n; i++) {".into());
        made.lines.extend(body.into_iter().map(|line| format!("        {line}")));
        made.lines.extend(["    }".into(), "}".to_string()]);
        Ok(())
    }

    /// The steps: the number of an action, then its columns. Columns of the caller are −1, −2 …
    fn table(&self, name: &str, actions: &[Action], lines: &mut Vec<String>) {
        let mut numbers: Vec<String> = Vec::new();
        for step in &self.plan.steps {
            let action = Action::of(step);
            let code = actions.iter().position(|known| *known == action).map_or(0, |i| i + 1);
            numbers.push(code.to_string());
            numbers.extend(operands(step).into_iter().map(|number| number.to_string()));
        }
        numbers.push("0".into());
        lines.push(String::new());
        lines.push(format!("static const int {name}_steps[{}] = {{", numbers.len()));
        lines.extend(numbers.chunks(20).map(|row| format!("    {},", row.join(", "))));
        lines.push("};".into());
    }

    /// The function that takes the steps for one block of points.
    fn run(&self, name: &str, actions: &[Action], program: &Program, lines: &mut Vec<String>) {
        let number = c::number(self.precision);
        let has_uniforms = program.uniforms.is_some();
        let u = if has_uniforms { format!(", const {number} *u") } else { String::new() };
        lines.push(String::new());
        lines.push("/* n points at most as many as a column of its own has room for: `stride`. */".into());
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
        for (i, &action) in actions.iter().enumerate() {
            let mut arguments = vec!["n".to_string()];
            let mut first = 0;
            let mut columns = action.columns();
            let mut function = format!("{name}_{}", action.name());
            if let Action::Piece(number) = action {
                let piece = &self.plan.pieces[number];
                function = format!("{name}_part{number}");
                arguments.extend(["x", "y", "z"].map(String::from));
                if has_uniforms {
                    arguments.push("u".into());
                }
                if piece.parameters > 0 {
                    arguments.push(format!("{name}_constants + s[0]"));
                    first = 1;
                }
                columns = piece.inputs.len() + piece.outputs.len();
            }
            arguments.extend((first..first + columns).map(|k| format!("RFM_COLUMN({k})")));
            lines.push(format!("        case {}:", i + 1));
            lines.push(format!("            {function}({});", arguments.join(", ")));
            lines.push(format!("            s += {};", first + columns));
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
        let mut lines = vec![format!("    {number} columns[{}];", self.plan.columns.max(1))];
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
        let (points, columns) = (self.points, self.plan.columns.max(1));
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

/// The numbers of a step in the table, in the order of the arguments of its function.
fn operands(step: &BlockStep) -> Vec<i64> {
    let column = |place: &ColumnPlace| match *place {
        ColumnPlace::Own(number) => i64::from(number),
        ColumnPlace::Output(number) => -1 - i64::from(number),
    };
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
