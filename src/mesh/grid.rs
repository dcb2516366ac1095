//! The regular grid on which a surface is sought: its box and its nodes.
//!
//! Invariant: a grid has at least one cell on each axis, its nodes strictly increase along each axis, and the
//! first and last node of an axis are exactly the ends of its box.

use std::fmt;

use glam::DVec3;

use crate::geom::Aabb;

/// How fine a grid is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// Number of cells along the grid's longest side.
    Cells(usize),
    /// Length of a cell's side, in metres.
    Spacing(f64),
}

/// A box filled with cells of equal shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    bounds: Aabb,
    cells: [usize; 3],
}

/// Why there is no grid for a box and a resolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GridError {
    /// The box is empty, infinite or NaN, or it is flat although [`Grid::filling`] needs a volume.
    BadBox(Aabb),
    /// Fewer cells than [`Grid::MIN_CELLS`] were asked for.
    TooFewCells(usize),
    /// The cell's side is not a positive finite number, or `f64` cannot resolve it at these coordinates.
    BadSpacing(f64),
    /// An axis would need this number of cells, which is more than [`Grid::MAX_CELLS`].
    TooManyCells(f64),
}

impl fmt::Display for GridError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BadBox(found) => {
                write!(
                    f,
                    "cannot mesh the box from {} to {}: it must be finite and not flat",
                    found.min, found.max
                )
            }
            Self::TooFewCells(found) => {
                write!(f, "{found} cells along the longest side; at least {} are needed", Grid::MIN_CELLS)
            }
            Self::BadSpacing(found) => {
                write!(f, "cell side {found} is not a positive length that these coordinates can resolve")
            }
            Self::TooManyCells(found) => {
                write!(f, "{found} cells along one side; at most {} are possible", Grid::MAX_CELLS)
            }
        }
    }
}

impl std::error::Error for GridError {}

/// Cells between a solid's bounds and the low side of its padded grid. The numbers are above one half, so
/// that bounds which err by half a cell still hold the solid. They are irrational and differ between axes, so
/// that neither flat faces nor planes of symmetry (x = y, the middle plane) fall onto nodes, where ω = 0
/// would make slivers.
const LOW_MARGIN: DVec3 = DVec3::new(0.618_033_988_749_895, 0.553_241_077_386_224, 0.587_401_051_968_199);

/// The cells that both margins of an axis take together.
const BOTH_MARGINS: f64 = 1.370_818_339_168_115;

impl Grid {
    /// The smallest number of cells along the longest side. Fewer leave no room for the margins.
    pub const MIN_CELLS: usize = 2;
    /// The largest number of cells along a side. A surface across 8192² cells has some 10⁸ vertices, a fifth
    /// of [`Mesh::MAX_VERTICES`](super::Mesh::MAX_VERTICES).
    pub const MAX_CELLS: usize = 8192;

    /// A grid of cubic cells around a solid's own bounds, in metres. It is padded so that the surface stays
    /// off the border.
    ///
    /// # Errors
    /// [`GridError`] if the bounds or the resolution are unusable.
    pub fn around(bounds: &Aabb, resolution: Resolution) -> Result<Self, GridError> {
        if bounds.is_empty() || !bounds.is_finite() {
            return Err(GridError::BadBox(*bounds));
        }
        let longest = bounds.size().max_element();
        let side = match resolution {
            Resolution::Cells(cells) if cells < Self::MIN_CELLS => return Err(GridError::TooFewCells(cells)),
            Resolution::Cells(cells) => longest / (cells as f64 - BOTH_MARGINS),
            Resolution::Spacing(side) => side,
        };
        check_side(side, bounds)?;
        let mut cells = [0; 3];
        for (axis, count) in cells.iter_mut().enumerate() {
            // on the longest axis this is the whole number that was asked for only up to rounding
            let needed = bounds.size()[axis] / side + BOTH_MARGINS;
            *count = cell_count((needed - 1e-6).ceil())?;
        }
        let min = bounds.min - side * LOW_MARGIN;
        let counts = DVec3::from_array(cells.map(|n| n as f64));
        Ok(Self { bounds: Aabb::new(min, min + side * counts), cells })
    }

    /// A grid that fills an imposed box exactly, in metres. Everything outside the box counts as fluid, so a
    /// solid that reaches the border is closed by faces on it. The cells are as near to cubes as whole
    /// numbers of them allow, and no side is longer than asked for.
    ///
    /// # Errors
    /// [`GridError`] if the box or the resolution are unusable.
    pub fn filling(domain: &Aabb, resolution: Resolution) -> Result<Self, GridError> {
        if !domain.is_finite() || domain.size().min_element() <= 0.0 {
            return Err(GridError::BadBox(*domain));
        }
        let side = match resolution {
            Resolution::Cells(cells) if cells < Self::MIN_CELLS => return Err(GridError::TooFewCells(cells)),
            Resolution::Cells(cells) => domain.size().max_element() / cells as f64,
            Resolution::Spacing(side) => side,
        };
        check_side(side, domain)?;
        let mut cells = [0; 3];
        for (axis, count) in cells.iter_mut().enumerate() {
            *count = cell_count((domain.size()[axis] / side - 1e-6).ceil().max(1.0))?;
        }
        let grid = Self { bounds: *domain, cells };
        check_side(grid.spacing().min_element(), domain)?;
        Ok(grid)
    }

    /// What reaches no farther out of a box than this, in its longest sides, counts as within it.
    pub const BESIDE: f64 = 1e-3;

    /// A grid of which the box and the numbers of cells are known, as of one that was stored.
    ///
    /// # Errors
    /// [`GridError`] if no grid can have them.
    pub fn of_cells(bounds: &Aabb, cells: [usize; 3]) -> Result<Self, GridError> {
        if !bounds.is_finite() || bounds.size().min_element() <= 0.0 {
            return Err(GridError::BadBox(*bounds));
        }
        for count in cells {
            if count == 0 {
                return Err(GridError::TooFewCells(count));
            }
            cell_count(count as f64)?;
        }
        let grid = Self { bounds: *bounds, cells };
        check_side(grid.spacing().min_element(), bounds)?;
        Ok(grid)
    }

    /// A grid for what of a solid's bounds lies in a box: around the bounds, or filling the part in the box if that
    /// is smaller.
    ///
    /// # Errors
    /// [`GridError`] if the boxes or the resolution are unusable.
    pub fn within(bounds: &Aabb, domain: &Aabb, resolution: Resolution) -> Result<Self, GridError> {
        let over = bounds.intersection(&domain.grown(Self::BESIDE * domain.size().max_element()));
        if *bounds == over || over.is_empty() {
            Self::around(bounds, resolution)
        } else {
            Self::filling(&over, resolution)
        }
    }

    /// The box that the cells fill, in metres.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// The numbers of cells along x, y and z.
    pub fn cells(&self) -> [usize; 3] {
        self.cells
    }

    /// The side lengths of a cell, in metres.
    pub fn spacing(&self) -> DVec3 {
        self.bounds.size() / DVec3::from_array(self.cells.map(|n| n as f64))
    }

    /// The coordinates of the nodes along an axis (0, 1 or 2), ascending: one more than there are cells.
    ///
    /// # Panics
    /// If `axis` is not below 3.
    pub fn nodes(&self, axis: usize) -> Vec<f64> {
        let (count, first, last) = (self.cells[axis], self.bounds.min[axis], self.bounds.max[axis]);
        let side = self.spacing()[axis];
        let mut nodes: Vec<f64> = (0..count).map(|i| first + side * i as f64).collect();
        nodes.push(last);
        nodes
    }
}

/// Refuses a side that moves a coordinate of the box by only a few units in the last place: nodes
/// would coincide.
fn check_side(side: f64, bounds: &Aabb) -> Result<(), GridError> {
    let largest = bounds.min.abs().max(bounds.max.abs()).max_element();
    if side.is_finite() && side > 1e-12 * largest { Ok(()) } else { Err(GridError::BadSpacing(side)) }
}

fn cell_count(needed: f64) -> Result<usize, GridError> {
    if needed <= Grid::MAX_CELLS as f64 { Ok(needed as usize) } else { Err(GridError::TooManyCells(needed)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box() -> Aabb {
        Aabb::new(DVec3::ZERO, DVec3::ONE)
    }

    #[test]
    fn padded_grid_has_cubic_cells_and_holds_the_bounds() {
        let bounds = Aabb::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 1.0, 2.5));
        let grid = Grid::around(&bounds, Resolution::Cells(30)).unwrap();
        let side = grid.spacing();
        assert_eq!(grid.cells()[0], 30);
        assert!((side - side.x).abs().max_element() < 1e-12);
        assert!(grid.bounds().contains(bounds.min - 0.5 * side.x));
        assert!(grid.bounds().contains(bounds.max + 0.5 * side.x));
    }

    #[test]
    fn padded_grid_keeps_nodes_off_faces_and_off_the_middle() {
        let grid = Grid::around(&unit_box(), Resolution::Cells(64)).unwrap();
        for axis in 0..3 {
            for plane in [0.0, 0.5, 1.0] {
                let in_cells = (plane - grid.bounds().min[axis]) / grid.spacing()[axis];
                assert!((in_cells - in_cells.round()).abs() > 0.01, "axis {axis}, plane {plane}: {in_cells}");
            }
        }
    }

    #[test]
    fn imposed_box_is_filled_exactly() {
        let domain = Aabb::new(DVec3::ZERO, DVec3::new(3.0, 1.0, 0.1));
        let grid = Grid::filling(&domain, Resolution::Cells(10)).unwrap();
        assert_eq!(grid.cells(), [10, 4, 1]);
        for axis in 0..3 {
            let nodes = grid.nodes(axis);
            assert_eq!((nodes[0], nodes[nodes.len() - 1]), (domain.min[axis], domain.max[axis]));
            assert!(nodes.is_sorted_by(|a, b| a < b));
        }
    }

    #[test]
    fn a_grid_is_made_again_of_its_box_and_its_cells() {
        let bounds = Aabb::new(DVec3::new(-1.0, 0.0, 2.0), DVec3::new(2.0, 1.0, 2.5));
        let grid = Grid::around(&bounds, Resolution::Cells(30)).unwrap();
        assert_eq!(Grid::of_cells(grid.bounds(), grid.cells()), Ok(grid));
        assert_eq!(Grid::of_cells(&unit_box(), [4, 0, 4]), Err(GridError::TooFewCells(0)));
        assert!(matches!(Grid::of_cells(&unit_box(), [4, usize::MAX, 4]), Err(GridError::TooManyCells(_))));
        assert!(matches!(Grid::of_cells(&Aabb::EMPTY, [4; 3]), Err(GridError::BadBox(_))));
    }

    #[test]
    fn unusable_boxes_and_resolutions_are_errors() {
        let flat = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(Grid::filling(&flat, Resolution::Cells(8)), Err(GridError::BadBox(flat)));
        assert!(matches!(Grid::around(&Aabb::EMPTY, Resolution::Cells(8)), Err(GridError::BadBox(_))));
        assert_eq!(Grid::around(&unit_box(), Resolution::Cells(1)), Err(GridError::TooFewCells(1)));
        for side in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-15] {
            assert!(matches!(
                Grid::around(&unit_box(), Resolution::Spacing(side)),
                Err(GridError::BadSpacing(_))
            ));
        }
        assert!(matches!(
            Grid::around(&unit_box(), Resolution::Spacing(1e-5)),
            Err(GridError::TooManyCells(_))
        ));
    }
}
