//! Bins that sort particles by upright columns as wide as the support radius, and by thin slices within each.
//!
//! Columns follow a Hilbert curve over the ground, so that neighbours in space are neighbours in memory.
//! Within a column, particles lie from bottom to top, slice by slice. The candidates near a few particles of
//! one column form one contiguous range in each of the nine columns around it. Two look-ups find such a
//! range, which fits as tightly as a slice is thin.
//!
//! Invariant: after [`Columns::sort`] and a permutation by [`Columns::order`], slice s of the column of rank
//! r holds the particles `starts[r·slices + s] .. starts[r·slices + s + 1]`. Particles of one slice keep
//! their previous order, so the result depends only on the input.

use std::ops::Range;

use glam::DVec3;
use smallvec::SmallVec;

use super::super::particles::Vectors;

/// Slices per support radius. A range reaches at most one slice too far at either end.
const SLICES: f64 = 8.0;

/// Upper bound on cells per particle. More cells would cost more to clear than they save.
const CELLS_PER_PARTICLE: usize = 16;

/// Maximum number of particles whose surroundings are gathered together. A large block gathers less often; a
/// small one needs less room around it.
pub(in super::super) const BLOCK: usize = 64;

/// Consecutive particles of one column.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Block {
    pub first: u32,
    pub len: u32,
    /// Index of the column along x and y.
    column: [u32; 2],
}

impl Block {
    pub fn particles(&self) -> Range<usize> {
        self.first as usize..(self.first + self.len) as usize
    }
}

/// First and one past the last particle in each of the columns around a block; ranges may be empty.
pub(in super::super) type Ranges = SmallVec<[(u32, u32); 9]>;

/// Bins over the bounding box of the particles.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct Columns {
    origin: DVec3,
    /// Width of a column, m.
    width: f64,
    /// Thickness of a slice, m.
    thickness: f64,
    /// Number of columns along x and y, and of slices along z.
    counts: [usize; 3],
    /// Rank of each column along the curve; x varies fastest.
    rank: Vec<u32>,
    starts: Vec<u32>,
    /// Cell of each particle, in the old order.
    cell_of: Vec<u32>,
    order: Vec<u32>,
    blocks: Vec<Block>,
}

impl Columns {
    /// Bins finite positions for searches within `radius`. Columns are wider where particles are sparse.
    pub fn sort(&mut self, position: &Vectors, radius: f64) {
        self.lay_out(position, radius);
        let mut cell_of = std::mem::take(&mut self.cell_of);
        cell_of.clear();
        cell_of.extend(position.iter().map(|p| {
            let [x, y] = [self.column(0, p.x), self.column(1, p.y)];
            self.rank[x + self.counts[0] * y] * self.counts[2] as u32 + self.slice(p.z) as u32
        }));
        self.cell_of = cell_of;

        self.starts.clear();
        self.starts.resize(self.counts.iter().product::<usize>() + 2, 0);
        // Counts are stored two places further on, so that filling `order` leaves the starts in place.
        for &cell in &self.cell_of {
            self.starts[cell as usize + 2] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.order.resize(position.len(), 0);
        for (i, &cell) in self.cell_of.iter().enumerate() {
            let place = &mut self.starts[cell as usize + 1];
            self.order[*place as usize] = i as u32;
            *place += 1;
        }
        self.cut_into_blocks();
    }

    /// Old index of each particle in the new order.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    pub fn bytes(&self) -> usize {
        4 * (self.starts.capacity() + self.cell_of.capacity() + self.order.capacity())
            + size_of::<Block>() * self.blocks.capacity()
    }

    /// Blocks that hold all particles in their new order; each column is cut into pieces.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Returns a range of particles for each column around that of a block. Together they hold every particle
    /// within `radius` of a particle of the block with z from `low` to `high`. Shrinking the extent adds no
    /// range, and every range stays inside that of the larger extent.
    pub fn ranges_around(&self, block: &Block, (low, high): (f64, f64), radius: f64) -> Ranges {
        let (first, last) = (self.slice(low - radius), self.slice(high + radius));
        let [nx, ny, slices] = self.counts;
        let [x, y] = block.column.map(|c| c as usize);
        let mut ranges = Ranges::new();
        for cy in y.saturating_sub(1)..=(y + 1).min(ny - 1) {
            for cx in x.saturating_sub(1)..=(x + 1).min(nx - 1) {
                let column = self.rank[cx + nx * cy] as usize * slices;
                ranges.push((self.starts[column + first], self.starts[column + last + 1]));
            }
        }
        ranges
    }

    fn cut_into_blocks(&mut self) {
        self.blocks.clear();
        let [nx, ny, slices] = self.counts;
        for y in 0..ny {
            for x in 0..nx {
                let column = self.rank[x + nx * y] as usize * slices;
                let (mut first, end) = (self.starts[column], self.starts[column + slices]);
                // Pieces of equal size are better than full ones and a small rest.
                let mut pieces = (end - first).div_ceil(BLOCK as u32);
                while pieces > 0 {
                    let len = (end - first).div_ceil(pieces);
                    self.blocks.push(Block { first, len, column: [x as u32, y as u32] });
                    first += len;
                    pieces -= 1;
                }
            }
        }
        self.blocks.sort_unstable_by_key(|block| block.first);
    }

    /// Chooses origin, widths and counts. Columns grow where particles are too sparse for fine ones.
    fn lay_out(&mut self, position: &Vectors, radius: f64) {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in position.iter() {
            (min, max) = (min.min(p), max.max(p));
        }
        if position.is_empty() {
            (min, max) = (DVec3::ZERO, DVec3::ZERO);
        }
        let limit = (CELLS_PER_PARTICLE * position.len()).max(4096) as f64;
        // Columns are wider by the error that rounding may add to a distance.
        let slack = 1e-9 * radius + 8.0 * f64::EPSILON * min.abs().max(max.abs()).max_element();
        self.width = radius + slack;
        self.thickness = self.width / SLICES;
        let old = self.counts;
        loop {
            let size = DVec3::new(self.width, self.width, self.thickness);
            // The origin lies on multiples of the width, so that the layout stays while the fluid moves
            // little.
            let origin = (min / size).floor() * size;
            let counts = ((max - origin) / size).floor() + 1.0;
            if counts.element_product() <= limit {
                self.origin = origin;
                self.counts = counts.to_array().map(|n| n as usize);
                break;
            }
            self.width *= 1.25;
            self.thickness *= 1.25;
        }
        if self.counts[..2] != old[..2] || self.rank.is_empty() {
            self.rank_columns();
        }
    }

    fn rank_columns(&mut self) {
        let [nx, ny, _] = self.counts;
        let side = nx.max(ny).next_power_of_two() as u32;
        let mut along: Vec<(u32, u32)> =
            (0..nx * ny).map(|c| (hilbert(side, (c % nx) as u32, (c / nx) as u32), c as u32)).collect();
        along.sort_unstable();
        self.rank.resize(nx * ny, 0);
        for (rank, &(_, column)) in along.iter().enumerate() {
            self.rank[column as usize] = rank as u32;
        }
    }

    /// Column of a coordinate along x or y, clamped to the grid. The result is monotone in `x`.
    fn column(&self, axis: usize, x: f64) -> usize {
        // A negative quotient casts to 0, and `u32` can count all columns.
        (((x - self.origin[axis]) / self.width) as u32 as usize).min(self.counts[axis] - 1)
    }

    /// Slice of a height, clamped to the grid. The result is monotone in `z`.
    fn slice(&self, z: f64) -> usize {
        (((z - self.origin.z) / self.thickness) as u32 as usize).min(self.counts[2] - 1)
    }
}

/// Distance along the Hilbert curve (Hilbert 1891) of a square whose side is a power of two. Distances are
/// below 2³² for sides up to 2¹⁶. Columns farther out share distances, which only makes their order less
/// local.
fn hilbert(side: u32, mut x: u32, mut y: u32) -> u32 {
    let mut distance = 0u32;
    let mut s = side / 2;
    while s > 0 {
        let (right, up) = (u32::from(x & s > 0), u32::from(y & s > 0));
        distance = distance.wrapping_add(s.wrapping_mul(s).wrapping_mul((3 * right) ^ up));
        if up == 0 {
            if right == 1 {
                (x, y) = (side.wrapping_sub(1).wrapping_sub(x), side.wrapping_sub(1).wrapping_sub(y));
            }
            std::mem::swap(&mut x, &mut y);
        }
        s /= 2;
    }
    distance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::scenes;

    #[track_caller]
    fn check(cloud: &Vectors, radius: f64) {
        let mut columns = Columns::default();
        columns.sort(cloud, radius);
        let mut seen = vec![false; cloud.len()];
        let sorted: Vec<DVec3> = columns.order().iter().map(|&i| cloud.get(i as usize)).collect();
        for &i in columns.order() {
            assert!(!std::mem::replace(&mut seen[i as usize], true));
        }
        assert!(seen.iter().all(|&seen| seen));
        let mut covered = 0;
        for block in columns.blocks() {
            let particles = block.particles();
            assert_eq!(particles.start, covered);
            covered = particles.end;
            for i in particles {
                let z = sorted[i].z;
                let mut near = vec![false; sorted.len()];
                for (first, end) in columns.ranges_around(block, (z, z), radius) {
                    for near in &mut near[first as usize..end as usize] {
                        assert!(!std::mem::replace(near, true), "visited twice");
                    }
                }
                for (j, p) in sorted.iter().enumerate() {
                    assert!(near[j] || p.distance(sorted[i]) >= radius, "{i} misses {j}");
                }
            }
        }
        assert_eq!(covered, sorted.len());
    }

    #[test]
    fn ranges_hold_all_that_is_near() {
        check(&scenes::random_cloud(700, 1.0), 0.1);
        check(&scenes::random_cloud(700, 1.0), 0.37);
        check(&scenes::random_cloud(300, 0.05), 0.1); // all within one column
        check(&scenes::random_cloud(300, 1e6), 0.1); // sparse
        check(&scenes::random_cloud(1, 1.0), 0.1);
    }

    #[test]
    fn ranges_hold_all_that_is_near_on_borders_of_cells() {
        let mut lattice = Vectors::default();
        for k in 0..1000 {
            lattice.push(DVec3::new((k % 10) as f64, (k / 10 % 10) as f64, (k / 100) as f64) * 0.05);
        }
        check(&lattice, 0.1);
        check(&lattice, 0.05);
    }

    #[test]
    fn the_curve_visits_each_column_once_and_goes_from_neighbour_to_neighbour() {
        let side = 16;
        let mut places: Vec<(u32, (i32, i32))> = (0..side * side)
            .map(|c| (hilbert(side, c % side, c / side), ((c % side) as i32, (c / side) as i32)))
            .collect();
        places.sort_unstable();
        for (k, pair) in places.windows(2).enumerate() {
            assert_eq!(pair[0].0 as usize, k);
            let ((x, y), (u, v)) = (pair[0].1, pair[1].1);
            assert_eq!((x - u).abs() + (y - v).abs(), 1);
        }
    }
}
