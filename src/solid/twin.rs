//! The min/max twin of a solid: its sign at a fraction of the cost, and where paths meet it.

use glam::DVec3;

use super::construction::Solid;
use super::engine::ProgramKind;
use super::path::sweep::Sweep;
use crate::field::{Entry, Faces, Field, GradientsMut, Path, Points, Sheet, Walls, search_path};
use crate::geom::Aabb;
use crate::interval::Interval;

/// The min/max twin of a solid, see [`Solid::twin`].
#[derive(Debug, Clone)]
pub struct Twin {
    solid: Solid,
}

impl Solid {
    /// The min/max twin as a field of its own: the sign and zero set of ω at a fraction of the cost, and on
    /// the surface the gradient of the one leaf that it lies on.
    pub fn twin(&self) -> Twin {
        Twin { solid: self.clone() }
    }
}

impl Field for Twin {
    #[inline]
    fn omega(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.solid.evaluate(ProgramKind::Sign, p.to_array(), &mut out);
        out[0]
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.solid.evaluate(ProgramKind::SignGradient, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.solid.twin_many([points.x, points.y, points.z], omega);
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        let columns = [out.omega, out.x, out.y, out.z];
        self.solid.evaluate_many(ProgramKind::SignGradient, [points.x, points.y, points.z], columns);
    }

    fn range(&self, over: &Aabb) -> Interval {
        let Solid { inner, moment } = &self.solid;
        self.solid.twin_function().range(inner.engine, over, moment, true)
    }

    fn sheets(&self, over: &Aabb, visit: &mut dyn FnMut(Sheet<'_>)) -> bool {
        let Some(parts) = self.solid.parts() else { return false };
        parts.leaves.sheets(&parts.words, over, &mut Vec::new(), visit);
        true
    }
}

impl Walls for Twin {
    fn on_path(&self, path: &Path, t: f64) -> f64 {
        self.solid.then(t).twin().omega(path.at(t))
    }

    fn wall_velocity(&self, p: DVec3) -> DVec3 {
        self.solid.wall_velocity(p)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        self.solid.faces(p, reach, faces);
    }

    fn first_entry(&self, path: &Path) -> Option<Entry> {
        let finite = path.from.is_finite() && path.to.is_finite();
        if finite && self.range(&path.hull(path.start, 1.0)).hi < 0.0 {
            return None; // nearly all paths end here
        }
        let Some(parts) = self.solid.parts() else { return search_path(self, path) };
        Sweep::new(&parts.leaves, path).first_entry(&parts.words, (path.start, 1.0))
    }
}
