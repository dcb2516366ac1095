//! A long piece of arithmetic as a chain of short ones, where possible of one shape.
//!
//! The gradient of a union ends in sums over all its parts: thousands of operations in which a dozen repeat.
//! They are cut where the fewest results are handed on, which is between one part and the next; pieces whose
//! texts are equal but for their constants then share a function.

use crate::ir::{Expr, Graph, Node};

/// A piece with fewer operations than this stays whole.
const SHORT: usize = 100;

/// A cut is sought within this number of operations.
const WINDOW: usize = 64;

/// Operations of a chunk, at least.
const LEAST: usize = 4;

/// Some consecutive operations of a piece.
pub(super) struct Chunk {
    /// Results of earlier chunks, or inputs of the piece.
    pub reads: Vec<Node>,
    /// Results that later chunks read, and outputs of the piece.
    pub writes: Vec<Node>,
}

/// The chunks of a piece; `None` if it is short.
pub(super) fn chunks(graph: &Graph, inputs: &[Node], outputs: &[Node]) -> Option<Vec<Chunk>> {
    let piece = PieceOf::new(graph, inputs, outputs);
    if piece.order.len() < SHORT {
        return None;
    }
    let cuts = piece.cuts();
    let mut chunks = Vec::new();
    let mut start = 0;
    for end in cuts {
        chunks.push(piece.chunk(start, end));
        start = end;
    }
    Some(chunks)
}

/// How many results are carried on across each place of an order of operations, without those that wait for `far` or more of
/// them. `last_read` is for each node the place of its last reader.
pub(super) fn carried(order: &[Node], last_read: &[usize], far: usize) -> Vec<usize> {
    let mut changes = vec![0isize; order.len() + 2];
    for (i, node) in order.iter().enumerate() {
        let last = last_read[node.index()];
        if last > i && last - i < far {
            changes[i + 1] += 1;
            changes[last + 1] -= 1;
        }
    }
    let mut now = 0isize;
    changes
        .into_iter()
        .map(|change| {
            now += change;
            now.unsigned_abs()
        })
        .collect()
}

struct PieceOf<'a> {
    graph: &'a Graph,
    outputs: &'a [Node],
    /// Operations that are computed once, in the graph's order.
    order: Vec<Node>,
    /// For each node its place in the order.
    place: Vec<Option<usize>>,
    /// For each node the place of its last reader.
    last_read: Vec<usize>,
    is_input: Vec<bool>,
}

impl<'a> PieceOf<'a> {
    fn new(graph: &'a Graph, inputs: &[Node], outputs: &'a [Node]) -> Self {
        let mut is_input = vec![false; graph.len()];
        inputs.iter().for_each(|input| is_input[input.index()] = true);
        let mut used = vec![false; graph.len()];
        outputs.iter().for_each(|output| used[output.index()] = true);
        for i in (0..graph.len()).rev() {
            used[i] &= !is_input[i];
            if used[i] {
                graph.expr(graph.node(i)).operands().for_each(|operand| used[operand.index()] = true);
            }
        }
        let is_output = |node: &Node| outputs.contains(node);
        let order: Vec<Node> = (0..graph.len())
            .filter(|&i| used[i])
            .map(|i| graph.node(i))
            .filter(|node| is_output(node) || !is_repeated(graph, &is_input, *node))
            .collect();
        let (mut place, mut last_read) = (vec![None; graph.len()], vec![0; graph.len()]);
        for (i, node) in order.iter().enumerate() {
            place[node.index()] = Some(i);
        }
        let mut piece = Self { graph, outputs, order, place, last_read: Vec::new(), is_input };
        for (i, &node) in piece.order.iter().enumerate() {
            piece.operands(node).into_iter().for_each(|operand| last_read[operand.index()] = i);
        }
        piece.last_read = last_read;
        piece
    }

    /// The nodes from which a node is computed, without those that are computed again wherever they are read.
    fn operands(&self, node: Node) -> Vec<Node> {
        let mut found = Vec::new();
        for operand in self.graph.expr(node).operands() {
            if self.place[operand.index()].is_some() || self.is_input[operand.index()] {
                found.push(operand);
            }
        }
        found
    }

    /// The ends of the chunks.
    fn cuts(&self) -> Vec<usize> {
        let carried = carried(&self.order, &self.last_read, usize::MAX);
        let (mut cuts, mut start) = (Vec::new(), 0);
        while start < self.order.len() {
            let window = (start + LEAST).min(self.order.len())..=(start + WINDOW).min(self.order.len());
            let end = window.min_by_key(|&end| carried[end]).unwrap_or(self.order.len());
            cuts.push(end);
            start = end;
        }
        cuts
    }

    fn chunk(&self, start: usize, end: usize) -> Chunk {
        let mut reads: Vec<Node> = Vec::new();
        for &node in &self.order[start..end] {
            for operand in self.operands(node) {
                let is_inside = self.place[operand.index()].is_some_and(|place| place >= start);
                if !is_inside && !reads.contains(&operand) {
                    reads.push(operand);
                }
            }
        }
        let is_needed = |node: &&Node| self.last_read[node.index()] >= end || self.outputs.contains(node);
        Chunk { reads, writes: self.order[start..end].iter().filter(is_needed).copied().collect() }
    }
}

/// Whether a node is so cheap that every chunk computes it again: one operation on coordinates and constants,
/// or less.
fn is_repeated(graph: &Graph, is_input: &[bool], node: Node) -> bool {
    let is_free = |node: Node| {
        let free = matches!(
            graph.expr(node),
            Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_)
        );
        free && !is_input[node.index()]
    };
    is_free(node) || graph.expr(node).operands().all(is_free)
}
