//! Where pictures go: a file for each, or one film.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::ffmpeg::{Video, even};
use crate::cli::failure::{Failure, note};
use crate::cli::output::{self, Shown};
use crate::cli::progress::{self, Progress};
use rfm::render::{Apng, Gif, Image, Palette};

/// Programs that show GIF take delays below two hundredths of a second for ten.
const FASTEST_GIF: u32 = 50;

/// What is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A folder with a PNG of each picture.
    Folder,
    Png,
    Gif,
    Apng,
    Mp4,
    Webm,
}

impl Kind {
    /// What a path asks for by its ending.
    pub fn of(path: &Path) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            _ if path.is_dir() => Ok(Self::Folder),
            None => Ok(Self::Folder),
            Some("png") => Ok(Self::Png),
            Some("gif") => Ok(Self::Gif),
            Some("apng") => Ok(Self::Apng),
            Some("mp4") => Ok(Self::Mp4),
            Some("webm") => Ok(Self::Webm),
            Some(other) => Err(Failure::usage(format!(
                "cannot tell what `{}` should be: .{other} is none of .png .gif .apng .mp4 .webm, and the name of a folder \
                 for pictures has no ending",
                path.shown()
            ))),
        }
    }

    /// Whether it is one file with several pictures.
    pub fn is_film(self) -> bool {
        match self {
            Self::Gif | Self::Apng | Self::Mp4 | Self::Webm => true,
            Self::Folder | Self::Png => false,
        }
    }
}

/// Where pictures go.
pub(super) struct Target {
    pub path: PathBuf,
    pub kind: Kind,
    pub size: (u32, u32),
    /// The pictures in a second of a film.
    pub rate: u32,
}

/// Makes pictures. `Sync`, because several are made at once.
pub(super) type Make<'a> = dyn Fn(usize) -> Result<Image, Failure> + Sync + 'a;

impl Target {
    /// Says what is wrong with a number of pictures for this target, before any is made.
    pub fn check(&self, pictures: usize) -> Result<(), Failure> {
        let refuse = |reason: String| Err(Failure::usage(reason));
        let path = self.path.shown();
        match self.kind {
            Kind::Png if pictures > 1 => refuse(format!(
                "`{path}` is one picture, and there are {pictures} frames: choose one with --frames N, or write a folder or a \
                 film such as .gif"
            )),
            Kind::Gif if self.rate > FASTEST_GIF => refuse(format!(
                "--fps {}: a .gif counts hundredths of a second, and {FASTEST_GIF} is the most that programs keep to; .apng, \
                 .mp4 and .webm can do more",
                self.rate
            )),
            Kind::Mp4 | Kind::Webm => {
                let (width, height) = self.size;
                let even = even(self.size);
                if even != self.size {
                    note(format!(
                        "--size {width}x{height}: the colours of .mp4 and .webm have half the width and height, so `{path}` \
                         gets a white border and has {}x{}",
                        even.0, even.1
                    ));
                }
                Video::check(&self.path)
            }
            Kind::Folder | Kind::Png | Kind::Gif | Kind::Apng => Ok(()),
        }
    }

    /// Makes and writes pictures, several at once and in their order. `numbers` are those of their files.
    pub fn write(&self, numbers: &[usize], make: &Make<'_>) -> Result<(), Failure> {
        let bar = progress::bar(numbers.len() as u64, "pictures");
        let count = numbers.len();
        let done = match self.kind {
            Kind::Folder => self.folder(numbers, make, &bar),
            Kind::Png => {
                let image = make(0)?;
                output::write(&self.path, |mut out| image.write_png(&mut out))
            }
            Kind::Apng => self.stream(|out, failure| {
                let pictures = u32::try_from(count).map_err(io::Error::other)?;
                let mut film = Apng::new(out, self.size, pictures, self.rate as u16)?;
                in_batches(count, make, &bar, failure, |images| images.iter().try_for_each(|i| film.add(i)))?;
                film.finish()
            }),
            Kind::Gif => self.stream(|out, failure| {
                let few: Vec<Result<Image, Failure>> =
                    [0, count / 2, count - 1].into_par_iter().map(make).collect();
                let few: Vec<Image> = kept(few.into_iter().collect(), failure)?;
                let palette = Palette::of(&few.iter().collect::<Vec<_>>());
                let mut film = Gif::new(out, self.size, self.rate, palette)?;
                in_batches(count, make, &bar, failure, |images| film.add(&images))
            }),
            Kind::Mp4 | Kind::Webm => output::through(&self.path, |temporary| {
                let mut video = Video::begin(&self.path, temporary, self.size, self.rate)?;
                let mut failure = None;
                let fed = in_batches(count, make, &bar, &mut failure, |images| {
                    images.iter().try_for_each(|image| video.add(image))
                });
                match failure {
                    Some(failure) => Err(failure),
                    None => video.finish(fed),
                }
            }),
        };
        bar.finish_and_clear();
        done
    }

    fn folder(&self, numbers: &[usize], make: &Make<'_>, bar: &Progress) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.path)
            .map_err(|e| Failure::usage(format!("cannot make the folder `{}`: {e}", self.path.shown())))?;
        let name = |number: usize| format!("frame_{number:06}.png");
        numbers.par_iter().enumerate().try_for_each(|(k, number)| {
            let image = make(k)?;
            output::write(&self.path.join(name(*number)), |mut out| image.write_png(&mut out))?;
            bar.inc(1);
            Ok::<(), Failure>(())
        })?;
        let ours: std::collections::BTreeSet<String> = numbers.iter().map(|number| name(*number)).collect();
        let names =
            std::fs::read_dir(&self.path)?.flatten().map(|e| e.file_name().to_string_lossy().into_owned());
        let others =
            names.filter(|n| n.starts_with("frame_") && n.ends_with(".png") && !ours.contains(n)).count();
        if others > 0 {
            note(format!("`{}` also holds {others} pictures that were there before", self.path.shown()));
        }
        Ok(())
    }

    /// Writes one file. A failure that is not one of writing is reported first.
    fn stream(
        &self,
        fill: impl FnOnce(&mut dyn Write, &mut Option<Failure>) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let mut failure = None;
        let written = output::write(&self.path, |out| fill(out, &mut failure));
        match failure {
            Some(failure) => Err(failure),
            None => written,
        }
    }
}

/// Makes as many pictures at once as there are threads, and hands them on in their order.
fn in_batches(
    count: usize,
    make: &Make<'_>,
    bar: &Progress,
    failure: &mut Option<Failure>,
    mut take: impl FnMut(Vec<Image>) -> io::Result<()>,
) -> io::Result<()> {
    let at_once = rayon::current_num_threads().max(1);
    for first in (0..count).step_by(at_once) {
        let batch = (first..count.min(first + at_once)).into_par_iter();
        let images: Vec<Result<Image, Failure>> = batch.map(make).collect();
        let images: Vec<Image> = kept(images.into_iter().collect(), failure)?;
        bar.inc(images.len() as u64);
        take(images)?;
    }
    Ok(())
}

/// Keeps a failure for the report, and stops the stream.
fn kept<T>(made: Result<T, Failure>, failure: &mut Option<Failure>) -> io::Result<T> {
    made.map_err(|reason| {
        *failure = Some(reason);
        io::Error::other("a picture could not be made")
    })
}
