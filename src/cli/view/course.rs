//! The thing that changes in time: a fluid among its obstacles, or a solid that moves by itself.

use std::sync::Arc;

use glam::DVec3;

use super::super::run::bodies::Bodies;
use super::messages::{message, refused};
use super::plots::History;
use super::way::Way;
use rfm::geom::Aabb;
use rfm::mesh::{Mesh, split_creases};
use rfm::sph::Simulation;
use rfm::view::{Frame, FrameHead, Lattice, MeshRole, columns, pack_frame, pack_parts};
use rfm::{Experiment, Solid};

/// Most particles of a scene that begins to run by itself.
const MOST_AT_ONCE: usize = 200_000;

/// What goes on in time.
pub(super) enum Course {
    Fluid(Box<Flow>),
    Solid(Motion),
}

/// A simulation with what is drawn of its scene.
pub(super) struct Flow {
    pub simulation: Simulation,
    pub experiment: Experiment,
    pub history: History,
    pub lattice: Lattice,
    bodies: Bodies,
}

/// A solid that moves, with the time at which it is shown.
pub(super) struct Motion {
    bodies: Bodies,
    way: Way,
    time: f64,
}

impl Course {
    /// Begins again.
    ///
    /// # Errors
    /// Why that is not possible; everything is as it was then.
    pub fn restart(&mut self) -> Result<(), String> {
        match self {
            Self::Fluid(flow) => flow.restart(),
            Self::Solid(motion) => {
                motion.time = motion.way.start;
                Ok(())
            }
        }
    }

    /// The box in which it is shown.
    pub fn room(&self) -> Aabb {
        match self {
            Self::Fluid(flow) => flow.experiment.domain(),
            Self::Solid(motion) => motion.way.room,
        }
    }

    /// The simulated time, s.
    pub fn time(&self) -> f64 {
        match self {
            Self::Fluid(flow) => flow.simulation.time(),
            Self::Solid(motion) => motion.time,
        }
    }

    /// Whether it goes on as soon as it is there.
    pub fn begins_by_itself(&self) -> bool {
        match self {
            Self::Fluid(flow) => (1..=MOST_AT_ONCE).contains(&flow.simulation.particles().len()),
            Self::Solid(_) => true,
        }
    }

    /// Whether there is nothing more to show.
    pub fn has_ended(&self) -> bool {
        match self {
            Self::Fluid(_) => false,
            Self::Solid(motion) => motion.time >= motion.way.end,
        }
    }

    /// Advances: a fluid by a step of its own, a solid by the time `by`, s.
    ///
    /// # Errors
    /// Why the run has ended.
    pub fn step(&mut self, by: f64) -> Result<(), String> {
        match self {
            Self::Fluid(flow) => flow
                .simulation
                .step()
                .map_err(|error| format!("the run has ended at {:.4} s: {error}", flow.simulation.time())),
            Self::Solid(motion) => {
                motion.time = (motion.time + by).min(motion.way.end);
                Ok(())
            }
        }
    }

    /// Whether a mesh belongs to one instant alone.
    pub fn moves(&self) -> bool {
        match self {
            Self::Fluid(flow) => flow.bodies.move_about(),
            Self::Solid(_) => true,
        }
    }

    fn bodies(&self) -> &Bodies {
        match self {
            Self::Fluid(flow) => &flow.bodies,
            Self::Solid(motion) => &motion.bodies,
        }
    }

    /// The block of the mesh of all solids as they stand now.
    pub fn mesh(&self, run: u64) -> Result<Vec<u8>, String> {
        mesh_at(self.bodies(), self.time(), run)
    }

    /// Whether frames say now where all solids are.
    pub fn is_carried(&self) -> bool {
        self.bodies().placements(self.time()).is_some()
    }

    /// The block of the mesh that all solids take along, if they do.
    pub fn carried(&self, run: u64) -> Option<Vec<u8>> {
        let sharp: Vec<Mesh> = self.bodies().carried()?.into_iter().map(split_creases).collect();
        Some(pack_parts(&sharp, MeshRole::Carried, 0.0, run))
    }

    /// The block of the present instant.
    pub fn frame(&self, run: u64) -> Vec<u8> {
        match self {
            Self::Fluid(flow) => flow.frame(run),
            Self::Solid(motion) => motion.frame(run),
        }
    }

    /// The rest of the progress message, after the time. `spent` is the time of the clock that a step takes,
    /// s.
    pub fn details(&self, spent: f64) -> String {
        match self {
            Self::Fluid(flow) => flow.details(spent),
            Self::Solid(_) if self.has_ended() => " at the end of its way".into(),
            Self::Solid(_) => String::new(),
        }
    }

    /// Adds the present instant to the quantities over time.
    pub fn sample(&mut self) {
        match self {
            Self::Fluid(flow) => flow.history.sample(&flow.simulation),
            Self::Solid(_) => {}
        }
    }

    /// Lets gravity act in this direction from now on, m/s².
    pub fn set_gravity(&mut self, gravity: DVec3) {
        match self {
            Self::Fluid(flow) => flow.simulation.set_turning_gravity(Arc::new(move |_| gravity)),
            Self::Solid(_) => {}
        }
    }

    /// The simulation, if a fluid flows.
    pub fn flow(&self) -> Option<&Flow> {
        match self {
            Self::Fluid(flow) => Some(flow),
            Self::Solid(_) => None,
        }
    }
}

impl Flow {
    /// A simulation at its start, with obstacles meshed with the given number of cells along the longest side
    /// of each.
    ///
    /// # Errors
    /// The messages, as the command line shows them.
    pub fn start(experiment: Experiment, cells: usize) -> Result<Self, String> {
        let mut simulation = experiment.start().map_err(refused)?.simulation;
        let history = History::start(&mut simulation, experiment.scene());
        let solids = experiment.bodies().iter().map(|body| body.solid.clone()).collect();
        let domain = experiment.domain();
        let (bodies, lattice) = (Bodies::of(solids, domain, cells), Lattice::new(&domain));
        Ok(Self { simulation, experiment, history, lattice, bodies })
    }

    fn restart(&mut self) -> Result<(), String> {
        self.simulation = self.experiment.start().map_err(refused)?.simulation;
        self.history = History::start(&mut self.simulation, self.experiment.scene());
        Ok(())
    }

    fn frame(&self, run: u64) -> Vec<u8> {
        let particles = self.simulation.particles();
        // by their ids, so that the page can follow each of them
        let order = particles.order_by_id();
        let column = |of: &dyn Fn(usize) -> f64| order.iter().map(|&i| of(i)).collect::<Vec<f64>>();
        let velocity = &particles.velocity;
        let arrays = [
            column(&|i| velocity.get(i).length()),
            column(&|i| particles.density[i]),
            column(&|i| particles.pressure[i]),
            column(&|i| velocity.x[i]),
            column(&|i| velocity.y[i]),
            column(&|i| velocity.z[i]),
        ];
        let places = order.iter().map(|&i| particles.position.get(i));
        let (frame, ranges) = Frame::of(&self.lattice, places, &arrays.each_ref().map(Vec::as_slice));
        let (time, step) = (self.simulation.time(), Some(self.simulation.steps()));
        let poses = poses(&self.bodies, time);
        pack_frame(&FrameHead { step, ranges, poses, run, ..FrameHead::at(time) }, &frame, None)
    }

    fn details(&self, spent: f64) -> String {
        let speed = if spent > 0.0 { format!(" · {:.1} ms per step", 1e3 * spent) } else { String::new() };
        let found = self.simulation.findings();
        let found: String = found.iter().map(|(_, message)| format!(" · {message}")).collect();
        let until = self.experiment.scene().run.until;
        let past = if self.simulation.time() > until {
            format!(" · past the end of the run, {until} s")
        } else {
            String::new()
        };
        format!(" · step {}{speed}{past}{found}", self.simulation.steps())
    }
}

/// Where all solids are at a time, s; none if one of them is not just carried along.
fn poses(bodies: &Bodies, time: f64) -> Vec<[f64; 12]> {
    if !bodies.move_about() {
        return Vec::new();
    }
    bodies.placements(time).unwrap_or_default().iter().map(columns).collect()
}

/// The block of the mesh of all solids at a time, s.
fn mesh_at(bodies: &Bodies, time: f64, run: u64) -> Result<Vec<u8>, String> {
    Ok(packed(&bodies.meshes_at(time).map_err(message)?, time, run))
}

/// The block of the meshes of all solids at a time, s.
pub(super) fn packed(meshes: &[Mesh], time: f64, run: u64) -> Vec<u8> {
    let sharp: Vec<Mesh> = meshes.iter().map(split_creases).collect();
    pack_parts(&sharp, MeshRole::Solids, time, run)
}

impl Motion {
    /// A solid that moves within a room.
    pub fn of(solids: Vec<Solid>, way: Way, time: f64, cells: usize) -> Self {
        Self { bodies: Bodies::of(solids, way.room, cells), way, time }
    }

    fn frame(&self, run: u64) -> Vec<u8> {
        let head = FrameHead { poses: poses(&self.bodies, self.time), run, ..FrameHead::at(self.time) };
        pack_frame(&head, &Frame::default(), None)
    }
}
