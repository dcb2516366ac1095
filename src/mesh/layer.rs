//! One plane of nodes: samples of ω and the inside bits, 64 nodes to a word; and rows of edges that the surface
//! crosses, numbered by counting bits.
//!
//! Extended indices: a ring of virtual nodes that count as outside surrounds the grid, so node i of the grid has
//! extended index i + 1 and a surface that leaves the grid is closed there without special cases.
//!
//! Invariant: a bit is set exactly where ω > 0, whether sampled or proven; padding bits are zero.

use glam::DVec3;

use super::{
    MeshError,
    prune::{BRICK, Brick, Bricks},
};
use crate::field::{Field, Points};

/// The extended grid as rows of words.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Extended nodes on each axis.
    pub nodes: [usize; 3],
    /// Words in a row of bits along x.
    pub words: usize,
}

impl Shape {
    pub(super) fn new(cells: [usize; 3]) -> Self {
        let nodes = cells.map(|n| n + 3);
        Self { nodes, words: nodes[0].div_ceil(64) }
    }
}

/// Samples and inside bits of a plane z = constant.
#[derive(Debug, Clone)]
pub(super) struct Layer {
    shape: Shape,
    /// Extended rows of words.
    inside: Vec<u64>,
    /// ω at the grid's own nodes; stale where a brick's sign is proven.
    omega: Vec<f64>,
}

/// Scratch for one row of points.
pub(super) struct RowPoints {
    y: Vec<f64>,
    z: Vec<f64>,
    runs: Vec<Run>,
}

impl RowPoints {
    pub(super) fn new(shape: Shape) -> Self {
        Self { y: vec![0.0; shape.nodes[0]], z: vec![0.0; shape.nodes[0]], runs: Vec::new() }
    }
}

impl Layer {
    pub(super) fn outside(shape: Shape) -> Self {
        let samples = (shape.nodes[0] - 2) * (shape.nodes[1] - 2);
        Self { shape, inside: vec![0; shape.words * shape.nodes[1]], omega: vec![0.0; samples] }
    }

    /// Makes this the virtual plane beyond the border.
    pub(super) fn clear(&mut self) {
        self.inside.fill(0);
    }

    /// Samples the grid's plane `plane` where `bricks` do not tell the sign; returns the number of samples.
    ///
    /// # Errors
    /// [`MeshError::NotANumber`] at the first NaN.
    pub(super) fn sample(
        &mut self,
        field: &dyn Field,
        nodes: &[Vec<f64>; 3],
        plane: usize,
        bricks: &Bricks,
        scratch: &mut RowPoints,
    ) -> Result<u64, MeshError> {
        self.inside.fill(0);
        scratch.z.fill(nodes[2][plane]);
        let width = nodes[0].len();
        let mut samples = 0;
        for row in 0..nodes[1].len() {
            scratch.y.fill(nodes[1][row]);
            let inside = &mut self.inside[(row + 1) * self.shape.words..][..self.shape.words];
            let omega = &mut self.omega[row * width..][..width];
            find_runs(bricks, plane, row, width, &mut scratch.runs);
            for run in &scratch.runs {
                match run.sign {
                    Some(true) => run.nodes.clone().for_each(|i| inside[(i + 1) / 64] |= 1 << ((i + 1) % 64)),
                    Some(false) => {}
                    None => {
                        let (x, part) = (&nodes[0][run.nodes.clone()], &mut omega[run.nodes.clone()]);
                        let count = part.len();
                        samples += count as u64;
                        field.omega_many(Points::new(x, &scratch.y[..count], &scratch.z[..count]), part);
                        set_bits(inside, run.nodes.start + 1, part).map_err(|i| MeshError::NotANumber {
                            at: DVec3::new(x[i], nodes[1][row], nodes[2][plane]),
                        })?;
                    }
                }
            }
        }
        Ok(samples)
    }

    /// Inside bits of an extended row.
    pub(super) fn row(&self, row: usize) -> &[u64] {
        &self.inside[row * self.shape.words..][..self.shape.words]
    }

    /// ω at an extended node; the ring counts as −∞.
    pub(super) fn omega(&self, column: usize, row: usize) -> f64 {
        let (width, height) = (self.shape.nodes[0] - 2, self.shape.nodes[1] - 2);
        let (i, j) = (column.wrapping_sub(1), row.wrapping_sub(1));
        if i < width && j < height { self.omega[j * width + i] } else { f64::NEG_INFINITY }
    }
}

/// Neighbouring nodes of a row that are treated alike.
#[derive(Debug, Clone)]
pub(super) struct Run {
    nodes: std::ops::Range<usize>,
    /// True if proven inside, false if proven outside, none if samples must tell.
    sign: Option<bool>,
}

/// Cuts a row of nodes by the bricks that touch it. A node is sampled if any brick it touches is near the
/// surface, also on the brick's far border, so that both ends of every crossed edge have samples.
fn find_runs(bricks: &Bricks, plane: usize, row: usize, width: usize, found: &mut Vec<Run>) {
    found.clear();
    for brick in 0..bricks.per_row() {
        let touching = bricks.touching(brick, row, plane);
        let sign = match touching {
            Brick::Near => None,
            Brick::Solid => Some(true),
            Brick::Fluid => Some(false),
        };
        let end = ((brick + 1) * BRICK).min(width - 1) + 1;
        match found.last_mut() {
            Some(last) if last.sign == sign => last.nodes.end = end,
            // The shared node belongs to whichever side samples it.
            Some(last) if sign.is_none() => {
                last.nodes.end -= 1;
                let start = last.nodes.end;
                found.push(Run { nodes: start..end, sign });
            }
            Some(last) => {
                let start = last.nodes.end;
                found.push(Run { nodes: start..end, sign });
            }
            None => found.push(Run { nodes: 0..end, sign }),
        }
    }
}

/// Sets the bits from `first` on where ω > 0; `Err` holds the index of the first NaN.
fn set_bits(inside: &mut [u64], first: usize, omega: &[f64]) -> Result<(), usize> {
    let mut done = 0;
    while done < omega.len() {
        let (word, bit) = ((first + done) / 64, (first + done) % 64);
        let part = &omega[done..(done + 64 - bit).min(omega.len())];
        let mut bits = 0_u64;
        for (i, &w) in part.iter().enumerate() {
            bits |= u64::from(w > 0.0) << i;
        }
        inside[word] |= bits << bit;
        done += part.len();
    }
    // A pass of its own without a way out in the middle becomes vector code.
    let any_nan = omega.iter().fold(false, |any, w| any | w.is_nan());
    if any_nan { Err(omega.iter().position(|w| w.is_nan()).unwrap_or(0)) } else { Ok(()) }
}

/// Rows of edges along one axis: which of them the surface crosses, and their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct EdgeRows {
    words: usize,
    crossed: Vec<u64>,
    /// Number of the first crossed edge of each word.
    before: Vec<u32>,
}

impl EdgeRows {
    /// Edges along x of a layer, numbered from `next` on.
    pub(super) fn along_x(&mut self, shape: Shape, layer: &Layer, next: &mut u32) {
        self.rebuild(shape, next, |row, word| {
            let bits = layer.row(row);
            bits[word] ^ shifted(bits, word)
        });
    }

    /// Edges along y of a layer; the last row has none.
    pub(super) fn along_y(&mut self, shape: Shape, layer: &Layer, next: &mut u32) {
        let last = shape.nodes[1] - 1;
        self.rebuild(shape, next, |row, word| {
            if row < last { layer.row(row)[word] ^ layer.row(row + 1)[word] } else { 0 }
        });
    }

    /// Edges along z between two layers.
    pub(super) fn along_z(&mut self, shape: Shape, lower: &Layer, upper: &Layer, next: &mut u32) {
        self.rebuild(shape, next, |row, word| lower.row(row)[word] ^ upper.row(row)[word]);
    }

    /// Number of a crossed edge.
    pub(super) fn number(&self, column: usize, row: usize) -> u32 {
        let at = row * self.words + column / 64;
        let below = self.crossed[at] & ((1 << (column % 64)) - 1);
        self.before[at] + below.count_ones()
    }

    /// Calls `visit(column, row)` for each crossed edge in the order of numbers.
    pub(super) fn for_each(&self, mut visit: impl FnMut(usize, usize)) {
        for (at, &word) in self.crossed.iter().enumerate() {
            for bit in set_positions(word) {
                visit(at % self.words * 64 + bit, at / self.words);
            }
        }
    }

    fn rebuild(&mut self, shape: Shape, next: &mut u32, crossed: impl Fn(usize, usize) -> u64) {
        self.words = shape.words;
        self.crossed.clear();
        self.before.clear();
        for row in 0..shape.nodes[1] {
            for word in 0..shape.words {
                let bits = crossed(row, word);
                self.crossed.push(bits);
                self.before.push(*next);
                *next += bits.count_ones();
            }
        }
    }
}

/// The word of a row shifted by one node, so that bit i tells of node i + 1.
pub(super) fn shifted(row: &[u64], word: usize) -> u64 {
    row[word] >> 1 | row.get(word + 1).map_or(0, |next| next << 63)
}

/// Positions of the set bits, ascending.
pub(super) fn set_positions(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (word != 0).then(|| word.trailing_zeros() as usize)?;
        word &= word - 1;
        Some(bit)
    })
}
