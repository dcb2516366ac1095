//! The obstacles of a run as sharp meshes: one for each body if all stand still, one for every frame and body if any of
//! them moves. A body that moves without deformation takes its mesh along, as long as it lies whole within the box.

use std::sync::OnceLock;

use super::super::args::Run;
use super::super::deadline::Deadline;
use super::super::hidden::hidden;
use super::super::mesh::{LEAST_SEARCH, no_grid};
use super::super::{Failure, note};
use rfm::geom::{Aabb, Placement};
use rfm::mesh::{self, Grid, Mesh, MeshError, Resolution, Unwatched, Watch, dual_contouring, marching_cubes};
use rfm::{Experiment, Solid};

/// Bodies that are smaller than this part of the box are drawn as nothing.
const LEAST_BODY: f64 = 1e-9;

/// A box that is longer than a body by this factor has room for it within the tolerances of its own size.
const FAR_LARGER: f64 = 1e6;

/// The solids of a scene.
pub(in crate::cli) struct Bodies {
    solids: Vec<Solid>,
    domain: Aabb,
    /// Number of mesh cells along the longest side of each solid.
    cells: usize,
    /// The mesh of each solid at the time 0; `None` if it has none, or is deformed.
    carried: Vec<OnceLock<Option<Mesh>>>,
}

impl Bodies {
    pub fn new(options: &Run, experiment: &Experiment) -> Self {
        let solids = experiment.bodies().iter().map(|body| body.solid.clone()).collect();
        Self::of(solids, experiment.domain(), options.mesh_cells)
    }

    /// Solids in a box, to be meshed with the given number of cells along the longest side of each.
    pub fn of(solids: Vec<Solid>, domain: Aabb, cells: usize) -> Self {
        let carried = vec![OnceLock::new(); solids.len()];
        Self { solids, domain, cells, carried }
    }

    /// These bodies with at most the given number of cells.
    pub fn coarsened(self, cells: usize) -> Self {
        Self::of(self.solids, self.domain, self.cells.min(cells))
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
            let thin =
                mesh::thin_cells(&*surface, &grid, &Deadline::after(LEAST_SEARCH)).map_err(Failure::usage)?;
            if thin.count > 0 {
                note(format!(
                    "the fluid meets all of the obstacle `{name}`, but its mesh and its pictures do not show all of what is \
                     thinner than two cells: {}; --mesh-cells sets how many there are",
                    hidden(&thin, &grid)
                ));
            } else if thin.ended {
                note(format!(
                    "whether the mesh of the obstacle `{name}` misses what is thin was not found out in time"
                ));
            } else if mesh.triangles.is_empty() {
                note(self.why_empty(solid));
            }
        }
        Ok(meshes)
    }

    /// What is said of a solid whose mesh has no triangles, although nothing of it is too thin for its cells.
    fn why_empty(&self, solid: &Solid) -> String {
        let (name, room) = (solid.name(), self.domain.size().max_element());
        let bounds = solid.at(0.0).bounds().aabb();
        let lies_within = |bounds: &Aabb| {
            !bounds.intersection(&self.domain).is_empty() && solid.range(&self.domain).hi > 0.0
        };
        match bounds.filter(lies_within).map(|bounds| bounds.size().max_element()) {
            Some(size) if room > FAR_LARGER * size => format!(
                "the mesh and the pictures show nothing of the obstacle `{name}`: it is {size:.1e} m long, and the box {room:.1e} m; \
                 is a number of the box in another unit than was meant?"
            ),
            _ => format!("the obstacle `{name}` has no surface in the box"),
        }
    }

    /// What the meshes at a time, s, do not show, in words, for each solid of which something was found in a while.
    /// Sharp edges are left out.
    pub fn missed_at(&self, time: f64) -> Result<Vec<String>, Failure> {
        let mut missed = Vec::new();
        for solid in &self.solids {
            let solid = solid.at(time);
            let grid = self.grid(&solid)?;
            let surface = solid.surface(*grid.bounds());
            let thin =
                mesh::thin_cells(&*surface, &grid, &Deadline::after(LEAST_SEARCH)).map_err(Failure::usage)?;
            if thin.count > 0 && !thin.is_wedge {
                missed.push(hidden(&thin, &grid));
            }
        }
        Ok(missed)
    }

    /// The mesh of each solid at a time, s, cut off at the box.
    pub fn meshes_at(&self, time: f64) -> Result<Vec<Mesh>, Failure> {
        Ok(self.meshes_while(time, &Unwatched)?.unwrap_or_default())
    }

    /// [`Bodies::meshes_at`]; `None` if `watch` ends the work.
    pub fn meshes_while(&self, time: f64, watch: &dyn Watch) -> Result<Option<Vec<Mesh>>, Failure> {
        let mesh_at = |(number, solid): (usize, &Solid)| {
            // where nothing moves, meshes are made once
            let carried = || Some((self.placement(number, time)?, self.at_start(number)?));
            match if self.move_about() { carried() } else { None } {
                Some((placement, mesh)) => Ok(Some(mesh.moved(&placement))),
                None => self.mesh_of(&solid.at(time), watch),
            }
        };
        self.solids.iter().enumerate().map(mesh_at).collect()
    }

    /// Meshes at a time, s, whose edges are cut off: they are found in a part of the time of sharp ones.
    pub fn rough_meshes_at(&self, time: f64) -> Result<Vec<Mesh>, Failure> {
        let mesh_at = |solid: &Solid| {
            let solid = solid.at(time);
            let grid = self.grid(&solid)?;
            marching_cubes(&*solid.surface(*grid.bounds()), &grid, &Unwatched).map_err(Failure::usage)
        };
        self.solids.iter().map(mesh_at).collect()
    }

    /// The meshes of the time 0 that all solids take along; `None` if one of them takes none.
    pub fn carried(&self) -> Option<Vec<&Mesh>> {
        (0..self.solids.len()).map(|number| self.at_start(number)).collect()
    }

    /// Where these meshes are at a time, s; `None` if one of the solids has another mesh then.
    pub fn placements(&self, time: f64) -> Option<Vec<Placement>> {
        (0..self.solids.len()).map(|number| self.placement(number, time)).collect()
    }

    /// The mesh of a solid at the time 0, if it does not move or lies whole within the box.
    fn at_start(&self, number: usize) -> Option<&Mesh> {
        let make = || {
            let solid = self.solids[number].at(0.0);
            let is_whole = || solid.bounds().aabb().is_some_and(|bounds| self.holds(&bounds));
            if !self.solids[number].moves() || is_whole() {
                self.mesh_of(&solid, &Unwatched).ok().flatten()
            } else {
                None
            }
        };
        self.carried[number].get_or_init(make).as_ref()
    }

    /// Where the mesh of the time 0 is at a time, s; `None` if its solid is deformed, or does not lie whole within the
    /// box at both times.
    fn placement(&self, number: usize, time: f64) -> Option<Placement> {
        let solid = &self.solids[number];
        if !solid.moves() {
            return Some(Placement::IDENTITY);
        }
        let placement = solid.placement(time)?;
        let places = self.at_start(number)?.positions.iter();
        let bounds = places.fold(Aabb::EMPTY, |all, p| all.including(placement.apply(*p)));
        self.holds(&bounds).then_some(placement)
    }

    /// Whether a body with these bounds is not cut off at the box.
    fn holds(&self, bounds: &Aabb) -> bool {
        let room = self.domain.grown(Grid::BESIDE * self.domain.size().max_element());
        room.union(bounds) == room
    }

    /// The mesh of a solid; `None` if `watch` ends the work.
    fn mesh_of(&self, solid: &Solid, watch: &dyn Watch) -> Result<Option<Mesh>, Failure> {
        let grid = self.grid(solid)?;
        let surface = solid.surface(*grid.bounds());
        match dual_contouring(&*surface, &grid, watch) {
            Ok(mesh) => Ok(Some(mesh)),
            Err(MeshError::Ended) => Ok(None),
            Err(error) => Err(Failure::usage(error)),
        }
    }

    fn grid(&self, solid: &Solid) -> Result<Grid, Failure> {
        // a body that grows from a point has no cells at its start
        let least = LEAST_BODY * self.domain.size().max_element();
        let bounds = solid.bounds().aabb().filter(|bounds| bounds.size().max_element() > least);
        let bounds = bounds.unwrap_or(self.domain);
        let grid = Grid::within(&bounds, &self.domain, Resolution::Cells(self.cells));
        grid.map_err(|error| no_grid(&error, "--mesh-cells", self.cells))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rfm::{Engine, Program};

    use super::*;

    /// A block that sinks through the floor of the box and comes back, and turns.
    #[test]
    fn a_body_takes_its_mesh_along_while_it_is_whole_within_the_box() {
        let text = "rfm 1\nsolid block = box([-0.2, -0.1, -0.1], [0.2, 0.1, 0.1]).rotate_z(t).move([0, 0, 0.6*cos(t)])\n";
        let program = Program::from_source("block.rfm", text).unwrap();
        let solid = program.solid_with("block", Engine::Interpreter).unwrap();
        let domain = Aabb::new(DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE);
        let bodies = Bodies::of(vec![solid.clone()], domain, 16);
        let mesh_at = |time: f64| bodies.meshes_at(time).unwrap().remove(0);
        let start = mesh_at(0.0);
        for time in [0.3, 1.2, 5.2, 6.0] {
            let mesh = mesh_at(time);
            assert_eq!(mesh.triangles, start.triangles, "{time}");
            assert!(bodies.placements(time).is_some());
            let now = solid.at(time);
            let off = mesh.positions.iter().map(|p| now.omega(*p).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "{time}: {off}");
        }
        // cut off at the floor
        for time in [1.5, 4.8] {
            assert!(bodies.placements(time).is_none(), "{time}");
            assert!(mesh_at(time).positions.iter().all(|p| p.z >= -2e-3), "{time}");
        }
    }
}
