//! The triangles of a cell, for each of the 256 ways in which its corners can lie inside or outside.
//!
//! The table is derived, not typed in: a rule gives the segments on each face, these form closed loops around
//! the cell, and the loops are triangulated.
//!
//! Invariant 1: the two cells at a face put the same segments on it, because segments depend on the four
//! corners of the face alone. So loops close up between cells.
//!
//! Invariant 2: no triangle has a side in a cell's face other than such a segment. If a diagonal were allowed
//! there, the neighbour could use it too, and four triangles would meet in it.
//!
//! Numbering. Corner c: bit 0 of c is x, bit 1 y, bit 2 z. Edge e = 4·axis + place, from the corner that is
//! low on `axis` to the high one; bit 0 of `place` is the edge's position on the next axis (cyclically), bit
//! 1 on the one after. Face f = 2·axis + side.

use std::sync::LazyLock;

/// The number of edges of a cell.
pub(super) const EDGES: usize = 12;

/// The number of faces of a cell.
pub(super) const FACES: usize = 6;

/// The decision on a face whose inside corners lie on one diagonal and whose outside corners lie on
/// the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ambiguous {
    /// There is solid on both sides of a strip of fluid.
    PartSolid,
    /// There is a strip of solid between two parts of fluid.
    JoinSolid,
}

/// The triangles of all cells that the signs alone decide. Their corners are edges of the cell,
/// counter-clockwise as seen from the fluid.
pub(super) struct Cases {
    triangles: Vec<[u8; 3]>,
    first: [usize; 257],
}

/// The table, made on first use.
pub(super) static CASES: LazyLock<Cases> = LazyLock::new(Cases::new);

impl Cases {
    fn new() -> Self {
        let mut triangles = Vec::new();
        let mut first = [0; 257];
        for inside in 0..=255_u8 {
            if !needs_values(inside) {
                // no face of such a case is ambiguous
                let polygons = loops(inside, [Ambiguous::JoinSolid; FACES]);
                let without_face_diagonals = polygons.iter().map(|polygon| triangulate(polygon));
                triangles
                    .extend(without_face_diagonals.flat_map(|found| found.expect("every such loop has one")));
            }
            first[usize::from(inside) + 1] = triangles.len();
        }
        Self { triangles, first }
    }

    /// The triangles of a cell; bit c of `inside` is set if corner c has ω > 0. Empty for cells that
    /// need values.
    pub(super) fn triangles(&self, inside: u8) -> &[[u8; 3]] {
        let case = usize::from(inside);
        &self.triangles[self.first[case]..self.first[case + 1]]
    }
}

/// Whether the signs leave a choice: on a face, or between two like corners opposite one another in the cell,
/// which a tunnel may join.
pub(super) fn needs_values(inside: u8) -> bool {
    let is_inside = |corner: usize| inside >> corner & 1 == 1;
    let ambiguous = |face: usize| is_ambiguous(face_corners(face).map(is_inside));
    let opposite = |mask: u8| mask.count_ones() == 2 && mask == mask.reverse_bits();
    (0..FACES).any(ambiguous) || opposite(inside) || opposite(!inside)
}

/// Whether the corners around a face lie inside and outside in turn.
pub(super) fn is_ambiguous([a, b, c, d]: [bool; 4]) -> bool {
    a == c && b == d && a != b
}

/// Two loops that bound a tunnel, and the closed line around its waist.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tunnel {
    pub loops: [usize; 2],
    /// The corners of that line in the cell [0, 1]³.
    pub waist: [[f64; 3]; 6],
}

/// The position of a vertex within the cell, before it is put on the surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum InnerVertex {
    /// In the middle of the vertices on these edges.
    Amidst(Vec<usize>),
    /// At a point of the cell [0, 1]³.
    At([f64; 3]),
}

/// The triangles of a cell for which the values at its corners were needed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CellTriangles {
    /// Corners are edges of the cell, and from [`EDGES`] on inner vertices.
    pub triangles: Vec<[u8; 3]>,
    pub inner: Vec<InnerVertex>,
}

impl CellTriangles {
    /// A disc for each loop, except for the two that bound a tunnel.
    pub(super) fn new(loops: &[Vec<usize>], tunnel: Option<Tunnel>) -> Self {
        let mut patch = Self { triangles: Vec::new(), inner: Vec::new() };
        for (number, polygon) in loops.iter().enumerate() {
            match tunnel {
                Some(Tunnel { loops: [a, b], waist }) if number == b => {
                    patch.add_tunnel(&loops[a], polygon, &waist)
                }
                Some(Tunnel { loops: [a, _], .. }) if number == a => {}
                _ => patch.add_disc(polygon),
            }
        }
        patch
    }

    /// Adds a disc without inner vertices, or else a fan around one.
    fn add_disc(&mut self, polygon: &[usize]) {
        match triangulate(polygon) {
            Some(triangles) => self.triangles.extend(triangles),
            None => {
                let centre = (EDGES + self.inner.len()) as u8;
                let next = polygon.iter().cycle().skip(1);
                self.triangles.extend(polygon.iter().zip(next).map(|(&a, &b)| [a as u8, b as u8, centre]));
                self.inner.push(InnerVertex::Amidst(polygon.to_vec()));
            }
        }
    }

    /// Adds a tube between two loops, or else a tube from each loop to the waist.
    fn add_tunnel(&mut self, a: &[usize], b: &[usize], waist: &[[f64; 3]; 6]) {
        let first = EDGES + self.inner.len();
        let place = |v: usize| if v < EDGES { midpoint(v) } else { waist[v - first] };
        if let Some((_, triangles)) = tube(a, b, &place) {
            self.triangles.extend(triangles);
            return;
        }
        // no cross edge to the waist lies in a face, so both tubes exist; the waist runs in the direction
        // that makes them shorter
        let ring: Vec<usize> = (first..first + waist.len()).collect();
        let back: Vec<usize> = ring.iter().rev().copied().collect();
        let tubes = [(&ring, &back), (&back, &ring)].into_iter().filter_map(|(one, other)| {
            let (one, other) = (tube(a, one, &place)?, tube(other, b, &place)?);
            Some((one.0 + other.0, [one.1, other.1]))
        });
        if let Some((_, both)) = tubes.min_by_key(|(cost, _)| *cost) {
            self.inner.extend(waist.map(InnerVertex::At));
            self.triangles.extend(both.into_iter().flatten());
        }
    }
}

/// The axis of an edge, and its low corner.
pub(super) const fn edge(e: usize) -> (usize, usize) {
    let axis = e / 4;
    (axis, (e & 1) << ((axis + 1) % 3) | (e >> 1 & 1) << ((axis + 2) % 3))
}

/// The edge between two neighbouring corners.
pub(super) fn edge_between(a: usize, b: usize) -> usize {
    let axis = (a ^ b).trailing_zeros() as usize;
    let low = a & b;
    4 * axis + (low >> ((axis + 1) % 3) & 1) + 2 * (low >> ((axis + 2) % 3) & 1)
}

/// The corners of a face, counter-clockwise as seen from outside the cell.
pub(super) fn face_corners(face: usize) -> [usize; 4] {
    let (axis, side) = (face / 2, face % 2);
    let corner = |u: usize, v: usize| side << axis | u << ((axis + 1) % 3) | v << ((axis + 2) % 3);
    if side == 1 {
        [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
    } else {
        [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)]
    }
}

/// The segments on one face. Each leads from the edge where a walk around the face enters the solid to the
/// edge where it leaves it. The loops then turn counter-clockwise as seen from the fluid.
fn face_segments(inside: u8, face: usize, ambiguous: Ambiguous) -> Vec<(usize, usize)> {
    let corners = face_corners(face);
    let is_inside = |i: usize| inside >> corners[i % 4] & 1 == 1;
    let edge_after = |i: usize| edge_between(corners[i % 4], corners[(i + 1) % 4]);
    let enters: Vec<usize> = (0..4).filter(|&i| !is_inside(i) && is_inside(i + 1)).collect();
    let leave_after = |i: usize| (i + 1..i + 4).find(|&j| is_inside(j) && !is_inside(j + 1)).unwrap_or(i);
    let pairs = enters.iter().map(|&i| match (enters.len(), ambiguous) {
        (2, Ambiguous::JoinSolid) => (i, i + 3), // around the outside corner just left behind
        _ => (i, leave_after(i)),
    });
    pairs.map(|(enter, leave)| (edge_after(enter), edge_after(leave))).collect()
}

/// The closed loops of crossed edges, for given decisions about the faces.
pub(super) fn loops(inside: u8, ambiguous: [Ambiguous; FACES]) -> Vec<Vec<usize>> {
    let mut next = [None; EDGES];
    for (face, decision) in ambiguous.into_iter().enumerate() {
        for (from, to) in face_segments(inside, face, decision) {
            next[from] = Some(to);
        }
    }
    let mut found = Vec::new();
    for start in 0..EDGES {
        let mut polygon = Vec::new();
        let mut at = start;
        while let Some(to) = next[at].take() {
            polygon.push(at);
            at = to;
        }
        if !polygon.is_empty() {
            found.push(polygon);
        }
    }
    found
}

/// Whether both edges border one face of the cell.
fn share_a_face(a: usize, b: usize) -> bool {
    (0..6).any(|face| {
        let corners = face_corners(face);
        let borders = |e| (0..4).any(|i| edge_between(corners[i], corners[(i + 1) % 4]) == e);
        borders(a) && borders(b)
    })
}

/// The middle of an edge in the cell [0, 1]³.
fn midpoint(e: usize) -> [f64; 3] {
    let (axis, low) = edge(e);
    std::array::from_fn(|i| if i == axis { 0.5 } else { (low >> i & 1) as f64 })
}

/// Four times the squared distance between the midpoints of two edges, in cell sides.
fn midpoint_distance(a: usize, b: usize) -> u32 {
    let (p, q) = (midpoint(a), midpoint(b));
    (0..3).map(|i| (4.0 * (p[i] - q[i]).powi(2)) as u32).sum()
}

/// The triangulation of a loop with the shortest diagonals, none of which lies in a face. `None` if there is
/// no such triangulation.
///
/// This is dynamic programming over chains i..=j of the loop. `best[i][j]` is the least cost of the polygon
/// between the chain and its closing diagonal, with the corner of the triangle at that diagonal.
fn triangulate(polygon: &[usize]) -> Option<Vec<[u8; 3]>> {
    let n = polygon.len();
    let diagonal_cost = |i: usize, j: usize| match (j - i == 1 || j - i == n - 1, polygon[i], polygon[j]) {
        (true, ..) => Some(0),
        (false, a, b) if share_a_face(a, b) => None,
        (false, a, b) => Some(midpoint_distance(a, b)),
    };
    let mut best = vec![vec![Some((0, 0)); n]; n];
    for length in 2..n {
        for i in 0..n - length {
            let j = i + length;
            let apexes = (i + 1..j).filter_map(|k| Some((best[i][k]?.0 + best[k][j]?.0, k)));
            let cheapest = apexes.min();
            best[i][j] = cheapest.and_then(|(cost, k)| Some((cost + diagonal_cost(i, j)?, k)));
        }
    }
    best[0][n - 1]?;
    let mut triangles = Vec::with_capacity(n - 2);
    let mut chains = vec![(0, n - 1)];
    while let Some((i, j)) = chains.pop() {
        if j - i >= 2 {
            let (_, k) = best[i][j]?;
            triangles.push([polygon[i], polygon[k], polygon[j]].map(|e| e as u8));
            chains.extend([(k, j), (i, k)]);
        }
    }
    Some(triangles)
}

/// The tube between two loops that run around it in opposite directions, with the shortest cross edges, none
/// of which lies in a face; and its cost. `None` if there is no such tube. Vertices from [`EDGES`] on lie
/// within the cell.
///
/// A tube is a walk around both loops at once. The cross edge at (i, j) joins corner i of `a` to corner j of
/// the reversed `b`, and a triangle leads from there to (i + 1, j) or to (i, j + 1).
pub(super) fn tube(
    a: &[usize],
    b: &[usize],
    place: &impl Fn(usize) -> [f64; 3],
) -> Option<(u32, Vec<[u8; 3]>)> {
    let cost = |p: usize, q: usize| {
        let (from, to) = (place(p), place(q));
        let squared: f64 = (0..3).map(|i| (from[i] - to[i]).powi(2)).sum();
        let in_face = p < EDGES && q < EDGES && share_a_face(p, q);
        (!in_face).then_some((4096.0 * squared) as u32) // whole numbers compare the same everywhere
    };
    let walks = (0..b.len()).filter_map(|start| {
        let back: Vec<usize> = b.iter().rev().cycle().skip(start).take(b.len()).copied().collect();
        let (cost, steps) = shortest_walk(a, &back, &cost)?;
        Some((cost, start, back, steps))
    });
    let (cost, _, b, steps) = walks.min_by_key(|&(cost, start, ..)| (cost, start))?;
    let (mut i, mut j) = (0, 0);
    let mut triangles = Vec::with_capacity(steps.len());
    for along_a in steps {
        let (p, q) = (a[i % a.len()], b[j % b.len()]);
        if along_a {
            i += 1;
            triangles.push([p, a[i % a.len()], q].map(|e| e as u8));
        } else {
            j += 1;
            triangles.push([b[j % b.len()], q, p].map(|e| e as u8));
        }
    }
    Some((cost, triangles))
}

/// The cheapest walk from (0, 0) once around both loops, with its cost. A step is `true` if it goes along
/// `a`. The walk begins with a step along `a` and ends with one along `b`, as every tube does from one of its
/// cross edges. It turns more than once: a walk that went all around one loop at a single corner of the other
/// would meet that cross edge twice.
fn shortest_walk(
    a: &[usize],
    b: &[usize],
    cost: &impl Fn(usize, usize) -> Option<u32>,
) -> Option<(u32, Vec<bool>)> {
    let (m, n) = (a.len(), b.len());
    cost(a[0], b[0])?;
    // least cost to (i, j) in the first run along a, in the first run along b, and later, with the last step
    // and the run it came from
    let mut best = vec![vec![[None::<(u32, bool, usize)>; 3]; n + 1]; m + 1];
    best[0][0][0] = Some((0, true, 0));
    for i in 1..=m {
        for j in 0..=n {
            let along_a =
                |run: usize| best[i - 1][j][run].filter(|_| j < n).map(|(sum, ..)| (sum, true, run));
            let reached = match j {
                0 => [along_a(0), None, None],
                _ => {
                    let along_b = |run: usize| best[i][j - 1][run].map(|(sum, ..)| (sum, false, run));
                    let second = along_b(0).into_iter().chain(along_b(1)).min();
                    [along_a(0), second, [along_a(1), along_a(2), along_b(2)].into_iter().flatten().min()]
                }
            };
            let here = cost(a[i % m], b[j % n]);
            best[i][j] =
                reached.map(|found| found.and_then(|(sum, step, run)| Some((sum + here?, step, run))));
        }
    }
    let (sum, ..) = best[m][n][2]?;
    let (mut i, mut j, mut run) = (m, n, 2);
    let mut steps = Vec::with_capacity(m + n);
    while (i, j) != (0, 0) {
        let (_, along_a, from) = best[i][j][run]?;
        steps.push(along_a);
        run = from;
        if along_a { i -= 1 } else { j -= 1 }
    }
    steps.reverse();
    Some((sum, steps))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn crossed(inside: u8, e: usize) -> bool {
        let (axis, low) = edge(e);
        (inside >> low ^ inside >> (low | 1 << axis)) & 1 == 1
    }

    #[test]
    fn edges_and_corners_agree() {
        for e in 0..EDGES {
            let (axis, low) = edge(e);
            assert_eq!(edge_between(low, low | 1 << axis), e);
        }
    }

    /// All decisions about the ambiguous faces of a case. Those about other faces do not vary.
    fn choices(inside: u8) -> impl Iterator<Item = [Ambiguous; FACES]> {
        let is_inside = move |corner: usize| inside >> corner & 1 == 1;
        let is_ambiguous = move |face: usize| {
            let [a, b, c, d] = face_corners(face).map(is_inside);
            a == c && b == d && a != b
        };
        let free = (0..FACES).filter(|&face| is_ambiguous(face)).fold(0, |mask, face| mask | 1 << face);
        (0..64_u8).filter(move |choice| choice & !free == 0).map(|choice| {
            let pick =
                |f: usize| if choice >> f & 1 == 1 { Ambiguous::JoinSolid } else { Ambiguous::PartSolid };
            std::array::from_fn(pick)
        })
    }

    /// The border of a cell's triangles must be the face segments, each once, in their direction. Because
    /// neighbours agree about segments, any mesh is then closed and each of its edges is shared by two
    /// triangles. Within the cell, too, each side must have one partner.
    #[track_caller]
    fn check_triangles(inside: u8, faces: [Ambiguous; FACES], triangles: &[[u8; 3]]) {
        let side = |t: &[u8; 3], i: usize| (usize::from(t[i]), usize::from(t[(i + 1) % 3]));
        let mut sides: Vec<_> = triangles.iter().flat_map(|t| (0..3).map(move |i| side(t, i))).collect();
        sides.sort_unstable();
        assert!(sides.windows(2).all(|pair| pair[0] != pair[1]), "case {inside:08b}: a side met twice");
        let mut segments: Vec<_> = (0..FACES).flat_map(|f| face_segments(inside, f, faces[f])).collect();
        segments.sort_unstable();
        for &(a, b) in &sides {
            let is_segment = segments.contains(&(a, b));
            let inner = a >= EDGES || b >= EDGES;
            assert!(is_segment || inner || !share_a_face(a, b), "case {inside:08b}, side {a}-{b}");
        }
        let reversed: Vec<_> = sides.iter().map(|&(a, b)| (b, a)).collect();
        sides.retain(|side| !reversed.contains(side));
        assert_eq!(sides, segments, "case {inside:08b}");
        for e in 0..EDGES {
            let used = triangles.iter().flatten().any(|&v| usize::from(v) == e);
            assert_eq!(used, crossed(inside, e), "case {inside:08b}, edge {e}");
        }
    }

    /// Vertices − edges + triangles, the border included.
    fn euler(triangles: &[[u8; 3]]) -> i32 {
        let vertices: BTreeSet<u8> = triangles.iter().flatten().copied().collect();
        let edges: BTreeSet<(u8, u8)> = triangles
            .iter()
            .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        vertices.len() as i32 - edges.len() as i32 + triangles.len() as i32
    }

    #[test]
    fn cases_that_signs_decide_are_bounded_by_their_face_segments() {
        for inside in (0..=255).filter(|&inside| !needs_values(inside)) {
            let faces = [Ambiguous::PartSolid; FACES];
            check_triangles(inside, faces, CASES.triangles(inside));
            assert!(CASES.triangles(inside).len() <= 5, "case {inside:08b}");
        }
    }

    #[test]
    fn patches_of_discs_are_bounded_by_their_face_segments_for_any_choice() {
        for inside in 0..=255_u8 {
            for faces in choices(inside) {
                let polygons = loops(inside, faces);
                let patch = CellTriangles::new(&polygons, None);
                check_triangles(inside, faces, &patch.triangles);
                assert_eq!(euler(&patch.triangles), polygons.len() as i32);
                assert!(
                    patch.inner.len() <= 1
                        && polygons.iter().all(|l| l.len() >= 8 || triangulate(l).is_some())
                );
            }
        }
    }

    #[test]
    fn any_two_loops_can_be_joined_by_a_tunnel() {
        let waist = [
            [0.6, 0.4, 0.4],
            [0.6, 0.6, 0.4],
            [0.4, 0.6, 0.4],
            [0.4, 0.6, 0.6],
            [0.4, 0.4, 0.6],
            [0.6, 0.4, 0.6],
        ];
        // the second is far from both loops
        let waists = [waist, waist.map(|p| p.map(|c| 0.01 * c))];
        let (mut direct, mut at_waist) = (0, 0);
        for inside in 0..=255_u8 {
            for faces in choices(inside) {
                let polygons = loops(inside, faces);
                for (a, b) in (0..polygons.len()).flat_map(|b| (0..b).map(move |a| (a, b))) {
                    let (loops, choice) = ([a, b], usize::from(inside) % 2);
                    let patch = CellTriangles::new(&polygons, Some(Tunnel { loops, waist: waists[choice] }));
                    check_triangles(inside, faces, &patch.triangles);
                    assert_eq!(euler(&patch.triangles), polygons.len() as i32 - 2);
                    let ring = patch.inner.iter().any(|inner| matches!(inner, InnerVertex::At(_)));
                    *(if ring { &mut at_waist } else { &mut direct }) += 1;
                }
            }
        }
        assert!(direct > 0 && at_waist > 0, "{direct} {at_waist}");
    }

    #[test]
    fn neighbours_put_the_same_segments_on_their_common_face() {
        for axis in 0..3 {
            for corners in 0..16_u8 {
                // the same four corners as the high face of one cell and as the low face of the next
                let place = |side: usize| -> u8 {
                    (0..4).filter(|i| corners >> i & 1 == 1).fold(0, |mask, i| {
                        mask | 1
                            << (side << axis | (i & 1) << ((axis + 1) % 3) | (i >> 1) << ((axis + 2) % 3))
                    })
                };
                for rule in [Ambiguous::PartSolid, Ambiguous::JoinSolid] {
                    let flat = |side: usize| {
                        let of = face_segments(place(side), 2 * axis + side, rule);
                        let flat = |e: usize| (e / 4, edge(e).1 & !(1 << axis));
                        of.into_iter().map(|(a, b)| (flat(a), flat(b))).collect::<Vec<_>>()
                    };
                    let (mut low, high) = (flat(0), flat(1));
                    let mut mirrored: Vec<_> = high.into_iter().map(|(a, b)| (b, a)).collect();
                    low.sort_unstable();
                    mirrored.sort_unstable();
                    assert_eq!(low, mirrored, "axis {axis}, corners {corners:04b}, {rule:?}");
                }
            }
        }
    }

    /// One corner inside: the triangle's normal must point away from it.
    #[test]
    fn single_corner_faces_the_fluid() {
        assert_eq!(CASES.triangles(1).len(), 1);
        let [a, b, c] = CASES.triangles(1)[0];
        let smallest = a.min(b).min(c);
        let turned = [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|t| t[0] == smallest).unwrap();
        assert_eq!(turned, [0, 4, 8], "x, y, z edges of corner 0 in right-handed order");
    }
}
