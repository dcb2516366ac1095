//! What a fluid asks of an obstacle besides its field: where paths enter it, which faces are near a point,
//! how its surface moves, and which regions are surely free of it.
//!
//! Invariant: if a field knows its range, no part of a path before an [`Entry`] touches the obstacle, and a
//! path without an entry does not touch it at all. If the obstacle moves, this holds for each place at the
//! time at which the path passes it. A field that does not know its range is sampled, and what lies between
//! two samples is not seen.

use glam::DVec3;

use super::{Closures, Entry, Face, Faces, Field, Normals, Part, Path, last_outside};
use crate::geom::{Aabb, Placement};
use crate::interval::Interval;

/// Number of radii that [`Walls::clearance`] tries, each half of the one before.
const CLEARANCES: u32 = 5;

/// Parts of a path shorter than this are not divided further.
const SHORTEST: f64 = 1e-9;

/// Most ranges that are evaluated on one path. What is still undecided then is reported as uncertain.
const MOST_RANGES: usize = 2_000;

/// An obstacle as a fluid meets it. Every method has a default that follows from [`Field`] alone, so the line
/// `impl Walls for MyField {}` is enough. An implementation overrides the methods that it can answer better.
pub trait Walls: Field {
    /// Where a path first meets the obstacle, from [`Path::start`] on; ω = 0 counts as met. `None` if it does
    /// not.
    ///
    /// The default halves the path until [`Field::range`] proves its parts to be in the fluid, down to 1e-9
    /// of its length. A field that does not know its range is sampled, see [`Path::resolution`].
    fn first_entry(&self, path: &Path) -> Option<Entry> {
        search_path(self, path)
    }

    /// Adds to `faces` the faces of the obstacle's surface that may lie within `reach` of a point, and how
    /// they are joined. Adds nothing if the whole ball of that radius lies in the fluid.
    ///
    /// The default adds one face at the distance −ω/|∇ω|, which is accurate near the surface only.
    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        let (w, gradient) = self.omega_grad(p);
        let slope = gradient.length();
        let distance = -w / slope;
        // a vanishing gradient gives no face
        if distance < reach && slope > 0.0 {
            faces.push(Part::Face(Face { distance, normal: -gradient / slope, mean_curvature: 0.0 }));
        }
    }

    /// ω at a part `t` of a path, 0 to 1. If the obstacle moves, ω is that of the time at which the path
    /// passes this place.
    fn on_path(&self, path: &Path, t: f64) -> f64 {
        self.omega(path.at(t))
    }

    /// The velocity of the wall near a point of its surface, in the scene's units of length and time.
    ///
    /// If the field knows that the wall moves without deformation, this is v₀ + ω × p. Otherwise it is the velocity
    /// along the normal: on the surface ω(x(t), t) = 0, so it moves along n = −∇ω/|∇ω| with the speed ω_t/|∇ω|. At an
    /// edge this is the velocity of one of the faces, or their mean.
    fn wall_velocity(&self, _p: DVec3) -> DVec3 {
        DVec3::ZERO
    }

    /// The radius, at most `most`, of a ball around a point that is proven to lie in the fluid at all times
    /// that the field covers; 0 if nothing is proven.
    ///
    /// The default takes the ranges of the boxes around a few such balls.
    fn clearance(&self, p: DVec3, most: f64) -> f64 {
        clearance_by_ranges(self, p, most)
    }

    /// Whether a box is proven to lie in the fluid at all times that the field covers.
    fn is_outside(&self, over: &Aabb) -> bool {
        self.range(over).hi < 0.0
    }

    /// Whether a box is proven to lie in the fluid, with every point of it at least `reach` away from any
    /// surface, at all times that the field covers.
    fn is_far(&self, over: &Aabb, reach: f64) -> bool {
        self.range(&over.grown(reach)).hi < 0.0
    }

    /// A box that holds all places of a domain that are inside, or nearer to a surface than `reach`, at any time
    /// that the field covers. `None` if no such box is known; the default knows none. The box is found at once,
    /// so that it may be too large.
    fn surroundings(&self, _domain: &Aabb, _reach: f64) -> Option<Aabb> {
        None
    }
}

impl<F: Walls + ?Sized> Walls for &F {
    fn first_entry(&self, path: &Path) -> Option<Entry> {
        (**self).first_entry(path)
    }

    fn faces(&self, p: DVec3, reach: f64, faces: &mut Faces) {
        (**self).faces(p, reach, faces);
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

    fn is_outside(&self, over: &Aabb) -> bool {
        (**self).is_outside(over)
    }

    fn is_far(&self, over: &Aabb, reach: f64) -> bool {
        (**self).is_far(over, reach)
    }

    fn surroundings(&self, domain: &Aabb, reach: f64) -> Option<Aabb> {
        (**self).surroundings(domain, reach)
    }
}

impl<V, G> Walls for Closures<V, G>
where
    V: Fn(DVec3) -> f64 + Send + Sync,
    G: Fn(DVec3) -> DVec3 + Send + Sync,
{
}

/// An obstacle that may move.
pub trait Moving: Send + Sync {
    /// The obstacle during one time step, between two times in seconds. Values, gradients and signs are those
    /// at `to`; ranges hold for the whole step. [`Walls::first_entry`] lets time run evenly from `from` to
    /// `to` along a path.
    ///
    /// The call is cheap enough for every step.
    fn during(&self, from: f64, to: f64) -> Box<dyn Walls>;

    /// Where the obstacle is at a time, s, seen from where it is at the time 0, if it is known to move without
    /// deformation. Fluid solvers then know for good what it takes of the kernels near it.
    fn placement(&self, _time: f64) -> Option<Placement> {
        None
    }

    /// Whether the obstacle is known to be the same at two times, s. The default knows nothing.
    fn is_same(&self, _a: f64, _b: f64) -> bool {
        false
    }

    /// Whether the obstacle moves. If not, it is the same during every step.
    fn moves(&self) -> bool {
        true
    }
}

/// An obstacle at rest as a [`Moving`] one.
#[derive(Debug, Clone, Copy)]
pub struct Still<F>(pub F);

impl<F: Walls + Clone + 'static> Moving for Still<F> {
    fn during(&self, _from: f64, _to: f64) -> Box<dyn Walls> {
        Box::new(self.0.clone())
    }

    fn moves(&self) -> bool {
        false
    }
}

/// The largest of `most`, `most`/2, … whose ball around a point is free by the field's ranges; 0 if none is.
/// This is the default of [`Walls::clearance`].
pub(crate) fn clearance_by_ranges<F: Walls + ?Sized>(field: &F, p: DVec3, most: f64) -> f64 {
    let mut radius = most;
    for _ in 0..CLEARANCES {
        let range = field.range(&Aabb::new(p, p).grown(radius));
        if range.hi < 0.0 {
            return radius;
        }
        if range == Interval::ALL && radius == most && field.range(&Aabb::new(p, p)) == Interval::ALL {
            break; // the field knows nothing of its range
        }
        radius *= 0.5;
    }
    0.0
}

/// The first entry of a path by the field's ranges, or by samples if it has none; `None` if the path does not
/// enter. This is the default of [`Walls::first_entry`].
pub fn search_path<F: Walls + ?Sized>(field: &F, path: &Path) -> Option<Entry> {
    let knows = |t0, t1| field.range(&path.hull(t0, t1)) != Interval::ALL;
    let found = if knows(path.start, 1.0) || knows(path.start, path.start) {
        by_ranges(field, path)
    } else {
        by_samples(field, path)
    };
    found.map(|(stretch, certain)| {
        let mut normals = Normals::default();
        normals.add(-field.omega_grad(path.at(stretch.0)).1);
        Entry::new(path, stretch, certain, normals)
    })
}

/// Halves the path, the earlier half first, until a range proves a part to be in the fluid or the part is too
/// short to be divided. Undecided parts that follow one another are joined.
fn by_ranges<F: Walls + ?Sized>(field: &F, path: &Path) -> Option<((f64, f64), bool)> {
    let mut stack = vec![(path.start, 1.0)];
    let mut left = MOST_RANGES;
    let mut open: Option<(f64, f64)> = None;
    while let Some((t0, t1)) = stack.pop() {
        let range = field.range(&path.hull(t0, t1));
        if range.hi < 0.0 {
            if open.is_some() {
                break;
            }
            continue;
        }
        left = left.saturating_sub(1);
        if left == 0 {
            return Some(((open.map_or(t0, |o| o.0), 1.0), false));
        }
        if range.lo >= 0.0 && range != Interval::ALL {
            return Some(((open.map_or(t0, |o| o.0), t1), true));
        }
        if t1 - t0 > SHORTEST {
            let middle = 0.5 * (t0 + t1);
            stack.extend([(middle, t1), (t0, middle)]);
        } else {
            let begin = open.map_or(t0, |o| o.0);
            if field.on_path(path, t1) >= 0.0 {
                return Some(((begin, t1), true));
            }
            open = Some((begin, t1));
        }
    }
    open.map(|stretch| (stretch, false))
}

/// The first sample that is not in the fluid, and the last place before it that is; `None` if all samples are
/// in the fluid.
fn by_samples<F: Walls + ?Sized>(field: &F, path: &Path) -> Option<((f64, f64), bool)> {
    let start = field.on_path(path, path.start);
    if start >= 0.0 || start.is_nan() {
        return Some(((path.start, path.start), start >= 0.0));
    }
    let mut before = (path.start, start);
    for t in path.samples(path.start, 1.0) {
        let after = (t, field.on_path(path, t));
        if after.1.is_nan() {
            return Some(((before.0, t), false));
        }
        if after.1 >= 0.0 {
            return Some(((last_outside(|t| field.on_path(path, t), path, before, after), t), true));
        }
        before = after;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball of radius 1 whose range is known from the distance of the box's centre.
    struct Ball;

    impl Field for Ball {
        fn omega(&self, p: DVec3) -> f64 {
            1.0 - p.length()
        }

        fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
            (self.omega(p), -p.normalize_or_zero())
        }

        fn range(&self, over: &Aabb) -> Interval {
            let (middle, reach) = (self.omega(over.centre()), 0.5 * over.size().length() + 1e-15);
            Interval::new(middle - reach, middle + reach)
        }
    }

    impl Walls for Ball {}

    #[test]
    fn ranges_find_what_samples_miss() {
        let path = |y: f64| Path::new(DVec3::new(-2.0, y, 0.0), DVec3::new(2.0, y, 0.0), 10.0);
        let hit = Ball.first_entry(&path(0.6)).unwrap();
        assert!(hit.certain && (hit.t - 0.3).abs() < 1e-8, "{hit:?}");
        assert!((hit.normals.mean().unwrap() - DVec3::new(-0.8, 0.6, 0.0)).length() < 1e-7);
        assert_eq!(Ball.first_entry(&path(1.001)), None);
        let closures =
            Closures { omega: |p: DVec3| Ball.omega(p), gradient: |p: DVec3| Ball.omega_grad(p).1 };
        assert_eq!(closures.first_entry(&path(0.6)), None);
        let closely = Path { resolution: 0.1, ..path(0.6) };
        let hit = closures.first_entry(&closely).unwrap();
        assert!((hit.t - 0.3).abs() < 1e-14 && hit.certain && Ball.omega(hit.point) < 0.0, "{hit:?}");
    }
}
