//! Warnings about solids and scenes that are valid and most likely not meant: `rfm check` looks for all of
//! them, editors show them after a pause in typing, and a run shows those that its fluid would meet.

use super::chains::Chains;
use super::failure::note;
use rfm::diagnostic::{Code, Diagnostic, Diagnostics, Severity, Span};
use rfm::experiment::{self, Body, Taken};
use rfm::geom::{Aabb, place};
use rfm::glam::DVec3;
use rfm::ir::Node;
use rfm::lower::{NamedSolid, Scene};
use rfm::solid::{Break, Breakage, ProgramKind, ThinPart, Uneven};
use rfm::syntax::ast::Item;
use rfm::{Engine, Error, Experiment, Program, Solid};

/// What all solids and scenes of a file share.
pub(super) struct Searches {
    /// Operations that are left for operands without effect.
    idle: usize,
    /// Operations that are left for walls and gaps.
    thin: usize,
    /// The names of solids of which some operands were not looked at to the end.
    cut: Vec<String>,
    /// The walls and gaps of the shapes that were looked at: scenes that compare something share their obstacles.
    known: Vec<(Search, [Option<ThinPart>; 2])>,
    /// The chains of comparisons of the file, once they were asked for.
    chains: Option<Chains>,
    /// Operations that are left for chains that are fulfilled in the other order.
    turned: usize,
}

/// Maximum number of operations that are spent on operands without effect in all solids of a file together:
/// about a second.
const IDLE_OPERATIONS: usize = 30_000_000;

/// Maximum number of operations that are spent on chains of comparisons in all solids of a file together: less than a
/// second.
const CHAIN_OPERATIONS: usize = 60_000_000;

/// Maximum number of operations that are spent on the walls and gaps of all scenes together: some seconds.
const THIN_OPERATIONS: usize = 2_500_000_000;

impl Searches {
    pub fn new() -> Self {
        Self {
            idle: IDLE_OPERATIONS,
            thin: THIN_OPERATIONS,
            cut: Vec::new(),
            known: Vec::new(),
            chains: None,
            turned: CHAIN_OPERATIONS,
        }
    }

    /// Searches that end sooner, for texts that are being written and for runs that wait for the result.
    pub fn short() -> Self {
        Self {
            idle: IDLE_OPERATIONS / 10,
            thin: THIN_OPERATIONS / 10,
            turned: CHAIN_OPERATIONS / 10,
            ..Self::new()
        }
    }

    /// The thinnest wall and the thinnest gap of an obstacle that particles at a spacing do not show.
    fn thin_parts(&mut self, solid: &Solid, search: Search) -> [Option<ThinPart>; 2] {
        if let Some((_, parts)) = self.known.iter().find(|(other, _)| *other == search) {
            return *parts;
        }
        let (_, lengths, domain) = search;
        let parts = solid.thin_parts(lengths, &domain, &mut self.thin);
        self.known.push((search, parts));
        parts
    }

    /// Says which searches came to no end.
    pub fn tell(&self) {
        let Some(first) = self.cut.first() else { return };
        let others = match self.cut.len() - 1 {
            0 => String::new(),
            1 => " and another solid".into(),
            n => format!(" and {n} other solids"),
        };
        note(format!(
            "operands without effect (W0415) were looked for in `{first}`{others} only in part: that takes too long"
        ));
    }
}

/// Warnings about the formula of a solid.
pub(super) fn of_solid(
    program: &Program,
    named: &NamedSolid,
    solid: &Solid,
    searches: &mut Searches,
) -> Vec<Diagnostic> {
    let around = solid.bounds().aabb().map(|bounds| bounds.grown(0.05 * bounds.size().max_element()));
    let uses = |scene: &&Scene| scene.obstacles.iter().any(|obstacle| obstacle.name == named.name);
    let of_scene = program.module().scenes.iter().find(uses).map(|scene| scene.domain);
    let size = around.or(of_scene).map_or(1.0, |over| over.size().max_element());
    let subject = Subject { name: &named.name, at: named.span, text: definition(program, named), size };
    let jumps = around.or(of_scene).map_or_else(Vec::new, |over| solid.jumps(&over));
    let singular = of_scene.or(around).map_or_else(Vec::new, |over| singular(solid, &over, &jumps));
    let idle = solid.idle_operands(named.span.source, &mut searches.idle);
    if idle.is_cut {
        searches.cut.push(named.name.clone());
    }
    let mut found: Vec<Diagnostic> = idle.spans.into_iter().map(|span| subject.idle(span)).collect();
    let over = around.or(of_scene).unwrap_or(Aabb::new(DVec3::NEG_ONE, DVec3::ONE));
    let chains = searches.chains.get_or_insert_with(|| Chains::of(program));
    found.extend(chains.warnings((program, named), &over, solid.time(), &mut searches.turned));
    found.extend(untold(program, &jumps).map(|jump| subject.jump(jump)));
    let outside = Subject { size: of_scene.map_or(size, |room| room.size().max_element()), ..subject };
    found.extend(singular.iter().map(|place| outside.singular(place)));
    found.extend(solid.seam().map(|at| subject.seam(at)));
    found.extend(solid.flat_room().map(|at| subject.flat_room(at)));
    // where a formula jumps, differences say nothing of its gradient
    if jumps.is_empty() {
        found.extend(solid.uneven_operands().first().map(|uneven| subject.uneven(uneven)));
    }
    found
}

/// The jumps that nothing else tells of: that a bend leaves out the ends of its shape is told where it stands.
fn untold<'j>(program: &Program, jumps: &'j [Break]) -> impl Iterator<Item = &'j Break> {
    let mut told = if jumps.is_empty() { Vec::new() } else { program.warnings().list };
    told.retain(|warning| warning.code == Code::LOST_ENDS);
    jumps.iter().filter(move |jump| told.iter().all(|warning| Some(warning.primary.span) != jump.span))
}

/// The places in a box at which ω is singular outside of a solid and does not jump.
fn singular(solid: &Solid, over: &Aabb, jumps: &[Break]) -> Vec<Break> {
    let mut found = solid.singularities(over);
    found.retain(|place| jumps.iter().all(|jump| jump.span != place.span));
    found
}

/// The text of a solid's formula in the file.
pub(super) fn definition(program: &Program, named: &NamedSolid) -> Option<Span> {
    program.ast().items.iter().find_map(|item| match item {
        Item::Solid(solid) if solid.name.span == named.span => Some(solid.value.span),
        Item::Solid(_)
        | Item::Import(_)
        | Item::Param(_)
        | Item::Let(_)
        | Item::Function(_)
        | Item::Scene(_) => None,
    })
}

/// A solid that warnings are about.
#[derive(Clone, Copy)]
struct Subject<'a> {
    name: &'a str,
    /// The place of its name.
    at: Span,
    /// Its formula.
    text: Option<Span>,
    /// How large it is, m; places in it have as many digits as that takes.
    size: f64,
}

impl<'a> Subject<'a> {
    /// A body of a scene by its name. If it is the name of a solid of the file, warnings point to its
    /// formula, and otherwise to the place in the scene.
    fn of(program: &Program, name: &'a str, place: Span, size: f64) -> Self {
        match program.module().solids.iter().find(|named| named.name == name) {
            Some(named) => Self { name, at: named.span, text: definition(program, named), size },
            None => Self { name, at: place, text: Some(place), size },
        }
    }

    /// A warning at a part of the formula. For a part that is written elsewhere, in a `let` or another solid
    /// that shares it, the warning also names the solid.
    fn warning(&self, code: Code, span: Option<Span>, message: String, what: String) -> Diagnostic {
        let own = span.filter(|span| {
            self.text.is_some_and(|text| {
                span.source == text.source && text.start <= span.start && span.end <= text.end
            })
        });
        match (own, span) {
            (Some(own), _) => Diagnostic::warning(code, own, message).at(what),
            (None, Some(span)) if span.source == self.at.source => {
                let at = format!("{what}; it is first written here");
                Diagnostic::warning(code, self.at, message).label(span, at)
            }
            (None, _) => Diagnostic::warning(code, self.at, message).at(what),
        }
    }

    fn idle(&self, span: Span) -> Diagnostic {
        let message = format!("solid `{}` is the same without one of its operands", self.name);
        let what = "it changes no point of the shape".into();
        self.warning(Code::IDLE_OPERAND, Some(span), message, what)
            .help("remove it, or look for a slip in its size or place")
    }

    fn uneven(&self, uneven: &Uneven) -> Diagnostic {
        let [steep, flat] = uneven.gradients;
        let message = format!(
            "operands of solid `{}` have gradients of very different size at the surface: {steep:.1e} and {flat:.1e}",
            self.name
        );
        let what = format!("|∇ω| is {steep:.1e} or more here");
        let warning = self
            .warning(Code::UNEVEN_OPERANDS, uneven.steep, message, what)
            .help("write `normalise(…)` around the steeper one, or lengths in place of their powers");
        match uneven.flat.filter(|flat| flat.source == self.at.source && uneven.steep != Some(*flat)) {
            Some(other) => warning.label(other, format!("and {flat:.1e} or less here")),
            None => warning,
        }
    }

    fn seam(&self, at: DVec3) -> Diagnostic {
        let message = format!("ω of solid `{}` is 0 within it, at {}", self.name, place(at, self.size));
        self.warning(Code::SEAM, self.text, message, "there is a surface without an outside".into())
            .help("let the parts that only touch there overlap; an outline that is turned is drawn beyond its axis, to x < 0 for `.revolve()`")
    }

    fn flat_room(&self, at: DVec3) -> Diagnostic {
        let place = place(at, self.size);
        let message =
            format!("ω of solid `{}` is 0 throughout a part of space, as around {place}", self.name);
        self.warning(Code::SEAM, self.text, message, "such places count as outside".into()).help(
            "a part of the formula is 0 there and decides nothing, as `abs(z) <= z` for z > 0: write it so that it is positive \
             inside and negative outside",
        )
    }

    fn jump(&self, jump: &Break) -> Diagnostic {
        let (how, help) = match jump.what {
            Breakage::Jump => {
                ("jumps", "let both sides agree where they meet, or cut the shape there by `and`")
            }
            Breakage::Pole | Breakage::NoValue => {
                ("passes through infinity", "keep the divisor from zero, for example by `max(…, 1e-9)`")
            }
        };
        let name = &self.name;
        let message =
            format!("ω of solid `{name}` {how} from one sign to the other at {}", place(jump.at, self.size));
        let what = format!("{} of this does", jump.operation);
        self.warning(Code::JUMP, jump.span, message, what).help(help)
    }

    fn singular(&self, found: &Break) -> Diagnostic {
        let what = match found.what {
            Breakage::NoValue | Breakage::Jump => "no value",
            Breakage::Pole => "no bound",
        };
        let name = &self.name;
        let message =
            format!("ω of solid `{name}` has {what} outside of it, at {}", place(found.at, self.size));
        let at = format!("{} of this has none there", found.operation);
        self.warning(Code::SINGULAR, found.span, message, at)
            .help("choose another formula there by `where`, or keep its operand away by `max`")
    }
}

/// A shape, what is looked for in it, m, and the box of the scene.
type Search = (Node, [f64; 3], Aabb);

/// Warnings about obstacles that the particles of their scenes are too large for, and about fluids that lie
/// in obstacles. The walls of a container are not looked at.
pub(super) fn of_scenes(
    engine: Engine,
    program: &Program,
    searches: &mut Searches,
) -> Result<Vec<Diagnostic>, Error> {
    let mut found = Vec::new();
    for scene in &program.module().scenes {
        let is_crowded = scene.obstacles.len() > experiment::MOST_OBSTACLES;
        let compiled = match is_crowded {
            false => Experiment::new(program, &scene.name, engine),
            true => Experiment::without_obstacles(program, &scene.name, engine),
        };
        let experiment = match compiled {
            Ok(experiment) => experiment,
            Err(Error::Diagnostics(refusal)) => {
                // solids report tolerances themselves
                // perhaps an obstacle that was left out says how fast the fluid will be
                let is_told =
                    |code: Code| code != Code::TOLERANCE && !(is_crowded && code == Code::SCENE_MISSING);
                found.extend(refusal.list.into_iter().filter(|refusal| is_told(refusal.code)));
                continue;
            }
            Err(other) => return Err(other),
        };
        if is_crowded {
            found.extend(among_many(program, scene, &experiment)?);
            continue;
        }
        let spacing = experiment.parameters().spacing();
        let (outside, obstacles) = experiment
            .bodies()
            .split_at(usize::from(scene.container.is_some()).min(experiment.bodies().len()));
        let outside = outside.first().map(|body| &body.solid);
        for (k, (obstacle, body)) in scene.obstacles.iter().zip(obstacles).enumerate() {
            found.extend(experiment::out_of_reach((scene, spacing), obstacle, (&body.solid, outside)));
            let wall = experiment::wall_limit(scene, usize::from(outside.is_some()) + k);
            let solid = body.solid.at(0.0);
            found.extend(experiment::too_fine((scene, spacing), obstacle, (&solid, wall), |lengths| {
                searches.thin_parts(&solid, (obstacle.shape, lengths, scene.domain))
            }));
        }
        found.extend(of_fluid(&experiment));
    }
    Ok(found)
}

/// Messages about the place of a fluid before any of its particles is placed: it has no room, or lies outside
/// the box, or in obstacles.
fn of_fluid(experiment: &Experiment) -> Vec<Diagnostic> {
    let operations = |body: &Body| body.solid.graph(ProgramKind::Value).0.len();
    if experiment.bodies().iter().map(operations).sum::<usize>() > MOST_OPERATIONS {
        return Vec::new();
    }
    let mut found = experiment.foreseen();
    if found.iter().all(|diagnostic| diagnostic.severity != Severity::Error) {
        let scene = experiment.scene();
        let solids: Vec<Solid> = experiment.bodies().iter().map(|body| body.solid.at(0.0)).collect();
        found.extend(in_obstacles(scene, &experiment.fluid().at(0.0), &solids));
    }
    found
}

/// Messages about the fluid's room in a scene with very many obstacles. They are not compiled, but each is asked
/// whether it takes samples of the fluid. The experiment is that of the scene without them.
fn among_many(program: &Program, scene: &Scene, experiment: &Experiment) -> Result<Vec<Diagnostic>, Error> {
    let mut found = experiment.foreseen();
    if found.iter().any(|diagnostic| diagnostic.severity == Severity::Error) {
        return Ok(found);
    }
    let mut bodies: Vec<Solid> = experiment.bodies().iter().map(|body| body.solid.at(0.0)).collect();
    let mut operations = 0;
    for obstacle in &scene.obstacles {
        // to compile them all would take longer than the few places at which each is asked
        let solid = program.compile(&obstacle.name, obstacle.shape, Engine::Interpreter)?.at(0.0);
        operations += solid.graph(ProgramKind::Value).0.len();
        if operations > MOST_OPERATIONS_OF_MANY {
            return Ok(found);
        }
        bodies.push(solid);
    }
    found.extend(in_obstacles(scene, &experiment.fluid().at(0.0), &bodies));
    Ok(found)
}

/// Messages about the part of a fluid's shape that lies in obstacles or outside the container: a warning if
/// it is large, and an error if nothing is left. Where obstacles stand in a fluid that is drawn as if they
/// were not there, as posts in a tank do, they take less.
fn in_obstacles(scene: &Scene, fluid: &Solid, bodies: &[Solid]) -> Vec<Diagnostic> {
    let (container, obstacles) = bodies.split_at(usize::from(scene.container.is_some()).min(bodies.len()));
    let taken_by = |bodies: &[Solid]| {
        let taken =
            (!bodies.is_empty()).then(|| experiment::taken_by_obstacles(fluid, bodies, &scene.domain));
        taken.flatten()
    };
    let (outside, within) = (taken_by(container), taken_by(obstacles));
    let span = scene.fluid.shape_span;
    if outside.is_some_and(|taken| taken.is_all) {
        return vec![experiment::outside_the_container(scene)];
    }
    let out_of_them = "move the shape of the fluid out of the obstacles";
    let is_all = |taken: Option<Taken>| taken.is_some_and(|taken| taken.is_all);
    if is_all(within) || outside.is_some_and(|taken| taken.part > 0.0) && is_all(taken_by(bodies)) {
        let place = if is_all(within) { "in obstacles" } else { "in obstacles or outside of the container" };
        let message = format!("no particle finds room: all of the fluid's shape lies {place}");
        return vec![Diagnostic::error(Code::OBSTACLE_FILLS_BOX, span, message).help(out_of_them)];
    }
    let places = [
        (
            outside,
            "outside of the container",
            "a container is the room that the fluid may fill, not its walls",
        ),
        (within, "in obstacles", out_of_them),
    ];
    let told = places.into_iter().filter_map(|(taken, place, help)| {
        let part = taken.filter(|taken| taken.part > MUCH)?.part;
        let message = format!(
            "about {:.0} % of the fluid's shape lies {place}, where no particle is placed (an estimate by samples; a run counts the particles)",
            100.0 * part
        );
        Some(Diagnostic::warning(Code::FLUID_IN_OBSTACLE, span, message).help(help))
    });
    told.collect()
}

/// For bodies with more operations together it is not tested what they take of the fluid: that would take seconds.
const MOST_OPERATIONS: usize = 2000;

/// A fluid gets a warning if at least this part of its shape lies in obstacles.
const MUCH: f64 = 0.25;

/// Warnings about the bodies of an experiment that its fluid would meet: places at which their formulas jump or have no
/// value, and walls and gaps that its particles are too large for.
pub(super) fn of_experiment(experiment: &Experiment, searches: &mut Searches) -> Diagnostics {
    let (scene, spacing) = (experiment.scene(), experiment.parameters().spacing());
    let sources = experiment.program().sources().clone();
    let mut found = Diagnostics { list: Vec::new(), sources };
    if scene.obstacles.len() > experiment::MOST_OBSTACLES {
        return found;
    }
    let container = scene.container.iter().map(|container| (&container.name, container.span, None));
    let obstacles = scene.obstacles.iter().map(|obstacle| (&obstacle.name, obstacle.span, Some(obstacle)));
    let bodies = container.chain(obstacles).zip(experiment.bodies());
    for (number, ((name, span, obstacle), body)) in bodies.enumerate() {
        let size = scene.domain.size().max_element();
        let subject = Subject::of(experiment.program(), name, span, size);
        let jumps = body.solid.jumps(&scene.domain);
        found.list.extend(untold(experiment.program(), &jumps).map(|jump| subject.jump(jump)));
        found
            .list
            .extend(singular(&body.solid, &scene.domain, &jumps).iter().map(|place| subject.singular(place)));
        // behind the walls of a container is the outside, and the number of particles of the fluid shows its
        // gaps
        if let Some(obstacle) = obstacle {
            let outside = scene.container.as_ref().and_then(|_| experiment.bodies().first());
            let solids = (&body.solid, outside.map(|outside| &outside.solid));
            found.list.extend(experiment::out_of_reach((scene, spacing), obstacle, solids));
            let wall = experiment::wall_limit(scene, number);
            found.list.extend(experiment::too_fine(
                (scene, spacing),
                obstacle,
                (&body.solid, wall),
                |lengths| searches.thin_parts(&body.solid, (obstacle.shape, lengths, scene.domain)),
            ));
        }
    }
    found
}

/// The room among many obstacles is not looked at if they have more operations together: that would take seconds.
const MOST_OPERATIONS_OF_MANY: usize = 100_000;
