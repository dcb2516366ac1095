//! The surface near a point as a tree of faces. Walls without wall particles are computed from it.

use glam::DVec3;
use smallvec::SmallVec;

/// A piece of an obstacle's surface, seen from a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Distance of the point from the face, positive in the fluid, in the scene's unit of length.
    pub distance: f64,
    /// Outward unit normal at the nearest place of the face.
    pub normal: DVec3,
    /// Mean curvature, 1/length; positive where the obstacle is convex.
    pub mean_curvature: f64,
}

/// A node of a tree of faces: a face, or a combination of the trees that follow it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Part {
    /// A face: the obstacle lies behind it.
    Face(Face),
    /// The intersection of this many of the trees that follow: an edge that stands out of the obstacle.
    All(u32),
    /// The union of this many of the trees that follow: an edge that reaches into the obstacle.
    Any(u32),
}

/// A tree of faces in prefix order: each node is followed by its parts. It is empty if no surface is near.
pub type Faces = SmallVec<[Part; 16]>;

/// The faces of a tree that a body outside may touch: all parts of unions, and of an intersection those of
/// the part of which it is farthest.
pub(crate) fn standing_faces(faces: &[Part]) -> SmallVec<[Face; 8]> {
    /// Adds those of the tree that begins at a part. Returns how far the body is from that tree, and where
    /// the next one begins.
    fn of_tree(faces: &[Part], at: usize, found: &mut SmallVec<[Face; 8]>) -> (f64, usize) {
        let Some(part) = faces.get(at) else { return (f64::INFINITY, at) };
        match *part {
            Part::Face(face) => {
                found.push(face);
                (face.distance, at + 1)
            }
            Part::Any(parts) => (0..parts).fold((f64::INFINITY, at + 1), |(nearest, next), _| {
                let (distance, next) = of_tree(faces, next, found);
                (nearest.min(distance), next)
            }),
            Part::All(parts) => {
                let (mut farthest, mut next) = (f64::NEG_INFINITY, at + 1);
                let mut chosen = SmallVec::new();
                for _ in 0..parts {
                    let mut within = SmallVec::new();
                    let distance;
                    (distance, next) = of_tree(faces, next, &mut within);
                    if distance >= farthest {
                        (farthest, chosen) = (distance, within);
                    }
                }
                found.extend(chosen);
                (farthest, next)
            }
        }
    }
    let mut found = SmallVec::new();
    of_tree(faces, 0, &mut found);
    found
}

/// The face that is the obstacle's surface nearest to the point; `None` for a tree without faces. For an
/// intersection it is the farthest face, for a union the nearest.
pub(crate) fn surface_face(faces: &[Part]) -> Option<Face> {
    fn of_tree(faces: &[Part], at: &mut usize) -> Option<Face> {
        let part = *faces.get(*at)?;
        *at += 1;
        let (parts, all) = match part {
            Part::Face(face) => return Some(face),
            Part::All(parts) => (parts, true),
            Part::Any(parts) => (parts, false),
        };
        let mut chosen = of_tree(faces, at)?;
        for _ in 1..parts {
            let next = of_tree(faces, at)?;
            if (next.distance > chosen.distance) == all {
                chosen = next;
            }
        }
        Some(chosen)
    }
    of_tree(faces, &mut 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Below a cup a body touches its underside, however near the wall of its hollow is: it is behind the
    /// hollow's floor.
    #[test]
    fn of_a_cup_the_underside_stands_before_a_body_below() {
        let face = |distance: f64, normal: DVec3| Part::Face(Face { distance, normal, mean_curvature: 0.0 });
        let cup = [
            Part::All(2),
            face(0.01, -DVec3::Z),
            Part::Any(2),
            face(0.027, -DVec3::X),
            face(-0.07, DVec3::Z),
        ];
        let found = standing_faces(&cup);
        assert_eq!(found.iter().map(|face| face.distance).collect::<Vec<_>>(), [0.01]);
        assert_eq!(surface_face(&cup).map(|face| face.distance), Some(0.01));
    }
}
