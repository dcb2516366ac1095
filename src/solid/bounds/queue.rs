//! Boxes that wait to be looked at, the most promising first.

use std::cmp::Ordering;

use crate::geom::Aabb;

/// A box with its order in a queue, and with what is known of the part of a solid in it. The one with the highest
/// rank comes first.
pub struct Queued<K> {
    pub rank: f64,
    pub space: Aabb,
    pub known: K,
}

impl<K> PartialEq for Queued<K> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<K> Eq for Queued<K> {}

impl<K> PartialOrd for Queued<K> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<K> Ord for Queued<K> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.rank.total_cmp(&other.rank)
    }
}
