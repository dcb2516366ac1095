//! Soft darkness in folds and corners and under things, found from the depth of the picture alone.
//!
//! A ball around each point of the picture is partly filled by the things in front of that point. Loos and
//! Sloan ("Volumetric Obscurance", 2010) measure this part along some lines through the ball, in the
//! direction of the view, and take the lines in pairs on opposite sides of the point. On every plane nearness
//! is linear over the picture, so both lines of a pair together are half full, however the plane is turned.
//! Planes therefore keep their brightness.
//!
//! Beside the outline of a thing each line would leave a copy of that outline. So rows take different lines in turn,
//! and each point gets the mean over the rows around it that show the same surface.
//!
//! Invariant: every pixel of a row uses the same lines and nothing is random, so pictures have the same bits every
//! time.

use rayon::prelude::*;

/// The radius of the balls over the diagonal of the box.
const RADIUS: f64 = 0.035;
/// Darkening of a point with a quarter of its ball filled, such as one at the bottom of a right angle.
const DARKEST: f32 = 0.45;
/// The pairs of lines through a ball.
const LINES: u8 = 8;
/// Rows that take different lines. It is odd, so that as many lie above a point as below it.
const TURNS: u8 = 5;
/// Points of two rows show the same surface if their distances from the eye differ by less than this part of
/// the ball's radius: a surface as steep as that is hardly seen.
const APART: f64 = 0.5;
/// The part of a turn between a pair and the next, so that directions are spread evenly for any number of
/// pairs. Each row begins two such parts further on: beside outlines in nine directions the darkness of 5 × 8 pairs is
/// then within 0.010 of that of 1500 pairs in the root of the mean square, while 10 pairs in every row gave 0.023.
const GOLDEN: f64 = 0.618_033_988_75;
/// Number of pixels that are computed together.
const RUN: usize = 64;

/// The balls, in the scale of the picture.
#[derive(Debug, Clone)]
pub(super) struct Balls {
    /// Those of each row in turn.
    lines: [Vec<Line>; TURNS as usize],
    /// [`APART`] in metres, over the square of nearness.
    apart: f32,
    /// The farthest line from its point, in pixels.
    reach: usize,
}

/// A pair of lines.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// The place of one of them in the picture, from the point.
    columns: isize,
    rows: isize,
    /// Half the length of a line within the ball, times two, over the square of nearness. A difference of
    /// nearness, divided by this and by the square of nearness, is the part of the line by which it changes.
    length: f32,
    weight: f32,
}

impl Balls {
    /// `diagonal` is that of the box in metres, and `pixels` is the number of pixels per metre in the middle
    /// of the box.
    pub fn new(diagonal: f64, pixels: f64) -> Self {
        let radius = RADIUS * diagonal;
        let line = |turn: u8, k: u8| {
            // every line stands for an equal part of the disc, and all distances differ, so that no rings
            // appear
            let between = (f64::from(turn) + 0.5) / f64::from(TURNS);
            let part = ((f64::from(k) + between) / f64::from(LINES)).sqrt();
            let number = f64::from(2 * turn + k);
            let (sin, cos) = libm::sincos(std::f64::consts::PI * (GOLDEN * number).fract());
            let at = |x: f64| (part * radius * pixels * x).round() as isize;
            let half = (1.0 - part * part).sqrt();
            Line { columns: at(cos), rows: at(sin), length: (radius * half) as f32, weight: half as f32 }
        };
        // in small pictures lines may fall on the point itself, where they measure nothing
        let is_beside = |line: &Line| (line.columns, line.rows) != (0, 0);
        let lines: [Vec<Line>; TURNS as usize] =
            std::array::from_fn(|turn| (0..LINES).map(|k| line(turn as u8, k)).filter(is_beside).collect());
        let reach =
            lines.iter().flatten().map(|line| line.columns.unsigned_abs().max(line.rows.unsigned_abs()));
        Self { reach: reach.max().unwrap_or(0), lines, apart: (APART * radius) as f32 }
    }

    /// Finds how bright the pixels of a picture are, 0 … 1. Nearness 0 is the paper, which stays bright.
    /// `padded` is working memory.
    pub fn light(&self, nearness: &[f32], width: usize, padded: &mut Vec<f32>, light: &mut Vec<f32>) {
        light.clear();
        light.resize(nearness.len(), 1.0);
        if self.reach == 0 || width == 0 {
            return;
        }
        self.rough(&Padded::new(nearness, width, self.reach, padded), width, light);
        padded.clear();
        padded.resize(nearness.len(), 1.0);
        self.smooth(nearness, light, width, padded);
        std::mem::swap(padded, light);
    }

    /// The light by the lines of each row alone, without a lower bound.
    fn rough(&self, padded: &Padded<'_>, width: usize, light: &mut [f32]) {
        light.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let lines = &self.lines[y % usize::from(TURNS)];
            let all: f32 = lines.iter().map(|line| line.weight).sum();
            if all == 0.0 {
                return;
            }
            for (k, part) in row.chunks_mut(RUN).enumerate() {
                let points = padded.run(k * RUN, y, 0, 0);
                if points[..part.len()].iter().fold(0.0_f32, |most, near| most.max(*near)) > 0.0 {
                    let filled = filled(lines, padded, (k * RUN, y));
                    for ((light, near), filled) in part.iter_mut().zip(points).zip(filled) {
                        let dark = if *near > 0.0 { DARKEST * 2.0 * filled / all } else { 0.0 };
                        *light = 1.0 - dark;
                    }
                }
            }
        });
    }

    /// The mean over the rows around each point that show the same surface.
    fn smooth(&self, nearness: &[f32], rough: &[f32], width: usize, light: &mut [f32]) {
        let (rows, beside) = (nearness.len() / width, usize::from(TURNS / 2));
        light.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            let around = y.saturating_sub(beside)..rows.min(y + beside + 1);
            for (k, part) in row.chunks_mut(RUN).enumerate() {
                let run = |y: usize| y * width + k * RUN..y * width + k * RUN + part.len();
                let dark = |y: usize| rough[run(y)].iter().map(|light| u32::from(*light < 1.0)).sum::<u32>();
                if around.clone().all(|y| dark(y) == 0) {
                    continue;
                }
                let (mut sum, mut count) = ([0.0_f32; RUN], [0.0_f32; RUN]);
                for other in around.clone() {
                    let sums = sum.iter_mut().zip(&mut count);
                    let there = nearness[run(other)].iter().zip(&rough[run(other)]);
                    for (((sum, count), (near, light)), point) in sums.zip(there).zip(&nearness[run(y)]) {
                        let is_same = (near - point).abs() <= self.apart * point * point;
                        *sum += if is_same { *light } else { 0.0 };
                        *count += if is_same { 1.0 } else { 0.0 };
                    }
                }
                part.iter_mut()
                    .zip(sum.iter().zip(&count))
                    .for_each(|(light, (sum, count))| *light = (sum / count).max(1.0 - DARKEST));
            }
        });
    }
}

/// Twice the part of the balls of a run of pixels that is filled beyond one half, summed over the lines
/// with their weights.
fn filled(lines: &[Line], padded: &Padded<'_>, (x, y): (usize, usize)) -> [f32; RUN] {
    let points = padded.run(x, y, 0, 0);
    // paper has no depth, and is left out afterwards
    let scale: [f32; RUN] = std::array::from_fn(|i| 1.0 / (points[i] * points[i]).max(f32::MIN_POSITIVE));
    let mut filled = [0.0; RUN];
    for line in lines {
        let one = padded.run(x, y, line.columns, line.rows);
        let other = padded.run(x, y, -line.columns, -line.rows);
        let inverse = 1.0 / line.length;
        for i in 0..RUN {
            let a = (one[i] - points[i]) * (scale[i] * inverse);
            let b = (other[i] - points[i]) * (scale[i] * inverse);
            // a thing far in front of the ball is not in it, and hides what lies behind
            let far = a.max(b);
            let within = (2.0 - 0.5 * far).clamp(0.0, 1.0);
            let both = 0.5 * (a.clamp(-1.0, 1.0) + b.clamp(-1.0, 1.0));
            filled[i] += line.weight * within * both.max(0.0);
        }
    }
    filled
}

/// The nearness of a picture, with a border of paper.
struct Padded<'a> {
    nearness: &'a [f32],
    width: usize,
    border: usize,
}

impl<'a> Padded<'a> {
    /// Writes the nearness with its border to `padded`.
    fn new(nearness: &[f32], width: usize, border: usize, padded: &'a mut Vec<f32>) -> Self {
        let wide = width + RUN + 2 * border;
        let rows = nearness.len() / width;
        padded.clear();
        padded.resize(wide * (rows + 2 * border), 0.0);
        let inner = padded.chunks_exact_mut(wide).skip(border);
        for (to, from) in inner.zip(nearness.chunks_exact(width)) {
            to[border..border + width].copy_from_slice(from);
        }
        Self { nearness: padded, width: wide, border }
    }

    /// The run of pixels that begins at (x, y), moved by the given numbers of columns and rows, which are at
    /// most the border.
    fn run(&self, x: usize, y: usize, columns: isize, rows: isize) -> &[f32; RUN] {
        let row = (y + self.border).wrapping_add_signed(rows);
        let start = row * self.width + (x + self.border).wrapping_add_signed(columns);
        self.nearness[start..].first_chunk().expect("a run ends within the border")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 120;
    /// Pixels per metre, and the distance of the surface, in metres.
    const PIXELS: f64 = 400.0;
    const FAR: f64 = 50.0;

    /// The light in a picture of a surface that stands out by `height` at (x, y), all in metres.
    fn light(height: impl Fn(f64, f64) -> Option<f64>) -> Vec<f32> {
        let near = |i: usize| {
            let at = |k: usize| (k as f64 + 0.5 - 0.5 * WIDTH as f64) / PIXELS;
            height(at(i % WIDTH), at(i / WIDTH)).map_or(0.0, |z| (1.0 / (FAR - z)) as f32)
        };
        let nearness: Vec<f32> = (0..WIDTH * WIDTH).map(near).collect();
        let (mut padded, mut light) = (vec![0.3; 7], vec![0.4; 9]);
        Balls::new(2.0, PIXELS).light(&nearness, WIDTH, &mut padded, &mut light);
        light
    }

    /// The darkening of a picture at (x, y), both in metres.
    fn dark(light: &[f32], x: f64, y: f64) -> f64 {
        let at = |v: f64| (v * PIXELS + 0.5 * WIDTH as f64) as usize;
        1.0 - f64::from(light[at(y) * WIDTH + at(x)])
    }

    #[test]
    fn planes_stay_bright_however_they_are_turned() {
        for (a, b) in [(0.0, 0.0), (0.4, -0.2), (2.0, 1.0), (-30.0, 7.0)] {
            let light = light(|x, y| Some(a * x + b * y));
            for (x, y) in [(0.0, 0.0), (0.03, -0.05), (-0.06, 0.04)] {
                assert!(dark(&light, x, y).abs() < 0.01, "{a} {b}: {}", dark(&light, x, y));
            }
        }
        assert!(light(|_, _| None).iter().all(|light| *light == 1.0), "paper");
    }

    #[test]
    fn a_fold_is_as_dark_as_the_part_of_the_ball_that_it_fills() {
        // two planes that meet at x = 0 and rise at 45° on both sides
        let light = light(|x, _| Some(x.abs()));
        let radius = RADIUS * 2.0;
        for away in [0.0, 0.3, 0.6, 0.9, 1.3] {
            // the part of a ball around (away, 0, away) that lies behind the planes, counted on a fine grid
            let n = 80;
            let cell = |k: i32| (f64::from(k) + 0.5) / f64::from(n);
            let (mut inside, mut behind) = (0, 0);
            for (i, k) in (-n..n).flat_map(|i| (-n..n).map(move |k| (i, k))) {
                let (x, z) = (cell(i), cell(k));
                let rows = (1.0 - x * x - z * z).max(0.0).sqrt();
                let weight = (rows * 1e6) as i64;
                inside += weight;
                behind += if z + away < (x + away).abs() { weight } else { 0 };
            }
            let beyond_half = (2.0 * (behind as f64 / inside as f64 - 0.5)).max(0.0);
            let expected = f64::from(DARKEST) * (2.0 * beyond_half).min(1.0);
            let found = dark(&light, away * radius, 0.0);
            assert!((found - expected).abs() < 0.03, "{away}: {found} {expected}");
        }
    }

    #[test]
    fn what_is_far_in_front_casts_no_darkness() {
        let radius = RADIUS * 2.0;
        let over = |gap: f64| light(move |x, _| Some(if x > 0.0 { gap * radius } else { 0.0 }));
        // a point beside a step is darkened, but not a point beside something a metre in front of it
        assert!(dark(&over(0.7), -0.006, 0.0) > 0.1);
        assert!(dark(&over(15.0), -0.006, 0.0) < 0.01);
        // and the near side is not darkened at all
        assert!(dark(&over(0.7), 0.006, 0.0) < 0.01);
    }

    /// Beside the outline of a thing in front the darkness fades evenly: copies of the outline, one for each line,
    /// would be steps with a flat stretch before each. Ten lines in every row left 17 of 27 pixels as bright as their
    /// neighbours.
    #[test]
    fn beside_an_outline_the_darkness_fades_without_steps() {
        let radius = RADIUS * 2.0;
        let light = light(move |x, _| Some(if x > 0.0 { 0.7 * radius } else { 0.0 }));
        let pixels = (radius * PIXELS) as usize;
        for row in [WIDTH / 2, WIDTH / 2 + 1, WIDTH / 2 + 3] {
            let left = &light[row * WIDTH + WIDTH / 2 - pixels..row * WIDTH + WIDTH / 2];
            let steps: Vec<f32> = left.windows(2).map(|pair| (pair[0] - pair[1]).abs()).collect();
            let flat = steps.iter().filter(|step| **step < 1e-4).count();
            assert!(flat < 10 && steps.iter().all(|step| *step < 0.042), "{flat}: {steps:?}");
        }
    }
}
