//! A command for each combination of values: the folder, the index, the order of things.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::super::failure::{complain, note};
use super::super::output::{self, Shown};
use super::super::shared::Shared;
use super::super::{Failure, input, run as runs};
use super::figures::Command;
use super::index::{Axis, INDEX, Index, Row};
use super::plot;
use super::values::{Sweep, folder, grid, is_folder};
use serde_json::Value;

use rfm::Program;
use rfm::diagnostic::nearest;
use rfm::slice;

/// Maximum number of combinations of a sweep. A larger number is a typing error.
const MOST_COMBINATIONS: usize = 10_000;

/// Time between two writes of the index. If the process is killed in between, the work since the last write
/// is done again.
const BETWEEN_WRITES: Duration = Duration::from_secs(1);

/// Files that a sweep writes beside its index.
const FILES: [&str; 3] = ["table.csv", "plot.svg", "plot.png"];

/// A command that is to be swept.
pub(super) struct Task<'a> {
    pub shared: &'a Shared,
    pub command: Command,
    pub file: &'a Path,
    pub sweeps: &'a [Sweep],
    pub folder: PathBuf,
    /// How the folder is given.
    pub folder_flag: &'static str,
    /// All other options, as a text that differs if they do.
    pub options: String,
    pub resume: bool,
    pub force: bool,
}

impl Task<'_> {
    /// Runs the command for each combination. `each` does so in a folder, and prints one document.
    pub fn go(&self, each: impl Fn(&Shared, &Path) -> Result<(), Failure>) -> Result<(), Failure> {
        if self.file == Path::new("-") {
            return Err(Failure::usage("standard input is read once: name a file to sweep"));
        }
        let fingerprint = self.check()?;
        let mut index = self.begin(&fingerprint)?;
        let points = grid(self.sweeps);
        let mut written = Instant::now();
        for (i, point) in points.iter().enumerate() {
            let name = folder(self.sweeps, point);
            if index.rows.iter().any(|row| row.folder == name && row.exit == 0) {
                continue;
            }
            let unchanged = self.check().and_then(|now| match now == fingerprint {
                true => Ok(()),
                false => {
                    Err(Failure::usage("the file has changed: what is in the folder belongs to the old one"))
                }
            });
            let outcome = unchanged.and_then(|()| {
                note(format!("{} of {}: {}", i + 1, points.len(), self.shown(point)));
                self.row(name, point, &each)
            });
            // what was computed before is kept
            let (row, interrupted) = match outcome {
                Ok(outcome) => outcome,
                Err(failure) => {
                    self.conclude(&index)?;
                    return Err(failure);
                }
            };
            index.insert(row);
            if interrupted {
                self.conclude(&index)?;
                note(format!("interrupted; --resume goes on with `{}`", self.folder.shown()));
                return Err(Failure::Interrupted);
            }
            if written.elapsed() > BETWEEN_WRITES {
                index.write(&self.folder)?;
                written = Instant::now();
            }
        }
        self.conclude(&index)?;
        self.tell(&index)
    }

    /// Writes the index, the table, and the plot as SVG and PNG.
    fn conclude(&self, index: &Index) -> Result<(), Failure> {
        index.write(&self.folder)?;
        let table = index.table();
        output::write(&self.folder.join("table.csv"), |out| out.write_all(table.as_bytes()))?;
        let drawing = plot::draw(index);
        output::write(&self.folder.join("plot.svg"), |out| out.write_all(drawing.as_bytes()))?;
        let mut picture = Vec::new();
        slice::rasterise(&drawing, 2.0, &mut picture).map_err(Failure::usage)?;
        output::write(&self.folder.join("plot.png"), |out| out.write_all(&picture))
    }

    /// Prints the table, and says what has failed.
    fn tell(&self, index: &Index) -> Result<(), Failure> {
        if self.shared.json {
            output::json(index)?;
        } else {
            index.print();
            say!(
                "written to {}: a folder for each, {INDEX}, table.csv, plot.svg, plot.png",
                self.folder.shown()
            );
        }
        let failed: Vec<u8> = index.rows.iter().map(|row| row.exit).filter(|code| *code != 0).collect();
        let message = format!("{} of {} combinations failed", failed.len(), index.rows.len());
        match failed.into_iter().max() {
            None => Ok(()),
            Some(3) => Err(Failure::Numerical(message)),
            Some(2) => Err(Failure::Usage(message)),
            Some(_) => {
                complain(&message);
                Err(Failure::Findings)
            }
        }
    }

    fn shown(&self, point: &[f64]) -> String {
        let values = self.sweeps.iter().zip(point);
        values
            .map(|(sweep, value)| format!("{} = {}", sweep.name, sweep.shown(*value)))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// The outcome of a combination, and whether the user stopped it.
    fn row(
        &self,
        name: String,
        point: &[f64],
        each: impl Fn(&Shared, &Path) -> Result<(), Failure>,
    ) -> Result<(Row, bool), Failure> {
        let folder = self.folder.join(&name);
        std::fs::create_dir_all(&folder)
            .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", folder.shown())))?;
        let mut shared = self.shared.clone();
        shared.json = true;
        for (sweep, value) in self.sweeps.iter().zip(point) {
            shared.define.push(sweep.definition(*value).map_err(Failure::Usage)?);
        }
        let (result, documents) = output::captured(|| each(&shared, &folder));
        // of `check` messages are in its document, other commands have shown them
        for message in messages(&documents).filter(|message| message["severity"] == "warning") {
            let help = message["help"].as_str().map_or(String::new(), |help| format!("; {help}"));
            note(format!("{}: {}{help}", text_of(message, "code"), text_of(message, "message")));
        }
        let figures = documents.iter().flat_map(|document| self.command.figures(document, &folder)).collect();
        let (exit, failure) = match &result {
            Ok(()) => (0, None),
            Err(Failure::Findings) => (1, Some(first_error(&documents))),
            Err(Failure::Params) => (2, Some(first_error(&documents))),
            Err(Failure::Usage(message)) => (2, Some(message.clone())),
            Err(Failure::Numerical(message)) => (3, Some(message.clone())),
            Err(Failure::Interrupted | Failure::ClosedPipe) => (130, Some("interrupted".into())),
        };
        if let Some(message) = &failure {
            complain(message);
        }
        let failure = failure.map(|message| message.lines().next().unwrap_or_default().to_string());
        let row = Row { folder: name, values: point.to_vec(), figures, exit, failure };
        Ok((row, exit == 130))
    }

    /// Whether the file has the params, within whose ranges all values lie. Returns a hash of what the
    /// results depend on.
    fn check(&self) -> Result<String, Failure> {
        for (i, sweep) in self.sweeps.iter().enumerate() {
            if self.sweeps[..i].iter().any(|other| other.name == sweep.name) {
                return Err(Failure::usage(format!("--sweep {}: the param is swept twice", sweep.name)));
            }
            if self.shared.define.iter().any(|given| given.name == sweep.name) {
                note(format!(
                    "the value that is given for `{0}` is not used: --sweep {0} goes before it",
                    sweep.name
                ));
            }
        }
        let count =
            self.sweeps.iter().fold(1, |count: usize, sweep| count.saturating_mul(sweep.values.len()));
        if count > MOST_COMBINATIONS {
            return Err(Failure::usage(format!(
                "{count} combinations: at most {MOST_COMBINATIONS} are possible"
            )));
        }
        let source = input::read(self.file)?;
        let files = input::files(self.shared, &source);
        let program = input::check(self.shared, source, files.clone()).map_err(|messages| {
            input::show(&messages);
            input::failure(&messages)
        })?;
        self.sweeps.iter().try_for_each(|sweep| fits(&program, sweep))?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(format!("{}\n{:?}\n", self.options, self.shared.define).as_bytes());
        for source in program.sources().iter() {
            hasher.update(source.text.as_bytes());
        }
        // tables, meshes and maps of heights that it names; one that is gone was an error above
        for path in files.asked() {
            hasher.update(path.as_bytes()).update(&std::fs::read(&path).unwrap_or_default());
        }
        Ok(hasher.finalize().to_hex()[..32].to_string())
    }

    /// The index to begin with: that of the folder if the sweep is resumed.
    fn begin(&self, fingerprint: &str) -> Result<Index, Failure> {
        let known = Index::read(&self.folder);
        let axis = |sweep: &Sweep| Axis {
            name: sweep.name.clone(),
            unit: sweep.unit.clone(),
            values: sweep.values.clone(),
        };
        let new = Index {
            schema: 1,
            command: self.command.name().into(),
            file: self.file.display().to_string(),
            fingerprint: fingerprint.into(),
            sweeps: self.sweeps.iter().map(axis).collect(),
            rows: Vec::new(),
        };
        let shown = self.folder.shown();
        let Some(known) = known else {
            self.refuse_files_of_others()?;
            std::fs::create_dir_all(&self.folder)
                .map_err(|e| Failure::usage(format!("cannot make the folder `{shown}`: {e}")))?;
            return Ok(new);
        };
        let known = known?;
        let flag = self.folder_flag;
        if self.force {
            // if this is cut short, the index still names all folders, and none of them as whole
            let undone = known.rows.iter().map(|row| Row { exit: 130, ..row.clone() }).collect();
            let known = Index { rows: undone, ..known };
            known.write(&self.folder)?;
            self.remove_values_that_are_gone(&known)?;
            new.write(&self.folder)?;
            return Ok(new);
        }
        if !self.resume {
            return Err(Failure::usage(format!(
                "`{shown}` holds a sweep already ({} of `{}`, {} combinations): go on with it by --resume, replace it with \
                 --force, or write elsewhere with {flag}",
                known.command,
                known.file,
                known.rows.len()
            )));
        }
        if known.command != new.command || known.fingerprint != new.fingerprint {
            return Err(Failure::usage(format!(
                "`{shown}` holds a sweep of another file, of an older state of it, or with other options: replace it with \
                 --force, or write elsewhere with {flag}"
            )));
        }
        let params = |index: &Index| -> Vec<String> { index.sweeps.iter().map(Axis::column).collect() };
        if params(&known) != params(&new) {
            return Err(Failure::usage(format!(
                "`{shown}` holds a sweep of {}: sweep the same params with the same units, replace it with --force, or write \
                 elsewhere with {flag}",
                params(&known).join(", ")
            )));
        }
        // rows of other values stay in the table
        Ok(Index { rows: known.rows, ..new })
    }

    /// Removes the folders of a sweep that is replaced, but for those that are written again. Others stay.
    fn remove_values_that_are_gone(&self, known: &Index) -> Result<(), Failure> {
        let again: Vec<String> = grid(self.sweeps).iter().map(|point| folder(self.sweeps, point)).collect();
        let gone = known.rows.iter().map(|row| &row.folder).filter(|name| !again.contains(name));
        for name in gone.filter(|name| is_folder(name)) {
            let path = self.folder.join(name);
            // a link is not ours
            if std::fs::symlink_metadata(&path).is_ok_and(|found| found.is_dir()) {
                std::fs::remove_dir_all(&path)
                    .map_err(|e| Failure::usage(format!("cannot remove `{}`: {e}", path.shown())))?;
            }
        }
        Ok(())
    }

    /// Refuses a folder without the index of a sweep that holds a run, or a file with a name that a sweep writes.
    fn refuse_files_of_others(&self) -> Result<(), Failure> {
        let (shown, flag) = (self.folder.shown(), self.folder_flag);
        if let Some(content) = runs::run_in(&self.folder) {
            return Err(Failure::usage(format!(
                "`{shown}` holds a run ({content}): write the sweep elsewhere with {flag}"
            )));
        }
        match FILES.into_iter().find(|name| self.folder.join(name).exists()) {
            Some(name) => Err(Failure::usage(format!(
                "`{shown}` holds a file `{name}` that is not of a sweep: write elsewhere with {flag}"
            ))),
            None => Ok(()),
        }
    }
}

/// Whether a file has a param, and its range all values.
fn fits(program: &Program, sweep: &Sweep) -> Result<(), Failure> {
    let params = &program.module().params;
    let Some(param) = params.iter().find(|param| param.name == sweep.name) else {
        let known = params.iter().map(|param| param.name.as_str());
        let hint = match nearest(&sweep.name, known.clone()) {
            Some(near) => format!("; did you mean `{near}`?"),
            None if params.is_empty() => "; it declares none: write `param NAME = VALUE`".into(),
            None => format!("; it has {}", known.collect::<Vec<_>>().join(", ")),
        };
        return Err(Failure::usage(format!("--sweep {}: the file has no such param{hint}", sweep.name)));
    };
    for value in &sweep.values {
        let given = sweep.definition(*value).map_err(Failure::Usage)?;
        if let Some((low, high)) = param.range.filter(|(low, high)| !(*low..=*high).contains(&given.value)) {
            let in_unit = param.unit.as_ref().filter(|(unit, _)| sweep.unit.is_empty() && unit.factor != 1.0);
            let hint = in_unit.map_or(String::new(), |(_, unit)| {
                format!("; numbers without a unit are in SI units: write --sweep {}", sweep.written_in(unit))
            });
            return Err(Failure::usage(format!(
                "--sweep {}: {} lies outside {} .. {}, which the file allows{hint}",
                sweep.name,
                sweep.shown(*value),
                param.shown(low),
                param.shown(high)
            )));
        }
    }
    Ok(())
}

/// The messages in documents.
fn messages(documents: &[Value]) -> impl Iterator<Item = &Value> {
    documents.iter().filter_map(|document| document["diagnostics"].as_array()).flatten()
}

fn text_of<'a>(message: &'a Value, key: &str) -> &'a str {
    message[key].as_str().unwrap_or_default()
}

/// The first error among the messages of a document, or the first warning where these are denied.
fn first_error(documents: &[Value]) -> String {
    let error = messages(documents).find(|message| message["severity"] == "error");
    let first = error.or_else(|| messages(documents).next()).map(|message| text_of(message, "message"));
    first.unwrap_or("the file has findings").to_string()
}
