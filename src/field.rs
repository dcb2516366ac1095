//! What a consumer knows of an obstacle: a function ω(x, y, z), its gradient and its range over a box.
//!
//! Sign convention everywhere: **ω > 0 inside the obstacle, 0 on its surface, < 0 in the fluid**; the outward
//! unit normal is n = −∇ω/|∇ω|.
//!
//! Invariant: nothing here knows that a compiler exists, so a closure can stand in for a compiled solid.

mod faces;
mod sweep;

use glam::DVec3;

use crate::{geom::Aabb, interval::Interval};

pub use faces::{Face, Faces, Part};
pub use sweep::{Entry, Normals, Path, last_outside, search_path};

/// Radii that [`Field::clearance`] tries, each half of the one before.
const CLEARANCES: u32 = 5;

/// Borrowed points as a structure of arrays; the three slices have one length.
#[derive(Debug, Clone, Copy)]
pub struct Points<'a> {
    /// In the scene's unit of length, as `y` and `z`.
    pub x: &'a [f64],
    /// See `x`.
    pub y: &'a [f64],
    /// See `x`.
    pub z: &'a [f64],
}

impl<'a> Points<'a> {
    /// Borrows three columns.
    ///
    /// # Panics
    /// If the slices differ in length: a bug of the caller, never of a file.
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

    /// Point `i`; panics beyond the last, as a slice does.
    pub fn get(&self, i: usize) -> DVec3 {
        DVec3::new(self.x[i], self.y[i], self.z[i])
    }
}

/// Caller's slices for ω and ∇ω of many points, each as long as the points.
#[derive(Debug)]
pub struct GradientsMut<'a> {
    /// ω, positive inside.
    pub omega: &'a mut [f64],
    /// ∂ω/∂x, pointing inwards where ω is near zero; likewise `y` and `z`.
    pub x: &'a mut [f64],
    /// ∂ω/∂y
    pub y: &'a mut [f64],
    /// ∂ω/∂z
    pub z: &'a mut [f64],
}

/// A scalar field over space: positive inside an obstacle, negative in the fluid.
///
/// Implementations are pure: the same point gives the same bits on every thread. Non-finite coordinates
/// give NaN, never "outside".
pub trait Field: Sync {
    /// ω at a point.
    fn omega(&self, p: DVec3) -> f64;

    /// ω and ∇ω at a point. At corners and edges ∇ω is one finite member of the limits, never NaN.
    fn omega_grad(&self, p: DVec3) -> (f64, DVec3);

    /// ω at many points; `omega` is as long as `points`. No allocation, caller's thread.
    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        for (i, w) in omega.iter_mut().enumerate() {
            *w = self.omega(points.get(i));
        }
    }

    /// ω and ∇ω at many points. No allocation, caller's thread.
    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        for i in 0..points.len() {
            let (w, g) = self.omega_grad(points.get(i));
            (out.omega[i], out.x[i], out.y[i], out.z[i]) = (w, g.x, g.y, g.z);
        }
    }

    /// ω at a point, continuous in space. Differs from `omega` only where an implementation keeps nothing but the sign
    /// and the zero set of ω there, which does for roots but not for interpolation; the sign is the same.
    fn continuous(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    /// An interval that contains ω of every point of the box; the default knows nothing.
    fn range(&self, _over: &Aabb) -> Interval {
        Interval::ALL
    }

    /// Where a path first meets the obstacle, from [`Path::start`] on; ω = 0 counts as met.
    ///
    /// The default halves the path until [`Field::range`] proves its parts to be in the fluid, down to 1e-9 of its
    /// length; a field that knows nothing of its range is sampled, see [`Path::resolution`].
    fn first_entry(&self, path: &Path) -> Option<Entry> {
        search_path(self, path)
    }

    /// The faces of the obstacle's surface that may lie within `reach` of a point, and how they are joined; nothing is
    /// added if the whole ball of that radius lies in the fluid.
    ///
    /// The default knows one face, by the distance −ω/|∇ω|, which holds near the surface only.
    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        let (w, gradient) = self.omega_grad(p);
        let slope = gradient.length();
        let distance = -w / slope;
        // a vanishing gradient gives no face
        if distance < reach && slope > 0.0 {
            faces.push(Part::Face(Face { distance, normal: -gradient / slope, mean_curvature: 0.0 }));
        }
    }

    /// ω at a part of a path, at the time at which it is passed: the same as at any other time, unless the obstacle
    /// moves.
    fn on_path(&self, path: &Path, t: f64) -> f64 {
        self.omega(path.at(t))
    }

    /// The velocity of the surface near a point, in the scene's units of length and time, along the surface's normal.
    ///
    /// On the surface ω(x(t), t) = 0, so it moves along n = −∇ω/|∇ω| with the speed ω_t/|∇ω|; at edges it is that of
    /// one of the faces, or their mean. A motion within the surface itself, as of a turning cylinder, is not in ω.
    fn wall_velocity(&self, _p: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    /// A radius, `most` at the utmost, of a ball around a point that is proven to lie in the fluid at all times that the
    /// field speaks of; 0 where nothing is proven.
    ///
    /// The default asks for ranges of the boxes around a few such balls.
    fn clearance(&self, p: DVec3, most: f64) -> f64 {
        clearance_by_ranges(self, p, most)
    }

    /// Whether a box is proven to lie in the fluid, and nothing of it nearer than `reach` to a surface, at all times that
    /// the field speaks of.
    fn is_far(&self, over: &Aabb, reach: f64) -> bool {
        self.range(&over.grown(reach)).hi < 0.0
    }
}

/// The largest of `most`, its half and so on that a field's ranges prove to be free around a point: what
/// [`Field::clearance`] does unless a field knows better.
pub(crate) fn clearance_by_ranges<F: Field + ?Sized>(field: &F, p: DVec3, most: f64) -> f64 {
    let mut radius = most;
    for _ in 0..CLEARANCES {
        let range = field.range(&Aabb::new(p, p).grown(radius));
        if range.hi < 0.0 {
            return radius;
        }
        if range == Interval::ALL && radius == most && field.range(&Aabb::new(p, p)) == Interval::ALL {
            break; // it knows nothing, and will not know more
        }
        radius *= 0.5;
    }
    0.0
}

/// An obstacle that may move.
pub trait Moving: Sync {
    /// The obstacle during one time step, s: values, gradients and signs are those at `to`, ranges hold the whole step,
    /// and [`Field::first_entry`] lets time run evenly from `from` to `to` while the path is passed.
    ///
    /// Cheap enough to be asked for in every step.
    fn during(&self, from: f64, to: f64) -> Box<dyn Field + Send + '_>;

    /// Whether it does move: otherwise it is the same during every step.
    fn moves(&self) -> bool {
        true
    }
}

/// An obstacle at rest, where one that may move is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Still<F>(pub F);

impl<F: Field + Send> Moving for Still<F> {
    fn during(&self, _from: f64, _to: f64) -> Box<dyn Field + Send + '_> {
        Box::new(&self.0)
    }

    fn moves(&self) -> bool {
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

    fn range(&self, over: &Aabb) -> Interval {
        (**self).range(over)
    }

    fn first_entry(&self, path: &Path) -> Option<Entry> {
        (**self).first_entry(path)
    }

    fn on_path(&self, path: &Path, t: f64) -> f64 {
        (**self).on_path(path, t)
    }

    fn wall_velocity(&self, p: DVec3) -> DVec3 {
        (**self).wall_velocity(p)
    }

    fn clearance(&self, p: DVec3, most: f64) -> f64 {
        (**self).clearance(p, most)
    }

    fn is_far(&self, over: &Aabb, reach: f64) -> bool {
        (**self).is_far(over, reach)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        (**self).faces(p, reach, faces);
    }
}

/// A field made of two closures, for tests and for callers with formulas of their own.
#[derive(Debug, Clone, Copy)]
pub struct Closures<V, G> {
    /// Point → ω.
    pub omega: V,
    /// Point → ∇ω; finite everywhere, also where the formula has an edge.
    pub gradient: G,
}

impl<V, G> Field for Closures<V, G>
where
    V: Fn(DVec3) -> f64 + Sync,
    G: Fn(DVec3) -> DVec3 + Sync,
{
    fn omega(&self, p: DVec3) -> f64 {
        (self.omega)(p)
    }

    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        ((self.omega)(p), (self.gradient)(p))
    }
}
