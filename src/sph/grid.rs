//! Cell grid: particles in the order of the cells they lie in, found by one counting sort.
//!
//! A cell is as wide as the support radius, or a whole fraction of it; x runs fastest, so that the cells of a
//! row that a support ball can touch are one contiguous range of particles.
//!
//! Invariant: after [`CellGrid::sort`] and a permutation by [`CellGrid::order`], the particles of cell c are
//! `starts[c] .. starts[c + 1]`; particles of one cell keep their previous order, so the result depends on
//! nothing but the input.

use std::ops::Range;

use glam::DVec3;

use super::particles::Vectors;

/// More cells than this per particle would cost more to clear than they save.
const CELLS_PER_PARTICLE: usize = 32;

/// Bins over the bounding box of the particles.
#[derive(Debug, Clone, Default)]
pub(super) struct CellGrid {
    origin: DVec3,
    /// 1/side, 1/m
    per_length: f64,
    /// Cells to look at on either side.
    reach: usize,
    counts: [usize; 3],
    starts: Vec<u32>,
    /// Cell of each particle in the old order.
    cell_of: Vec<u32>,
    order: Vec<u32>,
    /// Cell of each particle in the new order.
    cells: Vec<u32>,
}

impl CellGrid {
    /// Bins finite positions for searches within `radius`, in cells of side radius/`cells_per_radius` or, where
    /// particles are sparse, wider.
    pub fn sort(&mut self, position: &Vectors, radius: f64, cells_per_radius: usize) {
        self.lay_out(position, radius, cells_per_radius);
        let mut cell_of = std::mem::take(&mut self.cell_of);
        cell_of.clear();
        cell_of.extend(position.iter().map(|p| {
            let [x, y, z] = [0, 1, 2].map(|axis| self.cell(axis, p[axis]));
            (x + self.counts[0] * (y + self.counts[1] * z)) as u32
        }));
        self.cell_of = cell_of;

        self.starts.clear();
        self.starts.resize(self.counts.iter().product::<usize>() + 2, 0);
        // counted two places on, so that filling `order` leaves the starts in place
        for &cell in &self.cell_of {
            self.starts[cell as usize + 2] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.order.resize(position.len(), 0);
        self.cells.resize(position.len(), 0);
        for (i, &cell) in self.cell_of.iter().enumerate() {
            let place = &mut self.starts[cell as usize + 1];
            self.order[*place as usize] = i as u32;
            self.cells[*place as usize] = cell;
            *place += 1;
        }
    }

    /// Old index of each particle in the new order.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The particles of the cell that holds particle `i` of the sorted order.
    pub fn cell_mates(&self, i: usize) -> Range<usize> {
        let cell = self.cells[i] as usize;
        self.starts[cell] as usize..self.starts[cell + 1] as usize
    }

    /// Calls with ranges of particles, one per row of cells, that hold all particles within the radius of any
    /// particle in the cell of particle `i`.
    pub fn for_ranges_around(&self, i: usize, mut visit: impl FnMut(Range<usize>)) {
        let [nx, ny, nz] = self.counts;
        let cell = self.cells[i] as usize;
        let near = |c: usize, count: usize| (c.saturating_sub(self.reach), (c + self.reach).min(count - 1));
        let (x, y, z) = (near(cell % nx, nx), near(cell / nx % ny, ny), near(cell / nx / ny, nz));
        for cz in z.0..=z.1 {
            for cy in y.0..=y.1 {
                let row = nx * (cy + ny * cz);
                visit(self.starts[row + x.0] as usize..self.starts[row + x.1 + 1] as usize);
            }
        }
    }

    /// Chooses origin, side and counts; the side grows where particles are too sparse for fine cells.
    fn lay_out(&mut self, position: &Vectors, radius: f64, cells_per_radius: usize) {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in position.iter() {
            (min, max) = (min.min(p), max.max(p));
        }
        let limit = (CELLS_PER_PARTICLE * position.len()).max(4096) as f64;
        self.origin = min;
        // rounding may add this to a distance: cells are wider by so much
        let slack = 1e-9 * radius + 8.0 * f64::EPSILON * min.abs().max(max.abs()).max_element();
        let mut side = (radius + slack) / cells_per_radius as f64;
        loop {
            let counts = ((max - min) / side).floor() + 1.0;
            if counts.element_product() <= limit {
                self.per_length = 1.0 / side;
                self.reach = (radius * (1.0 + 1e-10) / side).ceil() as usize;
                self.counts = counts.to_array().map(|n| n as usize);
                return;
            }
            side *= 1.25;
        }
    }

    /// Cell of a coordinate along an axis, clamped to the grid. Monotone in `x`.
    fn cell(&self, axis: usize, x: f64) -> usize {
        // a negative product casts to 0; there are fewer cells than u32 counts
        (((x - self.origin[axis]) * self.per_length) as u32 as usize).min(self.counts[axis] - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sort_is_a_stable_permutation_by_cell() {
        let mut position = Vectors::default();
        for x in [0.9, 0.1, 0.95, 0.12, 0.5] {
            position.push(DVec3::new(x, 0.0, 0.0));
        }
        let mut grid = CellGrid::default();
        grid.sort(&position, 0.4, 1);
        assert_eq!(grid.order(), [1, 3, 4, 0, 2]);
    }

    #[test]
    fn a_huge_sparse_cloud_needs_few_cells() {
        let mut position = Vectors::default();
        position.push(DVec3::splat(-1e9));
        position.push(DVec3::splat(1e9));
        let mut grid = CellGrid::default();
        grid.sort(&position, 0.1, 2);
        assert!(grid.starts.len() < 5000);
    }
}
