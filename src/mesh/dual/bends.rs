//! Vertices over tight bends of a smooth surface, found together.
//!
//! Hits whose normals differ by more than a few degrees show a crease or a tight bend. The search for a
//! crease takes dozens of evaluations one after another, and on a wavy surface nearly all cells only bend. So
//! all these vertices move onto the surface together first, and three signs say that the surface only bends
//! there: its normal below the vertex lies between those of the hits that differ most, while beside a crease
//! it would be one of them; beside the vertex it turns about as fast as it does on the way from hit to hit,
//! while over a crease it would turn at once; and the vertex stays in its cell.

use glam::DVec3;

use super::super::normals::{GradientColumns, unit};
use super::project::negligible;
use super::vertices::Hit;
use crate::field::Field;
use crate::geom::Aabb;

/// A vertex of a smooth surface that lies farther than this from its cell, in cells, is astray.
pub(super) const ASTRAY: f64 = 0.05;

/// Maximum number of steps of Newton's method.
const STEPS: usize = 6;

/// A step that needs no other after it, in cells.
const LAST_STEP: f64 = 1e-9;

/// The normals are compared this far beside a vertex, in cells.
const BESIDE: f64 = 0.05;

/// On a smooth surface the normal turns at most this many times as fast as on average from hit to hit.
const FASTER: f64 = 3.0;

/// Normals that differ by more than this (cosine) are not those of one bend that a cell can show.
const MOST: f64 = 0.0;

/// A cell over a crease or a bend.
#[derive(Debug, Clone)]
pub(super) struct Bent {
    pub cell: Aabb,
    /// Where the vertex begins: between the hits.
    pub start: DVec3,
    /// The two hits whose normals differ most.
    ends: [Hit; 2],
}

/// A vertex on a smooth surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settled {
    pub position: DVec3,
    pub normal: DVec3,
}

impl Bent {
    /// The cell with these hits. `None` if they face so differently that the surface has a crease, or nothing
    /// that the cell resolves.
    pub fn new(cell: Aabb, start: DVec3, hits: impl Iterator<Item = Hit> + Clone) -> Option<Self> {
        let mut ends = None;
        let mut least = f64::INFINITY;
        for (i, a) in hits.clone().enumerate() {
            for b in hits.clone().take(i) {
                let cosine = a.normal.dot(b.normal);
                if cosine < least {
                    (least, ends) = (cosine, Some([a, b]));
                }
            }
        }
        // a hit without a normal has the cosine 0
        ends.filter(|_| least > MOST).map(|ends| Self { cell, start, ends })
    }

    /// The cosine of half the way from the mean of the normals to either of them.
    fn half_way(&self) -> f64 {
        let [a, b] = self.ends.map(|hit| hit.normal);
        // cos(θ/4) from cos θ
        let half = (0.5 * (1.0 + a.dot(b))).sqrt();
        (0.5 * (1.0 + half)).sqrt()
    }

    /// Whether the normal lies between those of the ends.
    fn is_between(&self, normal: DVec3) -> bool {
        let [a, b] = self.ends.map(|hit| hit.normal);
        unit(a + b).is_some_and(|mean| mean.dot(normal) > self.half_way())
    }

    /// The direction in the tangent plane in which the normal turns most.
    fn along(&self, normal: DVec3) -> Option<DVec3> {
        let change = self.ends[1].normal - self.ends[0].normal;
        unit(change - normal * normal.dot(change))
    }

    /// Whether the normals at both probes differ as on a bend.
    fn turns_slowly(&self, [before, after]: [DVec3; 2], size: f64) -> bool {
        let [a, b] = self.ends;
        let way = a.position.distance(b.position);
        let turn = a.normal.distance(b.normal) * (2.0 * BESIDE * size / way);
        before.distance(after) <= FASTER * turn
    }
}

/// The vertices of bent cells on the surface; `None` for those over which it may have a crease. `count` counts
/// evaluations.
pub(super) fn settle(
    field: &dyn Field,
    bends: &[Bent],
    size: f64,
    gradients: &mut GradientColumns,
    count: &mut u64,
) -> Vec<Option<Settled>> {
    let mut settled: Vec<Option<Settled>> = vec![None; bends.len()];
    let mut at: Vec<DVec3> = bends.iter().map(|bend| bend.start).collect();
    let mut moving: Vec<usize> = (0..bends.len()).collect();
    for _ in 0..STEPS {
        if moving.is_empty() {
            break;
        }
        let positions: Vec<DVec3> = moving.iter().map(|&i| at[i]).collect();
        *count += positions.len() as u64;
        let mut found = gradients.at(field, &positions);
        moving.retain(|&i| {
            let Some((omega, gradient)) = found.next() else { return false };
            let step = gradient * (omega / gradient.length_squared());
            at[i] -= step;
            let margin = ASTRAY * bends[i].cell.size();
            let Aabb { min, max } = bends[i].cell;
            if !(at[i].cmpge(min - margin) & at[i].cmple(max + margin)).all() {
                return false; // NaN, too
            }
            let stays = step.length() > negligible(LAST_STEP, size, at[i]);
            if !stays {
                let normal = unit(-gradient).filter(|normal| bends[i].is_between(*normal));
                settled[i] = normal.map(|normal| Settled { position: at[i], normal });
            }
            stays
        });
    }
    keep_smooth(field, bends, size, gradients, (&mut settled, count));
    settled
}

/// Forgets the vertices beside which the surface turns as over a crease.
fn keep_smooth(
    field: &dyn Field,
    bends: &[Bent],
    size: f64,
    gradients: &mut GradientColumns,
    (settled, count): (&mut [Option<Settled>], &mut u64),
) {
    let mut probes = Vec::new();
    for (vertex, bend) in settled.iter_mut().zip(bends) {
        let along = vertex.and_then(|vertex| Some((vertex.position, bend.along(vertex.normal)?)));
        match along {
            Some((p, along)) => probes.extend([-BESIDE, BESIDE].map(|share| p + share * size * along)),
            None => *vertex = None,
        }
    }
    *count += probes.len() as u64;
    let mut found = gradients.at(field, &probes).map(|(_, gradient)| unit(-gradient));
    for (vertex, bend) in settled.iter_mut().zip(bends).filter(|(vertex, _)| vertex.is_some()) {
        let normals = found.next().flatten().zip(found.next().flatten());
        if !normals.is_some_and(|(before, after)| bend.turns_slowly([before, after], size)) {
            *vertex = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    const CELL: Aabb = Aabb { min: DVec3::ZERO, max: DVec3::ONE };

    fn settled(field: &dyn Field, hits: [(DVec3, DVec3); 4]) -> Option<Settled> {
        let mean = hits.iter().map(|(position, _)| position).sum::<DVec3>() / 4.0;
        let hits = hits.map(|(position, normal)| Hit { position, normal, is_cap: false });
        let bend = Bent::new(CELL, mean, hits.into_iter())?;
        settle(field, &[bend], 1.0, &mut GradientColumns::default(), &mut 0).pop().flatten()
    }

    /// The hits of a surface with the profile z(x) on the upright sides of the cell.
    fn over(height: impl Fn(f64) -> f64, normal: impl Fn(f64) -> DVec3) -> [(DVec3, DVec3); 4] {
        [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
            .map(|(x, y)| (DVec3::new(x, y, height(x)), normal(x)))
    }

    #[test]
    fn a_round_back_is_settled_and_a_ridge_is_not() {
        // a cylinder along y whose normals turn by 53° over the cell
        let centre = DVec3::new(0.5, 0.0, -0.5);
        let axis = |p: DVec3| DVec3::new(p.x, 0.0, p.z) - centre;
        let round = Closures {
            omega: move |p: DVec3| 1.25 - axis(p).length_squared(),
            gradient: move |p: DVec3| -2.0 * axis(p),
        };
        let height = |x: f64| -0.5 + (1.25 - (x - 0.5_f64).powi(2)).sqrt();
        let hits = over(height, |x| axis(DVec3::new(x, 0.0, height(x))).normalize());
        let found = settled(&round, hits).unwrap();
        assert!(found.position.distance(DVec3::new(0.5, 0.5, 1.25_f64.sqrt() - 0.5)) < 1e-9, "{found:?}");
        assert!(found.normal.distance(DVec3::Z) < 1e-9);

        // two roofs that meet at the middle, and beside it
        for ridge in [0.5, 0.7] {
            let side = move |p: DVec3| DVec3::new(if p.x < ridge { -1.0 } else { 1.0 }, 0.0, 2.0);
            let top = move |x: f64| 0.8 - 0.5 * (x - ridge).abs();
            let roof =
                Closures { omega: move |p: DVec3| 2.0 * (top(p.x) - p.z), gradient: move |p| -side(p) };
            let hits = over(top, |x| side(x * DVec3::X).normalize());
            assert!(settled(&roof, hits).is_none(), "{ridge}");
        }
    }
}
