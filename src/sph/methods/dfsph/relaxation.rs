//! The time in which an error of the density is paid back.

use super::ADVECTION;
use crate::sph::params::Parameters;

/// The relaxation time, in steps, if the fastest particle moves as far in a step as allowed.
pub(super) const RELAXATION_STEPS: f64 = 8.0;

/// The relaxation time at rest, in units of √(h/g), however short the steps are. The debt of a whole column
/// is paid at once, so with eight steps a column of eighty layers bursts at its start.
const RELAXATION_FALLS: f64 = 2.0;

/// Maximum relaxation time, in steps of the length that the motion allows. It bounds the time where gravity
/// is close to zero. Pressure makes the steps themselves shorter; a relaxation time that followed them would
/// make the pressure grow without end.
const MOST_RELAXATION_STEPS: f64 = 100.0;

/// The time, s, in which a debt is paid back after a step of the length `dt` with the greatest speed `speed`.
/// Reported pressures are averaged over at most this time.
///
/// A step may be short for other reasons than the motion of the fluid: a frame is due, a body jumps, or a
/// body causes a large acceleration. A debt that was paid back within eight such steps would become a speed
/// without bound (a still fluid with frames 0.1 ms apart reached 11 m/s). So the time is at least that of
/// eight steps of the expected motion.
pub(super) fn relaxation_time(parameters: &Parameters, speed: f64, dt: f64) -> f64 {
    // where nothing is expected to move, only frames limit the steps
    let allowed = parameters.time_step.min(parameters.stable_dt(speed));
    let most = MOST_RELAXATION_STEPS * allowed;
    let gravity = parameters.pull().length().max(parameters.most_gravity);
    let fall = (parameters.support_radius / gravity).sqrt();
    let falls = if fall.is_finite() { (RELAXATION_FALLS * fall).min(most) } else { 0.0 };
    let moving = RELAXATION_STEPS * dt;
    let slow = falls.max(moving);
    let courant = (dt * speed / (ADVECTION * parameters.spacing())).min(1.0);
    let in_steps = slow + (moving - slow) * courant;
    let expected = RELAXATION_STEPS * ADVECTION * parameters.spacing() / speed.max(parameters.expected_speed);
    in_steps.max(expected.min(most))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::sph::methods::dfsph::Dfsph;

    /// Pressure makes steps short. A debt must not become a greater speed by that, whatever gives the fluid
    /// its weight.
    #[test]
    fn a_relaxation_time_does_not_follow_steps_that_pressure_made_short() {
        let of = |gravity: f64, most_gravity: f64, dt: f64| {
            let parameters = Parameters {
                gravity: DVec3::new(0.0, 0.0, -gravity),
                most_gravity,
                expected_speed: 3.0,
                time_step: 1.0,
                method: Dfsph::default().into(),
                ..Parameters::paper()
            };
            relaxation_time(&parameters, 0.0, dt)
        };
        let fall = (Parameters::paper().support_radius / 9.81).sqrt();
        for (gravity, most_gravity) in [(9.81, 0.0), (0.0, 9.81)] {
            for dt in [1e-3, 1e-5, 1e-7] {
                let found = of(gravity, most_gravity, dt);
                assert!((found / (RELAXATION_FALLS * fall) - 1.0).abs() < 1e-12, "{gravity} {dt}: {found} s");
            }
        }
        // without weight it is the time of the expected motion
        assert!(of(0.0, 0.0, 1e-7) < 0.5 * fall && of(0.0, 0.0, 1e-7) == of(0.0, 0.0, 1e-5));
    }
}
