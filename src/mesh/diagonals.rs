//! Decisions about ambiguous faces by ω itself.
//!
//! On a face of a cell whose corners lie inside and outside in turn, the values at the corners say which of
//! them are joined if ω is bilinear. At the rim of a wedge it is not: a node just inside the rim has a small
//! value, and would be parted from the solid behind it, as a crumb beside the edge. But a solid that holds
//! all of the straight line from one corner to the other joins them whatever the values are. The same holds
//! for the fluid. So ω is asked along the diagonal that has the sign of the face's middle. Where ω is
//! bilinear the values decide.
//!
//! Invariant: a decision depends on the face's corners and not on their order, so both cells at the face decide alike.

use glam::DVec3;

use super::cases::Ambiguous;
use crate::field::{Field, Points};

/// Places from the middle of a diagonal to one of its ends, as parts of it: even ones, and then ever nearer
/// to the end, beside which a small value may dip below zero. All have few binary digits, so that a part and
/// what is left of the whole are exact, and with them the places are the same bits from either end.
const PLACES: [f64; 18] = [
    7.0 / 16.0,
    3.0 / 8.0,
    5.0 / 16.0,
    1.0 / 4.0,
    3.0 / 16.0,
    1.0 / 8.0,
    3.0 / 32.0,
    1.0 / 16.0,
    3.0 / 64.0,
    1.0 / 32.0,
    3.0 / 128.0,
    1.0 / 64.0,
    3.0 / 256.0,
    1.0 / 128.0,
    3.0 / 512.0,
    1.0 / 256.0,
    3.0 / 1024.0,
    1.0 / 512.0,
];

/// Departures of ω in the middle of a face, as parts of its largest value, that are rounding.
const BILINEAR: f64 = 1e-9;

/// The corners around a face, with their values.
pub(super) type FaceCorners = [(DVec3, f64); 4];

/// How the corners of ambiguous faces are joined. Each face is given by its corners and their values, around
/// it, of which the first and the third are inside. `None` where ω is bilinear, or where ω along the
/// diagonals leaves the choice. Adds to the number of evaluations.
pub(super) fn joined(
    field: &dyn Field,
    faces: &[FaceCorners],
    evaluations: &mut u64,
) -> Vec<Option<Ambiguous>> {
    let mut values_at = |places: &[DVec3]| -> Vec<f64> {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| places.iter().map(|p| p[axis]).collect::<Vec<f64>>());
        let mut omega = vec![0.0; places.len()];
        field.continuous_many(Points { x: &x, y: &y, z: &z }, &mut omega);
        *evaluations += places.len() as u64;
        omega
    };
    let middles: Vec<DVec3> = faces.iter().map(|[a, _, c, _]| on(a.0, c.0, 0.5)).collect();
    let middles = values_at(&middles);
    let diagonal = |([a, b, c, d], middle): (&FaceCorners, &f64)| {
        let (p, q) = if *middle > 0.0 { (a.0, c.0) } else { (b.0, d.0) };
        PLACES.into_iter().flat_map(move |part| [on(p, q, part), on(q, p, part)])
    };
    let along: Vec<DVec3> = faces.iter().zip(&middles).flat_map(diagonal).collect();
    let along = values_at(&along);
    let decide = |((face, middle), along): ((&FaceCorners, &f64), &[f64])| {
        let inside = *middle > 0.0;
        let is_whole = along.iter().all(|value| (*value > 0.0) == inside);
        let decision = if inside { Ambiguous::JoinSolid } else { Ambiguous::PartSolid };
        (is_whole && !is_bilinear(face, *middle)).then_some(decision)
    };
    faces.iter().zip(&middles).zip(along.chunks_exact(2 * PLACES.len())).map(decide).collect()
}

/// The place at a part of the way from p to q. A sum of two products is the same bits in either order.
fn on(p: DVec3, q: DVec3, part: f64) -> DVec3 {
    (1.0 - part) * p + part * q
}

/// Whether ω in the middle of a face is what its corners say, so that they are to be believed.
fn is_bilinear([a, b, c, d]: &FaceCorners, middle: f64) -> bool {
    let largest = [a, b, c, d].iter().fold(0.0, |largest: f64, corner| largest.max(corner.1.abs()));
    (0.25 * ((a.1 + c.1) + (b.1 + d.1)) - middle).abs() <= BILINEAR * largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;

    const SQUARE: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];

    fn decide(omega: impl Fn(DVec3) -> f64 + Send + Sync) -> Option<Ambiguous> {
        let square = SQUARE.map(|corner| (corner, omega(corner)));
        let field = Closures { omega, gradient: |_: DVec3| DVec3::ZERO };
        let mut evaluations = 0;
        let found = joined(&field, &[square], &mut evaluations);
        assert_eq!(evaluations, 37);
        let [a, b, c, d] = square;
        assert_eq!(joined(&field, &[[c, d, a, b]], &mut 0), found, "the other way round");
        found[0]
    }

    #[test]
    fn places_are_the_same_bits_from_either_end() {
        for k in 0..1000 {
            let number = |i: u32| (f64::from(k * 7 + i) * 0.754_877_666).fract() * 3.0 - 1.0;
            let (p, q) =
                (DVec3::new(number(1), number(2), number(3)), DVec3::new(number(4), number(5), number(6)));
            for part in PLACES {
                assert_eq!(on(p, q, part), on(q, p, 1.0 - part), "{p} {q} {part}");
            }
        }
    }

    #[test]
    fn what_holds_the_whole_diagonal_joins_its_ends() {
        // a bar along the diagonal, which is thin at one end: by its values, 0.01·0.21 < 1.89², it would be parted
        let bar = |p: DVec3| 0.01 + 0.1 * (p.x + p.y) - 2.0 * (p.x - p.y).abs();
        assert_eq!(decide(bar), Some(Ambiguous::JoinSolid));
        assert_eq!(
            decide(|p| 0.01 + 0.05 * (p.x + p.y - 1.0).abs() - 2.0 * (p.x - p.y).abs()),
            Some(Ambiguous::JoinSolid)
        );
    }

    #[test]
    fn a_gap_across_the_diagonal_parts_its_ends() {
        assert_eq!(decide(|p| (p.x + p.y - 1.0).abs() - 0.3), Some(Ambiguous::PartSolid));
    }

    #[test]
    fn where_neither_diagonal_is_whole_the_values_decide() {
        // solid in the middle and at the ends, with gaps between
        let omega = |p: DVec3| ((p.x + p.y - 1.0).abs() - 0.5).abs() - 0.2;
        assert_eq!(decide(omega), None);
        // bilinear, with corners 0.001, 1 inside and −0.04 outside: parted, by a narrow gap beside the first corner
        let bilinear = |p: DVec3| {
            let (u, v) = (p.x, p.y);
            0.001 * (1.0 - u) * (1.0 - v) + u * v - 0.04 * (u * (1.0 - v) + v * (1.0 - u))
        };
        assert_eq!(decide(bilinear), None);
    }
}
