//! The surfaces of the fluid that `rfm mesh DIR --fluid` leaves in the folder of a run.
//!
//! Invariant: a surface that names the frame it was made of is only taken for that frame.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::failure::Failure;
use super::output::{self, Shown};
use super::saved;
use rfm::fluid_surface::FrameEntry;
use rfm::mesh::FORMATS;
use rfm::sph;

/// The folder of the surfaces, within that of the run.
pub(super) const FOLDER: &str = "surface";

/// The list of surfaces for ParaView.
const LIST: &str = "surface.pvd";

/// The file that tells of which frames the surfaces were made.
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
    /// Those that a folder tells of; none if it has no such file.
    fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join(ORIGINS)).unwrap_or_default();
        Self(serde_json::from_str(&text).unwrap_or_default())
    }

    /// Adds a surface that was made of a frame with this content.
    pub fn add(&mut self, surface: &str, frame: &[u8]) {
        self.0.insert(surface.to_string(), checksum(frame));
    }

    /// Lists the surfaces, with their times in s, and tells of which frames they were made.
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

/// The surfaces of these frames of a run.
pub(super) fn of_frames(run: &Path, entries: &[(usize, FrameEntry)]) -> Result<Vec<PathBuf>, Failure> {
    let folder = run.join(FOLDER);
    let list = folder.join(LIST);
    let made_by = format!("`rfm mesh {} --fluid` makes them", run.shown());
    if !list.is_file() {
        return Err(Failure::usage(format!(
            "--surface: there are no surfaces of the fluid in `{}`: {made_by}",
            folder.shown()
        )));
    }
    let known = saved::by_time(saved::listed(&list)?);
    let origins = Origins::read(&folder);
    let of_frame = |(number, entry): &(usize, FrameEntry)| {
        let found = known.get(&entry.time.to_bits()).filter(|surface| folder.join(&surface.file).is_file());
        let Some(surface) = found else {
            return Err(Failure::usage(format!(
                "--surface: frame {number}, at {} s, has no surface in `{}`: {made_by}, and --frames chooses others",
                entry.time,
                list.shown()
            )));
        };
        let path = folder.join(&surface.file);
        if !origins.fits(&surface.file, &run.join(&entry.file))? {
            return Err(Failure::usage(format!(
                "--surface: `{}` was made of another run than frame {number}, at {} s: {made_by} anew",
                path.shown(),
                entry.time
            )));
        }
        Ok(path)
    };
    entries.iter().map(of_frame).collect()
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
