//! A solid for people to look at: its leaves, and what is left of it in a box.

use super::construction::Solid;
use super::leaves::pruning::{Verdict, prune};
use super::leaves::tree::{LeafNode, Logic};
use super::leaves::words::Word;
use crate::diagnostic::Span;
use crate::geom::Aabb;
use crate::interval::Interval;

/// One of the inequalities that a solid consists of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeafInfo {
    /// The place in the file where it was written first.
    pub span: Option<Span>,
    /// Leaves of one shape, numbered from 0, differ in their constants alone and share one program.
    pub shape: usize,
    /// Operations of its formula, constants and coordinates not counted.
    pub operations: usize,
}

/// What is left of a solid in a box.
#[derive(Debug, Clone, PartialEq)]
pub enum Remainder {
    /// It is proven that no point of the box is in the solid.
    Outside,
    /// It is proven that every point of the box is.
    Inside,
    /// For each leaf, in the order of [`Solid::leaves`], whether it still matters. The sign of the solid is
    /// that of the tree without the others.
    Leaves(Vec<bool>),
}

impl Solid {
    /// How many leaves decide the sign of the solid; `None` if it cannot be taken apart.
    pub fn leaf_count(&self) -> Option<usize> {
        self.parts().map(|parts| parts.leaves.len())
    }

    /// The leaves of the solid; `None` if it is too large to be taken apart.
    pub fn leaves(&self) -> Option<Vec<LeafInfo>> {
        let omega = &self.inner.omega;
        let parts = self.parts()?;
        let (_, nodes) = Logic::of(&omega.graph, omega.root)?;
        let info = |(leaf, &LeafNode { node, .. }): (usize, &LeafNode)| LeafInfo {
            span: omega.graph.span(node),
            shape: parts.leaves.shape_of(leaf as u32),
            operations: parts.leaves.operations(leaf as u32),
        };
        Some(nodes.iter().enumerate().map(info).collect())
    }

    /// The part of the solid that a cell map would keep in this box; `None` if it cannot be taken apart.
    pub fn remainder_in(&self, over: &Aabb) -> Option<Remainder> {
        let parts = self.parts()?;
        let mut words = Vec::new();
        let verdict = prune(&parts.words, &mut |leaf| parts.leaves.range(leaf, over), &mut words);
        Some(match verdict {
            Verdict::Outside => Remainder::Outside,
            Verdict::Inside => Remainder::Inside,
            Verdict::Near => {
                let mut kept = vec![false; parts.leaves.len()];
                for word in words {
                    if let Word::Leaf { leaf, .. } = Word::read(word) {
                        kept[leaf as usize] = true;
                    }
                }
                Remainder::Leaves(kept)
            }
        })
    }

    /// The range of each leaf over a box, in the order of [`Solid::leaves`]; `None` if it cannot be taken
    /// apart.
    pub fn leaf_ranges(&self, over: &Aabb) -> Option<Vec<Interval>> {
        let parts = self.parts()?;
        Some((0..parts.leaves.len() as u32).map(|leaf| parts.leaves.range(leaf, over)).collect())
    }
}
