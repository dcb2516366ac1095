//! The volume of a solid, from meshes of two sizes.

use super::{Grid, GridError, MeshError, Resolution, check, marching_cubes};
use crate::field::Field;
use crate::geom::Aabb;

/// The volume and the area of a solid, with an estimate of the volume's error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// The volume, m³.
    pub volume: f64,
    /// An estimate of the error of the volume, m³.
    pub error: f64,
    /// The area of the surface, m².
    pub area: f64,
    /// The number of separate solids.
    pub solids: usize,
}

/// Why a volume was not found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VolumeError {
    /// There is no grid for the box or the number of cells.
    Grid(GridError),
    /// The field could not be meshed.
    Mesh(MeshError),
    /// The solid is thinner than the cells everywhere, so its mesh is empty.
    TooThin,
}

impl std::fmt::Display for VolumeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Grid(error) => error.fmt(f),
            Self::Mesh(error) => error.fmt(f),
            Self::TooThin => write!(f, "the solid is too thin for this many cells along its longest side"),
        }
    }
}

impl std::error::Error for VolumeError {}

/// Finds the volume of a solid on meshes with `cells` cells and half as many along the longest side of its
/// bounds.
///
/// # Errors
/// [`VolumeError`] if one of the meshes cannot be made, or is empty.
pub fn volume(field: &dyn Field, bounds: &Aabb, cells: usize) -> Result<Volume, VolumeError> {
    let report = |cells| {
        let grid = Grid::around(bounds, Resolution::Cells(cells)).map_err(VolumeError::Grid)?;
        let mesh = marching_cubes(field, &grid, &|_| {}).map_err(VolumeError::Mesh)?;
        Ok(check(&mesh, field))
    };
    let (coarse, fine) = (report(cells / 2)?, report(cells)?);
    if fine.triangles == 0 {
        return Err(VolumeError::TooThin);
    }
    // vertices lie on the surface, so errors fall as h², and a third of the difference leads to the limit;
    // creases lie unevenly between the cells, so the whole difference is given as the error
    let difference = fine.volume - coarse.volume;
    Ok(Volume {
        volume: fine.volume + difference / 3.0,
        error: difference.abs(),
        area: fine.area,
        solids: fine.solids,
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::field::Closures;

    fn ball(radius: f64) -> impl Field {
        Closures {
            omega: move |p: DVec3| radius * radius - p.length_squared(),
            gradient: |p: DVec3| -2.0 * p,
        }
    }

    #[test]
    fn the_volume_of_a_ball_is_right_within_its_error() {
        let unit = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        let found = volume(&ball(1.0), &unit, 48).unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        assert!((found.volume - exact).abs() < 0.1 * found.error && found.error < 0.02 * exact, "{found:?}");
        assert_eq!(found.solids, 1);
    }

    #[test]
    fn what_has_no_mesh_has_no_volume() {
        let unit = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        assert_eq!(volume(&ball(1e-3), &unit, 16), Err(VolumeError::TooThin));
        assert_eq!(volume(&ball(1.0), &unit, 3), Err(VolumeError::Grid(GridError::TooFewCells(1))));
        let undefined = Closures { omega: |_| f64::NAN, gradient: |_| DVec3::ZERO };
        assert!(matches!(volume(&undefined, &unit, 16), Err(VolumeError::Mesh(_))));
    }
}
