//! What a page shows besides frames and meshes.

use serde::Serialize;

use super::levels::Levels;
use crate::geom::Aabb;

/// What a page shows besides frames and meshes. Lengths are in metres, texts are shown as they are.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setting {
    /// The heading, for example the name of a file.
    pub title: String,
    /// A line of facts below it.
    pub facts: String,
    /// Whether the page is connected to a simulation.
    pub live: bool,
    /// Whether a solid moves where no fluid does.
    pub moves: bool,
    /// Whether frames have surfaces of the fluid.
    pub has_surface: bool,
    /// The box whose edges are drawn.
    #[serde(rename = "box")]
    pub domain: Corners,
    /// The box of the [`Lattice`](super::Lattice) of positions, if it is another one.
    pub lattice: Option<Corners>,
    /// Half the spacing of the particles.
    pub radius: f64,
    /// The arrays of every frame, in their order. A page without arrays shows no particles.
    pub arrays: Vec<Array>,
    /// The solids that a live page may show, the one that is shown first; none where they stand in a fluid's way.
    pub solids: Vec<String>,
    /// Gravity, m/s², if it is constant.
    pub gravity: Option<[f64; 3]>,
    /// The params that a live page may change.
    pub params: Vec<Param>,
    /// Quantities over time; `None` if they are sent separately.
    pub plots: Option<Vec<Plot>>,
}

/// The lowest and the highest corner of a box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Corners {
    /// The lowest coordinates.
    pub min: [f64; 3],
    /// The highest coordinates.
    pub max: [f64; 3],
}

impl From<&Aabb> for Corners {
    fn from(bounds: &Aabb) -> Self {
        Self { min: bounds.min.to_array(), max: bounds.max.to_array() }
    }
}

/// A number at each particle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Array {
    /// Its name, for example `speed`.
    pub name: String,
    /// Its unit; empty if it is not known.
    pub unit: String,
    /// The range of the colours at the beginning; `None`: the range of all frames.
    pub range: Option<Levels>,
}

/// The names of the arrays that a page takes as the components of the velocity.
pub const VELOCITY: [&str; 3] = ["velocity x", "velocity y", "velocity z"];

impl Array {
    /// An array of a run by its name.
    pub fn named(name: &str, range: Option<Levels>) -> Self {
        let unit = match name {
            "speed" => "m/s",
            name if VELOCITY.contains(&name) => "m/s",
            "density" => "kg/m³",
            "pressure" => "Pa",
            _ => "",
        };
        Self { name: name.to_string(), unit: unit.to_string(), range }
    }
}

/// A param of a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// What the file says of it.
    pub doc: Option<String>,
    /// Its value in SI units.
    pub value: f64,
    /// Its least and greatest value in SI units, if the file states them.
    pub range: Option<(f64, f64)>,
    /// The unit in which it is shown; empty if it has none.
    pub unit: String,
    /// That unit in SI units.
    pub factor: f64,
}

/// Quantities over time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plot {
    /// What is shown.
    pub name: String,
    /// The unit of all columns.
    pub unit: String,
    /// The instants, s.
    pub times: Vec<f64>,
    /// The quantities.
    pub columns: Vec<Column>,
}

/// A quantity at the instants of a [`Plot`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its values; those that are not finite are left out of the plot.
    pub values: Vec<f64>,
}
