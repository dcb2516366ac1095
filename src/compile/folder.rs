//! Files of a folder.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::files::{Files, Reader, Unread};

/// The largest file that is read, in bytes.
const LARGEST: u64 = 1 << 30;

/// Reads the files in a folder and in the folders below it. Links that lead out of it count as outside.
struct Folder {
    /// `None` if files may lie anywhere.
    within: Option<PathBuf>,
}

/// Files for the text of a path: those in its folder, and outside of it if that is allowed.
pub fn files_beside(path: impl AsRef<Path>, allow_outside: bool) -> Files {
    let folder = path.as_ref().parent().filter(|folder| !folder.as_os_str().is_empty());
    let within = (!allow_outside).then(|| folder.unwrap_or(Path::new(".")).to_path_buf());
    Files::new(Arc::new(Folder { within }))
}

impl Reader for Folder {
    fn read(&self, name: &str) -> Result<Vec<u8>, Unread> {
        let failed = |error: std::io::Error| Unread::Failed(error.to_string());
        if let Some(within) = &self.within {
            let within = std::fs::canonicalize(within).map_err(failed)?;
            // whether there is such a file outside is not disclosed
            let inside = |path: &Path| std::fs::canonicalize(path).map(|path| path.starts_with(&within));
            let mut folder = Path::new(name);
            let is_inside = loop {
                match inside(folder) {
                    Ok(is_inside) => break is_inside,
                    Err(_) => match folder.parent() {
                        Some(above) if above.as_os_str().is_empty() => {
                            break inside(Path::new(".")).unwrap_or(false);
                        }
                        Some(above) => folder = above,
                        None => break false,
                    },
                }
            };
            if !is_inside {
                return Err(Unread::Outside);
            }
        }
        let file = std::fs::File::open(name).map_err(failed)?;
        if !file.metadata().map_err(failed)?.is_file() {
            return Err(Unread::Failed("it is no file".into()));
        }
        let mut bytes = Vec::new();
        file.take(LARGEST + 1).read_to_end(&mut bytes).map_err(failed)?;
        if bytes.len() as u64 > LARGEST {
            return Err(Unread::Failed(format!("it has more than {} MiB", LARGEST >> 20)));
        }
        Ok(bytes)
    }
}

/// Converts bytes to text.
///
/// # Errors
/// [`InvalidData`](std::io::ErrorKind::InvalidData) if the bytes are not UTF-8; the message says where.
pub fn text_of(bytes: Vec<u8>) -> std::io::Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        // the marks with which editors begin texts of 16-bit characters
        let message = match error.as_bytes() {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "it is a UTF-16 text: save it as UTF-8".into(),
            _ => format!("it is not a UTF-8 text (byte {at} does not belong to a character)"),
        };
        std::io::Error::new(std::io::ErrorKind::InvalidData, message)
    })
}
