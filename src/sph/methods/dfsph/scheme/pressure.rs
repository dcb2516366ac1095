//! The pressures of a step: those that particles bear, those around them that are reported, and how long a step they
//! allow.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::super::super::shifting::depth;
use super::super::ADVECTION;
use super::super::hydrostatic::Hydrostatic;
use super::super::passes::{Constants, Field};
use super::super::walls::WallsNear;
use super::DivergenceFree;
use crate::sph::{
    core::Core,
    params::Parameters,
    particles::{CHUNK, Particles, add_scaled},
    reaction::Reaction,
};

/// Longest step, as a part of 2/ω, for the fastest motion that pressure causes and that the solver does not
/// see. (Eight layers lie still with 0.75 and burst with 1, as a column of eighty does.)
const STABLE: f64 = 0.75;

/// ω² beside walls over ω² in the depth, for each unit of ‖M‖². M completes an acceleration beside walls, and
/// changes with the place as M∇K·M does. ‖M‖ is 2 at a plane, 2.8 in the corner of a box and 4 in a gap one
/// spacing wide. Without this factor water that tapers off between a cylinder and a floor reaches 60 m/s, and
/// columns of sixty and seventy layers, four wide, burst.
const STIFFER_AT_WALLS: f64 = 0.375;

impl DivergenceFree {
    /// The longest step, s, in which planes of particles that the present pressure holds together do not
    /// overshoot. The solver does not see a motion that changes no density, so its forces are those at the
    /// last places, and the motion grows if steps are longer than 2/ω.
    pub(super) fn pressure_dt(&self, core: &Core) -> f64 {
        let rest = core.parameters.rest_density;
        let in_the_depth = self.own_pressure.iter().copied().fold(0.0, f64::max);
        let completed = if self.walls.mirrors().is_some() { &[][..] } else { self.walls.found() };
        let at_walls = completed.iter().map(|(i, (_, completion))| {
            STIFFER_AT_WALLS * square_of_norm(completion) * self.own_pressure[*i as usize]
        });
        let greatest = at_walls.fold(in_the_depth, f64::max) / rest;
        let spacing = core.parameters.spacing();
        STABLE * 2.0 * spacing / (self.stiffness * greatest).sqrt()
    }

    /// The longest step, s, in which no particle comes nearer to a wall, which may move, than it may move in a step.
    pub(super) fn approach_dt(&self, core: &Core) -> f64 {
        let approach = |(i, (wall, _)): &(u32, (WallsNear, DMat3))| {
            approach_speed(core, wall, core.particles.velocity.get(*i as usize))
        };
        let found = self.walls.found().par_iter().with_min_len(CHUNK / 4);
        ADVECTION * core.parameters.spacing() / found.map(approach).reduce(|| 0.0, f64::max)
    }

    /// The pressure that the fluid of a sealed vessel has as one that is carried along, under gravity and with the bodies
    /// that it consists of; what pressure gave it in this step is learnt before.
    pub(super) fn find_hydrostatic(
        &mut self,
        core: &Core,
        bodies: Option<(Vec<usize>, usize)>,
        dt: f64,
        relaxation: f64,
    ) -> Option<Hydrostatic> {
        let bodies = bodies.filter(|_| core.parameters.is_sealed)?;
        let (times, share) = ((self.last_dt, dt), mean_share(core, dt, relaxation));
        self.carried.learn(bodies.clone(), (core, &self.walls, &self.forces.push), times, share);
        Some(Hydrostatic::of(core, bodies, |i| core.parameters.gravity - self.carried.of(i)))
    }

    /// Notes what walls did in a step of the length `dt`, s, by the pressure that was found and by the hydrostatic one.
    pub(super) fn note_walls(&mut self, core: &Core, hydrostatic: Option<&Hydrostatic>, dt: f64) {
        let Some(reaction) = Reaction::of(core, dt) else { return };
        let Parameters { rest_density, gravity, .. } = core.parameters;
        self.forces.note_walls(reaction, &self.walls, rest_density, (&self.forces.push, &self.forces.s));
        if let Some(hydrostatic) = hydrostatic {
            hydrostatic.note_walls(core, (&mut self.forces, &self.walls), reaction, gravity);
            self.carried.note_work(core, dt);
        }
    }

    /// Finds the pressures that the particles bear in this step and, averaged over the relaxation time, in several.
    /// The lower of the two is given in advance.
    pub(super) fn bear(&mut self, core: &Core, dt: f64, relaxation: f64) {
        let (s, density) = (&self.forces.s, &core.particles.density);
        let scale = |(rho, g): (&f64, &f64)| (1.0 + depth(*g) * (g - 1.0)) * rho * rho;
        let scales: Vec<f64> = density.iter().zip(&self.spread).map(scale).collect();
        self.free.clear();
        // what acted since the last solve, half of the last step and half of this one: the pressure that was given in
        // advance, and this answer for all of this step
        let is_first = self.last_dt == 0.0;
        let (given, all) = if is_first { (0.0, 2.0 * dt) } else { (self.ahead.dt, self.ahead.dt + dt) };
        let [given, found] = [given / all, 2.0 * dt / all];
        let now = |((s, ahead), scale): ((&f64, &f64), &f64)| (found * s + given * ahead) * scale;
        self.free.extend(s.iter().zip(&self.ahead.s).zip(&scales).map(now));
        let share = mean_share(core, dt, relaxation);
        for (mean, now) in self.own_pressure.iter_mut().zip(&self.free) {
            *mean += share * (now - *mean);
        }
        for ((((ahead, s), mean), now), scale) in self
            .ahead
            .s
            .iter_mut()
            .zip(&mut self.forces.s)
            .zip(&self.own_pressure)
            .zip(&self.free)
            .zip(&scales)
        {
            if *scale <= 0.0 {
                (*ahead, *s) = (0.0, 0.0);
                continue;
            }
            *ahead = if is_first { 0.0 } else { mean.min(*now) / scale };
            // the next solve begins with what it will find if nothing changes: half of gravity waits in it
            *s = (now / scale - 0.5 * if is_first { now / scale } else { *ahead }).max(0.0);
        }
    }

    /// Finds the pressures around the particles, and averages the reported ones over at most the time in which a
    /// particle moves by a spacing, with the hydrostatic one of a full vessel. Packed particles are heavier than they
    /// count in the sums, and so is their weight.
    pub(super) fn report_pressure(
        &mut self,
        core: &mut Core,
        dt: f64,
        relaxation: f64,
        hydrostatic: Option<&Hydrostatic>,
    ) {
        let Constants { kernel, rest_density, .. } = Constants::of(&core.parameters);
        // the field of the sums, which is divided by the packing below
        let rest_density = core.parameters.packing * rest_density;
        self.field.resize(self.free.len(), 0.0);
        // the displacements of this step are not known yet
        let push = &mut self.displacement;
        push.clone_from(&self.forces.push);
        add_scaled(push, &self.ahead.push, 0.5);
        let pass = Field { kernel, rest_density, push };
        core.sum(&pass, [&self.free], [&mut self.field]);
        let share = mean_share(core, dt, relaxation);
        let (spacing, packing) = (core.parameters.spacing(), core.parameters.packing);
        self.follow_the_weight(core, hydrostatic);
        let Particles { position, velocity, pressure, .. } = &mut core.particles;
        for (i, (mean, now)) in pressure.iter_mut().zip(&self.field).enumerate() {
            let speed = (velocity.get(i) - self.whole.at(position.get(i))).length();
            // the pressure that a particle bore a spacing ago belongs to another place
            let still = hydrostatic.map_or(0.0, |hydrostatic| hydrostatic.pressure[i]);
            *mean += share.max((dt * speed / spacing).min(1.0)) * (now / packing + still - *mean);
        }
    }

    /// Changes the means of pressures by what a gravity that is a function of time has changed in them since the last
    /// step: means alone would come late. That is all of the hydrostatic pressure in a sealed vessel, and elsewhere as much
    /// of a pressure as weight can have caused.
    fn follow_the_weight(&self, core: &mut Core, hydrostatic: Option<&Hydrostatic>) {
        let Some([before, now]) = core.change_of_gravity(self.last_dt) else { return };
        if let Some(carried) = hydrostatic {
            let earlier = carried.after(core, before - now);
            let changes = carried.pressure.iter().zip(&earlier.pressure);
            let means = core.particles.pressure.iter_mut();
            means.zip(changes).for_each(|(mean, (now, before))| *mean += now - before);
            return;
        }
        let growth = now.length() / before.length() - 1.0;
        if growth.is_finite() {
            let by_weight = Hydrostatic::of_one_body(core, before).pressure;
            let means = core.particles.pressure.iter_mut();
            means.zip(&by_weight).for_each(|(mean, most)| *mean += growth * mean.clamp(0.0, *most));
        }
    }
}

/// How fast a particle comes nearer to the walls, m/s. Between walls that face each other ∇λ vanishes, but not what their
/// motion makes of λ: it counts as that of a single plane which takes as much of the kernel.
pub(super) fn approach_speed(core: &Core, wall: &WallsNear, velocity: DVec3) -> f64 {
    let rate = wall.gradient.dot(velocity) - wall.sweep;
    if rate <= 0.0 {
        return 0.0;
    }
    let of_plane = core.wall().slope_at(wall.part) / core.parameters.support_radius;
    rate / wall.gradient.length().max(of_plane)
}

/// The weight of a step's pressure in a mean over the relaxation time. Until that has passed, the mean is taken since
/// the start.
fn mean_share(core: &Core, dt: f64, relaxation: f64) -> f64 {
    (dt / relaxation.min(core.time + dt)).min(1.0)
}

/// The square of the largest eigenvalue of a positive symmetric matrix, too large by 15 % at most: ‖M⁸‖^¼ in
/// Frobenius' norm.
fn square_of_norm(matrix: &DMat3) -> f64 {
    let square = *matrix * *matrix;
    let fourth = square * square;
    let eighth = fourth * fourth;
    let entries = eighth.to_cols_array();
    entries.iter().map(|x| x * x).sum::<f64>().sqrt().powf(0.25)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::square_of_norm;

    #[test]
    fn the_norm_of_a_completion_is_its_largest_eigenvalue() {
        // 4, 2 and 1 along turned axes
        let turn = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(1.1);
        let matrix = turn * DMat3::from_diagonal(DVec3::new(4.0, 2.0, 1.0)) * turn.transpose();
        let found = square_of_norm(&matrix);
        assert!((16.0..16.01).contains(&found), "{found}");
        // where all are alike it is too large by the eighth root of three
        let alike = square_of_norm(&(2.0 * DMat3::IDENTITY));
        assert!((alike / (4.0 * 3_f64.powf(0.125)) - 1.0).abs() < 1e-12, "{alike}");
    }
}
