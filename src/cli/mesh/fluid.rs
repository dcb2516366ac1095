//! `rfm mesh DIR --fluid`: surfaces of the fluid from the frames that `rfm run` wrote, one file for
//! each frame.
//!
//! The list of frames is read and checked before the first file is written. Each file is whole or not there.

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use serde::Serialize;

use super::super::args::Mesh as Options;
use super::super::failure::{Failure, complain, note};
use super::super::saved::{self, RunFigures};
use super::super::shared::Shared;
use super::super::surfaces::{self, Origins};
use super::super::{output, progress};
use super::format;
use crate::cli::output::{Shown, counted};
use rfm::fluid_surface::{FrameEntry, Reconstruction, read_points};
use rfm::mesh::{Format, LengthUnit, WriteMesh, is_closed_manifold, shells, vtp};

/// The JSON document. Lengths are in metres, volumes in cubic metres.
#[derive(Debug, Serialize)]
struct FluidSummary {
    schema: u32,
    /// The number of frames that were meshed.
    frames: usize,
    triangles: usize,
    milliseconds: f64,
    particle_radius: f64,
    support_radius: f64,
    cell: f64,
    format: &'static str,
    surfaces: Vec<FrameSurface>,
}

/// One frame.
#[derive(Debug, Serialize)]
struct FrameSurface {
    frame: usize,
    time: f64,
    file: String,
    particles: usize,
    /// The number of particles that were left out because their position is not a number.
    left_out: usize,
    vertices: usize,
    triangles: usize,
    closed: bool,
    components: usize,
    volume: f64,
    /// The number of particles times mass over rest density.
    particle_volume: f64,
    /// `volume` over `particle_volume`, null without particles. It shows the error of the surface together
    /// with the fluid's own compression.
    volume_ratio: Option<f64>,
    milliseconds: f64,
}

/// How large the particles are.
struct ParticleScale {
    surface: Reconstruction,
    /// The mass of a particle over the rest density, in m³.
    particle_volume: f64,
}

pub(super) fn run(shared: &Shared, options: &Options) -> Result<(), Failure> {
    let named =
        options.output.as_deref().filter(|path| !path.is_dir()).and_then(|path| format::of_path(path).ok());
    let format = options.format.or(named).unwrap_or(vtp::FORMAT);
    let unit = format::unit_fits(format, options.unit)?;
    let write = format::writer(format, options.ascii)?;
    let folder = options.file.as_path();
    let entries = saved::chosen(collection(folder)?, options.frames)?;
    let scale = ParticleScale::new(folder, options)?;
    saved::check_frames(folder, &entries)?;
    let target = target(folder, options, named, &entries)?;
    let job = Job { folder, target, ending: format.ending, write, unit, scale };
    let started = Instant::now();
    let surfaces = job.surfaces(&entries)?;
    let left_out: usize = surfaces.iter().map(|surface| surface.left_out).sum();
    if left_out > 0 {
        note(format!("{left_out} positions are not numbers and were left out"));
    }
    let summary = FluidSummary {
        schema: 1,
        frames: surfaces.len(),
        triangles: surfaces.iter().map(|surface| surface.triangles).sum(),
        milliseconds: started.elapsed().as_secs_f64() * 1e3,
        particle_radius: job.scale.surface.particle_radius,
        support_radius: job.scale.surface.support_radius,
        cell: job.scale.surface.cell,
        format: job.ending,
        surfaces,
    };
    let particles: usize = summary.surfaces.iter().map(|surface| surface.particles).sum();
    let found = if summary.triangles == 0 && particles > 0 {
        complain("no frame has a surface: --radius or --cell is larger than the fluid");
        Err(Failure::Findings)
    } else {
        Ok(())
    };
    if shared.json {
        return output::json(&summary).and(found);
    }
    print(&summary);
    say!("written to {}", job.target.path().shown());
    found
}

/// Where surfaces go.
enum Target {
    /// A file for each frame.
    Folder(PathBuf),
    /// The surface of the only frame.
    File(PathBuf),
}

impl Target {
    fn path(&self) -> &Path {
        match self {
            Self::Folder(path) | Self::File(path) => path,
        }
    }
}

/// Where the surfaces of these frames go. An ending of the format `named` is that of a file, which holds one frame.
fn target(
    folder: &Path,
    options: &Options,
    named: Option<Format>,
    entries: &[(usize, FrameEntry)],
) -> Result<Target, Failure> {
    if let Some(page) = options.output.as_deref().filter(|path| format::is_page(path)) {
        let (page, run) = (page.shown(), folder.shown());
        return Err(Failure::usage(format!(
            "-o {page}: `rfm view {run} --save {page}` makes a page of a run"
        )));
    }
    let (Some(path), Some(named)) = (&options.output, named) else {
        return Ok(Target::Folder(options.output.clone().unwrap_or_else(|| folder.join(surfaces::FOLDER))));
    };
    let (shown, ending) = (path.shown(), named.ending);
    if let Some(other) = options.format.filter(|other| other.ending != ending) {
        return Err(Failure::usage(format!(
            "-o {shown} names a .{ending} file, and --format {}",
            other.ending
        )));
    }
    if let [_] = entries {
        return Ok(Target::File(path.clone()));
    }
    let whole = path.with_extension("").shown();
    Err(Failure::usage(format!(
        "-o {shown} names one file, and there are {}: write a file for each into a folder, -o {whole} --format {ending}, or \
         choose one with --frames N",
        counted(entries.len(), "frame")
    )))
}

/// The frames of a run.
fn collection(folder: &Path) -> Result<Vec<FrameEntry>, Failure> {
    let shown = folder.shown();
    if !folder.exists() {
        return Err(Failure::usage(format!(
            "there is no folder `{shown}`: --fluid meshes what `rfm run FILE -o {shown}` leaves there"
        )));
    }
    if !folder.is_dir() {
        let run = folder.with_extension("out");
        return Err(Failure::usage(format!(
            "`{shown}` is a file: --fluid meshes the folder of a run; try `rfm run {shown}`, then `rfm mesh {} --fluid`",
            run.shown()
        )));
    }
    saved::collection(folder)
}

impl ParticleScale {
    /// The scale that the flags give, and otherwise the one in the run's summary.
    fn new(folder: &Path, options: &Options) -> Result<Self, Failure> {
        let path = folder.join("summary.json");
        let figures = RunFigures::read(&path);
        let vessel = figures.as_ref().ok().and_then(RunFigures::vessel);
        let figures = figures.map(|figures| figures.particle_volume());
        let usable = |length: f64| length.is_finite() && length > 0.0;
        let particle_volume = match (options.radius, figures) {
            (_, Ok(volume)) if usable(volume) => volume,
            (Some(radius), _) => (2.0 * radius).powi(3),
            (None, found) => {
                let why = found.err().unwrap_or_else(|| "its mass or density is not positive".into());
                return Err(Failure::usage(format!(
                    "`{}` does not tell how large the particles are: {why}\ngive half their spacing with --radius, \
                     for example --radius 13.6mm",
                    path.shown()
                )));
            }
        };
        let radius = options.radius.unwrap_or(0.5 * particle_volume.cbrt());
        let advised = Reconstruction::of_radius(radius);
        let cell = options.cell.unwrap_or(advised.cell);
        for (flag, length) in [("--radius", radius), ("--cell", cell)] {
            if !usable(length) {
                return Err(Failure::usage(format!("{flag} {length}: expected a length above 0")));
            }
        }
        Ok(Self { surface: Reconstruction { cell, vessel, ..advised }, particle_volume })
    }
}

/// What is done with every frame.
struct Job<'a> {
    /// The folder of the run.
    folder: &'a Path,
    target: Target,
    /// The ending of their files.
    ending: &'static str,
    write: WriteMesh,
    unit: LengthUnit,
    scale: ParticleScale,
}

impl Job<'_> {
    /// Meshes all frames, and lists the files in a collection if ParaView reads their format.
    fn surfaces(&self, entries: &[(usize, FrameEntry)]) -> Result<Vec<FrameSurface>, Failure> {
        let bar = progress::bar(entries.len() as u64, "surfaces");
        let mut surfaces: Vec<FrameSurface> = Vec::new();
        let mut origins = Origins::default();
        for (frame, entry) in entries {
            let made = self.surface(*frame, entry, &mut origins);
            let made = made.map_err(|failure| with_kept(failure, surfaces.len(), self.target.path()))?;
            bar.set_message(format!("t = {:.3} s, {} triangles", made.time, made.triangles));
            surfaces.push(made);
            if let Target::Folder(target) = &self.target
                && self.ending == vtp::FORMAT.ending
            {
                origins.write(target, surfaces.iter().map(|s| (s.time, s.file.as_str())))?;
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(surfaces)
    }

    /// Reads one frame, meshes it and writes the mesh.
    fn surface(
        &self,
        frame: usize,
        entry: &FrameEntry,
        origins: &mut Origins,
    ) -> Result<FrameSurface, Failure> {
        let started = Instant::now();
        let path = self.folder.join(&entry.file);
        let failed = |error: String| {
            let rest = "`rfm run` writes it again, or leave it out with --frames A..B";
            Failure::usage(format!("cannot mesh the frame `{}`: {error}\n{rest}", path.shown()))
        };
        let bytes = std::fs::read(&path).map_err(|error| failed(error.to_string()))?;
        output::remember_input(&path);
        let points = read_points(&bytes).map_err(|error| failed(error.to_string()))?;
        let finite: Vec<DVec3> = points.iter().copied().filter(|p| p.is_finite()).collect();
        let mesh = self.scale.surface.mesh(&finite).map_err(|error| failed(error.to_string()))?;
        let (path, file) = match &self.target {
            Target::Folder(folder) => {
                create(folder)?;
                let file = surfaces::file_name(frame, self.ending);
                (folder.join(&file), file)
            }
            Target::File(path) => (path.clone(), saved::title(path)),
        };
        output::write(&path, |out| (self.write)(&mesh, self.unit, out))?;
        origins.add(&file, &bytes);
        let parts = shells(&mesh);
        let volume = parts.iter().fold(0.0, |sum, shell| sum + shell.volume);
        let particle_volume = finite.len() as f64 * self.scale.particle_volume;
        Ok(FrameSurface {
            frame,
            time: entry.time,
            file,
            particles: finite.len(),
            left_out: points.len() - finite.len(),
            vertices: mesh.positions.len(),
            triangles: mesh.triangles.len(),
            closed: is_closed_manifold(&mesh),
            components: parts.len(),
            volume,
            particle_volume,
            volume_ratio: (particle_volume > 0.0).then_some(volume / particle_volume),
            milliseconds: started.elapsed().as_secs_f64() * 1e3,
        })
    }
}

fn create(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::usage(format!("cannot make the folder `{}`: {error}", folder.shown())))
}

/// The failure of a frame, which also says what is there already.
fn with_kept(failure: Failure, kept: usize, target: &Path) -> Failure {
    match failure {
        Failure::Usage(message) if kept > 0 => {
            Failure::Usage(format!("{message}\nthe {kept} surfaces before it are in `{}`", target.shown()))
        }
        other => other,
    }
}

fn print(summary: &FluidSummary) {
    let ratios = summary.surfaces.iter().filter_map(|surface| surface.volume_ratio);
    let (least, most) =
        ratios.fold((f64::INFINITY, 0.0), |(least, most), ratio| (ratio.min(least), ratio.max(most)));
    say!(
        "{}, {} triangles in {:.1} ms; particles of radius {:.3e} m, cells of {:.3e} m",
        counted(summary.frames, "frame"),
        summary.triangles,
        summary.milliseconds,
        summary.particle_radius,
        summary.cell
    );
    if least <= most {
        say!("volume within the surface: {least:.3} to {most:.3} times that of the particles");
    }
    let open = summary.surfaces.iter().filter(|surface| !surface.closed).count();
    if open > 0 {
        note(format!("{open} of the surfaces are not closed manifolds"));
    }
}
