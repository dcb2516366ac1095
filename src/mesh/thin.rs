//! Parts that a grid cannot see: parts of a solid, or gaps in it, that are too thin for its cells. They may pass
//! between the nodes, or beside triangles that show something else.
//!
//! A cell holds what the grid says if every face in it is known: it faces nearly as the surface does where it
//! crosses an edge of the grid within a cell around, and no two faces back onto each other unless the cell's
//! own edges show both. Ranges of the derivatives prove that for most cells, eight cells at a time where the
//! surface is smooth. All other cells are searched: they are divided, and from each part the surface is
//! sought along the gradient of every face that may be in it. A point with a change of sign whose face is not
//! known is a witness, and its cell is counted. So creases, bulges, faces that coincide and fields that touch
//! zero are not counted, since they have no witness; nor are steps and edges of parts and gaps that are
//! thicker than two cells.
//!
//! Invariant: unless the search was ended, a cell that is not counted is proven to hold what the grid says, or it was
//! searched down to an eighth of a cell without a witness.

mod edges;
mod found;
mod look;

use std::cell::RefCell;

use rayon::prelude::*;

use super::{
    Grid, MeshError, Watch,
    crossings::{BRICKS_PER_TASK, ProgressPart, sample},
    patches::undecided_cells,
    prune::{BRICK, Bricks, Lattice},
    signs::{Brick, Signs, crossed_cells},
};
use crate::{field::Field, geom::Aabb};
use edges::BrickEdges;
use look::Look;

pub use found::ThinCells;

/// Counts the cells of a grid in which [`marching_cubes`](super::marching_cubes) misses a part of the surface.
///
/// The search takes as long as the surface is intricate. If `watch` ends it, what was found so far is
/// returned, and [`ThinCells::ended`] says so. It receives the share of the cells that were looked at.
///
/// # Errors
/// [`MeshError::NotANumber`] if ω is NaN at a node.
pub fn thin_cells(field: &dyn Field, grid: &Grid, watch: &dyn Watch) -> Result<ThinCells, MeshError> {
    let lattice = Lattice::new(grid);
    let near = Bricks::classify(field, &lattice);
    let sampling = ProgressPart::new(near.near.len().div_ceil(BRICKS_PER_TASK), 0.0..SAMPLING, watch);
    let signs = match sample(field, &lattice, &near, &mut 0, &sampling) {
        Ok(signs) => signs,
        Err(MeshError::Ended) => return Ok(ThinCells::ENDED),
        Err(error @ (MeshError::NotANumber { .. } | MeshError::TooManyVertices { .. })) => return Err(error),
    };
    let cells = grid.cells();
    let searching = ProgressPart::new(near.near.len(), SAMPLING..1.0, watch);
    let parts: Vec<ThinCells> = (0..near.near.len())
        .into_par_iter()
        .map(|number| {
            let brick = near.near[number];
            let search = || {
                if brick.solid {
                    return ThinCells::NONE;
                }
                let around = Brick::new(&near, &signs, number).around(&signs);
                let crossed = std::array::from_fn(|z| crossed_cells(&around.corners(z)));
                let undecided = std::array::from_fn(|z| undecided_cells(&around.corners(z)));
                let low = brick.at.map(|b| b * BRICK);
                let edges = RefCell::new(BrickEdges::new(low));
                Search { field, lattice: &lattice, low, cells, crossed, undecided, edges, watch }
                    .count([0; 3], BRICK)
            };
            // a task fails only if the work is to end
            searching.run(|| Ok(search())).unwrap_or(ThinCells::ENDED)
        })
        .collect();
    Ok(parts.into_iter().fold(ThinCells::NONE, ThinCells::and))
}

/// The share of the work that is done when the nodes have their signs.
const SAMPLING: f64 = 0.1;

/// The search for hidden surfaces in one brick.
struct Search<'a> {
    field: &'a dyn Field,
    lattice: &'a Lattice,
    /// The extended indices of the brick's first node.
    low: [usize; 3],
    /// The numbers of cells of the grid.
    cells: [usize; 3],
    crossed: Signs,
    undecided: Signs,
    edges: RefCell<BrickEdges>,
    watch: &'a dyn Watch,
}

impl Search<'_> {
    /// The thin cells in a cube of cells, whose first cell is counted from the brick's first.
    fn count(&self, first: [usize; 3], size: usize) -> ThinCells {
        let low = [0, 1, 2].map(|axis| self.low[axis] + first[axis]);
        // A structure with a line for each field and its comment.
        let beyond = (0..3).any(|axis| low[axis] + size <= 1 || low[axis] > self.cells[axis]);
        if beyond {
            return ThinCells::NONE;
        }
        let high = low.map(|n| n + size);
        let bounds = Aabb::new(self.lattice.position(low), self.lattice.position(high));
        if look::is_decided(self.field.range(&bounds)) {
            return ThinCells::NONE;
        }
        if self.watch.is_over() {
            return ThinCells::ENDED;
        }
        if size == 1 {
            if (0..3).any(|axis| low[axis] == 0) {
                return ThinCells::NONE;
            }
            let holds = |cells: &Signs| cells[first[2]] >> (BRICK * first[1] + first[0]) & 1 == 1;
            let (is_crossed, is_undecided) = (holds(&self.crossed), holds(&self.undecided));
            let Self { field, lattice, ref edges, .. } = *self;
            return Look { field, lattice, edges, low, bounds, is_crossed, is_undecided }.into_cell();
        }
        if self.any_crossed(first, size) && look::is_one_sheet(self.field, &bounds) {
            return ThinCells::NONE;
        }
        let half = size / 2;
        let child = |i: usize| [0, 1, 2].map(|axis: usize| first[axis] + (i >> axis & 1) * half);
        (0..8).map(|i| self.count(child(i), half)).fold(ThinCells::NONE, ThinCells::and)
    }

    fn any_crossed(&self, first: [usize; 3], size: usize) -> bool {
        let row = ((1_u64 << size) - 1) << first[0];
        let square = (first[1]..first[1] + size).fold(0, |bits, y| bits | row << (BRICK * y));
        self.crossed[first[2]..first[2] + size].iter().any(|plane| plane & square != 0)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::field::Sheet;
    use crate::interval::Interval;
    use crate::mesh::{Resolution, Unwatched};

    /// A shell between two balls, with its exact range up to rounding.
    struct HollowBall {
        inner: f64,
        outer: f64,
    }

    impl Field for HollowBall {
        fn omega(&self, p: DVec3) -> f64 {
            let r = p.length();
            (self.outer - r).min(r - self.inner)
        }
        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            let outwards = p.normalize_or_zero();
            let to_outer = self.outer - p.length() < p.length() - self.inner;
            (self.omega(p), if to_outer { -outwards } else { outwards })
        }
        fn range(&self, over: &Aabb) -> Interval {
            let nearest = DVec3::ZERO.clamp(over.min, over.max).length() - 1e-12;
            let farthest = over.min.abs().max(over.max.abs()).length() + 1e-12;
            let lowest = (self.outer - farthest).min(nearest - self.inner);
            Interval::new(lowest, (self.outer - nearest).min(farthest - self.inner))
        }
    }

    fn thin(field: &dyn Field, cells: usize) -> ThinCells {
        let domain = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
        thin_cells(field, &Grid::filling(&domain, Resolution::Cells(cells)).unwrap(), &Unwatched).unwrap()
    }

    #[test]
    fn a_ball_and_a_thick_shell_hide_nothing() {
        for cells in [5, 16, 40, 64] {
            assert_eq!(thin(&HollowBall { inner: -1.0, outer: 0.83 }, cells), ThinCells::NONE);
        }
        assert_eq!(thin(&HollowBall { inner: 0.6, outer: 0.83 }, 40), ThinCells::NONE);
    }

    #[test]
    fn a_shell_thinner_than_a_cell_is_found_where_it_is() {
        // cells of 1/20, a wall of 1/1000
        let found = thin(&HollowBall { inner: 0.8, outer: 0.801 }, 40);
        // the sphere meets some 6·π·0.8²·20² cells, of which few see a node inside
        assert!(found.count > 1000, "{found:?}");
        assert!(found.bounds.max.max_element() < 0.86 && found.bounds.min.min_element() > -0.86, "{found:?}");
        assert_eq!(thin(&HollowBall { inner: 0.8, outer: 0.86 }, 160), ThinCells::NONE);
    }

    #[test]
    fn a_field_without_ranges_is_blamed_only_for_points_that_are_found() {
        let field = crate::field::Closures { omega: |p: DVec3| 0.5 - p.length(), gradient: |p: DVec3| -p };
        assert_eq!(thin(&field, 20), ThinCells::NONE);
        // a speck around the middle of one cell
        let speck = crate::field::Closures {
            omega: |p: DVec3| 0.01 - p.distance(DVec3::splat(0.05)),
            gradient: |p: DVec3| (DVec3::splat(0.05) - p).normalize_or_zero(),
        };
        assert_eq!(thin(&speck, 20).count, 1);
    }

    /// A round bar of which nothing is known across it, with what is known of its slope along it.
    struct Bar {
        along: Interval,
        asked: std::sync::atomic::AtomicUsize,
    }

    impl Field for Bar {
        fn omega(&self, p: DVec3) -> f64 {
            0.52 - p.truncate().length()
        }
        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            (self.omega(p), -p.truncate().normalize_or_zero().extend(0.0))
        }
        fn range(&self, over: &Aabb) -> Interval {
            let nearest = glam::DVec2::ZERO.clamp(over.min.truncate(), over.max.truncate()).length();
            let farthest = over.min.abs().max(over.max.abs()).truncate().length();
            Interval::new(0.52 - farthest - 1e-12, 0.52 - nearest + 1e-12)
        }
        fn sheets(&self, _: &Aabb, visit: &mut dyn FnMut(Sheet<'_>)) -> bool {
            self.asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            visit(Sheet { slopes: [Interval::ALL, Interval::ALL, self.along], at: &|p| self.omega_grad(p) });
            true
        }
    }

    #[test]
    fn an_axis_along_which_nothing_changes_is_not_divided() {
        let [known, unknown] = [0.0, 1e-300].map(|most| {
            let bar = Bar { along: Interval::new(-most, most), asked: 0.into() };
            assert_eq!(thin(&bar, 12), ThinCells::NONE);
            bar.asked.into_inner()
        });
        assert!(5 * known < unknown, "{known} questions, {unknown}");
    }
}
