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
    /// The names of the obstacles, in the order of the parts of their mesh.
    pub bodies: Vec<String>,
    /// Gravity, m/s², if it is constant.
    pub gravity: Option<[f64; 3]>,
    /// The params that a live page may change.
    pub params: Vec<Param>,
    /// Quantities over time; `None` if they are sent separately.
    pub plots: Option<Vec<Plot>>,
    /// How the scene is seen at the beginning; `None` if nothing states it.
    pub picture: Option<Outset>,
}

/// How a scene is seen at the beginning, as far as its file states that for its pictures.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Outset {
    /// The direction from the scene to the eye.
    pub camera: Option<[f64; 3]>,
    /// The place in the middle, m.
    pub look_at: Option<[f64; 3]>,
    /// How many times as large as if the whole box were seen.
    pub zoom: Option<f64>,
    /// Whether lines that are parallel stay so.
    pub parallel: bool,
    /// The plane that opens the obstacles.
    pub cut: Option<OutsetCut>,
    /// The look of the obstacles, `opaque`, `transparent` or `hidden`; `None`: as they hide the fluid or not.
    pub obstacle: Option<&'static str>,
    /// The names of obstacles that are not drawn.
    pub hide: Vec<String>,
    /// The names of obstacles that are drawn clear.
    pub glass: Vec<String>,
}

/// A plane across an axis that opens what is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OutsetCut {
    /// The axis: 0, 1 or 2.
    pub axis: usize,
    /// Where the plane meets the axis, m.
    pub at: f64,
    /// Whether the part at smaller coordinates is taken away.
    pub below: bool,
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
