//! The numbers on isolines: at most one for each level, where the line is straight and there is room.
//!
//! Invariant: a label keeps away from the frame, from the lines of other levels and from the labels
//! before it.

use glam::DVec2;

use super::axes::PlotFrame;

/// A number on the page. It is turned with its line, but never upside down.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelLabel {
    pub at: DVec2,
    /// In degrees, clockwise, −90 to 90.
    pub angle: f64,
    pub text: String,
}

impl LevelLabel {
    /// Whether a stretch of a line comes near it.
    pub fn is_met_by(&self, from: DVec2, to: DVec2) -> bool {
        let along = DVec2::from_angle(self.angle.to_radians());
        let half = DVec2::new(0.5 * width(&self.text), 0.5 * HEIGHT) + BESIDE;
        let is_near = |p: DVec2| {
            let d = p - self.at;
            d.dot(along).abs() < half.x && d.perp_dot(along).abs() < half.y
        };
        // as close together as labels are high
        let count = (from.distance(to) / (0.5 * HEIGHT)).ceil().max(1.0);
        (0..=count as usize).any(|k| is_near(from.lerp(to, k as f64 / count)))
    }
}

/// The width of a character and the height of a label in type of 10 units.
const CHARACTER: f64 = 5.6;
const HEIGHT: f64 = 11.0;
/// What arrows leave free around a label.
const BESIDE: f64 = 2.5;

fn width(text: &str) -> f64 {
    CHARACTER * text.chars().count() as f64
}

/// Finds places for labels that do not disturb each other.
#[derive(Debug)]
pub struct Placer<'a> {
    frame: &'a PlotFrame,
    /// The lines of each level, in page units, with points close together.
    lines: &'a [Vec<Vec<DVec2>>],
    /// Centres and radii of the labels so far.
    taken: Vec<(DVec2, f64)>,
}

impl<'a> Placer<'a> {
    pub fn new(frame: &'a PlotFrame, lines: &'a [Vec<Vec<DVec2>>]) -> Self {
        Self { frame, lines, taken: Vec::new() }
    }

    /// The best label for a text on the lines of a level. `None` if there is no room.
    pub fn place(&mut self, level: usize, text: &str) -> Option<LevelLabel> {
        let width = width(text);
        let candidates = self.lines[level].iter().flat_map(|line| stations(line, width));
        let best = candidates
            .filter(|s| self.is_free(s, level, 0.5 * width))
            .max_by(|a, b| self.merit(a).total_cmp(&self.merit(b)))?;
        self.taken.push((best.at, 0.5 * width));
        let angle = best.direction.y.atan2(best.direction.x).to_degrees();
        let upright = if angle > 90.0 {
            angle - 180.0
        } else if angle < -90.0 {
            angle + 180.0
        } else {
            angle
        };
        Some(LevelLabel { at: best.at, angle: upright, text: text.to_owned() })
    }

    fn is_free(&self, station: &Station, level: usize, radius: f64) -> bool {
        let at = station.at;
        let (low, high) = (self.frame.origin, self.frame.origin + self.frame.size);
        let inset = DVec2::splat(radius + 5.0);
        let in_frame = at.cmpge(low + inset).all() && at.cmple(high - inset).all();
        let clear = |&(other, size): &(DVec2, f64)| at.distance(other) > radius + size + 8.0;
        in_frame && self.taken.iter().all(clear) && !self.covers_other_lines(station, level, radius)
    }

    /// Whether a line of another level runs through the label's box.
    fn covers_other_lines(&self, station: &Station, level: usize, radius: f64) -> bool {
        let others = self.lines.iter().enumerate().filter(|(k, _)| *k != level);
        others.flat_map(|(_, lines)| lines.iter().flatten()).any(|p| {
            let d = *p - station.at;
            d.dot(station.direction).abs() < radius + 2.0
                && d.perp_dot(station.direction).abs() < 0.5 * HEIGHT
        })
    }

    /// How good a place is. Straight and level places are easy to read, and among equals those further to the
    /// right win.
    fn merit(&self, station: &Station) -> f64 {
        let place = ((station.at - self.frame.origin) / self.frame.size).x;
        4.0 * station.straightness + station.direction.x.abs() + 0.25 * place
    }
}

/// A stretch of line as long as the label.
struct Station {
    at: DVec2,
    direction: DVec2,
    /// Chord over arc, 1 for a straight stretch.
    straightness: f64,
}

fn stations(line: &[DVec2], width: f64) -> Vec<Station> {
    let mut arc = vec![0.0];
    for pair in line.windows(2) {
        arc.push(arc[arc.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = arc[arc.len() - 1];
    let point = |s: f64| {
        let i = arc.partition_point(|a| *a <= s).clamp(1, line.len() - 1);
        let step = arc[i] - arc[i - 1];
        if step > 0.0 { line[i - 1].lerp(line[i], ((s - arc[i - 1]) / step).min(1.0)) } else { line[i] }
    };
    if line.len() < 2 || length < 3.0 * width {
        return Vec::new();
    }
    let spacing = 0.25 * width;
    let count = ((length - width) / spacing) as usize;
    (0..=count)
        .map(|k| {
            let s = 0.5 * width + k as f64 * spacing;
            let chord = point(s + 0.5 * width) - point(s - 0.5 * width);
            let straightness = chord.length() / width;
            Station { at: point(s), direction: chord.normalize_or(DVec2::X), straightness }
        })
        .filter(|station| station.straightness > 0.93)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slice::Window;

    #[test]
    fn labels_keep_apart_and_stay_off_other_lines() {
        let frame = PlotFrame::new(Window::new(DVec2::ZERO, DVec2::new(2.0, 1.0)), DVec2::ZERO);
        let dense = |y: f64| vec![(0..=560).map(|x| DVec2::new(f64::from(x), y)).collect::<Vec<_>>()];
        let lines = [
            dense(200.0),
            dense(100.0),
            dense(109.0),
            dense(203.0),
            dense(1.0),
            vec![vec![DVec2::ZERO; 3], vec![]],
        ];
        let mut placer = Placer::new(&frame, &lines);
        let first = placer.place(1, "0.1").unwrap();
        let second = placer.place(2, "0.2").unwrap();
        assert_eq!(first.angle, 0.0);
        assert!(first.at.distance(second.at) > 16.0);
        assert_eq!(placer.place(3, "0.5"), None, "beside another line");
        assert_eq!(placer.place(4, "0.5"), None, "on the frame");
        assert_eq!(placer.place(5, "0.5"), None, "no length");
    }
}
