//! A solid at a time, or during a stretch of time: all that is found once for it and then kept.

use std::sync::{Arc, OnceLock};

use super::bounds::found::FoundBounds;
use super::engine::ProgramKind;
use super::leaves::leaf_set::LeafTree;
use super::programs::number::UniformValues;
use super::programs::ranges::UniformRanges;
use crate::geom::Twist;
use crate::interval::Interval;

/// A stretch of time. Values are those at its end, ranges hold for all of it; a solid at rest has a single
/// one without end.
pub(super) struct Moment {
    pub from: f64,
    pub to: f64,
    uniforms: [OnceLock<UniformValues>; ProgramKind::COUNT],
    omega_ranges: OnceLock<UniformRanges>,
    twin_ranges: OnceLock<UniformRanges>,
    parts: OnceLock<Option<Arc<LeafTree>>>,
    bounds: OnceLock<FoundBounds>,
    twist: OnceLock<Option<Twist>>,
}

impl Moment {
    pub fn new(from: f64, to: f64) -> Arc<Self> {
        Arc::new(Self {
            from,
            to,
            uniforms: Default::default(),
            omega_ranges: OnceLock::new(),
            twin_ranges: OnceLock::new(),
            parts: OnceLock::new(),
            bounds: OnceLock::new(),
            twist: OnceLock::new(),
        })
    }

    /// All times of the stretch.
    pub fn interval(&self) -> Interval {
        Interval::new(self.from.min(self.to), self.from.max(self.to))
    }

    /// What the programs of one kind need, found by `find`.
    #[inline]
    pub fn uniforms(&self, kind: ProgramKind, find: impl FnOnce(f64) -> UniformValues) -> &UniformValues {
        self.uniforms[kind as usize].get_or_init(|| find(self.to))
    }

    /// What the ranges of ω, or of its twin, need.
    pub fn ranges(&self, twin: bool, find: impl FnOnce(Interval) -> UniformRanges) -> &UniformRanges {
        let slot = if twin { &self.twin_ranges } else { &self.omega_ranges };
        slot.get_or_init(|| find(self.interval()))
    }

    /// The solid taken apart, by `find` for the two ends of the stretch.
    pub fn parts(&self, find: impl FnOnce(f64, f64) -> Option<Arc<LeafTree>>) -> Option<Arc<LeafTree>> {
        self.parts.get_or_init(|| find(self.from, self.to)).clone()
    }

    pub fn bounds(&self, find: impl FnOnce() -> FoundBounds) -> &FoundBounds {
        self.bounds.get_or_init(find)
    }

    /// How the solid moves at the end of the stretch, as `find` says.
    pub fn twist(&self, find: impl FnOnce(f64) -> Option<Twist>) -> Option<Twist> {
        *self.twist.get_or_init(|| find(self.to))
    }
}
