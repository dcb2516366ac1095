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

/// A wall of which less than this part is bare counts as covered: maps know λ to some parts in a thousand.
const LEAST_BARE: f64 = 0.01;

/// A cover of less than this part of a wall is left to the angle between wall and obstacle.
const LEAST_COVER: f64 = 0.5;

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

    /// The walls of the box that are nearer to a place than the support radius and not behind a moving obstacle: their
    /// normals into the box, and distances, m.
    pub fn box_planes(&self, wall: &Wall, p: DVec3) -> impl Iterator<Item = (DVec3, f64)> {
        self.box_faces(p)
            .filter(move |(_, face)| face.distance < wall.h && self.bare(wall, p, face) > 0.5)
            .map(|(_, face)| (face.normal, face.distance))
    }

    /// What the walls of the box take of the kernel of a particle, without that of obstacles.
    pub fn coverage_by_box(&self, wall: &Wall, p: DVec3) -> Coverage {
        self.of_box(wall, p)
    }

    /// How much of a wall of the box before a particle counts beside moving obstacles, 0 to 1.
    ///
    /// A vessel that moves may have its floor in the wall or before it. What is behind the wall is then the vessel's
    /// own, and the wall adds nothing. (As two walls, they took too much wherever the vessel's own walls meet, and
    /// water at rest boiled. Obstacles at rest end at the box, see [`Coverage::with_bodies`].)
    ///
    /// An obstacle takes the part b of a ball of the size of a kernel that touches the wall from behind, and a of the
    /// kernel. It covers (b − a)/(1 − a) of the wall: all where b is 1, and nothing where it crosses the wall, because
    /// there a and b are the same. Of that, the first half is left to the angle between wall and obstacle, by which the
    /// two are joined. (With b itself in its place the water over a floor that rises was 1.1 % too dense.)
    fn bare(&self, wall: &Wall, p: DVec3, face: &Face) -> f64 {
        if !self.maps.any_moves() {
            return 1.0;
        }
        let behind = p - (face.distance + wall.h) * face.normal;
        let covered = |k: usize| {
            let there = self.maps.part_of_moving(k, behind);
            if there <= LEAST_COVER {
                return 0.0;
            }
            let here = self.maps.part_of_moving(k, p);
            let more = if here < there { (there - here) / (1.0 - here) } else { 0.0 };
            ((more - LEAST_COVER) / (1.0 - LEAST_COVER)).clamp(0.0, 1.0)
        };
        let bare: f64 = self.broad_phase.at(p).map(|k| 1.0 - covered(k)).product();
        if bare < LEAST_BARE { 0.0 } else { bare }
    }

    /// What the walls of the box take of the kernel of a particle beside moving obstacles.
    pub(super) fn of_box<F: Friction, B: Behind>(&self, wall: &Wall, p: DVec3) -> Coverage<F, B> {
        self.of_box_with(wall, p, |face| self.bare(wall, p, face))
    }

    /// What the walls of the box take of the kernel of a particle, with those behind obstacles.
    pub(super) fn of_whole_box<F: Friction, B: Behind>(&self, wall: &Wall, p: DVec3) -> Coverage<F, B> {
        self.of_box_with(wall, p, |_| 1.0)
    }

    fn of_box_with<F: Friction, B: Behind>(
        &self,
        wall: &Wall,
        p: DVec3,
        bare: impl Fn(&Face) -> f64,
    ) -> Coverage<F, B> {
        let mut whole = Coverage::<F, B>::default();
        for (_, face) in self.box_faces(p).filter(|(_, face)| face.distance < wall.h) {
            let bare = bare(&face);
            if bare == 0.0 {
                continue;
            }
            let mut face = Coverage::of_face(wall, &face);
            if bare < 1.0 {
                face = face.in_part(bare);
            }
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
                moments[axis] += self.bare(wall, p, &face) * face.normal.dot(tensor * face.normal);
            }
        }
        moments
    }
}
