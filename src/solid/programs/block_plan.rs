//! How a graph is evaluated over a block of points: the steps, their order, and the columns of their results.
//!
//! R₀ is a step of its own, a *junction*; in solids of many leaves so are min and max, and sums, products
//! and quotients of what junctions give. What is left falls apart into pieces of plain arithmetic, each of which is
//! compiled into one program. Where many pieces have one shape and differ in constants and uniforms alone, they
//! share a program: ten thousand balls are compiled as one.
//!
//! The *stage* of a node is how many junctions lie below it, counted along the path with the most changes
//! from junction to arithmetic; all arithmetic of one stage is one program.

use rustc_hash::FxHashMap;
use std::ops::Range;

use super::columns::ColumnPlace;
use crate::ir::{Binary, Expr, Form, Forms, Graph, Node, R0, Scalar, Unary};

/// Up to this many pieces one program computes them all: it shares what they have in common, such as x² + y².
const FEW_PIECES: usize = 16;

/// From this number of pieces of one shape on, a shared program is worth its call.
const SAME_SHAPE: usize = 4;

#[derive(Debug, Clone, PartialEq)]
pub enum BlockStep<P = ColumnPlace> {
    Arithmetic {
        program: usize,
        /// Their place among the plan's numbers.
        parameters: Range<usize>,
        reads: Vec<P>,
        writes: Vec<P>,
    },
    Junction {
        op: Operation,
        /// How R₀ is evaluated.
        form: Form,
        /// An operation on one number has its operand here twice.
        operands: [P; 2],
        value: P,
        /// Derivatives by the operands, where they are asked for.
        weights: Option<[P; 2]>,
    },
    Copy {
        from: P,
        to: P,
    },
}

/// What a junction does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Operation {
    Binary(Binary),
    Negate,
}

/// A piece of arithmetic that is to be compiled.
#[derive(Debug, Clone)]
pub struct Piece {
    /// A graph of its own with parameters; `None` for a part of the planned graph.
    pub shape: Option<Graph>,
    pub parameters: usize,
    pub inputs: Vec<Node>,
    pub outputs: Vec<Node>,
}

/// How a graph is evaluated.
#[derive(Debug, Clone)]
pub struct BlockPlan {
    pub pieces: Vec<Piece>,
    pub steps: Vec<BlockStep>,
    /// Columns that must be kept at a time.
    pub columns: usize,
    /// The parameters of all steps.
    pub numbers: Vec<Scalar>,
}

impl BlockPlan {
    /// A plan; `None` where it would not pay, because there is no R₀ and there are few junctions of another
    /// kind.
    pub fn new(graph: &Graph, outputs: &[Node], forms: &Forms) -> Option<Self> {
        let used = graph.reachable(outputs);
        let count = |is: fn(Binary) -> bool| {
            let binary = |(node, expr): (Node, Expr)| match expr {
                Expr::Binary(op, ..) => used[node.index()] && is(op),
                _ => false,
            };
            graph.nodes().filter(|&n| binary(n)).count()
        };
        let many = count(|op| is_r0(op) || is_choice(op)) > FEW_PIECES;
        if !many && count(is_r0) == 0 {
            return None;
        }
        let planned = PlannedGraph::new(graph, outputs, &used, many);
        let mut planner =
            Planner { planned, forms, pieces: Vec::new(), numbers: Vec::new(), steps: Vec::new() };
        planner.schedule(outputs);
        let Planner { pieces, numbers, steps, .. } = planner;
        let (steps, columns) = allocate(steps, outputs);
        Some(Self { pieces, steps, columns, numbers })
    }
}

/// Whether a node is a step of its own; `is_junction` says it of the operands.
fn is_step(graph: &Graph, expr: Expr, many: bool, is_junction: &[bool]) -> bool {
    match expr {
        Expr::Binary(op, ..) if is_r0(op) => true,
        _ if !many => false,
        // a leaf that is cut off at a constant remains one leaf
        Expr::Binary(op, a, b) if is_choice(op) || matches!(op, Binary::MinWeight | Binary::MaxWeight) => {
            let is_number = |node| matches!(graph.expr(node), Expr::Constant(_) | Expr::Uniform(_));
            !is_number(a) && !is_number(b)
        }
        Expr::Binary(Binary::Add | Binary::Sub | Binary::Mul | Binary::Div | Binary::DivOrZero, a, b) => {
            is_junction[a.index()] || is_junction[b.index()]
        }
        Expr::Unary(Unary::Neg, a) => is_junction[a.index()],
        _ => false,
    }
}

fn is_r0(op: Binary) -> bool {
    op.r0().is_some()
}

fn is_choice(op: Binary) -> bool {
    matches!(op, Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax)
}

/// A node, and the numbers of its cone that are parameters of its shape.
type Member = (Node, Vec<Scalar>);

/// The graph taken apart.
struct PlannedGraph<'g> {
    graph: &'g Graph,
    used: Vec<bool>,
    junction: Vec<bool>,
    stage: Vec<u32>,
    /// Arithmetic whose result another part needs.
    cut: Vec<bool>,
    /// Cut nodes of each stage that one program computes.
    together: Vec<Vec<Node>>,
    /// Cut nodes that share a program with others: its number, and their parameters.
    shared: FxHashMap<Node, (usize, Vec<Scalar>)>,
    shapes: Vec<Graph>,
}

impl<'g> PlannedGraph<'g> {
    fn new(graph: &'g Graph, outputs: &[Node], used: &[bool], many: bool) -> Self {
        let nodes = graph.len();
        let (mut junction, mut stage, mut cut) = (vec![false; nodes], vec![0; nodes], vec![false; nodes]);
        for (node, expr) in graph.nodes().filter(|(node, _)| used[node.index()]) {
            let is_junction = is_step(graph, expr, many, &junction);
            junction[node.index()] = is_junction;
            for operand in expr.operands() {
                let below = stage[operand.index()] + u32::from(!is_junction && junction[operand.index()]);
                stage[node.index()] = below.max(stage[node.index()]);
                cut[operand.index()] |= is_junction && !junction[operand.index()];
            }
        }
        for output in outputs {
            cut[output.index()] |= !junction[output.index()];
        }
        let stages = stage.iter().max().map_or(0, |&last| last as usize + 1);
        let mut together: Vec<Vec<Node>> = vec![Vec::new(); stages];
        for (node, _) in graph.nodes().filter(|(node, _)| cut[node.index()]) {
            together[stage[node.index()] as usize].push(node);
        }
        let (shapes, shared) = (Vec::new(), FxHashMap::default());
        let used = used.to_vec();
        let mut planned = Self { graph, used, junction, stage, cut, together, shared, shapes };
        if planned.together[0].len() > FEW_PIECES {
            planned.share();
        }
        planned
    }

    /// Gives the cut nodes at the bottom that have one shape a common program.
    fn share(&mut self) {
        let mut groups: FxHashMap<Vec<Expr>, usize> = FxHashMap::default();
        let mut members: Vec<(Graph, Vec<Member>)> = Vec::new();
        for &node in &self.together[0] {
            let (shape, _, numbers) = self.graph.parametrised_with_uniforms(node);
            let number = *groups.entry(shape.exprs().to_vec()).or_insert_with(|| {
                members.push((shape, Vec::new()));
                members.len() - 1
            });
            members[number].1.push((node, numbers));
        }
        for (shape, leaves) in members.into_iter().filter(|(_, leaves)| leaves.len() >= SAME_SHAPE) {
            let number = self.shapes.len();
            self.shapes.push(shape);
            self.shared.extend(leaves.into_iter().map(|(node, numbers)| (node, (number, numbers))));
        }
        self.together[0].retain(|node| !self.shared.contains_key(node));
    }

    /// What the program of one stage reads: results of junctions, and cut nodes of earlier stages.
    fn inputs(&self, stage: usize) -> Vec<Node> {
        let is_given = |node: Node| {
            let i = node.index();
            self.junction[i] || (self.cut[i] && (self.stage[i] as usize) < stage && !self.is_free(node))
        };
        let mut seen = vec![false; self.graph.len()];
        let mut stack = self.together[stage].clone();
        let mut inputs = Vec::new();
        while let Some(node) = stack.pop() {
            if std::mem::replace(&mut seen[node.index()], true) {
                continue;
            }
            if is_given(node) {
                inputs.push(node);
            } else {
                stack.extend(self.graph.expr(node).operands());
            }
        }
        inputs.sort_unstable();
        inputs
    }

    /// Coordinates, constants and what depends on time alone need no column to be read from.
    fn is_free(&self, node: Node) -> bool {
        matches!(self.graph.expr(node), Expr::Coordinate(_) | Expr::Constant(_) | Expr::Uniform(_))
    }
}

struct Planner<'g> {
    planned: PlannedGraph<'g>,
    forms: &'g Forms,
    pieces: Vec<Piece>,
    numbers: Vec<Scalar>,
    steps: Vec<BlockStep<Slot>>,
}

/// A result while columns are not yet given: the node that it is, or an unused one.
type Slot = Option<Node>;

impl Planner<'_> {
    /// Every part comes after what it needs, and leaves as late as possible: few columns are then in use at a
    /// time.
    fn schedule(&mut self, outputs: &[Node]) {
        for (number, shape) in self.planned.shapes.clone().into_iter().enumerate() {
            // the root of a cone is its last node
            let root = shape.node(shape.len() - 1);
            let parameters = shape.nodes().filter(|(_, expr)| matches!(expr, Expr::Parameter(_))).count();
            debug_assert_eq!(number, self.pieces.len());
            let (inputs, outputs) = (Vec::new(), vec![root]);
            self.pieces.push(Piece { shape: Some(shape), parameters, inputs, outputs });
        }
        let mut done = vec![false; self.planned.graph.len()];
        let mut stack: Vec<Node> = outputs.iter().rev().copied().collect();
        while let Some(&node) = stack.last() {
            if done[node.index()] {
                stack.pop();
                continue;
            }
            let missing: Vec<Node> =
                self.needs(node).into_iter().filter(|needed| !done[needed.index()]).collect();
            if missing.is_empty() {
                stack.pop();
                self.emit(node).into_iter().for_each(|made| done[made.index()] = true);
            } else {
                stack.extend(missing.into_iter().rev());
            }
        }
    }

    fn needs(&self, node: Node) -> Vec<Node> {
        if self.planned.junction[node.index()] {
            return self.planned.graph.expr(node).operands().collect();
        }
        if self.planned.shared.contains_key(&node) {
            return Vec::new();
        }
        self.planned.inputs(self.planned.stage[node.index()] as usize)
    }

    /// The step that computes a node, and all that it computes.
    fn emit(&mut self, node: Node) -> Vec<Node> {
        if self.planned.junction[node.index()] {
            return match self.planned.graph.expr(node) {
                Expr::Binary(op, u, v) => self.junction(node, op, u, v),
                Expr::Unary(Unary::Neg, a) => self.push_junction(Operation::Negate, [a; 2], node),
                expr => unreachable!("{expr:?} is no step of its own"),
            };
        }
        if let Some((program, numbers)) = self.planned.shared.get(&node) {
            let first = self.numbers.len();
            self.numbers.extend(numbers);
            let parameters = first..self.numbers.len();
            let (reads, writes) = (Vec::new(), vec![Some(node)]);
            self.steps.push(BlockStep::Arithmetic { program: *program, parameters, reads, writes });
            return vec![node];
        }
        let stage = self.planned.stage[node.index()] as usize;
        let (inputs, outputs) = (self.planned.inputs(stage), self.planned.together[stage].clone());
        let program = self.pieces.len();
        let slots = |nodes: &[Node]| nodes.iter().copied().map(Some).collect();
        let (reads, writes) = (slots(&inputs), slots(&outputs));
        self.steps.push(BlockStep::Arithmetic { program, parameters: 0..0, reads, writes });
        self.pieces.push(Piece { shape: None, parameters: 0, inputs, outputs: outputs.clone() });
        outputs
    }

    /// Value and both weights of R₀ share most of their work: one step computes all that are used.
    fn junction(&mut self, node: Node, op: Binary, u: Node, v: Node) -> Vec<Node> {
        let (value_op, weight_op) = match op.r0() {
            Some(R0::And | R0::AndWeight) => (Binary::And, Binary::AndWeight),
            Some(R0::Or | R0::OrWeight) => (Binary::Or, Binary::OrWeight),
            None => (op, op),
        };
        let operands = [Some(u), Some(v)];
        let graph = self.planned.graph;
        let find = |op, a, b| graph.find(Expr::Binary(op, a, b)).filter(|n| self.planned.used[n.index()]);
        let value = find(value_op, u, v);
        let (by_u, by_v) = (find(weight_op, u, v), find(weight_op, v, u));
        if value_op == weight_op || (by_u.is_none() && by_v.is_none()) {
            return self.push_junction(Operation::Binary(value_op), [u, v], node);
        }
        let made: Vec<Node> = [value, by_u, by_v].into_iter().flatten().collect();
        let weights = Some([by_u, if u == v { None } else { by_v }]);
        let op = Operation::Binary(value_op);
        let form = self.forms.of(u, v);
        self.steps.push(BlockStep::Junction { op, form, operands, value, weights });
        made
    }

    fn push_junction(&mut self, op: Operation, [u, v]: [Node; 2], node: Node) -> Vec<Node> {
        let (form, operands) = (self.forms.of(u, v), [Some(u), Some(v)]);
        self.steps.push(BlockStep::Junction { op, form, operands, value: Some(node), weights: None });
        vec![node]
    }
}

/// Gives each result a column for as long as it is needed, or a column of the caller.
fn allocate(steps: Vec<BlockStep<Slot>>, outputs: &[Node]) -> (Vec<BlockStep>, usize) {
    let mut last_use: FxHashMap<Node, usize> = FxHashMap::default();
    let mut in_three: Vec<Node> = Vec::new();
    for (i, step) in steps.iter().enumerate() {
        step.reads().into_iter().for_each(|node| _ = last_use.insert(node, i));
        if matches!(step, BlockStep::Junction { weights: Some(_), .. }) {
            in_three.extend(step.writes());
        }
    }
    let is_direct = |node: Node| {
        let once = outputs.iter().filter(|&&output| output == node).count() == 1;
        once && !last_use.contains_key(&node) && !in_three.contains(&node)
    };
    let direct: FxHashMap<Node, u32> =
        (0u32..).zip(outputs).filter(|&(_, &node)| is_direct(node)).map(|(i, &node)| (node, i)).collect();
    let kept: Vec<Node> = outputs.iter().copied().filter(|node| !direct.contains_key(node)).collect();

    let mut columns = Columns::default();
    let mut placed = Vec::with_capacity(steps.len());
    for (i, step) in steps.into_iter().enumerate() {
        let (reads, writes) = (step.reads(), step.writes());
        let mut unused = Vec::new();
        let step = step.map(|node| {
            let Some(node) = node else {
                unused.push(columns.take());
                return ColumnPlace::Own(unused[unused.len() - 1]);
            };
            direct.get(&node).map_or_else(|| ColumnPlace::Own(columns.of(node)), |&o| ColumnPlace::Output(o))
        });
        placed.push(step);
        columns.free.extend(unused);
        for node in reads.into_iter().chain(writes) {
            let over = last_use.get(&node).is_none_or(|&last| last == i);
            if over && !kept.contains(&node) {
                columns.release(node);
            }
        }
    }
    for (i, node) in (0u32..).zip(outputs).filter(|(_, node)| !direct.contains_key(node)) {
        placed
            .push(BlockStep::Copy { from: ColumnPlace::Own(columns.of(*node)), to: ColumnPlace::Output(i) });
    }
    (placed, columns.count as usize)
}

#[derive(Default)]
struct Columns {
    of: FxHashMap<Node, u32>,
    free: Vec<u32>,
    count: u32,
}

impl Columns {
    fn take(&mut self) -> u32 {
        self.free.pop().unwrap_or_else(|| {
            self.count += 1;
            self.count - 1
        })
    }

    fn of(&mut self, node: Node) -> u32 {
        if let Some(&column) = self.of.get(&node) {
            return column;
        }
        let column = self.take();
        self.of.insert(node, column);
        column
    }

    fn release(&mut self, node: Node) {
        if let Some(column) = self.of.remove(&node) {
            self.free.push(column);
        }
    }
}

impl BlockStep<Slot> {
    fn reads(&self) -> Vec<Node> {
        match self {
            Self::Arithmetic { reads, .. } => reads.iter().copied().flatten().collect(),
            Self::Junction { operands, .. } => operands.iter().copied().flatten().collect(),
            Self::Copy { from, .. } => Vec::from_iter(*from),
        }
    }

    fn writes(&self) -> Vec<Node> {
        match self {
            Self::Arithmetic { writes, .. } => writes.iter().copied().flatten().collect(),
            Self::Junction { value, weights, .. } => {
                std::iter::once(value).chain(weights.iter().flatten()).copied().flatten().collect()
            }
            Self::Copy { to, .. } => Vec::from_iter(*to),
        }
    }

    /// Reads before writes: a column is not taken for a result while an operand is still in it.
    fn map(self, mut place: impl FnMut(Slot) -> ColumnPlace) -> BlockStep {
        match self {
            Self::Arithmetic { program, parameters, reads, writes } => BlockStep::Arithmetic {
                program,
                parameters,
                reads: reads.into_iter().map(&mut place).collect(),
                writes: writes.into_iter().map(&mut place).collect(),
            },
            Self::Junction { op, form, operands, value, weights } => BlockStep::Junction {
                op,
                form,
                operands: operands.map(&mut place),
                value: place(value),
                weights: weights.map(|both| both.map(&mut place)),
            },
            Self::Copy { from, to } => BlockStep::Copy { from: place(from), to: place(to) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;

    fn ball(graph: &mut Graph, i: usize) -> Node {
        let axes = [Axis::X, Axis::Y, Axis::Z].map(|axis| graph.coordinate(axis));
        let one = graph.constant(1.0);
        axes.into_iter().enumerate().fold(one, |rest, (k, axis)| {
            let centre = graph.constant(0.05 + 0.1 * (i + k) as f64);
            let difference = graph.binary(Binary::Sub, axis, centre);
            let square = graph.binary(Binary::Mul, difference, difference);
            graph.binary(Binary::Sub, rest, square)
        })
    }

    fn union(graph: &mut Graph, parts: &[Node]) -> Node {
        match parts {
            [one] => *one,
            _ => {
                let (first, second) = parts.split_at(parts.len() / 2);
                let (first, second) = (union(graph, first), union(graph, second));
                graph.binary(Binary::Or, first, second)
            }
        }
    }

    fn places(plan: &BlockPlan) -> Vec<ColumnPlace> {
        let of = |step: &BlockStep| match step {
            BlockStep::Arithmetic { reads, writes, .. } => [&reads[..], writes].concat(),
            BlockStep::Junction { operands, value, weights, .. } => {
                [&operands[..], &[*value], &weights.map_or_else(Vec::new, |w| w.to_vec())].concat()
            }
            BlockStep::Copy { from, to } => vec![*from, *to],
        };
        plan.steps.iter().flat_map(of).collect()
    }

    #[test]
    fn a_thousand_balls_share_a_program_and_a_few_columns() {
        let mut graph = Graph::default();
        let balls: Vec<Node> = (0..1000).map(|i| ball(&mut graph, i)).collect();
        let root = union(&mut graph, &balls);
        let plan = BlockPlan::new(&graph, &[root], &Forms::default()).unwrap();
        assert_eq!(plan.pieces.len(), 1);
        assert_eq!(plan.numbers.len(), 1000 * plan.pieces[0].parameters);
        assert_eq!(plan.steps.len(), 1000 + 999);
        // a balanced tree of n leaves has log₂ n partial results
        assert!(plan.columns <= 12, "{}", plan.columns);
        assert_eq!(places(&plan).iter().filter(|p| matches!(p, ColumnPlace::Output(0))).count(), 1);
    }

    #[test]
    fn results_do_not_overwrite_what_is_still_needed() {
        let mut graph = Graph::default();
        let balls: Vec<Node> = (0..40).map(|i| ball(&mut graph, i)).collect();
        let root = union(&mut graph, &balls);
        let mut outputs = vec![root];
        outputs.extend(crate::ir::gradient(&mut graph, root));
        let plan = BlockPlan::new(&graph, &outputs, &Forms::default()).unwrap();
        for step in &plan.steps {
            if let BlockStep::Junction { operands, value, weights, .. } = step {
                let results: Vec<ColumnPlace> =
                    std::iter::once(*value).chain(weights.iter().flatten().copied()).collect();
                assert!(results.iter().all(|place| !operands.contains(place)), "{step:?}");
                assert!((1..results.len()).all(|i| !results[..i].contains(&results[i])), "{step:?}");
            }
        }
    }

    #[test]
    fn plain_arithmetic_and_small_twins_need_no_plan() {
        let mut graph = Graph::default();
        let (a, b) = (ball(&mut graph, 0), ball(&mut graph, 1));
        let (least, forms) = (graph.binary(Binary::PlainMin, a, b), Forms::default());
        assert!(
            BlockPlan::new(&graph, &[least], &forms).is_none()
                && BlockPlan::new(&graph, &[a], &forms).is_none()
        );
        let both = graph.binary(Binary::And, a, b);
        assert!(BlockPlan::new(&graph, &[both], &forms).is_some());
    }

    #[test]
    fn an_output_asked_for_twice_is_written_twice() {
        let mut graph = Graph::default();
        let (a, b) = (ball(&mut graph, 0), ball(&mut graph, 1));
        let both = graph.binary(Binary::And, a, b);
        let plan = BlockPlan::new(&graph, &[both, a, both], &Forms::default()).unwrap();
        let written = |i| places(&plan).iter().filter(|p| **p == ColumnPlace::Output(i)).count();
        assert_eq!([written(0), written(1), written(2)], [1, 1, 1]);
    }
}
