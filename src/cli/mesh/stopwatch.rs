//! How long the stages of a mesh take.

use std::time::Instant;

/// The time since an instant, ms.
pub(super) fn milliseconds(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
