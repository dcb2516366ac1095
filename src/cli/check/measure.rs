//! Measures a solid: its volume and area on meshes, and what is thinner than their cells.

use super::facts::{Box3, Facts, RESOLUTION, VOLUME_CELLS};
use crate::cli::deadline::Deadline;
use crate::cli::failure::{Failure, note};
use rfm::Solid;
use rfm::field::Field;
use rfm::geom::{Aabb, to_thousandths};
use rfm::glam::DVec3;
use rfm::interval::Interval;
use rfm::mesh::{self, Grid, MeshError, ThinCells, VolumeError};
use rfm::solid::Bounds;

/// Boxes along each side of a solid in which its range is tried; one in `MOST_UNKNOWN` of them may be
/// unknown.
const PROBES: u32 = 16;
const MOST_UNKNOWN: usize = 50;

/// What is known of a solid, and what its meshes miss. At the deadline it ends with what was found until then.
pub(super) fn measure(solid: &Solid, file: &str, deadline: &Deadline) -> Result<(Facts, ThinCells), Failure> {
    let mut facts = Facts::unknown(solid, file);
    let bounds = match solid.bounds() {
        Bounds::Within(bounds) => bounds,
        Bounds::Unbounded => return Ok((facts, ThinCells::NONE)),
        Bounds::Empty => {
            let zero = Some(0.0);
            let facts = Facts {
                empty: true,
                volume: zero,
                volume_error: zero,
                area: zero,
                area_error: zero,
                components: Some(0),
                resolved: Some(true),
                thin_cells: Some(0),
                ..facts
            };
            return Ok((facts, ThinCells::NONE));
        }
    };
    facts.bounds = Some(Box3::of(bounds));
    let surface = solid.surface(bounds.grown(0.1 * bounds.size().max_element()));
    let grid = match Grid::around(bounds, RESOLUTION) {
        Ok(grid) => grid,
        Err(error) => {
            // one solid that is next to nothing, or far away, says nothing about the others of a file
            let place = to_thousandths(bounds.centre());
            facts.no_volume = Some(format!("the room around {place} cannot be divided: {error}"));
            return Ok((facts, ThinCells::NONE));
        }
    };
    let mut shows_nothing = false;
    match mesh::volume(&*surface, bounds, VOLUME_CELLS, deadline) {
        Ok(found) => {
            facts.volume = Some(found.volume);
            facts.volume_error = Some(found.error);
            facts.area = Some(found.area);
            facts.area_error = Some(found.area_error);
            facts.components = Some(found.solids);
            facts.components_coarser = Some(found.solids_coarser);
        }
        Err(VolumeError::TooThin) => {
            facts.no_volume =
                Some(format!("it is empty, or too thin for {VOLUME_CELLS} cells along its longest side"));
            shows_nothing = true;
        }
        Err(error @ VolumeError::TooFewCells(_)) => return Err(Failure::usage(error)),
        Err(VolumeError::Grid(error)) => return Err(Failure::usage(error)),
        Err(VolumeError::Mesh(MeshError::Ended)) => {
            facts.unfinished.push("volume");
            facts.no_volume = Some("its meshes were not finished in time; --budget gives more of it".into());
        }
        Err(VolumeError::Mesh(
            error @ (MeshError::NotANumber { .. } | MeshError::TooManyVertices { .. }),
        )) => {
            facts.no_volume = Some(error.to_string());
            return Ok((facts, ThinCells::NONE));
        }
    }
    let thin = thin_cells(solid, &*surface, &grid, deadline);
    if thin.is_some_and(|thin| thin.ended) {
        facts.unfinished.push("thin_cells");
        note(format!(
            "the search for thin parts of `{}` was ended before all of its surface was looked at; --budget gives it \
             more time",
            solid.name()
        ));
    }
    if let (Some(solids), Some(coarser)) = (facts.components, facts.components_coarser) {
        // what is left out at the edge of a wedge is within the errors
        let no_thin_parts = thin.is_some_and(|thin| thin.count == 0 || thin.is_wedge);
        let is_known = solids != coarser || !no_thin_parts || thin.is_some_and(|thin| !thin.ended);
        facts.resolved = is_known.then_some(solids == coarser && no_thin_parts);
    }
    // a part thinner than a cell would have been found
    facts.shows_nothing = shows_nothing && thin.is_some_and(|thin| thin.count == 0 && !thin.ended);
    facts.thin_cells = thin.filter(|thin| !thin.ended).map(|thin| thin.count);
    Ok((facts, thin.unwrap_or(ThinCells::NONE)))
}

/// What the finest mesh misses; `None` if the formula does not let it be found.
fn thin_cells(solid: &Solid, surface: &dyn Field, grid: &Grid, deadline: &Deadline) -> Option<ThinCells> {
    if !knows_ranges(solid, grid.bounds()) {
        note(format!(
            "thin parts of `{}` are not looked for: the ranges of its formula are unknown",
            solid.name()
        ));
        return None;
    }
    // a formula that is not a number somewhere has no such search; its volume has reported it
    mesh::thin_cells(surface, grid, deadline).ok()
}

/// Whether ranges say anything about the solid nearly everywhere in a box. Where they do not, a search for
/// thin parts would divide every cell to the end.
fn knows_ranges(solid: &Solid, bounds: &Aabb) -> bool {
    let size = bounds.size() / f64::from(PROBES);
    let probe = |i: u32| {
        let place =
            DVec3::new(f64::from(i % PROBES), f64::from(i / PROBES % PROBES), f64::from(i / PROBES.pow(2)));
        let low = bounds.min + size * place;
        solid.range(&Aabb::new(low, low + size)) == Interval::ALL
    };
    let unknown = (0..PROBES.pow(3)).filter(|&i| probe(i)).count();
    unknown * MOST_UNKNOWN <= PROBES.pow(3) as usize
}
