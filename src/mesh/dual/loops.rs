//! The closed loops of crossed edges of a cell. Each runs around a sheet of the surface and becomes a vertex.
//!
//! The loops are those of marching cubes. Where the signs leave a choice, on a face or about a tunnel, the
//! corners' values decide (see `ambiguity`). A single vertex at either end of a tunnel would close the
//! tunnel. There each loop becomes a ring of vertices, one at each passage through a face, and a tube joins
//! the rings.

use std::sync::LazyLock;

use smallvec::SmallVec;

use super::super::{
    cases::{Ambiguous, FACES, loops, needs_values},
    patches::CellValues,
    prune::{BRICK, Lattice},
    signs::{Around, crossed_cells, inside_corners, set_positions},
};
use crate::field::Field;

/// A loop around the surface's part in a cell.
#[derive(Debug, Clone)]
pub(super) struct Loop {
    /// Edges of the cell, numbered as in the table of cases, in the order of the loop.
    pub edges: SmallVec<[u8; 12]>,
    /// Pairs of neighbours in the loop, by their places in it, that lie in a face which the loop passes
    /// twice. Two cells whose loops both pass their common face twice would be joined by two edges of the
    /// mesh with the same ends.
    pub twice: Vec<[u8; 2]>,
}

/// The loops of all cases that the signs alone decide. The lists of other cases are empty.
pub(super) static LOOPS: LazyLock<Vec<Vec<Loop>>> = LazyLock::new(|| {
    let of_case = |inside: u8| match needs_values(inside) {
        true => Vec::new(),
        // no face of such a case is ambiguous
        false => loops(inside, [Ambiguous::JoinSolid; FACES]).iter().map(|l| Loop::of(l)).collect(),
    };
    (0..=255).map(of_case).collect()
});

/// The loops of a cell that signs alone do not decide.
#[derive(Debug, Clone)]
pub(super) struct CellLoops {
    /// The cell's plane, and its bit in the plane.
    pub cell: (usize, usize),
    pub loops: Vec<Loop>,
    /// The two loops that bound a tunnel.
    pub tunnel: Option<[usize; 2]>,
}

/// The sheets of the surface in the cells of a brick.
#[derive(Debug, Clone)]
pub(super) struct Sheets {
    pub undecided: Vec<CellLoops>,
    /// The number of vertices. Those of cells that signs decide come first.
    pub vertices: usize,
    pub evaluations: u64,
}

impl Sheets {
    /// The sheets of the brick whose first node has the extended indices `low`.
    pub fn find(field: &dyn Field, lattice: &Lattice, low: [usize; 3], around: &Around) -> Self {
        let mut sheets = Self { undecided: Vec::new(), vertices: 0, evaluations: 0 };
        let cells = CellValues::of_brick(field, lattice, low, around, &mut sheets.evaluations);
        for (cell, values) in cells {
            let (polygons, tunnel) = values.loops();
            let found = CellLoops {
                cell,
                loops: polygons.iter().map(|polygon| Loop::of(polygon)).collect(),
                tunnel: tunnel.map(|tunnel| tunnel.loops),
            };
            sheets.vertices += (0..found.loops.len()).map(|number| found.vertices(number)).sum::<usize>();
            sheets.undecided.push(found);
        }
        let loops = &*LOOPS;
        for z in 0..BRICK {
            let corners = around.corners(z);
            for cell in set_positions(crossed_cells(&corners)) {
                sheets.vertices += loops[usize::from(inside_corners(&corners, cell))].len();
            }
        }
        sheets
    }
}

impl CellLoops {
    /// Whether a loop is an end of the tunnel.
    pub fn opens(&self, number: usize) -> bool {
        self.tunnel.is_some_and(|ends| ends.contains(&number))
    }

    /// The number of vertices that a loop becomes.
    pub fn vertices(&self, number: usize) -> usize {
        if self.opens(number) { self.loops[number].edges.len() } else { 1 }
    }
}

impl Loop {
    fn of(edges: &[usize]) -> Self {
        let n = edges.len();
        let faces: Vec<Option<usize>> = (0..n).map(|i| common_face(edges[i], edges[(i + 1) % n])).collect();
        let is_repeated = |face: &Option<usize>| faces.iter().filter(|other| *other == face).count() > 1;
        let twice = (0..n).filter(|&i| is_repeated(&faces[i]));
        Self {
            twice: twice.map(|i| [i as u8, ((i + 1) % n) as u8]).collect(),
            edges: edges.iter().map(|&e| e as u8).collect(),
        }
    }
}

/// The face 2·axis + side that holds both edges.
fn common_face(a: usize, b: usize) -> Option<usize> {
    let faces = |e: usize| {
        let axis = e / 4;
        [2 * ((axis + 1) % 3) + (e & 1), 2 * ((axis + 2) % 3) + (e >> 1 & 1)]
    };
    faces(a).into_iter().find(|face| faces(b).contains(face))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All cases with all decisions about their faces.
    fn all_loops() -> impl Iterator<Item = (u8, Vec<Loop>)> {
        (0..=255_u8).flat_map(|inside| {
            (0..64_u8).map(move |choice| {
                let pick =
                    |f: usize| if choice >> f & 1 == 1 { Ambiguous::JoinSolid } else { Ambiguous::PartSolid };
                let found = loops(inside, std::array::from_fn(pick));
                (inside, found.iter().map(|l| Loop::of(l)).collect())
            })
        })
    }

    #[test]
    fn every_crossed_edge_is_in_one_loop_and_neighbours_share_a_face() {
        for (inside, loops) in all_loops() {
            let mut seen: Vec<u8> = loops.iter().flat_map(|l| l.edges.iter().copied()).collect();
            seen.sort_unstable();
            let crossed = (0..12_u8).filter(|&e| {
                let (axis, low) = super::super::super::cases::edge(e.into());
                (inside >> low ^ inside >> (low | 1 << axis)) & 1 == 1
            });
            assert_eq!(seen, crossed.collect::<Vec<_>>(), "case {inside:08b}");
            for l in loops {
                assert!(l.edges.len() >= 3);
                for i in 0..l.edges.len() {
                    let next = l.edges[(i + 1) % l.edges.len()];
                    assert!(common_face(l.edges[i].into(), next.into()).is_some());
                }
            }
        }
    }

    #[test]
    fn the_table_holds_the_cases_that_signs_decide() {
        for (inside, found) in (0..=255).zip(&*LOOPS) {
            let is_crossed = inside != 0 && inside != 255;
            assert_eq!(!found.is_empty(), is_crossed && !needs_values(inside), "case {inside:08b}");
            assert!(found.iter().all(|l| l.twice.is_empty()), "faces that signs decide are passed once");
        }
    }

    /// Some loops pass a face twice: for example if two corners on a diagonal of a face are inside, and all
    /// corners of the opposite face.
    #[test]
    fn a_face_can_be_passed_twice() {
        let (mut with, mut without) = (0, 0);
        for l in all_loops().flat_map(|(_, loops)| loops) {
            assert!(l.twice.len().is_multiple_of(2));
            *(if l.twice.is_empty() { &mut without } else { &mut with }) += 1;
        }
        assert!(with > 0 && without > 0, "{with} {without}");
    }
}
