//! Measures a solid: its volume and area on meshes, what is too thin for their cells, and volume and area along lines
//! where something is.

use super::facts::{Box3, Facts, RESOLUTION, VOLUME_CELLS};
use crate::cli::failure::Failure;
use crate::cli::hidden::{knows_ranges, without_ranges};
use rfm::Solid;
use rfm::field::Field;
use rfm::geom::{Aabb, to_thousandths};
use rfm::mesh::{
    self, ByLines, Grid, Mesh, MeshError, Resolution, Stretch, ThinCells, Volume, VolumeError, Watch,
};
use rfm::solid::Bounds;

/// The most cells on three faces of the bounds with which a solid is measured that is too thin for the usual ones, 512
/// along each side of a cube, and how often it gets more.
const MOST_ON_FACES: f64 = 3.0 * 512.0 * 512.0;
const REFINED: usize = 3;

/// Cells by which a mesh may fall short of the bounds of its solid: tips and sharp rims are cut off.
const HIDDEN_CELLS: f64 = 2.0;

/// The share of the work that is done when the volume is known.
const MESHES: f64 = 0.5;

/// What rounding may add to the sums over triangles, relative to them.
const ROUNDING: f64 = 1e-12;

/// What is known of a solid, what its meshes miss, and what is to be said about the search. The watch may end
/// it with what was found until then.
pub(super) fn measure(
    solid: &Solid,
    file: &str,
    watch: &dyn Watch,
    notes: &mut Vec<String>,
) -> Result<(Facts, ThinCells), Failure> {
    let mut facts = Facts::unknown(solid, file);
    let bounds = match solid.bounds() {
        Bounds::Within(bounds) => bounds,
        Bounds::Unbounded => return Ok((facts, ThinCells::NONE)),
        Bounds::Empty => {
            return Ok((of_nothing(facts), ThinCells::NONE));
        }
    };
    facts.bounds = Some(Box3::of(bounds));
    facts.are_unproven = !solid.bounds_are_tight();
    let triangles = solid.triangles().map(|(places, triangles)| Mesh::from_triangles(places, triangles));
    if let Some(mesh) = &triangles {
        exact(mesh, &mut facts);
    }
    if triangles.is_none() && watch.is_over() {
        let thin = ThinCells { ended: true, ..ThinCells::NONE };
        ended_before_meshes(&mut facts);
        tell_of_end(solid, Some(thin), &mut facts, notes);
        return Ok((facts, thin));
    }
    let surface = solid.surface(bounds.grown(0.1 * bounds.size().max_element()));
    let grid = match Grid::around(bounds, RESOLUTION) {
        Ok(grid) => grid,
        Err(error) => {
            // one solid that is next to nothing, or far away, says nothing about the others of a file
            let place = to_thousandths(bounds.centre());
            let why = format!("the room around {place} cannot be divided: {error}");
            facts.no_volume = Some(why).filter(|_| facts.volume.is_none());
            return Ok((facts, ThinCells::NONE));
        }
    };
    if triangles.is_some() {
        let thin = thin_cells(solid, &*surface, &grid, watch, notes);
        tell_of_end(solid, thin, &mut facts, notes);
        return Ok((facts, thin.unwrap_or(ThinCells::NONE)));
    }
    let meshing = Stretch { watch, from: 0.0, to: MESHES };
    let searching = Stretch { watch, from: MESHES, to: 1.0 };
    let by_meshes = by_meshes(&*surface, bounds, &meshing, &mut facts)?;
    let (mut found, shows_nothing) = match by_meshes {
        ByMeshes::Measured(found) => (Some(found), false),
        ByMeshes::Ended => (None, false),
        ByMeshes::ShowNothing => (None, true),
        ByMeshes::Impossible => return Ok((facts, ThinCells::NONE)),
    };
    let by_lines = || mesh::by_lines(&*surface, bounds, watch);
    // the search for thin parts follows slopes, of which a choice has none, and takes the longer for it
    let of_choices = (solid.may_choose() && knows_ranges(solid, grid.bounds())).then(by_lines).flatten();
    let thin = thin_cells(solid, &*surface, &grid, &searching, notes);
    tell_of_end(solid, thin, &mut facts, notes);
    facts.resolved = found.and_then(|found| found.shows_all(thin.as_ref()));
    // of a plate that lies between the nodes nothing is seen, but the search may have found it
    let is_hidden = shows_nothing && thin.is_some_and(|thin| thin.count > 0 && !thin.ended);
    // a sheet or a wire, of which cells show little or nothing, is crossed by lines
    let hides_parts = facts.resolved != Some(true) && thin.is_some_and(|thin| thin.count > 0);
    let shows_nothing = shows_nothing && thin.is_some();
    let lines = of_choices.or_else(|| (hides_parts || shows_nothing).then(by_lines).flatten());
    match (&lines, found) {
        (Some(lines), Some(by_meshes)) if !hides_parts && by_meshes.agrees_with(lines) => {
            let trusted = by_meshes.trusted_no_more_than(lines);
            (facts.volume_error, facts.area_error) = (Some(trusted.error), Some(trusted.area_error));
            found = Some(trusted);
        }
        (Some(lines), _) => {
            take_by_lines(lines, bounds, &mut facts);
            found = None;
        }
        (None, _) => {}
    }
    let misses_parts = facts.resolved == Some(true) && found.is_some_and(|found| found.is_uncertain());
    if let Some(thin) = thin.filter(|_| facts.resolved == Some(false) || is_hidden || misses_parts) {
        let finer =
            refine((solid, &*surface, bounds), (&grid, thin), lines.as_ref(), watch, (&mut facts, notes));
        found = finer.or(found);
    }
    if facts.resolved == Some(true) && found.is_some_and(|found| found.is_uncertain()) {
        facts.resolved = None;
    }
    if facts.resolved == Some(false) && facts.lines.is_none() {
        // three grids may agree about what all of them miss
        (facts.volume_error, facts.area_error) = (None, None);
    }
    // a part too thin for a cell would have been found
    facts.shows_nothing =
        shows_nothing && lines.is_none() && thin.is_some_and(|thin| thin.count == 0 && !thin.ended);
    Ok((facts, thin.unwrap_or(ThinCells::NONE)))
}

/// Says that there was no time for the meshes.
fn ended_before_meshes(facts: &mut Facts) {
    facts.unfinished.push("volume");
    facts.no_volume = Some("its meshes were not finished in time; --budget gives more of it".into());
}

/// What is known of a solid that is empty.
fn of_nothing(facts: Facts) -> Facts {
    let zero = Some(0.0);
    Facts {
        empty: true,
        volume: zero,
        volume_error: zero,
        area: zero,
        area_error: zero,
        components: Some(0),
        resolved: Some(true),
        thin_cells: Some(0),
        ..facts
    }
}

/// What came of the meshes that show the volume.
#[derive(Debug, Clone, Copy, PartialEq)]
enum ByMeshes {
    /// The volume.
    Measured(Volume),
    /// A part of the work, until it was ended.
    Ended,
    /// No part of the solid.
    ShowNothing,
    /// The solid cannot be meshed.
    Impossible,
}

/// Measures the volume and the area on meshes with the usual number of cells.
fn by_meshes(
    surface: &dyn Field,
    bounds: &Aabb,
    watch: &dyn Watch,
    facts: &mut Facts,
) -> Result<ByMeshes, Failure> {
    match mesh::volume(surface, bounds, VOLUME_CELLS, watch) {
        Ok(found) => {
            take(&found, bounds, VOLUME_CELLS, facts);
            Ok(ByMeshes::Measured(found))
        }
        Err(VolumeError::TooThin) => {
            let why = format!("it is empty, or too thin for {VOLUME_CELLS} cells along its longest side");
            facts.no_volume = Some(why + &uneven_sides(bounds).unwrap_or_default());
            // nothing shows how far it reaches
            facts.are_loose = true;
            Ok(ByMeshes::ShowNothing)
        }
        Err(error @ VolumeError::TooFewCells(_)) => Err(Failure::usage(error)),
        Err(VolumeError::Grid(error)) => Err(Failure::usage(error)),
        Err(VolumeError::Mesh(MeshError::Ended)) => {
            ended_before_meshes(facts);
            Ok(ByMeshes::Ended)
        }
        Err(VolumeError::Mesh(
            error @ (MeshError::NotANumber { .. } | MeshError::TooManyVertices { .. }),
        )) => {
            facts.no_volume = Some(error.to_string());
            Ok(ByMeshes::Impossible)
        }
    }
}

/// What there is to ask of bounds with a side that is far longer than another, as in
/// `box([0, 0, 0], [10 mm, 20 mm, 5])`.
fn uneven_sides(bounds: &Aabb) -> Option<String> {
    let sides = bounds.size();
    let ratio = sides.max_element() / sides.min_element();
    let axis = |side: f64| ["x", "y", "z"].into_iter().zip(sides.to_array()).find(|(_, own)| *own == side);
    let (long, _) = axis(sides.max_element())?;
    let (short, _) = axis(sides.min_element())?;
    (ratio.is_finite() && ratio > VOLUME_CELLS as f64).then(|| {
        format!(
            "; along {long} it is {ratio:.0} times as long as along {short}: is a unit such as mm missing?"
        )
    })
}

/// The figures of meshes, the finest of which has so many cells along the longest side of the solid's bounds.
fn take(found: &Volume, bounds: &Aabb, cells: usize, facts: &mut Facts) {
    let hidden = HIDDEN_CELLS * bounds.size().max_element() / cells as f64;
    let excess = (found.extent.min - bounds.min).max(bounds.max - found.extent.max);
    facts.are_loose = excess.max_element() > hidden;
    facts.no_volume = None;
    facts.lines = None;
    facts.cells = Some(cells);
    facts.volume = Some(found.volume);
    facts.volume_error = Some(found.error);
    facts.area = Some(found.area);
    facts.area_error = Some(found.area_error);
    facts.components = Some(found.solids);
    facts.components_coarser = Some(found.solids_coarser);
}

/// The figures that lines have found. Components are those of the cells, if they show any.
fn take_by_lines(found: &ByLines, bounds: &Aabb, facts: &mut Facts) {
    facts.no_volume = None;
    facts.lines = Some(found.lines);
    facts.cells = None;
    facts.volume = Some(found.volume);
    facts.volume_error = Some(found.error);
    facts.area = Some(found.area);
    facts.area_error = Some(found.area_error);
    facts.resolved = Some(false);
    facts.uneven_sides = uneven_sides(bounds);
}

/// The figures of a solid whose surface is a list of triangles.
fn exact(mesh: &Mesh, facts: &mut Facts) {
    let shells = mesh::shells(mesh);
    let volume = shells.iter().map(|shell| shell.volume).sum::<f64>();
    // that of a hollow body is a difference, and places far from the origin are rounded
    let of_both_sides = shells.iter().map(|shell| shell.volume.abs()).sum::<f64>();
    let farthest = mesh.positions.iter().fold(0.0, |most, p| f64::max(most, p.abs().max_element()));
    let area = shells.iter().map(|shell| shell.area).sum::<f64>();
    let components = shells.iter().filter(|shell| shell.is_solid()).count();
    facts.volume = Some(volume);
    facts.volume_error = Some(ROUNDING * of_both_sides + f64::EPSILON * farthest * area);
    facts.area = Some(area);
    facts.area_error = Some(ROUNDING * area);
    facts.components = Some(components);
    facts.components_coarser = Some(components);
    facts.resolved = Some(true);
}

/// Says that the search for thin parts was ended, or how many cells hide some.
fn tell_of_end(solid: &Solid, thin: Option<ThinCells>, facts: &mut Facts, notes: &mut Vec<String>) {
    if thin.is_some_and(|thin| thin.ended) {
        facts.unfinished.push("thin_cells");
        notes.push(format!(
            "the search for thin parts of `{}` was ended before all of its surface was looked at; --budget gives it \
             more time",
            solid.name()
        ));
    }
    facts.thin_cells = thin.filter(|thin| !thin.ended).map(|thin| thin.count);
}

/// Measures a solid again with the cells that its thin parts need. If these show all of it, and lines do not
/// contradict them, their figures are taken, and returned.
fn refine(
    (solid, surface, bounds): (&Solid, &dyn Field, &Aabb),
    (grid, thin): (&Grid, ThinCells),
    lines: Option<&ByLines>,
    watch: &dyn Watch,
    (facts, notes): (&mut Facts, &mut Vec<String>),
) -> Option<Volume> {
    // what hides in no cell of the usual grid may still hide in the coarser one, of half as many
    let mut needed = if thin.count == 0 { Some(2 * VOLUME_CELLS) } else { thin.cells_needed(grid) };
    for _ in 0..REFINED {
        let can_be_had = |&cells: &usize| cells > VOLUME_CELLS && on_faces(bounds, cells) <= MOST_ON_FACES;
        let cells = needed.filter(can_be_had)?;
        let Ok(grid) = Grid::around(bounds, Resolution::Cells(cells)) else { return None };
        let no_time = format!(
            "there was no time to measure `{}` with the {cells} cells that show its thin parts; --budget gives it more",
            solid.name()
        );
        let thin = match mesh::thin_cells(surface, &grid, watch) {
            Ok(thin) if !thin.ended => thin,
            Ok(_) => {
                facts.wants_time = true;
                notes.push(no_time);
                return None;
            }
            // its volume has reported it
            Err(_) => return None,
        };
        if thin.count > 0 && !thin.is_wedge {
            // where it is thinnest elsewhere, or in steps where the same place needs a little more
            needed = Some(thin.cells_needed(&grid).unwrap_or(0).max(cells + cells / 4));
            continue;
        }
        match mesh::volume(surface, bounds, cells, watch) {
            Ok(found)
                if found.solids == found.solids_coarser
                    && lines.is_none_or(|lines| found.agrees_with(lines)) =>
            {
                take(&found, bounds, cells, facts);
                facts.resolved = Some(true);
                facts.uneven_sides = uneven_sides(bounds);
                return Some(found);
            }
            Err(VolumeError::Mesh(MeshError::Ended)) => {
                facts.wants_time = true;
                notes.push(no_time);
            }
            // the figures of the usual cells, or of lines, stay
            Ok(_) | Err(_) => {}
        }
        return None;
    }
    None
}

/// How many cells three faces of some bounds have, with so many along the longest side.
fn on_faces(bounds: &Aabb, cells: usize) -> f64 {
    let [x, y, z] = (bounds.size() / bounds.size().max_element() * cells as f64).ceil().to_array();
    x * y + y * z + z * x
}

/// What the finest mesh misses; `None` if the formula does not let it be found.
fn thin_cells(
    solid: &Solid,
    surface: &dyn Field,
    grid: &Grid,
    watch: &dyn Watch,
    notes: &mut Vec<String>,
) -> Option<ThinCells> {
    if !knows_ranges(solid, grid.bounds()) {
        notes.push(without_ranges(solid));
        return None;
    }
    // a formula that is not a number somewhere has no such search; its volume has reported it
    mesh::thin_cells(surface, grid, watch).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rfm::glam::DVec3;
    use rfm::{Engine, Program};

    #[test]
    fn measuring_reports_how_far_it_is() {
        let program = Program::from_source("s.rfm", "rfm 1\nsolid s = sphere(1) and z <= 0.5\n").unwrap();
        let solid = program.solid_with("s", Engine::Interpreter).unwrap();
        let shares = std::sync::Mutex::new(Vec::new());
        let note = |done: f64| shares.lock().unwrap().push(done);
        measure(&solid, "s.rfm", &note, &mut Vec::new()).unwrap();
        let shares = shares.into_inner().unwrap();
        let count = |from: f64, to: f64| shares.iter().filter(|done| (from..=to).contains(*done)).count();
        assert!(count(0.0, MESHES) > 10 && count(MESHES, 1.0) > 10, "{shares:?}");
        assert_eq!(count(0.0, 1.0), shares.len());
        assert!(shares.iter().any(|done| *done > 0.99));
    }

    #[test]
    fn bounds_are_loose_if_the_mesh_ends_cells_before_them() {
        let program = Program::from_source("s.rfm", "rfm 1\nsolid s = sphere(1)\n").unwrap();
        let solid = program.solid_with("s", Engine::Interpreter).unwrap();
        let extent = Aabb::new(DVec3::splat(-1.0), DVec3::splat(1.0));
        let found = Volume {
            volume: 4.2,
            error: 0.0,
            area: 12.6,
            area_error: 0.0,
            extent,
            solids: 1,
            solids_coarser: 1,
        };
        let is_loose_by = |excess: f64| {
            let mut facts = Facts::unknown(&solid, "");
            take(&found, &Aabb::new(extent.min, extent.max + DVec3::Y * excess), 100, &mut facts);
            facts.are_loose
        };
        assert_eq!([0.0, 0.01, 0.03, 0.05, 1.0].map(is_loose_by), [false, false, false, true, true]);
    }
}
