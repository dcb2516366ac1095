//! The volume of a solid, as the bindings tell it.

use std::fmt;

use rfm::Solid;
use rfm::mesh::{self, Grid, Mesh, Resolution, VolumeError, Watch};
use rfm::solid::Bounds;

/// A volume, and what is doubtful about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The volume, m³.
    pub volume: f64,
    /// How far it may be off, m³; infinite if that is not known, because parts of the solid are not in it.
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
            Self::Unbounded(name) => {
                write!(f, "`{name}` could not be proven to end anywhere: state the box to mesh")
            }
            Self::Meshes(error) => error.fmt(f),
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
    let by_meshes = match mesh::volume(&*surface, bounds, cells, watch) {
        Ok(found) => Some(found),
        Err(VolumeError::TooThin) => None,
        Err(error) => return Err(NoVolume::Meshes(error)),
    };
    if let Some(found) = &by_meshes {
        let grid = Grid::around(bounds, Resolution::Cells(cells)).map_err(VolumeError::Grid);
        let thin = grid.and_then(|grid| mesh::thin_cells(&*surface, &grid, watch).map_err(VolumeError::Mesh));
        let thin = thin.map_err(NoVolume::Meshes)?;
        if found.shows_all(Some(&thin)) == Some(true) && !found.is_uncertain() {
            return Ok(Measured::certain(found.volume, found.error));
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
                format!(
                    "parts of the solid are too thin for {cells} cells, so its volume is known to {:.0} % only",
                    100.0 * part
                )
            });
            Ok(Measured { volume: lines.volume, error: lines.error, doubt })
        }
        (None, Some(found)) => {
            let doubt =
                format!("parts of the solid are too thin for {cells} cells, and its volume is without them");
            Ok(Measured { volume: found.volume, error: f64::INFINITY, doubt: Some(doubt) })
        }
        (None, None) => Err(NoVolume::Meshes(VolumeError::TooThin)),
    }
}
