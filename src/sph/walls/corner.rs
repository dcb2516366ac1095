//! The corner where two flat walls meet, as a particle in it sees it.
//!
//! The pressure of a fluid near a wall that stands alone adds up to p for each part of the wall's area,
//! because a column of fluid above it takes ½ of a kernel, and the pressure counts twice. In an acute corner,
//! columns above a wall end at the other wall; in an obtuse one, there is fluid without a wall below it. So a
//! particle presses on a wall if its foot is on it, and so does its mirror image behind the other wall. In a
//! right-angled corner that gives the same as a wall that is alone. (Without this a wall of the corner θ is
//! off by 0.21·cot θ·p·h for each part of the edge. Below 45° there are images of images, which are left out:
//! there it is off by 0.21·cot 2θ·p·h.)
//!
//! The places behind both faces lie in a wedge along the edge. Integrals along the edge and away from the
//! particle come from a table, the one over the angle around the particle from a sum.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::{DMat3, DVec3};

use super::symmetric::Symmetric;
use crate::field::Face;

/// Two faces meet in a corner if the square of the sine of their angle is at least this, some ten degrees.
const LEAST_SQUARED_SINE: f64 = 0.03;

/// Rows of the table.
const ROWS: usize = 64;

/// Places and weights of Gauss's formula with six places in −1 to 1; the others lie at the negative places.
const GAUSS: [[f64; 2]; 3] = [
    [0.238_619_186_083_196_9, 0.467_913_934_572_691],
    [0.661_209_386_466_264_5, 0.360_761_573_048_138_6],
    [0.932_469_514_203_152, 0.171_324_492_379_170_4],
];

/// The edge in which two faces would meet, seen from a particle.
pub(super) struct Corner {
    /// The distances to the faces, m.
    distance: [f64; 2],
    /// The directions into the walls.
    into: [DVec3; 2],
    /// The direction of the edge.
    along: DVec3,
    cosine: f64,
    squared_sine: f64,
}

/// Integrals of a kernel (Wendland C2) over a part of the wall.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seen {
    /// ∇λ, 1/m.
    pub gradient: DVec3,
    /// K = ∫ y ⊗ ∇W.
    pub moment: DMat3,
}

impl Corner {
    /// The corner of two faces before a particle; `None` if they are nearly parallel, one of them is not
    /// before it, or what lies behind both is beyond the support radius h, m.
    pub fn of(one: &Face, other: &Face, h: f64) -> Option<Self> {
        let cosine = one.normal.dot(other.normal);
        let squared_sine = 1.0 - cosine * cosine;
        let distance = [one.distance, other.distance];
        let is_before = distance.iter().all(|distance| *distance > -h * ON_FACE);
        if squared_sine < LEAST_SQUARED_SINE || !is_before {
            return None;
        }
        let into = [-one.normal, -other.normal];
        let along = into[0].cross(into[1]).normalize();
        let distance = distance.map(|distance| distance.max(h * ON_FACE));
        let corner = Self { distance, into, along, cosine, squared_sine };
        // the nearest place behind both: the foot on one of the faces, if that is behind the other, or the
        // edge
        let feet = [0, 1].map(|on| (corner.foot(on) < 0.0).then_some(distance[on]));
        let nearest = feet.into_iter().flatten().fold(f64::INFINITY, f64::min);
        let nearest = if nearest.is_finite() { nearest } else { corner.edge([0.0, 0.0]).length() };
        (nearest < h).then_some(corner)
    }

    /// The way from the particle to the edge, and from there to the place that lies so deep in both walls, m.
    pub fn edge(&self, depth: [f64; 2]) -> DVec3 {
        let [to_one, to_other] = [self.distance[0] + depth[0], self.distance[1] + depth[1]];
        let along_one = (to_one - self.cosine * to_other) / self.squared_sine;
        let along_other = (to_other - self.cosine * to_one) / self.squared_sine;
        along_one * self.into[0] + along_other * self.into[1]
    }

    /// The distances, m, from which a particle presses on a wall, which is the first or the second of the
    /// faces: its own, and that of its mirror image behind the other face, if their feet are on the wall.
    pub fn pressing(&self, on: usize) -> [Option<f64>; 2] {
        let (to_wall, to_other) = (self.distance[on], self.distance[1 - on]);
        let foot = self.foot(on);
        let way = 2.0 * to_other * self.into[1 - on];
        let mirrored = [to_wall - way.dot(self.into[on]), foot + way.dot(self.outward(on))];
        [[to_wall, foot], mirrored].map(|[to_wall, foot]| (foot >= 0.0 && to_wall >= 0.0).then_some(to_wall))
    }

    /// How far from the edge the particle's foot on a wall is, m; negative beyond the edge.
    fn foot(&self, on: usize) -> f64 {
        -self.edge([0.0, 0.0]).dot(self.outward(on))
    }

    /// The direction along a wall away from the edge.
    fn outward(&self, on: usize) -> DVec3 {
        (self.cosine * self.into[on] - self.into[1 - on]) / self.squared_sine.sqrt()
    }

    /// What lies behind both faces.
    pub fn behind_both(&self, h: f64) -> Seen {
        let edge = self.edge([0.0, 0.0]);
        let mut seen = Seen::default();
        for first in [0, 1] {
            // angles around the particle, from the direction into the second wall towards that into the
            // first, on that side of the edge on which the second face is the farther one
            let [to_first, to_second] = [self.into[first], self.into[1 - first]];
            let beside = (to_first - self.cosine * to_second) / self.squared_sine.sqrt();
            let depth = self.distance[1 - first] / h;
            let to_edge = edge.dot(beside).atan2(edge.dot(to_second));
            let end = depth.clamp(-1.0, 1.0).acos();
            if to_edge >= end {
                continue;
            }
            let (middle, half) = (0.5 * (to_edge + end), 0.5 * (end - to_edge));
            let square = |n: DVec3| Symmetric::square(n).to_matrix();
            for [place, weight] in GAUSS {
                for place in [-place, place] {
                    let angle = middle + half * place;
                    let direction = angle.cos() * to_second + angle.sin() * beside;
                    let [slope, across, along] = TABLE.at(depth / angle.cos());
                    seen.gradient += half * weight * slope / h * direction;
                    seen.moment += half * weight * (across * square(direction) + along * square(self.along));
                }
            }
        }
        seen
    }
}

/// Least distance of a particle before a face, over the support radius.
const ON_FACE: f64 = 1e-6;

/// Integrals over all places on a ray's half-plane, spanned by the ray and the edge's direction, that are
/// farther than q from the line through the particle along the edge, for each angle: of |∇W| across that
/// line, in 1/h, and of the components of y ⊗ ∇W across and along it.
struct Table {
    rows: [[f64; 3]; ROWS + 1],
}

static TABLE: LazyLock<Table> = LazyLock::new(Table::new);

impl Table {
    fn new() -> Self {
        // parts of a row, and of the half chord along the edge
        const PARTS: usize = 8;
        const CHORD: usize = 64;
        let mut rows = [[0.0; 3]; ROWS + 1];
        for row in (0..ROWS).rev() {
            let mut sums = rows[row + 1];
            for part in 0..PARTS {
                let step = 1.0 / (ROWS * PARTS) as f64;
                let q = (row * PARTS + part) as f64 * step + 0.5 * step;
                let half = (1.0 - q * q).sqrt();
                for k in 0..CHORD {
                    let z = half * (k as f64 + 0.5) / CHORD as f64;
                    let t = (q * q + z * z).sqrt();
                    // −W'/t of w = 21/2π·(1 − t)⁴·(1 + 4t) is 420/2π·(1 − t)³ ; both halves of the chord
                    let slope = 420.0 / (2.0 * PI) * (1.0 - t).powi(3);
                    let weight = 2.0 * half / CHORD as f64 * step * q * slope;
                    sums[0] += weight * q;
                    sums[1] += weight * q * q;
                    sums[2] += weight * z * z;
                }
            }
            rows[row] = sums;
        }
        Self { rows }
    }

    fn at(&self, q: f64) -> [f64; 3] {
        let place = q.clamp(0.0, 1.0) * ROWS as f64;
        let row = (place as usize).min(ROWS - 1);
        let part = place - row as f64;
        std::array::from_fn(|k| self.rows[row][k] + part * (self.rows[row + 1][k] - self.rows[row][k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sph::walls::WallKernel;

    const H: f64 = 0.3;

    fn face(degrees: f64, distance: f64) -> Face {
        let (sin, cos) = degrees.to_radians().sin_cos();
        Face { distance, normal: DVec3::new(-sin, 0.0, cos), mean_curvature: 0.0 }
    }

    #[test]
    fn edges_are_found_at_any_angle() {
        for degrees in [30.0, 60.0, 90.0, 120.0, 150.0, -60.0] {
            let faces = [face(0.0, 0.1 * H), face(degrees, 0.08 * H)];
            let corner = Corner::of(&faces[0], &faces[1], H).unwrap();
            let way = corner.edge([0.02, -0.01]);
            for (face, depth) in faces.iter().zip([0.02, -0.01]) {
                assert!((-way.dot(face.normal) - face.distance - depth).abs() < 1e-12, "{degrees}: {way}");
            }
        }
        assert!(Corner::of(&face(0.0, 0.1), &face(180.0, 0.1), H).is_none());
        assert!(Corner::of(&face(0.0, 0.1), &face(5.0, 0.1), H).is_none());
        assert!(Corner::of(&face(0.0, 0.25), &face(90.0, 0.25), H).is_none());
    }

    /// What lies behind both faces, against sums over a grid of the support's box.
    #[test]
    fn integrals_behind_both_faces_are_those_by_brute_force() {
        const N: i32 = 100;
        let step = 2.0 * H / f64::from(N);
        let place = |i: i32| -H + (f64::from(i) + 0.5) * step;
        for (degrees, to_one, to_other) in
            [(90.0, 0.1, 0.3), (90.0, 0.0, 0.2), (45.0, 0.2, 0.25), (120.0, 0.15, 0.2), (135.0, 0.3, 0.1)]
        {
            let faces = [face(0.0, to_one * H), face(degrees, to_other * H)];
            let found = Corner::of(&faces[0], &faces[1], H).unwrap().behind_both(H);
            let mut exact = Seen::default();
            for (i, j, k) in (0..N).flat_map(|i| (0..N).flat_map(move |j| (0..N).map(move |k| (i, j, k)))) {
                let y = DVec3::new(place(i), place(j), place(k));
                let q = y.length() / H;
                if q >= 1.0 || faces.iter().any(|face| -y.dot(face.normal) < face.distance) {
                    continue;
                }
                let slope = (step / H).powi(3) * 420.0 / (2.0 * PI) * (1.0 - q).powi(3) / (H * H);
                exact.gradient += slope * y;
                exact.moment += slope * DMat3::from_cols(y.x * y, y.y * y, y.z * y);
            }
            println!("{degrees} {to_one} {to_other}: {} {}", found.gradient * H, exact.gradient * H);
            assert!((found.gradient - exact.gradient).length() * H < 0.01);
            assert!((found.moment - exact.moment).abs_diff_eq(DMat3::ZERO, 0.005));
        }
    }

    /// Fluid of one pressure in a corner of any angle from 45° on presses on both walls as on their areas.
    #[test]
    fn a_corner_of_any_angle_is_pressed_like_its_walls() {
        let kernel = WallKernel::WendlandC2;
        for degrees in [45.0_f64, 60.0, 90.0, 120.0, 150.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            // the floor lies at z = 0, x > 0, the other wall rises from its end
            let normal = DVec3::new(sin, 0.0, -cos);
            let reach = 1.5 * H / sin;
            let (steps, length) = (1200, reach + H);
            let cell = length / f64::from(steps);
            let place = |i: i32| (f64::from(i) + 0.5) * cell;
            let mut pressed = 0.0;
            for (i, k) in (-steps..steps).flat_map(|i| (0..steps).map(move |k| (i, k))) {
                let p = DVec3::new(place(i), 0.0, place(k));
                let to_wall = p.dot(normal);
                if to_wall < 0.0 || p.z > H || p.x > reach {
                    continue;
                }
                let floor = Face { distance: p.z, normal: DVec3::Z, mean_curvature: 0.0 };
                let wall = Face { distance: to_wall, normal, mean_curvature: 0.0 };
                // far from the edge it is alone
                let distances =
                    Corner::of(&floor, &wall, H).map_or([Some(p.z), None], |corner| corner.pressing(0));
                pressed += distances.into_iter().flatten().map(|d| kernel.slope(d / H)).sum::<f64>();
            }
            pressed *= 2.0 * cell * cell / H;
            println!("{degrees}: {:.4}", (pressed - reach) / H);
            assert!((pressed - reach).abs() < 0.01 * H, "{degrees}: {pressed} for {reach}");
        }
    }
}
