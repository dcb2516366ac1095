//! Warnings about solids and scenes that are valid and most likely not meant: `rfm check` looks for all of
//! them, editors show them after a pause in typing, and a run shows those that its fluid would meet.

use super::failure::note;
use rfm::diagnostic::{Code, Diagnostic, Diagnostics, Severity, Span};
use rfm::experiment::{self, Body, Taken};
use rfm::geom::{Aabb, to_thousandths};
use rfm::glam::DVec3;
use rfm::ir::Node;
use rfm::lower::{NamedSolid, Obstacle, Scene};
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
}

/// Maximum number of operations that are spent on operands without effect in all solids of a file together:
/// about a second.
const IDLE_OPERATIONS: usize = 30_000_000;

/// Maximum number of operations that are spent on the walls and gaps of all scenes together: some seconds.
const THIN_OPERATIONS: usize = 2_500_000_000;

impl Searches {
    pub fn new() -> Self {
        Self { idle: IDLE_OPERATIONS, thin: THIN_OPERATIONS, cut: Vec::new(), known: Vec::new() }
    }

    /// Searches that end sooner, for texts that are being written and for runs that wait for the result.
    pub fn short() -> Self {
        Self { idle: IDLE_OPERATIONS / 10, thin: THIN_OPERATIONS / 10, ..Self::new() }
    }

    /// The thinnest wall and the thinnest gap of an obstacle that particles at a spacing do not show.
    fn thin_parts(&mut self, solid: &Solid, search: Search) -> [Option<ThinPart>; 2] {
        if let Some((_, parts)) = self.known.iter().find(|(other, _)| *other == search) {
            return *parts;
        }
        let (_, [wall, gap], domain) = search;
        let parts = solid.thin_parts([wall, gap], &domain, &mut self.thin);
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
    let subject = Subject { name: &named.name, at: named.span, text: definition(program, named) };
    let around = solid.bounds().aabb().map(|bounds| bounds.grown(0.05 * bounds.size().max_element()));
    let uses = |scene: &&Scene| scene.obstacles.iter().any(|obstacle| obstacle.name == named.name);
    let of_scene = program.module().scenes.iter().find(uses).map(|scene| scene.domain);
    let jumps = around.or(of_scene).map_or_else(Vec::new, |over| solid.jumps(&over));
    let singular = of_scene.or(around).map_or_else(Vec::new, |over| singular(solid, &over, &jumps));
    let idle = solid.idle_operands(named.span.source, &mut searches.idle);
    if idle.is_cut {
        searches.cut.push(named.name.clone());
    }
    let mut found: Vec<Diagnostic> = idle.spans.into_iter().map(|span| subject.idle(span)).collect();
    found.extend(jumps.iter().map(|jump| subject.jump(jump)));
    found.extend(singular.iter().map(|place| subject.singular(place)));
    found.extend(solid.seam().map(|at| subject.seam(at)));
    // where a formula jumps, differences say nothing of its gradient
    if jumps.is_empty() {
        found.extend(solid.uneven_operands().first().map(|uneven| subject.uneven(uneven)));
    }
    found
}

/// The places in a box at which ω is singular outside of a solid and does not jump.
fn singular(solid: &Solid, over: &Aabb, jumps: &[Break]) -> Vec<Break> {
    let mut found = solid.singularities(over);
    found.retain(|place| jumps.iter().all(|jump| jump.span != place.span));
    found
}

/// The text of a solid's formula in the file.
fn definition(program: &Program, named: &NamedSolid) -> Option<Span> {
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
struct Subject<'a> {
    name: &'a str,
    /// The place of its name.
    at: Span,
    /// Its formula.
    text: Option<Span>,
}

impl<'a> Subject<'a> {
    /// A body of a scene by its name. If it is the name of a solid of the file, warnings point to its
    /// formula, and otherwise to the place in the scene.
    fn of(program: &Program, name: &'a str, place: Span) -> Self {
        match program.module().solids.iter().find(|named| named.name == name) {
            Some(named) => Self { name, at: named.span, text: definition(program, named) },
            None => Self { name, at: place, text: Some(place) },
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
        let message = format!("ω of solid `{}` is 0 within it, at {}", self.name, point(at));
        self.warning(Code::SEAM, self.text, message, "there is a surface without an outside".into())
            .help("if an outline is turned there, draw it beyond its axis: to x < 0 for `.revolve()`")
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
        let message = format!("ω of solid `{name}` {how} from one sign to the other at {}", point(jump.at));
        let what = format!("{} of this does", jump.operation);
        self.warning(Code::JUMP, jump.span, message, what).help(help)
    }

    fn singular(&self, found: &Break) -> Diagnostic {
        let what = match found.what {
            Breakage::NoValue | Breakage::Jump => "no value",
            Breakage::Pole => "no bound",
        };
        let name = &self.name;
        let message = format!("ω of solid `{name}` has {what} outside of it, at {}", point(found.at));
        let at = format!("{} of this has none there", found.operation);
        self.warning(Code::SINGULAR, found.span, message, at)
            .help("choose another formula there by `where`, or keep its operand away by `max`")
    }
}

/// A shape, the widths, m, below which walls and gaps are reported, and the box of the scene.
type Search = (Node, [f64; 2], Aabb);

/// Warnings about obstacles that the particles of their scenes are too large for, and about fluids that lie
/// in obstacles. The walls of a container are not looked at.
pub(super) fn of_scenes(
    engine: Engine,
    program: &Program,
    searches: &mut Searches,
) -> Result<Vec<Diagnostic>, Error> {
    let mut found = Vec::new();
    for scene in &program.module().scenes {
        if scene.obstacles.len() > MOST_OBSTACLES {
            continue;
        }
        let experiment = match Experiment::new(program, &scene.name, engine) {
            Ok(experiment) => experiment,
            Err(Error::Diagnostics(refusal)) => {
                // solids report tolerances themselves
                found.extend(refusal.list.into_iter().filter(|refusal| refusal.code != Code::TOLERANCE));
                continue;
            }
            Err(other) => return Err(other),
        };
        let spacing = experiment.parameters().spacing();
        let (outside, obstacles) = experiment
            .bodies()
            .split_at(usize::from(scene.container.is_some()).min(experiment.bodies().len()));
        let outside = outside.first().map(|body| &body.solid);
        for (k, (obstacle, body)) in scene.obstacles.iter().zip(obstacles).enumerate() {
            found.extend(out_of_reach((scene, spacing), obstacle, (&body.solid, outside)));
            let wall = wall_limit(scene, usize::from(outside.is_some()) + k);
            let search = (obstacle.shape, [wall * spacing, spacing], scene.domain);
            found.extend(too_thin(
                (scene, spacing),
                obstacle,
                wall,
                searches.thin_parts(&body.solid.at(0.0), search),
            ));
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
        let message = "no particle finds room: all of the fluid's shape lies in obstacles";
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
        let message =
            format!("{:.0} % of the fluid's shape lies {place}, where no particle is placed", 100.0 * part);
        Some(Diagnostic::warning(Code::FLUID_IN_OBSTACLE, span, message).help(help))
    });
    told.collect()
}

/// A warning if no fluid can meet an obstacle.
fn out_of_reach(
    (scene, spacing): (&Scene, f64),
    obstacle: &Obstacle,
    (solid, outside): (&Solid, Option<&Solid>),
) -> Option<Diagnostic> {
    if solid.graph(ProgramKind::Value).0.len() > MOST_OPERATIONS {
        return None;
    }
    let is_out = experiment::is_out_of_reach(solid, outside, &scene.domain, scene.run.until, DEPTH * spacing);
    is_out.then(|| {
        let (room, help) = match &scene.container {
            Some(container) => (
                format!("the container `{}`", container.name),
                "where its face lies on the container's, both act on the fluid: let the container reach beyond it",
            ),
            None => ("the box".to_owned(), "move it into the box, or make the box larger"),
        };
        let message = format!("obstacle `{}` lies outside {room}: no fluid can be in its place", obstacle.name);
        Diagnostic::warning(Code::OUT_OF_REACH, obstacle.span, message).help(help)
    })
}

/// Part of the spacing by which an obstacle may reach into the room and count as outside of it.
const DEPTH: f64 = 0.5;

/// For obstacles with more operations it is not tested what they take of the fluid, and whether the fluid can
/// meet them: that would take seconds.
const MOST_OPERATIONS: usize = 2000;

/// A fluid gets a warning if at least this part of its shape lies in obstacles.
const MUCH: f64 = 0.25;

/// Warnings about the bodies of an experiment that its fluid would meet: places at which their formulas jump or have no
/// value, and walls and gaps that its particles are too large for.
pub(super) fn of_experiment(experiment: &Experiment, searches: &mut Searches) -> Diagnostics {
    let (scene, spacing) = (experiment.scene(), experiment.parameters().spacing());
    let sources = experiment.program().sources().clone();
    let mut found = Diagnostics { list: Vec::new(), sources };
    if scene.obstacles.len() > MOST_OBSTACLES {
        return found;
    }
    let container = scene.container.iter().map(|container| (&container.name, container.span, None));
    let obstacles = scene.obstacles.iter().map(|obstacle| (&obstacle.name, obstacle.span, Some(obstacle)));
    let bodies = container.chain(obstacles).zip(experiment.bodies());
    for (number, ((name, span, obstacle), body)) in bodies.enumerate() {
        let subject = Subject::of(experiment.program(), name, span);
        let jumps = body.solid.jumps(&scene.domain);
        found.list.extend(jumps.iter().map(|jump| subject.jump(jump)));
        found
            .list
            .extend(singular(&body.solid, &scene.domain, &jumps).iter().map(|place| subject.singular(place)));
        // behind the walls of a container is the outside, and the number of particles of the fluid shows its
        // gaps
        if let Some(obstacle) = obstacle {
            let outside = scene.container.as_ref().and_then(|_| experiment.bodies().first());
            let solids = (&body.solid, outside.map(|outside| &outside.solid));
            found.list.extend(out_of_reach((scene, spacing), obstacle, solids));
            let wall = wall_limit(scene, number);
            let parts =
                searches.thin_parts(&body.solid, (obstacle.shape, [wall * spacing, spacing], scene.domain));
            found.list.extend(too_thin((scene, spacing), obstacle, wall, parts));
        }
    }
    found
}

/// Walls that are thinner than this part of the spacing are reported. A particle stays half a spacing away
/// from each face: through such a wall it is nearer to those on the other side than to its own second
/// neighbours.
const THIN_WALL: f64 = 0.5;

/// Walls whose load a probe measures are reported below this part of the spacing. The kernels of particles
/// before a thinner wall reach beyond it, where nothing presses back: with still water on one side loads are
/// 5 % too large at 1.4 spacings.
const LOADED_WALL: f64 = 1.5;

/// Walls and gaps as wide as this part of the limit are wide enough.
const ALMOST: f64 = 0.999;

/// Scenes with more obstacles are not looked at.
const MOST_OBSTACLES: usize = 50;

/// Messages about the thinnest wall and the thinnest gap of an obstacle.
fn too_thin(
    scene: (&Scene, f64),
    obstacle: &Obstacle,
    of_wall: f64,
    [wall, gap]: [Option<ThinPart>; 2],
) -> impl Iterator<Item = Diagnostic> {
    [(wall, "wall", of_wall), (gap, "gap", 1.0)]
        .into_iter()
        .filter_map(move |(part, what, of_spacing)| thin(scene, obstacle, &part?, (what, of_spacing)))
}

fn thin(
    (scene, spacing): (&Scene, f64),
    obstacle: &Obstacle,
    part: &ThinPart,
    (what, of_spacing): (&str, f64),
) -> Option<Diagnostic> {
    let spacings = part.thickness / spacing;
    // of a search that ends a little below the limit
    if spacings > ALMOST * of_spacing {
        return None;
    }
    let is_load = what == "wall" && spacings >= THIN_WALL;
    let less = match () {
        () if is_load => format!("{spacings:.1} times"),
        () if of_spacing != 1.0 => "less than half of".to_owned(),
        () => "less than".to_owned(),
    };
    let consequence = match (is_load, what) {
        (true, _) => {
            "; loads on it by a fluid on one side are too large, by 5 % at 1.4 times, 15 % at 1, 40 % at 0.7"
        }
        (false, "wall") => ", so that fluids on its two sides push one another through it",
        (false, _) => ", so that less flows through it than should",
    };
    let message = format!(
        "a {what} of obstacle `{}` is {:.2e} m wide at {}: {less} the {spacing:.2e} m between particles{consequence}",
        obstacle.name,
        part.thickness,
        point(part.at)
    );
    // so that it is shown
    let needed = rounded_down(part.thickness / of_spacing);
    let number = scene.fluid.particles.map_or_else(String::new, |n| {
        format!(", that of {:.1e} particles,", n as f64 * (spacing / needed).powi(3))
    });
    let help = format!("a spacing of {needed:.1e} m{number} is small enough; or make the {what} wider");
    Some(Diagnostic::warning(Code::THIN_FOR_PARTICLES, obstacle.span, message).help(help))
}

/// A length, m, rounded down to two digits.
fn rounded_down(length: f64) -> f64 {
    let unit = 10_f64.powf(length.log10().floor() - 1.0);
    // an exact number of units may lie a rounding error below it
    (length / unit * (1.0 + 1e-9)).floor() * unit
}

/// The part of the spacing below which a wall of a body, given by its number, is reported.
fn wall_limit(scene: &Scene, number: usize) -> f64 {
    let is_loaded = scene
        .probes
        .iter()
        .any(|probe| matches!(probe.measured, rfm::sph::Probe::Force { obstacle, .. } if obstacle == number));
    if is_loaded { LOADED_WALL } else { THIN_WALL }
}

fn point(p: DVec3) -> String {
    let DVec3 { x, y, z } = to_thousandths(p);
    format!("[{x:.3}, {y:.3}, {z:.3}]")
}
