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

use std::collections::{BTreeMap, BTreeSet, HashMap};

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

/// The most cells and pieces that are kept, of some 60 bytes each, and how many cells are added at a time; what a larger
/// surface has besides is found each time.
const MOST_KEPT: usize = 1 << 20;
const CELLS_AT_ONCE: usize = 512;

/// A particle nearer than this part of the support radius counts as that far away for the slope of a velocity.
const NEAREST: f64 = 0.1;

/// Turns a force and its moment about the origin into the force and its moment about a point.
pub fn about([x, y, z, u, v, w]: [f64; 6], point: DVec3) -> [f64; 6] {
    let force = DVec3::new(x, y, z);
    let moment = DVec3::new(u, v, w) - point.cross(force);
    [x, y, z, moment.x, moment.y, moment.z]
}

/// Force, N, and torque about a point, N·m, on an obstacle by pressure, and if asked by friction where the fluid
/// sticks to it. Zero for methods without pressure at walls. The pieces of an obstacle at rest are kept for the next
/// time.
pub fn on_surface(
    core: &Core,
    obstacle: usize,
    point: DVec3,
    with_friction: bool,
    kept: &mut KeptPieces,
) -> [f64; 6] {
    if !core.parameters.walls_have_density() {
        return [0.0; 6];
    }
    let cells = Cells::of(core);
    let wetted: Vec<[i32; 3]> = cells.wetted().into_iter().collect();
    let all_rest = core.boundary.obstacles.iter().all(|obstacle| obstacle.moving.is_none());
    let wetting =
        Wetting { core, cells: &cells, weight: Weight::of(core), obstacle, with_friction, all_rest };
    kept.add(&wetting, &wetted);
    let on_cell = |cell: &[i32; 3]| match kept.cells.get(cell) {
        Some(pieces) => wetting.on_cell(*cell, pieces, point),
        None => wetting.on_cell(*cell, &wetting.pieces(*cell), point),
    };
    let forces: Vec<(DVec3, DVec3)> = wetted.par_iter().map(on_cell).collect();
    // one after the other: the same bits for any number of threads
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (push, turn) in forces {
        force += push;
        torque += turn;
    }
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// The pieces of the surface of an obstacle at rest, by the cells that were wetted so far. To cut them takes as long as
/// some ten steps.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct KeptPieces {
    cells: HashMap<[i32; 3], Vec<WallPiece>>,
    /// The number of cells and pieces.
    count: usize,
}

impl KeptPieces {
    /// Adds the pieces in the cells that are not known yet, unless the obstacle moves.
    fn add(&mut self, wetting: &Wetting<'_>, wetted: &[[i32; 3]]) {
        let body = &wetting.core.boundary.obstacles[wetting.obstacle];
        if body.moving.is_some() {
            return;
        }
        let new: Vec<[i32; 3]> =
            wetted.iter().filter(|cell| !self.cells.contains_key(*cell)).copied().collect();
        for some in new.chunks(CELLS_AT_ONCE) {
            if self.count > MOST_KEPT {
                break;
            }
            let pieces: Vec<Vec<WallPiece>> = some.par_iter().map(|cell| wetting.pieces(*cell)).collect();
            self.count += pieces.iter().map(|pieces| 1 + pieces.len()).sum::<usize>();
            self.cells.extend(some.iter().copied().zip(pieces));
        }
    }
}

/// A piece of an obstacle's surface with the walls around it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WallPiece {
    piece: Piece,
    /// The part of a kernel at the piece that walls leave free; zero if another obstacle lies on the piece. `None` if
    /// it changes, because an obstacle moves.
    free: Option<f64>,
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
    /// Whether no obstacle moves.
    all_rest: bool,
}

/// What is used of a particle near a wall.
#[derive(Clone, Copy)]
struct NearParticle {
    i: usize,
    at: DVec3,
    volume: f64,
    pressure: f64,
    density: f64,
    /// Its acceleration by pressure, m/s².
    by_pressure: DVec3,
}

/// The particles near a cell, and the squares of their distances from a piece, m²: most of them are too far away, and
/// columns tell that of several at once.
struct Near {
    columns: [Vec<f64>; 3],
    squares: Vec<f64>,
    particles: Vec<NearParticle>,
}

impl Near {
    fn of(particles: Vec<NearParticle>) -> Self {
        let column = |axis: usize| particles.iter().map(|particle| particle.at[axis]).collect();
        Self { columns: [column(0), column(1), column(2)], squares: vec![0.0; particles.len()], particles }
    }

    /// Finds the squares of the distances from a place.
    fn measure(&mut self, from: DVec3) {
        let [x, y, z] = &self.columns;
        for (square, ((x, y), z)) in self.squares.iter_mut().zip(x.iter().zip(y).zip(z)) {
            let (x, y, z) = (x - from.x, y - from.y, z - from.z);
            *square = x * x + y * y + z * z;
        }
    }
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
    /// The pieces of the surface in a cell.
    fn pieces(&self, cell: [i32; 3]) -> Vec<WallPiece> {
        let spacing = self.core.parameters.spacing();
        let field = self.core.boundary.field(self.obstacle);
        let mut pieces = Pieces { field, spacing, found: Vec::new() };
        pieces.find(self.cells.bounds(cell));
        let with_walls =
            |piece: Piece| WallPiece { piece, free: self.all_rest.then(|| self.free_part(&piece)) };
        pieces.found.into_iter().map(with_walls).collect()
    }

    /// Force and torque on the pieces in a cell.
    fn on_cell(&self, cell: [i32; 3], pieces: &[WallPiece], point: DVec3) -> (DVec3, DVec3) {
        if pieces.is_empty() {
            return (DVec3::ZERO, DVec3::ZERO);
        }
        let h = self.core.parameters.support_radius;
        let reach = pieces.iter().fold(Aabb::EMPTY, |all, wall| all.including(wall.piece.at)).grown(h);
        let particles: Vec<NearParticle> = self
            .cells
            .around(cell)
            .filter_map(|cell| self.cells.particles.get(&cell))
            .flatten()
            .filter(|&&i| reach.contains(self.core.particles.position.get(i)))
            .map(|&i| self.near_particle(i))
            .collect();
        let mut near = Near::of(particles);
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for wall in pieces {
            let push = self.on_piece(wall, &mut near);
            force += push;
            torque += (wall.piece.at - point).cross(push);
        }
        (force, torque)
    }

    fn near_particle(&self, i: usize) -> NearParticle {
        let Core { parameters, particles, contacts, acceleration, .. } = self.core;
        let (density, pressure) = (particles.density[i], particles.pressure[i]);
        let drag = contacts.as_ref().map_or(DVec3::ZERO, |contacts| contacts.drag(i));
        let by_pressure = acceleration.get(i) - self.core.gravity(i) - drag;
        let volume = parameters.mass_in_sums() / density;
        NearParticle { i, at: particles.position.get(i), volume, pressure, density, by_pressure }
    }

    fn on_piece(&self, WallPiece { piece, free }: &WallPiece, near: &mut Near) -> DVec3 {
        let Some(normal) = piece.area.try_normalize() else { return DVec3::ZERO };
        if *free == Some(0.0) {
            return DVec3::ZERO;
        }
        let found = self.in_front(piece, normal, near);
        if found.filled == 0.0 {
            return DVec3::ZERO;
        }
        let free = free.unwrap_or_else(|| self.free_part(piece));
        if free == 0.0 {
            return DVec3::ZERO;
        }
        let filled = found.filled.max(FILLED * free);
        let viscosity = self.core.parameters.viscosity;
        (-found.pressure * piece.area + viscosity * piece.area.length() * found.shear) / filled
    }

    fn in_front(&self, piece: &Piece, normal: DVec3, near: &mut Near) -> InFront {
        let Core { parameters, particles, .. } = self.core;
        let h = parameters.support_radius;
        let behind = BEHIND * parameters.spacing();
        let body = &self.core.boundary.obstacles[self.obstacle];
        let sticks = self.with_friction && body.slip == Slip::No && parameters.viscosity > 0.0;
        let mut found = InFront::default();
        near.measure(piece.at);
        for (r2, particle) in near.squares.iter().zip(&near.particles) {
            if *r2 >= h * h {
                continue;
            }
            let &NearParticle { i, at, volume, pressure, density, by_pressure } = particle;
            let away = at - piece.at;
            let (r2, distance) = (away.length_squared(), away.dot(normal));
            if distance < -behind {
                continue;
            }
            let weight = volume * self.weight.at(r2);
            // a method that solves for its pressure knows none before the first step
            let is_known = self.core.steps > 0 || pressure != 0.0;
            found.filled += weight;
            found.pressure +=
                weight * if is_known { pressure + density * by_pressure.dot(away) } else { 0.0 };
            if sticks {
                let wall = self.core.boundary.velocity_along(self.obstacle, at);
                let velocity = particles.velocity.get(i) - wall;
                let along = velocity - velocity.dot(normal) * normal;
                found.shear += weight / distance.max(NEAREST * h) * along;
            }
        }
        found
    }

    /// The part of a kernel at a piece that walls leave free; zero if another obstacle lies on the piece.
    fn free_part(&self, piece: &Piece) -> f64 {
        let Core { parameters, boundary, .. } = self.core;
        let front = piece.at + 0.01 * parameters.spacing() * piece.area.normalize_or_zero();
        let lies_on_it = |k: usize| k != self.obstacle && boundary.field(k).omega(front) >= 0.0;
        if (0..boundary.obstacles.len()).any(lies_on_it) {
            return 0.0;
        }
        let covered = boundary.coverage::<(), ()>(self.core.wall(), piece.at).map_or(0.0, |c| c.part);
        1.0 - covered.min(MOST_COVERED)
    }
}
