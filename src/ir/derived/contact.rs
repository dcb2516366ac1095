//! Distance, normal and mean curvature at the surface, from the leaves.
//!
//! ω/|∇ω| is a poor distance: R₀ mixes leaves of unlike scale. A leaf u by itself knows better: along its
//! normal it is nearly quadratic, so with g = |∇u| and b = nᵀ·Hess u·n the surface lies at
//!
//! ```text
//! t = 2u / (g + √(g² − 2ub))          (u/g where the root is not real)
//! ```
//!
//! which is exact along the normal for every quadric. The leaves' distances are combined by the min/max twin,
//! and normal and curvature are those of the leaf that decides; at a tie, the mean of the two. Products of
//! two factors are split into their faces, sign(pq) = (p∧q)∨(¬p∧¬q): the product of a slab is half the
//! distance far away.
//!
//! Where |∇u|² leaves the range of numbers (|∇u| beyond 1e±154), the distance comes out as 0 or NaN, and whoever asks looks
//! for the surface by ranges instead: scaling each gradient first would cost every contact.
//!
//! The surface of a leaf that depends on time moves along its outward normal n with the speed u_t/|∇u|: on
//! u(x(t), t) = 0 the derivative ∇u·x′ + u_t vanishes, and n = −∇u/|∇u|.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::ir::derived::gradient::{gradient, gradient_and_rate};
use crate::ir::derived::sign::SignRule;
use crate::ir::graph::{Axis, Expr, Graph, Node};
use crate::ir::op::{Binary, Unary};

/// How far a point is moved off a singular place of a leaf, relative to the leaf's value and to the
/// coordinates. Second derivatives grow with the inverse of this distance, and lose as many digits.
const STEP: f64 = 1e-6;
const RELATIVE_STEP: f64 = 2.5e-7;

/// What is known of the surface nearest to a point, as nodes.
#[derive(Debug, Clone, Copy)]
struct Surface {
    /// Distance, positive inside the solid.
    depth: Node,
    /// Outward unit normal.
    normal: [Node; 3],
    /// Mean curvature, positive where the solid is convex.
    curvature: Node,
    /// Velocity along the normal, where it is asked for.
    velocity: Option<[Node; 3]>,
}

/// [distance (positive in the fluid), outward unit normal x, y, z, mean curvature (1/length, convex
/// positive)]
pub fn contact(graph: &mut Graph, root: Node) -> [Node; 5] {
    let mut builder = Builder { graph, known: FxHashMap::default(), moving: false };
    let surface = builder.surface(root);
    let [nx, ny, nz] = builder.unit(surface.normal);
    let distance = builder.graph.unary(Unary::Neg, surface.depth);
    [distance, nx, ny, nz, surface.curvature]
}

/// The velocity along its normal of the surface that [`contact`] finds: of the leaf that decides, or the mean
/// of two. A motion within the surface itself, as of a turning cylinder, is not in ω.
pub fn wall_velocity(graph: &mut Graph, root: Node) -> [Node; 3] {
    let mut builder = Builder { graph, known: FxHashMap::default(), moving: true };
    let surface = builder.surface(root);
    let zero = graph.constant(0.0);
    surface.velocity.unwrap_or([zero; 3])
}

struct Builder<'g> {
    graph: &'g mut Graph,
    moving: bool,
    known: FxHashMap<Node, Surface>,
}

/// How a shape is made of others.
#[derive(Clone, Copy)]
enum Kind {
    /// A product of two factors that vary in space, split into its faces.
    Product(Node, Node),
    /// A factor that is computed and the same everywhere, and what it scales: a shape of its sign.
    Scaled {
        factor: Node,
        shape: Node,
    },
    Signs(SignRule),
}

impl Kind {
    fn operands(self) -> impl Iterator<Item = Node> {
        let (shapes, rule) = match self {
            Self::Product(p, q) => ([Some(p), Some(q)], SignRule::Leaf),
            Self::Scaled { shape, .. } => ([Some(shape), None], SignRule::Leaf),
            Self::Signs(rule) => ([None; 2], rule),
        };
        shapes.into_iter().flatten().chain(rule.operands())
    }
}

/// How a node is made of shapes.
fn kind(graph: &Graph, node: Node) -> Kind {
    match SignRule::of(graph, node) {
        SignRule::Leaf => product(graph, node).unwrap_or(Kind::Signs(SignRule::Leaf)),
        rule => Kind::Signs(rule),
    }
}

/// What becomes of a product; `None` for other formulas, and where a factor is a number.
fn product(graph: &Graph, node: Node) -> Option<Kind> {
    let Expr::Binary(Binary::Mul, p, q) = graph.expr(node) else { return None };
    let is_number =
        |node| matches!(graph.expr(node), Expr::Constant(_) | Expr::Parameter(_) | Expr::Uniform(_));
    if p == q || is_number(p) || is_number(q) {
        return None;
    }
    let varies = |node| Axis::SPACE.iter().any(|&axis| graph.uses(node, axis));
    match (varies(p), varies(q)) {
        (true, true) => Some(Kind::Product(p, q)),
        (false, true) => Some(Kind::Scaled { factor: p, shape: q }),
        (true, false) => Some(Kind::Scaled { factor: q, shape: p }),
        (false, false) => None,
    }
}

/// The formulas below a root whose surfaces [`contact`] estimates; at most `most`, and `None` if there are more.
pub fn leaves(graph: &Graph, root: Node, most: usize) -> Option<Vec<Node>> {
    let (mut waiting, mut seen, mut found) = (vec![root], FxHashSet::default(), Vec::new());
    while let Some(node) = waiting.pop() {
        if !seen.insert(node) {
            continue;
        }
        match kind(graph, node) {
            Kind::Signs(SignRule::Leaf) => found.push(node),
            joined => waiting.extend(joined.operands()),
        }
        if found.len() > most {
            return None;
        }
    }
    Some(found)
}

impl Builder<'_> {
    /// Logic nodes below the root in an order in which operands come first: no recursion, trees may be deep.
    fn surface(&mut self, root: Node) -> Surface {
        let mut stack = vec![root];
        while let Some(&node) = stack.last() {
            if self.known.contains_key(&node) {
                stack.pop();
                continue;
            }
            let kind = kind(self.graph, node);
            let missing: Vec<Node> = kind.operands().filter(|o| !self.known.contains_key(o)).collect();
            if missing.is_empty() {
                let surface = self.combine(node, kind);
                self.known.insert(node, surface);
                stack.pop();
            } else {
                stack.extend(missing);
            }
        }
        self.known[&root]
    }

    fn combine(&mut self, node: Node, kind: Kind) -> Surface {
        match kind {
            Kind::Product(p, q) => {
                let (p, q) = (self.known[&p], self.known[&q]);
                let both = self.nearer(p, q, Binary::Min);
                let (p, q) = (self.negated(p), self.negated(q));
                let neither = self.nearer(p, q, Binary::Min);
                self.nearer(both, neither, Binary::Max)
            }
            Kind::Scaled { factor, shape } => self.scaled(factor, self.known[&shape]),
            Kind::Signs(SignRule::All(u, v)) => self.nearer(self.known[&u], self.known[&v], Binary::Min),
            Kind::Signs(SignRule::Any(u, v)) => self.nearer(self.known[&u], self.known[&v], Binary::Max),
            Kind::Signs(SignRule::Not(u)) => self.negated(self.known[&u]),
            // a positive factor moves nothing
            Kind::Signs(SignRule::Same(u)) => self.known[&u],
            Kind::Signs(SignRule::Leaf) => self.leaf(node),
        }
    }

    /// A factor that is the same everywhere moves nothing: where it is negative, the two sides change places.
    fn scaled(&mut self, factor: Node, s: Surface) -> Surface {
        let sign = self.graph.unary(Unary::Sign, factor);
        let mut signed = |node: Node| self.graph.binary(Binary::Mul, sign, node);
        Surface {
            depth: signed(s.depth),
            normal: s.normal.map(&mut signed),
            curvature: signed(s.curvature),
            velocity: s.velocity,
        }
    }

    fn negated(&mut self, s: Surface) -> Surface {
        Surface {
            depth: self.graph.unary(Unary::Neg, s.depth),
            normal: s.normal.map(|n| self.graph.unary(Unary::Neg, n)),
            curvature: self.graph.unary(Unary::Neg, s.curvature),
            velocity: s.velocity, // the other side of a surface moves with it
        }
    }

    /// The surface that decides: weights are 1 and 0, or ½ and ½ at a tie.
    fn nearer(&mut self, u: Surface, v: Surface, op: Binary) -> Surface {
        let depth = self.graph.binary(op, u.depth, v.depth);
        let weight = if op == Binary::Min { Binary::MinWeight } else { Binary::MaxWeight };
        let (wu, wv) =
            (self.graph.binary(weight, u.depth, v.depth), self.graph.binary(weight, v.depth, u.depth));
        let mut mixed = |a: Node, b: Node| {
            let (a, b) = (self.graph.binary(Binary::Mul, wu, a), self.graph.binary(Binary::Mul, wv, b));
            self.graph.binary(Binary::Add, a, b)
        };
        let normal = std::array::from_fn(|i| mixed(u.normal[i], v.normal[i]));
        let velocity = match (u.velocity, v.velocity) {
            (Some(a), Some(b)) => Some(std::array::from_fn(|i| mixed(a[i], b[i]))),
            _ => None,
        };
        Surface { depth, normal, curvature: mixed(u.curvature, v.curvature), velocity }
    }

    fn leaf(&mut self, u: Node) -> Surface {
        let surface = self.smooth_leaf(u);
        match self.beside_singular(u) {
            Some(beside) => self.moved(surface, beside),
            None => surface,
        }
    }

    /// The coordinates, moved a little where a root or a magnitude in u vanishes: there its derivative is put to
    /// 0, which hides the surface around an axis. `None` if u has neither.
    fn beside_singular(&mut self, u: Node) -> Option<[Node; 3]> {
        use Binary::{Add, Min, MinWeight, Mul};
        let arguments: Vec<Node> = self
            .graph
            .cone(u)
            .into_iter()
            .filter_map(|node| match self.graph.expr(node) {
                Expr::Unary(Unary::Sqrt | Unary::Abs, a) => Some(a),
                _ => None,
            })
            .filter(|&a| Axis::SPACE.iter().any(|&axis| self.graph.uses(a, axis)))
            .collect();
        let magnitudes: Vec<Node> = arguments.iter().map(|&a| self.graph.unary(Unary::Abs, a)).collect();
        let smallest = magnitudes.into_iter().reduce(|a, b| self.graph.binary(Min, a, b))?;
        // the step in lengths: the value of a leaf is about its distance
        let (step, half) = (self.graph.constant(STEP), self.graph.constant(0.5 * STEP));
        let size = self.graph.unary(Unary::Abs, u);
        let [step, near] = [step, half].map(|factor| self.graph.binary(Mul, factor, size));
        let near = self.graph.binary(Mul, near, near);
        let is_singular = self.graph.binary(MinWeight, smallest, near);
        let mut part = 1.0;
        Some(Axis::SPACE.map(|axis| {
            let coordinate = self.graph.coordinate(axis);
            let magnitude = self.graph.unary(Unary::Abs, coordinate);
            let relative = self.graph.constant(RELATIVE_STEP);
            let relative = self.graph.binary(Mul, relative, magnitude);
            let both = self.graph.binary(Add, relative, step);
            // in no direction that a formula is likely to have
            let factor = self.graph.constant(part);
            part *= 0.7;
            let offset = self.graph.binary(Mul, factor, both);
            let offset = self.graph.binary(Mul, is_singular, offset);
            self.graph.binary(Add, coordinate, offset)
        }))
    }

    /// A surface as seen from other coordinates.
    fn moved(&mut self, s: Surface, to: [Node; 3]) -> Surface {
        let mut at = |node: Node| self.graph.substitute(node, to);
        Surface {
            depth: at(s.depth),
            normal: s.normal.map(&mut at),
            curvature: at(s.curvature),
            velocity: s.velocity.map(|velocity| velocity.map(&mut at)),
        }
    }

    fn smooth_leaf(&mut self, u: Node) -> Surface {
        use Binary::{Add, DivOrZero, Mul, Sub};
        let slopes = gradient(self.graph, u);
        let g2 = self.dot(slopes, slopes);
        let g = self.graph.unary(Unary::Sqrt, g2);
        // ∇(½g²) = Hess u · ∇u
        let half = self.graph.constant(0.5);
        let half_g2 = self.graph.binary(Mul, half, g2);
        let bent = gradient(self.graph, half_g2);
        let along = self.dot(slopes, bent);
        let [trace, squares] = self.second_derivatives(slopes);
        let b = self.graph.binary(DivOrZero, along, g2);
        // where there is no normal the steepest direction counts: Σλ²/Σλ of the eigenvalues of Hess u, which
        // for balls, cylinders and layers is the one that they have
        let has_normal = self.graph.unary(Unary::Sign, g2);
        let one = self.graph.constant(1.0);
        let has_none = self.graph.binary(Sub, one, has_normal);
        let mean = self.graph.binary(DivOrZero, squares, trace);
        let mean = self.graph.binary(Mul, has_none, mean);
        let b = self.graph.binary(Add, b, mean);
        let depth = self.depth(u, g, g2, b);
        let normal = slopes.map(|slope| {
            let inward = self.graph.binary(DivOrZero, slope, g);
            self.graph.unary(Unary::Neg, inward)
        });
        // −(tr Hess u − nᵀ·Hess u·n)/2g
        let across = self.graph.binary(Sub, b, trace);
        let twice = self.graph.binary(Add, g, g);
        let curvature = self.graph.binary(DivOrZero, across, twice);
        let velocity = self.moving.then(|| self.velocity(u, g, normal));
        Surface { depth, normal, curvature, velocity }
    }

    /// n·u_t/|∇u|
    fn velocity(&mut self, u: Node, g: Node, normal: [Node; 3]) -> [Node; 3] {
        let [.., rate] = gradient_and_rate(self.graph, u);
        let speed = self.graph.binary(Binary::DivOrZero, rate, g);
        normal.map(|n| self.graph.binary(Binary::Mul, speed, n))
    }

    /// 2u/(g + √(g² − 2ub)), or u/g where the root is not real.
    fn depth(&mut self, u: Node, g: Node, g2: Node, b: Node) -> Node {
        use Binary::{Add, DivOrZero, Max, MinWeight, Mul, Sub};
        let twice = self.graph.binary(Add, u, u);
        let bend = self.graph.binary(Mul, twice, b);
        let radicand = self.graph.binary(Sub, g2, bend);
        let zero = self.graph.constant(0.0);
        let clipped = self.graph.binary(Max, radicand, zero);
        let root = self.graph.unary(Unary::Sqrt, clipped);
        let unreal = self.graph.binary(MinWeight, radicand, zero);
        let instead = self.graph.binary(Mul, unreal, g);
        let below = self.graph.binary(Add, g, root);
        let below = self.graph.binary(Add, below, instead);
        self.graph.binary(DivOrZero, twice, below)
    }

    /// The trace of Hess u, and the sum of the squares of its elements.
    fn second_derivatives(&mut self, slopes: [Node; 3]) -> [Node; 2] {
        let rows = slopes.map(|slope| gradient(self.graph, slope));
        let sum = self.graph.binary(Binary::Add, rows[0][0], rows[1][1]);
        let trace = self.graph.binary(Binary::Add, sum, rows[2][2]);
        let [x, y, z] = rows.map(|row| self.dot(row, row));
        let sum = self.graph.binary(Binary::Add, x, y);
        [trace, self.graph.binary(Binary::Add, sum, z)]
    }

    fn dot(&mut self, a: [Node; 3], b: [Node; 3]) -> Node {
        let [x, y, z] = std::array::from_fn(|i| self.graph.binary(Binary::Mul, a[i], b[i]));
        let sum = self.graph.binary(Binary::Add, x, y);
        self.graph.binary(Binary::Add, sum, z)
    }

    /// A vector made one of length 1; zero where opposite normals meet.
    fn unit(&mut self, v: [Node; 3]) -> [Node; 3] {
        let square = self.dot(v, v);
        let length = self.graph.unary(Unary::Sqrt, square);
        v.map(|c| self.graph.binary(Binary::DivOrZero, c, length))
    }
}
