//! Formulas that are too long for one function of C: steps over blocks of points, from a table.
//!
//! These are the steps of the machine code, see `solid::programs::block_plan`: parts of one shape share a function
//! and differ in a table of numbers, and each operation that joins them is a short loop. A solid of 500 balls is
//! compiled as one ball.

use std::cell::RefCell;
use std::collections::HashMap;

use super::SourceError;
use super::c_chunks::{Chunk, chunks};
use super::c_room::{IN_COLUMNS, Long, Room};
use super::c_table::{Called, Table};
use super::language::C;
use super::operations::{Operation, WEIGHTED_FIELDS};
use super::program::Program;
use super::statements::{Part, Statements, Writer};
use crate::ir::{Axis, Binary, Expr, Form, Forms, Graph, Node};
use crate::precision::Precision;
use crate::solid::{BlockPlan, BlockStep, ColumnPlace, JoiningOperation, Piece};

/// A plan with more numbers for each node than this is refused: its parts hold one another, as those of folds by
/// `blend` do, and the table grows with the square of their number.
const MOST_NUMBERS: usize = 2;

/// A program as steps.
pub(super) struct Blocks {
    plan: BlockPlan,
    steps: Vec<Step>,
    /// Its columns are those of the plan, and those that the chunks of long pieces hand on.
    room: Room,
}

/// A step of the plan, or a part of one.
enum Step {
    Planned(BlockStep),
    /// A chunk of a piece, by the piece's number. `numbers` says where those of a piece with parameters begin.
    Chunk {
        piece: usize,
        chunk: Chunk,
        numbers: Option<usize>,
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

/// What is written for the steps.
#[derive(Default)]
struct Written {
    made: Statements,
    called: Vec<Called>,
    table: Table,
    actions: Vec<(Action, usize)>,
    /// Functions of chunks by their texts.
    chunks: HashMap<String, usize>,
}

impl Blocks {
    /// `None` if the graph has no parts that would be steps, or none that are apart.
    pub fn of(program: &Program, precision: Precision) -> Option<Self> {
        let plan = BlockPlan::new(&program.graph, &program.outputs, program.forms(precision))?;
        if plan.numbers.len() > MOST_NUMBERS * program.graph.len() {
            return None;
        }
        let mut columns = plan.columns;
        let mut steps = Vec::with_capacity(plan.steps.len());
        for step in &plan.steps {
            match divided(&plan, &program.graph, step, &mut columns) {
                Some(chunks) => steps.extend(chunks),
                None => steps.push(Step::Planned(step.clone())),
            }
        }
        Some(Self { plan, steps, room: Room::new(precision, columns, program.uniforms.is_some()) })
    }

    /// The functions and tables: in the end a function that evaluates one block.
    pub fn write(self, writer: &Writer<'_>, name: &str, program: &Program) -> Result<Long, SourceError> {
        let table = Table { numbers: self.plan.numbers.clone(), steps: Vec::new() };
        let mut written = Written { table, ..Written::default() };
        for step in &self.steps {
            match step {
                Step::Planned(step) => {
                    let called = self.planned(Action::of(step), name, (writer, program), &mut written)?;
                    written.table.steps.push(called as i64 + 1);
                    written.table.steps.extend(operands(step));
                }
                Step::Chunk { piece, chunk, numbers, reads, writes } => {
                    let function = format!("{name}_chunk{}", written.chunks.len());
                    let graph = self.plan.pieces[*piece].shape.as_ref().unwrap_or(&program.graph);
                    self.chunk((graph, chunk, *numbers), &function, writer, &mut written)?;
                    written.table.steps.extend(reads.iter().chain(writes).map(column));
                }
            }
        }
        let Written { mut made, called, table, .. } = written;
        let length = made.lines.len();
        table.write(name, &called, self.room.kind(), &mut made.lines);
        Ok(Long { made, length, room: self.room, table })
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
                Called { name: function, is_piece: true, has_numbers: piece.parameters > 0, columns }
            }
            Action::Join(..) | Action::Weighted(..) | Action::Negate | Action::Copy => {
                self.action(action, &function, writer, &mut written.made)?;
                Called { name: function, is_piece: false, has_numbers: false, columns: action.columns() }
            }
        };
        written.called.push(called);
        written.actions.push((action, written.called.len() - 1));
        Ok(written.called.len() - 1)
    }

    /// A chunk of a long piece: its function, if none has its text yet, and its first numbers in the table.
    fn chunk(
        &self,
        (graph, chunk, numbers): (&Graph, &Chunk, Option<usize>),
        name: &str,
        writer: &Writer<'_>,
        written: &mut Written,
    ) -> Result<(), SourceError> {
        let gathered = RefCell::new(Vec::new());
        let parameter = |i: u32| format!("c[{i}]");
        let to_gather = numbers.is_none().then_some(&gathered); // those of a shape are its parameters already
        let writer = Writer { axes: IN_COLUMNS, gathered: to_gather, parameter: &parameter, ..*writer };
        let inputs: Vec<(Node, String)> =
            chunk.reads.iter().enumerate().map(|(i, &node)| (node, format!("r{i}[i]"))).collect();
        let forms = Forms::default(); // a piece has no R₀
        let part = Part { graph, inputs: &inputs, outputs: &chunk.writes, forms: &forms };
        let body = writer.statements(&part)?;
        let text = body.lines.join("\n") + &body.outputs.join(",");
        let gathered = gathered.into_inner();
        let has_numbers = numbers.is_some() || !gathered.is_empty();
        let known = written.chunks.get(&text).copied();
        let called = known.unwrap_or_else(|| {
            let counts = [chunk.reads.len(), chunk.writes.len()];
            self.room.loop_of(name, counts, has_numbers, (&body, None), &mut written.made);
            let columns = chunk.reads.len() + chunk.writes.len();
            written.called.push(Called { name: name.into(), is_piece: true, has_numbers, columns });
            written.chunks.insert(text, written.called.len() - 1);
            written.called.len() - 1
        });
        let Table { numbers: all, steps } = &mut written.table;
        steps.push(called as i64 + 1);
        if let Some(first) = numbers {
            steps.push(first as i64);
        } else if has_numbers {
            steps.push(all.len() as i64);
            all.extend(gathered);
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
        self.room.loop_of(name, counts, piece.parameters > 0, (&body, None), made);
        Ok(())
    }

    /// The loop of an operation that joins columns.
    fn action(
        &self,
        action: Action,
        function: &str,
        writer: &Writer<'_>,
        made: &mut Statements,
    ) -> Result<(), SourceError> {
        let number = C.number(self.room.precision);
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
                let joint = writer.names.joint(&C, self.room.precision);
                let call = writer.names.operation(operation, &C, self.room.precision);
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
            let numbers = (!parameters.is_empty()).then_some(parameters.start as i64);
            numbers.into_iter().chain(reads.iter().chain(writes).map(column)).collect()
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
    let numbers = piece.shape.is_some().then_some(parameters.start);
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
        steps.push(Step::Chunk { piece: *program, chunk, numbers, reads: read, writes: written });
    }
    *columns = (*columns).max(next as usize);
    Some(steps)
}
