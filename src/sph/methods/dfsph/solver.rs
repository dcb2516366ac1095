//! The solver of a linear system for s ≥ 0. There are two systems: one for velocities and one for places.

use rayon::prelude::*;

use super::super::images::WithImages;
use super::corrected::Correction;
use super::passes::{Constants, Continuation, Push, Squeeze};
use super::rigid::Rigid;
use super::walls::Walls;
use crate::sph::{
    core::Core,
    params::Parameters,
    particles::{CHUNK, Vectors},
    reaction::Reaction,
    walls::Pushed,
};

/// Factor by which walls and disorder make a system stiffer than the even fluid of [`stiffness`], first for
/// velocities that continue behind walls, then for places. These factors need the fewest iterations. A solve
/// notices if its system is stiffer.
const STIFFNESS: [f64; 2] = [1.5, 0.8];

/// Part of an increased stiffness that the next solve keeps.
const FORGET: f64 = 0.97;

/// A particle whose diagonal is below this part of that in a full neighbourhood counts as alone, and gets no
/// pressure.
const LONELY: f64 = 1e-3;

/// One system, its last answer, and working memory.
pub(super) struct Solver {
    continuation: Continuation,
    /// Corrections of the sums, if the fluid fills its vessel.
    correction: Option<Correction>,
    /// The answer s: p/ρ² where it changes velocities.
    pub s: Vec<f64>,
    /// The diagonal of the system, without corrections: the decrease of the particle's own dρ/dt in a second by a unit of s.
    pub factor: Vec<f64>,
    /// a(s), the acceleration or displacement that belongs to the answer.
    pub push: Vectors,
    /// Rate of density dρ/dt of the last velocity passed to `find_rate_of`.
    pub rate: Vec<f64>,
    /// M·v, where velocities continue linearly.
    completed: Vectors,
    /// The last guess, without the momentum that was added to it.
    last: Vec<f64>,
    /// Greatest eigenvalue of the system over its diagonal. Its inverse is a step that cannot overshoot.
    pub stiffness: f64,
    /// Sums of the errors and of the momentum's work, chunk by chunk.
    errors: Vec<(Errors, f64)>,
}

/// The pressures from which a solve begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Begin {
    /// Those of the last solve.
    Last,
    /// None.
    Nothing,
}

/// The vectors to which a rate of density belongs.
#[derive(Clone, Copy)]
pub(super) enum RateOf<'a> {
    /// Velocities of a fluid with this motion as a whole, beside walls that may move.
    Velocity(&'a Rigid),
    /// The same with gaps before walls: the part of each particle's walls that is not there.
    BeforeGaps(&'a Rigid, &'a [f64]),
    /// Accelerations or displacements by pressure, to which the motion of walls adds nothing.
    Pressure,
}

/// The goal of a solve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Goal {
    /// Mean error that is accepted. One particle in two hundred may be off by more than ten times as much.
    pub tolerance: f64,
    /// Maximum number of iterations.
    pub most_iterations: u32,
}

/// An error this many times the accepted mean is large.
const LARGE: f64 = 10.0;

/// Part of the particles whose errors may be large.
const FEW: f64 = 0.005;

/// Errors of many particles.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Errors {
    sum: f64,
    large: usize,
}

impl Errors {
    /// Counts one particle's error.
    #[inline]
    pub fn count(&mut self, error: f64, goal: Goal) {
        self.sum += error;
        self.large += usize::from(error > LARGE * goal.tolerance);
    }

    /// Whether the errors of n particles reach the goal.
    pub fn reach(&self, goal: Goal, n: usize) -> bool {
        self.sum <= goal.tolerance * n as f64 && self.large as f64 <= FEW * n as f64
    }
}

impl Solver {
    /// The solver for n particles, without an answer yet.
    pub fn new(continuation: Continuation, parameters: &Parameters, n: usize) -> Self {
        let mut solver = Self {
            continuation,
            correction: None,
            s: vec![0.0; n],
            factor: vec![0.0; n],
            push: Vectors::default(),
            rate: vec![0.0; n],
            completed: Vectors::default(),
            last: Vec::new(),
            stiffness: least_stiffness(continuation, parameters),
            errors: Vec::new(),
        };
        solver.push.resize(n);
        solver
    }

    /// Corrects the sums of this system from now on, or no more. To be called whenever particles have moved.
    pub fn correct(&mut self, core: &Core, walls: &Walls, is_corrected: bool) {
        if is_corrected {
            self.correction.get_or_insert_default().find(core, walls);
        } else {
            self.correction = None;
        }
    }

    /// Finds s ≥ 0 such that the rate of density `free` + dt·(rate of a(s)) vanishes where s > 0 and is not
    /// positive elsewhere. It begins with the present `s`, or with zero. Leaves a(s) in `push` and its rate
    /// in `rate`, and returns the number of iterations.
    ///
    /// The method is projected gradients with momentum (Nesterov 1983), scaled by the diagonal, and restarted
    /// when the momentum leads uphill (O'Donoghue & Candès 2015). It takes some √κ iterations where Jacobi's
    /// method needs κ.
    pub fn solve(
        &mut self,
        core: &Core,
        walls: &Walls,
        free: &[f64],
        dt: f64,
        goal: Goal,
        begin: Begin,
    ) -> u32 {
        // the stiffness that one neighbourhood needed is forgotten again
        self.stiffness = (FORGET * self.stiffness).max(least_stiffness(self.continuation, &core.parameters));
        let least = LONELY * Constants::of(&core.parameters).full_factor;
        let n = self.s.len();
        let (mut iteration, mut momentum, mut best) = (0, 0.0, f64::INFINITY);
        if begin == Begin::Nothing {
            // zero pressure has no effect, so the first guess needs no sums
            self.s.fill(0.0);
            self.rate.fill(0.0);
            self.last.clone_from(&self.s);
            self.guess_again(free, dt, least, 0.0);
            (iteration, momentum) = (1, 1.0);
        }
        self.last.clone_from(&self.s);
        loop {
            self.find_push(core, walls);
            let push = std::mem::take(&mut self.push);
            self.find_rate_of(core, walls, &push, RateOf::Pressure);
            self.push = push;
            let (errors, uphill) = self.find_errors(free, dt, least, goal);
            let mean = errors.sum / n as f64;
            let done = (errors.reach(goal, n) && iteration > 0) || iteration >= goal.most_iterations;
            if done || !mean.is_finite() {
                break;
            }
            let too_long = mean > 2.0 * best;
            if too_long {
                // steps are too long for this neighbourhood
                self.stiffness *= 1.3;
            }
            best = if too_long { mean } else { best.min(mean) };
            let begin_anew = too_long || uphill > 0.0;
            let beta = if begin_anew { 0.0 } else { momentum / (momentum + 3.0) };
            momentum = if begin_anew { 0.0 } else { momentum + 1.0 };
            self.guess_again(free, dt, least, beta);
            iteration += 1;
        }
        iteration
    }

    /// The errors at a guess, and a sum that is positive if momentum leads uphill from there.
    fn find_errors(&mut self, free: &[f64], dt: f64, least: f64, goal: Goal) -> (Errors, f64) {
        let scale = 1.0 / (dt * self.stiffness);
        self.rate
            .par_chunks(CHUNK)
            .zip(free.par_chunks(CHUNK))
            .zip(self.factor.par_chunks(CHUNK))
            .zip(self.s.par_chunks(CHUNK))
            .zip(self.last.par_chunks(CHUNK))
            .map(|((((rate, free), factor), s), last)| {
                let (mut errors, mut uphill) = (Errors::default(), 0.0);
                for k in 0..rate.len() {
                    if factor[k] > least {
                        let error = free[k] + dt * rate[k];
                        let next = projected(scale, s[k], error, factor[k]);
                        // no pressure can end an expansion, so it is no error
                        errors.count(if s[k] > 0.0 { error.abs() } else { error.max(0.0) }, goal);
                        uphill += factor[k] * (s[k] - next) * (next - last[k]);
                    }
                }
                (errors, uphill)
            })
            .collect_into_vec(&mut self.errors);
        self.errors.iter().fold((Errors::default(), 0.0), |(all, up), (errors, uphill)| {
            (Errors { sum: all.sum + errors.sum, large: all.large + errors.large }, up + uphill)
        })
    }

    /// Takes a step along the gradient, and repeats the part `beta` of the last step.
    fn guess_again(&mut self, free: &[f64], dt: f64, least: f64, beta: f64) {
        let scale = 1.0 / (dt * self.stiffness);
        self.s
            .par_chunks_mut(CHUNK)
            .zip(self.last.par_chunks_mut(CHUNK))
            .zip(self.rate.par_chunks(CHUNK))
            .zip(free.par_chunks(CHUNK))
            .zip(self.factor.par_chunks(CHUNK))
            .for_each(|((((s, last), rate), free), factor)| {
                for k in 0..s.len() {
                    if factor[k] > least {
                        let error = free[k] + dt * rate[k];
                        let next = projected(scale, s[k], error, factor[k]);
                        s[k] = (next + beta * (next - last[k])).max(0.0);
                        last[k] = next;
                    } else {
                        (s[k], last[k]) = (0.0, 0.0);
                    }
                }
            });
    }

    /// Finds a(s).
    fn find_push(&mut self, core: &Core, walls: &Walls) {
        let (mut push, s) = (std::mem::take(&mut self.push), std::mem::take(&mut self.s));
        self.find_push_of(core, walls, &s, &mut push);
        (self.push, self.s) = (push, s);
    }

    /// Finds the a(s) of other pressures than the answer.
    pub fn find_push_of(&mut self, core: &Core, walls: &Walls, s: &[f64], push: &mut Vectors) {
        let (constants, continuation) = (Constants::of(&core.parameters), self.continuation);
        let pass = Push { constants, walls, pressure: s, continuation };
        if let Some(correction) = &mut self.correction {
            correction.push(core, pass, s, push);
            return;
        }
        let Vectors { x, y, z } = push;
        match walls.mirrors() {
            Some(mirrors) => {
                let pass = WithImages::new(pass, mirrors);
                core.sum(&pass, mirrors.columns_after([s]), [&mut x[..], y, z]);
            }
            None => core.sum(&pass, [s], [&mut x[..], y, z]),
        }
    }

    /// Finds the dρ/dt of velocities, or of accelerations in a second.
    pub fn find_rate_of(&mut self, core: &Core, walls: &Walls, velocity: &Vectors, of: RateOf<'_>) {
        let is_completed = self.continuation == Continuation::Linear && walls.mirrors().is_none();
        let (whole, open) = match of {
            RateOf::Velocity(whole) => (Some(whole), None),
            RateOf::BeforeGaps(whole, open) => (Some(whole), Some(open)),
            RateOf::Pressure => (None, None),
        };
        let own = velocity;
        let velocity = if is_completed {
            let completed = &mut self.completed;
            match whole {
                Some(whole) => {
                    walls.complete_velocities(velocity, (&core.particles.position, whole), open, completed);
                }
                None => walls.complete(velocity, completed),
            }
            &self.completed
        } else {
            velocity
        };
        let pass = Squeeze {
            constants: Constants::of(&core.parameters),
            walls,
            velocity,
            continuation: self.continuation,
            with_walls: whole.is_some(),
            open: open.map(|open| (open, own)),
        };
        if let Some(correction) = &self.correction {
            correction.rate(core, pass, &mut self.rate);
            return;
        }
        let Vectors { x, y, z } = velocity;
        match walls.mirrors() {
            Some(mirrors) => {
                let pass = WithImages::new(pass, mirrors);
                core.sum(&pass, mirrors.columns_after([&x[..], y, z]), [&mut self.rate]);
            }
            None => core.sum(&pass, [&x[..], y, z], [&mut self.rate]),
        }
    }

    /// Notes the part of the walls in a(s) = M·(a of the pairs − 2ρ₀s·∇λ), for the system that changes
    /// velocities. The rest density is in kg/m³.
    pub fn note_walls(
        &self,
        reaction: Reaction<'_>,
        walls: &Walls,
        rest_density: f64,
        (push, s): (&Vectors, &[f64]),
    ) {
        walls.found().par_iter().with_min_len(CHUNK / 4).for_each(|(i, (wall, completion))| {
            let i = *i as usize;
            let (push, factor) = (push.get(i), -2.0 * rest_density * s[i]);
            let of_pairs = completion.inverse() * push - factor * wall.gradient;
            let by_pressure = push - of_pairs;
            let pushed = Pushed { by_pressure, factor, gradient: wall.gradient, ..Pushed::default() };
            reaction.add(i, pushed);
        });
    }

    /// Memory of this solver, bytes.
    pub fn bytes(&self) -> usize {
        let columns = [&self.s, &self.factor, &self.rate, &self.last];
        columns.map(|column| 8 * column.capacity()).iter().sum::<usize>()
            + self.push.bytes()
            + self.completed.bytes()
            + self.correction.as_ref().map_or(0, Correction::bytes)
    }
}

/// The guess after a step along the gradient, not below zero.
#[inline]
fn projected(scale: f64, s: f64, error: f64, factor: f64) -> f64 {
    (s + scale * error / factor).max(0.0)
}

/// The stiffness with which a solve begins.
fn least_stiffness(continuation: Continuation, parameters: &Parameters) -> f64 {
    let [velocities, places] = STIFFNESS;
    let factor = match continuation {
        Continuation::Linear => velocities,
        Continuation::Barrier => places,
    };
    factor * stiffness(parameters.support_radius / parameters.spacing())
}

/// Greatest eigenvalue over diagonal in an even fluid with `ratio` spacings per support radius. It belongs to
/// pressure waves of the length 1.65 h, and was found by quadrature of (∫ ∇W sin kx)²·ρ/m / ∫|∇W|².
fn stiffness(ratio: f64) -> f64 {
    1.775 * (0.5 * ratio).powi(3)
}
