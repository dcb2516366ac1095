//! A long formula as a chain of short pieces, where possible of one shape.
//!
//! Folds are thousands of operations in which a dozen repeat. They are put into an order in which every part follows
//! what it needs, and cut where the fewest results are handed on, which is between one part and the next. Pieces whose
//! texts are equal but for their constants and uniforms then share a function.

use std::collections::HashSet;
use std::hash::{Hash, Hasher};

use rustc_hash::FxHasher;

use super::c_chunks::carried;
use crate::ir::{Binary, Expr, Graph, Node, R0, Unary, UnaryFunction};

/// Whether a node calls a function of the mathematical library.
pub(super) fn is_call(graph: &Graph, node: Node) -> bool {
    matches!(graph.expr(node), Expr::Unary(Unary::Call(_), _) | Expr::Binary(Binary::Call(_), ..))
}

/// A cut is sought within this number of operations. Where parts have few shapes, long chunks need fewer columns; where
/// they have many, as the links of a sweep do whose directions differ in their signs, short chunks are more often equal.
const WINDOWS: [usize; 4] = [32, 12, 6, 4];

/// Operations of all chunks that differ, up to which longer chunks are taken: gcc -O3 needs about a millisecond for each.
const SHORT: usize = 700;

/// Operations of a chunk, at least.
const LEAST: usize = 4;

/// A result that is read so many operations later, or more, waits in a column wherever the cuts are.
const FAR: usize = 256;

/// Up to this number of operations on coordinates and constants, a result is computed again wherever it is read: this
/// takes no longer than to keep it, and parts that share it by chance keep one text.
const CHEAP: usize = 2;

/// Some consecutive operations.
pub(super) struct Chunk {
    /// Results of earlier chunks.
    pub reads: Vec<Node>,
    /// Results that later chunks read, and outputs.
    pub writes: Vec<Node>,
}

/// The chunks of what the outputs depend on, in their order.
pub(super) fn chunks(graph: &Graph, outputs: &[Node]) -> Vec<Chunk> {
    let formula = Formula::new(graph, outputs);
    let mut chunks = Vec::new();
    let mut start = 0;
    let mut found = Vec::new();
    let mut least = usize::MAX;
    for window in WINDOWS {
        let (cuts, different) = formula.cuts(window);
        if different < least {
            (found, least) = (cuts, different);
        }
        if least <= SHORT {
            break;
        }
    }
    for end in found {
        chunks.push(formula.chunk(start, end));
        start = end;
    }
    chunks
}

struct Formula<'a> {
    graph: &'a Graph,
    is_output: Vec<bool>,
    /// Operations that are computed once.
    order: Vec<Node>,
    /// For each node its place in the order.
    place: Vec<Option<usize>>,
    /// For each node the place of its last reader.
    last_read: Vec<usize>,
}

impl<'a> Formula<'a> {
    fn new(graph: &'a Graph, outputs: &[Node]) -> Self {
        let mut is_output = vec![false; graph.len()];
        outputs.iter().for_each(|output| is_output[output.index()] = true);
        let cheap = cheap(graph);
        let mut order = ordered(graph, outputs);
        order.retain(|node| is_output[node.index()] || !cheap[node.index()]);
        let mut place = vec![None; graph.len()];
        for (i, node) in order.iter().enumerate() {
            place[node.index()] = Some(i);
        }
        let mut formula = Self { graph, is_output, order, place, last_read: Vec::new() };
        let mut last_read = vec![0; graph.len()];
        for (i, &node) in formula.order.iter().enumerate() {
            formula.operands(node).for_each(|operand| last_read[operand.index()] = i);
        }
        formula.last_read = last_read;
        formula
    }

    /// The nodes from which a node is computed, without those that are computed again wherever they are read.
    fn operands(&self, node: Node) -> impl Iterator<Item = Node> {
        self.graph.expr(node).operands().filter(|operand| self.place[operand.index()].is_some())
    }

    /// The ends of the chunks: the longest that has been seen before, or else where the fewest results are handed on.
    /// What joins two parts is a chunk of its own: with others in many orders, it would be compiled as often. So are calls
    /// of the mathematical library, whose loops are not vectorised. The second result is the number of operations in chunks
    /// that differ.
    fn cuts(&self, window: usize) -> (Vec<usize>, usize) {
        let carried = carried(&self.order, &self.last_read, FAR);
        let (mut cuts, mut start, mut different) = (Vec::new(), 0, 0);
        let mut seen: HashSet<u64> = HashSet::new();
        while start < self.order.len() {
            let alone = self.joined_end(start).or_else(|| self.called_end(start));
            let end = alone.unwrap_or_else(|| {
                let most = (start + window).min(self.order.len());
                let is_alone = |&i: &usize| self.joint(i).is_some() || is_call(self.graph, self.order[i]);
                let last = (start..most).find(is_alone).unwrap_or(most);
                let least = (start + LEAST).min(last);
                let patterns = self.patterns(start, last);
                let known = (least..=last).rev().find(|&end| seen.contains(&patterns[end - start - 1]));
                let end = known.or((least..=last).min_by_key(|&end| carried[end])).unwrap_or(last);
                if seen.insert(patterns[end - start - 1]) {
                    different += end - start;
                }
                end
            });
            cuts.push(end);
            start = end;
        }
        (cuts, different)
    }

    /// A hash of what each chunk computes that begins at `start` and ends behind it, up to `last`: of its operations but
    /// not of its constants and uniforms.
    fn patterns(&self, start: usize, last: usize) -> Vec<u64> {
        let mut hasher = FxHasher::default();
        let mut reads = Vec::new();
        let mut found = Vec::new();
        for end in start + 1..=last {
            self.pattern(self.order[end - 1], start, &mut reads, &mut hasher);
            let mut whole = hasher.clone();
            for (i, node) in self.order[start..end].iter().enumerate() {
                if self.last_read[node.index()] >= end || self.is_output[node.index()] {
                    i.hash(&mut whole);
                }
            }
            found.push(whole.finish());
        }
        found
    }

    /// Hashes an operation of a chunk, with its operands as far as they are computed again.
    fn pattern(&self, node: Node, start: usize, reads: &mut Vec<Node>, hasher: &mut FxHasher) {
        let expr = self.graph.expr(node);
        match expr {
            Expr::Constant(_) | Expr::Uniform(_) => (),
            Expr::Coordinate(_) | Expr::Parameter(_) => expr.hash(hasher),
            Expr::Unary(op, _) => op.hash(hasher),
            Expr::Binary(op, ..) => op.hash(hasher),
            Expr::Lookup(lookup, _) => lookup.hash(hasher),
        }
        for operand in expr.operands() {
            match self.place[operand.index()] {
                Some(place) if place >= start => (0, place - start).hash(hasher),
                Some(_) => {
                    let known = reads.iter().position(|&read| read == operand).unwrap_or_else(|| {
                        reads.push(operand);
                        reads.len() - 1
                    });
                    (1, known).hash(hasher);
                }
                None => {
                    2.hash(hasher);
                    self.pattern(operand, start, reads, hasher);
                }
            }
        }
    }

    /// Where a junction ends that begins at a place: a value, and weights of R₀.
    fn joined_end(&self, start: usize) -> Option<usize> {
        let first = self.joint(start)?;
        (start..self.order.len()).find(|&i| self.joint(i) != Some(first)).or(Some(self.order.len()))
    }

    /// Where a call ends that begins at a place: one function, or the sine and the cosine of one argument.
    fn called_end(&self, start: usize) -> Option<usize> {
        let first = self.order[start];
        if !is_call(self.graph, first) {
            return None;
        }
        let is_both = self.order.get(start + 1).is_some_and(|&next| {
            let together: Vec<Node> = companions(self.graph, first).collect();
            together.contains(&first) && together.contains(&next)
        });
        Some(start + 1 + usize::from(is_both))
    }

    /// The operands of R₀ or of a choice between two results, and which of these it is, if there is one at a place.
    fn joint(&self, place: usize) -> Option<(Node, Node, Binary)> {
        let Expr::Binary(op, u, v) = self.graph.expr(self.order[place]) else { return None };
        match op {
            Binary::And | Binary::AndWeight => Some((u.min(v), u.max(v), Binary::And)),
            Binary::Or | Binary::OrWeight => Some((u.min(v), u.max(v), Binary::Or)),
            Binary::Min | Binary::Max | Binary::PlainMin | Binary::PlainMax => {
                let is_result = |node: Node| self.place[node.index()].is_some();
                (is_result(u) && is_result(v)).then_some((u, v, op))
            }
            _ => None,
        }
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
        let is_needed = |node: &&Node| self.last_read[node.index()] >= end || self.is_output[node.index()];
        Chunk { reads, writes: self.order[start..end].iter().filter(is_needed).copied().collect() }
    }
}

/// What the outputs depend on, each node after its operands. The first output comes as early as it can, deeper
/// operands before others: one part of a fold then follows the other. The rest remains in the graph's order, which
/// goes through the parts of a gradient one by one.
fn ordered(graph: &Graph, outputs: &[Node]) -> Vec<Node> {
    let used = graph.reachable(outputs);
    let mut depth = vec![0usize; graph.len()];
    for (node, expr) in graph.nodes() {
        depth[node.index()] = expr.operands().map(|operand| depth[operand.index()] + 1).max().unwrap_or(0);
    }
    let mut order = Vec::new();
    let mut done = vec![false; graph.len()];
    let rest = graph.nodes().map(|(node, _)| node).filter(|node| used[node.index()]);
    for wanted in outputs.first().copied().into_iter().chain(rest) {
        let mut stack = vec![wanted];
        while let Some(&node) = stack.last() {
            let mut missing: Vec<Node> =
                graph.expr(node).operands().filter(|operand| !done[operand.index()]).collect();
            missing.sort_by_key(|operand| depth[operand.index()]);
            if missing.is_empty() {
                stack.pop();
                for made in std::iter::once(node).chain(companions(graph, node)) {
                    if used[made.index()] && !std::mem::replace(&mut done[made.index()], true) {
                        order.push(made);
                    }
                }
            }
            stack.extend(missing);
        }
    }
    order
}

/// Nodes of the same operands that are computed with a node in one go: weights of R₀, and sine and cosine.
pub(super) fn companions(graph: &Graph, node: Node) -> impl Iterator<Item = Node> {
    let found = match graph.expr(node) {
        Expr::Binary(op, u, v) => match op.r0() {
            Some(R0::And | R0::AndWeight) => joined(u, v, [Binary::And, Binary::AndWeight]),
            Some(R0::Or | R0::OrWeight) => joined(u, v, [Binary::Or, Binary::OrWeight]),
            None => Vec::new(),
        },
        Expr::Unary(Unary::Call(UnaryFunction::Sin | UnaryFunction::Cos), a) => {
            [UnaryFunction::Sin, UnaryFunction::Cos].map(|wave| Expr::Unary(Unary::Call(wave), a)).to_vec()
        }
        _ => Vec::new(),
    };
    found.into_iter().filter_map(|expr| graph.find(expr))
}

/// The value of R₀ and both weights.
fn joined(u: Node, v: Node, [value, weight]: [Binary; 2]) -> Vec<Expr> {
    vec![Expr::Binary(value, u, v), Expr::Binary(weight, u, v), Expr::Binary(weight, v, u)]
}

/// Which nodes are computed again wherever they are read.
pub(super) fn cheap(graph: &Graph) -> Vec<bool> {
    let mut cost = vec![usize::MAX; graph.len()];
    for (node, expr) in graph.nodes() {
        cost[node.index()] = match expr {
            Expr::Constant(_) | Expr::Coordinate(_) | Expr::Parameter(_) | Expr::Uniform(_) => 0,
            Expr::Unary(Unary::Neg, a) => cost[a.index()].saturating_add(1),
            Expr::Binary(Binary::Mul, a, b) if a == b => cost[a.index()].saturating_add(1),
            Expr::Binary(Binary::Add | Binary::Sub | Binary::Mul, a, b) => {
                cost[a.index()].saturating_add(cost[b.index()]).saturating_add(1)
            }
            Expr::Unary(..) | Expr::Binary(..) | Expr::Lookup(..) => usize::MAX,
        };
    }
    cost.into_iter().map(|cost| cost <= CHEAP).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;

    /// Σ √(x − i), from the right if it is asked for.
    fn sum(count: usize, from_right: bool) -> (Graph, Node) {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let part = |graph: &mut Graph, i: usize| {
            let number = graph.constant(i as f64);
            let difference = graph.binary(Binary::Sub, x, number);
            graph.unary(Unary::Sqrt, difference)
        };
        let parts: Vec<Node> = (0..count).map(|i| part(&mut graph, i)).collect();
        let all = parts.into_iter().reduce(|all, part| {
            let [a, b] = if from_right { [part, all] } else { [all, part] };
            graph.binary(Binary::Add, a, b)
        });
        (graph, all.unwrap())
    }

    #[test]
    fn a_sum_hands_on_one_number() {
        for from_right in [false, true] {
            let (graph, root) = sum(100, from_right);
            let chunks = chunks(&graph, &[root]);
            assert!(chunks.len() > 40, "{}", chunks.len());
            for chunk in &chunks {
                assert!(
                    chunk.reads.len() <= 1 && chunk.writes.len() == 1,
                    "{:?} {:?}",
                    chunk.reads,
                    chunk.writes
                );
            }
        }
    }

    #[test]
    fn every_result_is_written_before_it_is_read() {
        let (mut graph, root) = sum(100, false);
        let mut outputs = vec![root];
        outputs.extend(crate::ir::gradient(&mut graph, root));
        let mut written = std::collections::HashSet::new();
        for chunk in chunks(&graph, &outputs) {
            assert!(chunk.reads.iter().all(|node| written.contains(node)));
            assert!(chunk.writes.into_iter().all(|node| written.insert(node)));
        }
        assert!(outputs.iter().all(|output| written.contains(output)));
    }
}
