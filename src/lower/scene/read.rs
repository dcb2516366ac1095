//! Reads the blocks of a scene, one after the other.

use glam::DVec3;

use super::super::lowering::Lowering;
use super::super::probes::Surroundings;
use super::fluid::FluidAndMethod;
use super::{Block, Bounce, Container, Gravity, Obstacle, Run, Scene, Skin, Tolerance, Truth};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::Aabb;
use crate::ir::Unary;
use crate::quantity::{Bound, Dimension};
use crate::sph::Slip;
use crate::syntax::ast::{self, Entry, Expr, ExprKind};

pub(in crate::lower) const SCENE_KEYS: [&str; 14] = [
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
    "picture",
    "tolerance",
];
pub(in crate::lower) const TRUTH_KEYS: [&str; 4] = ["pressure", "velocity", "front", "from"];
pub(in crate::lower) const BOX_KEYS: [&str; 4] = ["min", "max", "restitution", "friction"];
pub(in crate::lower) const OBSTACLE_KEYS: [&str; 5] =
    ["solid", "restitution", "friction", "walls", "surface_velocity"];
const FREE_SLIP: (&str, Slip) = ("free_slip", Slip::Free);
const NO_SLIP: (&str, Slip) = ("no_slip", Slip::No);
pub(in crate::lower) const RUN_KEYS: [&str; 4] = ["dt", "until", "save_every", "checkpoint_every"];

impl<'a> Lowering<'a> {
    /// Reads a scene; `None` if it has errors, which are reported.
    pub fn scene(&mut self, scene: &'a ast::SceneItem) -> Option<Scene> {
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
        let fluid = self.fluid_and_method(&block);
        let slip = self.word_key(&block, "walls", &[FREE_SLIP, NO_SLIP]);
        let walls = slip.unwrap_or(Slip::Free);
        let container = self.container(&block, walls);
        let obstacles: Vec<Obstacle> = block
            .blocks("obstacle")
            .filter_map(|(_, entries, span)| self.obstacle(entries, span, "an obstacle", walls))
            .collect();
        let gravity = self.gravity(&block);
        let truth = self.truth(&block);
        let run = self.run(&block);
        let container_name = container.iter().map(|c| &c.name[..]);
        let bodies: Vec<&str> = container_name.chain(obstacles.iter().map(|o| &o.name[..])).collect();
        // a body that is missing has mistakes that were reported
        let stated = block.blocks("obstacle").count() + block.blocks("container").count();
        let all_bodies = (bodies.len() == stated).then_some(bodies);
        let picture = all_bodies.as_ref().and_then(|bodies| self.picture(&block, bodies));
        let probes = match (&domain, &fluid, &run, all_bodies) {
            (
                Some((domain, ..)),
                Some(FluidAndMethod { fluid, .. }),
                Some(Run { until, .. }),
                Some(bodies),
            ) => {
                let around = Surroundings { domain: *domain, bodies, fluid: &fluid.name, until: *until };
                self.probes(&block, &around)
            }
            // what they may refer to has mistakes that were reported
            _ => Vec::new(),
        };
        let tolerance = block.setting("tolerance").and_then(|(_, value)| self.tolerance(value));
        if self.errors() > errors_before {
            return None;
        }
        let (domain, walls, domain_span) = domain?;
        let FluidAndMethod { fluid, method, solver } = fluid?;
        Some(Scene {
            name: scene.name.text.clone(),
            span: scene.name.span,
            domain,
            domain_span,
            walls,
            slip: slip?,
            container,
            fluid,
            obstacles,
            gravity: gravity?,
            method,
            solver,
            run: run?,
            truth: truth?,
            probes,
            picture: picture?,
            tolerance,
        })
    }

    /// Reads a tolerance of ω; `None` if it is not positive and finite, which is reported.
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
        let is_misspelt = entries.iter().any(|entry| !BOX_KEYS.contains(&entry.key().text.as_str()));
        if block.setting("max").is_none() && !is_misspelt {
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

    /// Reads how a solid acts at its surface. Unless it says otherwise, it lets the fluid slip or stick as
    /// `walls` do.
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

    fn gravity(&mut self, block: &Block<'_>) -> Option<Gravity> {
        let Some((_, value)) = block.setting("gravity") else {
            return Some(Gravity::Still(DVec3::new(0.0, 0.0, -9.81)));
        };
        let nodes = self.components(value, Dimension::ACCELERATION, "gravity")?;
        let turns = nodes.iter().any(|&node| self.known_value(node).is_none());
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
        let shape = self.shape(value)?;
        let name = match &value.kind {
            ExprKind::Name(name) => name.clone(),
            _ => "obstacle".into(),
        };
        Some(Obstacle { name, shape, span: value.span, skin: skin? })
    }

    fn run(&mut self, block: &Block<'_>) -> Option<Run> {
        let defaults = Run { dt: None, dt_span: None, until: 5.0, save_every: 0.05, checkpoint_every: None };
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
        let run = Run {
            dt: dt?,
            dt_span: block.setting("dt").map(|(_, value)| value.span),
            until: until?,
            save_every: save?,
            checkpoint_every: checkpoint_every?,
        };
        if let (Some(every), Some((_, value))) = (run.checkpoint_every, block.setting("checkpoint_every"))
            && every > run.until
        {
            let [until, every] = [run.until, every].map(seconds_as_written);
            let message = format!("a checkpoint every {every} in a run of {until}: only its end is saved");
            let help =
                "a run that is interrupted saves one too; without this key there is one with every frame";
            self.report(Diagnostic::warning(Code::FRAMES, value.span, message).help(help));
        }
        if let (Some(dt), Some(at)) = (run.dt, run.dt_span)
            && dt > run.until
        {
            let [until, step] = [run.until, dt].map(seconds_as_written);
            let message = format!("a step of {step} is longer than the run of {until}");
            let help = "leave `dt` out: the step is then as long as is stable";
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help(help));
            return None;
        }
        let stated =
            block.setting("save_every").or(block.setting("until")).map_or(span, |(_, value)| value.span);
        self.frames_fit(&run, stated).then_some(run)
    }

    /// Reports frames that would fill a disk, and warns of frames so rare that there are none.
    fn frames_fit(&mut self, run: &Run, at: Span) -> bool {
        const MANY: f64 = 20_000.0;
        let frames = run.until / run.save_every;
        let [until, every] = [run.until, run.save_every].map(seconds_as_written);
        let fewer = format!("write for example `save_every: {}`", seconds_as_written(run.until / 100.0));
        if frames > Scene::MOST_FRAMES as f64 {
            let message = format!(
                "{until} with a frame every {every} are {frames:.3e} frames; at most {} are saved",
                Scene::MOST_FRAMES
            );
            self.report(Diagnostic::error(Code::OUT_OF_RANGE, at, message).help(fewer));
            return false;
        }
        if frames > MANY {
            let message = format!("{until} with a frame every {every} are {frames:.0} frames");
            self.report(Diagnostic::warning(Code::FRAMES, at, message).help(fewer));
        } else if run.save_every > run.until {
            let message =
                format!("a frame every {every} in a run of {until}: only its start and its end are saved");
            self.report(Diagnostic::warning(Code::FRAMES, at, message).help(fewer));
        }
        true
    }
}

/// A time as a file writes it, with two digits: `50 ms`, `0.2 s`.
fn seconds_as_written(time: f64) -> String {
    let rounded = |value: f64| format!("{value:.1e}").parse().unwrap_or(value);
    if time < 0.1 && time > 1e-5 {
        format!("{} ms", rounded(1e3 * time))
    } else {
        format!("{} s", rounded(time))
    }
}
