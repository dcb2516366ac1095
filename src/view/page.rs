//! The document: its text, the style and the program of the page in one file, with the blocks that it shows.

use std::io::{self, Write};

use base64::prelude::BASE64_STANDARD;
use base64::write::EncoderWriter;
use flate2::Compression;
use flate2::write::DeflateEncoder;

use super::block::pack_mesh;
use super::setting::{Corners, Setting};
use crate::geom::Aabb;
use crate::mesh::{Mesh, split_creases};

const DOCUMENT: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/style.css");

/// The program of the page, in the order in which its parts build on each other.
const PROGRAM: &[&str] = &[
    include_str!("page/algebra.js"),
    include_str!("page/colours.js"),
    include_str!("page/blocks.js"),
    include_str!("page/shaders.js"),
    include_str!("page/slice.js"),
    include_str!("page/motion.js"),
    include_str!("page/exact.js"),
    include_str!("page/scene.js"),
    include_str!("page/camera.js"),
    include_str!("page/overlay.js"),
    include_str!("page/plots.js"),
    include_str!("page/timeline.js"),
    include_str!("page/live.js"),
    include_str!("page/panel.js"),
    include_str!("page/main.js"),
];

/// A self-contained document that is being written.
pub struct Page<'a> {
    out: &'a mut dyn Write,
    meshes: Group,
    surfaces: Group,
    frames: Group,
}

/// Blocks that are not written yet, each behind its length, and the bytes of those that are.
#[derive(Default)]
struct Group {
    waiting: Vec<u8>,
    written: u64,
}

/// What the parts of a document take, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Its frames.
    pub frames: u64,
    /// Its meshes of solids.
    pub meshes: u64,
    /// Its surfaces of the fluid.
    pub surfaces: u64,
}

/// Blocks that are written together have about this many bytes: browsers take milliseconds for each group,
/// and runs may have very many small frames.
const GROUP: usize = 1 << 18;

impl<'a> Page<'a> {
    /// Begins a document with what it shows besides blocks, which becomes JSON.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn begin(out: &'a mut dyn Write, setting: &Setting) -> io::Result<Self> {
        let (head, _) = parts();
        out.write_all(head.replace("/*STYLE*/", STYLE).as_bytes())?;
        out.write_all(b"<script type=\"application/json\" id=\"setting\">")?;
        // `<` ends a script or begins a comment; in JSON it stands only in texts
        let json = serde_json::to_string(setting)?.replace('<', "\\u003c");
        out.write_all(json.as_bytes())?;
        out.write_all(b"</script>\n")?;
        Ok(Self { out, meshes: Group::default(), surfaces: Group::default(), frames: Group::default() })
    }

    /// Adds the block of a frame, deflated and as base64, together with those around it if it is small.
    ///
    /// # Errors
    /// Those of the stream, and blocks of 4 GiB and more.
    pub fn frame(&mut self, block: &[u8]) -> io::Result<()> {
        self.frames.add(block)?;
        if self.frames.waiting.len() < GROUP {
            return Ok(());
        }
        // a frame needs the meshes that it names
        self.meshes.write(self.out)?;
        self.surfaces.write(self.out)?;
        self.frames.write(self.out)
    }

    /// Adds the block of a mesh that later frames name, as [`Page::frame`] does.
    ///
    /// # Errors
    /// Those of the stream, and blocks of 4 GiB and more.
    pub fn mesh(&mut self, block: &[u8]) -> io::Result<()> {
        self.meshes.add(block)?;
        if self.meshes.waiting.len() >= GROUP { self.meshes.write(self.out) } else { Ok(()) }
    }

    /// Adds the block of a surface of the fluid that later frames name, as [`Page::frame`] does.
    ///
    /// # Errors
    /// Those of the stream, and blocks of 4 GiB and more.
    pub fn surface(&mut self, block: &[u8]) -> io::Result<()> {
        self.surfaces.add(block)?;
        if self.surfaces.waiting.len() >= GROUP { self.surfaces.write(self.out) } else { Ok(()) }
    }

    /// Ends the document.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn end(mut self) -> io::Result<Sizes> {
        self.meshes.write(self.out)?;
        self.surfaces.write(self.out)?;
        self.frames.write(self.out)?;
        let (_, tail) = parts();
        self.out.write_all(tail.replace("/*PROGRAM*/", &PROGRAM.concat()).as_bytes())?;
        Ok(Sizes {
            frames: self.frames.written,
            meshes: self.meshes.written,
            surfaces: self.surfaces.written,
        })
    }
}

impl Group {
    fn add(&mut self, block: &[u8]) -> io::Result<()> {
        let length = u32::try_from(block.len()).map_err(io::Error::other)?;
        self.waiting.extend(length.to_le_bytes());
        self.waiting.extend(block);
        Ok(())
    }

    /// Writes the blocks that wait.
    fn write(&mut self, out: &mut dyn Write) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        out.write_all(b"<script type=\"application/octet-stream\">")?;
        let counting = Counting { out: &mut *out, count: 0 };
        let base64 = EncoderWriter::new(counting, &BASE64_STANDARD);
        let mut deflated = DeflateEncoder::new(base64, Compression::new(7));
        deflated.write_all(&self.waiting)?;
        self.waiting.clear();
        self.written += deflated.finish()?.finish()?.count;
        out.write_all(b"</script>\n")
    }
}

/// A stream that counts its bytes.
struct Counting<'a> {
    out: &'a mut dyn Write,
    count: u64,
}

impl Write for Counting<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.count += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// A document without blocks, as a server sends it.
///
/// # Errors
/// [`io::Error`] if the setting has no form in JSON.
pub fn document(setting: &Setting) -> io::Result<Vec<u8>> {
    let mut out = Vec::new();
    Page::begin(&mut out, setting)?.end()?;
    Ok(out)
}

/// Writes a document that shows a mesh, with its creases sharp.
///
/// # Errors
/// Those of the stream.
pub fn solid(title: &str, mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let bounds = mesh.positions.iter().fold(Aabb::EMPTY, |all, p| all.including(*p));
    let size = bounds.size();
    let setting = Setting {
        title: title.to_string(),
        facts: format!(
            "{} triangles · {:.4} m × {:.4} m × {:.4} m",
            mesh.triangles.len(),
            size.x,
            size.y,
            size.z
        ),
        live: false,
        moves: false,
        has_surface: false,
        domain: Corners::from(&bounds),
        lattice: None,
        radius: 0.0,
        arrays: Vec::new(),
        solids: Vec::new(),
        bodies: Vec::new(),
        gravity: None,
        params: Vec::new(),
        plots: None,
        picture: None,
    };
    let mut page = Page::begin(out, &setting)?;
    page.mesh(&pack_mesh(&split_creases(mesh), 0.0, 0))?;
    page.end().map(|_| ())
}

/// What stands before the data, and what stands behind it.
fn parts() -> (&'static str, &'static str) {
    DOCUMENT.split_once("<!--DATA-->").unwrap_or((DOCUMENT, ""))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn text_of_the_user_cannot_end_the_data() {
        let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let mesh = Mesh::from_triangles(corners, vec![[0, 1, 2]]);
        let mut page = Vec::new();
        solid("</script><script>alert(1)</script><!--", &mesh, &mut page).unwrap();
        let page = String::from_utf8(page).unwrap();
        assert!(!page.contains("alert(1)</script>") && page.contains("\\u003c/script>"));
    }

    #[test]
    fn the_page_is_small_and_shows_text_as_text() {
        let parts = || [DOCUMENT, STYLE].into_iter().chain(PROGRAM.iter().copied());
        let lines: usize = PROGRAM.iter().map(|part| part.lines().count()).sum();
        assert!(lines <= 3000, "{lines} lines");
        let words = [
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
            "http://",
            "https://",
        ];
        for word in words {
            assert!(!parts().any(|part| part.contains(word)), "{word}");
        }
        for mark in ["<!--DATA-->", "/*STYLE*/", "/*PROGRAM*/"] {
            assert_eq!(DOCUMENT.matches(mark).count(), 1, "{mark}");
        }
    }
}
