//! Warnings that take longer than a keystroke: they are looked for in a thread of their own, once a text
//! rests, and solids are measured after that. Solids with very many operations, and what takes longer than a
//! second, are left to `rfm check`.
//!
//! Invariant: messages about a text are sent only while it is the newest one of its file. The sender holds
//! the lock, so that older messages never follow newer ones.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use lsp_types::{PublishDiagnosticsParams, Uri};

use rfm::diagnostic::Diagnostic;
use rfm::lower::NamedSolid;
use rfm::mesh::Watch;
use rfm::solid::ProgramKind;
use rfm::{Engine, Program, Solid};

use super::super::check::remarks::by_measuring as remarks;
use super::super::deadline::Deadline;
use super::super::lints;
use super::buffers::Buffers;
use super::document::Document;
use super::messages;
use super::reading::Encoding;

/// A text that is not changed for so long rests.
const REST: Duration = Duration::from_millis(400);

/// Time that is spent on the solids of a text. The solid at which it ends is still searched completely.
const MOST_TIME: Duration = Duration::from_secs(1);

/// Time to measure the solids of a text: what is too thin for a mesh, or without end, or empty.
const MEASURING: f64 = 1.0;

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
                let send_while_newest = |messages| {
                    let state = shared.state();
                    if !state.is_over && state.newest.get(text.uri.as_str()) == Some(&text.number) {
                        send(messages);
                    }
                };
                // a mistake in a search must not end the others
                _ = catch_unwind(AssertUnwindSafe(|| {
                    look(
                        &shared,
                        &text,
                        Document::new(&text.uri, &text.text, text.version, encoding, &buffers),
                        send_while_newest,
                    )
                }));
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

/// The solids of a text that were compiled, by their names; `None` for those that cannot be, and those that are too
/// large.
type Compiled = HashMap<String, Option<Solid>>;

/// Looks for warnings about the formulas of a text, then for those that measuring its solids gives. Each time that some
/// are found, all messages of the text are sent.
fn look(shared: &Shared, text: &Text, mut document: Document, send: impl Fn(PublishDiagnosticsParams)) {
    let mut compiled = Compiled::new();
    for search in [by_formulas, by_measuring] {
        let Some(program) = &document.program else { return };
        if !shared.is_newest(text) {
            return;
        }
        let found = search((shared, text), program, &mut compiled);
        if !found.is_empty() {
            document.messages.list.extend(found);
            send(messages::published(&text.uri, &document));
        }
    }
}

/// Each solid of a program that is small enough, by its name in the file; each is compiled once. Why one cannot be
/// compiled is among the messages of the text.
fn solids<'p>(
    program: &'p Program,
    compiled: &mut Compiled,
) -> impl Iterator<Item = (&'p NamedSolid, Solid)> {
    solids_by(program, compiled, |name| program.solid_with(name, Engine::Auto).ok())
}

/// What [`solids`] gives, with a function that compiles.
fn solids_by<'p>(
    program: &'p Program,
    compiled: &mut Compiled,
    compile: impl Fn(&str) -> Option<Solid>,
) -> impl Iterator<Item = (&'p NamedSolid, Solid)> {
    let is_small = |solid: &Solid| solid.graph(ProgramKind::Value).0.len() <= MOST_OPERATIONS;
    program.module().solids.iter().filter_map(move |named| {
        let known = compiled.entry(named.name.clone());
        let solid = known.or_insert_with(|| compile(&named.name).filter(is_small));
        Some((named, solid.clone()?))
    })
}

/// What formulas show. If the text is no longer the newest, that is nothing.
fn by_formulas(
    (shared, text): (&Shared, &Text),
    program: &Program,
    compiled: &mut Compiled,
) -> Vec<Diagnostic> {
    let started = Instant::now();
    let mut searches = lints::Searches::short();
    let mut found: Vec<Diagnostic> = Vec::new();
    for (named, solid) in solids(program, compiled) {
        if !shared.is_newest(text) {
            return Vec::new();
        }
        if started.elapsed() > MOST_TIME {
            break;
        }
        found.extend(lints::of_solid(program, named, &solid, &mut searches));
    }
    if shared.is_newest(text) && started.elapsed() < MOST_TIME {
        // why a scene cannot be compiled is among the messages of the text, too
        found.extend(lints::of_scenes(Engine::Auto, program, &mut searches).unwrap_or_default());
    }
    found
}

/// What `rfm check` says after it has measured the solids, as far as there is time.
fn by_measuring(
    (shared, text): (&Shared, &Text),
    program: &Program,
    compiled: &mut Compiled,
) -> Vec<Diagnostic> {
    let watch = WhileNewest { shared, text, deadline: Deadline::after(MEASURING) };
    let all = solids(program, compiled).take_while(|_| !watch.is_over());
    // what cannot be measured at all is left to `rfm check`, too
    all.flat_map(|(named, solid)| remarks(program, named, &solid, &watch).unwrap_or_default()).collect()
}

/// Ends the work on a text at a deadline, or when there is a newer one.
struct WhileNewest<'a> {
    shared: &'a Shared,
    text: &'a Text,
    deadline: Deadline,
}

impl Watch for WhileNewest<'_> {
    fn is_over(&self) -> bool {
        self.deadline.is_over() || !self.shared.is_newest(self.text)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    #[test]
    fn the_searches_of_a_text_compile_a_solid_once() {
        let source = "rfm 1\nsolid a = sphere(1)\nsolid b = sphere(2)\n";
        let program = Program::from_source("two.rfm", source).unwrap();
        let (mut compiled, calls) = (Compiled::new(), Cell::new(0));
        let compile = |name: &str| {
            calls.set(calls.get() + 1);
            program.solid_with(name, Engine::Interpreter).ok()
        };
        for _ in 0..2 {
            let found = solids_by(&program, &mut compiled, compile);
            assert_eq!(found.map(|(named, _)| &*named.name).collect::<Vec<_>>(), ["a", "b"]);
        }
        assert_eq!(calls.get(), 2);
    }
}
