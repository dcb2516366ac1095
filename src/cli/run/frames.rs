//! The files of a run: ParaView frames with their collection, pictures, and the obstacles' mesh. If an
//! obstacle moves, there is also a frame of the obstacles for each of the fluid.
//!
//! Invariant: after every frame the collections list exactly the frames that are complete.

use std::path::{Path, PathBuf};

use super::super::args::Run;
use super::super::failure::{note, warn};
use super::super::stopwatch::Stopwatch;
use super::super::{Failure, output};
use super::bodies::Bodies;
use super::pictures::{Look, Pictures, Seen, end_of_colours};
use super::{checkpoints, folder, paraview, probes};
use crate::cli::output::{Shown, counted};
use crate::cli::{saved, surfaces};
use rfm::Experiment;
use rfm::diagnostic::Code;
use rfm::mesh::{self, Mesh};
use rfm::sph::{self, Checkpoint, Simulation, short_time};
use rfm::view::Levels;

/// Meshes of a run are in the unit of its frames.
const METRE: mesh::LengthUnit = mesh::LengthUnit::METRE;

/// Names of the frames' times, steps and greatest speeds in a checkpoint.
const TIMES: &str = "frames";
const STEPS: &str = "steps of frames";
const SPEEDS: &str = "speeds of frames";

/// The part of a frame's particles that may be faster than the speed at the end of the colours: a few fast ones near a
/// blade or in a jet would leave the others without a colour.
const STRAY: f64 = 0.02;

/// The frames and pictures of a run.
pub(super) struct Frames {
    folder: PathBuf,
    saved: Vec<Saved>,
    write_frames: bool,
    bodies: Bodies,
    pictures: Option<Pictures>,
    count: usize,
    last_time: f64,
    /// Time of the last frame that the collections list, s: a frame may fail, or the collections after it.
    listed_until: Option<f64>,
}

/// A frame that was saved.
struct Saved {
    /// Its time, s.
    time: f64,
    /// The number of steps until then, and the greatest speed of most particles, m/s; `None` if an earlier version
    /// saved it.
    step: Option<u64>,
    fastest: Option<f64>,
    /// Its file, relative to the folder of the run.
    file: String,
    /// Whether the file is missing, although the run saved it before it was resumed.
    is_lost: bool,
}

/// Says that flags for pictures change nothing where there are none.
fn tell_of_idle_flags(options: &Run) {
    let flags = [
        ("--camera", options.camera.is_some()),
        ("--cut", options.cut.is_some()),
        ("--hide", !options.hide.is_empty()),
        ("--glass", !options.glass.is_empty()),
        ("--surface", options.surface.is_some()),
    ];
    let given: Vec<&str> =
        flags.into_iter().filter_map(|(flag, is_given)| is_given.then_some(flag)).collect();
    if !given.is_empty() {
        let why = if options.no_pictures { "--no-pictures" } else { "--no-frames" };
        note(format!("{} of no effect: with {why} there are no pictures", of_flags(&given)));
    }
}

/// Flags as the subject of a sentence.
fn of_flags(flags: &[&str]) -> String {
    match flags {
        [one] => format!("{one} is"),
        several => format!("{} are", several.join(", ")),
    }
}

impl Frames {
    /// Prepares the folder of a run that begins, or that goes on from a checkpoint.
    pub fn new(
        options: &Run,
        experiment: &Experiment,
        resumed: Option<&Checkpoint>,
    ) -> Result<Self, Failure> {
        let folder = folder::of(options);
        let write_frames = !options.no_frames;
        // all that can fail comes before the first change to the folder
        let bodies = Bodies::new(options, experiment);
        let meshes = if write_frames { bodies.meshes_at_start()? } else { Vec::new() };
        let pictures = if write_frames && !options.no_pictures {
            Some(Pictures::new(Look::of(options), experiment, &meshes)?)
        } else {
            tell_of_idle_flags(options);
            None
        };
        create(&folder)?;
        if resumed.is_none() {
            remove_old(&folder)?;
        }
        if write_frames {
            create(&folder.join("frames"))?;
            paraview::write(&folder, experiment, end_of_colours(experiment))?;
        }
        if pictures.is_some() {
            create(&folder.join("pictures"))?;
        }
        if write_frames && !bodies.is_empty() {
            let obstacle = Mesh::joined(&meshes);
            output::write(&folder.join("obstacle.stl"), |mut out| {
                mesh::stl::write(&obstacle, METRE, &mut out)
            })?;
            output::write(&folder.join("obstacle.vtp"), |mut out| {
                mesh::vtp::write_bodies(&meshes, METRE, &mut out)
            })?;
        }
        let (count, last_time) = (0, 0.0);
        let mut frames = Self {
            folder,
            saved: Vec::new(),
            write_frames,
            bodies,
            pictures,
            count,
            last_time,
            listed_until: None,
        };
        if let Some(checkpoint) = resumed {
            frames.take_up(checkpoint)?;
        }
        Ok(frames)
    }

    /// Takes over the frames up to a checkpoint, and removes those after it.
    fn take_up(&mut self, checkpoint: &Checkpoint) -> Result<(), Failure> {
        let times = checkpoint.get(TIMES).unwrap_or_default();
        self.last_time = times.last().copied().unwrap_or_default();
        if !self.write_frames {
            return Ok(());
        }
        self.count = times.len();
        let [steps, speeds] = [STEPS, SPEEDS].map(|name| checkpoint.get(name).unwrap_or_default());
        let saved = times.iter().enumerate().map(|(number, &time)| {
            let file = frame_name(number);
            let (step, fastest) = (steps.get(number).map(|step| *step as u64), speeds.get(number).copied());
            Saved { time, step, fastest, is_lost: !self.folder.join(&file).is_file(), file }
        });
        self.saved = saved.collect();
        self.tell_of_lost();
        if let Some(pictures) = &mut self.pictures {
            pictures.count = self.count;
        }
        self.write_collections()?;
        remove_numbered(&self.folder.join("frames"), PARTICLES, ".vtp", self.count)?;
        remove_numbered(&self.folder.join("frames"), OBSTACLE, ".vtp", self.count)?;
        remove_numbered(&self.folder.join("pictures"), "frame_", ".png", self.count)
    }

    /// Warns of frames that the run had saved and that are missing now.
    fn tell_of_lost(&self) {
        let mut lost = self.saved.iter().filter(|saved| saved.is_lost);
        let Some(first) = lost.next() else { return };
        let (count, all) = (1 + lost.count(), self.saved.len());
        let are = if count == 1 { "is" } else { "are" };
        warn(
            Code::RUN_HAS_HOLES,
            format!(
                "{count} of {all} frames {are} missing, the first at {} s (`{}`): particles.pvd goes without",
                short_time(first.time),
                self.folder.join(&first.file).shown()
            ),
        );
    }

    /// The time and the file of each frame that is there.
    fn listed(&self) -> impl Iterator<Item = (f64, &str)> {
        self.saved.iter().filter(|saved| !saved.is_lost).map(|saved| (saved.time, saved.file.as_str()))
    }

    /// Puts into a checkpoint which frames there are. A frame that was saved out of turn, because the run
    /// ended, is left out: a resumed run has the frames of one that never stopped.
    pub fn remember(&self, checkpoint: &mut Checkpoint, in_turn: bool) {
        let out_of_turn = usize::from(!in_turn && self.last_time == checkpoint.time);
        let kept = &self.saved[..self.saved.len().saturating_sub(out_of_turn)];
        checkpoint.set(TIMES, kept.iter().map(|saved| saved.time).collect());
        let steps: Option<Vec<f64>> = kept.iter().map(|saved| saved.step.map(|step| step as f64)).collect();
        let speeds: Option<Vec<f64>> = kept.iter().map(|saved| saved.fastest).collect();
        for (name, values) in [(STEPS, steps), (SPEEDS, speeds)] {
            checkpoint.set(name, values.unwrap_or_default());
        }
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Time of the last frame, s.
    pub fn last_time(&self) -> f64 {
        self.last_time
    }

    /// Time of the last frame that can be found, s; `None` if there is none.
    pub fn listed_until(&self) -> Option<f64> {
        self.listed_until
    }

    /// The files that were written, as text.
    pub fn describe(&self) -> String {
        let mut parts = vec!["summary.json".to_string()];
        if self.write_frames {
            let frames = counted(self.listed().count(), "frame");
            parts.push(format!("particles.pvd, open_in_paraview.py and {frames} for ParaView"));
        }
        if self.write_frames && !self.bodies.is_empty() {
            let moving = if self.bodies.move_about() { "obstacle.pvd, " } else { "" };
            parts.push(format!("{moving}obstacle.stl, obstacle.vtp"));
        }
        if let Some(pictures) = &self.pictures {
            parts.push(counted(pictures.count, "picture"));
        }
        parts.join(", ")
    }

    /// Draws all pictures again if their colours do not fit the speeds of all frames together, so that one scale
    /// holds for all of them. Returns the new end of the colours, m/s.
    pub fn fit_colours(&mut self, options: &Run, experiment: &Experiment) -> Result<Option<f64>, Failure> {
        let Some(pictures) = &self.pictures else { return Ok(None) };
        let fastest = self
            .saved
            .iter()
            .map(|saved| saved.fastest)
            .try_fold(0.0, |most: f64, one| one.map(|one| most.max(one)));
        let better = fastest.and_then(|fastest| pictures.better_end(fastest));
        let Some(end) = better else { return Ok(None) };
        let meshes = self.bodies.meshes_at_start()?;
        let look = Look { fastest: Some(end), ..Look::of(options) };
        paraview::write(&self.folder, experiment, end)?;
        let mut pictures = Pictures::new(look, experiment, &meshes)?;
        let has_steps = self.saved.iter().all(|saved| saved.step.is_some());
        for (number, saved) in self.saved.iter().enumerate().filter(|(_, saved)| !saved.is_lost) {
            let (places, arrays) = saved::arrays(&self.folder.join(&saved.file))?;
            let speeds = arrays.into_iter().find(|array| array.name == "speed");
            let speeds = speeds.map_or_else(Vec::new, |array| array.values);
            if self.bodies.move_about() {
                pictures.show(&self.bodies.meshes_at(saved.time)?);
            }
            let seen = Seen { places, speeds, time: saved.time, step: saved.step.filter(|_| has_steps) };
            pictures.save(&self.folder.join(picture_name(number)), seen)?;
        }
        pictures.count = self.count;
        self.pictures = Some(pictures);
        Ok(better)
    }

    /// Saves the present state as a frame and a picture.
    pub fn save(&mut self, simulation: &Simulation) -> Result<(), Failure> {
        self.last_time = simulation.time();
        if !self.write_frames {
            return Ok(());
        }
        let name = frame_name(self.count);
        output::write(&self.folder.join(&name), |mut out| sph::write_vtp(&mut out, simulation.particles()))?;
        let moved =
            if self.bodies.move_about() { Some(self.bodies.meshes_at(simulation.time())?) } else { None };
        if let Some(meshes) = &moved {
            let path = self.folder.join(obstacle_name(self.count));
            output::write(&path, |mut out| mesh::vtp::write_bodies(meshes, METRE, &mut out))?;
        }
        let seen = Seen::of(simulation);
        let fastest = Levels::of_most(seen.speeds.iter().copied(), STRAY).map(|range| range.high);
        self.saved.push(Saved { time: seen.time, step: seen.step, fastest, file: name, is_lost: false });
        self.write_collections()?;
        if let Some(pictures) = &mut self.pictures {
            if let Some(meshes) = &moved {
                pictures.show(meshes);
            }
            pictures.save(&self.folder.join(picture_name(self.count)), seen)?;
        }
        self.count += 1;
        Ok(())
    }

    fn write_collections(&mut self) -> Result<(), Failure> {
        output::write(&self.folder.join("particles.pvd"), |mut out| sph::write_pvd(&mut out, self.listed()))?;
        self.listed_until = self.listed().last().map(|(time, _)| time);
        if !self.bodies.move_about() {
            return Ok(());
        }
        let obstacle = |file: &str| file.replace(PARTICLES, OBSTACLE);
        let saved: Vec<_> = self.saved.iter().map(|saved| (saved.time, obstacle(&saved.file))).collect();
        let is_there = |file: &str| self.folder.join(file).is_file();
        output::write(&self.folder.join("obstacle.pvd"), |mut out| {
            let frames = saved.iter().filter(|(_, file)| is_there(file));
            sph::write_pvd(&mut out, frames.map(|(time, file)| (*time, file.as_str())))
        })
    }
}

/// What one frame costs.
pub(super) struct FrameCost {
    pub seconds: f64,
    pub bytes: f64,
    /// What the first frame takes longer than others, s: what rests is drawn once.
    pub first: f64,
    /// The parts of both that grow with the number of particles.
    per_particle: (f64, f64),
}

impl FrameCost {
    /// Cells of the meshes that are measured. The work of a mesh grows with the square of their number.
    const CELLS: usize = 24;

    /// Measures a frame without writing it.
    pub fn measured(
        options: &Run,
        experiment: &Experiment,
        simulation: &Simulation,
    ) -> Result<Self, Failure> {
        if options.no_frames {
            return Ok(Self { seconds: 0.0, bytes: 0.0, first: 0.0, per_particle: (0.0, 0.0) });
        }
        let mut out = Vec::new();
        let started = Stopwatch::start();
        sph::write_vtp(&mut out, simulation.particles())?;
        let per_particle = (started.seconds(), out.len() as f64);
        out.clear();
        let bodies = Bodies::new(options, experiment).coarsened(Self::CELLS);
        let started = Stopwatch::start();
        let meshes = bodies.meshes_at(0.0)?;
        let meshing = started.seconds();
        let finer = (options.mesh_cells as f64 / Self::CELLS.min(options.mesh_cells) as f64).powi(2);
        let (mut seconds, mut bytes, mut first) = (0.0, 0.0, finer * meshing);
        if bodies.move_about() {
            let started = Stopwatch::start();
            // bodies that are not deformed have a mesh already
            let moved = bodies.meshes_at(0.37 * experiment.scene().run.until).ok();
            mesh::vtp::write_bodies(moved.as_ref().unwrap_or(&meshes), METRE, &mut out)?;
            seconds += finer * started.seconds();
            bytes += finer * out.len() as f64;
            out.clear();
        }
        if !options.no_pictures {
            let mut pictures = Pictures::new(Look::of(options), experiment, &meshes)?;
            let mut drawn = || -> Result<(f64, f64), Failure> {
                let started = Stopwatch::start();
                if bodies.move_about() {
                    pictures.show(&meshes);
                }
                out.clear();
                pictures.image(Seen::of(simulation))?.write_png(&mut out)?;
                Ok((started.seconds(), out.len() as f64))
            };
            let (once, _) = drawn()?;
            let (later, size) = drawn()?;
            first += (once - later).max(0.0);
            seconds += later;
            bytes += size;
        }
        Ok(Self { seconds, bytes, first, per_particle })
    }

    /// The cost of a frame with the given multiple of particles.
    pub fn scaled(self, scale: f64) -> Self {
        let (seconds, bytes) = self.per_particle;
        Self { seconds: self.seconds + scale * seconds, bytes: self.bytes + scale * bytes, ..self }
    }
}

/// Size of a checkpoint.
pub(super) fn checkpoint_bytes(simulation: &Simulation) -> f64 {
    let mut out = Vec::new();
    // writing to memory cannot fail
    let _ = simulation.checkpoint().write(&mut out);
    out.len() as f64
}

/// Beginnings of the names of frames.
const PARTICLES: &str = "particles_";
const OBSTACLE: &str = "obstacle_";

fn frame_name(number: usize) -> String {
    format!("frames/{PARTICLES}{number:06}.vtp")
}

fn picture_name(number: usize) -> String {
    format!("pictures/frame_{number:06}.png")
}

fn obstacle_name(number: usize) -> String {
    format!("frames/{OBSTACLE}{number:06}.vtp")
}

fn create(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", folder.shown())))
}

/// Removes the files of an earlier run, which would mix with those of this one, and no other files.
fn remove_old(folder: &Path) -> Result<(), Failure> {
    for name in folder::RESULTS {
        let path = folder.join(name);
        if path.is_file() {
            std::fs::remove_file(&path).map_err(|e| not_cleared(folder, &e))?;
        }
    }
    checkpoints::remove_all(folder).map_err(|e| not_cleared(folder, &e))?;
    probes::remove_old(folder).map_err(|e| not_cleared(folder, &e))?;
    surfaces::remove_old(folder).map_err(|e| not_cleared(folder, &e))?;
    remove_numbered(&folder.join("frames"), PARTICLES, ".vtp", 0)?;
    remove_numbered(&folder.join("frames"), OBSTACLE, ".vtp", 0)?;
    remove_numbered(&folder.join("pictures"), "frame_", ".png", 0)
}

/// Removes the numbered files whose number is at least `first`.
fn remove_numbered(folder: &Path, prefix: &str, suffix: &str, first: usize) -> Result<(), Failure> {
    if !folder.is_dir() {
        return Ok(());
    }
    let failed = |e| not_cleared(folder, &e);
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let number = folder::number_in(&entry.file_name().to_string_lossy(), prefix, suffix);
        if number.is_some_and(|number| number >= first) {
            std::fs::remove_file(entry.path()).map_err(failed)?;
        }
    }
    Ok(())
}

fn not_cleared(folder: &Path, error: &std::io::Error) -> Failure {
    Failure::usage(format!("cannot clear `{}`: {error}", folder.shown()))
}
