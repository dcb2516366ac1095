//! The end of the time for a piece of work.

use std::time::{Duration, Instant};

use super::progress::Progress;
use rfm::mesh::Watch;

/// Ends the work at an instant. What is found until then depends on the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deadline(pub Instant);

impl Deadline {
    /// The instant that is the given number of seconds from now; far away if that is no time that can be
    /// stated.
    pub fn after(seconds: f64) -> Self {
        let far = Duration::from_secs(60 * 60 * 24 * 365);
        let wait = Duration::try_from_secs_f64(seconds.max(0.0)).map_or(far, |wait| wait.min(far));
        Self(Instant::now() + wait)
    }
}

impl Watch for Deadline {
    fn is_over(&self) -> bool {
        Instant::now() >= self.0
    }
}

/// Work whose progress another watch shows, and that ends at a deadline.
pub struct Within<'a>(pub &'a dyn Watch, pub Deadline);

impl Watch for Within<'_> {
    fn progress(&self, done: f64) {
        self.0.progress(done);
    }

    fn is_over(&self) -> bool {
        self.1.is_over()
    }
}

/// Work whose progress is shown, and that ends at a deadline if there is one.
pub struct Shown<'a>(pub &'a Progress, pub Option<Deadline>);

impl Watch for Shown<'_> {
    fn progress(&self, done: f64) {
        self.0.progress(done);
    }

    fn is_over(&self) -> bool {
        self.1.is_some_and(|deadline| deadline.is_over())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_that_are_no_times_are_over_or_far_away() {
        for seconds in [1e300, f64::INFINITY, 60.0] {
            assert!(!Deadline::after(seconds).is_over());
        }
        for seconds in [-1.0, 0.0, f64::NAN] {
            assert!(Deadline::after(seconds).is_over());
        }
    }
}
