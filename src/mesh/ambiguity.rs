//! Decisions by the values at a cell's corners where their signs leave a choice. The mesh then has the
//! topology of the trilinear interpolant, F(x, y, z) in the cell [0, 1]³.
//!
//! On a face F is bilinear and F = 0 is a hyperbola. The sign of F at its saddle says which corners its
//! branches join (asymptotic decider, Nielson and Hamann, Visualization 1991). Within the cell each loop of
//! segments bounds a disc, except that two of them may bound a tunnel.
//!
//! A tunnel is recognised as follows. In a slice x = t, F is bilinear with corner values A, B, C, D linear in
//! t; A·C − B·D is a quadratic in t whose discriminant is Cayley's hyperdeterminant of the corner values, the
//! same on all three axes. If it is positive, the roots u₀, u₁ on x, v₀, v₁ on y and w₀, w₁ on z span a box
//! on which F vanishes at six corners and along the six edges between them: a closed hexagon of straight
//! lines on the surface (compare Grosso, Computer Graphics Forum 35, 2016). The box's other two corners P and
//! Q lie opposite to one another, and in coordinates of the box F = F(P)·(1−x)(1−y)(1−z) + F(Q)·xyz. So if
//! F(P) and F(Q) differ in sign, the surface within the box is a disc that spans the hexagon; if they agree,
//! the box is free of surface, and the hexagon is the waist of a tunnel from P to Q. A tunnel lies in the
//! cell where its waist does. The lines go on beyond the hexagon's corners, those next to P towards the faces
//! on the side of P: the loops that they meet there are the tunnel's ends.
//!
//! Where ω itself is not as its values say, see `diagonals`, it decides about a face, and no tunnel is sought.
//!
//! The values are those of [`crate::field::Field::continuous`] at the grid's nodes. For a solid they come
//! from the min/max twin, whose sign is that of ω; with a cell map from its leaves, which give the same but
//! for rounding. Ties count as outside, as ω = 0 does everywhere.
//!
//! Invariant: a decision about a face depends on its four values alone and not on their order, so both cells
//! at the face decide alike.

use super::cases::{Ambiguous, FACES, Tunnel, edge_between, face_corners};

/// ω at the corners of a cell. Bit 0 of the index is x, bit 1 is y, bit 2 is z.
pub(super) type Corners = [f64; 8];

/// Bit c is set if corner c is inside.
pub(super) fn inside(corners: &Corners) -> u8 {
    corners.iter().enumerate().fold(0, |mask, (c, &w)| mask | u8::from(w > 0.0) << c)
}

/// Which corners are joined on each face. The decision has no effect on a face that is not ambiguous.
pub(super) fn faces(corners: &Corners) -> [Ambiguous; FACES] {
    std::array::from_fn(|face| {
        let [a, b, c, d] = face_corners(face).map(|corner| corners[corner]);
        // products are the same bits in either order, so a mirrored or turned face is the same face
        let (inside, outside) = if a > 0.0 { (a * c, b * d) } else { (b * d, a * c) };
        if inside > outside { Ambiguous::JoinSolid } else { Ambiguous::PartSolid }
    })
}

/// The tunnel of a cell, with the two loops that bound it and its waist. `None` if there is none.
pub(super) fn tunnel(corners: &Corners, loops: &[Vec<usize>]) -> Option<Tunnel> {
    if loops.len() < 2 {
        return None;
    }
    let box_around = Waist::of(corners)?;
    let waist = box_around.hexagon();
    if loops.len() == 2 {
        return Some(Tunnel { loops: [0, 1], waist });
    }
    let ends = [box_around.end, box_around.end.map(|side| 1 - side)];
    match ends.map(|end| box_around.loop_towards(end, corners, loops)) {
        [Some(p), Some(q)] if p != q => Some(Tunnel { loops: [p.min(q), p.max(q)], waist }),
        _ => None, // rounding only
    }
}

/// The box that is spanned by the hexagon around a tunnel.
struct Waist {
    /// The low and the high side on each axis.
    sides: [[f64; 2]; 3],
    /// The corner P: low (0) or high (1) on each axis.
    end: [usize; 3],
}

impl Waist {
    /// The waist within the cell. `None` if there is no tunnel.
    fn of(corners: &Corners) -> Option<Self> {
        let mut sides = [[0.0; 2]; 3];
        for (axis, sides) in sides.iter_mut().enumerate() {
            *sides = degenerate_slices(corners, axis)?;
        }
        let value =
            |corner: usize| trilinear(corners, [0, 1, 2].map(|axis: usize| sides[axis][corner >> axis & 1]));
        let size = |corner: usize| value(corner).abs() + value(7 - corner).abs();
        // rounding leaves the other six corners at almost zero
        let end = (0..4).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
        let agree = value(end) * value(7 - end) > 0.0;
        agree.then(|| Self { sides, end: [0, 1, 2].map(|axis: usize| end >> axis & 1) })
    }

    /// The six corners besides P and Q, each a neighbour of the next.
    fn hexagon(&self) -> [[f64; 3]; 6] {
        let turned = [0b001, 0b011, 0b010, 0b110, 0b100, 0b101];
        turned.map(|turn: usize| {
            [0, 1, 2].map(|axis: usize| self.sides[axis][self.end[axis] ^ (turn >> axis & 1)])
        })
    }

    /// The loop at one end of the tunnel: the one that most lines beyond the hexagon's corners next to that
    /// end meet.
    fn loop_towards(&self, end: [usize; 3], corners: &Corners, loops: &[Vec<usize>]) -> Option<usize> {
        let mut votes = vec![0; loops.len()];
        for axis in 0..3 {
            for turned in [(axis + 1) % 3, (axis + 2) % 3] {
                let mut at = [0, 1, 2].map(|a: usize| self.sides[a][end[a]]);
                at[turned] = self.sides[turned][1 - end[turned]];
                if let Some(found) = loop_on_face(2 * axis + end[axis], at, corners, loops) {
                    votes[found] += 1;
                }
            }
        }
        (0..loops.len()).filter(|&l| votes[l] > 0).max_by_key(|&l| votes[l])
    }
}

/// The two slices across an axis in which the bilinear F degenerates to a pair of lines. `None` if they are
/// not both within the cell.
fn degenerate_slices(corners: &Corners, axis: usize) -> Option<[f64; 2]> {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let [a, b, c, d] = [0, u, u | v, v].map(|low| (corners[low], corners[low | 1 << axis] - corners[low]));
    // (A·C − B·D)(t)
    let constant = a.0 * c.0 - b.0 * d.0;
    let linear = a.0 * c.1 + a.1 * c.0 - b.0 * d.1 - b.1 * d.0;
    let square = a.1 * c.1 - b.1 * d.1;
    let discriminant = linear * linear - 4.0 * square * constant;
    if discriminant.is_nan() || discriminant <= 0.0 {
        return None;
    }
    let far = -0.5 * (linear + discriminant.sqrt().copysign(linear));
    let roots = [far / square, constant / far];
    let within = roots.iter().all(|root| *root > 0.0 && *root < 1.0);
    within.then(|| [roots[0].min(roots[1]), roots[0].max(roots[1])])
}

fn trilinear(corners: &Corners, at: [f64; 3]) -> f64 {
    let weight = |corner: usize| {
        (0..3).fold(1.0, |product, axis| {
            product * if corner >> axis & 1 == 1 { at[axis] } else { 1.0 - at[axis] }
        })
    };
    (0..8).map(|corner| weight(corner) * corners[corner]).sum()
}

/// The loop whose segment on a face holds a point of F = 0 on that face.
fn loop_on_face(face: usize, at: [f64; 3], corners: &Corners, loops: &[Vec<usize>]) -> Option<usize> {
    let around = face_corners(face);
    let borders = |e: usize| (0..4).position(|i| edge_between(around[i], around[(i + 1) % 4]) == e);
    // segments on the face, each as its loop and two sides of the face
    let mut segments = Vec::new();
    for (number, polygon) in loops.iter().enumerate() {
        for (i, &from) in polygon.iter().enumerate() {
            if let (Some(a), Some(b)) = (borders(from), borders(polygon[(i + 1) % polygon.len()])) {
                segments.push((number, a, b));
            }
        }
    }
    if let [(only, ..)] = segments[..] {
        return Some(only);
    }
    // each of two segments cuts off a corner, and lies on that corner's side of the hyperbola's asymptotes
    let axes = [(face / 2 + 1) % 3, (face / 2 + 2) % 3];
    let base = (face % 2) << (face / 2);
    let [f00, f10, f01, f11] =
        [0, 1, 2, 3].map(|i: usize| corners[base | (i & 1) << axes[0] | (i >> 1) << axes[1]]);
    let twist = f00 + f11 - f10 - f01;
    let saddle = [(f00 - f01) / twist, (f00 - f10) / twist];
    let beyond = [0, 1].map(|i| at[axes[i]] - saddle[i]);
    let clearer = usize::from(beyond[1].abs() > beyond[0].abs());
    let found = segments.iter().find(|&&(_, a, b)| {
        let corner = if (a + 1) % 4 == b { around[b] } else { around[a] };
        (corner >> axes[clearer] & 1 == 1) == (beyond[clearer] > 0.0)
    });
    found.map(|&(number, ..)| number)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rayon::prelude::*;

    use crate::geom::Aabb;
    use crate::mesh::Unwatched;
    use crate::mesh::tests::{Formula, between_nodes};
    use crate::mesh::{Grid, Resolution, check, dual_contouring, marching_cubes};

    /// A small generator (Marsaglia's xorshift), so that a grid can be made again from its number.
    struct Random(u64);

    impl Random {
        fn new(seed: u64) -> Self {
            Self((seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
        }

        /// Uniform in [−1, 1).
        fn signed(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// Values at n³ nodes, and the function that is trilinear between them.
    struct Values {
        n: usize,
        at: Vec<f64>,
    }

    impl Values {
        fn random(n: usize, seed: u64) -> Self {
            let mut random = Random::new(seed);
            (0..20).for_each(|_| _ = random.signed());
            Self { n, at: (0..n * n * n).map(|_| random.signed()).collect() }
        }

        fn value(&self, p: DVec3) -> f64 {
            between_nodes(&self.at, self.n, p)
        }

        /// The values at the nodes' x on a line along x, which is linear between them.
        fn along_x(&self, y: f64, z: f64) -> Vec<f64> {
            let n = self.n;
            let [j, k] = [y, z].map(|c| (c as usize).min(n - 2));
            let [u, v] = [y - j as f64, z - k as f64];
            let at = |i: usize, j: usize, k: usize| self.at[(k * n + j) * n + i];
            let on_plane = |i, k| (1.0 - u) * at(i, j, k) + u * at(i, j + 1, k);
            (0..n).map(|i| (1.0 - v) * on_plane(i, k) + v * on_plane(i, k + 1)).collect()
        }
    }

    /// The topology of a solid, as a set of points shows it.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Topology {
        /// The Euler characteristic of the solid; that of its surface is twice as large.
        euler: i64,
        solids: usize,
        /// The number of parts of the fluid, with the one outside.
        fluids: usize,
    }

    /// The topology of the positive set by brute force, with `per_cell` points to a cell side. Positive
    /// points are joined along the axes, and squares and cubes between them are filled; the other points are
    /// joined across corners as well. The roles are then exchanged. Where the points resolve the surface both
    /// ways agree; `None` if they do not.
    fn sampled(values: &Values, per_cell: usize) -> Option<Topology> {
        let side = (values.n - 1) * per_cell + 3; // a layer of fluid around
        let mut positive = vec![false; side.pow(3)];
        for k in 1..side - 1 {
            for j in 1..side - 1 {
                let place = |index: usize| (index - 1) as f64 / per_cell as f64;
                let nodes = values.along_x(place(j), place(k));
                for i in 1..side - 1 {
                    let cell = ((i - 1) / per_cell).min(values.n - 2);
                    let t = place(i) - cell as f64;
                    positive[(k * side + j) * side + i] = (1.0 - t) * nodes[cell] + t * nodes[cell + 1] > 0.0;
                }
            }
        }
        let [solid, fluid] = [true, false].map(|kind| parts(&positive, side, kind));
        // the complement of a solid in space has the solid's characteristic, plus one for the ball
        // at infinity
        let agree =
            solid.euler == fluid.euler - 1 && [solid, fluid].iter().all(|p| p.along_axes == p.across_corners);
        agree.then_some(Topology { euler: solid.euler, solids: solid.along_axes, fluids: fluid.along_axes })
    }

    /// The parts that points of one kind form.
    #[derive(Debug, Clone, Copy)]
    struct PointSet {
        /// The Euler characteristic of points, edges, filled squares and filled cubes.
        euler: i64,
        /// The number of parts if points are joined along the axes, and if they are joined across corners
        /// as well.
        along_axes: usize,
        across_corners: usize,
    }

    fn parts(positive: &[bool], side: usize, kind: bool) -> PointSet {
        let steps = [1, side, side * side];
        let is = |at: usize| positive[at] == kind;
        let mut parent: Vec<u32> = (0..positive.len() as u32).collect();
        let mut euler = 0;
        let mut mixed = Vec::new();
        for at in 0..positive.len() {
            let inner = [0, 1, 2].map(|axis: usize| at / steps[axis] % side + 1 < side);
            let mut corners = [false; 8];
            for (c, corner) in corners.iter_mut().enumerate() {
                let within = (0..3).all(|axis| c >> axis & 1 == 0 || inner[axis]);
                *corner = within && is(at + (0..3).map(|axis| (c >> axis & 1) * steps[axis]).sum::<usize>());
            }
            if inner == [true; 3] && corners.contains(&true) && corners.contains(&false) {
                mixed.push(at);
            }
            if !corners[0] {
                continue;
            }
            euler += 1;
            for (axis, step) in steps.into_iter().enumerate() {
                let (a, u, v) = (1 << axis, 1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
                if corners[a] {
                    euler -= 1;
                    unite(&mut parent, at, at + step);
                }
                euler += i64::from(corners[u] && corners[v] && corners[u | v]);
            }
            euler -= i64::from(corners == [true; 8]);
        }
        let count =
            |parent: &[u32]| (0..parent.len()).filter(|&at| is(at) && parent[at] as usize == at).count();
        let along_axes = count(&parent);
        for at in mixed {
            let corner = |c: usize| at + (0..3).map(|axis| (c >> axis & 1) * steps[axis]).sum::<usize>();
            let mut alike = (0..8).map(corner).filter(|&c| is(c));
            if let Some(first) = alike.next() {
                alike.for_each(|other| unite(&mut parent, first, other));
            }
        }
        PointSet { euler, along_axes, across_corners: count(&parent) }
    }

    fn find(parent: &mut [u32], mut at: usize) -> usize {
        while parent[at] as usize != at {
            parent[at] = parent[parent[at] as usize];
            at = parent[at] as usize;
        }
        at
    }

    fn unite(parent: &mut [u32], a: usize, b: usize) {
        let (a, b) = (find(parent, a), find(parent, b));
        parent[a.max(b)] = a.min(b) as u32;
    }

    /// Refines until `in_a_row` resolutions agree. `None` for fields that are too near to a change
    /// of topology.
    fn true_topology(values: &Values, resolutions: &[usize], in_a_row: usize) -> Option<Topology> {
        let mut agreeing: Vec<Topology> = Vec::new();
        for &per_cell in resolutions {
            let found = sampled(values, per_cell);
            agreeing.retain(|before| Some(*before) == found);
            agreeing.extend(found);
            if agreeing.len() == in_a_row {
                return found;
            }
        }
        None
    }

    /// Meshes a random grid by both methods and says whether the topology of each is right. `None` if the
    /// truth could not be found. Two resolutions may agree and still miss a tunnel between their points, so a
    /// mesh is called wrong only if three finer ones agree against it.
    fn is_right(n: usize, seed: u64) -> Option<[bool; 2]> {
        let values = Values::random(n, seed);
        let truth = true_topology(&values, &[6, 9, 14, 21], 2)?;
        let field = Formula(|p: DVec3| values.value(p));
        let domain = Aabb::new(DVec3::ZERO, DVec3::splat((n - 1) as f64));
        let grid = Grid::filling(&domain, Resolution::Spacing(1.0)).unwrap();
        let reports = [marching_cubes, dual_contouring].map(|method| {
            let report = check(&method(&field, &grid, &Unwatched).unwrap(), &field);
            assert!(report.closed && report.manifold, "grid {n}³ {seed}: {report:?}");
            report
        });
        assert!(reports[0].degenerate == 0, "grid {n}³ {seed}: {:?}", reports[0]);
        // the signs of volumes say which components are solids, but dual contouring may get those of a cell
        // or two wrong; its characteristic and its number of components are compared instead
        let matches = |truth: Topology| {
            let expected = (2 * truth.euler, truth.solids + truth.fluids - 1);
            let same = reports.each_ref().map(|report| (report.euler, report.components) == expected);
            [same[0] && reports[0].solids == truth.solids, same[1]]
        };
        if matches(truth) == [true; 2] {
            return Some([true; 2]);
        }
        let truth = true_topology(&values, &[31, 47, 70, 105], 3)?;
        let found = matches(truth);
        if found != [true; 2] {
            println!("grid {n}³ number {seed}: found {reports:?}, expected {truth:?}");
        }
        Some(found)
    }

    fn check_random_grids(counts: [(usize, u64); 5]) {
        for (n, count) in counts {
            let results: Vec<Option<[bool; 2]>> =
                (0..count).into_par_iter().map(|seed| is_right(n, seed)).collect();
            let unknown = results.iter().filter(|r| r.is_none()).count();
            let known = results.len() - unknown;
            let right = [0, 1].map(|method| results.iter().flatten().filter(|r| r[method]).count());
            println!(
                "{n}³ nodes: marching cubes {}, dual contouring {} right of {known}, {unknown} too near a change of \
                 topology to tell",
                right[0], right[1]
            );
            assert_eq!(right, [known; 2], "{n}³ nodes");
            assert!(unknown * 2 < results.len(), "{n}³ nodes: the oracle must know most grids");
        }
    }

    /// Meshes of a random trilinear grid have the interpolant's Euler characteristic and parts, as found by
    /// brute force on ever finer points. `RFM_THOUSANDS_OF_GRIDS=1 cargo test --release --lib random_grids`
    /// tries thirty thousand grids, which takes some minutes.
    #[test]
    fn random_grids_have_the_topology_of_the_interpolant() {
        check_random_grids(match std::env::var_os("RFM_THOUSANDS_OF_GRIDS") {
            None => [(2, 500), (3, 200), (4, 80), (5, 50), (6, 20)],
            Some(_) => [(2, 20_000), (3, 5000), (4, 3000), (5, 2000), (6, 1000)],
        });
    }
}
