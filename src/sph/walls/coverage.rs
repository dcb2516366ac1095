//! What the walls around a particle take of its kernel: the closed forms of [`Wall`] for each face nearby,
//! combined as the faces are joined.
//!
//! For two faces A and B, the part of the kernel behind both is λ_A·λ_B where they meet at a right angle, the
//! smaller of the two where they look the same way, and what exceeds one where they face each other. Between
//! these cases it is interpolated with the weight (2/π)·arcsin|n_A·n_B|. On the edge itself, λ_A = λ_B = ½,
//! this is exact for every kernel, because only the wedge's angle counts there. "Any of" follows by
//! complement.
//!
//! The gradient ∇λ = ∫ ∇W over the wall and the moment K = ∫ y ⊗ ∇W (y from the particle) belong to λ.
//! Integration by parts over a half-space leaves K = λ·1 + d·(A/h)·n⊗n. With K, a pressure that is linear in
//! space is continued into the wall: a column of fluid at rest stays at rest in a vessel of any shape.
//!
//! (These formulas hold for a continuous wall. For a wall in layers both terms are sums over the layers, see
//! [`Wall`].)
//!
//! Invariant: 0 ≤ λ ≤ 1. Beyond the support radius of every face all quantities are zero.

use glam::{DMat3, DVec3};

use crate::field::{Face, Faces, Part};
use crate::geom::eigen;

use super::{
    behind::{Behind, Carried},
    friction::{Friction, LEAST_FREE},
    layers::{OfFace, Wall},
    recess::Recess,
    symmetric::Symmetric,
    volume::Taken,
};

/// Curvatures, in units of 1/h, are cut off here: the series behind the correction does not hold beyond.
const MOST_CURVED: f64 = 0.4;

/// Parts of a kernel below this count as zero.
const LEAST_TAKEN: f64 = 1e-9;

/// Integrals of a kernel over the walls near a particle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct Coverage<F = (), B = ()> {
    /// λ = ∫ W, 0 to 1.
    pub part: f64,
    /// What a wall adds to the sum over a lattice of particles, see [`OfFace::filled`].
    pub filled: f64,
    /// ∇λ = ∫ ∇W, 1/m; it points out of the fluid.
    pub gradient: DVec3,
    /// K − λ·1 = Σ d·(A/h)·n⊗n over the faces.
    pub spread: Symmetric,
    /// ∇λ·v for walls that move with the velocity v, 1/s.
    pub sweep: f64,
    /// The barrier B and its gradient, see [`OfFace::barrier`]; without meaning for a continuous wall.
    pub barrier: Barrier,
    /// Friction with a viscous fluid.
    pub friction: F,
    /// The motion of the fluid behind the walls.
    pub behind: B,
}

/// What walls add to the density of a fluid that must not be compressed, see [`OfFace::barrier`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(in crate::sph) struct Barrier {
    /// B, as a part of the rest density.
    pub part: f64,
    /// ∇B, 1/m; it points out of the fluid.
    pub gradient: DVec3,
    /// ∇B·v for walls that move with the velocity v, 1/s.
    pub sweep: f64,
}

impl<F: Friction, B: Behind> Coverage<F, B> {
    /// The coverage by one face.
    pub fn of_face(wall: &Wall, face: &Face) -> Self {
        let h = wall.h;
        let delta = face.distance / h;
        if delta >= 1.0 {
            return Self::default();
        }
        let curvature = (face.mean_curvature * h).clamp(-MOST_CURVED, MOST_CURVED);
        let taken = wall.of_face(delta, curvature);
        let OfFace { part, area, spread, filled, barrier, barrier_area } = taken;
        Self {
            part,
            filled,
            gradient: -area / h * face.normal,
            spread: spread * Symmetric::square(face.normal),
            sweep: 0.0,
            barrier: Barrier { part: barrier, gradient: -barrier_area / h * face.normal, sweep: 0.0 },
            friction: F::of_face(wall, face, &taken),
            behind: B::of_face(part, face.normal),
        }
    }

    /// Lets all of these walls move with one velocity, m/s. Friction is handled separately.
    pub fn set_in_motion(&mut self, velocity: DVec3) {
        self.sweep = self.gradient.dot(velocity);
        self.behind.set_in_motion(&self.spread, velocity);
        self.barrier.sweep = self.barrier.gradient.dot(velocity);
    }

    /// Lets the fluid slip along all of these walls.
    pub fn let_slip(&mut self) {
        self.friction.let_slip(self.part);
    }

    /// The coverage by a tree of faces.
    pub fn of_faces(wall: &Wall, faces: &Faces) -> Self {
        if faces.is_empty() { Self::default() } else { Self::of_tree(wall, faces, &mut 0) }
    }

    fn of_tree(wall: &Wall, faces: &[Part], at: &mut usize) -> Self {
        let part = faces[*at];
        *at += 1;
        let (parts, all) = match part {
            Part::Face(face) => return Self::of_face(wall, &face),
            Part::All(parts) => (parts, true),
            Part::Any(parts) => (parts, false),
        };
        let mut whole = Self::of_tree(wall, faces, at);
        for _ in 1..parts {
            let next = Self::of_tree(wall, faces, at);
            whole = if all { whole.and(&next) } else { whole.or(&next) };
        }
        whole
    }

    /// The coverage by what lies behind both.
    pub fn and(&self, other: &Self) -> Self {
        let cosine = self.cosine(other);
        self.joined(other, |a, b| common(a, b, cosine))
    }

    /// The coverage by what lies behind either: all but what lies before both.
    pub fn or(&self, other: &Self) -> Self {
        if self.part == 0.0 || other.part == 0.0 {
            return if self.part == 0.0 { *other } else { *self };
        }
        // the faces of both complements look the other way, so the angle between them stays the same
        let cosine = self.cosine(other);
        self.joined(other, |a, b| {
            let (before, da, db) = common(1.0 - a, 1.0 - b, cosine);
            (1.0 - before, da, db)
        })
    }

    /// Cosine of the angle between the directions in which two walls lie.
    fn cosine(&self, other: &Self) -> f64 {
        cosine_between(self.gradient, other.gradient)
    }

    /// The coverage by this part of the walls, where they are neither wet nor bare as a whole.
    pub fn in_part(self, part: f64) -> Self {
        let Barrier { part: barrier, gradient, sweep } = self.barrier;
        Self {
            part: part * self.part,
            filled: part * self.filled,
            gradient: part * self.gradient,
            spread: part * self.spread,
            sweep: part * self.sweep,
            barrier: Barrier { part: part * barrier, gradient: part * gradient, sweep: part * sweep },
            friction: self.friction.in_part(part),
            behind: self.behind.in_part(part),
        }
    }

    /// The coverage with another friction.
    pub fn with_friction<G>(self, friction: G) -> Coverage<G, B> {
        let Self { part, filled, gradient, spread, sweep, barrier, friction: _, behind } = self;
        Coverage { part, filled, gradient, spread, sweep, barrier, friction, behind }
    }

    /// The coverage without its friction.
    pub fn without_friction(self) -> Coverage<(), B> {
        self.with_friction(())
    }

    /// The coverage without what is behind the walls.
    pub fn without_behind(self) -> Coverage<F> {
        let Self { part, filled, gradient, spread, sweep, barrier, friction, behind: _ } = self;
        Coverage { part, filled, gradient, spread, sweep, barrier, friction, behind: () }
    }

    /// ⅓ tr K, with the K of [`tensor`](Self::tensor).
    pub fn share(&self) -> f64 {
        self.part + self.spread.trace() / 3.0
    }

    /// K, the part of walls in what sums make of the gradient of a position.
    pub fn tensor(&self) -> Symmetric {
        self.part * Symmetric::IDENTITY + self.spread
    }

    /// (1 − K)⁻¹, by which a sum over the fluid alone becomes what it would be if the fluid continued behind
    /// the walls. No direction is stretched by more than 1/[`LEAST_FREE`].
    pub fn completion(&self) -> DMat3 {
        // along the normal of one wall K is hardly more than ½ in the fluid; between two that face each other, and in
        // corners, their sum may come near to 1
        let moment = DMat3::from_diagonal(DVec3::splat(1.0 - self.part)) - self.spread.to_matrix();
        inverse_above(&moment, LEAST_FREE)
    }

    /// Two walls combined by a rule, which says how their λ combine, and the derivatives by both.
    fn joined(&self, other: &Self, rule: impl Fn(f64, f64) -> (f64, f64, f64)) -> Self {
        let (part, da, db) = rule(self.part, other.part);
        let shares = || {
            // walls look where their gradients point
            let weight = |slope: f64, of: &Self| slope * of.gradient.length();
            let (wa, wb) = (weight(da, self), weight(db, other));
            let share = |weight: f64, of: &Self| {
                if weight > 0.0 && of.part > 0.0 { part * weight / (wa + wb) / of.part } else { 0.0 }
            };
            [share(wa, self), share(wb, other)]
        };
        Self {
            part: part.clamp(0.0, 1.0),
            filled: (part + da * (self.filled - self.part) + db * (other.filled - other.part))
                .clamp(0.0, 1.0),
            gradient: da * self.gradient + db * other.gradient,
            spread: da * self.spread + db * other.spread,
            sweep: da * self.sweep + db * other.sweep,
            barrier: self.barrier.joined(&other.barrier, part, [da, db], [self.part, other.part]),
            behind: self.behind.joined(&other.behind, shares, [da, db]),
            friction: self.friction.joined(&other.friction, rule),
        }
    }
}

impl<B: Behind> Coverage<(), B> {
    /// Adds bodies whose volume is known to these walls of the box, which are `continuous` if they are not in layers.
    ///
    /// The bodies take the part b of what the box leaves. The other figures of a wall follow from its
    /// distance. For bodies this is the distance of a plane that takes as much, or of the planes of an edge
    /// or a corner, see [`Recess`]; its gradient along the way is that of b. For walls in layers, a body that
    /// faces the box takes nothing that the box might have: there b is all that the bodies take, by the
    /// weight of [`Coverage::and`]. (A particle in the middle of a gap half a spacing high, between floor and
    /// body, was driven against the body.)
    pub fn with_bodies(&self, wall: &Wall, continuous: &Coverage, taken: &Taken) -> Self {
        let shared = if wall.layer.is_some() {
            1.0 - facing(cosine_between(continuous.gradient, taken.gradient))
        } else {
            1.0
        };
        let left = 1.0 - shared * continuous.part;
        let part = (taken.part / left).min(1.0);
        if part < LEAST_TAKEN {
            return *self;
        }
        let gradient = (taken.gradient + shared * part * continuous.gradient) / left;
        let sweep = taken.sweep / left;
        // ∮ W·y·n over the surface of the bodies
        let support = (taken.moment.trace() - 3.0 * taken.part) / left;
        let Recess { part: of_layered, filled, barrier, of_part, of_barrier, of_layers } =
            wall.recess(part, support);
        let normal = gradient.normalize_or_zero();
        // for bodies that change their shape the motion of the surface is known
        let velocity = || {
            let steep = gradient.length();
            let of_surface = if steep > 0.0 { sweep / steep * normal } else { DVec3::ZERO };
            taken.velocity.unwrap_or(of_surface)
        };
        let part = if wall.layer.is_some() { of_layered } else { part };
        let spread = of_part * (taken.moment - taken.part * Symmetric::IDENTITY)
            + of_layers * Symmetric::square(normal);
        let bodies = Self {
            part,
            filled,
            gradient: of_part * gradient,
            spread,
            sweep: of_part * sweep,
            barrier: Barrier { part: barrier, gradient: of_barrier * gradient, sweep: of_barrier * sweep },
            friction: (),
            behind: B::of_bodies(part, normal, &spread, velocity),
        };
        let (da, db) = (1.0 - shared * bodies.part, 1.0 - shared * self.part);
        // there is no more than the whole kernel; that the weight of facing walls changes with the place is
        // left out of gradients
        let whole = self.joined(&bodies, |_, _| ((self.part + db * bodies.part).min(1.0), da, db));
        // K of bodies in the box adds to that of the box
        let behind = whole.behind.with_moments_of(&self.behind, &bodies.behind);
        Self { spread: self.spread + bodies.spread, behind, ..whole }
    }
}

impl<F> Coverage<F, Carried> {
    /// The velocity that the fluid behind the walls has, m/s, by that of the walls across them and by one
    /// along them, m/s: the solution r of K·r = Σ (K_n·v + λ·(1 − n⊗n)·along) over the walls.
    pub fn velocity_behind(&self, along: DVec3) -> DVec3 {
        let Carried { across, by_part, by_spread } = self.behind;
        let moment = self.part * Symmetric::IDENTITY + self.spread;
        let slipping = self.part * along - across * along;
        let behind = moment.to_matrix().inverse() * (by_part + by_spread + slipping);
        if behind.is_finite() { behind } else { along }
    }
}

impl Barrier {
    /// The barrier of two walls, whose λ combine to `part` with the derivatives by both λ.
    fn joined(&self, other: &Self, part: f64, [da, db]: [f64; 2], [a, b]: [f64; 2]) -> Self {
        Self {
            part: (part + da * (self.part - a) + db * (other.part - b)).max(0.0),
            gradient: da * self.gradient + db * other.gradient,
            sweep: da * self.sweep + db * other.sweep,
        }
    }
}

/// Cosine of the angle between two directions; 0 if one of them vanishes.
fn cosine_between(a: DVec3, b: DVec3) -> f64 {
    let lengths = (a.length_squared() * b.length_squared()).sqrt();
    if lengths > 0.0 { (a.dot(b) / lengths).clamp(-1.0, 1.0) } else { 0.0 }
}

/// How far two walls with this cosine between their directions face each other, 0 to 1.
fn facing(cosine: f64) -> f64 {
    std::f64::consts::FRAC_2_PI * arcsine((-cosine).max(0.0))
}

/// The part of a kernel behind two faces that cover a and b of it, with its derivatives by a and b.
fn common(a: f64, b: f64, cosine: f64) -> (f64, f64, f64) {
    let weight = std::f64::consts::FRAC_2_PI * arcsine(cosine.abs());
    // the limit for parallel faces, with its derivatives
    let (limit, da, db) = match () {
        () if cosine < 0.0 && a + b > 1.0 => (a + b - 1.0, 1.0, 1.0),
        () if cosine < 0.0 => (0.0, 0.0, 0.0),
        () if a < b => (a, 1.0, 0.0),
        () if a > b => (b, 0.0, 1.0),
        () => (a, 0.5, 0.5),
    };
    let mix = |square: f64, parallel: f64| (1.0 - weight) * square + weight * parallel;
    (mix(a * b, limit), mix(b, da), mix(a, db))
}

/// The inverse of a symmetric matrix, of which no eigenvalue counts as smaller than `least`.
pub(in crate::sph) fn inverse_above(moment: &DMat3, least: f64) -> DMat3 {
    if is_positive_definite(&(*moment - DMat3::from_diagonal(DVec3::splat(least)))) {
        return moment.inverse();
    }
    let (free, directions) = eigen(*moment);
    let stretches = free.max(DVec3::splat(least)).recip();
    directions * DMat3::from_diagonal(stretches) * directions.transpose()
}

/// Whether all eigenvalues of a symmetric matrix are positive (Sylvester's criterion).
pub(super) fn is_positive_definite(m: &DMat3) -> bool {
    let [x, y] = [m.x_axis, m.y_axis];
    x.x > 0.0 && x.x * y.y > x.y * y.x && m.determinant() > 0.0
}

/// arcsin x for 0 ≤ x ≤ 1, with an error of at most 7e-5 (Abramowitz & Stegun 1964, 4.4.45). The rule that
/// uses it has an error of 3e-2.
fn arcsine(x: f64) -> f64 {
    let series = ((-0.018_729_3 * x + 0.074_261) * x - 0.212_114_4) * x + 1.570_728_8;
    std::f64::consts::FRAC_PI_2 - (1.0 - x).max(0.0).sqrt() * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::walls::{ViscousForces, WallDrag, WallKernel};

    type Coverage = super::Coverage<WallDrag, Carried>;

    const H: f64 = 0.3;
    const WALL: Wall = Wall {
        kernel: WallKernel::WendlandC2,
        h: H,
        layer: None,
        spacing: 1.0 / 2.6,
        at_rest: 0.0,
        lattice_over_layers: 1.0,
        viscous_forces: ViscousForces::AlongLines,
    };

    fn face(distance: f64, normal: DVec3) -> Part {
        Part::Face(Face { distance, normal: normal.normalize(), mean_curvature: 0.0 })
    }

    #[test]
    fn a_part_of_walls_is_that_part_of_all_they_do() {
        let wall = Wall { viscous_forces: ViscousForces::WithSpin, ..WALL };
        let faces = [Part::Any(2), face(0.1, DVec3::Z), face(0.05, DVec3::new(1.0, 0.2, 0.0))];
        let mut whole = Coverage::of_faces(&wall, &faces.into_iter().collect());
        whole.set_in_motion(DVec3::new(0.3, -0.4, 0.2));
        whole.friction.take_along(DVec3::new(0.3, -0.4, 0.2), DVec3::Y);
        assert_eq!(whole.in_part(1.0), whole);
        let quarter = whole.in_part(0.25);
        assert_eq!(quarter.part, 0.25 * whole.part);
        assert_eq!(quarter.barrier.gradient, 0.25 * whole.barrier.gradient);
        assert_eq!(quarter.in_part(4.0), whole);
        // what the fluid does behind a part of a wall is what it does behind the wall
        let along = DVec3::new(0.1, 0.2, 0.3);
        let (behind, of_part) = (whole.velocity_behind(along), quarter.velocity_behind(along));
        assert!((behind - of_part).length() < 1e-12, "{behind} {of_part}");
    }

    /// Integrals of W, ∇W and y ⊗ ∇W over a region, by brute force on a grid of the support's box.
    fn brute_force(inside: impl Fn(DVec3) -> bool) -> (f64, DVec3, DMat3) {
        const N: i32 = 96;
        let step = 2.0 * H / f64::from(N);
        let place = |i: i32| -H + (f64::from(i) + 0.5) * step;
        let (mut part, mut gradient, mut moment) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for (i, j, k) in (0..N).flat_map(|i| (0..N).flat_map(move |j| (0..N).map(move |k| (i, j, k)))) {
            let y = DVec3::new(place(i), place(j), place(k));
            let q = y.length() / H;
            if q >= 1.0 || !inside(y) {
                continue;
            }
            let volume = step.powi(3) * 21.0 / (2.0 * std::f64::consts::PI * H.powi(3));
            part += volume * (1.0 - q).powi(4) * (1.0 + 4.0 * q);
            // the gradient by the particle's place points against that by y
            let slope = volume * 20.0 * (1.0 - q).powi(3) / (H * H) * y;
            gradient += slope;
            moment += DMat3::from_cols(y * slope.x, y * slope.y, y * slope.z);
        }
        (part, gradient, moment)
    }

    #[test]
    fn walls_that_are_far_away_take_nothing() {
        let far = face(1.1 * H, DVec3::X);
        let near = face(0.1 * H, DVec3::Y);
        for faces in [&[][..], &[far], &[Part::All(2), far, near]] {
            let coverage = Coverage::of_faces(&WALL, &Faces::from_slice(faces));
            assert_eq!((coverage.part, coverage.gradient.length()), (0.0, 0.0));
            assert_eq!((coverage.spread, coverage.friction), Default::default());
        }
    }

    #[test]
    fn one_face_is_exact_with_its_moment() {
        let n = DVec3::new(0.6, 0.0, 0.8);
        for distance in [0.0, 0.05, 0.2] {
            let coverage = Coverage::of_faces(&WALL, &Faces::from_slice(&[face(distance, n)]));
            let (part, gradient, moment) = brute_force(|y| y.dot(n) < -distance);
            // the grid cuts cells at the face: some 1/N of them
            assert!((coverage.part - part).abs() < 3e-3, "{} {part}", coverage.part);
            assert!((coverage.gradient - gradient).length() < 2e-2 / H, "{} {gradient}", coverage.gradient);
            let found = coverage.spread.to_matrix() + DMat3::from_diagonal(DVec3::splat(coverage.part));
            assert!((found - moment).abs_diff_eq(DMat3::ZERO, 1e-2), "{found} {moment}");
        }
    }

    #[test]
    fn arcsines_are_known_well_enough() {
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            assert!((arcsine(x) - x.asin()).abs() < 7e-5, "{x}");
        }
    }

    #[test]
    fn faces_far_behind_change_nothing() {
        let wall = Wall::in_layers(WallKernel::WendlandC2, H, H / 2.2);
        let near = face(0.1 * H, DVec3::X);
        let alone = Coverage::of_faces(&wall, &Faces::from_slice(&[near]));
        // a slab's other side, and its rim
        for far in [face(-1.2 * H, -DVec3::X), face(-3.0 * H, DVec3::Y), face(-1e30, DVec3::Z)] {
            let slab = Coverage::of_faces(&wall, &Faces::from_slice(&[Part::All(2), near, far]));
            // all but the rounding of a + 1 − 1
            assert!((slab.part - alone.part).abs() < 1e-15, "{slab:?} {alone:?}");
            assert_eq!(slab.friction.tensor, alone.friction.tensor);
            assert!(
                slab.behind.across.to_matrix().abs_diff_eq(alone.behind.across.to_matrix(), 1e-15),
                "{slab:?}"
            );
            let Coverage { part, filled, behind, barrier, friction, .. } = alone;
            assert_eq!(Coverage { part, filled, behind, barrier, friction, ..slab }, alone);
        }
    }

    /// A wall that lets the fluid slip stands for the mirrored flow behind it. So beside such walls the
    /// friction of another wall is the same as far from them, and friction within the fluid is a sum over
    /// what they have left.
    #[test]
    fn slippery_walls_do_not_change_the_friction_of_others() {
        let viscosity = 0.3;
        let (drag, velocity) = (DVec3::new(0.4, -1.0, 2.0), DVec3::new(-0.7, 1.1, 0.2));
        let floor = Coverage::of_faces(&WALL, &Faces::from_slice(&[face(0.2 * H, DVec3::X)]));
        let wanted = floor.friction.complete(drag, velocity, viscosity);
        for [y, z] in [[0.15, 2.0], [0.4, 0.6], [0.3, 0.1]] {
            let sides = [face(y * H, DVec3::Y), face(z * H, DVec3::Z)].map(|side| {
                let mut side = Coverage::of_faces(&WALL, &Faces::from_slice(&[side]));
                side.let_slip();
                side
            });
            let left = (1.0 - sides[0].part) * (1.0 - sides[1].part);
            for whole in [floor.or(&sides[0]).or(&sides[1]), sides[1].or(&floor).or(&sides[0])] {
                let found = whole.friction.complete(left * drag, velocity, viscosity);
                assert!((found - wanted).length() < 1e-3, "{found} {wanted}");
            }
        }
    }

    /// Largest error of λ over places around an edge whose faces' normals have this cosine.
    fn worst_at_edge(cosine: f64, all: bool) -> f64 {
        let (n, m) = (DVec3::X, DVec3::new(cosine, (1.0 - cosine * cosine).sqrt(), 0.0));
        let mut worst: f64 = 0.0;
        for (a, b) in [(0.0, 0.0), (0.0, 0.1), (0.1, 0.1), (0.05, 0.2), (-0.05, 0.05), (-0.1, 0.2)] {
            let behind = |y: DVec3| (y.dot(n) < -a, y.dot(m) < -b);
            let head = if all { Part::All(2) } else { Part::Any(2) };
            let faces = Faces::from_slice(&[head, face(a, n), face(b, m)]);
            let found = Coverage::of_faces(&WALL, &faces).part;
            let (exact, ..) = brute_force(|y| {
                let (first, second) = behind(y);
                if all { first && second } else { first || second }
            });
            worst = worst.max((found - exact).abs());
        }
        worst
    }

    #[test]
    fn edges_of_any_angle_are_known_to_a_few_hundredths() {
        for cosine in [-0.95, -0.7, -0.3, 0.0, 0.3, 0.7, 0.95] {
            for all in [true, false] {
                let worst = worst_at_edge(cosine, all);
                println!("cosine {cosine}, {}: {worst:.4}", if all { "all" } else { "any" });
                assert!(worst < 0.03, "{cosine} {all}: {worst}");
            }
        }
    }

    /// Walls that all move with one velocity have it behind them, and so has what slips along them with it:
    /// on one wall, in corners, between walls, and behind the edge of two.
    #[test]
    fn what_moves_as_one_has_one_velocity_behind_its_walls() {
        let velocity = DVec3::new(2.0, -1.0, 0.5);
        let (x, y, slanted) = (face(0.1 * H, DVec3::X), face(0.2 * H, DVec3::Y), face(0.3 * H, DVec3::ONE));
        let faces = [
            vec![x],
            vec![Part::Any(2), x, y],
            vec![Part::All(2), x, y],
            vec![Part::Any(3), x, y, slanted],
            vec![Part::Any(2), face(0.4 * H, DVec3::X), face(0.5 * H, -DVec3::X)],
        ];
        for faces in faces {
            let mut wall = Coverage::of_faces(&WALL, &Faces::from_slice(&faces));
            wall.set_in_motion(velocity);
            let behind = wall.velocity_behind(velocity);
            assert!((behind - velocity).length() < 1e-9, "{faces:?}: {behind}");
            // joined to a wall at rest it is dragged by that
            let floor = Coverage::of_faces(&WALL, &Faces::from_slice(&[face(0.2 * H, DVec3::Z)]));
            let both = wall.or(&floor).velocity_behind(DVec3::ZERO);
            assert!(both.z.abs() < velocity.z, "{faces:?}: {both}");
        }
        // one wall alone has no motion along itself but that of the fluid
        let mut wall = Coverage::of_faces(&WALL, &Faces::from_slice(&[x]));
        wall.set_in_motion(velocity);
        let behind = wall.velocity_behind(DVec3::new(7.0, 3.0, 4.0));
        assert!((behind - DVec3::new(2.0, 3.0, 4.0)).length() < 1e-9, "{behind}");
    }

    /// Between two walls, in an edge and in a corner no direction is stretched beyond the limit, and
    /// directions in which a single wall stretches keep its stretching.
    #[test]
    fn no_direction_is_stretched_beyond_the_limit() {
        let across = Symmetric::square(DVec3::new(0.6, 0.8, 0.0));
        let along = DVec3::new(-0.8, 0.6, 0.0);
        for (part, spread) in [(0.3, 0.1), (0.5, 0.45), (0.6, 0.39), (0.6, 0.7), (0.9, 0.05), (1.0, 0.0)] {
            let wall: super::Coverage =
                super::Coverage { part, spread: spread * across, ..Default::default() };
            let completion = wall.completion();
            let stretch = |direction: DVec3| (completion * direction).dot(direction);
            let limited = |free: f64| 1.0 / free.max(LEAST_FREE);
            assert!((stretch(DVec3::new(0.6, 0.8, 0.0)) - limited(1.0 - part - spread)).abs() < 1e-12);
            assert!((stretch(along) - limited(1.0 - part)).abs() < 1e-12);
            assert!((stretch(DVec3::Z) - limited(1.0 - part)).abs() < 1e-12);
        }
    }
}
