//! A box cut by the surface ω = 0, by tetrahedra: the surface in it, and the volume inside.
//!
//! In each of the six tetrahedra along the box's diagonal the surface is a plane through its crossings with the
//! edges. Neighbouring boxes share their crossings, so a surface cut by many boxes has no gaps.

use glam::DVec3;

/// The six tetrahedra of a box along its diagonal, by the numbers of its corners (x + 2y + 4z).
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// What lies in a box that a surface cuts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Cut {
    /// The area of the surface times its normal out of the inside, m².
    pub area: DVec3,
    /// The middle of the surface, m; the origin if there is none.
    pub middle: DVec3,
    /// The volume where ω ≥ 0, m³.
    pub inside: f64,
    /// The integral of the place over that volume, m⁴. Places count from the middle of the box.
    pub places: DVec3,
    /// The integrals of xx, yy, zz, yz, zx, xy over it, m⁵.
    pub squares: [f64; 6],
}

/// ω = 0 counts as inside, as it does where particles meet obstacles.
pub(crate) fn is_inside(omega: f64) -> bool {
    omega >= 0.0
}

/// Cuts the box with these corners, in the order of [`Aabb::corners`](crate::geom::Aabb::corners), and the values of ω
/// there.
pub(crate) fn cut(corners: &[DVec3; 8], values: &[f64; 8], omega: &dyn Fn(DVec3) -> f64) -> Cut {
    let (mut area, mut moment, mut whole) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    let mut filled = Filled { from: 0.5 * (corners[0] + corners[7]), ..Filled::default() };
    for tetrahedron in TETRAHEDRA {
        let place = |k: usize| corners[k];
        let crossing = |i: usize, o: usize| crossing((corners[i], values[i]), (corners[o], values[o]), omega);
        let (within, without): (Vec<usize>, Vec<usize>) =
            tetrahedron.into_iter().partition(|&k| is_inside(values[k]));
        let polygon: Vec<DVec3> = match (&within[..], &without[..]) {
            (&[a], &[p, q, r]) => {
                let polygon = vec![crossing(a, p), crossing(a, q), crossing(a, r)];
                filled.add(1.0, [place(a), polygon[0], polygon[1], polygon[2]]);
                polygon
            }
            (&[a, b, c], &[p]) => {
                let polygon = vec![crossing(a, p), crossing(b, p), crossing(c, p)];
                filled.add(1.0, [place(a), place(b), place(c), place(p)]);
                filled.add(-1.0, [place(p), polygon[0], polygon[1], polygon[2]]);
                polygon
            }
            (&[a, b], &[p, q]) => {
                let polygon = vec![crossing(a, p), crossing(a, q), crossing(b, q), crossing(b, p)];
                // a prism from the triangle at a to that at b
                filled.add(1.0, [place(a), polygon[0], polygon[1], polygon[2]]);
                filled.add(1.0, [place(a), polygon[0], polygon[2], polygon[3]]);
                filled.add(1.0, [place(a), place(b), polygon[2], polygon[3]]);
                polygon
            }
            (&[a, b, c, d], []) => {
                filled.add(1.0, [place(a), place(b), place(c), place(d)]);
                continue;
            }
            _ => continue, // four outside: partition gives no other
        };
        let out = place(without[0]) - place(within[0]);
        for k in 2..polygon.len() {
            let [a, b, c] = [polygon[0], polygon[k - 1], polygon[k]];
            let twice = (b - a).cross(c - a);
            let half = 0.5 * if twice.dot(out) < 0.0 { -twice } else { twice };
            let size = half.length();
            area += half;
            moment += size / 3.0 * (a + b + c);
            whole += size;
        }
    }
    let middle = if whole > 0.0 { moment / whole } else { DVec3::ZERO };
    Cut { area, middle, inside: filled.volume, places: filled.places, squares: filled.squares }
}

/// A sum of tetrahedra.
#[derive(Default)]
struct Filled {
    volume: f64,
    /// Where places count from.
    from: DVec3,
    /// The integral of the place.
    places: DVec3,
    /// The integrals of the products of coordinates.
    squares: [f64; 6],
}

impl Filled {
    fn add(&mut self, factor: f64, [a, b, c, d]: [DVec3; 4]) {
        let volume = factor * (b - a).cross(c - a).dot(d - a).abs() / 6.0;
        self.volume += volume;
        let corners = [a, b, c, d].map(|corner| corner - self.from);
        let sum: DVec3 = corners.iter().sum();
        self.places += 0.25 * volume * sum;
        // over a tetrahedron ∫ p⊗p is V/20·(Σ v⊗v + Σ v ⊗ Σ v)
        let square = |p: DVec3| [p.x * p.x, p.y * p.y, p.z * p.z, p.y * p.z, p.z * p.x, p.x * p.y];
        for p in corners.into_iter().chain([sum]) {
            for (total, of_one) in self.squares.iter_mut().zip(square(p)) {
                *total += volume / 20.0 * of_one;
            }
        }
    }
}

/// An edge is divided again while the last division has moved its crossing by more than this part of it.
const MOVED: f64 = 0.02;

/// Maximum number of divisions of an edge.
const DIVISIONS: usize = 8;

/// Where the surface crosses an edge, from a corner inside to one outside, with their ω: by the rule of false position,
/// twice where ω is nearly linear. Where it is not, as where conditions of different size are joined, an end that stays
/// counts half each time (the Illinois rule: Dowell and Jarratt, BIT 11, 1971).
fn crossing(
    (inside, w_in): (DVec3, f64),
    (outside, w_out): (DVec3, f64),
    omega: &dyn Fn(DVec3) -> f64,
) -> DVec3 {
    let place = |(low, w_low): (f64, f64), (high, w_high): (f64, f64)| {
        let part = w_low / (w_low - w_high);
        low + (high - low) * if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.5 }
    };
    let (mut low, mut high) = ((0.0, w_in), (1.0, w_out));
    let mut at = place(low, high);
    let mut was_inside = None;
    for _ in 0..DIVISIONS {
        let w = omega(inside.lerp(outside, at));
        let is_in = is_inside(w);
        let (moved, stays) = if is_in { (&mut low, &mut high) } else { (&mut high, &mut low) };
        *moved = (at, w);
        if was_inside == Some(is_in) {
            stays.1 *= 0.5;
        }
        was_inside = Some(is_in);
        let next = place(low, high);
        let step = (next - at).abs();
        at = next;
        if step <= MOVED {
            break;
        }
    }
    inside.lerp(outside, at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Aabb;

    /// A plane cuts a box exactly, however it lies.
    #[test]
    fn planes_cut_exactly() {
        let unit = Aabb::new(DVec3::ZERO, DVec3::new(1.0, 2.0, 0.5));
        let corners = unit.corners();
        for (normal, offset) in [(DVec3::X, 0.3), (DVec3::Z, 0.2), (DVec3::new(1.0, 2.0, -0.7), 1.1)] {
            let omega = |p: DVec3| offset - normal.dot(p);
            let found = cut(&corners, &corners.map(omega), &omega);
            // by a grid of points
            let n = 120;
            let points =
                (0..n * n * n).map(|k| DVec3::new((k % n) as f64, (k / n % n) as f64, (k / n / n) as f64));
            let below = points.filter(|p| omega((p + 0.5) / f64::from(n) * unit.max) > 0.0).count();
            let volume = below as f64 / f64::from(n).powi(3);
            assert!((found.inside - volume).abs() < 2e-3, "{} {volume}", found.inside);
            assert!(found.area.length() > 0.0 && found.area.cross(normal).length() < 1e-12, "{}", found.area);
            assert!(found.area.dot(normal) > 0.0 && omega(found.middle).abs() < 1e-12);
        }
    }
}
