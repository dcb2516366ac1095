//! Numbers beside the marks of a plot, where they cover neither lines nor each other.

use std::fmt::Write;

use super::{BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH};

/// Size of the letters, and the width that one takes.
const SIZE: f64 = 11.0;
const LETTER: f64 = 6.2;

/// Where a label may stand beside its mark: offsets of its near edge, with the preferred ones first. The
/// third number is the part of its width that lies left of that edge.
const PLACES: [(f64, f64, f64); 8] = [
    (8.0, -7.0, 0.0),
    (8.0, 14.0, 0.0),
    (-8.0, -7.0, 1.0),
    (-8.0, 14.0, 1.0),
    (0.0, -10.0, 0.5),
    (0.0, 19.0, 0.5),
    (11.0, 4.0, 0.0),
    (-11.0, 4.0, 1.0),
];

/// A rectangle by its corners.
type Rect = [f64; 4];

/// What labels of a plot must not cover.
pub(in crate::cli) struct Labels {
    segments: Vec<[(f64, f64); 2]>,
    taken: Vec<Rect>,
}

impl Labels {
    /// Labels that keep off these lines and their marks.
    pub fn beside(lines: &[Vec<(f64, f64)>]) -> Self {
        let segments = lines.iter().flat_map(|line| line.windows(2).map(|pair| [pair[0], pair[1]])).collect();
        let marks = lines.iter().flatten().map(|(x, y)| [x - 6.0, y - 6.0, x + 6.0, y + 6.0]);
        Self { segments, taken: marks.collect() }
    }

    /// Writes a label beside a mark.
    pub fn write(&mut self, out: &mut String, (x, y): (f64, f64), text: &str) {
        let width = LETTER * text.chars().count() as f64;
        let place = |(dx, dy, left): (f64, f64, f64)| (x + dx - left * width, y + dy);
        let rect = |(x, y): (f64, f64)| [x - 1.0, y - SIZE, x + width + 1.0, y + 2.0];
        let cost = |at: (f64, f64)| {
            let own = rect(at);
            let frame = [LEFT, TOP, WIDTH - RIGHT, HEIGHT - BOTTOM];
            let outside = own[0] < frame[0] || own[1] < frame[1] || own[2] > frame[2] || own[3] > frame[3];
            let covered = self.taken.iter().filter(|other| overlap(&own, other)).count();
            let crossed = self.segments.iter().filter(|segment| crosses(segment, &own)).count();
            4 * usize::from(outside) + 2 * covered + crossed
        };
        // the first of the best, so that a lonely mark has its label above to the right
        let places = PLACES.map(place);
        let mut best = places[0];
        for at in places {
            if cost(at) < cost(best) {
                best = at;
            }
        }
        self.taken.push(rect(best));
        // writing to a String cannot fail
        let _ =
            write!(out, r##"<text x="{:.1}" y="{:.1}" font-size="{SIZE}">{text}</text>"##, best.0, best.1);
    }
}

fn overlap(a: &Rect, b: &Rect) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

/// Whether a piece of a line passes through a rectangle, by cutting it at the sides.
fn crosses([a, b]: &[(f64, f64); 2], rect: &Rect) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (start, end, low, high) in [(a.0, b.0, rect[0], rect[2]), (a.1, b.1, rect[1], rect[3])] {
        let along = end - start;
        if along == 0.0 {
            if start < low || start > high {
                return false;
            }
            continue;
        }
        let (first, last) = ((low - start) / along, (high - start) / along);
        from = from.max(first.min(last));
        to = to.min(first.max(last));
    }
    from < to
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places(lines: &[Vec<(f64, f64)>]) -> Vec<Rect> {
        let mut labels = Labels::beside(lines);
        let marks = labels.taken.len();
        let mut out = String::new();
        for (x, y) in lines.iter().flatten() {
            labels.write(&mut out, (*x, *y), "12345");
        }
        labels.taken.split_off(marks)
    }

    #[test]
    fn labels_keep_off_lines_and_each_other() {
        // lines that rise, fall, and lie close together
        let lines = [
            vec![(120.0, 300.0), (200.0, 240.0), (300.0, 230.0), (400.0, 120.0)],
            vec![(120.0, 100.0), (200.0, 160.0), (300.0, 190.0), (400.0, 330.0)],
            vec![(130.0, 320.0), (210.0, 270.0), (310.0, 262.0)],
        ];
        let found = places(&lines);
        assert_eq!(found.len(), 11);
        for (i, own) in found.iter().enumerate() {
            assert!(found[..i].iter().all(|other| !overlap(own, other)), "{own:?}");
            for line in &lines {
                for pair in line.windows(2) {
                    assert!(!crosses(&[pair[0], pair[1]], own), "{own:?} {pair:?}");
                }
            }
        }
    }

    #[test]
    fn labels_stay_in_the_frame_and_a_lonely_one_stands_above_to_the_right() {
        let right = places(&[vec![(WIDTH - RIGHT - 2.0, 200.0)]])[0];
        assert!(right[2] <= WIDTH - RIGHT, "{right:?}");
        let lonely = places(&[vec![(300.0, 200.0)]])[0];
        assert!(lonely[0] > 300.0 && lonely[3] < 200.0, "{lonely:?}");
    }
}
