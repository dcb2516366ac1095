//! How far bodies fill the cells of a lattice.

use std::sync::Arc;

use glam::DVec3;

use super::{lattice::Lattice, sparse::Sparse};
use crate::{
    field::{Walls, cut, is_inside},
    geom::Aabb,
    interval::Interval,
};

/// Cells along the side of a tile.
pub(super) const TILE: usize = 8;

/// Distance from the walls of the box, in cells, of the places that stand for places on the walls.
const BESIDE_WALL: f64 = 1e-3;

/// How far a cell is filled, and with what.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct Filled {
    /// The filled part of its volume.
    pub part: f32,
    /// That part times the way from the cell's middle to its own, m.
    pub moment: [f32; 3],
    /// The mean over the cell of (z − c)⊗(z − c) where it is filled, less what a whole cell has in
    /// proportion, m²: xx, yy, zz, yz, zx, xy.
    pub square: [f32; 6],
}

impl Filled {
    pub const WHOLE: Self = Self { part: 1.0, moment: [0.0; 3], square: [0.0; 6] };
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

/// The tiles of several bodies together.
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
        let within = lattice.cells_from(first, TILE);
        let near = self.near(lattice, &within);
        let range = near.range(&within);
        if range.hi < 0.0 {
            return Tile::Empty;
        }
        if range.lo > 0.0 {
            return Tile::Full;
        }
        let mut cells = vec![Filled::default(); TILE * TILE * TILE];
        near.fill(&mut cells, first, [0; 3], TILE);
        let is_all = |filled: Filled| cells.iter().all(|cell| *cell == filled);
        match () {
            () if is_all(Filled::default()) => Tile::Empty,
            () if is_all(Filled::WHOLE) => Tile::Full,
            () => Tile::Cut(cells.into()),
        }
    }

    /// The bodies that may fill some of a box. In a scene with many bodies these are few, and all others would be asked
    /// at each place.
    fn near<'a>(&'a self, lattice: &'a Lattice, within: &Aabb) -> Near<'a> {
        // places on the walls of the box are moved inwards
        let asked = within.grown(BESIDE_WALL * lattice.step.max_element());
        let may_fill = |body: &&dyn Walls| {
            let most = body.range(&asked).hi;
            most >= 0.0 || most.is_nan()
        };
        let bodies = self.bodies.iter().map(|body| &**body as &dyn Walls);
        Near { bodies: bodies.filter(may_fill).collect(), lattice }
    }
}

/// The bodies that may fill the cells of a tile.
struct Near<'a> {
    bodies: Vec<&'a dyn Walls>,
    lattice: &'a Lattice,
}

impl Near<'_> {
    /// Fills the cells of a tile from `at` on, `size` along each axis. Cells beyond the lattice stay empty.
    fn fill(&self, cells: &mut [Filled], first: [usize; 3], at: [usize; 3], size: usize) {
        let lattice = self.lattice;
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
                self.fill(cells, first, at, half);
            }
            return;
        }
        let filled = if range.lo > 0.0 { Filled::WHOLE } else { self.part(&within, range).within(&within) };
        cells[at[0] + TILE * (at[1] + TILE * at[2])] = filled;
    }

    /// The filled part of a cell whose range is not of one sign. Its eight parts are treated one by one,
    /// because of curved surfaces and thin parts.
    fn part(&self, within: &Aabb, range: Interval) -> Part {
        let lattice = self.lattice;
        // a body that ends in a wall of the box has no surface there
        let margin = BESIDE_WALL * lattice.step;
        let (low, high) = (lattice.domain.min + margin, lattice.domain.max - margin);
        let omega = |p: DVec3| {
            let p = p.clamp(low, high);
            self.bodies.iter().map(|body| body.omega(p)).fold(f64::NEG_INFINITY, f64::max)
        };
        if range == Interval::ALL {
            let inside = within.corners().map(|corner| is_inside(omega(corner)));
            if inside.iter().all(|is| *is == inside[0]) {
                return if inside[0] { Part::whole(within) } else { Part::default() };
            }
        }
        let along = [within.min, within.centre(), within.max];
        let place = |[i, j, k]: [usize; 3]| DVec3::new(along[i].x, along[j].y, along[k].z);
        let values: [f64; 27] = std::array::from_fn(|n| omega(place([n % 3, n / 3 % 3, n / 9])));
        let parts = (0..8).map(|n| {
            let [i, j, k] = [n & 1, n >> 1 & 1, n >> 2];
            let part = Aabb::new(place([i, j, k]), place([i + 1, j + 1, k + 1]));
            // in the order of the box's corners
            let values =
                std::array::from_fn(|c| values[i + (c & 1) + 3 * (j + (c >> 1 & 1)) + 9 * (k + (c >> 2))]);
            Part::of(&part, &values, &omega).seen_from(part.centre() - within.centre())
        });
        parts.fold(Part::default(), Part::plus)
    }

    fn range(&self, over: &Aabb) -> Interval {
        let ranges = self.bodies.iter().map(|body| body.range(over));
        ranges.fold(Interval::new(f64::NEG_INFINITY, f64::NEG_INFINITY), |all, range| {
            Interval::new(all.lo.max(range.lo), all.hi.max(range.hi))
        })
    }
}

/// What is filled of a box: integrals over it, of places from its middle.
#[derive(Clone, Copy, Default)]
struct Part {
    volume: f64,
    moment: DVec3,
    /// xx, yy, zz, yz, zx, xy.
    squares: [f64; 6],
}

impl Part {
    /// What is filled of a box, by ω at its corners.
    fn of(within: &Aabb, values: &[f64; 8], omega: &dyn Fn(DVec3) -> f64) -> Self {
        let inside = values.map(is_inside);
        match () {
            () if inside.iter().any(|is| *is != inside[0]) => {
                let cut = cut(&within.corners(), values, omega);
                Self { volume: cut.inside, moment: cut.places, squares: cut.squares }
            }
            () if inside[0] => Self::whole(within),
            () => Self::default(),
        }
    }

    fn whole(within: &Aabb) -> Self {
        let (volume, size) = (within.volume(), within.size());
        let [x, y, z] = (volume / 12.0 * size * size).to_array();
        Self { volume, moment: DVec3::ZERO, squares: [x, y, z, 0.0, 0.0, 0.0] }
    }

    /// The integrals with another origin, from which the middle of the box lies at `by`.
    fn seen_from(self, by: DVec3) -> Self {
        let Self { volume, moment, squares } = self;
        let product = |i: usize, j: usize| moment[i] * by[j] + by[i] * moment[j] + volume * by[i] * by[j];
        let shifts =
            [product(0, 0), product(1, 1), product(2, 2), product(1, 2), product(2, 0), product(0, 1)];
        Self {
            volume,
            moment: moment + volume * by,
            squares: std::array::from_fn(|k| squares[k] + shifts[k]),
        }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            volume: self.volume + other.volume,
            moment: self.moment + other.moment,
            squares: std::array::from_fn(|k| self.squares[k] + other.squares[k]),
        }
    }

    /// How far it fills a cell.
    fn within(self, cell: &Aabb) -> Filled {
        let whole = Self::whole(cell);
        let part = self.volume / whole.volume;
        let square = |k: usize| (self.squares[k] - part * whole.squares[k]) / whole.volume;
        Filled {
            part: part as f32,
            moment: (self.moment / whole.volume).to_array().map(|m| m as f32),
            square: std::array::from_fn(|k| square(k) as f32),
        }
    }
}
