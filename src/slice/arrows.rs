//! Arrows along −∇ω, the way out of a solid, on a grid over a slice.
//!
//! All are as long as the part of their direction that lies in the plane: one that points out of the paper is a dot.

use std::fmt::Write;

use glam::{DVec2, DVec3};

use super::axes::{INK, PlotFrame};
use super::labels::LevelLabel;
use super::plane::Plane;
use crate::field::Field;
use crate::geom::direction;

/// The way from arrow to arrow, the length of one in the plane and of its head, in units of the page.
const SPACING: f64 = 34.0;
const LENGTH: f64 = 20.0;
const HEAD: f64 = 5.5;

/// Arrows shorter than this are dots.
const SHORTEST: f64 = 3.0;

/// How far around a place its direction must hold, in units of the page.
const HOLDS: f64 = 2.0;

/// Draws the arrows of a field, but none across a label, and none where their direction is not known.
pub fn draw(out: &mut String, field: &dyn Field, plane: Plane, frame: &PlotFrame, labels: &[LevelLabel]) {
    let count = (frame.size / SPACING).floor().max(DVec2::ONE);
    let (right, up) = plane.axis.right_and_up();
    let (mut shafts, mut heads, mut dots) = (String::new(), String::new(), String::new());
    for row in 0..count.y as usize {
        for column in 0..count.x as usize {
            let part = (DVec2::new(column as f64, row as f64) + 0.5) / count;
            let uv = frame.window.min + frame.window.size() * part;
            let Some(way) = way_out(field, plane.point(uv)) else { continue };
            if !holds(field, plane, frame, (uv, way)) {
                continue;
            }
            // the page has its y axis downwards
            let step = DVec2::new(way[right.index()], -way[up.index()]) * LENGTH;
            let middle = frame.page(uv);
            if labels.iter().any(|label| label.is_met_by(middle - 0.5 * step, middle + 0.5 * step)) {
                continue;
            }
            if step.length() < SHORTEST {
                let _ = write!(dots, r#"<circle cx="{:.1}" cy="{:.1}" r="1.4"/>"#, middle.x, middle.y);
                continue;
            }
            let (from, to) = (middle - 0.5 * step, middle + 0.5 * step);
            let along = step.normalize();
            let base = to - HEAD * along;
            let aside = 0.42 * HEAD * along.perp();
            // writing to a String cannot fail
            let _ = write!(shafts, "M{:.1} {:.1}L{:.1} {:.1}", from.x, from.y, base.x, base.y);
            let (a, b) = (base + aside, base - aside);
            let _ = write!(heads, "M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}z", to.x, to.y, a.x, a.y, b.x, b.y);
        }
    }
    let _ = writeln!(
        out,
        r#"<g fill="{INK}" stroke="none"><path d="{shafts}" fill="none" stroke="{INK}" stroke-width="1"/><path d="{heads}"/>{dots}</g>"#
    );
}

/// The direction of −∇ω at a point; `None` where there is none.
fn way_out(field: &dyn Field, p: DVec3) -> Option<DVec3> {
    let (omega, gradient) = field.omega_grad(p);
    if omega.is_nan() { None } else { direction(-gradient) }
}

/// Whether directions beside a place are not opposed to that at the place, as they are around a centre and along a
/// ridge.
fn holds(field: &dyn Field, plane: Plane, frame: &PlotFrame, (uv, way): (DVec2, DVec3)) -> bool {
    let step = HOLDS * frame.window.size() / frame.size;
    let beside = [DVec2::X, DVec2::NEG_X, DVec2::Y, DVec2::NEG_Y].map(|d| plane.point(uv + step * d));
    beside.into_iter().all(|p| way_out(field, p).is_none_or(|other| other.dot(way) > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::Closures;
    use crate::geom::Aabb;
    use crate::slice::{Axis, Window};

    #[test]
    fn arrows_point_out_of_a_ball_and_are_dots_above_it() {
        let ball = Closures { omega: |p: DVec3| 1.0 - p.length_squared(), gradient: |p: DVec3| -2.0 * p };
        let arrows = |axis, at| {
            let plane = Plane::new(axis, at);
            let window = plane.window(&Aabb::new(DVec3::splat(-0.4), DVec3::splat(0.4)));
            let frame = PlotFrame::new(window, DVec2::ZERO);
            let mut out = String::new();
            draw(&mut out, &ball, plane, &frame, &[]);
            (out, frame)
        };
        let (out, frame) = arrows(Axis::Z, 0.0);
        let shafts = out.split("<path d=\"").nth(1).unwrap().split('"').next().unwrap();
        let middle = frame.page(DVec2::ZERO);
        let mut seen = 0;
        for shaft in shafts.split('M').skip(1) {
            let numbers: Vec<f64> = shaft.split(['L', ' ']).map(|x| x.parse().unwrap()).collect();
            let [x0, y0, x1, y1] = numbers[..] else { panic!("{shaft}") };
            let (from, to) = (DVec2::new(x0, y0) - middle, DVec2::new(x1, y1) - middle);
            assert!(
                to.length() > from.length()
                    && from.perp_dot(to).abs() < 0.1 * to.length() * from.length() + 3.0
            );
            seen += 1;
        }
        assert!(seen > 100, "{seen}");
        // about the middle of a distance, ways out have no direction
        let off = DVec3::new(1e-9, -2e-9, 0.0);
        let cone =
            Closures { omega: |p: DVec3| -p.length(), gradient: |p: DVec3| -(p + off).normalize_or_zero() };
        let window = Window::new(DVec2::splat(-0.4), DVec2::splat(0.4));
        let plane = Plane::new(Axis::Z, 0.0);
        let frame = PlotFrame::new(window, DVec2::ZERO);
        assert!(!holds(&cone, plane, &frame, (DVec2::ZERO, DVec3::X)));
        assert!(holds(&cone, plane, &frame, (DVec2::new(0.1, 0.0), DVec3::X)));
        // an arrow over a label is left out
        let mut out = String::new();
        let (middle, text) = (frame.page(DVec2::new(0.2, 0.1)), "0.02".to_string());
        let label = LevelLabel { at: middle, angle: 30.0, text };
        draw(&mut out, &ball, plane, &frame, std::slice::from_ref(&label));
        let heads = out.split("<path d=\"").nth(2).unwrap().split('"').next().unwrap();
        for tip in heads.split('M').skip(1) {
            let numbers: Vec<f64> =
                tip.split('L').next().unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
            let tip = DVec2::new(numbers[0], numbers[1]);
            assert!(!label.is_met_by(tip, tip), "{tip}");
        }
        // far above the ball its way out is towards the reader
        let (out, _) = arrows(Axis::Z, 50.0);
        assert!(out.matches("<circle").count() > 100 && !out.contains('L'));
    }
}
