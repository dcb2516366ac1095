//! Points of the surface of a solid, between the nodes of a coarse lattice.

use glam::DVec3;

use crate::geom::Aabb;
use crate::solid::construction::Solid;

/// Nodes along each side of a lattice that shows where the faces of a solid are. Their number is even, so
/// that no edge lies on an axis through the middle: an angle around it has no value there.
pub const FEW_NODES: usize = 26;

/// Maximum number of points of the surface that are found.
pub const MOST_POINTS: usize = 1500;

/// How often a stretch is halved until its ends are neighbouring numbers, unless they are next to 0.
pub const ALL_HALVINGS: usize = 100;

/// A step along an axis over which the sign changes.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// Its ends.
    pub ends: [DVec3; 2],
    /// The larger |ω| at the ends of the edge of the lattice: how large ω is near by.
    pub scale: f64,
}

/// The nodes of a lattice over a box, with the sign of the solid at each.
pub struct Lattice {
    space: Aabb,
    nodes: usize,
    pub points: Vec<DVec3>,
    pub signs: Vec<f64>,
}

impl Lattice {
    pub fn of(solid: &Solid, space: &Aabb, nodes: usize) -> Self {
        let step = space.size() / (nodes - 1) as f64;
        let place =
            |i: usize| DVec3::new((i % nodes) as f64, (i / nodes % nodes) as f64, (i / nodes.pow(2)) as f64);
        let points: Vec<DVec3> = (0..nodes.pow(3)).map(|i| space.min + step * place(i)).collect();
        let columns: [Vec<f64>; 3] = [0, 1, 2].map(|axis| points.iter().map(|p| p[axis]).collect());
        let mut signs = vec![0.0; points.len()];
        solid.sign_many(columns.each_ref().map(|column| &column[..]), &mut signs);
        Self { space: *space, nodes, points, signs }
    }

    /// All pairs of neighbours, by their numbers.
    pub fn edges(&self) -> impl Iterator<Item = [usize; 2]> + '_ {
        let nodes = self.nodes;
        [1, nodes, nodes * nodes].into_iter().flat_map(move |stride| {
            let has_next = move |&i: &usize| i / stride % nodes + 1 < nodes;
            (0..self.points.len()).filter(has_next).map(move |i| [i, i + stride])
        })
    }

    /// The places where the surface crosses edges, each halved `halvings` times, and the number of crossings
    /// that each place stands for: if there are more than `most`, some of them stand for all.
    pub fn crossings(&self, solid: &Solid, most: usize, halvings: usize) -> (Vec<Crossing>, usize) {
        let crossed: Vec<[usize; 2]> =
            self.edges().filter(|[a, b]| self.signs[*a] * self.signs[*b] < 0.0).collect();
        let every = crossed.len().div_ceil(most).max(1);
        let crossing = |edge: &[usize; 2]| {
            let ends = edge.map(|i| self.points[i]);
            let scale = ends.map(|p| solid.omega(p).abs()).into_iter().fold(0.0, f64::max);
            Crossing { ends: halved(ends, halvings, |p| solid.sign(p) > 0.0), scale }
        };
        (evenly(&crossed, most).map(crossing).collect(), every)
    }

    /// The sides of a cell.
    pub fn cell(&self) -> DVec3 {
        self.space.size() / (self.nodes - 1) as f64
    }
}

/// At most `most` members of a list, spread evenly. Each stretch of the list contributes a member from
/// another place in it, because what comes from a lattice repeats.
pub fn evenly<T>(list: &[T], most: usize) -> impl Iterator<Item = &T> {
    let every = list.len().div_ceil(most).max(1);
    list.chunks(every)
        .enumerate()
        .map(move |(i, chunk)| &chunk[i.wrapping_mul(0x9E37_79B1) / 64 % chunk.len()])
}

/// Halves a stretch `halvings` times, or as long as numbers allow, so that `holds` differs at its ends.
pub fn halved([mut a, mut b]: [DVec3; 2], halvings: usize, holds: impl Fn(DVec3) -> bool) -> [DVec3; 2] {
    let at_first = holds(a);
    for _ in 0..halvings {
        let middle = 0.5 * (a + b);
        if middle == a || middle == b {
            break;
        }
        *(if holds(middle) == at_first { &mut a } else { &mut b }) = middle;
    }
    [a, b]
}
