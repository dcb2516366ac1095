//! Ground from a map of heights: h(x, y) − z, with h between the nodes of a rectangular grid from the four
//! nearest ones.
//!
//! Beyond the map, the height is that of its border. The least and the greatest height of each square of
//! nodes, of squares of squares and so on, give ranges over boxes at once.

use std::fmt;

use glam::{DVec2, DVec3};

use crate::geom::Aabb;
use crate::interval::Interval;
use crate::table::{Sample, Table};

/// The most nodes of a map.
pub const MOST_NODES: usize = 1 << 26;

/// Over more cells than this the slope is only known to be that of the whole map.
const MOST_CELLS: usize = 64;

/// Over more cells than this the heights are only known to be between those of the nodes around.
const FEW_CELLS: usize = 9;

/// The most that rounding may add to a height, relative to all terms of the height.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Heights on a grid.
pub struct HeightMap {
    /// Nodes along x and along y.
    counts: [usize; 2],
    /// Row after row, that of the least y first.
    heights: Vec<f64>,
    corner: DVec2,
    spacing: DVec2,
    /// The greatest slopes along x and y between neighbours.
    steepest: DVec2,
    /// The least and the greatest height of blocks of 2ⁿ × 2ⁿ nodes, for n = 0 and so on.
    levels: Vec<Level>,
    largest: f64,
    hash: blake3::Hash,
}

/// Blocks of nodes of one size.
struct Level {
    counts: [usize; 2],
    ranges: Vec<(f64, f64)>,
}

impl HeightMap {
    /// A map over the rectangle between two corners, from rows of heights, that of the greatest y first as in
    /// a picture.
    ///
    /// # Errors
    /// What is wrong with the heights or with the rectangle.
    pub fn new(rows: &[Vec<f64>], low: DVec2, high: DVec2) -> Result<Self, String> {
        let counts = [rows.first().map_or(0, Vec::len), rows.len()];
        if counts.iter().any(|&count| count < 2) {
            return Err(format!("it has {} x {} heights, and two are needed each way", counts[0], counts[1]));
        }
        if counts[0].saturating_mul(counts[1]) > MOST_NODES {
            return Err(format!(
                "it has {} x {} heights; at most {MOST_NODES} are taken",
                counts[0], counts[1]
            ));
        }
        if let Some(row) = rows.iter().position(|row| row.len() != counts[0]) {
            return Err(format!("row {} has {} heights and not {}", row + 1, rows[row].len(), counts[0]));
        }
        let heights: Vec<f64> = rows.iter().rev().flatten().copied().collect();
        if !heights.iter().all(|h| h.abs() < 1e100) {
            return Err("a height is not a finite number of a sensible size".into());
        }
        let size = high - low;
        if !(size.cmpgt(DVec2::ZERO).all() && size.is_finite()) {
            return Err("the second corner of its rectangle must be above the first in x and in y".into());
        }
        let spacing = size / DVec2::new((counts[0] - 1) as f64, (counts[1] - 1) as f64);
        let mut hasher = blake3::Hasher::new();
        for number in [low.x, low.y, high.x, high.y].iter().chain(&heights) {
            hasher.update(&number.to_bits().to_le_bytes());
        }
        hasher.update(&(counts[0] as u64).to_le_bytes());
        let at = |i: usize, j: usize| heights[j * counts[0] + i];
        let mut steps = DVec2::ZERO;
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                if i > 0 {
                    steps.x = steps.x.max((at(i, j) - at(i - 1, j)).abs());
                }
                if j > 0 {
                    steps.y = steps.y.max((at(i, j) - at(i, j - 1)).abs());
                }
            }
        }
        let levels = Level::all(counts, &heights);
        let largest = heights.iter().fold(0.0, |largest: f64, h| largest.max(h.abs()));
        let steepest = steps / spacing * (1.0 + 1e-12);
        Ok(Self { counts, heights, corner: low, spacing, steepest, levels, largest, hash: hasher.finalize() })
    }

    /// A place in units of the grid along an axis: the cell, and the part of it.
    fn cell(&self, axis: usize, coordinate: f64) -> (usize, f64) {
        let last = self.counts[axis] - 1;
        let place = ((coordinate - self.corner[axis]) / self.spacing[axis]).clamp(0.0, last as f64);
        let cell = (place as usize).min(last - 1);
        (cell, place - cell as f64)
    }

    /// What rounding may add to the part of a cell at which a place lies.
    fn blur(&self, axis: usize) -> f64 {
        ROUNDING * self.counts[axis] as f64
    }

    /// Whether a place lies beyond the map along an axis.
    fn is_beyond(&self, axis: usize, coordinate: f64) -> bool {
        let place = (coordinate - self.corner[axis]) / self.spacing[axis];
        !(0.0..=(self.counts[axis] - 1) as f64).contains(&place)
    }

    /// The heights at the corners of a cell.
    fn corners(&self, [i, j]: [usize; 2]) -> [f64; 4] {
        let node = |i: usize, j: usize| self.heights[j * self.counts[0] + i];
        [node(i, j), node(i + 1, j), node(i, j + 1), node(i + 1, j + 1)]
    }

    /// The cells between two places, if they are few, each with the parts of it along x and along y that lie
    /// between them.
    fn few_cells(
        &self,
        low: DVec2,
        high: DVec2,
        most: usize,
    ) -> Option<impl Iterator<Item = ([usize; 2], [[f64; 2]; 2])>> {
        let [begin, end] = [low, high].map(|p| [0, 1].map(|axis: usize| self.cell(axis, p[axis])));
        let across = [0, 1].map(|axis: usize| (end[axis].0 + 1).saturating_sub(begin[axis].0));
        let is_few = (1..=most).contains(&across[0].saturating_mul(across[1]));
        let part = move |axis: usize, cell: usize| {
            let from = if cell == begin[axis].0 { begin[axis].1 } else { 0.0 };
            [from, if cell == end[axis].0 { end[axis].1 } else { 1.0 }]
        };
        is_few.then(|| {
            (begin[1].0..=end[1].0)
                .flat_map(move |j| (begin[0].0..=end[0].0).map(move |i| ([i, j], [part(0, i), part(1, j)])))
        })
    }

    /// What the slope along an axis may be between two places that few cells hold. In a cell it is linear
    /// across the axis.
    fn slopes_along(&self, axis: usize, low: DVec2, high: DVec2) -> Option<Interval> {
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for (cell, parts) in self.few_cells(low, high, MOST_CELLS)? {
            let [a, b, c, d] = self.corners(cell);
            let [first, second] = if axis == 0 { [b - a, d - c] } else { [c - a, d - b] };
            for part in parts[1 - axis] {
                let slope = (first * (1.0 - part) + second * part) / self.spacing[axis];
                (least, greatest) = (least.min(slope), greatest.max(slope));
            }
        }
        let slack = (1e-12 + self.blur(1 - axis)) * self.steepest[axis];
        Some(Interval { lo: least - slack, hi: greatest + slack })
    }

    /// The least and the greatest height between two places, but for rounding.
    fn between(&self, low: DVec2, high: DVec2) -> (f64, f64) {
        if let Some(cells) = self.few_cells(low, high, FEW_CELLS) {
            // in a part of a cell heights are bilinear, so they are extreme at its corners
            let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
            for (cell, [along_x, along_y]) in cells {
                let corners = self.corners(cell);
                for (u, v) in along_x.into_iter().flat_map(|u| along_y.map(|v| (u, v))) {
                    let height = bilinear(corners, u, v);
                    (least, greatest) = (least.min(height), greatest.max(height));
                }
            }
            return (least, greatest);
        }
        let first = [0, 1].map(|axis| self.cell(axis, low[axis]).0);
        let last = [0, 1].map(|axis| self.cell(axis, high[axis]).0 + 1);
        // so many that at most three blocks lie side by side
        let side = (last[0] - first[0]).max(last[1] - first[1]);
        let level = (usize::BITS - (side / 2).leading_zeros()).min(self.levels.len() as u32 - 1);
        let Level { counts, ranges } = &self.levels[level as usize];
        let (mut least, mut greatest) = (f64::INFINITY, f64::NEG_INFINITY);
        for j in first[1] >> level..=last[1] >> level {
            for i in first[0] >> level..=last[0] >> level {
                let (lo, hi) = ranges[j * counts[0] + i];
                (least, greatest) = (least.min(lo), greatest.max(hi));
            }
        }
        (least, greatest)
    }
}

/// The height in a cell, at parts of it along x and y, from those at its corners. The weights of one sum: it
/// is never beyond those of the corners by more than rounding.
fn bilinear([a, b, c, d]: [f64; 4], u: f64, v: f64) -> f64 {
    let (low, high) = (a * (1.0 - u) + b * u, c * (1.0 - u) + d * u);
    low * (1.0 - v) + high * v
}

impl Level {
    fn all(counts: [usize; 2], heights: &[f64]) -> Vec<Self> {
        let mut levels = vec![Self { counts, ranges: heights.iter().map(|&h| (h, h)).collect() }];
        loop {
            let below = &levels[levels.len() - 1];
            if below.counts == [1, 1] {
                return levels;
            }
            let counts = below.counts.map(|count| count.div_ceil(2));
            let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); counts[0] * counts[1]];
            for (n, &(lo, hi)) in below.ranges.iter().enumerate() {
                let (i, j) = (n % below.counts[0], n / below.counts[0]);
                let range = &mut ranges[j / 2 * counts[0] + i / 2];
                *range = (range.0.min(lo), range.1.max(hi));
            }
            levels.push(Self { counts, ranges });
        }
    }
}

impl Table for HeightMap {
    fn at(&self, p: DVec3) -> Sample {
        if !p.is_finite() {
            return Sample::NAN;
        }
        let ((i, u), (j, v)) = (self.cell(0, p.x), self.cell(1, p.y));
        let corners = self.corners([i, j]);
        let [a, b, c, d] = corners;
        let height = bilinear(corners, u, v);
        let slope = |axis: usize, rise: f64| {
            if self.is_beyond(axis, p[axis]) { 0.0 } else { rise / self.spacing[axis] }
        };
        let along_x = slope(0, (b - a) * (1.0 - v) + (d - c) * v);
        let along_y = slope(1, (c - a) * (1.0 - u) + (d - b) * u);
        Sample { value: height - p.z, gradient: DVec3::new(along_x, along_y, -1.0) }
    }

    fn range(&self, over: &Aabb) -> Interval {
        let (least, greatest) = self.between(over.min.truncate(), over.max.truncate());
        let by_place: f64 =
            [0, 1].map(|axis| self.blur(axis) * self.steepest[axis] * self.spacing[axis]).iter().sum();
        let slack = |z: f64| if z.is_finite() { ROUNDING * (self.largest + z.abs()) + by_place } else { 0.0 };
        Interval { lo: least - over.max.z - slack(over.max.z), hi: greatest - over.min.z + slack(over.min.z) }
    }

    fn slopes(&self, over: &Aabb) -> [Interval; 3] {
        let along = |axis: usize| {
            let steepest = self.steepest[axis];
            let found = self.slopes_along(axis, over.min.truncate(), over.max.truncate());
            let found = found.unwrap_or(Interval { lo: -steepest, hi: steepest });
            let is_beyond = [over.min, over.max].into_iter().any(|p| self.is_beyond(axis, p[axis]));
            if is_beyond { found.hull(Interval::point(0.0)) } else { found }
        };
        [along(0), along(1), Interval { lo: -1.0, hi: -1.0 }]
    }

    fn reach(&self, least: f64) -> Aabb {
        let everywhere = Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY);
        if !least.is_finite() {
            return everywhere;
        }
        let highest = self.levels[self.levels.len() - 1].ranges[0].1;
        let top = highest - least + ROUNDING * (self.largest + least.abs());
        Aabb { max: everywhere.max.with_z(top), ..everywhere }
    }

    fn what(&self) -> &'static str {
        "a height map"
    }

    fn fingerprint(&self) -> String {
        self.hash.to_hex()[..16].to_string()
    }
}

impl fmt::Debug for HeightMap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "HeightMap({} x {}, {})", self.counts[0], self.counts[1], self.fingerprint())
    }
}

/// The rows of a grey picture, from 0 for black to 1 for white.
///
/// # Errors
/// Why it is no such picture.
pub fn rows_of_png(bytes: &[u8]) -> Result<Vec<Vec<f64>>, String> {
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|error| error.to_string())?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    if width.saturating_mul(height) > MOST_NODES {
        return Err(format!("it has {width} x {height} pixels; at most {MOST_NODES} are taken"));
    }
    let (colour, depth) = reader.output_color_type();
    if colour != png::ColorType::Grayscale {
        return Err("a map of heights is a grey picture without transparency".into());
    }
    let size = reader.output_buffer_size().ok_or("it is too large")?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).map_err(|error| error.to_string())?;
    let value = |at: usize, row: &[u8]| match depth {
        png::BitDepth::Sixteen => f64::from(u16::from_be_bytes([row[2 * at], row[2 * at + 1]])) / 65535.0,
        png::BitDepth::One | png::BitDepth::Two | png::BitDepth::Four | png::BitDepth::Eight => {
            f64::from(row[at]) / 255.0
        }
    };
    let rows = pixels.chunks_exact(frame.line_size).take(height);
    Ok(rows.map(|row| (0..width).map(|i| value(i, row)).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn random(counts: [usize; 2], random: &mut Random) -> HeightMap {
        let rows: Vec<Vec<f64>> =
            (0..counts[1]).map(|_| (0..counts[0]).map(|_| random.unit()).collect()).collect();
        HeightMap::new(&rows, DVec2::new(-1.0, 2.0), DVec2::new(3.0, 4.0)).unwrap()
    }

    #[test]
    fn a_plane_is_a_plane_and_goes_on_flat() {
        let rows: Vec<Vec<f64>> =
            (0..5).map(|j| (0..9).map(|i| 0.5 * f64::from(i) + f64::from(4 - j)).collect()).collect();
        let map = HeightMap::new(&rows, DVec2::ZERO, DVec2::new(8.0, 4.0)).unwrap();
        for (x, y) in [(0.0, 0.0), (8.0, 4.0), (3.3, 2.1), (7.9, 0.4)] {
            let Sample { value, gradient } = map.at(DVec3::new(x, y, 0.25));
            assert!((value - (0.5 * x + y - 0.25)).abs() < 1e-14, "{x} {y} {value}");
            assert!((gradient - DVec3::new(0.5, 1.0, -1.0)).length() < 1e-12);
        }
        let beyond = map.at(DVec3::new(10.0, 1.0, 0.0));
        assert_eq!((beyond.value, beyond.gradient.x), (5.0, 0.0));
    }

    #[test]
    fn values_are_within_their_ranges_and_gradients_are_differences() {
        let mut numbers = Random(3);
        for counts in [[2, 2], [7, 5], [33, 64], [3, 100]] {
            let map = random(counts, &mut numbers);
            let mut place = |scale: f64| {
                DVec3::new(6.0 * numbers.unit() - 2.0, 4.0 * numbers.unit() + 1.0, 2.0 * numbers.unit() - 0.5)
                    * scale
            };
            for _ in 0..2000 {
                let (a, b) = (place(1.0), place(0.2));
                let over = Aabb::new(a.min(a + b), a.max(a + b));
                let (range, middle) = (map.range(&over), map.at(over.centre()));
                for p in over.corners().into_iter().chain([over.centre()]) {
                    let value = map.at(p).value;
                    assert!(range.contains(value), "{counts:?}: {value} not in {range:?}");
                    assert!(map.reach(value).contains(p));
                }
                let slopes = map.slopes(&over);
                assert!((0..3).all(|i| slopes[i].contains(middle.gradient[i])), "{middle:?} {slopes:?}");
                // a small box has narrow ranges, however coarse the map is
                let small = Aabb::new(a, a + 1e-6);
                assert!(map.range(&small).width() < 1e-3 && map.range(&small).contains(map.at(a).value));
                if small.min.x > -1.0 && small.max.x < 3.0 && small.min.y > 2.0 && small.max.y < 4.0 {
                    let slopes = map.slopes(&small);
                    assert!(slopes.iter().all(|slope| slope.width() < 1e-2), "{slopes:?}");
                }
            }
            let all = map.range(&Aabb::new(DVec3::NEG_INFINITY, DVec3::INFINITY));
            assert_eq!((all.lo, all.hi), (f64::NEG_INFINITY, f64::INFINITY));
        }
    }

    #[test]
    fn pictures_are_rows() {
        for depth in [png::BitDepth::Eight, png::BitDepth::Sixteen] {
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, 3, 2);
            encoder.set_color(png::ColorType::Grayscale);
            encoder.set_depth(depth);
            let data: Vec<u8> = match depth {
                png::BitDepth::Sixteen => vec![0, 0, 51, 51, 255, 255, 255, 255, 0, 0, 0, 0],
                _ => vec![0, 51, 255, 255, 0, 0],
            };
            encoder.write_header().unwrap().write_image_data(&data).unwrap();
            assert_eq!(rows_of_png(&bytes).unwrap(), [[0.0, 0.2, 1.0], [1.0, 0.0, 0.0]]);
        }
        assert!(rows_of_png(b"no picture").is_err());
    }

    #[test]
    fn maps_that_are_none_are_refused() {
        let map = |rows: &[&[f64]], high: DVec2| {
            let rows: Vec<Vec<f64>> = rows.iter().map(|row| row.to_vec()).collect();
            HeightMap::new(&rows, DVec2::ZERO, high).map(|_| ()).unwrap_err()
        };
        assert!(map(&[&[1.0, 2.0]], DVec2::ONE).contains("two are needed"));
        assert!(map(&[&[1.0, 2.0], &[1.0]], DVec2::ONE).contains("row 2"));
        assert!(map(&[&[1.0, 2.0], &[1.0, f64::NAN]], DVec2::ONE).contains("finite"));
        assert!(map(&[&[1.0, 2.0], &[1.0, 2.0]], DVec2::X).contains("second corner"));
    }
}
