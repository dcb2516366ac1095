//! `rfm check`: messages about files, the solids with their bounds and volumes, and slices.

mod facts;
mod measure;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use serde::Serialize;

use super::args::{Check, MessageFormat};
use super::deadline::Deadline;
use super::failure::{Failure, complain, note, warn};
use super::findings::{self, Message, message};
use super::mesh::hidden;
use super::shared::Shared;
use super::{choose, input, lints, output, section};
use facts::{Box3, Facts, RESOLUTION, VOLUME_CELLS, print};
use measure::measure;
use rfm::diagnostic::{Code, Diagnostic, Diagnostics};
use rfm::geom::Aabb;
use rfm::glam::DVec3;
use rfm::ir::{Axis, Magnitudes};
use rfm::lower::NamedSolid;
use rfm::mesh::{Grid, ThinCells};
use rfm::solid::{Bounds, ProgramKind, Unbounded};
use rfm::{Precision, Program, Solid};

#[derive(Serialize)]
struct Document {
    schema: u32,
    ok: bool,
    diagnostics: Vec<Message>,
    solids: Vec<Facts>,
}

/// Seconds for each operation of a solid of many leaves: of ten thousand parts a minute was seen.
const SECONDS_BY_LEAVES: f64 = 8e-5;

/// Seconds for each operation of a solid that is evaluated as a whole, at a million points.
const SECONDS_AS_A_WHOLE: f64 = 4e-4;

pub(super) fn run(shared: &Shared, options: &Check) -> Result<(), Failure> {
    if !options.slice.is_empty() && options.files.len() > 1 {
        return Err(Failure::usage("--slice plots one file at a time"));
    }
    options.output.as_deref().map(output::Picture::of).transpose()?;
    if options.watch {
        return watch(shared, options);
    }
    once(shared, options, &mut Vec::new())
}

/// Checks again whenever the time stamp of a file changes, or that of a file that one of them names. It ends with the
/// process.
fn watch(shared: &Shared, options: &Check) -> Result<(), Failure> {
    if options.files.iter().any(|f| f == Path::new("-")) {
        return Err(Failure::usage("standard input cannot be watched"));
    }
    let stamps = |named: &[PathBuf]| -> Vec<Option<SystemTime>> {
        let all = options.files.iter().chain(named);
        all.map(|f| std::fs::metadata(f).and_then(|m| m.modified()).ok()).collect()
    };
    loop {
        let (started, mut named) = (SystemTime::now(), Vec::new());
        let before = stamps(&[]);
        if std::io::stdout().is_terminal() {
            anstream::print!("\x1b[2J\x1b[H");
        }
        match once(shared, options, &mut named) {
            Ok(()) | Err(Failure::Findings) => {}
            Err(Failure::Usage(message)) => complain(&message), // the file may be back in a moment
            Err(other) => return Err(other),
        }
        note("watching; press Ctrl-C to end");
        let mut seen = stamps(&named);
        // what was written while the files were read may have been missed
        let missed = seen[..before.len()] != before[..]
            || seen[before.len()..].iter().flatten().any(|written| *written >= started);
        if missed {
            seen.clear();
        }
        while stamps(&named) == seen {
            std::thread::sleep(Duration::from_millis(100));
        }
    }
}

/// Checks all files. `named` receives the paths of those that they name.
fn once(shared: &Shared, options: &Check, named: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let mut document = Document { schema: 1, ok: true, diagnostics: Vec::new(), solids: Vec::new() };
    let mut usage = None;
    for path in &options.files {
        match check_file(shared, options, path, &mut document, named) {
            Ok(()) => {}
            // the other files have their messages
            Err(Failure::Findings) => document.ok = false,
            Err(Failure::Usage(message)) => {
                document.ok = false;
                if let Some(earlier) = usage.replace(message) {
                    complain(&earlier);
                }
            }
            Err(other) => return Err(other),
        }
    }
    if shared.json {
        output::json(&document)?;
    }
    findings::write(&document.diagnostics, options.message_format)?;
    match usage {
        Some(message) => Err(Failure::Usage(message)),
        None if document.ok => Ok(()),
        None => Err(Failure::Findings),
    }
}

/// Checks one file, and adds to the document what is known of it and all messages, which are errors if it
/// fails by findings.
fn check_file(
    shared: &Shared,
    options: &Check,
    path: &Path,
    document: &mut Document,
    named: &mut Vec<PathBuf>,
) -> Result<(), Failure> {
    if options.fix {
        findings::fix(shared, path)?;
    }
    let source = input::read(path)?;
    let file = source.name.to_string();
    let files = input::files(shared, &source);
    let checked = input::check(shared, source, files.clone());
    named.extend(files.asked().into_iter().map(PathBuf::from));
    let program = match checked {
        Ok(program) => program,
        Err(diagnostics) => {
            show(shared, options, document, &diagnostics);
            return Err(input::failure(&diagnostics));
        }
    };
    let mut diagnostics = program.warnings();
    let facts = solids(shared, &program, &file, options, &mut diagnostics)?;
    document.ok &= !findings::fail(&diagnostics.list, &options.deny);
    show(shared, options, document, &diagnostics);
    if is_for_people(shared, options) {
        print(&file, &program, &facts);
    }
    document.solids.extend(facts);
    if options.slice.is_empty() {
        return Ok(());
    }
    let list = section::plot(shared, options, &program)?;
    document.ok &= !findings::fail(&list, &options.deny);
    if is_for_people(shared, options) {
        // they are about the flag, so no place in the file is shown
        list.into_iter().for_each(|warning| warn(warning.code, warning.message));
    } else {
        show(shared, options, document, &Diagnostics { list, ..diagnostics });
    }
    Ok(())
}

/// Whether the solids are printed, and messages with the lines of the file.
fn is_for_people(shared: &Shared, options: &Check) -> bool {
    !shared.json && options.message_format == MessageFormat::Human
}

fn show(shared: &Shared, options: &Check, document: &mut Document, diagnostics: &Diagnostics) {
    if is_for_people(shared, options) {
        input::show(diagnostics);
    } else {
        document.diagnostics.extend(diagnostics.list.iter().map(|d| message(d, diagnostics)));
    }
}

/// The facts about every solid. Adds warnings about odd ones to the messages.
fn solids(
    shared: &Shared,
    program: &Program,
    file: &str,
    options: &Check,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Facts>, Failure> {
    let (start, budget, all) = (Instant::now(), options.budget, &program.module().solids);
    let chosen = |name: &String| {
        let found = all.iter().find(|named| named.name == *name);
        found.ok_or_else(|| choose::no_such(Path::new(file), program, name))
    };
    let named_solids: Vec<&NamedSolid> = match &options.solid[..] {
        [] => all.iter().collect(),
        names => names.iter().map(chosen).collect::<Result<_, _>>()?,
    };
    let (mut tried, mut are_all): (Vec<Tried<'_>>, bool) = (Vec::new(), true);
    for (number, &named) in named_solids.iter().enumerate() {
        let elapsed = start.elapsed().as_secs_f64();
        if is_over(number, named_solids.len(), elapsed, budget) {
            note(left_out(&named_solids, number, elapsed, budget));
            are_all = false;
            break;
        }
        let solid = program.solid_with(&named.name, shared.engine.into()).map_err(choose::usage)?;
        let seconds = share(budget - elapsed, named_solids.len() - number, budget);
        tried.push(Tried::new((named, solid.at(options.time)), file, seconds, budget)?);
    }
    // what the others have left is for those whose share was too small; of too many solids nothing is left
    let mut unfinished = tried.iter().filter(|tried| tried.is_unfinished()).count();
    for tried in tried.iter_mut().filter(|tried| are_all && tried.is_unfinished()) {
        tried.again(file, share(budget - start.elapsed().as_secs_f64(), unfinished, 0.0))?;
        unfinished -= 1;
    }
    let (mut facts, mut searches) = (Vec::new(), lints::Searches::new());
    for tried in tried {
        facts.push(conclude(program, tried, &mut searches, diagnostics));
    }
    searches.tell();
    diagnostics
        .list
        .extend(lints::of_scenes(shared.engine.into(), program, &mut searches).map_err(choose::usage)?);
    Ok(facts)
}

/// A solid that was measured as far as its share of the time went.
struct Tried<'a> {
    named: &'a NamedSolid,
    solid: Solid,
    facts: Facts,
    /// `None` if it was not measured, because that takes longer than the budget.
    thin: Option<ThinCells>,
    notes: Vec<String>,
    /// Its share, s.
    seconds: f64,
}

impl<'a> Tried<'a> {
    fn new(
        (named, solid): (&'a NamedSolid, Solid),
        file: &str,
        seconds: f64,
        budget: f64,
    ) -> Result<Self, Failure> {
        let operations = solid.graph(ProgramKind::Value).0.len();
        let mut notes = Vec::new();
        let (facts, thin) = match too_long(&solid, operations, budget) {
            Some(why) => {
                notes.push(format!("solid `{}` has {operations} operations: {why}", named.name));
                let bounds = solid.bounds().aabb().map(|bounds| Box3::of(&bounds));
                let empty = *solid.bounds() == Bounds::Empty;
                (Facts { bounds, empty, ..Facts::unknown(&solid, file) }, None)
            }
            None => {
                let (facts, thin) = measure(&solid, file, &Deadline::after(seconds), &mut notes)?;
                (facts, Some(thin))
            }
        };
        Ok(Self { named, solid, facts, thin, notes, seconds })
    }

    fn is_unfinished(&self) -> bool {
        self.thin.is_some() && (!self.facts.unfinished.is_empty() || self.facts.wants_time)
    }

    /// Measures it anew, if there is more time than before.
    fn again(&mut self, file: &str, seconds: f64) -> Result<(), Failure> {
        if seconds > self.seconds {
            self.notes.clear();
            let (facts, thin) = measure(&self.solid, file, &Deadline::after(seconds), &mut self.notes)?;
            (self.facts, self.thin, self.seconds) = (facts, Some(thin), seconds);
        }
        Ok(())
    }
}

/// The part of the remaining time that a solid may take: an equal one, but no less than a twentieth of the budget, for
/// most solids take next to nothing.
fn share(left: f64, solids: usize, budget: f64) -> f64 {
    (left / solids as f64).max(LEAST_SHARE * budget).min(left)
}

/// The least part of the budget that a solid gets.
const LEAST_SHARE: f64 = 0.05;

/// The most names in a message.
const MOST_NAMES: usize = 5;

/// Which solids were not measured, and why.
fn left_out(solids: &[&NamedSolid], measured: usize, elapsed: f64, budget: f64) -> String {
    let rest = &solids[measured..];
    let names: Vec<String> = rest.iter().take(MOST_NAMES).map(|named| format!("`{}`", named.name)).collect();
    let more = match rest.len() - names.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let why = if elapsed > budget { "is spent" } else { "would not reach a tenth of them" };
    format!(
        "{measured} of {} solids were measured, because the budget of {budget} s {why}; left out: {}{more}; \
         --budget SECONDS gives more time, and -s NAME chooses solids",
        solids.len(),
        names.join(", ")
    )
}

/// What is told of a solid, and the messages about it.
fn conclude(
    program: &Program,
    tried: Tried<'_>,
    searches: &mut lints::Searches,
    diagnostics: &mut Diagnostics,
) -> Facts {
    let Tried { named, solid, facts: mut found, thin, notes, .. } = tried;
    notes.into_iter().for_each(note);
    found.tolerance = program.tolerance(&named.name).map(|tolerance| tolerance.value);
    let Some(thin) = thin else { return found };
    diagnostics.list.extend(overflow(program, named, &solid));
    match program.within_tolerance(&solid) {
        Some(Ok(chosen)) => {
            found.program = Some(chosen.variant().name());
            found.error_bound = Some(chosen.bound());
        }
        Some(Err(diagnostic)) => diagnostics.list.push(*diagnostic),
        None => {}
    }
    diagnostics.list.extend(remarks(program, named, &solid, &thin));
    if found.shows_nothing {
        diagnostics.list.push(may_be_empty(named));
    }
    diagnostics.list.extend(lints::of_solid(program, named, &solid, searches));
    found
}

/// Whether no more solids are measured: the budget is spent, or a tenth of it has shown that there are so
/// many solids that it would reach a tenth of them at most.
fn is_over(measured: usize, all: usize, elapsed: f64, budget: f64) -> bool {
    let is_hopeless = elapsed > 0.1 * budget && elapsed * all as f64 > 10.0 * budget * measured as f64;
    measured > 0 && (elapsed > budget || is_hopeless)
}

/// Why a solid is not measured, if that would take longer than the budget.
fn too_long(solid: &Solid, operations: usize, budget: f64) -> Option<String> {
    // leaf by leaf the work grows with the surface rather than with the formula
    let each = if solid.leaf_count().is_some() { SECONDS_BY_LEAVES } else { SECONDS_AS_A_WHOLE };
    let seconds = (each * operations as f64).ceil();
    let why = || format!("measuring it may take {seconds} s; --budget {seconds} allows it");
    (seconds > budget).then(why)
}

/// A warning about a solid that has a box but shows nothing in it, as `sphere(1) and not sphere(1)`.
fn may_be_empty(named: &NamedSolid) -> Diagnostic {
    let message = format!(
        "solid `{}` may be empty: {VOLUME_CELLS} cells along its longest side show nothing of it, and no part is hidden between them",
        named.name
    );
    Diagnostic::warning(Code::EMPTY_SOLID, named.span, message)
        .help("look for a shape that is joined by `and` to its own outside, or for a thickness of zero")
}

/// Warnings about a solid that is empty, unbounded or thin.
fn remarks(program: &Program, named: &NamedSolid, solid: &Solid, thin: &ThinCells) -> Vec<Diagnostic> {
    let warning = |code, message| Diagnostic::warning(code, named.span, message);
    let mut found = Vec::new();
    match solid.bounds() {
        Bounds::Empty => {
            let message = format!("solid `{}` is empty: ω is nowhere positive", named.name);
            found.push(warning(Code::EMPTY_SOLID, message));
        }
        Bounds::Unbounded => {
            found.push(unbounded(program, named, solid));
        }
        Bounds::Within(_) => {}
    }
    let grid = solid.bounds().aabb().and_then(|bounds| Grid::around(&bounds, RESOLUTION).ok());
    if let Some(grid) = grid.filter(|_| thin.count > 0) {
        let (what, does, help) = match (thin.is_wedge, thin.cells_needed(&grid)) {
            (true, _) => (
                "edges so sharp that",
                "show them blunt",
                "more --cells show more of them, and none shows all",
            ),
            (false, Some(_)) => {
                ("parts or gaps that", "do not show", "mesh it with more --cells, until `thin_cells` is 0")
            }
            (false, None) => (
                "parts or gaps that",
                "do not show",
                "to see the place, mesh it alone with a small --box around it",
            ),
        };
        let message = format!(
            "solid `{}` has {what} {VOLUME_CELLS} cells along its longest side {does}, {}",
            named.name,
            hidden(thin, &grid)
        );
        found.push(warning(Code::THIN_PARTS, message).help(help));
    }
    found
}

/// Whether ω is proven to be positive far away on all sides, as a distance is that is negative inside.
fn is_all_but_a_part(solid: &Solid) -> bool {
    [1.0, 1e2, 1e4].into_iter().any(|near: f64| {
        let far = 1e3 * near;
        if solid.range(&Aabb::new(DVec3::splat(-near), DVec3::splat(near))).lo >= 0.0 {
            return false;
        }
        DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]).all(|side| {
            let others = (DVec3::ONE - side.abs()) * far;
            let (a, b) = (near * side - others, far * side + others);
            solid.range(&Aabb::new(a.min(b), a.max(b))).lo > 0.0
        })
    })
}

/// A warning that says which operand of a solid was not found to end, and where.
fn unbounded(program: &Program, named: &NamedSolid, solid: &Solid) -> Diagnostic {
    let why = solid.unbounded();
    let sides = why.as_ref().map_or(String::new(), Unbounded::direction);
    let message = format!("solid `{}` could not be proven to end {sides}", named.name);
    let ends_but_along_z = why.as_ref().is_some_and(|why| why.sides == ["-z", "+z"]);
    let is_profile = ends_but_along_z && !program.module().graph.uses(named.node, Axis::Z);
    let help = match () {
        () if is_profile => {
            "it is a profile, the same at every z: `.extrude(z0, z1)` or `.revolve()` makes a solid of it"
        }
        () if is_all_but_a_part(solid) => {
            "ω is positive inside, and this one is positive everywhere far away: of a distance that is negative inside, \
             write `… <= 0`; if all but a part is meant, intersect it with a box"
        }
        () => "intersect it with a box, or mesh it with --box",
    };
    let warning = Diagnostic::warning(Code::UNBOUNDED_SOLID, named.span, message).help(help);
    let operand = why.filter(|why| !why.is_whole).and_then(|why| why.operand);
    match operand.filter(|operand| operand.source == named.span.source) {
        Some(operand) => warning.label(operand, "this operand has no bounds"),
        None => warning,
    }
}

/// A warning if ω may leave the range of numbers although its leaves do not.
fn overflow(program: &Program, named: &NamedSolid, solid: &Solid) -> Option<Diagnostic> {
    let (graph, _) = program.module().graph.extract_cone(named.node);
    let magnitudes = match program.domain(solid) {
        Some(over) => Magnitudes::over(&graph, &over),
        None => Magnitudes::within_reach(&graph),
    };
    let node = magnitudes.overflow(&graph, Precision::F64)?;
    let message = format!(
        "ω of solid `{}` may leave the range of numbers here: it doubles with each operation inside the next",
        named.name
    );
    let warning = Diagnostic::warning(Code::OVERFLOW, graph.span(node).unwrap_or(named.span), message);
    Some(warning.help("write it as one chain: it is evaluated as a balanced tree"))
}

#[cfg(test)]
mod tests {
    use super::is_over;

    #[test]
    fn one_solid_is_measured_as_far_as_the_budget_goes_and_no_more_when_it_is_spent() {
        assert!(!is_over(0, 3, 100.0, 10.0));
        assert!(!is_over(1, 3, 9.9, 10.0));
        assert!(is_over(1, 3, 10.1, 10.0));
    }

    #[test]
    fn a_budget_that_reaches_few_of_many_solids_is_not_spent() {
        // at this pace a hundred of two thousand would be measured, and of eight hundred an eighth
        assert!(is_over(11, 2000, 1.1, 10.0));
        assert!(!is_over(11, 800, 1.1, 10.0));
        // a tenth of the budget has not passed
        assert!(!is_over(9, 2000, 0.9, 10.0));
    }
}
