//! The surface near a point as faces, and how they are joined: what walls without wall particles are made of.

use glam::DVec3;
use smallvec::SmallVec;

/// A piece of surface, seen from a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// Of the point from the face, positive in the fluid.
    pub distance: f64,
    /// Outward unit normal at the nearest place.
    pub normal: DVec3,
    /// Positive where the obstacle is convex, 1/length.
    pub mean_curvature: f64,
}

/// A node of a tree of faces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Part {
    /// The obstacle lies behind the face.
    Face(Face),
    /// It is what the next so many trees have in common: an edge that stands out.
    All(u32),
    /// It is what belongs to any of the next so many trees: an edge that reaches in.
    Any(u32),
}

/// A tree in prefix order: a node is followed by its parts. Empty: no surface is near.
pub type Faces = SmallVec<[Part; 16]>;
