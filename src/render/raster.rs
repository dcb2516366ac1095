//! Sub-pixels with depth: the canvas, its bands, triangles and lines.
//!
//! Invariant: nearer things hide farther ones, and among equally near ones the first that was drawn stays.
//! Triangles are rasterised in integers, so neighbours share an edge without gap or overlap.

use std::ops::Range;

use glam::DVec2;
use rayon::prelude::*;

use super::{
    Rgb,
    camera::{SUBPIXELS, Seen},
};

/// Rows of sub-pixels in a band. The number is fixed, so that pictures do not depend on the number
/// of threads.
pub const BAND_ROWS: usize = 32;

/// All sub-pixels of a picture. Nearness 0 is infinitely far away.
#[derive(Debug, Clone)]
pub struct Canvas {
    pub width: usize,
    pub nearness: Vec<f32>,
    pub colour: Vec<Rgb>,
}

impl Canvas {
    pub fn new(width: usize, height: usize, ground: Rgb) -> Self {
        Self { width, nearness: vec![0.0; width * height], colour: vec![ground; width * height] }
    }

    /// Draws on every band, in parallel.
    pub fn draw(&mut self, on_band: impl Fn(&mut Band<'_>) + Sync) {
        let (width, size) = (self.width, BAND_ROWS * self.width);
        let pieces = self.nearness.par_chunks_mut(size).zip(self.colour.par_chunks_mut(size));
        pieces.enumerate().for_each(|(k, (nearness, colour))| {
            on_band(&mut Band { left: 0, top: k * BAND_ROWS, width, nearness, colour });
        });
    }

    /// Copies the columns of some of a band's rows.
    pub fn copy(&self, rows: Range<usize>, columns: Range<usize>, scratch: &mut Scratch) {
        scratch.nearness.clear();
        scratch.colour.clear();
        for row in rows {
            let line = row * self.width + columns.start..row * self.width + columns.end;
            scratch.nearness.extend_from_slice(&self.nearness[line.clone()]);
            scratch.colour.extend_from_slice(&self.colour[line]);
        }
    }
}

/// A part of a canvas. Its memory is reused, because the system clears new memory page by page.
#[derive(Default)]
pub struct Scratch {
    pub nearness: Vec<f32>,
    pub colour: Vec<Rgb>,
}

/// A rectangle of sub-pixels, which are addressed by their place in the whole picture.
pub struct Band<'a> {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub nearness: &'a mut [f32],
    pub colour: &'a mut [Rgb],
}

impl Band<'_> {
    pub fn bottom(&self) -> usize {
        self.top + self.nearness.len() / self.width
    }

    /// The columns of lo..=hi that lie in the band.
    pub fn columns(&self, lo: f64, hi: f64) -> Range<usize> {
        clip(lo, hi, self.left, self.left + self.width)
    }

    /// The rows of lo..=hi that lie in the band.
    pub fn rows(&self, lo: f64, hi: f64) -> Range<usize> {
        clip(lo, hi, self.top, self.bottom())
    }

    /// The index at which a sub-pixel of the band is stored.
    pub fn index(&self, x: usize, y: usize) -> usize {
        (y - self.top) * self.width + (x - self.left)
    }

    /// Writes pixels, each the mean of its sub-pixels. `out` holds the band's rows of pixels, which are
    /// `stride` pixels long.
    pub fn average(&self, out: &mut [u8], stride: usize) {
        let first = self.left / SUBPIXELS;
        for (row, lines) in self.colour.chunks_exact(SUBPIXELS * self.width).enumerate() {
            let (upper, lower) = lines.split_at(self.width);
            let pixels = &mut out[3 * (row * stride + first)..];
            let squares = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            for (pixel, (a, b)) in pixels.chunks_exact_mut(3).zip(squares) {
                for (i, channel) in pixel.iter_mut().enumerate() {
                    let sum =
                        u16::from(a[0][i]) + u16::from(a[1][i]) + u16::from(b[0][i]) + u16::from(b[1][i]);
                    *channel = ((sum + 2) / 4) as u8;
                }
            }
        }
    }

    /// Writes the greatest nearness of each pixel's sub-pixels, in the same way.
    pub fn nearest(&self, out: &mut [f32], stride: usize) {
        let first = self.left / SUBPIXELS;
        for (row, lines) in self.nearness.chunks_exact(SUBPIXELS * self.width).enumerate() {
            let (upper, lower) = lines.split_at(self.width);
            let squares = upper.chunks_exact(2).zip(lower.chunks_exact(2));
            for (pixel, (a, b)) in out[row * stride + first..].iter_mut().zip(squares) {
                *pixel = a[0].max(a[1]).max(b[0].max(b[1]));
            }
        }
    }

    /// Draws a straight line with soft borders. Colour and nearness change evenly along it.
    pub fn line(&mut self, ends: [Seen; 2], colours: [Rgb; 2], thickness: f64) {
        let [a, b] = ends.map(|end| end.at);
        let (along, length) = (b - a, a.distance(b));
        let reach = 0.5 * thickness + 0.5;
        for y in self.rows(a.y.min(b.y) - reach, a.y.max(b.y) + reach) {
            let centre = y as f64 + 0.5;
            // where the line passes this row; a nearly level line passes it along its whole length
            let slack = reach * (1.0 + length / along.y.abs().max(1e-9));
            let at_row = a.x + (centre - a.y) / if along.y == 0.0 { 1e-9 } else { along.y } * along.x;
            let lo = (at_row - slack).max(a.x.min(b.x) - reach);
            let hi = (at_row + slack).min(a.x.max(b.x) + reach);
            for x in self.columns(lo, hi) {
                let p = DVec2::new(x as f64 + 0.5, centre);
                let t = ((p - a).dot(along) / length.powi(2).max(1e-12)).clamp(0.0, 1.0);
                let cover = (reach - p.distance(a + t * along)).clamp(0.0, 1.0);
                let near = (ends[0].nearness + t * (ends[1].nearness - ends[0].nearness)) as f32;
                let at = self.index(x, y);
                if cover > 0.0 && near > self.nearness[at] {
                    let ink = mix(colours[0], colours[1], t);
                    self.colour[at] = mix(self.colour[at], ink, cover);
                    if cover > 0.5 {
                        self.nearness[at] = near;
                    }
                }
            }
        }
    }

    /// Draws a triangle. `colour` takes the weights of the corners, whose sum is one.
    pub fn triangle(&mut self, corners: &[Corner; 3], colour: impl Fn([f32; 3]) -> Rgb) {
        let frame = self.frame();
        frame.fragments(corners, |at, near, weights| {
            if near > self.nearness[at] {
                self.nearness[at] = near;
                self.colour[at] = colour(weights);
            }
        });
    }

    /// The place of the band in the picture.
    pub fn frame(&self) -> Frame {
        Frame { left: self.left, top: self.top, width: self.width, bottom: self.bottom() }
    }
}

/// The place of a band in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    left: usize,
    top: usize,
    width: usize,
    bottom: usize,
}

impl Frame {
    /// The frame of some columns of a band's rows.
    pub fn new(rows: &Range<usize>, columns: &Range<usize>) -> Self {
        Self { left: columns.start, top: rows.start, width: columns.len(), bottom: rows.end }
    }

    /// The first row.
    pub fn top(self) -> usize {
        self.top
    }

    /// The columns.
    pub fn columns(self) -> Range<usize> {
        self.left..self.left + self.width
    }

    /// The rows.
    pub fn rows(self) -> Range<usize> {
        self.top..self.bottom
    }

    /// Gives every sub-pixel of a triangle to `fragment`: the index at which the band stores it, its
    /// nearness, and the weights of the corners, whose sum is one.
    pub fn fragments(self, corners: &[Corner; 3], mut fragment: impl FnMut(usize, f32, [f32; 3])) {
        let [a, b, mut c] = *corners;
        let mut b = b;
        // most triangles of a fine mesh lie between the middles of sub-pixels
        let columns = covered([a.x, b.x, c.x], self.left, self.left + self.width);
        let rows = covered([a.y, b.y, c.y], self.top, self.bottom);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let area = edge(a, b, (c.x, c.y));
        if area == 0 {
            return;
        }
        // both sides are drawn: the corners are taken clockwise on the screen for either order
        let turned = area < 0;
        if turned {
            std::mem::swap(&mut b, &mut c);
        }
        let bias = [(b, c), (c, a), (a, b)].map(|(p, q)| i64::from(!is_top_or_left(p, q)));
        let scale = 1.0 / area.abs() as f32;
        for y in rows {
            let start = (centre(columns.start), centre(y));
            let mut w = [edge(b, c, start), edge(c, a, start), edge(a, b, start)];
            let step = [(b, c), (c, a), (a, b)].map(|(p, q)| -STEPS * (q.y - p.y));
            for x in columns.clone() {
                if (0..3).all(|i| w[i] >= bias[i]) {
                    let weight = w.map(|w| w as f32 * scale);
                    let near = weight[0] * a.nearness + weight[1] * b.nearness + weight[2] * c.nearness;
                    let [u, v, w] = weight;
                    let weight = if turned { [u, w, v] } else { weight };
                    fragment((y - self.top) * self.width + (x - self.left), near, weight);
                }
                for i in 0..3 {
                    w[i] += step[i];
                }
            }
        }
    }
}

/// Steps of the integer grid in a sub-pixel, and the number of their bits.
const STEPS: i64 = 1 << STEP_BITS;
const STEP_BITS: u32 = 8;

/// A corner of a triangle on the integer grid.
#[derive(Debug, Clone, Copy)]
pub struct Corner {
    x: i64,
    y: i64,
    nearness: f32,
}

impl Corner {
    pub fn new(seen: Seen) -> Self {
        // the camera shows nothing beyond a million sub-pixels, so the products below stay within 62 bits
        let snap = |v: f64| (v * STEPS as f64).round() as i64;
        Self { x: snap(seen.at.x), y: snap(seen.at.y), nearness: seen.nearness as f32 }
    }

    /// Whether a triangle shows the eye the side from which its corners run counter-clockwise.
    pub fn is_front(corners: &[Self; 3]) -> bool {
        let [a, b, c] = *corners;
        edge(a, b, (c.x, c.y)) < 0
    }

    /// The first and last row of sub-pixels that a triangle can touch.
    pub fn rows(corners: &[Self; 3]) -> (i64, i64) {
        ends(corners.map(|corner| corner.y))
    }

    /// The first and last column of sub-pixels that a triangle can touch.
    pub fn columns(corners: &[Self; 3]) -> (i64, i64) {
        ends(corners.map(|corner| corner.x))
    }
}

/// The sub-pixels that the least and the greatest of three coordinates lie in.
fn ends(v: [i64; 3]) -> (i64, i64) {
    let v = v.map(|v| v >> STEP_BITS);
    (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]))
}

fn centre(pixel: usize) -> i64 {
    pixel as i64 * STEPS + STEPS / 2
}

/// Twice the area of the triangle a, b, p: positive if p is to the right of a → b on the screen.
fn edge(a: Corner, b: Corner, (x, y): (i64, i64)) -> i64 {
    (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
}

/// Whether a border owns the points on it. It does for exactly one of two neighbours.
fn is_top_or_left(a: Corner, b: Corner) -> bool {
    b.y < a.y || (b.y == a.y && b.x > a.x)
}

/// The sub-pixels of first..end whose middles lie between the least and the greatest of three coordinates.
fn covered(v: [i64; 3], first: usize, end: usize) -> Range<usize> {
    let (low, high) = (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
    // shifts divide and round down; floats would be rounded by a function call on old processors
    let to = ((high - STEPS / 2) >> STEP_BITS) + 1;
    let from = (low + STEPS / 2 - 1) >> STEP_BITS;
    let to = (to.max(0) as usize).clamp(first, end);
    (from.max(0) as usize).clamp(first, to)..to
}

/// The whole numbers of lo..=hi within first..end, and sometimes the one beyond hi. The result always lies
/// within first..end, and may be empty.
fn clip(lo: f64, hi: f64, first: usize, end: usize) -> Range<usize> {
    // `as` rounds down, saturates, and turns NaN into 0
    let end = if hi >= 0.0 { (hi as usize).saturating_add(2).clamp(first, end) } else { first };
    (lo as usize).clamp(first, end)..end
}

/// The colour between `a` (t = 0) and `b` (t = 1).
pub fn mix(a: Rgb, b: Rgb, t: f64) -> Rgb {
    std::array::from_fn(|i| (f64::from(a[i]) + t * (f64::from(b[i]) - f64::from(a[i]))).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(x: f64, y: f64, nearness: f64) -> Seen {
        Seen { at: DVec2::new(x, y), nearness }
    }

    fn corners(points: [(f64, f64); 3], nearness: f64) -> [Corner; 3] {
        points.map(|(x, y)| Corner::new(seen(x, y, nearness)))
    }

    fn count(canvas: &Canvas, colour: Rgb) -> usize {
        canvas.colour.iter().filter(|c| **c == colour).count()
    }

    #[test]
    fn neighbouring_triangles_cover_a_square_once() {
        // two triangles at one nearness: the first stays, so an overlap would show as a missing sub-pixel
        let (p, q, r, s) = ((3.3, 4.1), (80.7, 9.9), (75.2, 90.5), (1.25, 70.0));
        let mut both = Canvas::new(100, 100, [0; 3]);
        let pieces = [(corners([p, q, r], 1.0), [1; 3]), (corners([r, s, p], 1.0), [2; 3])];
        both.draw(|band| {
            for (piece, colour) in pieces {
                band.triangle(&piece, |_| colour);
            }
        });
        let alone = |k: usize| {
            let mut canvas = Canvas::new(100, 100, [0; 3]);
            canvas.draw(|band| band.triangle(&pieces[k].0, |_| [9; 3]));
            count(&canvas, [9; 3])
        };
        assert_eq!(count(&both, [1; 3]), alone(0));
        assert_eq!(count(&both, [2; 3]), alone(1));
        let area = 0.5 * ((75.2 - 3.3) * (70.0 - 9.9) - (90.5 - 4.1) * (1.25 - 80.7_f64)).abs();
        assert!(((alone(0) + alone(1)) as f64 - area).abs() < 40.0);
    }

    #[test]
    fn the_nearer_triangle_hides_the_farther_whatever_the_order() {
        let shape = [(0.0, 0.0), (50.0, 0.0), (0.0, 50.0)];
        for order in [[1.0, 2.0], [2.0, 1.0]] {
            let mut canvas = Canvas::new(64, 64, [0; 3]);
            canvas.draw(|band| {
                for near in order {
                    band.triangle(&corners(shape, near), |_| [near as u8; 3]);
                }
            });
            assert_eq!(count(&canvas, [1; 3]), 0);
            assert!(count(&canvas, [2; 3]) > 1200);
        }
    }

    #[test]
    fn lines_have_their_thickness_and_survive_odd_ends() {
        let mut canvas = Canvas::new(100, 100, [0; 3]);
        let ends = |a: (f64, f64), b: (f64, f64)| [seen(a.0, a.1, 1.0), seen(b.0, b.1, 1.0)];
        canvas.draw(|band| band.line(ends((10.0, 50.0), (90.0, 50.0)), [[200; 3]; 2], 4.0));
        let sum: f64 = canvas.colour.iter().map(|c| f64::from(c[0]) / 200.0).sum();
        assert!((sum - 4.0 * 80.0).abs() < 16.0, "{sum}");
        canvas.draw(|band| {
            band.line(ends((10.0, 5.0), (10.0, 5.0)), [[200; 3]; 2], 4.0);
            band.line(ends((-1e6, -1e6), (1e6, 1e6)), [[200; 3]; 2], 4.0);
        });
    }
}
