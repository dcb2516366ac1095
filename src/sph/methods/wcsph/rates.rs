//! The rates of a particle: what follows from the sums over its neighbours and from the walls near it.

use glam::DVec3;

use super::super::{
    near_walls::NearWalls,
    negative_pressure::NegativePressure,
    roughness,
    shifting::{depth, falling_rate, return_rate},
    viscosity::SpinSums,
};
use super::Gradients;
use super::at_edges::{Edge, Edges};
use super::linear::{Held, Linear};
use super::numbers::{Numbers, at_rest};
use crate::sph::{
    core::Core,
    kernel::Wendland,
    params::Parameters,
    particles::Vectors,
    reaction::Reaction,
    walls::{Coverage, Friction, Pushed, WallDrag},
};

/// Between these values of Σ V W, with the part of a wall, a particle at the wall begins to take part in the
/// balance of the fluid. Spray has less, and a surface at rest more.
const HELD: [f64; 2] = [0.7, 0.8];

/// The density may exceed the sum over particles by this part of the rest density without being lowered.
/// Particles that have come to rest in disorder, and the layers of walls beside them, make an error of this
/// size. With 0 still water eight layers deep sinks by a hundredth, and its pressure is off by twice as much.
/// With 0.03 water that has splashed stands 2 % too high.
pub(super) const LOOSE: f64 = 0.02;

/// How far a particle at a wall takes part in the balance of the fluid, 0 to 1, from its Σ V W.
fn held(filled: f64) -> f64 {
    let [spray, surface] = HELD;
    ((filled - spray) / (surface - spray)).clamp(0.0, 1.0)
}

/// The data of the pass over pairs besides the columns that it sums.
#[derive(Clone, Copy)]
pub(super) struct Rates<'a> {
    numbers: &'a Numbers,
    parameters: &'a Parameters,
    core: &'a Core,
    velocity: &'a Vectors,
    pressure: &'a [f64],
    /// ρ − ρ₀, kg/m³, less the excess in a fluid at rest where the sums do not include crowding.
    excess: &'a [f64],
    pub kernel: Wendland,
    /// The factor V·c of V∇W = −V·c·(1 − q)³·r.
    steepness: f64,
    /// The factor 2δ·h/2·c·ρ₀ of the diffusion, over ρ₀.
    diffusion: f64,
    /// Kinematic viscosity ν = μ/ρ₀, m²/s.
    pub laminar: f64,
    /// The factor α·h/2·c·ρ₀ of the artificial viscosity.
    pub artificial: f64,
    /// Densities before the step, kg/m³.
    density: &'a [f64],
    /// Whether pressures act by their differences in the fluid's depth.
    differences: bool,
    /// Rate at which densities return to those of the places, 1/s.
    return_rate: f64,
    /// Rate at which they return where there is room, 1/s.
    closing_rate: f64,
    /// The density that kernels miss before a free surface, as a part of the rest density; zero where it is
    /// not computed.
    missing: &'a [f64],
    /// Σ V W on a lattice.
    lattice: f64,
    /// The mean density by places to which densities return, over the rest density.
    pub mean_filled: f64,
    /// Viscous forces that replace those along lines, with the walls near particles.
    pub spin: Option<(SpinSums<'a>, &'a NearWalls<Coverage<WallDrag>>)>,
    /// The edges on walls of a fluid under tension.
    pub edges: Option<Edges<'a>>,
    /// Receives the forces of walls, if they are wanted.
    reaction: Option<Reaction<'a>>,
}

impl<'a> Rates<'a> {
    pub fn new(
        core: &'a Core,
        numbers: &'a Numbers,
        velocity: &'a Vectors,
        pressure: &'a [f64],
        excess: &'a [f64],
        missing: &'a [f64],
        dt: f64,
    ) -> Self {
        let parameters = &core.parameters;
        let kernel = Wendland::new(parameters.support_radius);
        let smoothing = 0.5 * parameters.support_radius;
        Self {
            numbers,
            parameters,
            core,
            velocity,
            pressure,
            excess,
            kernel,
            steepness: parameters.volume_in_sums() * kernel.steepness,
            diffusion: 2.0 * numbers.density_diffusion * smoothing * numbers.sound_speed,
            laminar: parameters.viscosity / parameters.rest_density,
            artificial: parameters.rest_density
                * roughness::factor(
                    numbers.artificial_viscosity,
                    numbers.sound_speed,
                    parameters.support_radius,
                    dt,
                ),
            density: &core.particles.density,
            differences: numbers.gradients == Gradients::Differences,
            return_rate: return_rate(core),
            closing_rate: return_rate(core).max(falling_rate(core)),
            missing,
            lattice: Wendland::lattice_sum(parameters.support_radius / parameters.spacing()),
            mean_filled: 1.0,
            spin: None,
            edges: None,
            reaction: Reaction::of(core, dt),
        }
    }
}

/// What a pass over pairs sums besides what all of them do.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contents {
    /// Laminar viscosity.
    pub laminar: bool,
    /// Artificial viscosity.
    pub artificial: bool,
    /// Crowding, and pressures by their differences.
    pub even: bool,
}

/// The sums of a particle over its neighbours. With f = (1 − q)³ and d from the neighbour:
pub(super) struct Sums {
    /// Σ f·(p_j ± p_i + Π)·d.
    pub push: DVec3,
    /// Σ f·(v_i − v_j)·d.
    pub departing: f64,
    /// Σ f·(ρ_j − ρ_i).
    pub denser: f64,
    /// Σ f·d.
    pub crowding: DVec3,
    /// Σ f·d².
    pub squares: f64,
    /// Σ W, without the kernel's constant.
    pub weights: f64,
    /// Σ f·((v_j − v_i)·d)·d/d².
    pub rubbing: DVec3,
    /// Σ W·v_j, without the kernel's constant.
    pub velocities: DVec3,
    /// Σ f·(ρ_j − ρ₀)·d of a fluid that is shifted.
    pub denser_along: DVec3,
    /// The tensors of differences of pressure.
    pub linear: Option<Linear>,
}

/// Viscous forces on a particle, and the walls near it.
struct Viscous {
    /// By neighbours and walls, m/s².
    drag: DVec3,
    /// The part of walls alone, m/s².
    by_walls: DVec3,
    friction: WallDrag,
    wall: Option<Coverage>,
}

/// How much of a particle's kernel neighbours and walls fill.
struct Filling {
    /// Σ V∇W over the neighbours, 1/m.
    crowding_by_pairs: DVec3,
    /// That with the walls.
    crowding: DVec3,
    /// Σ V W with the walls, over that on a lattice.
    filled: f64,
    /// The density that places say, kg/m³.
    places: f64,
    /// How fast walls approach, in units of the kernel that they take.
    wall_rate: f64,
    /// The part of that by which walls themselves move towards the particle.
    swept: f64,
    /// What walls add to the density, kg/m³, and how fast that grows by the motion of the particle, kg/m³/s.
    of_walls: f64,
    rate_of_walls: f64,
    /// `filled` with what kernels miss before a free surface.
    whole: f64,
    /// How far the particle belongs to the depth of the fluid, 0 to 1.
    depth: f64,
    /// How far pressures act by their differences, 0 to 1.
    smooth: f64,
    /// The factor by which gradients are those of a full kernel.
    mean: f64,
}

/// What pressures do to a particle.
struct Pressed {
    /// The force per volume, N/m³.
    push: DVec3,
    /// That by neighbours alone.
    by_pairs: DVec3,
    /// The rate −∇·v at which the fluid is compressed, 1/s.
    compression: f64,
    /// `wall_rate` with what is known at edges.
    wall_rate: f64,
}

// inlined, so that what a pass does not sum costs it nothing
impl Rates<'_> {
    /// The results of a particle: acceleration, rate of the density and the density that places say, its drift, the part of
    /// its kernel that is filled, crowding, the mean velocity around it, how far it belongs to the depth, and what walls add
    /// to the density, with the rate of that by the particle's motion.
    #[inline(always)]
    pub fn finish(&self, i: usize, contents: Contents, sums: &Sums) -> [f64; 16] {
        let parameters = self.parameters;
        let rest = parameters.rest_density;
        let velocity = self.velocity.get(i);
        let viscous = self.viscous(i, contents, sums, velocity);
        let filling = self.filling(i, contents, sums, viscous.wall.as_ref(), velocity);
        let density = rest + filling.smooth * self.excess[i];
        let pressed = self.pressed(i, sums, &filling, viscous.wall.as_ref(), (velocity, density));
        self.act_on_walls(i, contents, &viscous, (&pressed, filling.mean), (velocity, density));
        let Filling { crowding, crowding_by_pairs, filled, depth, mean, .. } = filling;
        let acceleration = pressed.push / density + mean * viscous.drag + parameters.gravity;
        // where the fluid is denser because it is compressed, particles do not crowd
        let compressed = self.steepness * sums.denser_along + self.excess[i] * (crowding_by_pairs - crowding);
        let evening = depth * (crowding + compressed / rest);
        // differences of pressure make waves grow, so all motion is damped
        let around = if contents.artificial && !self.differences {
            sums.velocities / sums.weights
        } else {
            DVec3::ZERO
        };
        let (rate, places) = if self.differences {
            (0.0, 0.0)
        } else {
            (rest * (-self.steepness * sums.departing + 2.0 * pressed.wall_rate), filling.places)
        };
        let drift = self.drift(i, contents, sums, &filling, density * pressed.compression);
        [
            acceleration.x,
            acceleration.y,
            acceleration.z,
            rate,
            places,
            drift,
            rest * filled,
            evening.x,
            evening.y,
            evening.z,
            around.x,
            around.y,
            around.z,
            depth,
            filling.of_walls,
            filling.rate_of_walls,
        ]
    }

    /// The viscous force on a particle. A fluid without viscosity feels no friction, and most have none.
    #[inline(always)]
    fn viscous(&self, i: usize, contents: Contents, sums: &Sums, velocity: DVec3) -> Viscous {
        let laminar = self.laminar;
        let drag = match self.spin {
            Some((sums, _)) => sums.drag(i, laminar),
            None => 10.0 * laminar * self.steepness * sums.rubbing,
        };
        let (by_walls, friction) = (DVec3::ZERO, WallDrag::default());
        if !contents.laminar {
            return Viscous { drag, by_walls, friction, wall: self.core.coverage::<()>(i) };
        }
        let near = match self.spin {
            Some((_, walls)) => walls.near(i).copied(),
            None => self.core.coverage::<WallDrag>(i),
        };
        match near {
            None => Viscous { drag, by_walls, friction, wall: None },
            Some(wall) => Viscous {
                drag: wall.friction.complete(drag, velocity, laminar),
                by_walls: wall.friction.by_walls(drag, velocity, laminar),
                friction: wall.friction,
                wall: Some(wall.without_friction()),
            },
        }
    }

    #[inline(always)]
    fn filling(
        &self,
        i: usize,
        contents: Contents,
        sums: &Sums,
        wall: Option<&Coverage>,
        velocity: DVec3,
    ) -> Filling {
        let rest = self.parameters.rest_density;
        let crowding_by_pairs = -self.steepness * sums.crowding;
        let by_weight = self.parameters.mass_in_sums() * self.kernel.weight * sums.weights;
        let (mut crowding, mut spread) = (crowding_by_pairs, self.steepness * sums.squares / 3.0);
        let (mut filled, mut places) = (by_weight / (rest * self.lattice), by_weight);
        let (mut wall_rate, mut swept) = (0.0, 0.0);
        let (mut of_walls, mut rate_of_walls) = (0.0, 0.0);
        if let Some(wall) = wall {
            crowding += wall.gradient;
            spread += wall.share();
            wall_rate = wall.gradient.dot(velocity) - wall.sweep;
            swept = wall_rate.min(-wall.sweep);
            filled += wall.filled;
            (of_walls, rate_of_walls) = (2.0 * rest * wall.part, 2.0 * rest * wall.gradient.dot(velocity));
            places += of_walls;
        }
        // a gap beside a wall is no free surface
        let missing = self.missing[i];
        let whole = filled + if wall.is_some() { missing.min((1.0 - filled).max(0.0)) } else { missing };
        let depth = depth(if contents.even { spread } else { filled });
        let smooth = if self.differences { depth } else { 0.0 };
        let mean = if smooth > 0.0 { 1.0 + smooth * (1.0 / spread - 1.0) } else { 1.0 };
        Filling {
            crowding_by_pairs,
            crowding,
            filled,
            places,
            wall_rate,
            swept,
            of_walls,
            rate_of_walls,
            whole,
            depth,
            smooth,
            mean,
        }
    }

    /// The force by pressures, and how fast the fluid is compressed. Where pressures do not act by differences, a
    /// particle's own pressure pushes particles apart, and walls push like mirror images; without crowding the sums
    /// already contain the part of the pairs.
    #[inline(always)]
    fn pressed(
        &self,
        i: usize,
        sums: &Sums,
        filling: &Filling,
        wall: Option<&Coverage>,
        (velocity, density): (DVec3, f64),
    ) -> Pressed {
        let Filling { smooth, mean, .. } = *filling;
        let (steepness, pressure) = (self.steepness, self.pressure[i]);
        let mut wall_rate = filling.wall_rate;
        let pairs = steepness * sums.push;
        let by_pairs = pairs - 2.0 * pressure * filling.crowding_by_pairs;
        let blended = pairs - (1.0 - smooth) * 2.0 * pressure * filling.crowding;
        let mut push = blended;
        if let Some(wall) = wall {
            let balanced = if self.differences {
                1.0
            } else {
                filling.depth.max(held(filling.filled) * self.calm(i, velocity))
            };
            push = push.lerp(wall.completion() * push, balanced);
            if let Some(Edge { normal, weight, compression }) = self.edges.and_then(|edges| edges.at(i)) {
                let even = -2.0 * (1.0 - smooth) * pressure * normal;
                push = push.lerp(wall.completion() * pairs + even, weight);
                wall_rate += weight * (compression - wall_rate);
            }
        }
        push *= mean;
        let mut compression = mean * (-steepness * sums.departing + wall_rate);
        if let Some(linear) = sums.linear.filter(|_| smooth > 0.0) {
            let held = wall.map_or_else(Held::default, |_| Held {
                weight: self.core.box_moments(i),
                push: -density * self.core.gravity(i),
            });
            push = push.lerp(linear.gradient(steepness, blended, &held), smooth);
            // before a surface too few neighbours lie on one side, and what is exact is noisy
            if self.numbers.fills_room {
                let exact = linear.compression(steepness, wall, wall_rate);
                compression += smooth * (exact - compression);
            }
        }
        Pressed { push, by_pairs, compression, wall_rate }
    }

    /// Notes what the particle does to the walls near it, if somebody asks for it.
    #[inline(always)]
    fn act_on_walls(
        &self,
        i: usize,
        contents: Contents,
        viscous: &Viscous,
        (pressed, mean): (&Pressed, f64),
        (velocity, density): (DVec3, f64),
    ) {
        let (Some(wall), Some(reaction)) = (&viscous.wall, &self.reaction) else { return };
        let pushed = Pushed {
            by_pressure: (pressed.push - pressed.by_pairs) / density,
            factor: -2.0 * self.pressure[i] / density,
            gradient: wall.gradient,
            by_friction: mean * viscous.by_walls,
            velocity,
            viscosity: mean * self.laminar,
            ..Pushed::default()
        };
        let turned = self.spin.map(|(sums, _)| sums.with_couple(i, &viscous.friction, pushed));
        reaction.add(i, turned.unwrap_or(pushed));
        if contents.laminar {
            reaction.note_drag(i, mean * viscous.drag);
        }
    }

    /// The rate of the density besides that of the sums, kg/m³/s: diffusion, the return to what places say, and, with
    /// differences, all that the equation of continuity says.
    #[inline(always)]
    fn drift(&self, i: usize, contents: Contents, sums: &Sums, filling: &Filling, continuity: f64) -> f64 {
        let mut denser = self.diffusion * self.steepness * sums.denser;
        if contents.even {
            let at_rest = at_rest(self.numbers, self.parameters, self.core.gravity(i));
            denser -= self.diffusion * at_rest.dot(filling.crowding_by_pairs);
        }
        // a gap belongs to the depth before a surface as well
        let returning = if closes_gaps(self.numbers) { depth(filling.whole) } else { filling.depth };
        let drift = denser + returning * (self.returns(i, filling.whole) - self.rate_into_gap(i, filling));
        if self.differences { drift + continuity } else { drift }
    }

    /// How far a particle is at rest in the scene, 0 to 1: one up to the speed of a fall through a sixteenth
    /// of a spacing, and zero above that of a fall through an eighth. It is zero where nothing falls, because
    /// there is no weight to share.
    fn calm(&self, i: usize, velocity: DVec3) -> f64 {
        let fall = 0.125 * 2.0 * self.core.gravity(i).length() * self.parameters.spacing();
        if fall > 0.0 { (2.0 - 2.0 * velocity.length_squared() / fall).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The rate at which the density of a particle in the depth returns to that of its place, kg/m³/s.
    ///
    /// Where nothing pulls, a density below the rest density is as good as the rest density, and is left
    /// alone. A particle whose density is higher presses. If such a particle has room around it, its density
    /// belongs to another place, for instance a surface that a splash has folded in. Then the density falls
    /// until neighbours have filled the room. (If densities could not fall below the rest density, excess by
    /// disorder would raise them and nothing would lower them: water that comes to rest after a splash would
    /// stand 15 % too high, and a block that is lowered into it would raise it four times too far.)
    fn returns(&self, i: usize, filled: f64) -> f64 {
        let rest = self.parameters.rest_density;
        let (target, density) = (rest * filled / self.mean_filled, self.density[i]);
        if !closes_gaps(self.numbers) || target >= density {
            return self.return_rate * (target - density);
        }
        let gap = density - target - LOOSE * rest;
        if density > rest { -self.closing_rate * gap.max(0.0) } else { 0.0 }
    }

    /// The rate of density, kg/m³/s, that a wall causes which moves into the gap between itself and a surface. It compresses
    /// nothing as long as there is room. Away from surfaces gaps are disorder beside walls, which no motion of a wall
    /// closes. (What returns at the rate of a fall is too late: a rod that was lowered into water with 0.1 m/s pushed a gap
    /// of a spacing ahead, and its lift was that of a rod as much longer.)
    fn rate_into_gap(&self, i: usize, filling: &Filling) -> f64 {
        if filling.swept <= 0.0 || !closes_gaps(self.numbers) {
            return 0.0;
        }
        let rest = self.parameters.rest_density;
        let gap = self.density[i] - rest * filling.whole / self.mean_filled - LOOSE * rest;
        let at_surface = (self.missing[i] / (2.0 * LOOSE)).min(1.0);
        2.0 * rest * filling.swept * at_surface * (gap / (LOOSE * rest)).clamp(0.0, 1.0)
    }
}

/// Whether densities above the rest density fall where there is room: if pressures cannot pull, and act in
/// pairs.
pub(super) fn closes_gaps(numbers: &Numbers) -> bool {
    numbers.negative_pressure == NegativePressure::Clamp && numbers.gradients == Gradients::Pairs
}
