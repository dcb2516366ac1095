//! `rfm check`: messages about files, the solids with their bounds and volumes, and slices.

mod facts;
mod measure;
pub(super) mod remarks;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use serde::Serialize;

use super::args::{Check, MessageFormat};
use super::deadline::{Deadline, Within};
use super::failure::{Failure, complain, note, warn};
use super::findings;
use super::message::{Message, message};
use super::progress::Forwards;
use super::shared::Shared;
use super::{choose, input, lints, output, progress, section};
use facts::{Box3, Facts, print};
use measure::measure;
use rfm::diagnostic::Diagnostics;
use rfm::lower::NamedSolid;
use rfm::mesh::{Stretch, ThinCells, Watch};
use rfm::solid::{Bounds, ProgramKind};
use rfm::{Program, Solid};

#[derive(Serialize)]
struct Document {
    schema: u32,
    ok: bool,
    diagnostics: Vec<Message>,
    solids: Vec<Facts>,
}

/// The share of the work that is done when all solids are measured; then slips in their formulas are looked for.
const MEASURED: f64 = 0.8;

/// The share that is done when those are measured again that had too little time.
const MEASURED_AGAIN: f64 = 0.95;

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
            Ok(()) | Err(Failure::Findings | Failure::Params) => {}
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
    let (mut usage, mut fits) = (None, true);
    for path in &options.files {
        match check_file(shared, options, path, &mut document, named) {
            Ok(()) => {}
            // the other files have their messages
            Err(Failure::Findings) => document.ok = false,
            Err(Failure::Params) => (document.ok, fits) = (false, false),
            Err(Failure::Usage(message)) => {
                document.ok = false;
                document.diagnostics.push(Message::of_command(path, &message));
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
        None if !fits => Err(Failure::Params),
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
    let bar = progress::late_shares("checking");
    let forwards = Forwards(&bar);
    let until = |number: usize| MEASURED * number as f64 / named_solids.len() as f64;
    for (number, &named) in named_solids.iter().enumerate() {
        let elapsed = start.elapsed().as_secs_f64();
        if is_over(number, named_solids.len(), elapsed, budget) {
            bar.suspend(|| note(left_out(&named_solids, number, elapsed, budget)));
            are_all = false;
            break;
        }
        let solid = program.solid_with(&named.name, shared.engine.into()).map_err(choose::usage)?;
        let seconds = share(budget - elapsed, named_solids.len() - number, budget);
        bar.set_message(named.name.clone());
        let watch = Stretch { watch: &forwards, from: until(number), to: until(number + 1) };
        tried.push(Tried::new((named, solid.at(options.time)), file, (seconds, budget), &watch)?);
    }
    // what the others have left is for those whose share was too small; of too many solids nothing is left
    let mut unfinished = tried.iter().filter(|tried| tried.is_unfinished()).count();
    let (longer, mut done) = (unfinished, MEASURED);
    for tried in tried.iter_mut().filter(|tried| are_all && tried.is_unfinished()) {
        let from = done;
        done += (MEASURED_AGAIN - MEASURED) / longer as f64;
        let watch = Stretch { watch: &forwards, from, to: done };
        tried.again(file, share(budget - start.elapsed().as_secs_f64(), unfinished, 0.0), &watch)?;
        unfinished -= 1;
    }
    let (mut facts, mut searches) = (Vec::new(), lints::Searches::new());
    let measured = tried.len();
    for (number, tried) in tried.into_iter().enumerate() {
        forwards.progress(done + (1.0 - done) * number as f64 / measured as f64);
        bar.suspend(|| tried.notes.iter().for_each(note));
        facts.push(conclude(program, tried, &mut searches, diagnostics));
    }
    bar.finish_and_clear();
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
        (seconds, budget): (f64, f64),
        watch: &dyn Watch,
    ) -> Result<Self, Failure> {
        let operations = solid.graph(ProgramKind::Value).0.len();
        let mut notes = Vec::new();
        let (facts, thin) = match too_long(&solid, operations, budget) {
            Some(why) => {
                notes.push(format!("solid `{}` has {operations} operations: {why}", named.name));
                let bounds = solid.bounds().aabb().map(|bounds| Box3::of(&bounds));
                let empty = *solid.bounds() == Bounds::Empty;
                let no_volume = bounds.as_ref().map(|_| why);
                (Facts { bounds, empty, no_volume, ..Facts::unknown(&solid, file) }, None)
            }
            None => {
                let within = Within(watch, Deadline::after(seconds));
                let (facts, thin) = measure(&solid, file, &within, &mut notes)?;
                (facts, Some(thin))
            }
        };
        Ok(Self { named, solid, facts, thin, notes, seconds })
    }

    fn is_unfinished(&self) -> bool {
        self.thin.is_some() && (!self.facts.unfinished.is_empty() || self.facts.wants_time)
    }

    /// Measures it anew, if there is more time than before.
    fn again(&mut self, file: &str, seconds: f64, watch: &dyn Watch) -> Result<(), Failure> {
        if seconds > self.seconds {
            self.notes.clear();
            let within = Within(watch, Deadline::after(seconds));
            let (facts, thin) = measure(&self.solid, file, &within, &mut self.notes)?;
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
    let Tried { named, solid, facts: mut found, thin, .. } = tried;
    found.tolerance = program.tolerance(&named.name).map(|tolerance| tolerance.value);
    let Some(thin) = thin else { return found };
    let tolerance = program.within_tolerance(&solid);
    if let Some(Ok(chosen)) = &tolerance {
        found.program = Some(chosen.variant().name());
        found.error_bound = Some(chosen.bound());
    }
    diagnostics.list.extend(remarks::overflow(program, named, &solid));
    diagnostics.list.extend(tolerance.and_then(Result::err).map(|refusal| *refusal));
    diagnostics.list.extend(remarks::of_solid(program, named, &solid, (&found, &thin)));
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
    let seconds = each * operations as f64;
    let shown = upwards(seconds);
    let why = || format!("measuring it may take {shown} s; --budget {shown} allows it");
    (seconds > budget).then(why)
}

/// A number of seconds, no smaller than it is: with two digits, and whole from ten on.
fn upwards(seconds: f64) -> f64 {
    // one over the unit of the last digit, which is a power of ten without an error
    let parts = 10f64.powi((1.0 - seconds.log10().floor()).clamp(0.0, 12.0) as i32);
    (seconds * parts).ceil() / parts
}

#[cfg(test)]
mod tests {
    use super::{is_over, upwards};

    #[test]
    fn an_estimate_is_never_shown_below_what_a_budget_must_be() {
        let shown = [0.0041, 0.0124, 0.4, 1.21, 9.99, 12.3, 431.2].map(upwards);
        assert_eq!(shown, [0.0041, 0.013, 0.4, 1.3, 10.0, 13.0, 432.0]);
    }

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
