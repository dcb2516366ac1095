//! The volume and the area of a solid, from sharp meshes of three sizes.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::watch::Ends;
use super::{Grid, GridError, Mesh, MeshError, Resolution, Watch, dual_contouring, shells};
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
    /// The number of separate solids in the coarser mesh. If the two numbers differ, neither is certain.
    pub solids_coarser: usize,
}

/// Why a volume was not found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum VolumeError {
    /// Fewer cells were asked for than the coarsest mesh needs.
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

/// Finds the volume of a solid on meshes with `cells` cells, two thirds and half as many along the longest
/// side of its bounds. `watch` may end the work; progress is not reported.
///
/// # Errors
/// [`VolumeError`] if one of the meshes cannot be made, or is empty.
pub fn volume(
    field: &dyn Field,
    bounds: &Aabb,
    cells: usize,
    watch: &dyn Watch,
) -> Result<Volume, VolumeError> {
    let measured = |cells| {
        let grid = Grid::around(bounds, Resolution::Cells(cells)).map_err(VolumeError::Grid)?;
        let mesh = dual_contouring(field, &grid, &Ends(watch)).map_err(VolumeError::Mesh)?;
        let shells = shells(&mesh);
        let [volume, area] = shells.iter().fold([0.0; 2], |[v, a], shell| [v + shell.volume, a + shell.area]);
        let beyond = beyond(field, &mesh, grid.spacing().min_element());
        Ok(([volume + beyond, area], shells.iter().filter(|shell| shell.is_solid()).count()))
    };
    if cells / 2 < Grid::MIN_CELLS {
        return Err(VolumeError::TooFewCells(cells));
    }
    let ((coarse, solids_coarser), (middle, _), (fine, solids)) =
        (measured(cells / 2)?, measured(2 * cells / 3)?, measured(cells)?);
    if fine[1] == 0.0 {
        return Err(VolumeError::TooThin);
    }
    // edges that no vertex has caught lie unevenly between the cells, so the whole difference is given as the
    // error; two sizes may agree by chance, so a third one is used as well
    let error = |i: usize| {
        let all = [fine[i] - coarse[i], fine[i] - middle[i], middle[i] - coarse[i]];
        all.into_iter().fold(ROUNDING * fine[i].abs(), |most, difference| most.max(difference.abs()))
    };
    let (area, is_limit) = limit([coarse[1], middle[1], fine[1]]);
    Ok(Volume {
        volume: fine[0],
        error: error(0),
        area,
        area_error: if is_limit { error(1) } else { UNCERTAIN * error(1) },
        solids,
        solids_coarser,
    })
}

/// The limit of three areas, for cells in the ratio of 4 to 3 to 2, and whether they converge. Vertices lie
/// on the surface, so the error falls with the square of the cell. If it does not, a part has become visible
/// from one mesh to the next, and the last area counts.
fn limit([coarse, middle, fine]: [f64; 3]) -> (f64, bool) {
    // (3² − 2²)/(4² − 2²), roughly
    let is_small = (fine - coarse).abs() <= LARGEST_STEP * fine;
    let falls = is_small && (0.25..0.6).contains(&((fine - middle) / (fine - coarse)));
    (if falls { fine + (fine - coarse) / 3.0 } else { fine }, falls)
}

/// The volume between a mesh and the surface, m³, negative where the mesh is outside: the integral of the
/// height of the surface over the triangles. Vertices lie on the surface, so the middles of the edges show what the
/// curvature leaves out. Faces on the border of the grid, where the solid is cut, are left out.
fn beyond(field: &dyn Field, mesh: &Mesh, cell: f64) -> f64 {
    let caps: FxHashSet<u32> = mesh.caps.iter().copied().collect();
    let of_triangle = |corners: &[u32; 3]| {
        if corners.iter().all(|corner| caps.contains(corner)) {
            return 0.0;
        }
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        let twice = (b - a).cross(c - a);
        let (area, normal) = (0.5 * twice.length(), twice.normalize_or_zero());
        let middles = [(a, b), (b, c), (c, a)].map(|(p, q)| 0.5 * (p + q));
        area / 3.0 * middles.into_iter().map(|p| height(field, p, normal, cell)).sum::<f64>()
    };
    // in parts of one size, so that the sum does not depend on the threads
    let parts = mesh.triangles.par_chunks(TRIANGLES_PER_PART);
    parts.map(|part| part.iter().map(of_triangle).sum::<f64>()).collect::<Vec<f64>>().into_iter().sum()
}

/// How far the surface is above a point of a triangle, at most a cell. To first order that is ω/|∇ω|, and ω has changed
/// its sign well before only where another face than the triangle's decides ω at the point: the faces of a solid have
/// scales of their own, and the one of the lowest value need not be the nearest. There the change of sign is sought
/// along the triangle's normal. A height of more than a cell occurs only where the mesh is wrong, and is cut off.
fn height(field: &dyn Field, p: DVec3, normal: DVec3, cell: f64) -> f64 {
    let (omega, gradient) = field.omega_grad(p);
    let first = omega / gradient.length();
    if !first.is_finite() {
        return 0.0;
    }
    let first = first.clamp(-cell, cell);
    let is_beyond = |height: f64| (field.omega(p + height * normal) > 0.0) != (omega > 0.0);
    if first.abs() <= NEGLIGIBLE * cell || !is_beyond(EARLY * first) {
        return first;
    }
    let (mut near, mut far) = (0.0, EARLY * first);
    for _ in 0..HALVED {
        let middle = 0.5 * (near + far);
        if is_beyond(middle) { far = middle } else { near = middle }
    }
    0.5 * (near + far)
}

/// Heights below this part of a cell are taken to first order.
const NEGLIGIBLE: f64 = 1e-6;

/// The part of a height of first order at which ω has its sign still, unless another face is nearer.
const EARLY: f64 = 0.75;

/// Bisections of a height.
const HALVED: usize = 16;

/// Triangles that a thread takes at a time.
const TRIANGLES_PER_PART: usize = 4096;

/// Areas that differ by a larger part show something new rather than a smaller error.
const LARGEST_STEP: f64 = 0.05;

/// Safety factor on the differences where the error of an area does not fall as expected.
const UNCERTAIN: f64 = 2.0;

/// The least relative error: sums over many triangles are not more exact.
const ROUNDING: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::mesh::Unwatched;

    fn ball(radius: f64) -> impl Field {
        Closures {
            omega: move |p: DVec3| radius * radius - p.length_squared(),
            gradient: |p: DVec3| -2.0 * p,
        }
    }

    #[test]
    fn the_volume_of_a_ball_is_right_within_its_error() {
        let unit = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        let found = volume(&ball(1.0), &unit, 48, &Unwatched).unwrap();
        let exact = 4.0 / 3.0 * std::f64::consts::PI;
        // what the chords leave out is added to second order, so that the error falls with the fourth power of the cell
        assert!((found.volume - exact).abs() < found.error && found.error < 1e-5 * exact, "{found:?}");
        let area = 4.0 * std::f64::consts::PI;
        assert!((found.area - area).abs() < found.area_error && found.area_error < 0.02 * area, "{found:?}");
        assert_eq!((found.solids, found.solids_coarser), (1, 1));
    }

    #[test]
    fn faces_with_different_scales_have_the_volume_of_the_solid_between_them() {
        // near the rim the plane has the lower value although the ball is nearer
        let half = Closures {
            omega: |p: DVec3| (1000.0 * (1.0 - p.length_squared())).min(p.z - 0.1),
            gradient: |p: DVec3| {
                let is_plane = p.z - 0.1 < 1000.0 * (1.0 - p.length_squared());
                if is_plane { DVec3::Z } else { -2000.0 * p }
            },
        };
        let bounds = Aabb::new(DVec3::new(-1.0, -1.0, 0.1), DVec3::ONE);
        let found = volume(&half, &bounds, 48, &Unwatched).unwrap();
        let exact = std::f64::consts::PI * 0.9_f64.powi(2) * (3.0 - 0.9) / 3.0;
        assert!((found.volume - exact).abs() < found.error, "{found:?} {exact}");
        assert!(found.error < 1e-3 * exact, "{found:?}");
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
            let found = volume(&cube, &bounds, 64, &Unwatched).unwrap();
            assert!((found.area - 6.0).abs() <= found.area_error && found.area_error < 0.01, "{found:?}");
            assert!((found.volume - 1.0).abs() <= found.error && found.error < 1e-3, "{found:?}");
        }
    }

    #[test]
    fn the_volume_of_a_plate_with_small_holes_is_right_within_its_error() {
        // holes of three cells, in a plate of little more than one
        let holes = |p: DVec3| {
            let near = glam::DVec2::new(p.x, p.y) / 0.4;
            let way = 0.4 * (near - near.round());
            (way.length(), way)
        };
        let box_of = |p: DVec3| DVec3::new(1.0, 1.0, 0.025) - p.abs();
        let plate = Closures {
            omega: |p: DVec3| box_of(p).min_element().min(holes(p).0 - 0.06),
            gradient: |p: DVec3| {
                let (faces, (distance, way)) = (box_of(p), holes(p));
                if distance - 0.06 < faces.min_element() {
                    return way.normalize_or_zero().extend(0.0);
                }
                let face = faces.min_position();
                -p[face].signum() * DVec3::AXES[face]
            },
        };
        let bounds = Aabb::new(DVec3::new(-1.0, -1.0, -0.025), DVec3::new(1.0, 1.0, 0.025));
        let found = volume(&plate, &bounds, 96, &Unwatched).unwrap();
        let exact = 0.05 * (4.0 - 25.0 * std::f64::consts::PI * 0.06_f64.powi(2));
        assert!(
            (found.volume - exact).abs() < found.error && found.error < 2e-3 * exact,
            "{found:?} {exact}"
        );
    }

    #[test]
    fn areas_lead_to_a_limit_where_their_errors_fall_with_the_square_of_the_cell() {
        let areas = [4.0, 3.0, 2.0].map(|cell: f64| 10.0 - 0.01 * cell * cell);
        assert!((limit(areas).0 - 10.0).abs() < 1e-12);
        // fins that only the last mesh shows, and some of which the second one shows a part
        assert_eq!(limit([123.4, 150.0, 174.6]), (174.6, false));
        assert_eq!(limit([100.0, 110.0, 174.6]), (174.6, false));
        assert_eq!(limit([6.0, 6.0, 6.0]), (6.0, false));
    }

    #[test]
    fn what_the_box_cuts_off_has_the_volume_of_what_is_left() {
        let half = Aabb::new(DVec3::NEG_ONE, DVec3::new(1.0, 1.0, 0.0));
        let found = volume(&ball(1.0), &half, 48, &Unwatched).unwrap();
        let exact = 2.0 / 3.0 * std::f64::consts::PI;
        // the grid is a cell larger than the box
        assert!((found.volume - exact).abs() < 0.1 * exact, "{found:?}");
    }

    #[test]
    fn what_has_no_mesh_has_no_volume() {
        let unit = Aabb::new(DVec3::NEG_ONE, DVec3::ONE);
        assert_eq!(volume(&ball(1e-3), &unit, 16, &Unwatched), Err(VolumeError::TooThin));
        assert_eq!(volume(&ball(1.0), &unit, 3, &Unwatched), Err(VolumeError::TooFewCells(3)));
        let undefined = Closures { omega: |_| f64::NAN, gradient: |_| DVec3::ZERO };
        assert!(matches!(volume(&undefined, &unit, 16, &Unwatched), Err(VolumeError::Mesh(_))));
    }
}
