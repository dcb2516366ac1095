//! Neighbour lists: for every particle the indices of the others within the support radius.
//!
//! Particles are handled in blocks of fixed size. A block owns its list, so blocks are filled by any thread
//! without a lock and without allocation once the lists have grown; the order within a particle's list is the
//! grid's order whatever the thread.
//!
//! Invariant: the lists are complete and exact: j is in the list of i iff i ≠ j and |r_i − r_j|² < h² in
//! double precision, hence i is in the list of j too.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::{grid::CellGrid, particles::Vectors};

/// Particles per block: the unit of parallel work. Small enough to balance, large enough to forget.
pub(super) const BLOCK: usize = 128;

/// Candidates whose distances are found side by side.
const LANES: usize = 4;

/// Neighbours of a block of consecutive particles.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockList {
    /// Where each particle's list ends in `indices`, which is longer than its content.
    ends: Vec<u32>,
    indices: Vec<u32>,
}

impl BlockList {
    /// Neighbours of the block's k-th particle.
    #[inline(always)]
    pub fn of(&self, k: usize) -> &[u32] {
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.indices[start as usize..self.ends[k] as usize]
    }
}

/// Neighbours of all particles.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    blocks: Vec<BlockList>,
}

impl Neighbours {
    /// Finds all pairs nearer than `h` among particles in the order of the grid.
    pub fn search(&mut self, grid: &CellGrid, position: &Vectors, h: f64) {
        self.blocks.resize_with(position.len().div_ceil(BLOCK), BlockList::default);
        self.blocks.par_iter_mut().enumerate().for_each(|(b, block)| {
            block.ends.clear();
            for i in b * BLOCK..((b + 1) * BLOCK).min(position.len()) {
                block.add_particle(grid, position, h, i);
            }
        });
    }

    pub fn blocks(&self) -> &[BlockList] {
        &self.blocks
    }

    /// Number of ordered pairs.
    pub fn pairs(&self) -> usize {
        self.blocks.iter().map(BlockList::count).sum()
    }

    #[cfg(test)]
    pub fn of(&self, i: usize) -> &[u32] {
        self.blocks[i / BLOCK].of(i % BLOCK)
    }
}

impl BlockList {
    /// Pairs of the block so far.
    fn count(&self) -> usize {
        self.ends.last().map_or(0, |&end| end as usize)
    }

    fn add_particle(&mut self, grid: &CellGrid, position: &Vectors, h: f64, i: usize) {
        let p = position.get(i);
        let mut count = self.count();
        grid.for_ranges_near(p, h, |range| {
            // a particle is no neighbour of itself: its row is searched in two parts
            if range.contains(&i) {
                count = self.add_near(count, position, p, h * h, range.start..i);
                count = self.add_near(count, position, p, h * h, i + 1..range.end);
            } else {
                count = self.add_near(count, position, p, h * h, range);
            }
        });
        self.ends.push(count as u32);
    }

    /// Adds the particles of a range that are nearer than √h2 and returns the new count. Each is written, but
    /// the place advances for the near ones only, so that there is no branch to mispredict.
    #[inline(always)]
    fn add_near(&mut self, count: usize, position: &Vectors, p: DVec3, h2: f64, range: Range<usize>) -> usize {
        if self.indices.len() < count + range.len() {
            self.indices.resize(2 * (count + range.len()), 0);
        }
        let free = &mut self.indices[count..count + range.len()];
        let [x, y, z] = [&position.x, &position.y, &position.z].map(|c| c[range.clone()].as_chunks::<LANES>());
        let mut found = 0;
        let mut keep = |k: usize, near: bool| {
            free[found] = (range.start + k) as u32;
            found += usize::from(near);
        };
        for (c, ((x, y), z)) in x.0.iter().zip(y.0).zip(z.0).enumerate() {
            let r2: [f64; LANES] = std::array::from_fn(|l| distance2(p, x[l], y[l], z[l]));
            for (l, r2) in r2.into_iter().enumerate() {
                keep(c * LANES + l, r2 < h2);
            }
        }
        for (l, ((&x, &y), &z)) in x.1.iter().zip(y.1).zip(z.1).enumerate() {
            keep(range.len() / LANES * LANES + l, distance2(p, x, y, z) < h2);
        }
        count + found
    }
}

#[inline(always)]
fn distance2(p: DVec3, x: f64, y: f64, z: f64) -> f64 {
    let (dx, dy, dz) = (p.x - x, p.y - y, p.z - z);
    dx * dx + dy * dy + dz * dz
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::scenes;

    /// The specification: every pair, by brute force.
    fn naive(position: &Vectors, h: f64, i: usize) -> Vec<u32> {
        let near = |j: &usize| *j != i && position.get(*j).distance_squared(position.get(i)) < h * h;
        (0..position.len()).filter(near).map(|j| j as u32).collect()
    }

    #[track_caller]
    fn check(cloud: &Vectors, h: f64) {
        let mut grid = CellGrid::default();
        grid.sort(cloud, h);
        let mut sorted = Vectors::default();
        for &i in grid.order() {
            sorted.push(cloud.get(i as usize));
        }
        let mut neighbours = Neighbours::default();
        neighbours.search(&grid, &sorted, h);
        let mut pairs = 0;
        for i in 0..sorted.len() {
            let mut found = neighbours.of(i).to_vec();
            found.sort_unstable();
            assert_eq!(found, naive(&sorted, h, i), "particle {i}");
            pairs += found.len();
        }
        assert_eq!(neighbours.pairs(), pairs);
    }

    #[test]
    fn grid_search_equals_brute_force() {
        check(&scenes::random_cloud(700, 1.0), 0.1);
        check(&scenes::random_cloud(700, 1.0), 0.37);
        check(&scenes::random_cloud(300, 0.05), 0.1); // all within one cell
        check(&scenes::random_cloud(300, 1e6), 0.1); // sparse
        check(&scenes::random_cloud(1, 1.0), 0.1);
    }

    #[test]
    fn grid_search_equals_brute_force_on_cell_borders() {
        let mut lattice = Vectors::default();
        for k in 0..1000 {
            lattice.push(glam::DVec3::new((k % 10) as f64, (k / 10 % 10) as f64, (k / 100) as f64) * 0.05);
        }
        check(&lattice, 0.1);
        check(&lattice, 0.05);
    }
}
