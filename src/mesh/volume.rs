//! The volume and the area of a solid, from sharp meshes of two sizes.

use super::{Grid, GridError, MeshError, Resolution, dual_contouring, shells};
use crate::field::Field;
use crate::geom::Aabb;

/// The volume and the area of a solid, with estimates of their errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// The volume, m³.
    pub volume: f64,
    /// An estimate of the error of the volume, m³.
    pub error: f64,
    /// The area of the surface, m².
    pub area: f64,
    /// An estimate of the error of the area, m².
    pub area_error: f64,
    /// The number of separate solids in the finer mesh.
    pub solids: usize,
    /// The number of separate solids in the coarser mesh. If it is another one, neither is certain.
    pub solids_coarser: usize,
}

/// Why a volume was not found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VolumeError {
    /// Fewer cells were asked for than two meshes need.
    TooFewCells(usize),
    /// There is no grid for the box.
    Grid(GridError),
    /// The field could not be meshed.
    Mesh(MeshError),
    /// The solid is thinner than the cells everywhere, so its mesh is empty.
    TooThin,
}

impl std::fmt::Display for VolumeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooFewCells(cells) => {
                let least = 2 * Grid::MIN_CELLS;
                write!(
                    f,
                    "a volume needs at least {least} cells along the longest side, and {cells} were asked for"
                )
            }
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
    let measured = |cells| {
        let grid = Grid::around(bounds, Resolution::Cells(cells)).map_err(VolumeError::Grid)?;
        let mesh = dual_contouring(field, &grid, &|_| {}).map_err(VolumeError::Mesh)?;
        let shells = shells(&mesh);
        let sums = shells.iter().fold([0.0; 2], |[v, a], shell| [v + shell.volume, a + shell.area]);
        Ok((sums, shells.iter().filter(|shell| shell.is_solid()).count()))
    };
    if cells / 2 < Grid::MIN_CELLS {
        return Err(VolumeError::TooFewCells(cells));
    }
    let ((coarse, solids_coarser), (fine, solids)) = (measured(cells / 2)?, measured(cells)?);
    if fine[1] == 0.0 {
        return Err(VolumeError::TooThin);
    }
    // vertices lie on the surface, so errors fall as h², and a third of the difference leads to the limit; edges
    // that no vertex has caught lie unevenly between the cells, so the whole difference is given as the error
    let differences = [0, 1].map(|i: usize| fine[i] - coarse[i]);
    let error = |i: usize| differences[i].abs().max(ROUNDING * fine[i].abs());
    Ok(Volume {
        volume: fine[0] + differences[0] / 3.0,
        error: error(0),
        area: fine[1] + differences[1] / 3.0,
        area_error: error(1),
        solids,
        solids_coarser,
    })
}

/// The least relative error: sums over many triangles are not more exact.
const ROUNDING: f64 = 1e-12;

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
        let area = 4.0 * std::f64::consts::PI;
        assert!((found.area - area).abs() < found.area_error && found.area_error < 0.02 * area, "{found:?}");
        assert_eq!((found.solids, found.solids_coarser), (1, 1));
    }

    #[test]
    fn the_area_of_a_box_is_right_within_its_error() {
        let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        for turn in [glam::DQuat::IDENTITY, turn] {
            let inner = move |p: DVec3| DVec3::splat(0.5) - (turn.inverse() * p).abs();
            let cube = Closures {
                omega: move |p: DVec3| inner(p).min_element(),
                gradient: move |p: DVec3| {
                    let face = inner(p).min_position();
                    turn * (-(turn.inverse() * p)[face].signum() * DVec3::AXES[face])
                },
            };
            let bounds = Aabb::new(DVec3::splat(-0.87), DVec3::splat(0.87));
            let found = volume(&cube, &bounds, 64).unwrap();
            assert!((found.area - 6.0).abs() <= found.area_error && found.area_error < 0.01, "{found:?}");
            assert!((found.volume - 1.0).abs() <= found.error && found.error < 1e-3, "{found:?}");
        }
    }

    #[test]
    fn what_has_no_mesh_has_no_volume() {
        let unit = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        assert_eq!(volume(&ball(1e-3), &unit, 16), Err(VolumeError::TooThin));
        assert_eq!(volume(&ball(1.0), &unit, 3), Err(VolumeError::TooFewCells(3)));
        let undefined = Closures { omega: |_| f64::NAN, gradient: |_| DVec3::ZERO };
        assert!(matches!(volume(&undefined, &unit, 16), Err(VolumeError::Mesh(_))));
    }
}
