//! Contacts with single leaves.

use glam::DVec3;

use super::leaf_set::Leaves;
use crate::ir::TrustKind;
use crate::solid::confirm::{Surface, confirmed};
use crate::solid::contact::{Contact, SURE};

/// The surface of a leaf.
struct LeafSurface<'a> {
    leaves: &'a Leaves,
    leaf: u32,
}

impl Surface for LeafSurface<'_> {
    fn sign(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    fn omega(&self, p: DVec3) -> f64 {
        self.leaves.value(self.leaf, p)
    }

    fn estimate(&self, p: DVec3) -> Contact {
        self.leaves.estimated_contact(self.leaf, p)
    }

    fn crosses_a_face(&self, _: DVec3, _: DVec3) -> bool {
        false
    }
}

impl Leaves {
    /// The contact with a leaf, which is compared with the signs of the leaf where its formula makes it doubtful.
    #[inline]
    pub fn contact(&self, leaf: u32, p: DVec3) -> Contact {
        let estimate = self.estimated_contact(leaf, p);
        let trust = self.trust(leaf);
        if trust.kind != TrustKind::Doubtful {
            return estimate;
        }
        confirmed(&LeafSurface { leaves: self, leaf }, trust, p, estimate, SURE * p.abs().max_element())
    }

    /// Whether a leaf has another sign at one point than at another.
    pub fn is_crossed_between(&self, p: DVec3, q: DVec3) -> bool {
        let has_other_sign = |leaf: u32| self.value(leaf, p) * self.value(leaf, q) <= 0.0;
        (0..self.len() as u32).any(has_other_sign)
    }
}
