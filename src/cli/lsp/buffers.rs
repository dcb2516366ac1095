//! The texts that an editor has open: they count in place of those on the disk, also where other files import them.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rfm::compile::files_beside;
use rfm::files::{Files, Reader, Unread};

/// The open texts by their paths. Clones share them.
#[derive(Clone, Default)]
pub(super) struct Buffers {
    texts: Arc<Mutex<HashMap<String, Arc<str>>>>,
}

impl Buffers {
    fn texts(&self) -> MutexGuard<'_, HashMap<String, Arc<str>>> {
        // a thread that panicked has left texts that are right
        self.texts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Opens a text, or puts another one in its place.
    pub fn put(&self, path: &str, text: &str) {
        self.texts().insert(path.to_string(), text.into());
    }

    /// The open text of a path.
    pub fn text(&self, path: &str) -> Option<Arc<str>> {
        self.texts().get(path).cloned()
    }

    pub fn close(&self, path: &str) {
        self.texts().remove(path);
    }

    /// The files that the text of a path may name: those in its folder, as for the other commands.
    pub fn beside(&self, path: &str) -> Files {
        Files::new(Arc::new(Shelf { open: self.clone(), disk: files_beside(path, false) }))
    }
}

/// Open texts in front of the files of a folder.
struct Shelf {
    open: Buffers,
    disk: Files,
}

impl Reader for Shelf {
    fn read(&self, name: &str) -> Result<Vec<u8>, Unread> {
        let on_disk = self.disk.read(name);
        let open = self.open.text(name);
        match (open, on_disk) {
            (_, Err(Unread::Outside)) => Err(Unread::Outside),
            (Some(text), _) => Ok(text.as_bytes().to_vec()),
            (None, on_disk) => on_disk.map(|bytes| bytes.to_vec()),
        }
    }
}
