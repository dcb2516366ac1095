//! What a cell of the lattice adds to the nodes around it.
//!
//! The values of a map are a cubic B-spline, c ↦ Σ c_k B(x − k). With c = f − Δ²f/6 + Δ⁴f/36 along each axis,
//! where Δ² is the second difference, it has the values f at the nodes, up to Δ⁶f/216. Since f is a sum over
//! cells, the differences are taken of what each cell adds.

use std::ops::Range;

use glam::{DVec3, Vec4};

use super::{
    fractions::Filled,
    lattice::{CELLS, Lattice},
};

/// Cells from a node to the farthest that adds to it, on each side: its support, a cell for its own width, and two for
/// the differences.
pub(super) const REACH: usize = CELLS + 3;

/// Numbers of a weight: λ, K, the first and the second derivatives of λ.
const TERMS: usize = 16;

/// Cells along an axis that a node sees.
pub(super) const SIDE: usize = 2 * REACH;

/// Numbers that are added in one go.
type Lanes = [Vec4; 2];

/// What a cell adds to λ and K of a node.
struct Weight {
    /// λ, then K: xx, yy, zz, yz, zx, xy; last the derivative of λ by the z of what fills the cell, 1/m.
    sums: Lanes,
    /// Half of the second derivatives of λ by that place, 1/m², twice for those beside the diagonal: xx, yy,
    /// zz, yz, zx, xy; then its derivatives by x and y, 1/m.
    bends: Lanes,
}

impl Weight {
    fn of(terms: &[f64; TERMS]) -> Self {
        Self {
            sums: lanes([0, 1, 2, 3, 4, 5, 6, 9].map(|k| terms[k] as f32)),
            bends: lanes([10, 11, 12, 13, 14, 15, 7, 8].map(|k| terms[k] as f32)),
        }
    }
}

/// What cells add to a node, in the order of [`Weight`].
#[derive(Clone, Copy, Default)]
pub(super) struct Added {
    sums: Lanes,
    bends: Lanes,
}

impl Added {
    /// λ and K: xx, yy, zz, yz, zx, xy.
    pub fn total(&self) -> [f32; 7] {
        let [first, second] = self.sums;
        let bent = (self.bends[0] + self.bends[1]).element_sum();
        let [yz, zx, xy, slope] = second.to_array();
        let [part, xx, yy, zz] = first.to_array();
        [part + slope + bent, xx, yy, zz, yz, zx, xy]
    }
}

/// The weights of all cells around a node, by the index of the cell less that of the node plus [`REACH`].
pub(super) struct Stencil {
    /// x runs first.
    weights: Vec<Weight>,
    /// The weights of each row along x, summed up from its beginning: one more than it has cells.
    sums: Vec<Lanes>,
    /// The rows that add anything.
    lines: Vec<Line>,
}

/// A row of weights along x.
pub(super) struct Line {
    /// Its indices along y and z.
    pub at: [usize; 2],
    /// The weights that are not zero.
    span: Range<usize>,
}

impl Stencil {
    /// The weights for a kernel Wendland C2 of this support radius, m.
    pub fn new(lattice: &Lattice, h: f64) -> Self {
        let mut raw = vec![[0.0; TERMS]; SIDE * SIDE * SIDE];
        for (at, terms) in raw.iter_mut().enumerate() {
            let offset = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE];
            let from = DVec3::from_array(offset.map(|n| n as f64 + 0.5 - REACH as f64)) * lattice.step;
            *terms = averaged(from, lattice.step, h);
        }
        for stride in [1, SIDE, SIDE * SIDE] {
            sharpen(&mut raw, stride);
        }
        let mut sums = Vec::with_capacity(SIDE * SIDE * (SIDE + 1));
        let mut lines = Vec::new();
        for (line, row) in raw.chunks(SIDE).enumerate() {
            let mut sum = [0.0; 7];
            let single =
                |sum: &[f64; 7]| lanes(std::array::from_fn(|k| sum.get(k).map_or(0.0, |sum| *sum as f32)));
            for terms in row {
                sums.push(single(&sum));
                for (sum, term) in sum.iter_mut().zip(terms) {
                    *sum += term;
                }
            }
            sums.push(single(&sum));
            let adds = |terms: &[f64; TERMS]| terms.iter().any(|term| *term != 0.0);
            if let (Some(first), Some(last)) = (row.iter().position(adds), row.iter().rposition(adds)) {
                lines.push(Line { at: [line % SIDE, line / SIDE], span: first..last + 1 });
            }
        }
        Self { weights: raw.iter().map(Weight::of).collect(), sums, lines }
    }

    /// The rows of weights that add anything.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Adds what a row of cells adds to nodes one after another along x. The first node sees the cells from
    /// the first of the row on.
    #[inline]
    pub fn add(&self, line: &Line, row: &Row, nodes: &mut [Added]) {
        let at = line.at[0] + SIDE * line.at[1];
        let summed = &self.sums[at * (SIDE + 1)..][..=SIDE];
        let (low, high) = row.whole;
        if low < high {
            for (from, node) in nodes.iter_mut().enumerate() {
                let (low, high) = (low.clamp(from, from + SIDE) - from, high.clamp(from, from + SIDE) - from);
                let (low, high) = (&summed[low], &summed[high]);
                for half in 0..2 {
                    node.sums[half] += high[half] - low[half];
                }
            }
        }
        let weights = &self.weights[at * SIDE..][..SIDE];
        for (at, cell) in &row.others {
            for (from, node) in nodes.iter_mut().enumerate() {
                let Some(k) = at.checked_sub(from).filter(|k| line.span.contains(k)) else { continue };
                let weight = &weights[k];
                for half in 0..2 {
                    node.sums[half] += cell.sums[half] * weight.sums[half];
                    node.bends[half] += cell.bends[half] * weight.bends[half];
                }
            }
        }
    }
}

/// A cell that is filled in part, in the order of [`Weight`].
struct Cell {
    /// Its filled part seven times, and the z of what fills it.
    sums: Lanes,
    bends: Lanes,
}

impl Cell {
    fn of(filled: &Filled) -> Self {
        let Filled { part, moment: [x, y, z], square: [xx, yy, zz, yz, zx, xy] } = *filled;
        Self {
            sums: lanes([part, part, part, part, part, part, part, z]),
            bends: lanes([xx, yy, zz, yz, zx, xy, x, y]),
        }
    }
}

/// A row of cells along x.
#[derive(Default)]
pub(super) struct Row {
    /// A stretch of cells that are filled, from the first to the one behind the last.
    whole: (usize, usize),
    /// The other cells that are not empty.
    others: Vec<(usize, Cell)>,
}

impl Row {
    /// Adds a cell behind those that the row has.
    pub fn push(&mut self, at: usize, filled: Filled) {
        let (low, high) = self.whole;
        match filled {
            Filled::WHOLE if low == high => self.whole = (at, at + 1),
            Filled::WHOLE if high == at => self.whole = (low, at + 1),
            filled if filled == Filled::default() => {}
            filled => self.others.push((at, Cell::of(&filled))),
        }
    }

    /// Whether all of its cells are empty.
    pub fn is_empty(&self) -> bool {
        self.whole.0 == self.whole.1 && self.others.is_empty()
    }
}

fn lanes([a, b, c, d, e, f, g, h]: [f32; 8]) -> Lanes {
    [Vec4::new(a, b, c, d), Vec4::new(e, f, g, h)]
}

/// Takes f to f − Δ²f/6 + Δ⁴f/36 along an axis. Beyond the ends there is nothing.
fn sharpen(raw: &mut [[f64; TERMS]], stride: usize) {
    let differences = |of: &[[f64; TERMS]]| {
        let mut found = vec![[0.0; TERMS]; of.len()];
        for (at, found) in found.iter_mut().enumerate() {
            let n = at / stride % SIDE;
            for k in 0..TERMS {
                let low = if n > 0 { of[at - stride][k] } else { 0.0 };
                let high = if n + 1 < SIDE { of[at + stride][k] } else { 0.0 };
                found[k] = low - 2.0 * of[at][k] + high;
            }
        }
        found
    };
    let second = differences(raw);
    let fourth = differences(&second);
    for ((value, second), fourth) in raw.iter_mut().zip(&second).zip(&fourth) {
        for k in 0..TERMS {
            value[k] += fourth[k] / 36.0 - second[k] / 6.0;
        }
    }
}

/// The integrals of W, of y ⊗ ∇W (as in [`super::map::Taken`]) and of the derivatives of W over a cell whose
/// middle lies at `from` the node, by Gauss' rule with three points along each axis.
fn averaged(from: DVec3, step: DVec3, h: f64) -> [f64; TERMS] {
    const POINTS: [(f64, f64); 3] =
        [(-0.387_298_334_620_741_7, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.387_298_334_620_741_7, 5.0 / 18.0)];
    let mut sums = [0.0; TERMS];
    for ((x, u), (y, v), (z, w)) in
        POINTS.into_iter().flat_map(|x| POINTS.into_iter().flat_map(move |y| POINTS.map(|z| (x, y, z))))
    {
        let y = from + DVec3::new(x, y, z) * step;
        let q = y.length() / h;
        if q >= 1.0 {
            continue;
        }
        let volume = u * v * w * step.element_product();
        let factor = volume * 21.0 / (2.0 * std::f64::consts::PI * h.powi(3));
        // −W′/r
        let steep = factor * 20.0 * (1.0 - q).powi(3) / (h * h);
        let squares = [y.x * y.x, y.y * y.y, y.z * y.z, y.y * y.z, y.z * y.x, y.x * y.y];
        sums[0] += factor * (1.0 - q).powi(4) * (1.0 + 4.0 * q);
        for k in 0..6 {
            sums[1 + k] += steep * squares[k];
        }
        for k in 0..3 {
            sums[7 + k] -= steep * y[k];
        }
        // ∇∇W = y⊗y·60·(1 − q)²/(h³r) − 20·(1 − q)³/h²; its first factor is finite where y⊗y/r is
        let bent = factor * 60.0 * (1.0 - q).powi(2) / (h * h * h) / y.length().max(1e-9 * h);
        for k in 0..6 {
            let half = if k < 3 { 0.5 } else { 1.0 };
            sums[10 + k] += half * (bent * squares[k] - if k < 3 { steep } else { 0.0 });
        }
    }
    sums
}
