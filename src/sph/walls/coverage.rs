//! What the walls around a particle take of its kernel: the closed forms of [`Wall`] for each face that is near,
//! joined as the faces are joined.
//!
//! For two faces A and B the part of the kernel behind both is λ_A·λ_B where they meet at a right angle, the smaller of
//! the two where they look the same way, and what exceeds one where they face each other. Between these the weight
//! (2/π)·arcsin|n_A·n_B| leads over: at the edge itself, λ_A = λ_B = ½, that is exact for every kernel, because there
//! the wedge's angle alone counts. "Any of" follows by complement.
//!
//! With λ go its gradient ∇λ = ∫ ∇W over the wall, and the moment K = ∫ y ⊗ ∇W (y from the particle): integrating by
//! parts over a half-space leaves K = λ·1 + d·(A/h)·n⊗n. With K a pressure that is linear in space is continued into the
//! wall: a column of fluid at rest stays so, whatever the shape of its vessel.
//!
//! (So for a wall that is continuous; of one in layers both terms are sums over them, see [`Wall`].)
//!
//! Invariant: 0 ≤ λ ≤ 1; beyond the support radius of every face all is zero.

use glam::{DMat3, DVec3};

use crate::field::{Face, Faces, Part};

use super::kernel::{OfFace, Wall};

/// Curvatures are believed up to this part of 1/h: beyond it the series behind the correction does not hold.
const MOST_CURVED: f64 = 0.4;

/// Corrections for walls divide by what is left of the kernel, but never by less than this.
pub(in crate::sph) const LEAST_FREE: f64 = 0.25;

/// A face nearer than this part of the support radius counts as so near where a velocity's slope is asked for.
const NEAREST: f64 = 0.1;

/// Integrals of a kernel over the walls near a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::sph) struct Coverage {
    /// λ = ∫ W, 0 to 1.
    pub part: f64,
    /// ∇λ = ∫ ∇W, 1/m, out of the fluid.
    pub gradient: DVec3,
    /// K − λ·1 = Σ d·(A/h)·n⊗n over the faces.
    pub spread: DMat3,
    /// Σ (A/h)/d·(1 − n⊗n), 1/m², over the faces to which the fluid sticks: what it feels of a velocity.
    pub drag: DMat3,
    /// λ of the walls along which the fluid slips.
    pub slippery: f64,
    /// ∇λ·v of walls that move, 1/s.
    pub sweep: f64,
    /// The drag of the walls' own velocity, 1/(m·s).
    pub haul: DVec3,
}

/// Nothing is covered. (A matrix is the identity by default.)
impl Default for Coverage {
    fn default() -> Self {
        Self {
            part: 0.0,
            gradient: DVec3::ZERO,
            spread: DMat3::ZERO,
            drag: DMat3::ZERO,
            slippery: 0.0,
            sweep: 0.0,
            haul: DVec3::ZERO,
        }
    }
}

impl Coverage {
    /// One face.
    pub fn of_face(wall: &Wall, face: &Face) -> Self {
        let h = wall.h;
        let delta = face.distance / h;
        if delta >= 1.0 {
            return Self::default();
        }
        let curvature = (face.mean_curvature * h).clamp(-MOST_CURVED, MOST_CURVED);
        let OfFace { part, area, spread } = wall.of_face(delta, curvature);
        let n = face.normal;
        let along = DMat3::from_cols(n * n.x, n * n.y, n * n.z);
        Self {
            part,
            gradient: -area / h * n,
            spread: spread * along,
            drag: area / (h * face.distance.max(NEAREST * h)) * (DMat3::IDENTITY - along),
            ..Self::default()
        }
    }

    /// All of these walls move with one velocity.
    pub fn set_in_motion(&mut self, velocity: DVec3) {
        self.sweep = self.gradient.dot(velocity);
        self.haul = self.drag * velocity;
    }

    /// The fluid slips along all of these walls.
    pub fn let_slip(&mut self) {
        self.drag = DMat3::ZERO;
        self.haul = DVec3::ZERO;
        self.slippery = self.part;
    }

    /// All of these walls move within themselves, besides any other motion.
    pub fn take_along(&mut self, velocity: DVec3) {
        self.haul += self.drag * velocity;
    }

    /// A tree of faces, from its front.
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

    /// What lies behind both.
    pub fn and(&self, other: &Self) -> Self {
        let (part, da, db) = common(self.part, other.part, self.cosine(other));
        self.joined(other, part, da, db)
    }

    /// What lies behind either: all but what lies before both.
    pub fn or(&self, other: &Self) -> Self {
        if self.part == 0.0 || other.part == 0.0 {
            return if self.part == 0.0 { *other } else { *self };
        }
        // the complements' faces look the other way, both of them: the angle between them is the same
        let (part, da, db) = common(1.0 - self.part, 1.0 - other.part, self.cosine(other));
        self.joined(other, 1.0 - part, da, db)
    }

    /// Of the angle between the directions in which two walls lie.
    fn cosine(&self, other: &Self) -> f64 {
        self.gradient.normalize_or_zero().dot(other.gradient.normalize_or_zero()).clamp(-1.0, 1.0)
    }

    /// ⅓ tr K: the walls' part of the gradient of a position.
    pub fn share(&self) -> f64 {
        self.part + self.spread.diagonal().element_sum() / 3.0
    }

    /// (1 − K)⁻¹: makes of a sum over the fluid alone what it would be if the fluid went on behind the walls as it is
    /// before them. No direction is stretched by more than 1/[`LEAST_FREE`].
    pub fn completion(&self) -> DMat3 {
        let free = DMat3::from_diagonal(DVec3::splat((1.0 - self.part).max(LEAST_FREE)));
        let moment = free - self.spread;
        // along a face's normal K is at most ½ in the fluid; in corners the sum of several is held back
        let largest = DMat3::from_diagonal(DVec3::splat(1.0 / LEAST_FREE));
        if moment.determinant() < LEAST_FREE.powi(3) { largest } else { moment.inverse() }
    }

    fn joined(&self, other: &Self, part: f64, da: f64, db: f64) -> Self {
        Self {
            part: part.clamp(0.0, 1.0),
            gradient: da * self.gradient + db * other.gradient,
            spread: da * self.spread + db * other.spread,
            drag: da * self.drag + db * other.drag,
            slippery: da * self.slippery + db * other.slippery,
            sweep: da * self.sweep + db * other.sweep,
            haul: da * self.haul + db * other.haul,
        }
    }
}

/// The part of a kernel behind two faces of which each takes a and b, with its derivatives by a and b.
fn common(a: f64, b: f64, cosine: f64) -> (f64, f64, f64) {
    let weight = std::f64::consts::FRAC_2_PI * cosine.abs().asin();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::walls::WallKernel;

    const H: f64 = 0.3;
    const WALL: Wall = Wall { kernel: WallKernel::WendlandC2, h: H, layer: None };

    fn face(distance: f64, normal: DVec3) -> Part {
        Part::Face(Face { distance, normal: normal.normalize(), mean_curvature: 0.0 })
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
            // ∇W by the particle's place is against y
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
            assert_eq!((coverage.spread, coverage.drag), (DMat3::ZERO, DMat3::ZERO));
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
            let found = coverage.spread + DMat3::from_diagonal(DVec3::splat(coverage.part));
            assert!((found - moment).abs_diff_eq(DMat3::ZERO, 1e-2), "{found} {moment}");
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
}
