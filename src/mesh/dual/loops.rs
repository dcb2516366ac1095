//! The closed loops of crossed edges of a cell, for each of the 256 ways its corners can lie inside or outside.
//!
//! They are those of the marching-cubes table: a loop there becomes a polygon, here a vertex.

use std::sync::LazyLock;

use super::super::cases::{RULE, loops};

/// A loop around the surface's part in a cell.
#[derive(Debug, Clone)]
pub(super) struct Loop {
    /// Edges of the cell, numbered as in the table of cases, in the order of the loop.
    pub edges: Vec<u8>,
    /// Pairs of neighbours in the loop, by their places in it, that lie in a face which the loop passes twice. Two
    /// cells whose loops both pass their common face twice would be joined by two edges of the mesh with the same ends.
    pub twice: Vec<[u8; 2]>,
}

/// The loops of all cases.
pub(super) static LOOPS: LazyLock<Vec<Vec<Loop>>> = LazyLock::new(|| {
    (0..=255).map(|inside| loops(inside, [RULE; 6]).into_iter().map(Loop::of).collect()).collect()
});

impl Loop {
    fn of(edges: Vec<usize>) -> Self {
        let n = edges.len();
        let faces: Vec<Option<usize>> = (0..n).map(|i| common_face(edges[i], edges[(i + 1) % n])).collect();
        let is_repeated = |face: &Option<usize>| faces.iter().filter(|other| *other == face).count() > 1;
        let twice = (0..n).filter(|&i| is_repeated(&faces[i]));
        Self {
            twice: twice.map(|i| [i as u8, ((i + 1) % n) as u8]).collect(),
            edges: edges.into_iter().map(|e| e as u8).collect(),
        }
    }
}

/// The face that holds both edges: 2·axis + side.
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

    #[test]
    fn every_crossed_edge_is_in_one_loop_and_neighbours_share_a_face() {
        for (inside, loops) in LOOPS.iter().enumerate() {
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

    /// Two loops that pass a face twice exist: two corners inside on a diagonal, and all of the other face.
    #[test]
    fn a_face_can_be_passed_twice() {
        let with = LOOPS.iter().filter(|loops| loops.iter().any(|l| !l.twice.is_empty())).count();
        assert!(with > 0 && with < 256, "{with}");
        for l in LOOPS.iter().flatten() {
            assert!(l.twice.len().is_multiple_of(2));
        }
    }
}
