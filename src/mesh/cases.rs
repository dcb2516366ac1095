//! Which triangles a cell gets, for each of the 256 ways its corners can lie inside or outside.
//!
//! Nothing is typed in: face rule → segments on each face → closed loops around the cell → triangles.
//!
//! Invariant 1: the two cells at a face put the same segments on it, because these depend on the four corners
//! of that face alone. So loops close up between cells.
//!
//! Invariant 2: no triangle has a side in a cell's face other than such a segment. Were a diagonal allowed
//! there, the neighbour could use the same one, and four triangles would meet in it.
//!
//! Numbering. Corner c: bit 0 of c is x, bit 1 y, bit 2 z. Edge e = 4·axis + place, from the corner that is low
//! on `axis` to the high one; bit 0 of `place` is the edge's position on the next axis (cyclically), bit 1 on
//! the one after. Face f = 2·axis + side.

use std::sync::LazyLock;

/// Edges of a cell.
pub(super) const EDGES: usize = 12;

/// What happens on a face whose inside corners lie on one diagonal and whose outside corners on the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ambiguous {
    /// Solid on both sides of a strip of fluid.
    #[cfg_attr(not(test), expect(dead_code, reason = "waits for a decision from the field's values"))]
    PartSolid,
    /// A strip of solid between two parts of fluid.
    JoinSolid,
}

/// The rule in force. A wall about as thin as a cell then stays connected and does not leak.
pub(super) const RULE: Ambiguous = Ambiguous::JoinSolid;

/// Triangles of all cases, as edges of the cell, counter-clockwise seen from the fluid.
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
            for polygon in loops(inside, [RULE; 6]) {
                let without_face_diagonals = triangulate(&polygon);
                triangles
                    .extend(without_face_diagonals.expect("under one rule for all faces every loop has one"));
            }
            first[usize::from(inside) + 1] = triangles.len();
        }
        Self { triangles, first }
    }

    /// Triangles of a cell; bit c of `inside` tells that corner c has ω > 0.
    pub(super) fn triangles(&self, inside: u8) -> &[[u8; 3]] {
        let case = usize::from(inside);
        &self.triangles[self.first[case]..self.first[case + 1]]
    }
}

/// Axis of an edge, and its low corner.
pub(super) const fn edge(e: usize) -> (usize, usize) {
    let axis = e / 4;
    (axis, (e & 1) << ((axis + 1) % 3) | (e >> 1 & 1) << ((axis + 2) % 3))
}

/// The edge between two neighbouring corners.
fn edge_between(a: usize, b: usize) -> usize {
    let axis = (a ^ b).trailing_zeros() as usize;
    let low = a & b;
    4 * axis + (low >> ((axis + 1) % 3) & 1) + 2 * (low >> ((axis + 2) % 3) & 1)
}

/// Corners of a face, counter-clockwise seen from outside the cell.
fn face_corners(face: usize) -> [usize; 4] {
    let (axis, side) = (face / 2, face % 2);
    let corner = |u: usize, v: usize| side << axis | u << ((axis + 1) % 3) | v << ((axis + 2) % 3);
    if side == 1 {
        [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]
    } else {
        [corner(0, 0), corner(0, 1), corner(1, 1), corner(1, 0)]
    }
}

/// Segments on one face, each from the edge where a walk around the face enters the solid to the one where it
/// leaves it: so directed, the loops turn counter-clockwise seen from the fluid.
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

/// Closed loops of crossed edges, given the decision for each face.
pub(super) fn loops(inside: u8, ambiguous: [Ambiguous; 6]) -> Vec<Vec<usize>> {
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

/// True if both edges border one face of the cell.
fn share_a_face(a: usize, b: usize) -> bool {
    (0..6).any(|face| {
        let corners = face_corners(face);
        let borders = |e| (0..4).any(|i| edge_between(corners[i], corners[(i + 1) % 4]) == e);
        borders(a) && borders(b)
    })
}

/// Twice the squared distance between the midpoints of two edges, in cell sides.
fn midpoint_distance(a: usize, b: usize) -> u32 {
    let doubled = |e: usize| -> [i32; 3] {
        let (axis, low) = edge(e);
        std::array::from_fn(|i| if i == axis { 1 } else { 2 * (low >> i & 1) as i32 })
    };
    let (p, q) = (doubled(a), doubled(b));
    (0..3).map(|i| (p[i] - q[i]).pow(2) as u32).sum()
}

/// The triangulation of a loop with the shortest diagonals, none of them in a face; `None` if there is none.
///
/// Dynamic programming over chains i..=j of the loop: `best[i][j]` is the least cost of the polygon which the
/// chain and its closing diagonal bound, with the corner that makes the triangle at that diagonal.
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

#[cfg(test)]
mod tests {
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

    /// The border of a cell's triangles must be the face segments, each once, in their direction: that, and
    /// segments agreeing between neighbours, makes any mesh closed and each of its edges shared by two.
    #[test]
    fn border_of_every_case_is_its_face_segments() {
        for inside in 0..=255_u8 {
            let mut sides: Vec<(usize, usize)> = CASES
                .triangles(inside)
                .iter()
                .flat_map(|t| (0..3).map(|i| (usize::from(t[i]), usize::from(t[(i + 1) % 3]))))
                .collect();
            let reversed: Vec<_> = sides.iter().map(|&(a, b)| (b, a)).collect();
            sides.retain(|side| !reversed.contains(side));
            sides.sort_unstable();
            let mut segments: Vec<_> = (0..6).flat_map(|face| face_segments(inside, face, RULE)).collect();
            segments.sort_unstable();
            assert_eq!(sides, segments, "case {inside:08b}");
        }
    }

    #[test]
    fn inner_sides_never_lie_in_a_face() {
        for inside in 0..=255_u8 {
            let segments: Vec<_> = (0..6).flat_map(|face| face_segments(inside, face, RULE)).collect();
            for t in CASES.triangles(inside) {
                for i in 0..3 {
                    let (a, b) = (usize::from(t[i]), usize::from(t[(i + 1) % 3]));
                    let is_segment = segments.contains(&(a, b));
                    assert!(is_segment || !share_a_face(a, b), "case {inside:08b}, side {a}-{b}");
                }
            }
        }
    }

    #[test]
    fn every_crossed_edge_is_used_and_no_other() {
        for inside in 0..=255_u8 {
            let used = |e| CASES.triangles(inside).iter().flatten().any(|&v| usize::from(v) == e);
            assert!((0..EDGES).all(|e| used(e) == crossed(inside, e)), "case {inside:08b}");
            assert!(CASES.triangles(inside).len() <= 5, "case {inside:08b}");
        }
    }

    #[test]
    fn neighbours_put_the_same_segments_on_their_common_face() {
        for axis in 0..3 {
            for corners in 0..16_u8 {
                // The same four corners as the high face of one cell and the low face of the next.
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

    /// Loops exist for each free choice on the faces; those with no plain triangulation need an inner vertex.
    #[test]
    fn free_choice_of_faces_gives_loops_that_need_inner_vertices_only_when_long() {
        for inside in 0..=255_u8 {
            for choice in 0..64 {
                let pick =
                    |f: usize| if choice >> f & 1 == 1 { Ambiguous::JoinSolid } else { Ambiguous::PartSolid };
                let found = loops(inside, std::array::from_fn(pick));
                let crossed_edges = (0..EDGES).filter(|&e| crossed(inside, e)).count();
                assert_eq!(found.iter().map(Vec::len).sum::<usize>(), crossed_edges);
                assert!(found.iter().all(|l| l.len() >= 8 || triangulate(l).is_some()));
            }
        }
    }
}
