//! Scenes: keys with units and defaults → plain data for the solver.
//!
//! Invariant: after this stage every number is finite and in SI units, and every size is positive.

use glam::DVec3;

use super::Tolerance;
use super::eval::Lowering;
use super::probes::{Probe, Surroundings};
use super::value::Value;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::{Given, Interpreter, Node, Unary};
use crate::syntax::ast::{self, Entry, Expr, ExprKind, Name};
use crate::syntax::{Dimension, parse_unit};

/// What a simulation needs, as a file states it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub name: String,
    pub span: Span,
    /// The container.
    pub domain: Aabb,
    pub domain_span: Span,
    /// What the walls of the box do to a particle that hits them.
    pub walls: Bounce,
    /// Whether a fluid sticks to the walls of the box, and to obstacles that do not say otherwise.
    pub slip: Slip,
    /// The vessel within the box, if there is one: the fluid stays where it is positive.
    pub container: Option<Container>,
    pub fluid: Fluid,
    pub obstacles: Vec<Obstacle>,
    /// m/s², at the start.
    pub gravity: DVec3,
    /// The same as formulas of t, if it changes.
    pub turning_gravity: Option<[Node; 3]>,
    pub method: Method,
    pub solver: Solver,
    pub run: Run,
    /// What is known of the flow, to be compared with.
    pub truth: Option<Truth>,
    pub probes: Vec<Probe>,
    /// The largest error of ω that is accepted of its obstacles in the box, if one is stated.
    pub tolerance: Option<Tolerance>,
}

/// What becomes of a particle at a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounce {
    /// Part of the normal speed that is given back, 0 … 1.
    pub restitution: f64,
    /// Coefficient of friction μ.
    pub friction: f64,
}

/// Whether a fluid sticks to walls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slip {
    Free,
    No,
}

/// What a solid does to the fluid at its surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skin {
    pub bounce: Bounce,
    pub slip: Slip,
    /// Motion within the surface as formulas of x, y, z and t, m/s: of a belt, or of a cylinder that turns.
    pub velocity: Option<[Node; 3]>,
}

/// A vessel.
#[derive(Debug, Clone, PartialEq)]
pub struct Container {
    pub name: String,
    /// Positive outside the vessel: what the fluid meets.
    pub outside: Node,
    pub span: Span,
    pub skin: Skin,
}

/// A flow that is known, as formulas of x, y, z and t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Pa
    pub pressure: Option<Node>,
    /// m/s
    pub velocity: Option<[Node; 3]>,
    /// How far along x the fluid has come on the floor of the box, m: a formula of t alone.
    pub front: Option<Node>,
    /// From when on it holds, s.
    pub from: f64,
}

/// How a method is run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solver {
    /// Mean compression that `dfsph` accepts.
    pub compression: f64,
    /// Of its iterations, at most.
    pub iterations: usize,
    /// Of sums over neighbours; the method decides if it is not given.
    pub precision: Option<Precision>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    Single,
    Double,
}

/// The defaults are table 1 of the paper for its method, and those of water and of the particles' spacing for others.
#[derive(Debug, Clone, PartialEq)]
pub struct Fluid {
    pub name: String,
    /// Positive where particles are put at the start.
    pub shape: Node,
    pub shape_span: Span,
    /// Which part of the shape is taken when it has room for more particles than are wanted.
    pub fill: Fill,
    /// As many as fit if it is not given.
    pub particles: Option<usize>,
    pub particles_span: Option<Span>,
    /// Rest density ρ₀, kg/m³.
    pub density: f64,
    /// Of one particle, kg.
    pub mass: f64,
    /// Dynamic viscosity, Pa·s.
    pub viscosity: f64,
    /// N/m
    pub surface_tension: f64,
    /// |∇c| above which a particle belongs to the surface, the paper's l.
    pub threshold: f64,
    /// Gas stiffness k of p = k(ρ − ρ₀), J.
    pub stiffness: f64,
    /// h, m
    pub support_radius: f64,
    /// Speed of sound of `wcsph`, m/s; ten times the speed of a fall through the box if it is not given.
    pub sound_speed: Option<f64>,
    /// δ of the density diffusion of `wcsph`.
    pub density_diffusion: f64,
    /// α of the artificial viscosity of `wcsph`.
    pub artificial_viscosity: f64,
    /// Whether pressure may pull.
    pub negative_pressure: bool,
    /// Whether the fluid starts under the pressure of its own weight, `wcsph` only: otherwise it starts without, and rings.
    pub hydrostatic: bool,
    /// At the start, m/s.
    pub velocity: [Node; 3],
    /// Random displacement of the start positions, as a part of the particle spacing.
    pub jitter: f64,
    pub seed: u64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// The name of the solid, or `obstacle` for a shape written on the spot.
    pub name: String,
    pub shape: Node,
    pub span: Span,
    pub skin: Skin,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    /// From below, as a vessel is filled.
    Below,
    /// Where ω of the shape is largest: a drop of an exact number of particles.
    Middle,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Equations (8)–(14) of the paper, corrected.
    Paper,
    /// Weakly compressible.
    Wcsph,
    /// Divergence-free (Bender & Koschier 2017).
    Dfsph,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// Fixed time step, s; derived from the fluid if it is not given.
    pub dt: Option<f64>,
    /// End of the simulated time, s.
    pub until: f64,
    /// Time between saved frames, s.
    pub save_every: f64,
    /// Time between checkpoints, s; one goes with every frame if it is not given.
    pub checkpoint_every: Option<f64>,
}

const SCENE_KEYS: [&str; 13] = [
    "units",
    "box",
    "container",
    "fluid",
    "obstacle",
    "gravity",
    "walls",
    "method",
    "solver",
    "run",
    "truth",
    "probe",
    "tolerance",
];
/// Keys that open a block; all others have a value.
const BLOCKS: [&str; 9] =
    ["box", "container", "fluid", "obstacle", "solver", "run", "truth", "probe", "flux"];
const TRUTH_KEYS: [&str; 4] = ["pressure", "velocity", "front", "from"];
const BOX_KEYS: [&str; 4] = ["min", "max", "restitution", "friction"];
const SOLVER_KEYS: [&str; 3] = ["compression", "iterations", "precision"];
const FLUID_KEYS: [&str; 19] = [
    "shape",
    "fill",
    "particles",
    "density",
    "mass",
    "spacing",
    "viscosity",
    "surface_tension",
    "threshold",
    "stiffness",
    "support_radius",
    "sound_speed",
    "density_diffusion",
    "artificial_viscosity",
    "negative_pressure",
    "start",
    "velocity",
    "jitter",
    "seed",
];
const OBSTACLE_KEYS: [&str; 5] = ["solid", "restitution", "friction", "walls", "surface_velocity"];
const FREE_SLIP: (&str, Slip) = ("free_slip", Slip::Free);
const NO_SLIP: (&str, Slip) = ("no_slip", Slip::No);
const RUN_KEYS: [&str; 4] = ["dt", "until", "save_every", "checkpoint_every"];

/// The entries of a block whose keys are known, each at most once unless it may be repeated.
pub(super) struct Block<'a> {
    pub entries: &'a [Entry],
    what: &'static str,
    pub span: Span,
}

/// What a number may be.
#[derive(Clone, Copy)]
pub(super) enum Bound {
    Positive,
    NotNegative,
    Fraction,
}

impl<'a> Lowering<'a> {
    pub fn scene(&mut self, scene: &'a ast::Scene) -> Option<Scene> {
        let errors_before = self.errors();
        let block = self.block(
            &scene.entries,
            "a scene",
            scene.name.span,
            &SCENE_KEYS,
            &["obstacle", "fluid", "probe"],
        );
        self.units(&block);
        let domain = self.domain(&block);
        let words = [("paper", Method::Paper), ("wcsph", Method::Wcsph), ("dfsph", Method::Dfsph)];
        let method = self.word_key(&block, "method", &words).map(|stated| self.method.unwrap_or(stated));
        let fluid = self.fluid(&block, method.unwrap_or(Method::Paper));
        let slip = self.word_key(&block, "walls", &[FREE_SLIP, NO_SLIP]);
        let walls = slip.unwrap_or(Slip::Free);
        let container = self.container(&block, walls);
        let solver = self.solver(&block);
        let obstacles: Vec<Obstacle> = block
            .blocks("obstacle")
            .filter_map(|(_, entries, span)| self.obstacle(entries, span, "an obstacle", walls))
            .collect();
        let gravity = self.gravity(&block);
        let truth = self.truth(&block);
        let run = self.run(&block);
        let probes = match (&domain, &fluid) {
            (Some((domain, ..)), Some(fluid)) => {
                let container = container.iter().map(|c| &c.name[..]);
                let bodies = container.chain(obstacles.iter().map(|o| &o.name[..])).collect();
                self.probes(&block, &Surroundings { domain: *domain, bodies, fluid: &fluid.name })
            }
            _ => Vec::new(),
        };
        let tolerance = block.setting("tolerance").and_then(|(_, value)| self.tolerance(value));
        if self.errors() > errors_before {
            return None;
        }
        let (domain, walls, domain_span) = domain?;
        Some(Scene {
            name: scene.name.text.clone(),
            span: scene.name.span,
            domain,
            domain_span,
            walls,
            slip: slip?,
            container,
            fluid: fluid?,
            obstacles,
            gravity: gravity?.0,
            turning_gravity: gravity?.1,
            method: method?,
            solver: solver?,
            run: run?,
            truth: truth?,
            probes,
            tolerance,
        })
    }

    /// A tolerance of ω; what it may not be is reported.
    pub fn tolerance(&mut self, value: &Expr) -> Option<Tolerance> {
        let number = self.quantity_expr(value, Dimension::NONE, "tolerance")?;
        if number > 0.0 && number.is_finite() {
            return Some(Tolerance { value: number, span: value.span });
        }
        let message = format!("`tolerance` must be positive and finite, found {number}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    fn errors(&self) -> usize {
        self.diagnostics.iter().filter(|d| d.severity == crate::diagnostic::Severity::Error).count()
    }

    pub(super) fn missing(&mut self, block: &Block<'_>, key: &str, help: &str) {
        if block.entries.iter().any(|entry| entry.key().text == key) {
            return; // there, but of the wrong form, which was reported
        }
        let message = format!("{} needs `{key}`", block.what);
        self.report(Diagnostic::error(Code::SCENE_MISSING, block.span, message).help(help));
    }

    /// Reports unknown keys, and known ones that stand twice.
    pub(super) fn block<'b>(
        &mut self,
        entries: &'b [Entry],
        what: &'static str,
        span: Span,
        known: &[&'static str],
        repeatable: &[&str],
    ) -> Block<'b> {
        for (i, entry) in entries.iter().enumerate() {
            let key = entry.key();
            if !known.contains(&key.text.as_str()) {
                let message = format!("{what} has no key `{}`", key.text);
                let diagnostic = Diagnostic::error(Code::SCENE_KEY, key.span, message)
                    .help(format!("its keys are {}", known.join(", ")))
                    .suggest(&key.text, known.iter().copied());
                self.report(diagnostic);
            } else if matches!(entry, Entry::Block { .. }) != BLOCKS.contains(&key.text.as_str()) {
                let (is, form) = match entry {
                    Entry::Block { .. } => ("has a value", format!("{}: …", key.text)),
                    Entry::Setting { .. } => ("is a block", format!("{} {{ … }}", key.text)),
                };
                let message = format!("`{}` {is}", key.text);
                self.report(
                    Diagnostic::error(Code::SCENE_KEY, key.span, message).help(format!("write `{form}`")),
                );
            } else if let Some(first) = entries[..i].iter().find(|e| e.key().text == key.text)
                && !repeatable.contains(&key.text.as_str())
            {
                let message = format!("`{}` stands twice", key.text);
                self.report(
                    Diagnostic::error(Code::SCENE_REPEATED, key.span, message)
                        .label(first.key().span, "first stated here"),
                );
            }
        }
        Block { entries, what, span }
    }

    fn units(&mut self, block: &Block<'_>) {
        if let Some((_, value)) = block.setting("units")
            && value.kind != ExprKind::Text("SI".into())
        {
            let message = "the only system of units is \"SI\"";
            self.report(
                Diagnostic::error(Code::UNIT_MISMATCH, value.span, message)
                    .help("write other units at the numbers themselves: `20 mm`"),
            );
        }
    }

    fn domain(&mut self, block: &Block<'_>) -> Option<(Aabb, Bounce, Span)> {
        let Some((_, entries, span)) = block.blocks("box").next() else {
            self.missing(block, "box", "write `box { min: [0, 0, 0], max: [3, 3, 3] }`");
            return None;
        };
        let block = self.block(entries, "a box", span, &BOX_KEYS, &[]);
        let min = self.vector_key(&block, "min", Dimension::LENGTH, DVec3::ZERO);
        if block.setting("max").is_none() {
            self.missing(&block, "max", "write `max: [3, 3, 3]`");
        }
        let max = self.vector_key(&block, "max", Dimension::LENGTH, DVec3::ONE);
        let bounce = self.bounce(&block);
        let (min, max) = (min?, max?);
        if !max.cmpgt(min).all() {
            let message = format!("the box has no room: its size is {}", max - min);
            self.report(
                Diagnostic::error(Code::OUT_OF_RANGE, span, message)
                    .help("max must exceed min along x, y and z"),
            );
            return None;
        }
        Some((Aabb::new(min, max), bounce?, span))
    }

    fn bounce(&mut self, block: &Block<'_>) -> Option<Bounce> {
        let restitution = self.number_key(block, "restitution", Dimension::NONE, Some(0.5), Bound::Fraction);
        let friction = self.number_key(block, "friction", Dimension::NONE, Some(0.0), Bound::NotNegative);
        Some(Bounce { restitution: restitution?, friction: friction? })
    }

    fn container(&mut self, block: &Block<'a>, walls: Slip) -> Option<Container> {
        let (_, entries, span) = block.blocks("container").next()?;
        let Obstacle { name, shape, span, skin } = self.obstacle(entries, span, "a container", walls)?;
        let outside = self.module.graph.unary(Unary::Neg, shape);
        Some(Container { name, outside, span, skin })
    }

    /// What a solid does at its surface; the fluid sticks to it as to all `walls`, unless it says otherwise.
    fn skin(&mut self, block: &Block<'_>, walls: Slip) -> Option<Skin> {
        let bounce = self.bounce(block);
        let words = if walls == Slip::No { [NO_SLIP, FREE_SLIP] } else { [FREE_SLIP, NO_SLIP] };
        let slip = self.word_key(block, "walls", &words)?;
        let velocity = match block.setting("surface_velocity") {
            Some((key, value)) => {
                if slip == Slip::Free {
                    let message = "a surface along which the fluid slips does not take it along";
                    self.report(
                        Diagnostic::error(Code::SCENE_KEY, key.span, message)
                            .help("write `walls: no_slip` beside it, or leave `surface_velocity` out"),
                    );
                }
                Some(self.components(value, Dimension::SPEED, "surface_velocity")?)
            }
            None => None,
        };
        Some(Skin { bounce: bounce?, slip, velocity })
    }

    fn solver(&mut self, block: &Block<'_>) -> Option<Solver> {
        let (entries, span) =
            block.blocks("solver").next().map_or((&[][..], block.span), |(_, entries, span)| (entries, span));
        let block = self.block(entries, "a solver", span, &SOLVER_KEYS, &[]);
        let compression =
            self.number_key(&block, "compression", Dimension::NONE, Some(1e-4), Bound::Positive);
        let iterations = self.count_key(&block, "iterations", 1);
        let precision = self.word_key(
            &block,
            "precision",
            &[("auto", None), ("f32", Some(Precision::Single)), ("f64", Some(Precision::Double))],
        );
        Some(Solver {
            compression: compression?,
            iterations: iterations?.unwrap_or(100),
            precision: precision?,
        })
    }

    fn fluid(&mut self, block: &Block<'_>, method: Method) -> Option<Fluid> {
        let mut fluids = block.blocks("fluid");
        let Some((label, entries, span)) = fluids.next() else {
            self.missing(
                block,
                "fluid",
                "write `fluid water { shape: ball([1.5, 1.5, 2], 0.4), particles: 10000 }`",
            );
            return None;
        };
        if let Some((_, _, second)) = fluids.next() {
            let message = "a second fluid: this version simulates one fluid";
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, second, message).label(span, "the first fluid"),
            );
        }
        let block = self.block(entries, "a fluid", span, &FLUID_KEYS, &[]);
        let shape = match block.setting("shape") {
            Some((_, value)) => self.field(value).map(|node| (node, value.span)),
            None => {
                self.missing(&block, "shape", "write `shape: ball([1.5, 1.5, 2], 0.4)` or any other solid");
                None
            }
        };
        let fill = self.word_key(&block, "fill", &[("below", Fill::Below), ("middle", Fill::Middle)]);
        let mut number =
            |key, dimension, default, bound| self.number_key(&block, key, dimension, Some(default), bound);
        use Bound::{Fraction, NotNegative, Positive};
        let density = number("density", Dimension::DENSITY, 998.29, Positive);
        let paper = method == Method::Paper;
        let mass = number("mass", Dimension::MASS, 0.02, Positive);
        let spacing = number("spacing", Dimension::LENGTH, 0.02, Positive);
        let viscosity =
            number("viscosity", Dimension::VISCOSITY, if paper { 3.5 } else { 1e-3 }, NotNegative);
        let surface_tension =
            number("surface_tension", Dimension::TENSION, if paper { 0.0728 } else { 0.0 }, NotNegative);
        let threshold = number("threshold", Dimension::NONE, 7.065, Positive);
        let stiffness = number("stiffness", Dimension::ENERGY, 3.0, Positive);
        let sound_speed = number("sound_speed", Dimension::SPEED, 1.0, Positive);
        let density_diffusion = number("density_diffusion", Dimension::NONE, 0.1, NotNegative);
        let artificial_viscosity = number("artificial_viscosity", Dimension::NONE, 0.02, NotNegative);
        let (mass, density) = (mass?, density?);
        // a spacing says as much as a mass
        let mass = if block.setting("spacing").is_some() { density * spacing?.powi(3) } else { mass };
        // many neighbours make pressures smooth, and the incompressible solver slow
        let own_support = match method {
            Method::Paper => 0.1,
            Method::Wcsph => 2.6 * (mass / density).cbrt(),
            Method::Dfsph => 2.2 * (mass / density).cbrt(),
        };
        let support_radius =
            self.number_key(&block, "support_radius", Dimension::LENGTH, Some(own_support), Positive);
        let mut number =
            |key, dimension, default, bound| self.number_key(&block, key, dimension, Some(default), bound);
        let jitter = number("jitter", Dimension::NONE, 0.0, Fraction);
        if let (Some((first, _)), Some((second, _))) = (block.setting("mass"), block.setting("spacing")) {
            let message = "`mass` and `spacing` say the same: the mass of a particle is density·spacing³";
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, second.span, message)
                    .label(first.span, "the mass is stated here"),
            );
        }
        if let (Some((_, value)), false) = (block.setting("surface_tension"), paper)
            && surface_tension.is_some_and(|tension| tension > 0.0)
        {
            let message = "surface tension is known to the method `paper` only";
            self.report(
                Diagnostic::error(Code::SCENE_KEY, value.span, message)
                    .help("leave `surface_tension` out, or write `method: paper`"),
            );
        }
        let negative_pressure =
            self.word_key(&block, "negative_pressure", &[("clamp", false), ("keep", true)]);
        let hydrostatic = self.word_key(&block, "start", &[("free", false), ("hydrostatic", true)]);
        let sound_speed = block.setting("sound_speed").is_some().then_some(sound_speed?);
        let velocity = self.velocity(&block);
        let particles = self.count_key(&block, "particles", 1);
        let seed = self.count_key(&block, "seed", 0);
        let particles_span = block.setting("particles").map(|(_, value)| value.span);
        let (shape, shape_span) = shape?;
        Some(Fluid {
            name: label.map_or_else(|| "fluid".into(), |label| label.text.clone()),
            shape,
            shape_span,
            fill: fill?,
            particles: particles?,
            particles_span,
            density,
            mass,
            viscosity: viscosity?,
            surface_tension: surface_tension?,
            threshold: threshold?,
            stiffness: stiffness?,
            support_radius: support_radius?,
            sound_speed,
            density_diffusion: density_diffusion?,
            artificial_viscosity: artificial_viscosity?,
            negative_pressure: negative_pressure?,
            hydrostatic: hydrostatic?,
            velocity: velocity?,
            jitter: jitter?,
            seed: seed?.unwrap_or(1) as u64,
        })
    }

    /// Gravity at the start, and as formulas if it depends on t.
    fn gravity(&mut self, block: &Block<'_>) -> Option<(DVec3, Option<[Node; 3]>)> {
        let Some((_, value)) = block.setting("gravity") else {
            return Some((DVec3::new(0.0, 0.0, -9.81), None));
        };
        let nodes = self.components(value, Dimension::ACCELERATION, "gravity")?;
        let turns = nodes.iter().any(|&node| self.module.graph.constant_value(node).is_none());
        if !turns {
            return self
                .vector_key(block, "gravity", Dimension::ACCELERATION, DVec3::ZERO)
                .map(|gravity| (gravity, None));
        }
        if nodes.iter().any(|&node| self.depends_on_place(node)) {
            let message = "`gravity` may depend on the time t, not on the place";
            self.report(Diagnostic::error(Code::NOT_CONSTANT, value.span, message));
            return None;
        }
        let mut start = [0.0; 3];
        let given = Given { time: 0.0, ..Given::point([0.0; 3]) };
        Interpreter::new(&self.module.graph, &nodes).eval_given(given, &mut start);
        Some((DVec3::from_array(start), Some(nodes)))
    }

    fn truth(&mut self, block: &Block<'_>) -> Option<Option<Truth>> {
        let Some((_, entries, span)) = block.blocks("truth").next() else { return Some(None) };
        let block = self.block(entries, "a truth", span, &TRUTH_KEYS, &[]);
        let mut formula = |key| match block.setting(key) {
            Some((_, value)) => {
                let found = self.expr(value);
                Some(Some((self.as_number(&found, value.span)?, value.span)))
            }
            None => Some(None),
        };
        let (pressure, front) = (formula("pressure")?.map(|(node, _)| node), formula("front")?);
        if let Some((node, span)) = front
            && self.depends_on_place(node)
        {
            let message = "`front` may depend on the time t, not on the place";
            self.report(Diagnostic::error(Code::NOT_CONSTANT, span, message));
            return None;
        }
        let front = front.map(|(node, _)| node);
        let velocity = match block.setting("velocity") {
            Some((_, value)) => Some(self.components(value, Dimension::SPEED, "velocity")?),
            None => None,
        };
        if pressure.is_none() && velocity.is_none() && front.is_none() {
            let help = "write `pressure: 1000*9.81*(1 - z)`, `velocity: [..]` or `front: 2*t`";
            self.missing(&block, "pressure", help);
            return None;
        }
        let from = self.number_key(&block, "from", Dimension::TIME, Some(0.0), Bound::NotNegative)?;
        Some(Some(Truth { pressure, velocity, front, from }))
    }

    /// Three speeds, which may depend on the place.
    fn velocity(&mut self, block: &Block<'_>) -> Option<[Node; 3]> {
        match block.setting("velocity") {
            Some((_, value)) => self.components(value, Dimension::SPEED, "velocity"),
            None => Some([self.module.graph.constant(0.0); 3]),
        }
    }

    /// The components of a vector, formulas or quantities.
    fn components(&mut self, value: &Expr, dimension: Dimension, key: &str) -> Option<[Node; 3]> {
        let mut nodes = Vec::new();
        if let ExprKind::Vector(parts) = &value.kind
            && parts.len() == 3
        {
            for part in parts {
                let node = match &part.kind {
                    ExprKind::Quantity { .. } => {
                        let number = self.quantity_expr(part, dimension, key)?;
                        self.module.graph.constant(number)
                    }
                    ExprKind::Negate(inner) if matches!(inner.kind, ExprKind::Quantity { .. }) => {
                        let number = self.quantity_expr(part, dimension, key)?;
                        self.module.graph.constant(number)
                    }
                    _ => {
                        let value = self.expr(part);
                        self.as_number(&value, part.span)?
                    }
                };
                nodes.push(node);
            }
        } else {
            let found = self.expr(value);
            let numbers = self.constant_vector(&found, value.span, &format!("`{key}`"))?;
            nodes.extend(numbers.map(|number| self.module.graph.constant(number)));
        }
        nodes.try_into().ok()
    }

    fn obstacle(
        &mut self,
        entries: &'a [Entry],
        span: Span,
        what: &'static str,
        walls: Slip,
    ) -> Option<Obstacle> {
        let block = self.block(entries, what, span, &OBSTACLE_KEYS, &[]);
        let skin = self.skin(&block, walls);
        let Some((_, value)) = block.setting("solid") else {
            self.missing(&block, "solid", "write `solid: pawn` with the name of a solid");
            return None;
        };
        let shape = self.field(value)?;
        let name = match &value.kind {
            ExprKind::Name(name) => name.clone(),
            _ => "obstacle".into(),
        };
        Some(Obstacle { name, shape, span: value.span, skin: skin? })
    }

    /// One of a few words; the first is the default.
    fn word_key<T: Copy>(&mut self, block: &Block<'_>, key: &str, words: &[(&str, T)]) -> Option<T> {
        let Some((_, value)) = block.setting(key) else { return words.first().map(|(_, meaning)| *meaning) };
        let found = match &value.kind {
            ExprKind::Name(word) | ExprKind::Text(word) => word.as_str(),
            _ => "",
        };
        let meaning = words.iter().find(|(word, _)| *word == found).map(|(_, meaning)| *meaning);
        if meaning.is_none() {
            let known: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
            let diagnostic =
                Diagnostic::error(Code::SCENE_KEY, value.span, format!("unknown value of `{key}`"))
                    .help(format!("this version knows {}", known.join(", ")))
                    .suggest(found, known);
            self.report(diagnostic);
        }
        meaning
    }

    fn run(&mut self, block: &Block<'_>) -> Option<Run> {
        let defaults = Run { dt: None, until: 5.0, save_every: 0.05, checkpoint_every: None };
        let Some((_, entries, span)) = block.blocks("run").next() else { return Some(defaults) };
        let block = self.block(entries, "a run", span, &RUN_KEYS, &[]);
        let mut optional = |key| match block.setting(key) {
            Some(_) => self.number_key(&block, key, Dimension::TIME, None, Bound::Positive).map(Some),
            None => Some(None),
        };
        let (dt, checkpoint_every) = (optional("dt"), optional("checkpoint_every"));
        let until = self.number_key(&block, "until", Dimension::TIME, Some(defaults.until), Bound::Positive);
        let save = self.number_key(
            &block,
            "save_every",
            Dimension::TIME,
            Some(defaults.save_every),
            Bound::Positive,
        );
        Some(Run { dt: dt?, until: until?, save_every: save?, checkpoint_every: checkpoint_every? })
    }

    /// The value of a key, checked; `None` was reported. A key without a default must be present.
    pub(super) fn number_key(
        &mut self,
        block: &Block<'_>,
        key: &str,
        dimension: Dimension,
        default: Option<f64>,
        bound: Bound,
    ) -> Option<f64> {
        let Some((_, value)) = block.setting(key) else { return default };
        let number = self.quantity_expr(value, dimension, key)?;
        let (fits, expected) = match bound {
            Bound::Positive => (number > 0.0, "must be positive"),
            Bound::NotNegative => (number >= 0.0, "must not be negative"),
            Bound::Fraction => ((0.0..=1.0).contains(&number), "must lie between 0 and 1"),
        };
        if fits && number.is_finite() {
            return Some(number);
        }
        let message = format!("`{key}` {expected}, found {number}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    pub(super) fn vector_key(
        &mut self,
        block: &Block<'_>,
        key: &str,
        dimension: Dimension,
        default: DVec3,
    ) -> Option<DVec3> {
        let Some((_, value)) = block.setting(key) else { return Some(default) };
        let vector = if let ExprKind::Vector(parts) = &value.kind
            && let [a, b, c] = &parts[..]
        {
            let parts = [a, b, c].map(|part| self.quantity_expr(part, dimension, key));
            DVec3::new(parts[0]?, parts[1]?, parts[2]?)
        } else {
            let found = self.expr(value);
            DVec3::from_array(self.constant_vector(&found, value.span, &format!("`{key}`"))?)
        };
        if vector.is_finite() {
            return Some(vector);
        }
        let message = format!("`{key}` must be finite, found {vector}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    /// A whole number of at least `least`; the outer option is an error, the inner one an absent key.
    fn count_key(&mut self, block: &Block<'_>, key: &str, least: u32) -> Option<Option<usize>> {
        const MOST: f64 = 1e9;
        let Some((_, value)) = block.setting(key) else { return Some(None) };
        let number = self.quantity_expr(value, Dimension::NONE, key)?;
        if number.fract() == 0.0 && number >= f64::from(least) && number <= MOST {
            return Some(Some(number as usize));
        }
        let message = format!("`{key}` must be a whole number from {least} to {MOST}, found {number}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    /// A constant in SI units; a unit, where one is written, must fit.
    pub(super) fn quantity_expr(&mut self, expr: &Expr, expected: Dimension, key: &str) -> Option<f64> {
        match &expr.kind {
            ExprKind::Quantity { value, unit } => {
                let parsed = parse_unit(&unit.text)?; // the grammar admits known units only
                if parsed.dimension != expected {
                    let message = format!("`{}` is not a unit of `{key}`", unit.text);
                    let help = if expected == Dimension::NONE {
                        format!("`{key}` has no unit")
                    } else {
                        format!("write for example `1 {}`", example_unit(expected))
                    };
                    self.report(Diagnostic::error(Code::UNIT_MISMATCH, unit.span, message).help(help));
                    return None;
                }
                Some(value * parsed.factor)
            }
            ExprKind::Negate(inner) => self.quantity_expr(inner, expected, key).map(|v| -v),
            _ => {
                let value = self.expr(expr);
                if let Value::Text(_) | Value::Vector(_) = value {
                    self.as_number(&value, expr.span);
                    return None;
                }
                let node = self.as_number(&value, expr.span)?;
                self.as_constant(node, expr.span, &format!("`{key}`"))
            }
        }
    }
}

fn example_unit(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::LENGTH => "m",
        Dimension::MASS => "kg",
        Dimension::TIME => "s",
        Dimension::SPEED => "m/s",
        Dimension::ACCELERATION => "m/s^2",
        Dimension::DENSITY => "kg/m^3",
        Dimension::VISCOSITY => "Pa·s",
        Dimension::TENSION => "N/m",
        Dimension::ENERGY => "J",
        _ => "deg",
    }
}

impl<'a> Block<'a> {
    pub(super) fn setting(&self, key: &str) -> Option<(&'a Name, &'a Expr)> {
        self.entries.iter().find_map(|entry| match entry {
            Entry::Setting { key: name, value } if name.text == key => Some((name, value)),
            _ => None,
        })
    }

    pub(super) fn blocks(
        &self,
        key: &'static str,
    ) -> impl Iterator<Item = (Option<&'a Name>, &'a [Entry], Span)> + use<'a> {
        self.entries.iter().filter_map(move |entry| match entry {
            Entry::Block { key: name, label, entries, .. } if name.text == key => {
                Some((label.as_ref(), &entries[..], name.span))
            }
            _ => None,
        })
    }
}
