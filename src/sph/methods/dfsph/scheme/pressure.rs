//! The pressures of a step: those that particles bear, and those around them that are reported.

use super::super::super::shifting::depth;
use super::super::hydrostatic::Hydrostatic;
use super::super::passes::{Constants, Field};
use super::DivergenceFree;
use crate::sph::{
    core::Core,
    particles::{Particles, add_scaled},
};

impl DivergenceFree {
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

/// The weight of a step's pressure in a mean over the relaxation time. Until that has passed, the mean is taken since
/// the start.
pub(super) fn mean_share(core: &Core, dt: f64, relaxation: f64) -> f64 {
    (dt / relaxation.min(core.time + dt)).min(1.0)
}
