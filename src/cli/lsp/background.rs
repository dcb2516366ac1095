//! Warnings that take longer than a keystroke: they are looked for in a thread of their own, once a text
//! rests. Solids with very many operations, and those that take longer than a second, are left to
//! `rfm check`.
//!
//! Invariant: messages about a text are sent only while it is the newest one of its file. The sender holds
//! the lock, so that older messages never follow newer ones.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lsp_types::{PublishDiagnosticsParams, Uri};

use rfm::Engine;
use rfm::diagnostic::Diagnostic;

use super::super::lints;
use super::buffers::Buffers;
use super::document::Document;
use super::messages;
use super::reading::Encoding;

/// A text that is not changed for so long rests.
const REST: Duration = Duration::from_millis(400);

/// Time that is spent on the solids of a text. The solid at which it ends is still searched completely.
const MOST_TIME: Duration = Duration::from_secs(1);

/// Solids with more operations are left to `rfm check`: one of them must not take seconds.
const MOST_OPERATIONS: usize = 1000;

/// A version of a text.
#[derive(Clone)]
struct Text {
    uri: Uri,
    text: String,
    version: Option<i32>,
    /// When it was given.
    since: Instant,
    /// Counts the texts of all files.
    number: u64,
}

#[derive(Default)]
struct State {
    /// The number of the newest text of each file.
    newest: HashMap<String, u64>,
    /// The newest text of each file that has not been looked at, the longest at rest first.
    waiting: Vec<Text>,
    count: u64,
    is_over: bool,
}

/// The thread that looks for warnings, as the one that answers the editor sees it.
#[derive(Default)]
pub(super) struct Background {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        // a thread that panicked has left numbers that are right
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_newest(&self, text: &Text) -> bool {
        let state = self.state();
        !state.is_over && state.newest.get(text.uri.as_str()) == Some(&text.number)
    }

    /// Waits until a text rests; `None` if the editor is gone.
    fn wait(&self) -> Option<Text> {
        let mut state = self.state();
        while !state.is_over {
            let left = match state.waiting.first() {
                Some(text) => REST.saturating_sub(text.since.elapsed()),
                None => Duration::MAX,
            };
            if left.is_zero() {
                return Some(state.waiting.remove(0));
            }
            state = match left {
                Duration::MAX => self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                left => self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0,
            };
        }
        None
    }
}

impl Background {
    /// Starts the thread. It sends all messages of a text again, with those that it has found.
    pub fn start(
        encoding: Encoding,
        buffers: Buffers,
        send: impl Fn(PublishDiagnosticsParams) + Send + 'static,
    ) -> Self {
        let background = Self::default();
        let shared = Arc::clone(&background.shared);
        std::thread::spawn(move || {
            while let Some(text) = shared.wait() {
                // a mistake in a search must not end the others
                let found = catch_unwind(AssertUnwindSafe(|| look(&shared, &text, encoding, &buffers)));
                let Ok(Some(messages)) = found else { continue };
                let state = shared.state();
                if !state.is_over && state.newest.get(text.uri.as_str()) == Some(&text.number) {
                    send(messages);
                }
            }
        });
        background
    }

    /// Gives a text whose own messages have been sent.
    pub fn give(&self, uri: &Uri, text: String, version: Option<i32>) {
        let mut state = self.shared.state();
        state.count += 1;
        let number = state.count;
        state.newest.insert(uri.as_str().to_string(), number);
        state.waiting.retain(|waiting| waiting.uri != *uri);
        state.waiting.push(Text { uri: uri.clone(), text, version, since: Instant::now(), number });
        self.shared.changed.notify_one();
    }

    /// Forgets the texts of a file: what is found in them is no longer sent.
    pub fn forget(&self, uri: &Uri) {
        let mut state = self.shared.state();
        state.newest.remove(uri.as_str());
        state.waiting.retain(|waiting| waiting.uri != *uri);
    }
}

impl Drop for Background {
    /// The thread ends with the solid that it looks at.
    fn drop(&mut self) {
        self.shared.state().is_over = true;
        self.shared.changed.notify_one();
    }
}

/// All messages of a text with those that are found in its solids; `None` if there are none of these, or if
/// the text is no longer the newest.
fn look(
    shared: &Shared,
    text: &Text,
    encoding: Encoding,
    buffers: &Buffers,
) -> Option<PublishDiagnosticsParams> {
    let started = Instant::now();
    let mut document = Document::new(&text.uri, &text.text, text.version, encoding, buffers);
    let program = document.program.as_ref()?;
    let mut searches = lints::Searches::short();
    let mut found: Vec<Diagnostic> = Vec::new();
    for named in &program.module().solids {
        if !shared.is_newest(text) {
            return None;
        }
        if started.elapsed() > MOST_TIME {
            break;
        }
        // why a solid cannot be compiled is among the messages of the text
        let Ok(solid) = program.solid_with(&named.name, Engine::Auto) else { continue };
        if solid.graph(rfm::solid::ProgramKind::Value).0.len() <= MOST_OPERATIONS {
            found.extend(lints::of_solid(program, named, &solid, &mut searches));
        }
    }
    if shared.is_newest(text) && started.elapsed() < MOST_TIME {
        // why a scene cannot be compiled is among the messages of the text, too
        found.extend(lints::of_scenes(Engine::Auto, program, &mut searches).unwrap_or_default());
    }
    if found.is_empty() {
        return None;
    }
    document.messages.list.extend(found);
    Some(messages::published(&text.uri, &document))
}
