//! What all methods share: the particles, their neighbours, the boundary, and those stages of a step that do
//! not depend on how the pressure is found.

use std::sync::Arc;

use fearless_simd::{Level, Simd, SimdFloat};
use glam::DVec3;
use rayon::prelude::*;

use crate::precision::Precision;

use super::{
    VectorField, VectorOfTime,
    checkpoint::{Checkpoint, CheckpointError, VECTORS},
    contacts::Contacts,
    error::{Cause, Quantity, StepError},
    pairs::{Cloud, Columns, Near, PairPass, Real},
    params::Parameters,
    particles::{CHUNK, Particles, Vectors, add_scaled, set_sum},
    walls::{
        Behind, Boundary, Coverage, Fault, Friction, MARKED, StepLimits, Trouble, UNKNOWN, Undefined, Wall,
    },
};

/// A step shorter than this part of the longest one so far makes a run useless: speeds have grown by a factor
/// of 10⁶, or forces by 10¹².
const SHORTEST: f64 = 1e-6;

/// Part of the spacing that a body beside the fluid may move in one step, as far as a particle may.
const BODY_TRAVEL: f64 = 0.4;

/// Name of the greatest speed of sound in a checkpoint.
const SOUND: &str = "speed of sound";

/// The state of a simulation and the stages that all methods share.
pub(super) struct Core {
    pub parameters: Parameters,
    /// Gravity that depends on the place, m/s², in addition to that of the parameters.
    pub gravity_field: Option<Arc<VectorField>>,
    /// Gravity as a function of time, if it replaces that of the parameters at each step.
    pub turning_gravity: Option<Arc<VectorOfTime>>,
    pub boundary: Boundary,
    pub particles: Particles,
    /// Accelerations of the particles, m/s².
    pub acceleration: Vectors,
    pub steps: u64,
    /// Simulated time, s.
    pub time: f64,
    /// The greatest speed at the beginning of the present step, m/s.
    pub speed: f64,
    /// The greatest speed of sound in the fluid as it is compressed now, m/s; 0 if the method has none that
    /// grows with compression.
    pub sound: f64,
    /// The longest step, s, that the present pressure allows, by more than its acceleration; infinite if the
    /// method has no such limit.
    pub pressure_dt: f64,
    /// Impulses of the fluid on obstacles, if a probe asks for them, and the work of walls on it, if any move.
    pub contacts: Option<Contacts>,
    /// The longest step that was allowed so far, s.
    longest_dt: f64,
    level: Level,
    wall: Wall,
    columns: Columns,
    /// Neighbours of each particle, if a method has asked for them, see [`Core::find_near`].
    near: Near,
    near_is_known: bool,
    /// Least distance of each particle from all obstacles, m, see [`Boundary::collide`].
    clear: Vec<f64>,
    /// Whether a wall may be near one of [`MARKED`] particles, see [`Boundary::mark`].
    near_walls: Vec<bool>,
    /// The part of the walls near each particle that is wet, 0 to 1; empty if all are. Sorting forgets it.
    pub wet: Vec<f64>,
    /// Working memory: the targets of the particles before they collide, or a vector that a method needs.
    pub spare: Vectors,
    sorted_id: Vec<u32>,
}

impl Core {
    pub fn new(parameters: Parameters, mut boundary: Boundary, particles: Particles) -> Self {
        if parameters.walls_have_density() {
            boundary.map_obstacles(parameters.support_radius);
        }
        let mut acceleration = Vectors::default();
        acceleration.resize(particles.len());
        let speed = longest(&particles.velocity);
        let wall = wall_of(&parameters);
        let contacts = boundary.any_moves().then(|| Contacts::of(boundary.obstacles.len()));
        let clear = if boundary.obstacles.is_empty() { Vec::new() } else { vec![UNKNOWN; particles.len()] };
        Self {
            parameters,
            gravity_field: None,
            turning_gravity: None,
            boundary,
            particles,
            acceleration,
            steps: 0,
            time: 0.0,
            speed,
            sound: 0.0,
            pressure_dt: f64::INFINITY,
            contacts,
            longest_dt: 0.0,
            level: Level::new(),
            wall,
            columns: Columns::default(),
            near: Near::default(),
            near_is_known: false,
            clear,
            near_walls: Vec::new(),
            wet: Vec::new(),
            spare: Vectors::default(),
            sorted_id: Vec::new(),
        }
    }

    /// Lets the particles take this part of their room in sums over neighbours. The walls follow their spacing.
    pub fn pack(&mut self, packing: f64) {
        self.parameters.packing = packing;
        self.wall = wall_of(&self.parameters);
    }

    /// Moves the obstacles to the coming step.
    pub fn move_obstacles(&mut self, dt: f64) {
        self.boundary.move_to(self.time, self.time + dt);
    }

    /// Moves the particles by v·dt, and out of walls and obstacles that they hit on the way. `shift`, a field
    /// and its factor, moves them too, but does not belong to their velocity.
    pub fn drift(&mut self, dt: f64, shift: Option<(&Vectors, f64)>) -> Result<(), StepError> {
        set_sum(&mut self.spare, &self.particles.position, &self.particles.velocity, dt);
        if let Some((shift, factor)) = shift {
            add_scaled(&mut self.spare, shift, factor * dt);
        }
        // check now: infinite positions would be clamped to the box and never noticed
        if let Some(i) = first_non_finite(&self.spare) {
            return Err(self.non_finite(i, Quantity::Position, dt));
        }
        let Particles { position, velocity, id, .. } = &mut self.particles;
        let met = self.boundary.collide(
            position,
            &mut self.spare,
            velocity,
            &mut self.clear,
            self.contacts.as_ref(),
        );
        met.map_err(|Fault { index, trouble }| {
            let (step, id) = (self.steps, id[index]);
            match trouble {
                Trouble::NoRoom { at } => StepError::NoRoom { step, id, at },
                Trouble::Undefined(Undefined { at }) => {
                    let (quantity, cause) = (Quantity::Omega, Cause::FieldUndefined { at });
                    StepError::NonFinite { step, id, quantity, cause }
                }
            }
        })?;
        std::mem::swap(position, &mut self.spare);
        self.near_is_known = false;
        self.settle_contacts();
        Ok(())
    }

    /// Adds up what obstacles have received since this was done last.
    pub fn settle_contacts(&mut self) {
        if let Some(contacts) = &mut self.contacts {
            contacts.settle(self.parameters.particle_mass);
        }
    }

    /// Sorts all that belongs to particles into the order of the columns: position, velocity, acceleration,
    /// number, and the columns `kept` of the method.
    pub fn sort(&mut self, kept: &mut [&mut Vec<f64>]) {
        self.near_is_known = false;
        self.columns.sort(&self.particles.position, self.parameters.support_radius);
        let order = self.columns.order();
        let Particles { position, velocity, density, pressure, id } = &mut self.particles;
        let vectors =
            [position, velocity, &mut self.acceleration].into_iter().flat_map(Vectors::components_mut);
        let clear = Some(&mut self.clear).filter(|clear| !clear.is_empty());
        let scalars =
            [density, pressure].into_iter().chain(clear).chain(kept.iter_mut().map(|column| &mut **column));
        for column in vectors.chain(scalars) {
            permute(order, column, &mut self.spare.x);
        }
        permute(order, id, &mut self.sorted_id);
        if self.parameters.walls_have_density() {
            let Self { boundary, particles, near_walls, .. } = self;
            boundary.mark(&particles.position, self.parameters.support_radius, near_walls);
        }
        self.wet.clear();
    }

    /// What walls take of the kernel of a particle; `None` if they are farther away than the support radius.
    pub fn coverage<F: Friction>(&self, i: usize) -> Option<Coverage<F>> {
        self.coverage_with(i)
    }

    /// What walls take of the kernel of a particle, with what is known of the motion behind them if B asks for it.
    pub fn coverage_with<F: Friction, B: Behind>(&self, i: usize) -> Option<Coverage<F, B>> {
        let near = self.near_walls[i / MARKED];
        let whole = near.then(|| self.boundary.coverage(&self.wall, self.particles.position.get(i)))??;
        Some(match self.wet.get(i) {
            Some(&wet) if wet < 1.0 => whole.in_part(wet),
            Some(_) | None => whole,
        })
    }

    /// What walls that are wet as a whole take of the kernel of a particle, as continuous walls. `None` if none is near.
    pub fn coverage_by_whole_walls(&self, i: usize) -> Option<Coverage> {
        let near = self.near_walls[i / MARKED];
        let plain = Wall { layer: None, ..self.wall };
        near.then(|| self.boundary.coverage(&plain, self.particles.position.get(i)))?
    }

    /// The part of that by the walls of the box.
    pub fn coverage_by_box(&self, i: usize) -> Coverage {
        let plain = Wall { layer: None, ..self.wall };
        self.boundary.coverage_by_box(&plain, self.particles.position.get(i))
    }

    /// The walls of the box near a particle: their normals into it, and their distances, m.
    pub fn box_faces(&self, i: usize) -> impl Iterator<Item = (DVec3, f64)> {
        self.boundary.box_planes(&self.wall, self.particles.position.get(i))
    }

    /// How walls enter the sums of the method.
    pub fn wall(&self) -> &Wall {
        &self.wall
    }

    /// Changes how walls enter the sums, and returns how they did.
    pub fn exchange_wall(&mut self, wall: Wall) -> Wall {
        std::mem::replace(&mut self.wall, wall)
    }

    /// For each axis the part of the kernel's moment at a particle that lies behind the walls of the box across it.
    pub fn box_moments(&self, i: usize) -> DVec3 {
        let wet = self.wet.get(i).copied().unwrap_or(1.0);
        wet * self.boundary.box_moments(&self.wall, self.particles.position.get(i))
    }

    /// Gravity at a particle, m/s², at the end of the present step.
    pub fn gravity(&self, i: usize) -> DVec3 {
        let field = self
            .gravity_field
            .as_ref()
            .map(|field| field(self.particles.position.get(i), self.boundary.time));
        self.parameters.gravity + field.unwrap_or(DVec3::ZERO)
    }

    /// Whether any gravity pulls at the fluid.
    pub fn has_weight(&self) -> bool {
        self.gravity_field.is_some() || self.parameters.pull() != DVec3::ZERO
    }

    /// Adds to the accelerations a part of the gravity that depends on the place, if there is any.
    pub fn pull(&mut self, part: f64) {
        let Some(field) = &self.gravity_field else { return };
        let (position, time) = (&self.particles.position, self.boundary.time);
        let [x, y, z] = self.acceleration.components_mut();
        x.par_iter_mut().zip(y).zip(z).enumerate().for_each(|(i, ((x, y), z))| {
            let pull = part * field(position.get(i), time);
            *x += pull.x;
            *y += pull.y;
            *z += pull.z;
        });
    }

    /// Sums over the neighbours of every particle, in the precision of the parameters.
    pub fn sum<P, const IN: usize, const SUMS: usize, const OUT: usize>(
        &self,
        pass: &P,
        fields: [&[f64]; IN],
        out: [&mut [f64]; OUT],
    ) where
        P: PairPass<IN, SUMS, OUT>,
    {
        let cloud = Cloud { near: self.near_is_known.then_some(&self.near), ..self.cloud() };
        match self.parameters.precision {
            Precision::F32 => cloud.sum::<f32, P, IN, SUMS, OUT>(pass, fields, out),
            Precision::F64 => cloud.sum::<f64, P, IN, SUMS, OUT>(pass, fields, out),
        }
    }

    /// Finds the neighbours of each particle. All sums use them until particles move.
    pub fn find_near(&mut self) {
        let mut near = std::mem::take(&mut self.near);
        match self.parameters.precision {
            Precision::F32 => self.cloud().find_near::<f32>(&mut near),
            Precision::F64 => self.cloud().find_near::<f64>(&mut near),
        }
        self.near = near;
        self.near_is_known = true;
    }

    fn cloud(&self) -> Cloud<'_> {
        Cloud {
            level: self.level,
            columns: &self.columns,
            position: &self.particles.position,
            radius: self.parameters.support_radius,
            near: None,
        }
    }

    /// Number of ordered pairs of particles within the support radius, counted by this call.
    pub fn pairs(&self) -> usize {
        let mut counts = vec![0.0; self.particles.len()];
        let count = Count { radius: self.parameters.support_radius };
        self.sum(&count, [], [&mut counts]);
        counts.iter().map(|&count| count as usize).sum()
    }

    /// Checks that densities and accelerations are finite.
    ///
    /// # Errors
    /// The first particle whose density or acceleration is not.
    pub fn check_finite(&self, dt: f64) -> Result<(), StepError> {
        if !all_finite(&self.particles.density)
            && let Some(i) = self.particles.density.iter().position(|rho| !rho.is_finite())
        {
            return Err(self.non_finite(i, Quantity::Density, dt));
        }
        match first_non_finite(&self.acceleration) {
            Some(i) => Err(self.non_finite(i, Quantity::Acceleration, dt)),
            None => Ok(()),
        }
    }

    /// The longest step that this state allows, s: the least of the parameters' limits at the present greatest
    /// speed, the force limit at the present greatest acceleration, and the limit by pressure of the last step.
    pub fn stable_dt(&self) -> f64 {
        self.stable_dt_at(longest(&self.particles.velocity))
    }

    /// The longest step that this state allows, s, for a greatest speed that is known, m/s.
    fn stable_dt_at(&self, speed: f64) -> f64 {
        let limit = self.parameters.stable_dt(speed);
        let limit =
            if self.sound > 0.0 { limit.min(self.parameters.sound_dt(self.sound, speed)) } else { limit };
        limit.min(self.pressure_dt).min(self.parameters.present_force_dt(longest(&self.acceleration)))
    }

    /// The step to take now, s, at most `most`.
    ///
    /// # Errors
    /// [`StepError::Stalled`] if the step would be so short that the run makes no progress.
    pub fn next_dt(&mut self, most: f64) -> Result<f64, StepError> {
        self.speed = longest(&self.particles.velocity);
        let stated = self.parameters.time_step;
        if !self.parameters.adaptive {
            return Ok(stated.min(most));
        }
        let dt = stated.min(self.stable_dt_at(self.speed));
        self.longest_dt = self.longest_dt.max(dt);
        if dt < SHORTEST * self.longest_dt {
            return Err(self.stalled(dt));
        }
        let dt = self.dt_beside_bodies(dt, most);
        // take equal steps to the instant, rather than full ones and a small rest
        Ok(if most.is_finite() { most / (most / dt - 1e-9).ceil().max(1.0) } else { dt })
    }

    /// The longest step, s, at most `usual` and `most`, in which no body jumps past the fluid.
    fn dt_beside_bodies(&self, usual: f64, most: f64) -> f64 {
        let parameters = &self.parameters;
        let limits = StepLimits {
            travel: BODY_TRAVEL * parameters.spacing(),
            reach: parameters.support_radius,
            for_acceleration: |a| parameters.force_dt(a),
        };
        let dt = usual.min(most);
        self.boundary.step_beside_bodies(&self.particles.position, &limits, self.time, usual, dt)
    }

    /// The part of a checkpoint that all methods share.
    pub fn checkpoint(&self) -> Checkpoint {
        let Core { particles, acceleration, steps, time, .. } = self;
        let mut checkpoint = Checkpoint::default();
        (checkpoint.steps, checkpoint.time) = (*steps, *time);
        checkpoint.ids.clone_from(&particles.id);
        let vectors = [&particles.position, &particles.velocity, acceleration];
        for (name, column) in VECTORS.iter().zip(vectors.into_iter().flat_map(Vectors::components)) {
            checkpoint.set(name, column.clone());
        }
        checkpoint.set("density", particles.density.clone());
        checkpoint.set("pressure", particles.pressure.clone());
        checkpoint.set(SOUND, vec![self.sound]);
        if let Some(contacts) = self.contacts.as_ref().filter(|contacts| contacts.are_for_forces()) {
            checkpoint.set("contacts", contacts.totals().as_flattened().to_vec());
        }
        checkpoint
    }

    /// Restores what [`Checkpoint::of`] stored. The core has the same number of particles.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), CheckpointError> {
        self.particles = checkpoint.particles()?;
        let components = self.acceleration.components_mut();
        for (name, column) in VECTORS[6..].iter().zip(components) {
            *column = checkpoint.of_particles(name)?;
        }
        if let [sound] = checkpoint.get(SOUND)? {
            self.sound = *sound;
        }
        (self.steps, self.time) = (checkpoint.steps, checkpoint.time);
        Ok(())
    }

    /// Whether anything acts on all of the fluid: gravity that is constant, turns, or depends on the place.
    pub fn has_gravity(&self) -> bool {
        let Self { parameters, gravity_field, turning_gravity, .. } = self;
        parameters.gravity != DVec3::ZERO || gravity_field.is_some() || turning_gravity.is_some()
    }

    /// Uniform gravity some time ago and now, m/s²; `None` unless it is a function of time and has changed. `ago` is in s.
    pub fn change_of_gravity(&self, ago: f64) -> Option<[DVec3; 2]> {
        let gravity = self.turning_gravity.as_ref()?;
        let change = [self.time - ago, self.time].map(|time| gravity(time));
        (change[0].is_finite() && change[0] != change[1]).then_some(change)
    }

    /// Memory of the state and of the parts that all methods share, bytes.
    pub fn bytes(&self) -> usize {
        let Particles { position, velocity, density, pressure, id } = &self.particles;
        let vectors = [position, velocity, &self.acceleration, &self.spare].map(Vectors::bytes);
        vectors.iter().sum::<usize>()
            + 8 * (density.capacity() + pressure.capacity() + self.clear.capacity())
            + 8 * self.wet.capacity()
            + self.near_walls.capacity()
            + 4 * (id.capacity() + self.sorted_id.capacity())
            + self.columns.bytes()
            + self.near.bytes()
            + self.boundary.maps.bytes()
    }

    fn stalled(&self, dt: f64) -> StepError {
        let (id, speed) = self.fastest();
        StepError::Stalled { step: self.steps, dt, id, speed }
    }

    /// The error of a state whose energy has doubled, and whether walls moved.
    pub fn energy_doubled(&self, excess: f64, walls_move: bool) -> StepError {
        let (id, speed) = self.fastest();
        StepError::EnergyDoubled { step: self.steps, excess, walls_move, id, speed }
    }

    /// Number and speed, m/s, of the fastest particle.
    fn fastest(&self) -> (u32, f64) {
        let Particles { velocity, id, .. } = &self.particles;
        let speed = |i: &usize| velocity.get(*i).length();
        let fastest = (0..velocity.len()).max_by(|a, b| speed(a).total_cmp(&speed(b))).unwrap_or(0);
        (id[fastest], speed(&fastest))
    }

    /// The place of a particle at which a gravity that depends on the place has no finite value.
    fn without_gravity(&self) -> Option<DVec3> {
        let field = self.gravity_field.as_ref()?;
        let position = &self.particles.position;
        let places = (0..position.len()).map(|i| position.get(i));
        places.filter(|p| p.is_finite()).find(|p| !field(*p, self.boundary.time).is_finite())
    }

    fn non_finite(&self, index: usize, quantity: Quantity, dt: f64) -> StepError {
        // the state may hold NaN already; max and min pass it over
        let stable = self.stable_dt();
        let cause = match self.without_gravity() {
            Some(at) => Cause::GravityUndefined { at },
            None if dt > stable => Cause::StepTooLong { dt, stable },
            None => Cause::Overflow,
        };
        StepError::NonFinite { step: self.steps, id: self.particles.id[index], quantity, cause }
    }
}

/// Counts the neighbours within the radius, m, which is at most the support radius.
#[derive(Clone, Copy)]
pub(super) struct Count {
    pub radius: f64,
}

impl PairPass<0, 1, 1> for Count {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        _: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 1],
    ) {
        use fearless_simd::Select;
        let near = r2.simd_lt(V::Element::of(self.radius * self.radius));
        let [one, none] = [1.0, 0.0].map(|x| V::splat(r2.token(), V::Element::of(x)));
        sums[0] += near.select(one, none);
    }

    fn finish(&self, _: usize, [count]: [f64; 1]) -> [f64; 1] {
        [count - 1.0] // without the particle itself
    }
}

fn permute<T: Copy + Default + Send + Sync>(order: &[u32], values: &mut Vec<T>, buffer: &mut Vec<T>) {
    buffer.resize(values.len(), T::default());
    buffer.par_chunks_mut(CHUNK).zip(order.par_chunks(CHUNK)).for_each(|(buffer, order)| {
        for (to, &from) in buffer.iter_mut().zip(order) {
            *to = values[from as usize];
        }
    });
    std::mem::swap(values, buffer);
}

/// Length of the longest vector.
fn longest(vectors: &Vectors) -> f64 {
    let longest =
        |range: std::ops::Range<usize>| range.map(|i| vectors.get(i).length_squared()).fold(0.0, f64::max);
    let n = vectors.len();
    let chunks = (0..n.div_ceil(CHUNK)).into_par_iter();
    // the maximum does not depend on the order
    chunks.map(|c| longest(c * CHUNK..((c + 1) * CHUNK).min(n))).reduce(|| 0.0, f64::max).sqrt()
}

/// Index of the first vector that is not finite, if there is one.
pub(super) fn first_non_finite(vectors: &Vectors) -> Option<usize> {
    if vectors.components().into_iter().all(|column| all_finite(column)) {
        return None;
    }
    (0..vectors.len()).find(|&i| !vectors.get(i).is_finite())
}

/// Whether all values are finite. Every step checks every particle, so this is fast and does not say which
/// value is not finite.
fn all_finite(values: &[f64]) -> bool {
    const LANES: usize = 8;
    let is_finite = |chunk: &[f64]| {
        // x·0 is zero for a finite x and NaN otherwise; NaN stays in the sum
        let mut zeros = [0.0; LANES];
        let (whole, rest) = chunk.as_chunks::<LANES>();
        for values in whole {
            for (zero, value) in zeros.iter_mut().zip(values) {
                *zero += value * 0.0;
            }
        }
        zeros.iter().chain(rest).all(|x| x.is_finite())
    };
    values.par_chunks(CHUNK).all(is_finite)
}

/// How walls enter the sums of the method, for a fluid that rubs on itself as its viscosity asks for.
fn wall_of(parameters: &Parameters) -> Wall {
    let (numerics, scales) = (parameters.method.numerics(), parameters.scales());
    Wall { viscous_forces: numerics.viscous_forces(&scales), ..numerics.wall(&scales) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_not_finite_is_found_wherever_it_is() {
        for len in [0, 1, 29, CHUNK - 1, CHUNK + 13] {
            let mut values = vec![1e300; len];
            assert!(all_finite(&values));
            for i in (0..len).filter(|i| i % 64 < 30 || i + 30 > len) {
                for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    let before = std::mem::replace(&mut values[i], odd);
                    assert!(!all_finite(&values), "{odd} at {i} of {len}");
                    values[i] = before;
                }
            }
        }
    }
}
