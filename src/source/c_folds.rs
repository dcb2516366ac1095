//! Formulas that are too long for one function of C, as a chain of short pieces: sums, products, folds by `blend`.
//!
//! Each piece is a loop over the points of a block, see `c_links`. Those of one shape share a function and differ in a table
//! of numbers, so a fold of 500 parts is compiled as a few of them.

use std::cell::RefCell;
use std::collections::HashMap;

use super::SourceError;
use super::c_calls::{is_of_waves, stages};
use super::c_links::{Chunk, chunks};
use super::c_room::{IN_COLUMNS, Long, Room};
use super::c_table::{Called, Table};
use super::language::C;
use super::program::Program;
use super::statements::{Own, Part, Statements, Writer};
use crate::ir::{Node, Scalar};
use crate::precision::Precision;

/// A program as steps.
pub(super) struct Folds {
    steps: Vec<Step>,
    room: Room,
}

/// A chunk with the numbers of its columns. Those of the caller are −1, −2 …
struct Step {
    chunk: Chunk,
    reads: Vec<i64>,
    writes: Vec<i64>,
}

/// The steps whose texts are equal.
struct Shape {
    body: Statements,
    /// Calls of the library for the points where the body gives NaN.
    mend: Option<Statements>,
    reads: usize,
    writes: usize,
    /// The numbers of each of its steps.
    numbers: Vec<Vec<Scalar>>,
    /// Which of the numbers differ between its steps.
    varying: Vec<usize>,
}

/// A step by the number of its shape, and its number among the steps of that.
type Place = (usize, usize);

impl Folds {
    /// The steps of a program.
    pub fn of(program: &Program, precision: Precision) -> Self {
        let (steps, columns) = placed(chunks(&program.graph, &program.outputs), &program.outputs);
        Self { steps, room: Room::new(precision, columns, program.uniforms.is_some()) }
    }

    /// The steps of a program that calls functions of the mathematical library, for loops without calls.
    pub fn of_calls(program: &Program, precision: Precision) -> Option<Self> {
        let (steps, columns) = placed(stages(&program.graph, &program.outputs)?, &program.outputs);
        Some(Self { steps, room: Room::new(precision, columns, program.uniforms.is_some()) })
    }

    /// The functions and tables: in the end a function that evaluates one block.
    pub fn write(self, writer: &Writer<'_>, name: &str, program: &Program) -> Result<Long, SourceError> {
        let (shapes, places) = self.shapes(writer, program)?;
        let mut made = Statements::default();
        let mut called = Vec::new();
        for (number, shape) in shapes.iter().enumerate() {
            let (name, has_numbers) = (format!("{name}_part{number}"), !shape.varying.is_empty());
            let body = (&shape.body, shape.mend.as_ref());
            self.room.loop_of(&name, [shape.reads, shape.writes], has_numbers, body, &mut made);
            called.push(Called { name, is_piece: true, has_numbers, columns: shape.reads + shape.writes });
        }
        let (mut numbers, mut table) = (Vec::new(), Vec::new());
        for (step, (number, member)) in self.steps.iter().zip(places) {
            let shape = &shapes[number];
            table.push(number as i64 + 1);
            if !shape.varying.is_empty() {
                table.push(numbers.len() as i64);
                numbers.extend(shape.varying.iter().map(|&k| shape.numbers[member][k]));
            }
            table.extend(step.reads.iter().chain(&step.writes));
        }
        let length = made.lines.len();
        let table = Table { numbers, steps: table };
        table.write(name, &called, self.room.kind(), &mut made.lines);
        Ok(Long { made, length, room: self.room, table })
    }

    /// The shapes of the steps, and the place of each step among them.
    fn shapes(
        &self,
        writer: &Writer<'_>,
        program: &Program,
    ) -> Result<(Vec<Shape>, Vec<Place>), SourceError> {
        let forms = program.forms(self.room.precision);
        let mut known: HashMap<String, usize> = HashMap::new();
        let (mut shapes, mut places): (Vec<Shape>, Vec<Place>) = (Vec::new(), Vec::new());
        for Step { chunk, .. } in &self.steps {
            let gathered = RefCell::new(Vec::new());
            let of_waves = is_of_waves(&program.graph, chunk);
            let own = if of_waves { Own::FastWaves } else { writer.own };
            let writer = Writer { axes: IN_COLUMNS, gathered: Some(&gathered), own, ..*writer };
            let inputs: Vec<(Node, String)> =
                chunk.reads.iter().enumerate().map(|(i, &node)| (node, format!("r{i}[i]"))).collect();
            let part = Part { graph: &program.graph, inputs: &inputs, outputs: &chunk.writes, forms };
            let body = writer.statements(&part)?;
            let text = body.lines.join("\n") + &body.outputs.join(",");
            let number = *known.entry(text).or_insert(shapes.len());
            if number == shapes.len() {
                let [reads, writes] = [chunk.reads.len(), chunk.writes.len()];
                let again = RefCell::new(Vec::new());
                let slow = Writer { gathered: Some(&again), own: Own::Nothing, ..writer };
                let mend = of_waves.then(|| slow.statements(&part)).transpose()?;
                shapes.push(Shape { body, mend, reads, writes, numbers: Vec::new(), varying: Vec::new() });
            }
            places.push((number, shapes[number].numbers.len()));
            shapes[number].numbers.push(gathered.into_inner());
        }
        shapes.iter_mut().for_each(|shape| shape.settle(self.room.precision));
        Ok((shapes, places))
    }
}

impl Shape {
    /// Finds the numbers that differ between the steps, and writes the others into the text.
    fn settle(&mut self, precision: Precision) {
        let Some((first, others)) = self.numbers.split_first() else { return };
        let differs = |k: usize| others.iter().any(|other| other[k] != first[k]);
        self.varying = (0..first.len()).filter(|&k| differs(k)).collect();
        let texts: Vec<String> = (0..first.len())
            .map(|k| match self.varying.binary_search(&k) {
                Ok(number) => format!("c[{number}]"),
                Err(_) => match first[k] {
                    Scalar::Constant(value) => C.constant(value, precision).unwrap_or_default(),
                    Scalar::Uniform { index, negated: false } => format!("u[{index}]"),
                    Scalar::Uniform { index, negated: true } => format!("(-u[{index}])"),
                },
            })
            .collect();
        for body in [Some(&mut self.body), self.mend.as_mut()].into_iter().flatten() {
            for text in body.lines.iter_mut().chain(&mut body.outputs) {
                *text = replaced(text, &texts);
            }
        }
    }
}

/// A text with something else in the place of each `c[k]`.
fn replaced(text: &str, by: &[String]) -> String {
    let mut parts = text.split("c[");
    let mut made = parts.next().unwrap_or_default().to_string();
    for part in parts {
        match part
            .split_once(']')
            .and_then(|(number, rest)| Some((by.get(number.parse::<usize>().ok()?)?, rest)))
        {
            Some((number, rest)) => made.extend([number, rest]),
            None => made.extend(["c[", part]),
        }
    }
    made
}

/// Chunks with columns for what they hand on, each for as long as it is needed, and the number of these columns.
/// Outputs are written to the caller's columns, and read from there.
fn placed(chunks: Vec<Chunk>, outputs: &[Node]) -> (Vec<Step>, usize) {
    let mut last_read: HashMap<Node, usize> = HashMap::new();
    for (i, chunk) in chunks.iter().enumerate() {
        last_read.extend(chunk.reads.iter().map(|&node| (node, i)));
    }
    let mut places: HashMap<Node, i64> = HashMap::new();
    let mut again = Vec::new();
    for (&output, place) in outputs.iter().zip((i64::MIN..=-1).rev()) {
        if *places.entry(output).or_insert(place) != place {
            again.push((output, place));
        }
    }
    let (mut free, mut columns): (Vec<i64>, i64) = (Vec::new(), 0);
    let mut steps = Vec::with_capacity(chunks.len());
    for (i, chunk) in chunks.into_iter().enumerate() {
        let reads: Vec<i64> = chunk.reads.iter().map(|node| places[node]).collect();
        let mut take = || {
            free.pop().unwrap_or_else(|| {
                columns += 1;
                columns - 1
            })
        };
        let writes = chunk.writes.iter().map(|&node| *places.entry(node).or_insert_with(&mut take)).collect();
        // only now: what a chunk reads must not be where it writes
        let over = chunk.reads.iter().filter(|node| last_read[*node] == i).map(|node| places[node]);
        free.extend(over.filter(|&place| place >= 0));
        steps.push(Step { chunk, reads, writes });
    }
    for (node, place) in again {
        let chunk = Chunk { reads: vec![node], writes: vec![node] };
        steps.push(Step { chunk, reads: vec![places[&node]], writes: vec![place] });
    }
    (steps, columns as usize)
}
