//! Progress and cancellation of long work.

/// Waits for the making or the measuring of a mesh.
///
/// A closure `|done: f64| …` receives the progress of the work and never ends it.
pub trait Watch: Sync {
    /// Receives the share of the work that is done, in (0, 1]. It is called from any thread, not always in ascending
    /// order.
    fn progress(&self, _done: f64) {}

    /// Whether the work is to end. It looks here before each of its tasks and steps, the longest of which evaluate a
    /// field some ten thousand times.
    fn is_over(&self) -> bool {
        false
    }
}

impl<F: Fn(f64) + Sync> Watch for F {
    fn progress(&self, done: f64) {
        self(done);
    }
}

/// No watch: the work runs to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unwatched;

impl Watch for Unwatched {}

/// A part of the work of another watch: from one share of it to another.
pub struct Stretch<'a> {
    /// The watch of all the work.
    pub watch: &'a dyn Watch,
    /// The share of the work that is done before this part.
    pub from: f64,
    /// The share that is done after it.
    pub to: f64,
}

impl Watch for Stretch<'_> {
    fn progress(&self, done: f64) {
        self.watch.progress(self.from + done * (self.to - self.from));
    }

    fn is_over(&self) -> bool {
        self.watch.is_over()
    }
}
