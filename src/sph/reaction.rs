//! What walls do to particles in a step, noted for the obstacles that feel it.

use super::{contacts::Contacts, core::Core, walls::Pushed};

/// The notes of a step. Forces of particles on each other cancel, so with what walls add to these, and with contacts, the
/// momentum of the fluid changes by gravity and by what is noted alone. What surface tension does where it meets a wall is not
/// noted, nor the viscosity of a fluid along a wall on which it slips.
#[derive(Clone, Copy)]
pub struct Reaction<'a> {
    core: &'a Core,
    contacts: &'a Contacts,
    /// Length of the step, s.
    dt: f64,
}

impl<'a> Reaction<'a> {
    /// The notes of a step of the length `dt`, s; `None` if no probe asks for forces, if the method notes none, or for the
    /// start of a run.
    pub fn of(core: &'a Core, dt: f64) -> Option<Self> {
        let is_noted = dt > 0.0 && core.parameters.method.numerics().notes_reactions();
        core.contacts.as_ref().filter(|_| is_noted).map(|contacts| Self { core, contacts, dt })
    }

    /// Notes what walls do to a particle.
    pub fn add(&self, i: usize, pushed: Pushed) {
        if pushed == Pushed::default() {
            return;
        }
        let at = self.core.particles.position.get(i);
        self.core.boundary.divide(self.core.wall(), at, &pushed, |obstacle, share| {
            self.contacts.add(i, obstacle, self.dt * share, at);
        });
    }
}
