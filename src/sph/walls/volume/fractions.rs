//! How far bodies fill the cells of a lattice.

use std::sync::Arc;

use glam::DVec3;

use super::{Lattice, sparse::Sparse};
use crate::{
    field::{Walls, cut, is_inside},
    geom::Aabb,
    interval::Interval,
};

/// Cells along the side of a tile.
pub(super) const TILE: usize = 8;

/// Halvings of a cell that the surface cuts, or may cut: for curved surfaces and thin parts.
const DEEPER: u32 = 1;

/// How far a cell is filled, and with what.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct Filled {
    /// The filled part of its volume.
    pub part: f32,
    /// That part times the way from the cell's middle to its own, m.
    pub moment: [f32; 3],
}

impl Filled {
    const WHOLE: Self = Self { part: 1.0, moment: [0.0; 3] };
}

/// Cells of a tile.
pub(super) enum Tile {
    Empty,
    Full,
    /// x runs first.
    Cut(Box<[Filled]>),
}

impl Tile {
    pub fn cell(&self, [i, j, k]: [usize; 3]) -> Filled {
        match self {
            Self::Empty => Filled::default(),
            Self::Full => Filled::WHOLE,
            Self::Cut(cells) => cells[i + TILE * (j + TILE * k)],
        }
    }
}

/// The tiles of several bodies, of which it does not matter which is where.
pub(super) struct Fractions {
    bodies: Vec<Arc<dyn Walls>>,
    tiles: Sparse<Tile>,
}

impl Fractions {
    pub fn new(bodies: Vec<Arc<dyn Walls>>, lattice: &Lattice) -> Option<Self> {
        Some(Self { bodies, tiles: Sparse::new(lattice.cells.map(|n| n / TILE + 1))? })
    }

    /// A tile, by its indices.
    pub fn tile(&self, lattice: &Lattice, at: [usize; 3]) -> &Tile {
        self.tiles.get(at, || self.make(lattice, at))
    }

    fn make(&self, lattice: &Lattice, at: [usize; 3]) -> Tile {
        let first = at.map(|n| n * TILE);
        let range = self.range(&lattice.cells_from(first, TILE));
        if range.hi < 0.0 {
            return Tile::Empty;
        }
        if range.lo > 0.0 {
            return Tile::Full;
        }
        let mut cells = vec![Filled::default(); TILE * TILE * TILE];
        self.fill(lattice, &mut cells, first, [0; 3], TILE);
        let is_all = |filled: Filled| cells.iter().all(|cell| *cell == filled);
        match () {
            () if is_all(Filled::default()) => Tile::Empty,
            () if is_all(Filled::WHOLE) => Tile::Full,
            () => Tile::Cut(cells.into()),
        }
    }

    /// Fills the cells of a tile from `at` on, `size` along each axis. Cells beyond the lattice stay empty.
    fn fill(&self, lattice: &Lattice, cells: &mut [Filled], first: [usize; 3], at: [usize; 3], size: usize) {
        let from: [usize; 3] = std::array::from_fn(|axis| first[axis] + at[axis]);
        if (0..3).any(|axis| from[axis] >= lattice.cells[axis]) {
            return;
        }
        let within = lattice.cells_from(from, size);
        let range = self.range(&within);
        if range.hi < 0.0 {
            return;
        }
        if size > 1 {
            let half = size / 2;
            for corner in 0..8 {
                let at = std::array::from_fn(|axis| at[axis] + half * (corner >> axis & 1));
                self.fill(lattice, cells, first, at, half);
            }
            return;
        }
        let filled = if range.lo > 0.0 {
            Filled::WHOLE
        } else {
            let (volume, moment) = self.part(&within, DEEPER);
            let whole = within.volume();
            let moment = (moment - volume * within.centre()) / whole;
            Filled { part: (volume / whole) as f32, moment: moment.to_array().map(|m| m as f32) }
        };
        cells[at[0] + TILE * (at[1] + TILE * at[2])] = filled;
    }

    /// The filled volume of a box, and the integral of the place over it.
    fn part(&self, within: &Aabb, deeper: u32) -> (f64, DVec3) {
        let corners = within.corners();
        let omega = |p: DVec3| self.bodies.iter().map(|body| body.omega(p)).fold(f64::NEG_INFINITY, f64::max);
        let values = corners.map(omega);
        let inside = values.map(is_inside);
        let is_cut = inside.iter().any(|is| *is != inside[0]);
        let may_be_cut = || {
            let range = self.range(within);
            range != Interval::ALL && range.lo <= 0.0 && range.hi >= 0.0
        };
        if deeper == 0 && is_cut {
            let cut = cut(&corners, &values, &omega);
            return (cut.inside, cut.places);
        }
        if !is_cut && (deeper == 0 || !may_be_cut()) {
            let volume = if inside[0] { within.volume() } else { 0.0 };
            return (volume, volume * within.centre());
        }
        let centre = within.centre();
        let parts =
            corners.map(|corner| self.part(&Aabb::new(corner.min(centre), corner.max(centre)), deeper - 1));
        parts.into_iter().fold((0.0, DVec3::ZERO), |(volume, places), (v, p)| (volume + v, places + p))
    }

    fn range(&self, over: &Aabb) -> Interval {
        let ranges = self.bodies.iter().map(|body| body.range(over));
        ranges.fold(Interval::new(f64::NEG_INFINITY, f64::NEG_INFINITY), |all, range| {
            Interval::new(all.lo.max(range.lo), all.hi.max(range.hi))
        })
    }
}
