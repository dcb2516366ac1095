//! The obstacles of a run as meshes: one mesh if all stand still, one for every frame if any of them moves.

use super::super::args::Run;
use super::super::mesh::no_grid;
use super::super::{Failure, note};
use rfm::geom::Aabb;
use rfm::mesh::{Grid, Mesh, Resolution, marching_cubes};
use rfm::{Experiment, Solid};

/// The solids of a scene.
pub(super) struct Bodies {
    solids: Vec<Solid>,
    domain: Aabb,
    /// Number of mesh cells along the longest side of each solid.
    pub(super) cells: usize,
}

impl Bodies {
    pub fn new(options: &Run, experiment: &Experiment) -> Self {
        let solids = experiment.bodies().iter().map(|body| body.solid.clone()).collect();
        Self { solids, domain: experiment.domain(), cells: options.mesh_cells }
    }

    pub fn is_empty(&self) -> bool {
        self.solids.is_empty()
    }

    /// Whether any solid moves, so that each instant needs its own mesh.
    pub fn move_about(&self) -> bool {
        self.solids.iter().any(Solid::moves)
    }

    /// The mesh of all solids at the start. Notes which of them have no surface in the box.
    pub fn mesh_at_start(&self) -> Result<Mesh, Failure> {
        let mut all = Mesh::default();
        for solid in &self.solids {
            let mesh = self.mesh_of(solid)?;
            if mesh.triangles.is_empty() {
                note(format!("the obstacle `{}` has no surface in the box", solid.name()));
            }
            join(&mut all, mesh);
        }
        Ok(all)
    }

    /// The mesh of all solids at a time, s, cut off at the box.
    pub fn mesh_at(&self, time: f64) -> Result<Mesh, Failure> {
        let mut all = Mesh::default();
        for solid in &self.solids {
            join(&mut all, self.mesh_of(&solid.at(time))?);
        }
        Ok(all)
    }

    fn mesh_of(&self, solid: &Solid) -> Result<Mesh, Failure> {
        let bounds = solid.bounds().aabb().unwrap_or(self.domain);
        let inside = self.domain.grown(1e-3 * self.domain.size().max_element());
        let over = bounds.intersection(&inside);
        let grid = if bounds == over || over.is_empty() {
            Grid::around(&bounds, Resolution::Cells(self.cells))
        } else {
            Grid::filling(&over, Resolution::Cells(self.cells))
        };
        let grid = grid.map_err(|error| no_grid(&error, "--mesh-cells", self.cells))?;
        let surface = solid.surface(*grid.bounds());
        marching_cubes(&*surface, &grid, &|_| {}).map_err(Failure::usage)
    }
}

fn join(all: &mut Mesh, mesh: Mesh) {
    let first = all.positions.len() as u32;
    all.positions.extend(mesh.positions);
    all.normals.extend(mesh.normals);
    all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
}
