//! The plane that cuts an obstacle open.

use glam::DVec3;

/// A plane that cuts a mesh open: the part on the side of its normal is not drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// The unit normal of the plane, towards the side that is cut away.
    pub normal: DVec3,
    /// The distance of the plane from the origin along its normal, in metres.
    pub offset: f64,
}

impl Cut {
    /// How far a point lies beyond the plane; negative where the mesh stays.
    pub fn beyond(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
}
