//! The surface of an obstacle in pieces, as large as a third of the particles' spacing, where there is fluid
//! near.
//!
//! Boxes that the field's range proves to hold no surface are dropped, the others are halved, and those of
//! the last size cut by the surface ([`cut`]). A box whose corners lie on one side, but which may hold
//! surface by the range, is divided three times more, so that plates down to a 24th of the spacing count.

use glam::DVec3;

use crate::{
    field::{Cut, Faces, Part, Walls, cut, is_inside},
    geom::Aabb,
    interval::Interval,
};

/// Greatest size of a piece, as a part of the particles' spacing.
const FINENESS: f64 = 1.0 / 3.0;

/// Halvings beyond the size of a piece, in search of thin parts.
const DEEPER: u32 = 3;

/// A piece of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Its middle, m.
    pub at: DVec3,
    /// Its area times its normal out of the obstacle, m².
    pub area: DVec3,
}

/// Finds the pieces of an obstacle's surface in a box.
pub(super) struct Pieces<'a> {
    pub field: &'a dyn Walls,
    /// The particles' spacing, m.
    pub spacing: f64,
    pub found: Vec<Piece>,
}

impl Pieces<'_> {
    /// Adds the pieces of the surface in a box of about the support radius.
    pub fn find(&mut self, within: Aabb) {
        let halvings =
            (within.size().max_element() / (FINENESS * self.spacing)).log2().ceil().max(0.0) as u32;
        let knows = |over: &Aabb| self.field.range(over) != Interval::ALL;
        // a box with both signs may have no other range, and a point has one
        if knows(&within) || knows(&Aabb::new(within.centre(), within.centre())) {
            self.search(within, halvings, DEEPER);
        } else if self.may_hold_surface(&within) {
            // nothing is known of the field but its values
            self.search(within, halvings, 0);
        }
    }

    fn search(&mut self, within: Aabb, halvings: u32, deeper: u32) {
        let range = self.field.range(&within);
        if range.hi < 0.0 || range.lo > 0.0 {
            return;
        }
        if halvings > 0 {
            for part in eighths(&within) {
                self.search(part, halvings - 1, deeper);
            }
            return;
        }
        let corners = within.corners();
        let values = corners.map(|corner| self.field.omega(corner));
        let inside = values.map(is_inside);
        if inside.iter().any(|is| *is != inside[0]) {
            let Cut { area, middle, .. } = cut(&corners, &values, &|p| self.field.omega(p));
            self.found.push(Piece { at: middle, area });
        } else if deeper > 0 {
            for part in eighths(&within) {
                self.search(part, 0, deeper - 1);
            }
        }
    }

    /// Whether a box may hold surface by the distances of the faces that are seen from its middle.
    fn may_hold_surface(&self, within: &Aabb) -> bool {
        let reach = within.size().length();
        let mut faces = Faces::new();
        self.field.faces(within.centre(), reach, &mut faces);
        faces.iter().any(|part| matches!(part, Part::Face(face) if face.distance.abs() < reach))
    }
}

fn eighths(whole: &Aabb) -> [Aabb; 8] {
    let centre = whole.centre();
    whole.corners().map(|corner| Aabb::new(corner.min(centre), corner.max(centre)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Closures, Field};
    use crate::interval::Interval;
    use crate::sph::scenes;

    const SPACING: f64 = 0.1;

    fn pieces(field: &dyn Walls, within: Aabb) -> Vec<Piece> {
        let mut pieces = Pieces { field, spacing: SPACING, found: Vec::new() };
        pieces.find(within);
        pieces.found
    }

    #[test]
    fn a_ball_has_its_area_and_its_volume() {
        let (centre, radius) = (DVec3::new(0.1, 0.05, -0.02), 0.3);
        let found =
            pieces(&*scenes::sphere(centre, radius), Aabb::new(DVec3::splat(-0.5), DVec3::splat(0.5)));
        let area: f64 = found.iter().map(|piece| piece.area.length()).sum();
        let volume: f64 = found.iter().map(|piece| piece.area.dot(piece.at - centre) / 3.0).sum();
        let closed: DVec3 = found.iter().map(|piece| piece.area).sum();
        // planes for a sphere, with edges of a ninth of the radius and their diagonals
        let exact = 4.0 * std::f64::consts::PI * radius * radius;
        assert!((area / exact - 1.0).abs() < 5e-3, "{area} {exact}");
        assert!((volume / (exact * radius / 3.0) - 1.0).abs() < 5e-3, "{volume}");
        assert!(closed.length() < 1e-3 * area, "{closed}");
    }

    /// A plate of 5 mm, a twentieth of the spacing, which knows its range.
    struct Plate;

    impl Field for Plate {
        fn omega(&self, p: DVec3) -> f64 {
            0.0025 - (p.z - 0.4).abs()
        }

        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            (self.omega(p), DVec3::new(0.0, 0.0, -(p.z - 0.4).signum()))
        }

        fn range(&self, over: &Aabb) -> Interval {
            let ends = [self.omega(over.min), self.omega(over.max)];
            let within = (over.min.z..=over.max.z).contains(&0.4);
            let hi = if within { 0.0025 } else { ends[0].max(ends[1]) };
            Interval::new(ends[0].min(ends[1]), hi)
        }
    }

    impl Walls for Plate {}

    #[test]
    fn closures_and_thin_plates_have_surfaces() {
        let within = Aabb::new(DVec3::ZERO, DVec3::ONE);
        let floor = Closures { omega: |p: DVec3| 0.31 - p.z, gradient: |_: DVec3| -DVec3::Z };
        let up: DVec3 = pieces(&floor, within).iter().map(|piece| piece.area).sum();
        assert!((up - DVec3::Z).length() < 1e-12, "{up}");
        let found = pieces(&Plate, within);
        let (above, below): (Vec<Piece>, Vec<Piece>) = found.iter().partition(|piece| piece.area.z > 0.0);
        for (side, sign) in [(above, 1.0), (below, -1.0)] {
            let area: DVec3 = side.iter().map(|piece| piece.area).sum();
            assert!((area.z - sign).abs() < 1e-9, "{area}");
        }
    }
}
