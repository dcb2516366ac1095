//! Cells that signs alone do not decide. The values at their corners are evaluated, and their triangles are
//! made one by one. Smooth surfaces have few of them.

use glam::DVec3;

use super::{
    ambiguity,
    cases::{Ambiguous, CellTriangles, FACES, InnerVertex, Tunnel, edge, face_corners, is_ambiguous, loops},
    diagonals,
    prune::{BRICK, Lattice},
    signs::{Around, crossed_cells, set_positions},
};
use crate::field::{Field, Points};

/// The triangles of one cell of a brick.
#[derive(Debug, Clone)]
pub(super) struct CellPatch {
    /// The cell's plane, and its bit in the plane.
    pub cell: (usize, usize),
    /// Corners are edges of the cell, and from `cases::EDGES` on inner vertices.
    pub triangles: Vec<[u8; 3]>,
    /// The positions of the inner vertices, on ω = 0.
    pub inner: Vec<DVec3>,
}

/// The patches of the cells of a brick that need one, in the order of planes and bits. `low` are the extended
/// indices of the brick's first node. Adds to the number of evaluations.
pub(super) fn find(
    field: &dyn Field,
    lattice: &Lattice,
    low: [usize; 3],
    around: &Around,
    evaluations: &mut u64,
) -> Vec<CellPatch> {
    let mut found = Vec::new();
    for ((z, bit), cell) in CellValues::of_brick(field, lattice, low, around, evaluations) {
        let CellTriangles { triangles, inner } = cell.patch();
        let inner =
            inner.iter().map(|inner| cell.on_surface(field, cell.place(inner), evaluations)).collect();
        found.push(CellPatch { cell: (z, bit), triangles, inner });
    }
    found
}

/// The planes and bits of a brick's cells that signs alone do not decide, ascending.
fn undecided(around: &Around) -> impl Iterator<Item = (usize, usize)> {
    let planes = (0..BRICK).map(|z| (z, around.corners(z)));
    let crossed = planes.filter(|(_, corners)| crossed_cells(corners) != 0);
    crossed.flat_map(|(z, corners)| set_positions(undecided_cells(&corners)).map(move |bit| (z, bit)))
}

/// The extended indices of the low corner of a cell, given by its plane and bit, of the brick at `low`.
pub(super) fn cell_low(low: [usize; 3], (z, bit): (usize, usize)) -> [usize; 3] {
    [low[0] + bit % BRICK, low[1] + bit / BRICK, low[2] + z]
}

/// The cells with an ambiguous face, or with two opposite corners that differ from all others. This is
/// `cases::needs_values` for 64 cells at once.
pub(super) fn undecided_cells(corners: &[u64; 8]) -> u64 {
    let mut found = 0;
    for face in 0..6 {
        let [a, b, c, d] = face_corners(face).map(|corner| corners[corner]);
        found |= !(a ^ c) & !(b ^ d) & (a ^ b);
    }
    for first in 0..4 {
        let others = (0..8).filter(|&c| c != first && c != 7 - first);
        let (some, all) = others.fold((0, u64::MAX), |(some, all), c| (some | corners[c], all & corners[c]));
        let (a, b) = (corners[first], corners[7 - first]);
        found |= (a & b & !some) | (!a & !b & all);
    }
    found
}

/// A cell with the values at its corners.
pub(super) struct CellValues {
    low: DVec3,
    high: DVec3,
    values: ambiguity::Corners,
    /// How the corners of ambiguous faces are joined.
    faces: [Ambiguous; FACES],
    /// Whether ω joins them in another way than the values.
    is_kinked: bool,
}

impl CellValues {
    /// The cells of a brick that signs alone do not decide, with their planes and bits, in the order of
    /// [`undecided`]. `low` are the extended indices of the brick's first node.
    pub(super) fn of_brick(
        field: &dyn Field,
        lattice: &Lattice,
        low: [usize; 3],
        around: &Around,
        evaluations: &mut u64,
    ) -> Vec<((usize, usize), Self)> {
        let cells: Vec<(usize, usize)> = undecided(around).collect();
        let corners = |cell: (usize, usize)| {
            let low = cell_low(low, cell);
            (0..8).map(move |corner: usize| [0, 1, 2].map(|axis: usize| low[axis] + (corner >> axis & 1)))
        };
        let nodes: Vec<[usize; 3]> = cells.iter().flat_map(|&cell| corners(cell)).collect();
        let positions: Vec<DVec3> = nodes.iter().map(|&node| lattice.position(node)).collect();
        let [x, y, z] = [0, 1, 2].map(|axis: usize| positions.iter().map(|p| p[axis]).collect::<Vec<f64>>());
        let mut values = vec![0.0; nodes.len()];
        field.continuous_many(Points { x: &x, y: &y, z: &z }, &mut values);
        for (node, value) in nodes.iter().zip(&mut values) {
            if (0..3).any(|axis| lattice.is_ring(axis, node[axis])) {
                *value = f64::NEG_INFINITY;
            }
        }
        let of = |(i, cell): (usize, (usize, usize))| {
            let values = std::array::from_fn(|corner| values[8 * i + corner]);
            let (low, high, faces) = (positions[8 * i], positions[8 * i + 7], ambiguity::faces(&values));
            (cell, Self { low, high, values, faces, is_kinked: false })
        };
        *evaluations += nodes.len() as u64;
        let mut found: Vec<((usize, usize), Self)> = cells.into_iter().enumerate().map(of).collect();
        Self::look_along_diagonals(field, &mut found, evaluations);
        found
    }

    /// Lets ω decide about ambiguous faces where it can.
    fn look_along_diagonals(field: &dyn Field, cells: &mut [((usize, usize), Self)], evaluations: &mut u64) {
        let mut places = Vec::new();
        let mut faces = Vec::new();
        for (number, (_, cell)) in cells.iter().enumerate() {
            for face in 0..FACES {
                let mut around = face_corners(face);
                let value = |i: usize| cell.values[around[i]];
                let inside = [0, 1, 2, 3].map(|i| value(i) > 0.0);
                let leaves_grid = (0..4).any(|i| value(i) == f64::NEG_INFINITY);
                if !is_ambiguous(inside) || leaves_grid {
                    continue;
                }
                if !inside[0] {
                    around.rotate_left(1);
                }
                places.push((number, face));
                faces.push(around.map(|corner| (cell.corner(corner), cell.values[corner])));
            }
        }
        for ((number, face), joined) in places.into_iter().zip(diagonals::joined(field, &faces, evaluations))
        {
            let cell = &mut cells[number].1;
            if let Some(joined) = joined
                && joined != cell.faces[face]
            {
                cell.faces[face] = joined;
                cell.is_kinked = true;
            }
        }
    }

    /// The cell's loops of crossed edges, and the two of them that bound a tunnel, if any do. Where ω is not
    /// as its values say, there is none.
    pub(super) fn loops(&self) -> (Vec<Vec<usize>>, Option<Tunnel>) {
        let polygons = loops(ambiguity::inside(&self.values), self.faces);
        let tunnel = if self.is_kinked { None } else { ambiguity::tunnel(&self.values, &polygons) };
        (polygons, tunnel)
    }

    fn patch(&self) -> CellTriangles {
        let (polygons, tunnel) = self.loops();
        CellTriangles::new(&polygons, tunnel)
    }

    fn corner(&self, corner: usize) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis: usize| [self.low, self.high][corner >> axis & 1][axis]))
    }

    fn place(&self, inner: &InnerVertex) -> DVec3 {
        match inner {
            InnerVertex::At(share) => self.low + DVec3::from_array(*share) * (self.high - self.low),
            InnerVertex::Amidst(edges) => {
                edges.iter().map(|&e| self.on_edge(e)).sum::<DVec3>() / edges.len() as f64
            }
        }
    }

    /// The point of an edge at which the straight line between the values at its ends is zero.
    fn on_edge(&self, e: usize) -> DVec3 {
        let (axis, low) = edge(e);
        let (f0, f1) = (self.values[low], self.values[low | 1 << axis]);
        let share = f0 / (f0 - f1);
        self.corner(low).lerp(self.corner(low | 1 << axis), if share.is_finite() { share } else { 0.5 })
    }

    /// A point of ω = 0 near a point of the cell.
    fn on_surface(&self, field: &dyn Field, middle: DVec3, evaluations: &mut u64) -> DVec3 {
        *evaluations += 1;
        let value = field.omega(middle);
        // along the axes to the faces, and to the corners; some of them lie on the other side
        let to_face = |i: usize| {
            let mut end = middle;
            end[i % 3] = [self.low, self.high][i / 3][i % 3];
            end
        };
        let ends = (0..6).map(to_face).chain((0..8).map(|corner| self.corner(corner)));
        let across = ends.filter_map(|end| {
            *evaluations += 1;
            let other = field.omega(end);
            let distance = middle.distance(end) * value.abs() / (value.abs() + other.abs());
            ((other > 0.0) != (value > 0.0)).then_some((distance, end))
        });
        let nearest = across.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map_or(middle, |(_, end)| bisect(field, middle, end, value > 0.0, evaluations))
    }
}

/// The point between `from` and `to` at which the sign of ω changes, by halving until no number lies between.
fn bisect(
    field: &dyn Field,
    mut from: DVec3,
    mut to: DVec3,
    from_is_inside: bool,
    evaluations: &mut u64,
) -> DVec3 {
    loop {
        let middle = from.midpoint(to);
        if middle == from || middle == to {
            return from;
        }
        *evaluations += 1;
        if (field.omega(middle) > 0.0) == from_is_inside { from = middle } else { to = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::super::cases::needs_values;
    use super::*;

    #[test]
    fn many_cells_at_once_are_judged_like_one() {
        for first in (0..256_usize).step_by(64) {
            let corners: [u64; 8] =
                std::array::from_fn(|c| (0..64).fold(0, |bits, i| bits | ((first + i) as u64 >> c & 1) << i));
            let found = undecided_cells(&corners);
            for i in 0..64 {
                assert_eq!(found >> i & 1 == 1, needs_values((first + i) as u8), "case {:08b}", first + i);
            }
        }
    }
}
