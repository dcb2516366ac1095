//! The graph itself: interning, spans, substitution, extraction.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::diagnostic::Span;
use crate::ir::lookup::{Lookup, Tables};
use crate::ir::op::{Binary, Unary};
use crate::table::Table;

/// An operation of one graph; only that graph makes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Node(u32);

impl Node {
    /// Its place in the order.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A coordinate of space, or time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    /// Length along x.
    X,
    /// Length along y.
    Y,
    /// Length along z.
    Z,
    /// Time, s. It is a coordinate of the formula, but all points of a program share it.
    T,
}

impl Axis {
    /// The coordinates of a point.
    pub const SPACE: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Its place in a set of coordinates.
    fn bit(self) -> u8 {
        match self {
            Self::X => 1,
            Self::Y => 2,
            Self::Z => 4,
            Self::T => 8,
        }
    }
}

/// What a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Expr {
    /// The bits of an `f64`: equal bits, equal constant.
    Constant(u64),
    /// A coordinate of the point, or time.
    Coordinate(Axis),
    /// A constant that is known only when the program runs: programs of leaves that differ in their constants
    /// alone are one program.
    Parameter(u32),
    /// A number that depends on time alone, see `hoisted`. It is known when the instant is,
    /// and has a range over a stretch of time.
    Uniform(u32),
    /// An operation on one node.
    Unary(Unary, Node),
    /// An operation on two nodes.
    Binary(Binary, Node, Node),
    /// What one of the graph's tables has at the place that three nodes are.
    Lookup(Lookup, [Node; 3]),
}

impl Expr {
    /// The nodes that it is computed from, in order.
    pub fn operands(self) -> impl Iterator<Item = Node> {
        let all = match self {
            Self::Constant(_) | Self::Coordinate(_) | Self::Parameter(_) | Self::Uniform(_) => [None; 3],
            Self::Unary(_, a) => [Some(a), None, None],
            Self::Binary(_, a, b) => [Some(a), Some(b), None],
            Self::Lookup(_, at) => at.map(Some),
        };
        all.into_iter().flatten()
    }

    /// The operation with its operands replaced.
    pub fn map(self, mut f: impl FnMut(Node) -> Node) -> Self {
        match self {
            Self::Constant(_) | Self::Coordinate(_) | Self::Parameter(_) | Self::Uniform(_) => self,
            Self::Unary(op, a) => Self::Unary(op, f(a)),
            Self::Binary(op, a, b) => Self::Binary(op, f(a), f(b)),
            Self::Lookup(lookup, at) => Self::Lookup(lookup, at.map(f)),
        }
    }

    /// One key for both orders of a commutative operation.
    fn key(self) -> Self {
        match self {
            Self::Binary(op, a, b) if op.commutes() && a > b => Self::Binary(op, b, a),
            other => other,
        }
    }
}

/// Operations in an order in which operands come before their uses.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    exprs: Vec<Expr>,
    spans: Vec<Option<Span>>,
    /// On which coordinates each node depends, see [`Axis::bit`].
    axes: Vec<u8>,
    interned: FxHashMap<Expr, Node>,
    /// See [`Lookup`]. Graphs that are made of one another share them.
    tables: Tables,
    /// See [`Graph::enclose`].
    hulls: FxHashMap<Node, Node>,
}

impl Graph {
    /// A graph without nodes, for those of another one: it has the same tables.
    pub fn like(other: &Self) -> Self {
        Self { tables: other.tables.clone(), ..Self::default() }
    }

    /// The tables that [`Lookup`] numbers.
    pub fn tables(&self) -> &Tables {
        &self.tables
    }

    /// The number of a table, which is added unless it is there.
    pub fn table(&mut self, table: &Arc<dyn Table>) -> u32 {
        let known = self.tables.iter().position(|known| Arc::ptr_eq(known, table));
        let number = known.unwrap_or_else(|| {
            self.tables = self.tables.iter().chain([table]).cloned().collect();
            self.tables.len() - 1
        });
        number as u32
    }

    /// Whether some roots look up a table.
    pub fn has_lookups(&self, roots: &[Node]) -> bool {
        let is_lookup = |expr: &Expr| matches!(expr, Expr::Lookup(..));
        // few graphs have tables, and the others need not be walked
        !self.tables.is_empty() && {
            let used = self.reachable(roots);
            std::iter::zip(&self.exprs, used).any(|(expr, used)| used && is_lookup(expr))
        }
    }

    /// How many nodes there are.
    pub fn len(&self) -> usize {
        self.exprs.len()
    }

    /// Whether there is no node.
    pub fn is_empty(&self) -> bool {
        self.exprs.is_empty()
    }

    /// The node of an expression: the one that exists, or a new one that remembers the span.
    pub fn intern(&mut self, expr: Expr, span: Option<Span>) -> Node {
        *self.interned.entry(expr.key()).or_insert_with(|| {
            // operands are u32 themselves, and the compiler's node budget is far below 2³²
            let node = Node(self.exprs.len() as u32);
            let own = if let Expr::Coordinate(axis) = expr { axis.bit() } else { 0 };
            self.axes.push(expr.operands().fold(own, |axes, operand| axes | self.axes[operand.index()]));
            self.exprs.push(expr);
            self.spans.push(span);
            node
        })
    }

    /// The node at a place in the order.
    ///
    /// # Panics
    /// If the graph has no such node: a bug of the calling pass.
    pub fn node(&self, index: usize) -> Node {
        assert!(index < self.exprs.len(), "no node {index}");
        Node(index as u32)
    }

    /// The node of an expression, if there is one.
    pub fn find(&self, expr: Expr) -> Option<Node> {
        self.interned.get(&expr.key()).copied()
    }

    /// What a node is.
    pub fn expr(&self, node: Node) -> Expr {
        self.exprs[node.index()]
    }

    /// Where the node was first written.
    pub fn span(&self, node: Node) -> Option<Span> {
        self.spans[node.index()]
    }

    /// All nodes, operands before their uses.
    pub fn nodes(&self) -> impl Iterator<Item = (Node, Expr)> + '_ {
        self.exprs.iter().enumerate().map(|(i, &expr)| (Node(i as u32), expr))
    }

    /// The node of a constant.
    pub fn constant(&mut self, value: f64) -> Node {
        self.intern(Expr::Constant(value.to_bits()), None)
    }

    /// The node of a coordinate.
    pub fn coordinate(&mut self, axis: Axis) -> Node {
        self.intern(Expr::Coordinate(axis), None)
    }

    /// The node of an operation on one node; a new one gets the operand's span.
    pub fn unary(&mut self, op: Unary, a: Node) -> Node {
        let span = self.span(a);
        self.intern(Expr::Unary(op, a), span)
    }

    /// The node of an operation on two nodes; a new one gets the first operand's span.
    pub fn binary(&mut self, op: Binary, a: Node, b: Node) -> Node {
        let span = self.span(a);
        self.intern(Expr::Binary(op, a, b), span)
    }

    /// A graph of its own for one root; the work grows with what the root uses, not with this graph.
    pub fn extract_cone(&self, root: Node) -> (Self, Node) {
        let mut out = Self::like(self);
        let mut image: FxHashMap<Node, Node> = FxHashMap::default();
        for node in self.cone(root) {
            let new = out.intern(self.expr(node).map(|operand| image[&operand]), self.span(node));
            image.insert(node, new);
        }
        (out, image[&root])
    }

    /// The operations alone: equal for graphs of the same shape.
    pub fn exprs(&self) -> &[Expr] {
        &self.exprs
    }

    /// The constant that a node is, if it is one.
    pub fn as_constant(&self, node: Node) -> Option<f64> {
        match self.expr(node) {
            Expr::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// For each node, whether it is a root or a root depends on it.
    pub fn reachable(&self, roots: &[Node]) -> Vec<bool> {
        let mut used = vec![false; self.len()];
        for root in roots {
            used[root.index()] = true;
        }
        for i in (0..self.len()).rev() {
            if used[i] {
                for operand in self.exprs[i].operands() {
                    used[operand.index()] = true;
                }
            }
        }
        used
    }

    /// The nodes a root depends on, in order; cheap when the root uses little of a large graph.
    pub(crate) fn cone(&self, root: Node) -> Vec<Node> {
        let mut seen = FxHashSet::from_iter([root]);
        let mut cone = vec![root];
        let mut next = 0;
        while next < cone.len() {
            for operand in self.expr(cone[next]).operands() {
                if seen.insert(operand) {
                    cone.push(operand);
                }
            }
            next += 1;
        }
        cone.sort_unstable();
        cone
    }

    /// Whether a coordinate occurs in what a root depends on.
    pub fn uses(&self, root: Node, axis: Axis) -> bool {
        self.axes[root.index()] & axis.bit() != 0
    }

    /// Whether time does.
    pub fn uses_time(&self, root: Node) -> bool {
        self.uses(root, Axis::T)
    }

    /// The numbers of the parameters that a root depends on.
    pub fn parameters(&self, root: Node) -> Vec<u32> {
        let number = |node: Node| match self.expr(node) {
            Expr::Parameter(number) => Some(number),
            _ => None,
        };
        self.cone(root).into_iter().filter_map(number).collect()
    }

    /// Whether a parameter occurs in what some roots depend on.
    pub fn uses_parameters(&self, roots: &[Node]) -> bool {
        let is_parameter = |expr: &Expr| matches!(expr, Expr::Parameter(_));
        // few graphs have parameters, and the others need not be walked
        self.exprs.iter().any(is_parameter) && {
            let used = self.reachable(roots);
            std::iter::zip(&self.exprs, used).any(|(expr, used)| used && is_parameter(expr))
        }
    }

    /// States that a field is positive nowhere but where another one is, which has an end that is easily found: its
    /// formula may not show where it ends. Both keep to this in other coordinates. Graphs that are taken out of this
    /// one know nothing of it.
    pub fn enclose(&mut self, field: Node, hull: Node) {
        self.hulls.insert(field, hull);
    }

    /// What encloses a field.
    pub fn hull(&self, field: Node) -> Option<Node> {
        self.hulls.get(&field).copied()
    }

    /// The fields that some roots use and that are enclosed, with what encloses them.
    pub fn enclosed(&self, roots: &[Node]) -> Vec<(Node, Node)> {
        if self.hulls.is_empty() {
            return Vec::new();
        }
        let used = self.reachable(roots);
        let mut enclosed: Vec<(Node, Node)> = self
            .hulls
            .iter()
            .map(|(&field, &hull)| (field, hull))
            .filter(|(field, _)| used[field.index()])
            .collect();
        enclosed.sort_unstable();
        enclosed
    }

    /// The node with x, y, z replaced: the same shape in other coordinates, at the same time.
    pub fn substitute(&mut self, root: Node, coordinates: [Node; 3]) -> Node {
        let cone = self.cone(root);
        let mut image: FxHashMap<Node, Node> = FxHashMap::default();
        self.map_coordinates(&cone, coordinates, &mut image);
        for field in cone {
            if let Some(hull) = self.hull(field) {
                self.map_coordinates(&self.cone(hull), coordinates, &mut image);
                self.enclose(image[&field], image[&hull]);
            }
        }
        image[&root]
    }

    /// Adds the images of nodes, operands before their uses, with x, y, z replaced.
    fn map_coordinates(&mut self, cone: &[Node], coordinates: [Node; 3], image: &mut FxHashMap<Node, Node>) {
        for &node in cone {
            let new = match self.expr(node) {
                Expr::Coordinate(Axis::X) => coordinates[0],
                Expr::Coordinate(Axis::Y) => coordinates[1],
                Expr::Coordinate(Axis::Z) => coordinates[2],
                expr => {
                    let mapped = expr.map(|operand| image[&operand]);
                    let span = self.span(node);
                    self.intern(mapped, span)
                }
            };
            image.insert(node, new);
        }
    }

    /// Adds the values of nodes that are not known yet to those of the nodes before them, with these values of
    /// parameters. `None` for what uses a coordinate.
    pub fn extend_values(&self, parameters: &[f64], values: &mut Vec<Option<f64>>) {
        for &expr in &self.exprs[values.len().min(self.exprs.len())..] {
            let of = |node: Node| values[node.index()];
            let value = match expr {
                Expr::Constant(bits) => Some(f64::from_bits(bits)),
                Expr::Parameter(i) => parameters.get(i as usize).copied(),
                Expr::Coordinate(_) | Expr::Uniform(_) => None,
                Expr::Unary(op, a) => of(a).map(|a| op.eval(a)),
                Expr::Binary(op, a, b) => of(a).zip(of(b)).map(|(a, b)| op.eval(a, b)),
                Expr::Lookup(lookup, [x, y, z]) => {
                    of(x).zip(of(y)).zip(of(z)).map(|((x, y), z)| lookup.eval(&self.tables, [x, y, z]))
                }
            };
            values.push(value);
        }
    }

    /// A graph of its own for some roots, without what they do not use.
    pub fn extract(&self, roots: &[Node]) -> (Self, Vec<Node>) {
        let used = self.reachable(roots);
        let mut out = Self::like(self);
        let mut image: Vec<Option<Node>> = vec![None; self.len()];
        for (node, expr) in self.nodes().filter(|(node, _)| used[node.index()]) {
            let mapped = expr.map(|operand| image[operand.index()].unwrap_or(operand));
            image[node.index()] = Some(out.intern(mapped, self.span(node)));
        }
        let roots = roots.iter().map(|root| image[root.index()].unwrap_or(*root)).collect();
        (out, roots)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    #[test]
    fn equal_expressions_share_a_node() {
        let mut graph = Graph::default();
        let (x, y) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y));
        let sum = graph.binary(Binary::Add, x, y);
        assert_eq!(graph.binary(Binary::Add, y, x), sum);
        assert_ne!(graph.binary(Binary::Sub, y, x), graph.binary(Binary::Sub, x, y));
    }

    #[test]
    fn substitution_moves_a_shape() {
        let mut graph = Graph::default();
        let (x, y, z) = (graph.coordinate(Axis::X), graph.coordinate(Axis::Y), graph.coordinate(Axis::Z));
        let product = graph.binary(Binary::Mul, x, y);
        let one = graph.constant(1.0);
        let two = graph.constant(2.0);
        let moved = graph.substitute(product, [one, two, z]);
        let mut values = Vec::new();
        graph.extend_values(&[], &mut values);
        assert_eq!([moved, product].map(|node| values[node.index()]), [Some(2.0), None]);
    }

    #[test]
    fn extraction_leaves_out_the_unused() {
        let mut graph = Graph::default();
        let x = graph.coordinate(Axis::X);
        let unused = graph.unary(crate::ir::UnaryFunction::Sin.into(), x);
        let root = graph.unary(Unary::Neg, x);
        let (small, roots) = graph.extract(&[root]);
        assert_eq!(small.len(), 2);
        assert_eq!(small.expr(roots[0]), Expr::Unary(Unary::Neg, Node(0)));
        assert!(unused.index() < graph.len());
    }
}
