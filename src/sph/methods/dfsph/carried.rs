//! The acceleration of a fluid that is carried along by its sealed vessel.
//!
//! Where a vessel is pushed, a pressure that is linear in space accelerates all of the fluid alike, and stirs none of it.
//! The sums over pairs find its gradient only up to the disorder of the particles, so that a solve leaves each particle
//! with a part of the acceleration of its own: a tank that is pushed with 2 m/s² was stirred by 0.2 m/s at most, 0.03 in
//! the mean, and its load was 2 % too large. So the mean acceleration ā of each body of fluid acts on all of its
//! particles alike, and the pressure −ρ₀·ā·x is added as the hydrostatic one is ([`hydrostatic`](super::hydrostatic)):
//! both are the pressure under the gravity g − ā that the vessel feels. The solver finds what is left.
//!
//! ā is learnt from what pressure gives each body, as a mean over the relaxation time: what the mean velocity of the
//! fluid changes by in a step is noisy. Like the pressure in advance ([`ahead`](super::ahead)), it acts for half of the
//! step before and half of the step after the places where it is found. If it changes, the solver gives the difference
//! until it has been learnt.
//!
//! Where all walls around the fluid move as one, without turning, nothing needs to be learnt: ā is how their velocity has
//! changed in the last step. (A mean over eight steps came late for water that was shaken in 70 steps a period: it moved 5 %
//! too far, now 1.5, and the load of a pushed tank scattered twice as much.) Only a velocity that begins at once is left to
//! the solver. What acts in the middle of a step works with the vessel's velocity there.

use glam::{DMat3, DVec3};

use super::walls::Walls;
use crate::sph::{
    checkpoint::{Checkpoint, CheckpointError},
    core::Core,
    particles::{Vectors, add_scaled},
};

/// Names of its columns in a checkpoint.
const NAMES: [&str; 3] = ["carried x", "carried y", "carried z"];

/// Name of the velocity of the vessel in a checkpoint.
const VESSEL: &str = "velocity of the vessel";

/// The acceleration ā of the body that each particle belongs to.
#[derive(Default)]
pub(super) struct Carried {
    /// In m/s²; empty unless the vessel is sealed.
    acceleration: Vectors,
    /// The body of each particle in the order of the last solve, and their number.
    bodies: (Vec<usize>, usize),
    /// The part of what pressure gives beyond ā that is learnt in a step.
    share: f64,
    /// The velocity of the vessel, m/s, if all walls around the fluid have one.
    vessel: Option<DVec3>,
    /// Whether ā follows from that.
    is_led: bool,
}

/// Walls move as one if what one velocity leaves of their motion is below this part of it, squared.
const AS_ONE: f64 = 1e-9;

/// A velocity that changes in a step by more than this part of a spacing over the step begins or ends at once.
const AT_ONCE: f64 = 0.1;

impl Carried {
    /// Nothing is carried yet.
    pub fn at_rest(core: &Core) -> Self {
        let mut acceleration = Vectors::default();
        if core.parameters.is_sealed {
            acceleration.resize(core.particles.len());
        }
        Self { acceleration, bodies: (Vec::new(), 0), share: 0.0, vessel: None, is_led: false }
    }

    /// The fluid of an open vessel is moved by pressure alone.
    pub fn end(&mut self) {
        self.acceleration = Vectors::default();
    }

    /// ā of a particle, m/s².
    pub fn of(&self, i: usize) -> DVec3 {
        if self.acceleration.is_empty() { DVec3::ZERO } else { self.acceleration.get(i) }
    }

    /// Adds what ā gives in a time, s, to the velocities.
    pub fn act(&self, core: &mut Core, time: f64) {
        if !self.acceleration.is_empty() {
            add_scaled(&mut core.particles.velocity, &self.acceleration, time);
        }
    }

    /// Notes what the work of a vessel in a step of the length `dt`, s, is more than that with its velocity at the
    /// beginning: ā acts in the middle of the step.
    pub fn note_work(&self, core: &Core, dt: f64) {
        let Some(contacts) = core.contacts.as_ref().filter(|_| self.is_led) else { return };
        // ā is the same everywhere
        let by_walls = self.of(0) - core.parameters.pull();
        contacts.add_work(0, 0.5 * dt * dt * self.of(0).dot(by_walls) * self.acceleration.x.len() as f64);
    }

    /// Takes ā from the motion of the vessel, if it moves as one, at the beginning of a step; the last one took `last_dt`, s.
    /// Returns whether it did.
    fn follow(&mut self, core: &Core, walls: &Walls, last_dt: f64) -> bool {
        let now = velocity_of_walls(walls);
        let before = std::mem::replace(&mut self.vessel, now);
        self.is_led = false;
        let (Some(before), Some(now)) = (before, now) else { return false };
        let change = now - before;
        if last_dt <= 0.0 || change.length() * last_dt > AT_ONCE * core.parameters.spacing() {
            return false;
        }
        let acceleration = change / last_dt;
        let columns = self.acceleration.components_mut().into_iter().zip(acceleration.to_array());
        columns.for_each(|(column, component)| column.fill(component));
        self.is_led = true;
        true
    }

    /// Learns what pressure has given each body in the mean since the last step: ā, half of the pressure in advance, and
    /// the accelerations `push`, m/s², of the solve of this step, of the length `dt`, s. The last one took `last_dt`, s; a
    /// short step, as before a frame, makes little of the noise of its pressure. Of what is new the part `share` is learnt.
    pub fn learn(
        &mut self,
        bodies: (Vec<usize>, usize),
        (core, walls, push): (&Core, &Walls, &Vectors),
        (last_dt, dt): (f64, f64),
        share: f64,
    ) {
        self.bodies = bodies;
        if !self.acceleration.is_empty() && self.follow(core, walls, last_dt) {
            self.share = 0.0;
            return;
        }
        self.learn_from(push, (last_dt, dt), share);
    }

    fn learn_from(&mut self, push: &Vectors, (last_dt, dt): (f64, f64), share: f64) {
        self.share = share;
        if last_dt > 0.0 {
            self.add_means(push, share * dt / last_dt.max(dt));
        }
    }

    /// Counts half of the pressure in advance, which gives the accelerations `push`, m/s², as given.
    pub fn expect(&mut self, push: &Vectors) {
        self.add_means(push, 0.5 * self.share);
    }

    fn add_means(&mut self, push: &Vectors, factor: f64) {
        if self.acceleration.is_empty() {
            return;
        }
        let (of, count) = &self.bodies;
        let mut sums = vec![(DVec3::ZERO, 0.0); *count];
        for (i, (push, body)) in push.iter().zip(of).enumerate() {
            sums[*body].0 += self.acceleration.get(i) + factor * push;
            sums[*body].1 += 1.0;
        }
        // bodies may have joined, or parted
        for (i, body) in of.iter().enumerate() {
            let (sum, n) = sums[*body];
            self.acceleration.set(i, sum / n);
        }
    }

    /// The columns that are sorted with the particles.
    pub fn columns(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        let is_used = !self.acceleration.is_empty();
        self.acceleration.components_mut().into_iter().filter(move |_| is_used)
    }

    /// Saves what the next step needs.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        if !self.acceleration.is_empty() {
            for (name, column) in NAMES.into_iter().zip(self.acceleration.components()) {
                checkpoint.set(name, column.clone());
            }
        }
        checkpoint.set(VESSEL, self.vessel.map_or_else(Vec::new, |velocity| velocity.to_array().to_vec()));
    }

    /// Restores what [`Carried::save`] stored.
    ///
    /// # Errors
    /// The column that the checkpoint lacks.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        for (name, column) in NAMES.into_iter().zip(self.columns()) {
            *column = checkpoint.of_particles(name)?;
        }
        self.vessel = match checkpoint.get(VESSEL)? {
            [] => None,
            &[x, y, z] if x.is_finite() && y.is_finite() && z.is_finite() => Some(DVec3::new(x, y, z)),
            _ => return Err(CheckpointError::Column(VESSEL.into())),
        };
        Ok(())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.acceleration.bytes() + self.bodies.0.capacity() * size_of::<usize>()
    }
}

/// The velocity of the walls around a fluid, m/s, as far as they push it; `None` if they move differently or there are none
/// in some direction.
fn velocity_of_walls(walls: &Walls) -> Option<DVec3> {
    let (mut normals, mut swept, mut square) = (DMat3::ZERO, DVec3::ZERO, 0.0);
    for (_, (wall, _)) in walls.found() {
        let n = wall.gradient;
        normals += DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        swept += wall.sweep * n;
        square += wall.sweep * wall.sweep;
    }
    let velocity = normals.inverse() * swept;
    (velocity.is_finite() && square - swept.dot(velocity) <= AS_ONE * square).then_some(velocity)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_pressure_gave_in_the_mean_acts_from_then_on() {
        let mut carried = Carried::default();
        carried.acceleration.resize(3);
        let mut push = Vectors::default();
        [1.0, 9.0, 3.0].into_iter().for_each(|x| push.push(DVec3::new(x, 0.0, 0.0)));
        let two = (vec![0, 1, 0], 2);
        // half of the last step in advance, and all of this one
        let learn = |carried: &mut Carried, times: (f64, f64), share: f64| {
            carried.bodies = two.clone();
            carried.learn_from(&push, times, share);
        };
        learn(&mut carried, (0.0, 0.1), 1.0);
        carried.expect(&push);
        learn(&mut carried, (0.1, 0.1), 1.0);
        let found: Vec<f64> = (0..3).map(|i| carried.of(i).x).collect();
        assert!((found[0] - 3.0).abs() < 1e-12 && found[2] == found[0], "{found:?}");
        assert!((found[1] - 13.5).abs() < 1e-12, "{found:?}");
        // the speed that a short step gives is little of what a usual one needs
        learn(&mut carried, (0.1, 0.001), 1.0);
        assert!((carried.of(0).x - 3.02).abs() < 1e-12);
        learn(&mut carried, (0.1, 0.1), 0.25);
        assert!((carried.of(0).x - 3.52).abs() < 1e-12);
    }
}
