//! The force of a fluid on an obstacle by its state alone: ∫ p n, and friction, over the pieces of its surface that the
//! fluid touches.
//!
//! It is near the truth in a fluid at rest, and is used where no step notes what walls do by pressure. In a jet on a
//! plate of eight spacings, pressures of particles at the wall oscillate. They are never negative, so their
//! mean is too large: this force was 1.8 times the loss of the jet's momentum.
//!
//! The pressure of a piece is the mean of the particles in front of it, each continued to the piece by the balance
//! of the fluid, ∇p = ρ(g − a), with the weights V·W (Shepard 1968). So a pressure that is linear in space gives its
//! exact force, whatever the shape of the obstacle. (Sums over particles with ∇λ as the surface have a weight of ½
//! only in front of a plane: on a ball of five spacings the buoyancy came out 11 % too large, and on a cube it
//! depended on where the lattice lay.) Viscosity has its own part in a, which steps note for particles near walls.
//!
//! Friction is noted by each step too. Before the first step it is µ·v/d, the slope of the velocity towards the wall.
//! (In the narrow gap between a ball and a bowl this slope is a mean over a curved profile: the torque was 3 % too
//! small with five spacings from wall to wall, and 9 % with kernels of three spacings.)

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    geom::Aabb,
    sph::{core::Core, scales::Slip},
};

use super::{
    MOST_COVERED, Weight,
    surface::{Piece, Pieces},
};

/// Particles farther behind the plane of a piece than this part of the spacing lie on another side.
const BEHIND: f64 = 0.1;

/// A kernel that is filled less than this, in front of a piece and outside walls, counts as filled to this
/// part with a fluid without pressure: the surface of the fluid, and spray.
const FILLED: f64 = 0.5;

/// A particle nearer than this part of the support radius counts as that far away for the slope of a velocity.
const NEAREST: f64 = 0.1;

/// Turns a force and its moment about the origin into the force and its moment about a point.
pub fn about([x, y, z, u, v, w]: [f64; 6], point: DVec3) -> [f64; 6] {
    let force = DVec3::new(x, y, z);
    let moment = DVec3::new(u, v, w) - point.cross(force);
    [x, y, z, moment.x, moment.y, moment.z]
}

/// Force, N, and torque about a point, N·m, on an obstacle by pressure, and if asked by friction where the fluid
/// sticks to it. Zero for methods without pressure at walls.
pub fn on_surface(core: &Core, obstacle: usize, point: DVec3, with_friction: bool) -> [f64; 6] {
    if !core.parameters.walls_have_density() {
        return [0.0; 6];
    }
    let cells = Cells::of(core);
    let wetted: Vec<[i32; 3]> = cells.wetted().into_iter().collect();
    let wetting = Wetting { core, cells: &cells, weight: Weight::of(core), obstacle, with_friction };
    let forces: Vec<(DVec3, DVec3)> = wetted.par_iter().map(|cell| wetting.on_cell(*cell, point)).collect();
    // one after the other: the same bits for any number of threads
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (push, turn) in forces {
        force += push;
        torque += turn;
    }
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// The box in cells that are not smaller than the support radius, with the particles in each.
struct Cells {
    domain: Aabb,
    size: DVec3,
    counts: [i32; 3],
    particles: BTreeMap<[i32; 3], Vec<usize>>,
}

impl Cells {
    fn of(core: &Core) -> Self {
        let (domain, h) = (core.boundary.domain, core.parameters.support_radius);
        // cells beyond what a counter holds are larger
        let counts = (domain.size() / h).to_array().map(|n| n.floor().clamp(1.0, f64::from(i32::MAX / 2)));
        let size = domain.size() / DVec3::from_array(counts);
        let counts = counts.map(|n| n as i32);
        let mut particles: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
        for (i, position) in core.particles.position.iter().enumerate() {
            let cell = ((position - domain.min) / size).floor().to_array();
            let cell = std::array::from_fn(|k| (cell[k] as i32).clamp(0, counts[k] - 1));
            particles.entry(cell).or_default().push(i);
        }
        Self { domain, size, counts, particles }
    }

    /// A cell and those that touch it.
    fn around(&self, [i, j, k]: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
        let counts = self.counts;
        (0..27)
            .map(move |n| [i + n % 3 - 1, j + n / 3 % 3 - 1, k + n / 9 - 1])
            .filter(move |cell| (0..3).all(|axis| (0..counts[axis]).contains(&cell[axis])))
    }

    /// The cells within reach of a particle.
    fn wetted(&self) -> BTreeSet<[i32; 3]> {
        self.particles.keys().flat_map(|cell| self.around(*cell)).collect()
    }

    fn bounds(&self, cell: [i32; 3]) -> Aabb {
        let corner = |cell: [i32; 3]| self.domain.min + self.size * DVec3::from_array(cell.map(f64::from));
        Aabb::new(corner(cell), corner(cell.map(|n| n + 1)))
    }
}

/// An obstacle and the fluid around it.
struct Wetting<'a> {
    core: &'a Core,
    cells: &'a Cells,
    weight: Weight,
    obstacle: usize,
    with_friction: bool,
}

/// What the fluid in front of a piece does to it.
#[derive(Default)]
struct InFront {
    /// Σ V·W.
    filled: f64,
    /// Σ V·W·p, Pa, continued to the piece.
    pressure: f64,
    /// Σ V·W·v/d, 1/s, along the wall.
    shear: DVec3,
}

impl Wetting<'_> {
    /// Force and torque on the surface in a cell.
    fn on_cell(&self, cell: [i32; 3], point: DVec3) -> (DVec3, DVec3) {
        let spacing = self.core.parameters.spacing();
        let field = self.core.boundary.field(self.obstacle);
        let mut pieces = Pieces { field, spacing, found: Vec::new() };
        pieces.find(self.cells.bounds(cell));
        let near: Vec<usize> = self
            .cells
            .around(cell)
            .filter_map(|cell| self.cells.particles.get(&cell))
            .flat_map(|particles| particles.iter().copied())
            .collect();
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for piece in &pieces.found {
            let push = self.on_piece(piece, &near);
            force += push;
            torque += (piece.at - point).cross(push);
        }
        (force, torque)
    }

    fn on_piece(&self, piece: &Piece, near: &[usize]) -> DVec3 {
        let Some(normal) = piece.area.try_normalize() else { return DVec3::ZERO };
        let found = self.in_front(piece, normal, near);
        if found.filled == 0.0 || self.is_covered(piece, normal) {
            return DVec3::ZERO;
        }
        let covered =
            self.core.boundary.coverage::<(), ()>(self.core.wall(), piece.at).map_or(0.0, |c| c.part);
        let filled = found.filled.max(FILLED * (1.0 - covered.min(MOST_COVERED)));
        let viscosity = self.core.parameters.viscosity;
        (-found.pressure * piece.area + viscosity * piece.area.length() * found.shear) / filled
    }

    fn in_front(&self, piece: &Piece, normal: DVec3, near: &[usize]) -> InFront {
        let Core { parameters, particles, .. } = self.core;
        let (h, mass) = (parameters.support_radius, parameters.particle_mass);
        let behind = BEHIND * parameters.spacing();
        let body = &self.core.boundary.obstacles[self.obstacle];
        let sticks = self.with_friction && body.slip == Slip::No && parameters.viscosity > 0.0;
        let contacts = self.core.contacts.as_ref();
        let mut found = InFront::default();
        for &i in near {
            let x = particles.position.get(i);
            let away = x - piece.at;
            let (r2, distance) = (away.length_squared(), away.dot(normal));
            if r2 >= h * h || distance < -behind {
                continue;
            }
            let density = particles.density[i];
            let weight = mass / density * self.weight.at(r2);
            let pressure = particles.pressure[i];
            // a method that solves for its pressure knows none before the first step
            let is_known = self.core.steps > 0 || pressure != 0.0;
            let drag = contacts.map_or(DVec3::ZERO, |contacts| contacts.drag(i));
            let by_pressure = self.core.acceleration.get(i) - self.core.gravity(i) - drag;
            found.filled += weight;
            found.pressure +=
                weight * if is_known { pressure + density * by_pressure.dot(away) } else { 0.0 };
            if sticks {
                let wall = self.core.boundary.velocity_along(self.obstacle, x);
                let velocity = particles.velocity.get(i) - wall;
                let along = velocity - velocity.dot(normal) * normal;
                found.shear += weight / distance.max(NEAREST * h) * along;
            }
        }
        found
    }

    /// Whether another obstacle lies on the piece.
    fn is_covered(&self, piece: &Piece, normal: DVec3) -> bool {
        let front = piece.at + 0.01 * self.core.parameters.spacing() * normal;
        let boundary = &self.core.boundary;
        (0..boundary.obstacles.len()).any(|k| k != self.obstacle && boundary.field(k).omega(front) >= 0.0)
    }
}
