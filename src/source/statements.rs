//! A graph as statements: one declaration for each operation, in the graph's order.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap, HashSet};

use super::language::{Function, Language};
use super::operations::{Junction, Names, Operation};
use super::{Math, SourceError};
use crate::ir::{Axis, Binary, BinaryFunction, Expr, Forms, Graph, Node, R0, Scalar, Unary, UnaryFunction};
use crate::precision::Precision;

/// How a graph is written.
#[derive(Clone, Copy)]
pub(super) struct Writer<'a> {
    pub language: &'a Language,
    pub precision: Precision,
    pub names: &'a Names<'a>,
    pub math: Math,
    /// How x, y, z and t are written.
    pub axes: [&'a str; 4],
    /// How a parameter is written, by its number.
    pub parameter: &'a dyn Fn(u32) -> String,
    /// How a uniform is written.
    pub uniform: &'a dyn Fn(u32) -> String,
    /// Where constants and uniforms are gathered, to be written as `c[0]`, `c[1]` …, and values are numbered one after the
    /// other: parts of one shape then have one text.
    pub gathered: Option<&'a RefCell<Vec<Scalar>>>,
    /// What the names of values begin with, so that two graphs may stand in one function.
    pub values: &'a str,
    pub own: Own,
}

/// Which functions of the mathematical library a file has of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Own {
    Nothing,
    /// sin and cos, which call the library for a few arguments.
    Waves,
    /// sin and cos that are NaN for these arguments: loops over columns mend them, see `c_calls`.
    FastWaves,
    /// sin, cos, tan and powers of negative numbers: those of shaders are inaccurate or undefined.
    Shaders,
}

/// A graph as statements.
#[derive(Debug, Clone, Default)]
pub(super) struct Statements {
    pub lines: Vec<String>,
    /// How the outputs are written.
    pub outputs: Vec<String>,
    /// The functions of the file that the statements call.
    pub operations: BTreeSet<Operation>,
    /// The functions of the mathematical library that they call.
    pub functions: BTreeSet<Function>,
}

/// A part of a graph: nodes that are known already, with how they are written, and the outputs.
pub(super) struct Part<'a> {
    pub graph: &'a Graph,
    pub inputs: &'a [(Node, String)],
    pub outputs: &'a [Node],
    pub forms: &'a Forms,
}

impl Writer<'_> {
    /// The statements of a part of a graph.
    ///
    /// # Errors
    /// If the language cannot write one of its numbers.
    pub fn statements(&self, part: &Part<'_>) -> Result<Statements, SourceError> {
        let texts = part.inputs.iter().cloned().collect();
        let mut state =
            State { writer: self, part, made: Statements::default(), texts, joints: HashMap::new() };
        let needed = state.needed();
        let weighted = weighted_pairs(part.graph, &needed);
        for &node in &needed {
            let text = state.node(node, &weighted)?;
            state.texts.insert(node, text);
        }
        state.made.outputs = part.outputs.iter().map(|output| state.texts[output].clone()).collect();
        Ok(state.made)
    }
}

/// Keeps a number, and says how it is written.
fn gather(gathered: &RefCell<Vec<Scalar>>, number: Scalar) -> String {
    let mut gathered = gathered.borrow_mut();
    gathered.push(number);
    format!("c[{}]", gathered.len() - 1)
}

/// The pairs of operands whose weights are asked for, the lesser node first.
fn weighted_pairs(graph: &Graph, needed: &[Node]) -> BTreeSet<(Node, Node, Junction)> {
    let weight = |&node: &Node| match graph.expr(node) {
        Expr::Binary(op @ (Binary::AndWeight | Binary::OrWeight), u, v) => {
            op.r0().map(|r0| (u.min(v), u.max(v), Junction::from(r0)))
        }
        _ => None,
    };
    needed.iter().filter_map(weight).collect()
}

struct State<'a> {
    writer: &'a Writer<'a>,
    part: &'a Part<'a>,
    made: Statements,
    texts: HashMap<Node, String>,
    /// Names of values with their weights that are declared already, by their operands.
    joints: HashMap<(Node, Node, Junction), String>,
}

impl State<'_> {
    /// What the outputs depend on, down to the inputs and without them, in the graph's order.
    fn needed(&self) -> Vec<Node> {
        let mut seen: HashSet<Node> = HashSet::new();
        let mut found: Vec<Node> = Vec::new();
        let mut stack: Vec<Node> = self.part.outputs.to_vec();
        while let Some(node) = stack.pop() {
            if !self.texts.contains_key(&node) && seen.insert(node) {
                found.push(node);
                stack.extend(self.part.graph.expr(node).operands());
            }
        }
        found.sort_unstable();
        found
    }

    /// How a node is written: a number, an argument, or the name of a new constant.
    fn node(
        &mut self,
        node: Node,
        weighted: &BTreeSet<(Node, Node, Junction)>,
    ) -> Result<String, SourceError> {
        let writer = self.writer;
        let value = match self.part.graph.expr(node) {
            Expr::Constant(bits) => return self.given(f64::from_bits(bits)),
            Expr::Coordinate(Axis::X) => return Ok(writer.axes[0].into()),
            Expr::Coordinate(Axis::Y) => return Ok(writer.axes[1].into()),
            Expr::Coordinate(Axis::Z) => return Ok(writer.axes[2].into()),
            Expr::Coordinate(Axis::T) => return Ok(writer.axes[3].into()),
            Expr::Parameter(i) => return Ok((writer.parameter)(i)),
            Expr::Uniform(i) => return Ok(self.uniform(i)),
            Expr::Unary(op, a) => self.unary(op, &self.texts[&a].clone())?,
            Expr::Binary(op, u, v) => {
                if let Some(r0) = op.r0() {
                    let pair = (u.min(v), u.max(v), Junction::from(r0));
                    let weights = weighted.contains(&pair);
                    return Ok(self.join(op, (u, v), weights, node));
                }
                let (u, v) = (self.texts[&u].clone(), self.texts[&v].clone());
                self.binary(op, &u, &v)?
            }
            Expr::Lookup(..) => return Err(SourceError::Table),
        };
        let name = self.name(node);
        self.declare(writer.language.number(writer.precision), &name, &value);
        Ok(name)
    }

    /// The name of the value of a node.
    fn name(&self, node: Node) -> String {
        let number = if self.writer.gathered.is_some() { self.made.lines.len() } else { node.index() };
        format!("{}{number}", self.writer.values)
    }

    fn declare(&mut self, kind: &str, name: &str, value: &str) {
        self.made.lines.push((self.writer.language.declare)(kind, name, value));
    }

    /// A constant of the graph.
    fn given(&self, value: f64) -> Result<String, SourceError> {
        let Some(gathered) = self.writer.gathered else { return self.constant(value) };
        Ok(gather(gathered, Scalar::Constant(value)))
    }

    fn uniform(&self, index: u32) -> String {
        let Some(gathered) = self.writer.gathered else { return (self.writer.uniform)(index) };
        gather(gathered, Scalar::Uniform { index, negated: false })
    }

    /// A constant of an operation.
    fn constant(&self, value: f64) -> Result<String, SourceError> {
        let written = self.writer.language.constant(value, self.writer.precision);
        written.ok_or(SourceError::NumberOutOfRange(value))
    }

    fn operation(&mut self, operation: Operation, operands: &str) -> String {
        self.made.operations.insert(operation);
        let Writer { names, language, precision, .. } = *self.writer;
        format!("{}({operands})", names.operation(operation, language, precision))
    }

    fn pick(&self, condition: &str, yes: &str, no: &str) -> String {
        let Writer { names, language, precision, .. } = *self.writer;
        format!("{}({condition}, {yes}, {no})", names.pick(language, precision))
    }

    /// ∧, ∨ or a weight. A pair of operands whose weights are asked for is computed once, with its value.
    fn join(&mut self, op: Binary, (u, v): (Node, Node), weights: bool, node: Node) -> String {
        let Some(r0) = op.r0() else { unreachable!("{op:?} joins nothing") };
        let (junction, style) = (r0.into(), self.part.forms.of(u, v).into());
        let Writer { names, language, precision, .. } = *self.writer;
        let (first, second) = (u.min(v), u.max(v));
        if !weights {
            let operands = format!("{}, {}", self.texts[&u], self.texts[&v]);
            let value = self.operation(Operation::Join(junction, style), &operands);
            let name = self.name(node);
            self.declare(language.number(precision), &name, &value);
            return name;
        }
        let joint = match self.joints.get(&(first, second, junction)) {
            Some(joint) => joint.clone(),
            None => {
                let kind = if junction == Junction::And { "and" } else { "or" };
                let numbers = match self.writer.gathered {
                    Some(_) => self.made.lines.len().to_string(),
                    None => format!("{}_{}", first.index(), second.index()),
                };
                let joint = format!("{}_{kind}{numbers}", self.writer.values);
                let operands = format!("{}, {}", self.texts[&first], self.texts[&second]);
                let value = self.operation(Operation::Weighted(junction, style), &operands);
                self.declare(&names.joint(language, precision), &joint, &value);
                self.joints.insert((first, second, junction), joint.clone());
                joint
            }
        };
        let field = match r0 {
            R0::AndWeight | R0::OrWeight if u == first => "by_u",
            R0::AndWeight | R0::OrWeight => "by_v",
            R0::And | R0::Or => "value",
        };
        format!("{joint}.{field}")
    }

    fn unary(&mut self, op: Unary, a: &str) -> Result<String, SourceError> {
        let Writer { language, precision, own, .. } = *self.writer;
        let of = |both| format!("{}({a})", super::language::pair(both, precision));
        Ok(match op {
            Unary::Neg => format!("-{a}"),
            Unary::Abs => of(language.magnitude),
            Unary::Sqrt => of(language.root),
            Unary::Sign => {
                let (zero, one, minus) = (self.constant(0.0)?, self.constant(1.0)?, self.constant(-1.0)?);
                let other = self.pick(&format!("{a} < {zero}"), &minus, a);
                self.pick(&format!("{a} > {zero}"), &one, &other)
            }
            Unary::Floor => of(language.floor),
            Unary::Round => of(language.round),
            Unary::Call(UnaryFunction::Sin) => self.wave(UnaryFunction::Sin, a),
            Unary::Call(UnaryFunction::Cos) => self.wave(UnaryFunction::Cos, a),
            Unary::Call(UnaryFunction::Tan) if own == Own::Shaders => self.operation(Operation::Tan, a),
            Unary::Call(function) => self.library(Function::Unary(function), &[a]),
        })
    }

    /// The call of a function of the mathematical library.
    fn library(&mut self, function: Function, operands: &[&str]) -> String {
        let Writer { language, precision, math, .. } = *self.writer;
        self.made.functions.insert(function);
        (language.function)(function, precision, math, operands)
    }

    /// The sine or the cosine.
    fn wave(&mut self, function: UnaryFunction, a: &str) -> String {
        let is_sine = function == UnaryFunction::Sin;
        let fast = if is_sine { Operation::FastSin } else { Operation::FastCos };
        match self.writer.own {
            Own::Nothing => self.library(Function::Unary(function), &[a]),
            Own::Shaders => self.operation(if is_sine { Operation::Sin } else { Operation::Cos }, a),
            Own::FastWaves => self.operation(fast, a),
            Own::Waves => {
                let name = format!("{}_fast{}", self.writer.values, self.made.lines.len());
                let value = self.operation(fast, a);
                self.declare(self.writer.language.number(self.writer.precision), &name, &value);
                let other = self.library(Function::Unary(function), &[a]);
                self.pick(&format!("{name} == {name}"), &name, &other)
            }
        }
    }

    fn binary(&mut self, op: Binary, a: &str, b: &str) -> Result<String, SourceError> {
        let Writer { language, own, .. } = *self.writer;
        Ok(match op {
            Binary::Add => format!("{a} + {b}"),
            Binary::Sub => format!("{a} - {b}"),
            Binary::Mul => format!("{a} * {b}"),
            Binary::Div => format!("{a} / {b}"),
            Binary::DivOrZero => {
                let zero = self.constant(0.0)?;
                self.pick(&format!("{b} == {zero}"), &zero, &format!("{a} / {b}"))
            }
            Binary::MulOrZero => {
                let zero = self.constant(0.0)?;
                self.pick(&format!("{b} == {zero}"), &zero, &format!("{a} * {b}"))
            }
            Binary::Min | Binary::Max => {
                let sign = if op == Binary::Min { '<' } else { '>' };
                // one choice: of a chain of nested ones clang 14 makes twice the work with each link
                self.pick(&format!("({a} {sign} {b}) {} ({a} != {a})", language.either), a, b)
            }
            Binary::PlainMin => self.pick(&format!("{a} < {b}"), a, b),
            Binary::PlainMax => self.pick(&format!("{b} < {a}"), a, b),
            Binary::MinWeight | Binary::MaxWeight => {
                let sign = if op == Binary::MinWeight { '<' } else { '>' };
                let (zero, half, one) = (self.constant(0.0)?, self.constant(0.5)?, self.constant(1.0)?);
                let other = self.pick(&format!("{a} == {b}"), &half, &zero);
                self.pick(&format!("{a} {sign} {b}"), &one, &other)
            }
            Binary::Call(BinaryFunction::Pow) if own == Own::Shaders => {
                self.operation(Operation::Power, &format!("{a}, {b}"))
            }
            Binary::Call(function) => self.library(Function::Binary(function), &[a, b]),
            Binary::And | Binary::Or | Binary::AndWeight | Binary::OrWeight => {
                unreachable!("{op:?} is written by `join`")
            }
        })
    }
}
