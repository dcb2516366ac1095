//! What a cell of the lattice adds to the nodes around it.
//!
//! The values of a map are a cubic B-spline, c ↦ Σ c_k B(x − k). If c = f − Δ²f/6 along each axis, with the second
//! difference Δ², the spline is f up to the fourth order. Since f is a sum over cells, the differences are taken of
//! what each cell adds.

use glam::DVec3;

use super::{CELLS, Lattice};

/// Nodes from a cell to the farthest that it adds to, on each side: its support, a cell for its own width, and one for
/// the differences.
pub(super) const REACH: usize = CELLS + 2;

/// Offsets of nodes along an axis.
const SIDE: usize = 2 * REACH;

/// What a cell adds to λ and K of a node.
#[derive(Clone, Copy, Default)]
pub(super) struct Weight {
    /// λ, then K: xx, yy, zz, yz, zx, xy.
    pub sums: [f32; 8],
    /// The derivative of λ by the place of what fills the cell, 1/m.
    pub slope: [f32; 4],
}

/// Weights by the offset of the node, and which of them are not zero.
pub(super) struct Stencil {
    pub weights: Vec<(Offset, Weight)>,
}

/// Indices of a cell less those of a node, plus [`REACH`].
pub(super) type Offset = [u8; 3];

impl Stencil {
    /// The weights for a kernel Wendland C2 of this support radius, m.
    pub fn new(lattice: &Lattice, h: f64) -> Self {
        let mut raw = vec![[0.0; 10]; SIDE * SIDE * SIDE];
        for (at, sums) in raw.iter_mut().enumerate() {
            let offset = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE];
            let from = DVec3::from_array(offset.map(|n| n as f64 + 0.5 - REACH as f64)) * lattice.step;
            *sums = averaged(from, lattice.step, h);
        }
        for stride in [1, SIDE, SIDE * SIDE] {
            sharpen(&mut raw, stride);
        }
        let most =
            raw.iter().fold([0.0f64; 10], |most, sums| std::array::from_fn(|k| most[k].max(sums[k].abs())));
        let weights = raw.iter().enumerate().filter(|(_, sums)| {
            // what single precision keeps of a sum
            (0..7).any(|k| sums[k].abs() > 1e-9 * most[k])
        });
        let weights = weights.map(|(at, sums)| {
            let offset = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE].map(|n| n as u8);
            let mut weight = Weight::default();
            for (weight, sum) in weight.sums.iter_mut().zip(&sums[..7]) {
                *weight = *sum as f32;
            }
            for (weight, sum) in weight.slope.iter_mut().zip(&sums[7..]) {
                *weight = *sum as f32;
            }
            (offset, weight)
        });
        Self { weights: weights.collect() }
    }
}

/// Takes a sixth of the second differences along an axis. Beyond the ends there is nothing.
fn sharpen(raw: &mut [[f64; 10]], stride: usize) {
    let before = raw.to_vec();
    for at in 0..raw.len() {
        let n = at / stride % SIDE;
        for k in 0..10 {
            let low = if n > 0 { before[at - stride][k] } else { 0.0 };
            let high = if n + 1 < SIDE { before[at + stride][k] } else { 0.0 };
            raw[at][k] -= (low - 2.0 * before[at][k] + high) / 6.0;
        }
    }
}

/// The integrals of W, of y ⊗ ∇W (as in [`super::Taken`]) and of the derivative of W over a cell whose middle lies at
/// `from` the node, by Gauss' rule with three points along each axis.
fn averaged(from: DVec3, step: DVec3, h: f64) -> [f64; 10] {
    const POINTS: [(f64, f64); 3] =
        [(-0.387_298_334_620_741_7, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.387_298_334_620_741_7, 5.0 / 18.0)];
    let mut sums = [0.0; 10];
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
    }
    sums
}
