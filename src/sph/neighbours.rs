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

/// Mean number of neighbours above which cells of half the radius are faster than whole ones. Nanoseconds per
/// pair and step with whole and half cells: 13.6 and 11.0 in the drop (172 neighbours), 9.9 and 8.5 in the pool
/// it ends in (82), 16.5 and 36.8 in a sparse drop (24).
const DENSE: usize = 60;

/// Candidates whose distances are found side by side.
const LANES: usize = 4;

/// Neighbours of a block of consecutive particles.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockList {
    /// Where each particle's list ends in `indices`, which is longer than its content.
    ends: Vec<u32>,
    indices: Vec<u32>,
    candidates: Candidates,
}

impl BlockList {
    /// Neighbours of the block's k-th particle.
    #[inline(always)]
    pub fn of(&self, k: usize) -> &[u32] {
        let start = if k == 0 { 0 } else { self.ends[k - 1] };
        &self.indices[start as usize..self.ends[k] as usize]
    }
}

/// Particles of the cells around one cell, copied side by side.
#[derive(Debug, Clone, Default)]
struct Candidates {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
    index: Vec<u32>,
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
            let (mut i, last) = (b * BLOCK, ((b + 1) * BLOCK).min(position.len()));
            while i < last {
                // particles of one cell share their candidates
                let own = block.gather_candidates(grid, position, i);
                let mates = grid.cell_mates(i).end.min(last) - i;
                (own..own + mates).for_each(|own| block.add_particle(h, own));
                i += mates;
            }
        });
    }

    /// How fine a grid the next search wants: small cells hold fewer candidates, but are worth their number
    /// only where many particles share one.
    pub fn cells_per_radius(&self, particles: usize) -> usize {
        if self.pairs() > DENSE * particles { 2 } else { 1 }
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

    /// Copies the particles of all cells around particle `i`'s, and returns the place of `i` among them.
    fn gather_candidates(&mut self, grid: &CellGrid, position: &Vectors, i: usize) -> usize {
        let Candidates { x, y, z, index } = &mut self.candidates;
        [&mut *x, &mut *y, &mut *z].into_iter().for_each(Vec::clear);
        index.clear();
        let mut own = 0;
        grid.for_ranges_around(i, |range| {
            if range.contains(&i) {
                own = index.len() + i - range.start;
            }
            x.extend_from_slice(&position.x[range.clone()]);
            y.extend_from_slice(&position.y[range.clone()]);
            z.extend_from_slice(&position.z[range.clone()]);
            index.extend(range.start as u32..range.end as u32);
        });
        own
    }

    /// Adds the neighbours of the candidate `own`.
    fn add_particle(&mut self, h: f64, own: usize) {
        let count = self.count();
        let most = count + self.candidates.index.len();
        if self.indices.len() < most {
            self.indices.resize(2 * most, 0);
        }
        // a particle is no neighbour of itself: the candidates before and after it
        let c = &self.candidates;
        let p = DVec3::new(c.x[own], c.y[own], c.z[own]);
        let before = c.add_near(p, h * h, 0..own, &mut self.indices[count..]);
        let after = c.add_near(p, h * h, own + 1..c.index.len(), &mut self.indices[count + before..]);
        self.ends.push((count + before + after) as u32);
    }
}

impl Candidates {
    /// Writes the indices of a range's candidates that are nearer than √h2 and returns how many. Each is
    /// written, but the place advances for the near ones only, so that there is no branch to mispredict.
    #[inline(always)]
    fn add_near(&self, p: DVec3, h2: f64, range: Range<usize>, free: &mut [u32]) -> usize {
        let [x, y, z] = [&self.x, &self.y, &self.z].map(|c| c[range.clone()].as_chunks::<LANES>());
        let index = self.index[range].as_chunks::<LANES>();
        let mut found = 0;
        let mut keep = |j: u32, near: bool| {
            free[found] = j;
            found += usize::from(near);
        };
        for (((x, y), z), j) in x.0.iter().zip(y.0).zip(z.0).zip(index.0) {
            let r2: [f64; LANES] = std::array::from_fn(|l| distance2(p, x[l], y[l], z[l]));
            for l in 0..LANES {
                keep(j[l], r2[l] < h2);
            }
        }
        for (((&x, &y), &z), &j) in x.1.iter().zip(y.1).zip(z.1).zip(index.1) {
            keep(j, distance2(p, x, y, z) < h2);
        }
        found
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
        [1, 2, 3].into_iter().for_each(|cells| check_cells(cloud, h, cells));
    }

    #[track_caller]
    fn check_cells(cloud: &Vectors, h: f64, cells: usize) {
        let mut grid = CellGrid::default();
        grid.sort(cloud, h, cells);
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
