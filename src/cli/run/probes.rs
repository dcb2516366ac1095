//! The samples of probes, as CSV that grows by one line at a time, and as a plot at the end. Every run also
//! has tables of its energy and its audit.
//!
//! Invariant: however a run ends, a file holds its header and the lines of all samples before that. At most
//! one line is cut off, which `--resume` removes.

use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::super::failure::warn;
use super::super::plot;
use super::super::{Failure, note, output};
use super::folder::{PROBES, TIME, is_table};
use super::means::Means;
use super::probe_plot::{drawn, rows};
use crate::cli::output::Shown;
use crate::cli::saved::{HISTORY, OWN_TABLES};
use rfm::diagnostic::Code;
use rfm::experiment::{Every, probe_column};
use rfm::lower::{AskedMean, Gravity, Scene};
use rfm::sph::{Checkpoint, Gauge, Probe, Simulation, short_time};

/// A resumed run takes over samples up to this relative tolerance after the checkpoint's time. Times are
/// written with twelve digits, so these are the samples before the checkpoint.
const ROUNDING: f64 = 1e-10;

/// Samples of a run's own tables from one frame to the next.
const SAMPLES_PER_FRAME: f64 = 10.0;

/// Says of the probes of energy what they leave out.
pub(super) fn tell_of_potentials(scene: &Scene) {
    let mut energies = scene.probes.iter().filter(|probe| probe.measured == Probe::Energy);
    if let (Gravity::Field(_), Some(probe)) = (scene.gravity, energies.next()) {
        note(format!(
            "gravity depends on the place, and the potential energy of such a force is not known: in the probe `{}` it is 0, and not part of `total`",
            probe.name
        ));
    }
}

/// The probes of a run.
pub(super) struct Probes {
    /// Those that the scene states.
    stated: Vec<Recorder>,
    /// Those of the energy and the audit.
    own: Vec<Recorder>,
}

/// One probe with its file.
struct Recorder {
    name: String,
    gauge: Gauge,
    /// The mean that the scene asks for.
    mean: Option<AskedMean>,
    clock: Every,
    path: PathBuf,
    /// Samples in the file, and samples that the run took before it was resumed and that the file lacks.
    samples: usize,
    lost: usize,
    file: File,
}

impl Probes {
    /// Begins the files of the probes, or continues those of a resumed run.
    pub fn start(
        run_folder: &Path,
        scene: &Scene,
        simulation: &mut Simulation,
        resumed: Option<&Checkpoint>,
    ) -> Result<Self, Failure> {
        let folder = run_folder.join(PROBES);
        if !scene.probes.is_empty() {
            create(&folder)?;
        }
        let mut stated = Vec::new();
        for probe in &scene.probes {
            let measured = probe.measured;
            let memory = resumed.and_then(|checkpoint| checkpoint.get(&probe_column(&probe.name)).ok());
            let gauge = match resumed {
                Some(checkpoint) => simulation.gauge_at(measured, checkpoint, memory.unwrap_or_default()),
                None => simulation.gauge(measured),
            };
            let gauge = gauge.map_err(|e| Failure::usage(format!("probe `{}`: {e}", probe.name)))?;
            let every = probe.every.unwrap_or(scene.run.save_every);
            let recorder = Recorder::start(&folder, &probe.name, gauge, every, simulation, resumed)?;
            stated.push(Recorder { mean: probe.mean.clone(), ..recorder });
        }
        let every = scene.run.save_every / SAMPLES_PER_FRAME;
        let folder = run_folder.join(HISTORY);
        create(&folder)?;
        let own = OWN_TABLES.into_iter().map(|(name, probe)| {
            Recorder::start(&folder, name, Gauge::new(probe), every, simulation, resumed)
        });
        let own = own.collect::<Result<_, _>>()?;
        Ok(Self { stated, own })
    }

    /// Samples the probes that are due.
    pub fn sample(&mut self, simulation: &Simulation) -> Result<(), Failure> {
        for recorder in self.stated.iter_mut().chain(&mut self.own) {
            if !recorder.clock.is_due(simulation.time()) {
                continue;
            }
            let mut line = short_time(simulation.time()).to_string();
            for value in simulation.sample(&mut recorder.gauge) {
                // writing to a String cannot fail
                let _ = if value.is_nan() { write!(line, ",nan") } else { write!(line, ",{value}") };
            }
            line.push('\n');
            // the line is written in one piece and not buffered
            recorder.file.write_all(line.as_bytes()).map_err(|e| not_written(&recorder.path, &e))?;
            recorder.samples += 1;
        }
        Ok(())
    }

    /// Puts into a checkpoint what a probe needs to go on.
    pub fn save(&self, checkpoint: &mut Checkpoint) {
        for recorder in &self.stated {
            checkpoint.set(&probe_column(&recorder.name), recorder.gauge.memory().to_vec());
        }
        for recorder in self.stated.iter().chain(&self.own) {
            checkpoint.set(&samples_column(&recorder.path), vec![(recorder.samples + recorder.lost) as f64]);
        }
    }

    /// Draws the samples as SVG and PNG beside each file.
    pub fn plot(&self) -> Result<(), Failure> {
        for recorder in &self.stated {
            let text = recorder.text()?;
            let means = recorder.means(&text);
            for ending in ["svg", "png"] {
                let path = recorder.path.with_extension(ending);
                let picture =
                    plot::end(drawn(&recorder.name, &recorder.gauge.probe, &text, means.as_ref()), &path)?;
                output::write(&path, |out| out.write_all(&picture))?;
            }
        }
        Ok(())
    }

    /// The means that the scene asks for, over the samples so far.
    pub fn means(&self) -> Result<Vec<Means>, Failure> {
        let mut means = Vec::new();
        for recorder in &self.stated {
            if recorder.mean.is_some() {
                means.extend(recorder.means(&recorder.text()?));
            }
        }
        Ok(means)
    }

    pub fn count(&self) -> usize {
        self.stated.len()
    }
}

impl Recorder {
    /// Begins the file of a probe in a folder, or continues that of a resumed run.
    fn start(
        folder: &Path,
        name: &str,
        gauge: Gauge,
        every: f64,
        simulation: &Simulation,
        resumed: Option<&Checkpoint>,
    ) -> Result<Self, Failure> {
        let path = folder.join(format!("{name}.csv"));
        let header = header(&gauge.probe);
        let past = resumed.map(|checkpoint| Past::of(&path, &header, checkpoint)).unwrap_or_default();
        output::write(&path, |out| write!(out, "{header}\n{}", past.kept))?;
        let file = OpenOptions::new().append(true).open(&path).map_err(|e| not_written(&path, &e))?;
        // a new probe begins with the present instant
        let clock = Every::after(every, if past.is_new() { -every } else { simulation.time() });
        let (samples, lost) = (past.kept.lines().count(), past.lost);
        Ok(Self { name: name.to_string(), gauge, mean: None, clock, path, samples, lost, file })
    }

    /// The means that the scene asks for, of the rows of a table.
    fn means(&self, table: &str) -> Option<Means> {
        let means = Means::of(&self.name, &self.gauge.probe, self.mean.as_ref()?, &rows(table));
        Some(means.lacking(self.lost))
    }

    /// The table so far.
    fn text(&self) -> Result<String, Failure> {
        std::fs::read_to_string(&self.path)
            .map_err(|e| Failure::usage(format!("cannot read `{}`: {e}", self.path.shown())))
    }
}

/// What a resumed run has of the table of a probe.
#[derive(Default)]
struct Past {
    /// The lines up to the checkpoint.
    kept: String,
    /// Samples before the checkpoint that the table lacks.
    lost: usize,
}

impl Past {
    /// Reads a table as far as a checkpoint. Says what it lacks, and where a table begins that is not as old
    /// as the run.
    fn of(path: &Path, header: &str, checkpoint: &Checkpoint) -> Self {
        let kept = lines_until(path, header, checkpoint.time * (1.0 + ROUNDING));
        let taken = checkpoint.get(&samples_column(path)).ok().and_then(|numbers| numbers.first().copied());
        let (table, time) = (path.shown(), short_time(checkpoint.time));
        let Some(taken) = taken.map(|taken| taken as usize) else {
            if kept.is_empty() && checkpoint.steps > 0 {
                note(format!("`{table}` has no samples of the time before {time} s: it begins there"));
            }
            return Self { kept, lost: 0 };
        };
        if measures_something_else(path, header) {
            note(format!("`{table}` measures something else than before: it begins anew at {time} s"));
            return Self::default();
        }
        let lost = taken.saturating_sub(kept.lines().count());
        if lost > 0 {
            let message = format!("`{table}` lacks {lost} of the {taken} samples up to {time} s");
            warn(Code::RUN_HAS_HOLES, format!("{message}: means over them would be wrong"));
        }
        Self { kept, lost }
    }

    fn is_new(&self) -> bool {
        self.kept.is_empty() && self.lost == 0
    }
}

/// The name under which a checkpoint keeps the number of samples of a table.
fn samples_column(table: &Path) -> String {
    let part = |path: Option<&std::ffi::OsStr>| path.unwrap_or_default().to_string_lossy().into_owned();
    format!("samples {}/{}", part(table.parent().and_then(Path::file_name)), part(table.file_stem()))
}

/// Whether a table has other columns than these.
fn measures_something_else(path: &Path, header: &str) -> bool {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    text.lines().next().is_some_and(|first| first.starts_with(TIME) && first.trim_end() != header)
}

/// Removes the tables and plots that an earlier run has left, and nothing else.
pub(super) fn remove_old(run_folder: &Path) -> std::io::Result<()> {
    let remove = |path: &Path| if path.is_file() { std::fs::remove_file(path) } else { Ok(()) };
    // tables of their own names, without drawings
    for (name, _) in OWN_TABLES {
        let path = run_folder.join(HISTORY).join(format!("{name}.csv"));
        if is_table(&path) {
            remove(&path)?;
        }
    }
    let probes = run_folder.join(PROBES);
    if !probes.is_dir() {
        return Ok(());
    }
    for entry in std::fs::read_dir(&probes)? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "csv") && is_table(&path) {
            ["svg", "png", "csv"].into_iter().try_for_each(|ending| remove(&path.with_extension(ending)))?;
        }
    }
    Ok(())
}

fn header(probe: &Probe) -> String {
    let columns = probe.columns().iter().map(|(name, unit)| format!(",{name} [{unit}]"));
    std::iter::once(TIME.to_string()).chain(columns).collect()
}

/// The complete lines of a table with times up to `end`; empty if the table has other columns.
fn lines_until(path: &Path, header: &str, end: f64) -> String {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut lines = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
    if lines.next().is_none_or(|first| first.trim_end() != header) {
        return String::new();
    }
    let before =
        |line: &&str| line.split(',').next().and_then(|t| t.parse().ok()).is_some_and(|t: f64| t <= end);
    lines.take_while(before).collect()
}

fn create(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", folder.shown())))
}

fn not_written(path: &Path, error: &std::io::Error) -> Failure {
    Failure::usage(format!("cannot write `{}`: {error}", path.shown()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_cut_at_a_time_and_where_it_was_torn() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let header = header(&Probe::Height { x: 0.0, y: 0.0 });
        assert_eq!(header, "time [s],height [m]");
        let check = |text: &str, expected: &str| {
            std::fs::write(&path, text).unwrap();
            assert_eq!(lines_until(&path, &header, 0.05 * (1.0 + ROUNDING)), expected);
        };
        check("time [s],height [m]\n0,1\n0.05,2\n0.1,3\n", "0,1\n0.05,2\n");
        check("time [s],height [m]\n0,1\n0.05,", "0,1\n");
        check("time [s],pressure [Pa]\n0,1\n", "");
        check("", "");
        check("time [s],height [m]\n0,nan\nx,2\n0.05,1\n", "0,nan\n");
        assert_eq!(lines_until(&folder.path().join("none"), &header, 1.0), "");
    }
}
