//! The volume of a solid, as the bindings tell it.

use std::fmt;

use rfm::Solid;
use rfm::mesh::{self, Grid, Mesh, Resolution, ThinCells, Volume, VolumeError, Watch};
use rfm::solid::Bounds;

/// A volume, and what is doubtful about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The volume, m³.
    pub volume: f64,
    /// How far it may be off, m³; infinite if that is not known, because parts of the solid may not be in it.
    pub error: f64,
    /// What a caller is to be told who did not ask for the error.
    pub doubt: Option<String>,
}

impl Measured {
    fn certain(volume: f64, error: f64) -> Self {
        Self { volume, error, doubt: None }
    }
}

/// Why a volume is not known.
#[derive(Debug, Clone, PartialEq)]
pub enum NoVolume {
    /// No box around the solid of this name could be proven.
    Unbounded(String),
    /// Neither meshes nor lines show it.
    Meshes(VolumeError),
}

impl fmt::Display for NoVolume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unbounded(name) => write!(f, "`{name}` could not be proven to end anywhere"),
            Self::Meshes(error) => error.fmt(f),
        }
    }
}

impl NoVolume {
    /// What a caller is told who may state a box in place of the one that is not known.
    pub fn asking_for_a_box(name: &str) -> String {
        format!("{}: state the box to mesh", Self::Unbounded(name.to_string()))
    }
}

/// Why the volume of meshes is not trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cause {
    /// Parts are thinner than the cells.
    Thin,
    /// Nobody knows whether there are such parts.
    Unsearched,
    /// Meshes of different cells have different numbers of separate solids.
    Parts,
    /// Their volumes differ by much.
    Differing,
}

impl Cause {
    /// `None` if the meshes show all of a solid, with the parts of it that are too thin for the finest of them.
    fn of(found: &Volume, thin: &ThinCells) -> Option<Self> {
        let is_thin = thin.count > 0 && !thin.is_wedge;
        match found.shows_all(Some(thin)) {
            Some(true) => found.is_uncertain().then_some(Self::Differing),
            Some(false) if is_thin => Some(Self::Thin),
            Some(false) => Some(Self::Parts),
            None => Some(Self::Unsearched),
        }
    }

    /// The beginning of a sentence.
    fn words(self, cells: usize) -> String {
        match self {
            Self::Thin => format!("parts of the solid are too thin for {cells} cells"),
            Self::Unsearched => {
                format!("it is not known whether parts of the solid are too thin for {cells} cells")
            }
            Self::Parts => {
                format!("meshes of {cells} cells and of fewer show the solid in different numbers of parts")
            }
            Self::Differing => format!("meshes of {cells} cells and of fewer differ much in volume"),
        }
    }
}

/// An error of a volume above this part of it is told.
const LARGE_ERROR: f64 = 0.01;

/// The volume of a solid: of its triangles, if it is made of these; otherwise on meshes with so many cells along the
/// longest side, or along lines if the meshes do not show all of it.
///
/// # Errors
/// [`NoVolume`] if no box around the solid is known, if it cannot be meshed, or if neither meshes nor lines show it.
pub fn volume(solid: &Solid, cells: usize, watch: &dyn Watch) -> Result<Measured, NoVolume> {
    let bounds = match solid.bounds() {
        Bounds::Within(bounds) => bounds,
        Bounds::Empty => return Ok(Measured::certain(0.0, 0.0)),
        Bounds::Unbounded => return Err(NoVolume::Unbounded(solid.name().to_string())),
    };
    if let Some((places, triangles)) = solid.triangles() {
        let shells = mesh::shells(&Mesh::from_triangles(places, triangles));
        return Ok(Measured::certain(shells.iter().map(|shell| shell.volume).sum(), 0.0));
    }
    let surface = solid.surface(bounds.grown(0.1 * bounds.size().max_element()));
    let mut cause = Cause::Thin;
    let by_meshes = match mesh::volume(&*surface, bounds, cells, watch) {
        Ok(found) => Some(found),
        Err(VolumeError::TooThin) => None,
        Err(error) => return Err(NoVolume::Meshes(error)),
    };
    if let Some(found) = &by_meshes {
        let grid = Grid::around(bounds, Resolution::Cells(cells)).map_err(VolumeError::Grid);
        let thin = grid.and_then(|grid| mesh::thin_cells(&*surface, &grid, watch).map_err(VolumeError::Mesh));
        let thin = thin.map_err(NoVolume::Meshes)?;
        match Cause::of(found, &thin) {
            Some(known) => cause = known,
            None => return Ok(Measured::certain(found.volume, found.error)),
        }
    }
    match (mesh::by_lines(&*surface, bounds, watch), by_meshes) {
        // what the mesh lacks is less than what the lines leave uncertain
        (Some(lines), Some(found)) if (lines.volume - found.volume).abs() <= lines.error => {
            Ok(Measured::certain(found.volume, found.error.max(lines.error)))
        }
        (Some(lines), _) => {
            let part = lines.error / lines.volume;
            let doubt = (part > LARGE_ERROR).then(|| {
                format!("{}, so its volume is known to {:.0} % only", cause.words(cells), 100.0 * part)
            });
            Ok(Measured { volume: lines.volume, error: lines.error, doubt })
        }
        (None, Some(found)) => {
            let end = match cause {
                Cause::Thin => "and its volume is without them",
                Cause::Unsearched | Cause::Parts | Cause::Differing => "so its volume is not certain",
            };
            let doubt = format!("{}, {end}", cause.words(cells));
            Ok(Measured { volume: found.volume, error: f64::INFINITY, doubt: Some(doubt) })
        }
        (None, None) => Err(NoVolume::Meshes(VolumeError::TooThin)),
    }
}
