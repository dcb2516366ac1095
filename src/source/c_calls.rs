//! A formula with functions of the mathematical library in stages: compilers vectorise no loop that calls one.
//!
//! Arithmetic, then what calls functions of its results, then arithmetic on these: each stage is a loop over the points of a
//! block, see `c_folds`. Sines and cosines are vectorised as well, see `c_waves`; a second loop calls the library for the
//! few arguments that these leave to it.

use super::c_links::{Chunk, cheap, companions, is_call};
use crate::ir::{Expr, Graph, Node, Unary, UnaryFunction};

/// Whether a node is a sine or a cosine.
fn is_wave(graph: &Graph, node: Node) -> bool {
    matches!(graph.expr(node), Expr::Unary(Unary::Call(UnaryFunction::Sin | UnaryFunction::Cos), _))
}

/// Whether a chunk is nothing but a sine, a cosine or both.
pub(super) fn is_of_waves(graph: &Graph, chunk: &Chunk) -> bool {
    chunk.writes.iter().all(|&node| is_wave(graph, node) && !chunk.reads.contains(&node))
}

/// The stages of what the outputs depend on, in their order; `None` if no function is called.
pub(super) fn stages(graph: &Graph, outputs: &[Node]) -> Option<Vec<Chunk>> {
    let stages = Stages::new(graph, outputs);
    if !stages.order.iter().any(|&node| is_call(graph, node)) {
        return None;
    }
    let mut chunks = Vec::new();
    for stage in 0..=stages.last {
        let here = || stages.order.iter().copied().filter(|node| stages.stage[node.index()] == stage);
        chunks.push(here().filter(|&node| !is_call(graph, node)).collect());
        for node in here().filter(|&node| is_call(graph, node)) {
            let together: Vec<Node> = match is_wave(graph, node) {
                true => companions(graph, node).filter(|wave| stages.is_placed[wave.index()]).collect(),
                false => vec![node],
            };
            if together[0] == node {
                chunks.push(together);
            }
        }
    }
    Some(chunks.into_iter().filter(|nodes| !nodes.is_empty()).map(|nodes| stages.chunk(&nodes)).collect())
}

struct Stages<'a> {
    graph: &'a Graph,
    is_output: Vec<bool>,
    /// What is computed once, in the graph's order.
    order: Vec<Node>,
    is_placed: Vec<bool>,
    /// For each node its stage. Calls follow the arithmetic of theirs.
    stage: Vec<usize>,
    last: usize,
    /// For each node its readers.
    readers: Vec<Vec<Node>>,
}

impl<'a> Stages<'a> {
    fn new(graph: &'a Graph, outputs: &[Node]) -> Self {
        let mut is_output = vec![false; graph.len()];
        outputs.iter().for_each(|output| is_output[output.index()] = true);
        let (used, cheap) = (graph.reachable(outputs), cheap(graph));
        let is_placed: Vec<bool> = (0..graph.len()).map(|i| used[i] && (is_output[i] || !cheap[i])).collect();
        let order: Vec<Node> =
            graph.nodes().map(|(node, _)| node).filter(|node| is_placed[node.index()]).collect();
        let mut readers = vec![Vec::new(); graph.len()];
        for &node in &order {
            for operand in graph.expr(node).operands().filter(|operand| is_placed[operand.index()]) {
                readers[operand.index()].push(node);
            }
        }
        let mut stages =
            Self { graph, is_output, order, is_placed, stage: vec![0; graph.len()], last: 0, readers };
        stages.settle();
        stages
    }

    /// Calls come as early as they can, and what is between them as late: then little waits in columns.
    fn settle(&mut self) {
        for &node in &self.order {
            let after =
                |operand: Node| self.stage[operand.index()] + usize::from(is_call(self.graph, operand));
            let operands = self.graph.expr(node).operands();
            let stage = operands.filter(|operand| self.is_placed[operand.index()]).map(after).max();
            self.stage[node.index()] = stage.unwrap_or(0);
            self.last = self.last.max(self.stage[node.index()] + usize::from(is_call(self.graph, node)));
        }
        for &node in self.order.iter().rev().filter(|&&node| !is_call(self.graph, node)) {
            let first = self.readers[node.index()].iter().map(|reader| self.stage[reader.index()]).min();
            self.stage[node.index()] = first.unwrap_or(self.last);
        }
    }

    fn chunk(&self, nodes: &[Node]) -> Chunk {
        let mut reads: Vec<Node> = Vec::new();
        for &node in nodes {
            for operand in self.graph.expr(node).operands().filter(|operand| self.is_placed[operand.index()])
            {
                if !nodes.contains(&operand) && !reads.contains(&operand) {
                    reads.push(operand);
                }
            }
        }
        let is_needed = |node: &&Node| {
            self.is_output[node.index()]
                || self.readers[node.index()].iter().any(|reader| !nodes.contains(reader))
        };
        Chunk { reads, writes: nodes.iter().filter(is_needed).copied().collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ir::Axis;
    use crate::ir::Binary;

    #[test]
    fn arithmetic_and_calls_take_turns() {
        let mut graph = Graph::default();
        let (x, y) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y));
        let sum = graph.binary(Binary::Add, x, y);
        let root = graph.unary(Unary::Sqrt, sum);
        let [sine, cosine] =
            [UnaryFunction::Sin, UnaryFunction::Cos].map(|wave| graph.unary(Unary::Call(wave), root));
        let product = graph.binary(Binary::Mul, sine, cosine);
        let both = graph.binary(Binary::Add, product, root);
        let chunks = stages(&graph, &[both]).unwrap();
        let written: Vec<Vec<Node>> = chunks.iter().map(|chunk| chunk.writes.clone()).collect();
        assert_eq!(written, [vec![root], vec![sine, cosine], vec![both]]);
        assert_eq!(chunks[2].reads, [sine, cosine, root]);
        assert!(is_of_waves(&graph, &chunks[1]) && !is_of_waves(&graph, &chunks[2]));
        assert!(stages(&graph, &[root]).is_none());
    }
}
