//! Which obstacle does what of all that walls do to a particle.

use glam::{DMat3, DVec3};
use smallvec::SmallVec;

use super::{boundary::Boundary, coverage::Coverage, kernel::Wall};

/// Beside walls along their normals, walls share equally in a force along them by this part of it.
const ALONG: f64 = 1e-3;

/// A wall near a particle.
struct Near {
    /// Its number; `None` for the box.
    obstacle: Option<usize>,
    /// What it takes of the kernel.
    part: f64,
    /// ∇λ, 1/m.
    gradient: DVec3,
}

impl Boundary {
    /// Divides the acceleration of a particle by all walls, m/s², among the obstacles near it, and tells the acceleration by
    /// each. A factor times ∇λ, m²/s², is the part that acts in each wall's own direction.
    ///
    /// The rest, by which forces are completed at walls, is divided by the walls' normals: in a corner each wall has what
    /// acts along its own. All shares, that of the box included, add up to the whole.
    pub fn divide(
        &self,
        wall: &Wall,
        p: DVec3,
        acceleration: DVec3,
        factor: f64,
        mut tell: impl FnMut(usize, DVec3),
    ) {
        let near = self.near(wall, p);
        if let [only] = &near[..] {
            if let Some(obstacle) = only.obstacle {
                tell(obstacle, acceleration);
            }
            return;
        }
        let together: DVec3 = near.iter().map(|near| near.gradient).sum();
        let weights: SmallVec<[DMat3; 4]> = near.iter().map(Near::weight).collect();
        let all = weights.iter().fold(DMat3::ZERO, |all, weight| all + *weight);
        let rest = all.inverse() * (acceleration - factor * together);
        for (near, weight) in near.iter().zip(weights) {
            if let Some(obstacle) = near.obstacle {
                tell(obstacle, factor * near.gradient + weight * rest);
            }
        }
    }

    /// The walls within reach of a particle that at least one wall is near.
    fn near(&self, wall: &Wall, p: DVec3) -> SmallVec<[Near; 4]> {
        let near = |obstacle: Option<usize>, coverage: &Coverage<()>| Near {
            obstacle,
            part: coverage.part,
            gradient: coverage.gradient,
        };
        let mut found: SmallVec<[Near; 4]> = SmallVec::new();
        let of_box = self.of_box::<()>(wall, p);
        if of_box.part > 0.0 {
            found.push(near(None, &of_box));
        }
        if found.is_empty() && self.obstacles.len() == 1 {
            found.push(near(Some(0), &Coverage::default()));
            return found;
        }
        for k in 0..self.obstacles.len() {
            let coverage = self.with_faces(wall, p, Coverage::<()>::default(), k);
            if coverage.part > 0.0 {
                found.push(near(Some(k), &coverage));
            }
        }
        found
    }
}

impl Near {
    /// λ·(n⊗n), and a little in all directions.
    fn weight(&self) -> DMat3 {
        let n = self.gradient.normalize_or_zero();
        let along = DMat3::from_cols(n.x * n, n.y * n, n.z * n);
        self.part * (along + ALONG * DMat3::IDENTITY)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::{
        field::Closures,
        geom::Aabb,
        sph::{
            scales::Slip,
            walls::{Obstacle, WallKernel, volume::Maps},
        },
    };

    /// A box with a floor at z = 0 and two blocks, that end at x = 0 and begin at x = `gap`.
    fn boundary(gap: f64) -> Boundary {
        let left = Closures { omega: |p: DVec3| -p.x, gradient: |_: DVec3| -DVec3::X };
        let right = Closures { omega: move |p: DVec3| p.x - gap, gradient: |_: DVec3| DVec3::X };
        let obstacles: Vec<Obstacle> =
            vec![Obstacle::at_rest(Arc::new(left), 0.01), Obstacle::at_rest(Arc::new(right), 0.01)];
        Boundary {
            domain: Aabb::new(DVec3::new(-5.0, -5.0, 0.0), DVec3::splat(5.0)),
            wall_restitution: 0.0,
            wall_friction: 0.0,
            slip: Slip::Free,
            obstacles,
            during: Vec::new(),
            time: 0.0,
            clearance: 1e-6,
            maps: Maps::new(&[], &Aabb::new(DVec3::ZERO, DVec3::ONE), 1.0, 0.0),
        }
    }

    fn shares(boundary: &Boundary, p: DVec3, acceleration: DVec3, factor: f64) -> [DVec3; 2] {
        let mut shares = [DVec3::ZERO; 2];
        let wall = Wall::new(WallKernel::WendlandC2, 1.0, 0.5);
        boundary.divide(&wall, p, acceleration, factor, |k, share| shares[k] += share);
        shares
    }

    #[test]
    fn one_wall_has_all() {
        let push = DVec3::new(3.0, 1.0, 2.0);
        assert_eq!(shares(&boundary(9.0), DVec3::new(0.2, 0.0, 2.0), push, -7.0), [push, DVec3::ZERO]);
    }

    #[test]
    fn in_a_corner_each_wall_has_what_acts_along_its_normal() {
        let [left, right] = shares(&boundary(9.0), DVec3::new(0.2, 0.0, 0.3), DVec3::new(3.0, 0.0, 5.0), 0.0);
        assert!((left.x - 3.0).abs() < 0.01 && left.z.abs() < 0.02, "{left}");
        assert_eq!(right, DVec3::ZERO);
    }

    #[test]
    fn between_two_walls_each_presses_by_itself() {
        // in the middle the pressure on both is the same, and the particle stays
        let [left, right] = shares(&boundary(1.0), DVec3::new(0.5, 0.0, 2.0), DVec3::ZERO, -4.0);
        assert!(left.x > 1.0 && (left + right).length() < 1e-12, "{left} {right}");
    }
}
