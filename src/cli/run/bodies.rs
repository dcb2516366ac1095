//! The obstacles of a run as sharp meshes: one for each body if all stand still, one for every frame and body if any of
//! them moves.

use super::super::args::Run;
use super::super::mesh::{hidden, no_grid};
use super::super::{Failure, note};
use rfm::geom::Aabb;
use rfm::mesh::{self, Grid, Mesh, Resolution, dual_contouring};
use rfm::{Experiment, Solid};

/// The solids of a scene.
pub(in crate::cli) struct Bodies {
    solids: Vec<Solid>,
    domain: Aabb,
    /// Number of mesh cells along the longest side of each solid.
    pub(super) cells: usize,
}

impl Bodies {
    pub fn new(options: &Run, experiment: &Experiment) -> Self {
        let solids = experiment.bodies().iter().map(|body| body.solid.clone()).collect();
        Self::of(solids, experiment.domain(), options.mesh_cells)
    }

    /// Solids in a box, to be meshed with so many cells along the longest side of each.
    pub fn of(solids: Vec<Solid>, domain: Aabb, cells: usize) -> Self {
        Self { solids, domain, cells }
    }

    pub fn is_empty(&self) -> bool {
        self.solids.is_empty()
    }

    /// Whether any solid moves, so that each instant needs its own mesh.
    pub fn move_about(&self) -> bool {
        self.solids.iter().any(Solid::moves)
    }

    /// The mesh of each solid at the start. Notes which of them have no surface in the box, and what their meshes miss.
    pub fn meshes_at_start(&self) -> Result<Vec<Mesh>, Failure> {
        let meshes = self.meshes_at(0.0)?;
        for (solid, mesh) in self.solids.iter().zip(&meshes) {
            let name = solid.name();
            let grid = self.grid(solid)?;
            let surface = solid.surface(*grid.bounds());
            let thin = mesh::thin_cells(&*surface, &grid).map_err(Failure::usage)?;
            if thin.count > 0 {
                note(format!(
                    "the fluid meets all of the obstacle `{name}`, but its mesh and its pictures miss what is thinner than a \
                     cell {}; --mesh-cells sets how many there are",
                    hidden(&thin, &grid)
                ));
            } else if mesh.triangles.is_empty() {
                note(format!("the obstacle `{name}` has no surface in the box"));
            }
        }
        Ok(meshes)
    }

    /// The mesh of each solid at a time, s, cut off at the box.
    pub fn meshes_at(&self, time: f64) -> Result<Vec<Mesh>, Failure> {
        self.solids.iter().map(|solid| self.mesh_of(&solid.at(time))).collect()
    }

    fn mesh_of(&self, solid: &Solid) -> Result<Mesh, Failure> {
        let grid = self.grid(solid)?;
        let surface = solid.surface(*grid.bounds());
        dual_contouring(&*surface, &grid, &|_| {}).map_err(Failure::usage)
    }

    fn grid(&self, solid: &Solid) -> Result<Grid, Failure> {
        let bounds = solid.bounds().aabb().unwrap_or(self.domain);
        let grid = Grid::within(&bounds, &self.domain, Resolution::Cells(self.cells));
        grid.map_err(|error| no_grid(&error, "--mesh-cells", self.cells))
    }
}
