//! Slices are drawn in a thread of their own, one after the other: a slice of a solid with many parts takes
//! seconds, and meanwhile the editor gets all other answers.
//!
//! Invariant: each request is answered once. A thread takes a request out of the state, under the
//! lock, before it answers.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use lsp_server::{ErrorCode, RequestId, Response};

use super::document::Document;
use super::preview::{self, Wanted};

/// A slice that is asked for.
pub(super) struct Asked {
    pub id: RequestId,
    /// The text as it was then.
    pub document: Arc<Document>,
    pub wanted: Wanted,
}

#[derive(Default)]
struct State {
    /// In the order in which they came, at most one for each panel.
    waiting: Vec<Asked>,
    /// What is being drawn, unless it has been answered already.
    drawn: Option<RequestId>,
    /// `None` if the editor is gone.
    send: Option<Box<dyn Fn(Response) + Send>>,
}

impl State {
    fn answer(&self, answer: Response) {
        if let Some(send) = &self.send {
            send(answer);
        }
    }

    fn refuse(&self, id: RequestId, code: ErrorCode, why: &str) {
        self.answer(Response::new_err(id, code as i32, why.to_string()));
    }

    fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.drawn.is_none()
    }
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // a thread that panicked has left requests that are right
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait_while(&self, is_so: impl Fn(&State) -> bool) -> MutexGuard<'_, State> {
        let state = self.changed.wait_while(self.state(), |state| is_so(state));
        state.unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a request to draw; `None` if the editor is gone.
    fn next(&self) -> Option<Asked> {
        let mut state = self.wait_while(|state| state.waiting.is_empty() && state.send.is_some());
        state.send.as_ref()?;
        let asked = state.waiting.remove(0);
        state.drawn = Some(asked.id.clone());
        Some(asked)
    }
}

/// The thread that draws, as the one that answers the editor sees it.
pub(super) struct Slices {
    shared: Arc<Shared>,
}

impl Slices {
    /// Starts the thread.
    pub fn start(send: impl Fn(Response) + Send + 'static) -> Self {
        let shared = Arc::new(Shared::default());
        shared.state().send = Some(Box::new(send));
        let slices = Self { shared: Arc::clone(&shared) };
        std::thread::spawn(move || {
            while let Some(asked) = shared.next() {
                let answer = draw(&asked);
                let mut state = shared.state();
                if state.drawn.take().is_some() {
                    state.answer(answer);
                }
                shared.changed.notify_all();
            }
        });
        slices
    }

    /// Has a slice drawn. An older request for the same panel would be out of date when it is shown, so it is
    /// refused.
    pub fn ask(&self, asked: Asked) {
        let mut state = self.shared.state();
        let same = |other: &mut Asked| other.wanted.panel() == asked.wanted.panel();
        for old in state.waiting.extract_if(.., same).collect::<Vec<_>>() {
            state.refuse(old.id, ErrorCode::ContentModified, "another slice was asked for since");
        }
        state.waiting.push(asked);
        self.shared.changed.notify_all();
    }

    /// Refuses a slice that the editor no longer wants. One that is being drawn is drawn to the end and
    /// discarded.
    pub fn cancel(&self, id: &RequestId) {
        self.refuse(|asked| asked == id, "the slice is not wanted any more");
    }

    /// Refuses all slices, because the server ends.
    pub fn cancel_all(&self) {
        self.refuse(|_| true, "the server ends");
    }

    fn refuse(&self, is_meant: impl Fn(&RequestId) -> bool, why: &str) {
        let mut state = self.shared.state();
        let waiting = state.waiting.extract_if(.., |asked| is_meant(&asked.id)).map(|asked| asked.id);
        let mut meant: Vec<RequestId> = waiting.collect();
        meant.extend(state.drawn.take_if(|drawn| is_meant(drawn)));
        for id in meant {
            state.refuse(id, ErrorCode::RequestCanceled, why);
        }
    }

    /// Waits until all slices are answered.
    pub fn finish(&self) {
        drop(self.shared.wait_while(|state| !state.is_idle()));
    }
}

impl Drop for Slices {
    /// The slice that is being drawn is no longer wanted.
    fn drop(&mut self) {
        self.shared.state().send = None;
        self.shared.changed.notify_all();
    }
}

/// Draws a slice.
fn draw(asked: &Asked) -> Response {
    let id = asked.id.clone();
    // a mistake in one slice must not end the others
    let slice = catch_unwind(AssertUnwindSafe(|| preview::slice(&asked.document, &asked.wanted)));
    match slice.map(|slice| slice.map(serde_json::to_value)) {
        Ok(Ok(Ok(slice))) => Response::new_ok(id, slice),
        Ok(Ok(Err(error))) => Response::new_err(id, ErrorCode::InternalError as i32, error.to_string()),
        Ok(Err(why)) => Response::new_err(id, ErrorCode::RequestFailed as i32, why),
        Err(_) => Response::new_err(id, ErrorCode::InternalError as i32, "this is a mistake of rfm".into()),
    }
}
