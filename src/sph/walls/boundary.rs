//! Collision: particles that a step has carried into an obstacle or out of the box are put back.
//!
//! For each particle the solver keeps the radius of a ball that is proven to lie in the fluid, less the
//! distance moved since. While it is positive, no obstacle is evaluated. No obstacle is evaluated either for
//! a block of particles whose paths all lie in a box that the field's range proves to be fluid. Other paths
//! are swept.
//!
//! At a contact the particle stops on the surface, its velocity is reflected, and the rest of its path goes
//! on along the surface. Without that, a sliding particle would touch at once in every step and never move.
//! The rest of the path is not mirrored, because it could lift a particle above the height from which it
//! fell: only the velocity bounces.
//!
//! This stage acts on positions and velocities only. [`Coverage`] has what walls add to density and pressure.
//!
//! Invariant: every particle leaves this stage finite, in the box, and with ω < 0 for every obstacle. If the
//! wedge between a wall and an obstacle at rest has no such place near the target, the particle stays at the
//! last such place. Where moving walls leave no room there is an error.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    field::{Face, Faces, Moving, Part, Walls},
    geom::Aabb,
};

use crate::sph::{VectorField, contacts::Contacts, particles::Vectors, scales::Slip};

use super::{
    behind::Behind,
    broad_phase::BroadPhase,
    contact::{Trouble, rubbed},
    coverage::Coverage,
    friction::Friction,
    layers::{ViscousForces, Wall},
    volume::{ChangingShape, Known, Mapped, Maps, RigidPart},
};

/// Number of particles whose paths are first tested together.
const BLOCK: usize = 32;

/// Number of particles that [`Boundary::mark`] tests together.
pub(in crate::sph) const MARKED: usize = 32;

/// A support radius, in clearances. A particle that a moving wall overtakes is moved at most this far, and no
/// larger ball is tested for being free.
const REACH: f64 = 1e6;

/// Stands for an unknown distance of a particle from all obstacles. Any negative number means the same.
pub(in crate::sph) const UNKNOWN: f64 = -1.0;

/// An obstacle ends in a wall of the box if its face is within this distance from the wall, over the support
/// radius.
pub(super) const FLUSH: f64 = 1e-3;

/// The cosine of the angle between that face and the wall may be less than 1 by this much.
const LEVEL: f64 = 1e-6;

/// The distance, over the support radius, of a face behind which all of a kernel lies.
const BEYOND_REACH: f64 = 2.0;

/// A step by which the slope of a wall's velocity is found, over the support radius.
const TURNING_STEP: f64 = 1e-2;

/// Part of a proven radius that is used. The rest allows for the rounding of many subtractions.
const SURELY: f64 = 1.0 - 1e-9;

/// An obstacle: a body in the way of the fluid.
#[derive(Clone)]
pub struct Obstacle {
    /// The field of the body, ω > 0 inside. For a body that moves it is the field at the start.
    pub field: Arc<dyn Walls>,
    /// The motion of the body; `None` if it is at rest.
    pub moving: Option<Arc<dyn Moving>>,
    /// The parts of a body that moves, if they move differently and each without deformation; empty if it
    /// moves as a whole, or if that is not known. The part of kernels that they take then follows from their
    /// volume.
    pub parts: Vec<RigidPart>,
    /// How often the part of kernels is found that a body takes which changes its shape. If it is `None`,
    /// that part follows from the faces, in closed forms that hold where faces are hardly bent within a
    /// support radius.
    pub changing: Option<ChangingShape>,
    /// Restitution c_R, 0 (stick) to 1 (mirror).
    pub restitution: f64,
    /// Coefficient of friction μ: when a particle hits the body, its speed along the face falls by μ times
    /// the change of its velocity normal to the face.
    pub friction: f64,
    /// Thickness, m, of the thinnest part that must stop particles of any speed, for fields that do not know
    /// their range (closures): their paths are sampled this closely. A twentieth of the support radius is a
    /// good value; a smaller one costs more samples per step. Compiled solids stop particles at any
    /// thickness.
    pub resolution: f64,
    /// How the body acts on a fluid that moves along it.
    pub slip: Slip,
    /// Motion of the surface within itself, m/s, as that of a belt. It drags a fluid that sticks, in place of
    /// the body's own motion along its surface. It is evaluated at the places of particles near the surface,
    /// so that the field of a body that turns does not rub on a fluid that turns with it.
    pub surface_velocity: Option<Arc<VectorField>>,
}

impl Obstacle {
    /// A body at rest along which the fluid slips. It returns half of a speed into it. See
    /// [`Obstacle::resolution`] for `resolution`.
    pub fn at_rest(field: Arc<dyn Walls>, resolution: f64) -> Self {
        Self {
            field,
            moving: None,
            parts: Vec::new(),
            changing: None,
            restitution: 0.5,
            friction: 0.0,
            resolution,
            slip: Slip::Free,
            surface_velocity: None,
        }
    }

    /// Whether it moves, or its surface does.
    pub(in crate::sph) fn moves(&self) -> bool {
        self.moving.is_some() || self.surface_velocity.is_some()
    }
}

/// The box and the bodies in it.
pub(in crate::sph) struct Boundary {
    pub domain: Aabb,
    pub wall_restitution: f64,
    pub wall_friction: f64,
    /// How the walls of the box act on a fluid that moves along them.
    pub slip: Slip,
    pub obstacles: Vec<Obstacle>,
    /// For each obstacle that moves, its field during the present step.
    pub during: Vec<Option<Box<dyn Walls>>>,
    /// The end of the present step, s.
    pub time: f64,
    /// The length of the present step, s.
    pub step: f64,
    /// Distance from an obstacle's surface, m, at which particles stop.
    pub clearance: f64,
    /// What the obstacles take of kernels.
    pub maps: Maps,
    /// Which obstacles may be near a place.
    pub broad_phase: BroadPhase,
}

/// A particle that could not be put anywhere, by its index.
#[derive(Debug, Clone, Copy)]
pub(in crate::sph) struct Fault {
    pub index: usize,
    pub trouble: Trouble,
}

impl Boundary {
    /// Sets the moving obstacles to a step between two times, s.
    pub fn move_to(&mut self, from: f64, to: f64) {
        self.time = to;
        self.step = to - from;
        self.during.clear();
        self.during
            .extend(self.obstacles.iter().map(|o| o.moving.as_ref().map(|moving| moving.during(from, to))));
        self.maps.move_to(from, to);
        for k in (0..self.obstacles.len()).filter(|k| self.obstacles[*k].moving.is_some()) {
            let around = self.field(k).surroundings(&self.domain, self.broad_phase.h());
            self.broad_phase.set(k, around);
        }
    }

    /// The field of an obstacle during the present step.
    pub fn field(&self, k: usize) -> &dyn Walls {
        match self.during.get(k) {
            Some(Some(moving)) => &**moving,
            _ => &*self.obstacles[k].field,
        }
    }

    /// The greatest distance, m, by which a particle that a moving wall overtakes is moved.
    pub(super) fn reach(&self) -> f64 {
        REACH * self.clearance
    }

    /// Whether any wall moves, by its motion or within its surface, and so does work on the fluid.
    pub fn any_moves(&self) -> bool {
        self.obstacles.iter().any(Obstacle::moves)
    }

    /// The velocity of an obstacle's wall near a point, m/s; zero if it is at rest.
    pub fn wall_velocity(&self, k: usize, p: DVec3) -> DVec3 {
        if self.obstacles[k].moving.is_some() { self.field(k).wall_velocity(p) } else { DVec3::ZERO }
    }

    /// The velocity along an obstacle's surface near a point, m/s: the one that the scene states, or that of
    /// the body's motion. Only its part in the surface has a meaning.
    pub fn velocity_along(&self, k: usize, p: DVec3) -> DVec3 {
        match &self.obstacles[k].surface_velocity {
            Some(velocity) => velocity(p, self.time),
            None => self.wall_velocity(k, p),
        }
    }

    /// The fields of all obstacles during the present step.
    pub fn fields(&self) -> impl Iterator<Item = &dyn Walls> {
        (0..self.obstacles.len()).map(|k| self.field(k))
    }

    /// The obstacles to which a point of a box may be nearer than the support radius.
    pub(super) fn fields_near(&self, over: &Aabb) -> impl Iterator<Item = &dyn Walls> {
        self.broad_phase.over(*over).map(|k| self.field(k))
    }

    /// The obstacles that may be nearer to a place than the support radius.
    fn fields_at(&self, p: DVec3) -> impl Iterator<Item = &dyn Walls> {
        self.broad_phase.at(p).map(|k| self.field(k))
    }

    /// Moves particles from `position` to `target`, and corrects target and velocity where they collide.
    /// What obstacles do to the particles is added to `contacts`, if given. `clear` holds for each particle
    /// its least distance from all obstacles, m, or [`UNKNOWN`]; it is empty if there are no obstacles.
    ///
    /// # Errors
    /// Returns the first particle, in the order of the arrays, at which a field is undefined or for which
    /// walls leave no room.
    pub fn collide(
        &self,
        position: &Vectors,
        target: &mut Vectors,
        velocity: &mut Vectors,
        clear: &mut [f64],
        contacts: Option<&Contacts>,
    ) -> Result<(), Fault> {
        self.hold(target, velocity);
        if self.obstacles.is_empty() {
            return Ok(());
        }
        let [tx, ty, tz] = target.components_mut().map(|c| c.par_chunks_mut(BLOCK));
        let [vx, vy, vz] = velocity.components_mut().map(|c| c.par_chunks_mut(BLOCK));
        let fault = tx
            .zip(ty)
            .zip(tz)
            .zip(vx.zip(vy).zip(vz))
            .zip(clear.par_chunks_mut(BLOCK))
            .enumerate()
            .filter_map(|(b, ((((x, y), z), ((u, v), w)), clear))| {
                let (target, velocity) = ([x, y, z], [u, v, w]);
                let mut block = Block { first: b * BLOCK, position, target, velocity, clear };
                self.collide_block(&mut block, contacts).err()
            })
            .min_by_key(|fault| fault.index);
        fault.map_or(Ok(()), Err)
    }

    /// Keeps all particles in the box.
    fn hold(&self, target: &mut Vectors, velocity: &mut Vectors) {
        let [tx, ty, tz] = target.components_mut().map(|c| c.par_chunks_mut(BLOCK));
        let [vx, vy, vz] = velocity.components_mut().map(|c| c.par_chunks_mut(BLOCK));
        tx.zip(ty).zip(tz).zip(vx.zip(vy).zip(vz)).for_each(|(((x, y), z), ((u, v), w))| {
            let sides = [&*x, &*y, &*z].map(bounds);
            let within = (0..3).all(|c| sides[c].0 >= self.domain.min[c] && sides[c].1 <= self.domain.max[c]);
            if within {
                return;
            }
            for k in 0..x.len() {
                let (at, velocity) =
                    self.hold_in_box(DVec3::new(x[k], y[k], z[k]), DVec3::new(u[k], v[k], w[k]));
                [x[k], y[k], z[k]] = at.to_array();
                [u[k], v[k], w[k]] = velocity.to_array();
            }
        });
    }

    /// Finds the blocks of [`MARKED`] particles of which one may be nearer than h to the box or an obstacle.
    /// Most blocks need no further test.
    pub fn mark(&self, position: &Vectors, h: f64, is_near: &mut Vec<bool>) {
        is_near.resize(position.len().div_ceil(MARKED), true);
        let [x, y, z] = position.components().map(|c| c.par_chunks(MARKED));
        x.zip(y).zip(z).zip(is_near).with_min_len(64).for_each(|(((x, y), z), is_near)| {
            let block = box_around([x, y, z]);
            let in_box = self.domain.union(&block.grown(h)) == self.domain;
            *is_near = !(in_box && self.fields_near(&block).all(|field| field.is_far(&block, h)));
        });
    }

    /// Prepares what is known for good of the obstacles near kernels with the support radius h, m: the maps of
    /// what they take, and which of them are near.
    pub fn map_obstacles(&mut self, h: f64) {
        let obstacles: Vec<_> = (self.obstacles.iter())
            .map(|obstacle| Mapped {
                field: &obstacle.field,
                motion: obstacle.moving.as_ref(),
                parts: &obstacle.parts,
                changing: obstacle.changing.as_ref(),
            })
            .collect();
        self.maps = Maps::new(&obstacles, &self.domain, h, self.time);
        let boxes = self.fields().zip(&self.obstacles);
        let boxes =
            boxes.map(|(field, obstacle)| (field.surroundings(&self.domain, h), obstacle.moving.is_none()));
        self.broad_phase = BroadPhase::new(self.domain, h, boxes);
    }

    /// The parts of the kernel of a particle that the box and the obstacles take; `None` if they are farther
    /// away than h.
    pub fn coverage<F: Friction, B: Behind>(&self, wall: &Wall, p: DVec3) -> Option<Coverage<F, B>> {
        let of_box = self.of_box::<F, B>(wall, p);
        if self.obstacles.is_empty() {
            return (of_box.part > 0.0).then_some(of_box);
        }
        let mut whole = of_box.without_friction();
        if let Some(taken) = self.maps.in_box(self.broad_phase.at(p), p) {
            let plain = Wall { layer: None, ..*wall };
            let continuous =
                if wall.layer.is_some() { self.of_box::<(), ()>(&plain, p) } else { whole.without_behind() };
            whole = whole.with_bodies(wall, &continuous, &taken);
        }
        let (none, nothing) = (Coverage::<(), B>::default(), Coverage::default());
        for k in self.broad_phase.at(p) {
            match self.maps.of(k, p) {
                Known::AtRest | Known::Changing | Known::Nothing => {}
                Known::Taken(taken) => {
                    let taken = taken.moving(self.field(k).wall_velocity(p));
                    whole = whole.or(&none.with_bodies(wall, &nothing, &taken));
                }
                Known::Parts(parts) => {
                    for (taken, velocity) in &parts {
                        whole = whole.or(&none.with_bodies(wall, &nothing, &taken.moving(*velocity)));
                    }
                }
                Known::ByFaces => whole = self.with_faces(wall, p, whole, k),
            }
        }
        if whole.part <= 0.0 {
            return None;
        }
        // friction is a matter of faces
        let friction = if F::IS_NONE {
            F::default()
        } else {
            let of_box = of_box.without_behind();
            self.broad_phase.at(p).fold(of_box, |whole, k| self.with_faces(wall, p, whole, k)).friction
        };
        Some(whole.with_friction(friction))
    }

    /// Whether the box is all that holds the fluid.
    pub fn is_box(&self) -> bool {
        self.obstacles.is_empty()
    }

    /// Whether nothing is as near as the reach, m, to two walls of the box that face each other.
    pub fn is_wide(&self, reach: f64) -> bool {
        self.domain.size().min_element() >= 2.0 * reach
    }

    /// Whether a face of an obstacle before a particle lies in a wall of the box and looks out of it. The
    /// obstacle is then assumed to continue behind that wall, as one that stands out of the box does. Neither
    /// end can be seen, and the room behind the wall would otherwise count as a notch in both.
    pub(super) fn ends_at_box(&self, p: DVec3, face: &Face, h: f64) -> bool {
        let axis = face.normal.abs().max_position();
        let outwards = face.normal[axis];
        let wall = if outwards > 0.0 { self.domain.max[axis] } else { self.domain.min[axis] };
        let foot = p[axis] - face.distance * outwards;
        let is_level = outwards.abs() > 1.0 - LEVEL && (face.mean_curvature * h).abs() < FLUSH;
        is_level && (foot - wall) * outwards.signum() > -FLUSH * h
    }

    /// Adds what an obstacle takes of the kernel of a particle by its faces.
    pub(super) fn with_faces<F: Friction, B: Behind>(
        &self,
        wall: &Wall,
        p: DVec3,
        whole: Coverage<F, B>,
        k: usize,
    ) -> Coverage<F, B> {
        let mut faces = Faces::new();
        self.field(k).faces(p, wall.h, &mut faces);
        if faces.is_empty() { whole } else { whole.or(&self.of_faces(wall, p, faces, k)) }
    }

    /// What faces of an obstacle near a particle take of its kernel.
    pub(super) fn of_faces<F: Friction, B: Behind>(
        &self,
        wall: &Wall,
        p: DVec3,
        mut faces: Faces,
        k: usize,
    ) -> Coverage<F, B> {
        let (obstacle, field) = (&self.obstacles[k], self.field(k));
        for part in &mut faces {
            if let Part::Face(face) = part
                && self.ends_at_box(p, face, wall.h)
            {
                face.distance = -BEYOND_REACH * wall.h;
            }
        }
        let mut coverage = Coverage::<F, B>::of_faces(wall, &faces);
        if obstacle.slip == Slip::Free {
            coverage.let_slip();
        }
        let motion = obstacle.moving.as_ref().map(|_| field.wall_velocity(p));
        if let Some(velocity) = motion {
            coverage.set_in_motion(velocity);
        }
        if !F::IS_NONE && obstacle.slip == Slip::No {
            let stated = obstacle.surface_velocity.as_ref().map(|velocity| velocity(p, self.time));
            if let Some(velocity) = stated.or(motion) {
                let turning = match wall.viscous_forces {
                    ViscousForces::AlongLines => DVec3::ZERO,
                    ViscousForces::WithSpin => self.turning(k, p, wall.h),
                };
                coverage.friction.take_along(velocity, turning);
            }
        }
        coverage
    }

    /// By how much an obstacle's surface turns near a place: half the curl of its velocity, 1/s. A body that changes
    /// its shape tells only its velocity across the surface, and half of its turning.
    pub fn turning(&self, k: usize, p: DVec3, h: f64) -> DVec3 {
        let step = TURNING_STEP * h;
        let velocity = self.velocity_along(k, p);
        let slope = |axis: DVec3| (self.velocity_along(k, p + step * axis) - velocity) / step;
        // a motion that has no slope at an edge turns nothing there
        let curl = DVec3::AXES.into_iter().map(|axis| axis.cross(slope(axis))).sum::<DVec3>();
        if curl.is_finite() { 0.5 * curl } else { DVec3::ZERO }
    }

    fn collide_block(&self, block: &mut Block<'_>, contacts: Option<&Contacts>) -> Result<(), Fault> {
        if block.stays_clear() {
            return Ok(());
        }
        let swept = block.swept();
        // if an obstacle moves, a ball that is free now may not be free in the next step
        let at_rest = self.all_at_rest();
        // maps of cells know nothing beyond the support radius, to which the reach is equal but for rounding
        let most = self.reach().min(self.broad_phase.h());
        if self.fields_near(&swept).all(|field| field.is_outside(&swept)) {
            if at_rest && self.fields_near(&swept).all(|field| field.is_far(&swept, most)) {
                block.clear.fill(SURELY * most);
            }
            return Ok(());
        }
        for k in 0..block.len() {
            if block.clear[k] >= 0.0 {
                continue;
            }
            let (from, to) = (block.from(k), block.target(k));
            let free =
                SURELY * self.fields_at(from).map(|field| field.clearance(from, most)).fold(most, f64::min);
            let left = free - from.distance(to);
            // a particle that does not move needs a proof as well: a wall may reach it
            if free > 0.0 && left >= 0.0 {
                block.clear[k] = if at_rest { left } else { UNKNOWN };
                continue;
            }
            let hit = |obstacle, change: DVec3, wall: DVec3, at| {
                if let Some(contacts) = contacts {
                    contacts.add(block.first + k, obstacle, [change, DVec3::ZERO], at);
                    contacts.add_work(block.first + k, change.dot(wall));
                }
            };
            let (at, velocity) = self
                .resolve(from, to, block.velocity(k), hit)
                .map_err(Trouble::from)
                .and_then(|end| self.leave_moving(from, end, hit))
                .map_err(|trouble| block.fault(k, trouble))?;
            // a point of a path may lie a rounding error beyond both of its ends
            block.put(k, at.clamp(self.domain.min, self.domain.max), velocity);
            block.clear[k] = UNKNOWN;
        }
        Ok(())
    }

    /// Clamps a particle to the box. The part of its velocity that points out of a crossed wall is reflected,
    /// with restitution and friction.
    pub(super) fn hold_in_box(&self, mut at: DVec3, mut velocity: DVec3) -> (DVec3, DVec3) {
        for axis in 0..3 {
            let (low, high) = (self.domain.min[axis], self.domain.max[axis]);
            let outward = if at[axis] < low {
                at[axis] = low;
                -velocity[axis]
            } else if at[axis] > high {
                at[axis] = high;
                velocity[axis]
            } else {
                continue;
            };
            if outward > 0.0 {
                let before = velocity;
                velocity[axis] *= -self.wall_restitution;
                let mut normal = DVec3::ZERO;
                normal[axis] = before[axis].signum();
                velocity = rubbed(before, velocity, normal, self.wall_friction);
            }
        }
        (at, velocity)
    }

    /// Whether no obstacle moves.
    pub(super) fn all_at_rest(&self) -> bool {
        self.obstacles.iter().all(|obstacle| obstacle.moving.is_none())
    }
}

/// The smallest box that holds some points, given by columns.
pub(super) fn box_around(points: [&[f64]; 3]) -> Aabb {
    let [x, y, z] = points.map(bounds);
    Aabb::new(DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1))
}

/// The smallest and the largest of some numbers.
fn bounds(values: &[f64]) -> (f64, f64) {
    // side by side, for vector instructions
    const LANES: usize = 8;
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    let mut take = |values: &[f64]| {
        for ((low, high), &value) in low.iter_mut().zip(&mut high).zip(values) {
            *low = if value < *low { value } else { *low };
            *high = if value > *high { value } else { *high };
        }
    };
    let (whole, rest) = values.as_chunks::<LANES>();
    whole.iter().for_each(|values| take(values));
    take(rest);
    (low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// The particles of a block: their positions, targets and velocities.
struct Block<'a> {
    first: usize,
    position: &'a Vectors,
    target: [&'a mut [f64]; 3],
    velocity: [&'a mut [f64]; 3],
    clear: &'a mut [f64],
}

impl Block<'_> {
    fn len(&self) -> usize {
        self.target[0].len()
    }

    /// The box around all paths of the block.
    fn swept(&self) -> Aabb {
        let own = self.first..self.first + self.len();
        let begin = self.position.components().map(|column| bounds(&column[own.clone()]));
        let end = self.target.each_ref().map(|column| bounds(column));
        let side = |pick: fn((f64, f64)) -> f64, join: fn(f64, f64) -> f64| {
            DVec3::from_array(std::array::from_fn(|c| join(pick(begin[c]), pick(end[c]))))
        };
        Aabb::new(side(|b| b.0, f64::min), side(|b| b.1, f64::max))
    }

    /// Subtracts the lengths of the paths from the clear distances. Returns whether all of them remain
    /// non-negative.
    fn stays_clear(&mut self) -> bool {
        let own = self.first..self.first + self.len();
        let [x, y, z] = self.position.components().map(|column| &column[own.clone()]);
        let [tx, ty, tz] = self.target.each_ref().map(|column| &column[..x.len()]);
        let clear = &mut self.clear[..x.len()];
        let mut lasts = true;
        for k in 0..x.len() {
            let (dx, dy, dz) = (tx[k] - x[k], ty[k] - y[k], tz[k] - z[k]);
            clear[k] -= (dx * dx + dy * dy + dz * dz).sqrt();
            lasts &= clear[k] >= 0.0;
        }
        lasts
    }

    fn from(&self, k: usize) -> DVec3 {
        self.position.get(self.first + k)
    }

    fn target(&self, k: usize) -> DVec3 {
        DVec3::from_array(self.target.each_ref().map(|c| c[k]))
    }

    fn velocity(&self, k: usize) -> DVec3 {
        DVec3::from_array(self.velocity.each_ref().map(|c| c[k]))
    }

    fn put(&mut self, k: usize, target: DVec3, velocity: DVec3) {
        for c in 0..3 {
            self.target[c][k] = target[c];
            self.velocity[c][k] = velocity[c];
        }
    }

    fn fault(&self, k: usize, trouble: Trouble) -> Fault {
        Fault { index: self.first + k, trouble }
    }
}
