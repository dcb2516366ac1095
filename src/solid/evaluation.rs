//! The values of a solid: ω and its gradient, its sign, its range, the surface near a point.

use std::cell::OnceCell;

use glam::{DVec3, Vec3};

use super::confirm::{Surface, confirmed};
use super::construction::Solid;
use super::contact::{Contact, SURE};
use super::engine::ProgramKind;
use super::nearest::{Distance, Distances};
use super::programs::on_demand::Lane;
use crate::field::{Field, GradientsMut, Points};
use crate::geom::Aabb;
use crate::interval::Interval;
use crate::ir::{TrustKind, Unary};
use crate::precision::Precision;

/// The same for numbers in single precision.
const SURE_F32: f64 = 1e-4;

/// Points of columns that are looked at together, whether one of them has to be compared with signs.
const LOOKED_AT: usize = 32;

impl Solid {
    /// ω at a point.
    #[inline]
    pub fn omega(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.evaluate(ProgramKind::Value, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω at a point; at edges and corners ∇ω is one finite member of the limits.
    #[inline]
    pub fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        let mut out = [0.0; 4];
        self.evaluate(ProgramKind::Gradient, p.to_array(), &mut out);
        (out[0], DVec3::new(out[1], out[2], out[3]))
    }

    /// ω in single precision throughout.
    #[inline]
    pub fn omega_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0];
        self.evaluate(ProgramKind::Value, p.to_array(), &mut out);
        out[0]
    }

    /// ω and ∇ω in single precision throughout.
    #[inline]
    pub fn omega_grad_f32(&self, p: Vec3) -> (f32, Vec3) {
        let mut out = [0.0; 4];
        self.evaluate(ProgramKind::Gradient, p.to_array(), &mut out);
        (out[0], Vec3::new(out[1], out[2], out[3]))
    }

    /// ω at many points given by columns; no allocation, on the caller's thread.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_many<T: Lane>(&self, points: [&[T]; 3], omega: &mut [T]) {
        self.evaluate_many(ProgramKind::Value, points, [omega]);
    }

    /// ω and ∇ω at many points given by columns: `out` is ω, ∂x, ∂y, ∂z.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn omega_grad_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 4]) {
        self.evaluate_many(ProgramKind::Gradient, points, out);
    }

    /// Inside (1), on the surface (0) or outside (−1), exactly the logic of the leaves' signs; NaN where a
    /// leaf is not a number, or farther than 1e77 from the origin.
    #[inline]
    pub fn sign(&self, p: DVec3) -> f64 {
        let mut out = [0.0];
        self.evaluate(ProgramKind::Sign, p.to_array(), &mut out);
        Unary::Sign.eval(out[0])
    }

    /// Distance, normal and curvature of the surface as seen from a point: accurate near the surface, an
    /// estimate far away, but never 0 off the surface. At axes, on creases and in the middle of valleys, where ω and its
    /// derivatives say little of the distance, the nearest place is looked for by the sign. Where the derivatives say nothing
    /// and no surface is found, as beside an empty solid, the distance is infinite. Solids of more than 256 different formulas
    /// are not looked into for such axes, creases and valleys: their distances are the estimates of these formulas.
    pub fn contact(&self, p: DVec3) -> Contact {
        self.contact_or_search(p, &OnceCell::new())
    }

    /// The contact at a point. `distances` are prepared when a search is first needed.
    fn contact_or_search(&self, p: DVec3, distances: &OnceCell<Distances>) -> Contact {
        let contact = self.estimated_contact(p);
        if says_nothing(contact.distance) && self.sign(p).abs() == 1.0 {
            searched_contact(distances.get_or_init(|| Distances::new(self)), p, contact)
        } else {
            self.confirmed_contact(p, contact)
        }
    }

    /// The contact of which an estimate is given.
    #[inline]
    fn confirmed_contact(&self, p: DVec3, estimate: Contact) -> Contact {
        let trust = self.trust();
        let Contact { distance, mean_curvature, .. } = estimate;
        if !trust.is_in_doubt(p, distance, mean_curvature) {
            return estimate;
        }
        confirmed(self, trust, p, estimate, SURE * p.abs().max_element())
    }

    /// The contact that single leaves gave, of which doubtful ones are compared with their own signs; that of the whole solid
    /// where the nearest place may be elsewhere.
    #[inline]
    pub(super) fn settled(&self, p: DVec3, found: Contact) -> Contact {
        let trust = self.trust();
        let is_in_doubt =
            trust.kind != TrustKind::Doubtful && trust.is_in_doubt(p, found.distance, found.mean_curvature);
        if is_in_doubt { self.contact(p) } else { found }
    }

    /// The contact that its program finds. Where the derivatives say nothing, its distance is 0.
    pub(super) fn estimated_contact(&self, p: DVec3) -> Contact {
        let mut out = [0.0; 5];
        self.evaluate(ProgramKind::Contact, p.to_array(), &mut out);
        let [distance, nx, ny, nz, mean_curvature] = out;
        Contact { distance, normal: DVec3::new(nx, ny, nz), mean_curvature }
    }

    /// The velocity of the solid near a point of its surface, in lengths per second. Zero for a solid at rest.
    ///
    /// A solid that is moved and turned without deformation has the velocity v₀ + ω × p, also where its
    /// surface moves within itself, as that of a turning cylinder does. For other solids, ω holds only the
    /// velocity along the normal of the face that [`Solid::contact`] finds. Solids whose parts move
    /// differently are among them.
    pub fn wall_velocity(&self, p: DVec3) -> DVec3 {
        if !self.moves() {
            return DVec3::ZERO;
        }
        self.twist().map_or_else(|| self.face_velocity(p), |twist| twist.at(p))
    }

    /// The velocity along its normal of the face nearest to a point. Away from the face, the formula is that of a surface
    /// of another value of ω, which may be faster or slower.
    fn face_velocity(&self, p: DVec3) -> DVec3 {
        let velocity = |at: DVec3| {
            let mut out = [0.0; 3];
            self.evaluate(ProgramKind::Velocity, at.to_array(), &mut out);
            DVec3::from_array(out)
        };
        self.estimated_contact(p).velocity_at_foot(p, velocity)
    }

    /// The distance of [`Solid::contact`] in single precision throughout.
    pub fn distance_f32(&self, p: Vec3) -> f32 {
        let mut out = [0.0; 5];
        self.evaluate(ProgramKind::Contact, p.to_array(), &mut out);
        out[0]
    }

    /// Distance, normal x, y, z and mean curvature at many points given by columns, as [`Solid::contact`].
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn contact_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 5]) {
        let [distance, nx, ny, nz, curvature] = out;
        self.estimated_contact_many(points, [distance, nx, ny, nz, curvature]);
        let distances = OnceCell::new();
        let trust = self.trust();
        for first in (0..distance.len()).step_by(LOOKED_AT) {
            let run = first..distance.len().min(first + LOOKED_AT);
            let is_lost = distance[run.clone()].iter().any(|distance| says_nothing(distance.to_f64()));
            let at = points.map(|column| &column[run.clone()]);
            if !is_lost && !trust.has_doubts(at, &distance[run.clone()], &curvature[run.clone()]) {
                continue;
            }
            for i in run {
                let p = DVec3::from_array(points.map(|column| column[i].to_f64()));
                if !says_nothing(distance[i].to_f64())
                    && !trust.is_in_doubt(p, distance[i].to_f64(), curvature[i].to_f64())
                {
                    continue;
                }
                let normal = DVec3::from_array([nx[i], ny[i], nz[i]].map(T::to_f64));
                let found =
                    Contact { distance: distance[i].to_f64(), normal, mean_curvature: curvature[i].to_f64() };
                let contact = self.of_column::<T>(p, found, &distances);
                if contact != found {
                    let Contact { distance: d, normal, mean_curvature } = contact;
                    let row = [d, normal.x, normal.y, normal.z, mean_curvature].map(T::from_f64);
                    [distance[i], nx[i], ny[i], nz[i], curvature[i]] = row;
                }
            }
        }
    }

    /// What ω and its derivatives alone say of contacts, in the order of [`Solid::contact_many`]: no sign is compared with it, and
    /// the distance is 0 where the derivatives say nothing. These are the distances of `rfm build`.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn estimated_contact_many<T: Lane>(&self, points: [&[T]; 3], out: [&mut [T]; 5]) {
        self.evaluate_many(ProgramKind::Contact, points, out);
    }

    /// The contact that replaces one of a column.
    fn of_column<T: Lane>(&self, p: DVec3, found: Contact, distances: &OnceCell<Distances>) -> Contact {
        if says_nothing(found.distance) {
            return self.contact_or_search(p, distances);
        }
        let is_single = T::PRECISION == Precision::F32;
        if is_single && found.distance.abs() < SURE_F32 * p.abs().max_element() {
            // what is left of so short a distance in single precision would contradict the signs
            let estimate = self.estimated_contact(p);
            let contact = self.confirmed_contact(p, estimate);
            return if contact == estimate { found } else { contact };
        }
        self.confirmed_contact(p, found)
    }

    /// Inside (1), on the surface (0) or outside (−1) at many points given by columns, as [`Solid::sign`].
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn sign_many<T: Lane>(&self, points: [&[T]; 3], sign: &mut [T]) {
        self.twin_many(points, sign);
        sign.iter_mut().for_each(|value| *value = Unary::Sign.eval(*value));
    }

    /// The twin at many points: positive inside, 0 on the surface, negative outside.
    ///
    /// # Panics
    /// If the columns differ in length.
    pub fn twin_many<T: Lane>(&self, points: [&[T]; 3], twin: &mut [T]) {
        self.evaluate_many(ProgramKind::Sign, points, [twin]);
    }

    /// An interval that contains ω of every point of a box: the exact value and the one that [`Solid::omega`]
    /// gives, also where that overflows. [`Interval::ALL`] where ω may not be a number. It does not cover
    /// points at which ω is NaN because of their coordinates: not finite, or so large that their sum is not.
    pub fn range(&self, over: &Aabb) -> Interval {
        self.inner.omega.range(self.inner.engine, over, &self.moment, false)
    }
}

/// Whether an estimated distance is none: the derivatives vanish, or are no numbers.
#[inline]
fn says_nothing(distance: f64) -> bool {
    distance == 0.0 || distance.is_nan()
}

/// The contact with the nearest point of the surface, of whose curvature nothing is known. Where no surface is found it
/// is infinitely far, and the rest stays that of `lost`.
fn searched_contact(distances: &Distances, p: DVec3, lost: Contact) -> Contact {
    let Distance { estimate, nearest, .. } = distances.at(p);
    let normal = (p - nearest) / estimate;
    match normal.is_finite() {
        true => Contact { distance: estimate, normal, mean_curvature: 0.0 },
        false if estimate.is_infinite() => Contact { distance: estimate, ..lost },
        false => lost,
    }
}

impl Surface for Solid {
    fn sign(&self, p: DVec3) -> f64 {
        self.sign(p)
    }

    fn omega(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    fn estimate(&self, p: DVec3) -> Contact {
        self.estimated_contact(p)
    }

    /// At an edge the estimate is that of one face, which ends before its foot: there that face is crossed.
    fn crosses_a_face(&self, p: DVec3, behind: DVec3) -> bool {
        let parts = if self.has_many_leaves() { None } else { self.parts() };
        parts.is_some_and(|parts| parts.leaves.len() > 1 && parts.leaves.is_crossed_between(p, behind))
    }
}

impl Field for Solid {
    #[inline]
    fn omega(&self, p: DVec3) -> f64 {
        self.omega(p)
    }

    #[inline]
    fn omega_grad(&self, p: DVec3) -> (f64, DVec3) {
        self.omega_grad(p)
    }

    fn omega_many(&self, points: Points<'_>, omega: &mut [f64]) {
        self.omega_many([points.x, points.y, points.z], omega);
    }

    fn omega_grad_many(&self, points: Points<'_>, out: GradientsMut<'_>) {
        self.omega_grad_many([points.x, points.y, points.z], [out.omega, out.x, out.y, out.z]);
    }

    fn range(&self, over: &Aabb) -> Interval {
        self.range(over)
    }
}
