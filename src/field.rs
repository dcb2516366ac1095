//! The interface between obstacles and what uses them: a function ω(x, y, z), its gradient, and its range
//! over a box.
//!
//! Sign convention everywhere: **ω > 0 inside the obstacle, 0 on its surface, < 0 in the fluid**; the outward
//! unit normal is n = −∇ω/|∇ω|.
//!
//! Invariant: nothing here knows that a compiler exists, so a closure can stand in for a compiled solid.

mod cut;
mod faces;
mod path;
mod region;
mod walls;

use glam::DVec3;

use crate::{geom::Aabb, interval::Interval};

pub(crate) use cut::{Cut, cut, is_inside};
pub use faces::{Face, Faces, Part};
pub(crate) use faces::{standing_faces, surface_face};
pub use path::{Entry, Normals, Path, last_outside};
pub(crate) use region::{Everywhere, Region, is_flat};
pub(crate) use walls::clearance_by_ranges;
pub use walls::{Moving, Still, Walls, search_path};

/// Borrowed points as a structure of arrays; the three slices have one length.
#[derive(Debug, Clone, Copy)]
pub struct Points<'a> {
    /// x coordinates, in the scene's unit of length.
    pub x: &'a [f64],
    /// y coordinates, in the scene's unit of length.
    pub y: &'a [f64],
    /// z coordinates, in the scene's unit of length.
    pub z: &'a [f64],
}

impl<'a> Points<'a> {
    /// Borrows three slices as points.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn new(x: &'a [f64], y: &'a [f64], z: &'a [f64]) -> Self {
        assert!(x.len() == y.len() && y.len() == z.len(), "coordinate slices differ in length");
        Self { x, y, z }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Point `i`.
    ///
    /// # Panics
    /// If there are not more than `i` points.
    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.x[i], self.y[i], self.z[i])
    }
}

/// Slices that receive ω and ∇ω of many points. Each is as long as the points.
#[derive(Debug)]
pub struct GradientsMut<'a> {
    /// ω, positive inside.
    pub omega: &'a mut [f64],
    /// ∂ω/∂x. Where ω is near zero, the gradient (`x`, `y`, `z`) points into the obstacle.
    pub x: &'a mut [f64],
    /// ∂ω/∂y.
    pub y: &'a mut [f64],
    /// ∂ω/∂z.
    pub z: &'a mut [f64],
}

/// A face that may be part of the surface in a box.
pub struct Sheet<'a> {
    /// Encloses the gradient that ω has in the box where this face decides: it points inwards.
    pub slopes: [Interval; 3],
    /// ω and ∇ω at a point where this face decides; elsewhere the function that belongs to the face.
    pub at: &'a dyn Fn(DVec3) -> (f64, DVec3),
}

/// A scalar field over space: positive inside an obstacle, negative in the fluid.
///
/// Implementations are pure: the same point gives the same bits on every thread. Non-finite coordinates
/// give NaN, never "outside".
pub trait Field: Send + Sync {
    /// ω at a point.
    fn omega(&self, p: DVec3) -> f64;

    /// ω and ∇ω at a point. At corners and edges ∇ω is one finite member of its limits there, never NaN.
    fn omega_grad(&self, p: DVec3) -> (f64, DVec3);

    /// ω at many points, written to `omega`, which is as long as `points`. Allocates nothing and runs on the
    /// calling thread.
    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        for (i, w) in omega.iter_mut().enumerate() {
            *w = self.omega(points.get(i));
        }
    }

    /// ω and ∇ω at many points. Allocates nothing and runs on the calling thread.
    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        for i in 0..points.len() {
            let (w, g) = self.omega_grad(points.get(i));
            (out.omega[i], out.x[i], out.y[i], out.z[i]) = (w, g.x, g.y, g.z);
        }
    }

    /// ω at a point, continuous in space. It has the sign of `omega` everywhere. The two differ only where an
    /// implementation keeps no more of ω than its sign and zero set: that is enough to find roots, but not to
    /// interpolate.
    fn continuous(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    /// [`continuous`](Self::continuous) at many points, written to `omega`, which is as long as `points`.
    fn continuous_many(&self, points: Points<'_>, omega: &mut [f64]) {
        for (i, w) in omega.iter_mut().enumerate() {
            *w = self.continuous(points.get(i));
        }
    }

    /// An interval that contains ω of every point of the box. The default knows nothing and returns
    /// [`Interval::ALL`].
    fn range(&self, _over: &Aabb) -> Interval {
        Interval::ALL
    }

    /// Visits the faces that may be part of the surface in a box, and may visit others. Returns whether they
    /// are all; the default knows none.
    fn sheets(&self, _over: &Aabb, _visit: &mut dyn FnMut(Sheet<'_>)) -> bool {
        false
    }
}

impl<F: Field + ?Sized> Field for &F {
    fn omega(&self, p: DVec3) -> f64 {
        (**self).omega(p)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        (**self).omega_grad(p)
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        (**self).omega_many(points, omega);
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        (**self).omega_grad_many(points, out);
    }

    fn continuous(&self, p: DVec3) -> f64 {
        (**self).continuous(p)
    }

    fn continuous_many(&self, points: Points<'_>, omega: &mut [f64]) {
        (**self).continuous_many(points, omega);
    }

    fn range(&self, over: &Aabb) -> Interval {
        (**self).range(over)
    }

    fn sheets(&self, over: &Aabb, visit: &mut dyn FnMut(Sheet<'_>)) -> bool {
        (**self).sheets(over, visit)
    }
}

/// A field made of two closures, for tests and for callers with formulas of their own.
#[derive(Debug, Clone, Copy)]
pub struct Closures<V, G> {
    /// Point → ω.
    pub omega: V,
    /// Point → ∇ω. It is finite everywhere, also where the formula has an edge.
    pub gradient: G,
}

impl<V, G> Field for Closures<V, G>
where
    V: Fn(DVec3) -> f64 + Send + Sync,
    G: Fn(DVec3) -> DVec3 + Send + Sync,
{
    fn omega(&self, p: DVec3) -> f64 {
        (self.omega)(p)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        ((self.omega)(p), (self.gradient)(p))
    }
}
