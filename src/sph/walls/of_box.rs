//! What the walls of the box take of kernels, and what they ask of the fluid before them.

use glam::DVec3;

use super::{
    behind::Behind,
    boundary::{Boundary, FLUSH},
    coverage::Coverage,
    friction::Friction,
    layers::Wall,
};
use crate::{field::Face, geom::Aabb, sph::Slip};

impl Boundary {
    /// The walls of the box as faces before a place, each with the axis that it lies across.
    fn box_faces(&self, p: DVec3) -> impl Iterator<Item = (usize, Face)> {
        let Aabb { min, max } = self.domain;
        (0..3).flat_map(move |axis| {
            let face = |distance: f64, side: f64| {
                let mut normal = DVec3::ZERO;
                normal[axis] = side;
                (axis, Face { distance, normal, mean_curvature: 0.0 })
            };
            [face(p[axis] - min[axis], 1.0), face(max[axis] - p[axis], -1.0)]
        })
    }

    /// What the walls of the box take of the kernel of a particle.
    pub(super) fn of_box<F: Friction, B: Behind>(&self, wall: &Wall, p: DVec3) -> Coverage<F, B> {
        let mut whole = Coverage::<F, B>::default();
        for (_, face) in self.box_faces(p).filter(|(_, face)| face.distance < wall.h) {
            let face = Coverage::of_face(wall, &face);
            // most particles near walls have one wall near them
            if whole.part == 0.0 {
                whole = face;
            } else {
                whole = whole.or(&face);
            }
        }
        if self.slip == Slip::Free {
            whole.let_slip();
        }
        whole
    }

    /// For each axis the K along it of the walls of the box that lie across it, see [`Coverage::tensor`]. A wall
    /// behind an obstacle has none: what is before a particle there is the obstacle.
    pub fn box_moments(&self, wall: &Wall, p: DVec3) -> DVec3 {
        let mut moments = DVec3::ZERO;
        for (axis, face) in self.box_faces(p).filter(|(_, face)| face.distance < wall.h) {
            let before = p - (face.distance - FLUSH * wall.h) * face.normal;
            let hidden = self.broad_phase.at(p).any(|k| self.field(k).omega(before) >= 0.0);
            if !hidden {
                let tensor = Coverage::<()>::of_face(wall, &face).tensor().to_matrix();
                moments[axis] += face.normal.dot(tensor * face.normal);
            }
        }
        moments
    }
}
