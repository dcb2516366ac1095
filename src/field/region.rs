//! The volume of what several fields leave free of a shape.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    Field,
    cut::{cut, is_inside},
};
use crate::geom::Aabb;
use crate::interval::Interval;

/// Halvings of a region's box along each axis: 128 cells along a side. The volume of a ball comes out to 1e-4.
const HALVINGS: u32 = 7;

/// The points of a box that lie in a shape and in none of several bodies.
pub(crate) struct Region<'a> {
    /// Positive in the shape.
    pub shape: &'a dyn Field,
    /// Positive in the bodies.
    pub bodies: Vec<&'a dyn Field>,
    pub within: Aabb,
}

/// The shape of a region that fills its box.
pub(crate) struct Everywhere;

impl Field for Everywhere {
    fn omega(&self, _: DVec3) -> f64 {
        1.0
    }

    fn omega_grad(&self, _: DVec3) -> (f64, DVec3) {
        (1.0, DVec3::ZERO)
    }

    fn range(&self, _: &Aabb) -> Interval {
        Interval::point(1.0)
    }
}

/// Whether a box is empty, or so thin that rounding alone may have left it: what lies in it has no volume.
pub fn is_flat(within: &Aabb) -> bool {
    within.is_empty() || within.size().min_element() <= FLAT * within.size().max_element()
}

/// Thickness of a flat box over its width.
const FLAT: f64 = 1e-12;

impl Region<'_> {
    /// The volume, m³. Boxes that the ranges of the fields decide count as a whole; the others are halved, and those of
    /// the last size cut by the surface. A place where a field is undefined does not count.
    pub fn volume(&self) -> f64 {
        if is_flat(&self.within) {
            return 0.0;
        }
        let bodies: Vec<usize> = (0..self.bodies.len()).collect();
        self.volume_of(self.within, &bodies, HALVINGS)
    }

    /// The volume in a box, of whose bodies only some are near.
    fn volume_of(&self, within: Aabb, bodies: &[usize], halvings: u32) -> f64 {
        let shape = self.shape.range(&within);
        if shape.hi < 0.0 {
            return 0.0;
        }
        let mut near = Vec::new();
        for &k in bodies {
            let range = self.bodies[k].range(&within);
            if range.lo > 0.0 {
                return 0.0;
            }
            let is_clear = range.hi < 0.0;
            if !is_clear {
                near.push(k);
            }
        }
        if shape.lo > 0.0 && near.is_empty() {
            return within.volume();
        }
        if halvings == 1 {
            return self.volume_of_cells(within, &near);
        }
        let centre = within.centre();
        let parts = within.corners().map(|corner| Aabb::new(corner.min(centre), corner.max(centre)));
        // the sum keeps its order for any number of threads
        if halvings > 4 {
            let volumes: Vec<f64> =
                parts.into_par_iter().map(|part| self.volume_of(part, &near, halvings - 1)).collect();
            return volumes.into_iter().sum();
        }
        parts.into_iter().map(|part| self.volume_of(part, &near, halvings - 1)).sum()
    }

    /// The volume in the eight cells of a box. Ranges would decide most of them, too, but take longer than the values
    /// at the corners that cells share.
    fn volume_of_cells(&self, within: Aabb, near: &[usize]) -> f64 {
        let (min, centre, max) = (within.min, within.centre(), within.max);
        let at = |[i, j, k]: [usize; 3]| {
            DVec3::new([min.x, centre.x, max.x][i], [min.y, centre.y, max.y][j], [min.z, centre.z, max.z][k])
        };
        let values: [f64; 27] =
            std::array::from_fn(|n| self.free(at([n % 3, n / 3 % 3, n / 9]), near.iter().copied()));
        let cell = |n: usize| {
            let low = [n % 2, n / 2 % 2, n / 4];
            let corner = |m: usize| [low[0] + m % 2, low[1] + m / 2 % 2, low[2] + m / 4];
            let values: [f64; 8] = std::array::from_fn(|m| {
                let [i, j, k] = corner(m);
                values[i + 3 * j + 9 * k]
            });
            self.volume_of_cell(Aabb::new(at(corner(0)), at(corner(7))), values, near)
        };
        (0..8).map(cell).sum()
    }

    /// The volume in a cell, with the values at its corners, near which are some of the bodies.
    fn volume_of_cell(&self, within: Aabb, values: [f64; 8], near: &[usize]) -> f64 {
        match values.map(is_inside) {
            inside if inside.iter().all(|is| *is) => within.volume(),
            inside if inside.iter().any(|is| *is) => {
                // a body that ends before the cell has no part in its surface
                let ends_before = |k: usize| self.bodies[k].range(&within).hi < 0.0;
                let near: Vec<usize> = near.iter().copied().filter(|&k| !ends_before(k)).collect();
                let omega = |p: DVec3| self.free(p, near.iter().copied());
                let corners = within.corners();
                cut(&corners, &corners.map(omega), &omega).inside
            }
            _ => 0.0,
        }
    }

    /// Positive in the shape and in none of these bodies.
    fn free(&self, p: DVec3, bodies: impl Iterator<Item = usize>) -> f64 {
        bodies.map(|k| -self.bodies[k].omega(p)).fold(self.shape.omega(p), f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    fn ball(centre: DVec3, radius: f64) -> impl Field {
        Closures {
            omega: move |p: DVec3| radius * radius - p.distance_squared(centre),
            gradient: move |p: DVec3| 2.0 * (centre - p),
        }
    }

    #[test]
    fn volumes_of_balls_and_what_they_leave() {
        let of_ball = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        let (shape, body) = (ball(DVec3::ZERO, 1.0), ball(DVec3::new(0.1, 0.2, 0.0), 0.5));
        let within = Aabb::new(DVec3::splat(-1.1), DVec3::new(1.1, 1.2, 1.3));
        let whole = Region { shape: &shape, bodies: Vec::new(), within }.volume();
        assert!((whole / of_ball(1.0) - 1.0).abs() < 2e-4, "{whole}");
        let free = Region { shape: &shape, bodies: vec![&body], within }.volume();
        assert!((free / (of_ball(1.0) - of_ball(0.5)) - 1.0).abs() < 3e-4, "{free}");
        let all = Region { shape: &Everywhere, bodies: vec![&body], within }.volume();
        assert!((all / (within.volume() - of_ball(0.5)) - 1.0).abs() < 1e-4, "{all}");
        let half = Aabb::new(DVec3::splat(-1.1), DVec3::new(1.1, 1.1, 0.0));
        let below = Region { shape: &shape, bodies: Vec::new(), within: half }.volume();
        assert!((below / (0.5 * of_ball(1.0)) - 1.0).abs() < 2e-4, "{below}");
    }
}
