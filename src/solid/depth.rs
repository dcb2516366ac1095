//! A solid as its signed depth: what meshes are measured against.

use glam::DVec3;

use super::cells::map::CellMap;
use super::construction::Solid;
use crate::field::{Field, GradientsMut, Points};
use crate::geom::Aabb;

/// The depth below a solid's surface, m, as a [`Field`]: minus the distance of [`Solid::contact`], so
/// positive inside, with minus the outward unit normal as its gradient.
///
/// Exact near quadrics whatever the scales of the leaves, where ω only has the right sign; Newton's method on
/// it reaches the surface after a step or two.
///
/// ```
/// use rfm::{Engine, Field, Program, glam::DVec3, solid::Depth};
///
/// let program = Program::from_source("ball.rfm", "rfm 1\nsolid ball = ball([0, 0, 0], 2)")?;
/// let ball = program.solid_with("ball", Engine::Auto)?;
/// let (depth, gradient) = Depth(&ball).omega_grad(DVec3::new(1.5, 0.0, 0.0));
/// assert!((depth - 0.5).abs() < 1e-12 && (gradient + DVec3::X).length() < 1e-12);
/// # Ok::<(), rfm::Error>(())
/// ```
pub struct Depth<'a>(pub &'a Solid);

/// Points whose contacts are asked for at a time: the curvatures, which are not needed, then lie on the
/// stack.
const BATCH: usize = 256;

impl Field for Depth<'_> {
    fn omega(&self, p: DVec3) -> f64 {
        -self.0.contact(p).distance
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let contact = self.0.contact(p);
        (-contact.distance, -contact.normal)
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        let mut unused = [0.0; BATCH];
        let GradientsMut { omega, x, y, z } = out;
        for start in (0..points.len()).step_by(BATCH) {
            let run = start..points.len().min(start + BATCH);
            let at = [points.x, points.y, points.z].map(|column| &column[run.clone()]);
            let curvature = &mut unused[..run.len()];
            let (omega, x) = (&mut omega[run.clone()], &mut x[run.clone()]);
            let (y, z) = (&mut y[run.clone()], &mut z[run.clone()]);
            self.0.contact_many(at, [omega, x, y, z, curvature]);
        }
        for column in [omega, x, y, z] {
            column.iter_mut().for_each(|value| *value = -*value);
        }
    }
}

impl Solid {
    /// A field with the same surface as [`Depth`] in a box, and the same distances within `reach` of that surface: [`Depth`] itself
    /// for a few leaves, and for many a [`CellMap`], which asks only those that have a zero near a place. It is made for
    /// points that lie near the surface; elsewhere it costs as much as [`Depth`].
    pub fn depth(&self, over: Aabb, reach: f64) -> Box<dyn Field + '_> {
        match if self.has_many_leaves() { CellMap::with_reach(self, over, reach) } else { None } {
            Some(map) => Box::new(MappedDepth { all: Depth(self), map }),
            None => Box::new(Depth(self)),
        }
    }
}

/// [`Depth`] by the leaves that matter within a map's reach.
struct MappedDepth<'a> {
    all: Depth<'a>,
    map: CellMap,
}

impl MappedDepth<'_> {
    /// The depth and its gradient, if the map knows the surface around a point.
    fn near(&self, p: DVec3) -> Option<(f64, DVec3)> {
        let contact = self.map.contact(p);
        // where the derivatives say nothing the distance is 0 off the surface, too
        let is_known = contact.distance.is_finite() && (contact.distance != 0.0 || self.map.sign(p) == 0.0);
        is_known.then_some((-contact.distance, -contact.normal))
    }
}

impl Field for MappedDepth<'_> {
    fn omega(&self, p: DVec3) -> f64 {
        self.near(p).map_or_else(|| self.all.omega(p), |found| found.0)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        self.near(p).unwrap_or_else(|| self.all.omega_grad(p))
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        for i in 0..points.len() {
            let (omega, gradient) = self.omega_grad(points.get(i));
            (out.omega[i], out.x[i], out.y[i], out.z[i]) = (omega, gradient.x, gradient.y, gradient.z);
        }
    }
}
