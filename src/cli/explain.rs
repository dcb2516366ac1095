//! `rfm explain`: the long text of a message, or the stages of the compiler for a file.

use std::path::Path;

use glam::DVec3;

use super::args::{Explain, Stage};
use super::language::{outputs, page, words::is_of_a_word};
use super::output::sound_speed;
use super::run::{experiment, start};
use super::shared::Shared;
use super::{Failure, choose, input};
use rfm::codegen::{CodegenError, Listing, Request, Shape, target_description};
use rfm::diagnostic::{Span, explain, nearest};
use rfm::geom::{Aabb, to_thousandths};
use rfm::interval::Interval;
use rfm::ir::{Node, dump};
use rfm::lower::{NamedSolid, Scene};
use rfm::simplify::{Exactness, MOST_PLACES, simplify};
use rfm::solid::{Bounds, ProgramKind, Remainder};
use rfm::sph::{Method, method_reference, methods_reference};
use rfm::syntax;
use rfm::{Precision, Program, Solid};

pub(super) fn run(shared: &Shared, options: &Explain) -> Result<(), Failure> {
    if shared.json {
        return Err(Failure::usage("explanations are for people: `rfm explain` has no --json"));
    }
    let Some(subject) = options.subject.as_deref() else {
        say!("{}", methods_reference().trim_end());
        return Ok(());
    };
    if subject == "codes" && !Path::new(subject).exists() {
        for (code, about) in page::messages() {
            say!("{code}  {about}");
        }
        return Ok(());
    }
    if let Some(method) = Method::named(subject).filter(|_| !Path::new(subject).exists()) {
        say!("{}", method_reference(method).trim_end());
        return Ok(());
    }
    if let Some(text) = explain(subject) {
        say!("{}\n\n{text}", subject.to_uppercase());
        return Ok(());
    }
    let is_code = subject.len() == 5 && subject.starts_with(['E', 'W']) && !Path::new(subject).exists();
    if is_code && subject[1..].bytes().all(|b| b.is_ascii_digit()) {
        return Err(Failure::usage(format!("there is no message {subject}: `rfm explain codes` lists all")));
    }
    let (path, name) = choose::subject(subject);
    if !Path::new(path).exists() {
        if subject == "words" {
            say!("{}", page::all().trim_end());
            return Ok(());
        }
        if subject == "outputs" {
            say!("{}", outputs::all().trim_end());
            return Ok(());
        }
        if let Some(text) = page::of(subject).or_else(|| outputs::of(subject)) {
            say!("{}", text.trim_end());
            return Ok(());
        }
        let word = subject.trim_start_matches('.');
        if !word.is_empty() && word.chars().all(is_of_a_word) {
            return Err(no_such_word(subject));
        }
    }
    let program = input::program(shared, path)?;
    if options.show.contains(&Stage::Ast) {
        say!("{}", syntax::print(program.ast()).trim_end());
    }
    match name {
        Some(name) if program.module().scenes.iter().any(|s| s.name == name) => {
            scene_passes(shared, &program, choose::scene(&program, Some(name))?)
        }
        Some(name) => {
            let module = program.module();
            let Some(solid) = module.solids.iter().find(|s| s.name == name) else {
                return Err(choose::no_such(path, &program, name));
            };
            stages(shared, &program, solid, &options.show)
        }
        None => {
            for solid in &program.module().solids {
                stages(shared, &program, solid, &options.show)?;
            }
            Ok(())
        }
    }
}

fn no_such_word(subject: &str) -> Failure {
    if let Some(here) = rfm::lower::known_elsewhere(subject) {
        return Failure::usage(format!("there is no word `{subject}`: {here}"));
    }
    let names = page::names();
    let near = nearest(subject, names.iter().map(String::as_str));
    let near = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    Failure::usage(format!(
        "there is no word and no file `{subject}`{near} (`rfm explain words` lists all words, `rfm explain codes` all \
         messages)"
    ))
}

/// Prints what the stages of the compiler make of one solid.
fn stages(shared: &Shared, program: &Program, named: &NamedSolid, show: &[Stage]) -> Result<(), Failure> {
    let solid = program.solid_with(&named.name, shared.engine.into()).map_err(choose::usage)?;
    let text = Explanation { program, solid: &solid };
    say!("solid {}", named.name);
    text.motion();
    text.simplification(named);
    text.leaves();
    text.specialisation();
    text.programs();
    let (value, value_outputs) = solid.graph(ProgramKind::Value);
    let (gradient, gradient_outputs) = solid.graph(ProgramKind::Gradient);
    for precision in [Precision::F64, Precision::F32] {
        let name = precision.name();
        let scaled = solid.forms(ProgramKind::Value, precision).exceptions();
        if scaled > 0 {
            say!("  scaled: {scaled} operations in {name}, where squares may leave the range");
        }
    }
    if let Some(chosen) = choose::within_tolerance(program, &solid)? {
        let over = chosen.over();
        say!(
            "  values of ω: {}, to {:.1e} in {:.3} … {:.3}",
            chosen.variant().name(),
            chosen.bound(),
            to_thousandths(over.min),
            to_thousandths(over.max)
        );
    }
    say!("  target: {}", target_description());
    if show.contains(&Stage::Ir) {
        say!("\nω:\n{}", dump(value, &[("omega", value_outputs[0])], program.sources()));
        let names = ["omega", "gx", "gy", "gz"];
        let roots: Vec<_> = names.into_iter().zip(gradient_outputs.iter().copied()).collect();
        say!("ω and ∇ω:\n{}", dump(gradient, &roots, program.sources()));
    }
    if show.contains(&Stage::Clif) || show.contains(&Stage::Asm) {
        for (title, kind) in [("ω", ProgramKind::Value), ("ω and ∇ω", ProgramKind::Gradient)] {
            let listing = listing(&solid, kind).map_err(|e| Failure::usage(e.to_string()))?;
            if show.contains(&Stage::Clif) {
                say!("\n{title}, f64, one point, intermediate representation:\n{}", listing.clif);
            }
            if show.contains(&Stage::Asm) {
                say!("\n{title}, f64, one point, machine code:\n{}", listing.assembly);
            }
        }
    }
    Ok(())
}

/// The code generator's listings of a program for one point in `f64`.
fn listing(solid: &Solid, kind: ProgramKind) -> Result<Listing, CodegenError> {
    let (graph, outputs) = solid.graph(kind);
    let (precision, shape, forms) = (Precision::F64, Shape::Point, solid.forms(kind, Precision::F64));
    let uniforms = solid.moves();
    Listing::of(Request { graph, inputs: &[], outputs, precision, shape, forms, parameters: false, uniforms })
}

/// Most leaves that are listed one by one.
const MOST_LEAVES: usize = 24;

/// Most operations of a program that is compiled only to be counted.
const MOST_OPERATIONS: usize = 5_000;

/// The text about one solid, part by part.
struct Explanation<'a> {
    program: &'a Program,
    solid: &'a Solid,
}

impl Explanation<'_> {
    /// The place `pawn.rfm:8:11` and the beginning of the text there.
    fn place(&self, span: Span) -> String {
        let Some(source) = self.program.sources().iter().find(|s| s.id == span.source) else {
            return String::new();
        };
        let at = source.position(span.start as usize);
        // without the comments and line ends that an expression may contain
        let code: Vec<&str> =
            source.slice(span).lines().map(|l| l.split('#').next().unwrap_or("").trim()).collect();
        let text = code.join(" ").trim().to_string();
        let cut: String = text.chars().take(60).collect();
        let more = if cut.len() < text.len() { "…" } else { "" };
        format!("{}:{}:{}  `{cut}{more}`", source.name, at.line, at.column)
    }

    /// What is computed once for each time, if the solid moves.
    fn motion(&self) {
        if let Some(numbers) = self.solid.time_dependent(ProgramKind::Value) {
            let s = if numbers == 1 { "" } else { "s" };
            say!(
                "  moves: time enters ω by {numbers} number{s}, found once for each time; below it is at t = 0 s"
            );
        }
    }

    /// Which rules were applied, and to which places of the text.
    fn simplification(&self, named: &NamedSolid) {
        let (written, _) = self.program.module().graph.extract(&[named.node]);
        let (graph, outputs) = self.solid.graph(ProgramKind::Value);
        let (simplified, ..) = simplify(&self.program.module().graph, &[named.node]);
        say!(
            "  ω: {} operations as written, {} simplified, {} with the guard against coordinates that are not finite",
            written.len(),
            simplified.len(),
            graph.len()
        );
        let rules = &self.solid.applied_rules().0;
        if !rules.is_empty() {
            say!("  rewritten, {}: the value is the same at every point", Exactness::Value);
        }
        for (equation, uses) in rules {
            say!("    {:>4} ×  {equation}", uses.count);
            for &span in &uses.places {
                say!("             {}", self.place(span));
            }
            if uses.places.len() == MOST_PLACES {
                say!("             …");
            }
        }
        let mut used = vec![0usize; graph.len()];
        graph.nodes().for_each(|(_, expr)| expr.operands().for_each(|operand| used[operand.index()] += 1));
        outputs.iter().for_each(|output| used[output.index()] += 1);
        let is_operation = |node: Node| graph.expr(node).operands().next().is_some();
        let shared = graph.nodes().filter(|&(node, _)| used[node.index()] > 1 && is_operation(node));
        let place = |(node, _)| graph.span(node).map(|span| (used[node.index()], self.place(span)));
        // one expression may stand for several operations
        let mut places: Vec<(usize, String)> = Vec::new();
        shared.filter_map(place).for_each(|found| {
            if !places.contains(&found) {
                places.push(found)
            }
        });
        for (uses, place) in places.iter().take(MOST_LEAVES) {
            say!("  computed once, used {uses} times: {place}");
        }
        if places.len() > MOST_LEAVES {
            say!("  … and {} more", places.len() - MOST_LEAVES);
        }
    }

    /// The leaves, which are the inequalities that decide the sign.
    fn leaves(&self) {
        let Some(leaves) = self.solid.leaves() else {
            say!("  leaves: too many to be taken apart");
            return;
        };
        let shapes = leaves.iter().map(|leaf| leaf.shape + 1).max().unwrap_or(0);
        let s = |n: usize| if n == 1 { "" } else { "s" };
        say!(
            "  sign, {}: {} lea{} of {shapes} shape{}, joined by min and max in place of ∧ and ∨",
            Exactness::ZeroSet,
            leaves.len(),
            if leaves.len() == 1 { "f" } else { "ves" },
            s(shapes)
        );
        for (i, leaf) in leaves.iter().enumerate().take(MOST_LEAVES) {
            let place = leaf.span.map_or(String::new(), |span| self.place(span));
            say!(
                "    leaf {:<3} shape {:<3} {:>3} operations  {place}",
                i + 1,
                leaf.shape + 1,
                leaf.operations
            );
        }
        if leaves.len() > MOST_LEAVES {
            say!("    … and {} more", leaves.len() - MOST_LEAVES);
        }
    }

    /// Which leaves are irrelevant, as ranges prove, in the solid's bounds and in their eighths.
    fn specialisation(&self) {
        let bounds = match self.solid.bounds() {
            Bounds::Within(bounds) => *bounds,
            Bounds::Empty => return say!("  bounds: empty, proven by ranges"),
            Bounds::Unbounded => return say!("  bounds: none found"),
        };
        let corner = |p: DVec3| format!("{:.3}", to_thousandths(p));
        let shown = (corner(bounds.min), corner(bounds.max));
        say!("  what ranges leave of it in its bounds {} to {}, {}:", shown.0, shown.1, Exactness::ZeroSet);
        self.say_left(vec![("everywhere".to_string(), bounds)]);
        let centre = bounds.centre();
        let eighth = |corner: DVec3| {
            let over = Aabb::new(corner.min(centre), corner.max(centre));
            let side = |axis: usize| if over.min[axis] == bounds.min[axis] { '−' } else { '+' };
            (format!("x{}y{}z{}", side(0), side(1), side(2)), over)
        };
        say!("  and in the eighths of its bounds, lower (−) or upper (+) along each axis:");
        self.say_left(bounds.corners().map(eighth).into());
    }

    /// The leaves that are left in some boxes. Boxes with the same leaves are named together.
    fn say_left(&self, boxes: Vec<(String, Aabb)>) {
        let mut groups: Vec<(Remainder, String, Vec<Interval>)> = Vec::new();
        for (name, over) in boxes {
            let (Some(left), Some(ranges)) = (self.solid.remainder_in(&over), self.solid.leaf_ranges(&over))
            else {
                return say!("    too many leaves to tell");
            };
            match groups.iter_mut().find(|(known, ..)| *known == left) {
                Some((_, names, hulls)) => {
                    names.push_str(&format!(", {name}"));
                    hulls.iter_mut().zip(&ranges).for_each(|(hull, range)| *hull = hull.hull(*range));
                }
                None => groups.push((left, name, ranges)),
            }
        }
        for (left, names, ranges) in groups {
            match left {
                Remainder::Outside => say!("    {names}: all fluid"),
                Remainder::Inside => say!("    {names}: all solid"),
                Remainder::Leaves(kept) => self.say_dropped(&names, &kept, &ranges),
            }
        }
    }

    /// Prints which leaves are left in some boxes, and why the others are dropped.
    fn say_dropped(&self, names: &str, kept: &[bool], ranges: &[Interval]) {
        let left: Vec<String> = (0..kept.len()).filter(|&i| kept[i]).map(|i| (i + 1).to_string()).collect();
        let more = if left.len() > MOST_LEAVES { ", …" } else { "" };
        let list = left[..left.len().min(MOST_LEAVES)].join(", ");
        match left.len() {
            n if n == kept.len() => return say!("    {names}: every leaf"),
            n => say!("    {names}: {n} of {} leaves, {list}{more}", kept.len()),
        }
        for i in (0..kept.len()).filter(|&i| !kept[i]).take(MOST_LEAVES) {
            let Interval { lo, hi } = ranges[i];
            let why = match (lo > 0.0, hi < 0.0) {
                (true, _) => "positive throughout",
                (_, true) => "negative throughout",
                _ => "the rest of its part decides without it",
            };
            say!("      dropped leaf {}: from {lo:.3} to {hi:.3}, {why}", i + 1);
        }
    }

    /// The operations and instructions of each program.
    fn programs(&self) {
        say!("  programs for one point in f64:");
        for (name, kind) in [
            ("ω", ProgramKind::Value),
            ("ω and ∇ω", ProgramKind::Gradient),
            ("sign", ProgramKind::Sign),
            ("sign and leaf's gradient", ProgramKind::SignGradient),
            ("distance, normal, curvature", ProgramKind::Contact),
        ] {
            let operations = self.solid.graph(kind).0.len();
            let instructions = if operations > MOST_OPERATIONS {
                "not compiled here".to_string()
            } else {
                match listing(self.solid, kind) {
                    Ok(listing) => format!("{} instructions", instructions(&listing.assembly)),
                    Err(error) => error.to_string(),
                }
            };
            say!("    {name:<28} {operations:>6} operations  {instructions:>6}");
        }
    }
}

/// Number of lines of an assembly text that are instructions, neither labels nor comments.
fn instructions(assembly: &str) -> usize {
    let is_instruction = |line: &&str| {
        let line = line.trim();
        !(line.is_empty() || line.ends_with(':') || line.starts_with([';', '.']))
    };
    assembly.lines().filter(is_instruction).count()
}

/// `rfm explain FILE:SCENE`: which passes run, which do not, and why.
fn scene_passes(shared: &Shared, program: &Program, scene: &Scene) -> Result<(), Failure> {
    let experiment = experiment(shared, program, &scene.name)?;
    let (simulation, _) = start(&experiment)?;
    let (parameters, step) = (experiment.parameters(), experiment.time_step());
    say!(
        "scene {}: method {}, sums over neighbours in {}, time step {}",
        scene.name,
        parameters.method.name(),
        parameters.precision.name(),
        if parameters.adaptive {
            step.reason.to_string()
        } else {
            format!("{:.3e} s ({})", step.seconds, step.reason)
        }
    );
    if parameters.sound_speed() > 0.0 {
        say!("  sound_speed: {}", sound_speed(parameters));
    }
    for (key, word) in parameters.method.words() {
        say!("  {key}: {word}");
    }
    for (pass, absence) in simulation.plan() {
        match absence {
            None => say!("  runs      {pass}"),
            Some(reason) => say!("  left out  {pass}: {reason}"),
        }
    }
    Ok(())
}
