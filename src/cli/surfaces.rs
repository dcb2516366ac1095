//! The surfaces of the fluid that `rfm mesh DIR --fluid` leaves in the folder of a run.
//!
//! Invariant: a surface that names the frame it was made of is only taken for that frame.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use super::failure::{Failure, note};
use super::output::{self, Shown};
use super::saved;
use rfm::fluid_surface::FrameEntry;
use rfm::mesh::FORMATS;
use rfm::sph;

/// The folder of the surfaces, within that of the run.
pub(super) const FOLDER: &str = "surface";

/// The list of surfaces for ParaView.
const LIST: &str = "surface.pvd";

/// The index that maps surfaces to the frames they were made of.
const ORIGINS: &str = "surface.json";

/// Beginning of the names of surfaces.
const SURFACE: &str = "surface_";

/// The name of the surface of a frame.
pub(super) fn file_name(frame: usize, ending: &str) -> String {
    format!("{SURFACE}{frame:06}.{ending}")
}

/// For each surface, by its name, the checksum of the frame that it was made of.
#[derive(Debug, Default)]
pub(super) struct Origins(BTreeMap<String, String>);

impl Origins {
    /// The index of a folder; empty if the folder has none.
    fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join(ORIGINS)).unwrap_or_default();
        Self(serde_json::from_str(&text).unwrap_or_default())
    }

    /// Adds a surface that was made of a frame with this content.
    pub fn add(&mut self, surface: &str, frame: &[u8]) {
        self.0.insert(surface.to_string(), checksum(frame));
    }

    /// Writes the list of surfaces, with their times in s, and the index of the frames that they were made
    /// of.
    pub fn write<'a>(
        &self,
        folder: &Path,
        surfaces: impl Iterator<Item = (f64, &'a str)>,
    ) -> Result<(), Failure> {
        output::write(&folder.join(ORIGINS), |out| {
            serde_json::to_writer_pretty(&mut *out, &self.0)?;
            writeln!(out)
        })?;
        output::write(&folder.join(LIST), |mut out| sph::write_pvd(&mut out, surfaces))
    }

    /// Whether a surface may belong to a frame: it names no other one.
    fn fits(&self, surface: &str, frame: &Path) -> Result<bool, Failure> {
        let Some(origin) = self.0.get(surface) else { return Ok(true) };
        let bytes = std::fs::read(frame)
            .map_err(|error| Failure::usage(format!("cannot read the frame `{}`: {error}", frame.shown())))?;
        Ok(*origin == checksum(&bytes))
    }
}

fn checksum(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Why a frame has no surface.
enum Missing {
    /// None is listed for its time, or the file is gone.
    NotThere,
    /// The one that is there was made of another frame.
    OfAnother(PathBuf),
}

/// The surfaces that a folder lists.
struct Surfaces<'a> {
    run: &'a Path,
    folder: PathBuf,
    known: HashMap<u64, FrameEntry>,
    origins: Origins,
}

impl<'a> Surfaces<'a> {
    /// Reads the list; `None` if there is none.
    fn of(run: &'a Path) -> Result<Option<Self>, Failure> {
        let folder = run.join(FOLDER);
        let list = folder.join(LIST);
        if !list.is_file() {
            return Ok(None);
        }
        let (known, origins) = (saved::by_time(saved::listed(&list)?), Origins::read(&folder));
        Ok(Some(Self { run, folder, known, origins }))
    }

    fn of_frame(&self, entry: &FrameEntry) -> Result<Result<PathBuf, Missing>, Failure> {
        let known = self.known.get(&entry.time.to_bits());
        let Some(surface) = known.filter(|surface| self.folder.join(&surface.file).is_file()) else {
            return Ok(Err(Missing::NotThere));
        };
        let path = self.folder.join(&surface.file);
        let fits = self.origins.fits(&surface.file, &self.run.join(&entry.file))?;
        Ok(if fits { Ok(path) } else { Err(Missing::OfAnother(path)) })
    }
}

/// The ending of surfaces that were written for other programs alone, as by `--format ply`.
fn other_format(folder: &Path) -> Option<String> {
    let endings = std::fs::read_dir(folder)
        .ok()?
        .flatten()
        .filter_map(|entry| entry.path().extension().map(|ending| ending.to_string_lossy().to_string()));
    endings.filter(|ending| ["ply", "stl", "obj"].contains(&ending.as_str())).min()
}

/// The surfaces of these frames of a run.
pub(super) fn of_frames(run: &Path, entries: &[(usize, FrameEntry)]) -> Result<Vec<PathBuf>, Failure> {
    let made_by = format!("`rfm mesh {} --fluid` makes them", run.shown());
    let Some(surfaces) = Surfaces::of(run)? else {
        if let Some(ending) = other_format(&run.join(FOLDER)) {
            return Err(Failure::usage(format!(
                "--surface: the surfaces in `{}` are .{ending} files, and pictures need the .vtp: {made_by}, without \
                 --format",
                run.join(FOLDER).shown()
            )));
        }
        return Err(Failure::usage(format!(
            "--surface: there are no surfaces of the fluid in `{}`: {made_by}",
            run.join(FOLDER).shown()
        )));
    };
    let of_frame = |(number, entry): &(usize, FrameEntry)| match surfaces.of_frame(entry)? {
        Ok(path) => Ok(path),
        Err(Missing::NotThere) => Err(Failure::usage(format!(
            "--surface: frame {number}, at {} s, has no surface in `{}`: {made_by}, and --frames chooses others",
            entry.time,
            surfaces.folder.join(LIST).shown()
        ))),
        Err(Missing::OfAnother(path)) => Err(Failure::usage(format!(
            "--surface: `{}` was made of another run than frame {number}, at {} s: {made_by} anew",
            path.shown(),
            entry.time
        ))),
    };
    entries.iter().map(of_frame).collect()
}

/// The surfaces of these frames of a run as far as there are any. Notes which were made of other frames, and a
/// list that cannot be read: all else of the run can be shown without it.
pub(super) fn there_are(
    run: &Path,
    entries: &[(usize, FrameEntry)],
) -> Result<Vec<Option<PathBuf>>, Failure> {
    let surfaces = match Surfaces::of(run) {
        Ok(surfaces) => surfaces,
        Err(Failure::Usage(message)) => {
            let again = format!("`rfm mesh {} --fluid` makes them anew", run.shown());
            note(format!("{message}; surfaces of the fluid are not shown: {again}"));
            None
        }
        Err(other) => return Err(other),
    };
    let Some(surfaces) = surfaces else { return Ok(vec![None; entries.len()]) };
    let (mut found, mut others) = (Vec::new(), 0);
    for (_, entry) in entries {
        found.push(match surfaces.of_frame(entry)? {
            Ok(path) => Some(path),
            Err(Missing::NotThere) => None,
            Err(Missing::OfAnother(_)) => {
                others += 1;
                None
            }
        });
    }
    if others > 0 {
        note(format!(
            "{} of the fluid in `{}` {} made of another run and {} not shown: `rfm mesh {} --fluid` makes them anew",
            output::counted(others, "surface"),
            surfaces.folder.shown(),
            if others == 1 { "was" } else { "were" },
            if others == 1 { "is" } else { "are" },
            run.shown()
        ));
    }
    Ok(found)
}

/// Removes the surfaces that an earlier run has left in the folder of a run, and nothing else.
pub(super) fn remove_old(run: &Path) -> std::io::Result<()> {
    let folder = run.join(FOLDER);
    if !folder.is_dir() {
        return Ok(());
    }
    for entry in std::fs::read_dir(&folder)? {
        let entry = entry?;
        if is_ours(&entry.file_name().to_string_lossy()) && entry.path().is_file() {
            std::fs::remove_file(entry.path())?;
        }
    }
    // a folder that still holds files of others stays
    let _ = std::fs::remove_dir(&folder);
    Ok(())
}

/// A file in the folder of a run that [`remove_old`] would remove.
pub(super) fn first_old(run: &Path) -> Option<String> {
    let names = std::fs::read_dir(run.join(FOLDER)).into_iter().flatten().flatten();
    let mut names = names.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.find(|name| is_ours(name)).map(|name| format!("{FOLDER}/{name}"))
}

/// Whether `rfm mesh DIR --fluid` writes files of this name.
fn is_ours(name: &str) -> bool {
    if name == LIST || name == ORIGINS {
        return true;
    }
    let numbered = name.strip_prefix(SURFACE).and_then(|rest| rest.split_once('.'));
    numbered.is_some_and(|(number, ending)| {
        number.len() >= 6
            && number.bytes().all(|byte| byte.is_ascii_digit())
            && FORMATS.iter().any(|format| format.ending == ending)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_our_names_are_removed() {
        for format in FORMATS {
            assert!(is_ours(&file_name(3, format.ending)) && is_ours(&file_name(12_345_678, format.ending)));
        }
        assert!(is_ours("surface.pvd") && is_ours("surface.json"));
        for name in ["surface_1.vtp", "surface_000001.png", "surface_00000a.vtp", "surface.txt", "notes.md"] {
            assert!(!is_ours(name), "{name}");
        }
    }
}
