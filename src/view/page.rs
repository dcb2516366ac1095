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
    /// Blocks that are not written yet, each behind its length.
    waiting: Vec<u8>,
}

/// Blocks that are written together have about this many bytes: browsers take milliseconds for each group, and runs may have
/// very many small frames.
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
        Ok(Self { out, waiting: Vec::new() })
    }

    /// Adds a block, deflated and as base64, together with those around it if it is small.
    ///
    /// # Errors
    /// Those of the stream, and blocks of 4 GiB and more.
    pub fn block(&mut self, block: &[u8]) -> io::Result<()> {
        let length = u32::try_from(block.len()).map_err(io::Error::other)?;
        self.waiting.extend(length.to_le_bytes());
        self.waiting.extend(block);
        if self.waiting.len() >= GROUP { self.group() } else { Ok(()) }
    }

    /// Writes the blocks that wait.
    fn group(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        self.out.write_all(b"<script type=\"application/octet-stream\">")?;
        let base64 = EncoderWriter::new(&mut *self.out, &BASE64_STANDARD);
        let mut deflated = DeflateEncoder::new(base64, Compression::new(7));
        deflated.write_all(&self.waiting)?;
        self.waiting.clear();
        deflated.finish()?.finish()?;
        self.out.write_all(b"</script>\n")
    }

    /// Ends the document.
    ///
    /// # Errors
    /// Those of the stream.
    pub fn end(mut self) -> io::Result<()> {
        self.group()?;
        let (_, tail) = parts();
        self.out.write_all(tail.replace("/*PROGRAM*/", &PROGRAM.concat()).as_bytes())
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
        domain: Corners::from(&bounds),
        lattice: None,
        radius: 0.0,
        arrays: Vec::new(),
        gravity: None,
        params: Vec::new(),
        plots: None,
    };
    let mut page = Page::begin(out, &setting)?;
    page.block(&pack_mesh(&split_creases(mesh), 0.0, 0))?;
    page.end()
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
        let lines: usize = parts().map(|part| part.lines().count()).sum();
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
