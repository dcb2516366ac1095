//! The volume and the area of a solid, from sharp meshes of three sizes.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::normals::gradients;
use super::{
    ByLines, Grid, GridError, Mesh, MeshError, Resolution, Stretch, ThinCells, Watch, dual_contouring, shells,
};
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
    /// The box of the finer mesh.
    pub extent: Aabb,
    /// The number of separate solids in the finer mesh.
    pub solids: usize,
    /// The number of separate solids in the coarser mesh. If the two numbers differ, neither is certain.
    pub solids_coarser: usize,
}

/// The part of the volume from which on its error tells of a part that coarser meshes have missed: of plates as thin as
/// their cells, errors were a tenth of the volume and more.
const MISSED_PART: f64 = 0.05;

impl Volume {
    /// Whether the meshes show all parts of the solid, of which `thin` were found in the cells of the finest one; `None`
    /// where that is not known.
    pub fn shows_all(&self, thin: Option<&ThinCells>) -> Option<bool> {
        let agree = self.solids == self.solids_coarser;
        // what is left out at the edge of a wedge is within the errors
        let no_thin_parts = thin.is_some_and(|thin| thin.count == 0 || thin.is_wedge);
        let is_known = !agree || !no_thin_parts || thin.is_some_and(|thin| !thin.ended);
        is_known.then_some(agree && no_thin_parts)
    }

    /// Whether the coarser of the meshes are so far off that they must have missed a part.
    pub fn is_uncertain(&self) -> bool {
        self.error > MISSED_PART * self.volume.abs()
    }

    /// Whether lines have found the same volume, within the errors of both.
    pub fn agrees_with(&self, lines: &ByLines) -> bool {
        (self.volume - lines.volume).abs() <= self.error + lines.error
    }

    /// This volume with errors at least as large as those along lines: meshes may not show what lines do not meet.
    #[must_use]
    pub fn trusted_no_more_than(self, lines: &ByLines) -> Self {
        let (error, area_error) = (self.error.max(lines.error), self.area_error.max(lines.area_error));
        Self { error, area_error, ..self }
    }
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
            Self::TooThin => {
                write!(f, "the solid is empty, or too thin for this many cells along its longest side")
            }
        }
    }
}

impl std::error::Error for VolumeError {}

/// Finds the volume of a solid on meshes with `cells` cells, two thirds and half as many along the longest
/// side of its bounds. `watch` receives the share of them that is made, and may end the work.
///
/// # Errors
/// [`VolumeError`] if one of the meshes cannot be made, or is empty.
pub fn volume(
    field: &dyn Field,
    bounds: &Aabb,
    cells: usize,
    watch: &dyn Watch,
) -> Result<Volume, VolumeError> {
    let measured = |cells, [from, to]: [f64; 2]| {
        let grid = Grid::around(bounds, Resolution::Cells(cells)).map_err(VolumeError::Grid)?;
        let mesh = dual_contouring(field, &grid, &Stretch { watch, from, to }).map_err(VolumeError::Mesh)?;
        Ok(Measured::of(field, &mesh, grid.spacing().min_element()))
    };
    if cells / 2 < Grid::MIN_CELLS {
        return Err(VolumeError::TooFewCells(cells));
    }
    let [coarse, middle, fine]: [Measured; 3] = [
        measured(cells / 2, [0.0, COARSE])?,
        measured(2 * cells / 3, [COARSE, MIDDLE])?,
        measured(cells, [MIDDLE, 1.0])?,
    ];
    if fine.area == 0.0 {
        return Err(VolumeError::TooThin);
    }
    let volumes = [coarse.volume, middle.volume, fine.volume];
    let (area, area_spread) = limit([coarse.area, middle.area, fine.area]);
    Ok(Volume {
        volume: fine.volume,
        // heights of several degrees are left out, so that these have no trend to rely on
        error: spread(volumes, false).max(fine.cubic.error()),
        area,
        area_error: area_spread.max(fine.added_area.error()),
        extent: fine.extent,
        solids: fine.solids,
        solids_coarser: coarse.solids,
    })
}

/// The shares of the work that are done with the coarser two of three meshes: it goes with the square of the cells.
const COARSE: f64 = 0.15;
const MIDDLE: f64 = 0.4;

/// How far values of three meshes are apart, as an error of the finest one. Edges that no vertex has caught lie
/// unevenly between the cells, so the whole difference is given. Sizes without a trend may agree by chance.
fn spread([coarse, middle, fine]: [f64; 3], falls: bool) -> f64 {
    let all = [fine - coarse, fine - middle, middle - coarse];
    let most = all.into_iter().fold(0.0, |most, difference| f64::max(most, difference.abs()));
    (if falls { most } else { UNCERTAIN * most }).max(ROUNDING * fine.abs())
}

/// Whether values of three meshes converge: the last step is as large a part of both as with the square of the cell.
/// If not, a part has become visible from one mesh to the next.
fn falls([coarse, middle, fine]: [f64; 3]) -> bool {
    let is_small = (fine - coarse).abs() <= LARGEST_STEP * fine.abs();
    is_small && TREND.contains(&((fine - middle) / (fine - coarse)))
}

/// The limit of three areas, for cells in the ratio of 4 to 3 to 2, and its error. Vertices lie on the surface, so the
/// error falls with the square of the cell. If it does not, the last area counts.
fn limit(areas: [f64; 3]) -> (f64, f64) {
    let ([coarse, _, fine], falls) = (areas, falls(areas));
    // (3² − 2²)/(4² − 2²), roughly
    (if falls { fine + (fine - coarse) / 3.0 } else { fine }, spread(areas, falls))
}

/// What one mesh shows of a solid.
struct Measured {
    volume: f64,
    area: f64,
    /// The box of its vertices.
    extent: Aabb,
    /// The number of separate solids.
    solids: usize,
    /// What the surface has more of area than the triangles.
    added_area: Added,
    /// What the heights in the middles of triangles have added to the volume, after those of the edges.
    cubic: Added,
}

/// What all triangles have added to a sum.
#[derive(Debug, Clone, Copy, Default)]
struct Added {
    sum: f64,
    squares: f64,
}

impl Added {
    fn add(&mut self, own: f64) {
        self.sum += own;
        self.squares += own * own;
    }

    fn join(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, squares: self.squares + other.squares }
    }

    /// The error of the corrected sum: no more than was added, unless chance has cancelled it. Triangles across an edge
    /// of the solid that no vertex has caught add what a few points happen to see of both faces.
    fn error(self) -> f64 {
        self.sum.abs() + DEVIATIONS * self.squares.sqrt()
    }
}

impl Measured {
    /// Adds to a mesh what lies between it and the surface. Vertices lie on the surface, so the heights of the surface
    /// over a triangle, and its slopes, show what the curvature leaves out. Faces on the border of the grid, where the
    /// solid is cut, are left out.
    fn of(field: &dyn Field, mesh: &Mesh, cell: f64) -> Self {
        let caps: FxHashSet<u32> = mesh.caps.iter().copied().collect();
        let is_cap = |corners: &&[u32; 3]| corners.iter().all(|corner| caps.contains(corner));
        let flat = |corners: &[u32; 3]| Flat::new(corners.map(|corner| mesh.positions[corner as usize]));
        let beyond = neighbours(mesh);
        let of_part = |part: &[[u32; 3]]| {
            let (mut quadratic, mut cubic, mut area) = (0.0, Added::default(), Added::default());
            let part: Vec<&[u32; 3]> = part.iter().filter(|corners| !is_cap(corners)).collect();
            let triangles: Vec<Flat> = part.iter().map(|corners| flat(corners)).collect();
            let points: Vec<DVec3> = triangles.iter().flat_map(Flat::points).collect();
            let found = gradients(field, &points);
            for ((corners, triangle), found) in part.iter().zip(&triangles).zip(found.chunks_exact(POINTS)) {
                let heights = triangle.heights((field, cell), found);
                quadratic += triangle.below_edges(&heights);
                cubic.add(triangle.below_middle(&heights));
                let across = beyond_sides(corners, &beyond)
                    .map(|other| other.map(|other| flat(&mesh.triangles[other as usize]).normal));
                area.add(triangle.excess(found, &heights, across));
            }
            (quadratic, cubic, area)
        };
        // in parts of one size, so that the sums do not depend on the threads
        let parts: Vec<_> = mesh.triangles.par_chunks(TRIANGLES_PER_PART).map(of_part).collect();
        let none = (0.0, Added::default(), Added::default());
        let (quadratic, cubic, added_area) = parts
            .into_iter()
            .fold(none, |all, part| (all.0 + part.0, all.1.join(part.1), all.2.join(part.2)));
        let nothing = Aabb::new(DVec3::INFINITY, DVec3::NEG_INFINITY);
        let shells = shells(mesh);
        let [volume, area] = shells.iter().fold([0.0; 2], |[v, a], shell| [v + shell.volume, a + shell.area]);
        Self {
            volume: volume + quadratic + cubic.sum,
            area: area + added_area.sum,
            extent: mesh.positions.iter().fold(nothing, |all, p| Aabb::new(all.min.min(*p), all.max.max(*p))),
            solids: shells.iter().filter(|shell| shell.is_solid()).count(),
            added_area,
            cubic,
        }
    }
}

/// The triangle on the left of each side, by the ends of the side.
type Neighbours = FxHashMap<[u32; 2], u32>;

fn neighbours(mesh: &Mesh) -> Neighbours {
    let sides =
        |(number, &[a, b, c]): (u32, &[u32; 3])| [([a, b], number), ([b, c], number), ([c, a], number)];
    (0..).zip(&mesh.triangles).flat_map(sides).collect()
}

/// The triangles beyond the three sides of one.
fn beyond_sides(&[a, b, c]: &[u32; 3], neighbours: &Neighbours) -> [Option<u32>; 3] {
    [[b, a], [c, b], [a, c]].map(|side| neighbours.get(&side).copied())
}

/// Points of a triangle at which the surface over it is asked for.
const POINTS: usize = 7;

/// How far the points at the edges lie within the triangle, as a part of the way to the corner beyond. On an edge of
/// the solid itself ω would be that of any face.
const WITHIN: f64 = 0.05;

/// Heights of the surface over a triangle: over the middles of its edges, if the face went on, and over its own middle.
struct Heights {
    edges: [f64; 3],
    middle: f64,
}

/// A triangle of a mesh, with the surface over it.
struct Flat {
    corners: [DVec3; 3],
    area: f64,
    normal: DVec3,
}

impl Flat {
    fn new(corners @ [a, b, c]: [DVec3; 3]) -> Self {
        let twice = (b - a).cross(c - a);
        Self { corners, area: 0.5 * twice.length(), normal: twice.normalize_or_zero() }
    }

    /// Points near the middles of the edges, the middle of the triangle, then those between that and the corners.
    fn points(&self) -> [DVec3; POINTS] {
        let [a, b, c] = self.corners;
        let middle = (a + b + c) / 3.0;
        let near = |p: DVec3, q: DVec3, beyond: DVec3| (0.5 * (1.0 - WITHIN)) * (p + q) + WITHIN * beyond;
        let halved = |p: DVec3| 0.5 * (p + middle);
        [near(a, b, c), near(b, c, a), near(c, a, b), middle, halved(a), halved(b), halved(c)]
    }

    fn heights(&self, (field, cell): (&dyn Field, f64), found: &[(f64, DVec3)]) -> Heights {
        let points = self.points();
        let at = |i: usize| height(field, (points[i], found[i]), self.normal, cell);
        let near = [at(0), at(1), at(2)];
        // a height of the second degree that is 0 at the corners has these parts of those over the edges
        let (own, other) = ((1.0 - WITHIN).powi(2), 2.0 * WITHIN * (1.0 - WITHIN));
        let all = near.iter().sum::<f64>() / (own + 2.0 * other);
        Heights { edges: near.map(|height| (height - other * all) / (own - other)), middle: at(3) }
    }

    /// The volume between the triangle and the surface, m³, negative where the triangle is outside: the integral of the
    /// height if that is of the second degree.
    fn below_edges(&self, heights: &Heights) -> f64 {
        self.area / 3.0 * heights.edges.iter().sum::<f64>()
    }

    /// What the height in the middle adds to the volume, so that it is right for a height of the third degree.
    fn below_middle(&self, heights: &Heights) -> f64 {
        9.0 / 20.0 * self.area * (heights.middle - 4.0 / 9.0 * heights.edges.iter().sum::<f64>())
    }

    /// How much more area the surface has than the triangle, m². More than a part of the triangle itself is no surface
    /// above it, but another face of the solid, or a fold of the mesh: at edges that no vertex has caught.
    fn excess(&self, found: &[(f64, DVec3)], heights: &Heights, across: [Option<DVec3>; 3]) -> f64 {
        let most = MOST_ADDED * self.area;
        (self.slope(found) + self.bulge(heights, across)).clamp(-most, most)
    }

    /// By how much the surface above the triangle has more area, m²: the integral of its slope, by the rule that is
    /// right for a surface of the second degree.
    fn slope(&self, found: &[(f64, DVec3)]) -> f64 {
        let excess = found[4..].iter().map(|(_, gradient)| {
            let cosine = gradient.normalize_or_zero().dot(self.normal).abs();
            // where there is no normal nothing is known, and nothing is added
            if cosine > 0.0 { 1.0 / cosine.max(STEEPEST) - 1.0 } else { 0.0 }
        });
        self.area / 3.0 * excess.sum::<f64>()
    }

    /// By how much the surface above the triangle reaches beyond it, m². Given are the normals across its edges. The
    /// true edge is a parabola through the ends and through the place where both faces have their heights. With the
    /// angle δ between the normals, the two triangles together win 2/3 of the edge, times both heights, times tan(δ/2).
    fn bulge(&self, heights: &Heights, across: [Option<DVec3>; 3]) -> f64 {
        let [a, b, c] = self.corners;
        let ways = [b - a, c - b, a - c];
        let of_edge = |i: usize| {
            let Some(other) = across[i] else { return 0.0 };
            // the length of the edge and the sine of δ
            let sine = self.normal.cross(other).dot(ways[i]);
            2.0 / 3.0 * heights.edges[i] * sine / (1.0 + self.normal.dot(other)).max(SHARPEST)
        };
        (0..3).map(of_edge).sum()
    }
}

/// How far the surface is above a point of a triangle, at most a cell. To first order that is ω/|∇ω|, and ω has changed
/// its sign well before only where another face than the triangle's decides ω at the point: the faces of a solid have
/// scales of their own, and the one of the lowest value need not be the nearest. There the change of sign is sought
/// along the triangle's normal. A height of more than a cell occurs only where the mesh is wrong, and is cut off.
fn height(field: &dyn Field, (p, (omega, gradient)): (DVec3, (f64, DVec3)), normal: DVec3, cell: f64) -> f64 {
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
const TRIANGLES_PER_PART: usize = 512;

/// Areas that differ by a larger part show something new rather than a smaller error.
const LARGEST_STEP: f64 = 0.05;

/// The part that the last of two steps has where errors fall with the square of the cell, roughly.
const TREND: Range<f64> = 0.25..0.6;

/// Safety factor on the differences where errors do not fall as expected.
const UNCERTAIN: f64 = 2.0;

/// Standard deviations of what triangles add by chance.
const DEVIATIONS: f64 = 3.0;

/// The most that is added to the area of a triangle, as a part of it. With three times as much the thread of a screw
/// came out 0.4 % too large, and with a third as much the errors of rotated boxes do not hold.
const MOST_ADDED: f64 = 0.3;

/// The least cosine of the angle between the surface and a triangle below it, and the least 1 + cos δ at an edge.
const STEEPEST: f64 = 0.5;
const SHARPEST: f64 = 0.3;

/// The least relative error: vertices are not nearer to the surface, and sums not more exact. Hollow boxes were seen to
/// be off by 1.1e-12.
const ROUNDING: f64 = 1e-11;

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
        for areas in [[123.4, 150.0, 174.6], [100.0, 110.0, 174.6]] {
            assert_eq!(limit(areas), (174.6, UNCERTAIN * (174.6 - areas[0])));
        }
        assert_eq!(limit([6.0, 6.0, 6.0]), (6.0, 6.0 * ROUNDING));
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
    fn three_meshes_and_the_search_for_thin_parts_report_one_progress_each() {
        let shares = std::sync::Mutex::new(Vec::new());
        let note = |done: f64| shares.lock().unwrap().push(done);
        let bounds = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
        volume(&ball(0.9), &bounds, 48, &note).unwrap();
        let found = std::mem::take(&mut *shares.lock().unwrap());
        let most = found.iter().copied().fold(0.0, f64::max);
        assert!(
            most > 0.99 && most <= 1.0 && found.iter().filter(|done| **done < MIDDLE).count() > 2,
            "{found:?}"
        );
        let grid = Grid::around(&bounds, Resolution::Cells(48)).unwrap();
        crate::mesh::thin_cells(&ball(0.9), &grid, &note).unwrap();
        let found = shares.into_inner().unwrap();
        let most = found.iter().copied().fold(0.0, f64::max);
        assert!(most > 0.99 && most <= 1.0 && found.len() > 10, "{found:?}");
    }

    #[test]
    fn a_volume_is_trusted_if_meshes_and_the_search_agree() {
        let sound = Volume {
            volume: 2.0,
            error: 0.01,
            area: 6.0,
            area_error: 0.0,
            extent: Aabb::EMPTY,
            solids: 1,
            solids_coarser: 1,
        };
        let hidden = ThinCells { count: 3, ..ThinCells::NONE };
        let wedge = ThinCells { is_wedge: true, ..hidden };
        let ended = ThinCells { ended: true, ..ThinCells::NONE };
        let found = [None, Some(ThinCells::NONE), Some(wedge), Some(hidden), Some(ended)];
        let shown = |volume: Volume| found.map(|thin| volume.shows_all(thin.as_ref()));
        assert_eq!(shown(sound), [Some(false), Some(true), Some(true), Some(false), None]);
        // a part that the coarser mesh lost may be lost to the finer one, too
        assert_eq!(shown(Volume { solids_coarser: 2, ..sound }), [Some(false); 5]);
        assert!(!sound.is_uncertain() && Volume { error: 0.2, ..sound }.is_uncertain());
        let lines = ByLines { volume: 2.05, error: 0.05, area: 6.0, area_error: 0.1, lines: 100 };
        assert!(sound.agrees_with(&lines) && !sound.agrees_with(&ByLines { volume: 2.1, ..lines }));
        assert_eq!(sound.trusted_no_more_than(&lines), Volume { error: 0.05, area_error: 0.1, ..sound });
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
