//! Curves as chains of points: arcs, helices and splines, refined until no point of the curve is farther from the chain
//! than a tolerance.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

/// The most points of one curve.
pub(super) const MOST_POINTS: usize = 10_000;

/// Sines below this are those of rounded angles.
const STRAIGHT: f64 = 1e-12;

/// A path that turns back by more than 150° has an edge there, as wings have it: the cosine of the turn.
const SHARP: f64 = -0.866_025_403_784_438_6;

/// What is wrong with a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flaw {
    /// The three points of an arc lie on a line, or two of them are one.
    OnALine,
    /// This point of a spline is the one before it.
    Repeated(usize),
    /// A spline through less than two points, or a closed one through less than three.
    TooFew,
    /// The tolerance asks for more than [`MOST_POINTS`].
    TooFine,
    /// Some numbers are so large that their squares are infinite.
    TooLarge,
    /// The path turns back at this point.
    TurnsBack(usize),
    /// The pieces beside this point are too short for the arcs at their ends.
    NoRoom(usize),
}

/// How many chords of an arc stay within a tolerance of it.
fn chords(radius: f64, angle: f64, tolerance: f64) -> Result<usize, Flaw> {
    // the middle of a chord is r·(1 − cos(φ/2)) = 2r·sin²(φ/4) below the arc
    let sine = (0.5 * tolerance / radius).sqrt();
    let widest = if sine < 0.5 { 4.0 * libm::asin(sine) } else { TAU / 3.0 };
    whole(angle.abs() / widest)
}

/// The next whole number, at least 1.
fn whole(count: f64) -> Result<usize, Flaw> {
    if count.is_nan() || count.is_infinite() {
        return Err(Flaw::TooLarge);
    }
    // a count that is whole but for rounding is meant to be whole
    let count = (count - 1e-9).ceil().max(1.0);
    if count < MOST_POINTS as f64 { Ok(count as usize) } else { Err(Flaw::TooFine) }
}

/// The circle around a centre from one angle to another, with both ends. It lies in the plane z = 0.
pub(super) fn arc(
    centre: DVec3,
    radius: f64,
    [from, to]: [f64; 2],
    tolerance: f64,
) -> Result<Vec<DVec3>, Flaw> {
    let count = chords(radius, to - from, tolerance)?;
    let at = |i: usize| {
        let angle = from + (to - from) * (i as f64 / count as f64);
        centre + radius * DVec3::new(libm::cos(angle), libm::sin(angle), 0.0)
    };
    let mut points: Vec<DVec3> = (0..=count).map(at).collect();
    if (to - from).abs() >= TAU * (1.0 - STRAIGHT) {
        points[count] = points[0];
    }
    finite(points)
}

/// The arc from the first point through the second one to the third one. Its radius is given to `tolerance`.
pub(super) fn arc_through([a, b, c]: [DVec3; 3], tolerance: impl Fn(f64) -> f64) -> Result<Vec<DVec3>, Flaw> {
    let (u, v) = (b - a, c - a);
    let across = u.cross(v);
    if !across.length_squared().is_finite() {
        return Err(Flaw::TooLarge);
    }
    let is_flat = |p: DVec3, q: DVec3| across.length() <= STRAIGHT * p.length() * q.length();
    if is_flat(u, v) || is_flat(u, c - b) {
        return Err(Flaw::OnALine);
    }
    let to_centre = (v.length_squared() * across.cross(u) + u.length_squared() * v.cross(across))
        / (2.0 * across.length_squared());
    let radius = to_centre.length();
    let ahead = -to_centre / radius;
    let aside = (across / across.length()).cross(ahead);
    let end = v - to_centre;
    let angle = libm::atan2(end.dot(aside), end.dot(ahead));
    let angle = if angle > 0.0 { angle } else { angle + TAU };
    let count = chords(radius, angle, tolerance(radius))?;
    let at = |i: usize| match i {
        0 => a,
        i if i == count => c,
        i => {
            let turned = angle * (i as f64 / count as f64);
            a + to_centre + radius * (libm::cos(turned) * ahead + libm::sin(turned) * aside)
        }
    };
    finite((0..=count).map(at).collect())
}

/// A helix around z from `[radius, 0, 0]` upwards; negative turns go clockwise.
pub(super) fn helix(radius: f64, pitch: f64, turns: f64, tolerance: f64) -> Result<Vec<DVec3>, Flaw> {
    let count = chords(radius, TAU * turns, tolerance)?;
    let at = |i: usize| {
        let part = i as f64 / count as f64;
        let angle = TAU * turns * part;
        DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), pitch * turns.abs() * part)
    };
    finite((0..=count).map(at).collect())
}

/// The straight ways between points that a curve goes through.
struct Legs {
    /// Whether the last point is the first.
    closed: bool,
    lengths: Vec<f64>,
    /// The directions of the ways, of length 1.
    ahead: Vec<DVec3>,
}

impl Legs {
    fn between(points: &[DVec3]) -> Result<Self, Flaw> {
        let pieces = points.len().saturating_sub(1);
        let closed = points.first() == points.last();
        if pieces < if closed { 3 } else { 1 } {
            return Err(Flaw::TooFew);
        }
        if let Some(i) = (1..=pieces).find(|&i| points[i] == points[i - 1]) {
            return Err(Flaw::Repeated(i));
        }
        let lengths: Vec<f64> = points.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
        if !lengths.iter().all(|length| length.is_normal()) {
            return Err(Flaw::TooLarge);
        }
        let ahead = points.windows(2).zip(&lengths).map(|(pair, length)| (pair[1] - pair[0]) / *length);
        let ahead = ahead.collect();
        Ok(Self { closed, lengths, ahead })
    }
}

/// The cubic spline through points, over the length of the chords between them: its direction and its curvature have no
/// jumps. Its ends are straight; if the last point is the first one, it is closed and as smooth there as elsewhere, unless
/// the points turn back there: a spline around the sharp edge of a wing would cross itself.
pub(super) fn spline(points: &[DVec3], tolerance: f64) -> Result<Vec<DVec3>, Flaw> {
    let Legs { closed, lengths, ahead } = Legs::between(points)?;
    let turns_back = matches!(&ahead[..], [first, .., last] if first.dot(*last) < SHARP);
    let bends =
        if closed && !turns_back { closed_bends(&lengths, &ahead) } else { open_bends(&lengths, &ahead) };
    let mut chain = vec![points[0]];
    for i in 0..lengths.len() {
        let (length, from, to) = (lengths[i], bends[i], bends[i + 1]);
        // a chord over a step h of the parameter is no farther from the curve than h²/8 times its largest bend
        let bend = from.length().max(to.length());
        let count = whole(length * (bend / (8.0 * tolerance)).sqrt())?;
        if chain.len() + count > MOST_POINTS {
            return Err(Flaw::TooFine);
        }
        for step in 1..count {
            let b = step as f64 / count as f64;
            let a = 1.0 - b;
            let bent = ((a * a * a - a) * from + (b * b * b - b) * to) * (length * length / 6.0);
            chain.push(a * points[i] + b * points[i + 1] + bent);
        }
        chain.push(points[i + 1]);
    }
    finite(chain)
}

/// Bézier curves of third order, each of which begins where the one before ends.
pub(super) fn beziers(curves: &[[DVec3; 4]], tolerance: f64) -> Result<Vec<DVec3>, Flaw> {
    let mut chain: Vec<DVec3> = curves.first().map(|curve| curve[0]).into_iter().collect();
    for &[p, q, r, s] in curves {
        let bend = 6.0 * (p - 2.0 * q + r).length().max((q - 2.0 * r + s).length());
        // rounding bends straight pieces
        let bend = if bend <= STRAIGHT * (s - p).length() { 0.0 } else { bend };
        let count = whole((bend / (8.0 * tolerance)).sqrt())?;
        if chain.len() + count > MOST_POINTS {
            return Err(Flaw::TooFine);
        }
        for step in 1..count {
            let b = step as f64 / count as f64;
            let a = 1.0 - b;
            chain.push(a * a * a * p + 3.0 * a * a * b * q + 3.0 * a * b * b * r + b * b * b * s);
        }
        chain.push(s);
    }
    finite(chain)
}

/// A chain of straight pieces with an arc in place of each corner, closed if the last point is the first.
pub(super) fn rounded(points: &[DVec3], radius: f64, tolerance: f64) -> Result<Vec<DVec3>, Flaw> {
    let Legs { closed, lengths, ahead } = Legs::between(points)?;
    let pieces = lengths.len();
    // the piece in front of a corner; none in front of the first point of an open chain
    let before = |i: usize| if i > 0 { i - 1 } else { pieces - 1 };
    let turn = |i: usize| match i {
        0 if !closed => 0.0,
        i if i == pieces && !closed => 0.0,
        i => {
            let (u, v) = (ahead[before(i)], ahead[i % pieces]);
            libm::atan2(u.cross(v).length(), u.dot(v))
        }
    };
    let cut = |i: usize| radius * libm::tan(0.5 * turn(i));
    if let Some(i) = (0..=pieces).find(|&i| turn(i) > PI - 1e-6) {
        return Err(Flaw::TurnsBack(i));
    }
    if let Some(i) = (0..pieces).find(|&i| cut(i) + cut(i + 1) > lengths[i] * (1.0 + 1e-9)) {
        return Err(Flaw::NoRoom(if cut(i) > cut(i + 1) { i } else { i + 1 }));
    }
    let mut chain: Vec<DVec3> = Vec::new();
    for i in usize::from(closed)..=pieces {
        let (p, angle) = (points[i], turn(i));
        if angle < STRAIGHT {
            chain.push(p);
            continue;
        }
        let (u, v) = (ahead[before(i)], ahead[i % pieces]);
        let aside = (v - u * u.dot(v)).normalize();
        let count = chords(radius, angle, tolerance)?;
        if chain.len() + count > MOST_POINTS {
            return Err(Flaw::TooFine);
        }
        let start = p - cut(i) * u;
        for step in 0..=count {
            let a = angle * (step as f64 / count as f64);
            let at = start + radius * (libm::sin(a) * u + (1.0 - libm::cos(a)) * aside);
            // where two arcs touch, the end of one is the beginning of the other
            if chain.last().is_none_or(|last| last.distance(at) > 1e-9 * radius) {
                chain.push(at);
            }
        }
    }
    if closed {
        if chain.len() > 1 && chain[0].distance(chain[chain.len() - 1]) <= 1e-9 * radius {
            chain.pop();
        }
        chain.push(chain[0]);
    }
    finite(chain)
}

/// The second derivatives at the points of an open spline: none at its ends.
fn open_bends(lengths: &[f64], ahead: &[DVec3]) -> Vec<DVec3> {
    let inner = lengths.len() - 1;
    let middle: Vec<f64> = (0..inner).map(|i| 2.0 * (lengths[i] + lengths[i + 1])).collect();
    let right: Vec<DVec3> = (0..inner).map(|i| 6.0 * (ahead[i + 1] - ahead[i])).collect();
    let off: Vec<f64> = lengths[1..lengths.len()].to_vec();
    let mut bends = vec![DVec3::ZERO];
    bends.extend(solved(&middle, &off, right));
    bends.push(DVec3::ZERO);
    bends
}

/// The second derivatives at the points of a closed spline, the first of them again at its end. The system has two
/// corners beside its three diagonals, which are a correction of rank one (Sherman and Morrison).
fn closed_bends(lengths: &[f64], ahead: &[DVec3]) -> Vec<DVec3> {
    let n = lengths.len();
    let before = |i: usize| (i + n - 1) % n;
    let mut middle: Vec<f64> = (0..n).map(|i| 2.0 * (lengths[before(i)] + lengths[i])).collect();
    let right: Vec<DVec3> = (0..n).map(|i| 6.0 * (ahead[i] - ahead[before(i)])).collect();
    let corner = lengths[n - 1];
    let first = -middle[0];
    middle[0] -= first;
    middle[n - 1] -= corner * corner / first;
    let off = &lengths[..n - 1];
    let mut edge = vec![DVec3::ZERO; n];
    (edge[0], edge[n - 1]) = (DVec3::splat(first), DVec3::splat(corner));
    let plain = solved(&middle, off, right);
    let edge = solved(&middle, off, edge);
    let weigh = |v: &[DVec3]| v[0] + v[n - 1] * (corner / first);
    let factor = weigh(&plain) / (DVec3::ONE + weigh(&edge));
    let mut bends: Vec<DVec3> = plain.iter().zip(&edge).map(|(p, e)| *p - factor * *e).collect();
    bends.push(bends[0]);
    bends
}

/// The solution of a symmetric system with three diagonals, whose middle one outweighs the others (Thomas).
fn solved(middle: &[f64], off: &[f64], mut right: Vec<DVec3>) -> Vec<DVec3> {
    let n = middle.len();
    let mut pivots = middle.to_vec();
    for i in 1..n {
        let factor = off[i - 1] / pivots[i - 1];
        pivots[i] -= factor * off[i - 1];
        let above = right[i - 1];
        right[i] -= factor * above;
    }
    for i in (0..n).rev() {
        let below = if i + 1 < n { off[i] * right[i + 1] } else { DVec3::ZERO };
        right[i] = (right[i] - below) / pivots[i];
    }
    right
}

fn finite(points: Vec<DVec3>) -> Result<Vec<DVec3>, Flaw> {
    if points.iter().all(|p| p.is_finite()) { Ok(points) } else { Err(Flaw::TooLarge) }
}

/// Whether an angle is more than a whole turn, but for rounding.
pub(super) fn beyond_a_turn(angle: f64) -> bool {
    angle.abs() > 2.0 * PI * (1.0 + STRAIGHT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distance of a point from a chain.
    fn distance(p: DVec3, chain: &[DVec3]) -> f64 {
        let to = |pair: &[DVec3]| {
            let along = pair[1] - pair[0];
            let at = ((p - pair[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (p - pair[0] - along * at).length()
        };
        chain.windows(2).map(to).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn an_arc_keeps_its_tolerance_and_no_more() {
        let centre = DVec3::new(2.0, -1.0, 0.0);
        for (radius, tolerance, [from, to]) in [
            (1.0, 1e-3, [0.0, TAU]),
            (5.0, 1e-2, [1.0, -2.0]),
            (0.1, 1e-9, [0.2, 0.3]),
            (1.0, 3.0, [0.0, TAU]),
        ] {
            let chain = arc(centre, radius, [from, to], tolerance).unwrap();
            let mut worst = 0.0f64;
            for i in 0..=5000 {
                let angle = from + (to - from) * f64::from(i) / 5000.0;
                let p = centre + radius * DVec3::new(angle.cos(), angle.sin(), 0.0);
                worst = worst.max(distance(p, &chain));
            }
            assert!(worst <= tolerance * (1.0 + 1e-6), "{radius}: {worst}");
            assert!(worst >= tolerance * 0.5 || chain.len() <= 4, "{radius}: {worst} with {}", chain.len());
        }
        assert_eq!(arc(centre, 1.0, [0.0, TAU], 1e-12), Err(Flaw::TooFine));
        assert_eq!(arc(centre, 1e308, [0.0, TAU], 1e308).unwrap().len(), 4);
    }

    #[test]
    fn an_arc_through_three_points_is_the_circle_there() {
        // a circle in a plane of its own
        let (u, v) = (DVec3::new(0.6, 0.8, 0.0), DVec3::new(0.0, 0.0, 1.0));
        let centre = DVec3::new(1.0, 2.0, 3.0);
        let at = |angle: f64| centre + 2.0 * (angle.cos() * u + angle.sin() * v);
        for ends in [[0.1, 1.0, 2.0], [0.1, 3.0, 6.2], [2.0, 1.0, -3.0], [0.0, -0.1, -0.2]] {
            let chain = arc_through(ends.map(at), |radius| 1e-4 * radius).unwrap();
            assert_eq!((chain[0], chain[chain.len() - 1]), (at(ends[0]), at(ends[2])));
            assert!(chain.iter().all(|p| (p.distance(centre) - 2.0).abs() < 1e-12));
            for i in 0..=1000 {
                let p = at(ends[0] + (ends[2] - ends[0]) * f64::from(i) / 1000.0);
                assert!(distance(p, &chain) <= 2.001e-4, "{ends:?}: {p}");
            }
        }
        let line = [DVec3::ZERO, DVec3::ONE, 3.0 * DVec3::ONE];
        assert_eq!(arc_through(line, |_| 1.0), Err(Flaw::OnALine));
        assert_eq!(arc_through([DVec3::ZERO, DVec3::X, DVec3::ZERO], |_| 1.0), Err(Flaw::OnALine));
        assert_eq!(arc_through([DVec3::ZERO, DVec3::X, DVec3::X], |_| 1.0), Err(Flaw::OnALine));
    }

    /// Through the points of a circle, the spline is off by the fourth power of their distance.
    #[test]
    fn a_closed_spline_nears_a_circle_with_the_fourth_power() {
        let error = |count: i32| {
            let at = |i: i32| {
                DVec3::new(
                    (TAU * f64::from(i) / f64::from(count)).cos(),
                    (TAU * f64::from(i) / f64::from(count)).sin(),
                    0.0,
                )
            };
            let mut points: Vec<DVec3> = (0..count).map(at).collect();
            points.push(points[0]);
            let chain = spline(&points, 1e-7).unwrap();
            assert_eq!(chain.first(), chain.last());
            chain.iter().map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(8), error(16));
        assert!(coarse < 3e-3 && (coarse / fine - 16.0).abs() < 4.0, "{coarse} {fine}");
    }

    /// The curve itself from the same points, by a finer chain.
    #[test]
    fn a_spline_keeps_its_tolerance_and_passes_its_points() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.5], [1.1, 1.0, 0.0], [3.0, 1.5, -1.0], [3.0, 4.0, 0.0]]
            .map(DVec3::from_array);
        for closed in [false, true] {
            let mut points = points.to_vec();
            if closed {
                points.push(points[0]);
            }
            let exact = spline(&points, 1e-6).unwrap();
            for tolerance in [1e-1, 1e-2, 1e-4] {
                let chain = spline(&points, tolerance).unwrap();
                assert!(points.iter().all(|p| chain.contains(p)));
                let worst = exact.iter().map(|p| distance(*p, &chain)).fold(0.0, f64::max);
                assert!(worst <= tolerance && worst >= 0.1 * tolerance, "{tolerance}: {worst}");
            }
        }
    }

    /// Its bends have no jump: the turn from chord to chord is as small at the points as between them.
    #[test]
    fn a_closed_spline_has_no_corner() {
        let points =
            [[0.0, 0.0], [2.0, 0.1], [1.5, 1.0], [0.2, 1.4], [0.0, 0.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let chain = spline(&points, 1e-6).unwrap();
        let n = chain.len() - 1;
        for i in 0..n {
            let (a, b, c) = (chain[i], chain[(i + 1) % n], chain[(i + 2) % n]);
            assert!((b - a).angle_between(c - b) < 0.02, "{b}");
        }
    }

    #[test]
    fn flaws_of_splines_are_found() {
        let p = [DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_eq!(spline(&p[..1], 0.1), Err(Flaw::TooFew));
        assert_eq!(spline(&[p[0], p[1], p[0]], 0.1), Err(Flaw::TooFew));
        assert_eq!(spline(&[p[0], p[1], p[1]], 0.1), Err(Flaw::Repeated(2)));
        assert_eq!(spline(&p, 1e-12), Err(Flaw::TooFine));
        assert_eq!(spline(&[p[0], 1e200 * p[1], p[2]], 0.1), Err(Flaw::TooLarge));
        assert_eq!(spline(&p[..2], 0.1).unwrap(), p[..2]);
    }

    #[test]
    fn rounded_corners_touch_their_pieces() {
        // a square with corners of radius 0.5: the points at 0.5 from a smaller square
        let square =
            [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0], [0.0, 0.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let chain = rounded(&square, 0.5, 1e-4).unwrap();
        assert_eq!(chain.first(), chain.last());
        let away = |p: DVec3| {
            let inner = p.clamp(DVec3::new(0.5, 0.5, 0.0), DVec3::new(2.5, 1.5, 0.0));
            (p.distance(inner) - 0.5).abs()
        };
        assert!(chain.iter().all(|p| away(*p) < 1e-12));
        assert!(chain.windows(2).all(|pair| away(pair[0].midpoint(pair[1])) < 1.01e-4));
        // arcs that touch each other, and a chain in space whose ends stay
        assert_eq!(rounded(&square, 1.0, 1e-4).unwrap().first(), rounded(&square, 1.0, 1e-4).unwrap().last());
        let open = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 1.0), DVec3::new(3.0, 1.0, 1.0)];
        let chain = rounded(&open, 0.3, 1e-4).unwrap();
        assert_eq!((chain[0], chain[chain.len() - 1]), (open[0], open[3]));
        assert!(chain.iter().all(|p| distance(*p, &open) < 0.3 * (2f64.sqrt() - 1.0)));
        let turn = |w: &[DVec3]| (w[1] - w[0]).angle_between(w[2] - w[1]);
        assert!(chain.windows(3).all(|w| turn(w) < 0.06), "{chain:?}");
        assert_eq!(rounded(&square, 1.1, 1e-4), Err(Flaw::NoRoom(2)));
        assert_eq!(
            rounded(&[DVec3::ZERO, DVec3::X, DVec3::ZERO, DVec3::Y], 0.1, 1e-4),
            Err(Flaw::TurnsBack(1))
        );
        assert_eq!(rounded(&[DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], 0.1, 1e-4).unwrap().len(), 3);
    }

    #[test]
    fn a_helix_climbs_by_its_pitch() {
        let chain = helix(2.0, 0.5, -3.0, 1e-3).unwrap();
        let end = chain[chain.len() - 1];
        assert!((end - DVec3::new(2.0, 0.0, 1.5)).length() < 1e-12 && chain[1].y < 0.0);
        for i in 0..=3000 {
            let turned = f64::from(i) / 1000.0;
            let p = DVec3::new(2.0 * (TAU * turned).cos(), -2.0 * (TAU * turned).sin(), 0.5 * turned);
            assert!(distance(p, &chain) <= 1.001e-3);
        }
    }
}
