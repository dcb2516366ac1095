//! Rows of sites that fill a box with any number of particles: those of a lattice, except that a part of the
//! rows hold one site more than the others.
//!
//! A number of particles is seldom a product of three numbers. If surplus sites of the next larger lattice
//! were left out, each particle would have more mass than its cell has room: with 2.6 % of vacancies a fluid
//! at rest bursts at the beginning.
//!
//! Invariant: the number of sites is exactly the wanted one, each row spans the box, and rows differ by at
//! most one site.

use glam::DVec3;

use crate::geom::Aabb;

/// Penalty for rows of different length, relative to cells that are longer than wide by one part in their
/// length.
const UNEVEN: f64 = 1.0;

/// How a fraction grows from row to row and from layer to layer so that its values are spread evenly over both: the
/// powers of the root of a³ = a + 1 (Roberts 2018).
const SPREAD: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];

/// Rows of sites along an axis of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    bounds: Aabb,
    /// The axis of the rows.
    axis: usize,
    /// Number of rows along the next axis, and along the one after that.
    across: [usize; 2],
    sites: usize,
}

impl Rows {
    /// The rows that fill a box with this number of sites, whose cells are as much like cubes as can be.
    pub fn filling(bounds: Aabb, sites: usize) -> Self {
        let size = bounds.size();
        let spacing = (size.element_product() / sites.max(1) as f64).cbrt();
        let mut best = (f64::INFINITY, Self { bounds, axis: 0, across: [1, 1], sites });
        for axis in 0..3 {
            let others = [(axis + 1) % 3, (axis + 2) % 3];
            for choice in 0..16 {
                // from one row fewer to two more
                let across = [0, 1].map(|k| {
                    let few = (size[others[k]] / spacing).floor() as usize;
                    (few + (choice >> (2 * k) & 3)).saturating_sub(1).max(1)
                });
                let rows = Self { bounds, axis, across, sites };
                let badness = rows.badness();
                if badness < best.0 {
                    best = (badness, rows);
                }
            }
        }
        best.1
    }

    /// Size of the cells, m; along the rows their mean.
    pub fn cell(&self) -> DVec3 {
        let mut counts = DVec3::ZERO;
        counts[self.axis] = self.sites as f64 / self.number() as f64;
        counts[(self.axis + 1) % 3] = self.across[0] as f64;
        counts[(self.axis + 2) % 3] = self.across[1] as f64;
        self.bounds.size() / counts
    }

    /// Number of sites.
    pub fn len(&self) -> usize {
        self.sites
    }

    /// Whether there are no sites.
    pub fn is_empty(&self) -> bool {
        self.sites == 0
    }

    /// The sites, row by row.
    pub fn sites(&self) -> Vec<DVec3> {
        let size = self.bounds.size();
        let [ny, nz] = self.across;
        let mut sites = Vec::with_capacity(self.sites);
        for (row, is_longer) in self.longer().into_iter().enumerate() {
            let number = self.sites / self.number() + usize::from(is_longer);
            for i in 0..number {
                let mut part = DVec3::ZERO;
                part[self.axis] = (i as f64 + 0.5) / number as f64;
                part[(self.axis + 1) % 3] = ((row % ny) as f64 + 0.5) / ny as f64;
                part[(self.axis + 2) % 3] = ((row / ny) as f64 + 0.5) / nz as f64;
                sites.push(self.bounds.min + size * part);
            }
        }
        sites
    }

    fn number(&self) -> usize {
        self.across[0] * self.across[1]
    }

    /// Which rows hold one site more than the others.
    fn longer(&self) -> Vec<bool> {
        let place = |row: usize| {
            let (j, k) = (row % self.across[0], row / self.across[0]);
            (SPREAD[0] * j as f64 + SPREAD[1] * k as f64).fract()
        };
        let mut order: Vec<usize> = (0..self.number()).collect();
        order.sort_by(|a, b| place(*a).total_cmp(&place(*b)).then(a.cmp(b)));
        let mut longer = vec![false; self.number()];
        order[..self.sites % self.number()].iter().for_each(|&row| longer[row] = true);
        longer
    }

    fn badness(&self) -> f64 {
        let cell = self.cell();
        let stretch = (cell.max_element() / cell.min_element()).ln();
        if self.sites.is_multiple_of(self.number()) {
            return stretch;
        }
        stretch + UNEVEN * self.number() as f64 / self.sites as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_fills_a_box_evenly() {
        let bounds = Aabb::new(DVec3::new(1.0, -2.0, 0.5), DVec3::new(1.6, -1.8, 0.65));
        for number in [1, 2, 7, 100, 999, 1000, 3000, 3001] {
            let rows = Rows::filling(bounds, number);
            let sites = rows.sites();
            assert_eq!(sites.len(), number);
            assert!(sites.iter().all(|&site| bounds.contains(site)));
            let middle = sites.iter().sum::<DVec3>() / number as f64 - 0.5 * (bounds.min + bounds.max);
            // rows span the box, so only the places of the longer ones move the middle
            assert!((middle / bounds.size()).abs().max_element() < 0.5 / (number as f64).cbrt(), "{middle}");
            if number >= 999 {
                let cell = rows.cell();
                assert!(cell.max_element() / cell.min_element() < 1.25, "{number}: {cell}");
            }
        }
    }

    #[test]
    fn a_number_that_a_lattice_has_is_that_lattice() {
        let bounds = Aabb::new(DVec3::ZERO, DVec3::new(0.4, 0.2, 0.8));
        let rows = Rows::filling(bounds, 16 * 8 * 32);
        assert!((rows.cell() - DVec3::splat(0.025)).abs().max_element() < 1e-15);
        let on_lattice = |at: DVec3| {
            let index = at / 0.025 - 0.5;
            (index - index.round()).abs().max_element() < 1e-9
        };
        assert!(rows.sites().into_iter().all(on_lattice));
    }
}
