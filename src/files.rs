//! The other files that a file names: where they come from, and what has been read so far.
//!
//! Nothing here touches a file system. A program that embeds the compiler gives a [`Reader`], which may read
//! from a folder, an archive or memory; without one, a file that names others is refused.

use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::table::Table;

/// Where files come from.
pub trait Reader: Send + Sync {
    /// The bytes of a file. Its name is the path that a file states, from the folder of that file's own name, without
    /// `.` and with `..` only in front: `parts/knight.rfm` where `parts/chess.rfm` names `knight.rfm`.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn read(&self, name: &str) -> Result<Vec<u8>, Unread>;
}

/// Files that are known from the beginning.
struct Memory(BTreeMap<String, Vec<u8>>);

impl Reader for Memory {
    fn read(&self, name: &str) -> Result<Vec<u8>, Unread> {
        let unknown = || match &self.0.keys().map(String::as_str).collect::<Vec<_>>()[..] {
            [] => "no files are given".to_string(),
            known => format!("the files given are {}", known.join(", ")),
        };
        self.0.get(name).cloned().ok_or_else(|| Unread::Failed(unknown()))
    }
}

/// Why a file cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unread {
    /// The text was given without a place from which others could be read.
    NoReader,
    /// The file lies outside of the folder that may be read.
    Outside,
    /// What the file system says, or the [`Reader`].
    Failed(String),
}

impl fmt::Display for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReader => f.write_str("other files cannot be read here"),
            Self::Outside => f.write_str("it lies outside of the folder of the file"),
            Self::Failed(reason) => f.write_str(reason),
        }
    }
}

/// The files that one file names, each read once. Clones share what was read.
#[derive(Clone, Default)]
pub struct Files {
    reader: Option<Arc<dyn Reader>>,
    known: Arc<Mutex<Known>>,
}

#[derive(Default)]
struct Known {
    files: BTreeMap<String, Result<Arc<[u8]>, Unread>>,
    /// What was made of files, by a text that says how.
    tables: HashMap<String, Arc<dyn Table>>,
}

impl Files {
    /// Files from a reader.
    pub fn new(reader: Arc<dyn Reader>) -> Self {
        Self { reader: Some(reader), known: Arc::default() }
    }

    /// Files from memory, by their paths. A file names others from its own folder: `dir/board.rfm`, which imports
    /// `parts.rfm`, finds `dir/parts.rfm`.
    pub fn from_memory<N: AsRef<str>, B: Into<Vec<u8>>>(files: impl IntoIterator<Item = (N, B)>) -> Self {
        let named = files.into_iter().map(|(name, bytes)| (Self::plain(name.as_ref()), bytes.into()));
        Self::new(Arc::new(Memory(named.collect())))
    }

    /// The name of a file that another one names by a path.
    pub fn name(path: &str, from: &str) -> String {
        let folder = Path::new(from).parent().unwrap_or(Path::new(""));
        plain(&folder.join(path))
    }

    /// The name of a file without detours.
    pub fn plain(name: &str) -> String {
        plain(Path::new(name))
    }

    /// The bytes of a file.
    ///
    /// # Errors
    /// Why it cannot be read, or could not when it was first asked for.
    pub fn read(&self, name: &str) -> Result<Arc<[u8]>, Unread> {
        let reader = self.reader.as_ref().ok_or(Unread::NoReader)?;
        if let Some(read) = self.known().files.get(name) {
            return read.clone();
        }
        let read = reader.read(name).map(Arc::from);
        self.known().files.insert(name.to_string(), read.clone());
        read
    }

    /// All files that were asked for, whether they could be read or not, by name.
    pub fn asked(&self) -> Vec<String> {
        self.known().files.keys().cloned().collect()
    }

    /// Forgets all files, so that each is read again when it is next asked for.
    pub fn forget(&self) {
        *self.known() = Known::default();
    }

    /// The value that was made of a file, or the one that `make` makes of it now.
    pub(crate) fn table<E>(
        &self,
        how: String,
        make: impl FnOnce() -> Result<Arc<dyn Table>, E>,
    ) -> Result<Arc<dyn Table>, E> {
        if let Some(table) = self.known().tables.get(&how) {
            return Ok(table.clone());
        }
        let table = make()?;
        self.known().tables.insert(how, table.clone());
        Ok(table)
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Files {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Files").field("asked", &self.asked()).finish_non_exhaustive()
    }
}

/// A path without `.`, and with `..` only where nothing stands in front of it.
fn plain(path: &Path) -> String {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => {
                out.pop();
            }
            Component::Normal(_) | Component::ParentDir | Component::RootDir | Component::Prefix(_) => {
                out.push(part)
            }
        }
    }
    out.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Shelf;

    impl Reader for Shelf {
        fn read(&self, name: &str) -> Result<Vec<u8>, Unread> {
            Ok(name.as_bytes().to_vec())
        }
    }

    #[test]
    fn names_have_no_detours() {
        assert_eq!(Files::name("b.rfm", "a.rfm"), "b.rfm");
        assert_eq!(Files::name("./parts/../b.rfm", "x/a.rfm"), "x/b.rfm");
        assert_eq!(Files::name("../../b.rfm", "x/a.rfm"), "../b.rfm");
        assert_eq!(Files::name("/b.rfm", "x/a.rfm"), "/b.rfm");
        assert_eq!(Files::name("b.rfm", "<stdin>"), "b.rfm");
    }

    #[test]
    fn nothing_is_read_without_a_reader() {
        assert_eq!(Files::default().read("a"), Err(Unread::NoReader));
        let files = Files::new(Arc::new(Shelf));
        assert_eq!(&*files.read("a").unwrap(), b"a");
        assert_eq!(files.clone().asked(), ["a"]);
        files.forget();
        assert!(files.asked().is_empty());
    }
}
