//! The audit of a simulation: what its energy, its volume, its densities, its speed and the distances of its particles
//! say about whether it can be believed. It runs in every simulation and changes nothing in it.
//!
//! Energy is compared with the work of gravity and of walls after every step: E = ½Σmv² + Σm·e(ρ) − W. The
//! work of uniform gravity is M·g·Δ(centre of mass), and that of a field of gravity is the integral of its
//! power. Where a method's velocities are those of the middle of a step, only half of what the field does in
//! it is set against them. The work of walls which move is the sum of force times way over what they do to
//! particles in pressure, friction and contacts. Viscosity, contacts with walls at rest and diffusion only
//! take from E, so all that it gains is an error of the method. Where walls work on the fluid, what they give
//! is soon dissipated, and would hide any gain: there E is compared with the least that it has been. Of methods
//! that know this work roughly, a tenth of it is taken for an error. The energy that a surface under tension
//! has at the start may become motion, so it is allowed for, less what no surface of the fluid can be without.
//!
//! Densities are those that the particles' places say, Σ m·W and the part of the walls, and not those that a
//! method carries along. A density below that at rest belongs to the surface and counts as that at rest.
//!
//! Invariant: sums run in a fixed order, so the same state gives the same bits for any number of threads.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

mod compression;
mod memory;
mod rows;

pub use compression::Compression;
use rows::Rows;

use super::core::Core;
use super::error::StepError;
use super::methods::Noted;
use super::params::Parameters;
use super::particles::CHUNK;
use crate::geom::{Aabb, significant};

/// The least energy at the start that is judged, in units of Σm·(expected speed)².
const LEAST_ENERGY: f64 = 1e-9;

/// The least energy with which what walls give is compared, in units of Σm·(expected speed)²: that of a
/// thirtieth of this speed. A fluid that they set in motion begins with none.
const LEAST_GIVEN: f64 = 5e-4;

/// Why the energy is no longer judged after a wall had no finite velocity.
pub const UNDEFINED_WORK: &str = "the velocity of a moving wall has no finite value";

/// Number of steps from one look at the densities to the next.
const LOOK: u64 = 8;

/// An excess of energy above this part of the reference is a finding.
const MOST_EXCESS: f64 = 0.01;

/// An excess of energy above this part of the greatest energy of motion is a finding too: nearly all energy
/// of a low wave in deep water is that of the depth, which cannot move.
const MOST_OF_MOTION: f64 = 0.25;

/// By this measure, only an excess above this part of the reference is a finding: water that comes to rest
/// hardly moves.
const LEAST_EXCESS: f64 = 0.002;

/// The energy of motion, as a part of the reference, below which waves are not said to have grown. Water at
/// rest has less, and what it gains as its particles leave their lattice has nothing to do with motion.
const LEAST_MOTION: f64 = 1e-3;

/// An excess of energy, as a part of the reference, that ends a run.
const RUINOUS_EXCESS: f64 = 1.0;

/// Where walls move, as many looks one after the other must find such an excess: walls that begin to move have given
/// next to nothing.
const RUINOUS_LOOKS: u32 = 8;

/// A change of the volume above this part of it is a finding.
const MOST_VOLUME_CHANGE: f64 = 0.02;

/// A mean compression above this is a finding, in units of the one that the method is to keep.
const MOST_COMPRESSION: f64 = 10.0;

/// Particles faster than this part of the speed of sound count as a gas. The tips of splashes reach a fifth to a quarter of
/// it, if it is derived.
const MOST_MACH: f64 = 0.4;

/// More of them than this part of all are a finding.
const MOST_TOO_FAST: f64 = 1e-3;

/// The error of the work of walls with methods that know it roughly, as a part of it.
const ROUGHNESS: f64 = 0.1;

/// Where this work is known roughly, it jumps from step to step as well: beside a blade that turns fast in a tank of
/// 500 particles, by up to 1 % of the energy. There an excess above this part of the reference is a finding.
const MOST_ROUGH_EXCESS: f64 = 0.05;

/// Why the energy is not judged of a fluid at rest without gravity.
pub const NO_ENERGY: &str = "the fluid has no energy at the start to compare with";

/// What the audit of a simulation has found so far. All figures are the worst since the start.
#[derive(Debug, Clone, PartialEq)]
pub struct Audit {
    /// Why the energy is not judged; `None` if it is.
    unjudged: Option<&'static str>,
    /// The energy that excesses are compared with, J: the greatest since the start, from the box's lowest corner.
    reference: f64,
    /// The part of that at the start which is due to the fluid's height, J.
    height: f64,
    /// Kinetic and elastic energy at the start, and what a surface under tension may release, J.
    at_start: f64,
    /// Work of gravity and of walls since the start, J.
    work: f64,
    /// Work of walls since the start, J.
    by_walls: f64,
    /// The least that the energy has been, J, without what was at the start and the work since.
    least: f64,
    /// Work of walls since the last look, J.
    given: f64,
    /// The reference at the start, and the amounts of the work of walls from look to look, J.
    supplied: f64,
    /// The number of looks, one after the other, at which as much energy had come from nowhere.
    ruinous_looks: u32,
    /// What the errors of roughly known work may have added to the energy since it was least, J.
    allowed: f64,
    /// The mean of what it is so since the last look, J.
    gained: f64,
    /// Whether walls move.
    is_moved: bool,
    /// Whether the work of walls is known roughly.
    is_rough: bool,
    /// The power of a field of gravity at the last step, W.
    power: f64,
    /// Sum of the places at the last step, m.
    places: DVec3,
    excess: f64,
    /// The greatest energy of motion so far, J.
    liveliest: f64,
    /// Mean of ρ₀/max(ρ, ρ₀) at the start.
    volume_at_start: f64,
    /// The change of the volume that is largest by its amount.
    volume_change: f64,
    compression: Compression,
    rows: Rows,
    max_speed: f64,
    /// The greatest part of the particles that was faster at once than [`MOST_MACH`], as seen from the mean velocity.
    too_fast: f64,
    /// The figures of the last look.
    now: Instant,
    /// Which findings have been reported, in the order of [`Finding::ALL`].
    told: [bool; 5],
}

/// The figures of one look.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Instant {
    excess: f64,
    volume_change: f64,
    compression: Compression,
    speed: f64,
}

/// Something about a run that its user must know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// The energy exceeds that at the start by more than gravity's work.
    Energy,
    /// The fluid lost volume.
    Volume,
    /// The fluid is compressed far more than the method is to allow.
    Compression,
    /// The fluid is as fast as a gas, for its speed of sound.
    Speed,
    /// Particles came closer to each other than sums over neighbours are made for.
    Rows,
}

impl Finding {
    const ALL: [Self; 5] = [Self::Energy, Self::Volume, Self::Compression, Self::Speed, Self::Rows];
}

/// A sum over all particles at one instant.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    squares: f64,
    places: DVec3,
    elastic: f64,
    /// Power of a field of gravity at the present places, and where particles with their velocities were a
    /// step ago, W/kg.
    power: f64,
    power_before: f64,
    /// Sum of what the field pulls with, m/s².
    pull: f64,
    fastest: f64,
    /// Number of particles faster than [`MOST_MACH`].
    too_fast: usize,
}

impl Sums {
    /// The sums after a step of the length `dt`, s.
    fn of(core: &Core, dt: f64) -> Self {
        let (method, scales) = (core.parameters.method.numerics(), core.parameters.scales());
        let is_staggered = method.is_staggered();
        let limit = greatest_speed(&core.parameters).map_or(f64::INFINITY, |speed| speed.powi(2));
        // what all of the fluid does compresses nothing
        let of_all = if limit.is_finite() { core.particles.velocity.mean() } else { DVec3::ZERO };
        let position = core.particles.position.components().map(|c| c.par_chunks(CHUNK));
        let velocity = core.particles.velocity.components().map(|c| c.par_chunks(CHUNK));
        let [x, y, z] = position;
        let [u, v, w] = velocity;
        let density = core.particles.density.par_chunks(CHUNK);
        let sums: Vec<Self> = x
            .zip(y)
            .zip(z)
            .zip(u.zip(v).zip(w))
            .zip(density)
            .map(|((((x, y), z), ((u, v), w)), density)| {
                let mut sums = Self::default();
                for k in 0..x.len() {
                    let square = u[k] * u[k] + v[k] * v[k] + w[k] * w[k];
                    sums.squares += square;
                    sums.fastest = sums.fastest.max(square);
                    let relative = (DVec3::new(u[k], v[k], w[k]) - of_all).length_squared();
                    sums.too_fast += usize::from(relative > limit);
                    sums.places += DVec3::new(x[k], y[k], z[k]);
                }
                sums.elastic = method.elastic_energies(&scales, density);
                if let Some(field) = &core.gravity_field {
                    for k in 0..x.len() {
                        let (place, velocity) = (DVec3::new(x[k], y[k], z[k]), DVec3::new(u[k], v[k], w[k]));
                        let pull = field(place, core.time);
                        sums.power += pull.dot(velocity);
                        sums.pull += pull.length();
                        if is_staggered {
                            sums.power_before += field(place - dt * velocity, core.time - dt).dot(velocity);
                        }
                    }
                }
                sums
            })
            .collect();
        let add = |a: Self, b: Self| Self {
            squares: a.squares + b.squares,
            places: a.places + b.places,
            elastic: a.elastic + b.elastic,
            power: a.power + b.power,
            power_before: a.power_before + b.power_before,
            pull: a.pull + b.pull,
            fastest: a.fastest.max(b.fastest),
            too_fast: a.too_fast + b.too_fast,
        };
        let sum = sums.into_iter().fold(Self::default(), add);
        Self { fastest: sum.fastest.sqrt(), ..sum }
    }
}

impl Audit {
    /// The audit of a simulation at its start. `densities` are those that the particles' places say, kg/m³.
    pub(super) fn start(core: &Core, densities: &[f64]) -> Self {
        let sums = Sums::of(core, 0.0);
        let Core { parameters, boundary, particles, .. } = core;
        let (mass, n) = (parameters.particle_mass, particles.len() as f64);
        let own = mass * (0.5 * sums.squares + sums.elastic);
        let surface = surface_energy(parameters, densities);
        let height = height(core, &sums);
        let scale = n * mass * parameters.expected_speed.powi(2);
        let is_moved = boundary.any_moves();
        let reference = if is_moved { LEAST_GIVEN * scale } else { 0.0f64 }.max(own + surface + height);
        let unjudged = (!is_moved && reference <= LEAST_ENERGY * scale).then_some(NO_ENERGY);
        let (compression, volume) = Compression::of(densities, parameters.rest_density);
        Self {
            unjudged,
            reference,
            height,
            at_start: own + released(core, surface),
            work: 0.0,
            by_walls: 0.0,
            least: 0.0,
            given: 0.0,
            supplied: reference,
            ruinous_looks: 0,
            allowed: 0.0,
            gained: 0.0,
            is_moved,
            is_rough: parameters.method.numerics().noted() == Noted::Friction,
            power: mass * sums.power,
            places: sums.places,
            excess: 0.0,
            liveliest: 0.5 * mass * sums.squares,
            volume_at_start: volume,
            volume_change: 0.0,
            compression,
            rows: Rows::start(core),
            max_speed: sums.fastest,
            too_fast: sums.too_fast as f64 / n,
            now: Instant { compression, speed: sums.fastest, ..Instant::default() },
            told: [false; 5],
        }
    }

    /// Takes the figures of the state after a step of the length `dt`, s, in which walls did this work, J.
    /// `densities` are those that the particles' places say, kg/m³.
    ///
    /// # Errors
    /// [`StepError::EnergyDoubled`] if the energy has doubled without work.
    pub(super) fn look(
        &mut self,
        core: &Core,
        densities: &[f64],
        dt: f64,
        by_walls: f64,
    ) -> Result<(), StepError> {
        let sums = Sums::of(core, dt);
        let parameters = &core.parameters;
        let mass = parameters.particle_mass;
        let is_staggered = parameters.method.numerics().is_staggered();
        let power = mass * sums.power;
        let before = if is_staggered { mass * sums.power_before } else { self.power };
        let by_fall = mass * parameters.gravity.dot(sums.places - self.places);
        let by_gravity = by_fall + 0.5 * dt * (before + power);
        // the part of it that the velocities do not show yet
        let to_come = match (is_staggered, self.is_moved) {
            // in a sealed vessel walls bear the weight in the same step
            (true, true) if parameters.is_sealed => 0.5 * dt * power,
            // the work of walls is that up to the middle of the step, and what they carry has moved to its end
            (true, true) => 0.5 * (by_fall + dt * power),
            (true, false) => 0.5 * dt * power,
            (false, _) => 0.0,
        };
        if by_walls.is_finite() {
            self.work += by_gravity + by_walls;
            self.by_walls += by_walls;
            self.given += by_walls;
        } else {
            self.unjudged = Some(UNDEFINED_WORK);
        }
        (self.places, self.power) = (sums.places, power);
        self.liveliest = self.liveliest.max(0.5 * mass * sums.squares);
        (self.now.speed, self.max_speed) = (sums.fastest, self.max_speed.max(sums.fastest));
        self.too_fast = self.too_fast.max(sums.too_fast as f64 / core.particles.len() as f64);
        if self.unjudged.is_none() {
            let energy = mass * (0.5 * sums.squares + sums.elastic);
            let gained = energy - self.at_start - (self.work - to_come);
            if self.is_moved {
                let height = self.height - (self.work - self.by_walls);
                self.reference = self.reference.max(energy + height);
                self.gained += gained / LOOK as f64;
                if core.steps.is_multiple_of(LOOK) {
                    let by_nothing = self.look_at_gain(parameters.surface_tension).unwrap_or(0.0);
                    let is_ruinous = by_nothing > RUINOUS_EXCESS;
                    self.ruinous_looks = if is_ruinous { self.ruinous_looks + 1 } else { 0 };
                    if self.ruinous_looks >= RUINOUS_LOOKS {
                        return Err(core.energy_doubled(by_nothing, true));
                    }
                }
            } else {
                // gravity that turns may bring in more than there was, and one that grows makes a depth worth more
                self.reference = self.reference.max(self.at_start + self.work);
                if core.turning_gravity.is_some() || core.gravity_field.is_some() {
                    self.reference = self.reference.max(height(core, &sums));
                }
                let excess = gained / self.reference;
                (self.now.excess, self.excess) = (excess, self.excess.max(excess));
                if excess > RUINOUS_EXCESS {
                    return Err(core.energy_doubled(excess, false));
                }
            }
        }
        if core.steps.is_multiple_of(LOOK) {
            let (compression, volume) = Compression::of(densities, parameters.rest_density);
            self.compression = self.compression.worst(compression);
            let change = volume / self.volume_at_start - 1.0;
            (self.now.compression, self.now.volume_change) = (compression, change);
            if change.abs() > self.volume_change.abs() {
                self.volume_change = change;
            }
        }
        self.rows.look(core);
        Ok(())
    }

    /// Judges the mean gain of the last steps where walls move. Their work is found for several steps at a
    /// time, and its errors add up over a long run: so that they are no reason to end it, what came from nowhere is
    /// compared with all the energy that walls have moved. Returns it as a part of that and of the energy at the start;
    /// `None` while there is neither.
    fn look_at_gain(&mut self, surface_tension: f64) -> Option<f64> {
        let (gained, given) = (std::mem::take(&mut self.gained), std::mem::take(&mut self.given));
        if self.is_rough {
            self.allowed += ROUGHNESS * given.abs();
        }
        // of a surface under tension only what it has at the start is known, so it may have been the least
        if surface_tension == 0.0 && gained <= self.least + self.allowed {
            (self.least, self.allowed) = (gained, 0.0);
        }
        let by_nothing = gained - self.least - self.allowed;
        let excess = by_nothing / self.reference;
        (self.now.excess, self.excess) = (excess, self.excess.max(excess));
        self.supplied += given.abs();
        // a gravity that turns brings in more than the height at the start
        let supplied = self.supplied + (self.work - self.by_walls - self.height).max(0.0);
        (supplied > 0.0).then(|| by_nothing / supplied)
    }

    /// The greatest excess of the energy over that at the start and the work of gravity and walls, as a part
    /// of the greatest energy so far; where walls work on the fluid, over the least that it has been. `None`
    /// if it is not judged, see [`Audit::unjudged`].
    pub fn energy_excess(&self) -> Option<f64> {
        self.unjudged.is_none().then_some(self.excess)
    }

    /// The work of walls that move on the fluid, J; `None` if the energy is not judged.
    pub fn wall_work(&self) -> Option<f64> {
        self.unjudged.is_none().then_some(self.by_walls)
    }

    /// Whether the work of walls is known to a tenth only, so that as much of it is allowed for.
    pub fn work_is_rough(&self) -> bool {
        self.is_rough
    }

    /// Why the energy is not judged; `None` if it is.
    pub fn unjudged(&self) -> Option<&'static str> {
        self.unjudged
    }

    /// The greatest change of the fluid's volume, as a part of that at the start; below zero if it shrinks.
    /// Where there is less fluid than at rest, the volume is that at rest: a splash is no gain.
    pub fn volume_change(&self) -> f64 {
        self.volume_change
    }

    /// The worst compression by the places of the particles. Each figure is the worst of its own instant.
    pub fn compression(&self) -> Compression {
        self.compression
    }

    /// The greatest part of the particles, beyond that at the start, that were closer to another one than half a spacing.
    pub fn crowded(&self) -> f64 {
        self.rows.most - self.rows.at_start
    }

    /// The greatest speed of a particle after any step, m/s.
    pub fn max_speed(&self) -> f64 {
        self.max_speed
    }

    /// The greatest speed of a particle after the last step, m/s.
    pub(super) fn speed(&self) -> f64 {
        self.now.speed
    }

    /// The present figures of the columns of [`Probe::Audit`](super::Probe::Audit). The excess is NaN if it is
    /// not judged.
    pub(super) fn sample(&self) -> Vec<f64> {
        let Instant { excess, volume_change, compression: Compression { mean, p99, largest }, speed } =
            self.now;
        let excess = if self.unjudged.is_none() { excess } else { f64::NAN };
        vec![excess, volume_change, mean, p99, largest, speed]
    }

    /// What a user must know about the run so far, each finding with a sentence.
    pub(super) fn findings(&self, parameters: &Parameters) -> Vec<(Finding, String)> {
        let kept = parameters.kept_compression();
        let percent = |x: f64| 100.0 * x;
        let energy = self.energy_excess().and_then(|excess| {
            let gained = excess * self.reference;
            let is_more = gained > MOST_OF_MOTION * self.liveliest;
            let has_moved = self.liveliest > LEAST_MOTION * self.reference;
            let outgrows_motion = !self.is_moved && has_moved && excess > LEAST_EXCESS && is_more;
            let of_all = percent(excess);
            let most = if self.is_moved && self.is_rough { MOST_ROUGH_EXCESS } else { MOST_EXCESS };
            match (excess > most, self.is_moved) {
                (true, true) => Some(format!(
                    "the energy rose by {of_all:.1} % of the greatest so far, with no work to explain it"
                )),
                (true, false) => {
                    Some(format!("the energy was {of_all:.1} % above that at the start and gravity's work"))
                }
                (false, _) if outgrows_motion => {
                    let part = if gained > self.liveliest {
                        "more than the".to_string()
                    } else {
                        format!("{:.0} % of the", percent(gained / self.liveliest))
                    };
                    Some(format!(
                        "the energy was {of_all:.1} % above that at the start and gravity's work, which is {part} \
                         greatest energy of motion: waves may have grown by it"
                    ))
                }
                (false, _) => None,
            }
        });
        let change = self.volume_change;
        let volume = (change.abs() > MOST_VOLUME_CHANGE).then(|| {
            let verb = if change < 0.0 { "shrank" } else { "grew" };
            format!("the fluid's volume {verb} by {:.1} %", percent(change.abs()))
        });
        let Compression { mean, p99, .. } = self.compression;
        let compression = kept.filter(|kept| mean > MOST_COMPRESSION * kept).map(|kept| {
            format!(
                "the fluid was compressed by {:.2} % on average, and by more than {:.1} % at one particle in a \
                 hundred; the method is to keep it within {:.2} %",
                percent(mean),
                percent(p99),
                percent(kept)
            )
        });
        Finding::ALL
            .into_iter()
            .zip([energy, volume, compression, self.gas(parameters), self.rows.finding()])
            .filter_map(|(f, t)| Some((f, t?)))
            .collect()
    }

    /// The sentence about a fluid that is as fast as a gas.
    fn gas(&self, parameters: &Parameters) -> Option<String> {
        (self.too_fast > MOST_TOO_FAST).then(|| {
            let (sound, speed) = (significant(parameters.sound_speed()), significant(self.max_speed));
            let derived = if parameters.states_sound_speed() { "" } else { " derived" };
            let wanted = format!("{:.1e}", 10.0 * self.max_speed);
            let wanted: f64 = wanted.parse().unwrap_or(10.0 * self.max_speed);
            // one that is too low for what was foreseen is the cause of what was not
            let stated = parameters.stated_sound();
            let advice = match stated.is_some_and(|stated| stated.sound_speed < 10.0 * stated.driven_speed) {
                true => "leave `sound_speed` out".to_string(),
                false => format!("state `sound_speed: {wanted} m/s`"),
            };
            format!(
                "the fluid reached {speed} m/s, with a{derived} speed of sound of {sound} m/s: there it is a gas, and its \
                 forces are not those of a liquid; {advice}"
            )
        })
    }

    /// Returns the findings that were not reported before, and marks them as reported.
    pub(super) fn news(&mut self, parameters: &Parameters) -> Vec<(Finding, String)> {
        let found = self.findings(parameters);
        found
            .into_iter()
            .filter(|(finding, _)| !std::mem::replace(&mut self.told[*finding as usize], true))
            .collect()
    }
}

/// The speed above which the fluid is a gas, m/s; `None` if the method does not stand for a liquid by its sound: one that keeps
/// its density has none, and the one whose walls have no density, the paper's, is far from a liquid anyway.
fn greatest_speed(parameters: &Parameters) -> Option<f64> {
    let is_weakly_compressible = parameters.walls_have_density() && !parameters.keeps_density();
    is_weakly_compressible.then(|| MOST_MACH * parameters.sound_speed())
}

/// The energy of a fluid's height, J: that of its fall to the lowest corner of the box. A field of gravity
/// has no lowest corner; a fall by the support radius is its scale.
fn height(core: &Core, sums: &Sums) -> f64 {
    let Core { parameters, boundary, particles, .. } = core;
    let g = parameters.gravity;
    let floor = boundary.domain.corners().map(|c| -g.dot(c)).into_iter().fold(f64::INFINITY, f64::min);
    let of_field = parameters.support_radius * sums.pull;
    parameters.particle_mass * (-g.dot(sums.places) - particles.len() as f64 * floor + of_field)
}

/// Energy of the surface under tension, J: the tension times an area. Each particle below a flat surface lacks
/// a part of its density; a surface lacks as much as a wall in its place would have.
fn surface_energy(parameters: &Parameters, densities: &[f64]) -> f64 {
    if parameters.surface_tension == 0.0 {
        return 0.0;
    }
    let lacking: f64 = densities.iter().map(|rho| (1.0 - rho / parameters.rest_density).max(0.0)).sum();
    let wall = parameters.method.numerics().wall(&parameters.scales());
    let spacing = parameters.spacing();
    let layers = (wall.h / spacing).ceil() as u32;
    let of_column: f64 =
        (0..layers).map(|k| wall.kernel.covered((f64::from(k) + 0.5) * spacing / wall.h)).sum();
    parameters.surface_tension * spacing.powi(2) * lacking / of_column
}

/// What the tension of a surface with this energy, J, can set free: beside obstacles all of it, as far as is known; in
/// a box alone what it has, and may have more than is found, beyond the energy of the smallest surface that the fluid
/// may have.
fn released(core: &Core, surface: f64) -> f64 {
    let Core { parameters, boundary, particles, .. } = core;
    if !boundary.is_box() {
        return surface;
    }
    let fluid = particles.len() as f64 * parameters.particle_mass / parameters.rest_density;
    let least = parameters.surface_tension * least_area(&boundary.domain, fluid);
    (UNSURE_AREA * surface - least).max(0.0)
}

/// By how much a surface may have more area than is found of it.
const UNSURE_AREA: f64 = 1.1;

/// The smallest surface, m², of a fluid of this volume, m³, in a box whose walls it meets at a right angle: an eighth
/// of a sphere in a corner, a quarter of a cylinder along an edge, or a plane, with the fluid or the air inside.
fn least_area(within: &Aabb, fluid: f64) -> f64 {
    let sides = within.size();
    let inside = fluid.min(within.volume() - fluid).max(0.0);
    let sphere = 0.5 * PI * (6.0 * inside / PI).powf(2.0 / 3.0);
    let edge = (PI * inside * sides.min_element()).sqrt();
    sphere.min(edge).min(within.volume() / sides.max_element())
}

#[cfg(test)]
mod tests;
