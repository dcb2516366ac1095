//! The blocks of a scene, read one after the other.

use glam::DVec3;

use super::super::Tolerance;
use super::super::eval::Lowering;
use super::super::probes::Surroundings;
use super::{
    Block, Bounce, Bound, Container, Fill, Fluid, Gravity, Method, Obstacle, Run, Scene, Skin, Slip, Solver,
    Truth,
};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::{Node, Unary};
use crate::precision::Precision;
use crate::syntax::Dimension;
use crate::syntax::ast::{self, Entry, Expr, ExprKind};

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
const TRUTH_KEYS: [&str; 4] = ["pressure", "velocity", "front", "from"];
const BOX_KEYS: [&str; 4] = ["min", "max", "restitution", "friction"];
const SOLVER_KEYS: [&str; 3] = ["compression", "iterations", "precision"];
const FLUID_KEYS: [&str; 21] = [
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
    "gradients",
    "shifting",
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
            gravity: gravity?,
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
            &[("auto", None), ("f32", Some(Precision::F32)), ("f64", Some(Precision::F64))],
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
        let differences = self.word_key(&block, "gradients", &[("pairs", false), ("differences", true)]);
        let own_shifting = if method == Method::Wcsph && differences == Some(true) { 1.0 } else { 0.0 };
        let shifting =
            self.number_key(&block, "shifting", Dimension::NONE, Some(own_shifting), Bound::NotNegative);
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
            differences: differences?,
            shifting: shifting?,
            negative_pressure: negative_pressure?,
            hydrostatic: hydrostatic?,
            velocity: velocity?,
            jitter: jitter?,
            seed: seed?.unwrap_or(1) as u64,
        })
    }

    fn gravity(&mut self, block: &Block<'_>) -> Option<Gravity> {
        let Some((_, value)) = block.setting("gravity") else {
            return Some(Gravity::Still(DVec3::new(0.0, 0.0, -9.81)));
        };
        let nodes = self.components(value, Dimension::ACCELERATION, "gravity")?;
        let turns = nodes.iter().any(|&node| self.module.graph.constant_value(node).is_none());
        if !turns {
            return self
                .vector_key(block, "gravity", Dimension::ACCELERATION, DVec3::ZERO)
                .map(Gravity::Still);
        }
        let of_place = nodes.iter().any(|&node| self.depends_on_place(node));
        Some(if of_place { Gravity::Field(nodes) } else { Gravity::Turning(nodes) })
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
}
