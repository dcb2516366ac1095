//! Spreads and packs the particles of a fluid before its first step.
//!
//! A lattice fits few walls. Particles that are too dense are moved apart. Otherwise the first step would
//! give them speeds, and a weakly compressible fluid would grow until it has the room that it needs (beside
//! the walls of a bent tube by 3 % of its volume). A fluid with a surface has room for that. A fluid that
//! fills its vessel has none. Its particles are packed, x ← x − β·h²·(Σ V ∇W + ∇B), until they lie evenly and
//! keep the distance that curved walls demand. If it is too dense then, moving particles does not help, so
//! all of them count with a smaller mass in the sums over neighbours
//! ([`packing`](crate::sph::Parameters::packing)). They keep their mass, because all forces are sums too: motion does not
//! change, and what walls bear belongs to the whole mass. (If particles that are too near to a wall are left out
//! instead, the flow between two cylinders, 8 spacings apart, loses 13 % of its mass, and gaps beside the walls make
//! its velocity wrong by 44 % instead of 9.)

use std::collections::HashMap;

use fearless_simd::{Simd, SimdFloat};
use glam::DVec3;

use super::super::{crowding::Crowding, numerics::Numerics};
use super::Dfsph;
use super::scheme::{DivergenceFree, OWED};
use super::walls::Walls;
use crate::sph::{
    core::Core,
    pairs::{PairPass, Real},
    particles::{Particles, Vectors},
};

/// Maximum number of rounds that move particles apart; little compression is left after them.
const ROUNDS: usize = 40;

/// Maximum number of packing rounds.
const PACKING_ROUNDS: usize = 100;

/// β: how far packing moves particles in a round. With 0.2 they swing instead of coming to rest.
const PACKING_FACTOR: f64 = 0.05;

/// If the mean excess of the density is above this, the density that moving apart takes away does not become
/// a debt of the first steps. (Particles in a bent tube, 3 % too dense, would gain 0.8 % of their energy from
/// the debt. A column of forty layers whose places have a jitter of a twentieth of the spacing needs the
/// debt: without its push the pressure comes too late, and the column bursts.)
const CROWDED: f64 = 0.01;

/// Packing ends when no particle moves farther than this part of the spacing in a round.
const PACKED: f64 = 1e-3;

/// Part of the particles that are at most as dense as the fluid at rest after packing. With a half, the flow
/// between cylinders throws particles; with four fifths it does not.
const FITTING: f64 = 0.95;

/// Largest part of its room that the volumes of particles take in a fluid without a surface. A lattice that fills a box
/// to its walls has the greatest allowed density, and any other arrangement is denser. Once the fluid flows,
/// displacements cannot remove this excess: with 0.97 a hundredth of 512 particles in a vortex is 1 % too dense, and with
/// all of the room a hundredth of 3456 is 11 %. (Packed vessels of other shapes reach 0.945 to 0.96 by themselves.)
const LOOSEST: f64 = 0.95;

/// Mean compression that may be left in a fluid of another method: a tenth of the compression by its motion.
const SPREAD_TOLERANCE: f64 = 1e-3;

/// Maximum number of iterations in each round for a fluid of another method.
const SPREAD_ITERATIONS: u32 = 30;

/// Finds how particles crowd: Σ V ∇W + ∇B, 1/m, with the barrier B of the walls.
#[derive(Clone, Copy)]
struct Packing<'a> {
    crowding: Crowding,
    walls: &'a Walls,
}

impl PairPass<0, 3, 3> for Packing<'_> {
    #[inline(always)]
    fn add<S: Simd, V: SimdFloat<S, Element: Real>>(
        &self,
        d: [V; 3],
        r2: V,
        _: &[V; 0],
        _: [V; 0],
        sums: &mut [V; 3],
    ) {
        self.crowding.add(d, r2, sums);
    }

    fn finish(&self, i: usize, sums: [f64; 3]) -> [f64; 3] {
        let of_walls = self.walls.near(i).map_or(DVec3::ZERO, |(wall, _)| wall.barrier.gradient);
        (self.crowding.total(sums) + of_walls).to_array()
    }
}

/// Moves apart the particles of a new fluid that are too dense, whatever its method. Velocities and densities
/// stay.
pub(in crate::sph::methods) fn spread(core: &mut Core) {
    let Particles { density, id, .. } = &core.particles;
    let densities: HashMap<u32, f64> = id.iter().copied().zip(density.iter().copied()).collect();
    let numbers =
        Dfsph { tolerance: SPREAD_TOLERANCE, most_iterations: SPREAD_ITERATIONS, ..Dfsph::default() };
    let own_wall = core.exchange_wall(numbers.wall(&core.parameters.scales()));
    DivergenceFree::at(numbers, core).settle_in(core);
    core.exchange_wall(own_wall);
    let Particles { density, id, .. } = &mut core.particles;
    density.clear();
    // particles without a density get one from their method
    density.extend(id.iter().map(|id| densities.get(id).copied().unwrap_or(0.0)));
}

impl DivergenceFree {
    /// Packs the particles of a fluid without a surface, and moves apart those that are too dense. Velocities
    /// stay.
    pub(super) fn settle_in(&mut self, core: &mut Core) {
        let mut velocity = core.particles.velocity.clone();
        let speed = std::mem::take(&mut core.speed);
        core.particles.velocity.components_mut().into_iter().for_each(|column| column.fill(0.0));
        if core.parameters.fills_vessel && !core.particles.is_empty() {
            self.pack(core, &mut velocity);
        }
        self.move_apart(core, &mut velocity);
        (core.particles.velocity, core.speed) = (velocity, speed);
        core.acceleration.components_mut().into_iter().for_each(|column| column.fill(0.0));
        core.particles.pressure.fill(0.0);
        self.own_pressure.fill(0.0);
        self.iterations = 0;
    }

    fn pack(&mut self, core: &mut Core, velocity: &mut Vectors) {
        let (h, spacing) = (core.parameters.support_radius, core.parameters.spacing());
        for _ in 0..PACKING_ROUNDS {
            let pass = Packing { crowding: Crowding::of(&core.parameters), walls: &self.walls };
            self.displacement.resize(core.particles.len());
            let Vectors { x, y, z } = &mut self.displacement;
            core.sum(&pass, [], [x, y, z]);
            let longest = self.displacement.iter().map(|way| way.length()).fold(0.0, f64::max);
            let factor = PACKING_FACTOR * h * h;
            if factor * longest < PACKED * spacing || !self.displace(core, -factor, velocity) {
                break;
            }
        }
        let mut densities = self.loaded.clone();
        let last = densities.len().saturating_sub(1);
        let (_, density, _) =
            densities.select_nth_unstable_by((FITTING * last as f64) as usize, f64::total_cmp);
        let packing = core.parameters.packing * core.parameters.rest_density / *density;
        core.pack(packing.min(LOOSEST));
        self.find_lattice(&core.parameters);
        self.settle(core, &mut velocity.components_mut());
    }

    fn move_apart(&mut self, core: &mut Core, velocity: &mut Vectors) {
        let rest = core.parameters.rest_density;
        let excess: f64 = self.loaded.iter().map(|rho| (rho / rest - 1.0).max(0.0)).sum();
        let is_crowded = excess > CROWDED * self.loaded.len() as f64;
        for round in 0..ROUNDS {
            let worst = self.loaded.iter().fold(0.0, |worst: f64, rho| worst.max(rho / rest - 1.0));
            if worst < 2.0 * self.numbers.tolerance {
                break;
            }
            // the density that later rounds take away was added by earlier ones, so it is not owed
            let owed = if round == 0 { OWED } else { 0.0 };
            // before the first step moving walls do not sweep
            self.drift.clone_from(&core.particles.velocity);
            self.find_displacements(core, 0.0, owed);
            let moves = self.displacement.iter().any(|way| way != DVec3::ZERO);
            if moves && !self.displace(core, 1.0, velocity) {
                break;
            }
        }
        // without weight there is no pressure that could come too late
        if is_crowded || !core.has_weight() {
            self.debt.fill(0.0);
        }
    }

    /// Moves the particles by their displacements times a factor. `velocity`, which they will have, is sorted
    /// with them. Returns whether the move was possible; if an obstacle has no value at a place, the first
    /// step will report it.
    fn displace(&mut self, core: &mut Core, factor: f64, velocity: &mut Vectors) -> bool {
        let moved = core.drift(1.0, Some((&self.displacement, factor))).is_ok();
        if moved {
            // a wall that stops a particle must not give it a speed
            core.particles.velocity.components_mut().into_iter().for_each(|column| column.fill(0.0));
            self.settle(core, &mut velocity.components_mut());
        }
        moved
    }
}
