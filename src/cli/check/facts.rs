//! What is known about a solid, and how it is printed.

use std::path::Path;

use serde::Serialize;

use crate::cli::output::{Shown, counted, significant};
use rfm::geom::Aabb;
use rfm::mesh::Resolution;
use rfm::{Program, Solid};

/// Cells along the longest side of the mesh that volumes are measured on.
pub(super) const VOLUME_CELLS: usize = 96;
pub(super) const RESOLUTION: Resolution = Resolution::Cells(VOLUME_CELLS);

/// What is known about a solid. Numbers that do not exist (the volume of an unbounded solid) or that were not
/// found (the volume of one too thin for the grid) are null.
#[derive(Serialize)]
pub(super) struct Facts {
    pub name: String,
    pub file: String,
    pub empty: bool,
    pub bounds: Option<Box3>,
    pub volume: Option<f64>,
    /// Estimated from three resolutions, or from sets of lines; what rounding may add for a solid that is a mesh alone.
    /// Null if meshes do not show all of the solid and lines have not measured it.
    pub volume_error: Option<f64>,
    pub area: Option<f64>,
    /// As that of the volume.
    pub area_error: Option<f64>,
    /// Those of the solid: one that is hollow is one, although its surface has two.
    pub components: Option<usize>,
    /// Whether two resolutions have as many components, and no part but the edges of wedges is too thin for the cells
    /// with which the volume was measured. If not, the components are those of what the finer one shows, and so are
    /// the volume, the area and their errors unless `lines` says that lines have found them. `None` if the search for
    /// such parts was ended.
    pub resolved: Option<bool>,
    /// The tolerance for the error of ω that the file states, the program that keeps it, and the program's
    /// certified bound.
    pub tolerance: Option<f64>,
    pub program: Option<String>,
    pub error_bound: Option<f64>,
    /// The time in seconds for which all this holds. Null for a solid at rest.
    pub time: Option<f64>,
    /// The number of cells of the finer grid in which parts of the surface hide, see `mesh::thin_cells`.
    pub thin_cells: Option<usize>,
    /// The cells along the longest side of the finest grid that the volume and the area were measured on: more than
    /// the usual ones where the solid is too thin for these. Null if there was no need of a grid, or no volume
    /// on one.
    pub cells: Option<usize>,
    /// The number of lines that the volume and the area were measured along, because cells do not show its thin parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lines: Option<usize>,
    /// What was not finished within the budget: `volume` (and area), `thin_cells`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unfinished: Vec<&'static str>,
    /// The number of components that half as many cells show.
    #[serde(skip)]
    pub components_coarser: Option<usize>,
    /// Whether the cells that its thin parts need were too many for its share of the time.
    #[serde(skip)]
    pub wants_time: bool,
    /// Why there is no volume although there are bounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub no_volume: Option<String>,
    /// Whether the bounds reach farther than the mesh by more than its cells may hide.
    #[serde(skip)]
    pub are_loose: bool,
    /// Whether no point of the solid is proven to be near some side of the bounds.
    #[serde(skip)]
    pub are_unproven: bool,
    /// What there is to ask of sides that are far longer than others.
    #[serde(skip)]
    pub uneven_sides: Option<String>,
    /// Whether nothing of the solid was found: the finer grid has no surface, and no part hides between its nodes.
    #[serde(skip)]
    pub shows_nothing: bool,
}

impl Facts {
    pub fn unknown(solid: &Solid, file: &str) -> Self {
        Self {
            name: solid.name().to_string(),
            file: file.to_string(),
            empty: false,
            bounds: None,
            volume: None,
            volume_error: None,
            area: None,
            area_error: None,
            components: None,
            resolved: None,
            tolerance: None,
            program: None,
            error_bound: None,
            time: solid.moves().then(|| solid.time()),
            thin_cells: None,
            cells: None,
            lines: None,
            unfinished: Vec::new(),
            components_coarser: None,
            wants_time: false,
            no_volume: None,
            are_loose: false,
            are_unproven: false,
            uneven_sides: None,
            shows_nothing: false,
        }
    }
}

#[derive(Serialize)]
pub(super) struct Box3 {
    min: [f64; 3],
    max: [f64; 3],
}

impl Box3 {
    pub fn of(bounds: &Aabb) -> Self {
        Self { min: bounds.min.to_array(), max: bounds.max.to_array() }
    }
}

/// Prints a file's parameters, solids and scenes.
pub(super) fn print(file: &str, program: &Program, facts: &[Facts]) {
    let module = program.module();
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    say!(
        "{}: {}, {}",
        Path::new(file).shown(),
        count(module.solids.len(), "solid"),
        count(module.scenes.len(), "scene")
    );
    for param in &module.params {
        let shown = |value| param.shown(value);
        let range = param.range.map(|(low, high)| format!(" in {} .. {}", shown(low), shown(high)));
        let doc = param.doc.as_ref().map(|doc| format!("   {doc}"));
        let (range, doc) = (range.unwrap_or_default(), doc.unwrap_or_default());
        say!("  param {} = {}{range}{doc}", param.name, shown(param.value));
    }
    facts.iter().for_each(print_solid);
    for scene in &module.scenes {
        let obstacles: Vec<&str> = scene.obstacles.iter().map(|o| o.name.as_str()).collect();
        let particles =
            scene.fluid.particles.map_or("as many particles as fit".into(), |n| counted(n, "particle"));
        let around =
            if obstacles.is_empty() { String::new() } else { format!(" around {}", obstacles.join(", ")) };
        say!("  scene {}: {particles} of {}{around}, {} s", scene.name, scene.fluid.name, scene.run.until);
    }
}

/// Prints what is known of a solid.
fn print_solid(solid: &Facts) {
    say!("  solid {}", solid.name);
    if let Some(time) = solid.time {
        say!("    moves       at t = {time} s:");
    }
    if solid.empty {
        say!("    empty");
    }
    if let Some(bounds) = &solid.bounds {
        let [min, max] = corners(bounds);
        let at_most = if solid.are_loose || solid.are_unproven { "at most " } else { "" };
        say!("    bounds      {at_most}{min} … {max}");
        if let Some(why) = &solid.no_volume {
            say!("    volume      not found: {why}");
        }
    } else if !solid.empty {
        say!("    bounds      none found");
    }
    let measured = |value: f64, error: Option<f64>| match error {
        Some(error) => format!("{} ± {error:.1e}", significant(value, 6)),
        None => format!("{}, not resolved", significant(value, 3)),
    };
    if let (Some(volume), false) = (solid.volume, solid.empty) {
        say!("    volume      {}", measured(volume, solid.volume_error));
    }
    if let (Some(area), false) = (solid.area, solid.empty) {
        say!("    area        {}", measured(area, solid.area_error));
    }
    if let (Some(components), Some(coarser), false) =
        (solid.components, solid.components_coarser, solid.empty)
    {
        let cells = solid.cells.unwrap_or(VOLUME_CELLS);
        let half = cells / 2;
        match coarser == components {
            true if solid.resolved != Some(true) => {
                say!("    components  {components} of what {cells} cells show")
            }
            true => say!("    components  {components} of the solid"),
            false => say!(
                "    components  {components} of what {cells} cells show, and {coarser} of what {half} show; \
                 `rfm mesh --cells {}` counts those of the surface on finer ones",
                2 * cells
            ),
        }
    }
    let uneven = solid.uneven_sides.as_deref().unwrap_or_default();
    match (solid.cells, solid.lines) {
        (_, Some(lines)) => {
            say!(
                "    measured    along {lines} lines, which find what {VOLUME_CELLS} cells do not show{uneven}"
            )
        }
        (Some(cells), None) if cells > VOLUME_CELLS => {
            say!("    measured    with {cells} cells along its longest side{uneven}")
        }
        (Some(_), None) => {}
        (None, None) if solid.volume.is_some() && !solid.empty => {
            say!("    measured    by the triangles of its mesh")
        }
        (None, None) => {}
    }
    if solid.resolved == Some(false) && solid.lines.is_none() {
        say!("    not resolved: volume, area and components are those of what {VOLUME_CELLS} cells show");
    }
    if let (Some(name), Some(bound), Some(tolerance)) = (&solid.program, solid.error_bound, solid.tolerance) {
        say!("    program     {name}: ω to {bound:.1e}, tolerance {tolerance:e}");
    }
}

/// The corners of a box, with more digits behind the point for smaller boxes.
fn corners(bounds: &Box3) -> [String; 2] {
    let size = (0..3).map(|i| bounds.max[i] - bounds.min[i]).fold(f64::MIN_POSITIVE, f64::max);
    let digits = (3.0 - size.log10().floor()).clamp(4.0, 12.0) as usize;
    // rounded first, so that zero has no sign
    let unit = 10f64.powi(digits as i32);
    let shown = |x: f64| format!("{:.digits$}", (unit * x).round() / unit + 0.0);
    [bounds.min, bounds.max].map(|corner| format!("({})", corner.map(shown).join(", ")))
}
