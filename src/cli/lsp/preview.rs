//! The command `rfm.slice`: ω of a solid in a plane, as a picture beside the text.

use lsp_types::Uri;
use serde::{Deserialize, Serialize};

use rfm::Engine;
use rfm::field::Field;
use rfm::slice::{self, Axis, Plane};
use rfm::solid::Bounds;

use super::document::Document;

pub(super) const COMMAND: &str = "rfm.slice";

/// What its arguments are, for a caller that gave others.
pub(super) const EXPECTED: &str = "rfm.slice takes one object: { \"uri\": address of an open file, \"solid\": its name, \
     \"axis\": \"x\", \"y\" or \"z\", \"at\": metres along the axis, \"panel\": where it is shown }, of which only `uri` \
     must be there";

/// Samples along the longer side: enough for a panel beside the text, and quick.
const SAMPLES: usize = 128;

/// What is to be drawn.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Wanted {
    pub uri: Uri,
    /// The solid; without it, or if there is none of this name, the last one of the file.
    solid: Option<String>,
    /// `x`, `y` or `z`; without it the axis across the largest side of the solid.
    axis: Option<String>,
    /// Where the plane meets the axis; without it in the middle of the solid.
    at: Option<f64>,
    /// What the editor calls the place where it shows the slice; without it there is one for each file.
    panel: Option<String>,
}

impl Wanted {
    /// Where the slice is shown: if there are two for one place, the later one is wanted.
    pub fn panel(&self) -> &str {
        self.panel.as_deref().unwrap_or(self.uri.as_str())
    }
}

/// A picture, and what it shows.
#[derive(Debug, Serialize)]
pub(super) struct Slice {
    svg: String,
    solid: String,
    axis: &'static str,
    at: f64,
    /// The solid's extent along the axis.
    from: f64,
    to: f64,
    /// The solids that there are to choose from.
    solids: Vec<String>,
}

/// Draws a slice of a file without errors.
///
/// # Errors
/// What is missing, in words.
pub(super) fn slice(document: &Document, wanted: &Wanted) -> Result<Slice, String> {
    let program = document.program.as_ref().ok_or("the file has errors")?;
    let solids: Vec<String> = program.module().solids.iter().map(|solid| solid.name.clone()).collect();
    let name = wanted.solid.as_ref().filter(|name| solids.contains(name)).or(solids.last());
    let name = name.ok_or("the file has no solid")?;
    let solid = program.solid_with(name, Engine::Auto).map_err(|error| error.to_string())?;
    let bounds = match solid.bounds() {
        Bounds::Within(bounds) => bounds.grown(0.15 * bounds.size().max_element()),
        Bounds::Empty => return Err(format!("solid `{name}` is empty")),
        Bounds::Unbounded => {
            let scene = program.module().scenes.first();
            scene
                .map(|scene| scene.domain)
                .ok_or_else(|| format!("no bounds of solid `{name}` were found"))?
        }
    };
    let size = bounds.size();
    let axis = match wanted.axis.as_deref() {
        Some("x") => Axis::X,
        Some("y") => Axis::Y,
        Some("z") => Axis::Z,
        Some(other) => return Err(format!("there is no axis `{other}`")),
        // the section with the largest area
        None if size.x < size.y.min(size.z) => Axis::X,
        None if size.y <= size.z => Axis::Y,
        None => Axis::Z,
    };
    let (from, to) = (bounds.min[axis.index()], bounds.max[axis.index()]);
    let at = wanted.at.filter(|at| at.is_finite()).unwrap_or(f64::midpoint(from, to));
    let plane = Plane::new(axis, at);
    let mut svg = Vec::new();
    slice::write_svg(&solid as &dyn Field, name, plane, plane.window(&bounds), SAMPLES, &mut svg)
        .map_err(|error| error.to_string())?;
    let svg = String::from_utf8(svg).map_err(|error| error.to_string())?;
    Ok(Slice { svg, solid: name.clone(), axis: axis.name(), at, from, to, solids })
}
