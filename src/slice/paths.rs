//! Polylines as SVG path data, with so few points and digits that the eye sees no difference.

use std::fmt::Write;

use glam::DVec2;

/// The largest distance in page units between a line and the path that is written: a twelfth of a pixel at
/// double size.
const TOLERANCE: f64 = 0.04;

/// Appends path data for points in page units.
pub fn append(path: &mut String, points: &[DVec2], closed: bool) {
    let kept = simplify(points, closed);
    let Some(first) = kept.first() else { return };
    // steps between rounded points, so that rounding does not add up along the line
    let hundredths = |p: &DVec2| ((p.x * 100.0).round() as i64, (p.y * 100.0).round() as i64);
    let mut at = hundredths(first);
    let _ = write!(path, "M{} {}", number(at.0), number(at.1));
    let mut command = "l";
    for next in kept[1..].iter().map(hundredths).filter({
        let mut last = at;
        move |next| std::mem::replace(&mut last, *next) != *next
    }) {
        let (dx, dy) = (next.0 - at.0, next.1 - at.1);
        let gap = if dy < 0 { "" } else { " " };
        let start = if command == " " && dx < 0 { "" } else { command };
        let _ = write!(path, "{start}{}{gap}{}", number(dx), number(dy));
        command = " ";
        at = next;
    }
    if closed {
        path.push('z');
    }
}

/// Hundredths as decimal text without needless zeros.
fn number(hundredths: i64) -> String {
    let sign = if hundredths < 0 { "-" } else { "" };
    let (whole, part) = (hundredths.abs() / 100, hundredths.abs() % 100);
    match part {
        0 => format!("{sign}{whole}"),
        _ if part % 10 == 0 => format!("{sign}{whole}.{}", part / 10),
        _ => format!("{sign}{whole}.{part:02}"),
    }
}

/// The points that Douglas and Peucker's method selects. A closed line is cut at its first point and at the
/// point farthest from it.
fn simplify(points: &[DVec2], closed: bool) -> Vec<DVec2> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut line = points.to_vec();
    if closed {
        line.push(points[0]);
    }
    let last = line.len() - 1;
    let mut keep = vec![false; line.len()];
    keep[0] = true;
    keep[last] = true;
    let mut stretches = vec![(0, last)];
    while let Some((from, to)) = stretches.pop() {
        let (a, chord) = (line[from], line[to] - line[from]);
        let distance = |p: DVec2| {
            let t = ((p - a).dot(chord) / chord.length_squared()).clamp(0.0, 1.0);
            if t.is_nan() { p.distance(a) } else { p.distance(a + t * chord) }
        };
        let farthest = (from + 1..to).map(|i| (distance(line[i]), i)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((far, i)) = farthest
            && far > TOLERANCE
        {
            keep[i] = true;
            stretches.push((from, i));
            stretches.push((i, to));
        }
    }
    let kept = if closed { last } else { last + 1 };
    (0..kept).filter(|&i| keep[i]).map(|i| line[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_runs_become_one_step() {
        let points: Vec<_> = (0..=10).map(|i| DVec2::new(f64::from(i), 0.5 * f64::from(i))).collect();
        let mut path = String::new();
        append(&mut path, &points, false);
        assert_eq!(path, "M0 0l10 5");
    }

    #[test]
    fn a_circle_stays_within_the_tolerance() {
        let circle: Vec<_> = (0..1000)
            .map(|i| 100.0 * DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 1000.0))
            .collect();
        let kept = simplify(&circle, true);
        assert!((30..130).contains(&kept.len()), "{}", kept.len());
        let sagitta = |i: usize| 100.0 - (0.5 * (kept[i] + kept[(i + 1) % kept.len()])).length();
        assert!((0..kept.len()).all(|i| sagitta(i) <= TOLERANCE * 1.001));
    }

    #[test]
    fn degenerate_lines_are_written_without_a_panic() {
        for points in [vec![], vec![DVec2::ONE], vec![DVec2::ONE; 5]] {
            append(&mut String::new(), &points, true);
        }
    }
}
