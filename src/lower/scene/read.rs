//! Reads the blocks of a scene, one after the other.

use glam::DVec3;

use super::super::lowering::Lowering;
use super::super::probes::Surroundings;
use super::declaration::{SceneKey, declare_keys, names};
use super::fluid::{FluidAndMethod, OF_VELOCITY};
use super::{Block, Bounce, Container, Gravity, Obstacle, Run, Scene, Skin, Tolerance};
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::geom::{Aabb, significant};
use crate::ir::Unary;
use crate::quantity::Dimension;
use crate::sph::Slip;
use crate::syntax::ast::{self, Entry, Expr, ExprKind};

/// How walls act on fluid that moves along them, and the words for it.
const WALLS: &[&str] = &["free_slip", "no_slip"];
const SLIPS: [Slip; 2] = [Slip::Free, Slip::No];

declare_keys! {
    /// Keys of a scene.
    mod scene_keys {
        UNITS = "units", Other, Text("\"SI\""),
            "the system of units; there is no other one";
        BOX = "box", Block(super::box_keys::ALL), Required,
            "the block for the room of the simulation; its walls hold the fluid";
        CONTAINER = "container", Block(super::obstacle_keys::ALL), Text("the box alone"),
            "the block for a vessel within the box, in which the fluid stays";
        FLUID = "fluid", Block(crate::lower::scene::fluid::keys::ALL), Required,
            "the block for the fluid: where it is at the start, and what it is";
        OBSTACLE = "obstacle", Block(super::obstacle_keys::ALL), Text("none"),
            "a block for a solid in the fluid; there may be several";
        GRAVITY = "gravity", Formulas(Dimension::ACCELERATION), Is3([0.0, 0.0, -9.81]),
            "the acceleration of free fall; may depend on x, y, z and t";
        WALLS = "walls", Words(super::WALLS), Text("free_slip"),
            "whether the fluid slips along walls or sticks to them";
        METHOD = "method", MethodName, Text("wcsph"),
            "how the pressure is found";
        SOLVER = "solver", Block(crate::lower::scene::fluid::solver_keys::ALL), Text("that of the method"),
            "the block for how the method is run";
        RUN = "run", Block(crate::lower::scene::run::keys::ALL), Text("5 s, a frame every 0.05 s"),
            "the block for how long the simulation runs and what it saves";
        TRUTH = "truth", Block(crate::lower::scene::truth::keys::ALL), Text("none"),
            "the block for a known solution, with which the run compares the flow";
        PROBE = "probe", Block(crate::lower::probes::keys::ALL), Text("none"),
            "a block with a name for something that is measured; there may be several";
        PICTURE = "picture", Block(crate::lower::scene::picture::keys::ALL), Text("the whole box"),
            "the block for how pictures are drawn";
        TOLERANCE = "tolerance", Number(Dimension::NONE, Bound::Positive), Text("none"),
            "the largest error of ω that is accepted for the obstacles";
    }
}

declare_keys! {
    /// Keys of the box.
    mod box_keys {
        MIN = "min", Vector(Dimension::LENGTH), Is3([0.0, 0.0, 0.0]),
            "the lowest corner";
        MAX = "max", Vector(Dimension::LENGTH), Required,
            "the highest corner";
        RESTITUTION = "restitution", Number(Dimension::NONE, Bound::Fraction), Is(0.5),
            "the part of its normal speed with which a particle that hits a wall bounces off, 0 … 1";
        FRICTION = "friction", Number(Dimension::NONE, Bound::NotNegative), Is(0.0),
            "the coefficient of friction of particles that hit a wall; a fluid that rests on a wall is held off it by pressure, and feels no friction";
    }
}

declare_keys! {
    /// Keys of a container or an obstacle.
    mod obstacle_keys {
        SOLID = "solid", Other, Required,
            "the solid, by its name or written here";
        RESTITUTION = "restitution", Number(Dimension::NONE, Bound::Fraction), Is(0.5),
            "the part of its normal speed with which a particle that hits it bounces off, 0 … 1";
        FRICTION = "friction", Number(Dimension::NONE, Bound::NotNegative), Is(0.0),
            "the coefficient of friction of particles that hit it; a fluid that rests on it is held off by pressure, and feels no friction";
        WALLS = "walls", Words(super::WALLS), Text("that of the scene"),
            "whether the fluid slips along it or sticks to it";
        SURFACE_VELOCITY = "surface_velocity", Formulas(Dimension::SPEED), Is3([0.0, 0.0, 0.0]),
            "how fast its surface moves within itself, as a belt does; may depend on x, y, z and t";
    }
}

impl<'a> Lowering<'a> {
    /// Reads a scene; `None` if it has errors, which are reported.
    pub fn scene(&mut self, scene: &'a ast::SceneItem) -> Option<Scene> {
        let errors_before = self.errors();
        let block = self.block(
            &scene.entries,
            "a scene",
            scene.name.span,
            scene_keys::ALL,
            &["obstacle", "fluid", "probe"],
        );
        self.units(&block);
        self.refuse_names(&block);
        let domain = self.domain(&block);
        let fluid = self.fluid_and_method(&block);
        let slip = self.word_key(&block, &scene_keys::WALLS, &SLIPS, Slip::Free);
        let walls = slip.unwrap_or(Slip::Free);
        let container = self.container(&block, walls);
        let obstacles: Vec<Obstacle> = block
            .blocks("obstacle")
            .filter_map(|(_, entries, span)| self.obstacle(entries, span, "an obstacle", walls))
            .collect();
        self.refuse_same_obstacles(&obstacles);
        let gravity = self.gravity(&block);
        let run = self.run(&block);
        let truth = self.truth(&block, run.map(|run| run.until));
        if let (Some(FluidAndMethod { fluid, .. }), Some(truth)) = (&fluid, &truth) {
            // a known solution may serve as the start
            let is_known = truth.is_some_and(|truth| truth.velocity == Some(fluid.velocity));
            if let Some(at) = fluid.velocity_span.filter(|_| !is_known) {
                self.warn_of_time(&OF_VELOCITY, &fluid.velocity, at);
            }
        }
        let container_name = container.iter().map(|c| &c.name[..]);
        let bodies: Vec<&str> = container_name.chain(obstacles.iter().map(|o| &o.name[..])).collect();
        // a body that is missing has mistakes that were reported
        let stated = block.blocks("obstacle").count() + block.blocks("container").count();
        let all_bodies = (bodies.len() == stated).then_some(bodies);
        let picture = all_bodies
            .as_ref()
            .and_then(|bodies| self.picture(&block, bodies, domain.map(|(domain, ..)| domain)));
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
        let tolerance =
            block.setting(scene_keys::TOLERANCE.name).and_then(|(_, value)| self.tolerance(value));
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
        let number = self.quantity_expr(value, Dimension::NONE, scene_keys::TOLERANCE.name)?;
        if number > 0.0 && number.is_finite() {
            return Some(Tolerance { value: number, span: value.span });
        }
        let message = format!("`tolerance` must be positive and finite, found {number}");
        self.report(Diagnostic::error(Code::OUT_OF_RANGE, value.span, message));
        None
    }

    /// Reports names behind keys whose blocks have none.
    fn refuse_names(&mut self, scene: &Block<'_>) {
        for entry in scene.entries {
            let Entry::Block { key, label: Some(label), .. } = entry else { continue };
            if matches!(key.text.as_str(), "fluid" | "probe") {
                continue;
            }
            let message = format!("the block `{}` has no name", key.text);
            let help = match key.text.as_str() {
                "obstacle" | "container" => {
                    format!("leave `{}` out: it is called after its solid", label.text)
                }
                _ => format!("leave `{}` out", label.text),
            };
            self.report(Diagnostic::error(Code::SCENE_KEY, label.span, message).help(help));
        }
    }

    /// Reports obstacles that are one solid at one place.
    fn refuse_same_obstacles(&mut self, obstacles: &[Obstacle]) {
        for (i, obstacle) in obstacles.iter().enumerate() {
            let Some(first) = obstacles[..i].iter().find(|first| first.shape == obstacle.shape) else {
                continue;
            };
            let name = &obstacle.name;
            let message = format!("the obstacle `{name}` stands twice at the same place");
            self.report(
                Diagnostic::error(Code::SCENE_REPEATED, obstacle.span, message)
                    .label(first.span, "first stated here")
                    .help(format!("leave one out, or move it: `solid {name}2 = {name}.move([1, 0, 0])`")),
            );
        }
    }

    fn units(&mut self, block: &Block<'_>) {
        if let Some((_, value)) = block.setting(scene_keys::UNITS.name)
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
        let block = self.block(entries, "a box", span, box_keys::ALL, &[]);
        let min = self.vector_key(&block, &box_keys::MIN);
        let is_misspelt =
            entries.iter().any(|entry| !names(box_keys::ALL).any(|key| key == entry.key().text));
        if block.setting(box_keys::MAX.name).is_none() && !is_misspelt {
            self.missing(&block, box_keys::MAX.name, "write `max: [3, 3, 3]`");
        }
        let max = self.stated_vector(&block, &box_keys::MAX).map(|max| max.unwrap_or(DVec3::ONE));
        let bounce = self.bounce(&block, [&box_keys::RESTITUTION, &box_keys::FRICTION]);
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

    fn bounce(&mut self, block: &Block<'_>, [restitution, friction]: [&SceneKey; 2]) -> Option<Bounce> {
        let (restitution, friction) = (self.number_key(block, restitution), self.number_key(block, friction));
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
        let bounce = self.bounce(block, [&obstacle_keys::RESTITUTION, &obstacle_keys::FRICTION]);
        let slip = self.word_key(block, &obstacle_keys::WALLS, &SLIPS, walls)?;
        let velocity = match block.setting(obstacle_keys::SURFACE_VELOCITY.name) {
            Some((key, value)) => {
                if slip == Slip::Free {
                    let message = "a surface along which the fluid slips does not take it along";
                    self.report(
                        Diagnostic::error(Code::SCENE_KEY, key.span, message)
                            .help("write `walls: no_slip` beside it, or leave `surface_velocity` out"),
                    );
                }
                Some(self.components(value, &obstacle_keys::SURFACE_VELOCITY)?)
            }
            None => None,
        };
        Some(Skin { bounce: bounce?, slip, velocity })
    }

    fn gravity(&mut self, block: &Block<'_>) -> Option<Gravity> {
        let key = &scene_keys::GRAVITY;
        let Some((_, value)) = block.setting(key.name) else {
            return key.vector_without().map(Gravity::Still);
        };
        let nodes = self.components(value, key)?;
        let turns = nodes.iter().any(|&node| self.known_value(node).is_none());
        if !turns {
            let gravity = self.vector_key(block, key)?;
            self.warn_of_other_gravity(gravity, value);
            return Some(Gravity::Still(gravity));
        }
        let of_place = nodes.iter().any(|&node| self.depends_on_place(node));
        Some(if of_place { Gravity::Field(nodes) } else { Gravity::Turning(nodes) })
    }

    /// Warns of the gravity of the Earth in centimetres or millimetres.
    fn warn_of_other_gravity(&mut self, gravity: DVec3, value: &Expr) {
        const UNITS: [(&str, f64); 2] = [("cm/s^2", 981.0), ("mm/s^2", 9810.0)];
        let is_near = |earth: f64| (gravity.length() / earth - 1.0).abs() < 0.01;
        let Some((unit, _)) = UNITS.into_iter().find(|(_, earth)| is_near(*earth)) else { return };
        let size = significant(gravity.length());
        let message = format!("gravity of {size} m/s² is that of the Earth in {unit}");
        let help = format!("that of the Earth is `[0, 0, -9.81]`, in m/s², or `[0, 0, -{size} {unit}]`");
        self.report(Diagnostic::warning(Code::ODD_QUANTITY, value.span, message).help(help));
    }

    fn obstacle(
        &mut self,
        entries: &'a [Entry],
        span: Span,
        what: &'static str,
        walls: Slip,
    ) -> Option<Obstacle> {
        let block = self.block(entries, what, span, obstacle_keys::ALL, &[]);
        let skin = self.skin(&block, walls);
        let Some((_, value)) = block.setting(obstacle_keys::SOLID.name) else {
            self.missing(&block, obstacle_keys::SOLID.name, "write `solid: pawn` with the name of a solid");
            return None;
        };
        let shape = self.shape(value)?;
        let name = match &value.kind {
            ExprKind::Name(name) => name.clone(),
            _ => "obstacle".into(),
        };
        Some(Obstacle { name, shape, span: value.span, skin: skin? })
    }
}
