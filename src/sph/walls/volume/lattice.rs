//! The lattice of a map.

use glam::DVec3;

use crate::geom::Aabb;

/// Cells along a support radius.
pub(super) const CELLS: usize = 6;

/// The cells of the box. The box has a whole number of them along each axis.
pub(super) struct Lattice {
    pub domain: Aabb,
    /// Size of a cell, m.
    pub step: DVec3,
    pub cells: [usize; 3],
}

impl Lattice {
    /// The lattice of a box for a support radius, m.
    pub fn new(domain: &Aabb, h: f64) -> Self {
        let cells = (domain.size() / h * CELLS as f64).ceil().max(DVec3::ONE);
        Self { domain: *domain, step: domain.size() / cells, cells: cells.to_array().map(|n| n as usize) }
    }

    /// The box of the cells from `first` on, `size` along each axis, in the lattice.
    pub fn cells_from(&self, first: [usize; 3], size: usize) -> Aabb {
        let corner = |add: usize| {
            let place: [usize; 3] = std::array::from_fn(|axis| (first[axis] + add).min(self.cells[axis]));
            self.domain.min + DVec3::from_array(place.map(|n| n as f64)) * self.step
        };
        Aabb::new(corner(0), corner(size))
    }
}
