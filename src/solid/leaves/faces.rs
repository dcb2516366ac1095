//! The leaves near a point, with the distances that `ir::contact` finds, joined as the solid joins them.

use glam::DVec3;

use super::leaf_set::Leaves;
use super::words::Word;
use crate::field::{Face, Faces, Part};
use crate::solid::contact::Contact;

impl Leaves {
    /// Adds the faces of the tree that begins at `first`, unless all that it describes is farther away than
    /// `reach`.
    pub fn add_faces(&self, words: &[u32], first: usize, p: DVec3, reach: f64, faces: &mut Faces) {
        let begin = faces.len();
        if !self.add_tree(words, &mut { first }, p, reach, faces) {
            faces.truncate(begin);
        }
    }

    /// Adds a tree and returns whether it may reach into the ball around the point.
    fn add_tree(&self, words: &[u32], at: &mut usize, p: DVec3, reach: f64, faces: &mut Faces) -> bool {
        let word = Word::read(words[*at]);
        *at += 1;
        let (parts, all) = match word {
            Word::Leaf { leaf, negated } => {
                let sign = if negated { -1.0 } else { 1.0 };
                let Contact { distance, normal, mean_curvature } = self.contact(leaf, p);
                let (distance, normal, mean_curvature) =
                    (sign * distance, sign * normal, sign * mean_curvature);
                faces.push(Part::Face(Face { distance, normal, mean_curvature }));
                return distance < reach;
            }
            Word::All(parts) => (parts, true),
            Word::Any(parts) => (parts, false),
        };
        let head = faces.len();
        faces.push(Part::All(parts));
        // if one member of "all of" does not reach a place, the whole does not; a member of "any of" only
        // drops out
        let (mut kept, mut near) = (0, all);
        for _ in 0..parts {
            let first = faces.len();
            let reaches = self.add_tree(words, at, p, reach, faces);
            if all {
                near &= reaches;
                kept += 1;
            } else if reaches {
                near = true;
                kept += 1;
            } else {
                faces.truncate(first);
            }
        }
        faces[head] = if all { Part::All(kept) } else { Part::Any(kept) };
        near
    }
}
