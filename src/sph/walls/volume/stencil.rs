//! What a cell of the lattice adds to the nodes around it.
//!
//! The values of a map are a cubic B-spline, c ↦ Σ c_k B(x − k). With c = f − Δ²f/6 + Δ⁴f/36 along each axis, where Δ² is
//! the second difference, it has the values f at the nodes but for Δ⁶f/216. Since f is a sum over cells, the differences
//! are taken of what each cell adds.

use glam::DVec3;

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

/// What a cell adds to λ and K of a node.
struct Weight {
    /// λ, then K: xx, yy, zz, yz, zx, xy.
    sums: [f32; 8],
    /// The derivative of λ by the place of what fills the cell, 1/m.
    slope: [f32; 4],
    /// Half of its second derivatives, 1/m², twice for those beside the diagonal: xx, yy, zz, yz, zx, xy.
    bend: [f32; 8],
}

impl Weight {
    fn of(terms: &[f64; TERMS]) -> Self {
        let from = |first: usize| move |k: usize| terms.get(first + k).map_or(0.0, |term| *term as f32);
        Self {
            sums: single(terms),
            slope: [terms[7] as f32, terms[8] as f32, terms[9] as f32, 0.0],
            bend: std::array::from_fn(from(10)),
        }
    }

    /// Adds what a cell adds.
    #[inline]
    fn add(&self, filled: &Filled, sums: &mut [f32; 8]) {
        for (sum, weight) in sums.iter_mut().zip(&self.sums) {
            *sum += filled.part * weight;
        }
        let [x, y, z] = filled.moment;
        let bends = filled.square.iter().zip(&self.bend).map(|(square, bend)| square * bend);
        sums[0] += x * self.slope[0] + y * self.slope[1] + z * self.slope[2] + bends.sum::<f32>();
    }
}

/// The weights of all cells around a node, by the index of the cell less that of the node plus [`REACH`].
pub(super) struct Stencil {
    /// x runs first.
    weights: Vec<Weight>,
    /// The weights of each row along x, summed up from its beginning: one more than it has cells.
    sums: Vec<[f32; 8]>,
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
        for row in raw.chunks(SIDE) {
            let mut sum = [0.0; 7];
            for terms in row {
                sums.push(single(&sum));
                for (sum, term) in sum.iter_mut().zip(terms) {
                    *sum += term;
                }
            }
            sums.push(single(&sum));
        }
        Self { weights: raw.iter().map(Weight::of).collect(), sums }
    }

    /// Adds to `sums` what a row of cells adds to a node. `row` is the place of the row beside the node, `from` the first of
    /// its cells that the node sees.
    #[inline]
    pub fn add(&self, [b, c]: [usize; 2], from: usize, row: &Row, sums: &mut [f32; 8]) {
        let line = b + SIDE * c;
        let (low, high) = row.whole;
        let (low, high) = (low.clamp(from, from + SIDE) - from, high.clamp(from, from + SIDE) - from);
        if low < high {
            let summed = &self.sums[line * (SIDE + 1)..][..=SIDE];
            for ((sum, high), low) in sums.iter_mut().zip(&summed[high]).zip(&summed[low]) {
                *sum += high - low;
            }
        }
        let weights = &self.weights[line * SIDE..][..SIDE];
        for (at, filled) in &row.others {
            if let Some(weight) = at.checked_sub(from).and_then(|at| weights.get(at)) {
                weight.add(filled, sums);
            }
        }
    }
}

/// A row of cells along x.
#[derive(Default)]
pub(super) struct Row {
    /// A stretch of cells that are filled, from the first to the one behind the last.
    pub whole: (usize, usize),
    /// The other cells that are not empty.
    pub others: Vec<(usize, Filled)>,
}

impl Row {
    /// Adds a cell behind those that the row has.
    pub fn push(&mut self, at: usize, filled: Filled) {
        let (low, high) = self.whole;
        match filled {
            Filled::WHOLE if low == high => self.whole = (at, at + 1),
            Filled::WHOLE if high == at => self.whole = (low, at + 1),
            filled if filled == Filled::default() => {}
            filled => self.others.push((at, filled)),
        }
    }
}

/// The first seven numbers in single precision.
fn single(terms: &[f64]) -> [f32; 8] {
    std::array::from_fn(|k| if k < 7 { terms[k] as f32 } else { 0.0 })
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

/// The integrals of W, of y ⊗ ∇W (as in [`super::map::Taken`]) and of the derivatives of W over a cell whose middle lies at
/// `from` the node, by Gauss' rule with three points along each axis.
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
