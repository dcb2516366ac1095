//! What walls do to particles in a step, noted for the force on obstacles and for the work of walls.

use glam::DVec3;

use super::{
    contacts::Contacts,
    core::Core,
    methods::Noted,
    walls::{NearMotion, Pushed, Share},
};

/// Steps for which the work of several walls on a particle is divided once.
const TURNS: u32 = 8;

/// The notes of a step. Forces of particles on each other cancel. So the momentum of the fluid changes only
/// by gravity and by what is noted: the part of walls in these forces, and contacts. What surface tension
/// does where it meets a wall is not noted, nor the viscosity of a fluid along a wall on which it slips.
#[derive(Clone, Copy)]
pub struct Reaction<'a> {
    core: &'a Core,
    contacts: &'a Contacts,
    /// What is noted of the forces, and not only of work.
    forces: Noted,
    /// Length of the step, s.
    dt: f64,
}

impl<'a> Reaction<'a> {
    /// The notes of a step of the length `dt`, s; `None` if no probe asks for forces and no wall moves, if
    /// the method notes none, or for the start of a run.
    pub fn of(core: &'a Core, dt: f64) -> Option<Self> {
        let noted = core.parameters.method.numerics().noted();
        let is_noted = dt > 0.0 && noted != Noted::Nothing;
        let forces = |contacts: &Contacts| if contacts.are_for_forces() { noted } else { Noted::Nothing };
        core.contacts.as_ref().filter(|_| is_noted).map(|contacts| Self {
            core,
            contacts,
            forces: forces(contacts),
            dt,
        })
    }

    /// Whether the work of several walls on a particle is divided in this step.
    fn is_turn_of(&self, i: usize) -> bool {
        let id = u64::from(self.core.particles.id[i]);
        (id + self.core.steps).is_multiple_of(u64::from(TURNS))
    }

    /// Notes the acceleration of a particle near walls by viscosity, m/s², if forces follow from the pressure in front
    /// of surfaces: all the rest is by pressure and gravity.
    pub fn note_drag(&self, i: usize, drag: DVec3) {
        if self.forces == Noted::Friction {
            self.contacts.note_drag(i, drag);
        }
    }

    /// Notes what walls do to a particle. If only work is noted, a force that only one wall can have caused
    /// is not divided. To divide a force of several walls takes long, so all of it counts as that of the
    /// moving one. In one of [`TURNS`] steps the error of this is found, and applied to all of them.
    pub fn add(&self, i: usize, pushed: Pushed) {
        if pushed.is_nothing() {
            return;
        }
        let (at, wall, boundary) =
            (self.core.particles.position.get(i), self.core.wall(), &self.core.boundary);
        // pressure works by how a wall moves, and friction by how its surface does
        let work = |obstacle: usize, share: Share| {
            self.dt
                * (share.by_pressure.dot(boundary.wall_velocity(obstacle, at))
                    + share.by_friction.dot(boundary.velocity_along(obstacle, at))
                    + work_of_couple(share, || boundary.turning(obstacle, at, wall.h)))
        };
        let force: Option<fn(Share) -> DVec3> = match self.forces {
            Noted::Nothing => None,
            Noted::Friction if pushed.by_friction == DVec3::ZERO && pushed.couple == DVec3::ZERO => None,
            Noted::Friction => Some(|share| share.by_friction),
            Noted::Forces => Some(|share| share.by_pressure + share.by_friction),
        };
        if let Some(force) = force {
            return boundary.divide(wall, at, &pushed, |obstacle, share| {
                self.contacts.add_work(i, work(obstacle, share));
                self.contacts.add(i, obstacle, [self.dt * force(share), self.dt * share.couple], at);
            });
        }
        let (moving, is_alone) = match boundary.moving_near(at, wall.h) {
            NearMotion::Nothing => return,
            NearMotion::Alone(moving) => (moving, true),
            NearMotion::BesideOthers(moving) => (moving, false),
        };
        let roughly = work(moving, pushed.into());
        self.contacts.add_work(i, roughly);
        if !is_alone && self.is_turn_of(i) {
            let mut exactly = 0.0;
            boundary.divide(wall, at, &pushed, |obstacle, share| exactly += work(obstacle, share));
            self.contacts.add_work(i, f64::from(TURNS) * (exactly - roughly));
        }
    }
}

/// The power of a couple on a fluid, W/kg, beside a wall that turns, 1/s.
fn work_of_couple(share: Share, turning: impl Fn() -> DVec3) -> f64 {
    if share.couple == DVec3::ZERO { 0.0 } else { share.couple.dot(turning()) }
}
